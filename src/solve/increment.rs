//! One step of all unknowns, and the linear systems behind it.

use crate::assembly::{Model, System};
use crate::boundary::{Constraints, Enforced};
use crate::error::{Cause, LinearError};
use crate::linear::vector::{dot, negate, norm};
use crate::linear::{Inertia, LinearSolver, LinearSystem, minimal_residuals};
use crate::term::Zone;

use super::functional::Control;
use super::rejection::Rejection;
use super::state::State;

/// Linear solutions are refined until this relative residual: what is left of it is corrected by Newton's next
/// iteration, which would leave as much by its own rounding.
const REFINED: f64 = 1e-10;
/// Where there is a skew part, until this one: each sweep costs a solution, and Newton's next iteration finds what is
/// left of it at once.
const SWEPT: f64 = 1e-6;

/// Sweeps over the skew part that leave more than this part of the residual of the one before give way to minimal residuals.
const SLOW: f64 = 0.5;
/// Inverse iterations for a mode that is near enough.
const INVERSE_ITERATIONS: usize = 4;
/// The golden ratio, whose multiples leave no two parts of 1 close together.
const GOLDEN: f64 = 0.618_033_988_749_894_9;
/// What is left of prescribed values below this part of a step, or of the value, is rounding: they are met.
pub(super) const MET: f64 = 1e-12;

/// A step of displacement, multipliers, load and condensed unknowns.
pub(super) struct Increment {
    pub step: Vec<f64>,
    /// Multipliers of the whole step.
    pub multipliers: Vec<f64>,
    pub condensed: Vec<Vec<f64>>,
    /// The answer to a unit change of the load.
    pub load_step: Vec<f64>,
    pub load_multipliers: Vec<f64>,
    pub load_change: f64,
    /// Changes of pressures that are kept uncondensed, and their answer to a unit change of the load.
    pub pressures: Vec<[f64; 4]>,
    pub load_pressures: Vec<[f64; 4]>,
    gradient: Vec<f64>,
}

impl Increment {
    pub(crate) fn new(state: &State) -> Self {
        let (unknowns, equations) = (state.displacement.len(), state.multipliers.len());
        Increment {
            step: vec![0.0; unknowns],
            multipliers: vec![0.0; equations],
            condensed: state.condensed.iter().map(|l| vec![0.0; l.len()]).collect(),
            load_step: vec![0.0; unknowns],
            load_multipliers: vec![0.0; equations],
            load_change: 0.0,
            pressures: Vec::new(),
            load_pressures: Vec::new(),
            gradient: vec![0.0; unknowns],
        }
    }

    /// Solves for the increments under a control.
    pub(crate) fn solve(
        &mut self,
        linear: &mut Linear<'_>,
        control: Control<'_>,
        state: &State,
        buffers: &mut Buffers,
    ) -> Result<(), Rejection> {
        if let Control::Functional(..) = control {
            linear.solve(true, buffers)?;
            linear.enforced.recover(&buffers.solution, &buffers.slope, &mut self.load_step, &mut self.load_multipliers);
            self.load_pressures.clone_from(&buffers.pressures);
        }
        linear.solve(false, buffers)?;
        self.pressures.clone_from(&buffers.pressures);
        linear.enforced.recover(&buffers.solution, &buffers.violation, &mut self.step, &mut self.multipliers);
        self.meet_control(control, state)?;
        Ok(())
    }

    /// Recovers the increments of the condensed unknowns; the largest part of the step that is admissible.
    pub(crate) fn advance(&mut self, model: &Model, zones: &[Zone], state: &State) -> Result<f64, Cause> {
        let here = model.at_own(state);
        let bound = here.advance_own(&self.step, &mut self.condensed);
        if !(bound > 0.0) {
            return Err(Cause::StepLimited { factor: bound });
        }
        here.advance_load(self.load_change, &mut self.condensed);
        here.take_pressures(zones, &self.pressures, &mut self.condensed);
        Ok(bound)
    }

    /// Adds as much of the answer to the load as brings a controlled functional to its target.
    pub(crate) fn meet_control(&mut self, control: Control<'_>, state: &State) -> Result<(), Cause> {
        let Control::Functional(functional, target) = control else { return Ok(()) };
        functional.gradient(&state.displacement, &mut self.gradient);
        let along = dot(&self.gradient, &self.load_step);
        let missing = target - functional.value(&state.displacement) - dot(&self.gradient, &self.step);
        self.load_change = missing / along;
        if !self.load_change.is_finite() {
            return Err(Cause::Control);
        }
        for (s, l) in self.step.iter_mut().zip(&self.load_step) {
            *s += self.load_change * l;
        }
        for (m, l) in self.multipliers.iter_mut().zip(&self.load_multipliers) {
            *m += self.load_change * l;
        }
        for (p, l) in self.pressures.as_flattened_mut().iter_mut().zip(self.load_pressures.as_flattened()) {
            *p += self.load_change * l;
        }
        Ok(())
    }

