//! What may touch what: as a scene says it and as a problem holds it.

use std::sync::Arc;

use crate::contact::{ContactSurface, Interference, Obstacle, PairContact, RigidContact, Trace, validate};
use crate::each::Each;
use crate::error::{Error, GeometryError};
use crate::geometry::{Point, Vec3, unit};
use crate::term::View;

use super::place::Place;

/// Called for each direction in which contact blocks motion: the trace function, one of the other part, its place, the direction.
type BarVisitor<'a> = dyn FnMut(&Trace, Option<&Trace>, &Vec3, &Vec3) + 'a;

/// A part of the body and the rigid surface that it may touch.
#[derive(Clone)]
pub(crate) struct ContactDefinition<const D: usize> {
    pub place: Place<D>,
    pub surface: Obstacle,
    /// Whether the stage before had it.
    pub goes_on: bool,
}

impl<const D: usize> ContactDefinition<D> {
    pub(crate) fn label(&self) -> String {
        format!("contact of {} with {}", self.place, self.surface.name)
    }
}

/// Two parts of the boundary that may touch each other, of one body or of two, or one that may touch itself.
///
/// ```
/// use rkpm::prelude::*;
/// // A bush whose bore is drawn smaller than the shaft that it is pressed on, with friction.
/// let pair = ContactPair::between("shaft", "bore", "fit").interference(0.5).friction(0.4);
/// # let _: ContactPair<2> = pair;
/// ```
#[derive(Debug, Clone)]
pub struct ContactPair<const D: usize> {
    pub(crate) first: Place<D>,
    pub(crate) second: Option<Place<D>>,
    pub(crate) name: String,
    pub(crate) friction: f64,
    pub(crate) interference: Option<Interference>,
    /// Whether the stage before had it.
    pub(crate) goes_on: bool,
}

impl<const D: usize> ContactPair<D> {
    /// Two parts, whose contact goes by a name.
    pub fn between(first: impl Into<Place<D>>, second: impl Into<Place<D>>, name: &str) -> Self {
        ContactPair { second: Some(second.into()), ..ContactPair::itself(first, name) }
    }

    /// A part that may touch itself where it folds.
    pub fn itself(place: impl Into<Place<D>>, name: &str) -> Self {
        ContactPair {
            first: place.into(),
            second: None,
            name: name.into(),
            friction: 0.0,
            interference: None,
            goes_on: false,
        }
    }

    /// Coulomb's coefficient of friction, in the plane and in space.
    pub fn friction(mut self, coefficient: f64) -> Self {
        self.friction = coefficient;
        self
    }

    /// Lets the parts begin inside each other: the overlap is resolved while the load factor goes from 0 to `until`.
    pub fn interference(mut self, until: f64) -> Self {
        self.interference = Some(Interference::new(until));
        self
    }

    /// Refuses coefficients and stages that are none.
    pub(super) fn validate(&self) -> Result<(), Error> {
        validate_pair(self.friction, self.interference.as_ref(), self.second.is_none(), &self.name)
    }
}

fn validate_pair(
    friction: f64,
    interference: Option<&Interference>,
    with_itself: bool,
    name: &str,
) -> Result<(), Error> {
    validate(friction, interference, &format!("contact {name}"))?;
    ensure!(
        interference.is_none() || !with_itself,
        GeometryError::Unsuited { what: "interference of a part with itself", needed: "two parts of the boundary" }
    );
    Ok(())
}

/// A contact in a problem.
pub(crate) struct Contact {
    /// The name of its surface.
    pub name: String,
    /// Its place among the terms.
    pub term: usize,
    pub law: Law,
}

/// What it touches.
pub(crate) enum Law {
    Rigid(Arc<RigidContact>),
    /// Two parts, and whether they are in the other order than named.
    Pair(Arc<PairContact>, bool),
}

impl Law {
    /// The faces of the bodies, that which carries the pressures first.
    pub(crate) fn surfaces(&self) -> &[ContactSurface] {
        match self {
            Law::Rigid(law) => std::slice::from_ref(&law.contact_surface),
            Law::Pair(law, _) => &law.contact_surfaces,
        }
    }

    pub(crate) fn rigid(&self) -> Option<&RigidContact> {
        match self {
            Law::Rigid(law) => Some(law),
            Law::Pair(..) => None,
        }
    }

    pub(crate) fn has_friction(&self) -> bool {
        match self {
            Law::Rigid(law) => law.law.has_friction(),
            Law::Pair(law, _) => law.law.has_friction(),
        }
    }

    /// Condensed unknowns of a trace function, and how many of these there are.
    pub(crate) fn unknowns(&self) -> (usize, usize) {
        let law = match self {
            Law::Rigid(law) => &law.law,
            Law::Pair(law, _) => &law.law,
        };
        (law.stride(), self.surfaces()[0].traces.len())
    }

    /// The node of the unknowns of a surface that is pushed or free to turn.
    pub(crate) fn rigid_dof(&self) -> Option<usize> {
        self.rigid()?.rigid_dof.map(|node| node as usize)
    }

    /// Visits the trace functions with one of the opposite part, their undeformed places and the directions in which the contact blocks
    /// motion there: vectors whose squares, over the directions that are blocked alike, add up to one. Without friction, or where it
    /// is not to count, that is the normal direction. The direction in which a surface is pushed is left out, and so is contact within one part.
    /// A surface that turns freely is treated as one that does not turn.
    pub(crate) fn bars(&self, rest: &[f64], friction: bool, visit: &mut BarVisitor<'_>) {
        let (surface, opposite) = match self.surfaces() {
            [surface, other] => (surface, other.traces.first()),
            surfaces => (&surfaces[0], None),
        };
        let rigid = self.rigid();
        if rigid.is_none() && opposite.is_none() {
            return;
        }
        let view = View { displacement: rest, condensed: &[], load: 0.0 };
        let free = rigid.and_then(|law| law.surface.free_direction());
        let total: f64 = surface.traces.summed(|trace| trace.area);
        for (k, trace) in surface.traces.iter().enumerate() {
            let mut x = Vec3::zeros();
            for &(point, weight) in &trace.points {
                x += surface.table.positions[point as usize] * (weight / trace.area);
            }
            let share = (trace.area / total).sqrt();
            let mut less = |direction: Vec3| {
                let along = free.map_or_else(Point::zeros, |free| free * direction.dot(&free));
                visit(trace, opposite, &x, &((direction - along) * share));
            };
            match rigid {
                _ if friction && self.has_friction() => {
                    (0..surface.table.dim).for_each(|axis| less(unit(axis)));
                }
                Some(law) => less(law.local_contact(k, &view, |_, _, _| {}).normal),
                None => less(surface.normal(trace)),
            }
        }
    }
}
