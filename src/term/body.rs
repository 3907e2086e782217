//! The body: distortional energy at points, volumetric energy at points or projected on zones.

use nalgebra::Matrix3;

use crate::error::SolveError;
use crate::geometry::Point;
use crate::material::Material;
use crate::table::ShapeTable;
#[cfg(feature = "solve")]
use crate::tensor::cofactor;

use super::amplitude::Amplitude;
use super::apart::{Product, Zone};
use super::step_limit::jacobian;
use super::volumetric_measure::VolumetricMeasure;
use super::{Element, StateDiagnostics, Term, View};

/// Part of the bulk modulus that may stay pointwise beside projected pressures; see [`Body::zonal`].
const POINTWISE_SHARE: f64 = 0.1;

/// Tensions of a zone, by the sum of its initial shear modulus and von Mises' stress, between which its measure goes over
/// from roots of $J$ to $J$. Roots are stable below 3 to 4; with 1 and 3 a cylinder of revolution, bonded and pulled by 30 %,
/// had unstable modes on the way. A pulled sheet stays below 2/3.
const TENSION_BLEND: [f64; 2] = [0.8, 1.6];

/// Equal parts of that way: the measure goes it part by part, so that it rests while Newton's method comes to rest.
const PARTS: f64 = 16.0;

/// A zone keeps its part until that of the current pressure differs by more than this.
const KEPT: f64 = 0.75;

/// Zones of so many times the points of the smallest keep as many times its stabilisation, wider ones no more.
const WIDEST: f64 = 1.5;

/// How the volumetric energy of a body is treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PressureField {
    /// $U(J)$ at each point, plain Newton in the displacements.
    Displacement,
    /// $U(J)$ at each point, the pressure at each point an iterate of Newton. Same solution as
    /// [`Displacement`](PressureField::Displacement) in far fewer steps.
    Pointwise,
    /// $U(\bar J)$ with $G(\bar J)$ the projection of $G(J)$ on constants in each cluster; see [`Body`].
    Constant,
    /// $U(\bar J)$ with $G(\bar J)$ the projection of $G(J)$ on linear functions in each cluster.
    Linear,
}

/// Which measure of the volume is projected on the zones of pressure; see [`Body`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum ProjectedMeasure {
    /// A root of $J$ that goes over to $J$ in zones under tension. Coarse models stay stable whether pressed, bent or pulled.
    ///
    /// The exponent is set beside Newton's iteration and is no variable of the energy: beyond tensions of 0.8 shear moduli work
    /// and energy differ (by 1.3e-4 for a bonded pad pulled by a tenth), and a state depends as much on the way to it.
    #[default]
    Adapted,
    /// $J$ itself, with the stabilisation $sk = \mu_0$: forces, tangent and energy derive from one potential, so that work is energy
    /// and a state does not depend on how it was reached.
    ///
    /// Coarse models are less stable: of 48 drawn blocks that were bent hard 6 ended in unstable states, 2 with
    /// [`Adapted`](ProjectedMeasure::Adapted), and strips of few particles stretched to three times their length are a quarter
    /// further off.
    Jacobian,
}

