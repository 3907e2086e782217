//! Equilibrium in the open: the equations of a model under its conditions, linearised at a state, and steps of all unknowns.

use std::cell::OnceCell;

use crate::assembly::{Assembler, Model, System, release};
use crate::boundary::{Constraints, Reduction};
use crate::each::Each;
use crate::error::{Cause, SolveError};
use crate::linear::vector::norm;
use crate::linear::{Inertia, LinearSolver, LinearSystem};
use crate::term::{Product, StateDiagnostics, TermStep, Zone};

use super::active_set::shift_diagonal;
use super::increment::{Applied, Increment, LEAST_LOAD, condensed_change};
use super::motion_limit::MotionLimit;
use super::state::State;

/// The product of a zone's condensed unknowns with a vector.
type Multiply<'a> = Box<dyn Fn(&Zone, &[f64], &mut Product) + Sync + 'a>;

/// What is left of prescribed values below this part of a step, or of the value, is rounding: they are met.
pub(super) const MET: f64 = 1e-12;
/// Differences of load factors below this are rounding: a step takes them with it.
pub(super) const LOAD_ROUNDING: f64 = 1e-9;
/// Displacements below this part of the body's extent are rounding.
const LEAST: f64 = 1e-6;

/// The equations of equilibrium of a model under its conditions, with a linear solver bound to them: what Newton's method of this crate
/// and methods of one's own stand on.
///
/// [`linearize`](Equilibrium::linearize) forms and factorises the matrix at a state, [`solve`](Equilibrium::solve) finds steps with the
/// last factors, [`apply`](Equilibrium::apply) takes as much of one as is admissible, and [`commit`](Equilibrium::commit) accepts a
/// converged state: materials remember it, friction sticks from there. Newton's method is a loop over the first three:
///
/// ```
/// use rkpm::prelude::*;
/// use rkpm::solve::Rhs;
/// let block = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
///     .hold(Side::Min)
///     .prescribe(Side::Max, 0, 0.5);
/// let problem = block.discretize(&Scheme::default().particles([9, 5]))?;
/// let (mut equilibrium, start) = (problem.equilibrium()?, problem.at_rest());
/// let mut state = State { load: 1.0, ..start.clone() };
/// for _ in 0..30 {
///     let linear = equilibrium.linearize(&state)?;
///     let step = equilibrium.solve(Rhs::Residual)?;
///     if equilibrium.apply(&step, 1.0, &mut state)?.is_settled(1e-8) && linear.residual < 1e-9 {
///         break;
///     }
/// }
/// equilibrium.commit(&start, &mut state)?;
/// let path = problem.run()?.completed()?;
/// let [own, run] = [&state, path.last()].map(|state| problem.reaction(state, Side::Max));
/// assert!((own?[0] / run?[0] - 1.0).abs() < 1e-9);
/// # Ok::<(), rkpm::Error>(())
/// ```
pub struct Equilibrium<'a> {
    pub(super) model: &'a Model,
    pub(super) equations: &'a Constraints,
    assembler: Assembler,
    pub(super) reduction: Reduction,
    pub(super) solver: Box<dyn LinearSolver>,
    product: Multiply<'a>,
    /// Forces at the last state, and what the matrix has beside its reduced part.
    pub(super) system: System,
    /// The reduced matrix.
    pub(super) values: Vec<f64>,
    /// Of the last state.
    pub(super) violation: Vec<f64>,
    pub(super) multipliers: Vec<f64>,
    pub(super) load: f64,
    /// Increments of condensed unknowns.
    condensed: Vec<Vec<f64>>,
    /// The extent of the body \[length\].
    pub(super) extent: f64,
    /// Norm of the forces that is rounding.
    rounding: f64,
    /// Load factors inside (0, 1) at which amplitudes have break points, rising.
    pub(super) break_points: Vec<f64>,
    /// Prescribed values that run along curves.
    motion_limit: OnceCell<MotionLimit<'a>>,
    /// Steps of the load below this are not cut any further.
    smallest: f64,
    /// Linearisations so far.
    pub(super) iterations: usize,
    pub(super) inertia: Option<Inertia>,
}

/// What a linearisation tells of a state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linearized {
    /// Norm of the out-of-balance forces, relative to [`scale`](Linearized::scale).
    pub residual: f64,
    /// Norm of what prescribed displacements are off by \[length\].
    pub violation: f64,
    /// Norm of all forces, reactions included \[force\].
    pub scale: f64,
    /// Signs of the pivots of the last matrix, where the solver knows them.
    pub inertia: Option<Inertia>,
    /// Unstable modes of the last matrix under a fixed load: negative pivots less constraints.
    pub unstable: Option<usize>,
}

