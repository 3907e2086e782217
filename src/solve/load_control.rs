//! Control of the load factor: the full load first, halved on failure.

use crate::error::Cause;

use super::continuation::Continuation;
use super::equilibrium::LOAD_ROUNDING;
use super::functional::Control;
use super::path::StepControlState;
use super::rejection::Rejection;
use super::state::State;
use super::step_loop::{Retry, StepRule};
use super::stepping::Stepping;

/// Part of the step of time that the error of the last one would allow.
const TIME_SAFETY: f64 = 0.9;
/// Largest ratio of a step of time to the one before.
const TIME_GROWTH: f64 = 3.0;

/// The load factor from that of the current state to 1.
pub(super) struct LoadSteps {
    increment: f64,
    /// After a rejection one step keeps its increment, or the next one would be rejected again.
    rejected: bool,
    /// What the error of the last step of time says of the next one, in terms of the last; none where steps are taken as they come.
    time_factor: Option<f64>,
    timed: bool,
    stepping: Stepping,
}

impl LoadSteps {
    pub(super) fn new(run: &Continuation<'_, '_>) -> Self {
        let stepping = run.analysis.stepping;
        LoadSteps {
            increment: run.control_state().map_or(stepping.first, |control_state| control_state.increment),
            rejected: false,
            time_factor: None,
            timed: run.equilibrium.model.is_timed() && stepping.time_tolerance.is_finite(),
            stepping,
        }
    }
}

impl StepRule for LoadSteps {
    fn is_done(&self, run: &Continuation<'_, '_>) -> bool {
        !(run.state.load < 1.0)
    }

    fn next(&mut self, run: &Continuation<'_, '_>) -> [f64; 2] {
        let now = run.state.load;
        let mut target = now + self.increment;
        // A rest smaller than a rounding of the load is part of this step.
        if target > 1.0 - LOAD_ROUNDING {
            target = 1.0;
        }
        [now, run.equilibrium.farthest(now, target)]
    }

    fn attempt(
        &mut self,
        run: &mut Continuation<'_, '_>,
        [now, target]: [f64; 2],
    ) -> Result<(usize, State), Rejection> {
        let turns_back =
            run.previous.as_ref().is_some_and(|p| !run.equilibrium.motion_limit().go_on([p.load, now], target));
        let ratio = if run.at_break_point() || turns_back { f64::NAN } else { run.load_ratio(target) };
        self.time_factor = None;
        let (iterations, state) = run.attempt(run.predicted(ratio), Control::Load(target))?;
        if self.timed {
            let error = run.time_error(&state);
            // Third order in the step: what is left after a step of second order. An error that is no number tells nothing of the next.
            let factor = TIME_SAFETY * error.powf(-1.0 / 3.0);
            self.time_factor = (factor > 0.0).then_some(factor.min(TIME_GROWTH));
            if !(error <= 1.0) {
                run.count_rejection();
                let tolerance = self.stepping.time_tolerance;
                return Err(Cause::TimeError { error: error * tolerance, tolerance }.into());
            }
        }
        Ok((iterations, state))
    }

    fn accepted(
        &mut self,
        _run: &Continuation<'_, '_>,
        [now, target]: [f64; 2],
        iterations: usize,
        _state: &State,
    ) -> StepControlState {
        let Stepping { quick, growth, largest, .. } = self.stepping;
        let grows = iterations <= quick && !self.rejected;
        let taken = target - now;
        if let Some(factor) = self.time_factor {
            // A step that ended early at a break point does not hold back those behind it.
            let allowed = factor * taken;
            self.increment = if taken < self.increment { allowed.max(self.increment) } else { allowed };
            self.increment = self.increment.min(largest);
            if !grows {
                self.increment = self.increment.min(taken);
            }
        } else if grows {
            self.increment = (self.increment * growth).min(largest);
        }
        self.rejected = false;
        StepControlState { increment: self.increment, ..StepControlState::default() }
    }

    fn rejected(&mut self, run: &Continuation<'_, '_>, [now, target]: [f64; 2], rejection: Rejection) -> Retry {
        if let Rejection::TooLarge(answer) = &rejection {
            // Where the load does no work on the tangent displacement, load control goes on.
            return run.driver_after(answer).map_or(Retry::Again, |(driver, first)| Retry::Instead(driver, first));
        }
        self.rejected = true;
        let factor = self.time_factor.map_or(0.5, |factor| factor.min(TIME_SAFETY));
        self.increment = factor * (target - now);
        if self.increment < rejection.least(self.stepping.smallest) {
            return Retry::Stall(rejection, run.driven());
        }
        Retry::Again
    }
}
