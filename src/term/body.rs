//! The body: distortional energy at points, volumetric energy at points or projected on zones.

use std::sync::Arc;

use crate::geometry::Mat3;
use crate::material::{FreeThickness, Material, Past};
use crate::table::ShapeTable;

use super::Term;
use super::pressure_field::{PressureField, ProjectedMeasure};
use super::stabilisation::{Kept, POINTWISE_SHARE, PointwiseEnergy, WIDEST, pointwise_share};
use super::volumetric_measure::VolumetricMeasure;

/// The elastic energy of a body over a table, $\Pi = \int W(F)\\,\mathrm d\Omega$ (4.4).
///
/// With projected pressures, $W = \bar W(F) + R(\bar J) + s\\,h(J)$, $R = U - s\\,h$, where $G(\bar J) = \varphi^T\theta$ is the
/// $L_2$ projection of a measure $G(J)$ of the volume on the zone functions $\varphi$; $\theta$ and $\pi$
/// ($p = G'\varphi^T\pi$) are unknowns of Newton's method, condensed before assembly. With orthonormal $\varphi$,
/// $\hat R(G(J)) = R(J)$, $C = \int\varphi\\,\partial G/\partial d$ and $H = \int\varphi\\,\hat R''\varphi^T$ the
/// condensed system is
/// $$\Big[K_{dev} + \int \varphi^T\pi\\,\partial^2_{dd}G + C^T H C\Big]\delta d = -\big(f + C^T(r_\theta + H r_\pi)\big).$$
///
/// What stays pointwise, $h = k\\,(J^5 + J^{-5} - 2)/50$, has the curvature of $U$ at $J = 1$ and grows fast away from it: with $U$ itself a
/// point could lose most of its volume for an energy of the size of $\mu_0$, and bodies folded inside their zones. Where $s\\,h''$
/// reaches half of $U''$ it stays there, so that $R$ is convex for every ratio of the moduli. $h$ enters Newton's method as
/// [`PressureField::Pointwise`] does: $J$ and the pressure of each point are condensed unknowns too. In a viscoelastic body the
/// pressures $s\\,h'(J)$ and $s\\,h'(\\bar J)$, the latter in $R$, relax by the series of the material.
///
/// The measure is $G = m\\,(J^{1/m} - 1) + 1$ with $m$ the number of directions in which the kinematics moves (2 in
/// plane strain and cylinders, 3 in bodies of revolution and spheres; 2 in solids, where 3 would let the mean volume
/// of a zone drift by a third more). The projection does not resist changes of volume inside a zone that are neither
/// constant nor linear. Under compression the geometric stiffness $p\\,\partial^2J$ of $G = J$ destabilises them, and bodies
/// wrinkle inside their macro cells. $J^{1/m}$ is linear in a uniform stretch of $m$ directions: this stiffness vanishes,
/// whatever the pressure. Under tension the root destabilises a stretch in one direction instead, by
/// $-p\\,(1 - \tfrac1m)\\,(\delta J)^2$: beyond 3 to 4 $\mu_0$ bonded bodies show cavitation-like modes inside their macro cells.
/// The exponent $q$ of $G = 1 + (J^q - 1)/q$ therefore rises from $1/m$ to 1, in sixteen parts, while the mean pressure of the
/// zone rises from 0.8 to 1.6 of $\mu_0$. It is a condensed unknown that [`advance`](super::Term::advance)
/// sets by the pressure and everything else takes as given: forces and matrix are those of the potential with it.
pub struct Body<const D: usize> {
    pub(super) table: ShapeTable<D>,
    /// As it was given.
    law: Arc<dyn Material>,
    /// The law as the kinematics moves it: in a sheet with the thickness free.
    pub(super) material: Arc<dyn Material>,
    pub(super) field: PressureField,
    pub(super) functions: usize,
    pub(super) phi: Vec<f64>,
    pub(super) stabilisation: f64,
    /// What the stabilisation multiplies.
    pub(super) pointwise: Option<PointwiseEnergy>,
    /// Points of the smallest zone where the stabilisation grows with the points of a zone; else 0.
    pub(crate) fewest: usize,
    /// A zone on which no functions are orthonormal, and the square norm of one that is not positive.
    pub(super) unsuited: Option<f64>,
    /// Whether its matrix goes without what the condensed pressures of zones add.
    pub(super) apart: bool,
    /// Initial shear modulus where the measure follows the pressure, else 0.
    pub(super) shear: f64,
    pub(super) measure: VolumetricMeasure,
    pub(super) projected: ProjectedMeasure,
    /// What is remembered of a point at rest: by the material, then of what stays pointwise where that relaxes.
    pub(super) rest: Vec<f64>,
}

