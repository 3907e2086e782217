//! The faces that two bodies share: their facets, and functions of one side carried to the other.

use nalgebra::{DMatrix, SMatrix};

use crate::boundary::{InterfaceSide, facet_neighbours};
use crate::cells::BoundaryCells;
use crate::error::Error;
use crate::geometry::{Bounds, Point, unit};
use crate::kinematics::Kinematics;

use super::discrete_body::DiscreteBody;

/// Facets of two bodies lie on each other where the distance across is below this part of their size: chords of one arc, cut
/// into facets of different lengths, are a sixteenth of a quarter turn apart at most.
const ACROSS: f64 = 0.05;

/// A face of a body: its facets on an interface.
pub(crate) struct Face<'a, const D: usize> {
    pub(crate) discrete_body: &'a DiscreteBody<D>,
    pub(crate) cells: BoundaryCells<D>,
    /// Weights with the measure of the kinematics.
    pub(crate) weights: Vec<f64>,
    /// The particles with a trace function, in the order of the facets.
    pub(crate) particles: Vec<u32>,
}

/// Middle, mean normal, size and shape of each facet.
struct Facets<const D: usize> {
    middles: Vec<Point<D>>,
    normals: Vec<Point<D>>,
    sizes: Vec<f64>,
    /// The longest distance within any facet.
    longest: f64,
    /// What takes an offset from the middle to lengths in terms of the facet's own: half of one at its edges.
    shapes: Vec<SMatrix<f64, D, D>>,
}

impl<const D: usize> Facets<D> {
    fn of(cells: &BoundaryCells<D>) -> Self {
        let mut facets =
            Facets { middles: Vec::new(), normals: Vec::new(), sizes: Vec::new(), longest: 0.0, shapes: Vec::new() };
        for group in cells.points.groups.windows(2) {
            let range = group[0]..group[1];
            let area: f64 = cells.points.weights[range.clone()].iter().sum();
            let weighted = |values: &[Point<D>]| {
                let parts = range.clone().map(|k| values[k] * cells.points.weights[k]);
                parts.sum::<Point<D>>() / area
            };
            facets.middles.push(weighted(&cells.points.positions));
            facets.normals.push(weighted(&cells.points.normals));
            let size = if D == 1 { 1.0 } else { area.powf(1.0 / (D as f64 - 1.0)) };
            facets.sizes.push(size);
            let middle = facets.middles[facets.middles.len() - 1];
            let away = |x: &Point<D>| (x - middle).norm();
            let farthest = cells.points.positions[range.clone()].iter().map(away).fold(0.0, f64::max);
            // Two Gauss points a side lie at 1/√3 of the way to the corners.
            facets.longest = facets.longest.max(size).max(2.0 * 3f64.sqrt() * farthest);
            let points = cells.points.positions[range.clone()].iter().zip(&cells.points.weights[range.clone()]);
            facets.shapes.push(shape(middle, size, area, points));
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
            // Half a diagonal and a little; neighbours are nearer to points beyond it.
            _ => (self.shapes[nearest] * (offset - own * across)).norm() <= 0.75,
        };
        let opposite = D == 1 || own.dot(normal) < -0.5;
        (inside && opposite && across.abs() <= ACROSS * size).then_some(nearest)
    }

    fn nearest(&self, among: &[usize], x: &Point<D>) -> Option<usize> {
        let distance = |k: usize| (self.shapes[k] * (x - self.middles[k])).norm();
        among.iter().copied().min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)))
    }
}

/// What takes offsets from the middle of a facet in space to lengths in terms of its own along its principal axes, by the second
/// moments of its points: half a side is $\sqrt{3\lambda}$ of a rectangle with the moment $\lambda$. Across, along axes in which the points do not
/// spread, and of facets in the plane, lengths are in terms of its size.
fn shape<'a, const D: usize>(
    middle: Point<D>,
    size: f64,
    area: f64,
    points: impl Iterator<Item = (&'a Point<D>, &'a f64)>,
) -> SMatrix<f64, D, D> {
    let mut plain = SMatrix::<f64, D, D>::identity() / size;
    if D < 3 {
        return plain;
    }
    let mut moments = DMatrix::<f64>::zeros(D, D);
    for (x, weight) in points {
        let offset = x - middle;
        for (i, j) in (0..D).flat_map(|i| (0..D).map(move |j| (i, j))) {
            moments[(i, j)] += offset[i] * offset[j] * weight / area;
        }
    }
    let principal = moments.symmetric_eigen();
    for (moment, axis) in principal.eigenvalues.iter().zip(principal.eigenvectors.column_iter()) {
        let side = 2.0 * (3.0 * moment.max(0.0)).sqrt();
        if side > FLAT * size {
            let more = 1.0 / side - 1.0 / size;
            plain += SMatrix::from_fn(|i, j| more * axis[i] * axis[j]);
        }
    }
    plain
}

/// Sides below this part of the size of a facet are none: its points lie on a line or a plane.
const FLAT: f64 = 1e-3;

/// A length to measure distances of points in one dimension by.
fn cells_scale<const D: usize>(cells: &BoundaryCells<D>) -> f64 {
    let ends = cells.points.positions.iter().map(|x| x.amax());
    1e-6 * ends.fold(f64::MIN_POSITIVE, f64::max)
}

