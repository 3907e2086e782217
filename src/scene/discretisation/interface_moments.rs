//! Values of the functions of multipliers on the far side of an interface, corrected to the measures and first moments of the near
//! side.

use std::collections::HashMap;

use crate::each::{Each, add};
use crate::geometry::Vec3;
use crate::linear::vector::dot;

use super::interface::{Face, Traces};

/// Rounds of corrections: each leaves about a part [`CLOSER`] of what was missing, until rounding is all that is left.
const ROUNDS: usize = 4;

/// Conjugate gradients end with this part of what they began with.
const CLOSER: f64 = 1e-7;

/// The system is singular: what rounding puts beyond its range can't be met, and iterations that try grow without bound. They end
/// with this many times the least residual, and the solution is that of the least.
const GROWN: f64 = 10.0;

/// Values of functions: for each point (number, value).
type Values = Vec<Vec<(usize, f64)>>;

/// The points of a face, by which functions have measures and first moments.
pub(crate) struct Weighed<'a> {
    weights: &'a [f64],
    /// $\xi = (1, (X - X_0)/L)$ at each point.
    xi: Vec<[f64; 4]>,
}

impl<'a> Weighed<'a> {
    /// Moments about a point, lengths over `size`.
    pub(crate) fn new(face: &'a Face, centre: &Vec3, size: f64) -> Self {
        let linear = |x: &Vec3| {
            let offset = (x - centre) / size;
            [1.0, offset[0], offset[1], offset[2]]
        };
        Weighed { weights: &face.weights, xi: face.positions().mapped(linear) }
    }

    /// Measure and first moments of the face.
    pub(crate) fn totals(&self) -> Vec<f64> {
        let mut totals = vec![0.0; 4];
        self.add(&vec![vec![(0, 1.0)]; self.xi.len()], 1.0, &mut totals);
        totals
    }

    /// Adds those of functions, one after the other.
    fn add(&self, functions: &Values, sign: f64, moments: &mut [f64]) {
        for ((values, q), weight) in functions.iter().zip(&self.xi).zip(self.weights) {
            for &(j, value) in values {
                add(&mut moments[4 * j..], sign * weight * value, q);
            }
        }
    }
}

/// Adds what is missing of the measures and first moments of each function of the mortar side at the points of the other one: the smallest
/// change in terms of the functions themselves that leaves their sums one, by conjugate gradients.
pub(crate) fn correct(traces: &mut Traces, mortar: &Face, [own, at]: [&Weighed<'_>; 2]) {
    let number: HashMap<u32, usize> = mortar.order.0.iter().enumerate().map(|(k, &p)| (p, k)).collect();
    let numbered = |traces: &Traces| -> Values { traces.mapped(|traces| traces.mapped(|&(p, v)| (number[&p], v))) };
    let (mut functions, mut wanted) = (numbered(traces), vec![0.0; 4 * number.len()]);
    own.add(&numbered(&mortar.cells.traces), 1.0, &mut wanted);
    let missing_of = |functions: &Values| {
        let mut missing = wanted.clone();
        at.add(functions, -1.0, &mut missing);
        missing
    };
    let bounds = functions.mapped(|values| values.mapped(|&(j, v)| (j, v.max(0.0))));
    let system = Changes { bounds, at };
    let mut missing = missing_of(&functions);
    for _ in 0..ROUNDS {
        let (mut corrected, changes) = (functions.clone(), system.of(&system.solve(&missing)));
        for (values, changes) in corrected.iter_mut().zip(changes) {
            values.iter_mut().zip(changes).for_each(|(entry, change)| entry.1 += change.1);
        }
        let left = missing_of(&corrected);
        if !(dot(&left, &left) < dot(&missing, &missing)) {
            break;
        }
        (functions, missing) = (corrected, left);
    }
    for (traces, functions) in traces.iter_mut().zip(functions) {
        traces.iter_mut().zip(functions).for_each(|(trace, function)| trace.1 = function.1);
    }
}

/// Changes $\delta\Theta_J = \omega_J\\,(\alpha_J\cdot\xi - \sum_K\omega_K\\,\alpha_K\cdot\xi/\sum_K\omega_K)$ of functions.
struct Changes<'a> {
    /// $\omega_J$ at each point.
    bounds: Values,
    at: &'a Weighed<'a>,
}

impl Changes<'_> {
    fn of(&self, alpha: &[f64]) -> Values {
        let at_point = |(bounds, xi): (&Vec<(usize, f64)>, &[f64; 4])| {
            let along = |j: usize| dot(xi, &alpha[4 * j..]);
            let total = bounds.summed(|b| b.1).max(f64::MIN_POSITIVE);
            let mean = bounds.summed(|&(j, w)| w * along(j)) / total;
            bounds.mapped(|&(j, w)| (j, w * (along(j) - mean)))
        };
        self.bounds.iter().zip(&self.at.xi).map(at_point).collect()
    }

    fn solve(&self, missing: &[f64]) -> Vec<f64> {
        let mut rest = missing.to_vec();
        let (mut alpha, mut direction) = (vec![0.0; rest.len()], rest.clone());
        let mut square = dot(&rest, &rest);
        let enough = CLOSER * CLOSER * square;
        let (mut best, mut least) = (alpha.clone(), square);
        for _ in 0..4 * rest.len() {
            let mut image = vec![0.0; rest.len()];
            self.at.add(&self.of(&direction), 1.0, &mut image);
            let curvature = dot(&direction, &image);
            if !(least > enough && square <= GROWN * GROWN * least && curvature > 0.0) {
                break;
            }
            let step = square / curvature;
            add(&mut alpha, step, &direction);
            add(&mut rest, -step, &image);
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