impl<const D: usize> Body<D> {
    /// A body with the given treatment of the volumetric energy; a material that can't be split
    /// runs in [`PressureField::Displacement`], and so does a sheet in plane stress, whose thickness settles for any material.
    ///
    /// Zones are the clusters of the table. Projected fields keep a stabilisation $s$ of the volumetric energy pointwise, at most
    /// a tenth: $sk = \tfrac23\mu_0$, the bulk modulus of a body with Poisson's ratio zero, whose directions do
    /// not feel each other; $sk = \mu_0$ in solids. Zones with more points than the smallest, as odd numbers of cells and
    /// scattered particles make them, keep more of it, up to half as much again: they hold more changes of volume that no
    /// pressure sees.
    pub fn new(table: ShapeTable<D>, material: impl Material + 'static, field: PressureField) -> Self {
        Body::projecting(table, Arc::new(material), field, ProjectedMeasure::Adapted)
    }

    /// As [`new`](Body::new) with the measure of volume that projected fields project.
    pub(crate) fn projecting(
        table: ShapeTable<D>,
        law: Arc<dyn Material>,
        field: PressureField,
        measure: ProjectedMeasure,
    ) -> Self {
        let adapted = measure == ProjectedMeasure::Adapted;
        let stabilisation = match field {
            PressureField::Constant | PressureField::Linear => {
                pointwise_share(&law, if adapted && D < 3 { 2.0 / 3.0 } else { 1.0 })
            }
            _ => 0.0,
        };
        let mut body = Body::sharing(table, law, field, stabilisation);
        if body.functions > 0 {
            let clusters = body.table.clusters();
            body.fewest = (0..clusters.count()).map(|zone| clusters.points(zone).len()).min().unwrap_or(0);
            body.pointwise_up_to((WIDEST * stabilisation).min(POINTWISE_SHARE));
            if adapted {
                let roots = if D == 3 { 2 } else { D + body.table.hoop_components().len() };
                body.measure = VolumetricMeasure::roots(roots);
                body.shear = body.material.initial_moduli().shear;
            }
        }
        body.projected = measure;
        body
    }

    /// As [`new`](Body::new) with $J$ itself projected, $G = J$, and the pointwise stabilisation $s \in [0, 1)$ given: the mixed finite
    /// elements of the literature with $s = 0$.
    ///
    /// With $J$ projected a pressed ring converged to states with negative eigenvalues for $sk \le \mu_0/2$; with the
    /// measure of [`new`](Body::new) it needs no pointwise part at all. Homogeneous states do not depend on $s$.
    pub(crate) fn zonal(
        table: ShapeTable<D>,
        material: impl Material + 'static,
        field: PressureField,
        stabilisation: f64,
    ) -> Self {
        Body::sharing(table, Arc::new(material), field, stabilisation)
    }

