//! A bonded pad pressed to half its height: its free face folds onto the plates.
//!
//! `cargo run --release --example pressed_pad [-- --out DIR]` prints a table and writes `summary.csv`, forces and pictures.
//! Lengths in mm, stresses in MPa, forces in N/mm; plane strain, a quarter by symmetry.
//!
//! The free face bulges so far that next to the plates it comes to lie on them: without contact material is squeezed
//! through the corner and every scheme stalls.

mod support;

use std::error::Error;

use rkpm::output::chart::{Colour, Series};
use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use support::Summary;

/// Half width, half height, and what each plate moves.
const PAD: [f64; 3] = [10.0, 10.0, 5.0];
const STEPS: usize = 10;

fn pad() -> Result<Scene<2>, rkpm::Error> {
    let [width, height, way] = PAD;
    let rubber = Rubber::neo_hookean(0.5, 1e3)?;
    // Stops of the load, for the curve.
    let break_points = Amplitude::table((0..=STEPS).map(|k| k as f64 / STEPS as f64).map(|x| (x, x)).collect())?;
    let plate = RigidSurface::plane([0.0, height], [0.0, -1.0]).moving_along([0.0, -way], break_points).named("plate");
    Ok(Scene::new(Block::new([0.0, 0.0], [width, height]), PlaneStrain, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 0, 0.0)
        .prescribe((1, Side::Max), 1, -way)
        .contact((0, Side::Max), plate))
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("pressed_pad");
    let mut summary = Summary::new();
    let mut table = Table::new(["particles", "steps", "factorisations", "load", "force_N_per_mm", "folded_mm"]);
    let mut curves = Chart::new("Bonded pad pressed to half its height").x("compression").y("force [N/mm]");
    let mut last = f64::NAN;
    for count in [9, 13, 17, 25, 33] {
        let problem = pad()?.discretize(&Scheme::default().particles([count, count]))?;
        let path = problem.run()?;
        let mut curve = vec![[0.0, 0.0]];
        for step in &path.steps {
            let plate = problem.contact(&step.state, "plate")?;
            let bonded = problem.reaction(&step.state, (1, Side::Max))?[1];
            let force = -2.0 * (bonded + plate.force[1]);
            curve.push([0.5 * step.state.load, force]);
            if step.state.load == path.last().load {
                let (particles, factors) = (problem.cells().positions().len(), path.iterations);
                table.push([
                    particles as f64,
                    path.steps.len() as f64,
                    factors as f64,
                    step.state.load,
                    force,
                    plate.extent,
                ])?;
                summary.note(format!("load_{count}"), step.state.load)?;
                summary.note(format!("force_{count}"), force)?;
                summary.note(format!("change_{count}"), (force / last - 1.0).abs())?;
                summary.note(format!("factorisations_{count}"), factors as f64)?;
                last = force;
            }
        }
        curves = curves.marked_line(format!("{count} × {count} particles"), &curve);
        if count == 25 {
            let height = PAD[1] - PAD[2] * path.last().load;
            Chart::new("A quarter of the pad at half its height")
                .x("x [mm]")
                .y("y [mm]")
                .with(Series::outlines("", &support::grid_lines(&problem, path.last(), 4)?).colour(Colour::Blue))
                .line("plate", &[[0.0, height], [20.0, height]])
                .equal_aspect()
                .size(800, 420)
                .write(out.join("shape.svg"))?;
        }
    }
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    table.write(out.join("forces.csv"))?;
    curves.write(out.join("force.svg"))?;
    println!("results in {}", out.display());
    Ok(())
}
