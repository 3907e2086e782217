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
    /// No facet of the part faces what it is to touch.
    #[error(
        "{contact}: no point of the part faces what it is to touch, X = {at:?} for instance: name the part of the boundary that \
         does, or reverse the normal of a rigid surface to make it face the part"
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
    /// A rigid surface that is moved and pushed, or turned and driven.
    #[error(
        "{contact}: the rigid surface is given a motion and a force, of which only one can say where it is: take RigidSurface::moving or \
         RigidSurface::pushed (RigidSurface::turning or RigidSurface::driven), or one after the other in stages"
    )]
    DrivenTwice {
        /// The contact.
        contact: String,
    },
    /// A rigid surface with the amplitude of a turn that it was not given.
    #[error(
        "{contact}: RigidSurface::turning_along is the amplitude of a turn, and the rigid surface has none: give the angle by \
         RigidSurface::turning or the moment by RigidSurface::driven"
    )]
    Unturned {
        /// The contact.
        contact: String,
    },
    /// Nothing of the boundary can touch.
    #[error("{contact}: {place} holds no facet: let the predicate hold for the middles of some, or name another part")]
    NoFacet {
        /// The contact.
        contact: String,
        /// The place.
        place: String,
    },
    /// A part is to touch itself as if it were two.
    #[error(
        "{contact}: both faces are {place}: name two parts, or use ContactPair::itself for a part that may touch itself where it folds"
    )]
    SameFace {
        /// The contact.
        contact: String,
        /// The place.
        place: String,
    },
    /// An interference of parts that do not overlap.
    #[error(
        "{contact}: an interference is to be resolved, and the parts are {gap:e} apart where they begin: draw them with their \
         overlap, or leave the interference out"
    )]
    NoOverlap {
        /// The contact.
        contact: String,
        /// Their least distance \[length\].
        gap: f64,
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
         presses, so that several touch it; where the rubber rolls over the edge of the part that touches, let the faces behind the \
         edge touch too"
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
