//! A line search on the slope of the potential along a Newton step.

use crate::assembly::Model;
use crate::linear::vector::dot;

use super::increment::{Increment, MET};
use super::state::State;

/// Whether Newton's steps are shortened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LineSearch {
    /// Whole steps, up to the step limiter.
    #[default]
    Off,
    /// Steps end where the slope $g(s) = \delta d\cdot r(d + s\\,\delta d)$ of the potential along them has fallen to
    /// 0.8 of its first value: in energies of the displacements alone, under load control, and once the prescribed
    /// displacements are met. Whole steps elsewhere.
    ///
    /// Pressures that are iterates of Newton ([`PressureField::Pointwise`](crate::term::PressureField) and the
    /// projected ones) make the potential a saddle: its slope along a good step may well rise, and shortening such
    /// steps was measured to cost three to seven times the iterations.
    Slope,
}

/// Part of the first slope that may be left; the usual loose value (Bonet & Wood, §9.6.2: 0.5; Crisfield: 0.8).
const LEFT: f64 = 0.8;
/// Residuals evaluated in one search; each costs about a tenth of a factorisation.
const EVALUATIONS: usize = 5;
/// The shortest step relative to the bound of the step limiter; a shorter one is better cut by halving the load.
const SHORTEST: f64 = 0.05;

/// One Newton step with everything that changes along it.
pub(super) struct Ahead<'a> {
    pub next: &'a Increment,
    pub violation: &'a [f64],
}

/// The step factor in (0, bound] at which the slope of the potential is small enough; `force` is $-r$ where the step starts.
pub(super) fn search<const D: usize>(
    model: &Model<D>,
    state: &State,
    force: &[f64],
    ahead: &Ahead<'_>,
    bound: f64,
) -> f64 {
    let step = &ahead.next.step;
    let size = dot(step, step).sqrt();
    if state.condensed.iter().any(|l| !l.is_empty()) || ahead.violation.iter().any(|g| g.abs() > MET * size) {
        return bound;
    }
    // Reactions do no work on a step that keeps what is prescribed.
    let slope = |at: &State| dot(step, &model.residual(&at.displacement, &at.condensed, at.load));
    let first = -dot(step, force);
    if !(first < 0.0) {
        return bound;
    }
    let (mut low, mut at_low) = (0.0, first);
    let (mut high, mut at_high) = (f64::NAN, f64::NAN);
    let mut factor = bound;
    for _ in 0..EVALUATIONS {
        let mut trial = state.clone();
        ahead.next.apply(factor, &mut trial);
        let value = slope(&trial);
        if value.abs() <= LEFT * first.abs() {
            return factor;
        }
        // Falling on at the bound: further on lies what the guard forbids.
        if value < 0.0 && factor >= bound {
            return bound;
        }
        if value < 0.0 {
            (low, at_low) = (factor, value);
        } else {
            (high, at_high) = (factor, value);
        }
        // The false position, kept away from the ends; not finite ahead counts as far too far.
        let part = if at_high.is_finite() { at_low / (at_low - at_high) } else { 0.1 };
        factor = low + (high - low) * part.clamp(0.1, 0.9);
    }
    factor.max(SHORTEST * bound)
}
