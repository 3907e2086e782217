//! How far a material can be stretched before it loses stability.

use nalgebra::Matrix2;

use super::{Material, Mode, Past};
use crate::each::EachOf;
use crate::geometry::{Mat3, Vec3};
use crate::tensor;

/// A criterion of material stability.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Criterion {
    /// Drucker's: increments of Kirchhoff stress and logarithmic strain do positive work,
    /// $\sum_{ab}\frac{\partial\tau_a}{\partial\ln\lambda_b}\dot h_a\dot h_b > 0$ for the principal stretches, at constant volume where the
    /// material is nearly incompressible.
    Drucker,
    /// Strong ellipticity: $m_in_jm_kn_l\\\,F_{jJ}F_{lL}A_{iJkL} > 0$ for all directions, $m \perp n$ where the material is nearly
    /// incompressible. Beyond it fields may kink within the body.
    Ellipticity,
}

/// The stretches of one mode around 1 in which a material keeps a criterion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StableRange {
    /// The homogeneous test.
    pub mode: Mode,
    /// What is kept.
    pub criterion: Criterion,
    /// Smallest stretch; 0.1, the least that is looked at, where nothing was found.
    pub low: f64,
    /// Largest stretch; 10, the most that is looked at, where nothing was found.
    pub high: f64,
}

impl StableRange {
    /// Whether a stretch lies inside.
    pub fn contains(&self, stretch: f64) -> bool {
        stretch >= self.low && stretch <= self.high
    }
}

impl std::fmt::Display for StableRange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { mode, criterion, low, high } = self;
        let below = if *low <= SEARCHED[0] { "at least " } else { "" };
        let above = if *high >= SEARCHED[1] { "at least " } else { "" };
        write!(f, "{mode}, {criterion:?}: stretches from {below}{low:.4} to {above}{high:.4}")
    }
}

/// Stretches between which [`stable_ranges`] looks.
pub(crate) const SEARCHED: [f64; 2] = [0.1, 10.0];

/// Step of the search in the logarithm of the stretch.
const STEP: f64 = 0.02;

/// The ranges of stretch in which a material is stable in uniaxial, equibiaxial and planar tests, by both criteria.
///
/// Nearly incompressible materials ([`Material::volumetric`]) are looked at without change of volume, others with their
/// sides free. Where the energy ends, as Gent's does, so does the range. The search goes outwards by 2 % and then
/// bisects: an unstable stretch of road shorter than that is overlooked.
///
/// ```
/// use rkpm::material::{Criterion, Mode, Rubber, stable_ranges};
/// // µ₂ α₂ < 0: fits small strains, and gives way where its second term takes over.
/// let unstable = Rubber::ogden([(0.8, 1.5), (-0.02, 4.0)], 1e3)?;
/// let ranges = stable_ranges(&unstable);
/// let pulled = ranges.iter().find(|r| r.mode == Mode::Uniaxial && r.criterion == Criterion::Drucker).unwrap();
/// assert!(pulled.high < 4.0 && pulled.contains(1.2));
/// assert!(stable_ranges(&Rubber::neo_hookean(0.4, 1e3)?).iter().all(|r| r.contains(0.1) && r.contains(10.0)));
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
pub fn stable_ranges(material: &dyn Material) -> Vec<StableRange> {
    ranges(&Subject::of(material))
}

/// As [`stable_ranges`] for a distortional energy alone, incompressible.
pub fn stable_ranges_incompressible(distortional: &dyn Material) -> Vec<StableRange> {
    ranges(&Subject { incompressible: true, ..Subject::of(distortional) })
}

fn ranges(subject: &Subject<'_>) -> Vec<StableRange> {
    let mut ranges = Vec::with_capacity(6);
    for mode in Mode::SHAPES {
        for criterion in [Criterion::Drucker, Criterion::Ellipticity] {
            let holds = |stretch: f64| subject.holds(mode, criterion, stretch);
            let [low, high] = if holds(1.0) { SEARCHED.each(|end| edge(end, holds)) } else { [1.0, 1.0] };
            ranges.push(StableRange { mode, criterion, low, high });
        }
    }
    ranges
}

