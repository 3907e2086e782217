//! The zones of pressure of a body: their functions, measures, stabilisation and energy.

use nalgebra::SMatrix;

use crate::each::Each;
use crate::geometry::Point;
use crate::material::{Material, Volumetric, VolumetricEnergy};

use super::Term;
use super::body::Body;
use super::element::View;
use super::internal_variables::Recall;
use super::pressure_field::PressureField;
use super::stabilisation::{Kept, POINTWISE_SHARE, ProjectedEnergy, WIDEST};
use super::volumetric_measure::VolumetricMeasure;

/// Tensions of a zone, by its initial shear modulus, between which its measure goes over from roots of $J$ to $J$. Roots are stable
/// below 3 to 4; with 1 and 3 a cylinder of revolution, bonded and pulled by 30 %, had unstable modes on the way.
const TENSION_BLEND: [f64; 2] = [0.8, 1.6];

/// Equal parts of that way: the measure goes it part by part, so that it rests while Newton's method comes to rest.
const PARTS: f64 = 16.0;

/// A zone keeps its part until that of the current pressure differs by more than this.
const KEPT: f64 = 0.75;

impl<const D: usize> Body<D> {
    /// Orthonormal constants or linear functions on each cluster, by Gram–Schmidt over its points.
    pub(super) fn tabulate_zone_functions(&mut self, functions: usize, along: Option<&[SMatrix<f64, D, D>]>) {
        self.functions = functions;
        self.phi = vec![0.0; functions * self.table.point_count()];
        let clusters = self.table.clusters();
        for cluster in 0..clusters.count() {
            let points = clusters.points(cluster);
            let weights = &self.table.weights()[points.clone()];
            let positions = &self.table.positions()[points.clone()];
            let total: f64 = weights.iter().sum();
            let mut centre = Point::<D>::zeros();
            for (x, w) in positions.iter().zip(weights) {
                centre += x * (w / total);
            }
            let phi = &mut self.phi[points.start * functions..points.end * functions];
            let along = along.and_then(|along| along.get(cluster)).copied().unwrap_or_else(SMatrix::identity);
            for k in 0..functions {
                for (p, x) in positions.iter().enumerate() {
                    phi[p * functions + k] = if k == 0 { 1.0 } else { along.column(k - 1).dot(&(x - centre)) };
                }
                let square_of = |phi: &[f64]| -> f64 {
                    weights.iter().enumerate().map(|(p, w)| w * phi[p * functions + k].powi(2)).sum::<f64>()
                };
                let square = square_of(phi);
                let before = square.sqrt();
                // Twice is enough: the second sweep removes what rounding left of the first.
                for _ in 0..2 {
                    for l in 0..k {
                        let product: f64 = weights
                            .iter()
                            .enumerate()
                            .map(|(p, w)| w * phi[p * functions + k] * phi[p * functions + l])
                            .sum();
                        for p in 0..weights.len() {
                            phi[p * functions + k] -= product * phi[p * functions + l];
                        }
                    }
                }
                let left = square_of(phi);
                let norm = left.sqrt();
                // Weights of both signs may leave a function no norm: such a zone has no projection.
                let rounding = -1e-12
                    * weights.iter().enumerate().map(|(p, w)| w.abs() * phi[p * functions + k].powi(2)).sum::<f64>();
                for square in [square, left] {
                    if !weights.is_empty() && !(square >= rounding && (k > 0 || square > 0.0)) {
                        self.unsuited.get_or_insert(square);
                    }
                }
                // A zone with fewer independent points than functions simply has fewer functions.
                let scale = if norm > 1e-10 * before { 1.0 / norm } else { 0.0 };
                for p in 0..weights.len() {
                    phi[p * functions + k] *= scale;
                }
            }
        }
    }

    /// Writes the condensed unknowns of a cluster that belong to zero displacement where nothing expands: Newton's method goes on from there.
    pub(super) fn start_zone(&self, cluster: usize, condensed: &mut [f64]) {
        match self.field {
            PressureField::Displacement => {}
            PressureField::Pointwise => {
                for pair in condensed.chunks_exact_mut(2) {
                    pair.copy_from_slice(&[1.0, 0.0]);
                }
            }
            _ => {
                condensed.fill(0.0);
                self.project(cluster, |_| 1.0, &mut condensed[..self.functions]);
                // The exponent is behind the last pair.
                for pair in condensed[2 * self.functions..].chunks_exact_mut(2) {
                    pair.copy_from_slice(&[1.0, 0.0]);
                }
            }
        }
    }

    /// Coefficients of the projection of values at the points of a zone.
    pub(super) fn project(&self, cluster: usize, value: impl Fn(usize) -> f64, theta: &mut [f64]) {
        theta.fill(0.0);
        for point in self.table.clusters().points(cluster) {
            let weighted = self.table.weights()[point] * value(point);
            for (theta, phi) in theta.iter_mut().zip(self.zone_functions(point)) {
                *theta += weighted * phi;
            }
        }
    }

