//! One run: the steps from one equilibrium to the next.

use crate::assembly::{Model, StateRef};
use crate::boundary::Constraints;
use crate::each::Each;
use crate::error::{Cause, Doubt, DoubtCause, Driven, Error, Stalled};
use crate::linear::vector::norm;
use crate::term::{Element, each_force};

use super::analysis::Analysis;
use super::critical::CriticalPoint;
use super::equilibrium::{Equilibrium, MET};
use super::functional::Control;
use super::newton::Attempt;
use super::path::{Ending, EquilibriumPath, Observer, Step, StepControlState};
use super::rejection::Rejection;
use super::settings::{Newton, TangentUpdate};
use super::state::State;
use super::stepping::{Following, LARGE_CHANGE, StepControl, TOO_LARGE};

/// One run: what it works with and what it has reached.
pub(super) struct Continuation<'a, 'o> {
    pub(super) analysis: &'a Analysis,
    pub(super) equilibrium: Equilibrium<'a>,
    /// The other one of iteration and factors, once an attempt has needed these.
    other: Option<Equilibrium<'a>>,
    /// Whether the equilibrium is that of factors.
    by_factors: bool,
    pub(super) observer: &'o mut dyn Observer,
    /// Whether the first step of the next attempt tells that the load should not lead.
    pub(super) probes: bool,
    pub(super) path: EquilibriumPath,
    pub(super) previous: Option<State>,
    pub(super) state: State,
    /// Unstable modes of the current state, where they are known.
    pub(super) modes: Option<usize>,
    /// Iterations since the last converged state.
    pub(super) spent: usize,
    /// Rejected attempts since the last converged state.
    pub(super) rejected: usize,
    /// Whether a functional with targets is controlled.
    pub(super) controlled: bool,
}

impl<'a, 'o> Continuation<'a, 'o> {
    pub(super) fn new(
        analysis: &'a Analysis,
        model: &'a Model,
        equations: &'a Constraints,
        mut path: EquilibriumPath,
        observer: &'o mut dyn Observer,
    ) -> Result<Self, Error> {
        // What was spent on attempts after the last step is spent again.
        (path.iterations, path.rejected) = path.spent();
        path.ending = Ending::Completed;
        let mut equilibrium = analysis.equilibrium(model, equations)?;
        equilibrium.iterations = path.iterations;
        let state = path.last().clone();
        let previous = match path.steps.as_slice() {
            [] => None,
            [_] => Some(path.start.clone()),
            [.., before, _] => Some(before.state.clone()),
        };
        let modes = path.steps.last().and_then(|step| step.unstable);
        Ok(Continuation {
            analysis,
            equilibrium,
            other: None,
            by_factors: false,
            observer,
            probes: false,
            path,
            previous,
            state,
            modes,
            spent: 0,
            rejected: 0,
            controlled: false,
        })
    }

    /// How the stepping goes on where the path already has steps.
    pub(super) fn control_state(&self) -> Option<StepControlState> {
        self.path.steps.last().map(|step| step.control_state)
    }

    /// Whether the current state lies at a break point of an amplitude: the last step tells nothing of the next one.
    pub(super) fn at_break_point(&self) -> bool {
        self.equilibrium.break_points.contains(&self.state.load)
    }

    /// Tries one state, which has to lie on the path of the current one.
    pub(super) fn attempt(&mut self, attempt: State, control: Control<'_>) -> Result<(usize, State), Rejection> {
        let (iterations, state) = self.iterate(attempt, control)?;
        self.on_path(&state).inspect_err(|_| self.count_rejection())?;
        if let Err(refused) = self.equilibrium.follows(&self.state, &state) {
            self.count_rejection();
            return Err(refused.into());
        }
        Ok((iterations, state))
    }

    /// The error of a time step relative to its tolerance, at a state for which the internal variables are not yet updated.
    pub(super) fn time_error(&self, state: &State) -> f64 {
        let model = self.equilibrium.model;
        // Rates before a break point say nothing of those behind it.
        let before = self.previous.as_ref().filter(|_| !self.at_break_point());
        model.at_own(state).time_error(before.map(StateRef::from)) / self.analysis.stepping.time_tolerance
    }

    /// Adds the iterations since the last count to those of the path and of the step under way.
    pub(super) fn count_iterations(&mut self) {
        self.spent += self.equilibrium.iterations - self.path.iterations;
        self.path.iterations = self.equilibrium.iterations;
    }

