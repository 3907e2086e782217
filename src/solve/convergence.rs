//! The convergence test of Newton's method, and the policy for the length of its steps.

use crate::error::Cause;

use super::increment::Applied;
use super::settings::Newton;

/// An unknown load factor is settled once it changes by no more than this part: convergence is quadratic.
const LOAD_SETTLED: f64 = 1e-6;
/// Condensed unknowns are settled once none changes by more than this part of the largest of its term. Convergence is
/// quadratic, but a pressure may be small beside the volumes it is held with.
const CONDENSED_SETTLED: f64 = 1e-8;
/// A predicted attempt whose increments grow beyond this multiple of the first one is too far away.
const GROWN: f64 = 2.0;
/// Increments below this part of the displacement may grow all the same.
const GROWN_LEAST: f64 = 1e-2;
/// Step factors below this from the second iteration on mean that the attempt is too far away.
const SMALL_FACTOR: f64 = 0.3;
/// Small factors in a row before the attempt is given up.
const SMALL_FACTORS: usize = 3;

/// Increments $\eta_k = |\delta d_k| / |d_k|$ of an attempt and the rate $\rho = \eta_k/\eta_{k-1}$ at which they fall.
pub(super) struct Convergence<'a> {
    settings: &'a Newton,
    /// Whether increments may not grow, as from a state that was predicted from others.
    falling: bool,
    first: f64,
    /// What increments are measured against: the norm of the displacement.
    pub size: f64,
    pub increment: f64,
    rate: f64,
}

impl<'a> Convergence<'a> {
    /// `falling` says whether growing increments end the attempt.
    pub(crate) fn new(settings: &'a Newton, falling: bool) -> Self {
        let first = f64::INFINITY;
        Convergence { settings, falling, first, size: 0.0, increment: f64::INFINITY, rate: 1.0 }
    }

    /// Takes note of a step relative to the size of the state that it has led to.
    pub(crate) fn record(&mut self, size: f64, increment: f64) {
        self.size = size;
        self.rate = increment / self.increment;
        if self.first.is_infinite() {
            self.first = increment;
        }
        self.increment = increment;
    }

    /// Whether the last step was the last one needed: it is small, and so is what it leaves of the residual that it was found
    /// for. That falls with the square of the rate, or by no more than the linear solution has left of it.
    pub(crate) fn is_reached(&self, applied: &Applied, residual: f64, linear: f64) -> bool {
        let left = residual * self.rate.min(1.0).powi(2).max(linear);
        self.increment <= self.settings.tolerance
            && left <= self.settings.forces_settled()
            && is_load_settled(applied)
            && applied.condensed <= CONDENSED_SETTLED.max(self.settings.tolerance)
    }

    /// Ends attempts whose increments grow although they were predicted.
    pub(crate) fn check_growth(&self) -> Result<(), Cause> {
        if self.falling && self.increment > (GROWN * self.first).max(GROWN_LEAST) {
            return Err(Cause::Diverging { increment: self.increment });
        }
        Ok(())
    }
}

/// Steps in a row that the step limiter has cut short.
#[derive(Default)]
pub(super) struct CutSteps(usize);

impl CutSteps {
    /// Ends attempts whose steps are cut again and again: of this one a factor was taken, and would have been by damping alone.
    pub(crate) fn check(&mut self, number: usize, factor: f64, damping: f64) -> Result<(), Cause> {
        self.0 = if number >= 2 && factor < SMALL_FACTOR * damping { self.0 + 1 } else { 0 };
        if self.0 >= SMALL_FACTORS {
            return Err(Cause::StepLimited { factor });
        }
        Ok(())
    }
}

/// Whether an unknown load has come to rest: the load of a nearly incompressible wall settles after its displacement.
pub(super) fn is_load_settled(applied: &Applied) -> bool {
    applied.load <= LOAD_SETTLED
}
