//! The body: distortional energy at points, volumetric energy at points or projected on zones.

use nalgebra::Matrix3;

use crate::geometry::Point;
use crate::material::Material;
use crate::table::ShapeTable;
use crate::tensor::{Tangent, add_determinant_hessian, cofactor, components};

use super::guard::largest_step;
use super::{Element, Term, View};

/// Part of the bulk modulus that may stay pointwise beside projected pressures; see [`Body::zonal`].
const POINTWISE_SHARE: f64 = 0.1;

/// How the volumetric energy of a body is treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PressureField {
    /// $U(J)$ at each point, plain Newton in the displacements.
    Displacement,
    /// $U(J)$ at each point, the pressure at each point an iterate of Newton. Same solution as
    /// [`Displacement`](PressureField::Displacement) in far fewer steps.
    Pointwise,
    /// $U(\bar J)$ with $\bar J$ the projection of $J$ on constants in each cluster.
    Constant,
    /// $U(\bar J)$ with $\bar J$ the projection of $J$ on linear functions in each cluster.
    Linear,
}

/// The elastic energy of a body over a table, $\Pi = \int W(F)\,\mathrm d\Omega$ (4.4).
///
/// With projected pressures, $W = \bar W(F) + (1-s)\,U(\bar J) + s\,U(J)$: $\bar J = \varphi^T\theta$ is the
/// $L_2$ projection of $J$ on the zone functions $\varphi$, and $\theta$, $\pi$ ($p = \varphi^T\pi$) are local
/// unknowns of Newton, condensed before assembly. With orthonormal $\varphi$ and
/// $C = \int\varphi\,\partial J/\partial d$, $H = \int\varphi\,(1-s)U''\varphi^T$ the condensed system is
/// $$\Big[K_{dev} + \int p\,\partial^2_{dd}J + C^T H C\Big]\delta d = -\big(f + C^T(r_\theta + H r_\pi)\big).$$
pub struct Body<const D: usize, M> {
    table: ShapeTable<D>,
    material: M,
    field: PressureField,
    functions: usize,
    phi: Vec<f64>,
    share: f64,
}

impl<const D: usize, M: Material> Body<D, M> {
    /// A body with the given treatment of the volumetric energy; a material that can't be split
    /// runs in [`PressureField::Displacement`].
    ///
    /// Zones are the clusters of the table. Projected fields keep the share
    /// $s = \min(\mu_0/k, 1/10)$ of the volumetric energy pointwise (see [`zonal`](Body::zonal)).
    pub fn new(table: ShapeTable<D>, material: M, field: PressureField) -> Self {
        let share = match field {
            PressureField::Constant | PressureField::Linear => pointwise_share(&material),
            _ => 0.0,
        };
        Body::zonal(table, material, field, share)
    }

    /// As [`new`](Body::new) with the pointwise share $s \in [0, 1)$ of the volumetric energy given.
    ///
    /// Without a pointwise part a compressed body wrinkles inside its macro cells: a pressed ring
    /// converged to states with negative eigenvalues. Homogeneous states do not depend on $s$.
    pub fn zonal(table: ShapeTable<D>, material: M, field: PressureField, share: f64) -> Self {
        let field = if material.split().is_some() { field } else { PressureField::Displacement };
        let mut body = Body { table, material, field, functions: 0, phi: Vec::new(), share };
        match field {
            PressureField::Constant => body.tabulate_zone_functions(1),
            PressureField::Linear => body.tabulate_zone_functions(D + 1),
            _ => body.share = 0.0,
        }
        body
    }

    /// The table.
    pub fn table(&self) -> &ShapeTable<D> {
        &self.table
    }

    /// The material.
    pub fn material(&self) -> &M {
        &self.material
    }

    /// How the volumetric energy is treated; `Displacement` where the material could not be split.
    pub fn field(&self) -> PressureField {
        self.field
    }

