//! Energies of the principal stretches and their derivatives with respect to F.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::rivlin::positive;
use super::{Material, Response};
use crate::error::MaterialError;
use crate::tensor::{Tangent, components};

/// A symmetric energy of three logarithmic stretches with its derivatives \[stress\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Principal {
    /// $\bar W$.
    pub energy: f64,
    /// $\partial\bar W/\partial\ln\bar\lambda_a$.
    pub gradient: Vector3<f64>,
    /// $\partial^2\bar W/\partial\ln\bar\lambda_a\\,\partial\ln\bar\lambda_b$.
    pub hessian: Matrix3<f64>,
}

/// A distortional energy $\bar W(\bar\lambda_1,\bar\lambda_2,\bar\lambda_3)$ of the principal stretches
/// of $\bar F = J^{-1/3}F$, symmetric in its arguments.
///
/// It is handed $\ln\bar\lambda_a$, which add up to zero, and differentiates with respect to them as if
/// they were independent: for $\bar W = \sum_a w(\bar\lambda_a)$ the gradient is $\bar\lambda_aw'$ and
/// the diagonal of the Hessian $\bar\lambda_aw' + \bar\lambda_a^2w''$. [`PrincipalStretches`] makes a
/// [`Material`] of it. The exponentiated Hencky energy
/// $\frac{\mu}{\kappa}\left(e^{\kappa\sum_a(\ln\bar\lambda_a)^2} - 1\right)$:
///
/// ```
/// use rkpm::material::{Principal, PrincipalEnergy, PrincipalStretches, initial_shear_modulus};
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
/// assert!((initial_shear_modulus(&material) - 1.5).abs() < 1e-14);
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

impl Ogden {
    /// The energy with terms $(\mu_p, \alpha_p)$, $\mu_p$ in \[stress\].
    ///
    /// # Errors
    /// [`MaterialError::Constant`] for constants that aren't finite, $\alpha_p = 0$, and an initial
    /// shear modulus (hence also an empty list) that isn't above zero.
    pub fn new(terms: impl IntoIterator<Item = (f64, f64)>) -> Result<Self, MaterialError> {
        let terms: Vec<_> = terms.into_iter().collect();
        for (p, &(mu, alpha)) in terms.iter().enumerate() {
            let reject = |name: &str, value, needed| MaterialError::Constant {
                name: format!("{name}_{}", p + 1),
                value,
                needed,
            };
            if !mu.is_finite() {
                return Err(reject("mu", mu, "give a finite number"));
            }
            if !alpha.is_finite() || alpha == 0.0 {
                return Err(reject("alpha", alpha, "give a finite exponent other than zero"));
            }
        }
        let shear: f64 = terms.iter().map(|(mu, alpha)| 0.5 * mu * alpha).sum();
        positive("initial shear modulus (sum of mu_p alpha_p / 2)", shear)?;
        Ok(Self { terms })
    }

    /// The terms $(\mu_p, \alpha_p)$.
    pub fn terms(&self) -> &[(f64, f64)] {
        &self.terms
    }
}

