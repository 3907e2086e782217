//! Free surfaces that are compressed beyond their stability.

use std::collections::{HashMap, HashSet};

use nalgebra::Vector3;

use crate::each::EachOf;
use crate::error::{Doubt, DoubtCause};
use crate::material::surface_stability;
use crate::scene::Problem;
use crate::scene::results::view::ProblemView;
use crate::solve::State;
use crate::tensor::across;

use super::surface_points::SurfacePoint;

/// Which particles of a surface are fixed.
struct Fixed {
    /// By components.
    components: Vec<bool>,
    /// In all components, or tied to others.
    bonded: Vec<bool>,
}

/// A doubt about a free surface that two neighbouring trace functions, in the mean, have beyond Biot's limit. Particles that share a
/// facet with a bonded one are left out: at the end of a bonded face strains are singular, and grow with refinement. So are surfaces in
/// contact, which prevents the waves.
pub(super) fn beyond_limit(
    problem: &ProblemView<'_>,
    state: &State,
    points: &[SurfacePoint],
    touching: &HashSet<usize>,
) -> Option<Doubt> {
    let dim = problem.dim;
    if dim == 1 {
        return None;
    }
    let fixed = fixed(problem);
    let mut exempt = touching.clone();
    for point in points.iter().filter(|point| point.owners.iter().any(|&node| fixed.bonded[node])) {
        exempt.extend(&point.owners);
    }
    // Sums of the criterion and of the weights, by particle.
    let mut sums: HashMap<usize, [f64; 2]> = HashMap::new();
    let is_free = |point: &&SurfacePoint| {
        let prevented = |i: usize| point.owners.iter().all(|&node| fixed.components[node * dim + i]);
        !(0..dim).any(prevented) && !point.owners.iter().all(|node| touching.contains(node))
    };
    for point in points.iter().filter(is_free) {
        let body = problem.bodies[point.body];
        let material = body.material();
        if body.is_sheet() || material.volumetric().is_none() {
            continue;
        }
        let Some(stability) = least(point, &|along, across| surface_stability(material, along, across)) else {
            continue;
        };
        for &node in &point.owners {
            let [sum, weight] = sums.entry(node).or_default();
            *sum += point.weight * stability;
            *weight += point.weight;
        }
    }
    let mean = |node: &usize| sums.get(node).map_or(f64::INFINITY, |[sum, weight]| sum / weight);
    let fails = |node: &&usize| mean(node) < 0.0 && !exempt.contains(node);
    let several = points.iter().filter(|point| point.owners.iter().filter(fails).count() >= 2);
    let worst = several.min_by(|a, b| {
        let of = |point: &SurfacePoint| point.owners.iter().map(mean).fold(f64::INFINITY, f64::min);
        of(a).total_cmp(&of(b))
    })?;
    let stretch = least(worst, &|along, _| along)?;
    let cause = DoubtCause::Surface { stretch };
    Some(Doubt { cause, load: state.load, at: problem.cut(&worst.reference) })
}

/// The least value over the principal directions of the surface: of the elastic stretches along it and across.
fn least(point: &SurfacePoint, of: &dyn Fn(f64, f64) -> f64) -> Option<f64> {
    let area = point.area();
    let normal = area / area.norm();
    let strain = point.f * point.f.transpose() / point.free.powi(2);
    let values: Vec<f64> = if point.dim == 2 {
        let tangent = Vector3::new(-normal.y, normal.x, 0.0);
        vec![of(tangent.dot(&(strain * tangent)).sqrt(), strain[(2, 2)].sqrt())]
    } else {
        let [a, b] = <[f64; 2]>::from(across(&strain, &normal)).each(|square| square.max(0.0).sqrt());
        vec![of(a, b), of(b, a)]
    };
    values.into_iter().filter(|value| value.is_finite()).min_by(f64::total_cmp)
}

fn fixed(problem: &ProblemView<'_>) -> Fixed {
    let (nodes, dim) = (problem.model.node_count(), problem.dim);
    let mut fixed = Fixed { components: vec![false; nodes * dim], bonded: vec![false; nodes] };
    for equation in problem.equations.equations() {
        let component = equation.dependent % dim;
        fixed.components[equation.dependent] = true;
        if equation.entries.iter().any(|&(k, c)| k % dim != component && c != 0.0) {
            fixed.bonded[equation.dependent / dim] = true;
        }
    }
    for node in 0..nodes {
        fixed.bonded[node] |= (0..dim).all(|i| fixed.components[node * dim + i]);
    }
    fixed
}

/// Particles in contact.
pub(super) fn touching<const D: usize>(problem: &Problem<D>, state: &State) -> HashSet<usize> {
    let key = |x: &[f64]| x.iter().map(|v| v.to_bits()).collect::<Vec<u64>>();
    let mut active = HashSet::new();
    for contact in &problem.contacts {
        let Ok(found) = problem.contact(state, &contact.name) else { continue };
        let points = found.points.iter().filter(|point| point.is_active);
        active.extend(points.map(|point| key(point.reference.as_slice())));
    }
    let mut touching = HashSet::new();
    if active.is_empty() {
        return touching;
    }
    for contact in &problem.contacts {
        for trace in contact.law.surfaces().iter().flat_map(|surface| &surface.traces) {
            let node = trace.particle as usize;
            if active.contains(&key(problem.model().coordinates(node))) {
                touching.insert(node);
            }
        }
    }
    touching
}
