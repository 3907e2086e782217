//! Energies of the reduced invariants and their derivatives with respect to F.

use super::{Material, Past, Response};
use crate::geometry::Mat3;
use crate::tensor::{add_hessian_in, cofactor};

/// A distortional energy and its derivatives with respect to the reduced invariants \[stress\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Distortion {
    /// $\bar W$.
    pub energy: f64,
    /// $\bar K_1 = \partial\bar W/\partial\bar I_1$ (2.14).
    pub w1: f64,
    /// $\bar K_2 = \partial\bar W/\partial\bar I_2$ (2.14).
    pub w2: f64,
    /// $\bar H_{11} = \partial^2\bar W/\partial\bar I_1^2$.
    pub w11: f64,
    /// $\bar H_{12} = \partial^2\bar W/\partial\bar I_1\partial\bar I_2$.
    pub w12: f64,
    /// $\bar H_{22} = \partial^2\bar W/\partial\bar I_2^2$.
    pub w22: f64,
}

impl Distortion {
    /// NaN in every component: the answer outside the domain of an energy.
    pub(crate) fn undefined() -> Self {
        Self { energy: f64::NAN, w1: f64::NAN, w2: f64::NAN, w11: f64::NAN, w12: f64::NAN, w22: f64::NAN }
    }
}

/// A distortional energy $\bar W(\bar I_1, \bar I_2)$ of the reduced invariants (2.11), (2.12).
///
/// Both are 3 in the undeformed state and at least 3 elsewhere; the energy should vanish there.
/// [`Invariants`] makes a [`Material`] of it. The Fung-type energy
/// $\bar W = \frac{\mu}{2b}\left(e^{b(\bar I_1-3)} - 1\right)$:
///
/// ```
/// use rkpm::material::{Distortion, InvariantEnergy, Invariants, Material};
///
/// struct Fung { mu: f64, b: f64 }
///
/// impl InvariantEnergy for Fung {
///     fn evaluate(&self, i1: f64, _i2: f64) -> Distortion {
///         let x = self.b * (i1 - 3.0);
///         let w1 = 0.5 * self.mu * x.exp();
///         Distortion { energy: 0.5 * self.mu / self.b * x.exp_m1(), w1, w11: self.b * w1, ..Distortion::default() }
///     }
/// }
///
/// let tissue = Invariants(Fung { mu: 0.01, b: 2.0 });
/// assert!((tissue.initial_moduli().shear - 0.01).abs() < 1e-15);
/// ```
pub trait InvariantEnergy: Send + Sync {
    /// The energy and its derivatives at the reduced invariants $\bar I_1$, $\bar I_2$.
    fn evaluate(&self, i1: f64, i2: f64) -> Distortion;

    /// The same at the excesses $e_1 = \bar I_1 - 3$ and $e_2 = \bar I_2 - 3$.
    ///
    /// [`Invariants`] calls this one, because it knows the excesses to full relative precision where
    /// $\bar I_1 - 3$ has lost it: they are quadratic in the strain. An energy written in the
    /// excesses keeps that precision by overriding it.
    fn evaluate_excess(&self, e1: f64, e2: f64) -> Distortion {
        self.evaluate(3.0 + e1, 3.0 + e2)
    }
}

/// The material of an energy of the reduced invariants, $W(F) = \bar W(\bar I_1, \bar I_2)$.
///
/// With $N = \operatorname{cof}F/J = F^{-T}$, $I_1 = F:F$ and $I_2 = |\operatorname{cof}F|^2$,
/// $$g_1 = \frac{\partial\bar I_1}{\partial F} = 2\left(J^{-2/3}F - \tfrac13\bar I_1N\right),\qquad
///   g_2 = \frac{\partial\bar I_2}{\partial F} = 2\left(J^{-4/3}(I_1F - FF^TF) - \tfrac23\bar I_2N\right)$$
/// give the stress $P = \bar K_1g_1 + \bar K_2g_2$, which is $FS$ with the distortional part of (2.13),
/// and the tangent that carries (2.16) and the geometric stiffness in one block.
/// No inverse, no eigenvalue and no allocation is needed. NaN for $J \le 0$.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Invariants<E>(pub E);

