//! Triangles of the boundary in space, which of them face each other, and the gap of a point over one of them.

use crate::each::Each;
use crate::geometry::{Bounds, Vec3};

use super::bins::Bins;
use super::facing::BEHIND;
use super::jet::Jet;
use super::overlap::{Base, MeanGaps, Overlap};

/// Coordinates of a point and of three corners.
pub(super) const LOCAL: usize = 12;

/// How far beyond its edges a triangle still takes points, as a part of it: between two that meet at a convex edge there is a wedge.
const BEYOND: f64 = 0.02;
/// Bins around a point that are searched.
const REACH: i32 = 8;
/// Parts of a triangle that are none: rounding of what others cover of it.
const PART: f64 = 1e-6;

/// A triangle of a boundary part: a facet of three corners, a quarter of one of four.
pub(super) struct Triangle {
    /// For each corner the trace functions whose mean it is.
    pub corners: [Vec<u32>; 3],
    /// The movers at its corners.
    pub movers: [u32; 3],
    /// 1 where the corners run counter-clockwise seen from outside, -1 otherwise.
    pub sign: f64,
    /// Reference measure.
    pub measure: f64,
    /// The facet that it is a part of.
    pub facet: u32,
}

/// The distance of a point from the plane of a triangle, over their coordinates.
pub(super) fn gap(point: &Vec3, ends: &[Vec3; 3], sign: f64) -> Jet<LOCAL> {
    let of = |x: &Vec3, first: usize| -> [Jet<LOCAL>; 3] { std::array::from_fn(|i| Jet::variable(x[i], first + i)) };
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
    dot(&across, &away) * (dot(&across, &across).root().reciprocal() * sign)
}

/// What faces a triangle.
#[derive(Clone)]
pub(super) struct Facing {
    pub other: u32,
    pub overlap: Overlap,
    pub gaps: MeanGaps,
}

/// Triangles at a state, sorted into bins.
pub(super) struct Sorted<'a> {
    bins: Bins,
    corners: &'a [[Vec3; 3]],
    normals: Vec<Vec3>,
}

/// Marks of triangles that a search has come across, kept from one search to the next.
#[derive(Default)]
pub(super) struct Seen {
    marks: Vec<u32>,
    search: u32,
}

impl Seen {
    fn begin(&mut self, triangles: usize) {
        self.marks.resize(triangles, 0);
        self.search += 1;
    }

    /// Whether this search comes across a triangle for the first time.
    fn is_new(&mut self, triangle: usize) -> bool {
        std::mem::replace(&mut self.marks[triangle], self.search) != self.search
    }
}

impl<'a> Sorted<'a> {
    /// Triangles with their corners now, of which those from a given one on are looked for.
    pub(crate) fn new(triangles: &[Triangle], corners: &'a [[Vec3; 3]], from: usize) -> Self {
        let edge = |triangles: &[[Vec3; 3]]| {
            let all = triangles.iter().flat_map(|x| (0..3).map(|k| (x[(k + 1) % 3] - x[k]).norm()));
            all.sum::<f64>() / (3 * triangles.len()).max(1) as f64
        };
        let size = edge(&corners[from..]).max(edge(&corners[..from]));
        let normals = corners.iter().zip(triangles).map(|(x, triangle)| {
            let normal = (x[1] - x[0]).cross(&(x[2] - x[0])) * triangle.sign;
            normal / normal.norm().max(f64::MIN_POSITIVE)
        });
        let sought = corners.iter().enumerate().skip(from);
        let boxes: Vec<(u32, Bounds<3>)> = sought.map(|(k, x)| (k as u32, Bounds::of(x))).collect();
        Sorted { normals: normals.collect(), bins: Bins::new(&boxes, size), corners }
    }

    /// How far from a point triangles are found.
    pub(crate) fn reach(&self) -> f64 {
        f64::from(REACH - 1) * self.bins.size
    }