impl PrincipalEnergy for Ogden {
    fn evaluate(&self, logarithms: [f64; 3]) -> Principal {
        let mut sum = Principal { energy: 0.0, gradient: Vector3::zeros(), hessian: Matrix3::zeros() };
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
    /// [`MaterialError::Constant`] unless it is finite and above zero.
    pub fn new(shear: f64) -> Result<Self, MaterialError> {
        positive("mu", shear)?;
        Ok(Self { shear })
    }
}

impl PrincipalEnergy for Hencky {
    fn evaluate(&self, logarithms: [f64; 3]) -> Principal {
        let logarithms = Vector3::from(logarithms);
        Principal {
            energy: self.shear * logarithms.norm_squared(),
            gradient: 2.0 * self.shear * logarithms,
            hessian: Matrix3::from_diagonal_element(2.0 * self.shear),
        }
    }
}

/// The material of an energy of the reduced principal stretches, $W(F) = \bar W(\bar\lambda_a)$.
///
/// With $F = \sum_a\lambda_a\\,u_a\otimes v_a$ and $t_a = \partial W/\partial\ln\lambda_a$ (the
/// principal Kirchhoff stresses), $P = \sum_a\frac{t_a}{\lambda_a}u_a\otimes v_a$. In the basis
/// $u_a\otimes v_b$ the tangent couples the diagonal components among each other,
/// $\frac{1}{\lambda_a\lambda_b}\left(\frac{\partial t_a}{\partial\ln\lambda_b} - \delta_{ab}t_a\right)$,
/// and each pair $ab$, $ba$ with itself by
/// $$D = \frac{t_a-t_b}{\lambda_a^2-\lambda_b^2}\ \text{(equal)},\qquad
///   \frac{\lambda_b^2D-t_b}{\lambda_a\lambda_b}\ \text{(crossed)}.$$
/// $D$ is taken as a mean of second derivatives where the stretches are close, so equal stretches are
/// no special case. NaN for $J \le 0$.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PrincipalStretches<E>(pub E);

/// F = Σ λ_a u_a ⊗ v_a with λ_a > 0.
struct Stretches {
    values: [f64; 3],
    /// Columns u_a.
    left: Matrix3<f64>,
    /// Columns v_a.
    right: Matrix3<f64>,
    /// ln λ̄_a.
    logarithms: [f64; 3],
}

impl Stretches {
    /// One-sided Jacobi rotations: columns of F V made orthogonal, with high relative accuracy in small
    /// stretches too and no trouble with equal ones, which a decomposition of FᵀF would have.
    fn new(f: &Matrix3<f64>) -> Option<Self> {
        let j = f.determinant();
        if j.is_nan() || j <= 0.0 || !f.iter().all(|component| component.is_finite()) {
            return None;
        }
        let mut left = *f;
        let mut right = Matrix3::identity();
        // Convergence is quadratic and takes four or five sweeps; the bound only ends a loop that
        // round-off keeps alive.
        for _ in 0..12 {
            let mut rotated = false;
            for (a, b) in [(0, 1), (0, 2), (1, 2)] {
                let product = left.column(a).dot(&left.column(b));
                let (square_a, square_b) = (left.column(a).norm_squared(), left.column(b).norm_squared());
                if product.abs() <= 0.25 * f64::EPSILON * (square_a * square_b).sqrt() {
                    continue;
                }
                rotated = true;
                // The smaller root of t² + 2ζt - 1 = 0 makes the columns orthogonal.
                let zeta = (square_b - square_a) / (2.0 * product);
                let tangent = zeta.signum() / (zeta.abs() + zeta.hypot(1.0));
                let cosine = tangent.hypot(1.0).recip();
                let sine = cosine * tangent;
                for matrix in [&mut left, &mut right] {
                    let (old_a, old_b) = (matrix.column(a).into_owned(), matrix.column(b).into_owned());
                    matrix.set_column(a, &(cosine * old_a - sine * old_b));
                    matrix.set_column(b, &(sine * old_a + cosine * old_b));
                }
            }
            if !rotated {
                break;
            }
        }
        let values = [0, 1, 2].map(|a| left.column(a).norm());
        for (a, value) in values.into_iter().enumerate() {
            left.column_mut(a).unscale_mut(value);
        }
        let logarithms = values.map(f64::ln);
        let mean = logarithms.iter().sum::<f64>() / 3.0;
        Some(Self { values, left, right, logarithms: logarithms.map(|logarithm| logarithm - mean) })
    }
}

/// Distance of logarithms below which (g_a - g_b)/(ln λ_a - ln λ_b) is integrated instead: the
/// difference then loses at most two digits, and the rule below is exact to round-off for exponents
/// up to about 100.
const CLOSE: f64 = 0.02;

/// Positive nodes and weights (which sum to one) of the four-point Gauss–Legendre rule on [-1, 1].
const GAUSS: [(f64, f64); 2] =
    [(0.339_981_043_584_856_3, 0.652_145_154_862_546_1), (0.861_136_311_594_052_6, 0.347_854_845_137_453_9)];

impl<E: PrincipalEnergy> PrincipalStretches<E> {
    /// (g_a - g_b)/(ln λ_a - ln λ_b) for the gradient g of the energy.
    fn divided_difference(&self, at: &Principal, stretches: &Stretches, a: usize, b: usize) -> f64 {
        let logarithms = stretches.logarithms;
        let distance = logarithms[a] - logarithms[b];
        if distance.abs() > CLOSE {
            return (at.gradient[a] - at.gradient[b]) / distance;
        }
        // g_a - g_b is the integral of its derivative as the pair opens about its middle. The energy
        // is symmetric, so the integrand is even and half of the nodes suffice.
        let middle = 0.5 * (logarithms[a] + logarithms[b]);
        GAUSS
            .into_iter()
            .map(|(node, weight)| {
                let mut shifted = logarithms;
                shifted[a] = middle + 0.5 * node * distance;
                shifted[b] = middle - 0.5 * node * distance;
                let hessian = self.0.evaluate(shifted).hessian;
                weight * (0.5 * (hessian[(a, a)] + hessian[(b, b)]) - hessian[(a, b)])
            })
            .sum()
    }
}

impl<E: PrincipalEnergy> Material for PrincipalStretches<E> {
    fn energy(&self, f: &Matrix3<f64>) -> f64 {
        Stretches::new(f).map_or(f64::NAN, |stretches| self.0.evaluate(stretches.logarithms).energy)
    }

