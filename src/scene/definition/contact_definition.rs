//! What may touch what: as a scene says it and as a problem holds it.

use std::sync::Arc;

use crate::contact::{Interference, PairContact, RigidContact, RigidSurface};
use crate::error::{Error, GeometryError, Invalid};

use super::place::Place;

/// A part of the body and the rigid surface that it may touch.
#[derive(Clone)]
pub(crate) struct ContactDefinition<const D: usize> {
    pub place: Place<D>,
    pub surface: RigidSurface<D>,
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
#[derive(Clone)]
pub struct ContactPair<const D: usize> {
    pub(crate) first: Place<D>,
    pub(crate) second: Option<Place<D>>,
    pub(crate) name: String,
    pub(crate) friction: f64,
    pub(crate) interference: Option<Interference>,
}

impl<const D: usize> ContactPair<D> {
    /// Two parts, whose contact goes by a name.
    pub fn between(first: impl Into<Place<D>>, second: impl Into<Place<D>>, name: &str) -> Self {
        ContactPair { second: Some(second.into()), ..ContactPair::itself(first, name) }
    }

    /// A part that may touch itself where it folds.
    pub fn itself(place: impl Into<Place<D>>, name: &str) -> Self {
        ContactPair { first: place.into(), second: None, name: name.into(), friction: 0.0, interference: None }
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
        let contact = format!("contact {}", self.name);
        if !(self.friction >= 0.0 && self.friction.is_finite()) {
            let what = format!("{contact}: coefficient of friction");
            return Err(Invalid::new(what, self.friction, "give a finite number from 0 on").into());
        }
        if let Some(interference) = &self.interference {
            interference.validate(&contact)?;
            if self.second.is_none() {
                let needed = "two parts of the boundary";
                return Err(GeometryError::Unsuited { what: "interference of a part with itself", needed }.into());
            }
        }
        Ok(())
    }
}

/// A contact in a problem.
pub(crate) struct Contact<const D: usize> {
    /// The name of its surface.
    pub name: String,
    /// Its place among the terms.
    pub term: usize,
    pub law: Law<D>,
}

/// What it touches.
pub(crate) enum Law<const D: usize> {
    Rigid(Arc<RigidContact<D>>),
    /// Two parts, and whether they are in the other order than named.
    Pair(Arc<PairContact<D>>, bool),
}