    /// The hydrostatic pressures $p = U'$ (2.15) \[stress\] at the points of the table, positive in tension;
    /// those of the zones where pressures are projected. `None` for a material that can't be split.
    pub fn pressures(&self, view: View<'_>) -> Option<Vec<f64>> {
        let (_, volumetric) = self.material.split()?;
        let pointwise = |point| volumetric.evaluate(self.deformation_gradient(point, view.displacement).determinant());
        let mut pressures = Vec::with_capacity(self.table.len());
        for cluster in 0..self.table.clusters().len() {
            for point in self.table.clusters().points(cluster) {
                pressures.push(match self.field {
                    PressureField::Displacement => pointwise(point).slope,
                    PressureField::Pointwise => view.locals[2 * point + 1],
                    PressureField::Constant | PressureField::Linear => {
                        let pi = &view.locals[self.locals(cluster)][self.functions..];
                        let projected: f64 = self.phi(point).iter().zip(pi).map(|(p, pi)| p * pi).sum();
                        projected + self.share * pointwise(point).slope
                    }
                });
            }
        }
        Some(pressures)
    }

    /// Local unknowns that belong to a field of hydrostatic pressures $p(X)$ \[stress\], term by term as
    /// [`Term::locals`] counts them: $\pi$ the projection of $p$, $\theta$ that of the $J$ with $U'(J) = p$.
    ///
    /// A first guess for a state whose pressures are known from another model; empty where pressures are no
    /// unknowns.
    pub fn locals_of(&self, pressure: impl Fn(&Point<D>) -> f64) -> Vec<f64> {
        let clusters = self.table.clusters();
        let total = clusters.len().checked_sub(1).map_or(0, |last| self.locals(last).end);
        let mut locals = vec![0.0; total];
        let Some((_, volumetric)) = self.material.split() else { return locals };
        if total == 0 {
            return locals;
        }
        for cluster in 0..clusters.len() {
            let range = self.locals(cluster);
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
                if self.is_zonal() {
                    let (theta, pi) = locals[range.clone()].split_at_mut(self.functions);
                    let weight = self.table.weights()[point];
                    for (k, phi) in self.phi(point).iter().enumerate() {
                        theta[k] += weight * phi * j;
                        pi[k] += weight * phi * (1.0 - self.share) * p;
                    }
                } else {
                    locals[2 * point..2 * point + 2].copy_from_slice(&[j, p]);
                }
            }
        }
        locals
    }

    /// Orthonormal constants or linear functions on each cluster, by Gram–Schmidt over its points.
    fn tabulate_zone_functions(&mut self, functions: usize) {
        self.functions = functions;
        self.phi = vec![0.0; functions * self.table.len()];
        let clusters = self.table.clusters();
        for cluster in 0..clusters.len() {
            let points = clusters.points(cluster);
            let weights = &self.table.weights()[points.clone()];
            let positions = &self.table.positions()[points.clone()];
            let total: f64 = weights.iter().sum();
            let mut centre = Point::<D>::zeros();
            for (x, w) in positions.iter().zip(weights) {
                centre += x * (w / total);
            }
            let phi = &mut self.phi[points.start * functions..points.end * functions];
            for k in 0..functions {
                for (p, x) in positions.iter().enumerate() {
                    phi[p * functions + k] = if k == 0 { 1.0 } else { x[k - 1] - centre[k - 1] };
                }
                let norm_of = |phi: &[f64]| -> f64 {
                    weights.iter().enumerate().map(|(p, w)| w * phi[p * functions + k].powi(2)).sum::<f64>().sqrt()
                };
                let before = norm_of(phi);
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
                let norm = norm_of(phi);
                // A zone with fewer independent points than functions simply has fewer functions.
                let scale = if norm > 1e-10 * before { 1.0 / norm } else { 0.0 };
                for p in 0..weights.len() {
                    phi[p * functions + k] *= scale;
                }
            }
        }
    }

    /// Values of the orthonormal zone functions $\varphi_k$ of the point's cluster, $\int\varphi_k\varphi_l = \delta_{kl}$;
    /// empty where pressures are not projected. A cluster of too few points has zeros in place of the last ones.
    pub fn zone_functions(&self, point: usize) -> &[f64] {
        self.phi(point)
    }

    fn phi(&self, point: usize) -> &[f64] {
        &self.phi[point * self.functions..(point + 1) * self.functions]
    }

    /// The deformation gradient $F$ at a point of the table.
    pub fn deformation_gradient(&self, point: usize, displacement: &[f64]) -> Matrix3<f64> {
        Matrix3::identity() + self.table.displacement_gradient(point, displacement)
    }

    /// Residuals of the local equations and the Hessian of a zone, at the current state.
    fn zone_residuals(&self, cluster: usize, view: &View<'_>, zone: &mut ZoneState) {
        let n = self.functions;
        let Some((_, volumetric)) = self.material.split() else { return };
        let locals = &view.locals[self.locals(cluster)];
        let (theta, pi) = locals.split_at(n);
        zone.pi[..n].copy_from_slice(pi);
        for k in 0..n {
            zone.of_theta[k] = -pi[k];
            zone.of_pi[k] = -theta[k];
        }
        zone.hessian = [[0.0; 4]; 4];
        for point in self.table.clusters().points(cluster) {
            let phi = self.phi(point);
            let weight = self.table.weights()[point];
            let j = self.deformation_gradient(point, view.displacement).determinant();
            let projected: f64 = phi.iter().zip(theta).map(|(p, t)| p * t).sum();
            let u = volumetric.evaluate(projected);
            for k in 0..n {
                zone.of_theta[k] += weight * phi[k] * (1.0 - self.share) * u.slope;
                zone.of_pi[k] += weight * phi[k] * j;
                for l in 0..n {
                    zone.hessian[k][l] += weight * phi[k] * phi[l] * (1.0 - self.share) * u.curvature;
                }
            }
        }
        for k in 0..n {
            zone.pressure[k] =
                pi[k] + zone.of_theta[k] + (0..n).map(|l| zone.hessian[k][l] * zone.of_pi[l]).sum::<f64>();
        }
    }

    fn is_zonal(&self) -> bool {
        self.functions > 0
    }

    /// The energy of a body without local unknowns at a state: projected where the field is.
    fn zone_energy(&self, cluster: usize, d: &[f64]) -> f64 {
        let Some((distortional, volumetric)) = self.material.split() else {
            return self
                .table
                .clusters()
                .points(cluster)
                .map(|p| self.table.weights()[p] * self.material.energy(&self.deformation_gradient(p, d)))
                .sum();
        };
        let n = self.functions;
        let mut theta = [0.0; 4];
        let mut energy = 0.0;
        for point in self.table.clusters().points(cluster) {
            let f = self.deformation_gradient(point, d);
            let weight = self.table.weights()[point];
            let j = f.determinant();
            energy += weight * distortional.energy(&f);
            let pointwise = if self.is_zonal() { self.share } else { 1.0 };
            energy += weight * pointwise * volumetric.evaluate(j).energy;
            for (t, phi) in theta.iter_mut().zip(self.phi(point)) {
                *t += weight * phi * j;
            }
        }
        if n > 0 {
            for point in self.table.clusters().points(cluster) {
                let projected: f64 = self.phi(point).iter().zip(&theta).map(|(p, t)| p * t).sum();
                energy += self.table.weights()[point] * (1.0 - self.share) * volumetric.evaluate(projected).energy;
            }
        }
        energy
    }
}

