//! Step limit for prescribed motions: a part that turns moves along circles, and the curve is input as much as its end.

use crate::boundary::Constraints;

/// A step may lead this part of its largest change away from the straight line between its ends: a quarter turn leads
/// 0.207 away, half a turn 0.5, a full one comes back.
const STRAIGHT: f64 = 0.22;
/// Departures below this part of a way's whole extent count for nothing: at a corner steps of any size would depart.
const SLIGHT: f64 = 0.02;
/// Curves shorter than this part of the longest one are rounding: points on the axis of a turn.
const AT_REST: f64 = 1e-9;
/// Where a step is looked at: the middle, and parts that no number of turns makes periods of.
const PARTS: [f64; 8] = [0.0901699, 0.2360680, 0.3541020, 0.4721360, 0.5, 0.6180340, 0.7639320, 0.9098301];

/// The rows of one particle that is moved along a curve.
struct Way {
    /// Row, and the factor that makes its value a length.
    equations: Vec<(usize, f64)>,
    /// The least departure from a straight line that counts.
    slight: f64,
}

/// The ways of all particles whose prescribed values are functions of the load factor.
pub(super) struct MotionLimit<'a> {
    constraints: &'a Constraints,
    paths: Vec<Way>,
}

impl<'a> MotionLimit<'a> {
    /// The ways of rows with functions for amplitudes; others are straight between the break points of their tables.
    pub(super) fn new(constraints: &'a Constraints, dimension: usize) -> Self {
        let equations = constraints.equations();
        let particle = |equation: usize| equations[equation].dependent / dimension;
        let mut moved: Vec<usize> =
            (0..equations.len()).filter(|&r| equations[r].amplitude.is_function()).map(particle).collect();
        moved.sort_unstable();
        moved.dedup();
        let mut paths: Vec<Way> = moved.iter().map(|_| Way { equations: Vec::new(), slight: 0.0 }).collect();
        if paths.is_empty() {
            return MotionLimit { constraints, paths };
        }
        for (r, equation) in equations.iter().enumerate() {
            if let Ok(path) = moved.binary_search(&particle(r)) {
                paths[path].equations.push((r, 1.0 / equation.measure()));
            }
        }
        let mut paths = MotionLimit { constraints, paths };
        let extents: Vec<f64> = paths.paths.iter().map(|path| paths.extent(path)).collect();
        let longest = extents.iter().copied().fold(0.0, f64::max);
        for (path, extent) in paths.paths.iter_mut().zip(&extents) {
            path.slight = SLIGHT * extent;
        }
        let mut extents = extents.iter();
        paths.paths.retain(|_| extents.next().is_some_and(|&extent| extent > AT_REST * longest));
        paths
    }

    /// The load factor up to which a step from `now` to `target` may go: the first of as many equal parts as keep all ways
    /// near their straight lines, or are below `smallest`.
    pub(super) fn until(&self, now: f64, target: f64, smallest: f64) -> f64 {
        let mut parts = 1.0;
        loop {
            let next = if parts == 1.0 { target } else { now + (target - now) / parts };
            if next - now <= smallest || self.paths.iter().all(|path| self.straight(path, now, next)) {
                return next;
            }
            parts = (1.2 * parts + 0.9_f64).floor();
        }
    }

    /// Whether the values at `target` lie nearer to those extrapolated from two loads than to those of the second one:
    /// beyond a sixth of a turn, or where ways turn back, they don't.
    pub(super) fn go_on(&self, [before, now]: [f64; 2], target: f64) -> bool {
        let ratio = (target - now) / (now - before);
        let (mut ahead, mut here) = (0.0, 0.0);
        for path in &self.paths {
            let [a, b, c] = [before, now, target].map(|load| self.position(path, load));
            for ((a, b), c) in a.iter().zip(&b).zip(&c) {
                ahead += (c - b - ratio * (b - a)).powi(2);
                here += (c - b).powi(2);
            }
        }
        !(ahead > here)
    }

    /// The largest distance from the start of a way.
    fn extent(&self, path: &Way) -> f64 {
        let start = self.position(path, 0.0);
        PARTS.iter().chain(&[1.0]).map(|&load| distance(&self.position(path, load), &start)).fold(0.0, f64::max)
    }

    /// Whether a way stays near its straight line between two loads, and does not run back along it.
    fn straight(&self, path: &Way, from: f64, to: f64) -> bool {
        let (start, end) = (self.position(path, from), self.position(path, to));
        let line: Vec<f64> = end.iter().zip(&start).map(|(b, a)| b - a).collect();
        let length = line.iter().map(|l| l * l).sum::<f64>();
        let (mut reached, mut departure, mut change): (f64, f64, f64) = (0.0, 0.0, length.sqrt());
        for part in PARTS {
            let at = self.position(path, from + part * (to - from));
            let along: f64 = at.iter().zip(&start).zip(&line).map(|((x, a), l)| (x - a) * l).sum();
            if length > 0.0 {
                reached = reached.max((along / length).min(1.0));
            }
            let foot: Vec<f64> = start.iter().zip(&line).map(|(a, l)| a + reached * l).collect();
            departure = departure.max(distance(&at, &foot));
            change = change.max(distance(&at, &start));
        }
        // Values that are no numbers are left to the attempt, which says where they are.
        !(departure > path.slight && departure > STRAIGHT * change)
    }

    /// The prescribed values of a way \[length\].
    fn position(&self, path: &Way, load: f64) -> Vec<f64> {
        let equations = self.constraints.equations();
        path.equations
            .iter()
            .map(|&(r, factor)| factor * equations[r].target * equations[r].amplitude.value(load))
            .collect()
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
