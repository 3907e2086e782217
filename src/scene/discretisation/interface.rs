//! The faces that two bodies share: their facets, and functions of one side carried to the other.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use nalgebra::DMatrix;

use crate::boundary::{Order, facet_order};
use crate::cells::BoundaryCells;
use crate::each::{Each, list_of};
use crate::error::Error;
use crate::geometry::{Bounds, Mat3, Vec3, all_padded, unit};
use crate::kinematics::Kinematics;
use crate::order::accumulate;

use super::discrete_body::DiscreteBody;

/// Facets of two bodies lie on each other where the distance across is below this part of the larger one's size: chords of one arc, cut
/// into facets of different lengths, are a sixteenth of a quarter turn apart at most.
const ACROSS: f64 = 0.05;

/// Rounding of normals, and of distances in terms of a facet's size.
const ROUNDING: f64 = 1e-6;

/// A face of a body: its facets on an interface.
pub(crate) struct Face {
    pub(crate) dim: usize,
    pub(crate) cells: Arc<BoundaryCells<3>>,
    /// Weights with the measure of the kinematics.
    pub(crate) weights: Vec<f64>,
    /// The particles with a trace function.
    pub(crate) order: Order,
    /// Where the particles of the body lie.
    pub(crate) nodes: Vec<Vec3>,
}

/// Middle, mean normal, size and shape of each facet.
#[derive(Default)]
struct Facets {
    dim: usize,
    middles: Vec<Vec3>,
    normals: Vec<Vec3>,
    sizes: Vec<f64>,
    /// The longest distance within any facet.
    longest: f64,
    /// What takes an offset from the middle to lengths in terms of the facet's own: half of one at its edges.
    shapes: Vec<Mat3>,
}

impl Facets {
    fn of(dim: usize, cells: &BoundaryCells<3>) -> Self {
        let mut facets = Facets { dim, ..Facets::default() };
        for group in cells.points.groups.windows(2) {
            let range = group[0]..group[1];
            let (positions, weights) = (&cells.points.positions[range.clone()], &cells.points.weights[range.clone()]);
            let area: f64 = weights.iter().sum();
            let mean = |values: &[Vec3]| values.iter().zip(weights).map(|(x, w)| x * *w).sum::<Vec3>() / area;
            let middle = mean(positions);
            let size = if dim == 1 { 1.0 } else { area.powf(1.0 / (dim as f64 - 1.0)) };
            let farthest = positions.largest(|x| (x - middle).norm());
            // Two Gauss points a side lie at 1/√3 of the way to the corners.
            facets.longest = facets.longest.max(size).max(2.0 * 3f64.sqrt() * farthest);
            facets.shapes.push(if dim < 3 {
                Mat3::identity() / size
            } else {
                shape(middle, size, area, positions.iter().zip(weights))
            });
            facets.middles.push(middle);
            facets.normals.push(mean(&cells.points.normals[range]));
            facets.sizes.push(size);
        }
        facets
    }

    /// The facet that is nearest to a point by its own size, where the point lies over it and the normals are opposite; with the distance
    /// across.
    fn below(&self, among: &[usize], x: &Vec3, normal: &Vec3) -> Option<(usize, f64)> {
        let nearest = self.nearest(among, x)?;
        let (offset, size, own) = (x - self.middles[nearest], self.sizes[nearest], self.normals[nearest]);
        let across = offset.dot(&own);
        let along = offset - own * across;
        let inside = match self.dim {
            // Ends of lines that meet differ by rounding.
            1 => {
                offset.norm()
                    <= ACROSS * ROUNDING * self.middles.iter().map(|x| x.amax()).fold(f64::MIN_POSITIVE, f64::max)
            }
            2 => along.norm() <= 0.5 * size * (1.0 + ROUNDING),
            // Half a diagonal and a little; neighbours are nearer to points beyond it.
            _ => (self.shapes[nearest] * along).norm() <= 0.75,
        };
        (inside && (self.dim == 1 || own.dot(normal) < -0.5)).then_some((nearest, across.abs()))
    }

