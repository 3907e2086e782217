//! What is wrong with a contact.

use thiserror::Error;

use super::Invalid;

/// What is wrong with a contact.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ContactError {
    /// The body lies inside a rigid surface before anything moves.
    #[error(
        "{contact}: the body penetrates the surface by {depth:e} at X = {at:?} before anything moves: move the surface out, \
         and bring it in by RigidSurface::moving"
    )]
    Penetrates {
        /// The contact.
        contact: String,
        /// How deep \[length\].
        depth: f64,
        /// Where, in the undeformed body.
        at: Vec<f64>,
    },
    /// No facet of the part faces the surface.
    #[error(
        "{contact}: no point of the part faces the surface, X = {at:?} for instance: name the part of the boundary that \
         does, or reverse the normal of the surface to make it face the part"
    )]
    FacesAway {
        /// The contact.
        contact: String,
        /// A point of the part.
        at: Vec<f64>,
    },
    /// A coefficient of friction, a motion or a force of a rigid surface is NaN, infinite or out of its range.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// A rigid surface that is pushed by no force.
    #[error(
        "{contact}: the rigid surface is pushed by a force of zero, so its position is undetermined: give a force, \
         prescribe its motion by RigidSurface::moving, or leave it fixed"
    )]
    Unheld {
        /// The contact.
        contact: String,
    },
    /// A body lies on a rigid profile beyond its open end.
    #[error(
        "{contact}: at load factor {load} the body lies beyond an open end of the profile, at x = {at:?}: draw the profile longer, or close it"
    )]
    PassedEnd {
        /// The contact.
        contact: String,
        /// Where, in the deformed body.
        at: Vec<f64>,
        /// The load factor.
        load: f64,
    },
    /// A rigid surface that was outside a body is inside it after a step.
    #[error(
        "{contact}: at load factor {load} the rigid surface has passed through the body, at x = {at:?}: take more particles where it \
         presses, so that several touch it"
    )]
    PassedThrough {
        /// The contact.
        contact: String,
        /// Where, in the body now.
        at: Vec<f64>,
        /// The load factor.
        load: f64,
    },
    /// The faces of a contact depend on more particles than it can number.
    #[error(
        "{contact}: its faces depend on {particles} particles, at most {most} are accepted: name smaller parts of the boundary, those that will touch, or take a wider spacing"
    )]
    TooManyParticles {
        /// The contact.
        contact: String,
        /// Particles that move the faces.
        particles: usize,
        /// The most.
        most: usize,
    },
    /// No contact has the name requested.
    #[error(
        "no contact is named {requested:?}; {}",
        super::boundary::there_are(known, "contacts", "add a contact to the scene")
    )]
    Unknown {
        /// The name.
        requested: String,
        /// The names that there are.
        known: String,
    },
    /// Two contacts have one name.
    #[error("two contacts have the name {name}: give one of the surfaces a different name (RigidSurface::named)")]
    Twice {
        /// The name.
        name: String,
    },
}
