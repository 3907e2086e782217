//! Energies of the reduced invariants $\bar I_1 = I_1 J^{-2/3}$, $\bar I_2 = I_2 J^{-4/3}$ (2.11), (2.12).

use nalgebra::Matrix3;

use crate::error::MaterialError;
use crate::tensor::{Tangent, Vector9, add_determinant_hessian, cofactor, components, from_components};

use super::{Material, Response};

/// An energy of the reduced invariants and its derivatives \[stress\]: $\bar W$, $\bar K_n$ (2.14), $\bar H_{mn}$ (A.3).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Distortion {
    /// $\bar W$.
    pub energy: f64,
    /// $\bar K_1 = \partial\bar W/\partial\bar I_1$.
    pub w1: f64,
    /// $\bar K_2 = \partial\bar W/\partial\bar I_2$.
    pub w2: f64,
    /// $\bar H_{11}$.
    pub w11: f64,
    /// $\bar H_{12}$.
    pub w12: f64,
    /// $\bar H_{22}$.
    pub w22: f64,
}

/// An energy $\bar W(\bar I_1, \bar I_2)$.
///
/// ```
/// use rkpm::material::{Distortion, InvariantEnergy};
/// /// The exponential energy a (exp(b (Ī₁ − 3)) − 1).
/// struct Exponential { a: f64, b: f64 }
/// impl InvariantEnergy for Exponential {
///     fn evaluate(&self, i1: f64, _: f64) -> Distortion {
///         let e = (self.b * (i1 - 3.0)).exp();
///         Distortion {
///             energy: self.a * (e - 1.0),
///             w1: self.a * self.b * e,
///             w11: self.a * self.b * self.b * e,
///             ..Distortion::default()
///         }
///     }
/// }
/// assert_eq!(Exponential { a: 2.0, b: 1.0 }.evaluate(3.0, 3.0).w1, 2.0);
/// ```
pub trait InvariantEnergy: Send + Sync {
    /// $\bar W$ and its derivatives.
    fn evaluate(&self, i1: f64, i2: f64) -> Distortion;
}

/// Turns an [`InvariantEnergy`] into a [`Material`].
///
/// $\bar W$ is taken as a function of $(I_1, I_2, J)$, whose derivatives with respect to $F$ are polynomials:
/// $P = \sum_a W_a\,\partial_F a$ and $\partial P/\partial F = \sum_{ab} W_{ab}\,\partial_F a\otimes\partial_F b
/// + \sum_a W_a\,\partial^2_F a$, without any inverse. The same as $P = FS$ with (2.13).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Invariants<E>(
    /// The energy.
    pub E,
);

/// $J^{-2/3}$ and both reduced invariants; NaN for $J \le 0$.
#[inline]
fn reduced(f: &Matrix3<f64>, g: &Matrix3<f64>) -> (f64, f64, f64, f64, f64) {
    let j = f.determinant();
    // A cube root would be real for J < 0 and hide the inversion.
    let s = if j > 0.0 { 1.0 / (j * j).cbrt() } else { f64::NAN };
    let i1 = g.trace();
    let i2 = 0.5 * (i1 * i1 - g.norm_squared());
    (j, s, i1, i1 * s, i2 * s * s)
}

impl<E: InvariantEnergy> Material for Invariants<E> {
    fn energy(&self, f: &Matrix3<f64>) -> f64 {
        let (_, _, _, b1, b2) = reduced(f, &(f.transpose() * f));
        self.0.evaluate(b1, b2).energy
    }

