//! Energies with limited extensibility: Gent's, and with a logarithm of the second invariant.

use super::constants::{finite, positive};
use super::{Distortion, InvariantEnergy};
use crate::error::MaterialError;

/// The Gent energy $\bar W = -\frac{\mu J_m}{2}\ln\left(1 - \frac{\bar I_1-3}{J_m}\right)$, which
/// stiffens without bound as $\bar I_1 - 3$ nears $J_m$ and is NaN from there on.
///
/// For $J_m\to\infty$ it is the neo-Hookean energy $\frac\mu2(\bar I_1-3)$. (Gent, Rubber Chemistry
/// and Technology 69, 1996.)
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gent {
    /// Initial shear modulus $\mu$ \[stress\].
    pub shear: f64,
    /// Limit $J_m$ of $\bar I_1 - 3$.
    pub limit: f64,
}

impl Gent {
    /// The energy with initial shear modulus `shear` $= \mu$ and limit `limit` $= J_m$.
    ///
    /// # Errors
    /// [`MaterialError::Invalid`] unless both are finite and above zero.
    pub fn new(shear: f64, limit: f64) -> Result<Self, MaterialError> {
        positive("mu", shear)?;
        positive("J_m", limit)?;
        Ok(Self { shear, limit })
    }
}

impl InvariantEnergy for Gent {
    fn evaluate(&self, i1: f64, i2: f64) -> Distortion {
        self.evaluate_excess(i1 - 3.0, i2 - 3.0)
    }

    fn evaluate_excess(&self, x: f64, _: f64) -> Distortion {
        let used = x / self.limit;
        // Beyond the limit the derivatives are finite again, with the wrong sign: refuse them.
        if used.is_nan() || used >= 1.0 {
            return Distortion::undefined();
        }
        let w1 = 0.5 * self.shear / (1.0 - used);
        Distortion {
            energy: -0.5 * self.shear * self.limit * (-used).ln_1p(),
            w1,
            w11: w1 / (self.limit * (1.0 - used)),
            ..Distortion::default()
        }
    }
}

/// The energy of Gent with a term of the second invariant,
/// $\bar W = -\frac{\mu J_m}{2}\ln\left(1 - \frac{\bar I_1-3}{J_m}\right) + C_2\ln\frac{\bar I_2}{3}$,
/// initial shear modulus $\mu + \tfrac23C_2$. (Pucci and Saccomandi, Rubber Chemistry and Technology 75, 2002.)
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GentGent {
    /// The part of the first invariant.
    pub gent: Gent,
    /// $C_2$ \[stress\].
    pub second: f64,
}

impl GentGent {
    /// The energy with `shear` $= \mu$ \[stress\], `limit` $= J_m$ and `second` $= C_2$ \[stress\].
    ///
    /// # Errors
    /// [`MaterialError::Invalid`] unless $\mu$ and $J_m$ are finite and above zero, $C_2$ is finite, and the initial shear
    /// modulus is above zero.
    pub fn new(shear: f64, limit: f64, second: f64) -> Result<Self, MaterialError> {
        let gent = Gent::new(shear, limit)?;
        finite("C_2", second)?;
        positive("initial shear modulus mu + 2 C_2/3", shear + 2.0 / 3.0 * second)?;
        Ok(Self { gent, second })
    }
}

impl InvariantEnergy for GentGent {
    fn evaluate(&self, i1: f64, i2: f64) -> Distortion {
        self.evaluate_excess(i1 - 3.0, i2 - 3.0)
    }

    fn evaluate_excess(&self, x: f64, y: f64) -> Distortion {
        let mut sum = self.gent.evaluate_excess(x, y);
        let w2 = self.second / (3.0 + y);
        sum.energy += self.second * (y / 3.0).ln_1p();
        sum.w2 = w2;
        sum.w22 = -w2 / (3.0 + y);
        sum
    }
}
