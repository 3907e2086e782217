//! The inf-sup constant of a scheme's pressures.

use nalgebra::DMatrix;

use crate::compiled::compiled;
use crate::each::{Each, sum_of};
use crate::error::{Error, LinearError};
use crate::geometry::Part;
use crate::scene::{Scene, Scheme};
use crate::table::ShapeTable;

use super::algebra::{Complement, check_size, cholesky, forward, spectrum};

/// $\beta$ below which a pressure counts as unseen by the displacements: checkerboards of constants per cell
/// leave 1e-4 (functions that don't interpolate see a little of them), stable pairs 0.3 and more.
const UNSEEN: f64 = 1e-2;

/// The inf-sup constant and the spurious pressures of a scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InfSup {
    /// $\beta$ over all pressures but the constant; near zero where there are spurious ones.
    pub constant: f64,
    /// Pressures besides the constant that displacements hardly see ($\beta < 0.01$): checkerboards.
    pub spurious: usize,
    /// $\beta$ over the pressures that are left without the spurious ones.
    pub filtered: f64,
    /// Pressure functions, the constant included; with a single one there is no $\beta$ (NaN).
    pub pressures: usize,
    /// Displacement unknowns left by the conditions.
    pub displacements: usize,
}

/// The numerical inf-sup constant of the scheme's pressures (Chapelle & Bathe 1993),
/// $$\beta = \inf_p \sup_u \frac{\int p\\,\mathrm{div}\\,u}{\\|p\\|\\;|u|_1},$$
/// with the displacement fixed on the whole boundary by the scheme's own rows and the constant pressure
/// removed: the root of the smallest eigenvalue of $CK^{-1}C^Tp = \beta^2 Mp$, $K$ the vector
/// Laplacian and $C = \int\varphi\\,\mathrm{div}\\,u$ over the scheme's own table, $M$ the pressure mass.
///
/// Pressures at points and displacement form have one pressure function per integration point. The
/// scene gives domain and kinematics; its material matters only where it can't be split (then the
/// scheme runs in displacement form, and that is what is certified).
///
/// # Errors
/// As [`Scene::discretize`]; for several bodies; beyond 3000 pressures or unknowns of one
/// component; where conditions leave no displacement or the rule has spurious modes of its own.
///
/// ```
/// use rkpm::check::inf_sup;
/// use rkpm::prelude::*;
/// let square = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e4)?);
/// let stable = inf_sup(&square, &Scheme::default().particles([5]))?;
/// assert!(stable.constant > 0.3 && stable.spurious == 0);
/// let locking = inf_sup(&square, &Scheme::default().particles([5]).pressure_field(PressureField::Pointwise, 1))?;
/// assert!(locking.spurious > 0);
/// # Ok::<(), rkpm::Error>(())
/// ```
pub fn inf_sup<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<InfSup, Error> {
    compiled!(D: (scene: &Scene<D> = scene; scheme: &Scheme = scheme) -> Result<InfSup, Error> { measured(scene, scheme) })
}

fn measured<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<InfSup, Error> {
    let problem = scene.alone("check::inf_sup")?.hold(Part::Whole).discretize(scheme)?;
    let nodes = problem.cells().positions().len();
    check_size("particles of the inf-sup test", nodes)?;
    let table = problem.body().table();
    let pressures = Pressures::of(problem.body());
    check_size("pressures of the inf-sup test", pressures.count)?;

    let mut schur = DMatrix::<f64>::zeros(pressures.count, pressures.count);
    let mut displacements = 0;
    for component in 0..D {
        let equations: Vec<_> =
            problem.equations().equations().iter().filter(|row| row.dependent % D == component).collect();
        let mut conditions = DMatrix::zeros(nodes, equations.len());
        for (column, row) in equations.iter().enumerate() {
            for &(unknown, coefficient) in &row.entries {
                conditions[(unknown / D, column)] += coefficient;
            }
        }
        let free = Complement::of(conditions);
        if free.rank() >= nodes {
            continue;
        }
        displacements += nodes - free.rank();
        let (laplacian, divergence) = matrices(table, &pressures, component);
        let factor = cholesky(
            free.compress(laplacian),
            "the Laplacian of the integration rule is not positive definite: the rule has spurious modes",
        )?;
        let mut slopes = free.restrict(divergence);
        forward(&factor, &mut slopes);
        schur += slopes.tr_mul(&slopes);
    }
    ensure!(
        displacements != 0,
        LinearError::Pivot {
            pivot: 0,
            hint: "the conditions on the boundary leave no displacement: take more particles"
        }
    );
    // The constant pressure does no work on displacements that vanish on the boundary.
    let constant = DMatrix::from_column_slice(pressures.count, 1, &pressures.constant);
    let squares = spectrum(Complement::of(constant).compress(schur))?;
    // Rounding may leave a zero below zero.
    let beta: Vec<f64> = squares.mapped(|b| b.max(0.0).sqrt());
    let spurious = beta.iter().filter(|b| **b < UNSEEN).count();
    Ok(InfSup {
        constant: beta.first().copied().unwrap_or(f64::NAN),
        spurious,
        filtered: beta.get(spurious).copied().unwrap_or(f64::NAN),
        pressures: pressures.count,
        displacements,
    })
}

