//! What is wrong with a contact.

use thiserror::Error;

use super::Invalid;

/// What is wrong with a contact.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ContactError {
    /// The body lies inside a rigid surface before anything moves.
    #[error(
        "{contact}: the body is inside the surface by {depth:e} at X = {at:?} before anything moves: move the surface out, \
         and let it come in with RigidSurface::moving"
    )]
    Penetrates {
        /// The contact.
        contact: String,
        /// How deep \[length\].
        depth: f64,
        /// Where, in the body at rest.
        at: Vec<f64>,
    },
    /// No facet of the part looks at the surface.
    #[error(
        "{contact}: the part looks away from the surface, at X = {at:?} and everywhere: name the part of the boundary that \
         faces it, or turn the normal of the surface round"
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
    /// A rigid body that is moved by no force.
    #[error(
        "{contact}: the rigid surface is pushed by a force of zero, so that nothing says where it is: give a force, \
         RigidSurface::moving, or leave it fixed"
    )]
    Unheld {
        /// The contact.
        contact: String,
    },
    /// A body lies on a rigid profile beyond its open end.
    #[error(
        "{contact}: the body lies beyond an open end of the profile at x = {at:?} at load factor {load}: draw the profile on, or close it"
    )]
    PassedEnd {
        /// The contact.
        contact: String,
        /// Where, in the body now.
        at: Vec<f64>,
        /// The load factor.
        load: f64,
    },
    /// A rigid surface that was outside of a body is inside of it after a step.
    #[error(
        "{contact}: the rigid surface has passed through the body at x = {at:?} at load factor {load}: take more particles where it \
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
    /// More particles carry two faces than a contact between them can number.
    #[error(
        "{contact}: {particles} particles carry the faces, the most is {most}: name the parts of the boundary that come to touch, or take a wider spacing"
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
    #[error("no contact {requested}: there are {known}")]
    Unknown {
        /// The name.
        requested: String,
        /// The names that there are.
        known: String,
    },
    /// Two contacts have one name.
    #[error("two contacts are called {name}: give one of the surfaces a name of its own (RigidSurface::named)")]
    Twice {
        /// The name.
        name: String,
    },
}