impl<'a> Equilibrium<'a> {
    pub(super) fn bound(
        model: &'a Model,
        equations: &'a Constraints,
        assembler: Assembler,
        (reduction, solver): (Reduction, Box<dyn LinearSolver>),
        smallest: f64,
    ) -> Self {
        let mut break_points: Vec<f64> = model.break_points().into_iter().chain(equations.break_points()).collect();
        break_points.retain(|&break_point| break_point > 0.0 && break_point < 1.0);
        break_points.sort_unstable_by(f64::total_cmp);
        break_points.dedup();
        let rounding: f64 = model.terms().summed(|term| term.rounding()[1].powi(2));
        Equilibrium {
            model,
            equations,
            assembler,
            reduction,
            solver,
            product: Box::new(|zone, x, product| model.multiply_zone(zone, x, product)),
            system: System::default(),
            values: Vec::new(),
            violation: vec![0.0; equations.len()],
            multipliers: vec![0.0; equations.len()],
            load: 0.0,
            condensed: Vec::new(),
            extent: extent(model),
            rounding: rounding.sqrt(),
            break_points,
            motion_limit: OnceCell::new(),
            smallest,
            iterations: 0,
            inertia: None,
        }
    }

    /// Forms the equations at a state, and factorises their matrix.
    ///
    /// # Errors
    /// [`Cause::NotFinite`] and [`Cause::Term`] for forces that are no numbers and terms that break their promises,
    /// [`Cause::Singular`] and [`Cause::LinearSolver`] where there are no factors, [`Cause::Refused`] for a state of another problem.
    pub fn linearize(&mut self, state: &State) -> Result<Linearized, Cause> {
        self.linearize_with(state, 0.0)
    }

    /// The same with a multiple of the median of the matrix's diagonal added to the diagonal: steps become shorter, as in a viscous
    /// medium or within a trust region, and keep their direction downhill where the matrix itself is indefinite. A shift that is not above
    /// zero adds nothing.
    ///
    /// # Errors
    /// As [`linearize`](Equilibrium::linearize).
    pub fn linearize_with(&mut self, state: &State, shift: f64) -> Result<Linearized, Cause> {
        state.check_lengths(self.model, self.equations)?;
        self.iterations += 1;
        self.make_room();
        self.assembler.assemble_own(self.model, state.into(), &mut self.system);
        self.look_at(state)?;
        if shift > 0.0 {
            let diagonal = self.assembler.pattern().columns.split_last().map_or(&[][..], |(_, columns)| columns);
            shift_diagonal(&mut self.system.values, diagonal, shift);
        }
        self.reduction.reduce(&self.system, &mut self.values);
        self.system.release();
        let (solver, reduced) = self.reduced();
        let inertia = solver.factorize(&LinearSystem { state: state.into(), ..reduced })?;
        self.inertia = inertia;
        Ok(self.linearized())
    }

    /// Forces and violations at a state beside the factors of an earlier one: the next [`Rhs::Residual`](super::Rhs::Residual) is theirs.
    /// Violations that are rounding count as none. A linear solver that keeps pressures linearises anew, for their equations are part
    /// of what it solves.
    ///
    /// # Errors
    /// As [`linearize`](Equilibrium::linearize).
    pub fn update_residual(&mut self, state: &State) -> Result<Linearized, Cause> {
        if self.solver.keeps_pressures() {
            return self.linearize(state);
        }
        state.check_lengths(self.model, self.equations)?;
        self.forces(state)?;
        let mut linearized = self.linearized();
        if linearized.violation <= MET * self.size(&state.displacement) {
            self.violation.fill(0.0);
            linearized.violation = 0.0;
        }
        Ok(linearized)
    }

    /// Forces at a state, the matrix left as it is.
    pub(super) fn forces(&mut self, state: &State) -> Result<Linearized, Cause> {
        self.assembler.forces_own(self.model, state.into(), &mut self.system);
        self.look_at(state)?;
        Ok(self.linearized())
    }

