//! Sparse direct solvers behind traits of our own; faer is named in two private files.

mod direct;
mod factors;
mod gmres;
mod krylov;
mod multilevel;
mod ordering;
mod uncondensed;
pub(crate) mod vector;

pub use direct::Direct;
pub(crate) use direct::{minimum_degree, multiplications};
pub(crate) use gmres::minimal_residuals;
pub(crate) use krylov::{Auxiliary, Krylov};
pub(crate) use ordering::after_their_rows;
pub(crate) use ordering::banded;
pub use ordering::nested_dissection;
pub use uncondensed::{Linearised, ZoneProduct};

use std::sync::Arc;

use crate::assembly::{Pattern, Ranks, StateRef};
use crate::error::LinearError;
use crate::geometry::Point;

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

/// A sparse solver: pattern in, factoriser out.
///
/// ```
/// use rkpm::assembly::Pattern;
/// use rkpm::error::LinearError;
/// use rkpm::linear::{Factorizer, Factors, Inertia, LinearSolver, MatrixClass};
/// /// Solves diagonal systems.
/// struct Diagonal;
/// struct Entries(Pattern, Vec<f64>);
/// impl LinearSolver for Diagonal {
///     fn analyze(&self, pattern: &Pattern, _: MatrixClass, _: Option<&[usize]>) -> Result<Box<dyn Factorizer>, LinearError> {
///         Ok(Box::new(Entries(pattern.clone(), Vec::new())))
///     }
/// }
/// impl Factorizer for Entries {
///     fn factorize<'a>(&'a mut self, values: &'a [f64]) -> Result<Box<dyn Factors + 'a>, LinearError> {
///         self.1 = self.0.columns[..self.0.size()].iter().map(|&c| values[c]).collect();
///         Ok(Box::new(&*self))
///     }
/// }
/// impl Factors for &Entries {
///     fn solve_in_place(&self, rhs: &mut [f64]) -> Result<(), LinearError> {
///         rhs.iter_mut().zip(&self.1).for_each(|(b, a)| *b /= a);
///         Ok(())
///     }
///     fn inertia(&self) -> Option<Inertia> { None }
/// }
/// let pattern = Pattern::from_columns(vec![vec![], vec![]]);
/// let mut factorizer = Diagonal.analyze(&pattern, MatrixClass::Definite, None)?;
/// let mut x = [2.0, 6.0];
/// factorizer.factorize(&[2.0, 3.0])?.solve_in_place(&mut x)?;
/// assert_eq!(x, [1.0, 2.0]);
/// # Ok::<(), LinearError>(())
/// ```
pub trait LinearSolver: Send + Sync {
    /// The symbolic phase, once per pattern. `order` is an elimination order (old index at each new
    /// place) where the caller knows a good one; it has each multiplier
    /// after the unknowns of its row.
    ///
    /// # Errors
    /// Where the pattern is too large or malformed.
    fn analyze(
        &self,
        pattern: &Pattern,
        class: MatrixClass,
        order: Option<&[usize]>,
    ) -> Result<Box<dyn Factorizer>, LinearError>;

    /// Whether pressures of zones are to stay unknowns that are not condensed into the matrix, and the rest of their terms' matrices is
    /// to be left to the points; [`Factorizer::factorize_at`] is then given both. The unknowns keep the order of the particles,
    /// multipliers behind them.
    fn keeps_pressures(&self) -> bool {
        false
    }

    /// Krylov iterations that each solution so far has taken; none for direct solvers.
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
    fn preconditioner(&self, _nodes: &[Point<3>]) -> Option<Arc<dyn LinearSolver>> {
        None
    }
}

impl<T: LinearSolver + ?Sized> LinearSolver for Arc<T> {
    fn analyze(
        &self,
        pattern: &Pattern,
        class: MatrixClass,
        order: Option<&[usize]>,
    ) -> Result<Box<dyn Factorizer>, LinearError> {
        (**self).analyze(pattern, class, order)
    }

    fn keeps_pressures(&self) -> bool {
        (**self).keeps_pressures()
    }

    fn krylov_iterations(&self) -> Vec<usize> {
        (**self).krylov_iterations()
    }

    fn ranks(&self) -> Option<Arc<dyn Ranks>> {
        (**self).ranks()
    }

    fn preconditioner(&self, nodes: &[Point<3>]) -> Option<Arc<dyn LinearSolver>> {
        (**self).preconditioner(nodes)
    }
}

/// The numeric phase, repeated for each set of values.
///
/// Implemented as shown at [`LinearSolver`].
pub trait Factorizer: Send {
    /// Factorises the matrix with these lower values. Factors may look at the values again, to tell how well they
    /// solve, which saves a copy of the matrix.
    ///
    /// # Errors
    /// Where the matrix is singular or not finite.
    fn factorize<'a>(&'a mut self, values: &'a [f64]) -> Result<Box<dyn Factors + 'a>, LinearError>;

    /// Factorises a system that is known with its state.
    ///
    /// # Errors
    /// As [`factorize`](Factorizer::factorize).
    fn factorize_at<'a>(
        &'a mut self,
        system: Linearised<'a>,
        _at: StateRef<'_>,
    ) -> Result<Box<dyn Factors + 'a>, LinearError> {
        self.factorize(system.values)
    }

    /// Gives back the memory of large factors that are no longer looked at: called before another matrix is formed, so
    /// that it is never held beside the factors of the last one. Nothing needs to be written for it.
    fn release(&mut self) {}

    /// Bytes that the factors take, where the method knows them.
    fn bytes(&self) -> Option<usize> {
        None
    }
}

/// A factorised matrix.
///
/// Implemented as shown at [`LinearSolver`].
pub trait Factors {
    /// Solves $Ax = b$ in place.
    ///
    /// # Errors
    /// Where the result is not finite.
    fn solve_in_place(&self, rhs: &mut [f64]) -> Result<(), LinearError>;

    /// Signs of the pivots, where the method knows them.
    fn inertia(&self) -> Option<Inertia>;

    /// Solves together with the equations of the pressures that are kept uncondensed: `pressures` holds the right-hand sides $g$ of
    /// $C\\,\delta d - H^{-1} q = g$, zone by zone, and receives $q$. Solvers without such pressures leave them as they are.
    ///
    /// # Errors
    /// As [`solve_in_place`](Factors::solve_in_place).
    fn solve_apart(&self, rhs: &mut [f64], _pressures: &mut [[f64; 4]]) -> Result<(), LinearError> {
        self.solve_in_place(rhs)
    }

    /// The part of the residual that the last solution has left; 0 for factors. What an iteration leaves is found by Newton's
    /// next iteration, and is not refined: the reduced matrix is not all that it solves with.
    fn relative_residual(&self) -> f64 {
        0.0
    }
}
