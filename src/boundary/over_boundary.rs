//! Constraint equations over boundaries: integrals with linear trace functions.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use crate::cells::BoundaryCells;
use crate::error::{BoundaryError, Error};
use crate::geometry::{Point, Vec3, all_padded, unit};
use crate::kinematics::{self, Kinematics};
use crate::order;
use crate::shape::{Approximation, Scratch, ShapeFunctions};
use crate::table::check_values;
use crate::term::Amplitude;

use super::constraints::{Constraints, OVER_BOUNDARY};
use super::equation::ConstraintEquation;
use super::prescribed_directions::{PrescribedDirection, is_redundant};
use super::row_values::{Prescription, scaled};

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
        let prescription = Prescription::of(D, component, scaled(target, amplitude), label)?;
        let functions = FacetFunctions::new((approximation, 0, 1.0), Arc::new(boundary.padded()), kinematics)?;
        self.integrate(&all_padded(approximation.nodes()), (&functions, &mut None), &prescription, None)
    }

    /// Conditions $\int\Theta_J\,(e(X)\cdot u - g)\,\mathrm d\Gamma = 0$ along a direction that may vary; integrals along the first axis are kept for conditions
    /// along the others. The particles of the piece whose equation another one owns are `yielded`;
    /// where that was not settled before, an earlier condition owns the equation.
    pub(crate) fn integrate(
        &mut self,
        nodes: &[Vec3],
        (functions, along_first): (&FacetFunctions, &mut Option<Sums>),
        prescription: &Prescription<'_>,
        yielded: Option<&HashSet<u32>>,
    ) -> Result<(), Error> {
        functions.cells.validate(nodes.len())?;
        let (dim, order) = (functions.dim, facet_order(&functions.cells));
        let (rounding, normals) = (rounding(nodes), functions.cells.normals_at_particles());
        // What this condition requests of each particle, and which have it already.
        let mut requested: HashMap<u32, (PrescribedDirection, bool)> = HashMap::with_capacity(order.0.len());
        for &particle in &order.0 {
            let at = nodes[particle as usize];
            let normal = normals.get(&particle).copied().unwrap_or_else(Point::zeros);
            let wanted = prescription.at(&at, &normal)?;
            let prescriptions = self.prescriptions(OVER_BOUNDARY, particle as usize);
            let again = match yielded {
                Some(yielded) => yielded.contains(&particle),
                // Both conditions hold at the corner, whoever owns it: merged without a look, the later one would be spread
                // over its neighbours and the answer depend on the order.
                None => is_redundant(prescriptions, &wanted, &at.as_slice()[..dim], rounding)?,
            };
            requested.insert(particle, (wanted, again));
        }
        let varying;
        let sums = match (prescription.axis, along_first) {
            (Some(_), Some(known)) => &*known,
            (Some(_), along_first) => along_first.insert(integrals(&[functions], None)?),
            (None, _) => {
                varying = integrals(&[functions], Some(prescription))?;
                &varying
            }
        };
        for (particle, parts) in received(nodes, &order, sums, |particle| !requested[&particle].1) {
            let mut points = Vec::new();
            for part in &parts {
                points.extend_from_slice(&part.points);
            }
            let entries = summed(&parts, prescription.axis.unwrap_or(0));
            // The trace functions carry their measure: a multiplier is a traction [stress], whatever the spacing.
            let wanted = requested[&particle].0.clone();
            self.own(dim, (OVER_BOUNDARY, particle as usize), wanted, entries, (prescription.value)(points))?;
        }
        Ok(())
    }

    /// Conditions $\int\Theta_J\,(u_1 - u_2)\,\mathrm d\Gamma = 0$ between two sides with trace functions of the particles of the first one,
    /// which lie at `nodes` and have an order, for those that `tie` says are free along a component.
    pub(crate) fn bond(
        &mut self,
        nodes: &[Vec3],
        order: &Order,
        sides: [&FacetFunctions; 2],
        label: &str,
        tie: &mut dyn FnMut(usize, u32) -> bool,
    ) -> Result<(), Error> {
        let (sums, FacetFunctions { dim, first_node, .. }) = (integrals(&sides, None)?, sides[0]);
        for component in 0..*dim {
            let free: HashSet<u32> = order.0.iter().copied().filter(|&particle| tie(component, particle)).collect();
            for (particle, parts) in received(nodes, order, &sums, |particle| free.contains(&particle)) {
                let entries = summed(&parts, component);
                let dependent = (first_node + particle as usize) * dim + component;
                let (amplitude, label) = (Amplitude::Constant, label.to_string());
                self.push(ConstraintEquation { entries, dependent, target: 0.0, amplitude, label })?;
            }
        }
        Ok(())
    }
}

/// The particles of a boundary part in the order of its facets, and those that share a facet with each.
pub(crate) type Order = (Vec<u32>, HashMap<u32, Vec<u32>>);