/// $\min(\mu_0/k, 1/10)$ of a material that can be split, else 0.
fn pointwise_share(material: &impl Material) -> f64 {
    let Some((_, volumetric)) = material.split() else { return 0.0 };
    let shear = crate::material::initial_shear_modulus(material);
    let bulk = volumetric.evaluate(1.0).curvature;
    if bulk > 0.0 && shear >= 0.0 { (shear / bulk).min(POINTWISE_SHARE) } else { 0.0 }
}

/// Residuals of one zone; at most four functions.
#[derive(Default)]
struct ZoneState {
    pi: [f64; 4],
    of_theta: [f64; 4],
    of_pi: [f64; 4],
    hessian: [[f64; 4]; 4],
    /// π + r_θ + H r_π: the pressure that enters the condensed forces.
    pressure: [f64; 4],
}

impl<const D: usize, M: Material> Term<D> for Body<D, M> {
    fn clusters(&self) -> usize {
        self.table.clusters().len()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        self.table.clusters().nodes(cluster)
    }

    fn locals(&self, cluster: usize) -> std::ops::Range<usize> {
        match self.field {
            PressureField::Displacement => 0..0,
            PressureField::Pointwise => {
                let points = self.table.clusters().points(cluster);
                2 * points.start..2 * points.end
            }
            _ => 2 * self.functions * cluster..2 * self.functions * (cluster + 1),
        }
    }

