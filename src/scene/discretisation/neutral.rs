//! Round bodies that are free to roll between surfaces without friction.
//!
//! The shape of such a body between its surfaces stays as it is while the material runs round: a neutral motion, which the particles
//! turn into one that is next to neutral, and which Newton's method follows for hundreds of iterations to a place that means nothing.

use std::ops::Range;
use std::sync::Arc;

use crate::assembly::Model;
use crate::boundary::Constraints;
use crate::cells::circumcentre;
use crate::contact::{ContactSurface, RollingSpring};
use crate::geometry::{Vec2, padded};
use crate::material::Material;

use super::discrete_body::DiscreteBody;
use super::sharing::Sharing;
use crate::order;
use crate::scene::{Contact, Scene};

/// Difference of radii, as a part of them, up to which particles lie on one circle.
const ROUND: f64 = 1e-6;
/// Moments of the shape beside those of a round one: of the order of the square of the spacing.
const EVEN: f64 = 1e-2;

/// A body that is free to roll, and what holds it.
pub(crate) struct Rolling {
    pub body: String,
    pub radius: f64,
    pub spring: Arc<RollingSpring>,
}

/// Adds what holds the rolling of round bodies that touch surfaces without friction alone, in the plane.
pub(crate) fn hold_rolling<const D: usize>(
    scene: &Scene<D>,
    bodies: &[DiscreteBody<D>],
    sharing: &Sharing,
    equations: &Constraints,
    contacts: &[Contact],
    model: &mut Model,
) -> Vec<Rolling> {
    if D != 2 || contacts.is_empty() || !scene.kinematics.hoop_components().is_empty() || !scene.loads.is_empty() {
        return Vec::new();
    }
    let held = |body: &DiscreteBody<D>| {
        let all = equations.equations().iter().flat_map(|equation| &equation.entries);
        all.into_iter().any(|&(unknown, _)| body.nodes.contains(&(unknown / D)))
    };
    let mut found = Vec::new();
    for body in bodies.iter().filter(|body| !held(body)) {
        let spring = || -> Option<(f64, RollingSpring)> {
            let surfaces = smooth(&body.nodes, contacts)?;
            let (radius, centre) = circle(&surfaces, model)?;
            let stiffness = body.body.material().initial_moduli().shear;
            let spring =
                is_even(body, sharing, &centre).then(|| spring(surfaces[0], &centre, contacts, stiffness, model));
            Some((radius, spring??))
        };
        if let Some((radius, spring)) = spring() {
            let spring = Arc::new(spring);
            model.add_replicated(spring.clone());
            found.push(Rolling { body: body.name.clone(), radius, spring });
        }
    }
    found
}

/// The contact surfaces of a body of some nodes, unless one of them has friction.
fn smooth<'a>(nodes: &Range<usize>, contacts: &'a [Contact]) -> Option<Vec<&'a ContactSurface>> {
    let mut found = Vec::new();
    for contact in contacts {
        for surface in contact.law.surfaces() {
            let own = surface.traces.first().is_some_and(|trace| nodes.contains(&(trace.particle as usize)));
            match (own, contact.law.has_friction()) {
                (true, true) => return None,
                (true, false) => found.push(surface),
                _ => {}
            }
        }
    }
    Some(found)
}

/// Radius and centre of the circle that all particles of contact surfaces lie on.
fn circle(surfaces: &[&ContactSurface], model: &Model) -> Option<(f64, Vec2)> {
    let surface = surfaces.first()?;
    let at = |trace: usize| model.point::<2>(surface.traces[trace].particle as usize);
    let count = surface.traces.len();
    let centre = circumcentre([at(0), at(count / 3), at(2 * count / 3)]);
    let radius = (at(0) - centre).norm();
    let on_circle = |surface: &&ContactSurface| {
        let off = |particle: u32| ((model.point::<2>(particle as usize) - centre).norm() / radius - 1.0).abs();
        surface.traces.iter().all(|trace| off(trace.particle) < ROUND)
    };
    (count >= 6 && surfaces.iter().all(on_circle)).then_some((radius, centre))
}

/// What holds a round body between surfaces, on one of its own surfaces.
fn spring(
    surface: &ContactSurface,
    centre: &Vec2,
    contacts: &[Contact],
    stiffness: f64,
    model: &Model,
) -> Option<RollingSpring> {
    let at = |trace: usize| model.point::<2>(surface.traces[trace].particle as usize);
    let (count, radius) = (surface.traces.len(), (at(0) - centre).norm());
    // Where surfaces are farthest away, and opposite of it.
    let distance = |x: &Vec2| {
        let rigid = contacts.iter().filter_map(|contact| contact.law.rigid());
        let gaps = rigid.map(|law| law.surface.placed(0.0, [0.0; 2]).nearest(&*law.surface.shape, &padded(x)).gap);
        gaps.fold(f64::INFINITY, f64::min)
    };
    let first = (0..count).max_by(|&a, &b| distance(&at(a)).total_cmp(&distance(&at(b))))?;
    let opposite = centre * 2.0 - at(first);
    let second = (0..count).min_by(|&a, &b| (at(a) - opposite).norm().total_cmp(&(at(b) - opposite).norm()))?;
    if (at(second) - opposite).norm() > radius {
        return None;
    }
    let across = at(first) - at(second);
    let tangent = Vec2::new(-across[1], across[0]) / across.norm();
    let mut weights: Vec<(u32, f64)> = Vec::new();
    for (trace, sign) in [(first, 1.0), (second, -1.0)] {
        let trace = &surface.traces[trace];
        for (k, &(point, weight)) in trace.points.iter().enumerate() {
            let values = trace.local(k).iter().zip(surface.table.values(point as usize));
            weights.extend(values.map(|(&l, value)| (trace.nodes[l as usize], sign * weight * value / trace.area)));
        }
    }
    let (nodes, weights) = order::merged(weights).into_iter().map(|(node, value)| (node, tangent * value)).unzip();
    Some(RollingSpring { nodes, weights, stiffness })
}

/// Whether the body is as heavy on all sides: its moments $\int r^m e^{im\varphi}\,\mathrm d\Omega$ vanish.
fn is_even<const D: usize>(body: &DiscreteBody<D>, sharing: &Sharing, centre: &Vec2) -> bool {
    let centre = padded(centre);
    let table = body.body.table();
    // Two parts of each moment and what they are measured against.
    let mut moments = [0.0f64; 18];
    for (x, weight) in table.positions().iter().zip(table.weights()) {
        let away = x - centre;
        let (mut real, mut imaginary) = (1.0, 0.0);
        for [a, b, size] in moments.as_chunks_mut::<3>().0 {
            (real, imaginary) = (real * away[0] - imaginary * away[1], real * away[1] + imaginary * away[0]);
            *a += weight * real;
            *b += weight * imaginary;
            *size += weight * f64::hypot(real, imaginary);
        }
    }
    sharing.total(&mut moments);
    moments.as_chunks::<3>().0.iter().all(|[a, b, size]| f64::hypot(*a, *b) < EVEN * size)
}
