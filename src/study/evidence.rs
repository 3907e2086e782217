//! What two models of a scene say of their errors: differences that are weighted by dual solutions, zone by zone.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use crate::each::{Each, EachOf, IntoEach, add, list_of, point_of};
use crate::error::Error;
use crate::geometry::{Mat3, Point, Vec3, all_padded};
use crate::material::{Material, Past};
use crate::neighbours::BoxTree;
use crate::scene::{BodyView, DiscreteBody, Problem, coefficients, values};
use crate::shape::ShapeFunctions;
use crate::solve::State;
use crate::tensor::cofactor;
use crate::term::TermStep;

use super::answer::{Answer, Level, Tolerance};

/// Step of a dual solution, in parts of the displacement, by which its pressures are found.
const SMALL: f64 = 1e-3;

/// Two models that differ by less agree by no accident: bodies at rest, homogeneous states.
pub(super) const EXACT: f64 = 1e-10;

/// How far two models are apart.
pub(super) struct DifferenceBound {
    /// In the quantity in which they are furthest apart, relative to its value.
    pub most: f64,
    /// Whether they agree but for rounding: in the quantities, and in the energy and its parts where one is [`unseen`](Self::unseen).
    pub exact: bool,
    /// Whether a quantity did not change from model to model, and no derivative tells whether anything would change it: a contact
    /// that coarse models do not see leaves a force of zero.
    pub unseen: bool,
    /// What each zone of the finer model adds, all quantities together.
    pub zones: Vec<f64>,
    /// The dual-weighted change of each quantity, relative to its value.
    pub weighted: Vec<f64>,
}

/// How far two models are apart in what is requested, relative to the values of the finer one: for each quantity the larger one
/// of the difference of the values and of
/// $$\eta = \sum_z\Big|\int_z \Delta\mathbf P:\nabla\Delta z + \Delta p\\,\operatorname{cof}\mathbf F:\nabla\Delta z
/// \+ \Delta p_z\Big(\operatorname{cof}\mathbf F:\nabla\Delta u - \frac{\Delta p}{U''}\Big)\\,\mathrm d\Omega\Big|,$$
/// $\mathbf P$ being the stress of shape, $p$ the pressure, $z$ and $p_z$ the dual solution and its pressure, and $\Delta$ the
/// difference of the two models. Without the absolute values the sum is the difference of the values, as Galerkin's orthogonality
/// has it; it may vanish by accident, where parts of the body cancel each other. The parts can't all vanish. The energy adds
/// half of its second derivative, $z - u/2$ in place of $z$: where all loads are displacements, nothing else is left.
pub(super) fn difference_bound<const D: usize>(
    coarse: &Answer<D>,
    fine: &Answer<D>,
    tolerance: &Tolerance<D>,
    history: &[Level],
) -> Result<DifferenceBound, Error> {
    let clusters = fine.problem.discrete_bodies().iter().map(|body| body.body().table().clusters().count());
    let mut zones = vec![0.0; clusters.sum()];
    let (Some(before), Some(now)) = (coarse.levels.last(), fine.levels.last()) else {
        return Ok(DifferenceBound { most: f64::INFINITY, exact: false, unseen: false, zones, weighted: Vec::new() });
    };
    let relative = |k: usize, value: f64| {
        let size = tolerance.quantities.get(k).map_or(0.0, |quantity| quantity.size);
        if value == 0.0 { 0.0 } else { value.abs() / now.values[k].abs().max(size) }
    };
    let difference = |k: usize| relative(k, now.values[k] - before.values[k]);
    // The energy stands last.
    let energy = now.values.len() - 1;
    // Bodies at rest are solved by any model; what is left is rounding.
    if before.values[energy] == 0.0 && now.values[energy] == 0.0 {
        let most = (0..tolerance.quantities.len()).map(difference).fold(0.0, f64::max);
        let weighted = vec![0.0; tolerance.quantities.len()];
        return Ok(DifferenceBound { most, exact: most <= EXACT, unseen: true, zones, weighted });
    }
    let changes = Changes::new(coarse, fine)?;
    let mut of_energy = None;
    let (mut most, mut exact, mut unseen) = (0.0_f64, true, false);
    let mut weighted = Vec::with_capacity(tolerance.quantities.len());
    for (k, quantity) in tolerance.quantities.iter().enumerate() {
        let half = if quantity.is_energy() { 0.5 } else { 0.0 };
        let (sums, of, part) = match changes.sums(k, half)? {
            Some(sums) => (sums, k, 1.0),
            // Of a quantity without a derivative as much is believed as it changed beside the energy.
            None => {
                let energies = match of_energy.take() {
                    Some(known) => known,
                    None => changes.sums(energy, 0.5)?.unwrap_or_default(),
                };
                of_energy = Some(energies.clone());
                let (part, changed) = sensitivity(history, [before, now], k, &relative);
                if changed <= EXACT {
                    unseen = true;
                    exact &= difference(energy).max(relative(energy, energies.iter().sum())) <= EXACT;
                }
                (energies, energy, part)
            }
        };
        let known = if of == k { 0.0 } else { part * difference(energy) };
        let eta = part * relative(of, sums.iter().sum());
        most = most.max(difference(k)).max(eta).max(known);
        weighted.push(eta.max(known));
        zones.iter_mut().zip(&sums).for_each(|(zone, sum)| *zone += part * relative(of, *sum));
    }
    let most = if most.is_nan() { f64::INFINITY } else { most };
    Ok(DifferenceBound { most, exact: exact && most <= EXACT, unseen, zones, weighted })
}