    fn nearest(&self, among: &[usize], x: &Vec3) -> Option<usize> {
        let distance = |k: usize| (self.shapes[k] * (x - self.middles[k])).norm();
        among.iter().copied().min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)))
    }
}

/// What takes offsets from the middle of a facet in 3D to lengths in terms of its own along its principal axes, by the second
/// moments of its points: half a side is $\sqrt{3\lambda}$ of a rectangle with the moment $\lambda$. Across, and along axes in which the
/// points do not spread, lengths are in terms of its size.
fn shape<'a>(middle: Vec3, size: f64, area: f64, points: impl Iterator<Item = (&'a Vec3, &'a f64)>) -> Mat3 {
    let (mut plain, mut moments) = (Mat3::identity() / size, Mat3::zeros());
    for (x, weight) in points {
        let offset = x - middle;
        moments += offset * offset.transpose() * *weight / area;
    }
    let principal = DMatrix::from_column_slice(3, 3, moments.as_slice()).symmetric_eigen();
    for (moment, axis) in principal.eigenvalues.iter().zip(principal.eigenvectors.column_iter()) {
        let side = 2.0 * (3.0 * moment.max(0.0)).sqrt();
        if side > FLAT * size {
            let more = 1.0 / side - 1.0 / size;
            plain += Mat3::from_fn(|i, j| more * axis[i] * axis[j]);
        }
    }
    plain
}

/// Sides below this part of the size of a facet are none: its points lie on a line or a plane.
const FLAT: f64 = 1e-3;

/// The facets of two bodies that lie on each other.
pub(crate) struct Shared {
    /// By their numbers.
    pub(crate) chosen: [Vec<usize>; 2],
    /// The middle of a facet that is too large to lie on those of the other body that lie on it.
    pub(crate) unmatched: Option<Vec3>,
    /// Where the facets of both sides end at different places: the side whose points serve both, and which of them lie on the other body.
    pub(crate) carrier: Option<(usize, Vec<bool>)>,
    facets: [Facets; 2],
}

/// Looks for the facets of two bodies that lie on each other.
pub(crate) fn shared(dim: usize, cells: [BoundaryCells<3>; 2]) -> Shared {
    let facets = cells.each_ref().map(|cells| Facets::of(dim, cells));
    // What lies in the box of the other body, with the margin of a facet.
    let near: [Vec<usize>; 2] = std::array::from_fn(|side| {
        let (own, other) = (&facets[side], &facets[1 - side]);
        let margin = own.longest.max(other.longest);
        let Bounds { low, high } = Bounds::of(&other.middles);
        let inside = |x: &Vec3| (0..3).all(|i| x[i] >= low[i] - margin && x[i] <= high[i] + margin);
        (0..own.middles.len()).filter(|&k| inside(&own.middles[k])).collect()
    });
    let below: [HashMap<usize, (usize, f64)>; 2] = std::array::from_fn(|side| {
        let (own, other) = (&facets[side], &facets[1 - side]);
        let under = |&k: &usize| Some((k, other.below(&near[1 - side], &own.middles[k], &own.normals[k])?));
        near[side].iter().filter_map(under).collect()
    });
    let chosen: [Vec<usize>; 2] = std::array::from_fn(|side| {
        let lies = |k: &usize| {
            let size = |under: usize| facets[side].sizes[*k].max(facets[1 - side].sizes[under]);
            below[side].get(k).is_some_and(|&(under, across)| across <= ACROSS * size(under))
        };
        near[side].iter().copied().filter(lies).collect()
    });
    let mut shared = Shared { chosen, unmatched: None, carrier: None, facets };
    let under = if shared.agree() { None } else { shared.carried_by(&near, &below, &cells) };
    shared.unmatched = (0..2).find_map(|side| shared.unmatched(side, &below, under.is_some()));
    if let Some((side, under)) = under {
        let facets = cells[side].points.groups.windows(2);
        let on = |facet: &[usize]| under[facet[0]..facet[1]].iter().any(Option::is_some);
        shared.chosen[side] = facets.enumerate().filter(|(_, facet)| on(facet)).map(|(k, _)| k).collect();
        let mut below: Vec<usize> = under.iter().flatten().copied().collect();
        below.sort_unstable();
        below.dedup();
        shared.chosen[1 - side] = below;
        shared.carrier = Some((side, under.mapped(Option::is_some)));
    }
    shared
}

