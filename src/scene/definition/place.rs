//! Places: where a condition or a load acts, and where a result is requested.

use std::fmt;
use std::sync::Arc;

use crate::geometry::{Part, Point, Side};

/// Whether a point belongs to a place.
type Within<const D: usize> = Arc<dyn Fn(&Point<D>) -> bool + Send + Sync>;

/// Where a condition or a load acts: a boundary part, some of it, a point, or the whole body.
///
/// Whatever names a part is a place: `Side::Min`, `(1, Side::Max)`, `"hole"`, a [`Part`].
///
/// ```
/// use rkpm::prelude::*;
/// // The middle third of the upper face of a block.
/// let patch = Place::on((1, Side::Max)).within(|x: &Point<2>| (x[0] - 1.5).abs() < 0.5);
/// let block = Scene::new(Block::new([0.0, 0.0], [3.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
///     .hold((1, Side::Min))
///     .pressure(patch, 0.1);
/// # let _ = block.discretize(&Scheme::default().particles([10, 4]))?;
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Clone)]
pub struct Place<const D: usize> {
    pub(crate) spot: Spot<D>,
    /// All of them have to hold.
    pub(crate) within: Vec<Within<D>>,
    /// The body, where there are several.
    pub(crate) of: Option<String>,
}

/// The kinds of places.
#[derive(Clone, PartialEq)]
pub(crate) enum Spot<const D: usize> {
    Part(Part),
    Point(Point<D>),
    Body,
}

impl<const D: usize> Place<D> {
    /// A boundary part.
    pub fn on(part: impl Into<Part>) -> Self {
        Place { spot: Spot::Part(part.into()), within: Vec::new(), of: None }
    }

    /// A point of the body \[length\]; conditions act on the particle that lies there.
    pub fn at(point: impl Into<Point<D>>) -> Self {
        Place { spot: Spot::Point(point.into()), within: Vec::new(), of: None }
    }

    /// The whole body, for body forces and elastic foundations.
    pub fn body() -> Self {
        Place { spot: Spot::Body, within: Vec::new(), of: None }
    }

    /// The place on one of several bodies: faces of a lattice are as many as there are bodies.
    pub fn of(mut self, body: impl Into<String>) -> Self {
        self.of = Some(body.into());
        self
    }

    /// The part of the place where a predicate of $X$ holds: conditions act on the facets whose middle it holds for, loads
    /// at the points of integration.
    pub fn within(mut self, holds: impl Fn(&Point<D>) -> bool + Send + Sync + 'static) -> Self {
        self.within.push(Arc::new(holds));
        self
    }

    /// Whether all predicates hold at a point.
    pub(crate) fn holds(&self, at: &Point<D>) -> bool {
        self.within.iter().all(|within| within(at))
    }

    /// Whether it is on the boundary.
    pub(crate) fn is_on_part(&self) -> bool {
        matches!(self.spot, Spot::Part(_))
    }

    /// Whether it is a whole body.
    pub(crate) fn is_all_of_body(&self) -> bool {
        self.spot == Spot::Body && self.within.is_empty()
    }

    /// Whether a result at this place includes what acts at another place.
    pub(crate) fn takes_in(&self, other: &Place<D>) -> bool {
        let whole = matches!((&self.spot, &other.spot), (Spot::Part(Part::Whole), Spot::Part(_)));
        // What holds within all of these predicates holds within some of them.
        let same = self.within.iter().all(|mine| other.within.iter().any(|its| Arc::ptr_eq(mine, its)));
        let body = self.of.is_none() || self.of == other.of;
        same && body && (whole || self.spot == other.spot)
    }
}

impl<const D: usize> fmt::Display for Place<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.within.is_empty() {
            write!(f, "some of ")?;
        }
        match &self.spot {
            Spot::Part(part) => write!(f, "{part}")?,
            Spot::Point(at) => write!(f, "{:?}", at.as_slice())?,
            Spot::Body => write!(f, "the body")?,
        }
        match &self.of {
            Some(body) => write!(f, " of {body}"),
            None => Ok(()),
        }
    }
}

impl<const D: usize> fmt::Debug for Place<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Place({self})")
    }
}

macro_rules! parts_are_places {
    ($($part:ty),*) => {$(
        impl<const D: usize> From<$part> for Place<D> {
            fn from(part: $part) -> Self {
                Place::on(part)
            }
        }
    )*};
}
parts_are_places!(Part, Side, (usize, Side), &str);

impl<const D: usize> From<String> for Place<D> {
    fn from(name: String) -> Self {
        Place::on(Part::Named(name))
    }
}
