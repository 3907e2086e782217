//! Terms that are shared.

use std::sync::Arc;

use crate::error::SolveError;

use super::Term;
use super::diagnostics::StateDiagnostics;
use super::element::{Element, ForceDensities, View};
use super::uncondensed::{Product, Zone};

impl<const D: usize, T: Term<D> + ?Sized> Term<D> for Arc<T> {
    fn clusters(&self) -> usize {
        (**self).clusters()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        (**self).nodes(cluster)
    }

    fn validate(&self) -> Result<(), SolveError> {
        (**self).validate()
    }

    fn is_symmetric(&self) -> bool {
        (**self).is_symmetric()
    }

    fn has_matrix(&self) -> bool {
        (**self).has_matrix()
    }

    fn matrix_follows_load(&self) -> bool {
        (**self).matrix_follows_load()
    }

    fn break_points(&self) -> Vec<f64> {
        (**self).break_points()
    }

    fn is_unilateral(&self) -> bool {
        (**self).is_unilateral()
    }

    fn farthest_load(&self, from: f64, to: f64) -> f64 {
        (**self).farthest_load(from, to)
    }

    fn fills_lower_blocks(&self) -> bool {
        (**self).fills_lower_blocks()
    }

    fn separates(&self) -> bool {
        (**self).separates()
    }

    fn couplings(&self, cluster: usize, visit: &mut dyn FnMut(&[u16])) {
        (**self).couplings(cluster, visit);
    }

    fn multiply(&self, zone: &Zone, x: &[f64], product: &mut Product) {
        (**self).multiply(zone, x, product);
    }

    fn take_pressures(&self, cluster: usize, pressures: &[f64; 4], condensed_step: &mut [f64]) {
        (**self).take_pressures(cluster, pressures, condensed_step);
    }

    fn fills_compact(&self) -> bool {
        (**self).fills_compact()
    }

    fn condensed(&self, cluster: usize) -> std::ops::Range<usize> {
        (**self).condensed(cluster)
    }

    fn start(&self, cluster: usize, condensed: &mut [f64]) {
        (**self).start(cluster, condensed);
    }

    fn internal_variables(&self) -> std::ops::Range<usize> {
        (**self).internal_variables()
    }

    fn start_internal_variables(&self, internal_variables: &mut [f64]) {
        (**self).start_internal_variables(internal_variables);
    }

    fn update_history(&self, view: View<'_>, next: &mut [f64]) {
        (**self).update_history(view, next);
    }

    fn is_timed(&self) -> bool {
        (**self).is_timed()
    }

    fn time_error(&self, before: Option<&[f64]>, view: View<'_>, next: &[f64]) -> [f64; 2] {
        (**self).time_error(before, view, next)
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        (**self).linearize(cluster, view, out);
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        (**self).advance(cluster, view, step, condensed_step)
    }

    fn advance_load(&self, cluster: usize, view: View<'_>, load_step: f64, condensed_step: &mut [f64]) {
        (**self).advance_load(cluster, view, load_step, condensed_step);
    }

    fn check_state(&self, view: View<'_>) -> Option<String> {
        (**self).check_state(view)
    }

    fn rounding(&self) -> [f64; 2] {
        (**self).rounding()
    }

    fn energy(&self, cluster: usize, view: View<'_>) -> f64 {
        (**self).energy(cluster, view)
    }

    fn largest_gradient(&self, cluster: usize, displacement: &[f64]) -> f64 {
        (**self).largest_gradient(cluster, displacement)
    }

    fn smallest_jacobian(&self, cluster: usize, view: View<'_>) -> Option<(f64, Vec<f64>)> {
        (**self).smallest_jacobian(cluster, view)
    }

    fn diagnostics(&self, cluster: usize, view: View<'_>) -> StateDiagnostics {
        (**self).diagnostics(cluster, view)
    }

    fn force_densities(&self, view: View<'_>) -> Option<ForceDensities<D>> {
        (**self).force_densities(view)
    }
}
