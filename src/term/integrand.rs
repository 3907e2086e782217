//! Integrands: what is summed over the points of a table.

use std::sync::Arc;

use nalgebra::{SMatrix, SVector};

use crate::each::{Each, list_of};
use crate::error::SolveError;
use crate::geometry::{Mat3, Vec3, padded};
use crate::table::ShapeTable;
use crate::tensor::Tangent;

use super::step_limit::{largest_step, largest_step_of_hoops};
use super::{Amplitude, Element, ForceDensities, Layout, Term, TermStep, View};

/// What an integrand sees at a point; always three-dimensional.
#[derive(Debug, Clone, Copy)]
pub struct PointState {
    /// Reference position $X$ \[length\], padded by zeros.
    pub position: Vec3,
    /// Displacement $u$ \[length\], padded by zeros.
    pub displacement: Vec3,
    /// Deformation gradient $F$.
    pub deformation: Mat3,
    /// Outward unit normal $N$ of the reference body; zero inside it.
    pub normal: Vec3,
    /// Load factor $\lambda$.
    pub load: f64,
}

/// First and second derivatives of a density $\pi(F, u; \lambda)$, in the caller's buffer.
///
/// Loads that have no density (follower pressure) give the force that the virtual work asks for.
#[derive(Debug, Clone)]
pub struct PointDerivatives {
    /// Stored energy density.
    pub energy: f64,
    /// $P = \partial\pi/\partial F$.
    pub stress: Mat3,
    /// $\partial P/\partial F$.
    pub stress_by_gradient: Tangent,
    /// $\partial\pi/\partial u$: minus the external force.
    pub force: Vec3,
    /// $\partial\\,\text{force}/\partial F$, column $3k + L$.
    pub force_by_gradient: SMatrix<f64, 3, 9>,
    /// $\partial\\,\text{force}/\partial u$.
    pub force_by_displacement: Mat3,
    /// $\partial\\,\text{force}/\partial\lambda$.
    pub force_by_load: Vec3,
}

impl Default for PointDerivatives {
    fn default() -> Self {
        PointDerivatives {
            energy: 0.0,
            stress: Mat3::zeros(),
            stress_by_gradient: Tangent::zeros(),
            force: Vec3::zeros(),
            force_by_gradient: SMatrix::zeros(),
            force_by_displacement: Mat3::zeros(),
            force_by_load: Vec3::zeros(),
        }
    }
}

/// Which blocks of a [`PointDerivatives`] an integrand fills; the others are neither stored nor summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Sparsity {
    /// `stress` and `stress_by_gradient`.
    pub stress: bool,
    /// `force` and `force_by_load`.
    pub force: bool,
    /// `force_by_gradient`.
    pub force_by_gradient: bool,
    /// `force_by_displacement`.
    pub force_by_displacement: bool,
}

/// A density summed over points.
///
/// ```
/// use rkpm::term::{Sparsity, PointDerivatives, Integrand, PointState};
/// /// Springs that hold the body in place, ½ k |u|².
/// struct ElasticFoundation(f64);
/// impl Integrand for ElasticFoundation {
///     fn sparsity(&self) -> Sparsity {
///         Sparsity { force: true, force_by_displacement: true, ..Sparsity::default() }
///     }
///     fn evaluate(&self, at: &PointState, derivatives: &mut PointDerivatives) {
///         derivatives.energy = 0.5 * self.0 * at.displacement.norm_squared();
///         derivatives.force = at.displacement * self.0;
///         derivatives.force_by_displacement.fill_diagonal(self.0);
///     }
/// }
/// assert!(ElasticFoundation(1.0).is_symmetric());
/// ```
pub trait Integrand: Send + Sync {
    /// The blocks that [`evaluate`](Integrand::evaluate) fills.
    fn sparsity(&self) -> Sparsity;

    /// Fills the declared blocks of a zeroed derivatives.
    fn evaluate(&self, at: &PointState, derivatives: &mut PointDerivatives);

    /// Whether the second derivatives are symmetric.
    fn is_symmetric(&self) -> bool {
        true
    }

    /// Load factors inside $(0, 1)$ at which the forces have break points, see [`Term::break_points`].
    fn break_points(&self) -> Vec<f64> {
        Vec::new()
    }

