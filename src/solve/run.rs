//! Runs of an analysis.

use crate::assembly::Model;
use crate::boundary::Constraints;
use crate::error::{Error, Incompatible, Invalid, SolveError};

use super::analysis::Analysis;
use super::continuation::Continuation;
use super::functional::Functional;
use super::path::{EquilibriumPath, Observer};
use super::state::State;
use super::step_loop::Outcome;
use super::step_rule::{Lead, StepRule};

impl Analysis {
    /// Follows the load factor from 0 to 1, starting at rest.
    ///
    /// # Errors
    /// For a model without terms or unknowns, bad settings, rows that depend on each other, loads that
    /// are not finite. A stalled analysis is no error: the path so far is returned with its ending.
    pub fn run(
        &self,
        model: &Model,
        equations: &Constraints,
        observer: &mut dyn Observer,
    ) -> Result<EquilibriumPath, Error> {
        self.resume(model, equations, State::at_rest(model, equations), observer)
    }

    /// Goes on from the last step of a path that [`run`](Analysis::run) left unfinished, with the same bits as if it had never been
    /// broken off (on the same machine and build), or begins at a given state: follows the load factor to 1.
    ///
    /// The path comes back with the new steps behind the old ones; only the first and the last three of its states
    /// are used. A path that has reached its last load comes back as it is. Nothing but the path is needed:
    /// factors and scalings are made afresh within every step. Stepping and strategies may be others than those of the
    /// first run, model and conditions may not.
    ///
    /// # Errors
    /// As [`run`](Analysis::run), and where a state does not fit the model, is inverted, or lies beyond load factor 1, where the last
    /// state of the path is no equilibrium of this model under these conditions, or has another energy than was recorded: the path is
    /// that of another problem.
    pub fn resume(
        &self,
        model: &Model,
        equations: &Constraints,
        path: impl Into<EquilibriumPath>,
        observer: &mut dyn Observer,
    ) -> Result<EquilibriumPath, Error> {
        let path = path.into();
        self.validate(model, equations, &path)?;
        ensure!(
            !(path.steps.is_empty() && path.start.load > 1.0),
            Invalid::new(
                "load factor of the first state",
                path.start.load,
                "start from at most 1, where the run ends; Analysis::run_controlled goes on beyond",
            )
        );
        let mut run = Continuation::new(self, model, equations, path, observer)?;
        run.check_recorded()?;
        let mut control = match run.driver() {
            Some((driver, first)) => Outcome::Instead(driver, first),
            None if !run.begins() => Outcome::Ended,
            None => run.follow(&mut StepRule::new(&run, Lead::Load, self.stepping.first)),
        };
        while let Outcome::Instead(driver, first) = control {
            control = match run.arc_taken_over(&driver) {
                Some((arc, length)) => Outcome::Instead(arc, length),
                None => run.follow(&mut StepRule::new(&run, Lead::Driver(&driver), first)),
            };
        }
        Ok(run.path)
    }

    /// Follows a functional of the displacement through the given values, from a given state or the last step of a path that was left
    /// unfinished, as [`resume`](Analysis::resume) does; the load factor is unknown and may pass limit points or end anywhere. To go on,
    /// give the functional and targets of the first run.
    ///
    /// Values between two targets are inserted by halving where Newton needs them; they are part of the path.
    ///
    /// # Errors
    /// As [`resume`](Analysis::resume).
    pub fn run_controlled(
        &self,
        model: &Model,
        equations: &Constraints,
        path: impl Into<EquilibriumPath>,
        functional: &dyn Functional,
        targets: &[f64],
        observer: &mut dyn Observer,
    ) -> Result<EquilibriumPath, Error> {
        let path = path.into();
        self.validate(model, equations, &path)?;
        if let Some(given) = functional.unknowns().filter(|&n| n != model.unknowns()) {
            return Err(SolveError::Length { what: "controlled functional", given, needed: model.unknowns() }.into());
        }
        ensure!(
            !model.is_timed(),
            Incompatible::new(
                "control by a functional",
                "a material that relaxes",
                "the load factor is the time: take Analysis::run"
            )
        );
        ensure!(
            !self.solver.keeps_pressures() || !model.is_unilateral(),
            Incompatible::new(
                "control by a functional",
                "contact that is solved by iteration",
                "take SolverChoice::Direct, or control the load"
            )
        );
        ensure!(!targets.is_empty(), Invalid::new("number of control targets", 0.0, "give at least one target"));
        if let Some(&value) = targets.iter().find(|t| !t.is_finite()) {
            return Err(Invalid::new("control target", value, "give finite values").into());
        }
        let mut run = Continuation::new(self, model, equations, path, observer)?;
        run.check_recorded()?;
        let reached = run.control_state().map_or(0, |control_state| control_state.reached);
        run.controlled = true;
        for (index, &target) in targets.iter().enumerate().skip(reached) {
            let lead =
                Lead::Target { functional, index, start: functional.value(&run.path.start.displacement), target };
            if !matches!(run.follow(&mut StepRule::new(&run, lead, 1.0)), Outcome::Done) {
                break;
            }
        }
        Ok(run.path)
    }

    /// Iterates a guess to the equilibrium at the guess's own load factor, without stepping: what is left
    /// to do where the answer is nearly known, from a coarser model say.
    ///
    /// A guess that is too far away gives a stalled path without steps.
    ///
    /// # Errors
    /// As [`resume`](Analysis::resume).
    pub fn correct(
        &self,
        model: &Model,
        equations: &Constraints,
        guess: State,
        observer: &mut dyn Observer,
    ) -> Result<EquilibriumPath, Error> {
        let (load, path) = (guess.load, EquilibriumPath::from(guess));
        self.validate(model, equations, &path)?;
        let mut run = Continuation::new(self, model, equations, path, observer)?;
        run.correct(load);
        Ok(run.path)
    }
}
