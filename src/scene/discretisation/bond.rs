//! Bonds: bodies that share faces, joined by rows over the interface.

use std::collections::HashMap;

use crate::boundary::{ConstraintEquation, Constraints};
use crate::cells::BoundaryCells;
use crate::error::Error;
use crate::geometry::{Part, Point};
use crate::kinematics::Kinematics;
use crate::neighbours::BoxTree;
use crate::order;
use crate::shape::ShapeFunctions;
use crate::term::Amplitude;

use super::conditions::Placed;
use super::discrete_body::DiscreteBody;
use super::facet_rule::FacetRule;
use super::interface::{InterfaceSide, MultiplierValues, carried, linear, shared};
use super::interface_moments::correct;
use crate::scene::definition::place::{Place, Spot};
use crate::scene::definition::scene::Scene;
use crate::scene::definition::source::BodyCells;

/// Middles of one facet found twice differ by less than this part of its coordinates.
const SAME: f64 = 1e-9;

/// Two rules integrate one interface where their measures and first moments agree to this part.
const AGREED: f64 = 1e-9;

/// Which particles are tied to each other or to the ground, component by component: a row between two that are is one too
/// many.
pub(crate) struct Ties {
    leader: Vec<usize>,
}

impl Ties {
    /// Nothing tied among `unknowns` but what the conditions hold.
    pub(crate) fn new<const D: usize>(equations: &Constraints, unknowns: usize) -> Self {
        let mut ties = Ties { leader: (0..=unknowns).collect() };
        for unknown in 0..unknowns {
            if equations.prescribes(unknown / D, unknown % D) {
                ties.join(unknown, unknowns);
            }
        }
        ties
    }

    fn leader(&mut self, mut k: usize) -> usize {
        while self.leader[k] != k {
            self.leader[k] = self.leader[self.leader[k]];
            k = self.leader[k];
        }
        k
    }

    /// Ties two; `false` where they were already.
    fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.leader(a), self.leader(b));
        self.leader[a.min(b)] = a.max(b);
        a != b
    }
}

/// Adds rows $\int\Theta_J\\,(u_1 - u_2)\\,\mathrm d\Gamma = 0$ over the faces that two bodies share, with the trace functions of the coarser
/// one; `false` where they share none.
pub(crate) fn bond<const D: usize>(
    equations: &mut Constraints,
    ties: &mut Ties,
    discrete_bodies: [&DiscreteBody<D>; 2],
    boundaries: [BoundaryCells<D>; 2],
    kinematics: &dyn Kinematics<D>,
) -> Result<bool, Error> {
    let chosen = shared([&boundaries[0], &boundaries[1]]);
    if chosen.iter().any(Vec::is_empty) {
        return Ok(false);
    }
    let mut interface_sides = Vec::with_capacity(2);
    for side in 0..2 {
        interface_sides.push(InterfaceSide::new(discrete_bodies[side], &boundaries[side], &chosen[side], kinematics)?);
    }
    if interface_sides[1].particles.len() < interface_sides[0].particles.len() {
        interface_sides.swap(0, 1);
    }
    let [mortar, other] = interface_sides.as_slice() else { return Ok(false) };
    let number: HashMap<u32, usize> = mortar.particles.iter().enumerate().map(|(k, &p)| (p, k)).collect();
    let own: MultiplierValues =
        mortar.cells.traces.iter().map(|traces| traces.iter().map(|&(p, v)| (number[&p], v)).collect()).collect();
    let centre = mortar.cells.points.positions.iter().sum::<Point<D>>() / mortar.weights.len() as f64;
    let size = mortar.cells.points.positions.iter().map(|x| (x - centre).norm()).fold(f64::MIN_POSITIVE, f64::max);
    let totals = [mortar.moments(&centre, size), other.moments(&centre, size)];
    let agree = totals[0].iter().zip(&totals[1]).all(|(a, b)| (a - b).abs() <= AGREED * totals[0][0].abs());
    let carried_values;
    let mut sides: Vec<BondedSide<'_, D>> = Vec::new();
    if agree {
        let mut functions = carried(mortar, &number, other);
        let mut wanted = vec![vec![0.0; D + 1]; number.len()];
        for ((values, x), weight) in own.iter().zip(&mortar.cells.points.positions).zip(&mortar.weights) {
            for &(j, value) in values {
                wanted[j].iter_mut().zip(linear(x, &centre, size)).for_each(|(m, q)| *m += weight * value * q);
            }
        }
        correct(&mut functions, other, &wanted, &centre, size);
        carried_values = functions;
        sides.push((&own, &mortar.weights, mortar.values.clone()));
        sides.push((&carried_values, &other.weights, other.values.clone()));
    } else if totals[0][0] <= totals[1][0] {
        // The faces end at different places: the points of the smaller one serve both.
        sides.push((&own, &mortar.weights, mortar.values.clone()));
        sides.push((&own, &mortar.weights, other.discrete_body.values_at(&mortar.cells.points.positions)?));
    } else {
        carried_values = carried(mortar, &number, other);
        let there = mortar.discrete_body.values_at(&other.cells.points.positions)?;
        sides.push((&carried_values, &other.weights, there));
        sides.push((&carried_values, &other.weights, other.values.clone()));
    }
    let label = format!("bond of {} and {}", discrete_bodies[0].name, discrete_bodies[1].name);
    let supports = supports(&sides, number.len());
    let (neighbours, nearest) = (neighbours(mortar, &own), nearest(mortar, other));
    let first = [mortar.discrete_body.nodes.start, other.discrete_body.nodes.start];
    for component in 0..D {
        let free: Vec<bool> = mortar
            .particles
            .iter()
            .zip(&nearest)
            .map(|(&own, &others)| {
                let unknown = |side: usize, particle: u32| (first[side] + particle as usize) * D + component;
                ties.join(unknown(0, own), unknown(1, others))
            })
            .collect();
        let gathered = gathered(mortar, &free, &neighbours);
        for (j, parts) in gathered.iter().enumerate().filter(|(_, parts)| !parts.is_empty()) {
            let entries = entries(&sides, parts, &supports, |side, node| (first[side] + node) * D + component);
            let dependent = (first[0] + mortar.particles[j] as usize) * D + component;
            equations.push(ConstraintEquation {
                entries,
                dependent,
                target: 0.0,
                amplitude: Amplitude::Constant,
                label: label.clone(),
            })?;
        }
    }
    Ok(true)
}

