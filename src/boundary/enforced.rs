//! Enforced constraint equations, as matrices.

use crate::each::{Each, list_of};
use crate::error::BoundaryError;

use super::Constraints;

/// A constraint equation of which elimination leaves less than this part of its size depends on others.
pub(super) const DEPENDENT: f64 = 1e-10;
/// What rounding leaves of equations that are eliminated by the least pivot, relative to their parts.
const ROUNDING: f64 = f64::EPSILON / DEPENDENT;
/// The golden ratio: the fractions of its multiples are all different and spread evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Constraint equations $G d = g$ as they are enforced: eliminated, by multipliers, or by a penalty.
///
/// With $d = Tq + Vg$ the equations of equilibrium become
/// $$\begin{bmatrix}T^T K\\,T + G^T P\\,G & G^T\\ G & 0\end{bmatrix}
///   \begin{bmatrix}\delta q\\ \mu\end{bmatrix} = \begin{bmatrix}-T^T(r + K V\gamma) + G^T P\gamma\\ \gamma\end{bmatrix},
///   \qquad \gamma = g - G d,$$
/// where $V$ takes $\gamma$ of the equations that are eliminated; elsewhere $G$ and $\gamma$ are those of the others, over unknowns that
/// others do not express.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Enforced {
    /// The rows of $T$ and $V$ that are not those of the identity: $d_k = q_k$ for all other unknowns.
    pub eliminated: Vec<Eliminated>,
    /// Whether the equations that are not eliminated have multipliers.
    pub multipliers: bool,
    /// $P$, for each equation (entries of eliminated ones are ignored), in terms of the largest entry of $K$ and for
    /// equations divided by their largest coefficients: a penalty, or with multipliers an augmentation that does not change the solution.
    /// None where it is empty.
    pub penalty: Vec<f64>,
}

/// Unknowns as combinations of others and of what equations prescribe, $d_p = W q_f + V g$.
///
/// No unknown is expressed twice, and no equation is eliminated twice.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Eliminated {
    /// The unknowns $p$ that are expressed.
    pub unknowns: Vec<usize>,
    /// The unknowns $f$ that they are expressed by: an expressed one among them names what stands in its place in $q$.
    pub free: Vec<usize>,
    /// $W$, `unknowns × free`, row by row.
    pub transfer: Vec<f64>,
    /// The numbers of the constraint equations that are eliminated.
    pub equations: Vec<usize>,
    /// $V$, `unknowns × equations`, row by row.
    pub offsets: Vec<f64>,
}

impl Enforced {
    /// Refuses combinations that do not satisfy the equations they eliminate, $G\\,T = 0$ and $G\\,V = 1$: a displacement made of them
    /// shows it.
    pub(super) fn satisfies(&self, unknowns: usize, equations: &Constraints) -> Result<(), BoundaryError> {
        let any = |k: usize| ((k + 1) as f64 * GOLDEN).fract() - 0.5;
        let equations = equations.equations();
        let jump = |number: &usize| any(unknowns + number) * equations[*number].measure();
        let mut displacement: Vec<f64> = list_of(unknowns, any);
        for Eliminated { unknowns, free, transfer, equations, offsets } in &self.eliminated {
            for (p, &unknown) in unknowns.iter().enumerate() {
                let by_free = transfer[p * free.len()..].pair_sum(free, |w, &k| w * any(k));
                displacement[unknown] =
                    by_free + offsets[p * equations.len()..].pair_sum(equations, |v, e| v * jump(e));
            }
        }
        for number in self.eliminated.iter().flat_map(|of| &of.equations) {
            let equation = &equations[*number];
            let size = equation.entries.summed(|&(k, c)| (c * displacement[k]).abs()) + jump(number).abs();
            let off = (equation.value(&displacement) - jump(number)).abs();
            if !(off <= ROUNDING * size) {
                let reason = format!(
                    "{} is eliminated, but unknowns made of W and V do not satisfy it: off by {:.1e} of its parts; with G of the \
                     equations give W and V such that G W = 0 and G V = 1, those of all other unknowns included",
                    equation.label,
                    off / size
                );
                return Err(BoundaryError::Unsuitable { enforcement: "enforcement", reason });
            }
        }
        Ok(())
    }

    /// Refuses matrices that do not fit so many unknowns and equations, or each other.
    pub(super) fn check(&self, unknowns: usize, equations: usize) -> Result<(), BoundaryError> {
        let unsuitable = |reason: String| Err(BoundaryError::Unsuitable { enforcement: "enforcement", reason });
        let (mut expressed, mut eliminated) = (vec![false; unknowns], vec![false; equations]);
        for Eliminated { unknowns, free, transfer, equations, offsets } in &self.eliminated {
            if transfer.len() != unknowns.len() * free.len() || offsets.len() != unknowns.len() * equations.len() {
                return unsuitable("give a row of W and V for each unknown that is expressed".into());
            }
            if let Some(free) = free.iter().find(|&&k| k >= expressed.len()) {
                return unsuitable(format!("there is no unknown {free}: give numbers of unknowns of the model"));
            }
            for (what, numbers, seen) in
                [("unknown", unknowns, &mut expressed), ("constraint equation", equations, &mut eliminated)]
            {
                for &number in numbers {
                    if seen.get(number) != Some(&false) {
                        return unsuitable(format!(
                            "{what} {number} is not there or eliminated before: eliminate each one once"
                        ));
                    }
                    seen[number] = true;
                }
            }
        }
        if !self.penalty.is_empty() && self.penalty.len() != equations
            || self.penalty.iter().any(|p| !(p.is_finite() && *p >= 0.0))
        {
            return unsuitable(format!(
                "give a penalty of at least 0 for each of the {equations} constraint equations"
            ));
        }
        Ok(())
    }
}
