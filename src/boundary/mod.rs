//! Essential conditions: rows, and the strategies that enforce them.

mod elimination;
mod full;
mod multipliers;
mod rows;
mod transformation;

pub use full::FullTransformation;
pub use multipliers::LagrangeMultipliers;
pub(crate) use multipliers::dependent_rows;
pub(crate) use rows::check_unknowns;
pub use rows::{Constraints, Motion, Row};
pub use transformation::MixedTransformation;

use crate::assembly::{Pattern, System};
use crate::error::BoundaryError;
use crate::linear::MatrixClass;

/// Refuses patterns that are none, and rows beyond them.
fn pattern_fits(pattern: &Pattern, rows: &Constraints) -> Result<(), BoundaryError> {
    if let Err(error) = pattern.validate() {
        return Err(BoundaryError::Unsuitable { enforcement: "pattern", reason: error.to_string() });
    }
    check_unknowns(rows.rows(), pattern.size())
}

/// A way to enforce rows $\sum_k c_k d_k = g(\lambda)$.
///
/// Exact strategies span the same space, so that their solutions agree. Implemented as shown by
/// [`Enforced`].
pub trait Enforcement: Send + Sync {
    /// Binds rows to the pattern of a model.
    ///
    /// # Errors
    /// Where rows depend on each other, or the strategy can't serve them.
    fn bind(&self, pattern: &Pattern, rows: &Constraints) -> Result<Box<dyn Enforced>, BoundaryError>;
}

/// Rows bound to a pattern: reduces the full system and recovers the full increment.
///
/// With unknowns $\hat d$ and $\delta d = T\hat d + \delta d_g$ (mixed transformation) or
/// $(\delta d, \mu) = \hat d$ (multipliers):
///
/// ```
/// use rkpm::assembly::{Pattern, System};
/// use rkpm::boundary::{Constraints, Enforced, Enforcement};
/// use rkpm::error::BoundaryError;
/// use rkpm::linear::MatrixClass;
/// /// Penalty: ½ p (c·d − g)² for rows of one entry.
/// struct Penalty(f64);
/// struct Bound { pattern: Pattern, rows: Vec<(usize, f64)>, penalty: f64 }
/// impl Enforcement for Penalty {
///     fn bind(&self, pattern: &Pattern, rows: &Constraints) -> Result<Box<dyn Enforced>, BoundaryError> {
///         let rows = rows.rows().iter().map(|r| r.entries[0]).collect();
///         Ok(Box::new(Bound { pattern: pattern.clone(), rows, penalty: self.0 }))
///     }
/// }
/// impl Enforced for Bound {
///     fn pattern(&self) -> &Pattern { &self.pattern }
///     fn class(&self) -> MatrixClass { MatrixClass::Definite }
///     fn unknowns(&self) -> usize { self.pattern.size() }
///     fn reduce(&mut self, full: &System, values: &mut Vec<f64>) {
///         values.clone_from(&full.values);
///         for &(d, c) in &self.rows {
///             values[self.pattern.columns[d]] += self.penalty * c * c;
///         }
///     }
///     fn restrict(&self, force: &[f64], gap: &[f64], _: &System, rhs: &mut Vec<f64>) {
///         rhs.clear();
///         rhs.extend_from_slice(force);
///         for (&(d, c), g) in self.rows.iter().zip(gap) {
///             rhs[d] += self.penalty * c * g;
///         }
///     }
///     fn project(&self, full: &[f64], out: &mut Vec<f64>) { out.clear(); out.extend_from_slice(full); }
///     fn recover(&self, solved: &[f64], _: &[f64], step: &mut [f64], _: &mut [f64]) { step.copy_from_slice(solved); }
/// }
/// # let _ = Penalty(1e6);
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

    /// Writes the reduced right-hand side for the full one `force` ($-r$) and `gap` ($g - Gd$).
    fn restrict(&self, force: &[f64], gap: &[f64], full: &System, rhs: &mut Vec<f64>);

    /// $T^T v$ for a full vector, zero in the rows of multipliers.
    fn project(&self, full: &[f64], out: &mut Vec<f64>);

    /// What is left of a residual once the conditions have taken their reactions, unknown by reduced unknown: zero at
    /// equilibrium.
    fn imbalance(&self, residual: &[f64], _multipliers: &[f64], out: &mut Vec<f64>) {
        self.project(residual, out);
    }

    /// Writes the multipliers $\mu$ that balance a residual, $r + G^T\mu = 0$, where they are not unknowns.
    fn react(&self, _residual: &[f64], _multipliers: &mut [f64]) {}

    /// Writes the full increment for a reduced solution and gap; multiplier strategies also write their multipliers.
    fn recover(&self, solved: &[f64], gap: &[f64], step: &mut [f64], multipliers: &mut [f64]);

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
