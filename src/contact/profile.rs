//! Profiles of lines and arcs in the plane, or in the meridian plane of a body of revolution.

use nalgebra::SMatrix;

use crate::error::GeometryError;
use crate::geometry::{Bounds, Curve, Point, Turn, Vec2};

use super::{Nearest, Surface};

/// Lines and arcs drawn so that the rigid body lies to the left of the way: counter-clockwise around a rigid
/// body, clockwise around a cavity in one. Open profiles go on straight beyond their ends for a small part of
/// their length; a body that passes an end is refused.
///
/// ```
/// use rkpm::contact::{Profile, Surface};
/// use rkpm::geometry::Turn;
/// // The groove of a seal, open to the top: its walls and its floor with rounded corners.
/// let groove = Profile::at([3.0, 2.0])
///     .line([3.0, 0.2]).arc([2.8, 0.0], [2.8, 0.2], Turn::Right)
///     .line([0.2, 0.0]).arc([0.0, 0.2], [0.2, 0.2], Turn::Right)
///     .line([0.0, 2.0]);
/// let at = groove.nearest(&[1.0, 0.5].into());
/// assert!((at.gap - 0.5).abs() < 1e-12 && at.normal[1] == 1.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    start: Vec2,
    curves: Vec<Curve>,
    /// A corner or centre that no arc fits to.
    wrong: Option<Vec2>,
}

/// Differences of lengths that rounding explains.
const ROUNDING: f64 = 1e-8;
/// How near to the end of a curve, as a part of it, the nearest point counts as the corner.
const CORNER: f64 = 1e-9;

impl Profile {
    /// Starts at a point \[length\].
    pub fn at(start: [f64; 2]) -> Self {
        Profile { start: start.into(), curves: Vec::new(), wrong: None }
    }

    fn end(&self) -> Vec2 {
        self.curves.last().map_or(self.start, |curve| curve.at(1.0))
    }

    /// A straight line to a corner.
    pub fn line(mut self, to: [f64; 2]) -> Self {
        let (from, to) = (self.end(), Vec2::from(to));
        if !((to - from).norm() > 0.0) {
            self.wrong.get_or_insert(to);
        }
        self.curves.push(Curve::Line { from, to });
        self
    }

    /// An arc to a corner, about a centre.
    pub fn arc(mut self, to: [f64; 2], centre: [f64; 2], turn: Turn) -> Self {
        let (from, to, centre) = (self.end(), Vec2::from(to), Vec2::from(centre));
        let (a, b) = (from - centre, to - centre);
        let radius = a.norm();
        if !(radius > 0.0 && (b.norm() - radius).abs() <= ROUNDING * (radius + to.amax())) {
            self.wrong.get_or_insert(to);
        }
        let start = a[1].atan2(a[0]);
        let mut sweep = b[1].atan2(b[0]) - start;
        match turn {
            Turn::Left if sweep <= 1e-12 => sweep += std::f64::consts::TAU,
            Turn::Right if sweep >= -1e-12 => sweep -= std::f64::consts::TAU,
            _ => {}
        }
        self.curves.push(Curve::Arc { from, to, centre, radius, start, sweep });
        self
    }

    /// A straight line back to the start.
    pub fn close(self) -> Self {
        let start = self.start;
        self.line([start[0], start[1]])
    }

    /// Whether it ends where it starts.
    pub(crate) fn is_closed(&self) -> bool {
        !self.curves.is_empty() && (self.end() - self.start).norm() <= ROUNDING * self.length()
    }

    /// Points along the profile for a picture, about `count` on each arc.
    pub fn drawn(&self, count: usize) -> Vec<Vec2> {
        let mut points = vec![self.start];
        for curve in &self.curves {
            let count = if matches!(curve, Curve::Line { .. }) { 1 } else { count.max(2) };
            points.extend((1..=count).map(|k| curve.at(k as f64 / count as f64)));
        }
        points
    }

    fn length(&self) -> f64 {
        self.curves.iter().map(Curve::length).sum()
    }

    /// Unit tangent of a curve at its start (0) or end (1), or in between.
    fn tangent(curve: &Curve, t: f64) -> Vec2 {
        match curve {
            Curve::Line { from, to } => (to - from).normalize(),
            Curve::Arc { start, sweep, .. } => {
                let angle = start + sweep * t;
                Vec2::new(-angle.sin(), angle.cos()) * sweep.signum()
            }
        }
    }

