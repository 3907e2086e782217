//! Enforced constraint equations, as matrices.

use crate::error::BoundaryError;

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