    /// The triangle over which a point with an outward normal has the smallest gap, among those that may.
    pub(crate) fn nearest(
        &self,
        x: &Vec3,
        outward: &Vec3,
        deeper: f64,
        may: impl Fn(usize, f64) -> bool,
    ) -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        for ring in 0..=REACH {
            if best.is_some_and(|(least, _)| least < (f64::from(ring) - 1.0) * self.bins.size) {
                break;
            }
            self.bins.ring(x, ring, |k| {
                let k = k as usize;
                let Some(gap) = self.over(k, x, outward, deeper) else { return };
                if best.is_none_or(|(least, _)| gap.abs() < least) && may(k, gap) {
                    best = Some((gap.abs(), k));
                }
            });
        }
        best.map(|(_, k)| k)
    }

    /// The distance of a point over a triangle that it is opposite to.
    fn over(&self, k: usize, x: &Vec3, outward: &Vec3, deeper: f64) -> Option<f64> {
        let ([a, b, c], normal) = (&self.corners[k], &self.normals[k]);
        if outward.dot(normal) >= 0.0 {
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

    /// What faces a triangle along its normal, among those that may: the nearest where there are several.
    pub(crate) fn facing(
        &self,
        own: usize,
        base: &Base,
        deeper: f64,
        seen: &mut Seen,
        may: impl Fn(usize, f64) -> bool,
    ) -> Vec<Facing> {
        let corners = &self.corners[own];
        let middle = (corners[0] + corners[1] + corners[2]) / 3.0;
        let radius = corners.largest(|x| (x - middle).norm());
        let mut found: Vec<(f64, Facing)> = Vec::new();
        let (mut covered, mut farthest) = (0.0, 0.0f64);
        seen.begin(self.corners.len());
        // From the middle of a large triangle among small ones it is far to what its corners face.
        let last = REACH + (radius / self.bins.size).ceil() as i32;
        for ring in 0..=last {
            if covered >= 1.0 - PART && farthest + radius < (f64::from(ring) - 1.0) * self.bins.size {
                break;
            }
            self.bins.ring(&middle, ring, |other| {
                let other = other as usize;
                if !seen.is_new(other) {
                    return;
                }
                if let Some((gap, facing)) = self.covers(other, own, base, deeper).filter(|(gap, _)| may(other, *gap)) {
                    if !found.iter().any(|(_, nearer)| facing.overlap.lies_over(&nearer.overlap, PART)) {
                        covered += facing.overlap.area();
                    }
                    farthest = farthest.max(gap.abs());
                    found.push((gap.abs(), facing));
                }
            });
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.other.cmp(&b.1.other)));
        let mut kept: Vec<Facing> = Vec::with_capacity(found.len());
        for (_, facing) in found {
            if !kept.iter().any(|nearer| facing.overlap.lies_over(&nearer.overlap, PART)) {
                kept.push(facing);
            }
        }
        kept
    }

    /// What a triangle covers of another one that it faces, with its mean gap there.
    fn covers(&self, other: usize, own: usize, base: &Base, deeper: f64) -> Option<(f64, Facing)> {
        if self.normals[own].dot(&self.normals[other]) >= 0.0 {
            return None;
        }
        let facing = covered(base, &self.corners[other], other as u32)?;
        let gap = facing.gaps.values.iter().sum::<f64>() / facing.gaps.areas.iter().sum::<f64>();
        let size = [own, other].map(|k| {
            let [a, b, c] = &self.corners[k];
            (b - a).norm().max((c - a).norm())
        });
        (gap >= -BEHIND * size[0].max(size[1]) - deeper).then_some((gap, facing))
    }
}

/// What a triangle of a number covers of another one, if anything.
pub(super) fn covered(base: &Base, corners: &[Vec3; 3], other: u32) -> Option<Facing> {
    let over = base.over(corners);
    let overlap = Overlap::new(&over.places)?;
    let gaps = base.mean_gaps(&overlap, &over);
    Some(Facing { other, overlap, gaps })
}

#[cfg(test)]
mod tests {
    use super::super::tests::assert_derivatives;
    use super::*;

    /// Gradient and Hessian are those of differences.
    #[test]
    fn derivatives() {
        let at = |q: &[f64; LOCAL]| {
            let point = |k: usize| Vec3::new(q[3 * k], q[3 * k + 1], q[3 * k + 2]);
            let gap = gap(&point(0), &[point(1), point(2), point(3)], -1.0);
            (gap.value, gap.slope, gap.curve)
        };
        let q: [f64; LOCAL] = [0.3, 0.2, 0.4, 0.0, 0.1, 0.0, 1.0, 0.0, 0.2, 0.1, 1.1, -0.1];
        assert_derivatives(at, &q);
    }
}
