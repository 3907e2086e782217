//! Steps of all unknowns.

use std::ops::{AddAssign, Mul};

use crate::assembly::Model;
use crate::each::Each;
use crate::error::Cause;
use crate::linear::vector::{dot, norm};
use crate::term::TermState;

use super::functional::Control;
use super::state::State;

/// Load factors below this count as this one: a path may pass through zero.
pub(super) const LEAST_LOAD: f64 = 1e-3;

/// A step of all unknowns but the condensed ones, which follow from it where it is
/// [applied](super::Equilibrium::apply).
///
/// Steps add up, as those of the arc length method do: `step += &(response * 0.5)`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Increment {
    /// $\delta d$, node by node \[length\].
    pub displacement: Vec<f64>,
    /// $\delta\mu$, one for each constraint equation.
    pub multipliers: Vec<f64>,
    /// Of the load factor.
    pub load: f64,
    /// Of the pressures that the linear solver keeps as unknowns, zone by zone; empty for factors.
    pub kept: Vec<[f64; 4]>,
    /// The part of the right-hand side that the linear solver has left: 0 for factors.
    pub left: f64,
}

impl Increment {
    /// $|\delta d|$, the root of the sum of the squares of all coefficients.
    pub fn norm(&self) -> f64 {
        norm(&self.displacement)
    }

    /// Adds as much of the answer to the load as brings a controlled functional to its target.
    pub(super) fn meet(
        &mut self,
        control: Control<'_>,
        state: &State,
        response: Option<&Increment>,
    ) -> Result<(), Cause> {
        let (Control::Functional(functional, target), Some(response)) = (control, response) else { return Ok(()) };
        let mut gradient = vec![0.0; self.displacement.len()];
        functional.gradient(&state.displacement, &mut gradient);
        let along = dot(&gradient, &response.displacement);
        let missing = target - functional.value(&state.displacement) - dot(&gradient, &self.displacement);
        let change = missing / along;
        ensure!(change.is_finite(), Cause::Control);
        *self += &(response.clone() * change);
        Ok(())
    }

    /// Whether all numbers of it are finite.
    pub(super) fn is_finite(&self) -> bool {
        let Increment { displacement, multipliers, load, kept, .. } = self;
        let mut numbers = displacement.iter().chain(multipliers).chain(kept.as_flattened()).chain([load]);
        numbers.all(|number| number.is_finite())
    }

    /// All numbers of it that add up.
    fn numbers(&mut self) -> impl Iterator<Item = &mut f64> {
        let Increment { displacement, multipliers, load, kept, .. } = self;
        displacement.iter_mut().chain(multipliers).chain(kept.as_flattened_mut()).chain([load])
    }
}

impl Mul<f64> for Increment {
    type Output = Increment;

    fn mul(mut self, factor: f64) -> Increment {
        self.numbers().for_each(|number| *number *= factor);
        self
    }
}

impl AddAssign<&Increment> for Increment {
    /// Lists that are missing on the left, as in the default, are zeros.
    fn add_assign(&mut self, other: &Increment) {
        self.displacement.resize(other.displacement.len().max(self.displacement.len()), 0.0);
        self.multipliers.resize(other.multipliers.len().max(self.multipliers.len()), 0.0);
        self.kept.resize(other.kept.len().max(self.kept.len()), [0.0; 4]);
        let add = |mine: &mut [f64], others: &[f64]| mine.iter_mut().zip(others).for_each(|(m, o)| *m += o);
        add(&mut self.displacement, &other.displacement);
        add(&mut self.multipliers, &other.multipliers);
        add(self.kept.as_flattened_mut(), other.kept.as_flattened());
        self.load += other.load;
    }
}

/// What was taken of a step, and how much it changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Applied {
    /// The part that was taken.
    pub part: f64,
    /// Whether the step limiter has let all pass that was requested.
    pub admissible: bool,
    /// Norm of the whole step of the displacement, relative to the displacement (of at least 1e-6 of the body's extent).
    pub increment: f64,
    /// The largest change of a condensed unknown by the whole step, relative to the largest of its term.
    pub condensed: f64,
    /// Change of the load factor by the whole step, relative to it.
    pub load: f64,
}

impl Applied {
    /// Whether all of the step was taken, and no part of it is larger than a tolerance: the state has settled.
    pub fn is_settled(&self, tolerance: f64) -> bool {
        self.admissible && self.increment.max(self.condensed).max(self.load) <= tolerance
    }
}

/// The largest change of a condensed unknown beside the largest of its term: where the displacement is prescribed, pressures
/// settle after it.
pub(super) fn condensed_change(model: &Model, steps: &[Vec<f64>], terms: &[TermState]) -> f64 {
    let largest = |v: &[f64]| v.largest(|x| x.abs());
    let mut sizes: Vec<f64> =
        steps.iter().zip(terms).flat_map(|(step, own)| [largest(step), largest(&own.condensed)]).collect();
    if let Some(ranks) = model.ranks() {
        ranks.largest(&mut sizes);
    }
    let part =
        |step: f64, all: f64, rounding: f64| if step <= rounding { 0.0 } else { step / all.max(f64::MIN_POSITIVE) };
    let changes = sizes.chunks_exact(2).zip(model.terms());
    changes.map(|(sizes, term)| part(sizes[0], sizes[1], term.rounding()[0])).fold(0.0, f64::max)
}
