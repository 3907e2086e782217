//! The mean gap between two triangles that face each other, over the part of one that the other covers, with its derivatives.

use nalgebra::{SMatrix, SVector};

use crate::each::{Each, list_of};
use crate::geometry::{Mat3, Vec3};

use super::jet::Jet;

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
    origin: Vec3,
    /// Gradients of the two coordinates.
    dual: [Vec3; 2],
    /// The outward normal.
    pub normal: Vec3,
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

/// A place in coordinates of the first triangle, with its derivatives over some variables: `N = 0` for values alone.
type Place<const N: usize, const M: usize = N> = [Jet<N, M>; 2];

fn cross<const N: usize, const M: usize>(a: &Place<N, M>, b: &Place<N, M>) -> Jet<N, M> {
    a[0] * b[1] - a[1] * b[0]
}

/// Twice the area of a polygon that runs counter-clockwise.
fn twice_area(polygon: &[[f64; 2]]) -> f64 {
    let next = |k: usize| polygon[(k + 1) % polygon.len()];
    polygon.iter().enumerate().map(|(k, at)| at[0] * next(k)[1] - at[1] * next(k)[0]).sum()
}

/// How far inside a side of the first triangle a place lies, in barycentric coordinates.
fn inside<const N: usize, const M: usize>(side: usize, at: &Place<N, M>) -> Jet<N, M> {
    match side {
        0 => at[1],
        1 => Jet::constant(1.0) - at[0] - at[1],
        _ => at[0],
    }
}

/// Where an edge crosses a side.
fn crossing<const N: usize, const M: usize>([from, to]: [&Place<N, M>; 2], side: usize) -> Place<N, M> {
    let [before, behind] = [from, to].map(|end| inside(side, end));
    let part = before * (before - behind).reciprocal();
    [0, 1].map(|i| from[i] + (to[i] - from[i]) * part)
}

