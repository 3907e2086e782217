//! A rubber cylinder squeezed between two rigid plates: contact that grows from a line to more than the diameter.
//!
//! `cargo run --release --example roller [-- --out DIR]` prints a table and writes `summary.csv`, the pressures under the
//! plate and pictures. Lengths in m, stresses in MPa, forces in MN/m = kN/mm; plane strain, a quarter by symmetry.

mod support;

use std::error::Error;
use std::path::Path as FilePath;
use std::time::Instant;

use rkpm::output::chart::{Colour, Series};
use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use rkpm::solve::TangentUpdate;
use support::Summary;

const RADIUS: f64 = 0.2;
const CLOSURES: [f64; 5] = [0.02, 0.05, 0.10, 0.15, 0.20];

/// The quarter under a plate that comes down to each closure in turn; lengths and stresses in units of `metre` and
/// `megapascal`.
fn quarter(metre: f64, megapascal: f64) -> Result<Scene<2>, rkpm::Error> {
    let r = RADIUS * metre;
    let outline =
        Outline::at([0.0, 0.0]).line("equator", [r, 0.0]).arc("outer", [0.0, r], [0.0, 0.0], Turn::Left).close("axis");
    let [a10, a01, k] = [0.293, 0.177, 1410.0].map(|modulus| modulus * megapascal);
    let rubber = Rubber::mooney_rivlin(a10, a01, k)?;
    // Both plates move: each by half of the closure. The break_points of the table are where the steps of the load stop.
    let last = CLOSURES[CLOSURES.len() - 1];
    let break_points = [0.0].into_iter().chain(CLOSURES).map(|c| (c / last, c / last)).collect();
    let plate = RigidSurface::plane([0.0, r], [0.0, -1.0])
        .moving_along([0.0, -0.5 * last * metre], Amplitude::table(break_points)?)
        .named("plate");
    Ok(Scene::new(Region::new(outline)?, PlaneStrain, rubber)
        .prescribe("equator", 1, 0.0)
        .prescribe("axis", 0, 0.0)
        .contact("outer", plate))
}

/// Forces of the whole cylinder at the closures, with problem and path.
fn squeeze(
    scene: &Scene<2>,
    count: usize,
) -> Result<(Vec<f64>, Problem<2>, rkpm::solve::EquilibriumPath), rkpm::Error> {
    let problem = scene.discretize(&Scheme::default().particles([count]))?;
    let path = problem.run()?.completed()?;
    support::print_doubts(&problem, &path)?;
    let mut forces = Vec::new();
    for closure in CLOSURES {
        let load = closure / CLOSURES[4];
        let step = path.steps.iter().find(|step| (step.state.load - load).abs() < 1e-12);
        let state = &step.expect("steps stop at the break_points").state;
        forces.push(-2.0 * problem.contact(state, "plate")?.force[1]);
    }
    Ok((forces, problem, path))
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("roller");
    let reference = support::csv_columns(include_str!("../tests/reference/cylinder_between_plates.csv"));
    let mut summary = Summary::new();
    let scene = quarter(1.0, 1.0)?;
    let (forces, problem, path) = squeeze(&scene, 25)?;
    for (k, (closure, force)) in CLOSURES.iter().zip(&forces).enumerate() {
        summary.record(format!("force_{closure:.2}"), *force, reference[1].1[k])?;
    }
    summary.note("particles", problem.cells().positions().len() as f64)?;
    summary.note("steps", path.steps.len() as f64)?;
    summary.note("factorisations", path.iterations as f64)?;

    // Other draws of as many particles, and twice as many.
    let worst = |other: &[f64]| forces.iter().zip(other).map(|(a, b)| (b / a - 1.0).abs()).fold(0.0, f64::max);
    let (finer, fine, _) = squeeze(&scene, 36)?;
    summary.note("particles_doubled", fine.cells().positions().len() as f64)?;
    summary.note("doubled_worst", worst(&finer))?;

    // One plate against the symmetry plane: what goes in comes out.
    let plate = problem.contact(path.last(), "plate")?;
    let balance = problem.reaction(path.last(), "equator")?[1] + plate.force[1];
    summary.note("balance", (balance / plate.force[1]).abs())?;
    // Deepest penetration of a trace function as a part of the radius.
    let deepest = plate.points.iter().map(|point| -point.gap).fold(0.0, f64::max);
    summary.note("penetration", deepest / RADIUS)?;

    // Millimetres and megapascals against metres and pascals.
    let (in_mm, _, of_mm) = squeeze(&quarter(1e3, 1.0)?, 25)?;
    let (in_pa, _, of_pa) = squeeze(&quarter(1.0, 1e6)?, 25)?;
    let units = in_mm.iter().zip(&in_pa).map(|(a, b)| (a * 1e3 / b - 1.0).abs()).fold(0.0, f64::max);
    summary.note("units_worst", units)?;
    summary.note("units_iterations", of_mm.iterations.abs_diff(of_pa.iterations) as f64)?;

    summary.note("iteration_cost", iteration_cost(&scene)?)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    plate.table()?.write(out.join("pressure.csv"))?;
    pictures(&out, &problem, &path)?;
    println!("results in {}", out.display());
    Ok(())
}

