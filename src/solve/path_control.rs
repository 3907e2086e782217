//! Control along a path: of the load, of a deflection or the arc length, of a functional with given targets.

use crate::error::{Cause, Driven};
use crate::linear::vector::{dot, root_mean_square};

use super::continuation::Continuation;
use super::driver::{Arc, Driver, along, predict};
use super::functional::{Control, Functional};
use super::increment::MET;
use super::newton::StepSizeProbe;
use super::path::StepControlState;
use super::rejection::Rejection;
use super::state::State;
use super::stepping::StepControl;

/// Differences of load factors below this are rounding: a step takes them with it.
const LOAD_ROUNDING: f64 = 1e-9;

/// Part of the step of time that the error of the last one would allow.
const TIME_SAFETY: f64 = 0.9;
/// Least ratio of a step of time to the one before.
const TIME_SHRINK: f64 = 0.1;
/// Largest ratio of a step of time to the one before.
const TIME_GROWTH: f64 = 3.0;

impl<const D: usize> Continuation<'_, '_, D> {
    fn steps_left(&mut self) -> bool {
        let left = self.path.steps.len() < self.analysis.stepping.steps;
        if !left {
            self.stall(Cause::Steps(self.analysis.stepping.steps), Driven::ByControl);
        }
        left
    }

    /// What drives a run under load control: loads, or prescribed displacements alone.
    pub(super) fn driven(&self) -> Driven {
        let mut loads = vec![0.0; self.workspace.model.unknowns()];
        self.workspace.model.load_slope(&self.state.displacement, &self.state.condensed, self.state.load, &mut loads);
        if loads.iter().all(|slope| *slope == 0.0) && !self.workspace.equations.is_empty() {
            Driven::ByDisplacements
        } else {
            Driven::ByLoads
        }
    }

    /// Whether a step changes what is controlled by more than its rounding: below, halves round up to the whole and
    /// attempts would be made for ever.
    fn moves(&mut self, now: f64, next: f64) -> bool {
        let moves = (next - now).abs() > 4.0 * f64::EPSILON * now.abs() && next.is_finite();
        if !moves {
            self.stall(Cause::Rounding { now, next }, Driven::ByControl);
        }
        moves
    }

    /// The state from which an attempt starts, `ratio` times the last step ahead.
    fn predicted(&self, ratio: f64) -> State {
        match &self.previous {
            Some(previous) if self.analysis.stepping.predict && ratio.is_finite() => {
                predict(self.workspace.model, previous, &self.state, ratio)
            }
            _ => self.state.clone(),
        }
    }

