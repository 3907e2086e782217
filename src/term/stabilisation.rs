//! The part of the volumetric energy that stays pointwise beside projected pressures.

use crate::material::{Material, Past, Prony, Volumetric, VolumetricEnergy};

/// Part of the bulk modulus that may stay pointwise beside projected pressures; see `Body::zonal`.
pub(super) const POINTWISE_SHARE: f64 = 0.1;

/// Zones of so many times the points of the smallest keep as many times its stabilisation, wider ones no more.
pub(super) const WIDEST: f64 = 1.5;

/// Part of the volumetric stiffness $U''$ that the pointwise energy has at most, however much it stiffens: the projected energy keeps at least
/// the other half, and stays convex.
const HALF: f64 = 0.5;

/// The stabilisation $s$ of a material with a volumetric part, so that $sk$ is a part of its instantaneous $\mu_0$, else 0; see `Body::new`.
pub(super) fn pointwise_share(material: &impl Material, of_shear: f64) -> f64 {
    let Some(volumetric) = material.volumetric() else { return 0.0 };
    let shear = material.initial_moduli().shear * material.relaxation().map_or(1.0, |prony| prony.relaxation(0.0));
    let bulk = volumetric.evaluate(1.0).curvature;
    let kept = of_shear * shear;
    if bulk > 0.0 && kept >= 0.0 { (kept / bulk).min(POINTWISE_SHARE) } else { 0.0 }
}

/// The energy $h(J)$ of which zones keep the share $s$ pointwise: $k\\,(J^n + J^{-n} - 2)/(2n^2)$ with $n = 5$.
///
/// Its curvature at $J = 1$ is that of $U$, and it grows fast on both sides: a change of volume that no pressure of a zone sees costs
/// little while it is small, and cannot become a fold. What is projected is $R = U - s\\,h$. Where $s\\,h''$ would exceed
/// $\kappa\\,U''$ ($\kappa = \tfrac12$), from $J_-$ downwards and from $J_+$ upwards, $h$ goes on with $h'' = \kappa\\,U''/s$:
/// $R'' \ge (1 - \kappa)\\,U''$ at all $J$, whatever $k/\mu$ is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PointwiseEnergy {
    bulk: f64,
    /// $J_-$ and $J_+$.
    range: [f64; 2],
    /// $\kappa/s$ of the zone with the largest share.
    beyond: f64,
}

impl PointwiseEnergy {
    /// The pointwise energy beside a volumetric one, for zones that keep no more than a share of it.
    pub(super) fn new(volumetric: &dyn VolumetricEnergy, share: f64) -> Self {
        let bulk = volumetric.evaluate(1.0).curvature;
        let part = HALF.max(share);
        let mut energy = PointwiseEnergy { bulk, range: [0.0, f64::INFINITY], beyond: part / share };
        if !(share > 0.0 && bulk > 0.0) {
            return energy;
        }
        let stiffer = |j: f64| share * energy.stiffening(j).curvature >= part * volumetric.evaluate(j).curvature;
        let range = [-1.0, 1.0].map(|side| first(stiffer, side));
        energy.range = [range[0].unwrap_or(0.0), range[1].unwrap_or(f64::INFINITY)];
        energy
    }

    /// $h$ and its derivatives; NaN where $J$ is not above zero.
    #[inline]
    pub(super) fn evaluate(&self, volumetric: &dyn VolumetricEnergy, j: f64) -> Volumetric {
        let [low, high] = self.range;
        let end = if j < low {
            low
        } else if j > high {
            high
        } else {
            return self.stiffening(j);
        };
        // The tangent at the end of the range, and of U what exceeds its own tangent there.
        let (inside, start, u) = (self.stiffening(end), volumetric.evaluate(end), volumetric.evaluate(j));
        let away = j - end;
        Volumetric {
            energy: inside.energy + inside.slope * away + self.beyond * (u.energy - start.energy - start.slope * away),
            slope: inside.slope + self.beyond * (u.slope - start.slope),
            curvature: self.beyond * u.curvature,
        }
    }

