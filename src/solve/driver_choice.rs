//! Which quantity drives a run: the load, a deflection or the arc.

use crate::each::Each;
use crate::linear::vector::root_mean_square;

use super::continuation::Continuation;
use super::driver::Driver;
use super::functional::{Control, Deflection, Functional};
use super::rejection::Rejection;
use super::settings::Newton;
use super::state::State;
use super::stepping::{FIRST_GRADIENT, StepControl, TOO_LARGE};

/// Part of the load by which the first step goes of a control that leaves the load free, where something may touch or no tangent leads.
const FIRST_LOAD: f64 = 1.0 / 16.0;

impl<'a, 'o> Continuation<'a, 'o> {
    /// The controlled quantity and its first increment, where that is not the load.
    pub(super) fn driver(&mut self) -> Option<(Driver, f64)> {
        let stepping = self.analysis.stepping;
        if stepping.control == StepControl::Load {
            return None;
        }
        // The tangent displacement does not predict contact.
        if stepping.control == StepControl::Auto && self.equilibrium.model.is_unilateral() {
            return None;
        }
        // Steps of the load are steps of time.
        if self.equilibrium.model.is_timed() {
            return None;
        }
        // Amplitudes with break points may let the load fall or rest, which control of a deflection could not follow.
        if stepping.control == StepControl::Auto && !self.equilibrium.break_points.is_empty() {
            return None;
        }
        // At the first state, wherever the path has come to by now: a resumed run controls the same deflection.
        let start = &self.path.start;
        let loads = self.equilibrium.model.at_own(start).load_slope();
        let total: f64 = loads.summed(|f| f.abs());
        if total == 0.0 && stepping.control == StepControl::Auto {
            // Driven by prescribed displacements alone.
            return None;
        }
        if stepping.control == StepControl::Auto {
            // Where they are driven as well, the mean displacement along the load says nothing of the path.
            let mut moved = Vec::new();
            self.equilibrium.equations.load_slope(start.load, &mut moved);
            if moved.iter().any(|slope| *slope != 0.0) {
                return None;
            }
        }
        let model = self.equilibrium.model;
        // The first arc is as long as a first step of the load leads.
        let by_load = || Some((Driver::Arc(Vec::new()), FIRST_LOAD.min(stepping.first)));
        let arcs = stepping.control == StepControl::ArcLength;
        if arcs && (model.is_unilateral() || self.follows_functions()) {
            return by_load();
        }
        let follows =
            model.terms().iter().map(|term| term.layout()).any(|layout| layout.has_matrix && layout.follows_load);
        let whole = stepping.control == StepControl::Auto && stepping.first >= 1.0;
        if whole && !follows {
            // The first step of the first attempt is the tangent displacement itself.
            self.probes = true;
            return if self.path.steps.is_empty() { None } else { self.driver_of_first_run() };
        }
        let probe = self.equilibrium.tangent_displacement(start);
        if self.path.steps.is_empty() {
            self.count_iterations();
        } else {
            // Counted by the first run.
            self.equilibrium.iterations = self.path.iterations;
        }
        let rest = 1.0 - self.path.start.load;
        // Where the tangent is singular (a mechanism stiffened only by its loads) the load is controlled; so is the first step of arcs
        // there, and where the load does not act yet.
        let Ok(probe) = probe else { return if arcs { by_load() } else { None } };
        let gradient = self.equilibrium.model.largest_gradient(&probe) * rest;
        if arcs {
            let part = stepping.first.min(FIRST_GRADIENT / gradient) * rest;
            let first = part * root_mean_square(&probe);
            return if first > 0.0 && first.is_finite() { Some((Driver::Arc(probe), first)) } else { by_load() };
        }
        if gradient <= TOO_LARGE || !gradient.is_finite() {
            return None;
        }
        self.deflection(&loads, &probe, rest, gradient)
    }

    /// Whether something follows a function of the load factor: what it does over a step does not follow from its slope at the start, which
    /// is that of a difference and may well vanish.
    fn follows_functions(&self) -> bool {
        let model = self.equilibrium.model;
        let mut equations = self.equilibrium.equations.equations().iter();
        equations.any(|equation| equation.amplitude.is_function())
            || model.terms().iter().flat_map(|term| term.amplitudes()).any(|amplitude| amplitude.is_function())
    }

    /// A state a little way along the load, where something may touch: no tangent at a first state tells what will, and a control
    /// that leaves the load free could go the other way, where nothing does.
    pub(super) fn touching(&mut self) -> Option<State> {
        if !self.equilibrium.model.is_unilateral() {
            return None;
        }
        let mut part = FIRST_LOAD;
        while part > self.analysis.stepping.smallest {
            let load = self.state.load + part * (1.0 - self.state.load);
            match self.attempt(self.state.clone(), Control::Load(load)) {
                Ok((_, state)) => return Some(state),
                Err(_) => part *= 0.25,
            }
        }
        None
    }

    /// The mean displacement along the loads, positive for positive ones, and its first increment: a part of that by the tangent
    /// displacement, `rest` times `answer`, whose largest gradient is given.
    fn deflection(&self, loads: &[f64], answer: &[f64], rest: f64, gradient: f64) -> Option<(Driver, f64)> {
        let total: f64 = loads.summed(|f| f.abs());
        let deflection = Deflection { weights: loads.mapped(|f| -f / total) };
        let first = deflection.value(answer) * rest * FIRST_GRADIENT / gradient;
        (first > 0.0 && first.is_finite()).then_some((Driver::Deflection(deflection), first))
    }

    /// The driver of the first attempt of the run that is resumed.
    fn driver_of_first_run(&mut self) -> Option<(Driver, f64)> {
        let mut attempt = self.path.start.clone();
        let once = Newton { iterations: 1, ..self.newton() };
        let outcome = self.equilibrium.newton(&once, &mut attempt, &self.ahead(Control::Load(1.0), false), &mut ());
        self.probes = false;
        // Counted by the first run.
        self.equilibrium.iterations = self.path.iterations;
        match outcome {
            Err(Rejection::TooLarge(answer)) => self.driver_after(&answer),
            _ => None,
        }
    }

    /// What is controlled where the first step of the first attempt was too large.
    pub(super) fn driver_after(&self, answer: &[f64]) -> Option<(Driver, f64)> {
        let (model, start) = (self.equilibrium.model, &self.path.start);
        let loads = model.at_own(start).load_slope();
        self.deflection(&loads, answer, 1.0, model.largest_gradient(answer))
    }
}
