//! Carroll's energy.

use super::constants::{finite, positive};
use super::{Distortion, InvariantEnergy};
use crate::error::MaterialError;

/// The energy of Carroll, $\bar W = A(\bar I_1 - 3) + B(\bar I_1^4 - 81) + C\big(\sqrt{\bar I_2} - \sqrt3\big)$, three constants
/// that follow Treloar's rubber in tension, equibiaxial tension and shear.
///
/// Initial shear modulus $2\big(A + 108B + \tfrac{C}{2\sqrt3}\big)$. (Carroll, Journal of Elasticity 103, 2011.)
///
/// ```
/// use rkpm::material::{Carroll, Invariants, Material};
/// let law = Invariants(Carroll::new(0.15, 3.1e-7, 0.095)?); // MPa, as Carroll fitted Treloar's rubber
/// assert!((law.initial_moduli().shear - 2.0 * (0.15 + 108.0 * 3.1e-7 + 0.095 / 12f64.sqrt())).abs() < 1e-15);
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carroll {
    /// $A$, $B$, $C$ \[stress\].
    constants: [f64; 3],
}

impl Carroll {
    /// The energy with $A$, $B$ and $C$ \[stress\].
    ///
    /// # Errors
    /// [`MaterialError::Invalid`] for constants that are not finite and an initial shear modulus not above zero.
    pub fn new(a: f64, b: f64, c: f64) -> Result<Self, MaterialError> {
        for (name, value) in [("A", a), ("B", b), ("C", c)] {
            finite(name, value)?;
        }
        positive("initial shear modulus 2 (A + 108 B + C/√12)", 2.0 * (a + 108.0 * b + c / 12f64.sqrt()))?;
        Ok(Self { constants: [a, b, c] })
    }
}

impl InvariantEnergy for Carroll {
    fn evaluate(&self, i1: f64, i2: f64) -> Distortion {
        self.evaluate_excess(i1 - 3.0, i2 - 3.0)
    }

    fn evaluate_excess(&self, x: f64, y: f64) -> Distortion {
        let [a, b, c] = self.constants;
        let (i1, i2) = (3.0 + x, 3.0 + y);
        let root = i2.sqrt();
        Distortion {
            // I1⁴ - 81 and √I2 - √3 without cancellation.
            energy: a * x + b * x * (108.0 + x * (54.0 + x * (12.0 + x))) + c * y / (root + 3f64.sqrt()),
            w1: a + 4.0 * b * i1.powi(3),
            w2: 0.5 * c / root,
            w11: 12.0 * b * i1 * i1,
            w12: 0.0,
            w22: -0.25 * c / (i2 * root),
        }
    }
}
