//! Spurious modes: the tangent of an integration rule against that of exact integration.

use nalgebra::DMatrix;

use crate::assembly::Model;
use crate::compiled::compiled;
use crate::each::IntoEach;
use crate::error::Error;
use crate::geometry::{Point, RigidMode};
use crate::quadrature::Points;
use crate::scene::{Scene, Scheme};
use crate::table::ShapeTable;
use crate::term::{Body, PressureField};

use super::algebra::{Pencil, add_tangent_at_rest, check_size};

/// Gauss points per direction and cell of the reference: four integrate rational functions to about 1e-3, eight far more accurately
/// than these checks need.
const REFERENCE_POINTS: usize = 8;
/// Points of the reference that are tabulated at a time, to bound the memory.
const POINTS_AT_ONCE: usize = 8192;
/// $\theta$ below which a mode counts as unseen by the rule. One sub-cell per cell leaves 1e-16 on regular
/// bricks, 1e-7 on regular squares and about 1e-3 on jittered ones; rules without such modes leave 0.2 and more.
const UNSEEN: f64 = 1e-2;
/// Energy of a rigid motion relative to the stiffness, below which it costs nothing.
const RIGID: f64 = 1e-10;

/// How the energy of a rule compares with exactly integrated energy over all deformations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stability {
    /// Smallest $\theta$: the deformation that the rule underrates most.
    pub smallest: f64,
    /// Largest $\theta$: the deformation that the rule overrates most.
    pub largest: f64,
    /// Spurious modes: deformations with less than 1 % of their energy under the rule ($\theta < 0.01$).
    /// On jittered particles they are seldom exactly zero, and no less harmful.
    pub zero_modes: usize,
    /// Rigid motions, which are set apart: 6 in 3D, 3 in plane strain, 1 in axisymmetric bodies.
    pub rigid_motions: usize,
    /// Displacement unknowns, those of rigid motions included.
    pub unknowns: usize,
}

/// The generalised eigenvalues of
/// $$K_{rule}\\,v = \theta\\,K_{reference}\\,v$$
/// on the complement of the rigid motions: both tangents at rest, with the same particles, shape
/// functions and material, $K_{reference}$ integrated by 8 Gauss points per direction in each cell.
///
/// What is tested is the scheme's integration rule alone: both have the volumetric energy in
/// displacement form, whatever the scheme's pressures. Conditions and loads of the scene are left out.
///
/// # Errors
/// As [`Scene::discretize`]; for several bodies; beyond 3000 unknowns; for a material that is
/// not stable at rest.
///
/// ```
/// use rkpm::check::spurious_modes;
/// use rkpm::prelude::*;
/// let square = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 5.0 / 3.0)?);
/// let stability = spurious_modes(&square, &Scheme::default().particles([4]))?;
/// assert_eq!((stability.zero_modes, stability.rigid_motions), (0, 3));
/// assert!(stability.smallest > 0.45);
/// # Ok::<(), rkpm::Error>(())
/// ```
pub fn spurious_modes<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<Stability, Error> {
    compiled!(D: (scene: &Scene<D> = scene; scheme: &Scheme = scheme) -> Result<Stability, Error> { measured(scene, scheme) })
}

fn measured<const D: usize>(scene: &Scene<D>, scheme: &Scheme) -> Result<Stability, Error> {
    let problem = scene.alone("check::spurious_modes")?.discretize(scheme)?;
    let positions = problem.cells().positions();
    let unknowns = positions.len() * D;
    check_size("unknowns of the test for spurious modes", unknowns)?;

    let tangent_of = |table: ShapeTable<D>, tangent: &mut DMatrix<f64>| {
        let mut model = Model::new(positions);
        model.add(Body::new(table, problem.body().law().clone(), PressureField::Displacement));
        add_tangent_at_rest(&model, tangent);
    };
    let mut rule = DMatrix::zeros(unknowns, unknowns);
    tangent_of(problem.body().table().clone(), &mut rule);
    let mut reference = DMatrix::zeros(unknowns, unknowns);
    for points in portions(&problem.cells().gauss(REFERENCE_POINTS)?) {
        tangent_of(problem.tabulate(&points, &*scene.kinematics)?, &mut reference);
    }

    let rigid = rigid_motions(positions, &reference);
    let ends = Pencil::beside(&rule, &reference, &rigid).ends(
        UNSEEN,
        "the exactly integrated tangent at rest is not positive definite: the material is not stable there",
    )?;
    Ok(Stability {
        smallest: ends.smallest,
        largest: ends.largest,
        zero_modes: ends.below,
        rigid_motions: rigid.ncols(),
        unknowns,
    })
}

/// A set of points in portions of whole groups.
fn portions<const D: usize>(points: &Points<D>) -> Vec<Points<D>> {
    let mut portions = Vec::new();
    let mut portion = Points::empty();
    for group in points.groups.windows(2) {
        portion.positions.extend_from_slice(&points.positions[group[0]..group[1]]);
        portion.weights.extend_from_slice(&points.weights[group[0]..group[1]]);
        portion.close_group();
        if portion.positions.len() >= POINTS_AT_ONCE {
            portions.push(std::mem::take(&mut portion));
        }
    }
    if !portion.positions.is_empty() {
        portions.push(portion);
    }
    portions
}

/// Translations and infinitesimal rotations as columns of coefficients, those that cost no energy: a body
/// of revolution has but one, and the Shepard functions hold no rotation.
fn rigid_motions<const D: usize>(positions: &[Point<D>], tangent: &DMatrix<f64>) -> DMatrix<f64> {
    let unknowns = tangent.nrows();
    let centre = positions.iter().sum::<Point<D>>() / positions.len() as f64;
    let motion = |mode: RigidMode| DMatrix::from_fn(unknowns, 1, |k, _| mode.at(&(positions[k / D] - centre))[k % D]);
    let mut motions: Vec<DMatrix<f64>> = RigidMode::all(D).into_mapped(motion);
    let stiffness = tangent.diagonal().max();
    motions.retain(|m| (tangent * m).dot(m) <= RIGID * stiffness * m.norm_squared());
    DMatrix::from_fn(unknowns, motions.len(), |row, column| motions[column][row] / motions[column].norm())
}
