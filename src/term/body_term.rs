//! The body as a term of the potential.

use crate::error::{Invalid, MaterialError, SolveError};
use crate::material::{Material, Past};
use crate::simd::dispatch;

use super::Term;
use super::advance::Advance;
use super::body::Body;
use super::diagnostics::StateDiagnostics;
use super::element::{Element, TermStep, View};
use super::layout::{Form, Layout};
use super::pressure_field::PressureField;
use super::product::Multiply;
use super::step_limit::jacobian;
use super::uncondensed::{Product, Zone};

impl<const D: usize> Term for Body<D> {
    fn dim(&self) -> usize {
        D
    }

    fn clusters(&self) -> usize {
        self.table.clusters().count()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        self.table.clusters().nodes(cluster)
    }

    fn validate(&self) -> Result<(), SolveError> {
        self.material.validate().map_err(|error| match error {
            MaterialError::Invalid(invalid) => SolveError::from(invalid),
            MaterialError::Empty => {
                Invalid::new("number of material constants", 0.0, "give a law with constants").into()
            }
        })?;
        let Some(value) = self.unsuited else { return Ok(()) };
        let needed = "pressures of zones need weights that add up to more than nothing in each zone: give positive ones, \
                      or take PressureField::Pointwise";
        Err(Invalid::new("square norm of a pressure function over a zone", value, needed).into())
    }

    fn layout(&self) -> Layout {
        let history = self.memory_len();
        let nodes = Some(self.table.node_count());
        Layout { follows_load: false, history, timed: history > 0, nodes, ..Layout::default() }
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        self.linearize_cluster(cluster, view, out);
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: TermStep<'_>, condensed_step: &mut [f64]) -> f64 {
        dispatch(Advance { body: self, cluster, view, step: step.displacement, condensed_step })
    }

    fn energy(&self, cluster: usize, view: View<'_>) -> f64 {
        self.zone_energy(cluster, view)
    }

    fn unknowns(&self, cluster: usize) -> std::ops::Range<usize> {
        match self.field {
            PressureField::Displacement => 0..0,
            PressureField::Pointwise => {
                let points = self.table.clusters().points(cluster);
                2 * points.start..2 * points.end
            }
            // θ, π, point by point J and the pressure of what stays pointwise, and the exponent.
            _ => {
                let points = self.table.clusters().points(cluster);
                let (each, of_point) = (2 * self.functions + 1, if self.pointwise.is_some() { 2 } else { 0 });
                each * cluster + of_point * points.start..each * (cluster + 1) + of_point * points.end
            }
        }
    }

    fn start(&self, condensed: &mut [f64], history: &mut [f64]) {
        for cluster in 0..self.clusters() {
            self.start_zone(cluster, &mut condensed[self.unknowns(cluster)]);
        }
        self.start_of_memory(condensed, history);
    }

    fn update(&self, view: View<'_>, next: &mut [f64]) {
        if self.rest.is_empty() {
            return;
        }
        let recall = self.recall(view);
        let gradient = |point| self.local_gradient(point, view.displacement);
        for (point, next) in next.chunks_exact_mut(self.rest.len()).enumerate() {
            self.material.remember(&gradient(point), recall.at(point), &mut next[..self.material.memory()]);
        }
        self.remember_volumes(recall, gradient, view.condensed, next);
    }

    fn time_error(&self, before: Option<Past<'_>>, view: View<'_>, next: &[f64]) -> [f64; 2] {
        self.error_of_time(before, view, next)
    }

    fn form(&self) -> Form<'_> {
        Form::Blocks { kept: self.separates(), apart: self.apart.then(|| self.table.clusters()) }
    }

    fn multiply(&self, zone: &Zone, x: &[f64], product: &mut Product) {
        dispatch(Multiply { body: self, zone, x, product });
    }

    fn largest_gradient(&self, cluster: usize, displacement: &[f64]) -> f64 {
        let points = self.table.clusters().points(cluster);
        points.map(|p| self.table.displacement_gradient(p, displacement).norm()).fold(0.0, f64::max)
    }

    fn smallest_jacobian(&self, cluster: usize, view: View<'_>) -> Option<(f64, Vec<f64>)> {
        let gradient = self.deformations_in(view);
        self.table
            .clusters()
            .points(cluster)
            .map(|point| (jacobian(&gradient(point), self.table.hoop_components()), point))
            .min_by(|a, b| below(a.0, b.0))
            .map(|(j, point)| (j, self.table.positions()[point].as_slice().to_vec()))
    }

    fn diagnostics(&self, cluster: usize, view: View<'_>) -> StateDiagnostics {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut volume, mut mean, mut pointwise) = (0.0, 0.0, 0.0);
        let volumetric = self.material.volumetric().filter(|_| self.functions == 0);
        let gradient = self.deformations_in(view);
        for point in self.table.clusters().points(cluster) {
            let j = gradient(point).determinant();
            (low, high) = (low.min(j), high.max(j));
            if let Some(volumetric) = volumetric {
                let weight = self.table.weights()[point];
                volume += weight;
                mean += weight * j;
                pointwise += weight * volumetric.evaluate(j).energy;
            }
        }
        // Against one mean per cluster: a cluster of a single point has nothing to lock.
        let locked = volumetric.map(|v| pointwise - volume * v.evaluate(mean / volume).energy);
        StateDiagnostics {
            rcond: Some(self.table.smallest_rcond()).filter(|r| r.is_finite()),
            jacobians: Some([low, high]).filter(|j| j[0].is_finite() && j[1].is_finite()),
            locked_energy: locked.filter(|e| e.is_finite()),
        }
    }
}

/// Orders numbers; a NaN, of whichever sign, counts as the smallest of all.
fn below(a: f64, b: f64) -> std::cmp::Ordering {
    b.is_nan().cmp(&a.is_nan()).then(a.total_cmp(&b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nan_is_the_smallest_wherever_it_stands() {
        for nan in [f64::NAN, -f64::NAN] {
            for all in [[nan, 0.5, 1.0], [0.5, nan, 1.0], [0.5, 1.0, nan]] {
                assert!(all.into_iter().min_by(|a, b| below(*a, *b)).is_some_and(f64::is_nan), "{all:?}");
            }
        }
        assert_eq!([0.5, -1.0, 1.0].into_iter().min_by(|a, b| below(*a, *b)), Some(-1.0));
    }
}
