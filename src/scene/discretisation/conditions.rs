//! Conditions of a scene as rows.

use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

use crate::boundary::{
    Claims, Constraints, FacetFunctions, Owners, Prescription, Sums, check_component, is_redundant, moved, rounding,
    scaled,
};
use crate::cells::{BoundaryCells, Cells, TraceChoice};
use crate::each::Each;
use crate::error::{BoundaryError, Error, Incompatible};
use crate::geometry::{Part, Point, Vec3, all_padded, padded};
use crate::shape::Approximation;
use crate::term::Amplitude;

use super::facet_rule::FacetRule;
use crate::scene::{Condition, Direction, Place, Scene, Spot, Value};

/// Called with the error of a condition that can't be added: returns it, or `Ok` to go on without the condition.
pub(crate) type Refused<'a> = &'a mut dyn FnMut(Error) -> Result<(), Error>;

/// A condition of a problem: the name and place by which its results are found, and its constraint equations.
pub(crate) struct Placed<const D: usize> {
    pub name: Option<String>,
    /// None where a name alone tells of it.
    pub place: Option<Place<D>>,
    pub equations: Range<usize>,
    /// The nodes that its forces act on.
    pub nodes: Range<usize>,
}

/// What a condition prescribes at a particle that is tied to a rigid body: it is prescribed of the rigid body there.
pub(crate) struct TiedPrescription {
    /// The numbers of the condition and of the rigid body.
    pub condition: usize,
    pub rigid: usize,
    pub at: Vec3,
    pub unit: Vec3,
    pub value: (f64, Amplitude),
    pub label: String,
}

/// One direction of a condition at a place whose name was looked up.
pub(crate) struct Single<'a, const D: usize> {
    place: &'a Place<D>,
    direction: &'a Direction<D>,
    pub(crate) value: &'a Value<D>,
    amplitude: &'a Amplitude,
    pub(crate) what: Prescription<'a>,
}

/// The directions of a condition, one by one.
pub(crate) fn singles<'a, const D: usize>(
    condition: &'a Condition<D>,
    place: &'a Place<D>,
) -> impl Iterator<Item = Single<'a, D>> {
    condition.prescribed.iter().map(move |(direction, value)| {
        let (amplitude, label) = (&condition.amplitude, condition.label(direction));
        let axis = match *direction {
            Direction::Component(component) => Some(component),
            _ => None,
        };
        let prescribed = match value {
            Value::Motion(motion) => {
                let (motion, amplitude) = (motion.clone(), amplitude.clone());
                moved(move |x: &Point<D>, load: f64| motion(x, amplitude.value(load)))
            }
            value => scaled(|x| value.at(x, 1.0), amplitude),
        };
        let of = label.clone();
        let along =
            Box::new(move |x: &Vec3, normal: &Vec3| Ok(padded(&direction.unit(&of, &padded(x), &padded(normal))?)));
        let what = Prescription { label, axis, along, value: prescribed };
        Single { place, direction, value, amplitude, what }
    })
}

impl<const D: usize> Single<'_, D> {
    /// Load factors at which its value has break points that its amplitude does not tell.
    pub(crate) fn break_points(&self) -> Vec<f64> {
        if let Value::Motion(_) = self.value { self.amplitude.break_points() } else { Vec::new() }
    }
}

/// A body whose conditions become equations: with the given facet rule over boundaries, or at particles without one.
pub(crate) struct Conditioned<'a, const D: usize> {
    pub scene: &'a Scene<D>,
    pub cells: &'a dyn Cells<D>,
    pub approximation: &'a dyn Approximation<D>,
    pub facets: Option<FacetRule>,
}

/// Conditions by their numbers in the scene, and parts of rigid bodies by theirs, with places whose names were looked up.
pub(crate) type Numbered<'a, const D: usize> = &'a [(usize, Place<D>)];

/// The equations of conditions and of parts tied to rigid bodies, and which are whose.
pub(crate) struct Prescribed<const D: usize> {
    pub equations: Constraints,
    pub placed: Vec<Placed<D>>,
    /// By the numbers of rigid bodies.
    pub ties: Vec<(usize, Range<usize>)>,
    pub at_ties: Vec<TiedPrescription>,
    /// The conditions, and the parts of rigid bodies, that select nothing here.
    pub nowhere: [Nowhere; 2],
}

/// What selects nothing on one body, by its number, with the error for where it selects nothing on any.
pub(crate) type Nowhere = Vec<(usize, Error)>;

