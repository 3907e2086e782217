//! Internal variables of a body, point by point.

use crate::each::{Each, EachOf};
use crate::geometry::Mat3;
use crate::material::{Material, Past};
use crate::tensor::cofactor;

use super::body::Body;
use super::stabilisation::Kept;
use super::{Term, View};

/// What the points of a body remember at the beginning of a step.
#[derive(Clone, Copy)]
pub(super) struct Recall<'a> {
    /// Time since then.
    elapsed: f64,
    points: &'a [f64],
    /// From point to point, of the material of a point, and of what stays pointwise of its volumetric energy.
    stride: usize,
    each: usize,
    of_volume: usize,
}

impl<'a> Recall<'a> {
    /// The past of a point.
    #[inline]
    pub(crate) fn at(&self, point: usize) -> Past<'a> {
        Past { memory: &self.points[point * self.stride..][..self.each], elapsed: self.elapsed }
    }

    /// The past of what stays pointwise of the volumetric energy of a point; empty where that does not relax.
    #[inline]
    pub(super) fn of_volume(&self, point: usize) -> Past<'a> {
        Past { memory: &self.points[point * self.stride + self.each..][..self.of_volume], elapsed: self.elapsed }
    }
}

impl<const D: usize> Body<D> {
    /// The memory in a view of the body, point by point; that at rest where there is none.
    #[inline]
    pub(super) fn recall<'a>(&'a self, view: View<'a>) -> Recall<'a> {
        let (each, all) = (self.material.memory(), self.rest.len());
        let (points, stride) = if view.history.is_empty() { (&self.rest[..], 0) } else { (view.history, all) };
        Recall { elapsed: view.elapsed, points, stride, each, of_volume: all - each }
    }

    /// The deformation gradient at a point in a view of the body: with the thickness that its history leaves a sheet.
    pub(crate) fn deformation_in(&self, point: usize, view: View<'_>) -> Mat3 {
        self.deformations_in(view)(point)
    }

    /// The same at one point after the other.
    pub(super) fn deformations_in<'a>(&'a self, view: View<'a>) -> impl Fn(usize) -> Mat3 + 'a {
        let recall = self.recall(view);
        move |point| self.material.settled(&self.local_gradient(point, view.displacement), recall.at(point))
    }

    /// Numbers that it remembers.
    pub(super) fn memory_len(&self) -> usize {
        self.rest.len() * self.table().point_count()
    }

    pub(super) fn start_of_memory(&self, condensed: &[f64], memory: &mut [f64]) {
        if self.rest.is_empty() {
            return;
        }
        let each = self.material.memory();
        let recall = Recall { elapsed: 0.0, points: &self.rest, stride: 0, each, of_volume: self.rest.len() - each };
        for (point, memory) in memory.chunks_exact_mut(self.rest.len()).enumerate() {
            memory.copy_from_slice(&self.rest);
            // What has expanded may be stressed by that: it is before any time passes.
            let at_rest = self.table.at_rest(point);
            if at_rest != Mat3::identity() {
                self.material.remember(&at_rest, recall.at(point), &mut memory[..each]);
            }
        }
        // So is the projected volume.
        let mut projected = condensed.to_vec();
        for cluster in 0..self.table.clusters().count() {
            let theta = self.unknowns(cluster).start;
            let measure = |point| self.measure.of(self.table.at_rest(point).determinant()).value;
            self.project(cluster, measure, &mut projected[theta..theta + self.functions]);
        }
        self.remember_volumes(recall, |point| self.table.at_rest(point), &projected, memory);
    }

    /// Writes what is remembered of the pointwise part of the volumetric energy, at deformation gradients.
    pub(super) fn remember_volumes(
        &self,
        recall: Recall<'_>,
        gradient: impl Fn(usize) -> Mat3,
        condensed: &[f64],
        next: &mut [f64],
    ) {
        let (each, all) = (self.material.memory(), self.rest.len());
        let (Some(prony), Some(volumetric)) = (self.material.relaxation(), self.material.volumetric()) else { return };
        if all == each {
            return;
        }
        let clusters = self.table.clusters();
        for cluster in 0..clusters.count() {
            let (theta, _, measure) = self.zone(cluster, condensed);
            for point in clusters.points(cluster) {
                let projected: f64 = self.zone_functions(point).pair_sum(theta, |phi, theta| phi * theta);
                let own = self.material.settled(&gradient(point), recall.at(point)).determinant();
                let slopes = [own, measure.volume(projected)].each(|j| self.pointwise_energy(volumetric, j).slope);
                Kept::remember(prony, recall.of_volume(point), slopes, &mut next[point * all..][each..all]);
            }
        }
    }

    pub(super) fn error_of_time(&self, before: Option<Past<'_>>, view: View<'_>, next: &[f64]) -> [f64; 2] {
        let (recall, mut sums) = (self.recall(view), [0.0; 2]);
        for (point, next) in next.chunks_exact(self.rest.len().max(1)).enumerate() {
            let earlier =
                before.map(|before| Recall { elapsed: before.elapsed, points: before.memory, ..recall }.at(point));
            let squares = self.material.time_error(earlier, recall.at(point), &next[..self.material.memory()]);
            for (sum, square) in sums.iter_mut().zip(squares) {
                *sum += self.table().weights()[point].abs() * square;
            }
        }
        sums
    }

    /// The first Piola–Kirchhoff stress at a point with deformation gradient `f` \[stress\], of the material, at fixed memory;
    /// without the pressure of the zone.
    pub(crate) fn stress(&self, point: usize, f: &Mat3, view: View<'_>) -> Mat3 {
        let stress = self.material.response_from(f, self.recall(view).at(point)).stress;
        match self.material.volumetric() {
            Some(volumetric) => stress + cofactor(f) * volumetric.evaluate(f.determinant()).slope,
            None => stress,
        }
    }

    /// A memory for the points of another body over the same domain: that of the nearest point. What only one of them keeps
    /// beside the material is at rest.
    pub(crate) fn memory_from<const E: usize>(
        &self,
        from: &Body<E>,
        given: &[f64],
        nearest: impl Fn(&crate::geometry::Point<D>) -> usize,
    ) -> Option<Vec<f64>> {
        let (own, other) = (self.rest.len(), from.rest.len());
        if given.is_empty() || own == 0 || from.material.memory() != self.material.memory() {
            return None;
        }
        let common = if own == other { own } else { self.material.memory() };
        let mut memory = Vec::with_capacity(self.memory_len());
        for x in self.table().positions() {
            memory.extend_from_slice(&given[nearest(x) * other..][..common]);
            memory.extend_from_slice(&self.rest[common..]);
        }
        Some(memory)
    }
}
