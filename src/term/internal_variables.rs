//! Internal variables of a body, point by point.

use nalgebra::Matrix3;

use crate::material::{InternalVariables, Material};

use super::View;
use super::body::Body;

/// The law of a body with internal variables, with their values at the beginning of a step.
#[derive(Clone, Copy)]
pub(super) struct Recall<'a> {
    pub law: &'a dyn InternalVariables,
    /// Time since then.
    pub elapsed: f64,
    points: &'a [f64],
    each: usize,
}

impl<'a> Recall<'a> {
    /// Internal variables of a point.
    #[inline]
    pub(crate) fn at(&self, point: usize) -> &'a [f64] {
        &self.points[point * self.each..(point + 1) * self.each]
    }
}

impl<const D: usize, M: Material> Body<D, M> {
    /// The memory in a view of the body: the time when it was written, then point by point. `None` where the law has none.
    #[inline]
    pub(super) fn recall<'a>(&'a self, view: View<'a>) -> Option<Recall<'a>> {
        if self.variables_per_point == 0 {
            return None;
        }
        let law = self.material.internal_variables()?;
        let internal_variables = view.condensed.get(self.memory_range())?;
        let elapsed = self.clock.as_ref().map_or(0.0, |clock| clock.evaluate(view.load).0 - internal_variables[0]);
        Some(Recall {
            law,
            elapsed: elapsed.max(0.0),
            points: &internal_variables[1..],
            each: self.variables_per_point,
        })
    }

    /// The deformation gradient at a point in a view of the body: with the thickness that its history leaves a sheet.
    #[cfg(feature = "solve")]
    pub(crate) fn deformation_in(&self, point: usize, view: View<'_>) -> Matrix3<f64> {
        match self.recall(view) {
            None => self.deformation_gradient(point, view.displacement),
            Some(recall) => {
                let f = self.local_gradient(point, view.displacement);
                recall.law.deformation(&f, recall.at(point), recall.elapsed)
            }
        }
    }

    /// Time at a load factor; 0 without a clock.
    pub(crate) fn time(&self, load: f64) -> f64 {
        self.clock.as_ref().map_or(0.0, |clock| clock.evaluate(load).0)
    }

    pub(super) fn memory_range(&self) -> std::ops::Range<usize> {
        if self.variables_per_point == 0 {
            return 0..0;
        }
        let start = self.condensed_count();
        start..start + 1 + self.variables_per_point * self.table().len()
    }

    pub(super) fn start_of_memory(&self, internal_variables: &mut [f64]) {
        let Some(law) = self.material.internal_variables().filter(|_| self.variables_per_point > 0) else { return };
        internal_variables[0] = self.time(0.0);
        internal_variables[1..].chunks_exact_mut(self.variables_per_point).for_each(|point| law.start(point));
    }

    pub(super) fn update_histories(&self, view: View<'_>, next: &mut [f64]) {
        let Some(recall) = self.recall(view) else { return };
        next[0] = self.time(view.load);
        for (point, next) in next[1..].chunks_exact_mut(self.variables_per_point).enumerate() {
            let f = self.local_gradient(point, view.displacement);
            recall.law.update_history(&f, recall.at(point), recall.elapsed, next);
        }
    }

    pub(super) fn error_of_time(&self, before: Option<&[f64]>, view: View<'_>, next: &[f64]) -> [f64; 2] {
        let Some(recall) = self.recall(view) else { return [0.0; 2] };
        let mut sums = [0.0; 2];
        for (point, next) in next[1..].chunks_exact(self.variables_per_point).enumerate() {
            let earlier = before.map(|before| {
                let each = self.variables_per_point;
                let began = view.condensed[self.memory_range().start];
                (&before[1 + point * each..1 + (point + 1) * each], began - before[0])
            });
            let squares = recall.law.time_error(earlier, recall.at(point), recall.elapsed, next);
            for (sum, square) in sums.iter_mut().zip(squares) {
                *sum += self.table().weights()[point].abs() * square;
            }
        }
        sums
    }

    /// The first Piola–Kirchhoff stress at a point with deformation gradient `f` \[stress\], of the material, at fixed internal variables where it has any;
    /// without the pressure of the zone.
    #[cfg(feature = "solve")]
    pub(crate) fn stress(&self, point: usize, f: &Matrix3<f64>, view: View<'_>) -> Matrix3<f64> {
        let elastic = self.material().response(f).stress;
        let Some(recall) = self.recall(view) else { return elastic };
        const ALL: [usize; 9] = [0, 1, 2, 3, 4, 5, 6, 7, 8];
        let mut stress = [0.0; 9];
        recall.law.respond(f, recall.at(point), recall.elapsed, &ALL, &mut stress, &mut []);
        let shape = Matrix3::from_row_slice(&stress);
        match self.material().split() {
            Some((distortional, _)) => elastic - distortional.response(f).stress + shape,
            None => shape,
        }
    }

    /// A memory for the points of another body over the same domain: that of the nearest point, at the same time.
    #[cfg(feature = "solve")]
    pub(crate) fn memory_from<const E: usize, N: Material>(
        &self,
        from: &Body<E, N>,
        condensed: &[f64],
        nearest: impl Fn(&crate::geometry::Point<D>) -> usize,
    ) -> Option<Vec<f64>> {
        let given = condensed.get(from.memory_range()).filter(|given| !given.is_empty())?;
        if from.variables_per_point != self.variables_per_point {
            return None;
        }
        let mut internal_variables = Vec::with_capacity(self.memory_range().len());
        internal_variables.push(given[0]);
        for x in self.table().positions() {
            let at = 1 + nearest(x) * self.variables_per_point;
            internal_variables.extend_from_slice(&given[at..at + self.variables_per_point]);
        }
        Some(internal_variables)
    }

    /// The energy of the shape at a point: at fixed internal variables where the law has any.
    pub(super) fn shape_energy(
        &self,
        recall: Option<&Recall<'_>>,
        distortional: &dyn Material,
        point: usize,
        f: &Matrix3<f64>,
    ) -> f64 {
        match recall {
            Some(recall) => recall.law.energy(f, recall.at(point), recall.elapsed),
            None => distortional.energy(f),
        }
    }
}
