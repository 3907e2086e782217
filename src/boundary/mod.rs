//! Essential conditions: constraint equations, and the strategies that enforce them.

mod at_particles;
mod constraints;
mod elimination;
mod equation;
mod multipliers;
mod over_boundary;
mod ownership;
mod prescribed_directions;
mod row_values;
mod transformation;

pub use constraints::Constraints;
pub use equation::ConstraintEquation;
pub(crate) use equation::{check_component, check_unknowns};
pub use multipliers::LagrangeMultipliers;
pub(crate) use multipliers::{Unaugmented, dependent_rows};
pub(crate) use over_boundary::{BoundaryPiece, InterfaceSide, facet_neighbours, rounding};
pub(crate) use ownership::Claims;
pub(crate) use prescribed_directions::is_redundant;
pub use row_values::Motion;
pub(crate) use row_values::{Prescription, moved, scaled};
pub use transformation::MixedTransformation;

use crate::assembly::{Pattern, System};
use crate::error::BoundaryError;
use crate::linear::MatrixClass;

/// Rejects malformed patterns, and constraint equations with unknowns beyond them.
pub(crate) fn pattern_fits(pattern: &Pattern, equations: &Constraints) -> Result<(), BoundaryError> {
    if let Err(error) = pattern.validate() {
        return Err(BoundaryError::Unsuitable { enforcement: "pattern", reason: error.to_string() });
    }
    check_unknowns(equations.equations(), pattern.size())
}

/// A way to enforce constraint equations $\sum_k c_k d_k = g(\lambda)$.
///
/// Exact strategies span the same space, so that their solutions agree. Implemented as shown by
/// [`Enforced`].
pub trait Enforcement: Send + Sync {
    /// Binds constraint equations to the pattern of a model.
    ///
    /// # Errors
    /// Where constraint equations depend on each other, or the strategy can't serve them.
    fn bind(&self, pattern: &Pattern, equations: &Constraints) -> Result<Box<dyn Enforced>, BoundaryError>;
}

/// Constraint equations bound to a pattern: reduces the full system and recovers the full increment.
///
/// With unknowns $\hat d$ and $\delta d = T\hat d + \delta d_g$ (mixed transformation) or
/// $(\delta d, \mu) = \hat d$ (multipliers):
///
/// ```
/// use rkpm::assembly::{Pattern, System};
/// use rkpm::boundary::{Constraints, Enforced, Enforcement};
/// use rkpm::error::BoundaryError;
/// use rkpm::linear::MatrixClass;
/// use rkpm::prelude::{Block, PlaneStrain, Rubber, Scene, Scheme, Side};
/// /// Penalty: ½ p (c·d − g)² for every constraint equation.
/// struct Penalty(f64);
/// struct Bound { full: Pattern, pattern: Pattern, equations: Vec<Vec<(usize, f64)>>, penalty: f64 }
/// impl Enforcement for Penalty {
///     fn bind(&self, full: &Pattern, equations: &Constraints) -> Result<Box<dyn Enforced>, BoundaryError> {
///         let equations: Vec<_> = equations.equations().iter().map(|equation| equation.entries.clone()).collect();
///         // A constraint equation couples all of its unknowns: the lower triangle needs an entry for each two of them.
///         let mut columns: Vec<Vec<u32>> = (0..full.size()).map(|c| full.column(c).to_vec()).collect();
///         for equation in &equations {
///             for &(a, _) in equation {
///                 columns[a].extend(equation.iter().map(|e| e.0 as u32).filter(|&b| b as usize > a));
///             }
///         }
///         let (full, pattern) = (full.clone(), Pattern::from_columns(columns));
///         Ok(Box::new(Bound { full, pattern, equations, penalty: self.0 }))
///     }
/// }
/// impl Enforced for Bound {
///     fn pattern(&self) -> &Pattern { &self.pattern }
///     fn class(&self) -> MatrixClass { MatrixClass::Definite }
///     fn unknowns(&self) -> usize { self.pattern.size() }
///     fn reduce(&mut self, full: &System, values: &mut Vec<f64>) {
///         values.clear();
///         values.resize(self.pattern.entries(), 0.0);
///         let mut add = |row, column, value| {
///             if let Some(place) = self.pattern.find(row, column) { values[place] += value; }
///         };
///         for c in 0..self.full.size() {
///             let first = self.full.columns[c];
///             for (k, &row) in self.full.column(c).iter().enumerate() { add(row as usize, c, full.values[first + k]); }
///         }
///         for equation in &self.equations {
///             for &(a, x) in equation {
///                 for &(b, y) in equation.iter().filter(|e| e.0 >= a) { add(b, a, self.penalty * x * y); }
///             }
///         }
///     }
///     fn restrict(&self, force: &[f64], violation: &[f64], _: &System, rhs: &mut Vec<f64>) {
///         rhs.clear();
///         rhs.extend_from_slice(force);
///         for (equation, g) in self.equations.iter().zip(violation) {
///             for &(k, c) in equation { rhs[k] += self.penalty * c * g; }
///         }
///     }
///     fn project(&self, full: &[f64], out: &mut Vec<f64>) { out.clear(); out.extend_from_slice(full); }
///     fn imbalance(&self, residual: &[f64], multipliers: &[f64], out: &mut Vec<f64>) {
///         self.project(residual, out);
///         for (equation, mu) in self.equations.iter().zip(multipliers) {
///             for &(k, c) in equation { out[k] += mu * c; }
///         }
///     }
///     fn recover(&self, solved: &[f64], violation: &[f64], step: &mut [f64], multipliers: &mut [f64]) {
///         step.copy_from_slice(solved);
///         // The reactions, µ = p (c·d − g) behind the step: `react` has nothing left to do.
///         for ((equation, g), mu) in self.equations.iter().zip(violation).zip(multipliers) {
///             *mu = self.penalty * (equation.iter().map(|&(k, c)| c * step[k]).sum::<f64>() - g);
///         }
///     }
/// }
/// let pulled = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e2)?)
///     .hold(Side::Min)
///     .prescribe(Side::Max, 0, 0.1);
/// let mut problem = pulled.discretize(&Scheme::default().particles([5, 3]))?;
/// let exact = problem.run()?.completed()?;
/// problem.analysis_mut().enforcement = Box::new(Penalty(1e8));
/// let penalised = problem.run()?.completed()?;
/// let force = |path: &rkpm::solve::EquilibriumPath| problem.reaction(path.last(), Side::Max).map(|f| f[0]);
/// assert!((force(&penalised)? / force(&exact)? - 1.0).abs() < 1e-5);
/// # Ok::<(), rkpm::Error>(())
/// ```
pub trait Enforced: Send {
    /// Pattern of the reduced matrix.
    fn pattern(&self) -> &Pattern;

