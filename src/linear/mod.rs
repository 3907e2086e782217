//! Sparse solvers behind a trait of our own; faer is named in two private files.

mod direct;
mod factors;
mod gmres;
mod krylov;
mod multilevel;
mod ordering;
mod system;
pub(crate) mod vector;

pub use direct::Direct;
pub(crate) use direct::{minimum_degree, multiplications};
pub(crate) use gmres::minimal_residuals;
pub(crate) use krylov::{Auxiliary, Krylov};
pub(crate) use ordering::after_their_rows;
pub(crate) use ordering::banded;
pub(crate) use ordering::nested_dissection;
pub use system::LinearSystem;

use std::sync::Arc;

use crate::assembly::{Pattern, Ranks};
use crate::error::LinearError;
use crate::geometry::Vec3;

/// What is known of a matrix before it is factorised.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MatrixClass {
    /// Symmetric, expected to be positive definite near stable states; may be indefinite.
    Definite,
    /// Symmetric saddle point; `constraints` of its rows belong to Lagrange multipliers: the last ones, but any where an
    /// elimination order is given. Their diagonals are zero.
    Saddle {
        /// Number of multipliers.
        constraints: usize,
    },
}

impl MatrixClass {
    /// Number of multipliers: as many pivots of a stable state are negative.
    pub(crate) fn constraints(self) -> usize {
        match self {
            MatrixClass::Definite => 0,
            MatrixClass::Saddle { constraints } => constraints,
        }
    }
}

/// Signs of the pivots of a factorisation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Inertia {
    /// Positive pivots.
    pub positive: usize,
    /// Negative pivots: as many as constraints on a stable saddle point, none on a stable definite matrix.
    pub negative: usize,
}

/// A sparse linear solver: pattern in, then values and right-hand sides as often as they come.
///
/// ```
/// use rkpm::assembly::Pattern;
/// use rkpm::error::LinearError;
/// use rkpm::linear::{Inertia, LinearSolver, LinearSystem, MatrixClass};
/// /// Solves diagonal systems.
/// #[derive(Default)]
/// struct Diagonal(Vec<usize>);
/// impl LinearSolver for Diagonal {
///     fn fresh(&self) -> Box<dyn LinearSolver> { Box::new(Diagonal::default()) }
///     fn analyze(&mut self, pattern: &Pattern, _: MatrixClass, _: Option<&[usize]>) -> Result<(), LinearError> {
///         self.0 = pattern.columns[..pattern.size()].to_vec();
///         Ok(())
///     }
///     fn factorize(&mut self, _: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError> { Ok(None) }
///     fn solve(&mut self, system: &LinearSystem<'_>, rhs: &mut [f64], _: Option<&mut [[f64; 4]]>) -> Result<f64, LinearError> {
///         rhs.iter_mut().zip(&self.0).for_each(|(b, &diagonal)| *b /= system.values[diagonal]);
///         Ok(0.0)
///     }
/// }
/// let (mut solver, system) = (Diagonal::default(), LinearSystem::of(&[2.0, 3.0]));
/// solver.analyze(&Pattern::from_columns(vec![vec![], vec![]]), MatrixClass::Definite, None)?;
/// solver.factorize(&system)?;
/// let mut x = [2.0, 6.0];
/// solver.solve(&system, &mut x, None)?;
/// assert_eq!(x, [1.0, 2.0]);
/// # Ok::<(), LinearError>(())
/// ```
pub trait LinearSolver: Send + Sync {
    /// A solver of the same kind that has looked at nothing yet: each analysis works with one of its own.
    fn fresh(&self) -> Box<dyn LinearSolver>;

    /// The symbolic phase, once per pattern. `order` is an elimination order (old index at each new
    /// place) where the caller knows a good one; it has each multiplier
    /// after the unknowns of its row.
    ///
    /// # Errors
    /// Where the pattern is too large or malformed.
    fn analyze(&mut self, pattern: &Pattern, class: MatrixClass, order: Option<&[usize]>) -> Result<(), LinearError>;

    /// Factorises the matrix of a system, or prepares an iteration; the signs of the pivots, where the method knows them.
    ///
    /// # Errors
    /// Where the matrix is singular or not finite.
    fn factorize(&mut self, system: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError>;

    /// Solves $Ax = b$ in place, for the system that was factorised last; the part of the residual that is left, 0 for factors. What
    /// an iteration leaves is found by Newton's next iteration, and is not refined: the reduced matrix is not all that it solves with.
    ///
    /// `pressures` holds the right-hand sides $g$ of the equations $C\\,\delta d - H^{-1} q = g$ of the pressures that are kept
    /// uncondensed, zone by zone, and receives $q$; solvers without such pressures leave them as they are. Without `pressures` these
    /// equations have zeros, and no further iteration of Newton's method follows: the solution is needed in full.
    ///
    /// # Errors
    /// Where the result is not finite.
    fn solve(
        &mut self,
        system: &LinearSystem<'_>,
        rhs: &mut [f64],
        pressures: Option<&mut [[f64; 4]]>,
    ) -> Result<f64, LinearError>;

    /// Whether pressures of zones are to stay unknowns that are not condensed into the matrix, and the rest of their terms' matrices is
    /// to be left to the points; [`LinearSystem`] then has both. The unknowns keep the order of the particles,
    /// multipliers behind them.
    fn keeps_pressures(&self) -> bool {
        false
    }

    /// Krylov iterations that each solution so far has taken, those of [`fresh`](LinearSolver::fresh) ones too; none for direct solvers.
    fn krylov_iterations(&self) -> Vec<usize> {
        Vec::new()
    }

    /// The ranks among which the solver expects the matrix: each gives the entries that it has summed, right-hand sides and
    /// solutions are whole. None for solvers of one process.
    fn ranks(&self) -> Option<Arc<dyn Ranks>> {
        None
    }

    /// An approximate solver for nodes at these positions in 3D: scenes use it in the preconditioner of a Krylov iteration. None for
    /// solvers that solve by themselves.
    fn preconditioner(&self, _nodes: &[Vec3]) -> Option<Box<dyn LinearSolver>> {
        None
    }

    /// Gives back the memory of large factors that are no longer looked at: called before another matrix is formed, so
    /// that it is never held beside the factors of the last one. Nothing needs to be written for it.
    fn release(&mut self) {}

    /// Bytes that the factors take, where the method knows them.
    fn bytes(&self) -> Option<usize> {
        None
    }
}
