//! Triangles of the boundary in space, and the gap of a point over one of them.

use nalgebra::{SMatrix, SVector};

use crate::geometry::Point;

use super::facing::{BEHIND, FACING};
use super::jet::Jet;

/// Coordinates of a point and of three corners.
pub(super) const LOCAL: usize = 12;

/// How far beyond its edges a triangle still takes points, as a part of it: between two that meet at a convex edge there is a wedge.
const BEYOND: f64 = 0.02;
/// Bins around a point that are searched.
const REACH: usize = 8;

/// A triangle of a boundary part: a half of a facet of three corners, a quarter of one of four.
pub(super) struct Triangle {
    /// For each corner the trace functions whose mean it is.
    pub corners: [Vec<u32>; 3],
    /// 1 where the corners run counter-clockwise seen from outside, -1 otherwise.
    pub sign: f64,
    /// The facet that it is a part of.
    pub facet: u32,
}

/// The gap of a point over a triangle, with its derivatives.
pub(super) struct Gap {
    pub value: f64,
    pub slope: SVector<f64, LOCAL>,
    pub curve: SMatrix<f64, LOCAL, LOCAL>,
}

impl Gap {
    /// The normal of the triangle, towards the point.
    pub fn normal(&self) -> Point<3> {
        self.slope.fixed_rows::<3>(0).into()
    }

    /// What point and corners move the place of contact by.
    pub fn shares(&self) -> [f64; 4] {
        let normal = self.normal();
        std::array::from_fn(|k| self.slope.fixed_rows::<3>(3 * k).dot(&normal).abs())
    }
}

