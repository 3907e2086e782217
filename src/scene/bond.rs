//! Bonds: bodies that share faces, joined by rows over the interface.

use std::collections::HashMap;

use nalgebra::DMatrix;

use crate::boundary::{Constraints, Row};
use crate::cells::BoundaryCells;
use crate::error::Error;
use crate::geometry::{Part, Point};
use crate::kinematics::Kinematics;
use crate::shape::ShapeFunctions;
use crate::term::Amplitude;

use super::discretize::FacetRule;
use super::member::Member;

/// Facets of two bodies lie on each other where the distance across is below this part of their size: chords of one arc, cut
/// into facets of different lengths, are a sixteenth of a quarter turn apart at most.
const ACROSS: f64 = 0.05;
/// Two rules integrate one interface where their measures and first moments agree to this part.
const AGREED: f64 = 1e-9;

/// One side of an interface: its facets there.
struct Shore<'a, const D: usize> {
    member: &'a Member<D>,
    cells: BoundaryCells<D>,
    /// Weights with the measure of the kinematics.
    weights: Vec<f64>,
    values: Vec<ShapeFunctions<D>>,
    /// The particles with a hat, in the order of the facets.
    particles: Vec<u32>,
}

/// Middle, mean normal and size of each facet.
struct Facets<const D: usize> {
    middles: Vec<Point<D>>,
    normals: Vec<Point<D>>,
    sizes: Vec<f64>,
}

impl<const D: usize> Facets<D> {
    fn of(cells: &BoundaryCells<D>) -> Self {
        let mut facets = Facets { middles: Vec::new(), normals: Vec::new(), sizes: Vec::new() };
        for group in cells.points.groups.windows(2) {
            let range = group[0]..group[1];
            let area: f64 = cells.points.weights[range.clone()].iter().sum();
            let weighted = |values: &[Point<D>]| {
                let parts = range.clone().map(|k| values[k] * cells.points.weights[k]);
                parts.sum::<Point<D>>() / area
            };
            facets.middles.push(weighted(&cells.points.positions));
            facets.normals.push(weighted(&cells.points.normals));
            facets.sizes.push(if D == 1 { 1.0 } else { area.powf(1.0 / (D as f64 - 1.0)) });
        }
        facets
    }

    /// The facet on which a point lies, that is nearest to it by its own size.
    fn under(&self, among: &[usize], x: &Point<D>, normal: &Point<D>, cells: &BoundaryCells<D>) -> Option<usize> {
        let nearest = self.nearest(among, x)?;
        let (offset, size) = (x - self.middles[nearest], self.sizes[nearest]);
        let own = self.normals[nearest];
        let across = offset.dot(&own);
        let along = (offset - own * across).norm();
        let inside = match D {
            1 => offset.norm() <= ACROSS * cells_scale(cells),
            2 => along <= 0.5 * size * (1.0 + 1e-6),
            // Half a diagonal of facets that are not too long; neighbours are nearer to points beyond it.
            _ => along <= 0.75 * size,
        };
        let opposite = D == 1 || own.dot(normal) < -0.5;
        (inside && opposite && across.abs() <= ACROSS * size).then_some(nearest)
    }

    fn nearest(&self, among: &[usize], x: &Point<D>) -> Option<usize> {
        let distance = |k: usize| (x - self.middles[k]).norm() / self.sizes[k];
        among.iter().copied().min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)))
    }
}

/// A length to measure distances of points in one dimension by.
fn cells_scale<const D: usize>(cells: &BoundaryCells<D>) -> f64 {
    let ends = cells.points.positions.iter().map(|x| x.amax());
    1e-6 * ends.fold(f64::MIN_POSITIVE, f64::max)
}

/// The facets of two bodies that lie on each other, by their numbers.
fn shared<const D: usize>(cells: [&BoundaryCells<D>; 2]) -> [Vec<usize>; 2] {
    let facets = cells.map(Facets::of);
    // What lies in the box of the other body, with the margin of a facet.
    let near: [Vec<usize>; 2] = std::array::from_fn(|side| {
        let (own, other) = (&facets[side], &facets[1 - side]);
        let margin = other.sizes.iter().chain(&own.sizes).fold(0.0, |a: f64, b| a.max(*b));
        let low = other.middles.iter().fold(Point::<D>::repeat(f64::INFINITY), |low, x| low.inf(x));
        let high = other.middles.iter().fold(Point::<D>::repeat(f64::NEG_INFINITY), |high, x| high.sup(x));
        let inside = |x: &Point<D>| (0..D).all(|i| x[i] >= low[i] - margin && x[i] <= high[i] + margin);
        (0..own.middles.len()).filter(|&k| inside(&own.middles[k])).collect()
    });
    std::array::from_fn(|side| {
        let (own, other) = (&facets[side], &facets[1 - side]);
        let on =
            |k: &usize| other.under(&near[1 - side], &own.middles[*k], &own.normals[*k], cells[1 - side]).is_some();
        near[side].iter().copied().filter(on).collect()
    })
}