    /// The amplitudes that it follows at a point, see [`Term::amplitudes`].
    fn amplitudes(&self, _at: &Vec3) -> Vec<Amplitude> {
        Vec::new()
    }

    /// Refuses what can't be meant, before an analysis begins; the default accepts all.
    ///
    /// # Errors
    /// What is wrong, and what to do.
    fn validate(&self) -> Result<(), SolveError> {
        Ok(())
    }

    /// Whether it reads the normal, as a pressure does: over points inside a body, which have none, it would be no
    /// load at all, and is refused.
    fn needs_normals(&self) -> bool {
        false
    }
}

/// An integrand over a table, as a term.
///
/// The integrand is called once per point through a pointer: loads of all kinds share one compiled term.
pub struct Pointwise<const D: usize> {
    table: ShapeTable<D>,
    integrand: Arc<dyn Integrand>,
    /// Whether the integrand finds the stretch across a sheet itself, which the table does not know.
    across: bool,
}

impl<const D: usize> Pointwise<D> {
    /// Sums `integrand` over the points of `table`.
    pub fn new(table: ShapeTable<D>, integrand: impl Integrand + 'static) -> Self {
        Pointwise { table, integrand: Arc::new(integrand), across: false }
    }

    /// Sums an integrand that others use too, and that finds the stretch across itself where the table is that of a sheet.
    pub(crate) fn shared(table: ShapeTable<D>, integrand: Arc<dyn Integrand>) -> Self {
        Pointwise { table, integrand, across: true }
    }

    fn state(&self, point: usize, view: &View<'_>) -> PointState {
        PointState {
            position: padded(&self.table.positions()[point]),
            displacement: padded(&self.table.displacement(point, view.displacement)),
            deformation: Mat3::identity() + self.table.displacement_gradient(point, view.displacement),
            normal: self.table.normals().get(point).map_or_else(Vec3::zeros, padded),
            load: view.load,
        }
    }
}

impl<const D: usize> Term for Pointwise<D> {
    fn dim(&self) -> usize {
        D
    }

    fn clusters(&self) -> usize {
        self.table.clusters().count()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        self.table.clusters().nodes(cluster)
    }

    fn layout(&self) -> Layout {
        let Sparsity { stress, force_by_gradient, force_by_displacement, .. } = self.integrand.sparsity();
        let has_matrix = stress || force_by_gradient || force_by_displacement;
        let nodes = Some(self.table.node_count());
        Layout { has_matrix, symmetric: self.integrand.is_symmetric(), nodes, ..Layout::default() }
    }

    fn break_points(&self) -> Vec<f64> {
        self.integrand.break_points()
    }

    fn amplitudes(&self) -> Vec<Amplitude> {
        let mut all: Vec<Amplitude> = Vec::new();
        for cluster in 0..self.clusters() {
            let Some(at) = self.table.clusters().points(cluster).next().map(|point| &self.table.positions()[point])
            else {
                continue;
            };
            for own in self.integrand.amplitudes(&padded(at)) {
                if !all.contains(&own) {
                    all.push(own);
                }
            }
        }
        all
    }