    /// Takes as much of a step as is admissible, or a given part of that: of the displacement, the condensed unknowns, which follow
    /// from it, the multipliers and the load factor. Where it is refused the state stays as it is.
    ///
    /// # Errors
    /// [`Cause::StepLimited`] where nothing of the step is admissible, [`Cause::NotFinite`] for a step or a part of it that is no number,
    /// and [`Cause::Refused`] for a state or a step of another problem.
    pub fn apply(&mut self, step: &Increment, part: f64, state: &mut State) -> Result<Applied, Cause> {
        state.check_lengths(self.model, self.equations)?;
        self.check("displacement of a step", step.displacement.len(), self.model.unknowns())?;
        self.check("multipliers of a step", step.multipliers.len(), self.equations.len())?;
        if !step.kept.is_empty() {
            self.check("pressures of a step", step.kept.len(), self.system.zones.len())?;
        }
        // A state would keep what is no number for good.
        let finite = part.is_finite() && step.is_finite() && (step.norm() / self.size(&state.displacement)).is_finite();
        ensure!(self.on_all_ranks(finite), Cause::NotFinite);
        self.condensed.resize(state.terms.len(), Vec::new());
        for (step, own) in self.condensed.iter_mut().zip(&state.terms) {
            step.clear();
            step.resize(own.condensed.len(), 0.0);
        }
        let here = self.model.at_own(&*state);
        let bound =
            here.advance_own(TermStep { displacement: &step.displacement, load: step.load }, &mut self.condensed);
        ensure!(bound > 0.0, Cause::StepLimited { factor: bound });
        here.take_pressures(&self.system.zones, &step.kept, &mut self.condensed);
        let taken = bound * part;
        let add = |to: &mut f64, change: &f64| *to += taken * change;
        state.displacement.iter_mut().zip(&step.displacement).for_each(|(d, s)| add(d, s));
        for (own, step) in state.terms.iter_mut().zip(&self.condensed) {
            own.condensed.iter_mut().zip(step).for_each(|(l, s)| add(l, s));
        }
        state.multipliers.iter_mut().zip(&step.multipliers).for_each(|(m, s)| add(m, s));
        state.load += taken * step.load;
        let increment = step.norm() / self.size(&state.displacement);
        let condensed = condensed_change(self.model, &self.condensed, &state.terms);
        let load = step.load.abs() / state.load.abs().max(LEAST_LOAD);
        Ok(Applied { part: taken, admissible: taken == part, increment, condensed, load })
    }

    /// Accepts a converged state that follows from an earlier one: what materials remember is written, contacts stick from there, and
    /// multipliers become those of the reactions.
    ///
    /// # Errors
    /// [`Cause::Refused`] where a term says that the state does not follow, and for a state of another problem; [`Cause::Term`] where
    /// what is remembered is no number.
    pub fn commit(&mut self, before: &State, state: &mut State) -> Result<StateDiagnostics, Cause> {
        before.check_lengths(self.model, self.equations)?;
        state.check_lengths(self.model, self.equations)?;
        self.follows(before, state)?;
        self.remember(state)?;
        Ok(self.model.at_own(&*state).diagnostics())
    }

    /// Refuses a state that does not follow from an earlier one by a step.
    pub(super) fn follows(&self, before: &State, state: &State) -> Result<(), Cause> {
        self.model.at_own(state).check_step(self.model.at_own(before)).map_or(Ok(()), |why| Err(Cause::Refused(why)))
    }

    /// Writes history and reactions of a converged state; nothing goes on from a memory that is no number.
    pub(super) fn remember(&mut self, state: &mut State) -> Result<(), Cause> {
        state.terms = self.model.at_own(&*state).update_history();
        state.time = self.model.time(state.load);
        self.react(state);
        let spoilt = state.terms.iter().position(|own| own.numbers().any(|number| !number.is_finite()));
        if self.on_all_ranks(spoilt.is_none()) {
            return Ok(());
        }
        let term = spoilt.map_or("a term".to_string(), |term| format!("term {term}"));
        let what = "what it remembers of the step is not finite: write finite numbers in Material::remember() or Term::update()";
        Err(Cause::Term(format!("{term} of the model: {what}")))
    }

    /// Whether something holds on this rank and on all others: they go on together.
    fn on_all_ranks(&self, mine: bool) -> bool {
        self.model.ranks().map_or(mine, |ranks| ranks.least(f64::from(u8::from(mine))) == 1.0)
    }

    /// Writes the multipliers of a converged state, for strategies whose multipliers are no unknowns.
    pub(super) fn react(&mut self, state: &mut State) {
        if self.equations.is_empty() {
            return;
        }
        let residual = self.model.at_own(&*state).residual();
        self.reduction.react(&residual, &mut state.multipliers);
    }

