//! Modified Newton: iterations with a matrix that is kept.

use super::convergence::{Convergence, is_load_settled};
use super::equilibrium::Equilibrium;
use super::functional::Control;
use super::increment::Increment;
use super::path::{Iteration, MatrixUse, Observer};
use super::rejection::Rejection;
use super::settings::Newton;
use super::solution::Rhs;
use super::state::State;

/// Iterations with a reused tangent that cost about as much as another matrix with its factors.
const WORTH: f64 = 4.0;
/// An iteration that reduces the last one to no less than this is not taken: the matrix is too old.
const WORST: f64 = 0.5;
/// The last increment, relative to the tolerance of Newton's method: its last iteration leaves an error far below the
/// tolerance, and so shall these. The contraction of two steps does not tell when to stop earlier.
const LAST: f64 = 1e-4;

/// A factorised matrix of an earlier state, and what it takes to go on with it.
pub(super) struct ReusedTangent<'e, 'a> {
    pub equilibrium: &'e mut Equilibrium<'a>,
    /// The answer to a unit of the load, where that is unknown.
    pub response: Option<Increment>,
    pub settings: &'e Newton,
    pub control: Control<'e>,
}

impl ReusedTangent<'_, '_> {
    /// Iterates from the state that the last step has reached, as long as this costs less than a new matrix; `true` at an equilibrium.
    ///
    /// The contraction is that of two steps together: where pressures are condensed every other step mends what the
    /// one before has left, and single steps tell nothing.
    ///
    /// # Errors
    /// Where an observer breaks off.
    pub(crate) fn settle(
        &mut self,
        state: &mut State,
        observer: &mut dyn Observer,
        convergence: &Convergence<'_>,
    ) -> Result<bool, Rejection> {
        // The last two increments.
        let mut before = [convergence.increment; 2];
        for number in 1.. {
            let forces = self.equilibrium.update_residual(state);
            let Some(residual) = forces.ok().filter(|forces| forces.violation == 0.0).map(|forces| forces.residual)
            else {
                return Ok(false);
            };
            let Ok(mut step) = self.equilibrium.solve(Rhs::Residual) else { return Ok(false) };
            if step.meet(self.control, state, self.response.as_ref()).is_err() {
                return Ok(false);
            }
            let increment = step.norm() / convergence.size;
            let contraction = increment / before[0];
            if !(contraction <= WORST) {
                return Ok(false);
            }
            let mut ahead = state.clone();
            let Some(applied) =
                self.equilibrium.apply(&step, 1.0, &mut ahead).ok().filter(|applied| applied.admissible)
            else {
                return Ok(false);
            };
            *state = ahead;
            let matrix = MatrixUse::ReusedTangent;
            let seen = Iteration { load: state.load, number, matrix, residual, increment, factor: 1.0 };
            if self.equilibrium.model.is_ended_by(observer.iteration(&seen)) {
                return Err(Rejection::Stopped);
            }
            let forces = residual * (increment / before[1]).min(1.0);
            if increment <= LAST * self.settings.tolerance
                && forces <= self.settings.forces_settled()
                && is_load_settled(&applied)
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