impl<'a, const D: usize> Shore<'a, D> {
    fn new(
        member: &'a Member<D>,
        boundary: &BoundaryCells<D>,
        chosen: &[usize],
        kinematics: &dyn Kinematics<D>,
    ) -> Result<Self, Error> {
        let mut cells = BoundaryCells { points: crate::quadrature::Points::empty(), hats: Vec::new() };
        for &facet in chosen {
            let range = boundary.points.groups[facet]..boundary.points.groups[facet + 1];
            cells.points.positions.extend_from_slice(&boundary.points.positions[range.clone()]);
            cells.points.weights.extend_from_slice(&boundary.points.weights[range.clone()]);
            cells.points.normals.extend_from_slice(&boundary.points.normals[range.clone()]);
            cells.hats.extend_from_slice(&boundary.hats[range]);
            cells.points.close_group();
        }
        let has_hoops = !kinematics.hoop_components().is_empty();
        let mut weights = Vec::with_capacity(cells.hats.len());
        for (x, weight) in cells.points.positions.iter().zip(&cells.points.weights) {
            weights.push(weight * crate::kinematics::measure(kinematics, has_hoops, x)?);
        }
        let values = member.values_at(&cells.points.positions)?;
        let mut particles: Vec<u32> = Vec::new();
        let mut seen = std::collections::HashSet::new();
        particles.extend(cells.hats.iter().flatten().map(|hat| hat.0).filter(|&particle| seen.insert(particle)));
        Ok(Shore { member, cells, weights, values, particles })
    }

    /// Measure and first moments of the facets about a point, lengths over `size`.
    fn moments(&self, centre: &Point<D>, size: f64) -> Vec<f64> {
        let mut sums = vec![0.0; D + 1];
        for (x, weight) in self.cells.points.positions.iter().zip(&self.weights) {
            sums.iter_mut().zip(linear(x, centre, size)).for_each(|(sum, q)| *sum += weight * q);
        }
        sums
    }
}

/// $(1, (X - X_0)/L)$.
fn linear<const D: usize>(x: &Point<D>, centre: &Point<D>, size: f64) -> impl Iterator<Item = f64> {
    let offset = (x - centre) / size;
    std::iter::once(1.0).chain((0..D).map(move |i| offset[i]))
}

/// Values of the multipliers' functions: for each point (multiplier, value).
type Functions = Vec<Vec<(usize, f64)>>;

/// The hats of one side at points of the other one: extrapolated from the points of the facet that a point lies on, and
/// corrected so that they have the measure and the first moments that they have on their own side.
///
/// Sums of the hats stay one, whatever the rules: a constant multiplier pushes both sides as their own rules do, and the patch
/// test passes across interfaces that do not match.
fn carried<const D: usize>(mortar: &Shore<'_, D>, number: &HashMap<u32, usize>, other: &Shore<'_, D>) -> Functions {
    let facets = Facets::of(&mortar.cells);
    let all: Vec<usize> = (0..facets.middles.len()).collect();
    let fits: Vec<Fit<D>> = all.iter().map(|&k| Fit::new(mortar, &facets, k)).collect();
    let mut carried: Functions = Vec::with_capacity(other.weights.len());
    for x in &other.cells.points.positions {
        let mut values: Vec<(usize, f64)> = Vec::new();
        if let Some(facet) = facets.nearest(&all, x) {
            let range = mortar.cells.points.groups[facet]..mortar.cells.points.groups[facet + 1];
            for (point, part) in range.zip(fits[facet].parts(x)) {
                for &(particle, hat) in &mortar.cells.hats[point] {
                    let multiplier = number[&particle];
                    match values.iter_mut().find(|entry| entry.0 == multiplier) {
                        Some(entry) => entry.1 += part * hat,
                        None => values.push((multiplier, part * hat)),
                    }
                }
            }
        }
        carried.push(values);
    }
    carried
}

/// How values at the points of a facet are extrapolated to points on or near it.
struct Fit<const D: usize> {
    middle: Point<D>,
    tangents: Vec<Point<D>>,
    /// Parts of the points for each function of the fit.
    inverse: DMatrix<f64>,
}

