//! What may touch what: as a scene says it and as a problem holds it.

use std::sync::Arc;

use crate::contact::{PairContact, RigidContact, RigidSurface};

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

/// Two parts of the boundary that may touch each other, or one that may touch itself.
#[derive(Clone)]
pub(crate) struct ContactPair<const D: usize> {
    pub first: Place<D>,
    pub second: Option<Place<D>>,
    pub name: String,
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
