//! The rule of steps: where the next one goes, and how long those behind it are, whatever leads.

use crate::each::Each;
use crate::error::{Cause, Driven};
use crate::linear::vector::{dot, norm, root_mean_square};

use super::continuation::Continuation;
use super::driver::{Arc, Driver};
use super::equilibrium::{LOAD_ROUNDING, MET};
use super::functional::{Control, Functional};
use super::path::StepControlState;
use super::rejection::Rejection;
use super::state::State;
use super::stepping::{StepControl, Stepping};

/// Part of the step of time that the error of the last one would allow.
const TIME_SAFETY: f64 = 0.9;
/// Largest ratio of a step of time to the one before.
const TIME_GROWTH: f64 = 3.0;

/// What leads a run.
#[derive(Clone, Copy)]
pub(super) enum Lead<'a> {
    /// The load factor, from that of the current state to 1: the full load first, halved on failure.
    Load,
    /// A deflection or an arc until the load factor passes 1, then the last step under the full load. Where a deflection leads no further
    /// it ends early with the arc that may.
    Driver(&'a Driver),
    /// A functional on its way from the value at the first state of the path to one of several targets, halving where needed.
    Target { functional: &'a dyn Functional, index: usize, start: f64, target: f64 },
}

/// The rule of steps.
pub(super) struct StepRule<'a> {
    lead: Lead<'a>,
    /// The first increment.
    first: f64,
    /// The next one: of what leads, or as a part of what is left to a target.
    increment: f64,
    /// After a rejection one step keeps its increment, or the next one would be rejected again.
    rejected: bool,
    /// What the error of the last step of time says of the next one, in terms of the last; none where steps are taken as they come.
    time_factor: Option<f64>,
    /// Where the first step to a target starts, where something may touch.
    touching: Option<State>,
}

/// What follows a rejected attempt.
pub(super) enum Retry {
    /// Another attempt.
    Again,
    /// Control of another quantity, with its first increment.
    Instead(Driver, f64),
    /// The end of the run.
    Stall(Rejection, Driven),
}

/// Iterations of an attempt, and the state behind it.
type Attempted = Result<(usize, State), Rejection>;

impl<'a> StepRule<'a> {
    /// A rule that begins with an increment, or goes on where the last step of the path left it.
    pub(super) fn new(run: &Continuation<'_, '_>, lead: Lead<'a>, first: f64) -> Self {
        let goes_on = |control_state: &StepControlState| match lead {
            Lead::Load => true,
            Lead::Driver(driver) => !run.is_instead(driver) || control_state.arc,
            Lead::Target { index, .. } => control_state.reached == index,
        };
        let increment = run.control_state().filter(goes_on).map_or(first, |control_state| control_state.increment);
        let mut rule = StepRule { lead, first, increment, rejected: false, time_factor: None, touching: None };
        let start = &run.path.start.displacement;
        let moved = run.path.steps.iter().find(|step| run.has_moved(&step.state));
        if let (Lead::Driver(Driver::Arc(first)), Some(step)) = (lead, moved)
            && first.is_empty()
        {
            // Arcs that begin with steps of the load are measured by the length of the first that moves anything.
            rule.first = Arc { from: start.clone() }.value(&step.state.displacement);
        }
        rule
    }

    /// Whether the next step of a run by arcs is one of the load: nothing has moved yet, and no tangent tells what will.
    fn begins_by_load(&self, run: &Continuation<'_, '_>) -> bool {
        matches!(self.lead, Lead::Driver(Driver::Arc(first)) if first.is_empty()) && !run.has_moved(&run.state)
    }

    /// Whether the last target is reached.
    pub(super) fn is_done(&self, run: &Continuation<'_, '_>) -> bool {
        let Lead::Target { functional, start, target, .. } = self.lead else { return !(run.state.load < 1.0) };
        let rest = target - functional.value(&run.state.displacement);
        rest.abs() <= MET * target.abs().max((target - start).abs())
    }

    /// What leads, now and after the next step.
    pub(super) fn next(&self, run: &Continuation<'_, '_>) -> [f64; 2] {
        let displacement = &run.state.displacement;
        match self.lead {
            Lead::Load => {
                let now = run.state.load;
                let target = now + self.increment;
                // A rest smaller than a rounding of the load is part of this step.
                [now, run.equilibrium.farthest(now, if target > 1.0 - LOAD_ROUNDING { 1.0 } else { target })]
            }
            Lead::Driver(driver) => {
                let now = match driver {
                    Driver::Deflection(deflection) => deflection.value(displacement),
                    Driver::Arc(_) => root_mean_square(displacement),
                };
                [now, now + self.increment]
            }
            Lead::Target { functional, target, .. } => {
                let now = functional.value(displacement);
                [now, if self.increment >= 1.0 { target } else { now + (target - now) * self.increment }]
            }
        }
    }