impl<const D: usize> Fit<D> {
    fn new(shore: &Shore<'_, D>, facets: &Facets<D>, facet: usize) -> Self {
        let range = shore.cells.points.groups[facet]..shore.cells.points.groups[facet + 1];
        let (middle, normal, size) = (facets.middles[facet], facets.normals[facet], facets.sizes[facet]);
        let mut tangents: Vec<Point<D>> = Vec::new();
        // The first along the points, which stand along the sides of bricks.
        let along =
            range.clone().skip(1).map(|k| shore.cells.points.positions[k] - shore.cells.points.positions[range.start]);
        let axes = (0..D).map(|axis| Point::<D>::from_fn(|i, _| f64::from(u8::from(i == axis))));
        for candidate in along.chain(axes) {
            if tangents.len() + 1 >= D {
                break;
            }
            let mut rest: Point<D> = candidate / size;
            rest -= normal * (rest.dot(&normal) / normal.norm_squared());
            for tangent in &tangents {
                rest -= tangent * rest.dot(tangent);
            }
            if rest.norm() > 0.1 {
                tangents.push(rest / (rest.norm() * size));
                let last = tangents.len() - 1;
                // Unit vectors while others are made; scaled to the facet in the end.
                tangents[last] *= size;
            }
        }
        tangents.iter_mut().for_each(|tangent| *tangent /= size);
        let mut fit = Fit { middle, tangents, inverse: DMatrix::zeros(0, 0) };
        let rows: Vec<Vec<f64>> =
            range.clone().map(|k| fit.functions(&shore.cells.points.positions[k], range.len())).collect();
        let functions = rows.first().map_or(0, Vec::len);
        let matrix = DMatrix::from_fn(rows.len(), functions, |i, j| rows[i][j]);
        fit.inverse = matrix.pseudo_inverse(1e-10).unwrap_or_else(|_| DMatrix::zeros(functions, rows.len()));
        fit
    }

    /// 1, and as many of s, t, st as the points of a facet determine.
    fn functions(&self, x: &Point<D>, points: usize) -> Vec<f64> {
        let local: Vec<f64> = self.tangents.iter().map(|tangent| (x - self.middle).dot(tangent)).collect();
        match (local.as_slice(), points) {
            (_, 1) | ([], _) => vec![1.0],
            (&[s], _) => vec![1.0, s],
            (&[s, t, ..], 4..) => vec![1.0, s, t, s * t],
            (&[s, t, ..], 3) => vec![1.0, s, t],
            _ => vec![1.0],
        }
    }

    /// The parts of the facet's points in the value at a point.
    fn parts(&self, x: &Point<D>) -> Vec<f64> {
        let functions = self.functions(x, self.inverse.ncols());
        (0..self.inverse.ncols())
            .map(|k| functions.iter().enumerate().map(|(f, v)| v * self.inverse[(f, k)]).sum())
            .collect()
    }
}

/// Rounds of corrections: each leaves about a part [`CLOSER`] of what was missing, until rounding is all that is left.
const ROUNDS: usize = 4;
/// Conjugate gradients end with this part of what they began with.
const CLOSER: f64 = 1e-7;
/// The system is singular: what rounding puts beyond its range can't be met, and iterations that try grow without bound. They end
/// with this many times the least residual, and the solution is that of the least.
const GROWN: f64 = 10.0;

