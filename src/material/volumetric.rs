//! Volumetric energies $U(J)$.

use crate::error::MaterialError;

/// $U$, $U'$ and $U''$ at one $J$ \[stress\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Volumetric {
    /// $U(J)$.
    pub energy: f64,
    /// $U'(J)$: the hydrostatic pressure (2.15).
    pub slope: f64,
    /// $U''(J)$; at $J = 1$ the bulk modulus.
    pub curvature: f64,
}

/// An energy of the volume change.
///
/// ```
/// use rkpm::material::{Volumetric, VolumetricEnergy};
/// /// k/2 (J − 1)²/J², infinite at J = 0.
/// struct Stiffening(f64);
/// impl VolumetricEnergy for Stiffening {
///     fn evaluate(&self, j: f64) -> Volumetric {
///         let q = 1.0 - 1.0 / j;
///         Volumetric {
///             energy: 0.5 * self.0 * q * q,
///             slope: self.0 * q / (j * j),
///             curvature: self.0 * (1.0 / j - 2.0 * q) / j.powi(3),
///         }
///     }
/// }
/// assert_eq!(Stiffening(7.0).evaluate(1.0).curvature, 7.0);
/// ```
pub trait VolumetricEnergy: Send + Sync {
    /// $U$, $U'$, $U''$ at $J$.
    fn evaluate(&self, j: f64) -> Volumetric;
}

/// Refuses bulk moduli that are not positive numbers.
fn check_bulk(k: f64) -> Result<f64, MaterialError> {
    if k > 0.0 && k.is_finite() {
        Ok(k)
    } else {
        Err(MaterialError::Constant {
            name: "k".into(),
            value: k,
            needed: "a bulk modulus is a finite number above zero",
        })
    }
}

/// $U = \tfrac k2(J-1)^2$ (2.10).
///
/// Finite at $J = 0$, against (5.10): the solver guards $J > 0$.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticVolume {
    /// Bulk modulus $k$ \[stress\].
    pub bulk: f64,
}

impl QuadraticVolume {
    /// With bulk modulus $k$ \[stress\].
    ///
    /// # Errors
    /// For $k \le 0$ or not finite.
    pub fn new(k: f64) -> Result<Self, MaterialError> {
        Ok(QuadraticVolume { bulk: check_bulk(k)? })
    }
}

impl VolumetricEnergy for QuadraticVolume {
    #[inline]
    fn evaluate(&self, j: f64) -> Volumetric {
        let q = j - 1.0;
        Volumetric { energy: 0.5 * self.bulk * q * q, slope: self.bulk * q, curvature: self.bulk }
    }
}

/// $U = \tfrac k4(J^2 - 1 - 2\ln J)$, infinite at $J = 0$ as (5.10) asks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MixedLogarithmicVolume {
    /// Bulk modulus $k$ \[stress\].
    pub bulk: f64,
}

impl MixedLogarithmicVolume {
    /// With bulk modulus $k$ \[stress\].
    ///
    /// # Errors
    /// For $k \le 0$ or not finite.
    pub fn new(k: f64) -> Result<Self, MaterialError> {
        Ok(MixedLogarithmicVolume { bulk: check_bulk(k)? })
    }
}

impl VolumetricEnergy for MixedLogarithmicVolume {
    fn evaluate(&self, j: f64) -> Volumetric {
        let k = self.bulk;
        // ln of J ≤ 0 is NaN or infinite: the solver rejects the step.
        Volumetric {
            energy: 0.25 * k * (j * j - 1.0 - 2.0 * j.ln()),
            slope: 0.5 * k * (j - 1.0 / j),
            curvature: 0.5 * k * (1.0 + 1.0 / (j * j)),
        }
    }
}

/// $U = \tfrac k2(\ln J)^2$; not convex beyond $J = e$.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogarithmicVolume {
    /// Bulk modulus $k$ \[stress\].
    pub bulk: f64,
}

impl LogarithmicVolume {
    /// With bulk modulus $k$ \[stress\].
    ///
    /// # Errors
    /// For $k \le 0$ or not finite.
    pub fn new(k: f64) -> Result<Self, MaterialError> {
        Ok(LogarithmicVolume { bulk: check_bulk(k)? })
    }
}

impl VolumetricEnergy for LogarithmicVolume {
    fn evaluate(&self, j: f64) -> Volumetric {
        let l = j.ln();
        Volumetric {
            energy: 0.5 * self.bulk * l * l,
            slope: self.bulk * l / j,
            curvature: self.bulk * (1.0 - l) / (j * j),
        }
    }
}
