//! One Newton solve: from a predicted state to an equilibrium under a control.

use crate::assembly::{Assembler, Model, System, release};
use crate::boundary::{Constraints, Enforced};
use crate::error::Cause;
use crate::linear::vector::{negate, norm};
use crate::linear::{At, Factorizer, Inertia, Linearised, MatrixClass};
use crate::term::{Product, Term, Zone};

use super::active_set::{ActiveSetCycling, CYCLING_ITERATIONS, shift_diagonal};
use super::functional::Control;
use super::increment::{Buffers, Increment, Linear, settled};
use super::line_search::{Ahead, LineSearch, search};
use super::path::{Iteration, MatrixUse, Observer};
use super::rejection::Rejection;
use super::reused_tangent::ReusedTangent;
use super::settings::{Newton, TangentUpdate};
use super::state::State;
use super::stepping::TOO_LARGE;

/// Step factors below this from the second iteration on mean that the attempt is too far away.
const SMALL_FACTOR: f64 = 0.3;
/// Small factors in a row before the attempt is given up.
const SMALL_FACTORS: usize = 3;
/// A predicted attempt whose increments grow beyond this multiple of the first one is too far away.
const GROWN: f64 = 2.0;
/// Increments below this part of the displacement may grow all the same.
const GROWN_LEAST: f64 = 1e-2;
/// Condensed unknowns are settled once none changes by more than this part of the largest of its term. Convergence is
/// quadratic, but a pressure may be small beside the volumes it is held with.
const CONDENSED_SETTLED: f64 = 1e-8;
/// Increments below this part of the displacement are small enough to go on with the same matrix; after larger ones it
/// seldom contracts where bulk moduli are large.
const CLOSE: f64 = 1e-3;

/// Everything a Newton solve works with; buffers are kept from one solve to the next.
pub(crate) struct Workspace<'a, const D: usize> {
    pub model: &'a Model<D>,
    pub equations: &'a Constraints,
    pub assembler: Assembler,
    pub enforced: Box<dyn Enforced>,
    pub factorizer: Box<dyn Factorizer>,
    pub system: System,
    /// Forces alone, beside the matrix of an earlier state.
    pub forces: System,
    pub values: Vec<f64>,
    pub iterations: usize,
    pub inertia: Option<Inertia>,
    /// Whether the first step of the next attempt answers what a probe would be requested: where it is too large for the
    /// load to lead, the attempt ends with `Rejection::TooLarge` and leaves it here.
    pub probe: StepSizeProbe,
}

/// What is known of the tangent displacement to the load.
#[derive(Default)]
pub(crate) enum StepSizeProbe {
    /// Nothing is requested.
    #[default]
    Off,
    /// The next first step tells.
    On,
    /// It was too large.
    TooLarge(Vec<f64>),
}