/// The elastic energy of a body over a table, $\Pi = \int W(F)\\,\mathrm d\Omega$ (4.4).
///
/// With projected pressures, $W = \bar W(F) + (1-s)\\,U(\bar J) + s\\,U(J)$, where $G(\bar J) = \varphi^T\theta$ is the
/// $L_2$ projection of a measure $G(J)$ of the volume on the zone functions $\varphi$; $\theta$ and $\pi$
/// ($p = G'\varphi^T\pi$) are unknowns of Newton's method, condensed before assembly. With orthonormal $\varphi$,
/// $\hat U(G(J)) = U(J)$, $C = \int\varphi\\,\partial G/\partial d$ and $H = \int\varphi\\,(1-s)\hat U''\varphi^T$ the
/// condensed system is
/// $$\Big[K_{dev} + \int \varphi^T\pi\\,\partial^2_{dd}G + C^T H C\Big]\delta d = -\big(f + C^T(r_\theta + H r_\pi)\big).$$
///
/// The measure is $G = m\\,(J^{1/m} - 1) + 1$ with $m$ the number of directions in which the kinematics moves (2 in
/// plane strain and cylinders, 3 in bodies of revolution and spheres; 2 in solids, where 3 would let the mean volume
/// of a zone drift by a third more). The projection does not resist changes of volume inside a zone that are neither
/// constant nor linear. Under compression the geometric stiffness $p\\,\partial^2J$ of $G = J$ destabilises them, and bodies
/// wrinkle inside their macro cells. $J^{1/m}$ is linear in a uniform stretch of $m$ directions: this stiffness vanishes,
/// whatever the pressure. Under tension the root destabilises a stretch in one direction instead, by
/// $-p\\,(1 - \tfrac1m)\\,(\delta J)^2$: beyond 3 to 4 $\mu_0$ bonded bodies show cavitation-like modes inside their macro cells.
/// The exponent $q$ of $G = 1 + (J^q - 1)/q$ therefore rises from $1/m$ to 1, in sixteen parts, while the mean pressure of the
/// zone rises from 0.8 to 1.6 of $\mu_0 + \sigma$, with the von Mises stress $\sigma$ of the zone. In membranes and threads the
/// pressure comes from their stretch, and the root stays. It is a condensed unknown that [`advance`](Term::advance) sets by the pressure and everything else takes
/// as given: forces and matrix are those of the potential with it.
pub struct Body<const D: usize, M> {
    pub(super) table: ShapeTable<D>,
    pub(super) material: M,
    pub(super) field: PressureField,
    pub(super) functions: usize,
    phi: Vec<f64>,
    stabilisation: f64,
    /// Points of the smallest zone where the stabilisation grows with the points of a zone; else 0.
    fewest: usize,
    /// A zone on which no functions are orthonormal, and the square norm of one that is not positive.
    unsuited: Option<f64>,
    /// Initial shear modulus where the measure follows the pressure, else 0.
    shear: f64,
    measure: VolumetricMeasure,
    projected: ProjectedMeasure,
    /// Numbers that a point remembers.
    pub(super) remembered: usize,
    /// Time by the load factor.
    pub(super) clock: Option<Amplitude>,
}

impl<const D: usize, M: Material> Body<D, M> {
    /// A body with the given treatment of the volumetric energy; a material that can't be split
    /// runs in [`PressureField::Displacement`].
    ///
    /// Zones are the clusters of the table. Projected fields keep a stabilisation $s$ of the volumetric energy pointwise, at most
    /// a tenth: $sk = \tfrac23\mu_0$, the bulk modulus of a body with Poisson's ratio zero, whose directions do
    /// not feel each other; $sk = \mu_0$ in solids. Zones with more points than the smallest, as odd numbers of cells and
    /// scattered particles make them, keep more of it, up to half as much again: they hold more changes of volume that no
    /// pressure sees.
    pub fn new(table: ShapeTable<D>, material: M, field: PressureField) -> Self {
        Body::projecting(table, material, field, ProjectedMeasure::Adapted)
    }

    /// As [`new`](Body::new) with the measure of volume that projected fields project.
    pub fn projecting(table: ShapeTable<D>, material: M, field: PressureField, measure: ProjectedMeasure) -> Self {
        let adapted = measure == ProjectedMeasure::Adapted;
        let stabilisation = match field {
            PressureField::Constant | PressureField::Linear => {
                pointwise_share(&material, if adapted && D < 3 { 2.0 / 3.0 } else { 1.0 })
            }
            _ => 0.0,
        };
        let mut body = Body::zonal(table, material, field, stabilisation);
        if body.functions > 0 {
            let clusters = body.table.clusters();
            body.fewest = (0..clusters.len()).map(|zone| clusters.points(zone).len()).min().unwrap_or(0);
            if adapted {
                let roots = if D == 3 { 2 } else { D + body.table.hoop_components().len() };
                body.measure = VolumetricMeasure::roots(roots);
                body.shear = crate::material::initial_shear_modulus(&body.material);
            }
        }
        body.projected = measure;
        body
    }

    /// As [`new`](Body::new) with $J$ itself projected, $G = J$, and the pointwise stabilisation $s \in [0, 1)$ of the volumetric
    /// energy given: the mixed finite elements of the literature with $s = 0$.
    ///
    /// With $J$ projected a pressed ring converged to states with negative eigenvalues for $sk \le \mu_0/2$; with the
    /// measure of [`new`](Body::new) it needs no pointwise part at all. Homogeneous states do not depend on $s$.
    pub fn zonal(table: ShapeTable<D>, material: M, field: PressureField, stabilisation: f64) -> Self {
        let field = if material.split().is_some() { field } else { PressureField::Displacement };
        let remembered = material.memory().map_or(0, |memory| memory.len());
        let mut body = Body {
            remembered,
            clock: None,
            table,
            material,
            field,
            functions: 0,
            phi: Vec::new(),
            stabilisation,
            fewest: 0,
            unsuited: None,
            shear: 0.0,
            measure: VolumetricMeasure::Volume,
            projected: ProjectedMeasure::Jacobian,
        };
        match field {
            PressureField::Constant => body.tabulate_zone_functions(1),
            PressureField::Linear => body.tabulate_zone_functions(D + 1),
            _ => body.stabilisation = 0.0,
        }
        body
    }

