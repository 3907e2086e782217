//! Control of a deflection or the arc length, the load factor being unknown.

use crate::error::{Cause, Driven};
use crate::linear::vector::{dot, norm, root_mean_square};

use super::continuation::Continuation;
use super::driver::{Arc, Driver};
use super::functional::{Control, Functional};
use super::path::{Step, StepControlState};
use super::rejection::Rejection;
use super::state::State;
use super::step_loop::{Retry, StepRule};
use super::stepping::StepControl;

/// Steps along a deflection or an arc until the load factor passes 1, then the last step under the full load. Where a
/// deflection leads no further it ends early with the arc that may.
pub(super) struct PathSteps<'a> {
    driver: &'a Driver,
    /// The first increment.
    first: f64,
    increment: f64,
    rejected: bool,
    /// Whether an arc has taken the place of a deflection.
    instead: bool,
}

impl<'a> PathSteps<'a> {
    pub(super) fn new(run: &Continuation<'_, '_>, driver: &'a Driver, first: f64) -> Self {
        let instead = !is_deflection(driver) && run.analysis.stepping.control == StepControl::Auto;
        let started = run.control_state().filter(|control_state| !instead || control_state.arc);
        let increment = started.map_or(first, |control_state| control_state.increment);
        // Arcs of contacts begin with a step of the load, and are measured by its length.
        let length = |step: &Step| Arc { from: run.path.start.displacement.clone() }.value(&step.state.displacement);
        let measured = run.path.steps.first().filter(|_| begins_by_load(driver)).map(length);
        PathSteps { driver, first: measured.unwrap_or(first), increment, rejected: false, instead }
    }

    /// How far the next increment is in terms of the last one; NaN before the second step.
    fn ratio(&self, run: &Continuation<'_, '_>) -> f64 {
        let Some(previous) = &run.previous else { return f64::NAN };
        let (now, then) = (&run.state.displacement, &previous.displacement);
        match self.driver {
            Driver::Deflection(deflection) => self.increment / (deflection.value(now) - deflection.value(then)),
            Driver::Arc(_) => self.increment / Arc { from: then.clone() }.value(now),
        }
    }

    /// An attempt one increment ahead, the load factor being unknown.
    fn attempt_ahead(&self, run: &mut Continuation<'_, '_>, ratio: f64) -> Result<(usize, State), Rejection> {
        let increment = self.increment;
        match self.driver {
            Driver::Deflection(deflection) => {
                let target = deflection.value(&run.state.displacement) + increment;
                run.attempt(run.predicted(ratio), Control::Functional(deflection, target))
            }
            Driver::Arc(_) if run.previous.is_none() && begins_by_load(self.driver) => {
                let load = run.state.load + increment * (1.0 - run.state.load);
                run.attempt(run.state.clone(), Control::Load(load))
            }
            Driver::Arc(first) => {
                // Arcs need a direction: they are predicted whatever the stepping says of predictors.
                let start = match &run.previous {
                    Some(previous) => run.equilibrium.predict_own(previous, &run.state, ratio),
                    None => run.equilibrium.along(&run.state, first, increment / root_mean_square(first)),
                };
                let arc = Arc { from: run.state.displacement.clone() };
                let (iterations, state) = run.attempt(start, Control::Functional(&arc, increment))?;
                // The first arc has no last step: it goes where the load pushes.
                let now = &run.state.displacement;
                let change =
                    |to: &[f64], from: &[f64]| -> Vec<f64> { to.iter().zip(from).map(|(t, f)| t - f).collect() };
                let last = run.previous.as_ref().map_or(first.clone(), |previous| change(now, &previous.displacement));
                let next = change(&state.displacement, now);
                // Arcs that differ by more than 60° end nearer to where they began than to their prediction: half of one tells
                // whether the path turns there. One that runs back is none.
                let cosine = dot(&next, &last) / (norm(&next) * norm(&last));
                if cosine < if self.rejected { 0.0 } else { 0.5 } {
                    run.count_rejection();
                    return Err(Cause::Turned.into());
                }
                Ok((iterations, state))
            }
        }
    }
}