pub(crate) fn facet_order(boundary: &BoundaryCells<3>) -> Order {
    let (mut order, mut neighbours): Order = Default::default();
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

/// The integrals of the trace functions by the particle that each goes to: its own where that is free, or the nearest free one on a shared
/// facet. One that has nowhere to go repeats what is prescribed already.
fn received<'a>(
    nodes: &[Vec3],
    (order, neighbours): &Order,
    sums: &'a Sums,
    is_free: impl Fn(u32) -> bool,
) -> Vec<(u32, Vec<&'a Integrals>)> {
    let mut received: HashMap<u32, Vec<&Integrals>> = HashMap::new();
    for &particle in order {
        let Some(sum) = sums.get(&particle) else { continue };
        let at = nodes[particle as usize];
        let nearer = |a: &u32, b: &u32| {
            let distance = |n: &u32| (nodes[*n as usize] - at).norm_squared();
            distance(a).total_cmp(&distance(b)).then(a.cmp(b))
        };
        let nearest = |among: &[u32]| among.iter().copied().filter(|&other| is_free(other)).min_by(nearer);
        let receiver = match is_free(particle) {
            true => Some(particle),
            // In corners of triangles all particles around may be prescribed: the trace functions of the part still sum to one.
            false => nearest(&neighbours[&particle]).or_else(|| nearest(order)),
        };
        if let Some(receiver) = receiver {
            received.entry(receiver).or_default().push(sum);
        }
    }
    order.iter().filter_map(|particle| received.remove_entry(particle)).collect()
}

/// Facets with the functions of a body and the measure of its kinematics at their points: one side of constraint equations.
pub(crate) struct FacetFunctions {
    dim: usize,
    /// The first node of the body, and the sign of the side.
    first_node: usize,
    sign: f64,
    pub(crate) cells: Arc<BoundaryCells<3>>,
    /// Weights with the measure; on the axis that of the line.
    weights: Vec<f64>,
    /// Particles and the values of their functions, point by point.
    values: Vec<(Vec<u32>, Vec<f64>)>,
}

impl FacetFunctions {
    pub(crate) fn new<const D: usize>(
        (approximation, first_node, sign): (&dyn Approximation<D>, usize, f64),
        cells: Arc<BoundaryCells<3>>,
        kinematics: &dyn Kinematics<D>,
    ) -> Result<Self, Error> {
        let count = approximation.nodes().len();
        cells.points.validate()?;
        let points = cells.points.positions.len();
        let (mut weights, mut values) = (Vec::with_capacity(points), Vec::with_capacity(points));
        let (mut scratch, mut psi) = (Scratch::default(), ShapeFunctions::default());
        let has_hoops = !kinematics::hoop_components(kinematics)?.is_empty();
        let positions: Vec<Point<D>> = all_padded(&cells.points.positions);
        for group in cells.points.groups.windows(2) {
            let group = group[0]..group[1];
            let on_axis = has_hoops && positions[group.clone()].iter().all(|x| kinematics.measure(x) == 0.0);
            for (at, weight) in positions[group.clone()].iter().zip(&cells.points.weights[group]) {
                approximation.evaluate_values(at, &mut scratch, &mut psi)?;
                check_values(&psi, count, at)?;
                let measure = if on_axis { 1.0 } else { kinematics::measure(kinematics, has_hoops, at)? };
                weights.push(weight * measure);
                values.push((psi.nodes.clone(), psi.values.clone()));
            }
        }
        Ok(FacetFunctions { dim: D, first_node, sign, cells, weights, values })
    }
}

/// Integrals by trace function.
pub(crate) type Sums = HashMap<u32, Integrals>;

/// The integrals of one trace function: coefficients by unknown, and the points that they were summed over with their weights.
#[derive(Default)]
pub(crate) struct Integrals {
    entries: HashMap<usize, f64>,
    points: Vec<(Vec3, f64)>,
}

/// The coefficients of several trace functions together, so many components further on, by rising index.
fn summed(parts: &[&Integrals], further: usize) -> Vec<(usize, f64)> {
    let mut entries: Vec<(usize, f64)> = Vec::new();
    for part in parts {
        for (unknown, value) in &part.entries {
            entries.push((unknown + further, *value));
        }
    }
    order::merged(entries)
}

/// Sums each trace function times the shape functions of all sides over their facets, along the first axis or another direction.
fn integrals(sides: &[&FacetFunctions], along: Option<&Prescription<'_>>) -> Result<Sums, BoundaryError> {
    let mut sums = Sums::new();
    for FacetFunctions { dim, first_node, sign, cells, weights, values } in sides {
        for (point, at) in cells.points.positions.iter().enumerate() {
            let normal = cells.points.normals.get(point).copied().unwrap_or_else(Point::zeros);
            let direction = along.map_or(Ok(unit(0)), |along| (along.along)(at, &normal))?;
            for &(particle, trace) in &cells.traces[point] {
                let weight = sign * weights[point] * trace;
                let Integrals { entries, points } = sums.entry(particle).or_default();
                for (&node, psi) in values[point].0.iter().zip(&values[point].1) {
                    for i in (0..*dim).filter(|&i| direction[i] != 0.0) {
                        *entries.entry((first_node + node as usize) * dim + i).or_default() +=
                            weight * psi * direction[i];
                    }
                }
                points.push((*at, weight));
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
