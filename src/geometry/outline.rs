//! Outlines of lines and arcs whose parts have names.

use std::f64::consts::TAU;

use crate::error::GeometryError;

use super::Vec2;

/// Which way an arc turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Turn {
    /// Counter-clockwise.
    Left,
    /// Clockwise.
    Right,
}

/// A line or an arc between two corners of an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Curve {
    Line {
        from: Vec2,
        to: Vec2,
    },
    /// `sweep` is the signed angle \[rad\].
    Arc {
        from: Vec2,
        to: Vec2,
        centre: Vec2,
        radius: f64,
        start: f64,
        sweep: f64,
    },
}

/// A closed curve of lines and arcs, drawn corner by corner in either direction.
///
/// Each line and arc has a name, by which conditions and loads find it; several may share one.
///
/// ```
/// use rkpm::geometry::{Outline, Region, Turn};
/// // A quarter of a plate with a central hole.
/// let plate = Outline::at([2.0, 0.0])
///     .line("bottom", [10.0, 0.0])
///     .line("right", [10.0, 5.0])
///     .line("top", [0.0, 5.0])
///     .line("left", [0.0, 2.0])
///     .arc("hole", [2.0, 0.0], [0.0, 0.0], Turn::Right);
/// let region = Region::new(plate)?;
/// assert!((region.area() - (50.0 - std::f64::consts::PI)).abs() < 1e-12);
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Outline {
    start: [f64; 2],
    edges: Vec<Edge>,
}

#[derive(Debug, Clone, PartialEq)]
struct Edge {
    name: String,
    to: [f64; 2],
    arc: Option<([f64; 2], Turn)>,
}

impl Outline {
    /// Starts at a corner \[length\].
    pub fn at(start: [f64; 2]) -> Self {
        Outline { start, edges: Vec::new() }
    }

    /// A straight line to a corner.
    pub fn line(mut self, name: &str, to: [f64; 2]) -> Self {
        self.edges.push(Edge { name: name.into(), to, arc: None });
        self
    }

    /// An arc to a corner, about a centre.
    pub fn arc(mut self, name: &str, to: [f64; 2], centre: [f64; 2], turn: Turn) -> Self {
        self.edges.push(Edge { name: name.into(), to, arc: Some((centre, turn)) });
        self
    }

    /// A straight line back to the start.
    pub fn close(self, name: &str) -> Self {
        let start = self.start;
        self.line(name, start)
    }

    /// A full circle.
    pub fn circle(name: &str, centre: [f64; 2], radius: f64) -> Self {
        // A radius that is none leaves no point to start from, which is refused with all others that are not finite.
        let radius = if radius > 0.0 { radius } else { f64::NAN };
        let start = [centre[0] + radius, centre[1]];
        Outline::at(start).arc(name, start, centre, Turn::Left)
    }

    /// Curves and their names in the order drawn.
    pub(super) fn curves(&self) -> Result<Vec<(Curve, String)>, GeometryError> {
        let wrong = |what, at: [f64; 2], remedy| GeometryError::Shape { what, at: at.to_vec(), remedy };
        let mut from = self.start;
        let mut curves = Vec::with_capacity(self.edges.len());
        for edge in &self.edges {
            if edge.name.trim().is_empty() {
                return Err(GeometryError::Nameless { what: "a part of an outline" });
            }
            let to = edge.to;
            let numbers = [from[0], from[1], to[0], to[1]];
            if numbers.iter().chain(edge.arc.iter().flat_map(|(c, _)| c)).any(|x| !x.is_finite()) {
                // Of a circle without a radius the centre alone is known.
                let at = edge.arc.filter(|_| to == from || to[0].is_nan()).map_or(to, |(centre, _)| centre);
                return Err(wrong(
                    "a corner or centre is not finite, or a radius not above zero",
                    at,
                    "give finite coordinates and radii above zero",
                ));
            }
            let (start, end) = (Vec2::from(from), Vec2::from(to));
            let curve = match edge.arc {
                None if start == end => {
                    return Err(wrong("a line has no length", to, "give two different corners"));
                }
                None => Curve::Line { from: start, to: end },
                Some((centre, turn)) => {
                    let centre = Vec2::from(centre);
                    let (a, b) = (start - centre, end - centre);
                    let radius = a.norm();
                    // Corners typed with eight digits still lie on their arc, and so do those of a small arc far
                    // from the origin, whose coordinates are rounded.
                    let rounding = 4.0 * f64::EPSILON * start.amax().max(end.amax()).max(centre.amax());
                    if !(radius > 0.0) || (b.norm() - radius).abs() > 1e-8 * radius + rounding {
                        return Err(wrong(
                            "the ends of an arc have different distances from its centre",
                            to,
                            "give a centre on the perpendicular bisector of the ends",
                        ));
                    }
                    let start_angle = a[1].atan2(a[0]);
                    let mut sweep = b[1].atan2(b[0]) - start_angle;
                    match turn {
                        Turn::Left if sweep <= 1e-12 => sweep += TAU,
                        Turn::Right if sweep >= -1e-12 => sweep -= TAU,
                        _ => {}
                    }
                    Curve::Arc { from: start, to: end, centre, radius, start: start_angle, sweep }
                }
            };
            curves.push((curve, edge.name.clone()));
            from = to;
        }
        if curves.is_empty() || from != self.start {
            return Err(wrong(
                "an outline does not end where it starts",
                from,
                "end at the first corner, or call close",
            ));
        }
        Ok(curves)
    }
}