    pub(super) fn count_rejection(&mut self) {
        self.rejected += 1;
        self.path.rejected += 1;
    }

    /// Iterates a state to an equilibrium.
    fn iterate(&mut self, mut attempt: State, control: Control<'_>) -> Result<(usize, State), Rejection> {
        if self.by_factors {
            self.exchange();
        }
        let near = self.previous.is_some() && self.analysis.stepping.predict && !self.at_break_point();
        let newton = self.newton();
        let ahead = self.ahead(control, near);
        self.probes = false;
        let given = self.analysis.factors.is_some().then(|| attempt.clone());
        let mut outcome = self.equilibrium.newton(&newton, &mut attempt, &ahead, self.observer);
        // What an iteration does not solve factors may: they are taken for this attempt alone, so that steps do not depend on those before.
        let unsolved = matches!(outcome, Err(Rejection::Failed(Cause::Singular { .. } | Cause::LinearSolver(_))));
        if let Some(given) = given.filter(|_| unsolved && self.bind_factors()) {
            self.exchange();
            attempt = given;
            outcome = self.equilibrium.newton(&newton, &mut attempt, &ahead, self.observer);
        }
        self.count_iterations();
        if outcome.as_ref().is_err_and(|rejection| !matches!(rejection, Rejection::TooLarge(_))) {
            self.count_rejection();
        }
        outcome.map(|iterations| (iterations, attempt))
    }

    /// Whether factors are there to take the place of an iteration.
    fn bind_factors(&mut self) -> bool {
        if self.other.is_none() {
            let Equilibrium { model, equations, .. } = self.equilibrium;
            self.other = self.analysis.factors.as_ref().and_then(|factors| factors.equilibrium(model, equations).ok());
        }
        self.other.is_some()
    }

    /// Exchanges iteration and factors.
    fn exchange(&mut self) {
        if let Some(other) = &mut self.other {
            other.iterations = self.equilibrium.iterations;
            std::mem::swap(&mut self.equilibrium, other);
            self.by_factors = !self.by_factors;
        }
    }

