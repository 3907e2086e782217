//! GOAL: particles on meshes keep the promises of lattices: exact on the patch test, stable, not locked.
//! GEOMETRY: ten meshes of tetrahedra and ten of hexahedra as Gmsh makes them, slivers included; prisms; triangles and
//! quadrangles in the plane (`examples/meshes/make.py`).
//! REFERENCE: the linear field itself; 8 Gauss points per direction.

use std::sync::Arc;

use rkpm::cells::Unstructured;
use rkpm::check::{inf_sup, patch_test_of, spurious_modes};
use rkpm::nalgebra::{Matrix2, Matrix3};
use rkpm::prelude::*;

use super::file;

/// Shear modulus 1, bulk modulus 5/3: what is tested is the rule, not the cure.
fn moderate() -> Rubber {
    Rubber::neo_hookean(0.5, 5.0 / 3.0).unwrap()
}

fn solid(name: &str, rubber: Rubber) -> Scene<3> {
    let mesh = Mesh::<3>::parse(&file(name)).unwrap();
    Scene::over(Arc::new(Unstructured::new(&mesh).unwrap()), Solid, rubber)
}

fn plane(rubber: Rubber) -> Scene<2> {
    let mesh = Mesh::<2>::parse(&file("flat.msh")).unwrap();
    Scene::over(Arc::new(Unstructured::new(&mesh).unwrap()), PlaneStrain, rubber)
}

fn family() -> impl Iterator<Item = String> {
    ["tetrahedra", "hexahedra"].into_iter().flat_map(|kind| (0..10).map(move |k| format!("{kind}_{k}.msh")))
}

fn scheme() -> Scheme {
    Scheme::default().dilation(1.0)
}

fn gradient() -> Matrix3<f64> {
    Matrix3::new(0.1, 0.08, -0.05, -0.06, 0.12, 0.04, 0.07, -0.03, -0.1)
}

#[test]
fn linear_fields_come_out_exactly() {
    let gradient2 = Matrix2::new(0.2, 0.1, -0.05, -0.1);
    let mut worst = patch_test_of(&plane(moderate()), &gradient2, &scheme()).unwrap().error;
    for name in ["prisms.msh", "tetrahedra_0.msh", "tetrahedra_5.msh", "hexahedra_2.msh", "hexahedra_9.msh"] {
        let error = patch_test_of(&solid(name, moderate()), &gradient(), &scheme()).unwrap().error;
        println!("{name}: {error:.1e}");
        worst = worst.max(error);
    }
    assert!(worst <= 1e-11, "{worst:e}");
}

/// `cargo test --profile quick --all-features --test parts -- --ignored --nocapture all_meshes`
#[test]
#[ignore = "minutes"]
fn all_meshes_keep_the_laws() {
    let parts: usize = std::env::var("PARTS").ok().and_then(|p| p.parse().ok()).unwrap_or(2);
    let r: f64 = std::env::var("DILATION").ok().and_then(|p| p.parse().ok()).unwrap_or(1.0);
    let scheme = Scheme::default().dilation(r).rule(rkpm::scene::Rule::Smoothed { parts });
    for name in family() {
        let scene = solid(&name, moderate());
        let cells = scene.discretize(&scheme).map(|p| p.cells.clone());
        let Ok(cells) = cells else {
            println!("{name}: {}", cells.err().unwrap());
            continue;
        };
        let patch = patch_test_of(&scene, &gradient(), &scheme).map(|p| p.error);
        let modes = spurious_modes(&scene, &scheme);
        let pressures = inf_sup(&scene, &scheme);
        println!(
            "{name}: {} particles, {} cells, patch {patch:?}, theta {:.3?}, {:?} zero, inf-sup {:.3?}, {:?} pressures",
            cells.positions().len(),
            cells.cell_count(),
            modes.as_ref().map(|m| m.smallest),
            modes.as_ref().map(|m| m.zero_modes),
            pressures.as_ref().map(|p| p.constant),
            pressures.as_ref().map(|p| p.pressures),
        );
    }
}
