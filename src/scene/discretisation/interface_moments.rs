//! Values of the functions of multipliers on the far side of an interface, corrected to the measures and first moments of the near
//! side.

use std::collections::HashMap;

use crate::geometry::Point;
use crate::linear::vector::dot;

use super::interface::{Face, Traces, linear};

/// Rounds of corrections: each leaves about a part [`CLOSER`] of what was missing, until rounding is all that is left.
const ROUNDS: usize = 4;

/// Conjugate gradients end with this part of what they began with.
const CLOSER: f64 = 1e-7;

/// The system is singular: what rounding puts beyond its range can't be met, and iterations that try grow without bound. They end
/// with this many times the least residual, and the solution is that of the least.
const GROWN: f64 = 10.0;

/// Adds what is missing of the measures and first moments of each function: the smallest change in terms of the functions
/// themselves that leaves their sums one, by conjugate gradients.
pub(crate) fn correct<const D: usize>(
    traces: &mut Traces,
    mortar: &Face<'_, D>,
    other: &Face<'_, D>,
    centre: &Point<D>,
    size: f64,
) {
    let number: HashMap<u32, usize> = mortar.particles.iter().enumerate().map(|(k, &p)| (p, k)).collect();
    let mut functions = numbered(traces, &number);
    let mut wanted = vec![vec![0.0; D + 1]; number.len()];
    let own = numbered(&mortar.cells.traces, &number);
    for ((values, x), weight) in own.iter().zip(&mortar.cells.points.positions).zip(&mortar.weights) {
        for &(j, value) in values {
            wanted[j].iter_mut().zip(linear(x, centre, size)).for_each(|(m, q)| *m += weight * value * q);
        }
    }
    let system = Moments {
        xi: other.cells.points.positions.iter().map(|x| linear(x, centre, size).collect()).collect(),
        bounds: functions.iter().map(|values| values.iter().map(|&(j, v)| (j, v.max(0.0))).collect()).collect(),
        weights: &other.weights,
        terms: D + 1,
    };
    let mut missing = system.missing(&functions, &wanted);
    for _ in 0..ROUNDS {
        let alpha = system.solve(&missing);
        let mut corrected = functions.clone();
        for (point, values) in corrected.iter_mut().enumerate() {
            for (j, change) in system.changes(&alpha, point) {
                values.iter_mut().filter(|entry| entry.0 == j).for_each(|entry| entry.1 += change);
            }
        }
        let left = system.missing(&corrected, &wanted);
        if !(dot(&left, &left) < dot(&missing, &missing)) {
            break;
        }
        (functions, missing) = (corrected, left);
    }
    for (traces, functions) in traces.iter_mut().zip(functions) {
        traces.iter_mut().zip(functions).for_each(|(trace, function)| trace.1 = function.1);
    }
}

/// Values of functions: for each point (number, value).
type Values = Vec<Vec<(usize, f64)>>;

fn numbered(traces: &Traces, number: &HashMap<u32, usize>) -> Values {
    traces.iter().map(|traces| traces.iter().map(|&(p, v)| (number[&p], v)).collect()).collect()
}

/// How measures and first moments of functions follow from changes
/// $\delta\Theta_J = \omega_J\\,(\alpha_J\cdot\xi - \sum_K\omega_K\\,\alpha_K\cdot\xi/\sum_K\omega_K)$.
struct Moments<'a> {
    /// $\xi$ at each point.
    xi: Vec<Vec<f64>>,
    /// $\omega_J$ at each point.
    bounds: Values,
    weights: &'a [f64],
    terms: usize,
}

impl Moments<'_> {
    /// What functions lack of the wanted moments, one after the other.
    fn missing(&self, functions: &Values, wanted: &[Vec<f64>]) -> Vec<f64> {
        let mut missing = wanted.concat();
        for ((values, q), weight) in functions.iter().zip(&self.xi).zip(self.weights) {
            for &(j, value) in values {
                let moments = missing[j * self.terms..(j + 1) * self.terms].iter_mut().zip(q);
                moments.for_each(|(m, q)| *m -= weight * value * q);
            }
        }
        missing
    }

    fn changes(&self, alpha: &[f64], point: usize) -> Vec<(usize, f64)> {
        let bounds = &self.bounds[point];
        let along = |j: usize| dot(&self.xi[point], &alpha[j * self.terms..(j + 1) * self.terms]);
        let total = bounds.iter().map(|b| b.1).sum::<f64>().max(f64::MIN_POSITIVE);
        let mean = bounds.iter().map(|&(j, w)| w * along(j)).sum::<f64>() / total;
        bounds.iter().map(|&(j, w)| (j, w * (along(j) - mean))).collect()
    }

    fn apply(&self, alpha: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; alpha.len()];
        for (point, q) in self.xi.iter().enumerate() {
            for (j, change) in self.changes(alpha, point) {
                let sums = out[j * self.terms..(j + 1) * self.terms].iter_mut().zip(q);
                sums.for_each(|(o, q)| *o += self.weights[point] * change * q);
            }
        }
        out
    }

    fn solve(&self, missing: &[f64]) -> Vec<f64> {
        let mut rest = missing.to_vec();
        let (mut alpha, mut direction) = (vec![0.0; rest.len()], rest.clone());
        let mut square = dot(&rest, &rest);
        let enough = CLOSER * CLOSER * square;
        let (mut best, mut least) = (alpha.clone(), square);
        for _ in 0..4 * rest.len() {
            let image = self.apply(&direction);
            let curvature = dot(&direction, &image);
            if !(least > enough && square <= GROWN * GROWN * least && curvature > 0.0) {
                break;
            }
            let step = square / curvature;
            alpha.iter_mut().zip(&direction).for_each(|(a, d)| *a += step * d);
            rest.iter_mut().zip(&image).for_each(|(r, i)| *r -= step * i);
            let next = dot(&rest, &rest);
            direction.iter_mut().zip(&rest).for_each(|(d, r)| *d = r + next / square * *d);
            square = next;
            if square < least {
                (best, least) = (alpha.clone(), square);
            }
        }
        best
    }
}