    fn validate(&self) -> Result<(), SolveError> {
        self.integrand.validate()?;
        if self.integrand.needs_normals() && self.table.normals().len() != self.table.point_count() {
            return Err(SolveError::Empty {
                what: "normals at the points of a pressure",
                remedy: "points inside a body have none: tabulate it over the points of a boundary (Cells::boundary)",
            });
        }
        ensure!(
            !self.integrand.sparsity().force || self.table.point_count() == 0 || self.table.has_values(),
            SolveError::Empty {
                what: "values in the table of a load",
                remedy: "smoothed tables hold gradients alone: tabulate the load's own points with ShapeTable::new",
            }
        );
        let Sparsity { stress, force_by_gradient, .. } = self.integrand.sparsity();
        ensure!(
            self.across || !self.table.is_plane_stress() || !(stress || force_by_gradient),
            SolveError::Empty {
                what: "stretch across the sheet for a load that reads F",
                remedy: "in plane stress it follows from the law, which a table does not know: give the load to a scene (Load::pressure, \
                         Load::integrand)",
            }
        );
        Ok(())
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        let (blocks, table) = (self.integrand.sparsity(), &self.table);
        let size = table.clusters().nodes(cluster).len() * D;
        for point in table.clusters().points(cluster) {
            let mut derivatives = PointDerivatives::default();
            self.integrand.evaluate(&self.state(point, &view), &mut derivatives);
            let (local, weight) = (table.clusters().local(point), table.weights()[point]);
            let (values, gradients, n) = (table.values(point), table.gradients(point), local.len());
            // Components of the gradient that component i of a node makes; the hoops belong to the first.
            let made = |a: usize, i: usize| {
                let hoops = table.hoop_components().iter().filter(move |_| i == 0);
                let hoops = hoops.map(move |&k| (4 * k, gradients[D * n + a]));
                (0..D).map(move |s| (3 * i + s, gradients[s * n + a])).chain(hoops)
            };
            for (a, &l) in local.iter().enumerate() {
                for i in 0..D {
                    let row = l as usize * D + i;
                    if let Some(value) = values.get(a).filter(|_| blocks.force) {
                        out.residual[row] += weight * value * derivatives.force[i];
                        out.load_slope[row] += weight * value * derivatives.force_by_load[i];
                    }
                    if blocks.stress {
                        let stress = |c: usize| derivatives.stress[(c / 3, c % 3)];
                        out.residual[row] += weight * made(a, i).map(|(c, g)| stress(c) * g).sum::<f64>();
                    }
                }
            }
            if !out.with_matrix {
                continue;
            }
            for (b, j) in (0..n).flat_map(|b| (0..D).map(move |j| (b, j))) {
                // The derivatives of force and stress by an unknown, by the chain rule through F and u.
                let (mut force, mut stress) = (Vec3::zeros(), SVector::<f64, 9>::zeros());
                for (c, g) in made(b, j) {
                    if blocks.force_by_gradient {
                        force += derivatives.force_by_gradient.column(c) * g;
                    }
                    if blocks.stress {
                        stress += derivatives.stress_by_gradient.column(c) * (weight * g);
                    }
                }
                // Forces act through values, which smoothed tables lack.
                if let Some(value) = values.get(b).filter(|_| blocks.force_by_displacement) {
                    force += derivatives.force_by_displacement.column(j) * *value;
                }
                force *= weight;
                let column = &mut out.matrix[(local[b] as usize * D + j) * size..][..size];
                for (a, &l) in local.iter().enumerate() {
                    for i in 0..D {
                        let mut sum = values.get(a).map_or(0.0, |value| value * force[i]);
                        if blocks.stress {
                            made(a, i).for_each(|(c, g)| sum += stress[c] * g);
                        }
                        column[l as usize * D + i] += sum;
                    }
                }
            }
        }
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: TermStep<'_>, _: &mut [f64]) -> f64 {
        if !self.integrand.sparsity().stress {
            return 1.0;
        }
        let mut bound: f64 = 1.0;
        for point in self.table.clusters().points(cluster) {
            let f = Mat3::identity() + self.table.displacement_gradient(point, view.displacement);
            let df = self.table.displacement_gradient(point, step.displacement);
            bound = bound.min(largest_step(&f, &df)).min(largest_step_of_hoops(&f, &df, self.table.hoop_components()));
        }
        bound
    }

    fn energy(&self, cluster: usize, view: View<'_>) -> f64 {
        self.table
            .clusters()
            .points(cluster)
            .map(|point| {
                let mut derivatives = PointDerivatives::default();
                self.integrand.evaluate(&self.state(point, &view), &mut derivatives);
                self.table.weights()[point] * derivatives.energy
            })
            .sum()
    }

    fn force_densities(&self, view: View<'_>) -> Option<ForceDensities> {
        if self.integrand.sparsity().stress {
            return None;
        }
        let force = |point| {
            let mut derivatives = PointDerivatives::default();
            self.integrand.evaluate(&self.state(point, &view), &mut derivatives);
            -derivatives.force
        };
        Some(ForceDensities {
            positions: self.table.positions().mapped(padded),
            normals: self.table.normals().mapped(padded),
            weights: self.table.weights().to_vec(),
            forces: list_of(self.table.point_count(), force),
        })
    }
}