/// The reduced invariants of a deformation gradient with J > 0 and what they were made from.
struct Reduced {
    /// J.
    j: f64,
    /// J^(-2/3).
    c: f64,
    /// cof F.
    cofactor: Mat3,
    /// G = FᵀF.
    green: Mat3,
    /// Ī1 - 3 and Ī2 - 3.
    excess: [f64; 2],
}

impl Reduced {
    #[inline]
    fn new(f: &Mat3) -> Option<Self> {
        let cofactor = cofactor(f);
        let j = f.m11 * cofactor.m11 + f.m12 * cofactor.m12 + f.m13 * cofactor.m13;
        if j.is_nan() || j <= 0.0 {
            return None;
        }
        // Quicker than the cube root, and as close: ln J is small wherever J is near one.
        let c = (-2.0 / 3.0 * j.ln()).exp();
        let green = f.transpose() * f;
        let i1 = c * green.trace();
        // Below this bound e2 + e3 doesn't cancel; above it, Ī1 - 3 has lost less than one digit.
        let excess = if i1 < 3.5 {
            // With ē = c G - δ, det(δ + ē) = 1 means tr ē = -(e2 + e3): the excesses follow from
            // terms quadratic in the strain, and round-off stays relative to them.
            let e = c * green - Mat3::identity();
            let e2 = e.m11 * e.m22 - e.m12 * e.m12 + e.m11 * e.m33 - e.m13 * e.m13 + e.m22 * e.m33 - e.m23 * e.m23;
            let e3 = e.determinant();
            [-(e2 + e3), -(e2 + 2.0 * e3)]
        } else {
            [i1 - 3.0, c * c * cofactor.norm_squared() - 3.0]
        };
        Some(Self { j, c, cofactor, green, excess })
    }
}

impl<E: InvariantEnergy> Material for Invariants<E> {
    fn energy_from(&self, f: &Mat3, _: Past<'_>) -> f64 {
        Reduced::new(f).map_or(f64::NAN, |reduced| self.0.evaluate_excess(reduced.excess[0], reduced.excess[1]).energy)
    }

    fn response_from(&self, f: &Mat3, past: Past<'_>) -> Response {
        Response::of_components(|of, stress, tangent| self.respond(f, past, of, stress, tangent))
    }

    fn respond(&self, f: &Mat3, _: Past<'_>, components: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        let n = components.len();
        let Some(reduced) = Reduced::new(f) else {
            stress[..n].fill(f64::NAN);
            tangent.fill(f64::NAN);
            return;
        };
        let dyads = self.dyads(f, &reduced);
        for (stress, &c) in stress.iter_mut().zip(components) {
            *stress = dyads.stress[(c / 3, c % 3)];
        }
        if tangent.is_empty() {
            return;
        }
        let Dyads { k11, k12, k22, k1n, k2n, knn, unit, q, hessian, .. } = dyads;
        // Without Ī2 there is nothing of its derivatives: the paper's Yeoh and any neo-Hookean rubber.
        let second = k12 != 0.0 || k22 != 0.0 || k2n != 0.0;
        let (green, left) = if q != 0.0 { (reduced.green, f * f.transpose()) } else { (reduced.green, reduced.green) };
        for (b, &d) in components.iter().enumerate() {
            let (k, l) = (d / 3, d % 3);
            let (a1, an) = (dyads.first[(k, l)], dyads.normal[(k, l)]);
            let (mut s1, mut s2, mut sn) = (k11 * a1 + k1n * an, 0.0, k1n * a1 + knn * an);
            if second {
                let a2 = dyads.second[(k, l)];
                s1 += k12 * a2;
                s2 = k12 * a1 + k22 * a2 + k2n * an;
                sn += k2n * a2;
            }
            for (a, &c) in components.iter().enumerate().take(b + 1) {
                let (i, j) = (c / 3, c % 3);
                let mut entry = dyads.first[(i, j)] * s1 + dyads.normal[(i, j)] * sn;
                if second {
                    entry += dyads.second[(i, j)] * s2;
                }
                if q != 0.0 {
                    entry -= q * f[(i, l)] * f[(k, j)];
                    if j == l {
                        entry -= q * left[(i, k)];
                    }
                    if i == k {
                        entry -= q * green[(j, l)];
                    }
                }
                if a == b {
                    entry += unit;
                }
                tangent[a * n + b] = entry;
                tangent[b * n + a] = entry;
            }
        }
        add_hessian_in(components, tangent, f, hessian);
    }
}

