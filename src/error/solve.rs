//! Errors of Newton's method and stepping.

use thiserror::Error;

use super::{Cause, Doubt, Invalid, Stalled};
use crate::each::Each;

/// What went wrong in an analysis.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SolveError {
    /// The initial state is inverted somewhere.
    #[error(
        "the initial state is inverted: J = {jacobian:e} at X = {at:?}; start from a state with J > 0 everywhere (zero displacement is one)"
    )]
    InvertedStart {
        /// det F.
        jacobian: f64,
        /// Where.
        at: Vec<f64>,
    },
    /// A vector has the wrong length.
    #[error("{what} has {given} entries, the model needs {needed}")]
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
        "the state belongs to another problem: its {what} has {given} entries, this problem has {needed}; pass a state that this problem has computed"
    )]
    OtherModel {
        /// What does not fit.
        what: &'static str,
        /// Entries given.
        given: usize,
        /// Entries needed.
        needed: usize,
    },
    /// A term has another dimension than the model.
    #[error(
        "a term has {given} displacement components at each node, the model has {needed}; tabulate the term in the dimension of the model, and return it from Term::dim"
    )]
    Dimension {
        /// Components of the term.
        given: usize,
        /// Components of the model.
        needed: usize,
    },
    /// A term is over other nodes than the model.
    #[error(
        "term {term} has shape functions of {given} nodes, the model has {needed}: tabulate it with those of the model, or count the others in \
         by ShapeTable::tabulate"
    )]
    OtherNodes {
        /// The term, counted from 0.
        term: usize,
        /// Nodes of its shape functions.
        given: usize,
        /// Nodes of the model.
        needed: usize,
    },
    /// A state of another body with as many unknowns.
    #[error(
        "the state belongs to another problem, whose particles lie at other places; pass a state that this problem has computed, or carry \
         it over by Problem::transfer"
    )]
    OtherParticles,
    /// The nodes of a cluster are not in rising order.
    #[error(
        "term {term} of the model, cluster {cluster}: Term::nodes() does not rise; list each node once, in rising order"
    )]
    Nodes {
        /// The term, counted from 0.
        term: usize,
        /// Its cluster, counted from 0.
        cluster: usize,
    },
    /// The condensed unknowns of a cluster run backwards, or are those of another cluster too.
    #[error(
        "term {term} of the model, cluster {cluster}: Term::unknowns() returns {start}..{end}, which runs backwards or holds unknowns of \
         another cluster; return a rising range that no other cluster has a part of"
    )]
    Unknowns {
        /// The term, counted from 0.
        term: usize,
        /// Its cluster, counted from 0.
        cluster: usize,
        /// The first of its condensed unknowns.
        start: usize,
        /// The one behind the last.
        end: usize,
    },
    /// A term couples a node that the model lacks.
    #[error(
        "term {term} of the model, cluster {cluster}: Term::nodes() names node {node}, counted from 0, the model has {nodes}; tabulate the \
         term over the nodes of the model"
    )]
    MissingNode {
        /// The term, counted from 0.
        term: usize,
        /// Its cluster, counted from 0.
        cluster: usize,
        /// The node.
        node: usize,
        /// Nodes of the model.
        nodes: usize,
    },
    /// A model would not fit into memory.
    #[error(
        "a model of {particles} particles needs about {}, the limit is {}: take at most {fits} particles along \
         each axis ({fits}³ in all), or raise the limit by Scheme::memory",
        bytes(*needed),
        bytes(*limit)
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
    /// No equilibrium was found in a loop of one's own over [`Equilibrium`](crate::solve::Equilibrium).
    #[error("{0}")]
    Attempt(Cause),
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
        /// The check that failed.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Load factor of the state.
        load: f64,
    },
    /// The analysis was ended before its last load; it can be resumed.
    #[error("ended at load factor {load} after {steps} converged steps: {why}")]
    BrokenOff {
        /// Load factor of the last converged state.
        load: f64,
        /// Converged steps.
        steps: usize,
        /// Why it ended.
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
    /// The analysis reached its last load, and the last state is no answer.
    #[error("completed, but the last state is no answer: {}", list(doubts))]
    Doubtful {
        /// Converged steps.
        steps: usize,
        /// Why.
        doubts: Vec<Doubt>,
    },
}

impl From<SolveError> for Cause {
    fn from(error: SolveError) -> Self {
        Cause::Refused(error.to_string())
    }
}

/// Doubts in one line.
fn list(doubts: &[Doubt]) -> String {
    doubts.mapped(Doubt::to_string).join("; ")
}

/// A number of bytes in the unit that suits its size.
fn bytes(number: f64) -> String {
    match number {
        n if n >= 1e9 => format!("{:.1} GB", n * 1e-9),
        n if n >= 1e6 => format!("{:.1} MB", n * 1e-6),
        n if n >= 1e3 => format!("{:.1} kB", n * 1e-3),
        n => format!("{n:.0} B"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_told_in_the_unit_of_its_size() {
        let told = |needed, limit| SolveError::Memory { particles: 27.0, needed, limit, fits: 2 }.to_string();
        assert!(told(3.26e6, 1.0).contains("needs about 3.3 MB, the limit is 1 B"));
        assert!(told(2.5e10, 4.1e3).contains("needs about 25.0 GB, the limit is 4.1 kB"));
    }
}