/// Values of the multipliers' functions at the points of one side, with weights and shape functions there.
type BondedSide<'a, const D: usize> = (&'a MultiplierValues, &'a [f64], Vec<ShapeFunctions<D>>);

/// Points and values of each multiplier's function on both sides.
fn supports<const D: usize>(sides: &[BondedSide<'_, D>], multipliers: usize) -> Vec<[Vec<(usize, f64)>; 2]> {
    let mut supports: Vec<[Vec<(usize, f64)>; 2]> = vec![[Vec::new(), Vec::new()]; multipliers];
    for (side, (functions, ..)) in sides.iter().enumerate() {
        for (point, values) in functions.iter().enumerate() {
            for &(j, value) in values.iter().filter(|entry| entry.1 != 0.0) {
                supports[j][side].push((point, value));
            }
        }
    }
    supports
}

/// The multipliers that share a facet with each.
fn neighbours<const D: usize>(mortar: &InterfaceSide<'_, D>, own: &MultiplierValues) -> Vec<Vec<usize>> {
    let mut neighbours: Vec<Vec<usize>> = vec![Vec::new(); mortar.particles.len()];
    for group in mortar.cells.points.groups.windows(2) {
        let mut together: Vec<usize> = Vec::new();
        for values in &own[group[0]..group[1]] {
            for entry in values {
                together.push(entry.0);
            }
        }
        together.sort_unstable();
        together.dedup();
        for &j in &together {
            neighbours[j].extend(&together);
        }
    }
    neighbours
}

/// The nearest particle of the other side to each of the mortar side.
fn nearest<const D: usize>(mortar: &InterfaceSide<'_, D>, other: &InterfaceSide<'_, D>) -> Vec<u32> {
    mortar
        .particles
        .iter()
        .map(|&particle| {
            let x = mortar.position(particle);
            let distance = |k: u32| (other.position(k) - x).norm_squared();
            let all = other.particles.iter().copied();
            all.min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b))).unwrap_or(0)
        })
        .collect()
}

/// Where each function goes: to itself, or to the nearest free one on a shared facet.
fn gathered<const D: usize>(
    mortar: &InterfaceSide<'_, D>,
    free: &[bool],
    neighbours: &[Vec<usize>],
) -> Vec<Vec<usize>> {
    let mut gathered: Vec<Vec<usize>> = vec![Vec::new(); free.len()];
    for j in 0..free.len() {
        let x = mortar.position(mortar.particles[j]);
        let distance = |k: usize| (mortar.position(mortar.particles[k]) - x).norm_squared();
        let receiver = if free[j] {
            Some(j)
        } else {
            let near = neighbours[j].iter().copied().filter(|&k| free[k]);
            near.min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)))
        };
        if let Some(receiver) = receiver {
            gathered[receiver].push(j);
        }
    }
    gathered
}

