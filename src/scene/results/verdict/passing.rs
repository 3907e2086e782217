//! Bodies that pass through one another, or through rigid surfaces, where no contact is declared.

use std::collections::HashSet;
use std::f64::consts::PI;
use std::sync::Arc;

use nalgebra::Vector3;

use crate::contact::RigidContact;
use crate::error::{Doubt, DoubtCause};
use crate::geometry::Point;
use crate::scene::Problem;
use crate::scene::results::view::ProblemView;
use crate::solve::State;

use super::surface_points::SurfacePoint;

/// How deep a point of a surface has to lie in another body, as a part of the spacing of the particles: nearer ones may touch.
const DEPTH: f64 = 0.5;
/// Most points whose place is looked at; the work goes with their number times that of all.
const MOST: usize = 2000;

/// Doubts about surfaces that lie in a body, their own or another one, or behind a rigid surface.
pub(super) fn passed<const D: usize>(problem: &Problem<D>, state: &State, points: &[SurfacePoint]) -> Vec<Doubt> {
    let mut doubts: Vec<Doubt> = through_bodies(&problem.view(), state, points).into_iter().collect();
    doubts.extend(through_rigid(problem, state, points));
    doubts
}

/// The first surface point beneath which two bodies, or two parts of one, lie: closed surfaces that wind around a place once make it one
/// body's, surfaces that wind around it twice that of two.
fn through_bodies(problem: &ProblemView<'_>, state: &State, points: &[SurfacePoint]) -> Option<Doubt> {
    let dim = problem.dim;
    // Ranks hold shares of the volume, and the surface of the whole.
    if dim == 1 || problem.model.ranks().is_some() {
        return None;
    }
    let revolved = problem.bodies.iter().any(|body| !body.hoops().is_empty());
    let sources: Vec<(Point<3>, Vector3<f64>)> = points.iter().map(|point| (point.current, point.facet())).collect();
    let undeformed: Vec<(Point<3>, Vector3<f64>)> =
        points.iter().map(|point| (point.reference, point.normal * point.weight)).collect();
    let stride = points.len().div_ceil(MOST).max(1);
    let overlap = |point: &SurfacePoint| {
        // Where the surface is stretched its points are farther apart, and see a place from farther away.
        let own = extent(dim, &point.facet());
        let depth = (DEPTH * point.spacing).max(2.0 * own);
        let beneath = |x: &Point<3>, normal: Vector3<f64>| x - normal * depth;
        let now = winding(dim, &beneath(&point.current, point.area().normalize()), &sources, revolved)?;
        let before = winding(dim, &beneath(&point.reference, point.normal), &undeformed, revolved)?;
        (now > 1.5 && before < 1.5).then_some(depth)
    };
    let mut looked_at = points.iter().step_by(stride);
    let (point, depth) = looked_at.find_map(|point| Some((point, overlap(point)?)))?;
    let body = problem.bodies[point.body].name().to_string();
    let cause = DoubtCause::Passed { body, through: None, depth };
    Some(Doubt { cause, load: state.load, at: problem.cut(&point.reference) })
}

/// The extent of a part of a surface from its area vector: a length, or the root of an area.
fn extent(dim: usize, area: &Vector3<f64>) -> f64 {
    if dim == 2 { area.norm() } else { area.norm().sqrt() }
}

/// How often closed surfaces wind around a place: the solid angle under which it sees them, over that of the whole. None where a point of
/// them is nearer than the part of the surface that it stands for.
fn winding(dim: usize, at: &Point<3>, sources: &[(Point<3>, Vector3<f64>)], revolved: bool) -> Option<f64> {
    let whole = if dim == 2 { 2.0 * PI } else { 4.0 * PI };
    let mut sum = 0.0;
    for (x, area) in sources {
        let size = extent(dim, area);
        let mut add = |mirror: f64| {
            let (mut along, mut square) = (0.0, 0.0);
            for i in 0..dim {
                let sign = if i == 0 { mirror } else { 1.0 };
                let away = sign * x[i] - at[i];
                along += away * sign * area[i];
                square += away * away;
            }
            sum += along / square.powf(0.5 * dim as f64).max(f64::MIN_POSITIVE);
            square.sqrt() >= size
        };
        // The half plane closes by its mirror image.
        if !add(1.0) || revolved && !add(-1.0) {
            return None;
        }
    }
    Some(sum / whole)
}

/// Surface points, of no part that a contact with the surface is declared for, that have gone behind a rigid surface.
fn through_rigid<const D: usize>(problem: &Problem<D>, state: &State, points: &[SurfacePoint]) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    for contact in &problem.contacts {
        let Some(law) = contact.law.rigid() else { continue };
        let (now, rest) =
            (law.placed(&state.displacement, state.load), law.placed(&vec![0.0; state.displacement.len()], 0.0));
        // Several contacts may share one surface: copies of it that have gone to the same place.
        let shape = |law: &RigidContact| Arc::as_ptr(&law.surface.shape).cast::<()>();
        let all = problem.contacts.iter().filter_map(|other| other.law.rigid());
        let same = all.filter(|other| {
            let there = other.placed(&state.displacement, state.load);
            shape(other) == shape(law) && there.offset == now.offset && there.angle() == now.angle()
        });
        let declared: HashSet<usize> =
            same.flat_map(|other| &other.contact_surface.traces).map(|trace| trace.particle as usize).collect();
        let deepest = points
            .iter()
            .filter(|point| !point.owners.iter().any(|node| declared.contains(node)))
            .filter(|point| rest.nearest(&*law.surface.shape, &point.reference).gap > 0.0)
            .map(|point| (-now.nearest(&*law.surface.shape, &point.current).gap, point))
            .filter(|(depth, point)| *depth > DEPTH * point.spacing)
            .max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((depth, point)) = deepest {
            let body = problem.discrete_bodies()[point.body].name().to_string();
            let cause = DoubtCause::Passed { body, through: Some(contact.name.clone()), depth };
            doubts.push(Doubt { cause, load: state.load, at: point.reference.as_slice()[..D].to_vec() });
        }
    }
    doubts
}
