//! Parts without a lattice, solved by iteration.
//!
//! GOAL: iteration finds what factors find, in few directions.
//! REFERENCE: the same scene by factors.

use rkpm::mesh::Mesh;
use rkpm::prelude::*;
use rkpm::scene::SolverChoice;
use rkpm::solid::{Select, Shape};

use super::file;
use approx::assert_abs_diff_eq;

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 5e3).unwrap()
}

/// Forces and energy by iteration and by factors, and the most directions.
fn both(scene: &Scene<3>, scheme: &Scheme, part: &str) -> usize {
    let mut found = Vec::new();
    let mut most = 0;
    for choice in [SolverChoice::Krylov, SolverChoice::Direct] {
        let problem = scene.discretize(&scheme.clone().solver_choice(choice)).unwrap();
        assert_eq!(problem.analysis().solver.keeps_pressures(), choice == SolverChoice::Krylov);
        let path = problem.run().unwrap().completed().unwrap();
        most = most.max(problem.analysis().solver.krylov_iterations().into_iter().max().unwrap_or(0));
        let mut own = problem.reaction(path.last(), part).unwrap().as_slice().to_vec();
        own.push(problem.energy(path.last()).unwrap());
        found.push(own);
    }
    let size = found[1][..3].iter().map(|f| f * f).sum::<f64>().sqrt();
    let sizes = [size, size, size, found[1][3]];
    for ((krylov, direct), size) in found[0].iter().zip(&found[1]).zip(sizes) {
        assert_abs_diff_eq!(krylov, direct, epsilon = 1e-7 * size);
    }
    assert!(most > 0);
    most
}

/// A block with a round hole in an even lattice, its walls left as they are: in forty directions, as lattices are.
#[test]
fn a_cut_solid_is_solved_by_iteration_as_by_factors() {
    let hole = Shape::cylinder([0.5, -0.1, 0.5], [0.5, 1.1, 0.5], 0.25);
    let solid = Shape::block([0.0; 3], [1.0; 3]).minus(hole).solid(0.05).unwrap();
    let solid = solid.name("base", Select::plane([0.0; 3], [0.0, 0.0, -1.0])).unwrap();
    let solid = solid.name("top", Select::plane([0.0, 0.0, 1.0], [0.0, 0.0, 1.0])).unwrap();
    let by = Condition::on("top").displacement([0.05, 0.0, -0.1]);
    let scene = Scene::new(&solid, Solid, rubber()).hold("base").with(by);
    let most = both(&scene, &Scheme::default().spacing(0.16).thin_walls(), "top");
    assert!(most <= 40, "{most} directions");
}

/// A plug of tetrahedra with bases of both orders.
#[test]
fn a_mesh_in_space_is_solved_by_iteration_as_by_factors() {
    let mesh = Mesh::<3>::parse(&file("plug_41_binary.msh")).unwrap();
    let by = Condition::on("top").displacement([0.02, 0.0, -0.05]);
    let scene = Scene::new(mesh, Solid, rubber()).hold("base").with(by);
    // The polynomial of the second order sees more than the fits do, which are linear: a restart's directions are enough.
    for (order, enough) in [(1, 40), (2, 80)] {
        let most = both(&scene, &Scheme::default().order(order), "top");
        println!("order {order}: {most} directions");
        assert!(most <= enough, "order {order}: {most} directions");
    }
}