    fn response(&self, f: &Matrix3<f64>) -> Response {
        let g = f.transpose() * f;
        let (j, s, i1, b1, b2) = reduced(f, &g);
        let d = self.0.evaluate(b1, b2);
        // Derivatives of the reduced invariants: Ī₁ = s I₁, Ī₂ = s² I₂ with s = J^(-2/3).
        let cof = cofactor(f);
        let c = components(&cof);
        let f9 = components(f);
        let fg = f * g;
        let u2: Vector9 = (f9 * i1 - components(&fg)) * 2.0;
        let (j1, j2) = (-2.0 / 3.0 * b1 / j, -4.0 / 3.0 * b2 / j);
        let a1: Vector9 = f9 * (2.0 * s) + c * j1;
        let a2: Vector9 = u2 * (s * s) + c * j2;
        let stress = from_components(&(a1 * d.w1 + a2 * d.w2));

        let mut tangent = Tangent::zeros();
        // Rank-one parts: (Ī₁, Ī₂) twice, and the cross terms of s and J.
        let v1: Vector9 = a1 * d.w11 + a2 * d.w12;
        let v2: Vector9 = a1 * d.w12 + a2 * d.w22;
        let cross: Vector9 = f9 * (d.w1 * -4.0 / 3.0 * s / j) + u2 * (d.w2 * -4.0 / 3.0 * s * s / j);
        let jj = d.w1 * 10.0 / 9.0 * b1 / (j * j) + d.w2 * 28.0 / 9.0 * b2 / (j * j);
        for col in 0..9 {
            for row in 0..9 {
                tangent[(row, col)] = a1[row] * v1[col]
                    + a2[row] * v2[col]
                    + cross[row] * c[col]
                    + c[row] * cross[col]
                    + jj * c[row] * c[col];
            }
        }
        // ∂²I₁ = 2 δδ, ∂²I₂ = 2 (2 F⊗F + I₁ δδ − δ_ik G_JL − F_iL F_kJ − (FFᵀ)_ik δ_JL).
        let (w1, w2) = (d.w1 * s, d.w2 * s * s);
        if w2 != 0.0 {
            let b = f * f.transpose();
            for i in 0..3 {
                for jj in 0..3 {
                    let row = 3 * i + jj;
                    for k in 0..3 {
                        for l in 0..3 {
                            let mut value = 2.0 * f[(i, jj)] * f[(k, l)] - f[(i, l)] * f[(k, jj)];
                            if i == k {
                                value -= g[(jj, l)];
                            }
                            if jj == l {
                                value -= b[(i, k)];
                            }
                            tangent[(row, 3 * k + l)] += 2.0 * w2 * value;
                        }
                    }
                }
            }
        }
        for row in 0..9 {
            tangent[(row, row)] += 2.0 * (w1 + w2 * i1);
        }
        add_determinant_hessian(&mut tangent, f, d.w1 * j1 + d.w2 * j2);
        Response { stress, tangent }
    }
}

/// Gent's energy $-\tfrac{\mu J_m}{2}\ln\big(1 - (\bar I_1 - 3)/J_m\big)$: chains that lock at $\bar I_1 = 3 + J_m$.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gent {
    shear: f64,
    limit: f64,
}

impl Gent {
    /// With shear modulus $\mu$ \[stress\] and limit $J_m$.
    ///
    /// # Errors
    /// Where one is not a positive number.
    pub fn new(shear: f64, limit: f64) -> Result<Self, MaterialError> {
        for (name, value) in [("mu", shear), ("J_m", limit)] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(MaterialError::Constant {
                    name: name.into(),
                    value,
                    needed: "give a finite number above zero",
                });
            }
        }
        Ok(Gent { shear, limit })
    }
}

impl InvariantEnergy for Gent {
    fn evaluate(&self, i1: f64, _i2: f64) -> Distortion {
        let left = 1.0 - (i1 - 3.0) / self.limit;
        // Beyond the limit the logarithm is NaN; so must be the stress, or the solver would not notice.
        let left = if left > 0.0 { left } else { f64::NAN };
        Distortion {
            energy: -0.5 * self.shear * self.limit * left.ln(),
            w1: 0.5 * self.shear / left,
            w11: 0.5 * self.shear / (self.limit * left * left),
            ..Distortion::default()
        }
    }
}