/// How much a quantity changed beside the energy: root of the sums of squares over this comparison and the change between the two models
/// before, of which one may be small by accident; and that root of the quantity alone.
fn sensitivity(history: &[Level], last: [&Level; 2], k: usize, relative: &impl Fn(usize, f64) -> f64) -> (f64, f64) {
    let energy = last[1].values.len() - 1;
    let before = || history.windows(2).next_back().map(|pair| [&pair[0], &pair[1]]);
    let pairs = || before().into_iter().chain([last]);
    let sum = |k: usize| pairs().map(|[a, b]| relative(k, b.values[k] - a.values[k]).powi(2)).sum::<f64>();
    let ratio = (sum(k) / sum(energy)).sqrt();
    (if ratio.is_nan() { 1.0 } else { ratio }, sum(k).sqrt())
}

/// What changes at a point.
struct Change {
    /// The stress of shape $\mathbf P$, linearised at the finer state.
    stress: Mat3,
    /// $\operatorname{cof}\mathbf F$, which does not change.
    cofactor: Mat3,
    pressure: f64,
    /// $1/U''$.
    give: f64,
}

/// What changes from one model to a finer one, at the points of the finer one, body by body.
struct Changes<'a, const D: usize> {
    coarse: &'a Answer<D>,
    fine: &'a Answer<D>,
    carries: Vec<Carry<'a, D>>,
    points: Vec<Vec<Change>>,
    displacement: Vec<f64>,
}

impl<'a, const D: usize> Changes<'a, D> {
    fn new(coarse: &'a Answer<D>, fine: &'a Answer<D>) -> Result<Self, Error> {
        let (problem, state, old) = (&fine.problem, fine.path.last(), coarse.path.last());
        let bodies = || 0..problem.discrete_bodies().len();
        let carries =
            bodies().map(|number| Carry::new(problem, &coarse.problem, number)).collect::<Result<Vec<_>, Error>>()?;
        let before = carried(&carries, &old.displacement, &state.displacement);
        let at_points = |number: usize| {
            let (member, carry) = (&problem.discrete_bodies()[number], &carries[number]);
            let body = member.body();
            let pressures = match (pressures(problem, number, state), pressures(&coarse.problem, carry.number, old)) {
                (Some(new), Some(old)) => difference(&new, &carry.at_points(&old)),
                _ => vec![0.0; body.table().point_count()],
            };
            // By the tangent at the finer state: the coarser one, laid over the finer points, may be inverted beside corners, where
            // a stress of it says nothing.
            let rest = body.material().rest();
            let past = Past { memory: &rest, elapsed: 0.0 };
            let tangent = |f: &Mat3| body.material().response_from(f, past).tangent;
            let at = |(point, p): (usize, f64)| {
                let [new, old] = [&state.displacement, &before].each(|d| body.deformation_gradient(point, d));
                let strain = new - old;
                let strain = point_of::<9>(|row| strain[(row / 3, row % 3)]);
                let change = tangent(&new) * strain;
                let change = Mat3::from_fn(|i, j| change[3 * i + j]);
                let volumetric = body.material().volumetric().map(|volumetric| volumetric.evaluate(new.determinant()));
                let give = volumetric.map_or(0.0, |volumetric| volumetric.curvature.recip());
                Change { stress: change, cofactor: cofactor(&new), pressure: p, give }
            };
            pressures.into_iter().enumerate().map(at).collect()
        };
        let points = bodies().map(at_points).collect();
        let displacement = difference(&state.displacement, &before);
        Ok(Changes { coarse, fine, carries, points, displacement })
    }