/// Orthonormal pressure functions: at each point (function, value) pairs.
struct Pressures {
    at: Vec<Vec<(usize, f64)>>,
    count: usize,
    /// Coefficients of the constant.
    constant: Vec<f64>,
}

impl Pressures {
    fn of<const D: usize>(body: &crate::term::Body<D>) -> Self {
        let table = body.table();
        let mut pressures = Pressures { at: vec![Vec::new(); table.point_count()], count: 0, constant: Vec::new() };
        for cluster in 0..table.clusters().count() {
            let points = table.clusters().points(cluster);
            let functions = points.clone().map(|p| body.zone_functions(p).len()).max().unwrap_or(0);
            if functions == 0 {
                for point in points {
                    let root = table.weights()[point].sqrt();
                    pressures.push([(point, 1.0 / root)], table.weights());
                }
                continue;
            }
            for k in 0..functions {
                // A zone with few points has fewer functions; the others are zero.
                let values = points.clone().map(|p| (p, body.zone_functions(p)[k])).filter(|v| v.1 != 0.0);
                pressures.push(values, table.weights());
            }
        }
        pressures
    }

    fn push(&mut self, values: impl IntoIterator<Item = (usize, f64)>, weights: &[f64]) {
        let mut integral = None;
        for (point, value) in values {
            self.at[point].push((self.count, value));
            *integral.get_or_insert(0.0) += weights[point] * value;
        }
        if let Some(integral) = integral {
            self.constant.push(integral);
            self.count += 1;
        }
    }
}

/// $\int\nabla\Psi_I\cdot\nabla\Psi_J$ (with $\Psi_I\Psi_J/R^2$ for each hoop) and $\int\varphi_k\\,\mathrm{div}(\Psi_I e_i)$
/// of one displacement component, particles by pressures.
fn matrices<const D: usize>(
    table: &ShapeTable<D>,
    pressures: &Pressures,
    component: usize,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let mut laplacian = DMatrix::zeros(table.node_count(), table.node_count());
    let mut divergence = DMatrix::zeros(table.node_count(), pressures.count);
    // The hoops stretch with the displacement along the radius alone.
    let hoops =
        if component == 0 && table.gradient_components() > D { table.hoop_components().len() as f64 } else { 0.0 };
    for point in 0..table.point_count() {
        let (nodes, gradients, weight) = (table.nodes(point), table.gradients(point), table.weights()[point]);
        let n = nodes.len();
        let hoop = |a: usize| if hoops > 0.0 { gradients[D * n + a] } else { 0.0 };
        for (b, &column) in nodes.iter().enumerate() {
            for (a, &row) in nodes.iter().enumerate() {
                let plane: f64 = sum_of(D, |s| gradients[s * n + a] * gradients[s * n + b]);
                laplacian[(row as usize, column as usize)] += weight * (plane + hoops * hoop(a) * hoop(b));
            }
            let change = gradients[component * n + b] + hoops * hoop(b);
            for &(k, value) in &pressures.at[point] {
                divergence[(column as usize, k)] += weight * value * change;
            }
        }
    }
    (laplacian, divergence)
}
