//! Curves of prescribed values over the load factor: a value that turns or returns within a step would be missed.
use crate::each::Each;
/// Largest departure of a curve from the straight line between the ends of a step, relative to the largest change within the
/// step: a quarter turn departs by 0.207, half a turn by 0.5, and a full turn comes back.
const STRAIGHT: f64 = 0.22;
/// Departures below this part of a curve's whole extent are ignored: at a corner steps of any size would depart.
const SLIGHT: f64 = 0.02;
/// Where a step is sampled: its middle, and fractions that are no multiples of a period for any number of turns.
const PARTS: [f64; 8] = [0.0901699, 0.2360680, 0.3541020, 0.4721360, 0.5, 0.6180340, 0.7639320, 0.9098301];

/// Prescribed values as a function of the load factor.
pub(crate) struct Curve<F> {
    position: F,
    /// The largest distance from the start.
    pub extent: f64,
}

impl<F: Fn(f64) -> Vec<f64>> Curve<F> {
    /// The curve of a position.
    pub(crate) fn new(position: F) -> Self {
        let start = position(0.0);
        let extent = PARTS.iter().chain(&[1.0]).map(|&load| distance(&position(load), &start)).fold(0.0, f64::max);
        Curve { position, extent }
    }

    /// The values at a load factor.
    pub(crate) fn at(&self, load: f64) -> Vec<f64> {
        (self.position)(load)
    }

    /// Whether it stays near its straight line between two load factors, and does not run back along it.
    pub(crate) fn is_straight(&self, from: f64, to: f64) -> bool {
        let (start, end) = (self.at(from), self.at(to));
        let line: Vec<f64> = end.paired(&start, |b, a| b - a);
        let length = line.summed(|l| l * l);
        let (mut reached, mut departure, mut change): (f64, f64, f64) = (0.0, 0.0, length.sqrt());
        for part in PARTS {
            let at = self.at(from + part * (to - from));
            let along: f64 = at.iter().zip(&start).zip(&line).map(|((x, a), l)| (x - a) * l).sum();
            if length > 0.0 {
                reached = reached.max((along / length).min(1.0));
            }
            let foot: Vec<f64> = start.paired(&line, |a, l| a + reached * l);
            departure = departure.max(distance(&at, &foot));
            change = change.max(distance(&at, &start));
        }
        // Values that are not finite are left to the attempt, which reports where they are.
        !(departure > SLIGHT * self.extent && departure > STRAIGHT * change)
    }
}

/// The load factor up to which a step from `now` to `target` may go: the first of as many equal parts as are `straight`, or
/// below `smallest`.
pub(crate) fn straight_until(now: f64, target: f64, smallest: f64, straight: impl Fn(f64, f64) -> bool) -> f64 {
    let mut parts = 1.0;
    loop {
        let next = if parts == 1.0 { target } else { now + (target - now) / parts };
        if next - now <= smallest || straight(now, next) {
            return next;
        }
        parts = (1.2 * parts + 0.9_f64).floor();
    }
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.pair_sum(b, |a, b| (a - b).powi(2)).sqrt()
}
