//! Whether a recorded path belongs to the problem that is to go on with it.

use crate::assembly::{StateRef, System};
use crate::error::{Error, SolveError};
use crate::linear::vector::norm;

use super::continuation::Continuation;

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
        let (model, equations, state) = (self.workspace.model, self.workspace.equations, &step.state);
        let refuse = |what, value| Err(SolveError::OtherProblem { what, value, load: state.load }.into());

        let mut forces = System::default();
        let assembler = &mut self.workspace.assembler;
        let mut strain = Vec::with_capacity(model.unknowns());
        for node in 0..model.node_count() {
            strain.extend(model.coordinates(node).iter().map(|x| LEAST_STRAIN * x));
        }
        assembler.assemble_forces(model, StateRef::new(&strain, &model.start(), 0.0), &mut forces)?;
        let least = forces.scale;
        assembler.assemble_forces(model, state, &mut forces)?;
        let size = forces.scale.max(least);
        let mut left = Vec::new();
        self.workspace.tangent.enforced.imbalance(&forces.residual, &state.multipliers, &mut left);
        let unbalanced = norm(&left) / size.max(f64::MIN_POSITIVE);
        if !(unbalanced <= BALANCED) {
            return refuse("relative to all forces its unbalanced ones are", unbalanced);
        }

        // Held displacements are sums of coefficients that need not be small themselves.
        equations.violation(&state.displacement, state.load, &mut left);
        let sums = equations.equations().iter().map(|equation| {
            let sum: f64 = equation.entries.iter().map(|&(k, c)| (c * state.displacement[k]).abs()).sum();
            sum.max((equation.target * equation.amplitude.evaluate(state.load).0).abs())
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