    /// The same with a clock: time as a function of the load factor, not falling. A law that relaxes does so by it; without one
    /// every step is sudden.
    pub fn with_clock(mut self, clock: Amplitude) -> Self {
        self.clock = Some(clock);
        self
    }

    /// Whether it takes time.
    #[cfg(feature = "solve")]
    pub(crate) fn has_clock(&self) -> bool {
        self.clock.is_some()
    }

    /// Condensed unknowns of all clusters.
    pub(super) fn unknowns(&self) -> usize {
        self.table.clusters().len().checked_sub(1).map_or(0, |last| self.condensed(last).end)
    }

    /// Points of the smallest zone where the stabilisation grows with the points of a zone; else 0.
    #[cfg(feature = "solve")]
    pub(crate) fn fewest(&self) -> usize {
        self.fewest
    }

    /// Takes the points of the smallest zone of a whole body of which this is a part.
    #[cfg(feature = "solve")]
    pub(crate) fn with_fewest(mut self, fewest: usize) -> Self {
        self.fewest = fewest;
        self
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

    /// The measure of volume that projected fields project.
    pub fn projected_measure(&self) -> ProjectedMeasure {
        self.projected
    }

    /// The hydrostatic pressures $p = U'$ (2.15) \[stress\] at the points of the table, positive in tension;
    /// those of the zones where pressures are projected. `None` for a material that can't be split, and for a state of
    /// another model.
    pub fn pressures(&self, view: View<'_>) -> Option<Vec<f64>> {
        let (_, volumetric) = self.material.split()?;
        let condensed = self.memory_range().end.max(self.unknowns());
        if view.displacement.len() != self.table.node_count() * D || view.condensed.len() != condensed {
            return None;
        }
        let pointwise = |point| volumetric.evaluate(self.deformation_gradient(point, view.displacement).determinant());
        let mut pressures = Vec::with_capacity(self.table.len());
        for cluster in 0..self.table.clusters().len() {
            for point in self.table.clusters().points(cluster) {
                pressures.push(match self.field {
                    PressureField::Displacement => pointwise(point).slope,
                    PressureField::Pointwise => view.condensed[2 * point + 1],
                    PressureField::Constant | PressureField::Linear => {
                        let (_, pi, measure) = self.zone(cluster, view.condensed);
                        let projected: f64 = self.phi(point).iter().zip(pi).map(|(p, pi)| p * pi).sum();
                        let j = self.deformation_gradient(point, view.displacement).determinant();
                        projected * measure.of(j).slope + self.stabilisation(cluster) * volumetric.evaluate(j).slope
                    }
                });
            }
        }
        Some(pressures)
    }

    /// How the pressures at the points of the table change with a small step of the displacement and of the condensed
    /// unknowns.
    #[cfg(feature = "solve")]
    pub(crate) fn pressure_changes(&self, view: View<'_>, step: &[f64], condensed_step: &[f64]) -> Option<Vec<f64>> {
        let (_, volumetric) = self.material.split()?;
        let mut changes = Vec::with_capacity(self.table.len());
        for cluster in 0..self.table.clusters().len() {
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
                        let pi = &condensed_step[self.condensed(cluster)][self.functions..2 * self.functions];
                        let projected: f64 = self.phi(point).iter().zip(pi).map(|(p, pi)| p * pi).sum();
                        projected * measure.of(f.determinant()).slope
                    }
                });
            }
        }
        Some(changes)
    }

    /// Condensed unknowns that belong to a field of hydrostatic pressures $p(X)$ \[stress\], term by term as
    /// [`Term::condensed`] counts them: the projections of the part of $p$ that zones carry, as the
    /// derivative by what they project ($J$ or its root), and of that at the $J$ with $U'(J) = p$.
    ///
    /// A first guess for a state whose pressures are known from another model; empty where pressures are no
    /// unknowns.
    pub fn condensed_of(&self, pressure: impl Fn(&Point<D>) -> f64) -> Vec<f64> {
        let clusters = self.table.clusters();
        let total = clusters.len().checked_sub(1).map_or(0, |last| self.condensed(last).end);
        let mut condensed = vec![0.0; total];
        let Some((_, volumetric)) = self.material.split() else { return condensed };
        if total == 0 {
            return condensed;
        }
        for cluster in 0..clusters.len() {
            let range = self.condensed(cluster);
            let mut measure = self.measure;
            if self.functions > 0 {
                let (mut sum, mut volume) = (0.0, 0.0);
                for point in clusters.points(cluster) {
                    let weight = self.table.weights()[point];
                    (sum, volume) = (sum + weight * pressure(&self.table.positions()[point]), volume + weight);
                }
                let pulled = self.pulled(cluster, sum / volume, None, 0.0);
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
                    let (theta, pi) = condensed[range.clone()].split_at_mut(self.functions);
                    let weight = self.table.weights()[point];
                    for (k, phi) in self.phi(point).iter().enumerate() {
                        theta[k] += weight * phi * measure.value;
                        pi[k] += weight * phi * (1.0 - self.stabilisation(cluster)) * p / measure.slope;
                    }
                } else {
                    condensed[2 * point..2 * point + 2].copy_from_slice(&[j, p]);
                }
            }
        }
        condensed
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

    /// Values of the orthonormal zone functions $\varphi_k$ of the point's cluster, $\int\varphi_k\varphi_l = \delta_{kl}$;
    /// empty where pressures are not projected. A cluster of too few points has zeros in place of the last ones.
    pub fn zone_functions(&self, point: usize) -> &[f64] {
        self.phi(point)
    }

    /// The unknowns of a zone: coefficients of $\bar G$ and of its conjugate, and the measure it has by the last one.
    #[inline(always)]
    pub(super) fn zone<'a>(&self, cluster: usize, condensed: &'a [f64]) -> (&'a [f64], &'a [f64], VolumetricMeasure) {
        let n = self.functions;
        if n == 0 {
            return (&[], &[], self.measure);
        }
        let all = &condensed[self.condensed(cluster)];
        (&all[..n], &all[n..2 * n], self.measure.towards_volume(all[2 * n] * self.unit(cluster)))
    }

    /// The constant zone function: the last condensed unknown is counted in its inverse, so that it is of the size of the first,
    /// whatever the unit of length.
    #[inline(always)]
    pub(super) fn unit(&self, cluster: usize) -> f64 {
        self.table.clusters().points(cluster).next().map_or(0.0, |point| self.phi(point)[0])
    }

    /// The last condensed unknown of a zone that has `held` under a mean pressure: how far it is on the way from roots of $J$
    /// to $J$. Without a displacement the stresses of shape are taken for none.
    #[inline(always)]
    pub(super) fn pulled(&self, cluster: usize, pressure: f64, displacement: Option<&[f64]>, held: f64) -> f64 {
        let [from, to] = TENSION_BLEND;
        let unit = self.unit(cluster);
        // Without a shear modulus nothing is known; a zone without a volume has no pressure.
        if !(self.shear > 0.0 && unit > 0.0 && (pressure > from * self.shear || held != 0.0)) {
            return 0.0;
        }
        let scale = self.shear + displacement.map_or(0.0, |d| self.shape_stress(cluster, d)).max(0.0);
        let x = ((pressure - from * scale) / ((to - from) * scale)).clamp(0.0, 1.0);
        let (wanted, held_part) = (PARTS * x * x * (3.0 - 2.0 * x), PARTS * held * unit);
        // What was predicted from two states, or gone by a part of a step, may lie between.
        let whole = (held_part - held_part.round()).abs() < 1e-6;
        if whole && (wanted - held_part).abs() <= KEPT { held } else { wanted.round() / (PARTS * unit) }
    }

    /// The mean of von Mises' stress, of the distortional energy per volume at rest, over a zone.
    #[inline(never)]
    fn shape_stress(&self, cluster: usize, displacement: &[f64]) -> f64 {
        let Some((distortional, _)) = self.material.split() else { return 0.0 };
        const ALL: [usize; 9] = [0, 1, 2, 3, 4, 5, 6, 7, 8];
        let (mut sum, mut volume) = (0.0, 0.0);
        for point in self.table.clusters().points(cluster) {
            let f = self.deformation_gradient(point, displacement);
            let mut stress = [0.0; 9];
            distortional.respond(&f, &ALL, &mut stress, &mut []);
            let kirchhoff = Matrix3::from_row_slice(&stress) * f.transpose();
            let deviator = kirchhoff - Matrix3::identity() * (kirchhoff.trace() / 3.0);
            let weight = self.table.weights()[point];
            (sum, volume) = (sum + weight * (1.5 * deviator.norm_squared()).sqrt(), volume + weight);
        }
        sum / volume
    }

    /// The initial shear modulus.
    pub(super) fn shear(&self) -> f64 {
        if self.shear > 0.0 { self.shear } else { crate::material::initial_shear_modulus(&self.material) }
    }

    /// The part of the volumetric energy of a zone that stays pointwise.
    #[inline(always)]
    pub(super) fn stabilisation(&self, cluster: usize) -> f64 {
        if self.fewest == 0 {
            return self.stabilisation;
        }
        let points = self.table.clusters().points(cluster).len();
        (self.stabilisation * (points as f64 / self.fewest as f64).min(WIDEST)).min(POINTWISE_SHARE)
    }

    #[inline(always)]
    pub(super) fn phi(&self, point: usize) -> &[f64] {
        &self.phi[point * self.functions..(point + 1) * self.functions]
    }

    /// The deformation gradient $F$ at a point of the table; NaN where there is no such point, or the displacement is too
    /// short.
    pub fn deformation_gradient(&self, point: usize, displacement: &[f64]) -> Matrix3<f64> {
        self.material.deformation(&self.local_gradient(point, displacement))
    }

    /// The same as the kinematics alone moves it.
    pub(super) fn local_gradient(&self, point: usize, displacement: &[f64]) -> Matrix3<f64> {
        self.table.at_rest(point) + self.table.displacement_gradient(point, displacement)
    }

    /// The energy of a body without condensed unknowns at a state: projected where the field is.
    fn zone_energy(&self, cluster: usize, view: View<'_>) -> f64 {
        let d = view.displacement;
        let recall = self.recall(view);
        let recall = recall.as_ref();
        let Some((distortional, volumetric)) = self.material.split() else {
            let energy = |p| self.shape_energy(recall, &self.material, p, &self.local_gradient(p, d));
            return self.table.clusters().points(cluster).map(|p| self.table.weights()[p] * energy(p)).sum();
        };
        let n = self.functions;
        let (_, _, measure) = self.zone(cluster, view.condensed);
        let mut theta = [0.0; 4];
        let mut energy = 0.0;
        for point in self.table.clusters().points(cluster) {
            let f = self.deformation_gradient(point, d);
            let weight = self.table.weights()[point];
            let j = f.determinant();
            energy += weight * self.shape_energy(recall, distortional, point, &f);
            let pointwise = if self.functions > 0 { self.stabilisation(cluster) } else { 1.0 };
            energy += weight * pointwise * volumetric.evaluate(j).energy;
            let value = measure.of(j).value;
            for (t, phi) in theta.iter_mut().zip(self.phi(point)) {
                *t += weight * phi * value;
            }
        }
        if n > 0 {
            for point in self.table.clusters().points(cluster) {
                let projected: f64 = self.phi(point).iter().zip(&theta).map(|(p, t)| p * t).sum();
                energy += self.table.weights()[point]
                    * (1.0 - self.stabilisation(cluster))
                    * measure.energy(volumetric, projected).energy;
            }
        }
        energy
    }
}