impl<const D: usize> Workspace<'_, D> {
    /// Iterates `state` to an equilibrium; on rejection the state is left where the attempt ended.
    /// `near` says that the state was predicted from others, so that increments must not grow.
    pub fn newton(
        &mut self,
        settings: &Newton,
        state: &mut State,
        control: Control<'_>,
        observer: &mut dyn Observer,
        scale: f64,
        near: bool,
    ) -> Result<usize, Rejection> {
        let unknowns = self.model.unknowns();
        let mut buffers = Buffers::new(self.equations.len());
        let (mut violation, mut slope) = (Vec::new(), Vec::new());
        let mut next = Increment::new(state);
        let mut imbalance = Vec::new();
        if let Control::Load(load) = control {
            state.load = load;
        }
        let mut small = 0;
        let (mut first, mut before) = (f64::INFINITY, f64::INFINITY);
        let probed = matches!(std::mem::take(&mut self.probe), StepSizeProbe::On);
        let unilateral = self.model.terms().iter().any(|term| term.is_unilateral());
        let mut cycling = ActiveSetCycling::default();
        let rounding = self.model.terms().iter().map(|term| term.rounding()[1].powi(2)).sum::<f64>().sqrt();
        for number in 1..=CYCLING_ITERATIONS * settings.iterations {
            if number > settings.iterations && !cycling.helped() {
                break;
            }
            self.make_room();
            let State { displacement, condensed, load, .. } = &*state;
            self.assembler.assemble(self.model, displacement, condensed, *load, &mut self.system);
            self.iterations += 1;
            if !self.system.scale.is_finite() {
                return Err(Cause::NotFinite.into());
            }
            self.enforced.imbalance(&self.system.residual, &state.multipliers, &mut imbalance);
            let residual = (norm(&imbalance) - rounding).max(0.0) / self.system.scale.max(f64::MIN_POSITIVE);
            self.equations.violation(&state.displacement, state.load, &mut violation);
            if cycling.shift > 0.0 {
                let diagonal = self.assembler.pattern().columns.split_last().map_or(&[][..], |(_, columns)| columns);
                shift_diagonal(&mut self.system.values, diagonal, cycling.shift);
            }
            self.enforced.reduce(&self.system, &mut self.values);
            negate(&mut self.system.residual);
            self.enforced.restrict(&self.system.residual, &violation, &self.system, &mut buffers.rhs);
            if let Control::Functional(..) = control {
                self.equations.load_slope(state.load, &mut slope);
                negate(&mut self.system.load_slope);
                self.enforced.restrict(&self.system.load_slope, &slope, &self.system, &mut buffers.load_rhs);
            }
            self.system.release();
            let (skew, zones) = (&self.system.skew, &self.system.zones);
            let product = |zone: &Zone, x: &[f64], product: &mut Product| self.model.multiply_zone(zone, x, product);
            let linearised = Linearised { values: &self.values, skew, zones, product: &product };
            let here = At { displacement: &state.displacement, condensed: &state.condensed, load: state.load };
            let factors = self.factorizer.factorize_at(linearised, here)?;
            self.inertia = factors.inertia();
            if unilateral {
                let constraints = match self.enforced.class() {
                    MatrixClass::Definite => 0,
                    MatrixClass::Saddle { constraints } => constraints,
                };
                let unstable = self.inertia.is_some_and(|inertia| inertia.negative > constraints);
                if cycling.raise_shift(unstable) {
                    continue;
                }
            }
            let linear =
                Linear { enforced: &*self.enforced, factors: &*factors, system: &self.system, values: &self.values };
            if let Control::Functional(..) = control {
                linear.solve(true, &mut buffers)?;
                linear.enforced.recover(&buffers.solution, &slope, &mut next.load_step, &mut next.load_multipliers);
                next.load_pressures.clone_from(&buffers.pressures);
            }
            linear.solve(false, &mut buffers)?;
            next.pressures.clone_from(&buffers.pressures);
            linear.enforced.recover(&buffers.solution, &violation, &mut next.step, &mut next.multipliers);
            next.meet_control(control, state)?;
            if probed && number == 1 && self.model.largest_gradient(&next.step) > TOO_LARGE {
                self.probe = StepSizeProbe::TooLarge(next.step);
                return Err(Rejection::TooLarge);
            }
            let bound =
                self.model.advance(&state.displacement, &state.condensed, state.load, &next.step, &mut next.condensed);
            if !(bound > 0.0) {
                return Err(Cause::StepLimited { factor: bound }.into());
            }
            let State { displacement, condensed, load, .. } = &*state;
            self.model.advance_load(displacement, condensed, *load, next.load_change, &mut next.condensed);
            self.model.take_pressures(&self.system.zones, &next.pressures, &mut next.condensed);
            let factor = match (settings.search, control) {
                (LineSearch::Slope, Control::Load(_)) => search(
                    self.model,
                    state,
                    &self.system.residual,
                    &Ahead { next: &next, violation: &violation },
                    bound,
                ),
                _ => bound,
            };
            let damping = if unilateral { cycling.damping(norm(&next.step)) } else { 1.0 };
            let factor = factor * damping;
            next.apply(factor, state);
            // Below rounding of the body's own size an increment is nothing.
            let size = norm(&state.displacement).max(1e-6 * scale * (unknowns as f64).sqrt());
            let increment = norm(&next.step) / size;
            if !increment.is_finite() {
                return Err(Cause::NotFinite.into());
            }
            let flow = observer.iteration(&Iteration {
                load: state.load,
                number,
                matrix: MatrixUse::Formed,
                residual,
                increment,
                factor,
            });
            if self.model.is_ended_by(flow) {
                return Err(Rejection::Stopped);
            }
            let left = residual * (increment / before).min(1.0).powi(2).max(linear.factors.relative_residual());
            before = increment;
            if factor == damping
                && cycling.shift == 0.0
                && increment <= settings.tolerance
                && left <= settings.forces_settled()
                && settled(&next, state)
                && condensed_change(self.model, &next, state) <= CONDENSED_SETTLED.max(settings.tolerance)
            {
                return Ok(number);
            }
            if number == 1 {
                first = increment;
            } else if near && !unilateral && increment > (GROWN * first).max(GROWN_LEAST) {
                return Err(Cause::Diverging { increment }.into());
            }
            if factor == 1.0
                && !cycling.helped()
                && increment <= CLOSE
                && settings.tangent_update == TangentUpdate::Modified
                && linear.factors.relative_residual() == 0.0
            {
                let mut kept = ReusedTangent {
                    model: self.model,
                    equations: self.equations,
                    linear,
                    assembler: &mut self.assembler,
                    forces: &mut self.forces,
                    settings,
                    control,
                };
                if kept.settle(state, &mut next, &mut buffers, observer, size) {
                    return Ok(number);
                }
            }
            small = if number >= 2 && factor < SMALL_FACTOR { small + 1 } else { 0 };
            if small >= SMALL_FACTORS {
                return Err(Cause::StepLimited { factor }.into());
            }
        }
        Err(Cause::Iterations(settings.iterations).into())
    }

    /// Negative pivots less constraints at the last factorisation, where the solver knows them.
    pub fn unstable_modes(&self) -> Option<usize> {
        let constraints = match self.enforced.class() {
            MatrixClass::Definite => 0,
            MatrixClass::Saddle { constraints } => constraints,
        };
        self.inertia.map(|inertia| inertia.negative.saturating_sub(constraints))
    }

    /// Gives back what large matrices and factors took before, and asks for the place of the reduced matrix first: the
    /// full one, which goes first, then lies above it and leaves no hole.
    pub(super) fn make_room(&mut self) {
        self.factorizer.release();
        release(&mut self.values);
        self.values.clear();
        self.values.reserve_exact(self.enforced.pattern().entries());
    }

    /// The tangent displacement to the full load at a state: increments for a unit change of the load factor,
    /// with the tangent of that state (at rest: without any follower stiffness).
    pub fn tangent_displacement(&mut self, state: &State) -> Result<Vec<f64>, Rejection> {
        self.make_room();
        self.assembler.assemble(self.model, &state.displacement, &state.condensed, state.load, &mut self.system);
        self.iterations += 1;
        if !self.system.scale.is_finite() {
            return Err(Cause::NotFinite.into());
        }
        self.enforced.reduce(&self.system, &mut self.values);
        let (mut violation, mut buffers) = (Vec::new(), Buffers::new(self.equations.len()));
        self.equations.load_slope(state.load, &mut violation);
        negate(&mut self.system.load_slope);
        self.enforced.restrict(&self.system.load_slope, &violation, &self.system, &mut buffers.rhs);
        self.system.release();
        let (skew, zones) = (&self.system.skew, &self.system.zones);
        let product = |zone: &Zone, x: &[f64], product: &mut Product| self.model.multiply_zone(zone, x, product);
        let linearised = Linearised { values: &self.values, skew, zones, product: &product };
        let here = At { displacement: &state.displacement, condensed: &state.condensed, load: state.load };
        let factors = self.factorizer.factorize_at(linearised, here)?;
        self.inertia = factors.inertia();
        let linear =
            Linear { enforced: &*self.enforced, factors: &*factors, system: &self.system, values: &self.values };
        std::mem::swap(&mut buffers.rhs, &mut buffers.load_rhs);
        linear.solve(true, &mut buffers)?;
        let mut step = vec![0.0; self.model.unknowns()];
        let mut multipliers = vec![0.0; self.equations.len()];
        linear.enforced.recover(&buffers.solution, &violation, &mut step, &mut multipliers);
        Ok(step)
    }

    /// Writes the multipliers of a converged state, for strategies whose multipliers are no unknowns.
    pub fn react(&mut self, state: &mut State) {
        if self.equations.is_empty() {
            return;
        }
        let residual = self.model.residual(&state.displacement, &state.condensed, state.load);
        self.enforced.react(&residual, &mut state.multipliers);
    }
}

/// The largest change of a condensed unknown beside the largest of its term: where the displacement is prescribed, pressures
/// settle after it.
fn condensed_change<const D: usize>(model: &Model<D>, next: &Increment, state: &State) -> f64 {
    let largest = |v: &[f64]| v.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    let terms = next.condensed.iter().zip(&state.condensed).zip(model.terms());
    // What is remembered is no unknown.
    let unknowns = |all: &[f64], term: &dyn Term<D>| {
        let internal_variables = term.internal_variables();
        largest(if internal_variables.is_empty() { all } else { &all[..internal_variables.start] })
    };
    let mut sizes: Vec<f64> = terms.flat_map(|((step, all), term)| [largest(step), unknowns(all, &**term)]).collect();
    if let Some(ranks) = model.ranks() {
        ranks.largest(&mut sizes);
    }
    let part =
        |step: f64, all: f64, rounding: f64| if step <= rounding { 0.0 } else { step / all.max(f64::MIN_POSITIVE) };
    let changes = sizes.chunks_exact(2).zip(model.terms());
    changes.map(|(sizes, term)| part(sizes[0], sizes[1], term.rounding()[0])).fold(0.0, f64::max)
}
