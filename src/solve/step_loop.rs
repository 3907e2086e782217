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
            if !self.steps_left() || !self.moves(step) {
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

    fn steps_left(&mut self) -> bool {
        let left = self.path.steps.len() < self.analysis.stepping.steps;
        if !left {
            self.stall(Cause::Steps(self.analysis.stepping.steps), Driven::ByControl);
        }
        left
    }

    /// Whether a step changes what is controlled by more than its rounding: below, halves round up to the whole and
    /// attempts would be made for ever.
    fn moves(&mut self, [now, next]: [f64; 2]) -> bool {
        let moves = (next - now).abs() > 4.0 * f64::EPSILON * now.abs() && next.is_finite();
        if !moves {
            self.stall(Cause::Rounding { now, next }, Driven::ByControl);
        }
        moves
    }

    /// The state from which an attempt starts, `ratio` times the last step ahead.
    pub(super) fn predicted(&self, ratio: f64) -> State {
        match &self.previous {
            Some(previous) if self.analysis.stepping.predict && ratio.is_finite() => {
                self.equilibrium.predict_own(previous, &self.state, ratio)
            }
            _ => self.state.clone(),
        }
    }

    /// A step of the load factor in terms of the last one; 0 before there is one.
    pub(super) fn load_ratio(&self, target: f64) -> f64 {
        self.previous.as_ref().map_or(0.0, |p| (target - self.state.load) / (self.state.load - p.load))
    }
}
