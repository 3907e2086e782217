//! Terms that another rank sums.

use crate::error::SolveError;
use crate::term::{Element, Term, View};

/// A term without clusters: what it says of itself holds on every rank, its forces are summed by one.
pub(super) struct RemoteTerm<T>(pub T);

impl<const D: usize, T: Term<D>> Term<D> for RemoteTerm<T> {
    fn clusters(&self) -> usize {
        0
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &[]
    }

    fn validate(&self) -> Result<(), SolveError> {
        self.0.validate()
    }

    fn is_symmetric(&self) -> bool {
        self.0.is_symmetric()
    }

    fn has_matrix(&self) -> bool {
        self.0.has_matrix()
    }

    fn matrix_follows_load(&self) -> bool {
        self.0.matrix_follows_load()
    }

    fn break_points(&self) -> Vec<f64> {
        self.0.break_points()
    }

    fn is_unilateral(&self) -> bool {
        self.0.is_unilateral()
    }

    fn farthest_load(&self, from: f64, to: f64) -> f64 {
        self.0.farthest_load(from, to)
    }

    fn fills_lower_blocks(&self) -> bool {
        self.0.fills_lower_blocks()
    }

    fn separates(&self) -> bool {
        self.0.separates()
    }

    fn is_timed(&self) -> bool {
        self.0.is_timed()
    }

    fn rounding(&self) -> [f64; 2] {
        self.0.rounding()
    }

    fn linearize(&self, _: usize, _: View<'_>, _: &mut Element) {}
}