/// For each point of a side the facet of the other one that it lies on.
type Under = Vec<Option<usize>>;

impl Shared {
    /// Whether the facets of both sides have the same area and the same middle.
    fn agree(&self) -> bool {
        let [a, b] = [0, 1].map(|side| {
            let own = &self.facets[side];
            let area = |k: usize| if own.dim == 1 { 1.0 } else { own.sizes[k].powi(own.dim as i32 - 1) };
            let (mut total, mut middle) = (0.0, Vec3::zeros());
            for &k in &self.chosen[side] {
                total += area(k);
                middle += area(k) * own.middles[k];
            }
            (total, middle / total)
        });
        let longest = self.facets[0].longest.max(self.facets[1].longest);
        (a.0 - b.0).abs() <= ROUNDING * a.0 && (a.1 - b.1).norm() <= ROUNDING * longest
    }

    /// The side whose points serve both, where the facets of the two sides end at different places: the only one each of whose facets lies on
    /// the other body with all of its points or with none, so that it ends where the interface ends; where both sides have facets that
    /// lie there in part, that with the smaller ones.
    fn carried_by(
        &self,
        near: &[Vec<usize>; 2],
        below: &[HashMap<usize, (usize, f64)>; 2],
        cells: &[BoundaryCells<3>; 2],
    ) -> Option<(usize, Under)> {
        // Facets whose middles are over the other body and away from it turn away from it, though points of them are near.
        let gapes =
            |side: usize, k: usize| below[side].contains_key(&k) && self.chosen[side].binary_search(&k).is_err();
        let [first, second] = [0, 1].map(|side| self.under(side, near, &gapes, &cells[side]));
        let whole = [&first, &second].map(|(_, whole)| *whole);
        let side = match whole {
            [true, true] => return None,
            [false, false] => usize::from(self.facets[1].longest < self.facets[0].longest),
            _ => usize::from(whole[1]),
        };
        let under = if side == 0 { first.0 } else { second.0 };
        under.iter().any(Option::is_some).then_some((side, under))
    }

    /// What the points of a side lie on, and whether no facet has some that lie on the other body and some that do not.
    fn under(
        &self,
        side: usize,
        near: &[Vec<usize>; 2],
        gapes: &dyn Fn(usize, usize) -> bool,
        cells: &BoundaryCells<3>,
    ) -> (Under, bool) {
        let (own, other) = (&self.facets[side], &self.facets[1 - side]);
        let (mut under, mut whole) = (vec![None; cells.points.positions.len()], true);
        for &k in near[side].iter().filter(|&&k| !gapes(side, k)) {
            let range = cells.points.groups[k]..cells.points.groups[k + 1];
            for point in range.clone() {
                let (x, normal) = (&cells.points.positions[point], &cells.points.normals[point]);
                let close = |&(facet, across): &(usize, f64)| {
                    !gapes(1 - side, facet) && across <= ACROSS * own.sizes[k].max(other.sizes[facet])
                };
                under[point] = other.below(&near[1 - side], x, normal).filter(close).map(|(facet, _)| facet);
            }
            let on = under[range.clone()].iter().filter(|facet| facet.is_some()).count();
            whole &= on == 0 || on == range.len();
        }
        (under, whole)
    }

