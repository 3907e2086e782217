//! The numbers of five scenes to the bit, as `python/tests/test_bits.py` expects them of the module.
//!
//! `cargo run --profile quick -p rkpm-python --example bits`, in the profile in which the module was compiled.

use rkpm::prelude::*;
use rkpm::study::{Budget, Quantity, Tolerance};

fn main() -> Result<(), rkpm::Error> {
    let yeoh = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?;
    let tube = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, yeoh).pressure(Side::Min, 0.46);
    solved("tube", &tube, &Scheme::default().particles([9]), None)?;

    let strip = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
        .hold((0, Side::Min))
        .with(Condition::on((0, Side::Max)).displacement([0.5, 0.0]).named("pull"));
    solved("strip", &strip, &Scheme::default().particles([9, 5]), Some("pull"))?;

    let block = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, Rubber::ogden([(0.6, 1.8), (-0.01, -3.0)], 500.0)?)
        .hold((2, Side::Min))
        .with(Condition::on((2, Side::Max)).displacement([0.3, 0.0, -0.1]).named("plate"));
    solved("block", &block, &Scheme::default().particles([5]), Some("plate"))?;

    let quarter = Outline::at([0.0, 0.0]).line("equator", [0.2, 0.0]);
    let quarter = quarter.arc("outer", [0.0, 0.2], [0.0, 0.0], Turn::Left).close("axis");
    let roller = Scene::new(Region::new(quarter)?, PlaneStrain, Rubber::mooney_rivlin(0.293, 0.177, 1410.0)?)
        .prescribe("equator", 1, 0.0)
        .prescribe("axis", 0, 0.0)
        .contact("outer", RigidSurface::plane([0.0, 0.2], [0.0, -1.0]).moving([0.0, -0.025]).named("plate"));
    solved("roller", &roller, &Scheme::default().particles([8]), None)?;

    let bearing = Scene::new(Block::new([0.0, 0.0], [40.0, 10.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
        .hold((1, Side::Min))
        .with(Condition::on((1, Side::Max)).displacement([5.0, 0.0]).named("push"));
    let tolerance = Tolerance::of(Quantity::reaction("push", 0), 0.02);
    let answer = bearing.solve_within(&tolerance, Budget::default())?;
    told("bearing", &answer.problem, answer.path.last(), Some("push"))
}

fn solved<const D: usize>(
    name: &str,
    scene: &Scene<D>,
    scheme: &Scheme,
    force: Option<&str>,
) -> Result<(), rkpm::Error> {
    let problem = scene.discretize(scheme)?;
    let path = problem.run()?.completed()?;
    told(name, &problem, path.last(), force)
}

/// A line for each field: the scene, the field, and the bits of its numbers.
fn told<const D: usize>(
    name: &str,
    problem: &Problem<D>,
    state: &State,
    force: Option<&str>,
) -> Result<(), rkpm::Error> {
    let line = |field: &str, values: &mut dyn Iterator<Item = f64>| {
        let bits: Vec<String> = values.map(|value| format!("{:016x}", value.to_bits())).collect();
        println!("{name} {field} {}", bits.join(" "));
    };
    let displacements = problem.particle_displacements(state)?;
    line("displacement", &mut displacements.iter().flat_map(|u| u.iter().copied()));
    let stresses = problem.stress_field(state)?.at_particles()?;
    line("cauchy", &mut stresses.iter().flat_map(|s| (0..9).map(|c| s[(c / 3, c % 3)])));
    line("energy", &mut std::iter::once(problem.energy(state)?));
    if let Some(force) = force {
        line("force", &mut problem.reaction(state, force)?.iter().copied());
    }
    Ok(())
}
