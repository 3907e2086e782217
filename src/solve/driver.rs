//! What is controlled where the load factor is an unknown, and where attempts start.

use crate::each::Each;
use crate::term::TermStep;

use super::equilibrium::Equilibrium;
use super::functional::{Deflection, Functional};
use super::increment::Increment;
use super::state::State;

/// What is controlled in a run whose load factor is an unknown.
pub(super) enum Driver {
    /// A generalised deflection.
    Deflection(Deflection),
    /// The arc length over the displacements; the first arc runs along this tangent displacement.
    Arc(Vec<f64>),
}

/// $|d - d_n|$, root of the mean square \[length\].
pub(super) struct Arc {
    pub(super) from: Vec<f64>,
}

impl Functional for Arc {
    fn value(&self, displacement: &[f64]) -> f64 {
        let sum: f64 = displacement.pair_sum(&self.from, |d, n| (d - n).powi(2));
        (sum / self.from.len() as f64).sqrt()
    }

    fn gradient(&self, displacement: &[f64], out: &mut [f64]) {
        // Undefined at the centre, where no attempt starts.
        let scale = 1.0 / (self.value(displacement) * self.from.len() as f64);
        for (g, (d, n)) in out.iter_mut().zip(displacement.iter().zip(&self.from)) {
            *g = scale * (d - n);
        }
    }
}

impl Equilibrium<'_> {
    /// A state `factor` times a tangent displacement ahead, as far as that is admissible, its condensed unknowns recovered along.
    pub(super) fn along(&mut self, state: &State, answer: &[f64], factor: f64) -> State {
        let displacement = answer.mapped(|a| factor * a);
        let multipliers = vec![0.0; state.multipliers.len()];
        let step = Increment { displacement, multipliers, load: factor, ..Increment::default() };
        let mut ahead = state.clone();
        if self.apply(&step, 1.0, &mut ahead).is_ok() { ahead } else { state.clone() }
    }

    pub(super) fn predict(&self, before: &State, state: &State, ratio: f64) -> State {
        let mut predicted = state.clone();
        let step: Vec<f64> = state.displacement.paired(&before.displacement, |now, then| ratio * (now - then));
        let mut unused: Vec<Vec<f64>> = state.terms.mapped(|own| vec![0.0; own.condensed.len()]);
        // Rigid surfaces move with the load: how far in a step leads is judged at the load that is predicted.
        predicted.load += ratio * (state.load - before.load);
        let factor =
            self.model.at_own(&predicted).advance_own(TermStep { displacement: &step, load: 0.0 }, &mut unused);
        for (d, s) in predicted.displacement.iter_mut().zip(&step) {
            *d += factor * s;
        }
        // What is remembered is held.
        for (own, (now, then)) in predicted.terms.iter_mut().zip(state.terms.iter().zip(&before.terms)) {
            for (l, (now, then)) in own.condensed.iter_mut().zip(now.condensed.iter().zip(&then.condensed)) {
                *l += factor * ratio * (now - then);
            }
        }
        predicted.load = state.load + factor * ratio * (state.load - before.load);
        predicted
    }
}