/// The facets of two bodies that lie on each other, by their numbers.
pub(crate) fn shared<const D: usize>(cells: [&BoundaryCells<D>; 2]) -> [Vec<usize>; 2] {
    let facets = cells.map(Facets::of);
    // What lies in the box of the other body, with the margin of a facet.
    let near: [Vec<usize>; 2] = std::array::from_fn(|side| {
        let (own, other) = (&facets[side], &facets[1 - side]);
        let margin = own.longest.max(other.longest);
        let Bounds { low, high } = Bounds::of(&other.middles);
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

impl<'a, const D: usize> Face<'a, D> {
    pub(crate) fn new(
        discrete_body: &'a DiscreteBody<D>,
        boundary: &BoundaryCells<D>,
        chosen: &[usize],
        kinematics: &dyn Kinematics<D>,
    ) -> Result<Self, Error> {
        let cells = boundary.facets(&|number, _| chosen.binary_search(&number).is_ok());
        let has_hoops = !kinematics.hoop_components().is_empty();
        let mut weights = Vec::with_capacity(cells.traces.len());
        for (x, weight) in cells.points.positions.iter().zip(&cells.points.weights) {
            weights.push(weight * crate::kinematics::measure(kinematics, has_hoops, x)?);
        }
        let (particles, _) = facet_neighbours(&cells);
        Ok(Face { discrete_body, cells, weights, particles })
    }

    /// A side of equations over facets here or of the other face.
    pub(crate) fn side<'b>(&'b self, boundary: &'b BoundaryCells<D>, sign: f64) -> InterfaceSide<'b, D> {
        let DiscreteBody { approximation, nodes, .. } = self.discrete_body;
        InterfaceSide { approximation: &**approximation, boundary, first_node: nodes.start, sign }
    }

    /// Where a particle of this side lies.
    pub(crate) fn position(&self, particle: u32) -> Point<D> {
        self.discrete_body.cells.positions()[particle as usize]
    }

    /// Measure and first moments of the facets about a point, lengths over `size`.
    pub(crate) fn moments(&self, centre: &Point<D>, size: f64) -> Vec<f64> {
        let mut sums = vec![0.0; D + 1];
        for (x, weight) in self.cells.points.positions.iter().zip(&self.weights) {
            sums.iter_mut().zip(linear(x, centre, size)).for_each(|(sum, q)| *sum += weight * q);
        }
        sums
    }
}

/// $(1, (X - X_0)/L)$.
pub(crate) fn linear<const D: usize>(x: &Point<D>, centre: &Point<D>, size: f64) -> impl Iterator<Item = f64> {
    let offset = (x - centre) / size;
    std::iter::once(1.0).chain((0..D).map(move |i| offset[i]))
}

/// Values of trace functions: for each point (particle, value).
pub(crate) type Traces = Vec<Vec<(u32, f64)>>;

/// The trace functions of one side at points of the other one: extrapolated from the points of the facet that a point lies on, and
/// corrected so that they have the measure and the first moments that they have on their own side.
///
/// Sums of the trace functions stay one, whatever the rules: a constant multiplier pushes both sides as their own rules do, and the patch
/// test passes across interfaces that do not match.
pub(crate) fn carried<const D: usize>(mortar: &Face<'_, D>, other: &Face<'_, D>) -> Traces {
    let facets = Facets::of(&mortar.cells);
    let all: Vec<usize> = (0..facets.middles.len()).collect();
    let fits: Vec<Fit<D>> = all.iter().map(|&k| Fit::new(mortar, &facets, k)).collect();
    let mut carried: Traces = Vec::with_capacity(other.weights.len());
    for x in &other.cells.points.positions {
        let mut values: Vec<(u32, f64)> = Vec::new();
        if let Some(facet) = facets.nearest(&all, x) {
            let range = mortar.cells.points.groups[facet]..mortar.cells.points.groups[facet + 1];
            for (point, part) in range.zip(fits[facet].parts(x)) {
                for &(particle, trace) in &mortar.cells.traces[point] {
                    match values.iter_mut().find(|entry| entry.0 == particle) {
                        Some(entry) => entry.1 += part * trace,
                        None => values.push((particle, part * trace)),
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
    fn new(face: &Face<'_, D>, facets: &Facets<D>, facet: usize) -> Self {
        let range = face.cells.points.groups[facet]..face.cells.points.groups[facet + 1];
        let (middle, normal, size) = (facets.middles[facet], facets.normals[facet], facets.sizes[facet]);
        let mut tangents: Vec<Point<D>> = Vec::new();
        // The first along the points, which stand along the sides of bricks.
        let along =
            range.clone().skip(1).map(|k| face.cells.points.positions[k] - face.cells.points.positions[range.start]);
        for candidate in along.chain((0..D).map(unit)) {
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
            range.clone().map(|k| fit.functions(&face.cells.points.positions[k], range.len())).collect();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Block, Part, Side};

    /// All facets of two equal faces lie on the other one, whatever their shapes.
    #[test]
    fn facets_of_any_shape_lie_on_each_other() {
        let face = |counts: [usize; 3], low: f64, side: Side| {
            let lattice = Block::new([0.0, 0.0, low], [8.0, 4.0, low + 1.0]).lattice(counts).unwrap();
            lattice.boundary(&Part::Face { axis: 2, side }, 1, 2).unwrap()
        };
        for counts in [[3, 5, 2], [2, 9, 2], [5, 3, 2]] {
            for other in [[17, 9, 2], [5, 17, 2], [33, 33, 2], [3, 5, 2]] {
                let lower = face(counts, 0.0, Side::Max);
                let upper = face(other, 1.0, Side::Min);
                let found = shared([&lower, &upper]).map(|facets| facets.len());
                let all = [&lower, &upper].map(|cells| cells.points.groups.len() - 1);
                assert_eq!(found, all, "{counts:?} {other:?}");
            }
        }
    }
}