    fn start(&self, cluster: usize, locals: &mut [f64]) {
        match self.field {
            PressureField::Displacement => {}
            PressureField::Pointwise => {
                for pair in locals.chunks_exact_mut(2) {
                    pair.copy_from_slice(&[1.0, 0.0]);
                }
            }
            _ => {
                locals.fill(0.0);
                for point in self.table.clusters().points(cluster) {
                    let weight = self.table.weights()[point];
                    for (theta, phi) in locals.iter_mut().zip(self.phi(point)) {
                        *theta += weight * phi;
                    }
                }
            }
        }
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        let table = &self.table;
        let size = table.clusters().nodes(cluster).len() * D;
        let contraction = Contraction::of(table);
        let split = self.material.split();
        let mut zone = ZoneState::default();
        let n = self.functions;
        let mut volume_slopes = std::mem::take(&mut out.scratch);
        if self.is_zonal() {
            self.zone_residuals(cluster, &view, &mut zone);
            volume_slopes.clear();
            volume_slopes.resize(2 * n * size, 0.0);
        }
        for point in table.clusters().points(cluster) {
            let f = self.deformation_gradient(point, view.displacement);
            let weight = table.weights()[point];
            let (mut stress, mut tangent) = match (self.field, split) {
                (PressureField::Displacement, _) | (_, None) => {
                    let response = self.material.response(&f);
                    (response.stress, response.tangent)
                }
                (_, Some((distortional, _))) => {
                    let response = distortional.response(&f);
                    (response.stress, response.tangent)
                }
            };
            if let (Some((_, volumetric)), true) = (split, self.field != PressureField::Displacement) {
                let cof = cofactor(&f);
                // `force` multiplies cof F in the stress, `geometric` ∂²J, `rank_one` cof ⊗ cof.
                let (force, geometric, rank_one) = if self.field == PressureField::Pointwise {
                    let theta = view.locals[2 * point];
                    let u = volumetric.evaluate(theta);
                    let force = u.slope + u.curvature * (f.determinant() - theta);
                    (force, view.locals[2 * point + 1], u.curvature)
                } else {
                    let phi = self.phi(point);
                    let u = volumetric.evaluate(f.determinant());
                    let dot = |c: &[f64; 4]| -> f64 { phi.iter().zip(c).map(|(p, c)| p * c).sum() };
                    (
                        dot(&zone.pressure) + self.share * u.slope,
                        dot(&zone.pi) + self.share * u.slope,
                        self.share * u.curvature,
                    )
                };
                stress += cof * force;
                if out.with_matrix {
                    add_determinant_hessian(&mut tangent, &f, geometric);
                    let c = components(&cof);
                    tangent.ger(rank_one, &c, &c, 1.0);
                    if self.is_zonal() {
                        let reduced = reduce_stress::<D>(&cof, table.hoops());
                        for k in 0..n {
                            let factor = weight * self.phi(point)[k];
                            contraction.add_forces(
                                table,
                                point,
                                &reduced,
                                factor,
                                &mut volume_slopes[k * size..(k + 1) * size],
                            );
                        }
                    }
                }
            }
            let reduced = reduce_stress::<D>(&stress, table.hoops());
            contraction.add_forces(table, point, &reduced, weight, &mut out.residual);
            if out.with_matrix {
                let reduced = reduce_tangent::<D>(&tangent, table.hoops());
                contraction.add_matrix(table, point, &reduced, weight, size, true, out);
            }
        }
        if self.is_zonal() && out.with_matrix {
            let (slopes, products) = volume_slopes.split_at_mut(n * size);
            for k in 0..n {
                for l in 0..n {
                    let h = zone.hessian[k][l];
                    for (product, slope) in
                        products[k * size..(k + 1) * size].iter_mut().zip(&slopes[l * size..(l + 1) * size])
                    {
                        *product += h * slope;
                    }
                }
            }
            for column in 0..size {
                // Whole blocks on the diagonal, as Element asks.
                let first = column - column % D;
                for k in 0..n {
                    let factor = products[k * size + column];
                    let target = &mut out.matrix[column * size + first..(column + 1) * size];
                    for (entry, slope) in target.iter_mut().zip(&slopes[k * size + first..(k + 1) * size]) {
                        *entry += factor * slope;
                    }
                }
            }
        }
        out.scratch = volume_slopes;
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: &[f64], locals_step: &mut [f64]) -> f64 {
        let mut bound: f64 = 1.0;
        let n = self.functions;
        let mut zone = ZoneState::default();
        if self.is_zonal() {
            self.zone_residuals(cluster, &view, &mut zone);
        }
        // r_π + C δd, function by function.
        let mut theta_step = zone.of_pi;
        let first = self.table.clusters().points(cluster).start;
        for point in self.table.clusters().points(cluster) {
            let f = self.deformation_gradient(point, view.displacement);
            let df = self.table.displacement_gradient(point, step);
            bound = bound.min(largest_step(&f, &df));
            let change = || cofactor(&f).dot(&df);
            match (self.field, self.material.split()) {
                (PressureField::Displacement, _) | (_, None) => {}
                (PressureField::Pointwise, Some((_, volumetric))) => {
                    let theta = view.locals[2 * point];
                    let u = volumetric.evaluate(theta);
                    let of_theta = f.determinant() - theta + change();
                    let at = 2 * (point - first);
                    locals_step[at] = of_theta;
                    locals_step[at + 1] = u.slope - view.locals[2 * point + 1] + u.curvature * of_theta;
                }
                _ => {
                    let weighted = self.table.weights()[point] * change();
                    for (t, phi) in theta_step.iter_mut().zip(self.phi(point)) {
                        *t += weighted * phi;
                    }
                }
            }
        }
        for k in 0..n {
            locals_step[k] = theta_step[k];
            locals_step[n + k] = zone.of_theta[k] + (0..n).map(|l| zone.hessian[k][l] * theta_step[l]).sum::<f64>();
        }
        bound
    }

