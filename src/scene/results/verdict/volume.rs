//! Fields that fold between particles.

use crate::error::{Doubt, DoubtCause};
use crate::geometry::Point;
use crate::material::VolumetricEnergy;
use crate::solve::State;
use crate::term::View;

use crate::scene::results::view::{BodyView, ProblemView};

use super::energy::elastic;

/// The largest part of its energy that a state may have in changes of volume that pressures do not allow, or lack where contacts overlap:
/// energies go with the squares of strains, so that strains are off by a tenth in the mean.
pub(super) const LARGEST_SHARE: f64 = 0.01;

/// $|\ln(J/\hat J)|$ from which on the volume of a point is not what the pressure allows. Where a cell bends, a linear field has changes
/// below this one at no loss: with a single element across an arch they would be a fifth of the energy, with its force within 1 %.
const APART: f64 = 0.2;

/// Where volumes are furthest from what pressures allow.
struct Worst {
    /// $|\ln(J/\hat J)|$, $J$, $\hat J$ and the position.
    values: [f64; 3],
    at: Point<3>,
}

/// A doubt about a state in which volumes are not what pressures allow.
///
/// Where pressures are projected the field is free to change volumes between the pressures, at little cost. A right field does so at
/// corners. $\hat J$ with $U'(\hat J) = p$ is the volume that the pressure allows, and $\frac{\mu_0}{2}\ln^2(J/\hat J)$ is the least energy
/// that a change of shape of this size takes: where its integral is more than a small part of the distortional energy, the shape of
/// the field is not that of the rubber.
pub(super) fn folded(problem: &ProblemView<'_>, state: &State) -> Option<Doubt> {
    let mut worst = Worst { values: [0.0, 1.0, 1.0], at: Point::zeros() };
    let mut folded = Vec::with_capacity(problem.bodies.len());
    for (number, body) in problem.bodies.iter().enumerate() {
        folded.push(apart(*body, problem.model.view(state, number), state, &mut worst));
    }
    problem.model.total(&mut folded);
    if folded.iter().all(|energy| *energy == 0.0) {
        return None;
    }
    // Each body by itself: what another one stores says nothing about it.
    let shares = folded.iter().zip(elastic(problem, state)).map(|(folded, energy)| folded / (folded + energy.shape));
    let share = shares.filter(|share| !share.is_nan()).fold(0.0, f64::max);
    if let Some(ranks) = problem.model.ranks() {
        let mut mine = worst.values.to_vec();
        mine.extend(&problem.cut(&worst.at));
        let all = ranks.gathered(&mine);
        if let Some(found) = all.chunks_exact(3 + problem.dim).max_by(|a, b| a[0].total_cmp(&b[0])) {
            worst.values.copy_from_slice(&found[..3]);
            worst.at.as_mut_slice()[..problem.dim].copy_from_slice(&found[3..]);
        }
    }
    let [_, jacobian, allowed] = worst.values;
    (share > LARGEST_SHARE).then(|| Doubt {
        cause: DoubtCause::Volume { share, limit: LARGEST_SHARE, jacobian, allowed },
        load: state.load,
        at: problem.cut(&worst.at),
    })
}

/// $\int\frac{\mu_0}{2}\ln^2(J/\hat J)$ over the points of a body that are apart.
fn apart(body: &dyn BodyView, view: Option<View<'_>>, state: &State, worst: &mut Worst) -> f64 {
    let material = body.material();
    let Some(volumetric) = material.volumetric() else { return 0.0 };
    let Some(pressures) = view.and_then(|view| body.bulk_pressures(view)) else { return 0.0 };
    let moduli = material.initial_moduli();
    let (weights, ends) = (body.weights(), [(-APART).exp(), APART.exp()]);
    let mut folded = 0.0;
    for (point, &pressure) in pressures.iter().enumerate() {
        let jacobian = body.deformation_gradient(point, &state.displacement).determinant();
        // U' grows with J.
        let [low, high] = ends.map(|factor| volumetric.evaluate(factor * jacobian).slope);
        if (low..=high).contains(&pressure) {
            continue;
        }
        let allowed = allowed(volumetric, pressure / moduli.bulk, moduli.bulk);
        let apart = (jacobian / allowed).ln().abs();
        if apart > APART {
            folded += 0.5 * moduli.shear * weights[point] * apart * apart;
        }
        if apart > worst.values[0] {
            *worst = Worst { values: [apart, jacobian, allowed], at: body.point(point) };
        }
    }
    folded
}

/// The $\hat J$ with $U'(\hat J) = p$, from a pressure over the bulk modulus.
fn allowed(volumetric: &dyn VolumetricEnergy, strain: f64, bulk: f64) -> f64 {
    /// Halves of the largest step in $\ln J$ until rounding.
    const HALVINGS: usize = 50;
    let mut allowed: f64 = 1.0 + strain;
    // U' is nearly straight around J = 1, where pressures of rubber are.
    if strain.abs() < 1e-3 {
        return allowed;
    }
    let (mut low, mut high) = (-4.0f64, 4.0f64);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        allowed = middle.exp();
        if volumetric.evaluate(allowed).slope < strain * bulk { low = middle } else { high = middle }
    }
    allowed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{LogarithmicVolume, QuadraticVolume};

    #[test]
    fn volumes_that_pressures_allow_are_inverse_to_pressures() {
        for strain in [-0.9, -0.3, -1e-4, 0.0, 2e-4, 0.2] {
            let quadratic = allowed(&QuadraticVolume { bulk: 700.0 }, strain, 700.0);
            assert!((quadratic - 1.0 - strain).abs() < 1e-12, "{strain}: {quadratic}");
        }
        // ln J / J = p/k.
        let found = allowed(&LogarithmicVolume { bulk: 3.0 }, -0.5, 3.0);
        assert!((found.ln() / found + 0.5).abs() < 1e-12, "{found}");
    }
}
