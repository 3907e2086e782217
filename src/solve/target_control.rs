//! Control of a functional with given targets.

use crate::error::Driven;

use super::continuation::Continuation;
use super::equilibrium::MET;
use super::functional::{Control, Functional};
use super::path::StepControlState;
use super::rejection::Rejection;
use super::state::State;
use super::step_loop::{Retry, StepRule};

/// A functional on its way to one target, halving where needed.
pub(super) struct TargetSteps<'a> {
    functional: &'a dyn Functional,
    index: usize,
    target: f64,
    /// The value at the first state of the path.
    start: f64,
    /// The next increment as a part of what is left.
    part: f64,
    /// Where the first step starts, where something may touch.
    touching: Option<State>,
}

impl<'a> TargetSteps<'a> {
    pub(super) fn new(run: &Continuation<'_, '_>, functional: &'a dyn Functional, index: usize, target: f64) -> Self {
        let started = run.control_state().filter(|control_state| control_state.reached == index);
        let part = started.map_or(1.0, |control_state| control_state.increment);
        let start = functional.value(&run.path.start.displacement);
        TargetSteps { functional, index, target, start, part, touching: None }
    }
}

impl StepRule for TargetSteps<'_> {
    fn is_done(&self, run: &Continuation<'_, '_>) -> bool {
        let TargetSteps { target, start, .. } = *self;
        let rest = target - self.functional.value(&run.state.displacement);
        rest.abs() <= MET * target.abs().max((target - start).abs())
    }

    fn next(&mut self, run: &Continuation<'_, '_>) -> [f64; 2] {
        let now = self.functional.value(&run.state.displacement);
        [now, if self.part >= 1.0 { self.target } else { now + (self.target - now) * self.part }]
    }

    fn attempt(&mut self, run: &mut Continuation<'_, '_>, [now, next]: [f64; 2]) -> Result<(usize, State), Rejection> {
        let before = run.previous.as_ref().map(|previous| self.functional.value(&previous.displacement));
        let ratio = before.map_or(0.0, |before| (next - now) / (now - before));
        if run.previous.is_none() && self.touching.is_none() {
            self.touching = run.touching();
        }
        let touching = self.touching.clone().filter(|_| run.previous.is_none());
        let start = touching.unwrap_or_else(|| run.predicted(ratio));
        run.attempt(start, Control::Functional(self.functional, next))
    }

    fn accepted(
        &mut self,
        run: &Continuation<'_, '_>,
        [now, next]: [f64; 2],
        iterations: usize,
        _state: &State,
    ) -> StepControlState {
        let stepping = &run.analysis.stepping;
        let arrived = next == self.target;
        // The part is one of what is left: keep the same increment, grow when quick.
        let growth = if iterations <= stepping.quick { stepping.growth } else { 1.0 };
        self.part = if arrived { 1.0 } else { (growth * (next - now) / (self.target - next)).min(1.0) };
        StepControlState { increment: self.part, reached: self.index + usize::from(arrived), arc: false }
    }

    fn rejected(&mut self, run: &Continuation<'_, '_>, _step: [f64; 2], rejection: Rejection) -> Retry {
        self.part *= 0.5;
        if self.part < rejection.least(run.analysis.stepping.smallest) {
            return Retry::Stall(rejection, Driven::ByControl);
        }
        Retry::Again
    }
}
