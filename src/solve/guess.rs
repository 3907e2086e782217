//! Guesses, from a coarser model say, brought to the equilibrium at their load factor.

use super::continuation::Continuation;
use super::driver::{along, predict};
use super::functional::{Control, Deflection, Functional};
use super::path::StepControlState;
use super::rejection::Rejection;
use super::state::State;

/// Load factors that differ by less are led from one to the other by the load.
const NEAR: f64 = 1e-2;
/// States under control of the deflection at most on the way to the load factor.
const STATES: usize = 8;

impl<const D: usize> Continuation<'_, '_, D> {
    /// Takes the first state as a guess of the equilibrium at a load factor.
    ///
    /// Where the load can't lead there, as on a bubble that hardly resists to be blown further, the guess's deflection along the load is
    /// held first: what a guess from another model has wrong at that deflection is the load, and secants of load over deflection lead
    /// to the load factor.
    pub(super) fn correct(&mut self, load: f64) {
        let found = match self.iterate(self.state.clone(), Control::Load(load)) {
            Err(Rejection::Stopped) => Err(Rejection::Stopped),
            Err(rejection) => self.by_deflection(load).unwrap_or(Err(rejection)),
            found => found.map(|(_, state)| state),
        };
        match found {
            Ok(state) => {
                // A guess is no equilibrium: its modes count for nothing.
                self.modes = self.workspace.unstable_modes();
                let increment = self.analysis.stepping.first;
                self.accept(state, StepControlState { increment, ..StepControlState::default() });
            }
            Err(rejection) => self.stall(rejection, self.driven()),
        }
    }

    /// The equilibrium at a load factor by way of that at the deflection of the guess; none where no load drives the body alone, or
    /// where states at given deflections do not exist or do not come near the load factor.
    fn by_deflection(&mut self, load: f64) -> Option<Result<State, Rejection>> {
        let model = self.workspace.model;
        let (mut moved, guess) = (Vec::new(), self.state.clone());
        self.workspace.equations.load_slope(guess.load, &mut moved);
        if moved.iter().any(|slope| *slope != 0.0) || model.is_unilateral() || model.is_timed() {
            return None;
        }
        let loads = model.at_own(&guess).load_slope();
        let total: f64 = loads.iter().map(|f| f.abs()).sum();
        if !(total > 0.0 && total.is_finite()) {
            return None;
        }
        let deflection = Deflection { weights: loads.iter().map(|f| -f / total).collect() };
        let mut next = (guess.clone(), deflection.value(&guess.displacement));
        let mut before: Option<State> = None;
        for _ in 0..STATES {
            let (start, value) = next;
            let now = match self.iterate(start, Control::Functional(&deflection, value)) {
                Ok((_, now)) => now,
                Err(Rejection::Stopped) => return Some(Err(Rejection::Stopped)),
                Err(_) => return None,
            };
            let predicted = match &before {
                Some(before) => {
                    let ratio = (load - now.load) / (now.load - before.load);
                    if !ratio.is_finite() {
                        return None;
                    }
                    predict(model, before, &now, ratio)
                }
                None => {
                    let answer = self.workspace.tangent_displacement(&now).ok()?;
                    along(model, &now, &answer, load - now.load)
                }
            };
            if (now.load - load).abs() < NEAR {
                match self.iterate(predicted.clone(), Control::Load(load)) {
                    Ok((_, state)) => return Some(Ok(state)),
                    Err(Rejection::Stopped) => return Some(Err(Rejection::Stopped)),
                    Err(_) => {}
                }
            }
            let value = deflection.value(&predicted.displacement);
            next = (predicted, value);
            before = Some(now);
        }
        None
    }
}
