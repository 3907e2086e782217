//! Energies of the principal stretches.

use super::rivlin::positive;
use crate::each::Each;
use crate::error::{Invalid, MaterialError};
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

/// A warning about the constants of an [`Ogden`] energy; see [`Ogden::warnings`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum OgdenWarning {
    /// A term with $\mu_p\alpha_p < 0$ softens: alone it is unstable, and where it outgrows the others so is the sum.
    Sign {
        /// The term, counted from 1.
        term: usize,
        /// $\mu_p$ \[stress\].
        mu: f64,
        /// $\alpha_p$.
        alpha: f64,
    },
    /// Terms of both signs cancel: the initial shear modulus is less than a tenth of the sum of their sizes.
    Cancelling {
        /// $\frac12\sum\mu_p\alpha_p$ \[stress\].
        modulus: f64,
        /// $\frac12\sum|\mu_p\alpha_p|$ \[stress\].
        largest: f64,
    },
}

impl std::fmt::Display for OgdenWarning {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Sign { term, mu, alpha } => {
                write!(f, "term {term}: mu = {mu:.4e} and alpha = {alpha:.4} have opposite signs, the term softens")
            }
            Self::Cancelling { modulus, largest } => {
                write!(f, "terms of both signs cancel: initial shear modulus {modulus:.4e} of {largest:.4e}")
            }
        }
    }
}

/// Part of the sum of sizes below which terms cancel.
const CANCELLED: f64 = 0.1;

impl Ogden {
    /// The energy with terms $(\mu_p, \alpha_p)$, $\mu_p$ in \[stress\].
    ///
    /// # Errors
    /// [`Invalid`] for constants that aren't finite, $\alpha_p = 0$, and an initial
    /// shear modulus (hence also an empty list) that isn't above zero.
    pub fn new(terms: impl IntoIterator<Item = (f64, f64)>) -> Result<Self, MaterialError> {
        let terms: Vec<_> = terms.into_iter().collect();
        for (p, &(mu, alpha)) in terms.iter().enumerate() {
            let reject = |name: &str, value, needed| {
                MaterialError::from(Invalid::new(format!("material constant {name}_{}", p + 1), value, needed))
            };
            ensure!(mu.is_finite(), reject("mu", mu, "give a finite number"));
            ensure!(
                alpha.is_finite() && alpha != 0.0,
                reject("alpha", alpha, "give a finite exponent other than zero")
            );
        }
        let shear: f64 = terms.summed(|(mu, alpha)| 0.5 * mu * alpha);
        positive("initial shear modulus (sum of mu_p alpha_p / 2)", shear)?;
        Ok(Self { terms })
    }

    /// The energy with constants in the convention of another program; `terms` are its pairs (modulus, exponent).
    ///
    /// ```
    /// use rkpm::material::{Ogden, OgdenConvention};
    /// // The same rubber: µ_p here, 2 µ_p/α_p² there; exponents are the same.
    /// let here = Ogden::new([(0.618, 1.3), (-0.00981, -2.0)])?;
    /// let there = [(0.5 * 0.618 * 1.3, 1.3), (0.5 * 0.00981 * 2.0, -2.0)];
    /// assert_eq!(Ogden::in_convention(OgdenConvention::ShearModuli, there)?, here);
    /// # Ok::<(), rkpm::error::MaterialError>(())
    /// ```
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn in_convention(
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

    /// What is doubtful about the constants, though [`new`](Self::new) accepts them: fits to few data often have such terms, and
    /// lose stability outside of them. [`stable_ranges`](super::stable_ranges) tells where.
    ///
    /// ```
    /// use rkpm::material::{Ogden, OgdenWarning};
    /// let fitted = Ogden::new([(0.6, 1.3), (-0.02, 3.0)])?;
    /// assert_eq!(fitted.warnings(), [OgdenWarning::Sign { term: 2, mu: -0.02, alpha: 3.0 }]);
    /// # Ok::<(), rkpm::error::MaterialError>(())
    /// ```
    pub fn warnings(&self) -> Vec<OgdenWarning> {
        let mut warnings = Vec::new();
        for (p, &(mu, alpha)) in self.terms.iter().enumerate() {
            if mu * alpha < 0.0 {
                warnings.push(OgdenWarning::Sign { term: p + 1, mu, alpha });
            }
        }
        let (sum, size) = self
            .terms
            .iter()
            .fold((0.0, 0.0), |(sum, size), (mu, alpha)| (sum + 0.5 * mu * alpha, size + (0.5 * mu * alpha).abs()));
        if sum < CANCELLED * size {
            warnings.push(OgdenWarning::Cancelling { modulus: sum, largest: size });
        }
        warnings
    }

    /// The terms $(\mu_p, \alpha_p)$.
    pub fn terms(&self) -> &[(f64, f64)] {
        &self.terms
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
    /// [`Invalid`] unless it is finite and above zero.
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