/// The stabilisation $s$ of a material that can be split, so that $sk$ is a part of $\mu_0$, else 0; see [`Body::new`].
fn pointwise_share(material: &impl Material, of_shear: f64) -> f64 {
    let Some((_, volumetric)) = material.split() else { return 0.0 };
    let shear = crate::material::initial_shear_modulus(material);
    let bulk = volumetric.evaluate(1.0).curvature;
    let kept = of_shear * shear;
    if bulk > 0.0 && kept >= 0.0 { (kept / bulk).min(POINTWISE_SHARE) } else { 0.0 }
}

impl<const D: usize, M: Material> Term<D> for Body<D, M> {
    fn clusters(&self) -> usize {
        self.table.clusters().len()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        self.table.clusters().nodes(cluster)
    }

    fn validate(&self) -> Result<(), SolveError> {
        let Some(value) = self.unsuited else { return Ok(()) };
        let needed = "pressures of zones need weights that add up to more than nothing in each zone: give positive ones, \
                      or take PressureField::Pointwise";
        Err(SolveError::Setting { what: "square norm of a pressure function over a zone", value, needed })
    }

    fn condensed(&self, cluster: usize) -> std::ops::Range<usize> {
        match self.field {
            PressureField::Displacement => 0..0,
            PressureField::Pointwise => {
                let points = self.table.clusters().points(cluster);
                2 * points.start..2 * points.end
            }
            // θ, π and the exponent.
            _ => {
                let each = 2 * self.functions + 1;
                each * cluster..each * (cluster + 1)
            }
        }
    }

