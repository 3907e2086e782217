//! Points, blocks, planar regions and the names of boundary parts.

mod bounds;
mod cubes;
mod disjoint;
mod morton;
mod outline;
mod region;
mod rigid_mode;
mod walls;

pub(crate) use bounds::Bounds;
pub(crate) use cubes::{Cubes, Mixed, Places, places};
pub(crate) use disjoint::Disjoint;
pub(crate) use morton::Morton;
pub(crate) use outline::Curve;
pub use outline::{Outline, Turn};
pub use region::Region;
pub(crate) use region::is_left;
pub(crate) use rigid_mode::RigidMode;
pub(crate) use walls::{OPPOSITE, Wall};

use std::fmt;
use std::sync::Arc;

use nalgebra::{SMatrix, SVector};

use crate::each::{Each, point_of};
use crate::error::GeometryError;

/// A point or vector in `D` dimensions \[length\].
pub type Point<const D: usize> = SVector<f64, D>;
/// A point or vector in the plane.
pub(crate) type Vec2 = Point<2>;
/// A point or vector with three components, whatever the dimension of the body.
pub(crate) type Vec3 = Point<3>;
/// A matrix of three rows and columns: a deformation gradient, a stress, a rotation.
pub(crate) type Mat3 = SMatrix<f64, 3, 3>;

/// The unit vector along an axis.
pub(crate) fn unit<const D: usize>(axis: usize) -> Point<D> {
    point_of(|i| f64::from(u8::from(i == axis)))
}

/// A point or vector in as many dimensions as are asked for: those that it lacks are zero, those beyond are left out.
pub(crate) fn padded<const D: usize, const N: usize>(x: &Point<D>) -> Point<N> {
    let mut all = Point::zeros();
    for i in 0..D.min(N) {
        all[i] = x[i];
    }
    all
}

/// Several places, each padded with zeros or cut.
pub(crate) fn all_padded<const D: usize, const N: usize>(points: &[Point<D>]) -> Vec<Point<N>> {
    points.mapped(padded)
}

/// A vector with three components, the others zero.
pub(crate) fn vector<const D: usize>(components: &[f64; D]) -> Vec3 {
    padded(&Point::from(*components))
}

/// The mean of some places; the origin without any.
pub(crate) fn mean<const D: usize>(places: &[Point<D>]) -> Point<D> {
    places.iter().sum::<Point<D>>() / places.len().max(1) as f64
}

/// Twice the area of a triangle along its normal, by the right hand.
pub(crate) fn double_area([a, b, c]: &[Vec3; 3]) -> Vec3 {
    (b - a).cross(&(c - a))
}

/// The first components of a place: as many as there are dimensions.
pub(crate) fn cut(at: &Vec3, dim: usize) -> Vec<f64> {
    at.as_slice()[..dim].to_vec()
}

/// One end of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Side {
    /// The end with the smaller coordinate.
    Min,
    /// The end with the larger coordinate.
    Max,
}

/// The name of a boundary part.
///
/// Lattices have the two faces of each axis of their unit cube; `Side::Min.into()` is the face of
/// axis 0 (all there is in one dimension), `(1, Side::Max).into()` the upper face of axis 1. Drawn
/// outlines have the names they were drawn with; `"hole".into()` is one.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Part {
    /// The face of a lattice at one end of an axis.
    Face {
        /// The axis, counted from 0.
        axis: usize,
        /// Which end.
        side: Side,
    },
    /// All of the boundary.
    Whole,
    /// The lines and arcs drawn under a name.
    Named(String),
}

impl From<&str> for Part {
    fn from(name: &str) -> Self {
        Part::Named(name.to_string())
    }
}

impl From<Side> for Part {
    fn from(side: Side) -> Self {
        Part::Face { axis: 0, side }
    }
}

impl From<(usize, Side)> for Part {
    fn from((axis, side): (usize, Side)) -> Self {
        Part::Face { axis, side }
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Part::Face { axis, side } => write!(f, "face ({axis}, {side:?})"),
            Part::Whole => write!(f, "whole boundary"),
            Part::Named(name) => write!(f, "{name}"),
        }
    }
}

impl Part {
    /// The error where no part of a boundary has this name; `nameless` says that there are no names.
    pub(crate) fn unknown(&self, names: &[&str], nameless: &str) -> GeometryError {
        let known = match names {
            [] => format!("{nameless}, but the whole boundary, and some of it by Place::within"),
            _ => format!("{}, and the whole boundary", names.join(", ")),
        };
        GeometryError::UnknownPart { part: self.to_string(), known }
    }
}