    /// Tries the step from one value to another.
    pub(super) fn attempt(&mut self, run: &mut Continuation<'_, '_>, [now, next]: [f64; 2]) -> Attempted {
        match self.lead {
            Lead::Load => self.attempt_load(run, [now, next]),
            Lead::Driver(driver) => self.attempt_ahead(run, driver),
            Lead::Target { functional, .. } => {
                let before = run.previous.as_ref().map(|previous| functional.value(&previous.displacement));
                let ratio = before.map_or(0.0, |before| (next - now) / (now - before));
                if run.previous.is_none() && self.touching.is_none() {
                    self.touching = run.touching();
                }
                let start = match (&self.touching, &run.previous) {
                    (Some(touching), None) => touching.clone(),
                    _ => run.predicted_along(ratio, |from, to| {
                        functional.value(&to.displacement) - functional.value(&from.displacement)
                    }),
                };
                run.attempt(start, Control::Functional(functional, next))
            }
        }
    }

    fn attempt_load(&mut self, run: &mut Continuation<'_, '_>, [now, target]: [f64; 2]) -> Attempted {
        let turns_back =
            run.previous.as_ref().is_some_and(|p| !run.equilibrium.motion_limit().go_on([p.load, now], target));
        let ratio = if run.at_break_point() || turns_back { f64::NAN } else { run.load_ratio(target) };
        self.time_factor = None;
        let (iterations, state) = run.attempt(run.predicted(ratio), Control::Load(target))?;
        let tolerance = run.analysis.stepping.time_tolerance;
        if run.equilibrium.model.is_timed() && tolerance.is_finite() {
            let error = run.time_error(&state);
            // Third order in the step: what is left after a step of second order. An error that is no number tells nothing of the next.
            let factor = TIME_SAFETY * error.powf(-1.0 / 3.0);
            self.time_factor = (factor > 0.0).then_some(factor.min(TIME_GROWTH));
            if !(error <= 1.0) {
                run.count_rejection();
                return Err(Cause::TimeError { error: error * tolerance, tolerance }.into());
            }
        }
        Ok((iterations, state))
    }

    /// An attempt one increment ahead, the load factor being unknown, or at the full load where that is within reach.
    fn attempt_ahead(&mut self, run: &mut Continuation<'_, '_>, driver: &Driver) -> Attempted {
        let increment = self.increment;
        // How far the next increment is in terms of the last one; NaN before the second step.
        let ratio = run.previous.as_ref().map_or(f64::NAN, |previous| match driver {
            Driver::Deflection(deflection) => {
                increment / (deflection.value(&run.state.displacement) - deflection.value(&previous.displacement))
            }
            Driver::Arc(_) => increment / Arc { from: previous.displacement.clone() }.value(&run.state.displacement),
        });
        let load_ahead = run.previous.as_ref().map_or(0.0, |p| run.state.load + ratio * (run.state.load - p.load));
        let (iterations, state) = match driver {
            _ if self.begins_by_load(run) => {
                let load = run.state.load + increment * (1.0 - run.state.load);
                run.attempt(run.state.clone(), Control::Load(load))?
            }
            _ if load_ahead >= 1.0 => run.attempt(run.predicted(run.load_ratio(1.0)), Control::Load(1.0))?,
            Driver::Deflection(deflection) => {
                let target = deflection.value(&run.state.displacement) + increment;
                let of = |state: &State| deflection.value(&state.displacement);
                let start = run.predicted_along(ratio, |from, to| of(to) - of(from));
                run.attempt(start, Control::Functional(deflection, target))?
            }
            Driver::Arc(first) => self.attempt_arc(run, first, ratio)?,
        };
        if state.load > 1.0 {
            // Overshot: the full load lies between the current state and this one.
            let part = (1.0 - run.state.load) / (state.load - run.state.load);
            let start = run.equilibrium.predict(&run.state, &state, part - 1.0);
            return run.attempt(start, Control::Load(1.0));
        }
        Ok((iterations, state))
    }