    /// The middle of a facet of one side that does not lie on the other body, though facets of that lie on it: on both sides of its middle,
    /// which is over the other body too, as on coarse chords of an arc; or within it in its plane, as on one that is larger than the whole
    /// other face. Facets at the ends of faces, and where one turns away from the other, are none of these.
    fn unmatched(&self, side: usize, below: &[HashMap<usize, (usize, f64)>; 2], carried: bool) -> Option<Vec3> {
        let (own, other) = (&self.facets[side], &self.facets[1 - side]);
        let mut on: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for &k in &self.chosen[1 - side] {
            let (under, _) = below[1 - side][&k];
            if self.chosen[side].binary_search(&under).is_err() {
                on.entry(under).or_default().push(k);
            }
        }
        // Within any triangle and any parallelogram of the facet's moments.
        let within = if own.dim < 3 { 0.5 } else { 6f64.sqrt().recip() };
        let unmatched = |(facet, others): &(&usize, &Vec<usize>)| {
            let (middle, size) = (own.middles[**facet], own.sizes[**facet]);
            let offsets = others.mapped(|&k| own.shapes[**facet] * (other.middles[k] - middle));
            // More than a third of a turn apart.
            let apart = |a: &Vec3| offsets.iter().any(|b| a.dot(b) < -0.5 * a.norm() * b.norm());
            let in_plane = |(&k, offset): (&usize, &Vec3)| {
                let across = (other.middles[k] - middle).dot(&own.normals[**facet]).abs();
                let parallel = (other.normals[k] + own.normals[**facet]).norm() <= ROUNDING;
                parallel && across <= ROUNDING * size && offset.norm() <= within
            };
            (below[side].contains_key(*facet) && offsets.iter().any(apart))
                || (self.chosen[side].is_empty() && !carried && others.iter().zip(&offsets).any(in_plane))
        };
        on.iter().find(unmatched).map(|(facet, _)| own.middles[*facet])
    }

    /// Whether a point of both bodies belongs to the interface: it is no farther from the middle of one of its facets than that is long.
    pub(crate) fn holds(&self, x: &Vec3) -> bool {
        (0..2).any(|side| {
            let own = &self.facets[side];
            self.chosen[side].iter().any(|&k| own.dim == 1 || (own.shapes[k] * (x - own.middles[k])).norm() <= 1.0)
        })
    }
}

impl Face {
    pub(crate) fn new<const D: usize>(
        body: &DiscreteBody<D>,
        boundary: &BoundaryCells<D>,
        chosen: &[usize],
        lies: &dyn Fn(usize) -> bool,
        kinematics: &dyn Kinematics<D>,
    ) -> Result<Self, Error> {
        let mut kept = vec![false; boundary.traces.len()];
        for &facet in chosen {
            let range = boundary.points.groups[facet]..boundary.points.groups[facet + 1];
            range.for_each(|point| kept[point] = lies(point));
        }
        let cells = boundary.at_points(&|point| kept[point]);
        let has_hoops = !kinematics.hoop_components().is_empty();
        let mut weights = Vec::with_capacity(cells.traces.len());
        for (x, weight) in cells.points.positions.iter().zip(&cells.points.weights) {
            weights.push(weight * crate::kinematics::measure(kinematics, has_hoops, x)?);
        }
        let (cells, nodes) = (Arc::new(cells.padded()), all_padded(body.approximation.nodes()));
        Ok(Face { dim: D, order: facet_order(&cells), cells, weights, nodes })
    }

    pub(crate) fn positions(&self) -> &[Vec3] {
        &self.cells.points.positions
    }
}

/// Values of trace functions: for each point (particle, value).
pub(crate) type Traces = Vec<Vec<(u32, f64)>>;

