//! Ways to enforce constraint equations.

use crate::assembly::Pattern;
use crate::error::BoundaryError;

use super::Constraints;
use super::elimination::{dependent, eliminate};
use super::enforced::Enforced;

/// A way to enforce constraint equations $\sum_k c_k d_k = g(\lambda)$.
///
/// Exact strategies span the same space, so that their solutions agree. One of one's own tells its matrices:
///
/// ```
/// use rkpm::assembly::Pattern;
/// use rkpm::boundary::{Constraints, Enforced, Enforcement};
/// use rkpm::error::BoundaryError;
/// use rkpm::prelude::{Block, PlaneStrain, Rubber, Scene, Scheme, Side};
/// /// ½ p k (c·d − g)² for each constraint equation: k the largest entry of the stiffness, c and g over the largest coefficient.
/// struct Penalty(f64);
/// impl Enforcement for Penalty {
///     fn bind(&self, _: &Pattern, equations: &Constraints) -> Result<Enforced, BoundaryError> {
///         Ok(Enforced { penalty: vec![self.0; equations.equations().len()], ..Enforced::default() })
///     }
/// }
/// let pulled = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e2)?)
///     .hold(Side::Min)
///     .prescribe(Side::Max, 0, 0.1);
/// let mut problem = pulled.discretize(&Scheme::default().particles([5, 3]))?;
/// let exact = problem.run()?.completed()?;
/// problem.analysis_mut().enforcement = Box::new(Penalty(1e7));
/// let penalised = problem.run()?.completed()?;
/// let force = |path: &rkpm::solve::EquilibriumPath| problem.reaction(path.last(), Side::Max).map(|f| f[0]);
/// assert!((force(&penalised)? / force(&exact)? - 1.0).abs() < 1e-5);
/// # Ok::<(), rkpm::Error>(())
/// ```
pub trait Enforcement: Send + Sync {
    /// The matrices that enforce constraint equations on the unknowns of a pattern.
    ///
    /// # Errors
    /// Where constraint equations depend on each other, or the strategy can't serve them.
    fn bind(&self, pattern: &Pattern, equations: &Constraints) -> Result<Enforced, BoundaryError>;
}

/// The mixed transformation: as many unknowns as there are constraint equations are expressed by the others,
/// $d_p = W d_f + V g$, so that the constraint equations hold exactly and the reduced matrix stays definite (4.28)–(4.45).
///
/// With constraint equations at particles this is the transformation (4.32), (4.42) of the constrained particles alone.
/// Constraint equations that share unknowns are eliminated together (Gauss–Jordan with complete pivoting), which
/// couples a whole constrained face; above [`limit`](MixedTransformation::limit) constraint equations in one such group
/// take [`LagrangeMultipliers`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MixedTransformation {
    /// Most constraint equations that may be eliminated together; the cost grows with its third power.
    pub limit: usize,
}

impl Default for MixedTransformation {
    /// 2000 constraint equations: about 100 MB and a few seconds.
    fn default() -> Self {
        MixedTransformation { limit: 2000 }
    }
}

impl Enforcement for MixedTransformation {
    fn bind(&self, _: &Pattern, equations: &Constraints) -> Result<Enforced, BoundaryError> {
        Ok(Enforced { eliminated: eliminate(equations.equations(), self.limit)?, ..Enforced::default() })
    }
}

/// Lagrange multipliers (4.5)–(4.19): the saddle point system (4.11), which is that of [`Enforced`] with nothing eliminated and $P = 1$.
///
/// Each multiplier is eliminated right after the last unknown of its constraint equation. The augmentation $G^T P\\,G$ does not change the
/// solution; it makes the block of the unknowns regular where the constraint equations alone support the body.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LagrangeMultipliers;

/// The same system without its augmentation, which couples all particles near a face: for iterations that meet the constraint
/// equations in every direction.
pub(crate) struct Unaugmented;

impl Enforcement for LagrangeMultipliers {
    fn bind(&self, pattern: &Pattern, equations: &Constraints) -> Result<Enforced, BoundaryError> {
        Ok(Enforced { penalty: vec![1.0; equations.len()], ..Unaugmented.bind(pattern, equations)? })
    }
}

impl Enforcement for Unaugmented {
    fn bind(&self, _: &Pattern, equations: &Constraints) -> Result<Enforced, BoundaryError> {
        match dependent(equations.equations()).into_iter().next() {
            Some(error) => Err(error),
            None => Ok(Enforced { multipliers: true, ..Enforced::default() }),
        }
    }
}
