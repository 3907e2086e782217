//! Analyses: a model, its conditions, and the one load-stepping rule of the crate.

use crate::assembly::Model;
use crate::boundary::{Constraints, Enforcement, MixedTransformation, check_unknowns};
use crate::error::{Error, SolveError};
use crate::linear::{Direct, LinearSolver, nested_dissection};

use super::newton::{Control, Deflection, Functional, Newton, Rejection, Workspace};
use super::path::{Ending, Observer, Pace, Path, State, Step};

/// What is controlled while the load factor goes from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StepControl {
    /// The load, unless the linear answer to it has $|\nabla u| > 1$: then a generalised deflection, the
    /// mean displacement along the load.
    #[default]
    Auto,
    /// The load.
    Load,
}

/// How the load is stepped: the full load first, halved on failure, grown after quick convergence,
/// with a linear predictor from the last two states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stepping {
    /// First increment of the load factor.
    pub first: f64,
    /// Increments below this end the analysis as stalled.
    pub smallest: f64,
    /// Largest increment.
    pub largest: f64,
    /// Growth after a step of at most `quick` iterations.
    pub growth: f64,
    /// Iterations up to which a step counts as quick.
    pub quick: usize,
    /// Most converged steps.
    pub steps: usize,
    /// Whether the next state is predicted from the last two.
    pub predict: bool,
    /// What is controlled.
    pub control: StepControl,
}

impl Default for Stepping {
    /// Full load first, growth 1.5 after at most 6 iterations.
    fn default() -> Self {
        Stepping {
            first: 1.0,
            smallest: 1e-4,
            largest: 1.0,
            growth: 1.5,
            quick: 6,
            steps: 1000,
            predict: true,
            control: StepControl::Auto,
        }
    }
}

impl Stepping {
    /// Equal increments without predictor or growth, as the paper steps.
    pub fn equal(steps: usize) -> Self {
        let first = 1.0 / steps.max(1) as f64;
        Stepping {
            first,
            largest: first,
            growth: 1.0,
            predict: false,
            steps: 100 * steps.max(1),
            control: StepControl::Load,
            ..Stepping::default()
        }
    }

    fn validate(&self) -> Result<(), SolveError> {
        for (what, value, ok) in [
            ("first load increment", self.first, self.first > 0.0 && self.first <= 1.0),
            ("smallest load increment", self.smallest, self.smallest > 0.0 && self.smallest <= self.first),
            ("largest load increment", self.largest, self.largest >= self.first && self.largest.is_finite()),
            ("growth of the load increment", self.growth, self.growth >= 1.0 && self.growth <= 1e3),
        ] {
            if !ok {
                return Err(SolveError::Setting {
                    what,
                    value,
                    needed: "increments are above 0 with smallest <= first <= largest and first <= 1, growth is from 1 to 1000",
                });
            }
        }
        Ok(())
    }
}

/// An analysis: strategies that turn a model and its conditions into a path of equilibria.
pub struct Analysis {
    /// Newton's method.
    pub newton: Newton,
    /// Load stepping.
    pub stepping: Stepping,
    /// How conditions are enforced.
    pub enforcement: Box<dyn Enforcement>,
    /// The linear solver.
    pub solver: Box<dyn LinearSolver>,
}

impl Default for Analysis {
    /// Mixed transformation and sparse direct factorisation.
    fn default() -> Self {
        Analysis::new(MixedTransformation::default(), Direct)
    }
}

impl Analysis {
    /// An analysis with the default stepping.
    pub fn new(enforcement: impl Enforcement + 'static, solver: impl LinearSolver + 'static) -> Self {
        Analysis {
            newton: Newton::default(),
            stepping: Stepping::default(),
            enforcement: Box::new(enforcement),
            solver: Box::new(solver),
        }
    }

