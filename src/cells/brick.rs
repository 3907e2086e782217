//! Numbers and maps of bricks.

use crate::each::{array_of, point_of};
use crate::geometry::Point;

/// The multi-index of a linear index, axis 0 running fastest.
#[inline]
pub(crate) fn unravel<const D: usize>(mut linear: usize, counts: &[usize; D]) -> [usize; D] {
    array_of(|i| {
        let index = linear % counts[i];
        linear /= counts[i];
        index
    })
}

/// The linear index of a multi-index, axis 0 running fastest.
#[inline]
pub(crate) fn ravel<const D: usize>(index: &[usize; D], counts: &[usize; D]) -> usize {
    (0..D).rev().fold(0, |linear, i| linear * counts[i] + index[i])
}

/// Value and slopes at a point of the unit cube of the polynomial that is 1 at node `k`, counted along axis 0 first, and 0 at the others:
/// of order 1 with $2^D$ nodes, of order 2 with $3^D$.
pub(crate) fn lagrange<const D: usize>(order: usize, k: usize, at: &Point<D>) -> (f64, Point<D>) {
    let place = unravel(k, &[order + 1; D]);
    let factors: [(f64, f64); D] = array_of(|i| {
        let t = at[i];
        match (order, place[i]) {
            (1, 0) => (1.0 - t, -1.0),
            (1, _) => (t, 1.0),
            (_, 0) => ((1.0 - t) * (1.0 - 2.0 * t), 4.0 * t - 3.0),
            (_, 1) => (4.0 * t * (1.0 - t), 4.0 - 8.0 * t),
            _ => (t * (2.0 * t - 1.0), 4.0 * t - 1.0),
        }
    });
    let value = factors.iter().map(|factor| factor.0).product();
    let slope = |j: usize| (0..D).map(|i| if i == j { factors[i].1 } else { factors[i].0 }).product();
    (value, point_of(slope))
}

/// Position and derivative columns $\partial X/\partial\xi_i$ of the map by [`lagrange`]'s polynomials of its nodes.
pub(crate) fn interpolated<const D: usize>(
    order: usize,
    nodes: impl Iterator<Item = Point<D>>,
    at: &Point<D>,
) -> (Point<D>, [Point<D>; D]) {
    let mut position = Point::zeros();
    let mut columns = [Point::zeros(); D];
    for (k, x) in nodes.enumerate() {
        let (value, slopes) = lagrange(order, k, at);
        position += x * value;
        for (column, slope) in columns.iter_mut().zip(slopes.iter()) {
            *column += x * *slope;
        }
    }
    (position, columns)
}

/// The same of the multilinear map of $2^D$ corners.
pub(crate) fn multilinear<const D: usize>(corners: &[Point<D>; 8], at: &Point<D>) -> (Point<D>, [Point<D>; D]) {
    interpolated(1, corners.iter().copied().take(1 << D), at)
}

/// A cell: a multilinear image of the unit cube, or one by parabolas. Corners and nodes run along axis 0 fastest, unused ones
/// are zero.
pub(crate) enum Shape<const D: usize> {
    /// $2^D$ corners.
    Straight([Point<D>; 8]),
    /// $3^D$ nodes.
    Curved([Point<D>; 27]),
}

impl<const D: usize> Shape<D> {
    /// Position and derivative columns $\partial X/\partial\xi_i$ at local coordinates between 0 and 1.
    pub(crate) fn map(&self, at: &Point<D>) -> (Point<D>, [Point<D>; D]) {
        let order = if matches!(self, Shape::Straight(_)) { 1 } else { 2 };
        interpolated(order, self.nodes().iter().copied(), at)
    }

    /// Whether its opposite sides are parallel, to rounding.
    pub(crate) fn is_parallelepiped(&self) -> bool {
        let Shape::Straight(corners) = self else { return false };
        let edges: [Point<D>; D] = std::array::from_fn(|i| corners[1 << i] - corners[0]);
        let rounding = 1e-12 * corners[..1 << D].iter().fold(0.0, |most: f64, x| most.max(x.amax()));
        (0..1 << D).all(|corner: usize| {
            let sum: Point<D> = (0..D).filter(|i| corner >> i & 1 == 1).map(|i| edges[i]).sum();
            (corners[corner] - corners[0] - sum).amax() <= rounding
        })
    }

    /// The points that it lies between.
    pub(crate) fn nodes(&self) -> &[Point<D>] {
        match self {
            Shape::Straight(corners) => &corners[..1 << D],
            Shape::Curved(nodes) => &nodes[..3usize.pow(D as u32)],
        }
    }
}

/// The determinant of `D` column vectors, `D` ≤ 3.
pub(crate) fn determinant<const D: usize>(columns: &[Point<D>; D]) -> f64 {
    match D {
        1 => columns[0][0],
        2 => columns[0][0] * columns[1][1] - columns[0][1] * columns[1][0],
        _ => {
            let (a, b, c) = (&columns[0], &columns[1], &columns[2]);
            a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        }
    }
}

/// Where a map takes to a point, by Newton's method and Cramer's rule; one step does for maps that are linear, a few for others.
pub(super) fn inverse<const D: usize>(
    at: &Point<D>,
    mut local: Point<D>,
    map: &dyn Fn(&Point<D>) -> (Point<D>, [Point<D>; D]),
) -> Point<D> {
    for _ in 0..20 {
        let (x, columns) = map(&local);
        let total = determinant(&columns);
        let step = point_of::<D>(|i| {
            let mut replaced = columns;
            replaced[i] = at - x;
            determinant(&replaced) / total
        });
        local += step;
        if step.norm() < 1e-12 {
            break;
        }
    }
    local
}

/// $n\\,\mathrm dA$ of the facet normal to lattice axis `axis`: the cofactor column of the map.
pub(crate) fn area_vector<const D: usize>(axis: usize, columns: &[Point<D>; D]) -> Point<D> {
    point_of(|i| {
        let mut replaced = *columns;
        replaced[axis] = Point::zeros();
        replaced[axis][i] = 1.0;
        determinant(&replaced)
    })
}
