//! A lip seal: a shaft with a chamfer is pushed through it, with friction.
//!
//! `cargo run --release --example lip_seal [-- --out DIR]` prints a table and writes `summary.csv`, forces and pictures.
//! Lengths in mm, stresses in MPa, forces in N of the full turn; a body of revolution.

mod support;

use std::error::Error;

use rkpm::output::chart::{Colour, Series};
use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use support::Summary;

const SHAFT: f64 = 10.0;
const WAY: f64 = 4.0;

/// The shaft in its meridian plane: it comes down with its chamfer first, from the side of the case, and opens the lip.
fn shaft() -> Profile {
    Profile::at([0.0, -0.6]).line([8.6, -0.6]).line([SHAFT, 2.2]).line([SHAFT, 40.0])
}

fn seal(friction: f64) -> Result<Scene<2>, rkpm::Error> {
    let lip = Outline::at([9.4, 0.5])
        .line("tip", [10.0, 0.0])
        .line("outside", [13.0, 2.6])
        .line("side", [13.0, 3.6])
        .line("case", [12.0, 3.6])
        .close("inside");
    let rubber = Rubber::mooney_rivlin(0.8, 0.2, 500.0)?;
    let surface = RigidSurface::profile(shaft()).moving([0.0, -WAY]).friction(friction);
    Ok(Scene::new(Region::new(lip)?, Axisymmetric, rubber)
        .hold("case")
        .hold("side")
        .contact("tip", surface.clone().named("shaft at the tip"))
        .contact("inside", surface.named("shaft at the inside")))
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("lip_seal");
    let mut summary = Summary::new();
    let mut table = Table::new(["friction", "way_mm", "axial_N", "radial_N", "width_mm", "peak_MPa"]);
    let mut chart = Chart::new("A shaft pushed through a lip seal").x("way of the shaft [mm]").y("axial force [N]");
    for friction in [0.0, 0.3] {
        let problem = seal(friction)?.discretize(&Scheme::default().spacing(0.16))?;
        let path = problem.run()?;
        let mut curve = vec![[0.0, 0.0]];
        let both = ["shaft at the tip", "shaft at the inside"];
        for step in &path.steps {
            let found = [problem.contact(&step.state, both[0])?, problem.contact(&step.state, both[1])?];
            let force = found[0].force + found[1].force;
            let width = found[0].extent + found[1].extent;
            let peak = found[0].peak_pressure().max(found[1].peak_pressure());
            let way = WAY * step.state.load;
            curve.push([way, force[1]]);
            table.push([friction, way, force[1], force[0], width, peak])?;
            if step.state.load == path.last().load {
                let name = |what: &str| format!("{what}_{friction:.1}");
                summary.note(name("load"), step.state.load)?;
                summary.note(name("radial_N"), force[0])?;
                summary.note(name("axial_N"), force[1])?;
                summary.note(name("width_mm"), width)?;
                summary.note(name("peak_MPa"), peak)?;
            }
        }
        summary.note(format!("particles_{friction:.1}"), problem.cells().positions().len() as f64)?;
        summary.note(format!("steps_{friction:.1}"), path.steps.len() as f64)?;
        summary.note(format!("factorisations_{friction:.1}"), path.iterations as f64)?;
        let work = problem.friction_work(&path, both[0])? + problem.friction_work(&path, both[1])?;
        summary.note(format!("friction_work_{friction:.1}"), work)?;
        chart = chart.marked_line(format!("friction {friction:.1}"), &curve);
        let positions = support::deformed(&problem, path.last())?;
        let travel = -WAY * path.last().load;
        let metal: Vec<[f64; 2]> = shaft().drawn(4).iter().map(|x| [x[0].max(7.5), (x[1] + travel).min(4.0)]).collect();
        Chart::new(format!("Lip seal on its shaft, friction {friction:.1}"))
            .x("R [mm]")
            .y("Z [mm]")
            .with(
                Series::outlines("at rest", &support::cells(&problem, problem.cells().positions()))
                    .colour(Colour::Grey),
            )
            .with(Series::outlines("on the shaft", &support::cells(&problem, &positions)).colour(Colour::Blue))
            .line("shaft", &metal)
            .equal_aspect()
            .size(640, 620)
            .write(out.join(format!("shape_{friction:.1}.svg")))?;
    }
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    table.write(out.join("forces.csv"))?;
    chart.write(out.join("force.svg"))?;
    println!("results in {}", out.display());
    Ok(())
}
