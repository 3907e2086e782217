//! Walls of a solid: where its surface faces away from itself over a short distance.

use std::collections::HashSet;

use crate::each::array_of;
pub(crate) use crate::geometry::OPPOSITE;
use crate::geometry::{Bounds, Vec3, double_area};

use super::closed::Solid3;

/// What rounding may put a point outside of a facet, as a part of its size.
const EDGE: f64 = 1e-9;

/// Some of a wall: a triangle on one side, and what leads from it to the other one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wall {
    pub(crate) corners: [Vec3; 3],
    pub(crate) through: Vec3,
    /// Whether both sides are parallel.
    pub(crate) is_even: bool,
}

impl Solid3 {
    /// The walls thinner than a length, along the normals of the surface in the middle of triangles whose sides are no longer than a step,
    /// and where there is a wall than its thickness or a least length: boxes around them then hold little else. Of facets smaller than a step
    /// one is looked at in each cube of that side that looks along the same axis, where they are `sampled`.
    pub(crate) fn walls(&self, thinner: f64, step: f64, least: f64, sampled: bool) -> Vec<Wall> {
        let mut found = Vec::new();
        let mut looked: HashSet<([i64; 3], usize, bool)> = HashSet::new();
        for facet in 0..self.facets.len() {
            let (inward, corners) = (-self.normals[facet], self.corners(facet));
            let is_small = (0..3).all(|k| (corners[k] - corners[(k + 1) % 3]).norm() < step);
            if sampled && is_small {
                let cube = array_of(|i| (corners[0][i] / step).floor() as i64);
                let axis = inward.iamax();
                if !looked.insert((cube, axis, inward[axis] > 0.0)) {
                    continue;
                }
            }
            let mut open = vec![corners];
            while let Some([a, b, c]) = open.pop() {
                // Halved across the longest side, which comes first.
                let sides = [(a, b, c), (b, c, a), (c, a, b)];
                let longest = |x: &(Vec3, Vec3, Vec3)| (x.1 - x.0).norm_squared();
                let Some((p, q, r)) = sides.into_iter().max_by(|x, y| longest(x).total_cmp(&longest(y))) else { break };
                let (length, middle) = ((q - p).norm(), (p + q) * 0.5);
                let halves = [[p, middle, r], [middle, q, r]];
                if length > step {
                    open.extend(halves);
                    continue;
                }
                let from = (a + b + c) / 3.0;
                match self.through(&from, &inward, thinner, facet as u32) {
                    Some((thickness, _)) if length > thickness.max(least) => open.extend(halves),
                    Some((thickness, is_even)) => {
                        found.push(Wall { corners: [a, b, c], through: inward * thickness, is_even });
                    }
                    None => {}
                }
            }
        }
        found
    }

    /// The distance from a point of a facet along a direction to the other side of a wall there, and whether that is parallel.
    fn through(&self, from: &Vec3, along: &Vec3, thinner: f64, own: u32) -> Option<(f64, bool)> {
        let to = from + along * thinner;
        let mut nearest: Option<(f64, f64)> = None;
        self.tree.for_each_in(&Bounds::of([from, &to]), |facet| {
            let (normal, x) = (self.normals[facet as usize], self.corners(facet as usize));
            let steep = normal.dot(along);
            let distance = (x[0] - from).dot(&normal) / steep;
            if facet == own || !(distance > EDGE * thinner && distance < thinner) {
                return;
            }
            let at = from + along * distance;
            let area = double_area(&x).norm();
            let within = |k: usize| double_area(&[x[k], x[(k + 1) % 3], at]).dot(&normal) >= -EDGE * area;
            if (0..3).all(within) && nearest.is_none_or(|known| distance < known.0) {
                nearest = Some((distance, steep));
            }
        });
        nearest.filter(|(_, steep)| *steep > OPPOSITE).map(|(distance, steep)| (distance, steep > 1.0 - EDGE))
    }
}
