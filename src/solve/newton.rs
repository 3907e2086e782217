//! One Newton solve: from a predicted state to an equilibrium under a control.

use crate::each::{Each, add};
use crate::error::Cause;

use super::active_set::ActiveSetCycling;
use super::convergence::{Convergence, CutSteps};
use super::equilibrium::{Equilibrium, Linearized};
use super::functional::Control;
use super::increment::Increment;
use super::path::{Iteration, MatrixUse, Observer};
use super::rejection::Rejection;
use super::reused_tangent::ReusedTangent;
use super::settings::{Newton, TangentUpdate};
use super::solution::Rhs;
use super::state::State;

/// Increments below this part of the displacement are small enough to go on with the same matrix; after larger ones it
/// seldom contracts where bulk moduli are large.
const CLOSE: f64 = 1e-3;

/// How far an attempt is pushed off an unstable state, as a part of the extent of the body: more than rounding, less than a change of
/// shape.
const PUSH: f64 = 1e-3;

/// What an attempt is to reach, and what is known of its first state.
#[derive(Clone, Copy)]
pub(super) struct Attempt<'a> {
    pub control: Control<'a>,
    /// Whether the first state was predicted from others, so that increments must not grow.
    pub predicted: bool,
    /// The largest $|\nabla u|$ that the first step may have: beyond, the attempt ends with [`Rejection::TooLarge`].
    pub largest_first_step: f64,
}

impl Equilibrium<'_> {
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
        let (model, control) = (self.model, attempt.control);
        let unilateral = model.is_unilateral();
        let mut cycling = ActiveSetCycling::new(unilateral, model.hold_searches(false));
        let mut convergence = Convergence::new(settings, attempt.predicted && !unilateral);
        let mut cut = CutSteps::default();
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
            let linear = self.linearize_with(state, cycling.shift)?;
            let modes = linear.unstable.unwrap_or(0);
            if cycling.raise_shift(modes > 0) {
                continue;
            }
            let (step, response) = self.step(control, state)?;
            if number == 1 && attempt.is_too_large(self, &step) {
                return Err(Rejection::TooLarge(step.displacement));
            }
            let damping = cycling.damping(&step.displacement);
            let applied = self.apply(&step, damping, state)?;
            if cycling.held && !held {
                held = model.hold_searches(true);
            }
            convergence.record(self.size(&state.displacement), applied.increment);
            let Linearized { residual, .. } = linear;
            let (increment, matrix) = (applied.increment, MatrixUse::Formed);
            let seen = Iteration { load: state.load, number, matrix, residual, increment, factor: applied.part };
            if model.is_ended_by(observer.iteration(&seen)) {
                return Err(Rejection::Stopped);
            }
            let close = settings.tangent_update == TangentUpdate::Modified && increment <= CLOSE;
            if close && step.left > 0.0 {
                near.get_or_insert(number);
            }
            let settled = applied.admissible && cycling.shift == 0.0;
            let unstable = stable && modes > 0;
            if settled && convergence.is_reached(&applied, residual, step.left) {
                if !unstable {
                    return Ok(near.unwrap_or(number));
                }
                ensure!(!pushed, Cause::NoStableState { modes });
                pushed = true;
                self.push(state)?;
                cycling.push_off();
                continue;
            }
            convergence.check_growth()?;
            if applied.part == 1.0 && !cycling.is_at_work() && !unstable && close && step.left == 0.0 {
                let mut kept = ReusedTangent { equilibrium: self, response, settings, control };
                if kept.settle(state, observer, &convergence)? {
                    return Ok(number);
                }
            }
            cut.check(number, applied.part, damping)?;
        }
        Err(Cause::Iterations(number).into())
    }

    /// The step under a control, and the answer to a unit of the load where that is unknown.
    fn step(&mut self, control: Control<'_>, state: &State) -> Result<(Increment, Option<Increment>), Cause> {
        let response = match control {
            Control::Functional(..) => Some(self.load_response()?),
            Control::Load(_) => None,
        };
        let mut step = self.solve(Rhs::Residual)?;
        step.meet(control, state, response.as_ref())?;
        Ok((step, response))
    }

    /// Pushes a state along the mode that it resists least.
    fn push(&mut self, state: &mut State) -> Result<(), Cause> {
        let mode = self.weakest_mode()?;
        let size = PUSH * self.extent / mode.largest(|u| u.abs());
        add(&mut state.displacement, size, &mode);
        Ok(())
    }

    /// The tangent displacement to the full load at a state: increments for a unit change of the load factor,
    /// with the tangent of that state (at rest: without any follower stiffness).
    pub(super) fn tangent_displacement(&mut self, state: &State) -> Result<Vec<f64>, Cause> {
        self.linearize(state)?;
        Ok(self.load_response()?.displacement)
    }
}

impl Attempt<'_> {
    /// Whether the first increment is too large to start from with this control.
    fn is_too_large(&self, equilibrium: &Equilibrium<'_>, first: &Increment) -> bool {
        self.largest_first_step.is_finite()
            && equilibrium.largest_gradient(&first.displacement) > self.largest_first_step
    }
}