    /// Follows the load factor from 0 to 1, starting at rest.
    ///
    /// # Errors
    /// For a model without terms or unknowns, bad settings, rows that depend on each other, loads that
    /// are not finite. A stalled analysis is no error: the path so far is returned with its ending.
    pub fn run<const D: usize>(
        &self,
        model: &Model<D>,
        rows: &Constraints,
        observer: &mut dyn Observer,
    ) -> Result<Path, Error> {
        let start = State::at_rest(model, rows);
        self.run_from(model, rows, start, observer)
    }

    /// Follows the load factor from that of a given state to 1.
    ///
    /// # Errors
    /// As [`run`](Analysis::run), and where the state does not fit the model or is inverted.
    pub fn run_from<const D: usize>(
        &self,
        model: &Model<D>,
        rows: &Constraints,
        start: State,
        observer: &mut dyn Observer,
    ) -> Result<Path, Error> {
        self.resume(model, rows, Path::new(start), observer)
    }

    /// Goes on from the last step of a path that [`run`](Analysis::run) or [`run_from`](Analysis::run_from)
    /// left unfinished, with the same bits as if it had never been broken off (on the same machine and build).
    ///
    /// The path comes back with the new steps behind the old ones; only the first and the last two of its states
    /// are used. A path that has reached its last load comes back as it is. Nothing but the path is needed:
    /// factors and scalings are made afresh within every step.
    ///
    /// # Errors
    /// As [`run_from`](Analysis::run_from).
    pub fn resume<const D: usize>(
        &self,
        model: &Model<D>,
        rows: &Constraints,
        path: Path,
        observer: &mut dyn Observer,
    ) -> Result<Path, Error> {
        self.validate(model, rows, &path)?;
        let mut march = March::new(self, model, rows, path, observer)?;
        match march.deflection()? {
            Some((deflection, first)) => march.by_deflection(&deflection, first),
            None => march.by_load(),
        }
        Ok(march.path)
    }

    /// Follows a functional of the displacement through the given values; the load factor is unknown and
    /// may pass limit points or end anywhere.
    ///
    /// Values between two targets are inserted by halving where Newton needs them; they are part of the path.
    ///
    /// # Errors
    /// As [`run_from`](Analysis::run_from).
    pub fn run_controlled<const D: usize>(
        &self,
        model: &Model<D>,
        rows: &Constraints,
        start: State,
        functional: &dyn Functional,
        targets: &[f64],
        observer: &mut dyn Observer,
    ) -> Result<Path, Error> {
        self.resume_controlled(model, rows, Path::new(start), functional, targets, observer)
    }

    /// Goes on from the last step of a path that [`run_controlled`](Analysis::run_controlled) left unfinished, as
    /// [`resume`](Analysis::resume) does; functional and targets are those of the first run.
    ///
    /// # Errors
    /// As [`run_controlled`](Analysis::run_controlled).
    pub fn resume_controlled<const D: usize>(
        &self,
        model: &Model<D>,
        rows: &Constraints,
        path: Path,
        functional: &dyn Functional,
        targets: &[f64],
        observer: &mut dyn Observer,
    ) -> Result<Path, Error> {
        self.validate(model, rows, &path)?;
        if let Some(given) = functional.unknowns().filter(|&n| n != model.unknowns()) {
            return Err(SolveError::Length { what: "controlled functional", given, needed: model.unknowns() }.into());
        }
        if let Some(&value) = targets.iter().find(|t| !t.is_finite()) {
            return Err(SolveError::Setting { what: "control target", value, needed: "give finite values" }.into());
        }
        let mut march = March::new(self, model, rows, path, observer)?;
        let reached = march.pace().map_or(0, |pace| pace.reached);
        for (index, &target) in targets.iter().enumerate().skip(reached) {
            if !march.reach(functional, index, target) {
                break;
            }
        }
        Ok(march.path)
    }