/// The last stretch on the way from 1 to another at which a condition holds.
fn edge(last: f64, holds: impl Fn(f64) -> bool) -> f64 {
    let end = last.ln();
    let steps = (end.abs() / STEP).ceil();
    let mut inside = 0.0;
    for k in 1..=steps as usize {
        let outside = end * k as f64 / steps;
        if holds(outside.exp()) {
            inside = outside;
            continue;
        }
        let (mut good, mut bad) = (inside, outside);
        while (bad - good).abs() > 1e-12 {
            let middle = 0.5 * (good + bad);
            if holds(middle.exp()) {
                good = middle;
            } else {
                bad = middle;
            }
        }
        return good.exp();
    }
    last
}

struct Subject<'a> {
    material: &'a dyn Material,
    rest: Vec<f64>,
    incompressible: bool,
}

impl<'a> Subject<'a> {
    fn of(material: &'a dyn Material) -> Self {
        Subject { material, rest: material.rest(), incompressible: material.volumetric().is_some() }
    }

    fn holds(&self, mode: Mode, criterion: Criterion, stretch: f64) -> bool {
        let stretches = if self.incompressible {
            mode.incompressible(stretch)
        } else if let Some(state) = mode.state(self.material, stretch) {
            state.stretches
        } else {
            return false;
        };
        let lambda = Vec3::from(stretches);
        let rest = Past { memory: &self.rest, elapsed: 0.0 };
        let response = self.material.response_from(&Mat3::from_diagonal(&lambda), rest);
        if !response.tangent.iter().all(|a| a.is_finite()) {
            return false;
        }
        match criterion {
            Criterion::Drucker => {
                // ∂τ_a/∂ln λ_b with τ_a = P_a λ_a.
                let slope = Mat3::from_fn(|a, b| {
                    let own = if a == b { response.stress[(a, a)] * lambda[a] } else { 0.0 };
                    lambda[a] * response.tangent[(4 * a, 4 * b)] * lambda[b] + own
                });
                if !self.incompressible {
                    return smallest(&slope) > 0.0;
                }
                // On the plane of constant volume.
                let (e, g) = (Vec3::new(1.0, -1.0, 0.0) / 2f64.sqrt(), Vec3::new(1.0, 1.0, -2.0) / 6f64.sqrt());
                let part = |v: &Vec3, w: &Vec3| v.dot(&(slope * w));
                Matrix2::new(part(&e, &e), part(&e, &g), part(&g, &e), part(&g, &g)).symmetric_eigenvalues().min() > 0.0
            }
            Criterion::Ellipticity => {
                let speed = |angles: [f64; 2]| {
                    let n = Vec3::new(
                        angles[0].sin() * angles[1].cos(),
                        angles[0].sin() * angles[1].sin(),
                        angles[0].cos(),
                    );
                    let pushed = lambda.component_mul(&n);
                    let acoustic = Mat3::from_fn(|i, k| {
                        let mut sum = 0.0;
                        for j in 0..3 {
                            for l in 0..3 {
                                sum += response.tangent[(3 * i + j, 3 * k + l)] * pushed[j] * pushed[l];
                            }
                        }
                        sum
                    });
                    if !self.incompressible {
                        return smallest(&acoustic);
                    }
                    tensor::across(&acoustic, &n).min()
                };
                least(speed) > 0.0
            }
        }
    }
}

fn smallest(matrix: &Mat3) -> f64 {
    (0.5 * (matrix + matrix.transpose())).symmetric_eigenvalues().min()
}

/// The least value over the directions of an octant: the principal planes are planes of symmetry.
fn least(of: impl Fn([f64; 2]) -> f64) -> f64 {
    const SIDE: usize = 9;
    let (mut centre, mut half) = ([std::f64::consts::FRAC_PI_4; 2], std::f64::consts::FRAC_PI_4);
    let mut best = f64::INFINITY;
    for _ in 0..4 {
        let mut nearest = centre;
        for p in 0..SIDE {
            for q in 0..SIDE {
                let at = |k: usize, c: f64| c + half * (2.0 * k as f64 / (SIDE - 1) as f64 - 1.0);
                let angles = [at(p, centre[0]), at(q, centre[1])];
                let value = of(angles);
                if value < best {
                    (best, nearest) = (value, angles);
                }
            }
        }
        (centre, half) = (nearest, half * 0.25);
    }
    best
}
