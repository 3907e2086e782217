//! The patch test: homogeneous fields must come out exactly.

use nalgebra::SMatrix;

use crate::each::array_of;
use crate::error::{Error, GeometryError, Invalid};
use crate::geometry::{Part, Point};
use crate::kinematics::Kinematics;
use crate::scene::{Scene, Scheme, Value};

/// What a patch test measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchTest {
    /// $\max|u - u_{exact}| / \max|u_{exact}|$ over all particles.
    pub error: f64,
    /// Newton iterations, those of rejected steps included.
    pub iterations: usize,
    /// Converged load steps.
    pub steps: usize,
}

/// Prescribes the linear field $u = HX$ on the whole boundary of a scene's body, component by component, runs, and
/// compares the displacement of all particles with it (1st-order patch test). Conditions and loads of the scene are left out.
///
/// `gradient` is $H_{iJ} = \partial u_i/\partial X_J$. Bodies of revolution are homogeneous only under
/// $u_R = aR$, $u_Z = bZ$: a diagonal gradient.
///
/// # Errors
/// As [`Scene::discretize`]; for a gradient that is zero, not finite, inverts the body ($\det F \le 0$)
/// or is not homogeneous under the kinematics; for several bodies; where the analysis stalls.
///
/// ```
/// use rkpm::check::patch_test;
/// use rkpm::cells::Layout;
/// use rkpm::nalgebra::Matrix2;
/// use rkpm::prelude::*;
/// let scheme = Scheme::default().particles([5]).layout(Layout::Jittered { amount: 0.3, seed: 1 });
/// let square = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?);
/// let test = patch_test(&square, &Matrix2::new(0.2, 0.1, -0.05, -0.1), &scheme)?;
/// assert!(test.error < 1e-12);
/// # Ok::<(), rkpm::Error>(())
/// ```
pub fn patch_test<const D: usize>(
    scene: &Scene<D>,
    gradient: &SMatrix<f64, D, D>,
    scheme: &Scheme,
) -> Result<PatchTest, Error> {
    check_gradient(gradient, scene.kinematics.hoop_components())?;
    let mut scene = scene.alone("check::patch_test")?;
    for component in 0..D {
        let row = gradient.row(component).into_owned();
        scene = scene.prescribe(Part::Whole, component, Value::field(move |x: &Point<D>| (row * x)[0]));
    }
    let problem = scene.discretize(scheme)?;
    // A homogeneous state of a large volume change is exact and, under its pressure, unstable.
    let path = problem.run()?.reached()?;
    let (mut error, mut size) = (0.0f64, 0.0f64);
    for (x, u) in problem.cells().positions().iter().zip(problem.particle_displacements(path.last())?) {
        let exact = gradient * x;
        error = error.max((u - exact).norm());
        size = size.max(exact.norm());
    }
    Ok(PatchTest { error: error / size, iterations: path.iterations, steps: path.steps.len() })
}

/// Refuses gradients that are no homogeneous deformation.
fn check_gradient<const D: usize>(gradient: &SMatrix<f64, D, D>, hoops: &[usize]) -> Result<(), Error> {
    let size = gradient.norm();
    ensure!(
        size > 0.0 && size.is_finite(),
        Invalid::new("size of the displacement gradient", size, "give a finite gradient other than zero")
    );
    let deformation = gradient + SMatrix::<f64, D, D>::identity();
    // The hoops stretch as the radius does.
    let plane = crate::cells::determinant(&array_of(|j| deformation.column(j).into_owned()));
    let value = hoops.iter().fold(plane, |jacobian, _| jacobian * deformation[(0, 0)]);
    ensure!(
        !(value <= 0.0),
        Invalid::new("det F of the patch test", value, "the body would be inverted: give a gradient with det F > 0")
    );
    let diagonal = (0..D).all(|i| (0..D).all(|j| i == j || gradient[(i, j)] == 0.0));
    ensure!(
        hoops.is_empty() || diagonal,
        GeometryError::Kinematics {
            what: "a gradient that is not homogeneous in an axisymmetric body",
            at: gradient.iter().copied().collect(),
            remedy: "give a diagonal gradient: u_R = aR and u_Z = bZ",
        }
    );
    Ok(())
}
