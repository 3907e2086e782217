//! Modified Newton: iterations with a matrix that is kept.

use crate::assembly::{Assembler, Model, System};
use crate::boundary::Constraints;
use crate::linear::vector::{negate, norm};

use super::convergence::{Convergence, is_load_settled};
use super::functional::Control;
use super::increment::{Buffers, Increment, Linear, MET};
use super::path::{Iteration, MatrixUse, Observer};
use super::rejection::Rejection;
use super::settings::Newton;
use super::state::State;

/// Iterations with a reused tangent that cost about as much as another matrix with its factors.
const WORTH: f64 = 4.0;
/// An iteration that reduces the last one to no less than this is not taken: the matrix is too old.
const WORST: f64 = 0.5;
/// The last increment, relative to the tolerance of Newton's method: its last iteration leaves an error far below the
/// tolerance, and so shall these. The contraction of two steps does not tell when to stop earlier.
const LAST: f64 = 1e-4;

/// A factorised matrix of an earlier state, and what it takes to go on with it.
pub(super) struct ReusedTangent<'a> {
    pub model: &'a Model,
    pub equations: &'a Constraints,
    pub linear: Linear<'a>,
    pub assembler: &'a mut Assembler,
    /// Forces of the current state.
    pub forces: &'a mut System,
    pub settings: &'a Newton,
    pub control: Control<'a>,
}

impl ReusedTangent<'_> {
    /// Iterates from the state that the last step of `next` has reached, as long as this costs less than a new matrix; `true`
    /// at an equilibrium.
    ///
    /// The contraction is that of two steps together: where pressures are condensed every other step mends what the
    /// one before has left, and single steps tell nothing.
    ///
    /// # Errors
    /// Where an observer breaks off.
    pub(crate) fn settle(
        &mut self,
        state: &mut State,
        next: &mut Increment,
        buffers: &mut Buffers,
        observer: &mut dyn Observer,
        convergence: &Convergence<'_>,
    ) -> Result<bool, Rejection> {
        let size = convergence.size;
        // The last two increments.
        let mut before = [convergence.increment; 2];
        for number in 1.. {
            self.assembler.forces_own(self.model, (&*state).into(), self.forces);
            let violation = &mut buffers.violation;
            self.equations.violation(&state.displacement, state.load, violation);
            // Violations of rows over a boundary are lengths times areas; a step is a length.
            violation
                .iter_mut()
                .zip(self.equations.equations())
                .for_each(|(violation, equation)| *violation /= equation.measure());
            if !self.forces.scale.is_finite() || norm(violation) > MET * size {
                return Ok(false);
            }
            let Linear { enforced, .. } = self.linear;
            enforced.imbalance(&self.forces.residual, &state.multipliers, &mut buffers.imbalance);
            let residual = convergence.relative(&buffers.imbalance, self.forces.scale);
            negate(&mut self.forces.residual);
            enforced.project(&self.forces.residual, &mut buffers.rhs);
            if self.linear.solve(false, buffers).is_err() {
                return Ok(false);
            }
            enforced.recover(&buffers.solution, &buffers.zero_violation, &mut next.step, &mut next.multipliers);
            if next.meet_control(self.control, state).is_err() {
                return Ok(false);
            }
            let increment = norm(&next.step) / size;
            let contraction = increment / before[0];
            if !(contraction <= WORST) {
                return Ok(false);
            }
            if !next.advance(self.model, &[], state).is_ok_and(|admissible| admissible >= 1.0) {
                return Ok(false);
            }
            next.apply(1.0, state);
            let matrix = MatrixUse::ReusedTangent;
            let seen = Iteration { load: state.load, number, matrix, residual, increment, factor: 1.0 };
            if self.model.is_ended_by(observer.iteration(&seen)) {
                return Err(Rejection::Stopped);
            }
            let forces = residual * (increment / before[1]).min(1.0);
            if increment <= LAST * self.settings.tolerance
                && forces <= self.settings.forces_settled()
                && is_load_settled(next, state)
            {
                return Ok(true);
            }
            let steps = 2.0 * (LAST * self.settings.tolerance / increment).ln() / contraction.ln();
            if steps > WORTH {
                return Ok(false);
            }
            before = [before[1], increment];
        }
        Ok(false)
    }
}