    /// Load control: the full load first, halved on failure. Returns early with what should be controlled instead.
    pub(super) fn load_control(&mut self) -> Option<(Driver, f64)> {
        let stepping = self.analysis.stepping;
        let mut increment = self.control_state().map_or(stepping.first, |control_state| control_state.increment);
        // After a rejection one step keeps its increment, or the next one would be rejected again.
        let mut rejected = false;
        let timed = self.workspace.model.is_timed() && stepping.time_tolerance.is_finite();
        while self.state.load < 1.0 && self.steps_left() {
            let mut target = self.state.load + increment;
            // A rest smaller than a rounding of the load is part of this step.
            if target > 1.0 - LOAD_ROUNDING {
                target = 1.0;
            }
            // A step ends at each break point of an amplitude: a peak inside it would be missed.
            let now = self.state.load;
            if let Some(&break_point) =
                self.break_points.iter().find(|&&at| at > now + LOAD_ROUNDING && target > at - LOAD_ROUNDING)
            {
                target = break_point;
            }
            // A motion that returns within one step would not be seen: the step ends before.
            target = self.motion_limit.until(now, target, stepping.smallest);
            let terms = self.workspace.model.terms();
            target = terms.iter().fold(target, |target, term| term.farthest_load(now, target));
            if !self.moves(self.state.load, target) {
                return None;
            }
            let ratio = self.previous.as_ref().map_or(0.0, |p| (target - self.state.load) / (self.state.load - p.load));
            let cycling = self.previous.as_ref().is_some_and(|p| !self.motion_limit.go_on([p.load, now], target));
            let ratio = if self.at_break_point() || cycling { f64::NAN } else { ratio };
            match self.attempt(self.predicted(ratio), Control::Load(target)) {
                Ok((iterations, state)) => {
                    if timed {
                        let error = self.time_error(&state);
                        let taken = target - now;
                        // Third order in the step: what is left after a step of second order.
                        let factor = (TIME_SAFETY * error.powf(-1.0 / 3.0)).clamp(TIME_SHRINK, TIME_GROWTH);
                        if !(error <= 1.0) {
                            self.count_rejection();
                            rejected = true;
                            increment = factor.min(TIME_SAFETY) * taken;
                            if increment < stepping.smallest {
                                let tolerance = stepping.time_tolerance;
                                self.stall(Cause::TimeError { error: error * tolerance, tolerance }, self.driven());
                                return None;
                            }
                            continue;
                        }
                        // A step that ended early at a break point does not hold back those behind it.
                        let allowed = factor * taken;
                        increment = if taken < increment { allowed.max(increment) } else { allowed };
                        increment = increment.min(stepping.largest);
                        if iterations > stepping.quick || rejected {
                            increment = increment.min(taken);
                        }
                    } else if iterations <= stepping.quick && !rejected {
                        increment = (increment * stepping.growth).min(stepping.largest);
                    }
                    rejected = false;
                    if !self.accept(state, StepControlState { increment, ..StepControlState::default() }) {
                        return None;
                    }
                }
                Err(rejection) => {
                    if let StepSizeProbe::TooLarge(answer) = std::mem::take(&mut self.workspace.probe) {
                        if let Some(driver) = self.driver_after(&answer) {
                            return Some(driver);
                        }
                        // The load does no work on the tangent displacement: load control goes on.
                        continue;
                    }
                    rejected = true;
                    increment = 0.5 * (target - self.state.load);
                    if increment < rejection.least(stepping.smallest) {
                        self.stall(rejection, self.driven());
                        return None;
                    }
                }
            }
        }
        None
    }

    /// How far the next increment is in terms of the last one; NaN before the second step.
    fn ratio(&self, driver: &Driver, increment: f64) -> f64 {
        let Some(previous) = &self.previous else { return f64::NAN };
        let (now, then) = (&self.state.displacement, &previous.displacement);
        match driver {
            Driver::Deflection(deflection) => increment / (deflection.value(now) - deflection.value(then)),
            Driver::Arc(_) => increment / Arc { from: then.clone() }.value(now),
        }
    }

    /// An attempt one increment ahead, the load factor being unknown.
    fn controlled_attempt(&mut self, driver: &Driver, increment: f64) -> Result<(usize, State), Rejection> {
        let ratio = self.ratio(driver, increment);
        match driver {
            Driver::Deflection(deflection) => {
                let target = deflection.value(&self.state.displacement) + increment;
                self.attempt(self.predicted(ratio), Control::Functional(deflection, target))
            }
            Driver::Arc(first) => {
                let model = self.workspace.model;
                // Arcs need a direction: they are predicted whatever the stepping says of predictors.
                let start = match &self.previous {
                    Some(previous) => predict(model, previous, &self.state, ratio),
                    None => along(model, &self.state, first, increment / root_mean_square(first)),
                };
                let arc = Arc { from: self.state.displacement.clone() };
                let (iterations, state) = self.attempt(start, Control::Functional(&arc, increment))?;
                // The first arc has no last step: it goes where the load pushes.
                let last: Vec<f64> = match &self.previous {
                    Some(previous) => self
                        .state
                        .displacement
                        .iter()
                        .zip(&previous.displacement)
                        .map(|(now, then)| now - then)
                        .collect(),
                    None => first.clone(),
                };
                if dot(&state.displacement, &last) < dot(&self.state.displacement, &last) {
                    self.count_rejection();
                    return Err(Cause::Turned.into());
                }
                Ok((iterations, state))
            }
        }
    }

