//! Conditions of a scene as rows.

use std::ops::Range;
use std::sync::Arc;

use crate::boundary::{
    BoundaryPiece, Constraints, PrescribedDirection, check_component, is_redundant, moved, rounding, scaled,
};
use crate::cells::Cells;
use crate::error::{BoundaryError, Error};
use crate::geometry::{Part, Point};
use crate::shape::Approximation;
use crate::term::Amplitude;

use super::facet_rule::FacetRule;
use crate::scene::definition::place::Spot;
use crate::scene::{Condition, Direction, Place, Scene, Value};

/// Called with the error of a condition that can't be added: returns it, or `Ok` to go on without the condition.
pub(crate) type Refused<'a> = &'a mut dyn FnMut(Error) -> Result<(), Error>;

/// A condition of a problem: the name and place by which its results are found, and its constraint equations.
pub(crate) struct Placed<const D: usize> {
    pub name: Option<String>,
    pub place: Place<D>,
    pub equations: Range<usize>,
    /// The nodes that its forces act on.
    pub nodes: Range<usize>,
}

/// One direction of a condition at a place whose name was looked up.
struct Single<'a, const D: usize> {
    place: &'a Place<D>,
    direction: &'a Direction<D>,
    value: &'a Value<D>,
    amplitude: &'a Amplitude,
    label: String,
}

/// The directions of a condition, one by one.
fn singles<'a, const D: usize>(
    condition: &'a Condition<D>,
    place: &'a Place<D>,
) -> impl Iterator<Item = Single<'a, D>> {
    condition.prescribed.iter().map(move |(direction, value)| {
        let (amplitude, label) = (&condition.amplitude, condition.label(direction));
        Single { place, direction, value, amplitude, label }
    })
}

/// Rows over boundaries with the given facet rule, or at particles without one; and which are those of each condition.
pub(crate) fn equations<const D: usize>(
    scene: &Scene<D>,
    mine: &[(usize, Place<D>)],
    cells: &dyn Cells<D>,
    approximation: &dyn Approximation<D>,
    facets: Option<FacetRule>,
    refused: Refused<'_>,
) -> Result<(Constraints, Vec<Placed<D>>), Error> {
    let mut equations = Constraints::new();
    let mut placed = Vec::with_capacity(mine.len());
    let mut last = None;
    for (number, place) in mine {
        let condition = &scene.conditions[*number];
        let first = equations.len();
        for single in singles(condition, place) {
            let before = equations.mark();
            // Rows over a face know nothing of single particles: what they say twice is looked up in the scene.
            let added = match facets.map_or(Ok(false), |_| lies_on_part(scene, mine, &single, cells)) {
                Ok(true) => Ok(()),
                Ok(false) => add(&mut equations, scene, &single, cells, approximation, facets, &mut last),
                Err(error) => Err(error),
            };
            if let Err(error) = added {
                refused(error)?;
                // Without the rows that were added before it was refused.
                equations.take_back(before);
            }
        }
        placed.push(Placed {
            name: condition.name.clone(),
            place: place.clone(),
            equations: first..equations.len(),
            nodes: 0..cells.positions().len(),
        });
    }
    Ok((equations, placed))
}

/// Adds the rows of a displacement that vanishes on a part, for a body that is tied there to another one.
pub(crate) fn tie<const D: usize>(
    equations: &mut Constraints,
    scene: &Scene<D>,
    (name, place): (&str, &Place<D>),
    cells: &dyn Cells<D>,
    approximation: &dyn Approximation<D>,
    facets: Option<FacetRule>,
) -> Result<(), Error> {
    let condition = Condition::on(place.clone()).displacement([0.0; D]).named(name);
    let mut last = None;
    for single in singles(&condition, place) {
        add(equations, scene, &single, cells, approximation, facets, &mut last)?;
    }
    Ok(())
}

/// Whether a condition at a particle says again what those on parts that hold the particle say: taken as well, the
/// particle would be prescribed twice.
///
/// # Errors
/// Where it says something else.
fn lies_on_part<const D: usize>(
    scene: &Scene<D>,
    mine: &[(usize, Place<D>)],
    single: &Single<'_, D>,
    cells: &dyn Cells<D>,
) -> Result<bool, Error> {
    let Spot::Point(at) = &single.place.spot else { return Ok(false) };
    let particle = particle_at(cells, at, &single.label)?;
    let at = &cells.positions()[particle];
    let mut prescriptions = Vec::new();
    for (number, place) in mine {
        let condition = &scene.conditions[*number];
        let Spot::Part(part) = &place.spot else { continue };
        // Parts that don't exist are refused with their own condition.
        if !place.holds(at) || !cells.boundary_nodes(part).is_ok_and(|nodes| nodes.contains(&particle)) {
            continue;
        }
        for other in singles(condition, place) {
            let normal = normal_at(cells, part, particle, other.direction)?;
            prescriptions.push(prescription_of(&other, at, &normal)?);
        }
    }
    let requested = prescription_of(single, at, &Point::zeros())?;
    Ok(is_redundant(&prescriptions, &requested, at, rounding(cells.positions()))?)
}

