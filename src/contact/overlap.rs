//! The mean gap between two triangles that face each other, over the part of one that the other covers, with its derivatives.

use nalgebra::{Matrix3, SMatrix, SVector};

use crate::geometry::Point;

/// Coordinates of the corners of two triangles.
pub(super) const LOCAL: usize = 18;
/// Coordinates of all corners but the first one, from that one.
const RELATIVE: usize = 15;
/// Places of the corners of the other triangle in coordinates of the first one.
const PLACES: usize = 6;
/// Those and the gaps there.
const FOOT: usize = 9;
/// Distances in barycentric coordinates that are none: a corner as near to a line lies on it for the triangles on both of its sides.
const SAME: f64 = 1e-9;
/// Inward gradients of the barycentric coordinates that vanish on the sides of the first triangle.
const INWARD: [[f64; 2]; 3] = [[0.0, 1.0], [-1.0, -1.0], [1.0, 0.0]];

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

/// A triangle with its coordinates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Base {
    origin: Point<3>,
    /// Gradients of the two coordinates.
    dual: [Point<3>; 2],
    /// The outward normal.
    pub normal: Point<3>,
    /// Twice the reference measure.
    density: f64,
}

/// Another triangle over it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Over {
    /// Where its corners are opposite, in coordinates of the first one.
    pub places: [[f64; 2]; 3],
    pub gaps: [f64; 3],
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

/// Gradients of those.
#[derive(Debug, Clone)]
pub(super) struct GapSlopes {
    pub gaps: [SVector<f64, LOCAL>; 3],
    pub areas: [SVector<f64, LOCAL>; 3],
}

