//! Energies of the principal stretches.

use super::constants::{exponent, finite, positive};
use crate::each::Each;
use crate::error::MaterialError;
use crate::geometry::{Mat3, Vec3};

/// A symmetric energy of three logarithmic stretches with its derivatives \[stress\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Principal {
    /// $\bar W$.
    pub energy: f64,
    /// $\partial\bar W/\partial\ln\bar\lambda_a$.
    pub gradient: Vec3,
    /// $\partial^2\bar W/\partial\ln\bar\lambda_a\\,\partial\ln\bar\lambda_b$.
    pub hessian: Mat3,
}

/// A distortional energy $\bar W(\bar\lambda_1,\bar\lambda_2,\bar\lambda_3)$ of the principal stretches
/// of $\bar F = J^{-1/3}F$, symmetric in its arguments.
///
/// It is handed $\ln\bar\lambda_a$, which add up to zero, and differentiates with respect to them as if
/// they were independent: for $\bar W = \sum_a w(\bar\lambda_a)$ the gradient is $\bar\lambda_aw'$ and
/// the diagonal of the Hessian $\bar\lambda_aw' + \bar\lambda_a^2w''$. [`PrincipalStretches`](super::PrincipalStretches) makes a
/// [`Material`](super::Material) of it. The exponentiated Hencky energy
/// $\frac{\mu}{\kappa}\left(e^{\kappa\sum_a(\ln\bar\lambda_a)^2} - 1\right)$:
///
/// ```
/// use rkpm::material::{Material, Principal, PrincipalEnergy, PrincipalStretches};
/// use rkpm::nalgebra::{Matrix3, Vector3};
///
/// struct ExponentiatedHencky { mu: f64, kappa: f64 }
///
/// impl PrincipalEnergy for ExponentiatedHencky {
///     fn evaluate(&self, logarithms: [f64; 3]) -> Principal {
///         let h = Vector3::from(logarithms);
///         let exponent = self.kappa * h.norm_squared();
///         let factor = 2.0 * self.mu * exponent.exp();
///         Principal {
///             energy: self.mu / self.kappa * exponent.exp_m1(),
///             gradient: factor * h,
///             hessian: factor * (Matrix3::identity() + 2.0 * self.kappa * h * h.transpose()),
///         }
///     }
/// }
///
/// let material = PrincipalStretches(ExponentiatedHencky { mu: 1.5, kappa: 0.3 });
/// assert!((material.initial_moduli().shear - 1.5).abs() < 1e-14);
/// ```
pub trait PrincipalEnergy: Send + Sync {
    /// The energy and its derivatives at $\ln\bar\lambda_1, \ln\bar\lambda_2, \ln\bar\lambda_3$.
    fn evaluate(&self, logarithms: [f64; 3]) -> Principal;
}

/// The Ogden energy $\bar W = \sum_p \frac{\mu_p}{\alpha_p}
/// \left(\bar\lambda_1^{\alpha_p} + \bar\lambda_2^{\alpha_p} + \bar\lambda_3^{\alpha_p} - 3\right)$,
/// initial shear modulus $\mu_0 = \frac12\sum_p\mu_p\alpha_p$.
///
/// (Ogden, Proceedings of the Royal Society A 326, 1972.)
///
/// ```
/// use rkpm::material::{NearlyIncompressible, Ogden, PrincipalStretches, QuadraticVolume};
///
/// // Treloar's rubber as fitted by Ogden, MPa.
/// let rubber = NearlyIncompressible {
///     distortional: PrincipalStretches(Ogden::new([(0.618, 1.3), (0.001245, 5.0), (-0.00981, -2.0)])?),
///     volumetric: QuadraticVolume::new(1e3)?,
/// };
/// # let _ = rubber;
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Ogden {
    /// Pairs (µ_p, α_p).
    terms: Vec<(f64, f64)>,
}