    fn energy(&self, cluster: usize, view: View<'_>) -> f64 {
        self.zone_energy(cluster, view.displacement)
    }

    fn largest_gradient(&self, cluster: usize, displacement: &[f64]) -> f64 {
        let points = self.table.clusters().points(cluster);
        points.map(|p| self.table.displacement_gradient(p, displacement).norm()).fold(0.0, f64::max)
    }

    fn smallest_jacobian(&self, cluster: usize, view: View<'_>) -> Option<(f64, Vec<f64>)> {
        self.table
            .clusters()
            .points(cluster)
            .map(|point| (self.deformation_gradient(point, view.displacement).determinant(), point))
            // A NaN counts as the smallest of all.
            .min_by(|a, b| if a.0.is_nan() { std::cmp::Ordering::Less } else { a.0.total_cmp(&b.0) })
            .map(|(j, point)| (j, self.table.positions()[point].as_slice().to_vec()))
    }
}

/// Stress components that do work on the displacement of one kinematics: entry $3i + s$ belongs to
/// displacement component $i$ and gradient slot $s$; the hoops are summed into slot $D$ of component 0.
#[inline]
pub(crate) fn reduce_stress<const D: usize>(stress: &Matrix3<f64>, hoops: &[usize]) -> [f64; 9] {
    let mut reduced = [0.0; 9];
    for i in 0..D {
        for s in 0..D {
            reduced[3 * i + s] = stress[(i, s)];
        }
    }
    for &k in hoops {
        reduced[D] += stress[(k, k)];
    }
    reduced
}