fn constant<const N: usize, const M: usize>(at: &[f64; 2]) -> Place<N, M> {
    at.map(Jet::constant)
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

/// For each corner of the first triangle the integrals of its linear function times 1, x and y.
fn weighted<const N: usize, const M: usize>(moments: &[Jet<N, M>; 6]) -> [[Jet<N, M>; 3]; 3] {
    let [one, x, y, xx, xy, yy] = *moments;
    [[one - x - y, x - xx - xy, y - xy - yy], [x, xx, xy], [y, xy, yy]]
}

/// The linear functions of the corners at places, as factors of 1, x and y.
fn linear<const N: usize, const M: usize>(places: &[Place<N, M>; 3]) -> [[Jet<N, M>; 3]; 3] {
    let [p, q, r] = places;
    let inverse = cross(&[q[0] - p[0], q[1] - p[1]], &[r[0] - p[0], r[1] - p[1]]).reciprocal();
    let of =
        |a: &Place<N, M>, b: &Place<N, M>| [cross(a, b) * inverse, (a[1] - b[1]) * inverse, (b[0] - a[0]) * inverse];
    let (first, second) = (of(q, r), of(r, p));
    // They sum to one.
    let third = [0, 1, 2].map(|m| Jet::constant(if m == 0 { 1.0 } else { 0.0 }) - first[m] - second[m]);
    [first, second, third]
}

impl Overlap {
    /// What a triangle with corners at `places` covers of the first one.
    pub(crate) fn new(places: &[[f64; 2]; 3]) -> Option<Self> {
        if (0..3).any(|side| places.iter().all(|place| inside::<0, 0>(side, &constant(place)).value < -SAME)) {
            return None;
        }
        let order = if twice_area(places) > 0.0 { [0, 1, 2] } else { [0, 2, 1] };
        let vertex = |k: usize| Vertex {
            at: places[order[k]],
            corner: Corner::Opposite(order[k]),
            edge: Edge::Opposite([order[k], order[(k + 1) % 3]]),
        };
        let mut vertices = list_of(3, vertex);
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
        twice_area(&self.vertices.mapped(|vertex| vertex.at))
    }

    /// Whether another part of the same triangle lies over this one by more than a part of the triangle.
    pub(crate) fn lies_over(&self, other: &Overlap, more: f64) -> bool {
        let mut polygon: Vec<[f64; 2]> = self.vertices.mapped(|vertex| vertex.at);
        for (k, vertex) in other.vertices.iter().enumerate() {
            let (from, to) = (vertex.at, other.vertices[(k + 1) % other.vertices.len()].at);
            let left = |at: [f64; 2]| (to[0] - from[0]) * (at[1] - from[1]) - (to[1] - from[1]) * (at[0] - from[0]);
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
            if kept.len() < 3 {
                return false;
            }
            polygon = kept;
        }
        twice_area(&polygon) > more
    }

    /// $\int 1, x, y, x^2, xy, y^2$.
    fn moments<const N: usize, const M: usize>(&self, places: &[Place<N, M>; 3]) -> [Jet<N, M>; 6] {
        let place = |vertex: &Vertex| match vertex.corner {
            Corner::Own => constant(&vertex.at),
            Corner::Opposite(k) => places[k],
            Corner::Crossing(ends, side) => crossing(ends.map(|k| &places[k]), side),
        };
        let corners = self.vertices.mapped(place);
        let mut found = [Jet::constant(0.0); 6];
        for (k, a) in corners.iter().enumerate() {
            let b = &corners[(k + 1) % corners.len()];
            let (turn, x, y) = (cross(a, b), a[0] + b[0], a[1] + b[1]);
            found[0] = found[0] + turn * 0.5;
            found[1] = found[1] + turn * x * (1.0 / 6.0);
            found[2] = found[2] + turn * y * (1.0 / 6.0);
            found[3] = found[3] + turn * (x * x - a[0] * b[0]) * (1.0 / 12.0);
            found[4] = found[4] + turn * (x * y + a[0] * a[1] + b[0] * b[1]) * (1.0 / 24.0);
            found[5] = found[5] + turn * (y * y - a[1] * b[1]) * (1.0 / 12.0);
        }
        found
    }

    /// The integrals of the linear functions of the corners of the first triangle times 1, x and y, and times those of the corners of the
    /// other one.
    fn integrals<const N: usize, const M: usize>(&self, places: &[Place<N, M>; 3]) -> [[[Jet<N, M>; 3]; 3]; 2] {
        let (near, linear) = (weighted(&self.moments(places)), linear(places));
        [near, near.each_ref().map(|near| linear.each_ref().map(|linear| product(linear, near)))]
    }
}

fn product<const N: usize, const M: usize>(a: &[Jet<N, M>; 3], b: &[Jet<N, M>; 3]) -> Jet<N, M> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Cuts off what lies outside of a side of the first triangle. What lies on the side stays as it is, and moves with the other triangle.
fn cut(vertices: &[Vertex], side: usize, places: &[[f64; 2]; 3]) -> Vec<Vertex> {
    let depth = vertices.mapped(|vertex| inside::<0, 0>(side, &constant(&vertex.at)).value);
    let mut kept = Vec::with_capacity(vertices.len() + 1);
    for (k, vertex) in vertices.iter().enumerate() {
        let (here, there) = (depth[k], depth[(k + 1) % vertices.len()]);
        let crossed = |edge: Edge| match vertex.edge {
            Edge::Own(other) => Vertex { at: between(side, other), corner: Corner::Own, edge },
            Edge::Opposite(ends) => {
                let corner = Corner::Crossing(ends, side);
                let [from, to] = ends.map(|k| constant::<0, 0>(&places[k]));
                Vertex { at: crossing([&from, &to], side).map(|jet| jet.value), corner, edge }
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
    pub(crate) fn new([a, b, c]: &[Vec3; 3], sign: f64, measure: f64) -> Self {
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
    pub(crate) fn over(&self, other: &[Vec3; 3]) -> Over {
        let away = other.each_ref().map(|y| y - self.origin);
        Over {
            places: away.each_ref().map(|away| self.dual.each_ref().map(|dual| dual.dot(away))),
            gaps: away.each_ref().map(|away| self.normal.dot(away)),
        }
    }

    /// The mean gaps under the corners of this triangle over an overlap.
    pub(crate) fn mean_gaps(&self, overlap: &Overlap, over: &Over) -> MeanGaps {
        let [near, far] = overlap.integrals::<0, 0>(&over.places.each_ref().map(constant));
        let mut found = MeanGaps { values: [0.0; 3], areas: [0.0; 3], shares: [[0.0; 6]; 3] };
        for a in 0..3 {
            let [one, x, y] = near[a].map(|integral| integral.value * self.density);
            let far = far[a].map(|integral| integral.value * self.density);
            found.areas[a] = one;
            found.values[a] = far[0] * over.gaps[0] + far[1] * over.gaps[1] + far[2] * over.gaps[2];
            found.shares[a] = [one - x - y, x, y, far[0], far[1], far[2]];
        }
        found
    }

    /// Gradients of the mean gaps.
    pub(crate) fn slopes(&self, overlap: &Overlap, over: &Over) -> GapSlopes {
        let [near, far] = overlap.integrals::<PLACES, 0>(&over.variables());
        let motions = self.motions(over);
        let all = |foot: &SVector<f64, FOOT>| self.all_corners(&motions.tr_mul(foot));
        let area = |a: usize| all(&SVector::from_fn(|i, _| if i < PLACES { near[a][0].slope[i] } else { 0.0 }));
        let gap = |a: usize| all(&over.foot(&far[a]));
        GapSlopes { gaps: [gap(0), gap(1), gap(2)], areas: [area(0), area(1), area(2)] }
    }

    /// A gradient over relative coordinates as one over the coordinates of all corners, times density: what the first corner does is the
    /// opposite of what the others do.
    fn all_corners(&self, relative: &SVector<f64, RELATIVE>) -> SVector<f64, LOCAL> {
        let mut all = SVector::<f64, LOCAL>::zeros();
        for i in 0..RELATIVE {
            all[3 + i] = relative[i] * self.density;
            all[i % 3] -= relative[i] * self.density;
        }
        all
    }

    /// Second derivatives of a sum of the mean gaps with factors, over the coordinates of all corners.
    pub(crate) fn curve(&self, overlap: &Overlap, over: &Over, factors: [f64; 3]) -> SMatrix<f64, LOCAL, LOCAL> {
        let places = over.variables::<PLACES>();
        let (near, linear) = (weighted(&overlap.moments(&places)), linear(&places));
        let near = [0, 1, 2].map(|m| near[0][m] * factors[0] + near[1][m] * factors[1] + near[2][m] * factors[2]);
        let far = linear.each_ref().map(|linear| product(linear, &near));
        let (foot, mut local) = (over.foot(&far), SMatrix::<f64, FOOT, FOOT>::zeros());
        for (k, (far, gap)) in far.iter().zip(over.gaps).enumerate() {
            for q in 0..PLACES {
                local[(q, PLACES + k)] = far.slope[q];
                local[(PLACES + k, q)] = far.slope[q];
                (0..PLACES).for_each(|p| local[(p, q)] += far.curve[(p, q)] * gap);
            }
        }
        let motions = self.motions(over);
        let relative = motions.tr_mul(&(local * motions)) + self.bent(over, &foot);
        let mut all = SMatrix::<f64, LOCAL, LOCAL>::zeros();
        for j in 0..RELATIVE {
            let column = self.all_corners(&relative.column(j).into_owned());
            for i in 0..LOCAL {
                all[(i, 3 + j)] = column[i];
                all[(i, j % 3)] -= column[i];
            }
        }
        all
    }

    /// What the edges of this triangle and the corners of the other one, from the first corner, move places and then gaps by.
    fn motions(&self, over: &Over) -> SMatrix<f64, FOOT, RELATIVE> {
        let (metric, mut found) = (self.metric(), SMatrix::zeros());
        for k in 0..3 {
            let ([x, y], gap) = (over.places[k], over.gaps[k]);
            for (c, along) in [self.dual[0], self.dual[1], self.normal].iter().enumerate() {
                let turned = if c < 2 { metric[c].map(|part| part * gap) } else { [0.0; 2] };
                let row = if c < 2 { 2 * k + c } else { PLACES + k };
                for i in 0..3 {
                    found[(row, i)] = self.normal[i] * turned[0] - along[i] * x;
                    found[(row, 3 + i)] = self.normal[i] * turned[1] - along[i] * y;
                    found[(row, 6 + 3 * k + i)] = along[i];
                }
            }
        }
        found
    }

    /// Products of the gradients of the coordinates.
    fn metric(&self) -> [[f64; 2]; 2] {
        self.dual.map(|a| self.dual.map(|b| a.dot(&b)))
    }

    /// What second derivatives over relative coordinates have because places and gaps are no linear functions of these, for a gradient over
    /// places and gaps.
    fn bent(&self, over: &Over, foot: &SVector<f64, FOOT>) -> SMatrix<f64, RELATIVE, RELATIVE> {
        let mut found = SMatrix::<f64, RELATIVE, RELATIVE>::zeros();
        let mut add = |first: usize, second: usize, block: &Mat3| {
            for i in 0..3 {
                for j in 0..3 {
                    found[(3 * first + i, 3 * second + j)] += block[(i, j)];
                    found[(3 * second + j, 3 * first + i)] += block[(i, j)];
                }
            }
        };
        let ([x, y], metric, normal) = (self.dual, self.metric(), self.normal);
        // The force on each corner of the other triangle.
        let forces = [0, 1, 2].map(|k| x * foot[2 * k] + y * foot[2 * k + 1] + normal * foot[PLACES + k]);
        let (mut force, mut pushed) = (Vec3::zeros(), 0.0);
        for k in 0..3 {
            force += forces[k] * over.gaps[k];
            pushed += foot[PLACES + k] * over.gaps[k];
        }
        for edge in 0..2 {
            let (mut between, mut lever) = ([Mat3::zeros(); 2], 0.0);
            for k in 0..3 {
                let turned = foot[2 * k] * metric[0][edge] + foot[2 * k + 1] * metric[1][edge];
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
}

impl Over {
    /// Its places as variables.
    fn variables<const M: usize>(&self) -> [Place<PLACES, M>; 3] {
        let variable = |k: usize, i: usize| Jet::variable(self.places[k][i], 2 * k + i);
        [0, 1, 2].map(|k| [variable(k, 0), variable(k, 1)])
    }

    /// The gradient over places and then gaps of the sum of the gaps with functions of places as factors.
    fn foot<const M: usize>(&self, far: &[Jet<PLACES, M>; 3]) -> SVector<f64, FOOT> {
        let mut slope = SVector::zeros();
        for (k, (far, gap)) in far.iter().zip(self.gaps).enumerate() {
            slope[PLACES + k] = far.value;
            (0..PLACES).for_each(|q| slope[q] += far.slope[q] * gap);
        }
        slope
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::assert_derivatives;
    use super::*;
    use approx::{abs_diff_eq, assert_abs_diff_eq};

    /// A triangle, another one over it, and what that covers.
    fn triangles(q: &[f64; LOCAL]) -> (Base, Over, Overlap) {
        let point = |k: usize| Vec3::new(q[3 * k], q[3 * k + 1], q[3 * k + 2]);
        let [own, other]: [[Vec3; 3]; 2] = [0, 3].map(|first| std::array::from_fn(|k| point(first + k)));
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
                let (mut force, mut moment) = (Vec3::zeros(), Vec3::zeros());
                for (k, x) in q.chunks_exact(3).enumerate() {
                    let part: Vec3 = slope.fixed_rows::<3>(3 * k).into();
                    force += part;
                    moment += Vec3::from_column_slice(x).cross(&part);
                }
                assert_abs_diff_eq!(force, Vec3::zeros(), epsilon = 1e-14);
                assert_abs_diff_eq!(moment, Vec3::zeros(), epsilon = 1e-14);
            }
        }
    }

    /// A triangle that is cut into three others has the same integrals over one as over all, wherever their common corner lies, on
    /// the edges of the first triangle too.
    #[test]
    fn parts_sum_to_the_whole() {
        let corners = [[-0.5, -0.3], [1.4, -0.2], [0.3, 1.7]];
        let of = |places: [[f64; 2]; 3]| {
            let height = |at: [f64; 2]| Vec3::new(at[0], at[1], 0.3 + 0.2 * at[0] - 0.1 * at[1]);
            let own = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|at: [f64; 2]| Vec3::new(at[0], at[1], 0.0));
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
