//! One Newton solve: from a predicted state to an equilibrium under a control.

use crate::assembly::{Assembler, Model, System};
use crate::boundary::Constraints;
use crate::error::Cause;
use crate::linear::Inertia;

use super::active_set::ActiveSetCycling;
use super::convergence::{Convergence, StepLength};
use super::functional::Control;
use super::increment::{Buffers, Increment, Linear};
use super::path::{Iteration, MatrixUse, Observer};
use super::rejection::Rejection;
use super::reused_tangent::ReusedTangent;
use super::settings::{Newton, TangentUpdate};
use super::state::State;
use super::tangent::Tangent;

/// Increments below this part of the displacement are small enough to go on with the same matrix; after larger ones it
/// seldom contracts where bulk moduli are large.
const CLOSE: f64 = 1e-3;

/// How far an attempt is pushed off an unstable state, as a part of the extent of the body: more than rounding, less than a change of
/// shape.
const PUSH: f64 = 1e-3;

/// Everything a Newton solve works with; buffers are kept from one solve to the next.
pub(crate) struct Workspace<'a> {
    pub model: &'a Model,
    pub equations: &'a Constraints,
    pub assembler: Assembler,
    pub tangent: Tangent<'a>,
    /// Forces alone, beside the matrix of an earlier state.
    pub forces: System,
    pub iterations: usize,
    pub inertia: Option<Inertia>,
}

/// What an attempt is to reach, and what is known of its first state.
#[derive(Clone, Copy)]
pub(super) struct Attempt<'a> {
    pub control: Control<'a>,
    /// The extent of the body \[length\].
    pub extent: f64,
    /// Whether the first state was predicted from others, so that increments must not grow.
    pub predicted: bool,
    /// The largest $|\nabla u|$ that the first step may have: beyond, the attempt ends with [`Rejection::TooLarge`].
    pub largest_first_step: f64,
}

