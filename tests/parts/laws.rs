//! GOAL: particles on meshes keep the promises of lattices: exact on the patch test, stable, not locked.
//! GEOMETRY: ten meshes of tetrahedra and ten of hexahedra as Gmsh makes them, slivers included; prisms; triangles and
//! quadrangles in the plane (`examples/meshes/make.py`).
//! REFERENCE: the linear field itself; 8 Gauss points per direction.

use rkpm::check::{inf_sup, patch_test, spurious_modes};
use rkpm::nalgebra::{Matrix2, Matrix3};
use rkpm::prelude::*;

use super::file;

/// Shear modulus 1, bulk modulus 5/3: what is tested is the rule, not the cure.
fn moderate() -> Rubber {
    Rubber::neo_hookean(0.5, 5.0 / 3.0).unwrap()
}

fn solid(name: &str, rubber: Rubber) -> Scene<3> {
    let mesh = Mesh::<3>::parse(&file(name)).unwrap();
    Scene::new(mesh, Solid, rubber)
}

fn plane(rubber: Rubber) -> Scene<2> {
    let mesh = Mesh::<2>::parse(&file("flat.msh")).unwrap();
    Scene::new(mesh, PlaneStrain, rubber)
}

fn family() -> impl Iterator<Item = String> {
    ["tetrahedra", "hexahedra"].into_iter().flat_map(|kind| (0..10).map(move |k| format!("{kind}_{k}.msh")))
}

fn scheme() -> Scheme {
    Scheme::default()
}

fn gradient() -> Matrix3<f64> {
    Matrix3::new(0.1, 0.08, -0.05, -0.06, 0.12, 0.04, 0.07, -0.03, -0.1)
}

#[test]
fn linear_fields_come_out_exactly() {
    let gradient2 = Matrix2::new(0.2, 0.1, -0.05, -0.1);
    let mut worst = patch_test(&plane(moderate()), &gradient2, &scheme()).unwrap().error;
    for name in ["prisms.msh", "hexahedra.msh", "tetrahedra_2.msh", "tetrahedra_5.msh", "hexahedra_9.msh"] {
        let error = patch_test(&solid(name, moderate()), &gradient(), &scheme()).unwrap().error;
        println!("{name}: patch {error:.1e}");
        worst = worst.max(error);
    }
    assert!(worst <= 1e-11, "{worst:e}");
}

#[test]
fn a_quadratic_basis_keeps_linear_fields_and_sees_every_deformation() {
    let scheme = scheme().order(2);
    // Gradients are linear in a cell: in hexahedra of this mesh they see the weakest of its fields by a few hundredths of their energy.
    for (name, least) in [("prisms.msh", 0.3), ("tetrahedra_2.msh", 0.3), ("hexahedra_9.msh", 0.03)] {
        let [patch, theta, beta] = laws(name, &scheme);
        assert!(patch <= 1e-10 && theta >= least && beta >= 0.1, "{name}");
    }
}

/// What a mesh's particles keep: patch test, θ, inf-sup.
fn laws(name: &str, scheme: &Scheme) -> [f64; 3] {
    let scene = solid(name, moderate());
    let patch = patch_test(&scene, &gradient(), scheme).unwrap().error;
    let modes = spurious_modes(&scene, scheme).unwrap();
    let pressures = inf_sup(&scene, scheme).unwrap();
    println!(
        "{name}: {} unknowns, patch {patch:.1e}, theta {:.3}, inf-sup {:.3} with {} pressures",
        modes.unknowns, modes.smallest, pressures.constant, pressures.pressures
    );
    assert_eq!((modes.zero_modes, modes.rigid_motions, pressures.spurious), (0, 6, 0), "{name}");
    [patch, modes.smallest, pressures.constant]
}

#[test]
fn every_deformation_is_seen_and_pressures_are_stable() {
    for name in ["tetrahedra_8.msh", "hexahedra_6.msh"] {
        let [_, theta, beta] = laws(name, &scheme());
        assert!(theta >= 0.3 && beta >= 0.15, "{name}");
    }
}

/// `cargo test --release --test parts -- --ignored --nocapture all_meshes`
#[test]
#[ignore = "minutes"]
fn all_meshes_keep_the_laws() {
    let mut failed = Vec::new();
    for name in family() {
        let [patch, theta, beta] = laws(&name, &scheme());
        // Two of the cut meshes of docs/measurements/parts.md have 0.232 and 0.290, all others more than 0.3.
        if !(patch <= 1e-11 && theta >= 0.23 && beta >= 0.15) {
            failed.push(name);
        }
    }
    assert!(failed.is_empty(), "{failed:?}");
}

/// Seconds of this process, so that other work on the machine does not count.
fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let ticks: Vec<f64> = stat.rsplit(')').next().unwrap_or("").split(' ').filter_map(|t| t.parse().ok()).collect();
    ticks.get(10).copied().unwrap_or(f64::NAN) / 100.0
}

/// The bonded cube sheared by 3 mm on meshes of `benches/peers/cube_meshes.py`, beside `benches/peers/peer_tetrahedra.py`:
/// `RAYON_NUM_THREADS=1 CUBES=target/rkpm/peers cargo test --release --test parts -- --ignored --nocapture sheared_cube`
#[test]
#[ignore = "needs meshes"]
fn the_sheared_cube_of_tetrahedra() {
    let Ok(folder) = std::env::var("CUBES") else { return };
    for parts in [2, 1] {
        for number in 0..6 {
            let mesh = Mesh::<3>::read(format!("{folder}/cube_{number}.msh")).unwrap();
            let rubber = Rubber::neo_hookean(40.097, 400_889.8).unwrap();
            let scene =
                Scene::new(mesh, Solid, rubber).hold("base").with(Condition::on("top").displacement([3.0, 0.0, 0.0]));
            let start = processor_seconds();
            let scheme = scheme().rule(rkpm::scene::Rule::Smoothed { parts });
            let problem = scene.discretize(&scheme).unwrap();
            let tabulated = processor_seconds() - start;
            let path = problem.run().unwrap().completed().unwrap();
            let seconds = processor_seconds() - start;
            let (last, force) = (path.last(), problem.reaction(path.last(), "top").unwrap());
            let found = [problem.energy(last).unwrap(), force[0], force[2]];
            let errors: Vec<f64> =
                found.iter().zip([2672.3, 1793.8, 343.0]).map(|(a, b)| 100.0 * (a / b - 1.0)).collect();
            println!(
                "cube_{number}, {parts} parts: {} unknowns, {} iterations, E {:.1}, Fx {:.1}, Fz {:.1}, errors {errors:.2?} %, \
                 {seconds:.2} s, tables {tabulated:.2} s",
                problem.model().unknowns(),
                path.iterations,
                found[0],
                found[1],
                found[2],
            );
        }
    }
}
