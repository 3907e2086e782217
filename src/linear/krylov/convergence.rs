//! How fast Krylov iterations reduce the residual.

/// Iterations per decade of the residual: of the first solution with the element matrices of a state, and of the last one.
#[derive(Clone, Copy, Default)]
pub(super) struct ConvergenceHistory {
    pub(super) first: Option<f64>,
    pub(super) last: f64,
}