/// Refuses dimensions other than one, two and three.
pub(crate) fn check_dimension<const D: usize>() -> Result<(), GeometryError> {
    if matches!(D, 1..=3) {
        return Ok(());
    }
    Err(GeometryError::Count { what: "dimensions D", count: D, needed: "1, 2 and 3 are possible" })
}

/// An axis-aligned block $\prod_i [\min_i, \max_i]$ \[length\] in one, two or three dimensions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Block<const D: usize> {
    /// The corner with the smallest coordinates.
    pub min: Point<D>,
    /// The corner with the largest coordinates.
    pub max: Point<D>,
}

impl<const D: usize> Block<D> {
    /// The block between two corners.
    pub fn new(min: [f64; D], max: [f64; D]) -> Self {
        Block { min: min.into(), max: max.into() }
    }

    /// Refuses a block without a finite positive extent along each axis, or of other than one to three dimensions.
    pub(crate) fn validate(&self) -> Result<(), GeometryError> {
        check_dimension::<D>()?;
        for axis in 0..D {
            let extent = self.max[axis] - self.min[axis];
            // The negation also catches NaN.
            ensure!(
                extent > 0.0 && extent.is_finite(),
                GeometryError::Degenerate { what: "block", axis, value: extent }
            );
        }
        Ok(())
    }
}

/// A region that is the image of the unit cube $\[0,1\]^D$.
///
/// ```
/// use rkpm::geometry::{Domain, Point};
/// /// A quarter ring in polar coordinates: axis 0 radial, axis 1 along the arc.
/// struct QuarterRing { inner: f64, outer: f64 }
/// impl Domain<2> for QuarterRing {
///     fn position(&self, unit: &Point<2>) -> Point<2> {
///         let radius = self.inner + (self.outer - self.inner) * unit[0];
///         let angle = std::f64::consts::FRAC_PI_2 * unit[1];
///         Point::<2>::new(radius * angle.cos(), radius * angle.sin())
///     }
/// }
/// assert!((QuarterRing { inner: 1.0, outer: 2.0 }.position(&Point::<2>::new(1.0, 0.0))[0] - 2.0).abs() < 1e-15);
/// ```
pub trait Domain<const D: usize>: Send + Sync {
    /// The position $X(\xi)$ \[length\] of a point $\xi \in \[0,1\]^D$; orientation-preserving.
    fn position(&self, unit: &Point<D>) -> Point<D>;

    /// Refuses a domain that can't be discretised; the default accepts all (cells are checked later).
    fn validate(&self) -> Result<(), GeometryError> {
        Ok(())
    }
}

impl<const D: usize> Domain<D> for Block<D> {
    fn position(&self, unit: &Point<D>) -> Point<D> {
        // Both ends come out exact, so that boundary particles lie on the boundary to the bit.
        point_of(|i| self.min[i] * (1.0 - unit[i]) + self.max[i] * unit[i])
    }

    fn validate(&self) -> Result<(), GeometryError> {
        Block::validate(self)
    }
}

impl<const D: usize, T: Domain<D> + ?Sized> Domain<D> for Arc<T> {
    fn position(&self, unit: &Point<D>) -> Point<D> {
        (**self).position(unit)
    }

    fn validate(&self) -> Result<(), GeometryError> {
        (**self).validate()
    }
}

/// A block deformed by a smooth map of the unit cube, $X = f(\xi)$.
#[derive(Clone, Copy)]
pub struct Mapped<F>(
    /// The map from $\[0,1\]^D$ to the body.
    pub F,
);

impl<const D: usize, F: Fn(&Point<D>) -> Point<D> + Send + Sync> Domain<D> for Mapped<F> {
    fn position(&self, unit: &Point<D>) -> Point<D> {
        (self.0)(unit)
    }
}

/// The quadrilateral with four corners, counter-clockwise from the image of (0, 0), mapped bilinearly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quadrilateral {
    /// The images of (0,0), (1,0), (1,1), (0,1) \[length\].
    pub corners: [[f64; 2]; 4],
}

impl Domain<2> for Quadrilateral {
    fn position(&self, unit: &Vec2) -> Vec2 {
        let (s, t) = (unit[0], unit[1]);
        let weights = [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t];
        let mut x = Vec2::zeros();
        for (w, c) in weights.iter().zip(&self.corners) {
            x += Vec2::from(*c) * *w;
        }
        x
    }
}
