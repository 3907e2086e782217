//! Cycling of the active set of a contact: Newton's method between two states that lead to each other.

use crate::each::Each;
use crate::linear::vector::norm;

/// An attempt whose active set cycles is allowed this many times the usual iterations.
const CYCLING_ITERATIONS: usize = 3;
/// Increments in a row of which none is the smallest so far, after which the method is taken to cycle.
const PATIENCE: usize = 3;
/// The first shift, relative to the median of the diagonal.
const SHIFT: f64 = 1e-3;
/// Factor by which a shift grows that does not suffice.
const GROWTH: f64 = 10.0;
/// A smaller shift is dropped.
const LEAST: f64 = 1e-6;
/// Factor by which the shift falls after each iteration with it.
const THINNER: f64 = 0.3;
/// An increment is shorter than another one below this part of it.
const PROGRESS: f64 = 0.95;
/// The least part of a step that is taken.
const LEAST_PART: f64 = 0.1;

/// Measures against increments that do not fall.
///
/// Where the search finds different opposite facets in turn, the gap jumps between two states, neither of which is in equilibrium: the
/// result of the search is kept until the attempt ends, as with one search per step.
///
/// Where the matrix is not definite, Newton's method is drawn to an unstable equilibrium on the wrong side of a contact, which then
/// opens or closes, and back: a shift of the diagonal that makes the matrix definite turns its steps into those of a body in a viscous
/// medium, which leave that equilibrium for a stable state. The shift falls after each iteration (pseudo-transient continuation). Where the
/// matrix is definite, the forces have a kink between two states (the end of an arc of a tool): parts of steps by Aitken's rule
/// $$\omega_{k+1} = -\omega_k\,\frac{\delta_k\cdot(\delta_{k+1} - \delta_k)}{|\delta_{k+1} - \delta_k|^2}$$
/// converge to the kink, and are whole steps where the forces are smooth. Neither changes a state to which the method converges.
#[derive(Default)]
pub(super) struct ActiveSetCycling {
    /// Whether a term acts from one side only; nothing is done elsewhere.
    unilateral: bool,
    /// Added to the diagonal, relative to its median.
    pub shift: f64,
    /// Whether one of the measures was taken, which allows more iterations.
    helped: bool,
    /// Whether there is a search for opposite facets, and whether its result is to be kept.
    searches: bool,
    pub held: bool,
    /// Whether the diagonal has been shifted: the shift grows again whenever the matrix is indefinite.
    viscous: bool,
    /// Whether steps are taken in parts, and the last part.
    relaxed: bool,
    part: f64,
    last: Vec<f64>,
    shortest: f64,
    /// Increments since the shortest one.
    idle: usize,
    /// Iterations since the matrix was last indefinite.
    since_unstable: Option<usize>,
}

impl ActiveSetCycling {
    /// For a model with or without unilateral terms (contact), and whether one of them searches for opposite facets.
    pub(crate) fn new(unilateral: bool, searches: bool) -> Self {
        ActiveSetCycling { unilateral, searches, part: 1.0, shortest: f64::INFINITY, ..ActiveSetCycling::default() }
    }

    /// Whether an attempt of so many iterations may take another one.
    pub(crate) fn allows(&self, taken: usize, iterations: usize) -> bool {
        taken < if self.helped { CYCLING_ITERATIONS * iterations } else { iterations }
    }

    /// Whether anything is done.
    pub(crate) fn is_at_work(&self) -> bool {
        self.shift > 0.0 || self.relaxed
    }

    /// Goes on from a state that was pushed off an unstable one.
    pub(crate) fn push_off(&mut self) {
        self.begin_shift(LEAST);
    }

    /// Shifts from here on.
    fn begin_shift(&mut self, shift: f64) {
        (self.shift, self.helped, self.shortest, self.idle) = (shift, true, f64::INFINITY, 0);
        (self.relaxed, self.part, self.viscous) = (false, 1.0, true);
    }

    /// Notes whether the matrix is indefinite; whether the shift has grown so that the matrix is to be formed anew.
    pub(crate) fn raise_shift(&mut self, unstable: bool) -> bool {
        if !self.unilateral {
            return false;
        }
        self.since_unstable = if unstable { Some(0) } else { self.since_unstable.map(|count| count + 1) };
        if unstable && self.viscous && self.shift < 1.0 {
            self.shift = (GROWTH * self.shift).max(LEAST);
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
        let mut begins = false;
        if self.shift > 0.0 {
            self.shift *= THINNER;
            if self.shift < LEAST {
                self.shift = 0.0;
            }
            (self.shortest, self.idle) = (f64::INFINITY, 0);
        } else if length < PROGRESS * self.shortest {
            (self.shortest, self.idle) = (length, 0);
        } else {
            self.idle += 1;
        }
        if self.idle >= PATIENCE {
            (self.shortest, self.idle) = (length, 0);
            if self.since_unstable.is_some_and(|count| count <= PATIENCE) {
                self.begin_shift(SHIFT);
            } else if self.searches && !self.held {
                (self.held, self.helped) = (true, true);
            } else if !self.relaxed {
                (self.relaxed, self.helped, self.part, begins) = (true, true, 0.5, true);
            }
        }
        if self.relaxed && !begins && self.last.len() == step.len() {
            let (mut along, mut size) = (0.0, 0.0);
            for (new, old) in step.iter().zip(&self.last) {
                along += old * (new - old);
                size += (new - old).powi(2);
            }
            self.part = (-self.part * along / size.max(f64::MIN_POSITIVE)).clamp(LEAST_PART, 1.0);
        }
        self.last.clear();
        self.last.extend_from_slice(step);
        self.part
    }
}

/// Adds a part of the median of a diagonal, whose entries stand at the given places, to all of it.
pub(super) fn shift_diagonal(values: &mut [f64], diagonal: &[usize], part: f64) {
    let mut all: Vec<f64> = diagonal.mapped(|&place| values[place]);
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
    fn cycling_active_set_is_damped() {
        let mut cycling = ActiveSetCycling::new(true, false);
        // To and fro about a kink of the forces: half of a step leads there.
        assert_eq!([1.0, -1.0, 1.0, -1.0].map(|step| cycling.damping(&[step])), [1.0, 1.0, 1.0, 0.5]);
        // The rest of a halved step, beyond the kink: the next step is whole.
        assert_eq!(cycling.damping(&[-0.5]), 1.0);
        assert!(cycling.is_at_work() && cycling.shift == 0.0);
        let mut cycling = ActiveSetCycling::new(true, false);
        for _ in 0..4 {
            assert!(!cycling.raise_shift(true));
            assert_eq!(cycling.damping(&[1.0]), 1.0);
        }
        assert_eq!(cycling.shift, SHIFT);
        assert!(cycling.raise_shift(true) && cycling.shift == 10.0 * SHIFT);
        let mut length = 1.0;
        for _ in 0..9 {
            assert!(!cycling.raise_shift(false));
            length *= 0.1;
            cycling.damping(&[length]);
        }
        assert!(!cycling.is_at_work() && cycling.allows(40, 30));
    }

    #[test]
    fn diagonals_are_shifted_by_their_median() {
        let mut values = [1.0, 9.0, 2.0, 9.0, 100.0];
        shift_diagonal(&mut values, &[0, 2, 4], 0.5);
        assert_eq!(values, [2.0, 9.0, 3.0, 9.0, 101.0]);
    }
}