    /// Out of the rigid body: to the right of the way.
    fn outward(curve: &Curve, t: f64) -> Vec2 {
        let along = Profile::tangent(curve, t);
        Vec2::new(along[1], -along[0])
    }
}

impl Surface<2> for Profile {
    fn nearest(&self, x: &Vec2) -> Nearest<2> {
        let mut best = (0, 0.0, f64::INFINITY);
        for (k, curve) in self.curves.iter().enumerate() {
            let (t, distance) = curve.nearest(x);
            if distance < best.2 {
                best = (k, t, distance);
            }
        }
        let (k, t, _) = best;
        let Some(curve) = self.curves.get(k) else { return Nearest::flat(f64::INFINITY, Point::zeros()) };
        let at_start = t <= CORNER;
        if at_start || t >= 1.0 - CORNER {
            let corner = curve.at(if at_start { 0.0 } else { 1.0 });
            let (n, closed) = (self.curves.len(), self.is_closed());
            let other = match (at_start, k) {
                (true, 0) if !closed => None,
                (true, k) => Some((k + n - 1) % n),
                (false, k) if k + 1 == n && !closed => None,
                (false, k) => Some((k + 1) % n),
            };
            let (mine, end) = (Profile::outward(curve, f64::from(u8::from(!at_start))), u8::from(at_start));
            let away = x - corner;
            let Some(other) = other else {
                // The straight way on beyond an open end.
                let along = Profile::tangent(curve, f64::from(u8::from(!at_start))) * if at_start { -1.0 } else { 1.0 };
                let passed = away.dot(&along) > CORNER * self.length();
                return Nearest { passed_end: passed, ..Nearest::flat(away.dot(&mine), mine) };
            };
            let both = mine + Profile::outward(&self.curves[other], f64::from(end));
            // Where the curves meet smoothly either tells all; a corner is round from outside.
            let smooth = both.norm() > 2.0 - 1e-9 || !(away.norm() > ROUNDING * self.length());
            if !smooth {
                let found = Nearest::round(away, 0.0, SMatrix::identity());
                return if away.dot(&both) >= 0.0 { found } else { found.hollow() };
            }
        }
        match curve {
            Curve::Line { from, .. } => {
                let normal = Profile::outward(curve, t);
                Nearest::flat((x - from).dot(&normal), normal)
            }
            Curve::Arc { centre, radius, sweep, .. } => {
                let found = Nearest::round(x - centre, *radius, SMatrix::identity());
                if *sweep > 0.0 { found } else { found.hollow() }
            }
        }
    }

    fn depth(&self) -> f64 {
        let extent = Bounds::of(&self.drawn(16)).extent();
        if self.is_closed() { 0.5 * extent.min() } else { 0.5 * extent.max() }
    }

    fn validate(&self) -> Result<(), GeometryError> {
        let wrong = |what, at: Vec2, remedy| Err(GeometryError::Shape { what, at: at.as_slice().to_vec(), remedy });
        if let Some(at) = self.wrong {
            return wrong(
                "a line of a rigid profile has no length, or the ends of an arc different distances from its centre",
                at,
                "give different corners, and centres at the same distance from both ends of the arc",
            );
        }
        if self.curves.is_empty() {
            return wrong("a rigid profile has no line", self.start, "draw lines and arcs");
        }
        let points = self.drawn(64);
        if points.iter().any(|x| !x.iter().all(|v| v.is_finite())) {
            return wrong("a coordinate of a rigid profile is not finite", self.start, "give finite coordinates");
        }
        if self.is_closed() {
            let area: f64 = points
                .windows(2)
                .map(|w| {
                    let (a, b) = (w[0] - self.start, w[1] - self.start);
                    0.5 * (a[0] * b[1] - a[1] * b[0])
                })
                .sum();
            if area.abs() <= ROUNDING * self.length().powi(2) {
                return wrong(
                    "a closed rigid profile has no inside",
                    self.start,
                    "draw it counter-clockwise around an area, or leave it open",
                );
            }
        }
        Ok(())
    }
}