/// Integrals over an overlap for each corner of the first triangle, with its linear function $\lambda_a$ as a factor.
struct Integrals {
    /// Of 1, x and y: gradients over the places.
    slopes: [[[f64; PLACES]; 3]; 3],
    /// Of the linear functions of the corners of the other triangle.
    shares: [[f64; 3]; 3],
    /// Those functions, as factors of 1, x and y.
    linear: [[f64; 3]; 3],
    /// The gap, as factors of 1, x and y.
    gap: [f64; 3],
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// How far inside a side of the first triangle a place lies, in barycentric coordinates.
fn inside(side: usize, at: [f64; 2]) -> f64 {
    match side {
        0 => at[1],
        1 => 1.0 - at[0] - at[1],
        _ => at[0],
    }
}

/// Where an edge crosses a side, as a part of the edge.
fn crossing_part(ends: [[f64; 2]; 2], side: usize) -> f64 {
    let [before, behind] = ends.map(|end| inside(side, end));
    before / (before - behind)
}

/// Where an edge crosses a side.
fn crossing(ends: [[f64; 2]; 2], side: usize) -> [f64; 2] {
    let ([from, to], part) = (ends, crossing_part(ends, side));
    [0, 1].map(|i| from[i] + (to[i] - from[i]) * part)
}

/// What a change of the ends of an edge moves the place by where it crosses a side, times what it moves that point of the edge by.
fn along_side([from, to]: [[f64; 2]; 2], side: usize) -> [[f64; 2]; 2] {
    let drop = inside(side, from) - inside(side, to);
    let along = [to[0] - from[0], to[1] - from[1]].map(|along| along / drop);
    let of = |i: usize, j: usize| f64::from(u8::from(i == j)) + along[i] * INWARD[side][j];
    [[of(0, 0), of(0, 1)], [of(1, 0), of(1, 1)]]
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

/// What an edge from a to b adds to $\int 1, x, y, x^2, xy, y^2$ over a polygon that runs counter-clockwise, over $a\times b$.
fn edge_moments(a: [f64; 2], b: [f64; 2]) -> [f64; 6] {
    let sum = [a[0] + b[0], a[1] + b[1]];
    [
        0.5,
        sum[0] / 6.0,
        sum[1] / 6.0,
        (sum[0] * sum[0] - a[0] * b[0]) / 12.0,
        (sum[0] * sum[1] + a[0] * a[1] + b[0] * b[1]) / 24.0,
        (sum[1] * sum[1] - a[1] * b[1]) / 12.0,
    ]
}

/// Gradients of those over a and b.
fn edge_slopes(a: [f64; 2], b: [f64; 2]) -> [[f64; 4]; 6] {
    let [ax, ay] = [0, 1].map(|i| 2.0 * a[i] + b[i]);
    let [bx, by] = [0, 1].map(|i| a[i] + 2.0 * b[i]);
    [
        [0.0; 4],
        [1.0 / 6.0, 0.0, 1.0 / 6.0, 0.0],
        [0.0, 1.0 / 6.0, 0.0, 1.0 / 6.0],
        [ax / 12.0, 0.0, bx / 12.0, 0.0],
        [ay / 24.0, ax / 24.0, by / 24.0, bx / 24.0],
        [0.0, ay / 12.0, 0.0, by / 12.0],
    ]
}

/// Gradient of $a\times b$ over a and b.
fn cross_slope(a: [f64; 2], b: [f64; 2]) -> [f64; 4] {
    [b[1], -b[0], -a[1], a[0]]
}

/// For each corner of the first triangle the integrals of its linear function times 1, x and y.
fn weighted(moments: &[f64; 6]) -> [[f64; 3]; 3] {
    let [one, x, y, xx, xy, yy] = *moments;
    [[one - x - y, x - xx - xy, y - xy - yy], [x, xx, xy], [y, xy, yy]]
}

/// The linear functions of the corners at places, as factors of 1, x and y.
fn linear(places: &[[f64; 2]; 3]) -> [[f64; 3]; 3] {
    let [p, q, r] = *places;
    let inverse = 1.0 / cross([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
    let of = |a: [f64; 2], b: [f64; 2]| [cross(a, b) * inverse, (a[1] - b[1]) * inverse, (b[0] - a[0]) * inverse];
    let (first, second) = (of(q, r), of(r, p));
    // They sum to one.
    let third = [1.0 - first[0] - second[0], -first[1] - second[1], -first[2] - second[2]];
    [first, second, third]
}

fn product(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl Overlap {
    /// What a triangle with corners at `places` covers of the first one.
    pub(crate) fn new(places: &[[f64; 2]; 3]) -> Option<Self> {
        if (0..3).any(|side| places.iter().all(|place| inside(side, *place) < -SAME)) {
            return None;
        }
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

    /// The corners at both ends of each edge.
    fn edges(&self) -> impl Iterator<Item = [&Vertex; 2]> {
        let behind = self.vertices.iter().skip(1).chain(&self.vertices[..1]);
        self.vertices.iter().zip(behind).map(|(from, to)| [from, to])
    }

    /// Its part of the first triangle.
    pub(crate) fn area(&self) -> f64 {
        self.edges().map(|[from, to]| cross(from.at, to.at)).sum()
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

    /// $\int 1, x, y, x^2, xy, y^2$.
    fn moments(&self) -> [f64; 6] {
        let mut found = [0.0; 6];
        for [from, to] in self.edges() {
            let turn = cross(from.at, to.at);
            found.iter_mut().zip(edge_moments(from.at, to.at)).for_each(|(moment, part)| *moment += turn * part);
        }
        found
    }

    /// Gradients of the coordinates of its corners over the places.
    fn corner_slopes(&self, places: &[[f64; 2]; 3]) -> Vec<[[f64; PLACES]; 2]> {
        let of = |vertex: &Vertex| {
            let mut slope = [[0.0; PLACES]; 2];
            match vertex.corner {
                Corner::Own => {}
                Corner::Opposite(k) => (0..2).for_each(|i| slope[i][2 * k + i] = 1.0),
                Corner::Crossing(ends, side) => {
                    let at = ends.map(|k| places[k]);
                    let (part, along) = (crossing_part(at, side), along_side(at, side));
                    for (k, part) in ends.into_iter().zip([1.0 - part, part]) {
                        for i in 0..2 {
                            (0..2).for_each(|j| slope[i][2 * k + j] = part * along[i][j]);
                        }
                    }
                }
            }
            slope
        };
        self.vertices.iter().map(of).collect()
    }

    /// Gradients of the moments over the places.
    fn moment_slopes(&self, corners: &[[[f64; PLACES]; 2]]) -> [[f64; PLACES]; 6] {
        let mut found = [[0.0; PLACES]; 6];
        for (k, [from, to]) in self.edges().enumerate() {
            let (a, b) = (from.at, to.at);
            let (turn, by_turn) = (cross(a, b), cross_slope(a, b));
            let (parts, slopes) = (edge_moments(a, b), edge_slopes(a, b));
            let ends = [&corners[k], &corners[(k + 1) % corners.len()]];
            for m in 0..6 {
                for v in 0..4 {
                    let by = by_turn[v] * parts[m] + turn * slopes[m][v];
                    let along = &ends[v / 2][v % 2];
                    (0..PLACES).for_each(|q| found[m][q] += by * along[q]);
                }
            }
        }
        found
    }

    /// Second derivatives over the places of the integral of a polynomial, given by factors of the moments, that does not change.
    fn curve(
        &self,
        factors: &[f64; 6],
        places: &[[f64; 2]; 3],
        corners: &[[[f64; PLACES]; 2]],
    ) -> [[f64; PLACES]; PLACES] {
        let mut found = [[0.0; PLACES]; PLACES];
        let mut forces = vec![[0.0; 2]; corners.len()];
        let [.., xx, xy, yy] = *factors;
        let (xx, xy, yy) = (xx / 12.0, xy / 24.0, yy / 12.0);
        let bent = [
            [2.0 * xx, 2.0 * xy, xx, xy],
            [2.0 * xy, 2.0 * yy, xy, yy],
            [xx, xy, 2.0 * xx, 2.0 * xy],
            [xy, yy, 2.0 * xy, 2.0 * yy],
        ];
        for (k, [from, to]) in self.edges().enumerate() {
            let (a, b, next) = (from.at, to.at, (k + 1) % corners.len());
            let (turn, by_turn) = (cross(a, b), cross_slope(a, b));
            let sum = factors.iter().zip(edge_moments(a, b)).map(|(factor, part)| factor * part).sum::<f64>();
            let (mut by_sum, slopes) = ([0.0; 4], edge_slopes(a, b));
            for v in 0..4 {
                by_sum[v] = (0..6).map(|m| factors[m] * slopes[m][v]).sum();
                forces[if v < 2 { k } else { next }][v % 2] += by_turn[v] * sum + turn * by_sum[v];
            }
            let along = [&corners[k][0], &corners[k][1], &corners[next][0], &corners[next][1]];
            for v in 0..4 {
                let mut row = [0.0; 4];
                for w in 0..4 {
                    row[w] = by_turn[v] * by_sum[w] + by_sum[v] * by_turn[w] + turn * bent[v][w];
                }
                // The second derivatives of the cross product.
                row[3 - v] += if v == 0 || v == 3 { sum } else { -sum };
                let mut half = [0.0; PLACES];
                for w in 0..4 {
                    (0..PLACES).for_each(|q| half[q] += row[w] * along[w][q]);
                }
                for p in 0..PLACES {
                    (0..PLACES).for_each(|q| found[p][q] += along[v][p] * half[q]);
                }
            }
        }
        for (vertex, force) in self.vertices.iter().zip(&forces) {
            if let Corner::Crossing(ends, side) = vertex.corner {
                add_turning(force, ends, side, places, &mut found);
            }
        }
        found
    }
}

/// Adds the second derivatives of the place where an edge of the other triangle crosses a side, along a force.
fn add_turning(
    force: &[f64; 2],
    ends: [usize; 2],
    side: usize,
    places: &[[f64; 2]; 3],
    curve: &mut [[f64; PLACES]; PLACES],
) {
    let at = ends.map(|k| places[k]);
    let (part, along) = (crossing_part(at, side), along_side(at, side));
    let drop = inside(side, at[0]) - inside(side, at[1]);
    // How the part of the edge changes, and what a change of the edge's direction does along the side.
    let (mut shift, mut turned) = ([0.0; PLACES], [0.0; PLACES]);
    for (k, part, sign) in [(ends[0], 1.0 - part, -1.0), (ends[1], part, 1.0)] {
        for j in 0..2 {
            shift[2 * k + j] = part * INWARD[side][j] / drop;
            turned[2 * k + j] = sign * (force[0] * along[0][j] + force[1] * along[1][j]);
        }
    }
    for p in 0..PLACES {
        (0..PLACES).for_each(|q| curve[p][q] += shift[p] * turned[q] + turned[p] * shift[q]);
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

impl Base {
    /// A triangle with its reference measure, and 1 where its corners run counter-clockwise seen from outside, -1 otherwise.
    pub(crate) fn new([a, b, c]: &[Point<3>; 3], sign: f64, measure: f64) -> Self {
        let (first, second) = (b - a, c - a);
        let across = first.cross(&second);
        let square = across.norm_squared();
        Base {
            origin: *a,
            dual: [second.cross(&across) / square, across.cross(&first) / square],
            normal: across * (sign / square.sqrt().max(f64::MIN_POSITIVE)),
            density: 2.0 * measure,
        }
    }

    /// Another triangle over this one.
    pub(crate) fn over(&self, other: &[Point<3>; 3]) -> Over {
        let away = other.each_ref().map(|y| y - self.origin);
        Over {
            places: away.each_ref().map(|away| self.dual.each_ref().map(|dual| dual.dot(away))),
            gaps: away.each_ref().map(|away| self.normal.dot(away)),
        }
    }

    /// The mean gaps under the corners of this triangle over an overlap.
    pub(crate) fn mean_gaps(&self, overlap: &Overlap, over: &Over) -> MeanGaps {
        let (weighted, linear) = (weighted(&overlap.moments()), linear(&over.places));
        let mut found = MeanGaps { values: [0.0; 3], areas: [0.0; 3], shares: [[0.0; 6]; 3] };
        for a in 0..3 {
            let [one, x, y] = weighted[a].map(|w| w * self.density);
            let far = linear.map(|linear| product(linear, [one, x, y]));
            found.areas[a] = one;
            found.values[a] = product(far, over.gaps);
            found.shares[a] = [one - x - y, x, y, far[0], far[1], far[2]];
        }
        found
    }

    fn integrals(&self, overlap: &Overlap, over: &Over, corners: &[[[f64; PLACES]; 2]]) -> Integrals {
        let (weighted_now, linear) = (weighted(&overlap.moments()), linear(&over.places));
        let (moments, mut slopes) = (overlap.moment_slopes(corners), [[[0.0; PLACES]; 3]; 3]);
        for q in 0..PLACES {
            let by = weighted(&moments.map(|slope| slope[q]));
            for a in 0..3 {
                (0..3).for_each(|m| slopes[a][m][q] = by[a][m]);
            }
        }
        Integrals {
            slopes,
            shares: weighted_now.map(|of| linear.map(|linear| product(linear, of))),
            linear,
            gap: [0, 1, 2].map(|m| product(over.gaps, linear.map(|linear| linear[m]))),
        }
    }

    /// Gradients of the mean gaps.
    pub(crate) fn slopes(&self, overlap: &Overlap, over: &Over) -> GapSlopes {
        let all = self.integrals(overlap, over, &overlap.corner_slopes(&over.places));
        let gap = |a: usize| {
            let by_place = all.by_place(&all.slopes[a], &all.shares[a]);
            self.pulled_back(over, &by_place, &all.shares[a])
        };
        let area = |a: usize| self.pulled_back(over, &all.slopes[a][0], &[0.0; 3]);
        GapSlopes { gaps: [gap(0), gap(1), gap(2)], areas: [area(0), area(1), area(2)] }
    }

    /// The force on each corner of the other triangle of a function of places and gaps.
    fn forces(&self, by_place: &[f64; PLACES], by_gap: &[f64; 3]) -> [Point<3>; 3] {
        let [x, y] = self.dual;
        [0, 1, 2].map(|k| x * by_place[2 * k] + y * by_place[2 * k + 1] + self.normal * by_gap[k])
    }

    /// Products of the gradients of the coordinates.
    fn metric(&self) -> [[f64; 2]; 2] {
        self.dual.map(|a| self.dual.map(|b| a.dot(&b)))
    }

    /// A gradient over places and gaps as one over the coordinates of all corners, times density.
    fn pulled_back(&self, over: &Over, by_place: &[f64; PLACES], by_gap: &[f64; 3]) -> SVector<f64, LOCAL> {
        let (forces, metric) = (self.forces(by_place, by_gap), self.metric());
        let edge = |side: usize| {
            let mut force = Point::<3>::zeros();
            for k in 0..3 {
                let turned = by_place[2 * k] * metric[0][side] + by_place[2 * k + 1] * metric[1][side];
                force += self.normal * (over.gaps[k] * turned) - forces[k] * over.places[k][side];
            }
            force
        };
        let (first, second) = (edge(0), edge(1));
        let origin = -(first + second + forces[0] + forces[1] + forces[2]);
        let all = [origin, first, second, forces[0], forces[1], forces[2]];
        SVector::from_fn(|i, _| all[i / 3][i % 3] * self.density)
    }

    /// Second derivatives of a sum of the mean gaps with factors, over the coordinates of all corners.
    pub(crate) fn curve(&self, overlap: &Overlap, over: &Over, factors: [f64; 3]) -> SMatrix<f64, LOCAL, LOCAL> {
        let corners = overlap.corner_slopes(&over.places);
        let all = self.integrals(overlap, over, &corners);
        let sum = |of: [f64; 3]| product(factors, of);
        let mut slopes = [[0.0; PLACES]; 3];
        for m in 0..3 {
            (0..PLACES).for_each(|q| slopes[m][q] = sum(all.slopes.map(|of| of[m][q])));
        }
        let shares = [0, 1, 2].map(|k| sum(all.shares.map(|of| of[k])));
        // The integrand: a linear function times the gap.
        let ([one, x, y], gap) = ([factors[0], factors[1] - factors[0], factors[2] - factors[0]], all.gap);
        let integrand = [
            one * gap[0],
            one * gap[1] + x * gap[0],
            one * gap[2] + y * gap[0],
            x * gap[1],
            x * gap[2] + y * gap[1],
            y * gap[2],
        ];
        let polygon = overlap.curve(&integrand, &over.places, &corners);
        let local = all.curve(&polygon, &slopes, &shares);
        let by_place = all.by_place(&slopes, &shares);
        self.whole(&self.relative(over, &local, &by_place, &shares))
    }

    /// What the edges of this triangle and the corners of the other one, from the first corner, move places and gaps by.
    fn motions(&self, over: &Over) -> [[f64; RELATIVE]; FOOT] {
        let (metric, mut found) = (self.metric(), [[0.0; RELATIVE]; FOOT]);
        for k in 0..3 {
            let ([x, y], gap) = (over.places[k], over.gaps[k]);
            for (c, along) in [self.dual[0], self.dual[1], self.normal].iter().enumerate() {
                let turned = if c < 2 { metric[c].map(|part| part * gap) } else { [0.0; 2] };
                let row = &mut found[3 * k + c];
                for i in 0..3 {
                    row[i] = self.normal[i] * turned[0] - along[i] * x;
                    row[3 + i] = self.normal[i] * turned[1] - along[i] * y;
                    row[6 + 3 * k + i] = along[i];
                }
            }
        }
        found
    }

    /// Second derivatives over places and gaps as those over relative coordinates: places and gaps are no linear functions of these.
    fn relative(
        &self,
        over: &Over,
        local: &[[f64; FOOT]; FOOT],
        by_place: &[f64; PLACES],
        by_gap: &[f64; 3],
    ) -> [[f64; RELATIVE]; RELATIVE] {
        let (motions, mut found) = (self.motions(over), [[0.0; RELATIVE]; RELATIVE]);
        for p in 0..FOOT {
            let mut half = [0.0; RELATIVE];
            for q in 0..FOOT {
                (0..RELATIVE).for_each(|j| half[j] += local[p][q] * motions[q][j]);
            }
            for i in 0..RELATIVE {
                (0..RELATIVE).for_each(|j| found[i][j] += motions[p][i] * half[j]);
            }
        }
        let mut add = |first: usize, second: usize, block: &Matrix3<f64>| {
            for i in 0..3 {
                for j in 0..3 {
                    found[3 * first + i][3 * second + j] += block[(i, j)];
                    found[3 * second + j][3 * first + i] += block[(i, j)];
                }
            }
        };
        let (forces, metric, normal) = (self.forces(by_place, by_gap), self.metric(), self.normal);
        let (mut force, mut pushed) = (Point::<3>::zeros(), 0.0);
        for k in 0..3 {
            force += forces[k] * over.gaps[k];
            pushed += by_gap[k] * over.gaps[k];
        }
        for edge in 0..2 {
            let (mut between, mut lever) = ([Matrix3::zeros(); 2], 0.0);
            for k in 0..3 {
                let turned = by_place[2 * k] * metric[0][edge] + by_place[2 * k + 1] * metric[1][edge];
                let mixed = normal * normal.transpose() * turned - self.dual[edge] * forces[k].transpose();
                add(2 + k, edge, &mixed);
                (0..2).for_each(|other| between[other] -= mixed * over.places[k][other]);
                lever += turned * over.gaps[k];
            }
            for other in 0..2 {
                let pull = (force - normal * (0.5 * pushed)) * metric[other][edge] + self.dual[other] * lever;
                add(other, edge, &(between[other] - normal * pull.transpose()));
            }
        }
        found
    }

    /// Second derivatives over relative coordinates as those over all, times density: what the first corner does is the opposite of
    /// what the others do.
    fn whole(&self, relative: &[[f64; RELATIVE]; RELATIVE]) -> SMatrix<f64, LOCAL, LOCAL> {
        let mut all = SMatrix::<f64, LOCAL, LOCAL>::zeros();
        for i in 0..RELATIVE {
            for j in 0..RELATIVE {
                let value = relative[i][j] * self.density;
                all[(3 + i, 3 + j)] = value;
                all[(i % 3, 3 + j)] -= value;
                all[(3 + i, j % 3)] -= value;
                all[(i % 3, j % 3)] += value;
            }
        }
        all
    }
}

impl Integrals {
    /// The gradient over the places of the integral of the gap times a function, given the gradients of the integrals of that function times
    /// 1, x and y and those with the linear functions of the other triangle.
    fn by_place(&self, slopes: &[[f64; PLACES]; 3], shares: &[f64; 3]) -> [f64; PLACES] {
        let mut found = [0.0; PLACES];
        for q in 0..PLACES {
            let fixed = product(self.gap, [slopes[0][q], slopes[1][q], slopes[2][q]]);
            // Where the corner goes the gap was another one.
            found[q] = fixed - shares[q / 2] * self.gap[1 + q % 2];
        }
        found
    }

    /// Its second derivatives over places and gaps, place by place with its gap; `polygon` are those with the gap as it is.
    fn curve(
        &self,
        polygon: &[[f64; PLACES]; PLACES],
        slopes: &[[f64; PLACES]; 3],
        shares: &[f64; 3],
    ) -> [[f64; FOOT]; FOOT] {
        let mut found = [[0.0; FOOT]; FOOT];
        let place = |q: usize| 3 * (q / 2) + q % 2;
        let mut fixed = [[0.0; 3]; PLACES];
        for q in 0..PLACES {
            fixed[q] = self.linear.map(|linear| product(linear, [slopes[0][q], slopes[1][q], slopes[2][q]]));
        }
        for p in 0..PLACES {
            let (i, c) = (p / 2, 1 + p % 2);
            for q in 0..PLACES {
                let (j, d) = (q / 2, 1 + q % 2);
                found[place(p)][place(q)] = polygon[p][q]
                    + (shares[i] * self.linear[j][c] - fixed[p][j]) * self.gap[d]
                    + (shares[j] * self.linear[i][d] - fixed[q][i]) * self.gap[c];
            }
            for k in 0..3 {
                let mixed = fixed[p][k] - shares[i] * self.linear[k][c];
                found[place(p)][3 * k + 2] = mixed;
                found[3 * k + 2][place(p)] = mixed;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::super::jet::assert_derivatives;
    use super::*;
    use approx::{abs_diff_eq, assert_abs_diff_eq};

    /// A triangle, another one over it, and what that covers.
    fn triangles(q: &[f64; LOCAL]) -> (Base, Over, Overlap) {
        let point = |k: usize| Point::<3>::new(q[3 * k], q[3 * k + 1], q[3 * k + 2]);
        let [own, other]: [[Point<3>; 3]; 2] = [0, 3].map(|first| std::array::from_fn(|k| point(first + k)));
        let base = Base::new(&own, -1.0, 0.7);
        let over = base.over(&other);
        (base, over, Overlap::new(&over.places).unwrap())
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
                    let (base, over, overlap) = triangles(q);
                    let factors = std::array::from_fn(|k| f64::from(u8::from(k == corner)));
                    let value = base.mean_gaps(&overlap, &over).values[corner];
                    let slope = base.slopes(&overlap, &over).gaps[corner];
                    (value, slope, base.curve(&overlap, &over, factors))
                };
                assert_derivatives(at, &q);
                let area = |q: &[f64; LOCAL]| {
                    let (base, over, overlap) = triangles(q);
                    base.mean_gaps(&overlap, &over).areas[corner]
                };
                let (base, over, overlap) = triangles(&q);
                let slope = base.slopes(&overlap, &over).areas[corner];
                for k in 0..LOCAL {
                    let (mut up, mut down) = (q, q);
                    up[k] += 1e-5;
                    down[k] -= 1e-5;
                    assert!(abs_diff_eq!((area(&up) - area(&down)) / 2e-5, slope[k], epsilon = 1e-8), "{k}");
                }
            }
        }
    }

    /// Forces along the gradient have neither a sum nor a moment.
    #[test]
    fn forces_and_moments_balance() {
        for q in all() {
            let (base, over, overlap) = triangles(&q);
            let found = base.slopes(&overlap, &over);
            for slope in found.gaps.iter().chain(&found.areas) {
                let (mut force, mut moment) = (Point::<3>::zeros(), Point::<3>::zeros());
                for (k, x) in q.chunks_exact(3).enumerate() {
                    let part: Point<3> = slope.fixed_rows::<3>(3 * k).into();
                    force += part;
                    moment += Point::<3>::from_column_slice(x).cross(&part);
                }
                assert_abs_diff_eq!(force, Point::<3>::zeros(), epsilon = 1e-14);
                assert_abs_diff_eq!(moment, Point::<3>::zeros(), epsilon = 1e-14);
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
            let base = Base::new(&own, 1.0, 0.5);
            let over = base.over(&places.map(height));
            let Some(overlap) = Overlap::new(&over.places) else { return ([0.0; 3], [0.0; 3]) };
            let found = base.mean_gaps(&overlap, &over);
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
                assert!(
                    abs_diff_eq!(value[a], values[a], epsilon = 1e-9)
                        && abs_diff_eq!(area[a], areas[a], epsilon = 1e-9),
                    "{common:?}"
                );
            }
        }
    }
}