    /// Steps along a deflection or an arc until the load factor passes 1, then the last step under the full load. Where a
    /// deflection leads no further it ends early with the arc that may.
    pub(super) fn unknown_load_control(&mut self, driver: &Driver, first: f64) -> Option<(Driver, f64)> {
        let stepping = self.analysis.stepping;
        let deflected = matches!(driver, Driver::Deflection(_));
        let taken_over = self.control_state().is_some_and(|control_state| control_state.arc);
        if let (true, true, Some(arc)) = (deflected, taken_over, self.arc_length_instead()) {
            // A run that is gone on with.
            return Some(arc);
        }
        let instead = !deflected && stepping.control == StepControl::Auto;
        let mut increment = self
            .control_state()
            .filter(|control_state| !instead || control_state.arc)
            .map_or(first, |control_state| control_state.increment);
        let mut rejected = false;
        while self.state.load < 1.0 && self.steps_left() {
            let now = match driver {
                Driver::Deflection(deflection) => deflection.value(&self.state.displacement),
                Driver::Arc(_) => root_mean_square(&self.state.displacement),
            };
            if !self.moves(now, now + increment) {
                return None;
            }
            let ratio = self.ratio(driver, increment);
            let load_ahead =
                self.previous.as_ref().map_or(0.0, |p| self.state.load + ratio * (self.state.load - p.load));
            let outcome = if load_ahead >= 1.0 {
                // The full load is within reach of this increment.
                let ratio =
                    self.previous.as_ref().map_or(0.0, |p| (1.0 - self.state.load) / (self.state.load - p.load));
                self.attempt(self.predicted(ratio), Control::Load(1.0))
            } else {
                self.controlled_attempt(driver, increment)
            };
            let outcome = match outcome {
                Ok((_, state)) if state.load > 1.0 => {
                    // Overshot: the full load lies between the current state and this one.
                    let part = (1.0 - self.state.load) / (state.load - self.state.load);
                    let start = predict(self.workspace.model, &self.state, &state, part - 1.0);
                    self.attempt(start, Control::Load(1.0))
                }
                other => other,
            };
            match outcome {
                Ok((iterations, state)) => {
                    if iterations <= stepping.quick && !rejected {
                        increment *= stepping.growth;
                    }
                    rejected = false;
                    let falls = state.load < self.state.load;
                    if !self.accept(state, StepControlState { increment, reached: 0, arc: instead }) {
                        return None;
                    }
                    if instead && falls {
                        // The falling branch beyond a limit point is followed only under StepControl::ArcLength.
                        self.stall(Cause::LimitPoint, Driven::ByControl);
                        return None;
                    }
                }
                Err(rejection) => {
                    rejected = true;
                    increment *= 0.5;
                    if increment < rejection.least(stepping.smallest) * first {
                        if let (true, Some(arc)) = (deflected, self.arc_length_instead()) {
                            return Some(arc);
                        }
                        self.stall(rejection, Driven::ByControl);
                        return None;
                    }
                }
            }
        }
        None
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

    /// Brings a functional to a value, halving where needed; `false` ends the run.
    pub(super) fn reach(&mut self, functional: &dyn Functional, index: usize, target: f64) -> bool {
        self.controlled = true;
        let start = functional.value(&self.path.start.displacement);
        let mut part = self
            .control_state()
            .filter(|control_state| control_state.reached == index)
            .map_or(1.0, |control_state| control_state.increment);
        while self.steps_left() {
            let now = functional.value(&self.state.displacement);
            let rest = target - now;
            if rest.abs() <= MET * target.abs().max((target - start).abs()) {
                return true;
            }
            let next = if part >= 1.0 { target } else { now + rest * part };
            if !self.moves(now, next) {
                return false;
            }
            let ratio =
                self.previous.as_ref().map_or(0.0, |p| (next - now) / (now - functional.value(&p.displacement)));
            match self.attempt(self.predicted(ratio), Control::Functional(functional, next)) {
                Ok((iterations, state)) => {
                    let arrived = next == target;
                    // The part is one of what is left: keep the same increment, grow when quick.
                    let growth =
                        if iterations <= self.analysis.stepping.quick { self.analysis.stepping.growth } else { 1.0 };
                    part = if arrived { 1.0 } else { (growth * (next - now) / (target - next)).min(1.0) };
                    if !self.accept(
                        state,
                        StepControlState { increment: part, reached: index + usize::from(arrived), arc: false },
                    ) {
                        return false;
                    }
                    if arrived {
                        return true;
                    }
                }
                Err(rejection) => {
                    part *= 0.5;
                    if part < rejection.least(self.analysis.stepping.smallest) {
                        self.stall(rejection, Driven::ByControl);
                        return false;
                    }
                }
            }
        }
        false
    }
}
