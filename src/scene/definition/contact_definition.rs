//! What may touch what: as a scene says it and as a problem holds it.

use std::sync::Arc;

use crate::contact::{ContactLaw, ContactSurface, Interference, Obstacle, PairContact, RigidContact, validate};
use crate::each::Each;
use crate::error::{Error, GeometryError};
use crate::geometry::{Point, Vec3, unit};
use crate::term::View;

use super::place::Place;

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
        validate(self.friction, self.interference.as_ref(), &format!("contact {}", self.name))?;
        ensure!(
            self.interference.is_none() || self.second.is_some(),
            GeometryError::Unsuited { what: "interference of a part with itself", needed: "two parts of the boundary" }
        );
        Ok(())
    }
}

/// A direction in which contact bars the motion of a particle at its undeformed place, against that of another one where there is one.
pub(crate) struct Barred {
    pub particle: usize,
    pub other: Option<usize>,
    pub at: Vec3,
    pub direction: Vec3,
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

    fn law(&self) -> &ContactLaw {
        match self {
            Law::Rigid(law) => &law.law,
            Law::Pair(law, _) => &law.law,
        }
    }

    pub(crate) fn has_friction(&self) -> bool {
        self.law().has_friction()
    }

    /// Condensed unknowns of a trace function, and how many of these there are.
    pub(crate) fn unknowns(&self) -> (usize, usize) {
        (self.law().stride(), self.surfaces()[0].traces.len())
    }

    /// The node of the unknowns of a surface that is pushed or free to turn.
    pub(crate) fn rigid_dof(&self) -> Option<usize> {
        self.rigid()?.rigid_dof.map(|node| node as usize)
    }

    /// The directions in which the contact blocks motion, at each trace function: vectors whose squares, over the directions that are
    /// blocked alike, add up to one. Without friction, or where it is not to count, that is the normal direction. The direction in which a
    /// surface is pushed is left out, and so is contact within one part. A surface that turns freely is treated as one that does not turn.
    pub(crate) fn bars(&self, rest: &[f64], friction: bool) -> Vec<Barred> {
        let (surface, other) = match self.surfaces() {
            [surface, other] => (surface, other.traces.first().map(|trace| trace.particle as usize)),
            surfaces => (&surfaces[0], None),
        };
        let (rigid, mut barred) = (self.rigid(), Vec::new());
        if rigid.is_none() && other.is_none() {
            return barred;
        }
        let view = View::at_rest(rest, 0.0);
        let free = rigid.and_then(|law| law.surface.free_direction());
        let total: f64 = surface.traces.summed(|trace| trace.area);
        for (k, trace) in surface.traces.iter().enumerate() {
            let mut at = Vec3::zeros();
            for &(point, weight) in &trace.points {
                at += surface.table.positions[point as usize] * (weight / trace.area);
            }
            let share = (trace.area / total).sqrt();
            let mut less = |direction: Vec3| {
                let along = free.map_or_else(Point::zeros, |free| free * direction.dot(&free));
                let (particle, direction) = (trace.particle as usize, (direction - along) * share);
                barred.push(Barred { particle, other, at, direction });
            };
            match rigid {
                _ if friction && self.has_friction() => {
                    (0..surface.table.dim).for_each(|axis| less(unit(axis)));
                }
                Some(law) => less(law.local_contact(k, &view, |_, _, _| {}).normal),
                None => less(surface.normal(trace)),
            }
        }
        barred
    }
}