    /// An attempt under a control, from a state that was predicted from others or was not.
    pub(super) fn ahead<'c>(&self, control: Control<'c>, predicted: bool) -> Attempt<'c> {
        let largest_first_step = if self.probes { TOO_LARGE } else { f64::INFINITY };
        Attempt { control, predicted, largest_first_step }
    }

    /// Newton's method as it is set; where the path counts the inertia has to be that of the states themselves.
    pub(super) fn newton(&self) -> Newton {
        let path_counts = self.follows_path() || self.controlled;
        let tangent_update =
            if path_counts { TangentUpdate::EveryIteration } else { self.analysis.newton.tangent_update };
        Newton { tangent_update, ..self.analysis.newton }
    }

    /// Whether the path counts, and not only the states on it.
    fn follows_path(&self) -> bool {
        let stepping = &self.analysis.stepping;
        stepping.follow == Following::Path || stepping.control == StepControl::ArcLength
    }

    /// Rejects a state that has gained or lost unstable modes in a large step, where the path counts.
    fn on_path(&mut self, attempt: &State) -> Result<(), Rejection> {
        // As long as there are none, nobody asks how many a first state had.
        let Some(after) = self.equilibrium.unstable_modes().filter(|after| *after != self.modes.unwrap_or(0)) else {
            return Ok(());
        };
        if !self.follows_path() {
            return Ok(());
        }
        let model = self.equilibrium.model;
        let size = model.largest_gradient(&attempt.displacement);
        let change: Vec<f64> = attempt.displacement.paired(&self.state.displacement, |new, old| new - old);
        if model.largest_gradient(&change) <= LARGE_CHANGE * (1.0 + size) {
            return Ok(());
        }
        let before = self.modes();
        if after == before { Ok(()) } else { Err(Cause::Unstable { before, after }.into()) }
    }

    /// Unstable modes of the current state. Those of the first one are counted when they are requested, which
    /// costs a factorisation; none where it has no factors.
    fn modes(&mut self) -> usize {
        if self.modes.is_none() {
            let last = self.equilibrium.inertia;
            let found =
                self.equilibrium.tangent_displacement(&self.state).ok().and_then(|_| self.equilibrium.unstable_modes());
            self.count_iterations();
            self.equilibrium.inertia = last;
            self.modes = Some(found.unwrap_or(0));
        }
        self.modes.unwrap_or(0)
    }

    /// Critical points between the current state and the next one, which has the given unstable modes.
    fn critical_points(&mut self, next: &State, after: Option<usize>) -> Vec<CriticalPoint> {
        let Some(after) = after else { return Vec::new() };
        // As long as there are none, nobody asks how many a first state had.
        if !self.follows_path() || after == self.modes.unwrap_or(0) {
            return Vec::new();
        }
        let before = self.modes();
        let newton = self.newton();
        let points = self.equilibrium.critical_points(&newton, (&self.state, before), (next, after), self.observer);
        self.count_iterations();
        points
    }

    /// Takes a converged state into the path; `false` where the observer breaks off, or nothing can go on from what is remembered of it.
    ///
    /// `control_state` holds whatever the rule carries on to the next step: what is not in it would be lost to a resumed run.
    pub(super) fn accept(&mut self, mut state: State, control_state: StepControlState) -> bool {
        let (inertia, unstable) = (self.equilibrium.inertia, self.equilibrium.unstable_modes());
        let critical = self.critical_points(&state, unstable);
        let model = self.equilibrium.model;
        if let Err(cause) = self.equilibrium.remember(&mut state) {
            self.stall(cause, self.driven());
            return false;
        }
        let energy = model.at_own(&state).energy();
        let step = Step {
            state: state.clone(),
            iterations: std::mem::take(&mut self.spent),
            rejected: std::mem::take(&mut self.rejected),
            energy,
            inertia,
            unstable,
            critical,
            diagnostics: model.at_own(&state).diagnostics(),
            doubts: self.doubts(&state, unstable),
            control_state,
        };
        self.modes = unstable;
        let flow = self.observer.step(&step);
        self.path.steps.push(step);
        self.previous = Some(std::mem::replace(&mut self.state, state));
        let ended = self.equilibrium.model.is_ended_by(flow);
        if ended {
            self.path.ending = Ending::Stopped;
        }
        !ended
    }

    /// Why a converged state may be no answer. Who follows the path, or controls something else than the load, goes on to states that are
    /// unstable under a fixed load.
    fn doubts(&mut self, state: &State, unstable: Option<usize>) -> Vec<Doubt> {
        let mut doubts = self.observer.doubts(state);
        let cause = match unstable {
            None => Some(DoubtCause::StabilityUnknown),
            Some(modes) if modes > 0 && !self.follows_path() && !self.controlled => {
                Some(DoubtCause::Unstable { modes })
            }
            Some(_) => None,
        };
        doubts.extend(cause.map(|cause| Doubt { cause, load: state.load, at: Vec::new() }));
        doubts
    }

    /// What drives a run under load control: loads, or prescribed displacements alone.
    pub(super) fn driven(&self) -> Driven {
        let (model, mut loads) = (&self.equilibrium.model, [0.0]);
        for (number, term) in model.terms().iter().enumerate().filter(|(_, term)| !term.layout().unilateral) {
            let view = model.at_own(&self.state).view(number);
            each_force(&**term, 0..term.clusters(), view, &mut Element::default(), |_, _, slope| {
                loads[0] = slope.iter().fold(loads[0], |most: f64, slope| most.max(slope.abs()));
            });
        }
        if let Some(ranks) = model.ranks() {
            ranks.largest(&mut loads);
        }
        match (loads[0] == 0.0, model.is_unilateral()) {
            (true, true) => Driven::ByContacts,
            (true, false) if !self.equilibrium.equations.is_empty() => Driven::ByDisplacements,
            _ => Driven::ByLoads,
        }
    }

    /// The load factor now and the largest one of the path.
    pub(super) fn loads(&self) -> [f64; 2] {
        let loads = self.path.steps.iter().map(|step| step.state.load);
        [self.state.load, loads.fold(self.path.start.load, f64::max)]
    }

    /// Ends the run for want of a further state.
    pub(super) fn stall(&mut self, rejection: impl Into<Rejection>, driven: Driven) {
        let mut cause = match rejection.into() {
            Rejection::Failed(cause) => cause,
            Rejection::Stopped => {
                self.path.ending = Ending::Stopped;
                return;
            }
            // Only a first attempt is told, and it goes on with another control.
            Rejection::TooLarge(_) => Cause::Iterations(0),
        };
        // What the first steps have solved is not free to move.
        if let Cause::Singular { at_start, .. } = &mut cause {
            *at_start = self.path.steps.is_empty();
        }
        let [load, largest_load] = self.loads();
        self.path.ending = Ending::Stalled(Stalled { cause, load, largest_load, driven });
    }

    /// Takes the first state as a guess of the equilibrium at a load factor.
    pub(super) fn correct(&mut self, load: f64) {
        let found = self.iterate(self.state.clone(), Control::Load(load));
        // A guess is no equilibrium: its modes count for nothing.
        self.modes = self.equilibrium.unstable_modes();
        self.take_first(found);
    }

    /// Whether a run of the load begins. Where time passes, what acts at the first load factor acts at once, before any time does: a first
    /// state that is out of balance is followed by the one in balance. Elsewhere the first step does the same.
    pub(super) fn begins(&mut self) -> bool {
        if !(self.equilibrium.model.is_timed() && self.path.steps.is_empty()) {
            return true;
        }
        let rounding = self.equilibrium.size(&[]);
        let settled = self.newton().forces_settled();
        match self.equilibrium.forces(&self.state) {
            Ok(now) if now.residual <= settled && now.violation <= MET * rounding => true,
            Ok(_) => {
                let found = self.attempt(self.state.clone(), Control::Load(self.state.load));
                // Forces of a body at rest may be rounding.
                found.as_ref().is_ok_and(|(_, to)| !self.has_moved(to)) || self.take_first(found)
            }
            Err(cause) => self.take_first(Err(cause.into())),
        }
    }

    /// Whether a state lies away from the first one of the path, by more than rounding.
    pub(super) fn has_moved(&self, state: &State) -> bool {
        let change: Vec<f64> = state.displacement.paired(&self.path.start.displacement, |to, from| to - from);
        norm(&change) > self.equilibrium.size(&[])
    }

    /// Takes the first state that was found, or ends the run.
    fn take_first(&mut self, found: Result<(usize, State), Rejection>) -> bool {
        let increment = self.analysis.stepping.first;
        match found {
            Ok((_, state)) => self.accept(state, StepControlState { increment, ..StepControlState::default() }),
            Err(rejection) => {
                self.stall(rejection, self.driven());
                false
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::Pattern;
    use crate::error::LinearError;
    use crate::geometry::{Block, Side};
    use crate::kinematics::PlaneStrain;
    use crate::linear::{Inertia, LinearSolver, LinearSystem, MatrixClass};
    use crate::material::Rubber;
    use crate::scene::{Scene, Scheme};

    /// Solves nothing, as an iteration that does not converge.
    struct Unsolved;

    impl LinearSolver for Unsolved {
        fn fresh(&self) -> Box<dyn LinearSolver> {
            Box::new(Unsolved)
        }

        fn analyze(&mut self, _: &Pattern, _: MatrixClass, _: Option<&[usize]>) -> Result<(), LinearError> {
            Ok(())
        }

        fn factorize(&mut self, _: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError> {
            Ok(None)
        }

        fn solve(
            &mut self,
            _: &LinearSystem<'_>,
            _: &mut [f64],
            _: Option<&mut [[f64; 4]]>,
        ) -> Result<f64, LinearError> {
            Err(LinearError::Residual { residual: 0.4 })
        }
    }

    /// The path is that of factors, bit for bit, but for the iterations that were lost; without factors the run ends with the cause.
    #[test]
    fn factors_take_over_what_an_iteration_does_not_solve() {
        let rubber = Rubber::neo_hookean(0.5, 1e3).unwrap();
        let scene = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber);
        let scene = scene.hold((1, Side::Min)).prescribe((1, Side::Max), 0, 0.2).prescribe((1, Side::Max), 1, 0.0);
        let mut problem = scene.discretize(&Scheme::default().particles([5, 5])).unwrap();
        let by_factors = problem.run().unwrap().completed().unwrap();
        let solver = std::mem::replace(&mut problem.analysis_mut().solver, Box::new(Unsolved));
        let ended = problem.run().unwrap();
        assert!(
            matches!(&ended.ending, Ending::Stalled(stalled) if matches!(stalled.cause, Cause::Singular { .. })),
            "{:?}",
            ended.ending
        );
        let factors = Analysis { solver, ..Analysis::default() };
        problem.analysis_mut().factors = Some(Box::new(factors));
        let path = problem.run().unwrap().completed().unwrap();
        assert_eq!(path.steps.len(), by_factors.steps.len());
        assert_eq!(path.last().displacement, by_factors.last().displacement);
        assert!(path.iterations > by_factors.iterations);
    }
}
