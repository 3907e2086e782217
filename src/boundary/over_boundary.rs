//! Constraint equations over boundaries: integrals with linear trace functions.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::cells::BoundaryCells;
use crate::error::Error;
use crate::geometry::{Point, padded, unit};
use crate::kinematics::Kinematics;
use crate::order;
use crate::shape::{Approximation, Scratch, ShapeFunctions};
use crate::table::check_values;
use crate::term::Amplitude;

use super::constraints::{Constraints, OVER_BOUNDARY};
use super::equation::ConstraintEquation;
use super::prescribed_directions::{PrescribedDirection, is_redundant};
use super::row_values::{Motion, PrescribedComponent, Prescription, moved, scaled};

impl Constraints {
    /// Conditions $\int\Theta_J(u_i - g\\,a(\lambda))\\,\mathrm d\Gamma = 0$ over a boundary part with its linear
    /// trace functions $\Theta_J$, (4.8), (4.16).
    ///
    /// Each corner and edge belongs to the part that is prescribed first; on the others its trace function is merged
    /// into its neighbour's, so that there are as many constraint equations as boundary particles and the trace functions of each
    /// part still sum to one. On the axis of an axisymmetric body the measure is that of the line.
    ///
    /// # Errors
    /// Where two conditions conflict at a corner, a component does not exist, or a shape function is not defined.
    #[allow(clippy::too_many_arguments)]
    pub fn over_boundary<const D: usize>(
        &mut self,
        approximation: &dyn Approximation<D>,
        boundary: &BoundaryCells<D>,
        kinematics: &dyn Kinematics<D>,
        component: usize,
        target: &dyn Fn(&Point<D>) -> f64,
        amplitude: &Amplitude,
        label: &str,
    ) -> Result<(), Error> {
        let (mut piece, value) = (BoundaryPiece::new(Arc::new(boundary.clone())), scaled(target, amplitude));
        let prescription = PrescribedComponent::new(component, &value, label)?;
        self.integrate(approximation, &mut piece, kinematics, &prescription, None)
    }

    /// Conditions $\int\Theta_J(u_i - g(X, \lambda))\\,\mathrm d\Gamma = 0$: as
    /// [`over_boundary`](Constraints::over_boundary) for values that do not grow in proportion.
    ///
    /// # Errors
    /// As [`over_boundary`](Constraints::over_boundary).
    pub fn motion_over_boundary<const D: usize>(
        &mut self,
        approximation: &dyn Approximation<D>,
        boundary: &BoundaryCells<D>,
        kinematics: &dyn Kinematics<D>,
        component: usize,
        motion: &Motion<D>,
        label: &str,
    ) -> Result<(), Error> {
        let (mut piece, value) = (BoundaryPiece::new(Arc::new(boundary.clone())), moved(motion));
        let prescription = PrescribedComponent::new(component, &value, label)?;
        self.integrate(approximation, &mut piece, kinematics, &prescription, None)
    }

    /// Conditions $\int\Theta_J\,(e(X)\cdot u - g)\,\mathrm d\Gamma = 0$ along a direction that may vary. The particles of the piece whose equation another one owns are `yielded`; where that was not settled before, an
    /// earlier condition owns the equation.
    pub(crate) fn integrate<const D: usize>(
        &mut self,
        approximation: &dyn Approximation<D>,
        piece: &mut BoundaryPiece<D>,
        kinematics: &dyn Kinematics<D>,
        prescription: &dyn Prescription<D>,
        yielded: Option<&HashSet<u32>>,
    ) -> Result<(), Error> {
        let BoundaryPiece { cells: boundary, along_first } = piece;
        boundary.validate(approximation.nodes().len())?;
        let (order, neighbours) = facet_neighbours(boundary);
        let rounding = rounding(approximation.nodes());
        let normals = boundary.normals_at_particles();
        // What this condition requests of each particle, and which have it already.
        let mut requested: HashMap<u32, (PrescribedDirection, bool)> = HashMap::with_capacity(order.len());
        for &particle in &order {
            let at = approximation.nodes()[particle as usize];
            let normal = normals.get(&particle).copied().unwrap_or_else(Point::zeros);
            let wanted = prescription.at(&at, &normal)?;
            let prescriptions = self.prescriptions(OVER_BOUNDARY, particle as usize);
            let again = match yielded {
                Some(yielded) => yielded.contains(&particle),
                // Both conditions hold at the corner, whoever owns it: merged without a look, the later one would be spread
                // over its neighbours and the answer depend on the order.
                None => is_redundant(prescriptions, &wanted, at.as_slice(), rounding)?,
            };
            requested.insert(particle, (wanted, again));
        }
        let side = InterfaceSide { approximation, boundary, first_node: 0, sign: 1.0 };
        let varying;
        let sums = match (prescription.axis(), along_first) {
            (Some(_), Some(known)) => &*known,
            (Some(_), along_first) => along_first.insert(integrals(&[side], kinematics, None)?),
            (None, _) => {
                varying = integrals(&[side], kinematics, Some(prescription))?;
                &varying
            }
        };
        let is_free = |particle: u32| !requested[&particle].1;
        let node = |particle: u32| padded(&approximation.nodes()[particle as usize]);
        let mut received = received(&node, (&order, &neighbours), &is_free);
        for particle in order {
            let Some(parts) = found(sums, received.remove(&particle)) else { continue };
            let mut points = Vec::new();
            for part in &parts {
                points.extend_from_slice(&part.points);
            }
            let entries = summed(&parts, prescription.axis().unwrap_or(0));
            // The trace functions carry their measure: a multiplier is a traction [stress], whatever the spacing.
            let Some((wanted, _)) = requested.remove(&particle) else { continue };
            self.own(D, (OVER_BOUNDARY, particle as usize), wanted, entries, prescription.value(points))?;
        }
        Ok(())
    }