/// The equations of conditions, and of a displacement that vanishes on parts tied to rigid bodies.
///
/// First all of them say what they prescribe over boundaries, then each equation at an edge is given to one, then they are made.
pub(crate) fn equations<const D: usize>(
    of: &Conditioned<'_, D>,
    mine: Numbered<'_, D>,
    tied: Numbered<'_, D>,
    refused: Refused<'_>,
) -> Result<Prescribed<D>, Error> {
    let still = |(number, place): &(usize, Place<D>)| {
        Condition::on(place.clone()).displacement([0.0; D]).named(&of.scene.rigids[*number].0)
    };
    let still = tied.mapped(still);
    let given = mine.iter().map(|(number, place)| (&of.scene.conditions[*number], place));
    let all: Vec<(&Condition<D>, &Place<D>)> = given.chain(still.iter().zip(tied.iter().map(|tie| &tie.1))).collect();
    let mut requests: Vec<Vec<Request<'_, D>>> = Vec::with_capacity(all.len());
    let nodes = all_padded(of.approximation.nodes());
    let mut skip = |number: usize, error: Error| if number < mine.len() { refused(error) } else { Err(error) };
    let (mut claims, mut last) = (Claims::default(), Vec::new());
    // What is refused for another reason is not refused for this one too.
    let mut selects = vec![false; all.len()];
    for (number, (condition, place)) in all.iter().enumerate() {
        let mut own = Vec::with_capacity(condition.prescribed.len());
        for single in singles(condition, place) {
            match of.request(single, &nodes, &mut claims, &mut last) {
                Ok(request) => own.extend(request),
                Err(error) => {
                    skip(number, error)?;
                    selects[number] = true;
                }
            }
        }
        requests.push(own);
    }
    let mut owners = claims.settle((D, &nodes));
    let (at_ties, tied_particles) = of.at_ties(mine, tied, &requests)?;
    for (requests, particles) in requests.iter().zip(&tied_particles) {
        for piece in requests.iter().filter_map(|request| Some(request.over.as_ref()?.1.clone())).flatten() {
            owners.yielded[piece].extend(particles.iter().map(|&particle| particle as u32));
        }
    }
    let (mut equations, none) = (Constraints::default(), HashSet::new());
    equations.overrule(std::mem::take(&mut owners.overruled));
    let (mut placed, mut ties, mut last) = (Vec::with_capacity(mine.len()), Vec::with_capacity(tied.len()), Vec::new());
    for (number, ((condition, place), own)) in all.iter().zip(&requests).enumerate() {
        let first = equations.len();
        for request in own {
            let before = equations.mark();
            // A tie holds wherever it is.
            let (mine, left_out) = tied_particles.get(number).map_or((&[][..], &none), |particles| (mine, particles));
            match of.add(&mut equations, (mine, left_out), request, &nodes, &owners, &mut last) {
                Ok(selected) => selects[number] |= selected,
                Err(error) => {
                    skip(number, error)?;
                    selects[number] = true;
                    // Without the rows that were added before it was refused.
                    equations.take_back(before);
                }
            }
        }
        let own = first..equations.len();
        if number < mine.len() {
            let (name, nodes) = (condition.name.clone(), 0..of.cells.positions().len());
            placed.push(Placed { name, place: Some((*place).clone()), equations: own, nodes });
        } else {
            ties.push((of.rigid(tied[number - mine.len()].0), own));
        }
    }
    let mut nowhere = [Vec::new(), Vec::new()];
    for (number, (condition, place)) in all.iter().enumerate().filter(|(number, _)| !selects[*number]) {
        let (kind, numbers, k) = if number < mine.len() { (0, mine, number) } else { (1, tied, number - mine.len()) };
        if let Some(single) = singles(condition, place).next() {
            nowhere[kind].push((numbers[k].0, empty(of.cells, &single).into()));
        }
    }
    Ok(Prescribed { equations, placed, ties, at_ties, nowhere })
}

/// The outward normals of a part at some of its particles, where a direction asks for them.
fn normals<const D: usize>(
    cells: &dyn Cells<D>,
    part: &Part,
    particles: &[usize],
    direction: &Direction<D>,
) -> Result<Vec<Vec3>, Error> {
    if !matches!(direction, Direction::Normal) {
        return Ok(Vec::new());
    }
    let normals = cells.facets(part, 1, 2)?.normals_at_particles();
    let normal = |particle: &usize| normals.get(&(*particle as u32)).map_or_else(Point::zeros, padded);
    Ok(particles.mapped(normal))
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
        let (target, amplitude) = (single.what.value)(vec![(padded(at), 1.0)]);
        for load in [1.0, 0.75, 0.5, 0.25].into_iter().chain(single.amplitude.break_points()) {
            let radius = at[0] + target * amplitude.value(load);
            // Points on the axis stay there: moved off it, they would be circles that were points.
            if radius < 0.0 || (radius == 0.0) != (at[0] == 0.0) {
                return Err(BoundaryError::BeyondAxis {
                    what: single.what.label.clone(),
                    at: at.as_slice().to_vec(),
                    radius,
                    load,
                });
            }
        }
    }
    Ok(())
}

