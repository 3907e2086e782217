//! Finite viscoelasticity by a Prony series.

use std::ops::{Add, Mul, Sub};

use nalgebra::SVector;

use super::constants::{check, positive};
use super::{ALL, Material, Past, Response};
use crate::each::Each;
use crate::error::{Invalid, MaterialError};
use crate::geometry::Mat3;
use crate::tensor::{cofactor, determinant_hessian, inverse};

/// A Prony series of relaxation, $G(t) = G_0\Big(1 - \sum_ig_i\big(1 - e^{-t/\tau_i}\big)\Big) =
/// G_\infty\Big(1 + \sum_i\gamma_ie^{-t/\tau_i}\Big)$.
#[derive(Debug, Clone, PartialEq)]
pub struct Prony {
    /// What does not relax, as a part of the elastic law.
    equilibrium: f64,
    /// Parts that relax, and their times.
    branches: Vec<[f64; 2]>,
}

impl Prony {
    /// Pairs $(g_i, \tau_i)$ beside an elastic law that is the instantaneous one: $g_i > 0$ with a sum below 1.
    ///
    /// # Errors
    /// [`Invalid`] for parts and times that are not finite and above zero, and parts that add up to 1 or more.
    pub fn of_instantaneous(pairs: impl IntoIterator<Item = (f64, f64)>) -> Result<Self, MaterialError> {
        let branches = checked("g", pairs)?;
        let sum = branches.summed(|[g, _]| *g);
        check("sum of g_i", sum, !(sum >= 1.0), "parts that relax add up to less than 1")?;
        Ok(Self { equilibrium: 1.0 - sum, branches })
    }

    /// Pairs $(\gamma_i, \tau_i)$ beside an elastic law that is the relaxed one, $\gamma_i > 0$.
    ///
    /// # Errors
    /// [`Invalid`] for parts and times that are not finite and above zero.
    pub fn of_relaxed(pairs: impl IntoIterator<Item = (f64, f64)>) -> Result<Self, MaterialError> {
        Ok(Self { equilibrium: 1.0, branches: checked("gamma", pairs)? })
    }

    /// The part of the elastic law that has not relaxed at a time after a sudden stretch: from
    /// the instantaneous one at 0 to that at rest.
    pub fn relaxation(&self, time: f64) -> f64 {
        self.equilibrium + self.branches.summed(|[part, tau]| part * (-time / tau).exp())
    }

    /// How many parts relax.
    pub(crate) fn branch_count(&self) -> usize {
        self.branches.len()
    }

    /// $a$ and $H$ of a step of time: $aS + H$ is left of an elastic stress $S$ at its end, with what that was at the beginning and its branches.
    pub(crate) fn step<T: Stress>(&self, elapsed: f64, last: T, branch: impl Fn(usize) -> T) -> (f64, T) {
        let (mut factor, mut held) = (self.equilibrium, T::default());
        for (k, [part, tau]) in self.branches.iter().enumerate() {
            let x = elapsed / tau;
            let weight = part * mean_decay(x);
            factor += weight;
            held = held + branch(k) * (-x).exp() - last * weight;
        }
        (factor, held)
    }

    /// A branch at the end of a step in which the elastic stress has changed.
    pub(crate) fn next<T: Stress>(&self, k: usize, elapsed: f64, branch: T, change: T) -> T {
        let [part, tau] = self.branches[k];
        let x = elapsed / tau;
        branch * (-x).exp() + change * (part * mean_decay(x))
    }
}

/// What a series relaxes: a stress, or a pressure.
pub(crate) trait Stress:
    Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self>
{
}

impl<T: Copy + Default + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T>> Stress for T {}

fn checked(name: &str, pairs: impl IntoIterator<Item = (f64, f64)>) -> Result<Vec<[f64; 2]>, MaterialError> {
    let branches: Vec<[f64; 2]> = pairs.into_iter().map(|(part, tau)| [part, tau]).collect();
    for (i, branch) in branches.iter().enumerate() {
        for (name, value) in [name, "tau"].iter().zip(branch) {
            positive(format!("{name}_{}", i + 1), *value)?;
        }
    }
    ensure!(
        !branches.is_empty(),
        Invalid::new(
            "number of pairs of a Prony series",
            0.0,
            "give at least one pair of a part and a relaxation time tau"
        )
    );
    Ok(branches)
}

