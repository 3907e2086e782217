//! A smooth solution in space, made first and the loads that belong to it after.
//!
//! GOAL: the order of convergence of functions of the first and the second order where nothing is singular.
//! REFERENCE: the energy of the given deformation, summed by Gauss points; body force and tractions are the divergence and the
//! normal part of its stress.

use nalgebra::Matrix3;
use rkpm::prelude::*;

/// Bulk over shear modulus 1.
const BULK: f64 = 20.0;

/// The displacement of the unit cube: zero on its lower face, gradients below 0.3. With loads of 2.5 times these gradients the cube comes to a limit point before.
fn displacement(x: &Point<3>) -> Point<3> {
    Point::<3>::new(
        0.2 * (1.2 * x[1] + 0.5 * x[2]).sin() + 0.1 * x[0] * x[0],
        0.15 * (x[0] + 0.7 * x[2]).sin(),
        0.1 * (1.3 * x[0]).cos() * (1.0 + x[1]) - 0.05 * x[2],
    ) * (0.4 * x[2])
}

/// Central differences of the sixth order along one axis: right to 1e-11.
fn slope<const R: usize, const C: usize>(
    f: impl Fn(&Point<3>) -> nalgebra::SMatrix<f64, R, C>,
    x: &Point<3>,
    axis: usize,
) -> nalgebra::SMatrix<f64, R, C> {
    let h = 0.01;
    let at = |steps: f64| {
        let mut moved = *x;
        moved[axis] += steps * h;
        f(&moved)
    };
    ((at(1.0) - at(-1.0)) * 45.0 - (at(2.0) - at(-2.0)) * 9.0 + (at(3.0) - at(-3.0))) / (60.0 * h)
}

fn rubber() -> impl Material + Clone {
    Rubber::neo_hookean(0.5, BULK).unwrap()
}

fn deformation(x: &Point<3>) -> Matrix3<f64> {
    Matrix3::identity() + Matrix3::from_columns(&[0, 1, 2].map(|axis| slope(displacement, x, axis)))
}

fn stress(x: &Point<3>) -> Matrix3<f64> {
    rubber().response(&deformation(x)).stress
}

/// The cube held below, under the loads of the deformation.
fn loaded() -> Scene<3> {
    let divergence =
        |x: &Point<3>| (0..3).map(|axis| slope(stress, x, axis).column(axis).into_owned()).sum::<Point<3>>();
    let force = Value::field(move |x: &Point<3>| {
        let divergence = divergence(x);
        [-divergence[0], -divergence[1], -divergence[2]]
    });
    let cube = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber());
    let free = [(0, Side::Min), (0, Side::Max), (1, Side::Min), (1, Side::Max), (2, Side::Max)];
    free.into_iter().fold(cube.hold((2, Side::Min)).with(Load::body_force(force)), |scene, (axis, side)| {
        let outward = if side == Side::Max { 1.0 } else { -1.0 };
        let traction = Value::field(move |x: &Point<3>| {
            let stress = stress(x);
            [0, 1, 2].map(|i| outward * stress[(i, axis)])
        });
        scene.traction((axis, side), traction)
    })
}

/// Errors of the energy, relative.
fn errors(scheme: &Scheme, counts: [usize; 2]) -> [f64; 2] {
    let points = [-1.0, 0.0, 1.0]
        .map(|side: f64| (0.5 + 0.5 * side * 0.6f64.sqrt(), (if side == 0.0 { 8.0 } else { 5.0 }) / 18.0));
    let mut exact = 0.0;
    let cells = 6;
    for place in 0..(3 * cells) * (3 * cells) * (3 * cells) {
        let index = [place % (3 * cells), place / (3 * cells) % (3 * cells), place / (3 * cells) / (3 * cells)];
        let at = index.map(|k| ((k / 3) as f64 + points[k % 3].0) / cells as f64);
        let weight: f64 = index.iter().map(|k| points[k % 3].1 / cells as f64).product();
        exact += weight * rubber().energy(&deformation(&Point::<3>::from(at)));
    }
    counts.map(|n| {
        let problem = loaded().discretize(&scheme.clone().particles([n])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        problem.energy(path.last()).unwrap() / exact - 1.0
    })
}

#[test]
fn energies_converge_with_twice_the_order_where_solutions_are_smooth() {
    let schemes = [
        ("order 1", Scheme::default(), 1.5),
        ("order 2", Scheme::default().order(2), 3.5),
        ("Q2/P1", Scheme::elements(2), 3.5),
    ];
    let found = schemes.map(|(name, scheme, least)| {
        let errors = errors(&scheme, [5, 9]);
        (name, (errors[0] / errors[1]).abs().log2(), least, errors)
    });
    assert!(found.iter().all(|(_, exponent, least, _)| exponent >= least), "{found:?}");
}