/// The outward normal of a part at one of its particles, where a direction asks for it.
fn normal_at<const D: usize>(
    cells: &dyn Cells<D>,
    part: &Part,
    particle: usize,
    direction: &Direction<D>,
) -> Result<Point<D>, Error> {
    if !matches!(direction, Direction::Normal) {
        return Ok(Point::zeros());
    }
    let normals = cells.boundary(part, 1, 2)?.normals_at_particles();
    Ok(normals.get(&(particle as u32)).copied().unwrap_or_else(Point::zeros))
}

/// What a condition prescribes at a point.
fn prescription_of<const D: usize>(
    single: &Single<'_, D>,
    at: &Point<D>,
    normal: &Point<D>,
) -> Result<PrescribedDirection, BoundaryError> {
    let (target, amplitude) = value_at(single, at);
    Ok(PrescribedDirection::new(single.direction.unit(&single.label, at, normal)?, &single.label, target, amplitude, 0))
}

/// What a condition prescribes at a point: a value and its amplitude.
fn value_at<const D: usize>(single: &Single<'_, D>, at: &Point<D>) -> (f64, Amplitude) {
    match single.value {
        Value::Motion(motion) => {
            let (motion, amplitude, at) = (motion.clone(), single.amplitude.clone(), *at);
            (1.0, Amplitude::Function(Arc::new(move |load| motion(&at, amplitude.evaluate(load).0))))
        }
        value => (value.at(at, 1.0), single.amplitude.clone()),
    }
}

/// Refuses values that take a point of a body of revolution to its axis or beyond, where its hoops would be inverted.
fn stays_off_axis<const D: usize>(
    scene: &Scene<D>,
    single: &Single<'_, D>,
    cells: &dyn Cells<D>,
    nodes: &[usize],
) -> Result<(), BoundaryError> {
    if !matches!(single.direction, Direction::Component(0)) || scene.kinematics.hoop_components().is_empty() {
        return Ok(());
    }
    for &node in nodes {
        let at = &cells.positions()[node];
        let (target, amplitude) = value_at(single, at);
        for load in [1.0, 0.75, 0.5, 0.25].into_iter().chain(single.amplitude.break_points()) {
            let radius = at[0] + target * amplitude.evaluate(load).0;
            // Points on the axis stay there: moved off it, they would be circles that were points.
            if radius < 0.0 || (radius == 0.0) != (at[0] == 0.0) {
                return Err(BoundaryError::BeyondAxis {
                    what: single.label.clone(),
                    at: at.as_slice().to_vec(),
                    radius,
                    load,
                });
            }
        }
    }
    Ok(())
}

/// The boundary at a place in pieces.
struct Pieces<const D: usize> {
    place: Place<D>,
    pieces: Vec<BoundaryPiece<D>>,
}

impl<const D: usize> Pieces<D> {
    /// The pieces at a place: those of the condition before, where that was on the same part.
    fn at<'a>(
        last: &'a mut Option<Self>,
        place: &Place<D>,
        part: &Part,
        cells: &dyn Cells<D>,
        facets: FacetRule,
    ) -> Result<&'a mut Vec<BoundaryPiece<D>>, Error> {
        let known = last.take_if(|own| own.place.takes_in(place) && place.takes_in(&own.place));
        let pieces = match known {
            Some(known) => known.pieces,
            None => {
                let pieces = match place.within.is_some() {
                    true => cells.boundary_within(part, facets.parts, facets.gauss, &|x| place.holds(x))?,
                    false => cells.boundary_pieces(part, facets.parts, facets.gauss)?,
                };
                pieces.into_iter().map(BoundaryPiece::new).collect()
            }
        };
        Ok(&mut last.insert(Pieces { place: place.clone(), pieces }).pieces)
    }
}