/// Processor time of an iteration with contact in terms of one of the same body without: under a traction of about the
/// same size, every iteration with a matrix of its own.
fn iteration_cost(scene: &Scene<2>) -> Result<f64, rkpm::Error> {
    let free = quarter_without_contact()?;
    let mut ratios = Vec::new();
    for _ in 0..5 {
        let mut seconds = [0.0; 2];
        for (k, scene) in [scene, &free].into_iter().enumerate() {
            let mut problem = scene.discretize(&Scheme::default().particles([25]))?;
            problem.analysis_mut().newton.tangent_update = TangentUpdate::EveryIteration;
            let clock = Instant::now();
            let path = problem.run()?.completed()?;
            seconds[k] = clock.elapsed().as_secs_f64() / path.iterations as f64;
        }
        ratios.push(seconds[0] / seconds[1]);
    }
    ratios.sort_by(f64::total_cmp);
    Ok(ratios[2])
}

fn quarter_without_contact() -> Result<Scene<2>, rkpm::Error> {
    let outline = Outline::at([0.0, 0.0])
        .line("equator", [RADIUS, 0.0])
        .arc("outer", [0.0, RADIUS], [0.0, 0.0], Turn::Left)
        .close("axis");
    Ok(Scene::new(Region::new(outline)?, PlaneStrain, Rubber::mooney_rivlin(0.293, 0.177, 1410.0)?)
        .prescribe("equator", 1, 0.0)
        .prescribe("axis", 0, 0.0)
        .traction("outer", [0.0, 0.4]))
}

/// Forces over the closure, the cylinder at rest and squeezed, and the pressures under the plate.
fn pictures(out: &FilePath, problem: &Problem<2>, path: &rkpm::solve::EquilibriumPath) -> Result<(), Box<dyn Error>> {
    let reference = support::csv_columns(include_str!("../tests/reference/cylinder_between_plates.csv"));
    let mut curve = vec![[0.0, 0.0]];
    let mut pressures = Chart::new("Pressure under the plate").x("x [m]").y("pressure [MPa]");
    let mut table = Table::new(["closure_m", "force_kN_per_mm", "width_m", "peak_pressure_MPa"]);
    for step in &path.steps {
        let plate = problem.contact(&step.state, "plate")?;
        let closure = CLOSURES[4] * step.state.load;
        curve.push([closure, -2.0 * plate.force[1]]);
        table.push([closure, -2.0 * plate.force[1], 2.0 * plate.extent, plate.peak_pressure()])?;
        let line: Vec<[f64; 2]> =
            plate.points.iter().filter(|p| p.is_active).map(|p| [p.position[0], p.pressure]).collect();
        pressures = pressures.marked_line(format!("closure {closure:.2} m"), &line);
    }
    table.write(out.join("forces.csv"))?;
    pressures.write(out.join("pressure.svg"))?;
    let points: Vec<[f64; 2]> = reference[0].1.iter().zip(&reference[1].1).map(|(x, y)| [*x, *y]).collect();
    Chart::new("Rubber cylinder between plates")
        .x("closure [m]")
        .y("force [kN/mm]")
        .line("particles", &curve)
        .markers("finite elements", &points)
        .write(out.join("force.svg"))?;
    let deformed = support::deformed(problem, path.last())?;
    let height = RADIUS - 0.5 * CLOSURES[4];
    Chart::new("A quarter of the cylinder, closure 0.2 m")
        .x("x [m]")
        .y("y [m]")
        .with(Series::outlines("at rest", &support::cells(problem, problem.cells().positions())).colour(Colour::Grey))
        .with(Series::outlines("squeezed", &support::cells(problem, &deformed)).colour(Colour::Blue))
        .line("plate", &[[0.0, height], [0.35, height]])
        .equal_aspect()
        .size(700, 460)
        .write(out.join("shape.svg"))?;
    Ok(())
}