/// A material whose distortional stress relaxes: $\bar S = \bar F^{-1}\tau\bar F^{-T}$ of the elastic law, its stress seen by the
/// material itself, drives linear Maxwell branches,
/// $$\tau = \operatorname{dev}\Big[\bar F\Big(g_\infty\bar S + \sum_iQ_i\Big)\bar F^T\Big] + Jp\mathbf 1,\qquad
/// \dot Q_i + \frac{Q_i}{\tau_i} = g_i\dot{\bar S}.$$
///
/// Steps of time are exact for an $\bar S$ that changes evenly within them, second order otherwise, and stable however long:
/// $Q_i\leftarrow e^{-x_i}Q_i + g_i\frac{1-e^{-x_i}}{x_i}\Delta\bar S$, $x_i = \Delta t/\tau_i$. In a step that is sudden, $\Delta t = 0$, the
/// material is the instantaneous elastic law; in one much longer than all $\tau_i$ the relaxed one. Volume responds elastically. (Simo,
/// Computer Methods in Applied Mechanics and Engineering 60, 1987.)
///
/// The energy of a step is its potential, $a\\bar W + \\frac12H:(\\bar C - \\mathbf 1)$: the stress is its derivative, what the branches store it does not tell.
///
/// Without a clock (see [`Scene::over_time`](crate::scene::Scene::over_time)) nothing relaxes. Materials without a
/// [`volumetric`](Material::volumetric) part relax as a whole. A law that remembers something itself is driven by its own stress: filled
/// rubber that softens and relaxes is `Viscoelastic::new(Mullins::new(..)?, ..)`.
///
/// ```
/// use rkpm::material::{Prony, Rubber, Viscoelastic};
/// let pad = Viscoelastic::new(Rubber::yeoh(0.373, -0.031, 0.005, 1e3)?, Prony::of_instantaneous([(0.3, 1.0), (0.1, 50.0)])?); // MPa, s
/// # let _ = pad;
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Viscoelastic<M> {
    material: M,
    prony: Prony,
}

impl<M: Material> Viscoelastic<M> {
    /// The material of an elastic law and its relaxation.
    pub fn new(material: M, prony: Prony) -> Self {
        Self { material, prony }
    }

    /// Numbers of its own: the last $\bar S$, the branches, the largest square of $\bar S$.
    fn own(&self) -> usize {
        6 * (1 + self.prony.branches.len()) + 1
    }

    /// Whether the shape alone relaxes.
    fn is_isochoric(&self) -> bool {
        self.material.volumetric().is_some()
    }

    /// $a$ and $H$ of a step: its energy is $a\bar W + \frac12H:\bar C$.
    fn step(&self, own: &[f64], elapsed: f64) -> (f64, Symmetric) {
        self.prony.step(elapsed, symmetric(own), |k| symmetric(&own[6 * (1 + k)..]))
    }

    /// $\bar S = J^{2/3}F^{-1}\bar P$, the stress of the elastic law seen by the material.
    fn seen(&self, f: &Mat3, inner: Past<'_>) -> Symmetric {
        let Some(inverse) = inverse(f) else { return Symmetric::repeat(f64::NAN) };
        let scale = if self.is_isochoric() { f.determinant().powf(2.0 / 3.0) } else { 1.0 };
        let mut stress = [0.0; 9];
        self.material.respond(f, inner, &ALL, &mut stress, &mut []);
        let s = inverse * Mat3::from_row_slice(&stress) * scale;
        Symmetric::new(s.m11, s.m22, s.m33, 0.5 * (s.m23 + s.m32), 0.5 * (s.m13 + s.m31), 0.5 * (s.m12 + s.m21))
    }
}

/// 11, 22, 33, 23, 13, 12.
type Symmetric = SVector<f64, 6>;

fn symmetric(components: &[f64]) -> Symmetric {
    Symmetric::from_column_slice(&components[..6])
}

fn matrix(s: &Symmetric) -> Mat3 {
    Mat3::new(s[0], s[5], s[4], s[5], s[1], s[3], s[4], s[3], s[2])
}

/// The square of the Frobenius norm.
fn square(s: &Symmetric) -> f64 {
    s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + 2.0 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5])
}

/// $(1 - e^{-x})/x$.
fn mean_decay(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { -(-x).exp_m1() / x }
}

/// $\frac12\int_0^1xe^{-xv}v(1-v)\\,\mathrm dv$: what an even change of $\bar S$ in place of a curved one does to a branch.
fn curvature_weight(x: f64) -> f64 {
    if x < 1e-2 {
        return x / 12.0 * (1.0 - 0.5 * x);
    }
    let decay = (-x).exp();
    let mean = mean_decay(x);
    0.5 * (mean - 2.0 / x * (mean - decay))
}

impl<M: Material> Material for Viscoelastic<M> {
    fn inner(&self) -> Option<&dyn Material> {
        Some(&self.material)
    }

    fn energy_from(&self, f: &Mat3, past: Past<'_>) -> f64 {
        let (own, inner) = past.split(self.own());
        let (factor, held) = self.step(own, past.elapsed);
        let scale = if self.is_isochoric() { f.determinant().powf(-2.0 / 3.0) } else { 1.0 };
        // H:(C̄ - δ): nothing at rest.
        let work = scale * (f.transpose() * f).dot(&matrix(&held)) - matrix(&held).trace();
        factor * self.material.energy_from(f, inner) + 0.5 * work
    }

    fn response_from(&self, f: &Mat3, past: Past<'_>) -> Response {
        Response::of_components(|of, stress, tangent| self.respond(f, past, of, stress, tangent))
    }