    /// Iterates a guess to the equilibrium at the guess's own load factor, without stepping: what is left
    /// to do where the answer is nearly known, from a coarser model say.
    ///
    /// A guess that is too far away gives a stalled path without steps.
    ///
    /// # Errors
    /// As [`run_from`](Analysis::run_from).
    pub fn correct<const D: usize>(
        &self,
        model: &Model<D>,
        rows: &Constraints,
        guess: State,
        observer: &mut dyn Observer,
    ) -> Result<Path, Error> {
        let (load, path) = (guess.load, Path::new(guess));
        self.validate(model, rows, &path)?;
        let mut march = March::new(self, model, rows, path, observer)?;
        match march.attempt(march.state.clone(), Control::Load(load)) {
            Ok((_, state)) => {
                march.accept(state, Pace { increment: self.stepping.first, reached: 0 });
            }
            Err(rejection) => march.path.ending = Ending::Stalled(rejection.to_string()),
        }
        Ok(march.path)
    }

    fn validate<const D: usize>(&self, model: &Model<D>, rows: &Constraints, path: &Path) -> Result<(), Error> {
        self.stepping.validate()?;
        let Newton { tolerance, iterations } = self.newton;
        for (what, value, ok, needed) in [
            ("Newton tolerance", tolerance, tolerance > 0.0 && tolerance < 1.0, "give a tolerance between 0 and 1"),
            ("Newton iterations", iterations as f64, iterations > 0, "give at least one iteration"),
        ] {
            if !ok {
                return Err(SolveError::Setting { what, value, needed }.into());
            }
        }
        if model.terms().is_empty() {
            return Err(SolveError::Empty { what: "terms", remedy: "add at least a body" }.into());
        }
        check_terms(model)?;
        check_unknowns(rows.rows(), model.unknowns())?;
        check_state(model, rows, &path.start)?;
        for step in path.steps.iter().rev().take(2) {
            check_state(model, rows, &step.state)?;
            let increment = step.pace.increment;
            if !(increment > 0.0 && increment.is_finite()) {
                return Err(SolveError::Setting {
                    what: "increment at the last step of the path",
                    value: increment,
                    needed: "resume a path as a run left it",
                }
                .into());
            }
        }
        Ok(())
    }

    /// Binds conditions and solver to the pattern of the model.
    pub(crate) fn workspace<'a, const D: usize>(
        &self,
        model: &'a Model<D>,
        rows: &'a Constraints,
    ) -> Result<Workspace<'a, D>, Error> {
        let assembler = model.assembler();
        let enforced = self.enforcement.bind(assembler.pattern(), rows)?;
        if enforced.unknowns() == 0 {
            return Err(SolveError::Empty {
                what: "free unknowns",
                remedy: "every displacement is prescribed; evaluate the field instead",
            }
            .into());
        }
        // Unknowns that stand in the full vector are ordered by position; multipliers stay last.
        let inner = (0..enforced.unknowns()).take_while(|&k| enforced.full_index(k).is_some()).count();
        let order = {
            let place = |k: usize| {
                let node = enforced.full_index(k).map_or(0, |full| full / D);
                let x = model.positions()[node];
                std::array::from_fn::<f64, D, _>(|i| x[i])
            };
            let mut order = nested_dissection(enforced.pattern(), inner, place);
            order.extend(inner..enforced.unknowns());
            order
        };
        let factorizer = self.solver.analyze(enforced.pattern(), enforced.class(), Some(&order))?;
        Ok(Workspace {
            model,
            rows,
            assembler,
            enforced,
            factorizer,
            system: Default::default(),
            values: Vec::new(),
            iterations: 0,
            inertia: None,
        })
    }
}

/// One run: what it works with and what it has reached.
struct March<'a, 'o, const D: usize> {
    analysis: &'a Analysis,
    workspace: Workspace<'a, D>,
    observer: &'o mut dyn Observer,
    scale: f64,
    path: Path,
    previous: Option<State>,
    state: State,
    /// Iterations since the last converged state.
    spent: usize,
    /// Rejected attempts since the last converged state.
    rejected: usize,
}

