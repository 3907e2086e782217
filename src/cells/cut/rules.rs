//! Integration rules on faces and patches of cut bricks.

use std::f64::consts::SQRT_2;

use crate::each::EachOf;
use crate::error::GeometryError;
use crate::geometry::{Vec3, double_area};
use crate::quadrature::{LineRule, gauss_legendre};

use super::super::inertia::Inertia;

/// Length below which a triangle takes a single point, in bricks: a sixth of the spacing.
const TINY: f64 = 0.33;

/// Three points of a triangle for moments of second order, and parts of its area.
const SECOND: [([f64; 2], f64); 3] =
    [([1.0 / 6.0, 1.0 / 6.0], 1.0 / 3.0), ([4.0 / 6.0, 1.0 / 6.0], 1.0 / 3.0), ([1.0 / 6.0, 4.0 / 6.0], 1.0 / 3.0)];

/// Rules with so many points per direction.
pub(super) struct Rules {
    line: LineRule,
    /// Coordinates along two edges of a triangle, and parts of its area.
    triangle: Vec<([f64; 2], f64)>,
}

impl Rules {
    pub(super) fn new(gauss: usize) -> Result<Self, GeometryError> {
        let line = gauss_legendre(gauss)?;
        let triangle = match gauss {
            1 => vec![([1.0 / 3.0; 2], 1.0)],
            2 => SECOND.to_vec(),
            _ => {
                let pairs = line.0.iter().zip(&line.1);
                let all = pairs.clone().flat_map(|(x, v)| pairs.clone().map(move |(y, w)| ((*x, *v), (*y, *w))));
                all.map(|((x, v), (y, w))| ([x, y * (1.0 - x)], 2.0 * v * w * (1.0 - x))).collect()
            }
        };
        Ok(Rules { line, triangle })
    }

    /// Points on a triangle with $n\,\mathrm dA$.
    pub(super) fn on_triangle(&self, corners: &[Vec3; 3], mut with: impl FnMut(Vec3, Vec3)) {
        let ([a, b, c], area) = (corners, double_area(corners) * 0.5);
        let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        let rule = match (longest < TINY * TINY, self.line.0.len()) {
            (true, 1 | 2) => return with((a + b + c) / 3.0, area),
            // Gradients that vary in cells ask for moments of second order everywhere.
            (true, _) => &SECOND[..],
            (false, _) => &self.triangle,
        };
        for &([s, t], share) in rule {
            with(a + (b - a) * s + (c - a) * t, area * share);
        }
    }

    /// Points on a plane piece of several triangles with $n\,\mathrm dA$: with two points per direction and more those that have its
    /// moments of second order, however many triangles it is made of.
    pub(super) fn on_piece(
        &self,
        triangles: impl ExactSizeIterator<Item = [Vec3; 3]>,
        mut with: impl FnMut(Vec3, Vec3),
    ) {
        if self.line.0.len() == 1 || triangles.len() == 1 {
            return triangles.for_each(|corners| self.on_triangle(&corners, &mut with));
        }
        let (mut inertia, mut area) = (Inertia::default(), Vec3::zeros());
        for corners in triangles {
            let own = double_area(&corners) * 0.5;
            inertia.add(&corners, own.norm());
            area += own;
        }
        // Slivers without an area have no points.
        if inertia.measure == 0.0 {
            return;
        }
        let (centre, [p, q, _]) = inertia.axes();
        if self.line.0.len() == 2 && 24.0 * p.norm_squared() < TINY * TINY {
            return with(centre, area);
        }
        let (third, half) = (area / 3.0, (0.75f64).sqrt());
        for [s, t] in [[0.0, 1.0], [-half, -0.5], [half, -0.5]] {
            with(centre + (p * s + q * t) * SQRT_2, third);
        }
    }

    /// Points on a parallelogram by two of its edges, with $n\,\mathrm dA$.
    pub(super) fn on_face(&self, corner: &Vec3, [p, q]: &[Vec3; 2], mut with: impl FnMut(Vec3, Vec3)) {
        let area = p.cross(q);
        for (t, w) in self.line.0.iter().zip(&self.line.1) {
            for (s, v) in self.line.0.iter().zip(&self.line.1) {
                with(corner + p * *s + q * *t, area * (v * w));
            }
        }
    }

    /// Points in a brick of unit edges from a corner.
    pub(super) fn in_brick(&self, corner: &Vec3, size: f64, mut with: impl FnMut(Vec3, f64)) {
        let line = || self.line.0.iter().zip(&self.line.1);
        for (z, w) in line() {
            for (y, v) in line() {
                for (x, u) in line() {
                    with(corner + Vec3::new(*x, *y, *z) * size, u * v * w * size.powi(3));
                }
            }
        }
    }

    /// Points in a tetrahedron, its measure signed.
    pub(super) fn in_tetrahedron(&self, apex: &Vec3, base: &[Vec3; 3], mut with: impl FnMut(Vec3, f64)) {
        let [a, b, c] = base.each(|corner| corner - apex);
        let measure = a.dot(&b.cross(&c));
        if self.line.0.len() == 1 {
            return with(apex + (a + b + c) / 4.0, measure / 6.0);
        }
        let line = || self.line.0.iter().zip(&self.line.1);
        for (x, u) in line() {
            for (y, v) in line() {
                for (z, w) in line() {
                    // From the apex on, by two collapses.
                    let at = (a + (b - a) * *y + (c - b) * (y * z)) * *x;
                    with(apex + at, measure * u * v * w * x * x * y);
                }
            }
        }
    }
}