    fn response(&self, f: &Matrix3<f64>) -> Response {
        let Some(stretches) = Stretches::new(f) else {
            return Response::undefined();
        };
        let Stretches { values: lambda, ref left, ref right, logarithms } = stretches;
        let energy = self.0.evaluate(logarithms);

        // ln λ̄_a = ln λ_a - mean: the chain rule takes the means off the gradient and the Hessian.
        let t = energy.gradient.add_scalar(-energy.gradient.mean());
        let mut slope = energy.hessian;
        for mut column in slope.column_iter_mut() {
            let mean = column.mean();
            column.add_scalar_mut(-mean);
        }
        for mut row in slope.row_iter_mut() {
            let mean = row.mean();
            row.add_scalar_mut(-mean);
        }

        // The tangent in the basis u_a ⊗ v_b, at row and column 3a + b.
        let mut principal = Tangent::zeros();
        for a in 0..3 {
            for b in 0..3 {
                let own = if a == b { t[a] } else { 0.0 };
                principal[(4 * a, 4 * b)] = (slope[(a, b)] - own) / (lambda[a] * lambda[b]);
            }
        }
        for (a, b) in [(0, 1), (0, 2), (1, 2)] {
            let product = lambda[a] * lambda[b];
            // λ_a² - λ_b² = 2 λ_a λ_b sinh(ln λ_a - ln λ_b).
            let distance = logarithms[a] - logarithms[b];
            let ratio = if distance == 0.0 { 1.0 } else { distance / distance.sinh() };
            let equal = 0.5 * ratio * self.divided_difference(&energy, &stretches, a, b) / product;
            // The mean of the two forms of the crossed coefficient keeps it free of the order of a, b.
            let crossed = 0.5 * ((lambda[a] * lambda[a] + lambda[b] * lambda[b]) * equal - t[a] - t[b]) / product;
            let (ab, ba) = (3 * a + b, 3 * b + a);
            principal[(ab, ab)] = equal;
            principal[(ba, ba)] = equal;
            principal[(ab, ba)] = crossed;
            principal[(ba, ab)] = crossed;
        }

        let mut dyads = SMatrix::<f64, 9, 9>::zeros();
        for a in 0..3 {
            for b in 0..3 {
                let dyad = left.column(a) * right.column(b).transpose();
                dyads.set_column(3 * a + b, &components(&dyad));
            }
        }
        let scaled = Vector3::from_fn(|a, _| t[a] / lambda[a]);
        Response {
            stress: left * Matrix3::from_diagonal(&scaled) * right.transpose(),
            tangent: dyads * principal * dyads.transpose(),
        }
    }
}