    /// Takes `factor` of the step.
    pub(crate) fn apply(&self, factor: f64, state: &mut State) {
        for (d, s) in state.displacement.iter_mut().zip(&self.step) {
            *d += factor * s;
        }
        for (l, s) in state.condensed.iter_mut().flatten().zip(self.condensed.iter().flatten()) {
            *l += factor * s;
        }
        // Multipliers are linear in the increment: those of the full step belong to the full step.
        for (m, new) in state.multipliers.iter_mut().zip(&self.multipliers) {
            *m += factor * (new - *m);
        }
        state.load += factor * self.load_change;
    }
}

/// Right-hand sides of one linear solve, and buffers.
#[derive(Default)]
pub(super) struct Buffers {
    pub solution: Vec<f64>,
    pub rhs: Vec<f64>,
    pub load_rhs: Vec<f64>,
    /// $g - Gd$.
    pub violation: Vec<f64>,
    /// $\partial g/\partial\lambda$.
    pub slope: Vec<f64>,
    /// Forces that neither the conditions nor the body balance, by reduced unknowns.
    pub imbalance: Vec<f64>,
    /// Right-hand sides of pressures that are kept uncondensed, then their changes.
    pub pressures: Vec<[f64; 4]>,
    correction: Vec<f64>,
    full: Vec<f64>,
    product: Vec<f64>,
    projected: Vec<f64>,
    skew: Vec<f64>,
    pub zero_violation: Vec<f64>,
    unused: Vec<f64>,
    /// The part of the right-hand side, or of what sweeps had left of it, that minimal residuals have left.
    left: f64,
}

impl Buffers {
    pub(crate) fn new(equations: usize) -> Self {
        Buffers { zero_violation: vec![0.0; equations], unused: vec![0.0; equations], ..Buffers::default() }
    }

    /// Forms the right-hand sides for increments under a control. The residual of the system changes its sign.
    pub(crate) fn form(
        &mut self,
        enforced: &dyn Enforced,
        system: &mut System,
        equations: &Constraints,
        state: &State,
        control: Control<'_>,
    ) {
        enforced.imbalance(&system.residual, &state.multipliers, &mut self.imbalance);
        equations.violation(&state.displacement, state.load, &mut self.violation);
        negate(&mut system.residual);
        enforced.restrict(&system.residual, &self.violation, system, &mut self.rhs);
        if let Control::Functional(..) = control {
            self.form_load(enforced, system, equations, state);
        }
    }

    /// Forms the right-hand side for the answer to the load. The load slope of the system changes its sign.
    pub(crate) fn form_load(
        &mut self,
        enforced: &dyn Enforced,
        system: &mut System,
        equations: &Constraints,
        state: &State,
    ) {
        equations.load_slope(state.load, &mut self.slope);
        negate(&mut system.load_slope);
        enforced.restrict(&system.load_slope, &self.slope, system, &mut self.load_rhs);
    }
}

/// A factorised reduced system with its matrix.
pub(super) struct Linear<'a> {
    pub enforced: &'a dyn Enforced,
    pub solver: &'a mut dyn LinearSolver,
    /// Signs of the pivots.
    pub inertia: Option<Inertia>,
    /// The part of the residual that the last solution has left: 0 with factors.
    pub left: f64,
    /// For the skew part.
    pub system: &'a System,
    /// What the solver has factorised.
    pub reduced: LinearSystem<'a>,
}

