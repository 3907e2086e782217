//! Integrands: what is summed over the points of a table.

use std::sync::Arc;

use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::error::SolveError;
use crate::geometry::padded;
use crate::table::ShapeTable;
use crate::tensor::Tangent;

use super::point_contraction::{Contraction, reduce_stress, reduce_tangent};
use super::step_limit::{largest_step, largest_step_of_hoops};
use super::views::{Diagnostics, TermMatrix};
use super::{Amplitude, Element, ForceDensities, Term, View};

/// What an integrand sees at a point; always three-dimensional.
#[derive(Debug, Clone, Copy)]
pub struct PointState {
    /// Reference position $X$ \[length\], padded by zeros.
    pub position: Vector3<f64>,
    /// Displacement $u$ \[length\], padded by zeros.
    pub displacement: Vector3<f64>,
    /// Deformation gradient $F$.
    pub deformation: Matrix3<f64>,
    /// Outward unit normal $N$ of the reference body; zero inside it.
    pub normal: Vector3<f64>,
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
    pub stress: Matrix3<f64>,
    /// $\partial P/\partial F$.
    pub stress_by_gradient: Tangent,
    /// $\partial\pi/\partial u$: minus the external force.
    pub force: Vector3<f64>,
    /// $\partial\\,\text{force}/\partial F$, column $3k + L$.
    pub force_by_gradient: SMatrix<f64, 3, 9>,
    /// $\partial\\,\text{force}/\partial u$.
    pub force_by_displacement: Matrix3<f64>,
    /// $\partial\\,\text{force}/\partial\lambda$.
    pub force_by_load: Vector3<f64>,
}

impl Default for PointDerivatives {
    fn default() -> Self {
        PointDerivatives {
            energy: 0.0,
            stress: Matrix3::zeros(),
            stress_by_gradient: Tangent::zeros(),
            force: Vector3::zeros(),
            force_by_gradient: SMatrix::zeros(),
            force_by_displacement: Matrix3::zeros(),
            force_by_load: Vector3::zeros(),
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
    fn amplitudes(&self, _at: &Vector3<f64>) -> Vec<Amplitude> {
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
}

impl<const D: usize> Pointwise<D> {
    /// Sums `integrand` over the points of `table`.
    pub fn new(table: ShapeTable<D>, integrand: impl Integrand + 'static) -> Self {
        Pointwise::shared(table, Arc::new(integrand))
    }

    /// Sums an integrand that others use too.
    pub(crate) fn shared(table: ShapeTable<D>, integrand: Arc<dyn Integrand>) -> Self {
        Pointwise { table, integrand }
    }

    /// The table.
    pub fn table(&self) -> &ShapeTable<D> {
        &self.table
    }

    fn state(&self, point: usize, view: &View<'_>) -> PointState {
        PointState {
            position: padded(&self.table.positions()[point]),
            displacement: padded(&self.table.displacement(point, view.displacement)),
            deformation: Matrix3::identity() + self.table.displacement_gradient(point, view.displacement),
            normal: self.table.normals().get(point).map_or_else(Vector3::zeros, padded),
            load: view.load,
        }
    }
}

impl<const D: usize> Term for Pointwise<D> {
    fn dim(&self) -> usize {
        D
    }

    fn clusters(&self) -> usize {
        self.table.clusters().len()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        self.table.clusters().nodes(cluster)
    }

    fn matrix(&self) -> TermMatrix {
        let Sparsity { stress, force_by_gradient, force_by_displacement, .. } = self.integrand.sparsity();
        let exists = stress || force_by_gradient || force_by_displacement;
        TermMatrix { exists, symmetric: self.integrand.is_symmetric(), ..TermMatrix::default() }
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
        if self.integrand.needs_normals() && self.table.normals().len() != self.table.len() {
            return Err(SolveError::Empty {
                what: "normals at the points of a pressure",
                remedy: "points inside a body have none: tabulate it over the points of a boundary (Cells::boundary)",
            });
        }
        if self.integrand.sparsity().force && !self.table.is_empty() && !self.table.has_values() {
            return Err(SolveError::Empty {
                what: "values in the table of a load",
                remedy: "smoothed tables hold gradients alone: tabulate the load's own points with ShapeTable::new",
            });
        }
        Ok(())
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        let blocks = self.integrand.sparsity();
        let table = &self.table;
        let size = table.clusters().nodes(cluster).len() * D;
        let contraction = Contraction::of(table);
        for point in table.clusters().points(cluster) {
            let mut derivatives = PointDerivatives::default();
            self.integrand.evaluate(&self.state(point, &view), &mut derivatives);
            let weight = table.weights()[point];
            let local = table.clusters().local(point);
            let values = table.values(point);
            let gradients = table.gradients(point);
            let n = local.len();
            if blocks.force {
                for (&l, value) in local.iter().zip(values) {
                    for i in 0..D {
                        out.residual[l as usize * D + i] += weight * value * derivatives.force[i];
                        out.load_slope[l as usize * D + i] += weight * value * derivatives.force_by_load[i];
                    }
                }
            }
            if blocks.stress {
                let stress = reduce_stress::<D>(&derivatives.stress, table.hoop_components());
                contraction.add_forces(table, point, &stress, weight, &mut out.residual);
            }
            if !out.with_matrix {
                continue;
            }
            if blocks.stress {
                let tangent = reduce_tangent::<D>(&derivatives.stress_by_gradient, table.hoop_components());
                contraction.add_matrix(table, point, &tangent, weight, size, self.integrand.is_symmetric(), out);
            }
            // Forces act through values, which smoothed tables lack.
            if values.is_empty() || !blocks.force_by_gradient && !blocks.force_by_displacement {
                continue;
            }
            for b in 0..n {
                for j in 0..D {
                    // ∂force/∂d_bj by the chain rule through F and u.
                    let mut slope = Vector3::zeros();
                    if blocks.force_by_gradient {
                        for s in 0..D {
                            slope += derivatives.force_by_gradient.column(3 * j + s) * gradients[s * n + b];
                        }
                        if j == 0 {
                            for &k in table.hoop_components() {
                                slope += derivatives.force_by_gradient.column(4 * k) * gradients[D * n + b];
                            }
                        }
                    }
                    if blocks.force_by_displacement {
                        slope += derivatives.force_by_displacement.column(j) * values[b];
                    }
                    slope *= weight;
                    let start = (local[b] as usize * D + j) * size;
                    let column = &mut out.matrix[start..start + size];
                    for (&l, value) in local.iter().zip(values) {
                        for (entry, slope) in column[l as usize * D..][..D].iter_mut().zip(&slope) {
                            *entry += value * slope;
                        }
                    }
                }
            }
        }
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: &[f64], _locals_step: &mut [f64]) -> f64 {
        if !self.integrand.sparsity().stress {
            return 1.0;
        }
        let mut bound: f64 = 1.0;
        for point in self.table.clusters().points(cluster) {
            let f = Matrix3::identity() + self.table.displacement_gradient(point, view.displacement);
            let df = self.table.displacement_gradient(point, step);
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

    fn diagnostics(&self) -> Option<&dyn Diagnostics> {
        Some(self)
    }
}

impl<const D: usize> Diagnostics for Pointwise<D> {
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
            positions: self.table.positions().iter().map(padded).collect(),
            normals: self.table.normals().iter().map(padded).collect(),
            weights: self.table.weights().to_vec(),
            forces: (0..self.table.len()).map(force).collect(),
        })
    }
}
