//! Bonds: bodies that share faces, joined by rows over the interface.

use std::collections::HashMap;
use std::sync::Arc;

use crate::boundary::{Constraints, FacetFunctions};
use crate::cells::BoundaryCells;
use crate::error::{BoundaryError, Error};
use crate::geometry::{Disjoint, Part, Point, Vec3, padded};
use crate::kinematics::Kinematics;
use crate::neighbours::BoxTree;

use super::conditions::Placed;
use super::discrete_body::DiscreteBody;
use super::facet_rule::FacetRule;
use super::interface::{Face, Shared, carried, shared};
use super::interface_moments::{Weighed, correct};
use crate::scene::{BodyCells, Scene, Spot};

/// Middles of one facet found twice differ by less than this part of its coordinates.
const SAME: f64 = 1e-9;

/// Two rules integrate one interface where their measures and first moments agree to this part.
const AGREED: f64 = 1e-9;

/// Nothing tied among `unknowns` but what the conditions tie to the ground, which is the number behind them: a row between two that are tied
/// is one too many.
fn ties<const D: usize>(equations: &Constraints, unknowns: usize) -> Disjoint {
    let mut ties = Disjoint::new(unknowns + 1);
    for unknown in 0..unknowns {
        if equations.prescribes(unknown / D, unknown % D) {
            ties.join(unknown, unknowns);
        }
    }
    ties
}

/// Adds rows $\int\Theta_J\\,(u_1 - u_2)\\,\mathrm d\Gamma = 0$ over the faces that two bodies share, with the trace functions of the side
/// that carries the bond, else of the coarser one; `false` where they share none.
fn bond<const D: usize>(
    equations: &mut Constraints,
    ties: &mut Disjoint,
    bodies: [&DiscreteBody<D>; 2],
    boundaries: [BoundaryCells<D>; 2],
    kinematics: &dyn Kinematics<D>,
) -> Result<bool, Error> {
    let Shared { chosen, unmatched, carrier, .. } = shared(D, boundaries.each_ref().map(BoundaryCells::padded));
    if let Some(at) = unmatched {
        let [first, second] = bodies.map(|body| body.name.clone());
        return Err(BoundaryError::Unmatched { first, second, at: at.as_slice()[..D].to_vec() }.into());
    }
    if chosen.iter().any(Vec::is_empty) {
        return Ok(false);
    }
    let face = |side: usize| {
        let lies = |point: usize| carrier.as_ref().is_none_or(|(own, lies)| *own != side || lies[point]);
        Face::new(bodies[side], &boundaries[side], &chosen[side], &lies, kinematics)
    };
    let (mut pair, mut faces) = (bodies, [face(0)?, face(1)?]);
    let coarser = usize::from(faces[1].order.0.len() < faces[0].order.0.len());
    if carrier.as_ref().map_or(coarser, |(side, _)| *side) == 1 {
        pair.reverse();
        faces.reverse();
    }
    let [mortar, other] = &faces;
    let cells = match carrier {
        // The points of one side serve both.
        Some(_) => [mortar.cells.clone(), mortar.cells.clone()],
        None => on_both_sides(mortar, other),
    };
    let side = |side: usize, sign: f64| {
        let DiscreteBody { approximation, nodes, .. } = pair[side];
        FacetFunctions::new((&**approximation, nodes.start, sign), cells[side].clone(), kinematics)
    };
    let sides = [&side(0, 1.0)?, &side(1, -1.0)?];
    let label = format!("bond of {} and {}", bodies[0].name, bodies[1].name);
    let nearest = |particle: u32| {
        let distance = |k: u32| (other.nodes[k as usize] - mortar.nodes[particle as usize]).norm_squared();
        let all = other.order.0.iter().copied();
        all.min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b))).unwrap_or(0)
    };
    let nearest: HashMap<u32, u32> = mortar.order.0.iter().map(|&particle| (particle, nearest(particle))).collect();
    equations.bond(&mortar.nodes, &mortar.order, sides, &label, &mut |component, own| {
        let unknown = |side: usize, particle: u32| (pair[side].nodes.start + particle as usize) * D + component;
        ties.join(unknown(0, own), unknown(1, nearest[&own]))
    })?;
    Ok(true)
}

