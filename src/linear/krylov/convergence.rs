//! How far Krylov iterations have come.

use std::sync::{Arc, Mutex};

/// Iterations per decade of the residual: of the first solution with the element matrices of a state, and of the last one.
#[derive(Clone, Copy, Default)]
pub(super) struct ConvergenceHistory {
    pub(super) first: Option<f64>,
    pub(super) last: f64,
}

/// What solutions so far tell those that follow.
pub(super) struct Progress {
    /// The largest right-hand side so far.
    pub(super) largest: f64,
    /// The last right-hand side.
    pub(super) last: f64,
    pub(super) convergence: ConvergenceHistory,
    /// Iterations of each solution.
    pub(super) counts: Arc<Mutex<Vec<usize>>>,
}

impl Progress {
    pub(super) fn new(counts: Arc<Mutex<Vec<usize>>>) -> Self {
        Progress { largest: 0.0, last: f64::MIN_POSITIVE, convergence: ConvergenceHistory::default(), counts }
    }
}