    /// $k\\,(J^n + J^{-n} - 2)/(2n^2)$.
    #[inline]
    fn stiffening(&self, j: f64) -> Volumetric {
        if j.is_nan() || j <= 0.0 {
            return Volumetric { energy: f64::NAN, slope: f64::NAN, curvature: f64::NAN };
        }
        let n = 5.0;
        let power = j.powi(5);
        let inverse = power.recip();
        // Jⁿ + J⁻ⁿ - 2 = (Jⁿ - 1)²/Jⁿ, without cancellation.
        let difference = (j - 1.0) * (1.0 + j * (1.0 + j * (1.0 + j * (1.0 + j))));
        let scaled = self.bulk / (2.0 * n);
        Volumetric {
            energy: scaled / n * difference * difference * inverse,
            slope: scaled * difference * (power + 1.0) * inverse / j,
            curvature: scaled * ((n - 1.0) * power + (n + 1.0) * inverse) / (j * j),
        }
    }
}

/// The $J$ nearest to 1, below it or above, from which on something holds; none within a factor of a thousand.
fn first(holds: impl Fn(f64) -> bool, side: f64) -> Option<f64> {
    // Parts of ln J: finer than any crossing of the two curvatures is sharp.
    let (count, farthest) = (70, 1e3f64.ln());
    let at = |part: f64| (side * part).exp();
    let parts = (0..=count).map(|k| farthest * k as f64 / count as f64);
    let mut outside = parts.into_iter().find(|part| holds(at(*part)))?;
    let mut inside = (outside - farthest / count as f64).max(0.0);
    for _ in 0..50 {
        let middle = 0.5 * (inside + outside);
        if holds(at(middle)) { outside = middle } else { inside = middle }
    }
    Some(at(outside))
}

/// What stays pointwise of the volumetric energy of a point in a step, $s\\,(a\\,h(J) + q\\,(J - 1))$: its pressure relaxes as the stress of the
/// shape does, $a = 1$ and $q = 0$ where nothing does. Were it to stay, a bonded body that relaxes would keep a part of its force, and take
/// another shape while it does.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kept {
    /// $sa$.
    pub share: f64,
    /// $sq$, of the volume of the point and of the one that is projected there.
    pub held: [f64; 2],
}

impl Kept {
    /// What stays of a share of an elastic energy.
    #[inline(always)]
    pub(super) fn elastic(share: f64) -> Self {
        Kept { share, held: [0.0; 2] }
    }

    /// Numbers that are remembered of a point: for the volume there and for the projected one $h'$ and its branches.
    pub(super) fn memory(prony: &Prony) -> usize {
        2 * (1 + prony.branch_count())
    }

    /// What stays of a share that relaxes, with its memory.
    pub(super) fn relaxing(share: f64, prony: &Prony, past: Past<'_>) -> Self {
        let share = share / prony.relaxation(0.0);
        let (own, projected) = past.memory.split_at(1 + prony.branch_count());
        let [(factor, held), (_, of_projected)] =
            [own, projected].map(|memory| prony.step(past.elapsed, memory[0], |k| memory[1 + k]));
        Kept { share: share * factor, held: [share * held, share * of_projected] }
    }

    /// Writes the memory at the end of a step that leads to the two $h'$.
    pub(super) fn remember(prony: &Prony, past: Past<'_>, slopes: [f64; 2], next: &mut [f64]) {
        let each = 1 + prony.branch_count();
        for ((before, next), slope) in past.memory.chunks_exact(each).zip(next.chunks_exact_mut(each)).zip(slopes) {
            next[0] = slope;
            for k in 0..prony.branch_count() {
                next[1 + k] = prony.next(k, past.elapsed, before[1 + k], slope - before[0]);
            }
        }
    }
}

/// What is projected, $R = U - s\\,(a\\,h + q\\,(J - 1))$: the volumetric energy without its pointwise part, so that homogeneous states have the
/// whole.
pub(super) struct ProjectedEnergy<'a> {
    pub volumetric: &'a dyn VolumetricEnergy,
    pub pointwise: &'a PointwiseEnergy,
    pub kept: Kept,
}