/// The tangent in the components of [`reduce_stress`].
#[inline]
pub(crate) fn reduce_tangent<const D: usize>(tangent: &Tangent, hoops: &[usize]) -> [[f64; 9]; 9] {
    let mut reduced = [[0.0; 9]; 9];
    for i in 0..D {
        for s in 0..D {
            for j in 0..D {
                for t in 0..D {
                    reduced[3 * i + s][3 * j + t] = tangent[(3 * i + s, 3 * j + t)];
                }
            }
            for &k in hoops {
                reduced[3 * i + s][D] += tangent[(3 * i + s, 4 * k)];
                reduced[D][3 * i + s] += tangent[(4 * k, 3 * i + s)];
            }
        }
    }
    for &k in hoops {
        for &l in hoops {
            reduced[D][D] += tangent[(4 * k, 4 * l)];
        }
    }
    reduced
}

/// Sums over neighbour pairs, compiled for each dimension and number of slots.
#[derive(Clone, Copy)]
pub(crate) struct Contraction {
    dimension: usize,
    slots: usize,
}

impl Contraction {
    pub(crate) fn of<const D: usize>(table: &ShapeTable<D>) -> Self {
        Contraction { dimension: D, slots: table.slots() }
    }

    /// Adds $w\,P_{is}\,g_{as}$ to the forces of a cluster.
    #[inline]
    pub(crate) fn add_forces<const D: usize>(
        self,
        table: &ShapeTable<D>,
        point: usize,
        stress: &[f64; 9],
        weight: f64,
        forces: &mut [f64],
    ) {
        let local = table.clusters().local(point);
        let gradients = table.gradients(point);
        let n = local.len();
        for (a, &l) in local.iter().enumerate() {
            let target = &mut forces[l as usize * D..l as usize * D + D];
            for (i, entry) in target.iter_mut().enumerate() {
                let mut sum = 0.0;
                for s in 0..self.slots {
                    sum += stress[3 * i + s] * gradients[s * n + a];
                }
                *entry += weight * sum;
            }
        }
    }

    /// Adds $w\,g_{as} A_{isjt}\,g_{bt}$ to the matrix of a cluster.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn add_matrix<const D: usize>(
        self,
        table: &ShapeTable<D>,
        point: usize,
        tangent: &[[f64; 9]; 9],
        weight: f64,
        size: usize,
        symmetric: bool,
        out: &mut Element,
    ) {
        let local = table.clusters().local(point);
        let gradients = table.gradients(point);
        let matrix = &mut out.matrix;
        match (self.dimension, self.slots) {
            (1, 1) => add_block::<1, 1>(local, gradients, tangent, weight, size, symmetric, matrix),
            (1, 2) => add_block::<1, 2>(local, gradients, tangent, weight, size, symmetric, matrix),
            (2, 2) => add_block::<2, 2>(local, gradients, tangent, weight, size, symmetric, matrix),
            (2, 3) => add_block::<2, 3>(local, gradients, tangent, weight, size, symmetric, matrix),
            _ => add_block::<3, 3>(local, gradients, tangent, weight, size, symmetric, matrix),
        }
    }
}

/// The structured contraction: $T_{isj} = A_{isjt} g_{bt}$ first, then one dot product per entry.
fn add_block<const D: usize, const S: usize>(
    local: &[u16],
    gradients: &[f64],
    tangent: &[[f64; 9]; 9],
    weight: f64,
    size: usize,
    symmetric: bool,
    matrix: &mut [f64],
) {
    let n = local.len();
    for b in 0..n {
        let mut g = [0.0; S];
        for t in 0..S {
            g[t] = weight * gradients[t * n + b];
        }
        let first = if symmetric { b } else { 0 };
        for j in 0..D {
            let mut products = [[0.0; S]; D];
            for i in 0..D {
                for s in 0..S {
                    let row = &tangent[3 * i + s];
                    let mut sum = 0.0;
                    for t in 0..S {
                        sum += row[3 * j + t] * g[t];
                    }
                    products[i][s] = sum;
                }
            }
            let start = (local[b] as usize * D + j) * size;
            let column = &mut matrix[start..start + size];
            for a in first..n {
                let row = local[a] as usize * D;
                let target = &mut column[row..row + D];
                for i in 0..D {
                    let mut sum = 0.0;
                    for s in 0..S {
                        sum += products[i][s] * gradients[s * n + a];
                    }
                    target[i] += sum;
                }
            }
        }
    }
}