/// The linear answer has $|\nabla u|$ beyond this: a thin sheet under pressure, whose load says little
/// about its deflection.
const FAR: f64 = 1.0;
/// $|\nabla u|$ of the linear answer at the first deflection step.
const FIRST_GRADIENT: f64 = 0.25;

impl<'a, 'o, const D: usize> March<'a, 'o, D> {
    fn new(
        analysis: &'a Analysis,
        model: &'a Model<D>,
        rows: &'a Constraints,
        mut path: Path,
        observer: &'o mut dyn Observer,
    ) -> Result<Self, Error> {
        // What was spent on attempts after the last step is spent again.
        (path.iterations, path.rejected) = path.spent();
        path.ending = Ending::Completed;
        let mut workspace = analysis.workspace(model, rows)?;
        workspace.iterations = path.iterations;
        let state = path.last().clone();
        let previous = match path.steps.as_slice() {
            [] => None,
            [_] => Some(path.start.clone()),
            [.., before, _] => Some(before.state.clone()),
        };
        let scale = extent(model);
        Ok(March { analysis, workspace, observer, scale, path, previous, state, spent: 0, rejected: 0 })
    }

    /// How the stepping goes on where the path already has steps.
    fn pace(&self) -> Option<Pace> {
        self.path.steps.last().map(|step| step.pace)
    }

    /// The generalised deflection to control and its first increment, where the load should not be controlled.
    fn deflection(&mut self) -> Result<Option<(Deflection, f64)>, Error> {
        if self.analysis.stepping.control == StepControl::Load {
            return Ok(None);
        }
        // At the first state, wherever the path has come to by now: a resumed run controls the same deflection.
        let start = &self.path.start;
        let mut loads = vec![0.0; self.workspace.model.unknowns()];
        self.workspace.model.load_slope(&start.displacement, &start.locals, start.load, &mut loads);
        let total: f64 = loads.iter().map(|f| f.abs()).sum();
        if total == 0.0 {
            // Driven by prescribed displacements alone.
            return Ok(None);
        }
        let before = self.workspace.iterations;
        let probe = self.workspace.probe(start);
        if self.path.steps.is_empty() {
            self.spent += self.workspace.iterations - before;
            self.path.iterations = self.workspace.iterations;
        } else {
            // Counted by the first run.
            self.workspace.iterations = before;
        }
        let rest = 1.0 - self.path.start.load;
        // A probe that fails (a mechanism stiffened only by its loads) leaves the load in control.
        let Ok(probe) = probe else { return Ok(None) };
        let gradient = self.workspace.model.largest_gradient(&probe) * rest;
        if gradient <= FAR || !gradient.is_finite() {
            return Ok(None);
        }
        // The mean displacement along the load: positive for a positive load.
        let deflection = Deflection { weights: loads.iter().map(|f| -f / total).collect() };
        let full = deflection.value(&probe) * rest;
        let first = full * FIRST_GRADIENT / gradient;
        Ok((first > 0.0 && first.is_finite()).then_some((deflection, first)))
    }

    /// Tries one state; on success it becomes the current one. `None` ends the run.
    fn attempt(&mut self, mut attempt: State, control: Control<'_>) -> Result<(usize, State), Rejection> {
        let before = self.workspace.iterations;
        let near = self.previous.is_some() && self.analysis.stepping.predict;
        let outcome =
            self.workspace.newton(&self.analysis.newton, &mut attempt, control, self.observer, self.scale, near);
        self.spent += self.workspace.iterations - before;
        self.path.iterations = self.workspace.iterations;
        if outcome.is_err() {
            self.rejected += 1;
            self.path.rejected += 1;
        }
        outcome.map(|iterations| (iterations, attempt))
    }

