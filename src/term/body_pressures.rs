//! The pressures of a body.

use crate::each::Each;
use crate::geometry::Point;
use crate::material::Material;
use crate::tensor::cofactor;

use super::Term;
use super::body::Body;
use super::element::View;
use super::pressure_field::PressureField;
use super::stabilisation::Kept;

impl<const D: usize> Body<D> {
    /// The hydrostatic pressures $p = U'$ (2.15) \[stress\] at the points of the table, positive in tension;
    /// those of the zones where pressures are projected. `None` for a material without a volumetric part, and for a state of
    /// another model.
    pub(crate) fn pressures(&self, view: View<'_>) -> Option<Vec<f64>> {
        self.pressures_of(view, |projected, pointwise, _| projected + pointwise)
    }

    /// The pressures that are proportional to the bulk modulus: without the part that zones leave pointwise, which is as large as the
    /// shear modulus whatever the bulk modulus is.
    pub(crate) fn bulk_pressures(&self, view: View<'_>) -> Option<Vec<f64>> {
        self.pressures_of(view, |projected, _, part| projected / (1.0 - part))
    }

    /// Pressures at the points, where they are projected by the projected one, the pointwise one and the part of the volumetric energy that
    /// stays pointwise.
    fn pressures_of(&self, view: View<'_>, of: impl Fn(f64, f64, f64) -> f64) -> Option<Vec<f64>> {
        let volumetric = self.material.volumetric()?;
        if view.displacement.len() != self.table.node_count() * D || view.condensed.len() != self.condensed_count() {
            return None;
        }
        let pointwise = |point| volumetric.evaluate(self.deformation_gradient(point, view.displacement).determinant());
        let recall = self.recall(view);
        let mut pressures = Vec::with_capacity(self.table.point_count());
        for cluster in 0..self.table.clusters().count() {
            for point in self.table.clusters().points(cluster) {
                pressures.push(match self.field {
                    PressureField::Displacement => pointwise(point).slope,
                    PressureField::Pointwise => view.condensed[2 * point + 1],
                    PressureField::Constant | PressureField::Linear => {
                        let (_, pi, measure) = self.zone(cluster, view.condensed);
                        let projected: f64 = self.zone_functions(point).pair_sum(pi, |p, pi| p * pi);
                        let j = self.deformation_gradient(point, view.displacement).determinant();
                        let Kept { share, held } = self.kept(self.stabilisation(cluster), &recall, point);
                        let pointwise = share * self.pointwise_energy(volumetric, j).slope + held[0];
                        of(projected * measure.of(j).slope, pointwise, share)
                    }
                });
            }
        }
        Some(pressures)
    }

    /// How the pressures at the points of the table change with a small step of the displacement and of the condensed
    /// unknowns.
    pub(crate) fn pressure_changes(&self, view: View<'_>, step: &[f64], condensed_step: &[f64]) -> Option<Vec<f64>> {
        let volumetric = self.material.volumetric()?;
        let mut changes = Vec::with_capacity(self.table.point_count());
        for cluster in 0..self.table.clusters().count() {
            for point in self.table.clusters().points(cluster) {
                let f = self.deformation_gradient(point, view.displacement);
                changes.push(match self.field {
                    PressureField::Displacement => {
                        let change = cofactor(&f).dot(&self.table.displacement_gradient(point, step));
                        volumetric.evaluate(f.determinant()).curvature * change
                    }
                    PressureField::Pointwise => condensed_step[2 * point + 1],
                    PressureField::Constant | PressureField::Linear => {
                        let (_, _, measure) = self.zone(cluster, view.condensed);
                        let pi = &condensed_step[self.unknowns(cluster)][self.functions..2 * self.functions];
                        let projected: f64 = self.zone_functions(point).pair_sum(pi, |p, pi| p * pi);
                        projected * measure.of(f.determinant()).slope
                    }
                });
            }
        }
        Some(changes)
    }

    /// Condensed unknowns that belong to a field of hydrostatic pressures $p(X)$ \[stress\], term by term as
    /// [`Term::unknowns`] counts them: the projections of the part of $p$ that zones carry, as the
    /// derivative by what they project ($J$ or its root), and of that at the $J$ with $U'(J) = p$.
    ///
    /// A first guess for a state whose pressures are known from another model; empty where pressures are no
    /// unknowns.
    pub(crate) fn condensed_of(&self, pressure: impl Fn(&Point<D>) -> f64) -> Vec<f64> {
        let (clusters, total) = (self.table.clusters(), self.condensed_count());
        let mut condensed = vec![0.0; total];
        let Some(volumetric) = self.material.volumetric() else { return condensed };
        if total == 0 {
            return condensed;
        }
        for cluster in 0..clusters.count() {
            let range = self.unknowns(cluster);
            let mut measure = self.measure;
            if self.functions > 0 {
                let (mut sum, mut volume) = (0.0, 0.0);
                for point in clusters.points(cluster) {
                    let weight = self.table.weights()[point];
                    (sum, volume) = (sum + weight * pressure(&self.table.positions()[point]), volume + weight);
                }
                let pulled = self.pulled(cluster, sum / volume, 0.0);
                condensed[range.end - 1] = pulled;
                measure = self.measure.towards_volume(pulled * self.unit(cluster));
            }
            for point in clusters.points(cluster) {
                let p = pressure(&self.table.positions()[point]);
                let mut j = 1.0;
                // U' is nearly straight around J = 1; a guess needs no more digits.
                for _ in 0..4 {
                    let u = volumetric.evaluate(j);
                    let next = j + (p - u.slope) / u.curvature;
                    if !(next > 0.2 && next < 5.0) {
                        break;
                    }
                    j = next;
                }
                if self.functions > 0 {
                    let measure = measure.of(j);
                    let kept = self.stabilisation(cluster) * self.pointwise_energy(volumetric, j).slope;
                    let (theta, pi) = condensed[range.clone()].split_at_mut(self.functions);
                    let weight = self.table.weights()[point];
                    for (k, phi) in self.zone_functions(point).iter().enumerate() {
                        theta[k] += weight * phi * measure.value;
                        pi[k] += weight * phi * (p - kept) / measure.slope;
                    }
                    if self.pointwise.is_some() {
                        let place = point - clusters.points(cluster).start;
                        let at = range.start + 2 * (self.functions + place);
                        condensed[at..at + 2].copy_from_slice(&[j, kept]);
                    }
                } else {
                    condensed[2 * point..2 * point + 2].copy_from_slice(&[j, p]);
                }
            }
        }
        condensed
    }
}
