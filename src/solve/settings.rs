//! Settings of Newton's method.

/// Settings of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Newton {
    /// Most iterations of one attempt.
    pub iterations: usize,
    /// Converged where the increment is below this part of the displacement (of at least 1e-6 of the body's extent), the
    /// residual below 3e-10 of the forces or 0.03 of this, and changes of condensed unknowns and load are small beside them as
    /// well. Looser values lost the path of thin sheets.
    pub tolerance: f64,
    /// How often the matrix is formed and factorised.
    pub tangent_update: TangentUpdate,
}

/// How often Newton's method forms and factorises the matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TangentUpdate {
    /// Until the increments are small; from there on solutions with the last factors follow as long as they
    /// converge fast enough to cost less than another matrix. They end where what is left of the error is far below
    /// the tolerance.
    #[default]
    Modified,
    /// In every iteration: the inertia is that of the last state but one, down to its rounding. Paths that are
    /// followed through critical points are solved like this.
    EveryIteration,
}

impl Newton {
    /// What a last step may leave of the residual.
    pub(super) fn forces_settled(&self) -> f64 {
        FORCES_SETTLED.max(FORCES_OF_TOLERANCE * self.tolerance)
    }
}

impl Default for Newton {
    /// 30 iterations, 1e-8.
    fn default() -> Self {
        Newton { iterations: 30, tolerance: 1e-8, tangent_update: TangentUpdate::default() }
    }
}

/// What a last step may leave of the residual, relative to the forces; it falls with the increments where the matrix is
/// kept and with their square where it is not. Displacements of nearly incompressible bodies rest before their
/// reactions, which were off by as much.
const FORCES_SETTLED: f64 = 3e-10;
/// The same as a part of a tolerance where that is more: a run to three digits does not iterate to ten.
const FORCES_OF_TOLERANCE: f64 = 0.03;