    /// Conditions $\int\Theta_J\,(u_1 - u_2)\,\mathrm d\Gamma = 0$ between two sides with trace functions of the particles on `faces` of the
    /// first one, for the particles that `tie` says are free along a component.
    pub(crate) fn bond<const D: usize>(
        &mut self,
        faces: &BoundaryCells<D>,
        sides: &[InterfaceSide<'_, D>; 2],
        kinematics: &dyn Kinematics<D>,
        label: &str,
        tie: &mut dyn FnMut(usize, u32) -> bool,
    ) -> Result<(), Error> {
        let (order, neighbours) = facet_neighbours(faces);
        let sums = integrals(sides, kinematics, None)?;
        for component in 0..D {
            let free: HashSet<u32> = order.iter().copied().filter(|&particle| tie(component, particle)).collect();
            let is_free = |particle: u32| free.contains(&particle);
            let node = |particle: u32| padded(&sides[0].approximation.nodes()[particle as usize]);
            let mut received = received(&node, (&order, &neighbours), &is_free);
            for particle in &order {
                let Some(parts) = found(&sums, received.remove(particle)) else { continue };
                let entries = summed(&parts, component);
                let dependent = (sides[0].first_node + *particle as usize) * D + component;
                let (amplitude, label) = (Amplitude::Constant, label.to_string());
                self.push(ConstraintEquation { entries, dependent, target: 0.0, amplitude, label })?;
            }
        }
        Ok(())
    }
}

/// The particles of a boundary part in the order of its facets, and those that share a facet with each.
pub(crate) fn facet_neighbours<const D: usize>(boundary: &BoundaryCells<D>) -> (Vec<u32>, HashMap<u32, Vec<u32>>) {
    let mut neighbours: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut order: Vec<u32> = Vec::new();
    for group in boundary.points.groups.windows(2) {
        let mut members: Vec<u32> = Vec::new();
        for traces in &boundary.traces[group[0]..group[1]] {
            for &(particle, _) in traces {
                if !members.contains(&particle) {
                    members.push(particle);
                }
            }
        }
        for &particle in &members {
            if !neighbours.contains_key(&particle) {
                order.push(particle);
            }
            neighbours.entry(particle).or_default().extend(&members);
        }
    }
    (order, neighbours)
}

/// The particles whose trace functions go to each: its own where that is free, or it is the nearest free one on a shared
/// facet. One that has nowhere to go repeats what is prescribed already.
fn received(
    node: &dyn Fn(u32) -> Point<3>,
    (order, neighbours): (&[u32], &HashMap<u32, Vec<u32>>),
    is_free: &dyn Fn(u32) -> bool,
) -> HashMap<u32, Vec<u32>> {
    let mut received: HashMap<u32, Vec<u32>> = HashMap::new();
    for &particle in order {
        let at = node(particle);
        let nearer = |a: &u32, b: &u32| {
            let distance = |n: &u32| (node(*n) - at).norm_squared();
            distance(a).total_cmp(&distance(b)).then(a.cmp(b))
        };
        let nearest = |among: &[u32]| among.iter().copied().filter(|&other| is_free(other)).min_by(nearer);
        let receiver = match is_free(particle) {
            true => Some(particle),
            // In corners of triangles all particles around may be prescribed: the trace functions of the part still sum to one.
            false => nearest(&neighbours[&particle]).or_else(|| nearest(order)),
        };
        if let Some(receiver) = receiver {
            received.entry(receiver).or_default().push(particle);
        }
    }
    received
}

/// The integrals of some particles; none where none of them has any.
fn found<const D: usize>(sums: &HashMap<u32, Integrals<D>>, particles: Option<Vec<u32>>) -> Option<Vec<&Integrals<D>>> {
    let mut found = Vec::new();
    for particle in particles? {
        if let Some(sum) = sums.get(&particle) {
            found.push(sum);
        }
    }
    (!found.is_empty()).then_some(found)
}

/// One side of constraint equations over facets: the trace functions there, the functions of its body, and the first node of this.
pub(crate) struct InterfaceSide<'a, const D: usize> {
    pub(crate) approximation: &'a dyn Approximation<D>,
    pub(crate) boundary: &'a BoundaryCells<D>,
    pub(crate) first_node: usize,
    pub(crate) sign: f64,
}