    /// The farthest load factor on the way from one to another that a single step may go to: loads have break points, prescribed motions
    /// turn, and something may come into contact.
    pub fn farthest(&self, from: f64, to: f64) -> f64 {
        // A step ends at each break point of an amplitude: a peak inside it would be missed.
        let inside = |&&at: &&f64| at > from + LOAD_ROUNDING && to > at - LOAD_ROUNDING;
        let to = self.break_points.iter().find(inside).copied().unwrap_or(to);
        // A motion that returns within one step would not be seen: the step ends before.
        let to = self.motion_limit().until(from, to, self.smallest);
        // Terms shorten the way: none leads beyond, or back. One that says no number lets nothing pass.
        let on_the_way = |load: f64, to: f64| load.max(from.min(to)).min(from.max(to));
        self.model.terms().iter().fold(to, |to, term| on_the_way(term.farthest_load(from, to), to))
    }

    pub(super) fn motion_limit(&self) -> &MotionLimit<'a> {
        self.motion_limit.get_or_init(|| MotionLimit::new(self.model, self.equations))
    }

    /// The largest $|\nabla u|$ of a displacement: how far from linear a step is; NaN for a list of another length than this problem has.
    pub(crate) fn largest_gradient(&self, displacement: &[f64]) -> f64 {
        if displacement.len() == self.model.unknowns() { self.model.largest_gradient(displacement) } else { f64::NAN }
    }

    /// Refuses lists that are not as long as this problem has them.
    pub(super) fn check(&self, what: &'static str, given: usize, needed: usize) -> Result<(), SolveError> {
        if given == needed { Ok(()) } else { Err(SolveError::Length { what, given, needed }) }
    }

    /// What increments are measured against: the norm of a displacement, that of rounding at least.
    pub(super) fn size(&self, displacement: &[f64]) -> f64 {
        norm(displacement).max(LEAST * self.extent * (self.model.unknowns() as f64).sqrt())
    }

    /// Negative pivots less constraints at the last factorisation, where the solver knows them.
    pub(super) fn unstable_modes(&self) -> Option<usize> {
        let constraints = self.reduction.class().constraints();
        self.inertia.map(|inertia| inertia.negative.saturating_sub(constraints))
    }

    /// Bytes of the reduced matrix, a value and a row index for each entry, and of its factors, where the solver tells them.
    pub(super) fn bytes(&self) -> usize {
        let entry = size_of::<f64>() + size_of::<u32>();
        entry * self.reduction.pattern.entries() + self.solver.bytes().unwrap_or(0)
    }

    /// The solver, and the system that it has factorised: solutions look at the matrix alone, the state moves on.
    pub(super) fn reduced(&mut self) -> (&mut dyn LinearSolver, LinearSystem<'_>) {
        let Equilibrium { solver, system, values, product, .. } = self;
        let reduced =
            LinearSystem { skew: &system.skew, zones: &system.zones, product: &**product, ..LinearSystem::of(values) };
        (&mut **solver, reduced)
    }

    /// Takes note of a state whose forces were summed.
    fn look_at(&mut self, state: &State) -> Result<(), Cause> {
        ensure!(self.system.scale.is_finite(), self.model.at_own(state).fault().map_or(Cause::NotFinite, Cause::Term));
        self.equations.violation(&state.displacement, state.load, &mut self.violation);
        self.multipliers.clone_from(&state.multipliers);
        self.load = state.load;
        Ok(())
    }

    fn linearized(&self) -> Linearized {
        let mut imbalance = Vec::new();
        self.reduction.imbalance(&self.system.residual, &self.multipliers, &mut imbalance);
        // Violations of equations over a boundary are lengths times areas.
        let off = self.violation.iter().zip(self.equations.equations());
        let violation: f64 = off.map(|(off, equation)| (off / equation.measure()).powi(2)).sum();
        // What is no number is not settled, as max() would have it.
        let left = norm(&imbalance) - self.rounding;
        Linearized {
            residual: if left < 0.0 { 0.0 } else { left } / self.system.scale.max(f64::MIN_POSITIVE),
            violation: violation.sqrt(),
            scale: self.system.scale,
            inertia: self.inertia,
            unstable: self.unstable_modes(),
        }
    }

    /// Gives back what large matrices and factors took before, and asks for the place of the reduced matrix first: the
    /// full one, which goes first, then lies above it and leaves no hole.
    fn make_room(&mut self) {
        self.solver.release();
        release(&mut self.values);
        self.values.clear();
        self.values.reserve_exact(self.reduction.pattern.entries());
    }
}

/// The largest extent of the nodes \[length\].
fn extent(model: &Model) -> f64 {
    let mut extent: f64 = 0.0;
    for axis in 0..model.dim() {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for node in 0..model.node_count() {
            let x = model.coordinates(node)[axis];
            low = low.min(x);
            high = high.max(x);
        }
        extent = extent.max(high - low);
    }
    extent
}
