//! GOAL: tetrahedra as Gmsh makes them neither lock nor lose the membrane's tip.
//! GEOMETRY: Cook's membrane [mm], extruded by 5 mm (`examples/meshes/make.py`).
//! BOUNDARY: plane strain by holding both sides across; clamped on the left, a dead traction upwards on the right.
//! REFERENCE: `tests/reference/cook_membrane.csv`; over k/µ this crate's own 49 × 49 particles in the plane.

use rkpm::prelude::*;

const SHEAR_MODULUS: f64 = 80.194;
const TIP: f64 = 6.9355;

/// The tip of the membrane of a mesh.
fn tip(mesh: &Mesh<3>, bulk: f64) -> f64 {
    let scene = Scene::new(mesh, Solid, Rubber::neo_hookean(0.5 * SHEAR_MODULUS, bulk).unwrap())
        .hold("clamp")
        .prescribe("sides", 2, 0.0)
        .traction("edge", [0.0, 6.25, 0.0]);
    let problem = scene.discretize(&Scheme::default()).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let tip = problem.displacement(path.last(), &Point::<3>::new(48.0, 60.0, 2.5)).unwrap()[1];
    println!("{} particles, {} iterations: {tip:.4} mm", mesh.points().len(), path.iterations);
    tip
}

fn tip_in_the_plane(bulk: f64) -> f64 {
    let shape = Quadrilateral { corners: [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]] };
    let scene = Scene::new(shape, PlaneStrain, Rubber::neo_hookean(0.5 * SHEAR_MODULUS, bulk).unwrap())
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.0, 6.25]);
    let problem = scene.discretize(&Scheme::default().particles([49])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    problem.displacement(path.last(), &Point::<2>::new(48.0, 60.0)).unwrap()[1]
}

fn membrane() -> Mesh<3> {
    Mesh::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/meshes/cook.msh")).unwrap()
}

#[test]
fn the_tip_of_the_coarse_membrane() {
    let error = tip(&membrane(), 4e5) / TIP - 1.0;
    println!("{:.2} %", 100.0 * error);
    assert!(error.abs() < 0.03, "{error}");
}

/// `cargo test --release --test parts -- --ignored --nocapture cook::`
#[test]
#[ignore = "a minute"]
fn the_tip_within_a_percent_and_no_locking() {
    let finer = membrane().refined().unwrap();
    assert!(finer.points().len() <= 3000);
    let error = tip(&finer, 4e5) / TIP - 1.0;
    println!("{} particles: {:.3} %", finer.points().len(), 100.0 * error);
    let spread = |mesh: &Mesh<3>| {
        let errors = [1e1, 1e2, 1e3, 1e4, 1e5, 1e6].map(|ratio| {
            let bulk = ratio * SHEAR_MODULUS;
            100.0 * (tip(mesh, bulk) / tip_in_the_plane(bulk) - 1.0)
        });
        let spread = errors.iter().flat_map(|a| errors.map(|b| (a - b).abs())).fold(0.0, f64::max);
        println!("{} particles, k/µ from 10 to 1e6: errors {errors:.3?} %, spread {spread:.3}", mesh.points().len());
        spread
    };
    // One tetrahedron across: 1.22 points.
    let (coarse, spread) = (spread(&membrane()), spread(&finer));
    assert!(coarse < 1.5, "{coarse}");
    assert!(error.abs() < 0.01, "{error}");
    assert!(spread < 1.0, "{spread}");
}
