//! Whether a recorded path belongs to the problem that is to go on with it.

use crate::each::Each;
use crate::error::{Error, SolveError};
use crate::linear::vector::norm;

use super::continuation::Continuation;
use super::state::State;

/// What may be left of forces and violations, relative to their own size: far above what Newton's method leaves.
const BALANCED: f64 = 1e-4;
/// How closely a recorded energy is that of its state; machines differ by rounding.
const ENERGY: f64 = 1e-6;
/// The uniform strain whose forces are the least that count: those of a body that only moved are rounding.
const LEAST_STRAIN: f64 = 1e-6;

impl Continuation<'_, '_> {
    /// Refuses a path whose last state is no equilibrium here: it was recorded with another scene or scheme.
    pub(super) fn check_recorded(&mut self) -> Result<(), Error> {
        let Some(step) = self.path.steps.last() else { return Ok(()) };
        let (model, equations, state) = (self.equilibrium.model, self.equilibrium.equations, &step.state);
        let refuse = |what, value| Err(SolveError::OtherProblem { what, value, load: state.load }.into());

        let mut strain = Vec::with_capacity(model.unknowns());
        for node in 0..model.node_count() {
            strain.extend(model.coordinates(node).iter().map(|x| LEAST_STRAIN * x));
        }
        let strained = State { displacement: strain, ..State::at_rest(model, equations) };
        // Forces that are no numbers balance nothing.
        let mut of = |state| {
            let forces = self.equilibrium.forces(state);
            forces.map_or([f64::NAN; 2], |forces| [forces.scale, forces.residual * forces.scale])
        };
        let ([least, _], [size, left]) = (of(&strained), of(state));
        let size = size.max(least);
        let unbalanced = left / size.max(f64::MIN_POSITIVE);
        if !(unbalanced <= BALANCED) {
            return refuse("relative to all forces its unbalanced ones are", unbalanced);
        }

        // Held displacements are sums of coefficients that need not be small themselves.
        let mut left = Vec::new();
        equations.violation(&state.displacement, state.load, &mut left);
        let sums = equations.equations().iter().map(|equation| {
            let sum: f64 = equation.entries.summed(|&(k, c)| (c * state.displacement[k]).abs());
            sum.max((equation.target * equation.amplitude.value(state.load)).abs())
        });
        let violation = norm(&left) / norm(&sums.collect::<Vec<_>>()).max(f64::MIN_POSITIVE);
        if !(violation <= BALANCED) {
            return refuse("it misses the prescribed displacements by a part of", violation);
        }

        let energy = model.at(state)?.energy();
        let off = (energy - step.energy).abs();
        let least = size * norm(&state.displacement);
        // Materials may leave energies undefined.
        if off > ENERGY * energy.abs().max(step.energy.abs()).max(least) {
            return refuse("its energy here differs from the recorded one by a part of", off / step.energy.abs());
        }
        Ok(())
    }
}
