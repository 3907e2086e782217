//! The increments of the condensed unknowns of a body over one cluster.

use crate::material::Material;
use crate::simd::{Arithmetic, Task};
use crate::table::displacement_gradient;
use crate::tensor::cofactor;

use super::Term;
use super::body::Body;
use super::element::View;
use super::pressure_field::PressureField;
use super::step_limit::{largest_part, largest_step, largest_step_of_hoops};
use super::zone_residuals::ZoneResiduals;

/// Increments of the condensed unknowns of a cluster and the largest step; see [`Term::advance`].
pub(super) struct Advance<'a, const D: usize> {
    pub body: &'a Body<D>,
    pub cluster: usize,
    pub view: View<'a>,
    pub step: &'a [f64],
    pub condensed_step: &'a mut [f64],
}

impl<const D: usize> Task for Advance<'_, D> {
    type Output = f64;

    #[inline(always)]
    fn run<A: Arithmetic>(self) -> f64 {
        let Advance { body, cluster, view, step, condensed_step } = self;
        let table = &body.table;
        let n = body.functions;
        let (theta, pi, measure) = body.zone(cluster, view.condensed);
        let share = body.stabilisation(cluster);
        let iterates = body.point_iterates(cluster, view.condensed);
        let recall = body.recall(view);
        let mut zone = ZoneResiduals::new(theta, pi, measure);
        let mut bound: f64 = 1.0;
        // C δd, function by function.
        let mut change_of_pi = [0.0; 4];
        let first = table.clusters().points(cluster).start;
        let volumetric = match body.field {
            PressureField::Displacement => None,
            _ => body.material.volumetric(),
        };
        for point in table.clusters().points(cluster) {
            let (nodes, gradients) = (table.nodes(point), table.gradients(point));
            let h = displacement_gradient::<A, D>(nodes, gradients, table.hoop_components(), view.displacement);
            let f = table.at_rest(point) + h;
            let df = displacement_gradient::<A, D>(nodes, gradients, table.hoop_components(), step);
            bound = bound.min(largest_step(&f, &df)).min(largest_step_of_hoops(&f, &df, table.hoop_components()));
            let Some(volumetric) = volumetric else { continue };
            let j = f.determinant();
            let change = cofactor(&f).dot(&df);
            if body.field == PressureField::Pointwise {
                let theta = view.condensed[2 * point];
                let u = volumetric.evaluate(theta);
                let of_theta = j - theta + change;
                let at = 2 * (point - first);
                condensed_step[at] = of_theta;
                condensed_step[at + 1] = u.slope - view.condensed[2 * point + 1] + u.curvature * of_theta;
            } else {
                let kept = body.kept(share, &recall, point);
                if let Some(&[theta, pi]) = iterates.get(2 * (point - first)..2 * (point - first) + 2) {
                    let u = body.pointwise_energy(volumetric, theta);
                    let of_theta = j - theta + change;
                    let at = 2 * (n + point - first);
                    condensed_step[at] = of_theta;
                    condensed_step[at + 1] = kept.share * (u.slope + u.curvature * of_theta) + kept.held[0] - pi;
                    bound = bound.min(largest_part(theta, of_theta));
                }
                let (phi, weight) = (body.zone_functions(point), table.weights()[point]);
                let measure = zone.add(body, (volumetric, kept), point, weight, theta, j);
                for (change_of_pi, phi) in change_of_pi.iter_mut().zip(phi) {
                    *change_of_pi += weight * measure.slope * change * phi;
                }
            }
        }
        for k in 0..n {
            condensed_step[k] = zone.of_pi[k] + change_of_pi[k];
            condensed_step[n + k] = zone.of_theta[k];
            for l in 0..n {
                condensed_step[n + k] += zone.hessian[k][l] * (zone.of_pi[l] + change_of_pi[l]);
            }
        }
        if n > 0 {
            // The exponent follows the pressure that is held, not that of the step: increments are linear in steps.
            let last = condensed_step.len() - 1;
            let held = view.condensed[body.unknowns(cluster)][last];
            condensed_step[last] = body.pulled(cluster, pi[0] * body.unit(cluster), held) - held;
        }
        bound
    }
}