    /// Takes a converged state into the path; `false` where the observer breaks off.
    ///
    /// `pace` holds whatever the rule carries on to the next step: what is not in it would be lost to a resumed run.
    fn accept(&mut self, mut state: State, pace: Pace) -> bool {
        self.workspace.react(&mut state);
        let energy = self.workspace.model.energy(&state.displacement, &state.locals, state.load);
        let step = Step {
            state: state.clone(),
            iterations: std::mem::take(&mut self.spent),
            rejected: std::mem::take(&mut self.rejected),
            energy,
            inertia: self.workspace.inertia,
            pace,
        };
        let flow = self.observer.step(&step);
        self.path.steps.push(step);
        self.previous = Some(std::mem::replace(&mut self.state, state));
        if flow.is_break() {
            self.path.ending = Ending::Stopped;
        }
        flow.is_continue()
    }

    fn steps_left(&mut self) -> bool {
        let left = self.path.steps.len() < self.analysis.stepping.steps;
        if !left {
            self.path.ending = Ending::Stalled(format!("{} steps are used up", self.analysis.stepping.steps));
        }
        left
    }

    /// Whether a step changes what is controlled by more than its rounding: below, halves round up to the whole and
    /// attempts would be made for ever.
    fn moves(&mut self, now: f64, next: f64) -> bool {
        let moves = (next - now).abs() > 4.0 * f64::EPSILON * now.abs() && next.is_finite();
        if !moves {
            self.path.ending = Ending::Stalled(format!("no step leads from {now:e} of what is controlled to {next:e}"));
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

    /// Load control: the full load first, halved on failure.
    fn by_load(&mut self) {
        let stepping = self.analysis.stepping;
        let mut increment = self.pace().map_or(stepping.first, |pace| pace.increment);
        // After a rejection one step keeps its increment, or the next one would be rejected again.
        let mut rejected = false;
        while self.state.load < 1.0 && self.steps_left() {
            let mut target = self.state.load + increment;
            // A rest smaller than a rounding of the load is part of this step.
            if target > 1.0 - 1e-9 {
                target = 1.0;
            }
            if !self.moves(self.state.load, target) {
                return;
            }
            let ratio = self.previous.as_ref().map_or(0.0, |p| (target - self.state.load) / (self.state.load - p.load));
            match self.attempt(self.predicted(ratio), Control::Load(target)) {
                Ok((iterations, state)) => {
                    if iterations <= stepping.quick && !rejected {
                        increment = (increment * stepping.growth).min(stepping.largest);
                    }
                    rejected = false;
                    if !self.accept(state, Pace { increment, reached: 0 }) {
                        return;
                    }
                }
                Err(rejection) => {
                    rejected = true;
                    increment = 0.5 * (target - self.state.load);
                    if increment < stepping.smallest {
                        self.path.ending = Ending::Stalled(rejection.to_string());
                        return;
                    }
                }
            }
        }
    }

    /// Deflection control until the load factor passes 1, then the last step under the full load.
    fn by_deflection(&mut self, deflection: &Deflection, first: f64) {
        let stepping = self.analysis.stepping;
        let mut increment = self.pace().map_or(first, |pace| pace.increment);
        let mut rejected = false;
        while self.state.load < 1.0 && self.steps_left() {
            let now = deflection.value(&self.state.displacement);
            let before = self.previous.as_ref().map(|p| deflection.value(&p.displacement));
            if !self.moves(now, now + increment) {
                return;
            }
            let ratio = before.map_or(0.0, |before| increment / (now - before));
            let load_ahead =
                self.previous.as_ref().map_or(0.0, |p| self.state.load + ratio * (self.state.load - p.load));
            let outcome = if load_ahead >= 1.0 {
                // The full load is within reach of this increment.
                let ratio =
                    self.previous.as_ref().map_or(0.0, |p| (1.0 - self.state.load) / (self.state.load - p.load));
                self.attempt(self.predicted(ratio), Control::Load(1.0))
            } else {
                self.attempt(self.predicted(ratio), Control::Functional(deflection, now + increment))
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
                    if !self.accept(state, Pace { increment, reached: 0 }) {
                        return;
                    }
                }
                Err(rejection) => {
                    rejected = true;
                    increment *= 0.5;
                    if increment < stepping.smallest * first {
                        self.path.ending = Ending::Stalled(rejection.to_string());
                        return;
                    }
                }
            }
        }
    }

    /// Brings a functional to a value, halving where needed; `false` ends the run.
    fn reach(&mut self, functional: &dyn Functional, index: usize, target: f64) -> bool {
        let start = functional.value(&self.path.start.displacement);
        let mut part = self.pace().filter(|pace| pace.reached == index).map_or(1.0, |pace| pace.increment);
        while self.steps_left() {
            let now = functional.value(&self.state.displacement);
            let rest = target - now;
            if rest.abs() <= 1e-12 * target.abs().max((target - start).abs()) {
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
                    if !self.accept(state, Pace { increment: part, reached: index + usize::from(arrived) }) {
                        return false;
                    }
                    if arrived {
                        return true;
                    }
                }
                Err(rejection) => {
                    part *= 0.5;
                    if part < self.analysis.stepping.smallest {
                        self.path.ending = Ending::Stalled(rejection.to_string());
                        return false;
                    }
                }
            }
        }
        false
    }
}

