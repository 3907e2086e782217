//! The loop over the steps of a run, whatever is controlled.

use crate::error::{Cause, Driven};

use super::continuation::Continuation;
use super::driver::Driver;
use super::state::State;
use super::step_rule::{Retry, StepRule};

/// How a loop has ended.
pub(super) enum Outcome {
    /// At its last target.
    Done,
    /// With the run.
    Ended,
    /// Another quantity is to be controlled, with its first increment.
    Instead(Driver, f64),
}

impl Continuation<'_, '_> {
    /// Steps until the last target of a rule is reached.
    pub(super) fn follow(&mut self, rule: &mut StepRule<'_>) -> Outcome {
        while !rule.is_done(self) {
            let step = rule.next(self);
            if let Some(cause) = self.hindrance(step) {
                self.stall(cause, Driven::ByControl);
                return Outcome::Ended;
            }
            match rule.attempt(self, step) {
                Ok((iterations, state)) => {
                    let control_state = rule.accepted(self, step, iterations, &state);
                    if !self.accept(state, control_state) {
                        return Outcome::Ended;
                    }
                    if let Some(cause) = rule.ends_at(self) {
                        self.stall(cause, Driven::ByControl);
                        return Outcome::Ended;
                    }
                }
                Err(rejection) => match rule.rejected(self, step, rejection) {
                    Retry::Again => {}
                    Retry::Instead(driver, first) => return Outcome::Instead(driver, first),
                    Retry::Stall(rejection, driven) => {
                        self.stall(rejection, driven);
                        return Outcome::Ended;
                    }
                },
            }
        }
        Outcome::Done
    }

    /// Why a step is not attempted: no more are allowed, or it changes what is controlled by no more than its rounding, where halves
    /// round up to the whole and attempts would be made for ever.
    fn hindrance(&self, [now, next]: [f64; 2]) -> Option<Cause> {
        let most = self.analysis.stepping.steps;
        if self.path.steps.len() >= most {
            return Some(Cause::Steps(most));
        }
        let moves = (next - now).abs() > 4.0 * f64::EPSILON * now.abs() && next.is_finite();
        (!moves).then_some(Cause::Rounding { now, next })
    }

    /// The state from which an attempt under another load starts, `ratio` times the last step ahead on the line through the last two
    /// states: near a limit point the path is no smooth function of the load.
    pub(super) fn predicted(&self, ratio: f64) -> State {
        match &self.previous {
            Some(previous) if self.analysis.stepping.predict && ratio.is_finite() => {
                self.equilibrium.predict(previous, &self.state, ratio)
            }
            _ => self.state.clone(),
        }
    }

    /// The same where the load is unknown; `between` is the change of the controlled quantity from one state to another.
    pub(super) fn predicted_along(&self, ratio: f64, between: impl Fn(&State, &State) -> f64) -> State {
        match &self.previous {
            Some(previous) if self.analysis.stepping.predict && ratio.is_finite() => {
                self.ahead_of(previous, ratio, between)
            }
            _ => self.state.clone(),
        }
    }

    /// The state `ratio` times the last step ahead, on the parabola through the last three states; on the line through two where there are
    /// no more, or nothing says that a smooth path leads through the three: contacts come and go, amplitudes have break points.
    pub(super) fn ahead_of(&self, previous: &State, ratio: f64, between: impl Fn(&State, &State) -> f64) -> State {
        let before = match self.path.steps.as_slice() {
            [] | [_] => None,
            [_, _] => Some(&self.path.start),
            [.., before, _, _] => Some(&before.state),
        };
        let smooth = |before: &&State| {
            let is_between = |load: &f64| (load - before.load) * (load - self.state.load) <= 0.0;
            !self.equilibrium.model.is_unilateral() && !self.equilibrium.break_points.iter().any(is_between)
        };
        let bent = before.filter(smooth).and_then(|before| {
            let step = between(previous, &self.state) / between(before, previous);
            (step > 0.0 && step.is_finite()).then(|| bent([before, previous, &self.state], ratio, step))
        });
        self.equilibrium.predict(bent.as_ref().unwrap_or(previous), &self.state, ratio)
    }

    /// A step of the load factor in terms of the last one; 0 before there is one.
    pub(super) fn load_ratio(&self, target: f64) -> f64 {
        self.previous.as_ref().map_or(0.0, |p| (target - self.state.load) / (self.state.load - p.load))
    }
}

/// A state before the last of three from which a line leads to where the parabola through the three is `ratio` times the last step ahead:
/// with the last two steps $\Delta_1$ and $\Delta_2$, the second $q$ times as long, and $r$ = `ratio` that is
/// $r\,\Delta_2 + r\frac{(1 + r)q}{1 + q}(\Delta_2 - q\Delta_1)$ ahead.
fn bent([before, previous, state]: [&State; 3], ratio: f64, step: f64) -> State {
    let bend = (1.0 + ratio) * step / (1.0 + step);
    let back = |now: f64, last: f64, then: f64| {
        let change = now - last;
        now - (change + bend * (change - step * (last - then)))
    };
    let each = |now: &[f64], last: &[f64], then: &[f64]| -> Vec<f64> {
        now.iter().zip(last).zip(then).map(|((now, last), then)| back(*now, *last, *then)).collect()
    };
    let mut bent = previous.clone();
    bent.displacement = each(&state.displacement, &previous.displacement, &before.displacement);
    let terms = state.terms.iter().zip(&previous.terms).zip(&before.terms);
    for (own, ((now, last), then)) in bent.terms.iter_mut().zip(terms) {
        own.condensed = each(&now.condensed, &last.condensed, &then.condensed);
    }
    bent.load = back(state.load, previous.load, before.load);
    bent
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::term::TermState;
    use approx::assert_relative_eq;

    /// Three states of a parabola in what leads, steps of any lengths: the line from the bent state leads to the fourth.
    #[test]
    fn parabolas_are_predicted_exactly() {
        let on = |s: f64| State {
            load: 1.0 - 3.0 * s + 0.5 * s * s,
            displacement: vec![2.0 * s - s * s, 0.3 * s * s],
            terms: [1.0 + s * s, s]
                .map(|condensed| TermState { condensed: vec![condensed], ..TermState::default() })
                .to_vec(),
            ..State::default()
        };
        let [first, second, third, fourth] = [0.1, 0.4, 0.6, 1.5];
        let states = [on(first), on(second), on(third)];
        let ratio = (fourth - third) / (third - second);
        let from = bent([&states[0], &states[1], &states[2]], ratio, (third - second) / (second - first));
        let (now, wanted) = (&states[2], on(fourth));
        let ahead = |now: f64, from: f64| now + ratio * (now - from);
        assert_relative_eq!(ahead(now.load, from.load), wanted.load, max_relative = 1e-13);
        for (k, wanted) in wanted.displacement.iter().enumerate() {
            assert_relative_eq!(ahead(now.displacement[k], from.displacement[k]), *wanted, max_relative = 1e-13);
        }
        for (k, wanted) in wanted.terms.iter().enumerate() {
            let ahead = ahead(now.terms[k].condensed[0], from.terms[k].condensed[0]);
            assert_relative_eq!(ahead, wanted.condensed[0], max_relative = 1e-13);
        }
    }
}