/// What stress and tangent are made of: with $g_1$, $g_2$ and $N$ the dyads
/// $A \ni \sum k_{ab}\\,g_a\otimes g_b$, and `unit`, `q` and `hessian` times what is left of
/// $\partial^2\bar I_1$ and $\partial^2\bar I_2$.
struct Dyads {
    stress: Mat3,
    first: Mat3,
    second: Mat3,
    normal: Mat3,
    k11: f64,
    k12: f64,
    k22: f64,
    k1n: f64,
    k2n: f64,
    knn: f64,
    unit: f64,
    q: f64,
    hessian: f64,
}

impl<E: InvariantEnergy> Invariants<E> {
    #[inline(always)]
    fn dyads(&self, f: &Mat3, reduced: &Reduced) -> Dyads {
        let Reduced { j, c, cofactor, green, excess } = reduced;
        let c = *c;
        let Distortion { w1, w2, w11, w12, w22, .. } = self.0.evaluate_excess(excess[0], excess[1]);
        let (i1, i2) = (3.0 + excess[0], 3.0 + excess[1]);

        // N = F⁻ᵀ; g1, g2: gradients of the reduced invariants.
        let normal = cofactor / *j;
        let first = 2.0 * (c * f - (i1 / 3.0) * normal);
        // A rubber without Ī2 asks for none of it: two products of matrices at every point.
        let second = if w2 != 0.0 || w12 != 0.0 || w22 != 0.0 {
            2.0 * (c * i1 * f - (c * c) * (f * green) - (2.0 / 3.0 * i2) * normal)
        } else {
            Mat3::zeros()
        };

        // The dyads of A = Σ H̄_ab g_a⊗g_b + Σ K̄_a ∂²Ī_a. Differentiating Ī1 = c I1 and
        // Ī2 = c² I2 once more gives dyads of F, FG and N, all in the span of g1, g2 and N:
        //   ∂²Ī1 ∋ -2/3 (g1⊗N + N⊗g1) + 2/9 Ī1 N⊗N
        //   ∂²Ī2 ∋ -4/3 (g2⊗N + N⊗g2) - 4/9 Ī2 N⊗N + 4 c² F⊗F, F = (g1/2 + Ī1 N/3)/c
        // What is left of ∂²Ī1 is 2c δ_ik δ_JL, and of ∂²Ī2
        // 2c² [δ_ik (I1 δ_JL - G_JL) - B_ik δ_JL - F_iL F_kJ], B = F Fᵀ.
        Dyads {
            stress: w1 * first + w2 * second,
            first,
            second,
            normal,
            k11: w11 + w2,
            k12: w12,
            k22: w22,
            k1n: 2.0 / 3.0 * (i1 * w2 - w1),
            k2n: -4.0 / 3.0 * w2,
            knn: 2.0 / 9.0 * (i1 * w1 - 2.0 * i2 * w2 + 2.0 * i1 * i1 * w2),
            unit: 2.0 * c * w1 + 2.0 * c * i1 * w2,
            q: 2.0 * c * c * w2,
            hessian: -2.0 / 3.0 * (i1 * w1 + 2.0 * i2 * w2) / j,
        }
    }
}
