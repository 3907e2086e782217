//! Fields that fold between particles.

use crate::error::{Doubt, DoubtCause};
use crate::geometry::Point;
use crate::material::{Past, VolumetricEnergy};
use crate::solve::State;

use crate::scene::results::view::{BodyView, ProblemView};

use super::share::LARGEST_SHARE;

/// $|\ln(J/\hat J)|$ from which on the volume of a point is not what the pressure allows. Where a cell bends, a linear field has changes
/// below this one at no loss: with a single element across an arch they would be a fifth of the energy, with its force within 1 %.
const APART: f64 = 0.2;

/// Energies of a body and the point that is furthest from what the pressure allows.
struct Found {
    /// $\int\frac{\mu_0}{2}\ln^2(J/\hat J)$ over the points that are apart.
    folded: f64,
    /// The distortional energy.
    distortional: f64,
    /// $|\ln(J/\hat J)|$, $J$, $\hat J$ and the position.
    worst: [f64; 3],
    at: Point<3>,
}

/// A doubt about a state in which volumes are not what pressures allow.
///
/// Where pressures are projected the field is free to change volumes between the pressures, at little cost. A right field does so at
/// corners. $\hat J$ with $U'(\hat J) = p$ is the volume that the pressure allows, and $\frac{\mu_0}{2}\ln^2(J/\hat J)$ is the least energy
/// that a change of shape of this size takes: where its integral is more than a small part of the distortional energy, the shape of
/// the field is not that of the rubber.
pub(super) fn folded(problem: &ProblemView<'_>, state: &State) -> Option<Doubt> {
    let mut found = Found { folded: 0.0, distortional: 0.0, worst: [0.0, 1.0, 1.0], at: Point::zeros() };
    for (number, body) in problem.bodies.iter().enumerate() {
        add(*body, number, state, &mut found);
    }
    if let Some(ranks) = problem.model.ranks() {
        let mut sums = [found.folded, found.distortional];
        ranks.sum(&mut sums);
        [found.folded, found.distortional] = sums;
        let mut mine = found.worst.to_vec();
        mine.extend(&problem.cut(&found.at));
        let all = ranks.gathered(&mine);
        if let Some(worst) = all.chunks_exact(3 + problem.dim).max_by(|a, b| a[0].total_cmp(&b[0])) {
            found.worst.copy_from_slice(&worst[..3]);
            found.at.as_mut_slice()[..problem.dim].copy_from_slice(&worst[3..]);
        }
    }
    let share = found.folded / (found.folded + found.distortional);
    let [_, jacobian, allowed] = found.worst;
    (share > LARGEST_SHARE).then(|| Doubt {
        cause: DoubtCause::Volume { share, limit: LARGEST_SHARE, jacobian, allowed },
        load: state.load,
        at: problem.cut(&found.at),
    })
}

fn add(body: &dyn BodyView, number: usize, state: &State, found: &mut Found) {
    let material = body.material();
    let Some(volumetric) = material.volumetric() else { return };
    let memory = material.rest();
    let Some(pressures) = state.view(number).and_then(|view| body.bulk_pressures(view)) else { return };
    let moduli = material.initial_moduli();
    let weights = body.weights();
    for (point, &pressure) in pressures.iter().enumerate() {
        let f = body.deformation_gradient(point, &state.displacement);
        let energy = material.energy_from(&f, Past { memory: &memory, elapsed: 0.0 });
        if energy.is_finite() {
            found.distortional += weights[point] * energy;
        }
        let (jacobian, allowed) = (f.determinant(), allowed(volumetric, pressure / moduli.bulk, moduli.bulk));
        let apart = (jacobian / allowed).ln().abs();
        if apart > APART {
            found.folded += 0.5 * moduli.shear * weights[point] * apart * apart;
        }
        if apart > found.worst[0] {
            found.worst = [apart, jacobian, allowed];
            found.at = body.point(point);
        }
    }
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
