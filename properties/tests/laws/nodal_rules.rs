//! GOAL: nodal rules by name. Stabilised conforming nodal integration (SCNI) reproduces a linear field exactly;
//! direct nodal integration does not; both see some deformations less than the default does.
//! GEOMETRY: unit square and cube, jittered lattices.
//! BOUNDARY: a linear field on the whole boundary; none in the test of stability.
//! REFERENCE: the field itself; 8 Gauss points per direction and cell.
#![cfg(feature = "solve")]

use approx::assert_abs_diff_eq;
use rkpm::cells::Layout;
use rkpm::check::{patch_test, spurious_modes};
use rkpm::nalgebra::{Matrix2, Matrix3};
use rkpm::prelude::*;
use rkpm::scene::Rule;

fn jittered(rule: Rule, count: usize) -> Scheme {
    Scheme::default().particles([count]).layout(Layout::Jittered { amount: 0.3, seed: 3 }).rule(rule)
}

#[test]
fn dual_cells_tile_the_body() {
    let lattice =
        Lattice::new(&Block::new([0.0; 3], [1.0, 2.0, 3.0]), [3, 4, 5], &Layout::Jittered { amount: 0.3, seed: 1 })
            .unwrap();
    let volumes = lattice.nodal_cells(2).unwrap().volumes();
    assert_eq!(volumes.len(), 60);
    assert!(volumes.iter().all(|v| *v > 0.0));
    // Facets between bilinear faces cancel; 2 Gauss points integrate the outer ones exactly.
    assert_abs_diff_eq!(volumes.iter().sum::<f64>(), 6.0, epsilon = 1e-13);
}

#[test]
fn conforming_nodal_integration_passes_the_patch_test_and_direct_one_does_not() {
    let gradient = Matrix2::new(0.2, 0.1, -0.05, -0.1);
    let rubber = || Rubber::neo_hookean(0.5, 1e3).unwrap();
    let error = |rule| {
        let square = Block::new([0.0; 2], [1.0; 2]);
        patch_test(&Scene::new(square, PlaneStrain, rubber()), &gradient, &jittered(rule, 7)).unwrap().error
    };
    // Exact up to rounding, which the bulk modulus multiplies.
    assert!(error(Rule::Scni) < 1e-12);
    assert!(error(Rule::Nodal) > 1e-3);
    let gradient = Matrix3::new(0.2, 0.1, 0.05, -0.05, -0.1, 0.02, 0.03, -0.04, 0.1);
    let cube = Block::new([0.0; 3], [1.0; 3]);
    let solid = patch_test(&Scene::new(cube, Solid, rubber()), &gradient, &jittered(Rule::Scni, 4)).unwrap();
    assert!(solid.error < 1e-12, "{solid:?}");
}

#[test]
fn nodal_rules_pay_in_stability() {
    let rubber = Rubber::neo_hookean(0.5, 5.0 / 3.0).unwrap();
    let square = Scene::new(Block::new([0.0; 2], [1.0; 2]), PlaneStrain, rubber);
    let of = |rule| spurious_modes(&square, &jittered(rule, 9)).unwrap();
    let (default, scni, nodal) = (of(Rule::Auto), of(Rule::Scni), of(Rule::Nodal));
    println!("default {default:?}\nSCNI    {scni:?}\nnodal   {nodal:?}");
    assert!(default.smallest > scni.smallest && default.smallest > nodal.smallest);
    // Found for such sets: SCNI 0.2 to 1, direct nodal integration 0.35 to 5.
    assert!(scni.smallest < 0.3 && nodal.largest > 1.5);
}