    /// The parts of the zones in a quantity, with `half` of the second derivative of the energy; none where no dual solution is known.
    fn sums(&self, k: usize, half: f64) -> Result<Option<Vec<f64>>, Error> {
        let (Some(Some(new)), Some(Some(old))) = (self.fine.duals.get(k), self.coarse.duals.get(k)) else {
            return Ok(None);
        };
        let mut dual = difference(new, &carried(&self.carries, old, new));
        add(&mut dual, -half, &self.displacement);
        let mut sums = Vec::new();
        for (number, carry) in self.carries.iter().enumerate() {
            let table = self.fine.problem.discrete_bodies()[number].body().table();
            let pressures =
                match (dual_pressures(self.fine, number, new), dual_pressures(self.coarse, carry.number, old)) {
                    (Some(new), Some(old)) => difference(&new, &carry.at_points(&old)),
                    _ => vec![0.0; table.point_count()],
                };
            let clusters = table.clusters();
            let part = |point: usize| {
                let Change { stress, cofactor, pressure, give } = &self.points[number][point];
                let gradient = table.displacement_gradient(point, &dual);
                let volume = cofactor.dot(&table.displacement_gradient(point, &self.displacement));
                let of_dual = stress.dot(&gradient) + pressure * cofactor.dot(&gradient);
                let dual_pressure = pressures[point] - half * pressure;
                table.weights()[point] * (of_dual + dual_pressure * (volume - give * pressure))
            };
            sums.extend((0..clusters.count()).map(|cluster| clusters.points(cluster).map(part).sum::<f64>().abs()));
        }
        Ok(Some(sums))
    }
}

/// A field of one model by the coefficients of another one; what belongs to no body is as in `own`.
fn carried<const D: usize>(carries: &[Carry<'_, D>], field: &[f64], own: &[f64]) -> Vec<f64> {
    let mut all = own.to_vec();
    for carry in carries {
        let first = carry.nodes.start * D;
        let coefficients = carry.field(field);
        all[first..first + coefficients.len()].copy_from_slice(&coefficients);
    }
    all
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.paired(b, |a, b| a - b)
}

/// The pressures of a dual solution at the points of a body; none where nothing tells pressures.
fn dual_pressures<const D: usize>(answer: &Answer<D>, number: usize, dual: &[f64]) -> Option<Vec<f64>> {
    let (problem, state) = (&answer.problem, answer.path.last());
    let member = &problem.discrete_bodies()[number];
    let largest = |field: &[f64]| field.largest(|x| x.abs());
    let size = largest(dual);
    if !(size > 0.0) {
        return pressures(problem, number, state).map(|pressures| vec![0.0; pressures.len()]);
    }
    // What is condensed answers linearly to steps that limit nothing.
    let moved = largest(&state.displacement);
    let scale = SMALL * if moved > 0.0 { moved } else { 1.0 } / size;
    let answered = |scale: f64| {
        let step: Vec<f64> = dual.mapped(|z| scale * z);
        let mut condensed: Vec<Vec<f64>> = state.terms.mapped(|own| vec![0.0; own.condensed.len()]);
        problem.model().at_own(state).advance_own(TermStep { displacement: &step, load: 0.0 }, &mut condensed);
        condensed.swap_remove(number)
    };
    let step: Vec<f64> = answered(scale).iter().zip(answered(0.0)).map(|(a, b)| (a - b) / scale).collect();
    member.body().pressure_changes(problem.model().view(state, number)?, dual, &step)
}

/// Hydrostatic pressures \[stress\] at the points of a body's table.
fn pressures<const D: usize>(problem: &Problem<D>, number: usize, state: &State) -> Option<Vec<f64>> {
    problem.discrete_bodies()[number].body().pressures(problem.model().view(state, number)?)
}

/// Carries fields of a body in one model to the same in another.
struct Carry<'a, const D: usize> {
    from: &'a DiscreteBody<D>,
    /// Which body of the one it is.
    number: usize,
    /// Nodes of the body among those of the other.
    nodes: Range<usize>,
    /// Functions of the one, and of the other, at the particles of the other.
    given: Vec<ShapeFunctions<3>>,
    own: Vec<ShapeFunctions<3>>,
    /// For each point of the other the nearest cluster of the one, and where the point lies.
    clusters: Vec<usize>,
    positions: &'a [Point<D>],
}

