//! The mean gap between two triangles that face each other, over the part of one that the other covers, with its derivatives.

use std::ops::{Add, Mul, Sub};

use nalgebra::{SMatrix, SVector};

use crate::geometry::Point;

use super::jet::Jet;

/// Coordinates of the corners of two triangles.
pub(super) const LOCAL: usize = 18;
/// Coordinates of all corners but the first one, from that one.
const RELATIVE: usize = 15;
/// Coordinates that the place of a corner of the other triangle depends on: the edges of the first one, and its own.
const PLACE: usize = 9;
/// Distances in barycentric coordinates that are none: a corner as near to a line lies on it for the triangles on both of its sides.
const SAME: f64 = 1e-9;

/// A corner of the part of the first triangle that the other one covers.
#[derive(Debug, Clone, Copy)]
enum Corner {
    /// A corner of the first triangle, which does not move in its coordinates.
    Own,
    /// A corner of the other one.
    Opposite(usize),
    /// Where an edge of the other one between two of its corners crosses a side of the first.
    Crossing([usize; 2], usize),
}

/// What an edge of the part lies on.
#[derive(Debug, Clone, Copy)]
enum Edge {
    /// A side of the first triangle.
    Own(usize),
    /// An edge of the other one between two of its corners.
    Opposite([usize; 2]),
}

/// A corner with its coordinates, and the edge to the next one.
#[derive(Debug, Clone, Copy)]
struct Vertex {
    at: [f64; 2],
    corner: Corner,
    edge: Edge,
}

/// The part of a triangle that another one covers: a convex polygon in coordinates of the first one, from its first corner along the
/// edges to its second and its third one.
#[derive(Debug, Clone)]
pub(super) struct Overlap {
    vertices: Vec<Vertex>,
}

/// Two triangles at a state.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triangles {
    pub own: [Point<3>; 3],
    pub other: [Point<3>; 3],
    /// 1 where the corners of the first one run counter-clockwise seen from outside, -1 otherwise.
    pub sign: f64,
    /// Reference measure of the first one.
    pub measure: f64,
}

/// $G_a = \int\lambda_a\\,g\\,\mathrm d\Gamma$ over an overlap for the linear functions $\lambda_a$ of the corners of the first triangle.
#[derive(Debug, Clone)]
pub(super) struct MeanGaps {
    pub values: [f64; 3],
    /// $\int\lambda_a\,\mathrm d\Gamma$.
    pub areas: [f64; 3],
    /// $\int\lambda_a\lambda_k\,\mathrm d\Gamma$ of the six corners: what they move it by.
    pub shares: [[f64; 6]; 3],
}

/// Derivatives of those, of the first and second order.
#[derive(Debug, Clone)]
pub(super) struct GapDerivatives {
    pub slopes: [SVector<f64, LOCAL>; 3],
    pub curves: [SMatrix<f64, LOCAL, LOCAL>; 3],
    /// Gradients of the areas.
    pub area_slopes: [SVector<f64, LOCAL>; 3],
}

/// Numbers and functions alike.
trait Scalar: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self> {
    fn constant(value: f64) -> Self;
    fn inverse(self) -> Self;
}

impl Scalar for f64 {
    fn constant(value: f64) -> Self {
        value
    }

    fn inverse(self) -> Self {
        self.recip()
    }
}

impl<const N: usize> Scalar for Jet<N> {
    fn constant(value: f64) -> Self {
        Jet::constant(value)
    }

    fn inverse(self) -> Self {
        self.reciprocal()
    }
}

fn cross<T: Scalar>(a: [T; 2], b: [T; 2]) -> T {
    a[0] * b[1] - a[1] * b[0]
}

/// How far inside a side of the first triangle a place lies, in barycentric coordinates.
fn inside<T: Scalar>(side: usize, at: [T; 2]) -> T {
    match side {
        0 => at[1],
        1 => T::constant(1.0) - at[0] - at[1],
        _ => at[0],
    }
}

/// Where an edge crosses a side.
fn crossing<T: Scalar>(ends: [[T; 2]; 2], side: usize) -> [T; 2] {
    let [from, to] = ends;
    let [before, behind] = ends.map(|end| inside(side, end));
    let part = before * (before - behind).inverse();
    [0, 1].map(|i| from[i] + (to[i] - from[i]) * part)
}

/// The corner of the first triangle between two of its sides.
fn between(first: usize, second: usize) -> [f64; 2] {
    match first + second {
        // Sides 0 and 1, then 1 and 2.
        1 => [1.0, 0.0],
        3 => [0.0, 1.0],
        _ => [0.0, 0.0],
    }
}