/// Adds what is missing of the measures and first moments of each function: the smallest change in terms of the functions
/// themselves that leaves their sums one, by conjugate gradients.
fn correct<const D: usize>(
    functions: &mut Functions,
    other: &Shore<'_, D>,
    wanted: &[Vec<f64>],
    centre: &Point<D>,
    size: f64,
) {
    let system = Moments {
        xi: other.cells.points.positions.iter().map(|x| linear(x, centre, size).collect()).collect(),
        bounds: functions.iter().map(|values| values.iter().map(|&(j, v)| (j, v.max(0.0))).collect()).collect(),
        weights: &other.weights,
        terms: D + 1,
    };
    let mut missing = system.missing(functions, wanted);
    for _ in 0..ROUNDS {
        let alpha = system.solve(&missing);
        let mut corrected = functions.clone();
        for (point, values) in corrected.iter_mut().enumerate() {
            for (j, change) in system.changes(&alpha, point) {
                values.iter_mut().filter(|entry| entry.0 == j).for_each(|entry| entry.1 += change);
            }
        }
        let left = system.missing(&corrected, wanted);
        if !(dot(&left, &left) < dot(&missing, &missing)) {
            break;
        }
        (*functions, missing) = (corrected, left);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// How measures and first moments of functions follow from changes
/// $\delta\Theta_J = \omega_J\\,(\alpha_J\cdot\xi - \sum_K\omega_K\\,\alpha_K\cdot\xi/\sum_K\omega_K)$.
struct Moments<'a> {
    /// $\xi$ at each point.
    xi: Vec<Vec<f64>>,
    /// $\omega_J$ at each point.
    bounds: Functions,
    weights: &'a [f64],
    terms: usize,
}

impl Moments<'_> {
    /// What functions lack of the wanted moments, one after the other.
    fn missing(&self, functions: &Functions, wanted: &[Vec<f64>]) -> Vec<f64> {
        let mut missing = wanted.concat();
        for ((values, q), weight) in functions.iter().zip(&self.xi).zip(self.weights) {
            for &(j, value) in values {
                let moments = missing[j * self.terms..(j + 1) * self.terms].iter_mut().zip(q);
                moments.for_each(|(m, q)| *m -= weight * value * q);
            }
        }
        missing
    }

    fn changes(&self, alpha: &[f64], point: usize) -> Vec<(usize, f64)> {
        let bounds = &self.bounds[point];
        let along = |j: usize| dot(&self.xi[point], &alpha[j * self.terms..(j + 1) * self.terms]);
        let total = bounds.iter().map(|b| b.1).sum::<f64>().max(f64::MIN_POSITIVE);
        let mean = bounds.iter().map(|&(j, w)| w * along(j)).sum::<f64>() / total;
        bounds.iter().map(|&(j, w)| (j, w * (along(j) - mean))).collect()
    }

    fn apply(&self, alpha: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; alpha.len()];
        for (point, q) in self.xi.iter().enumerate() {
            for (j, change) in self.changes(alpha, point) {
                let sums = out[j * self.terms..(j + 1) * self.terms].iter_mut().zip(q);
                sums.for_each(|(o, q)| *o += self.weights[point] * change * q);
            }
        }
        out
    }

    fn solve(&self, missing: &[f64]) -> Vec<f64> {
        let mut rest = missing.to_vec();
        let (mut alpha, mut direction) = (vec![0.0; rest.len()], rest.clone());
        let mut square = dot(&rest, &rest);
        let enough = CLOSER * CLOSER * square;
        let (mut best, mut least) = (alpha.clone(), square);
        for _ in 0..4 * rest.len() {
            let image = self.apply(&direction);
            let curvature = dot(&direction, &image);
            if !(least > enough && square <= GROWN * GROWN * least && curvature > 0.0) {
                break;
            }
            let step = square / curvature;
            alpha.iter_mut().zip(&direction).for_each(|(a, d)| *a += step * d);
            rest.iter_mut().zip(&image).for_each(|(r, i)| *r -= step * i);
            let next = dot(&rest, &rest);
            direction.iter_mut().zip(&rest).for_each(|(d, r)| *d = r + next / square * *d);
            square = next;
            if square < least {
                (best, least) = (alpha.clone(), square);
            }
        }
        best
    }
}

/// Which particles are tied to each other or to the ground, component by component: a row between two that are is one too
/// many.
pub(super) struct Ties {
    leader: Vec<usize>,
}

