//! What the benches share: bodies of any size, and pools of threads.
#![allow(dead_code)] // No bench needs all of it.

use rkpm::assembly::{Model, StateRef, System};
use rkpm::boundary::Reduction;
use rkpm::linear::LinearSolver;
use rkpm::prelude::*;
use rkpm::solve::State;

/// Cook's membrane with `n` × `n` particles.
pub fn membrane() -> Scene<2> {
    let corners = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]];
    let rubber = Rubber::neo_hookean(80.194 / 2.0, 4e5).expect("constants above zero");
    Scene::new(Quadrilateral { corners }, PlaneStrain, rubber)
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.0, 6.25])
}

/// The disk with a held rim under 0.1035 MPa.
pub fn disk() -> Scene<2> {
    let rubber = Rubber::mooney_rivlin(0.5516, 0.1379, 689.5).expect("constants above zero");
    Scene::new(Block::new([0.0, 0.0], [18.923, 0.635]), Axisymmetric, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .pressure((1, Side::Min), 0.1035)
        .hold((0, Side::Max))
}

/// The tube under 0.46 MPa.
pub fn tube() -> Scene<1> {
    let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5).expect("the paper's rubber");
    Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber).pressure(Side::Min, 0.46)
}

/// A cube held at its foot and pulled askew at its top.
pub fn cube() -> Scene<3> {
    let rubber = Rubber::neo_hookean(0.5, 1e3).expect("constants above zero");
    Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber)
        .hold((2, Side::Min))
        .traction((2, Side::Max), [0.05, 0.0, 0.05])
}

/// The default scheme with `n` particles along each axis.
pub fn scheme(n: usize) -> Scheme {
    Scheme::default().particles([n])
}

/// A state with every coefficient moved a little, so that nothing is zero by accident.
pub fn moved(model: &Model) -> Vec<f64> {
    (0..model.unknowns()).map(|i| 1e-4 * (i as f64).sin()).collect()
}

/// The conditions of a problem, bound to the pattern of its model.
pub fn bound<const D: usize>(problem: &Problem<D>) -> Reduction {
    let assembler = problem.model().assembler();
    let enforced = problem.analysis().enforcement.bind(assembler.pattern(), problem.equations());
    Reduction::new(enforced.expect("independent conditions"), assembler.pattern(), problem.equations())
        .expect("a pattern")
}

/// The solver of a problem's analysis, and its reduced matrix at rest.
pub fn reduced<const D: usize>(problem: &Problem<D>) -> (Reduction, Vec<f64>, Box<dyn LinearSolver>) {
    let model = problem.model();
    let state = State::at_rest(model, problem.equations());
    let mut reduction = bound(problem);
    let solver = problem.analysis().bound_solver(model, &mut reduction).expect("a sound pattern");
    let mut system = System::default();
    model.assembler().assemble(model, StateRef::new(&state.displacement, &state.terms, 1.0), &mut system).unwrap();
    let mut values = Vec::new();
    reduction.reduce(&system, &mut values);
    (reduction, values, solver)
}

/// Runs `f` on a pool of so many threads.
pub fn on_threads<T: Send>(threads: usize, f: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool of threads").install(f)
}