/// How programs write the terms of Ogden's energy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum OgdenConvention {
    /// $\frac{\mu_p}{\alpha_p}\sum_a(\bar\lambda_a^{\alpha_p}-1)$: this crate, Ogden's paper, Ansys, COMSOL, LS-DYNA, Marc.
    Nominal,
    /// $\frac{2\mu_p}{\alpha_p^2}\sum_a(\bar\lambda_a^{\alpha_p}-1)$: Abaqus, CalculiX. The $\mu_p$ add up to the initial shear modulus.
    ShearModuli,
    /// $\frac{c_p}{\alpha_p^2}\sum_a(\bar\lambda_a^{\alpha_p}-1)$: FEBio. The $c_p$ add up to twice the initial shear modulus.
    Squared,
}

impl Ogden {
    /// The energy with terms $(\mu_p, \alpha_p)$, $\mu_p$ in \[stress\].
    ///
    /// # Errors
    /// [`MaterialError::Invalid`] for constants that aren't finite, $\alpha_p = 0$, and an initial
    /// shear modulus (hence also an empty list) that isn't above zero.
    pub fn new(terms: impl IntoIterator<Item = (f64, f64)>) -> Result<Self, MaterialError> {
        let terms: Vec<_> = terms.into_iter().collect();
        for (p, &(mu, alpha)) in terms.iter().enumerate() {
            finite(format!("mu_{}", p + 1), mu)?;
            exponent(p, alpha)?;
        }
        let shear: f64 = terms.summed(|(mu, alpha)| 0.5 * mu * alpha);
        positive("initial shear modulus (sum of mu_p alpha_p / 2)", shear)?;
        Ok(Self { terms })
    }

    /// The energy with constants in the convention of another program; `terms` are its pairs (modulus, exponent).
    pub(crate) fn in_convention(
        convention: OgdenConvention,
        terms: impl IntoIterator<Item = (f64, f64)>,
    ) -> Result<Self, MaterialError> {
        let factor = |alpha: f64| match convention {
            OgdenConvention::Nominal => 1.0,
            OgdenConvention::ShearModuli => 2.0 / alpha,
            OgdenConvention::Squared => 1.0 / alpha,
        };
        // An exponent of zero is refused by `new`, whatever its modulus.
        let scaled = |(c, alpha): (f64, f64)| (if alpha == 0.0 { c } else { c * factor(alpha) }, alpha);
        Self::new(terms.into_iter().map(scaled))
    }
}

impl PrincipalEnergy for Ogden {
    fn evaluate(&self, logarithms: [f64; 3]) -> Principal {
        let mut sum = Principal { energy: 0.0, gradient: Vec3::zeros(), hessian: Mat3::zeros() };
        for &(mu, alpha) in &self.terms {
            for (a, logarithm) in logarithms.into_iter().enumerate() {
                // λ^α - 1 without cancellation near λ = 1.
                let excess = (alpha * logarithm).exp_m1();
                sum.energy += mu / alpha * excess;
                sum.gradient[a] += mu * (1.0 + excess);
                sum.hessian[(a, a)] += mu * alpha * (1.0 + excess);
            }
        }
        sum
    }
}

/// The Hencky energy $\bar W = \mu\sum_a(\ln\bar\lambda_a)^2$, quadratic in the logarithmic strain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hencky {
    /// Shear modulus $\mu$ \[stress\].
    pub shear: f64,
}

impl Hencky {
    /// The energy with shear modulus `shear` $= \mu$.
    ///
    /// # Errors
    /// [`MaterialError::Invalid`] unless it is finite and above zero.
    pub fn new(shear: f64) -> Result<Self, MaterialError> {
        positive("mu", shear)?;
        Ok(Self { shear })
    }
}

impl PrincipalEnergy for Hencky {
    fn evaluate(&self, logarithms: [f64; 3]) -> Principal {
        let logarithms = Vec3::from(logarithms);
        Principal {
            energy: self.shear * logarithms.norm_squared(),
            gradient: 2.0 * self.shear * logarithms,
            hessian: Mat3::from_diagonal_element(2.0 * self.shear),
        }
    }
}
