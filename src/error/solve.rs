//! Errors of Newton's method and stepping.

use thiserror::Error;

use super::{Invalid, Stalled};

/// What went wrong in an analysis.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SolveError {
    /// The first guess is inverted somewhere.
    #[error(
        "J = {jacobian:e} at X = {at:?} in the first state: start from a state with J > 0 everywhere (zero displacement is one)"
    )]
    InvertedStart {
        /// det F.
        jacobian: f64,
        /// Where.
        at: Vec<f64>,
    },
    /// A vector has the wrong length.
    #[error("{what} has {given} entries, the model {needed}")]
    Length {
        /// The vector.
        what: &'static str,
        /// Entries given.
        given: usize,
        /// Entries needed.
        needed: usize,
    },
    /// A state of another problem or model.
    #[error(
        "a state of another problem: {given} entries of {what}, here are {needed}; pass states of this problem's own paths"
    )]
    OtherModel {
        /// What does not fit.
        what: &'static str,
        /// Entries given.
        given: usize,
        /// Entries needed.
        needed: usize,
    },
    /// The nodes of a cluster fall or repeat.
    #[error(
        "term {term} of the model, cluster {cluster}: Term::nodes() does not rise; list each node once, by rising index"
    )]
    Nodes {
        /// The term, counted from 0.
        term: usize,
        /// Its cluster, counted from 0.
        cluster: usize,
    },
    /// A model would not fit into memory.
    #[error(
        "a model of {particles} particles needs about {:.1} GB, the limit is {:.1} GB: take at most {fits} particles along \
         each axis ({fits}³ in all), or raise the limit by Scheme::memory",
        *needed * 1e-9,
        *limit * 1e-9
    )]
    Memory {
        /// Particles requested.
        particles: f64,
        /// Bytes that the model would take at its peak.
        needed: f64,
        /// Bytes that it may take.
        limit: f64,
        /// Particles along each axis of a cube that fits.
        fits: usize,
    },
    /// A setting or another number is NaN, infinite or out of its range.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// The model has nothing to solve.
    #[error("the model has no {what}: {remedy}")]
    Empty {
        /// What is missing.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// A path that is to be resumed was recorded with another problem.
    #[error(
        "the last state of the path, at load factor {load}, does not belong to this problem: {what} {value:.1e}; resume with the scene and the scheme that it was recorded with"
    )]
    OtherProblem {
        /// What gave it away.
        what: &'static str,
        /// By how much.
        value: f64,
        /// Load factor of the state.
        load: f64,
    },
    /// The analysis ended before its last load, though further steps may well be found.
    #[error("ended at load factor {load} after {steps} converged steps: {why}")]
    BrokenOff {
        /// Load factor of the last converged state.
        load: f64,
        /// Converged steps.
        steps: usize,
        /// Who broke off.
        why: &'static str,
    },
    /// The analysis stalled before its last load.
    #[error("stalled at load factor {} after {steps} converged steps: {stalled}", stalled.load)]
    Stalled {
        /// Converged steps.
        steps: usize,
        /// Why and where.
        stalled: Stalled,
    },
}
