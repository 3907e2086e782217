//! Foams: energies of stretches and volume together.

use super::constants::{check, exponent, finite, positive};
use super::{Principal, PrincipalEnergy};
use crate::each::Each;
use crate::error::MaterialError;
use crate::geometry::{Mat3, Vec3};

/// One term of an [`OgdenFoam`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoamTerm {
    /// $\mu_p$ \[stress\]; the $\mu_p$ of all terms add up to the initial shear modulus.
    pub shear: f64,
    /// $\alpha_p$.
    pub exponent: f64,
    /// Poisson's ratio $\nu_p$ of the term, $\beta_p = \nu_p/(1-2\nu_p)$.
    pub poisson: f64,
}

/// The energy of Ogden and Storåkers for highly compressible elastomers,
/// $$W = \sum_p\frac{2\mu_p}{\alpha_p^2}\Big(\lambda_1^{\alpha_p} + \lambda_2^{\alpha_p} + \lambda_3^{\alpha_p} - 3
/// {}+ \frac{1}{\beta_p}\big(J^{-\alpha_p\beta_p} - 1\big)\Big),$$
/// with initial moduli $\mu_0 = \sum_p\mu_p$ and $k_0 = \sum_p2\mu_p(\tfrac13+\beta_p)$.
///
/// The stretches are those of $F$, not reduced: [`TotalStretches`](super::TotalStretches) makes a material of it.
/// (Storåkers, Journal of the Mechanics and Physics of Solids 34, 1986.)
///
/// ```
/// use rkpm::material::{FoamTerm, Material, OgdenFoam, TotalStretches};
/// use rkpm::nalgebra::{Matrix3, Vector3};
///
/// // A foam with ν = 0: pressed to a third, it does not move sideways, P = 2 µ/α (λ^(α-1) - 1/λ).
/// let foam = TotalStretches(OgdenFoam::new([FoamTerm { shear: 0.1, exponent: 3.0, poisson: 0.0 }])?);
/// let stress = foam.response(&Matrix3::from_diagonal(&Vector3::new(1.0 / 3.0, 1.0, 1.0))).stress;
/// assert!((stress[(0, 0)] - 0.2 / 3.0 * (1.0 / 9.0 - 3.0)).abs() < 1e-15 && stress[(1, 1)].abs() < 1e-15);
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct OgdenFoam {
    terms: Vec<FoamTerm>,
}

impl OgdenFoam {
    /// The energy with given terms.
    ///
    /// # Errors
    /// [`MaterialError::Invalid`] for constants that are not finite, an exponent of zero, Poisson's ratios outside
    /// $(-1, \tfrac12)$, and initial moduli (hence also an empty list) that are not above zero.
    pub fn new(terms: impl IntoIterator<Item = FoamTerm>) -> Result<Self, MaterialError> {
        let foam = Self { terms: terms.into_iter().collect() };
        for (p, term) in foam.terms.iter().enumerate() {
            finite(format!("mu_{}", p + 1), term.shear)?;
            exponent(p, term.exponent)?;
            let holds = term.poisson > -1.0 && term.poisson < 0.5;
            check(format!("nu_{}", p + 1), term.poisson, holds, "give a Poisson's ratio above -1 and below 1/2")?;
        }
        positive("initial shear modulus (sum of mu_p)", foam.terms.summed(|t| t.shear))?;
        let bulk = foam.terms.summed(|t| 2.0 * t.shear * (1.0 / 3.0 + t.beta()));
        positive("initial bulk modulus (sum of 2 mu_p (1/3 + beta_p))", bulk)?;
        Ok(foam)
    }

    /// The energy of Blatz and Ko with shear modulus `shear` $= \mu$, Poisson's ratio `poisson` $= \nu$ and fraction $f$,
    /// $$W = \frac{\mu f}{2}\Big(I_1 - 3 + \frac{1}{\beta}(J^{-2\beta} - 1)\Big)
    /// {}+ \frac{\mu(1-f)}{2}\Big(\frac{I_2}{J^2} - 3 + \frac1\beta(J^{2\beta} - 1)\Big),\qquad \beta = \frac{\nu}{1-2\nu}.$$
    /// Their foamed rubber, $\frac\mu2(I_2/J^2 + 2J - 5)$, has $f = 0$ and $\nu = \tfrac14$.
    /// (Blatz and Ko, Transactions of the Society of Rheology 6, 1962.)
    ///
    /// # Errors
    /// As [`new`](Self::new), and for a fraction outside $[0, 1]$.
    pub fn blatz_ko(shear: f64, poisson: f64, fraction: f64) -> Result<Self, MaterialError> {
        positive("mu", shear)?;
        check("f", fraction, (0.0..=1.0).contains(&fraction), "give a fraction from 0 (foam) to 1")?;
        let term = |part: f64, exponent| FoamTerm { shear: shear * part, exponent, poisson };
        Self::new([term(fraction, 2.0), term(1.0 - fraction, -2.0)].into_iter().filter(|t| t.shear != 0.0))
    }
}

impl FoamTerm {
    fn beta(&self) -> f64 {
        self.poisson / (1.0 - 2.0 * self.poisson)
    }
}

impl PrincipalEnergy for OgdenFoam {
    fn evaluate(&self, logarithms: [f64; 3]) -> Principal {
        let mut sum = Principal { energy: 0.0, gradient: Vec3::zeros(), hessian: Mat3::zeros() };
        let volume: f64 = logarithms.iter().sum();
        for term in &self.terms {
            let (mu, alpha, beta) = (term.shear, term.exponent, term.beta());
            // (J^-αβ - 1)/β, whose limit for β = 0 is -α ln J.
            let z = -alpha * beta * volume;
            let spent = z.exp_m1();
            let ratio = if z == 0.0 { 1.0 } else { spent / z };
            sum.energy -= 2.0 * mu / alpha * volume * ratio;
            for (a, logarithm) in logarithms.into_iter().enumerate() {
                let excess = (alpha * logarithm).exp_m1();
                sum.energy += 2.0 * mu / (alpha * alpha) * excess;
                sum.gradient[a] += 2.0 * mu / alpha * (excess - spent);
                sum.hessian[(a, a)] += 2.0 * mu * (1.0 + excess);
            }
            sum.hessian.add_scalar_mut(2.0 * mu * beta * (1.0 + spent));
        }
        sum
    }
}