/// The distance of a point from the plane of a triangle.
pub(super) fn gap(point: &Point<3>, ends: &[Point<3>; 3], sign: f64) -> Gap {
    let of =
        |x: &Point<3>, first: usize| -> [Jet<LOCAL>; 3] { std::array::from_fn(|i| Jet::variable(x[i], first + i)) };
    let x = of(point, 0);
    let corners: [[Jet<LOCAL>; 3]; 3] = std::array::from_fn(|k| of(&ends[k], 3 + 3 * k));
    let minus = |a: &[Jet<LOCAL>; 3], b: &[Jet<LOCAL>; 3]| -> [Jet<LOCAL>; 3] { std::array::from_fn(|i| a[i] - b[i]) };
    let cross = |a: &[Jet<LOCAL>; 3], b: &[Jet<LOCAL>; 3]| -> [Jet<LOCAL>; 3] {
        std::array::from_fn(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
    };
    let dot = |a: &[Jet<LOCAL>; 3], b: &[Jet<LOCAL>; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let (first, second, away) =
        (minus(&corners[1], &corners[0]), minus(&corners[2], &corners[0]), minus(&x, &corners[0]));
    let across = cross(&first, &second);
    let found = dot(&across, &away) * (dot(&across, &across).root().reciprocal() * sign);
    Gap { value: found.value, slope: found.slope, curve: found.curve }
}

/// Triangles at a state, sorted into bins.
pub(super) struct Sorted {
    low: Point<3>,
    size: f64,
    bins: std::collections::HashMap<[i32; 3], Vec<u32>>,
    corners: Vec<[Point<3>; 3]>,
    normals: Vec<Point<3>>,
}

impl Sorted {
    /// Triangles with their corners now.
    pub fn new(triangles: &[Triangle], corners: Vec<[Point<3>; 3]>) -> Self {
        let mut low = Point::<3>::repeat(f64::INFINITY);
        let mut total = 0.0;
        for triangle in &corners {
            for (k, x) in triangle.iter().enumerate() {
                low = low.zip_map(x, f64::min);
                total += (triangle[(k + 1) % 3] - x).norm();
            }
        }
        let size = total / (3 * corners.len()).max(1) as f64;
        let size = if size > 0.0 && size.is_finite() { size } else { f64::INFINITY };
        let mut sorted =
            Sorted { low, size, bins: std::collections::HashMap::new(), corners: Vec::new(), normals: Vec::new() };
        for (k, (x, triangle)) in corners.iter().zip(triangles).enumerate() {
            let normal = (x[1] - x[0]).cross(&(x[2] - x[0])) * triangle.sign;
            sorted.normals.push(normal / normal.norm().max(f64::MIN_POSITIVE));
            let (from, to) = (x[0].zip_map(&x[1], f64::min), x[0].zip_map(&x[1], f64::max));
            let (from, to) = (sorted.bin(&from.zip_map(&x[2], f64::min)), sorted.bin(&to.zip_map(&x[2], f64::max)));
            for i in from[0]..=to[0] {
                for j in from[1]..=to[1] {
                    for l in from[2]..=to[2] {
                        sorted.bins.entry([i, j, l]).or_default().push(k as u32);
                    }
                }
            }
        }
        sorted.corners = corners;
        sorted
    }

    /// How far from a point triangles are found.
    pub fn reach(&self) -> f64 {
        (REACH - 1) as f64 * self.size
    }

    fn bin(&self, x: &Point<3>) -> [i32; 3] {
        std::array::from_fn(|i| ((x[i] - self.low[i]) / self.size).floor().clamp(-1e6, 1e6) as i32)
    }

    /// The triangle over which a point with an outward normal has the smallest gap, among those that may.
    pub fn nearest(
        &self,
        x: &Point<3>,
        outward: &Point<3>,
        deeper: f64,
        may: impl Fn(usize, f64) -> bool,
    ) -> Option<usize> {
        let middle = self.bin(x);
        let mut best: Option<(f64, usize)> = None;
        for ring in 0..=REACH as i32 {
            if best.is_some_and(|(least, _)| least < (ring as f64 - 1.0) * self.size) {
                break;
            }
            for i in -ring..=ring {
                for j in -ring..=ring {
                    let whole = i.abs() == ring || j.abs() == ring;
                    let step = if whole || ring == 0 { 1 } else { 2 * ring as usize };
                    for l in (-ring..=ring).step_by(step) {
                        let bin = [middle[0] + i, middle[1] + j, middle[2] + l];
                        for &k in self.bins.get(&bin).into_iter().flatten() {
                            let k = k as usize;
                            let Some(gap) = self.over(k, x, outward, deeper) else { continue };
                            if best.is_none_or(|(least, _)| gap.abs() < least) && may(k, gap) {
                                best = Some((gap.abs(), k));
                            }
                        }
                    }
                }
            }
        }
        best.map(|(_, k)| k)
    }

    /// The distance of a point over a triangle that it is opposite to.
    fn over(&self, k: usize, x: &Point<3>, outward: &Point<3>, deeper: f64) -> Option<f64> {
        let ([a, b, c], normal) = (&self.corners[k], &self.normals[k]);
        if outward.dot(normal) > FACING {
            return None;
        }
        let (first, second, away) = (b - a, c - a, x - a);
        let across = first.cross(&second);
        let square = across.norm_squared();
        let eta = away.cross(&second).dot(&across) / square;
        let zeta = first.cross(&away).dot(&across) / square;
        let inside = eta.min(zeta).min(1.0 - eta - zeta) >= -BEYOND;
        let gap = away.dot(normal);
        let size = first.norm().max(second.norm());
        (inside && gap >= -BEHIND * size - deeper).then_some(gap)
    }
}

#[cfg(test)]
mod tests {
    use super::super::jet::assert_derivatives;
    use super::*;

    /// Gradient and Hessian are those of differences.
    #[test]
    fn derivatives() {
        let at = |q: &[f64; LOCAL]| {
            let point = |k: usize| Point::<3>::new(q[3 * k], q[3 * k + 1], q[3 * k + 2]);
            let gap = gap(&point(0), &[point(1), point(2), point(3)], -1.0);
            (gap.value, gap.slope, gap.curve)
        };
        let q: [f64; LOCAL] = [0.3, 0.2, 0.4, 0.0, 0.1, 0.0, 1.0, 0.0, 0.2, 0.1, 1.1, -0.1];
        assert_derivatives(at, &q);
    }
}
