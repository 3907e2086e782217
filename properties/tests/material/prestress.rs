//! Bodies that expand or were stretched before: free they take their new shape, held they are stressed.

use approx::{abs_diff_eq, assert_abs_diff_eq};
use rkpm::check;
use rkpm::material::{Material, Prestretched};
use rkpm::nalgebra::{Matrix3, Vector3};
use rkpm::prelude::*;

const STRETCH: f64 = 1.05;

fn rubber() -> Rubber {
    Rubber::mooney_rivlin(0.3, 0.05, 200.0).unwrap()
}

#[test]
fn free_bodies_expand_without_stress() {
    let run = |scene: &Scene<2>, radial: bool| {
        let problem = scene.discretize(&Scheme::default().particles([5, 5])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        for stress in problem.stresses(path.last()).unwrap() {
            assert!(abs_diff_eq!(stress, Matrix3::zeros(), epsilon = 3e-9), "radial {radial}: {stress}");
        }
        for f in problem.deformation_gradients(path.last()).unwrap() {
            assert!(abs_diff_eq!(f, Matrix3::identity(), epsilon = 3e-10), "the elastic part is none: {f}");
        }
        let u = problem.displacement(path.last(), &[1.0, 2.0].into()).unwrap();
        assert_abs_diff_eq!(u[0], 0.05, epsilon = 1e-9);
        assert_abs_diff_eq!(u[1], 0.1, epsilon = 1e-9);
        assert_abs_diff_eq!(problem.energy(path.last()).unwrap(), 0.0, epsilon = 1e-9);
    };
    let block = || Block::new([0.0, 0.0], [1.0, 2.0]);
    let sheet = Scene::new(block(), PlaneStress { thickness: 0.3 }, rubber());
    run(&sheet.prescribe((0, Side::Min), 0, 0.0).prescribe((1, Side::Min), 1, 0.0).with_expansion(STRETCH), false);
    let cylinder = Scene::new(block(), Axisymmetric, rubber());
    run(&cylinder.prescribe((0, Side::Min), 0, 0.0).prescribe((1, Side::Min), 1, 0.0).with_expansion(STRETCH), true);
}

/// Held all around, a body that would expand is pressed by its bulk modulus: F_e = 1/ϑ.
#[test]
fn held_bodies_are_pressed_by_their_expansion() {
    let scene = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber())
        .prescribe(Part::Whole, 0, 0.0)
        .prescribe(Part::Whole, 1, 0.0)
        .with_expansion(Value::field(|_: &Point<2>| STRETCH));
    let problem = scene.discretize(&Scheme::default().particles([5, 5])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let expected = 200.0 * (STRETCH.powi(-3) - 1.0);
    for stress in problem.stresses(path.last()).unwrap() {
        assert_abs_diff_eq!(stress, Matrix3::identity() * expected, epsilon = 3e-9);
    }
    // The wall feels it on its area: Cauchy's stress times one.
    let force = problem.reaction(path.last(), Part::Whole);
    assert!(force.is_ok());
    let wrong = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber()).with_expansion(0.0);
    let error = wrong.discretize(&Scheme::default().particles([3, 3])).err().unwrap().to_string();
    assert!(error.contains("expansion"), "{error}");
}

#[test]
fn stretched_materials_keep_the_contract_but_for_their_stress_at_rest() {
    let before = Matrix3::new(1.3, 0.1, 0.0, 0.0, 0.9, 0.05, 0.0, 0.0, 0.95);
    let material = Prestretched::new(rubber(), before).unwrap();
    let report = check::material(&material);
    let broken: Vec<_> = report.violations().map(|f| f.law).collect();
    // Where the body is pressed at rest, turning it releases energy: its tangent there has directions of less than nothing.
    let at_rest = ["no stress at rest", "the tangent at rest is not negative"];
    assert!(broken.contains(&at_rest[0]) && broken.iter().all(|law| at_rest.contains(law)), "{report}");
    let f = Matrix3::new(1.1, 0.2, 0.0, -0.1, 0.9, 0.1, 0.0, 0.1, 1.05);
    let expected = rubber().response(&(f * before)).stress * before.transpose() / before.determinant();
    assert_abs_diff_eq!(material.response(&f).stress, expected, epsilon = 3e-13);
    assert!(Prestretched::new(rubber(), -Matrix3::identity()).is_err());
}

/// A band that was pulled before it was built in: cut loose it shrinks back.
#[test]
fn stretched_bands_shrink_back() {
    let side = 1.5f64.powf(-0.5);
    let before = Matrix3::from_diagonal(&Vector3::new(1.5, side, side));
    let scene = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, Prestretched::new(rubber(), before).unwrap())
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((2, Side::Min), 2, 0.0);
    let problem = scene.discretize(&Scheme::default().particles([3, 3, 3])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let u = problem.displacement(path.last(), &[1.0, 1.0, 1.0].into()).unwrap();
    let expected = Vector3::new(1.0 / 1.5, 1.0 / side, 1.0 / side) - Vector3::repeat(1.0);
    assert_abs_diff_eq!(u, expected, epsilon = 5e-9);
}