    fn start(&self, cluster: usize, condensed: &mut [f64]) {
        match self.field {
            PressureField::Displacement => {}
            PressureField::Pointwise => {
                for pair in condensed.chunks_exact_mut(2) {
                    pair.copy_from_slice(&[1.0, 0.0]);
                }
            }
            _ => {
                condensed.fill(0.0);
                for point in self.table.clusters().points(cluster) {
                    let weight = self.table.weights()[point];
                    for (theta, phi) in condensed.iter_mut().zip(self.phi(point)) {
                        *theta += weight * phi;
                    }
                }
            }
        }
    }

    fn matrix_follows_load(&self) -> bool {
        self.is_timed()
    }

    fn break_points(&self) -> Vec<f64> {
        self.clock.as_ref().filter(|_| self.is_timed()).map_or_else(Vec::new, Amplitude::break_points)
    }

    fn memory(&self) -> std::ops::Range<usize> {
        self.memory_range()
    }

    fn start_memory(&self, memory: &mut [f64]) {
        self.start_of_memory(memory);
    }

    fn remember(&self, view: View<'_>, next: &mut [f64]) {
        self.remember_all(view, next);
    }

    fn is_timed(&self) -> bool {
        self.remembered > 0 && self.clock.is_some()
    }

    fn time_error(&self, before: Option<&[f64]>, view: View<'_>, next: &[f64]) -> [f64; 2] {
        self.error_of_time(before, view, next)
    }