/// The largest extent of the nodes \[length\].
fn extent<const D: usize>(model: &Model<D>) -> f64 {
    let mut extent: f64 = 0.0;
    for axis in 0..D {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for x in model.positions() {
            low = low.min(x[axis]);
            high = high.max(x[axis]);
        }
        extent = extent.max(high - low);
    }
    extent
}

/// Extrapolates linearly by `ratio` times the last step, cut back where the path guard asks for it.
fn predict<const D: usize>(model: &Model<D>, previous: &State, state: &State, ratio: f64) -> State {
    let mut predicted = state.clone();
    let step: Vec<f64> =
        state.displacement.iter().zip(&previous.displacement).map(|(now, then)| ratio * (now - then)).collect();
    let mut unused: Vec<Vec<f64>> = state.locals.iter().map(|l| vec![0.0; l.len()]).collect();
    let factor = model.advance(&state.displacement, &state.locals, state.load, &step, &mut unused);
    for (d, s) in predicted.displacement.iter_mut().zip(&step) {
        *d += factor * s;
    }
    for (locals, (now, then)) in predicted.locals.iter_mut().zip(state.locals.iter().zip(&previous.locals)) {
        for (l, (now, then)) in locals.iter_mut().zip(now.iter().zip(then)) {
            *l += factor * ratio * (now - then);
        }
    }
    predicted.load += factor * ratio * (state.load - previous.load);
    predicted
}

/// Refuses states of the wrong size, inverted ones, and numbers that are not finite.
fn check_state<const D: usize>(model: &Model<D>, rows: &Constraints, state: &State) -> Result<(), Error> {
    state.check_lengths(model, rows)?;
    let numbers = state.displacement.iter().chain(state.locals.iter().flatten()).chain(&state.multipliers);
    if let Some(&value) = numbers.chain([&state.load]).find(|v| !v.is_finite()) {
        return Err(SolveError::Setting {
            what: "a number of the first state, or of the last ones of a path",
            value,
            needed: "give finite numbers; zero displacement is a state at rest",
        }
        .into());
    }
    if let Some((jacobian, at)) = model.smallest_jacobian(&state.displacement, &state.locals, state.load)
        && !(jacobian > 0.0)
    {
        return Err(SolveError::InvertedStart { jacobian, at }.into());
    }
    Ok(())
}

/// Refuses terms over nodes that the model lacks: their tables belong to another set.
fn check_terms<const D: usize>(model: &Model<D>) -> Result<(), SolveError> {
    let needed = model.positions().len();
    for term in model.terms() {
        term.validate()?;
        let last = (0..term.clusters()).filter_map(|c| term.nodes(c).last()).max();
        if let Some(&last) = last.filter(|&&last| last as usize >= needed) {
            return Err(SolveError::Length { what: "the table of a term", given: last as usize + 1, needed });
        }
    }
    Ok(())
}