impl StepRule for PathSteps<'_> {
    fn is_done(&self, run: &Continuation<'_, '_>) -> bool {
        !(run.state.load < 1.0)
    }

    fn next(&mut self, run: &Continuation<'_, '_>) -> [f64; 2] {
        let now = match self.driver {
            Driver::Deflection(deflection) => deflection.value(&run.state.displacement),
            Driver::Arc(_) => root_mean_square(&run.state.displacement),
        };
        [now, now + self.increment]
    }

    fn attempt(&mut self, run: &mut Continuation<'_, '_>, _step: [f64; 2]) -> Result<(usize, State), Rejection> {
        let ratio = self.ratio(run);
        let load_ahead = run.previous.as_ref().map_or(0.0, |p| run.state.load + ratio * (run.state.load - p.load));
        let (iterations, state) = if load_ahead >= 1.0 {
            // The full load is within reach of this increment.
            run.attempt(run.predicted(run.load_ratio(1.0)), Control::Load(1.0))?
        } else {
            self.attempt_ahead(run, ratio)?
        };
        if state.load > 1.0 {
            // Overshot: the full load lies between the current state and this one.
            let part = (1.0 - run.state.load) / (state.load - run.state.load);
            let start = run.equilibrium.predict_own(&run.state, &state, part - 1.0);
            return run.attempt(start, Control::Load(1.0));
        }
        Ok((iterations, state))
    }

    fn accepted(
        &mut self,
        run: &Continuation<'_, '_>,
        _step: [f64; 2],
        iterations: usize,
        state: &State,
    ) -> StepControlState {
        let stepping = &run.analysis.stepping;
        if run.previous.is_none() && begins_by_load(self.driver) {
            self.first = Arc { from: run.state.displacement.clone() }.value(&state.displacement);
            self.increment = self.first;
        } else if iterations <= stepping.quick && !self.rejected {
            self.increment *= stepping.growth;
        }
        self.rejected = false;
        StepControlState { increment: self.increment, reached: 0, arc: self.instead }
    }

    fn rejected(&mut self, run: &Continuation<'_, '_>, _step: [f64; 2], rejection: Rejection) -> Retry {
        self.rejected = true;
        self.increment *= 0.5;
        if self.increment >= rejection.least(run.analysis.stepping.smallest) * self.first {
            return Retry::Again;
        }
        match run.arc_length_instead() {
            Some((arc, first)) if is_deflection(self.driver) => Retry::Instead(arc, first),
            _ => Retry::Stall(rejection, Driven::ByControl),
        }
    }

    fn ends_at(&self, run: &Continuation<'_, '_>) -> Option<Cause> {
        // The falling branch beyond a limit point is followed only under StepControl::ArcLength.
        let falls = run.previous.as_ref().is_some_and(|previous| run.state.load < previous.load);
        (self.instead && falls).then_some(Cause::LimitPoint)
    }
}

/// Whether the first arc is a step of the load: where something may touch.
fn begins_by_load(driver: &Driver) -> bool {
    matches!(driver, Driver::Arc(first) if first.is_empty())
}

fn is_deflection(driver: &Driver) -> bool {
    matches!(driver, Driver::Deflection(_))
}

impl Continuation<'_, '_> {
    /// The arc that a run that is gone on with has already followed in place of a deflection.
    pub(super) fn arc_taken_over(&self, driver: &Driver) -> Option<(Driver, f64)> {
        let taken_over = self.control_state().is_some_and(|control_state| control_state.arc);
        if taken_over && is_deflection(driver) { self.arc_length_instead() } else { None }
    }

    /// An arc in place of a deflection that leads no further: following loads turn with the body, and what is moved along
    /// the loads at the start may well have a largest value where nothing else has. The first arc is as long as the last
    /// step of the deflection.
    fn arc_length_instead(&self) -> Option<(Driver, f64)> {
        let steps = &self.path.steps;
        let taken = steps.iter().position(|step| step.control_state.arc).unwrap_or(steps.len());
        let now = &steps.get(taken.checked_sub(1)?)?.state;
        let before = if taken > 1 { &steps[taken - 2].state } else { &self.path.start };
        let change: Vec<f64> = now.displacement.iter().zip(&before.displacement).map(|(n, b)| n - b).collect();
        let length = root_mean_square(&change);
        (length > 0.0).then_some((Driver::Arc(change), length))
    }
}
