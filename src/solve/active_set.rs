//! Cycling of the active set of a contact: Newton's method between two states that lead to each other.

use crate::linear::vector::norm;

/// How many times the iterations of an attempt are allowed once it was helped.
const CYCLING_ITERATIONS: usize = 3;
/// Difference between increments, as a part of them, below which a state is taken to come back.
const SAME: f64 = 0.1;
/// The first shift, in terms of the median of the diagonal.
const SHIFT: f64 = 1e-3;
/// What a shift grows by that does not do.
const GROWTH: f64 = 10.0;
/// The shift below which there is none.
const LEAST: f64 = 1e-6;
/// Increments in a row that are smaller than the one before, after which a shift is lowered.
const FALLING: usize = 3;
/// What is left of a shift that is lowered.
const LET_DOWN: f64 = 1e-2;

/// What helps where increments of one size follow each other.
///
/// Where the matrix is not definite, Newton's method is drawn to an unstable equilibrium on the wrong side of a contact, which then
/// opens or closes, and back: a diagonal that makes the matrix definite turns its steps into ones that fall off it, to a
/// stable state. Where it is definite, a break point lies between both states (the end of an arc of a tool): half of each step comes
/// to rest there. Neither changes a state at which the method comes to rest.
#[derive(Default)]
pub(super) struct ActiveSetCycling {
    /// Whether a term acts from one side only; nothing is done elsewhere.
    unilateral: bool,
    /// Added to the diagonal, in terms of its median.
    pub shift: f64,
    halvings: i32,
    lengths: [f64; 2],
    /// Increments in a row that were smaller than the one before.
    falling: usize,
    /// Iterations since the matrix was last indefinite.
    since_unstable: Option<usize>,
}

impl ActiveSetCycling {
    /// For a model whose terms act from one side only, or for one without such terms.
    pub(crate) fn new(unilateral: bool) -> Self {
        ActiveSetCycling { unilateral, ..ActiveSetCycling::default() }
    }

    /// Whether an attempt of so many iterations may take another one.
    pub(crate) fn allows(&self, taken: usize, iterations: usize) -> bool {
        taken < if self.helped() { CYCLING_ITERATIONS * iterations } else { iterations }
    }

    /// Whether anything is done.
    pub(crate) fn helped(&self) -> bool {
        self.shift > 0.0 || self.halvings > 0
    }

    /// Notes whether the matrix is indefinite; whether the shift has grown so that the matrix is to be formed anew.
    pub(crate) fn raise_shift(&mut self, unstable: bool) -> bool {
        if !self.unilateral {
            return false;
        }
        self.since_unstable = if unstable { Some(0) } else { self.since_unstable.map(|count| count + 1) };
        if unstable && self.shift > 0.0 && self.shift < 1.0 {
            self.shift *= GROWTH;
            return true;
        }
        false
    }

    /// What to take of an increment.
    pub(crate) fn damping(&mut self, step: &[f64]) -> f64 {
        if !self.unilateral {
            return 1.0;
        }
        let length = norm(step);
        let returns = self.lengths.iter().all(|before| *before > 0.0 && (length / before - 1.0).abs() < SAME);
        self.falling = if length < self.lengths[0] { self.falling + 1 } else { 0 };
        self.lengths = if returns { [0.0; 2] } else { [length, self.lengths[0]] };
        if returns {
            if self.since_unstable.is_some_and(|count| count < 3) {
                self.shift = (GROWTH * self.shift).clamp(SHIFT, 1.0);
            } else if self.shift == 0.0 {
                self.halvings = (self.halvings + 1).min(3);
            }
        }
        if self.falling >= FALLING && self.shift > 0.0 {
            self.shift = if self.shift < LEAST { 0.0 } else { LET_DOWN * self.shift };
            self.falling = 0;
        }
        0.5f64.powi(self.halvings)
    }
}

/// Adds a part of the median of a diagonal, whose entries stand at the given places, to all of it.
pub(super) fn shift_diagonal(values: &mut [f64], diagonal: &[usize], part: f64) {
    let mut all: Vec<f64> = diagonal.iter().map(|&place| values[place]).collect();
    let middle = all.len() / 2;
    if middle < all.len() {
        let median = *all.select_nth_unstable_by(middle, f64::total_cmp).1;
        diagonal.iter().for_each(|&place| values[place] += part * median);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_that_come_back_are_halved_and_shifts_are_let_down() {
        let mut cycling = ActiveSetCycling::new(true);
        assert_eq!([1.0, 1.0, 1.0].map(|length| cycling.damping(&[length])), [1.0, 1.0, 0.5]);
        assert!(cycling.helped() && cycling.shift == 0.0);
        let mut cycling = ActiveSetCycling::new(true);
        for _ in 0..3 {
            assert!(!cycling.raise_shift(true));
            assert_eq!(cycling.damping(&[1.0]), 1.0);
        }
        assert_eq!(cycling.shift, SHIFT);
        assert!(cycling.raise_shift(true) && cycling.shift == 10.0 * SHIFT);
        let mut length = 1.0;
        // The first increment has none before it; then four times three: 1e-2, 1e-4, 1e-6, 1e-8, none.
        for _ in 0..13 {
            assert!(!cycling.raise_shift(false));
            length *= 0.1;
            cycling.damping(&[length]);
        }
        assert!(!cycling.helped());
    }

    #[test]
    fn diagonals_are_shifted_by_their_median() {
        let mut values = [1.0, 9.0, 2.0, 9.0, 100.0];
        shift_diagonal(&mut values, &[0, 2, 4], 0.5);
        assert_eq!(values, [2.0, 9.0, 3.0, 9.0, 101.0]);
    }
}