    fn respond(&self, f: &Mat3, past: Past<'_>, components: &[usize], stress: &mut [f64], tangent: &mut [f64]) {
        let (own, inner) = past.split(self.own());
        let isochoric = self.is_isochoric();
        let (factor, held) = self.step(own, past.elapsed);
        self.material.respond(f, inner, components, stress, tangent);
        let n = components.len();
        stress[..n].iter_mut().for_each(|p| *p *= factor);
        tangent.iter_mut().for_each(|a| *a *= factor);
        // ½ c H:C with c = J^(-2/3): c F H - ⅓ c h N, N = F⁻ᵀ, h = H:C.
        let held = matrix(&held);
        let pushed = f * held;
        let j = f.determinant();
        let (c, normal, h) = if isochoric {
            let c = if j > 0.0 { j.powf(-2.0 / 3.0) } else { f64::NAN };
            (c, cofactor(f) / j, (f.transpose() * pushed).trace())
        } else {
            (1.0, Mat3::zeros(), 0.0)
        };
        for (a, &row) in components.iter().enumerate() {
            let (i, k) = (row / 3, row % 3);
            stress[a] += c * (pushed[(i, k)] - h / 3.0 * normal[(i, k)]);
            if tangent.is_empty() {
                continue;
            }
            for (b, &column) in components.iter().enumerate() {
                let (m, l) = (column / 3, column % 3);
                let mut entry = if i == m { held[(k, l)] } else { 0.0 };
                if isochoric {
                    let (nik, nml) = (normal[(i, k)], normal[(m, l)]);
                    entry -= 2.0 / 3.0 * (pushed[(i, k)] * nml + nik * pushed[(m, l)]);
                    // ∂N = (∂²J - J N⊗N)/J.
                    entry += h * (5.0 / 9.0 * nik * nml - determinant_hessian(f, row, column) / (3.0 * j));
                }
                tangent[a * n + b] += c * entry;
            }
        }
    }

    fn memory(&self) -> usize {
        self.own() + self.material.memory()
    }

    /// Nothing, but for a law that is stressed at rest, as one that was stretched before.
    fn start(&self, memory: &mut [f64]) {
        let (own, inner) = memory.split_at_mut(self.own());
        self.material.start(inner);
        let stressed = self.seen(&Mat3::identity(), Past { memory: inner, elapsed: 0.0 });
        own[..6].copy_from_slice(stressed.as_slice());
        for (branch, [part, _]) in own[6..].chunks_exact_mut(6).zip(&self.prony.branches) {
            branch.copy_from_slice((stressed * *part).as_slice());
        }
        own[own.len() - 1] = square(&stressed);
    }

    fn settled(&self, f: &Mat3, past: Past<'_>) -> Mat3 {
        self.material.settled(f, past.split(self.own()).1)
    }

    fn relaxation(&self) -> Option<&Prony> {
        Some(&self.prony)
    }

    fn remember(&self, f: &Mat3, past: Past<'_>, next: &mut [f64]) {
        let (own, inner) = past.split(self.own());
        let (next, next_of_inner) = next.split_at_mut(own.len());
        let (last, seen) = (symmetric(own), self.seen(f, inner));
        next[..6].copy_from_slice(seen.as_slice());
        // The largest square of the stress stands behind the branches.
        let branches = own[6..].chunks_exact(6).zip(next[6..].chunks_exact_mut(6));
        for (k, (branch, next)) in branches.enumerate() {
            let held = self.prony.next(k, past.elapsed, symmetric(branch), seen - last);
            next.copy_from_slice(held.as_slice());
        }
        let place = own.len() - 1;
        next[place] = own[place].max(square(&seen));
        self.material.remember(f, inner, next_of_inner);
    }

    fn time_error(&self, before: Option<Past<'_>>, past: Past<'_>, next: &[f64]) -> [f64; 2] {
        let (own, inner) = past.split(self.own());
        let (next, next_of_inner) = next.split_at(own.len());
        let of_inner = self.material.time_error(before.map(|before| before.split(own.len()).1), inner, next_of_inner);
        let (elapsed, largest) = (past.elapsed, next[own.len() - 1]);
        // Against the largest stress so far: a cycle passes through none.
        let change = symmetric(next) - symmetric(own);
        // S̄'' Δt², where a rate before is known.
        let curvature = before.filter(|before| before.elapsed > 0.0).map(|before| {
            let rate = (symmetric(own) - symmetric(before.memory)) / before.elapsed;
            (change / elapsed - rate) * (2.0 * elapsed * elapsed / (before.elapsed + elapsed))
        });
        let of_branch = |[part, tau]: &[f64; 2]| {
            let x = elapsed / tau;
            part * match &curvature {
                Some(curvature) => curvature_weight(x) * square(curvature).sqrt(),
                // Another rule of second order in place of a rate.
                None => (mean_decay(x) - (-0.5 * x).exp()).abs() * square(&change).sqrt(),
            }
        };
        let error: f64 = if elapsed > 0.0 { self.prony.branches.summed(of_branch) } else { 0.0 };
        [error * error + of_inner[0], largest]
    }
}