/// The trace functions of one side at points of the other one: extrapolated from the points of the facet that a point lies on, and
/// corrected so that they have the measure and the first moments that they have on their own side.
///
/// Sums of the trace functions stay one, whatever the rules: a constant multiplier pushes both sides as their own rules do, and the patch
/// test passes across interfaces that do not match.
pub(crate) fn carried(mortar: &Face, other: &Face) -> Traces {
    let cells = &*mortar.cells;
    let facets = Facets::of(mortar.dim, cells);
    let all: Vec<usize> = (0..facets.middles.len()).collect();
    let fits = all.mapped(|&k| Fit::new(cells, &facets, k));
    let mut carried: Traces = Vec::with_capacity(other.positions().len());
    for x in other.positions() {
        let mut values: Vec<(u32, f64)> = Vec::new();
        if let Some(facet) = facets.nearest(&all, x) {
            let range = cells.points.groups[facet]..cells.points.groups[facet + 1];
            for (point, part) in range.zip(fits[facet].parts(x)) {
                for &(particle, trace) in &cells.traces[point] {
                    accumulate(&mut values, particle, part * trace);
                }
            }
        }
        carried.push(values);
    }
    carried
}

/// How values at the points of a facet are extrapolated to points on or near it.
struct Fit {
    middle: Vec3,
    tangents: Vec<Vec3>,
    /// Parts of the points for each function of the fit.
    inverse: DMatrix<f64>,
}

impl Fit {
    fn new(cells: &BoundaryCells<3>, facets: &Facets, facet: usize) -> Self {
        let positions = &cells.points.positions[cells.points.groups[facet]..cells.points.groups[facet + 1]];
        let (middle, normal, size) = (facets.middles[facet], facets.normals[facet], facets.sizes[facet]);
        let mut tangents: Vec<Vec3> = Vec::new();
        // The first along the points, which stand along the sides of bricks.
        let along = positions.iter().skip(1).map(|x| x - positions[0]);
        for candidate in along.chain((0..facets.dim).map(unit)) {
            if tangents.len() + 1 >= facets.dim {
                break;
            }
            let mut rest: Vec3 = candidate / size;
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
        let rows = positions.mapped(|x| fit.functions(x, positions.len()));
        let functions = rows.first().map_or(0, Vec::len);
        let matrix = DMatrix::from_fn(rows.len(), functions, |i, j| rows[i][j]);
        fit.inverse = matrix.pseudo_inverse(1e-10).unwrap_or_else(|_| DMatrix::zeros(functions, rows.len()));
        fit
    }

    /// 1, and as many of s, t, st as the points of a facet determine.
    fn functions(&self, x: &Vec3, points: usize) -> Vec<f64> {
        let local = self.tangents.mapped(|tangent| (x - self.middle).dot(tangent));
        match (local.as_slice(), points) {
            (_, 1) | ([], _) => vec![1.0],
            (&[s], _) => vec![1.0, s],
            (&[s, t, ..], 4..) => vec![1.0, s, t, s * t],
            (&[s, t, ..], 3) => vec![1.0, s, t],
            _ => vec![1.0],
        }
    }

    /// The parts of the facet's points in the value at a point.
    fn parts(&self, x: &Vec3) -> Vec<f64> {
        let functions = self.functions(x, self.inverse.ncols());
        list_of(self.inverse.ncols(), |k| functions.iter().enumerate().map(|(f, v)| v * self.inverse[(f, k)]).sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Block, Part, Side};

    /// All facets of two equal faces lie on the other one, whatever their shapes.
    #[test]
    fn facets_of_any_shape_lie_on_each_other() {
        let face = |counts: [usize; 3], low: f64, side: Side| {
            let lattice = Block::new([0.0, 0.0, low], [8.0, 4.0, low + 1.0]).lattice(counts).unwrap();
            lattice.plain_boundary(&Part::Face { axis: 2, side }, 1, 2).unwrap()
        };
        for counts in [[3, 5, 2], [2, 9, 2], [5, 3, 2]] {
            for other in [[17, 9, 2], [5, 17, 2], [33, 33, 2], [3, 5, 2]] {
                let lower = face(counts, 0.0, Side::Max);
                let upper = face(other, 1.0, Side::Min);
                let shared = shared(3, [lower.clone(), upper.clone()]);
                assert_eq!(shared.unmatched, None);
                let found = shared.chosen.map(|facets| facets.len());
                let all = [&lower, &upper].map(|cells| cells.points.groups.len() - 1);
                assert_eq!(found, all, "{counts:?} {other:?}");
            }
        }
    }
}