impl Curve {
    /// The point at parameter $t \in \[0,1\]$; both ends come out exact.
    pub(crate) fn at(&self, t: f64) -> Vec2 {
        match self {
            Curve::Line { from, to } => from * (1.0 - t) + to * t,
            Curve::Arc { from, .. } if t == 0.0 => *from,
            Curve::Arc { to, .. } if t == 1.0 => *to,
            Curve::Arc { centre, radius, start, sweep, .. } => {
                let angle = start + sweep * t;
                centre + Vec2::new(angle.cos(), angle.sin()) * *radius
            }
        }
    }

    /// Centre and squared radius of an arc.
    pub(super) fn circle(&self) -> Option<(Vec2, f64)> {
        match self {
            Curve::Line { .. } => None,
            Curve::Arc { centre, radius, .. } => Some((*centre, radius * radius)),
        }
    }

    /// Whether a point lies between a chord of an arc, taken in its direction, and the arc that has the body on its left.
    pub(crate) fn beyond_chord(&self, [a, b]: [&Vec2; 2], at: &Vec2) -> bool {
        let (chord, offset) = (b - a, at - a);
        matches!(self, Curve::Arc { centre, radius, sweep, .. }
            if *sweep > 0.0
                && (at - centre).norm() < *radius
                && chord.perp(&offset) < 0.0)
    }

    pub(crate) fn length(&self) -> f64 {
        match self {
            Curve::Line { from, to } => (to - from).norm(),
            Curve::Arc { radius, sweep, .. } => radius * sweep.abs(),
        }
    }

    /// Parameter of the nearest point and its distance.
    pub(crate) fn nearest(&self, x: &Vec2) -> (f64, f64) {
        let t = match self {
            Curve::Line { from, to } => {
                let along = to - from;
                ((x - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0)
            }
            Curve::Arc { centre, start, sweep, .. } => {
                let offset = x - centre;
                let mut angle = offset[1].atan2(offset[0]) - start;
                if *sweep > 0.0 {
                    angle = angle.rem_euclid(TAU);
                } else {
                    angle = -((-angle).rem_euclid(TAU));
                }
                let t = angle / sweep;
                // Beyond the end: nearer to the end or to the start.
                if t <= 1.0 {
                    t
                } else if t - 1.0 < (TAU / sweep.abs() - t).abs() {
                    1.0
                } else {
                    0.0
                }
            }
        };
        (t, (self.at(t) - x).norm())
    }

    /// Chords that keep the arc to a tolerance; 1 for lines.
    pub(crate) fn chords(&self, tolerance: f64) -> usize {
        match self {
            Curve::Line { .. } => 1,
            Curve::Arc { radius, sweep, .. } => {
                // Sagitta of a chord of half angle θ: R (1 − cos θ).
                let half = (1.0 - (tolerance / radius).clamp(1e-12, 0.5)).acos();
                ((sweep.abs() / (2.0 * half)).ceil() as usize).max(1)
            }
        }
    }

    pub(super) fn reversed(&self) -> Curve {
        match *self {
            Curve::Line { from, to } => Curve::Line { from: to, to: from },
            Curve::Arc { from, to, centre, radius, start, sweep } => {
                Curve::Arc { from: to, to: from, centre, radius, start: start + sweep, sweep: -sweep }
            }
        }
    }

    /// $\tfrac12\int x\\,\mathrm dy - y\\,\mathrm dx$ along the curve, with coordinates from a point near it: about a
    /// distant one the parts of a loop are large and cancel.
    pub(super) fn signed_area(&self, about: &Vec2) -> f64 {
        match *self {
            Curve::Line { from, to } => {
                let (a, b) = (from - about, to - about);
                0.5 * a.perp(&b)
            }
            Curve::Arc { from: a, to: b, centre, radius, sweep, .. } => {
                let centre = centre - about;
                0.5 * (radius * radius * sweep + centre[0] * (b[1] - a[1]) - centre[1] * (b[0] - a[0]))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn arcs_know_their_nearest_points() {
        let centre = Vec2::new(1.0, 2.0);
        let (from, to) = (Vec2::new(1.0, 4.0), Vec2::new(3.0, 2.0));
        let arc = Curve::Arc { from, to, centre, radius: 2.0, start: PI / 2.0, sweep: -PI / 2.0 };
        for t in [0.0, 0.3, 1.0] {
            let (found, distance) = arc.nearest(&(centre + (arc.at(t) - centre) * 1.5));
            assert_abs_diff_eq!(found, t, epsilon = 1e-12);
            assert_abs_diff_eq!(distance, 1.0, epsilon = 1e-12);
        }
        assert_eq!(arc.nearest(&Vec2::new(4.0, 1.0)).0, 1.0);
        assert_eq!(arc.nearest(&Vec2::new(0.0, 5.0)).0, 0.0);
    }
}