/// $\int 1, x, y, x^2, xy, y^2$ over a polygon that runs counter-clockwise.
fn moments<T: Scalar>(polygon: &[[T; 2]]) -> [T; 6] {
    let mut found = [T::constant(0.0); 6];
    for (k, &a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        let turn = cross(a, b);
        let sum = [a[0] + b[0], a[1] + b[1]];
        let parts = [
            T::constant(0.5),
            sum[0] * (1.0 / 6.0),
            sum[1] * (1.0 / 6.0),
            (sum[0] * sum[0] - a[0] * b[0]) * (1.0 / 12.0),
            (sum[0] * sum[1] + a[0] * a[1] + b[0] * b[1]) * (1.0 / 24.0),
            (sum[1] * sum[1] - a[1] * b[1]) * (1.0 / 12.0),
        ];
        for (moment, part) in found.iter_mut().zip(parts) {
            *moment = *moment + turn * part;
        }
    }
    found
}

/// For each corner of the first triangle the integrals of its linear function times 1, x and y.
fn weighted<T: Scalar>(moments: &[T; 6]) -> [[T; 3]; 3] {
    let [one, x, y, xx, xy, yy] = *moments;
    [[one - x - y, x - xx - xy, y - xy - yy], [x, xx, xy], [y, xy, yy]]
}

/// For each corner of the first triangle the integrals of its linear function times those of the corners of the other one at `places`.
fn shares<T: Scalar>(weighted: &[[T; 3]; 3], places: &[[T; 2]; 3]) -> [[T; 3]; 3] {
    let [p, q, r] = *places;
    let inverse = cross([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]).inverse();
    let linear = |a: [T; 2], b: [T; 2]| [cross(a, b) * inverse, (a[1] - b[1]) * inverse, (b[0] - a[0]) * inverse];
    let of = [linear(q, r), linear(r, p)];
    std::array::from_fn(|a| {
        let [first, second] = [0, 1].map(|k| {
            let ([one, x, y], [c, by_x, by_y]) = (weighted[a], of[k]);
            one * c + x * by_x + y * by_y
        });
        // They sum to one.
        [first, second, weighted[a][0] - first - second]
    })
}