    /// The same with a material that others use too.
    fn sharing(table: ShapeTable<D>, law: Arc<dyn Material>, field: PressureField, stabilisation: f64) -> Self {
        let material: Arc<dyn Material> =
            if table.is_plane_stress() { Arc::new(FreeThickness(law.clone())) } else { law.clone() };
        let field = if material.volumetric().is_some() { field } else { PressureField::Displacement };
        let mut body = Body {
            rest: material.rest(),
            table,
            law,
            material,
            field,
            functions: 0,
            phi: Vec::new(),
            stabilisation,
            pointwise: None,
            fewest: 0,
            unsuited: None,
            apart: false,
            shear: 0.0,
            measure: VolumetricMeasure::Volume,
            projected: ProjectedMeasure::Jacobian,
        };
        match field {
            PressureField::Constant => body.tabulate_zone_functions(1, None),
            PressureField::Linear => body.tabulate_zone_functions(D + 1, None),
            _ => body.stabilisation = 0.0,
        }
        body.pointwise_up_to(body.stabilisation);
        body
    }

    /// Sets the energy that stays pointwise, for zones that keep no more than a share of it.
    fn pointwise_up_to(&mut self, share: f64) {
        let volumetric = self.material.volumetric().filter(|_| share > 0.0);
        self.pointwise = volumetric.map(|volumetric| PointwiseEnergy::new(volumetric, share));
        let of_volume = self.pointwise.as_ref().and(self.material.relaxation()).map_or(0, Kept::memory);
        self.rest.resize(self.material.memory() + of_volume, 0.0);
    }

    /// The same with linear pressures that vary along the columns of a matrix per zone alone.
    pub(crate) fn varying_along(mut self, directions: &[nalgebra::SMatrix<f64, D, D>]) -> Self {
        if self.functions == D + 1 && directions.len() == self.table.clusters().count() {
            self.tabulate_zone_functions(D + 1, Some(directions));
        }
        self
    }

    /// The same body over another table with the same points and clusters.
    pub(crate) fn over(&self, table: ShapeTable<D>) -> Self {
        let (law, material, rest) = (self.law.clone(), self.material.clone(), self.rest.clone());
        Body { table, law, material, rest, phi: self.phi.clone(), ..*self }
    }

    /// The same with a matrix that goes without what the condensed pressures of zones add: only nodes that share a point are coupled.
    pub(crate) fn apart(self) -> Self {
        Body { apart: true, ..self }
    }

    /// Whether pressures of its zones can be kept as unknowns beside a matrix that stays at the points.
    pub(super) fn separates(&self) -> bool {
        D == 3 && self.table.gradient_components() == 3 && self.functions > 0
    }

    /// Condensed unknowns of all clusters.
    pub(super) fn condensed_count(&self) -> usize {
        self.table.clusters().count().checked_sub(1).map_or(0, |last| self.unknowns(last).end)
    }

    /// The table.
    pub fn table(&self) -> &ShapeTable<D> {
        &self.table
    }

    /// The law that it was made of.
    pub(crate) fn law(&self) -> &Arc<dyn Material> {
        &self.law
    }

    /// The material: the law, in a sheet with its thickness free.
    pub(crate) fn material(&self) -> &Arc<dyn Material> {
        &self.material
    }

    /// How the volumetric energy is treated; `Displacement` where the material could not be split.
    pub fn field(&self) -> PressureField {
        self.field
    }

    /// The measure of volume that projected fields project.
    pub(crate) fn projected_measure(&self) -> ProjectedMeasure {
        self.projected
    }

    /// The initial shear modulus.
    pub(super) fn shear(&self) -> f64 {
        if self.shear > 0.0 { self.shear } else { self.material.initial_moduli().shear }
    }

    /// The deformation gradient $F$ at a point of the table; NaN where there is no such point, or the displacement is too
    /// short.
    pub(crate) fn deformation_gradient(&self, point: usize, displacement: &[f64]) -> Mat3 {
        let rest = Past { memory: &self.rest[..self.material.memory()], elapsed: 0.0 };
        self.material.settled(&self.local_gradient(point, displacement), rest)
    }

    /// The same as the kinematics alone moves it.
    pub(super) fn local_gradient(&self, point: usize, displacement: &[f64]) -> Mat3 {
        self.table.at_rest(point) + self.table.displacement_gradient(point, displacement)
    }
}