    /// The unknowns of a zone: coefficients of $\bar G$ and of its conjugate, and the measure it has by the last one.
    #[inline(always)]
    pub(super) fn zone<'a>(&self, cluster: usize, condensed: &'a [f64]) -> (&'a [f64], &'a [f64], VolumetricMeasure) {
        let n = self.functions;
        if n == 0 {
            return (&[], &[], self.measure);
        }
        let all = &condensed[self.unknowns(cluster)];
        (&all[..n], &all[n..2 * n], self.measure.towards_volume(all[all.len() - 1] * self.unit(cluster)))
    }

    /// $J$ and the pressure of the pointwise energy at the points of a zone, as iterates; none where nothing stays pointwise.
    #[inline(always)]
    pub(super) fn point_iterates<'a>(&self, cluster: usize, condensed: &'a [f64]) -> &'a [f64] {
        if self.pointwise.is_none() {
            return &[];
        }
        let all = &condensed[self.unknowns(cluster)];
        &all[2 * self.functions..all.len() - 1]
    }

    /// The constant zone function: the exponent is counted in its inverse, so that it is of the size of the first,
    /// whatever the unit of length.
    #[inline(always)]
    pub(super) fn unit(&self, cluster: usize) -> f64 {
        self.table.clusters().points(cluster).next().map_or(0.0, |point| self.zone_functions(point)[0])
    }

    /// The exponent of a zone that has `held` under a mean pressure: how far it is on the way from roots of $J$
    /// to $J$.
    #[inline(always)]
    pub(super) fn pulled(&self, cluster: usize, pressure: f64, held: f64) -> f64 {
        let [from, to] = TENSION_BLEND;
        let unit = self.unit(cluster);
        // Without a shear modulus nothing is known; a zone without a volume has no pressure.
        if !(self.shear > 0.0 && unit > 0.0 && (pressure > from * self.shear || held != 0.0)) {
            return 0.0;
        }
        let x = ((pressure / self.shear - from) / (to - from)).clamp(0.0, 1.0);
        let (wanted, held_part) = (PARTS * x * x * (3.0 - 2.0 * x), PARTS * held * unit);
        // What was predicted from two states, or gone by a part of a step, may lie between.
        let whole = (held_part - held_part.round()).abs() < 1e-6;
        if whole && (wanted - held_part).abs() <= KEPT { held } else { wanted.round() / (PARTS * unit) }
    }

    /// What stays pointwise, per unit of its share.
    #[inline(always)]
    pub(super) fn pointwise_energy(&self, volumetric: &dyn VolumetricEnergy, j: f64) -> Volumetric {
        match &self.pointwise {
            Some(pointwise) => pointwise.evaluate(volumetric, j),
            None => Volumetric { energy: 0.0, slope: 0.0, curvature: 0.0 },
        }
    }

    /// What is projected of the volumetric energy of a zone with a share that stays pointwise, as a function of a measure.
    #[inline(always)]
    pub(super) fn projected_energy(
        &self,
        volumetric: &dyn VolumetricEnergy,
        (measure, kept): (VolumetricMeasure, Kept),
        value: f64,
    ) -> Volumetric {
        match &self.pointwise {
            Some(pointwise) => measure.energy(&ProjectedEnergy { volumetric, pointwise, kept }, value),
            None => measure.energy(volumetric, value),
        }
    }

    /// What stays pointwise at a point of a zone with a share.
    #[inline(always)]
    pub(super) fn kept(&self, share: f64, recall: &Recall<'_>, point: usize) -> Kept {
        let past = recall.of_volume(point);
        match if past.memory.is_empty() { None } else { self.material.relaxation() } {
            Some(prony) => Kept::relaxing(share, prony, past),
            None => Kept::elastic(share),
        }
    }

    /// The share of the pointwise energy in a zone.
    #[inline(always)]
    pub(super) fn stabilisation(&self, cluster: usize) -> f64 {
        if self.fewest == 0 {
            return self.stabilisation;
        }
        let points = self.table.clusters().points(cluster).len();
        (self.stabilisation * (points as f64 / self.fewest as f64).min(WIDEST)).min(POINTWISE_SHARE)
    }

    /// Values of the orthonormal zone functions $\varphi_k$ of the point's cluster, $\int\varphi_k\varphi_l = \delta_{kl}$;
    /// empty where pressures are not projected. A cluster of too few points has zeros in place of the last ones.
    #[inline(always)]
    pub(crate) fn zone_functions(&self, point: usize) -> &[f64] {
        &self.phi[point * self.functions..(point + 1) * self.functions]
    }

    /// The energy of a body without condensed unknowns at a state: projected where the field is.
    pub(super) fn zone_energy(&self, cluster: usize, view: View<'_>) -> f64 {
        let d = view.displacement;
        let recall = self.recall(view);
        let Some(volumetric) = self.material.volumetric() else {
            let energy = |p| self.material.energy_from(&self.local_gradient(p, d), recall.at(p));
            return self.table.clusters().points(cluster).map(|p| self.table.weights()[p] * energy(p)).sum();
        };
        let (n, share) = (self.functions, self.stabilisation(cluster));
        let (_, _, measure) = self.zone(cluster, view.condensed);
        let mut theta = [0.0; 4];
        let mut energy = 0.0;
        for point in self.table.clusters().points(cluster) {
            let f = self.deformation_gradient(point, d);
            let weight = self.table.weights()[point];
            let j = f.determinant();
            energy += weight * self.material.energy_from(&f, recall.at(point));
            energy += weight
                * match n {
                    0 => volumetric.evaluate(j).energy,
                    _ => {
                        let Kept { share, held } = self.kept(share, &recall, point);
                        share * self.pointwise_energy(volumetric, j).energy + held[0] * (j - 1.0)
                    }
                };
            let value = measure.of(j).value;
            for (t, phi) in theta.iter_mut().zip(self.zone_functions(point)) {
                *t += weight * phi * value;
            }
        }
        if n > 0 {
            for point in self.table.clusters().points(cluster) {
                let projected: f64 = self.zone_functions(point).pair_sum(&theta, |p, t| p * t);
                let kept = self.kept(share, &recall, point);
                energy +=
                    self.table.weights()[point] * self.projected_energy(volumetric, (measure, kept), projected).energy;
            }
        }
        energy
    }
}