impl Overlap {
    /// What a triangle with corners at `places` covers of the first one.
    pub(crate) fn new(places: &[[f64; 2]; 3]) -> Option<Self> {
        let [p, q, r] = *places;
        let turn = cross([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
        let order = if turn > 0.0 { [0, 1, 2] } else { [0, 2, 1] };
        let vertex = |k: usize| Vertex {
            at: places[order[k]],
            corner: Corner::Opposite(order[k]),
            edge: Edge::Opposite([order[k], order[(k + 1) % 3]]),
        };
        let mut vertices: Vec<Vertex> = (0..3).map(vertex).collect();
        for side in 0..3 {
            vertices = cut(&vertices, side, places);
            if vertices.len() < 3 {
                return None;
            }
        }
        let overlap = Overlap { vertices };
        (overlap.area() > 0.0).then_some(overlap)
    }

    /// Its part of the first triangle.
    pub(crate) fn area(&self) -> f64 {
        let at = |k: usize| self.vertices[k % self.vertices.len()].at;
        (0..self.vertices.len()).map(|k| cross(at(k), at(k + 1))).sum()
    }

    /// Whether another part of the same triangle lies over this one by more than a part of the triangle.
    pub(crate) fn lies_over(&self, other: &Overlap, more: f64) -> bool {
        let mut polygon: Vec<[f64; 2]> = self.vertices.iter().map(|vertex| vertex.at).collect();
        for (k, vertex) in other.vertices.iter().enumerate() {
            let (from, to) = (vertex.at, other.vertices[(k + 1) % other.vertices.len()].at);
            let left = |at: [f64; 2]| cross([to[0] - from[0], to[1] - from[1]], [at[0] - from[0], at[1] - from[1]]);
            let mut kept = Vec::with_capacity(polygon.len() + 1);
            for (i, &at) in polygon.iter().enumerate() {
                let next = polygon[(i + 1) % polygon.len()];
                let [here, there] = [left(at), left(next)];
                if here >= 0.0 {
                    kept.push(at);
                }
                if here * there < 0.0 {
                    let part = here / (here - there);
                    kept.push([0, 1].map(|i| at[i] + part * (next[i] - at[i])));
                }
            }
            polygon = kept;
        }
        let corners = polygon.len();
        (0..corners).map(|k| cross(polygon[k], polygon[(k + 1) % corners])).sum::<f64>() > more
    }

    /// Its corners where those of the other triangle are at `places`.
    fn corners<T: Scalar>(&self, places: &[[T; 2]; 3]) -> Vec<[T; 2]> {
        let corner = |vertex: &Vertex| match vertex.corner {
            Corner::Own => vertex.at.map(T::constant),
            Corner::Opposite(k) => places[k],
            Corner::Crossing(ends, side) => crossing(ends.map(|k| places[k]), side),
        };
        self.vertices.iter().map(corner).collect()
    }
}

/// Cuts off what lies outside of a side of the first triangle. What lies on the side stays as it is, and moves with the other triangle.
fn cut(vertices: &[Vertex], side: usize, places: &[[f64; 2]; 3]) -> Vec<Vertex> {
    let depth: Vec<f64> = vertices.iter().map(|vertex| inside(side, vertex.at)).collect();
    let mut kept = Vec::with_capacity(vertices.len() + 1);
    for (k, vertex) in vertices.iter().enumerate() {
        let (here, there) = (depth[k], depth[(k + 1) % vertices.len()]);
        let crossed = |edge: Edge| match vertex.edge {
            Edge::Own(other) => Vertex { at: between(side, other), corner: Corner::Own, edge },
            Edge::Opposite(ends) => {
                let corner = Corner::Crossing(ends, side);
                Vertex { at: crossing(ends.map(|k| places[k]), side), corner, edge }
            }
        };
        if here >= -SAME {
            let leaves = there < -SAME;
            let on = here <= SAME;
            kept.push(Vertex { edge: if leaves && on { Edge::Own(side) } else { vertex.edge }, ..*vertex });
            if leaves && !on {
                kept.push(crossed(Edge::Own(side)));
            }
        } else if there > SAME {
            kept.push(crossed(vertex.edge));
        }
    }
    kept
}

/// The normal of a triangle, times twice its area.
fn area_vector<T: Scalar>(first: [T; 3], second: [T; 3]) -> [T; 3] {
    std::array::from_fn(|i| first[(i + 1) % 3] * second[(i + 2) % 3] - first[(i + 2) % 3] * second[(i + 1) % 3])
}

fn dot<T: Scalar>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Triangles {
    /// The outward normal of the first one.
    pub(crate) fn normal(&self) -> Point<3> {
        let [a, b, c] = self.own;
        let across = (b - a).cross(&(c - a)) * self.sign;
        across / across.norm().max(f64::MIN_POSITIVE)
    }

    /// Where the corners of the other one are opposite in coordinates of the first one, and their gaps.
    pub(crate) fn opposite(&self) -> ([[f64; 2]; 3], [f64; 3]) {
        let [a, b, c] = self.own;
        let (first, second, normal) = (b - a, c - a, self.normal());
        let across = first.cross(&second);
        let square = across.norm_squared();
        let place = |y: &Point<3>| {
            let away = y - a;
            [away.cross(&second).dot(&across) / square, first.cross(&away).dot(&across) / square]
        };
        (self.other.each_ref().map(place), self.other.map(|y| normal.dot(&(y - a))))
    }

    /// The mean gaps under the corners of the first triangle over an overlap.
    pub(crate) fn mean_gaps(&self, overlap: &Overlap) -> MeanGaps {
        let (places, gaps) = self.opposite();
        let weighted = weighted(&moments(&overlap.corners(&places)));
        let (opposite, density) = (shares(&weighted, &places), 2.0 * self.measure);
        let mut found = MeanGaps { values: [0.0; 3], areas: [0.0; 3], shares: [[0.0; 6]; 3] };
        for a in 0..3 {
            let [one, x, y] = weighted[a].map(|w| w * density);
            found.areas[a] = one;
            let far = opposite[a].map(|w| w * density);
            found.values[a] = far.iter().zip(&gaps).map(|(w, gap)| w * gap).sum();
            found.shares[a] = [one - x - y, x, y, far[0], far[1], far[2]];
        }
        found
    }

    /// Place and gap of a corner of the other one over coordinates of the edges of the first one and its own.
    fn place(&self, corner: usize) -> [Jet<PLACE>; 3] {
        let of =
            |x: Point<3>, first: usize| -> [Jet<PLACE>; 3] { std::array::from_fn(|i| Jet::variable(x[i], first + i)) };
        let [a, b, c] = self.own;
        let (first, second, away) = (of(b - a, 0), of(c - a, 3), of(self.other[corner] - a, 6));
        let across = area_vector(first, second);
        let square = dot(across, across);
        let inverse = square.reciprocal();
        [
            dot(area_vector(away, second), across) * inverse,
            dot(area_vector(first, away), across) * inverse,
            dot(across, away) * (square.root().reciprocal() * self.sign),
        ]
    }

    /// Derivatives of the mean gaps.
    pub(crate) fn derivatives(&self, overlap: &Overlap) -> GapDerivatives {
        let found: [[Jet<PLACE>; 3]; 3] = std::array::from_fn(|k| self.place(k));
        let places: [[Jet<6>; 2]; 3] =
            std::array::from_fn(|k| std::array::from_fn(|i| Jet::variable(found[k][i].value, 2 * k + i)));
        let weighted = weighted(&moments(&overlap.corners(&places)));
        let shares = shares(&weighted, &places);
        let density = 2.0 * self.measure;
        let spread = |jet: &Jet<PLACE>, k: usize| {
            let mut slope = SVector::<f64, RELATIVE>::zeros();
            (0..PLACE).for_each(|i| slope[along(k, i)] = jet.slope[i]);
            slope
        };
        let mut by_place = SMatrix::<f64, 6, RELATIVE>::zeros();
        for k in 0..3 {
            (0..2).for_each(|i| by_place.set_row(2 * k + i, &spread(&found[k][i], k).transpose()));
        }
        let by_gap: [SVector<f64, RELATIVE>; 3] = std::array::from_fn(|k| spread(&found[k][2], k));
        let of = |a: usize| {
            let (mut slope, mut curve) = (SVector::<f64, 6>::zeros(), SMatrix::<f64, 6, 6>::zeros());
            for (share, [.., gap]) in shares[a].iter().zip(&found) {
                slope += share.slope * gap.value;
                curve += share.curve * gap.value;
            }
            let mut first = by_place.tr_mul(&slope);
            let mut second = by_place.tr_mul(&(curve * by_place));
            for k in 0..3 {
                first += by_gap[k] * shares[a][k].value;
                let mixed = by_gap[k] * by_place.tr_mul(&shares[a][k].slope).transpose();
                second += mixed + mixed.transpose();
                let [x, y, gap] = &found[k];
                let own = gap.curve * shares[a][k].value + x.curve * slope[2 * k] + y.curve * slope[2 * k + 1];
                for i in 0..PLACE {
                    (0..PLACE).for_each(|j| second[(along(k, i), along(k, j))] += own[(i, j)]);
                }
            }
            let area = by_place.tr_mul(&weighted[a][0].slope);
            (whole(&first) * density, whole_square(&second) * density, whole(&area) * density)
        };
        let all = [of(0), of(1), of(2)];
        GapDerivatives {
            slopes: [all[0].0, all[1].0, all[2].0],
            curves: [all[0].1, all[1].1, all[2].1],
            area_slopes: [all[0].2, all[1].2, all[2].2],
        }
    }
}

/// The place among the relative coordinates of one of those that a corner of the other triangle depends on.
fn along(corner: usize, i: usize) -> usize {
    if i < 6 { i } else { 3 * corner + i }
}

/// A gradient over relative coordinates as one over all: what the first corner does is the opposite of what the others do.
fn whole(slope: &SVector<f64, RELATIVE>) -> SVector<f64, LOCAL> {
    let mut all = SVector::<f64, LOCAL>::zeros();
    for i in 0..RELATIVE {
        all[3 + i] = slope[i];
        all[i % 3] -= slope[i];
    }
    all
}

fn whole_square(curve: &SMatrix<f64, RELATIVE, RELATIVE>) -> SMatrix<f64, LOCAL, LOCAL> {
    let mut all = SMatrix::<f64, LOCAL, LOCAL>::zeros();
    for j in 0..RELATIVE {
        let column = whole(&curve.column(j).into_owned());
        for i in 0..LOCAL {
            all[(i, 3 + j)] = column[i];
            all[(i, j % 3)] -= column[i];
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::super::jet::assert_derivatives;
    use super::*;

    fn triangles(q: &[f64; LOCAL]) -> Triangles {
        let point = |k: usize| Point::<3>::new(q[3 * k], q[3 * k + 1], q[3 * k + 2]);
        let [own, other] = [0, 3].map(|first| std::array::from_fn(|k| point(first + k)));
        Triangles { own, other, sign: -1.0, measure: 0.7 }
    }

    fn overlap(triangles: &Triangles) -> Overlap {
        Overlap::new(&triangles.opposite().0).unwrap()
    }

    /// Corners of a triangle, and of others over it: around one corner, within, around all of it, across.
    const OWN: [f64; 9] = [0.0, 0.1, 0.0, 1.0, 0.0, 0.2, 0.1, 1.1, -0.1];
    const OTHERS: [[f64; 9]; 4] = [
        [-0.4, 0.3, 0.4, 0.9, -0.6, 0.3, 0.5, 0.7, 0.2],
        [0.2, 0.3, -0.1, 0.6, 0.2, 0.3, 0.3, 0.6, 0.1],
        [-2.0, -1.0, 0.2, 3.0, -1.2, 0.4, 0.1, 3.0, 0.1],
        [-0.5, 0.2, 0.1, 2.0, 0.3, 0.3, 1.9, 0.6, 0.2],
    ];

    fn all() -> impl Iterator<Item = [f64; LOCAL]> {
        OTHERS.iter().map(|other| std::array::from_fn(|i| if i < 9 { OWN[i] } else { other[i - 9] }))
    }

    /// Gradient and Hessian are those of differences.
    #[test]
    fn derivatives() {
        for q in all() {
            for corner in 0..3 {
                let at = |q: &[f64; LOCAL]| {
                    let triangles = triangles(q);
                    let overlap = overlap(&triangles);
                    let found = triangles.derivatives(&overlap);
                    (triangles.mean_gaps(&overlap).values[corner], found.slopes[corner], found.curves[corner])
                };
                assert_derivatives(at, &q);
                let area = |q: &[f64; LOCAL]| triangles(q).mean_gaps(&overlap(&triangles(q))).areas[corner];
                let slope = triangles(&q).derivatives(&overlap(&triangles(&q))).area_slopes[corner];
                for k in 0..LOCAL {
                    let (mut up, mut down) = (q, q);
                    up[k] += 1e-5;
                    down[k] -= 1e-5;
                    assert!(((area(&up) - area(&down)) / 2e-5 - slope[k]).abs() < 1e-8, "{k}");
                }
            }
        }
    }

    /// Forces along the gradient have neither a sum nor a moment.
    #[test]
    fn forces_and_moments_balance() {
        for q in all() {
            let triangles = triangles(&q);
            let found = triangles.derivatives(&overlap(&triangles));
            for slope in found.slopes.iter().chain(&found.area_slopes) {
                let (mut force, mut moment) = (Point::<3>::zeros(), Point::<3>::zeros());
                for (k, x) in triangles.own.iter().chain(&triangles.other).enumerate() {
                    let part: Point<3> = slope.fixed_rows::<3>(3 * k).into();
                    force += part;
                    moment += x.cross(&part);
                }
                assert!(force.amax() < 1e-14 && moment.amax() < 1e-14, "{force} {moment}");
            }
        }
    }

    /// A triangle that is cut into three others has the same integrals over one as over all, wherever their common corner lies, on
    /// the edges of the first triangle too.
    #[test]
    fn parts_sum_to_the_whole() {
        let corners = [[-0.5, -0.3], [1.4, -0.2], [0.3, 1.7]];
        let of = |places: [[f64; 2]; 3]| {
            let height = |at: [f64; 2]| Point::<3>::new(at[0], at[1], 0.3 + 0.2 * at[0] - 0.1 * at[1]);
            let own = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|at: [f64; 2]| Point::<3>::new(at[0], at[1], 0.0));
            let triangles = Triangles { own, other: places.map(height), sign: 1.0, measure: 0.5 };
            let Some(overlap) = Overlap::new(&triangles.opposite().0) else { return ([0.0; 3], [0.0; 3]) };
            let found = triangles.mean_gaps(&overlap);
            (found.values, found.areas)
        };
        let (values, areas) = of(corners);
        for common in
            [[0.3, 0.4], [0.5, 0.5], [0.0, 0.0], [0.4, 0.0], [0.0, 0.2], [0.4, 1e-12], [0.6, 0.6], [0.4, -1e-10]]
        {
            let (mut value, mut area) = ([0.0; 3], [0.0; 3]);
            for k in 0..3 {
                let part = of([corners[k], corners[(k + 1) % 3], common]);
                for a in 0..3 {
                    value[a] += part.0[a];
                    area[a] += part.1[a];
                }
            }
            for a in 0..3 {
                assert!((value[a] - values[a]).abs() < 1e-9 && (area[a] - areas[a]).abs() < 1e-9, "{common:?}");
            }
        }
    }
}