/// A piece of a boundary; integrals along the first axis are kept for conditions along the others.
pub(crate) struct BoundaryPiece<const D: usize> {
    cells: Arc<BoundaryCells<D>>,
    along_first: Option<HashMap<u32, Integrals<D>>>,
}

impl<const D: usize> BoundaryPiece<D> {
    pub(crate) fn new(cells: Arc<BoundaryCells<D>>) -> Self {
        BoundaryPiece { cells, along_first: None }
    }

    /// Whether it is the piece of some cells.
    pub(crate) fn is_of(&self, cells: &Arc<BoundaryCells<D>>) -> bool {
        Arc::ptr_eq(&self.cells, cells)
    }
}

/// The integrals of one trace function: coefficients by unknown, and the points that they were summed over with their weights.
#[derive(Default)]
struct Integrals<const D: usize> {
    entries: HashMap<usize, f64>,
    points: Vec<(Point<D>, f64)>,
}

/// The coefficients of several trace functions together, so many components further on, by rising index.
fn summed<const D: usize>(parts: &[&Integrals<D>], further: usize) -> Vec<(usize, f64)> {
    let mut entries: Vec<(usize, f64)> = Vec::new();
    for part in parts {
        for (unknown, value) in &part.entries {
            entries.push((unknown + further, *value));
        }
    }
    order::merged(entries)
}

/// Sums each trace function times the shape functions of all sides over their facets, along the first axis or another direction.
fn integrals<const D: usize>(
    sides: &[InterfaceSide<'_, D>],
    kinematics: &dyn Kinematics<D>,
    along: Option<&dyn Prescription<D>>,
) -> Result<HashMap<u32, Integrals<D>>, Error> {
    let mut sums: HashMap<u32, Integrals<D>> = HashMap::new();
    let (mut scratch, mut psi) = (Scratch::default(), ShapeFunctions::default());
    let has_hoops = !crate::kinematics::hoop_components(kinematics)?.is_empty();
    for &InterfaceSide { approximation, boundary, first_node, sign } in sides {
        for group in boundary.points.groups.windows(2) {
            let mut at_group = boundary.points.positions[group[0]..group[1]].iter();
            let on_axis = has_hoops && at_group.all(|x| kinematics.measure(x) == 0.0);
            for point in group[0]..group[1] {
                let at = boundary.points.positions[point];
                approximation.evaluate_values(&at, &mut scratch, &mut psi)?;
                check_values(&psi, approximation.nodes().len(), &at)?;
                let measure = if on_axis { 1.0 } else { crate::kinematics::measure(kinematics, has_hoops, &at)? };
                let normal = boundary.points.normals.get(point).copied().unwrap_or_else(Point::zeros);
                let direction = along.map_or(Ok(unit(0)), |along| along.along(&at, &normal))?;
                for &(particle, trace) in &boundary.traces[point] {
                    let weight = sign * boundary.points.weights[point] * measure * trace;
                    let Integrals { entries, points } = sums.entry(particle).or_default();
                    for (&node, psi) in psi.nodes.iter().zip(&psi.values) {
                        for i in (0..D).filter(|&i| direction[i] != 0.0) {
                            *entries.entry((first_node + node as usize) * D + i).or_default() +=
                                weight * psi * direction[i];
                        }
                    }
                    points.push((at, weight));
                }
            }
        }
    }
    Ok(sums)
}

/// Displacements closer than this part of the coordinates are equal: they may be differences of them.
const ROUNDING: f64 = 1e-14;

/// The rounding of displacements of some nodes.
pub(crate) fn rounding<const D: usize>(nodes: &[Point<D>]) -> f64 {
    ROUNDING * nodes.iter().fold(0.0, |largest: f64, x| largest.max(x.amax()))
}