/// A direction of a condition; where it acts over a boundary, the pieces of that and their numbers among all.
struct Request<'a, const D: usize> {
    single: Single<'a, D>,
    over: Option<(Vec<Arc<BoundaryCells<3>>>, Range<usize>)>,
}

impl<const D: usize> Conditioned<'_, D> {
    /// Puts down what a direction of a condition prescribes over pieces of the boundary, if it does; the pieces of the one before are
    /// shared where they are the same. None where it selects no facet.
    fn request<'a>(
        &self,
        single: Single<'a, D>,
        nodes: &[Vec3],
        claims: &mut Claims,
        last: &mut Vec<Arc<BoundaryCells<3>>>,
    ) -> Result<Option<Request<'a, D>>, Error> {
        if let Direction::Component(component) = *single.direction {
            check_component(component, D, &single.what.label)?;
        }
        let (Spot::Part(part), Some(facets)) = (&single.place.spot, self.facets) else {
            return Ok(Some(Request { single, over: None }));
        };
        let mut particles: Vec<usize> = self.cells.particles_on(part)?;
        particles.retain(|&particle| single.place.holds(&self.cells.positions()[particle]));
        stays_off_axis(self.scene, &single, self.cells, &particles)?;
        let pieces = self.pieces(&single, part, facets, &[])?;
        if pieces.iter().all(|piece| piece.traces.is_empty()) {
            ensure!(!single.place.within.is_empty(), bare(&single));
            return Ok(None);
        }
        let pieces = shared(pieces, last);
        let own = (&pieces[..], self.cells.rebuilds_traces());
        let numbers = claims.add((D, nodes), own, &single.what)?;
        last.clone_from(&pieces);
        Ok(Some(Request { single, over: Some((pieces, numbers)) }))
    }

    /// The pieces of a part for a direction of a condition.
    fn pieces(
        &self,
        single: &Single<'_, D>,
        part: &Part,
        facets: FacetRule,
        without: &[HashSet<u32>],
    ) -> Result<Vec<BoundaryCells<3>>, Error> {
        let holds = |x: &Point<D>| single.place.holds(x);
        // A direction that does not exist is refused where it is asked for.
        let facing = |x: &Point<D>, normal: &Point<D>| {
            single.direction.unit(&single.what.label, x, normal).map_or(0.0, |e| e.dot(normal).abs())
        };
        let within = (!single.place.within.is_empty()).then_some(&holds as _);
        let choice = TraceChoice { within, facing: Some(&facing), without };
        let pieces = self.cells.pieces(part, facets.parts, facets.gauss, &choice)?;
        Ok(pieces.mapped(BoundaryCells::padded))
    }

    /// Adds the equations of one direction of a condition; integrals of the one before are kept where its pieces are the same. Whether it
    /// selects anything.
    fn add(
        &self,
        equations: &mut Constraints,
        (mine, left_out): (Numbered<'_, D>, &HashSet<usize>),
        request: &Request<'_, D>,
        nodes: &[Vec3],
        owners: &Owners,
        last: &mut Vec<(FacetFunctions, Option<Sums>)>,
    ) -> Result<bool, Error> {
        let single = &request.single;
        equations.add_break_points(single.break_points());
        let Some((pieces, numbers)) = &request.over else {
            return self.collocate(equations, (mine, left_out), single);
        };
        if let Some((_, refusal)) = owners.refused.range(numbers.clone()).next() {
            return Err(refusal.clone().into());
        }
        let yielded = &owners.yielded[numbers.clone()];
        let rebuilt;
        let pieces = match (&single.place.spot, self.facets) {
            (Spot::Part(part), Some(facets)) if yielded.iter().any(|own| !own.is_empty()) => {
                rebuilt = shared(self.pieces(single, part, facets, yielded)?, pieces);
                &rebuilt
            }
            _ => pieces,
        };
        let none = HashSet::new();
        for (number, cells) in pieces.iter().enumerate() {
            if !last.get(number).is_some_and(|(known, _)| Arc::ptr_eq(&known.cells, cells)) {
                last.truncate(number);
                let kinematics = &*self.scene.kinematics;
                last.push((FacetFunctions::new((self.approximation, 0, 1.0), cells.clone(), kinematics)?, None));
            }
            let (functions, sums) = &mut last[number];
            let others = Some(yielded.get(number).unwrap_or(&none));
            equations.integrate(nodes, (functions, sums), &single.what, others)?;
        }
        Ok(true)
    }

    /// Adds the equations of one direction of a condition at particles; whether it selects any.
    fn collocate(
        &self,
        equations: &mut Constraints,
        (mine, left_out): (Numbered<'_, D>, &HashSet<usize>),
        single: &Single<'_, D>,
    ) -> Result<bool, Error> {
        let (cells, place) = (self.cells, single.place);
        let mut nodes = particles_of(cells, place, &single.what.label)?;
        if nodes.is_empty() {
            ensure!(!place.within.is_empty(), bare(single));
            return Ok(false);
        }
        stays_off_axis(self.scene, single, cells, &nodes)?;
        nodes.retain(|node| !left_out.contains(node));
        if self.facets.is_some() {
            nodes = self.not_on_parts(mine, single, nodes)?;
        }
        let normals = match &place.spot {
            Spot::Part(part) => normals(cells, part, &nodes, single.direction)?,
            _ => Vec::new(),
        };
        equations.collocate(self.approximation, &nodes, &normals, &single.what)?;
        Ok(true)
    }

    /// The number of the rigid body of a part that is tied to one.
    fn rigid(&self, part: usize) -> usize {
        let name = &self.scene.rigids[part].0;
        self.scene.rigid_names().iter().position(|known| known == name).unwrap_or(0)
    }

    /// What conditions prescribe at particles that are tied to rigid bodies, and which particles these are for each condition. Faces
    /// leave it to [`Claims`] whose equation a particle on both has.
    fn at_ties(
        &self,
        mine: Numbered<'_, D>,
        tied: Numbered<'_, D>,
        requests: &[Vec<Request<'_, D>>],
    ) -> Result<(Vec<TiedPrescription>, Vec<HashSet<usize>>), Error> {
        let (cells, mut at_ties) = (self.cells, Vec::new());
        // Places that don't exist are refused with their own condition.
        let of = |place: &Place<D>| particles_of(cells, place, "").unwrap_or_default();
        let ties: Vec<(usize, bool, HashSet<usize>)> =
            tied.mapped(|(part, place)| (self.rigid(*part), place.is_on_part(), of(place).into_iter().collect()));
        let mut particles = vec![HashSet::new(); mine.len()];
        for (((condition, place), requests), own) in mine.iter().zip(requests).zip(&mut particles) {
            for (rigid, _, tied) in ties.iter().filter(|tie| !(tie.1 && place.is_on_part())) {
                let mut both = of(place);
                both.retain(|particle| tied.contains(particle) && own.insert(*particle));
                for Request { single, .. } in requests {
                    let normals = match &place.spot {
                        Spot::Part(part) => normals(cells, part, &both, single.direction)?,
                        _ => Vec::new(),
                    };
                    for (number, &particle) in both.iter().enumerate() {
                        let at = padded(&cells.positions()[particle]);
                        let normal = normals.get(number).copied().unwrap_or_else(Point::zeros);
                        let unit = (single.what.along)(&at, &normal)?;
                        let (value, label) = ((single.what.value)(vec![(at, 1.0)]), single.what.label.clone());
                        let (condition, rigid) = (*condition, *rigid);
                        at_ties.push(TiedPrescription { condition, rigid, at, unit, value, label });
                    }
                }
            }
        }
        Ok((at_ties, particles))
    }

    /// The particles of a condition at particles for which conditions on parts that hold them do not say the same: rows over a face know
    /// nothing of single particles, and these would be prescribed twice.
    ///
    /// # Errors
    /// Where they say something else.
    fn not_on_parts(
        &self,
        mine: Numbered<'_, D>,
        single: &Single<'_, D>,
        nodes: Vec<usize>,
    ) -> Result<Vec<usize>, Error> {
        let cells = self.cells;
        let mut parts = Vec::new();
        for (number, place) in mine {
            // Parts that don't exist are refused with their own condition.
            let Spot::Part(part) = &place.spot else { continue };
            let Ok(particles) = cells.particles_on(part) else { continue };
            let held = particles.into_iter().filter(|&particle| place.holds(&cells.positions()[particle]));
            parts.push((&self.scene.conditions[*number], place, part, held.collect::<HashSet<usize>>()));
        }
        let mut left = Vec::with_capacity(nodes.len());
        for particle in nodes {
            let at = &cells.positions()[particle];
            let mut prescriptions = Vec::new();
            for (condition, place, part, _) in parts.iter().filter(|(.., held)| held.contains(&particle)) {
                for other in singles(condition, place) {
                    let normals = normals(cells, part, &[particle], other.direction)?;
                    prescriptions
                        .push(other.what.at(&padded(at), &normals.first().copied().unwrap_or_else(Point::zeros))?);
                }
            }
            let requested = single.what.at(&padded(at), &Point::zeros())?;
            if !is_redundant(&prescriptions, &requested, at.as_slice(), rounding(cells.positions()))? {
                left.push(particle);
            }
        }
        Ok(left)
    }
}

/// The particles of a place.
fn particles_of<const D: usize>(cells: &dyn Cells<D>, place: &Place<D>, label: &str) -> Result<Vec<usize>, Error> {
    let mut particles = match &place.spot {
        Spot::Part(part) => cells.particles_on(part)?,
        Spot::Point(at) => return Ok(vec![particle_at(cells, at, label)?]),
        Spot::Body => (0..cells.positions().len()).collect(),
    };
    particles.retain(|&particle| place.holds(&cells.positions()[particle]));
    Ok(particles)
}

/// Pieces, those of them that are the same as known ones shared with these.
fn shared(pieces: Vec<BoundaryCells<3>>, known: &[Arc<BoundaryCells<3>>]) -> Vec<Arc<BoundaryCells<3>>> {
    let shared = |(number, piece): (usize, BoundaryCells<3>)| match known.get(number) {
        Some(same) if **same == piece => same.clone(),
        _ => Arc::new(piece),
    };
    pieces.into_iter().enumerate().map(shared).collect()
}

/// The error of a whole part that holds nothing.
fn bare<const D: usize>(single: &Single<'_, D>) -> Incompatible {
    let remedy = "return them from Cells::boundary and Cells::boundary_nodes, or an error where there is no such part";
    Incompatible::new(single.what.label.clone(), "cells without facets or particles there", remedy)
}

/// The error of some of a part, or of the body, that holds nothing.
fn empty<const D: usize>(cells: &dyn Cells<D>, single: &Single<'_, D>) -> BoundaryError {
    let among = match &single.place.spot {
        Spot::Part(part) => cells.particles_on(part).unwrap_or_default(),
        _ => vec![0],
    };
    let nearest = among.first().and_then(|&node| cells.positions().get(node)).map(|x| x.as_slice().to_vec());
    BoundaryError::Empty { what: single.what.label.clone(), nearest: nearest.unwrap_or_default() }
}

/// The particle that is nearest to a point.
pub(super) fn nearest_particle<const D: usize>(cells: &dyn Cells<D>, at: &Point<D>) -> usize {
    let distance = |node: usize| (cells.positions()[node] - at).norm();
    (0..cells.positions().len()).min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
}

/// The particle that lies at a point, to a thousandth of its spacing along each axis.
pub(crate) fn particle_at<const D: usize>(cells: &dyn Cells<D>, at: &Point<D>, label: &str) -> Result<usize, Error> {
    let nearest = nearest_particle(cells, at);
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
    use crate::geometry::Vec2;
    use crate::prelude::*;

    /// Rows at particles and over boundaries, some owned twice, taken back one condition after the other.
    #[test]
    fn what_was_added_is_taken_back() {
        let block = Block::new([0.0, 0.0], [2.0, 1.0]);
        let break_points = Amplitude::table(vec![(0.0, 0.0), (0.5, 2.0), (1.0, 1.0)]).unwrap();
        let moved = Value::motion(|x: &Vec2, load| 0.1 * x[1] * load);
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
            let of = Conditioned { scene: &scene, cells: &cells, approximation: &approximation, facets };
            let mut equations = Constraints::default();
            let all = scene.conditions.iter().flat_map(|condition| singles(condition, &condition.place));
            let (mut claims, nodes) = (Claims::default(), all_padded(approximation.nodes()));
            let requests: Vec<_> =
                all.filter_map(|single| of.request(single, &nodes, &mut claims, &mut Vec::new()).unwrap()).collect();
            let owners = claims.settle((2, &nodes));
            let none = (&[][..], &HashSet::new());
            for request in &requests {
                let (before, mark) = (equations.clone(), equations.mark());
                let refused = of.add(&mut equations, none, request, &nodes, &owners, &mut Vec::new()).is_err();
                let added = equations.clone();
                assert!(refused || added != before);
                equations.take_back(mark);
                assert_eq!(equations, before);
                if !refused {
                    of.add(&mut equations, none, request, &nodes, &owners, &mut Vec::new()).unwrap();
                }
            }
        }
    }
}