    fn attempt_arc(&self, run: &mut Continuation<'_, '_>, first: &[f64], ratio: f64) -> Attempted {
        let increment = self.increment;
        // Arcs need a direction: they are predicted whatever the stepping says of predictors.
        let start = match &run.previous {
            Some(previous) => run
                .ahead_of(previous, ratio, |from, to| Arc { from: from.displacement.clone() }.value(&to.displacement)),
            None => run.equilibrium.along(&run.state, first, increment / root_mean_square(first)),
        };
        let arc = Arc { from: run.state.displacement.clone() };
        let (iterations, state) = run.attempt(start, Control::Functional(&arc, increment))?;
        // The first arc has no last step: it goes where the load pushes.
        let now = &run.state.displacement;
        let last = run.previous.as_ref().map_or(first.to_vec(), |previous| change(now, &previous.displacement));
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

    /// Chooses the next increment after a step that is taken.
    pub(super) fn accepted(
        &mut self,
        run: &Continuation<'_, '_>,
        [now, next]: [f64; 2],
        iterations: usize,
        state: &State,
    ) -> StepControlState {
        let Stepping { quick, growth, largest, .. } = run.analysis.stepping;
        let grows = iterations <= quick && !self.rejected;
        let (mut reached, mut arc) = (0, false);
        match self.lead {
            Lead::Load => {
                let taken = next - now;
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
            }
            Lead::Driver(driver) => {
                if self.begins_by_load(run) {
                    if run.has_moved(state) {
                        self.first = Arc { from: run.path.start.displacement.clone() }.value(&state.displacement);
                        self.increment = self.first;
                    } else {
                        // The same part of the load again, or a larger one, in terms of what is left of it.
                        let growth = if grows { growth } else { 1.0 };
                        self.increment = (growth * self.increment / (1.0 - self.increment)).min(1.0);
                    }
                } else if grows {
                    self.increment *= growth;
                }
                arc = run.is_instead(driver);
            }
            Lead::Target { index, target, .. } => {
                let arrived = next == target;
                // The part is one of what is left: keep the same increment, grow when quick.
                let growth = if grows { growth } else { 1.0 };
                self.increment = if arrived { 1.0 } else { (growth * (next - now) / (target - next)).min(1.0) };
                reached = index + usize::from(arrived);
            }
        }
        self.rejected = false;
        StepControlState { increment: self.increment, reached, arc }
    }

    /// Chooses the next increment after a rejected attempt, or says how the run goes on.
    pub(super) fn rejected(
        &mut self,
        run: &Continuation<'_, '_>,
        [now, next]: [f64; 2],
        rejection: Rejection,
    ) -> Retry {
        if let (Lead::Load, Rejection::TooLarge(answer)) = (self.lead, &rejection) {
            // Where the load does no work on the tangent displacement, load control goes on.
            return run.driver_after(answer).map_or(Retry::Again, |(driver, first)| Retry::Instead(driver, first));
        }
        let mut least = rejection.least(run.analysis.stepping.smallest);
        match self.lead {
            Lead::Load => {
                self.increment = self.time_factor.map_or(0.5, |factor| factor.min(TIME_SAFETY)) * (next - now);
            }
            Lead::Driver(_) => {
                self.increment *= 0.5;
                least *= self.first;
            }
            Lead::Target { .. } => self.increment *= 0.5,
        }
        // What is left of the way to a target may always be taken in longer steps.
        self.rejected = !matches!(self.lead, Lead::Target { .. });
        if self.increment >= least {
            return Retry::Again;
        }
        match self.lead {
            Lead::Load => Retry::Stall(rejection, run.driven()),
            Lead::Driver(Driver::Deflection(_)) => match run.arc_length_instead() {
                Some((arc, first)) => Retry::Instead(arc, first),
                None => Retry::Stall(rejection, Driven::ByControl),
            },
            _ => Retry::Stall(rejection, Driven::ByControl),
        }
    }

    /// Why the run ends with the last step.
    pub(super) fn ends_at(&self, run: &Continuation<'_, '_>) -> Option<Cause> {
        // The falling branch beyond a limit point is followed only under StepControl::ArcLength.
        let falls = run.previous.as_ref().is_some_and(|previous| run.state.load < previous.load);
        let instead = matches!(self.lead, Lead::Driver(driver) if run.is_instead(driver));
        (instead && falls).then_some(Cause::LimitPoint)
    }
}

fn change(to: &[f64], from: &[f64]) -> Vec<f64> {
    to.paired(from, |t, f| t - f)
}

impl Continuation<'_, '_> {
    /// Whether an arc has taken the place of a deflection.
    fn is_instead(&self, driver: &Driver) -> bool {
        matches!(driver, Driver::Arc(_)) && self.analysis.stepping.control == StepControl::Auto
    }

    /// The arc that a run that is gone on with has already followed in place of a deflection.
    pub(super) fn arc_taken_over(&self, driver: &Driver) -> Option<(Driver, f64)> {
        let taken_over = self.control_state().is_some_and(|control_state| control_state.arc);
        if taken_over && matches!(driver, Driver::Deflection(_)) { self.arc_length_instead() } else { None }
    }

    /// An arc in place of a deflection that leads no further: following loads turn with the body, and what is moved along
    /// the loads at the start may well have a largest value where nothing else has. The first arc is as long as the last
    /// step of the deflection.
    fn arc_length_instead(&self) -> Option<(Driver, f64)> {
        let steps = &self.path.steps;
        let taken = steps.iter().position(|step| step.control_state.arc).unwrap_or(steps.len());
        let now = &steps.get(taken.checked_sub(1)?)?.state;
        let before = if taken > 1 { &steps[taken - 2].state } else { &self.path.start };
        let change = change(&now.displacement, &before.displacement);
        let length = root_mean_square(&change);
        (length > 0.0).then_some((Driver::Arc(change), length))
    }
}