/// Points and traces of the mortar for both sides: its own, and those carried to the points of the other side.
fn on_both_sides(mortar: &Face, other: &Face) -> [Arc<BoundaryCells<3>>; 2] {
    let centre = mortar.positions().iter().sum::<Vec3>() / mortar.weights.len() as f64;
    let size = mortar.positions().iter().map(|x| (x - centre).norm()).fold(f64::MIN_POSITIVE, f64::max);
    let weighed = [mortar, other].map(|face| Weighed::new(face, &centre, size));
    let totals = weighed.each_ref().map(Weighed::totals);
    let agree = totals[0].iter().zip(&totals[1]).all(|(a, b)| (a - b).abs() <= AGREED * totals[0][0].abs());
    let (here, mut there) = (&mortar.cells, BoundaryCells { traces: carried(mortar, other), ..(*other.cells).clone() });
    if agree {
        correct(&mut there.traces, mortar, weighed.each_ref());
    }
    let there = Arc::new(there);
    if agree {
        return [here.clone(), there];
    }
    // Where the faces end at different places the points of the smaller one serve both.
    let smaller = if totals[0][0] <= totals[1][0] { here.clone() } else { there };
    [smaller.clone(), smaller]
}

/// The boundaries of two bodies without the facets of the contacts between them: what is to touch is not bonded.
fn bondable<const D: usize>(
    scene: &Scene<D>,
    all: &BodyCells<D>,
    rule: &dyn Fn(usize) -> FacetRule,
    pair: [usize; 2],
) -> Result<[BoundaryCells<D>; 2], Error> {
    let boundary = |body: usize, part: &Part| {
        let rule = rule(body);
        all[body].1.facets(part, rule.parts, rule.gauss)
    };
    let mut boundaries = [boundary(pair[0], &Part::Whole)?, boundary(pair[1], &Part::Whole)?];
    for contact in scene.contact_pairs.iter().chain(&scene.released) {
        let Some(second) = &contact.second else { continue };
        let sides = [scene.touching(&contact.first, all)?, scene.touching(second, all)?];
        let [a, b] = sides.each_ref().map(|side| side.0);
        if [a, b] != pair && [b, a] != pair {
            continue;
        }
        for (body, place) in sides {
            let Spot::Part(part) = &place.spot else { continue };
            let middles = boundary(body, part)?.within(&|x| place.holds(x)).middles();
            let tree = BoxTree::of(&middles);
            let own = &mut boundaries[usize::from(body == pair[1])];
            *own = own.within(&|x| {
                let nearest = tree.nearest(x).map(|k| middles[k]);
                nearest.is_none_or(|middle| (middle - x).norm() > SAME * x.norm().max(middle.norm()))
            });
        }
    }
    Ok(boundaries)
}

/// Whether bodies are bonded where they have a point in common.
pub(crate) fn are_bonded_at<const D: usize>(
    scene: &Scene<D>,
    all: &BodyCells<D>,
    bodies: &[usize],
    at: &Point<D>,
) -> Result<bool, Error> {
    let mut bonded = Disjoint::new(bodies.len());
    let mut apart = bodies.len() - 1;
    for (k, &second) in bodies.iter().enumerate() {
        for (j, &first) in bodies[..k].iter().enumerate() {
            if scene.is_unbonded([first, second]) {
                continue;
            }
            // Middles do not depend on the rule.
            let boundaries = bondable(scene, all, &|_| FacetRule { parts: 1, gauss: 2 }, [first, second])?;
            let shared = shared(D, boundaries.each_ref().map(BoundaryCells::padded));
            if shared.chosen.iter().all(|own| !own.is_empty()) && shared.holds(&padded(at)) && bonded.join(j, k) {
                apart -= 1;
            }
        }
    }
    Ok(apart == 0)
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
    let mut ties = ties::<D>(equations, unknowns);
    let mut bonded = false;
    for (second, later) in discrete_bodies.iter().enumerate() {
        for (first, earlier) in discrete_bodies[..second].iter().enumerate() {
            if scene.is_unbonded([first, second]) {
                continue;
            }
            let (names, before) = ([&earlier.name, &later.name], equations.len());
            let boundaries = bondable(scene, all, &|body| rules[body], [first, second])?;
            bonded |= bond(equations, &mut ties, [earlier, later], boundaries, &*scene.kinematics)?;
            // The force of the bond is that on the earlier body.
            let (name, nodes) = (Some(format!("bond of {} and {}", names[0], names[1])), earlier.nodes.clone());
            if equations.len() > before {
                placed.push(Placed { name, place: None, equations: before..equations.len(), nodes });
            }
        }
    }
    Ok(bonded)
}