impl Workspace<'_> {
    /// Iterates `state` to an equilibrium; on rejection the state is left where the attempt ended.
    pub(super) fn newton(
        &mut self,
        settings: &Newton,
        state: &mut State,
        attempt: &Attempt<'_>,
        observer: &mut dyn Observer,
    ) -> Result<usize, Rejection> {
        let found = self.iterate(settings, state, attempt, observer);
        self.model.hold_searches(false);
        found
    }

    fn iterate(
        &mut self,
        settings: &Newton,
        state: &mut State,
        attempt: &Attempt<'_>,
        observer: &mut dyn Observer,
    ) -> Result<usize, Rejection> {
        let Workspace { model, equations, assembler, tangent, .. } = self;
        let (model, equations, control) = (*model, *equations, attempt.control);
        let unilateral = model.is_unilateral();
        let mut cycling = ActiveSetCycling::new(unilateral, model.hold_searches(false));
        let mut convergence = Convergence::new(settings, model, attempt.extent, attempt.predicted && !unilateral);
        let (mut length, mut next, mut buffers) =
            (StepLength::default(), Increment::new(state), Buffers::new(equations.len()));
        if let Control::Load(load) = control {
            state.load = load;
        }
        let mut number = 0;
        // What follows the first small increment does not count: factors would be used again there.
        let mut near = None;
        let (mut held, mut pushed) = (false, false);
        // Where paths are followed through critical points, states beyond them count as well.
        let stable = unilateral && settings.tangent_update != TangentUpdate::EveryIteration;
        while cycling.allows(number, settings.iterations) {
            number += 1;
            self.iterations += 1;
            let mut linear = tangent.linearise(assembler, state, cycling.shift, |enforced, system| {
                buffers.form(enforced, system, equations, state, control);
            })?;
            self.inertia = linear.inertia;
            if cycling.raise_shift(linear.unstable_modes() > 0) {
                continue;
            }
            next.solve(&mut linear, control, state, &mut buffers)?;
            if number == 1 && attempt.is_too_large(model, &next) {
                return Err(Rejection::TooLarge(next.step));
            }
            let factor = length.choose(next.advance(model, &linear.system.zones, state)?, cycling.damping(&next.step));
            if cycling.held && !held {
                held = model.hold_searches(true);
            }
            next.apply(factor, state);
            convergence.record(&next.step, state)?;
            let (residual, increment) =
                (convergence.relative(&buffers.imbalance, linear.system.scale), convergence.increment);
            let matrix = MatrixUse::Formed;
            let seen = Iteration { load: state.load, number, matrix, residual, increment, factor };
            if model.is_ended_by(observer.iteration(&seen)) {
                return Err(Rejection::Stopped);
            }
            if is_near(settings, increment) && linear.left > 0.0 {
                near.get_or_insert(number);
            }
            let settled = length.is_admissible() && cycling.shift == 0.0;
            let unstable = stable && linear.unstable_modes() > 0;
            if settled && convergence.is_reached(model, &next, state, residual, linear.left) {
                if !unstable {
                    return Ok(near.unwrap_or(number));
                }
                if pushed {
                    return Err(Cause::NoStableState { modes: linear.unstable_modes() }.into());
                }
                pushed = true;
                let mode = linear.weakest_mode(&mut buffers, state.displacement.len())?;
                let size = PUSH * attempt.extent / mode.iter().fold(0.0f64, |largest, u| largest.max(u.abs()));
                state.displacement.iter_mut().zip(&mode).for_each(|(d, u)| *d += size * u);
                cycling.push_off();
                continue;
            }
            convergence.check_growth()?;
            if factor == 1.0 && !cycling.is_at_work() && !unstable && may_reuse(settings, increment, &linear) {
                let forces = &mut self.forces;
                let mut kept = ReusedTangent { model, equations, linear, assembler, forces, settings, control };
                if kept.settle(state, &mut next, &mut buffers, observer, &convergence)? {
                    return Ok(number);
                }
            }
            length.check(number)?;
        }
        Err(Cause::Iterations(settings.iterations).into())
    }

    /// Negative pivots less constraints at the last factorisation, where the solver knows them.
    pub(crate) fn unstable_modes(&self) -> Option<usize> {
        let constraints = self.tangent.enforced.class().constraints();
        self.inertia.map(|inertia| inertia.negative.saturating_sub(constraints))
    }

    /// The tangent displacement to the full load at a state: increments for a unit change of the load factor,
    /// with the tangent of that state (at rest: without any follower stiffness).
    pub(crate) fn tangent_displacement(&mut self, state: &State) -> Result<Vec<f64>, Rejection> {
        let mut buffers = Buffers::new(self.equations.len());
        let equations = self.equations;
        self.iterations += 1;
        let mut linear = self.tangent.linearise(&mut self.assembler, state, 0.0, |enforced, system| {
            buffers.form_load(enforced, system, equations, state);
        })?;
        self.inertia = linear.inertia;
        linear.solve(true, &mut buffers)?;
        let mut step = vec![0.0; self.model.unknowns()];
        let mut multipliers = vec![0.0; self.equations.len()];
        linear.enforced.recover(&buffers.solution, &buffers.slope, &mut step, &mut multipliers);
        Ok(step)
    }

    /// Writes the multipliers of a converged state, for strategies whose multipliers are no unknowns.
    pub(crate) fn react(&mut self, state: &mut State) {
        if self.equations.is_empty() {
            return;
        }
        let residual = self.model.at_own(&*state).residual();
        self.tangent.enforced.react(&residual, &mut state.multipliers);
    }
}

impl Attempt<'_> {
    /// Whether the first increment is too large to start from with this control.
    fn is_too_large(&self, model: &Model, first: &Increment) -> bool {
        self.largest_first_step.is_finite() && model.largest_gradient(&first.step) > self.largest_first_step
    }
}

/// Whether the next iterations may go on with the matrix of this one.
fn may_reuse(settings: &Newton, increment: f64, linear: &Linear<'_>) -> bool {
    is_near(settings, increment) && linear.left == 0.0
}

/// Whether an increment is so small that factors would go on with this matrix.
fn is_near(settings: &Newton, increment: f64) -> bool {
    settings.tangent_update == TangentUpdate::Modified && increment <= CLOSE
}
