//! Terms that another rank sums.

use std::ops::Range;

use crate::error::SolveError;
use crate::term::{Element, History, Protocol, Term, TermMatrix, Unilateral, View};

/// A term without clusters and unknowns: what it says of itself holds on every rank, its forces are summed by one.
pub(super) struct RemoteTerm<const D: usize>(pub Box<dyn Term<D>>);

impl<const D: usize> Term<D> for RemoteTerm<D> {
    fn clusters(&self) -> usize {
        0
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &[]
    }

    fn validate(&self) -> Result<(), SolveError> {
        self.0.validate()
    }

    fn matrix(&self) -> TermMatrix {
        self.0.matrix()
    }

    fn break_points(&self) -> Vec<f64> {
        self.0.break_points()
    }

    fn linearize(&self, _: usize, _: View<'_>, _: &mut Element) {}

    fn history(&self) -> Option<&dyn History> {
        self.0.history().map(|_| self as &dyn History)
    }

    fn unilateral(&self) -> Option<&dyn Unilateral> {
        self.0.unilateral().map(|_| self as &dyn Unilateral)
    }

    fn protocol(&self) -> &dyn Protocol {
        self.0.protocol()
    }
}

impl<const D: usize> History for RemoteTerm<D> {
    fn variables(&self) -> Range<usize> {
        0..0
    }

    fn update(&self, _: View<'_>, _: &mut [f64]) {}

    fn is_timed(&self) -> bool {
        self.0.history().is_some_and(|history| history.is_timed())
    }
}

impl<const D: usize> Unilateral for RemoteTerm<D> {
    fn farthest_load(&self, from: f64, to: f64) -> f64 {
        self.0.unilateral().map_or(to, |unilateral| unilateral.farthest_load(from, to))
    }

    fn rounding(&self) -> [f64; 2] {
        self.0.unilateral().map_or([0.0; 2], |unilateral| unilateral.rounding())
    }
}