    fn fills_lower_blocks(&self) -> bool {
        true
    }

    fn separates(&self) -> bool {
        D == 3 && self.table.gradient_components() == 3 && self.functions > 0
    }

    fn multiply(&self, zone: &Zone, x: &[f64], product: &mut Product) {
        self.multiply_zone(zone, x, product);
    }

    fn take_pressures(&self, _cluster: usize, pressures: &[f64; 4], condensed_step: &mut [f64]) {
        let n = self.functions;
        condensed_step[n..2 * n].copy_from_slice(&pressures[..n]);
    }

    fn couplings(&self, cluster: usize, visit: &mut dyn FnMut(&[u16])) {
        let clusters = self.table.clusters();
        let mut last: &[u16] = &[];
        for point in clusters.points(cluster) {
            let nodes = clusters.local(point);
            if nodes != last {
                visit(nodes);
                last = nodes;
            }
        }
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        self.linearize_cluster(cluster, view, out);
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        self.advance_cluster(cluster, view, step, condensed_step)
    }

    fn energy(&self, cluster: usize, view: View<'_>) -> f64 {
        self.zone_energy(cluster, view)
    }

    fn largest_gradient(&self, cluster: usize, displacement: &[f64]) -> f64 {
        let points = self.table.clusters().points(cluster);
        points.map(|p| self.table.displacement_gradient(p, displacement).norm()).fold(0.0, f64::max)
    }

    fn smallest_jacobian(&self, cluster: usize, view: View<'_>) -> Option<(f64, Vec<f64>)> {
        self.table
            .clusters()
            .points(cluster)
            .map(|point| {
                (jacobian(&self.deformation_gradient(point, view.displacement), self.table.hoop_components()), point)
            })
            // A NaN counts as the smallest of all.
            .min_by(|a, b| if a.0.is_nan() { std::cmp::Ordering::Less } else { a.0.total_cmp(&b.0) })
            .map(|(j, point)| (j, self.table.positions()[point].as_slice().to_vec()))
    }

    fn diagnostics(&self, cluster: usize, view: View<'_>) -> StateDiagnostics {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let (mut volume, mut mean, mut pointwise) = (0.0, 0.0, 0.0);
        let volumetric = self.material.split().map(|(_, volumetric)| volumetric).filter(|_| self.functions == 0);
        for point in self.table.clusters().points(cluster) {
            let j = self.deformation_gradient(point, view.displacement).determinant();
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