/// Adds the rows of one direction of a condition.
fn add<const D: usize>(
    equations: &mut Constraints,
    scene: &Scene<D>,
    single: &Single<'_, D>,
    cells: &dyn Cells<D>,
    approximation: &dyn Approximation<D>,
    facets: Option<FacetRule>,
    last: &mut Option<Pieces<D>>,
) -> Result<(), Error> {
    let (amplitude, label, place) = (single.amplitude, single.label.as_str(), single.place);
    if let Direction::Component(component) = *single.direction {
        check_component(component, D, label)?;
    }
    if let Value::Motion(_) = single.value {
        equations.add_break_points(amplitude.break_points());
    }
    let along = |x: &Point<D>, normal: &Point<D>| single.direction.unit(label, x, normal);
    let moves = match single.value {
        Value::Motion(motion) => {
            let (motion, amplitude) = (motion.clone(), amplitude.clone());
            Some(Arc::new(move |x: &Point<D>, load: f64| motion(x, amplitude.evaluate(load).0)) as _)
        }
        _ => None,
    };
    let target = |x: &Point<D>| single.value.at(x, 1.0);
    let in_proportion = scaled(&target, amplitude);
    let moving = moves.as_ref().map(|motion| moved(motion));
    let value: crate::boundary::Value<'_, D> = match &moving {
        Some(moving) => moving,
        None => &in_proportion,
    };
    let nodes = match (&place.spot, facets) {
        (Spot::Part(part), Some(facets)) => {
            let nodes: Vec<usize> = cells.boundary_nodes(part)?;
            let held: Vec<usize> = nodes.into_iter().filter(|&node| place.holds(&cells.positions()[node])).collect();
            stays_off_axis(scene, single, cells, &held)?;
            let before = equations.len();
            // One by one: each piece prescribes its corners before the next one.
            let mut whole = 0;
            let axis = match *single.direction {
                Direction::Component(component) => Some(component),
                _ => None,
            };
            for piece in Pieces::at(last, place, part, cells, facets)? {
                whole += piece.len();
                equations.integrate(approximation, piece, &*scene.kinematics, (axis, &along), value, label)?;
            }
            if place.within.is_some() && whole == 0 && equations.len() == before {
                return Err(empty(cells, part, label)?.into());
            }
            return Ok(());
        }
        (Spot::Part(part), None) => {
            let mut nodes = cells.boundary_nodes(part)?;
            nodes.retain(|&node| place.holds(&cells.positions()[node]));
            if nodes.is_empty() && place.within.is_some() {
                return Err(empty(cells, part, label)?.into());
            }
            nodes
        }
        (Spot::Point(at), _) => vec![particle_at(cells, at, label)?],
        (Spot::Body, _) => {
            let mut nodes: Vec<usize> = (0..cells.positions().len()).collect();
            nodes.retain(|&node| place.holds(&cells.positions()[node]));
            nodes
        }
    };
    stays_off_axis(scene, single, cells, &nodes)?;
    let normals = match (single.direction, &place.spot) {
        (Direction::Normal, Spot::Part(part)) => {
            let of = cells.boundary(part, 1, 2)?.normals_at_particles();
            nodes.iter().map(|&node| of.get(&(node as u32)).copied().unwrap_or_else(Point::zeros)).collect()
        }
        _ => Vec::new(),
    };
    equations.collocate(approximation, &nodes, &normals, &along, value, label)
}

/// The error of a part of a part that holds nothing.
fn empty<const D: usize>(cells: &dyn Cells<D>, part: &Part, label: &str) -> Result<BoundaryError, Error> {
    let nearest = cells.boundary_nodes(part)?.first().map(|&node| cells.positions()[node].as_slice().to_vec());
    Ok(BoundaryError::Empty { what: label.to_string(), nearest: nearest.unwrap_or_default() })
}

/// The particle that lies at a point, to a thousandth of its spacing along each axis.
pub(crate) fn particle_at<const D: usize>(cells: &dyn Cells<D>, at: &Point<D>, label: &str) -> Result<usize, Error> {
    let distance = |node: usize| (cells.positions()[node] - at).norm();
    let nearest = (0..cells.positions().len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
    let (offset, spacings) = (cells.positions()[nearest] - at, cells.spacings(nearest));
    if (0..D).all(|i| offset[i].abs() <= 1e-3 * spacings[i]) {
        Ok(nearest)
    } else {
        let nearest = cells.positions()[nearest].as_slice().to_vec();
        Err(BoundaryError::Empty { what: label.to_string(), nearest }.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prelude::*;

    /// Rows at particles and over boundaries, some owned twice, taken back one condition after the other.
    #[test]
    fn what_was_added_is_taken_back() {
        let block = Block::new([0.0, 0.0], [2.0, 1.0]);
        let break_points = Amplitude::table(vec![(0.0, 0.0), (0.5, 2.0), (1.0, 1.0)]).unwrap();
        let moved = Value::motion(|x: &Point<2>, load| 0.1 * x[1] * load);
        let scene = Scene::new(block, PlaneStrain, Rubber::neo_hookean(0.5, 10.0).unwrap())
            .prescribe(Place::at([0.0, 0.0]), 0, 0.0)
            .hold((0, Side::Min))
            .with(Condition::on((0, Side::Max)).component(0, moved).amplitude(break_points))
            .prescribe(Place::at([2.0, 0.0]), 1, 0.1)
            .with(Condition::on((1, Side::Max)).along(Direction::Along([0.6, 0.8]), 0.0));
        let cells = block.lattice([5, 4]).unwrap();
        let approximation =
            ReproducingKernel::new(cells.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
        for facets in [None, Some(FacetRule { parts: 2, gauss: 2 })] {
            let mut equations = Constraints::new();
            let all = scene.conditions.iter().flat_map(|condition| singles(condition, &condition.place));
            for single in all {
                let (before, mark) = (equations.clone(), equations.mark());
                let mut last = None;
                let refused = add(&mut equations, &scene, &single, &cells, &approximation, facets, &mut last).is_err();
                let added = equations.clone();
                assert!(refused || added != before);
                equations.take_back(mark);
                assert_eq!(equations, before);
                if !refused {
                    add(&mut equations, &scene, &single, &cells, &approximation, facets, &mut last).unwrap();
                }
            }
        }
    }
}