impl VolumetricEnergy for ProjectedEnergy<'_> {
    #[inline]
    fn evaluate(&self, j: f64) -> Volumetric {
        let whole = self.volumetric.evaluate(j);
        let Kept { share, held: [_, held] } = self.kept;
        if share == 0.0 {
            return whole;
        }
        let kept = self.pointwise.evaluate(self.volumetric, j);
        Volumetric {
            energy: whole.energy - share * kept.energy - held * (j - 1.0),
            slope: whole.slope - share * kept.slope - held,
            curvature: whole.curvature - share * kept.curvature,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{HartmannNeffVolume, MixedLogarithmicVolume, QuadraticVolume};

    /// The laws with a ratio of the moduli, and the share of solids, which is the largest.
    fn laws(ratio: f64) -> ([Box<dyn VolumetricEnergy>; 3], f64) {
        let bulk = ratio;
        let laws: [Box<dyn VolumetricEnergy>; 3] = [
            Box::new(QuadraticVolume { bulk }),
            Box::new(MixedLogarithmicVolume { bulk }),
            Box::new(HartmannNeffVolume { bulk }),
        ];
        (laws, (WIDEST / bulk).min(POINTWISE_SHARE))
    }

    /// The pointwise part is as stiff as the shear modulus, or the tenth, to within what n leaves beside J = 1, and what is projected keeps
    /// half of the stiffness of the law: for every ratio of the moduli and every change of volume.
    #[test]
    fn both_parts_of_the_volumetric_energy_are_convex() {
        for k in 0..=60 {
            let ratio = 3.0 * (1e6f64 / 3.0).powf(f64::from(k) / 60.0);
            let (laws, share) = laws(ratio);
            for law in &laws {
                let pointwise = PointwiseEnergy::new(&**law, share);
                for of_widest in [1.0, 1.0 / WIDEST] {
                    let share = of_widest * share;
                    let kept = Kept::elastic(share);
                    let projected = ProjectedEnergy { volumetric: &**law, pointwise: &pointwise, kept };
                    for l in -200..=200 {
                        let j = (f64::from(l) / 200.0 * 20f64.ln()).exp();
                        let (whole, kept, rest) =
                            (law.evaluate(j), pointwise.evaluate(&**law, j), projected.evaluate(j));
                        assert!(rest.curvature >= (1.0 - HALF - 1e-12) * whole.curvature, "k/µ {ratio}, J {j}");
                        assert!(kept.curvature > 0.0 && kept.energy >= 0.0, "k/µ {ratio}, J {j}");
                        let sum = rest.slope + share * kept.slope;
                        assert!((sum - whole.slope).abs() <= 1e-13 * (whole.slope.abs() + kept.slope.abs()));
                    }
                }
            }
        }
    }

    #[test]
    fn slopes_are_derivatives_inside_the_range_and_beyond_it() {
        for ratio in [3.0, 10.0, 300.0, 1e6] {
            let (laws, share) = laws(ratio);
            for law in &laws {
                let pointwise = PointwiseEnergy::new(&**law, share);
                let [low, high] = pointwise.range;
                let ends = [0.5 * low, 0.999 * low, 1.001 * low, 0.999 * high, 1.001 * high, 2.0 * high];
                // A law that stiffens as fast has no such ends.
                let ends = ends.into_iter().filter(|j| *j > 0.0 && j.is_finite());
                for j in ends.chain([0.9, 1.0, 1.1]) {
                    let step = 1e-5 * j;
                    let [below, at, above] = [j - step, j, j + step].map(|j| pointwise.evaluate(&**law, j));
                    let slope = (above.energy - below.energy) / (2.0 * step);
                    let curvature = (above.slope - below.slope) / (2.0 * step);
                    let size = at.curvature.abs();
                    assert!((slope - at.slope).abs() < 1e-6 * (size + at.slope.abs()), "k/µ {ratio}, J {j}");
                    assert!((curvature - at.curvature).abs() < 1e-6 * size, "k/µ {ratio}, J {j}: {curvature}");
                }
            }
        }
    }
}
