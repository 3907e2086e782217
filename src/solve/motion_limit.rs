//! Step limit for prescribed motions and loads. A rotating part moves along circles: the steps must follow the prescribed curve, not
//! just reach its end.

use crate::assembly::Model;
use crate::boundary::{ConstraintEquation, Constraints};
use crate::each::{Each, IntoEach};
use crate::term::{Amplitude, Curve, straight_until};

/// Curves shorter than this part of the longest one are rounding: points on the axis of a turn.
const AT_REST: f64 = 1e-9;

type Position<'a> = Box<dyn Fn(f64) -> Vec<f64> + 'a>;

/// The curves of all particles whose prescribed values are functions of the load factor, and of all loads that are.
pub(super) struct MotionLimit<'a> {
    motions: Vec<Curve<Position<'a>>>,
    loads: Vec<Curve<Position<'a>>>,
}

impl<'a> MotionLimit<'a> {
    /// The curves of equations and loads with functions for amplitudes; others are straight between the break points of their tables.
    pub(super) fn new(model: &Model, constraints: &'a Constraints) -> Self {
        let equations = constraints.equations();
        let particle = |equation: &ConstraintEquation| equation.dependent / model.dim();
        let mut moved: Vec<usize> = equations.iter().filter(|e| e.amplitude.is_function()).map(particle).collect();
        moved.sort_unstable();
        moved.dedup();
        // The equations of one particle that is moved along a curve, and the factors that make their values lengths.
        let mut each: Vec<Vec<(&'a ConstraintEquation, f64)>> = moved.mapped(|_| Vec::new());
        for equation in equations.iter().filter(|_| !moved.is_empty()) {
            if let Ok(curve) = moved.binary_search(&particle(equation)) {
                each[curve].push((equation, 1.0 / equation.measure()));
            }
        }
        let curve = |equations: Vec<(&'a ConstraintEquation, f64)>| {
            let value =
                |&(own, factor): &(&ConstraintEquation, f64), load| factor * own.target * own.amplitude.value(load);
            Curve::new(Box::new(move |load| equations.mapped(|own| value(own, load))) as Position<'a>)
        };
        let mut motions: Vec<_> = each.into_mapped(curve);
        let longest = motions.largest(|curve| curve.extent);
        motions.retain(|curve| curve.extent > AT_REST * longest);

        let mut amplitudes: Vec<Amplitude> = Vec::new();
        for own in model.terms().iter().flat_map(|term| term.amplitudes()).filter(Amplitude::is_function) {
            if !amplitudes.contains(&own) {
                amplitudes.push(own);
            }
        }
        let curve = |own: Amplitude| Curve::new(Box::new(move |load| vec![own.value(load)]) as Position<'a>);
        MotionLimit { motions, loads: amplitudes.into_mapped(curve) }
    }

    /// The load factor up to which a step from `now` to `target` may go: the first of as many equal parts as keep all curves
    /// near their straight lines, or are below `smallest`.
    pub(super) fn until(&self, now: f64, target: f64, smallest: f64) -> f64 {
        straight_until(now, target, smallest, |from, to| {
            self.motions.iter().chain(&self.loads).all(|curve| curve.is_straight(from, to))
        })
    }

    /// Whether the values at `target` lie nearer to those extrapolated from two loads than to those of the second one:
    /// beyond a sixth of a turn, or where curves turn back, they don't.
    pub(super) fn go_on(&self, [before, now]: [f64; 2], target: f64) -> bool {
        let ratio = (target - now) / (now - before);
        let (mut ahead, mut here) = (0.0, 0.0);
        for curve in &self.motions {
            let [a, b, c] = [before, now, target].map(|load| curve.at(load));
            for ((a, b), c) in a.iter().zip(&b).zip(&c) {
                ahead += (c - b - ratio * (b - a)).powi(2);
                here += (c - b).powi(2);
            }
        }
        !(ahead > here)
    }
}
