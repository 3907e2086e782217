//! Errors of linear algebra.

use thiserror::Error;

/// What went wrong in the linear algebra.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LinearError {
    /// The matrix is singular or not definite enough for the method.
    #[error("factorisation failed at pivot {pivot}: {hint}")]
    Pivot {
        /// Index of the pivot, where the method knows it.
        pivot: usize,
        /// What this usually means.
        hint: &'static str,
    },
    /// The solution is not finite or does not satisfy the equations.
    #[error(
        "relative residual {residual:e} after the linear solve: the matrix is singular or nearly so. Either a rigid motion may be free \
         (check::scene finds those), or the state is at a limit point, or nearly inverted: take smaller steps"
    )]
    Residual {
        /// ‖b − A x‖ / ‖b‖, NaN where the solution is not finite.
        residual: f64,
    },
    /// A sparsity pattern is malformed.
    #[error("sparsity pattern, column {column}: {what}; build it with Pattern::from_columns")]
    Pattern {
        /// The column.
        column: usize,
        /// The rule that the pattern breaks.
        what: &'static str,
    },
    /// A vector or a list of values has the wrong length.
    #[error("{what} has {given} entries, the matrix needs {needed}")]
    Length {
        /// The vector.
        what: &'static str,
        /// Entries given.
        given: usize,
        /// Entries needed.
        needed: usize,
    },
    /// The problem is too large for the index type or the method.
    #[error("{what}: {size} exceeds the limit of {limit}; {remedy}")]
    Size {
        /// What is too large.
        what: &'static str,
        /// Its size.
        size: usize,
        /// The limit.
        limit: usize,
        /// What to do.
        remedy: &'static str,
    },
    /// The solver library reported something else.
    #[error("sparse solver: {what}; try another SolverChoice, or a smaller model")]
    Library {
        /// The library's message.
        what: String,
    },
}