impl<'a, const D: usize> Carry<'a, D> {
    fn new(to: &'a Problem<D>, from: &'a Problem<D>, number: usize) -> Result<Self, Error> {
        let to = &to.discrete_bodies()[number];
        let number = from.discrete_bodies().iter().position(|other| other.name() == to.name()).unwrap_or(0);
        let from = &from.discrete_bodies()[number];
        let particles: Vec<Vec3> = all_padded(to.cells().positions());
        let bodies: [&dyn BodyView; 2] = [from, to];
        let (given, own) = (bodies[0].values_at(&particles)?, bodies[1].values_at(&particles)?);
        let given = given.into_mapped(|psi| psi.shifted(from.nodes().start));
        let table = from.body().table();
        let nearest = BoxTree::of(table.positions());
        let mut of = vec![0; table.point_count()];
        for cluster in 0..table.clusters().count() {
            of[table.clusters().points(cluster)].fill(cluster);
        }
        let positions = to.body().table().positions();
        let clusters = positions.mapped(|x| of[nearest.nearest(x).unwrap_or(0)]);
        Ok(Carry { from, number, nodes: to.nodes(), given, own, clusters, positions })
    }

    /// The coefficients whose values at the particles are those of the given field.
    fn field(&self, field: &[f64]) -> Vec<f64> {
        coefficients(D, &self.own, values(D, &self.given, field))
    }

    /// Values at the points of one table at those of the other, by linear functions in each cluster.
    fn at_points(&self, values: &[f64]) -> Vec<f64> {
        let table = self.from.body().table();
        let fits: Vec<_> = list_of(table.clusters().count(), |cluster| {
            linear(table.clusters().points(cluster).map(|point| (table.positions()[point], values[point])))
        });
        let at = |(x, &cluster): (&Point<D>, &usize)| {
            let (centre, mean, slope) = &fits[cluster];
            mean + slope.dot(&(x - centre))
        };
        self.positions.iter().zip(&self.clusters).map(at).collect()
    }
}

/// Squares of spreads, in parts of the largest, below which points lie in a plane or on a line but for rounding.
const FLAT: f64 = 1e-9;

/// Centre, mean and slope of the linear function nearest to values at points; no slope along directions in which these do not spread.
fn linear<const D: usize>(points: impl Iterator<Item = (Point<D>, f64)>) -> (Point<D>, f64, Point<D>) {
    let points: Vec<_> = points.collect();
    let count = points.len().max(1) as f64;
    let centre = points.iter().map(|(x, _)| x).sum::<Point<D>>() / count;
    let mean = points.summed(|(_, value)| *value) / count;
    let mut gram = DMatrix::<f64>::zeros(D, D);
    let mut rhs = DVector::<f64>::zeros(D);
    for (x, value) in &points {
        for i in 0..D {
            rhs[i] += (x[i] - centre[i]) * (value - mean);
            for j in 0..D {
                gram[(i, j)] += (x[i] - centre[i]) * (x[j] - centre[j]);
            }
        }
    }
    let spread = gram.symmetric_eigen();
    let flat = FLAT * spread.eigenvalues.amax();
    let mut slope = Point::zeros();
    for (axis, &square) in spread.eigenvectors.column_iter().zip(&spread.eigenvalues) {
        if square > flat {
            let along = axis.dot(&rhs) / square;
            slope += point_of(|i| along * axis[i]);
        }
    }
    (centre, mean, slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    /// Points in a plane that is turned, but for rounding: the slope along it, and none across.
    #[test]
    fn points_in_a_plane_tell_no_slope_across() {
        let [along, aside] = [Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.0, 0.0, 1.0)];
        let across = Vec3::new(0.8, -0.6, 0.0);
        let points = (0..9).map(|k| {
            let (s, t) = (f64::from(k % 3) - 0.3, f64::from(k / 3) + 0.2);
            let rounding = 1e-16 * f64::from((7 * k) % 5);
            (along * s + aside * t + across * (1.7 + rounding), 3.0 + 2.0 * s - t)
        });
        let (centre, mean, slope) = linear(points);
        assert_abs_diff_eq!(slope, along * 2.0 - aside, epsilon = 5e-13);
        assert_abs_diff_eq!(mean, 3.0 + 2.0 * along.dot(&centre) - aside.dot(&centre), epsilon = 1e-12);
    }
}
