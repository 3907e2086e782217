//! Errors of particles and shape functions.

use thiserror::Error;

/// What is wrong with particles or shape functions.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ApproximationError {
    /// The normalised dilation is too small.
    #[error(
        "normalised dilation r = {r} (6.1) is too small: at r <= 0.5 each support holds no other particle and the moment matrix is singular; use r >= 0.6, or 1.0 for a linear and 1.3 for a quadratic basis"
    )]
    Dilation {
        /// The value given.
        r: f64,
    },
    /// A support is not positive and finite.
    #[error(
        "support of particle {particle} is {value:e}: supports need finite lengths above zero; derive them from the spacing with r >= 0.6 (6.1)"
    )]
    Support {
        /// The particle.
        particle: usize,
        /// The dilation given.
        value: f64,
    },
    /// Particles are missing, not finite, or coincide.
    #[error("particle {particle}: {what}; {remedy}")]
    Particle {
        /// The particle.
        particle: usize,
        /// What is wrong.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// Arrays of different length describe the same particles.
    #[error("{what}: {given} entries for {particles} particles; give one for each")]
    Length {
        /// The array.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The number of particles.
        particles: usize,
    },
    /// Too few particles cover a point.
    #[error(
        "X = {at:?} is covered by {covering} particles, but the basis has {needed} terms: raise the dilation there (r >= 0.6 for a linear basis on a lattice, 1.1 for a quadratic one) or add particles"
    )]
    Uncovered {
        /// The point.
        at: Vec<f64>,
        /// Particles whose support holds the point.
        covering: usize,
        /// Terms of the basis.
        needed: usize,
    },
    /// The moment matrix is singular to working precision.
    #[error(
        "the moment matrix at X = {at:?} is nearly singular: its reciprocal condition number is {rcond:e}, the least accepted is {limit:e} ({covering} particles cover the point). If they are few or nearly on a line or plane, raise the dilation there or add particles off that line; if they are many, supports are too wide or the kernel is too narrow: lower the dilation (r between 1 and 3) or take a wider kernel"
    )]
    Singular {
        /// The point.
        at: Vec<f64>,
        /// Reciprocal condition number in the 1-norm.
        rcond: f64,
        /// The bound it fell below.
        limit: f64,
        /// Particles whose support holds the point.
        covering: usize,
    },
    /// A custom kernel, basis or shape function has unusable values.
    #[error("{what} is {value:e} at {at}: {remedy}")]
    Function {
        /// The function.
        what: &'static str,
        /// Its value or slope, or the parameter that makes it unusable.
        value: f64,
        /// Where: a point or a normalised distance.
        at: String,
        /// What to do.
        remedy: &'static str,
    },
    /// A point is not finite.
    #[error("evaluation point X = {at:?} is not finite: give finite coordinates")]
    Point {
        /// The point.
        at: Vec<f64>,
    },
    /// A point lies outside the body.
    #[error("X = {at:?} lies outside the body: give a point inside it")]
    Outside {
        /// The point.
        at: Vec<f64>,
    },
}