/// The entries of one equation: the difference of what some functions see on both sides.
fn entries<const D: usize>(
    sides: &[BondedSide<'_, D>],
    parts: &[usize],
    supports: &[[Vec<(usize, f64)>; 2]],
    unknown: impl Fn(usize, usize) -> usize,
) -> Vec<(usize, f64)> {
    let mut entries: HashMap<usize, f64> = HashMap::new();
    for (side, (_, weights, values)) in sides.iter().enumerate() {
        let sign = if side == 0 { 1.0 } else { -1.0 };
        for &(point, value) in parts.iter().flat_map(|&part| &supports[part][side]) {
            let psi = &values[point];
            for (&node, &shape) in psi.nodes.iter().zip(&psi.values) {
                *entries.entry(unknown(side, node as usize)).or_default() += sign * weights[point] * value * shape;
            }
        }
    }
    let mut entries: Vec<(usize, f64)> = entries.into_iter().collect();
    order::sort(&mut entries, &|a, b| a.0.cmp(&b.0));
    entries
}

/// The boundaries of two bodies without the facets of the contacts between them: what is to touch is not bonded.
fn bondable<const D: usize>(
    scene: &Scene<D>,
    all: &BodyCells<D>,
    discrete_bodies: &[DiscreteBody<D>],
    rules: &[FacetRule],
    pair: [usize; 2],
) -> Result<[BoundaryCells<D>; 2], Error> {
    let boundary = |body: usize, part: &Part| {
        let rule = rules[body];
        discrete_bodies[body].cells.boundary(part, rule.parts, rule.gauss)
    };
    let mut boundaries = [boundary(pair[0], &Part::Whole)?, boundary(pair[1], &Part::Whole)?];
    for contact in &scene.contact_pairs {
        let Some(second) = &contact.second else { continue };
        let mut sides = Vec::new();
        for place in [&contact.first, second] {
            let place = scene.resolve(place);
            if let Spot::Part(part) = &place.spot {
                let of = scene.bodies_at(&place, &|| format!("contact of {place}"), all, &|_| true)?;
                sides.extend(of.first().map(|&body| (body, part.clone(), place.clone())));
            }
        }
        let [(a, ..), (b, ..)] = sides.as_slice() else { continue };
        if [*a, *b] != pair && [*b, *a] != pair {
            continue;
        }
        for (body, part, place) in &sides {
            let middles = boundary(*body, part)?.within(&|x| place.holds(x)).middles();
            let tree = BoxTree::of(&middles);
            let own = &mut boundaries[usize::from(*body == pair[1])];
            *own = own.within(&|x| {
                let nearest = tree.nearest(x).map(|k| middles[k]);
                nearest.is_none_or(|middle| (middle - x).norm() > SAME * x.norm().max(middle.norm()))
            });
        }
    }
    Ok(boundaries)
}

/// Bonds all bodies that share faces and are not left unbonded, but for the faces of contacts; whether there are any.
pub(crate) fn bond_all<const D: usize>(
    scene: &Scene<D>,
    all: &BodyCells<D>,
    discrete_bodies: &[DiscreteBody<D>],
    rules: &[FacetRule],
    equations: &mut Constraints,
    placed: &mut Vec<Placed<D>>,
) -> Result<bool, Error> {
    if discrete_bodies.len() < 2 {
        return Ok(false);
    }
    let unknowns = discrete_bodies.last().map_or(0, |last| last.nodes.end * D);
    let mut ties = Ties::new::<D>(equations, unknowns);
    let mut bonded = false;
    for (second, later) in discrete_bodies.iter().enumerate() {
        for (first, earlier) in discrete_bodies[..second].iter().enumerate() {
            let names = [&earlier.name, &later.name];
            let kept = |pair: &[String; 2]| names == [&pair[0], &pair[1]] || names == [&pair[1], &pair[0]];
            if scene.unbonded.iter().any(kept) {
                continue;
            }
            let before = equations.len();
            let boundaries = bondable(scene, all, discrete_bodies, rules, [first, second])?;
            bonded |= bond(equations, &mut ties, [earlier, later], boundaries, &*scene.kinematics)?;
            // The force of the bond is that on the earlier body.
            let (name, place) = (Some(format!("bond of {} and {}", names[0], names[1])), Place::body());
            if equations.len() > before {
                placed.push(Placed { name, place, equations: before..equations.len(), nodes: earlier.nodes.clone() });
            }
        }
    }
    Ok(bonded)
}
