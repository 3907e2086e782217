//! Walls of a solid: where its surface faces away from itself over a short distance.

use crate::geometry::Point;

use super::closed::Solid3;

/// Cosine beyond which two facets are the sides of a wall: those of an edge sharper than 10° are none.
pub(crate) const OPPOSITE: f64 = 0.985;
/// What rounding may put a point outside of a facet, as a part of its size.
const EDGE: f64 = 1e-9;

/// Some of a wall: a triangle on one side, and what leads from it to the other one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wall {
    pub(crate) corners: [Point<3>; 3],
    pub(crate) through: Point<3>,
}

impl Solid3 {
    /// The walls thinner than a length, along the normals of the surface in the middle of triangles whose sides are no longer than a step,
    /// and where there is a wall than its thickness or a least length: boxes around them then hold little else.
    pub(crate) fn walls(&self, thinner: f64, step: f64, least: f64) -> Vec<Wall> {
        let mut found = Vec::new();
        for facet in 0..self.facets.len() {
            let inward = -self.normals[facet];
            let mut open = vec![self.corners(facet)];
            while let Some([a, b, c]) = open.pop() {
                // Halved across the longest side, which comes first.
                let sides = [(a, b, c), (b, c, a), (c, a, b)];
                let longest = |x: &(Point<3>, Point<3>, Point<3>)| (x.1 - x.0).norm_squared();
                let Some((p, q, r)) = sides.into_iter().max_by(|x, y| longest(x).total_cmp(&longest(y))) else { break };
                let (length, middle) = ((q - p).norm(), (p + q) * 0.5);
                let halves = [[p, middle, r], [middle, q, r]];
                if length > step {
                    open.extend(halves);
                    continue;
                }
                let from = (a + b + c) / 3.0;
                match self.through(&from, &inward, thinner, facet as u32) {
                    Some(thickness) if length > thickness.max(least) => open.extend(halves),
                    Some(thickness) => found.push(Wall { corners: [a, b, c], through: inward * thickness }),
                    None => {}
                }
            }
        }
        found
    }

    /// The distance from a point of a facet along a direction to the other side of a wall there.
    fn through(&self, from: &Point<3>, along: &Point<3>, thinner: f64, own: u32) -> Option<f64> {
        let to = from + along * thinner;
        let mut nearest: Option<(f64, f64)> = None;
        self.tree.for_each_in(&from.inf(&to), &from.sup(&to), |facet| {
            let (normal, [a, b, c]) = (self.normals[facet as usize], self.corners(facet as usize));
            let steep = normal.dot(along);
            let distance = (a - from).dot(&normal) / steep;
            if facet == own || !(distance > EDGE * thinner && distance < thinner) {
                return;
            }
            let at = from + along * distance;
            let area = (b - a).cross(&(c - a)).norm();
            let within = |p: &Point<3>, q: &Point<3>| (q - p).cross(&(at - p)).dot(&normal) >= -EDGE * area;
            if within(&a, &b) && within(&b, &c) && within(&c, &a) && nearest.is_none_or(|known| distance < known.0) {
                nearest = Some((distance, steep));
            }
        });
        nearest.filter(|(_, steep)| *steep > OPPOSITE).map(|(distance, _)| distance)
    }
}