impl Linear<'_> {
    /// Negative pivots less constraints; 0 where the solver does not know them.
    pub(crate) fn unstable_modes(&self) -> usize {
        let constraints = self.enforced.class().constraints();
        self.inertia.map_or(0, |inertia| inertia.negative.saturating_sub(constraints))
    }

    /// Solves for the answer to a load that no further iteration corrects: pressures kept uncondensed have no part in the right-hand side.
    ///
    /// # Errors
    /// Also where sweeps and minimal residuals over the skew part leave more than Newton's next iteration would correct.
    pub(crate) fn solve_fully(&mut self, rhs: Vec<f64>, buffers: &mut Buffers) -> Result<(), LinearError> {
        buffers.load_rhs = rhs;
        self.solve_for((true, true), buffers)?;
        // Iterations do not refine.
        if self.left == 0.0 && !(buffers.left <= SWEPT) {
            return Err(LinearError::Residual { residual: buffers.left });
        }
        Ok(())
    }

    /// Solves for a reduced right-hand side: the symmetric factors carry the symmetric part, sweeps of iterative
    /// refinement the skew part and what rounding left.
    pub(crate) fn solve(&mut self, load: bool, buffers: &mut Buffers) -> Result<(), LinearError> {
        self.solve_for((load, false), buffers)
    }

    fn solve_for(&mut self, (load, fully): (bool, bool), buffers: &mut Buffers) -> Result<(), LinearError> {
        let Linear { enforced, solver, system, reduced, .. } = self;
        let symmetric = system.is_symmetric();
        let rhs = if load { &buffers.load_rhs } else { &buffers.rhs };
        buffers.left = 0.0;
        buffers.solution.clone_from(rhs);
        // Loads move forces alone.
        let gap = |zone: &Zone| if load { [0.0; 4] } else { zone.gap() };
        buffers.pressures.clear();
        buffers.pressures.extend(system.zones.iter().map(gap));
        let pressures = (!fully).then_some(&mut buffers.pressures[..]);
        self.left = solver.solve(reduced, &mut buffers.solution, pressures)?;
        let size = norm(rhs);
        if self.left > 0.0 {
            return Ok(());
        }
        let mut before = f64::INFINITY;
        let mut residual = 0.0;
        for sweep in 0.. {
            buffers.product.clear();
            buffers.product.resize(rhs.len(), 0.0);
            enforced.pattern().multiply_add(reduced.values, &buffers.solution, &mut buffers.product);
            if !symmetric {
                buffers.full.resize(system.residual.len(), 0.0);
                enforced.recover(&buffers.solution, &buffers.zero_violation, &mut buffers.full, &mut buffers.unused);
                buffers.skew.clear();
                buffers.skew.resize(system.residual.len(), 0.0);
                system.skew_multiply_add(&buffers.full, &mut buffers.skew);
                enforced.project(&buffers.skew, &mut buffers.projected);
                for (p, s) in buffers.product.iter_mut().zip(&buffers.projected) {
                    *p += s;
                }
            }
            system.over_ranks(&mut buffers.product);
            buffers.correction.clear();
            buffers.correction.extend(rhs.iter().zip(&buffers.product).map(|(b, p)| b - p));
            residual = norm(&buffers.correction);
            if !residual.is_finite() {
                return Err(LinearError::Residual { residual });
            }
            // One sweep removes the rounding of the factors; the skew part needs as many as it takes, each of which leaves no
            // more than half.
            if residual <= (if symmetric { REFINED } else { SWEPT }) * size || (symmetric && sweep > 0) {
                break;
            }
            if residual > SLOW * before {
                return self.minimise(residual > size, load, buffers);
            }
            before = residual;
            solver.solve(reduced, &mut buffers.correction, None)?;
            for (x, c) in buffers.solution.iter_mut().zip(&buffers.correction) {
                *x += c;
            }
        }
        // A solution of a regular system leaves next to nothing; what is left of a singular one is of its own size.
        if symmetric && residual > 1e-3 * size {
            return Err(LinearError::Residual { residual: residual / size });
        }
        Ok(())
    }

    /// The displacement that the stiffness answers to least, by inverse iteration: a mode of an unstable state, or a soft one beside it.
    pub(crate) fn weakest_mode(&mut self, buffers: &mut Buffers, unknowns: usize) -> Result<Vec<f64>, LinearError> {
        let Linear { enforced, solver, reduced, .. } = self;
        // From anything that has a part of all modes.
        let mut mode: Vec<f64> = (0..unknowns).map(|k| ((k + 1) as f64 * GOLDEN).fract() - 0.5).collect();
        for _ in 0..INVERSE_ITERATIONS {
            enforced.project(&mode, &mut buffers.projected);
            solver.solve(reduced, &mut buffers.projected, None)?;
            enforced.recover(&buffers.projected, &buffers.zero_violation, &mut mode, &mut buffers.unused);
            let size = norm(&mode);
            if !(size > 0.0 && size.is_finite()) {
                return Err(LinearError::Residual { residual: size });
            }
            mode.iter_mut().for_each(|u| *u /= size);
        }
        Ok(mode)
    }

    /// Minimal residuals of $(1 + K^{-1}N)\\,x = K^{-1}b$, from zero or from what sweeps have found with the residual left
    /// in the correction: where the skew part is no longer small beside the stiffness, as in slender bodies with free ends
    /// under following pressure, sweeps diverge.
    fn minimise(&mut self, from_zero: bool, load: bool, buffers: &mut Buffers) -> Result<(), LinearError> {
        let Linear { enforced, solver, system, reduced, .. } = self;
        if from_zero {
            buffers.correction.clone_from(if load { &buffers.load_rhs } else { &buffers.rhs });
            buffers.solution.fill(0.0);
        }
        let Buffers { solution, correction, full, projected, skew, zero_violation, unused, left: part, .. } = buffers;
        solver.solve(reduced, correction, None)?;
        let (found, left) = minimal_residuals(correction, SWEPT, |last, product| {
            full.resize(system.residual.len(), 0.0);
            enforced.recover(last, zero_violation, full, unused);
            skew.clear();
            skew.resize(system.residual.len(), 0.0);
            system.skew_multiply_add(full, skew);
            enforced.project(skew, projected);
            system.over_ranks(projected);
            solver.solve(reduced, projected, None)?;
            product.iter_mut().zip(last).zip(projected.iter()).for_each(|((p, v), n)| *p = v + n);
            Ok(())
        })?;
        *part = left;
        solution.iter_mut().zip(&found).for_each(|(x, v)| *x += v);
        Ok(())
    }
}
