//! Step limit for prescribed motions. A rotating part moves along circles: the steps must follow the prescribed curve, not just
//! reach its end.

use crate::boundary::Constraints;

/// Largest departure of the prescribed curve from the straight line between the ends of a step, relative to the largest change
/// within the step: a quarter turn departs by 0.207, half a turn by 0.5, and a full turn comes back.
const STRAIGHT: f64 = 0.22;
/// Departures below this part of a curve's whole extent are ignored: at a corner steps of any size would depart.
const SLIGHT: f64 = 0.02;
/// Curves shorter than this part of the longest one are rounding: points on the axis of a turn.
const AT_REST: f64 = 1e-9;
/// Where a step is sampled: its middle, and fractions that are no multiples of a period for any number of turns.
const PARTS: [f64; 8] = [0.0901699, 0.2360680, 0.3541020, 0.4721360, 0.5, 0.6180340, 0.7639320, 0.9098301];

/// The curve along which one particle is moved.
struct Curve {
    /// Number of each of its constraint equations, and the factor that makes its value a length.
    equations: Vec<(usize, f64)>,
    /// The least departure from a straight line that counts.
    slight: f64,
}

/// The curves of all particles whose prescribed values are functions of the load factor.
pub(super) struct MotionLimit<'a> {
    constraints: &'a Constraints,
    curves: Vec<Curve>,
}

impl<'a> MotionLimit<'a> {
    /// The curves of constraint equations whose amplitudes are functions; others are straight between the break points of their tables.
    pub(super) fn new(constraints: &'a Constraints, dimension: usize) -> Self {
        let equations = constraints.equations();
        let particle = |equation: usize| equations[equation].dependent / dimension;
        let mut moved: Vec<usize> =
            (0..equations.len()).filter(|&r| equations[r].amplitude.is_function()).map(particle).collect();
        moved.sort_unstable();
        moved.dedup();
        let mut curves: Vec<Curve> = moved.iter().map(|_| Curve { equations: Vec::new(), slight: 0.0 }).collect();
        if curves.is_empty() {
            return MotionLimit { constraints, curves };
        }
        for (r, equation) in equations.iter().enumerate() {
            if let Ok(curve) = moved.binary_search(&particle(r)) {
                curves[curve].equations.push((r, 1.0 / equation.measure()));
            }
        }
        let mut limit = MotionLimit { constraints, curves };
        let extents: Vec<f64> = limit.curves.iter().map(|curve| limit.extent(curve)).collect();
        let longest = extents.iter().copied().fold(0.0, f64::max);
        for (curve, extent) in limit.curves.iter_mut().zip(&extents) {
            curve.slight = SLIGHT * extent;
        }
        let mut extents = extents.iter();
        limit.curves.retain(|_| extents.next().is_some_and(|&extent| extent > AT_REST * longest));
        limit
    }

    /// The load factor up to which a step from `now` to `target` may go: the first of as many equal parts as keep all curves
    /// near their straight lines, or are below `smallest`.
    pub(super) fn until(&self, now: f64, target: f64, smallest: f64) -> f64 {
        let mut parts = 1.0;
        loop {
            let next = if parts == 1.0 { target } else { now + (target - now) / parts };
            if next - now <= smallest || self.curves.iter().all(|curve| self.straight(curve, now, next)) {
                return next;
            }
            parts = (1.2 * parts + 0.9_f64).floor();
        }
    }

    /// Whether the values at `target` lie nearer to those extrapolated from two loads than to those of the second one:
    /// beyond a sixth of a turn, or where curves turn back, they don't.
    pub(super) fn go_on(&self, [before, now]: [f64; 2], target: f64) -> bool {
        let ratio = (target - now) / (now - before);
        let (mut ahead, mut here) = (0.0, 0.0);
        for curve in &self.curves {
            let [a, b, c] = [before, now, target].map(|load| self.position(curve, load));
            for ((a, b), c) in a.iter().zip(&b).zip(&c) {
                ahead += (c - b - ratio * (b - a)).powi(2);
                here += (c - b).powi(2);
            }
        }
        !(ahead > here)
    }

    /// The largest distance from the start of a curve.
    fn extent(&self, curve: &Curve) -> f64 {
        let start = self.position(curve, 0.0);
        PARTS.iter().chain(&[1.0]).map(|&load| distance(&self.position(curve, load), &start)).fold(0.0, f64::max)
    }

    /// Whether a curve stays near its straight line between two loads, and does not run back along it.
    fn straight(&self, curve: &Curve, from: f64, to: f64) -> bool {
        let (start, end) = (self.position(curve, from), self.position(curve, to));
        let line: Vec<f64> = end.iter().zip(&start).map(|(b, a)| b - a).collect();
        let length = line.iter().map(|l| l * l).sum::<f64>();
        let (mut reached, mut departure, mut change): (f64, f64, f64) = (0.0, 0.0, length.sqrt());
        for part in PARTS {
            let at = self.position(curve, from + part * (to - from));
            let along: f64 = at.iter().zip(&start).zip(&line).map(|((x, a), l)| (x - a) * l).sum();
            if length > 0.0 {
                reached = reached.max((along / length).min(1.0));
            }
            let foot: Vec<f64> = start.iter().zip(&line).map(|(a, l)| a + reached * l).collect();
            departure = departure.max(distance(&at, &foot));
            change = change.max(distance(&at, &start));
        }
        // Values that are not finite are left to the attempt, which reports where they are.
        !(departure > curve.slight && departure > STRAIGHT * change)
    }

    /// The prescribed values of a curve \[length\].
    fn position(&self, curve: &Curve, load: f64) -> Vec<f64> {
        let equations = self.constraints.equations();
        curve
            .equations
            .iter()
            .map(|&(r, factor)| factor * equations[r].target * equations[r].amplitude.value(load))
            .collect()
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}
