//! Materials of energies of the principal stretches: their derivatives with respect to F.

use nalgebra::SMatrix;

use super::{Material, Past, Principal, PrincipalEnergy, Response};
use crate::each::EachOf;
use crate::geometry::{Mat3, Vec3};
use crate::tensor::{Tangent, components};

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
    left: Mat3,
    /// Columns v_a.
    right: Mat3,
    /// ln λ_a.
    logarithms: [f64; 3],
}

impl Stretches {
    /// One-sided Jacobi rotations: columns of F V made orthogonal, with high relative accuracy in small
    /// stretches too and no trouble with equal ones, which a decomposition of FᵀF would have.
    fn new(f: &Mat3) -> Option<Self> {
        let j = f.determinant();
        if j.is_nan() || j <= 0.0 || !f.iter().all(|component| component.is_finite()) {
            return None;
        }
        let mut left = *f;
        let mut right = Mat3::identity();
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
        let values = [0, 1, 2].each(|a| left.column(a).norm());
        for (a, value) in values.into_iter().enumerate() {
            left.column_mut(a).unscale_mut(value);
        }
        Some(Self { values, left, right, logarithms: values.each(f64::ln) })
    }

    /// ln λ̄_a.
    fn reduced(&self) -> [f64; 3] {
        let mean = self.logarithms.iter().sum::<f64>() / 3.0;
        self.logarithms.each(|logarithm| logarithm - mean)
    }

    /// $P$ of the principal Kirchhoff stresses $t_a$.
    fn stress(&self, t: &Vec3) -> Mat3 {
        let scaled = Vec3::from_fn(|a, _| t[a] / self.values[a]);
        self.left * Mat3::from_diagonal(&scaled) * self.right.transpose()
    }
}

/// Distance of logarithms below which (g_a - g_b)/(ln λ_a - ln λ_b) is integrated instead: the
/// difference then loses at most two digits, and the rule below is exact to round-off for exponents
/// up to about 100.
const CLOSE: f64 = 0.02;

/// Positive nodes and weights (which sum to one) of the four-point Gauss–Legendre rule on [-1, 1].
const GAUSS: [(f64, f64); 2] =
    [(0.339_981_043_584_856_3, 0.652_145_154_862_546_1), (0.861_136_311_594_052_6, 0.347_854_845_137_453_9)];

/// (g_a - g_b)/(ln λ_a - ln λ_b) for the gradient g of an energy at given logarithms.
fn divided_difference(energy: &impl PrincipalEnergy, at: &Principal, logarithms: [f64; 3], a: usize, b: usize) -> f64 {
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
            let hessian = energy.evaluate(shifted).hessian;
            weight * (0.5 * (hessian[(a, a)] + hessian[(b, b)]) - hessian[(a, b)])
        })
        .sum()
}

/// The tangent of principal Kirchhoff stresses `t` with derivatives `slope` by $\ln\lambda_b$, $D$ of each pair given.
fn tangent(stretches: &Stretches, t: &Vec3, slope: &Mat3, divided: impl Fn(usize, usize) -> f64) -> Tangent {
    let Stretches { values: lambda, left, right, logarithms } = stretches;
    // In the basis u_a ⊗ v_b, at row and column 3a + b.
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
        let equal = 0.5 * ratio * divided(a, b) / product;
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
    dyads * principal * dyads.transpose()
}

/// Takes the means off a gradient, the chain rule of $\ln\bar\lambda_a = \ln\lambda_a - \text{mean}$.
fn without_mean(gradient: &Vec3) -> Vec3 {
    gradient.add_scalar(-gradient.mean())
}

/// The logarithms that an energy depends on: without their mean where it is one of the shape alone.
fn logarithms(stretches: &Stretches, shape: bool) -> [f64; 3] {
    if shape { stretches.reduced() } else { stretches.logarithms }
}

fn energy(of: &impl PrincipalEnergy, f: &Mat3, shape: bool) -> f64 {
    Stretches::new(f).map_or(f64::NAN, |stretches| of.evaluate(logarithms(&stretches, shape)).energy)
}

fn response(of: &impl PrincipalEnergy, f: &Mat3, shape: bool) -> Response {
    let Some(stretches) = Stretches::new(f) else {
        return Response::undefined();
    };
    let logarithms = logarithms(&stretches, shape);
    let energy = of.evaluate(logarithms);
    let (mut t, mut slope) = (energy.gradient, energy.hessian);
    if shape {
        t = without_mean(&t);
        for mut column in slope.column_iter_mut() {
            let mean = column.mean();
            column.add_scalar_mut(-mean);
        }
        for mut row in slope.row_iter_mut() {
            let mean = row.mean();
            row.add_scalar_mut(-mean);
        }
    }
    let divided = |a, b| divided_difference(of, &energy, logarithms, a, b);
    Response { stress: stretches.stress(&t), tangent: tangent(&stretches, &t, &slope, divided) }
}

/// Some components; the stress alone where no tangent is asked for.
fn respond(
    of: &impl PrincipalEnergy,
    f: &Mat3,
    shape: bool,
    components: &[usize],
    stress: &mut [f64],
    tangent: &mut [f64],
) {
    if !tangent.is_empty() {
        return response(of, f, shape).select(components, stress, tangent);
    }
    let whole = Stretches::new(f).map_or(Mat3::repeat(f64::NAN), |stretches| {
        let t = of.evaluate(logarithms(&stretches, shape)).gradient;
        stretches.stress(&if shape { without_mean(&t) } else { t })
    });
    for (stress, &c) in stress.iter_mut().zip(components) {
        *stress = whole[(c / 3, c % 3)];
    }
}

impl<E: PrincipalEnergy> Material for PrincipalStretches<E> {
    fn energy_from(&self, f: &Mat3, _: Past<'_>) -> f64 {
        energy(&self.0, f, true)
    }

    fn response_from(&self, f: &Mat3, _: Past<'_>) -> Response {
        response(&self.0, f, true)
    }

    fn respond(&self, f: &Mat3, _: Past<'_>, components: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        respond(&self.0, f, true, components, stress, tangent);
    }
}

/// The material of an energy of the principal stretches themselves, volume and all: $W(F) = W(\lambda_a)$ with
/// $P = \sum_a\frac{t_a}{\lambda_a}u_a\otimes v_a$ and the tangent of [`PrincipalStretches`].
///
/// For foams ([`OgdenFoam`](super::OgdenFoam)), whose volume is no less soft than their shape: it has no
/// [`volumetric`](Material::volumetric) part, and none is needed, since nothing locks. NaN for $J \le 0$.
///
/// ```
/// use rkpm::material::{Material, OgdenFoam, TotalStretches};
/// let foam = TotalStretches(OgdenFoam::blatz_ko(0.2, 0.25, 0.0)?); // MPa
/// assert!((foam.initial_moduli().shear - 0.2).abs() < 1e-15);
/// assert!((foam.initial_moduli().bulk - 5.0 / 3.0 * 0.2).abs() < 1e-15); // ν = 1/4
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TotalStretches<E>(pub E);

impl<E: PrincipalEnergy> Material for TotalStretches<E> {
    fn energy_from(&self, f: &Mat3, _: Past<'_>) -> f64 {
        energy(&self.0, f, false)
    }

    fn response_from(&self, f: &Mat3, _: Past<'_>) -> Response {
        response(&self.0, f, false)
    }

    fn respond(&self, f: &Mat3, _: Past<'_>, components: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        respond(&self.0, f, false, components, stress, tangent);
    }
}
