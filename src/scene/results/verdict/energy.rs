//! The elastic energy of bodies, against which doubts are measured.

use crate::geometry::{Mat3, Vec3};
use crate::material::{Material, Past};
use crate::quadrature::gauss_legendre;
use crate::scene::results::view::{BodyView, ProblemView};
use crate::solve::State;
use crate::term::View;

/// What a body stores in the change of its shape, and in that of its volume by the pressures.
#[derive(Debug, Clone, Copy)]
pub(super) struct Elastic {
    pub shape: f64,
    pub volume: f64,
}

/// The energies of all bodies; of laws that relax, that of a sudden step from rest to the state.
pub(super) fn elastic(problem: &ProblemView<'_>, state: &State) -> Vec<Elastic> {
    let mut sums = vec![0.0; 2 * problem.bodies.len()];
    for (number, (body, sums)) in problem.bodies.iter().zip(sums.chunks_exact_mut(2)).enumerate() {
        sums.copy_from_slice(&[of_shape(*body, state), of_volume(*body, problem.model.view(state, number))]);
    }
    problem.model.total(&mut sums);
    sums.chunks_exact(2).map(|sums| Elastic { shape: sums[0], volume: sums[1] }).collect()
}

fn of_shape(body: &dyn BodyView, state: &State) -> f64 {
    let material = body.material();
    let memory = material.rest();
    let past = Past { memory: &memory, elapsed: 0.0 };
    let told = !material.energy_from(&Mat3::identity(), past).is_nan();
    let work_points = gauss_legendre(WORK_POINTS).unwrap_or_default();
    let mut sum = 0.0;
    for (point, weight) in body.weights().iter().enumerate() {
        let f = body.deformation_gradient(point, &state.displacement);
        let energy = if told { material.energy_from(&f, past) } else { work(material, &f, past, &work_points) };
        if energy.is_finite() {
            sum += weight * energy;
        }
    }
    sum
}

/// $\int p^2/2k$.
fn of_volume(body: &dyn BodyView, view: Option<View<'_>>) -> f64 {
    let bulk = body.material().initial_moduli().bulk;
    let Some(pressures) = view.and_then(|view| body.bulk_pressures(view)) else { return 0.0 };
    body.weights().iter().zip(&pressures).map(|(weight, pressure)| 0.5 * weight * pressure * pressure / bulk).sum()
}

/// Points along the path of a deformation, with which the work of stretches up to 3 is the energy within $10^{-3}$.
const WORK_POINTS: usize = 4;

/// The energy of a law that tells none: the work of its stress while the logarithms of the principal stretches grow in proportion,
/// $\int_0^1 P(U^t) : (U^t \ln U)\,\mathrm{d}t$ with $U = \sqrt{F^\mathsf{T}F}$. On this path $J$ is positive, and 1 where it is 1 in the end.
fn work(material: &dyn Material, f: &Mat3, past: Past<'_>, (abscissae, weights): &(Vec<f64>, Vec<f64>)) -> f64 {
    let svd = f.svd(false, true);
    let (Some(axes), stretches) = (svd.v_t, svd.singular_values) else { return f64::NAN };
    let about_axes = |principal: Vec3| axes.transpose() * Mat3::from_diagonal(&principal) * axes;
    let mut work = 0.0;
    for (abscissa, weight) in abscissae.iter().zip(weights) {
        let along = about_axes(stretches.map(|stretch| stretch.powf(*abscissa)));
        let rate = about_axes(stretches.map(|stretch| stretch.powf(*abscissa) * stretch.ln()));
        work += weight * material.response_from(&along, past).stress.dot(&rate);
    }
    work
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Rubber;
    use approx::assert_relative_eq;

    #[test]
    fn the_work_of_a_hyperelastic_law_is_its_energy() {
        let law = Rubber::mooney_rivlin(0.4, 0.1, 500.0).unwrap();
        let (memory, points) = (law.rest(), gauss_legendre(WORK_POINTS).unwrap());
        let past = Past { memory: &memory, elapsed: 0.0 };
        // With a large rotation; stretched by 3 along one axis, and along two.
        let turned = Mat3::new(0.2, -1.9, 0.3, 1.1, 0.1, 0.2, -0.1, 0.3, 0.8);
        let [along, across] = [[3.0, 3f64.sqrt().recip()], [1.0 / 9.0, 3.0]]
            .map(|[one, two]| Mat3::from_diagonal(&[one, two, two].into()));
        for f in [turned, along, across] {
            assert!(f.determinant() > 0.0);
            assert_relative_eq!(work(&law, &f, past, &points), law.energy_from(&f, past), max_relative = 1e-3);
        }
    }
}
