//! The convergence test of Newton's method, and the policy for the length of its steps.

use crate::assembly::Model;
use crate::error::Cause;
use crate::linear::vector::norm;
use crate::term::{Term, variables_range};

use super::increment::Increment;
use super::settings::Newton;
use super::state::State;

/// An unknown load factor is settled once it changes by no more than this part: convergence is quadratic.
const LOAD_SETTLED: f64 = 1e-6;
/// Load factors below this count as this one: a path may pass through zero.
const LEAST_LOAD: f64 = 1e-3;
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
    /// Displacements below this are none \[norm of all coefficients, length\].
    least: f64,
    /// Norm of the forces that is rounding.
    rounding: f64,
    /// Whether increments may not grow, as from a state that was predicted from others.
    falling: bool,
    first: f64,
    /// What increments are measured against: the norm of the displacement.
    pub size: f64,
    pub increment: f64,
    rate: f64,
}

impl<'a> Convergence<'a> {
    /// `extent` is the size of the body \[length\]; `falling` whether growing increments end the attempt.
    pub(crate) fn new(settings: &'a Newton, model: &Model, extent: f64, falling: bool) -> Self {
        Convergence {
            settings,
            // Below rounding of the body's own size an increment is nothing.
            least: 1e-6 * extent * (model.unknowns() as f64).sqrt(),
            rounding: model.terms().iter().map(|term| rounding_of(&**term)[1].powi(2)).sum::<f64>().sqrt(),
            falling,
            first: f64::INFINITY,
            size: 0.0,
            increment: f64::INFINITY,
            rate: 1.0,
        }
    }

    /// A norm of unbalanced forces beside that of all forces.
    pub(crate) fn relative(&self, imbalance: &[f64], scale: f64) -> f64 {
        (norm(imbalance) - self.rounding).max(0.0) / scale.max(f64::MIN_POSITIVE)
    }

    /// Takes note of the step that has led to a state.
    pub(crate) fn record(&mut self, step: &[f64], state: &State) -> Result<(), Cause> {
        self.size = norm(&state.displacement).max(self.least);
        let increment = norm(step) / self.size;
        if !increment.is_finite() {
            return Err(Cause::NotFinite);
        }
        self.rate = increment / self.increment;
        if self.first.is_infinite() {
            self.first = increment;
        }
        self.increment = increment;
        Ok(())
    }

    /// Whether the last step was the last one needed: it is small, and so is what it leaves of the residual that it was found
    /// for. That falls with the square of the rate, or by no more than the linear solution has left of it.
    pub(crate) fn is_reached(
        &self,
        model: &Model,
        next: &Increment,
        state: &State,
        residual: f64,
        linear: f64,
    ) -> bool {
        let left = residual * self.rate.min(1.0).powi(2).max(linear);
        self.increment <= self.settings.tolerance
            && left <= self.settings.forces_settled()
            && is_load_settled(next, state)
            && condensed_change(model, next, state) <= CONDENSED_SETTLED.max(self.settings.tolerance)
    }

    /// Ends attempts whose increments grow although they were predicted.
    pub(crate) fn check_growth(&self) -> Result<(), Cause> {
        if self.falling && self.increment > (GROWN * self.first).max(GROWN_LEAST) {
            return Err(Cause::Diverging { increment: self.increment });
        }
        Ok(())
    }
}

/// How much of each step is taken: what keeps the material from inverting, less what damps contacts that open and close.
#[derive(Default)]
pub(super) struct StepLength {
    pub factor: f64,
    damping: f64,
    /// Small factors in a row.
    small: usize,
}

impl StepLength {
    /// The factor for a step whose largest admissible part is given.
    pub(crate) fn choose(&mut self, admissible: f64, damping: f64) -> f64 {
        self.damping = damping;
        self.factor = admissible * damping;
        self.factor
    }

    /// Whether the step limiter has let the whole step pass.
    pub(crate) fn is_admissible(&self) -> bool {
        self.factor == self.damping
    }

    /// Ends attempts whose steps are cut again and again.
    pub(crate) fn check(&mut self, number: usize) -> Result<(), Cause> {
        self.small = if number >= 2 && self.factor < SMALL_FACTOR * self.damping { self.small + 1 } else { 0 };
        if self.small >= SMALL_FACTORS {
            return Err(Cause::StepLimited { factor: self.factor });
        }
        Ok(())
    }
}

/// Whether an unknown load has come to rest.
pub(super) fn is_load_settled(next: &Increment, state: &State) -> bool {
    // The load of a nearly incompressible wall settles after its displacement.
    next.load_change.abs() <= LOAD_SETTLED * state.load.abs().max(LEAST_LOAD)
}

/// The largest change of a condensed unknown beside the largest of its term: where the displacement is prescribed, pressures
/// settle after it.
fn condensed_change(model: &Model, next: &Increment, state: &State) -> f64 {
    let largest = |v: &[f64]| v.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()));
    let terms = next.condensed.iter().zip(&state.condensed).zip(model.terms());
    // What is remembered is no unknown.
    let unknowns = |all: &[f64], term: &dyn Term| {
        let held = variables_range(term);
        largest(if held.is_empty() { all } else { &all[..held.start] })
    };
    let mut sizes: Vec<f64> = terms.flat_map(|((step, all), term)| [largest(step), unknowns(all, &**term)]).collect();
    if let Some(ranks) = model.ranks() {
        ranks.largest(&mut sizes);
    }
    let part =
        |step: f64, all: f64, rounding: f64| if step <= rounding { 0.0 } else { step / all.max(f64::MIN_POSITIVE) };
    let changes = sizes.chunks_exact(2).zip(model.terms());
    changes.map(|(sizes, term)| part(sizes[0], sizes[1], rounding_of(&**term)[0])).fold(0.0, f64::max)
}

/// Condensed unknowns and forces of a term that are rounding.
fn rounding_of(term: &dyn Term) -> [f64; 2] {
    term.unilateral().map_or([0.0; 2], |unilateral| unilateral.rounding())
}
