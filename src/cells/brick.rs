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

/// Position and derivative columns $\partial X/\partial\xi_i$ of the multilinear map of $2^D$ corners.
pub(crate) fn multilinear<const D: usize>(corners: &[Point<D>; 8], at: &Point<D>) -> (Point<D>, [Point<D>; D]) {
    let mut position = Point::zeros();
    let mut columns = [Point::zeros(); D];
    for (corner, x) in corners.iter().enumerate().take(1 << D) {
        let factor = |i: usize| if (corner >> i) & 1 == 1 { at[i] } else { 1.0 - at[i] };
        let weight: f64 = (0..D).map(factor).product();
        position += x * weight;
        for (k, column) in columns.iter_mut().enumerate() {
            let sign = if (corner >> k) & 1 == 1 { 1.0 } else { -1.0 };
            let slope: f64 = (0..D).filter(|&i| i != k).map(factor).product();
            *column += x * (sign * slope);
        }
    }
    (position, columns)
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
        match self {
            Shape::Straight(corners) => multilinear(corners, at),
            Shape::Curved(nodes) => multiquadratic(nodes, at),
        }
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

/// Position and derivative columns of the map by tensor products of parabolas through $3^D$ nodes, axis 0 running fastest.
fn multiquadratic<const D: usize>(nodes: &[Point<D>; 27], at: &Point<D>) -> (Point<D>, [Point<D>; D]) {
    let parabolas = |t: f64| [(1.0 - t) * (1.0 - 2.0 * t), 4.0 * t * (1.0 - t), t * (2.0 * t - 1.0)];
    let slopes = |t: f64| [4.0 * t - 3.0, 4.0 - 8.0 * t, 4.0 * t - 1.0];
    let (values, derivatives): ([_; D], [_; D]) = (array_of(|i| parabolas(at[i])), array_of(|i| slopes(at[i])));
    let mut position = Point::zeros();
    let mut columns = [Point::zeros(); D];
    for (node, x) in nodes.iter().enumerate().take(3usize.pow(D as u32)) {
        let place = unravel(node, &[3; D]);
        position += x * (0..D).map(|i| values[i][place[i]]).product::<f64>();
        for (k, column) in columns.iter_mut().enumerate() {
            let factor = |i: usize| if i == k { derivatives[i][place[i]] } else { values[i][place[i]] };
            *column += x * (0..D).map(factor).product::<f64>();
        }
    }
    (position, columns)
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