    /// Class of the reduced matrix.
    fn class(&self) -> MatrixClass;

    /// Number of reduced unknowns.
    fn unknowns(&self) -> usize;

    /// Writes the values of the reduced matrix from the symmetric part of the full one.
    fn reduce(&mut self, full: &System, values: &mut Vec<f64>);

    /// Writes the reduced right-hand side for the full one `force` ($-r$) and `violation` ($g - Gd$). The full matrix is gone by then:
    /// what is needed of it is kept by [`reduce`](Enforced::reduce).
    fn restrict(&self, force: &[f64], violation: &[f64], full: &System, rhs: &mut Vec<f64>);

    /// $T^T v$ for a full vector, zero at the multipliers.
    fn project(&self, full: &[f64], out: &mut Vec<f64>);

    /// What is left of a residual once the conditions have taken their reactions, unknown by reduced unknown: zero at
    /// equilibrium.
    fn imbalance(&self, residual: &[f64], _multipliers: &[f64], out: &mut Vec<f64>) {
        self.project(residual, out);
    }

    /// Adds $K\\,\delta d$ of the matrix that was reduced last to a residual, wherever [`react`](Enforced::react) looks at it.
    fn stiffen(&self, _step: &[f64], _full: &System, _residual: &mut [f64]) {}

    /// Writes the multipliers $\mu$ that balance a residual, $r + G^T\mu = 0$, where they are not unknowns.
    fn react(&self, _residual: &[f64], _multipliers: &mut [f64]) {}

    /// Writes the full increment for a reduced solution and violation; multiplier strategies also write their multipliers.
    fn recover(&self, solved: &[f64], violation: &[f64], step: &mut [f64], multipliers: &mut [f64]);

    /// Renumbers the reduced unknowns so that `order[k]` becomes `k`, a permutation of all of them; `false` where they
    /// stay as they are. A matrix that comes in the order of its elimination is factorised without another copy.
    fn renumber(&mut self, _order: &[usize]) -> bool {
        false
    }

    /// Positions of the reduced unknowns in the full vector, for an elimination order; multipliers have none, and stand last
    /// until the unknowns are renumbered.
    fn full_index(&self, reduced: usize) -> Option<usize> {
        Some(reduced)
    }
}