impl Ties {
    /// Nothing tied among `unknowns` but what the conditions hold.
    pub(super) fn new<const D: usize>(rows: &Constraints, unknowns: usize) -> Self {
        let mut ties = Ties { leader: (0..=unknowns).collect() };
        for unknown in 0..unknowns {
            if rows.claims(unknown / D, unknown % D) {
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

/// Adds rows $\int\Theta_J\\,(u_1 - u_2)\\,\mathrm d\Gamma = 0$ over the faces that two bodies share, with the hats of the coarser
/// one; `false` where they share none.
pub(super) fn bond<const D: usize>(
    rows: &mut Constraints,
    ties: &mut Ties,
    members: [&Member<D>; 2],
    rules: [FacetRule; 2],
    kinematics: &dyn Kinematics<D>,
) -> Result<bool, Error> {
    let boundary = |side: usize| {
        let rule = rules[side];
        members[side].cells.boundary(&Part::Whole, rule.parts, rule.gauss)
    };
    let boundaries = [boundary(0)?, boundary(1)?];
    let chosen = shared([&boundaries[0], &boundaries[1]]);
    if chosen.iter().any(Vec::is_empty) {
        return Ok(false);
    }
    let mut shores = Vec::with_capacity(2);
    for side in 0..2 {
        shores.push(Shore::new(members[side], &boundaries[side], &chosen[side], kinematics)?);
    }
    if shores[1].particles.len() < shores[0].particles.len() {
        shores.swap(0, 1);
    }
    let [mortar, other] = shores.as_slice() else { return Ok(false) };
    let positions = |shore: &Shore<'_, D>, particle: u32| shore.member.cells.positions()[particle as usize];
    let number: HashMap<u32, usize> = mortar.particles.iter().enumerate().map(|(k, &p)| (p, k)).collect();
    let own: Functions =
        mortar.cells.hats.iter().map(|hats| hats.iter().map(|&(p, v)| (number[&p], v)).collect()).collect();
    let centre = mortar.cells.points.positions.iter().sum::<Point<D>>() / mortar.weights.len() as f64;
    let size = mortar.cells.points.positions.iter().map(|x| (x - centre).norm()).fold(f64::MIN_POSITIVE, f64::max);
    let totals = [mortar.moments(&centre, size), other.moments(&centre, size)];
    let agree = totals[0].iter().zip(&totals[1]).all(|(a, b)| (a - b).abs() <= AGREED * totals[0][0].abs());
    // (side, sign, functions at its points, weights, shape functions).
    let carried_values;
    let mut sides: Vec<(&Shore<'_, D>, &Functions, &[f64], Vec<ShapeFunctions<D>>)> = Vec::new();
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
        sides.push((mortar, &own, &mortar.weights, mortar.values.clone()));
        sides.push((other, &carried_values, &other.weights, other.values.clone()));
    } else if totals[0][0] <= totals[1][0] {
        // The faces end at different places: the points of the smaller one serve both.
        sides.push((mortar, &own, &mortar.weights, mortar.values.clone()));
        sides.push((other, &own, &mortar.weights, other.member.values_at(&mortar.cells.points.positions)?));
    } else {
        carried_values = carried(mortar, &number, other);
        let there = mortar.member.values_at(&other.cells.points.positions)?;
        sides.push((mortar, &carried_values, &other.weights, there));
        sides.push((other, &carried_values, &other.weights, other.values.clone()));
    }
    let label = format!("bond of {} and {}", members[0].name, members[1].name);
    // Functions of each multiplier: by side (point, value).
    let mut supports: Vec<[Vec<(usize, f64)>; 2]> = vec![[Vec::new(), Vec::new()]; number.len()];
    for (side, (_, functions, ..)) in sides.iter().enumerate() {
        for (point, values) in functions.iter().enumerate() {
            for &(j, value) in values.iter().filter(|entry| entry.1 != 0.0) {
                supports[j][side].push((point, value));
            }
        }
    }
    let mut neighbours: Vec<Vec<usize>> = vec![Vec::new(); number.len()];
    for group in mortar.cells.points.groups.windows(2) {
        let mut members: Vec<usize> = own[group[0]..group[1]].iter().flatten().map(|entry| entry.0).collect();
        members.sort_unstable();
        members.dedup();
        for &j in &members {
            neighbours[j].extend(&members);
        }
    }
    let nearest: Vec<u32> = mortar
        .particles
        .iter()
        .map(|&particle| {
            let x = positions(mortar, particle);
            let distance = |k: u32| (positions(other, k) - x).norm_squared();
            let all = other.particles.iter().copied();
            all.min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b))).unwrap_or(0)
        })
        .collect();
    let first = [mortar.member.nodes.start, other.member.nodes.start];
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
        // Where each function goes: to itself, or to the nearest free one on a shared facet.
        let mut gathered: Vec<Vec<usize>> = vec![Vec::new(); number.len()];
        for j in 0..number.len() {
            let x = positions(mortar, mortar.particles[j]);
            let distance = |k: usize| (positions(mortar, mortar.particles[k]) - x).norm_squared();
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
        for (j, parts) in gathered.iter().enumerate().filter(|(_, parts)| !parts.is_empty()) {
            let mut entries: HashMap<usize, f64> = HashMap::new();
            for (side, (_, _, weights, values)) in sides.iter().enumerate() {
                let sign = if side == 0 { 1.0 } else { -1.0 };
                for &(point, value) in parts.iter().flat_map(|&part| &supports[part][side]) {
                    let psi = &values[point];
                    for (&node, &shape) in psi.nodes.iter().zip(&psi.values) {
                        let unknown = (first[side] + node as usize) * D + component;
                        *entries.entry(unknown).or_default() += sign * weights[point] * value * shape;
                    }
                }
            }
            let mut entries: Vec<(usize, f64)> = entries.into_iter().collect();
            entries.sort_unstable_by_key(|entry| entry.0);
            let dependent = (first[0] + mortar.particles[j] as usize) * D + component;
            rows.push(Row { entries, dependent, target: 0.0, amplitude: Amplitude::Constant, label: label.clone() })?;
        }
    }
    Ok(true)
}
