//! An L-shaped bracket of rubber bent by its moved end: particles graded to its sharp corners.
//!
//! An L 10 × 10 with legs 4 wide in plane strain: the upper end is held, the other one is moved up by 2.
//!
//! `cargo run --release --example l_bracket [-- --out DIR]` prints a table beside quadratic elements and writes
//! `summary.csv`, the reaction against the number of particles and pictures of the cells. Lengths in cm, stresses in
//! MPa.

mod support;

use std::error::Error;
use std::path::Path as FilePath;

use rkpm::output::Chart;
use rkpm::output::chart::{Colour, Marker, Series};
use rkpm::prelude::*;
use rkpm::solve::State;
use support::Summary;

fn bracket() -> Result<Scene<2>, rkpm::Error> {
    let outline = Outline::at([0.0, 0.0])
        .line("outer", [10.0, 0.0])
        .line("moved", [10.0, 4.0])
        .line("inner", [4.0, 4.0])
        .line("inner", [4.0, 10.0])
        .line("held", [0.0, 10.0])
        .close("outer");
    let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?;
    Ok(Scene::new(Region::new(outline)?, PlaneStrain, rubber)
        .hold("held")
        .prescribe("moved", 0, 0.0)
        .prescribe("moved", 1, 2.0))
}

/// Where stresses are singular: the inner corner and those where a clamp ends.
const CORNERS: [[f64; 2]; 5] = [[4.0, 4.0], [10.0, 0.0], [10.0, 4.0], [0.0, 10.0], [4.0, 10.0]];

/// About `count` particles, six times finer at singular corners than two centimetres from them.
fn scheme(count: usize) -> Scheme {
    let grading = |x: &[f64]| {
        let distance = CORNERS.map(|c| (x[0] - c[0]).hypot(x[1] - c[1])).into_iter().fold(f64::INFINITY, f64::min);
        0.15 + 0.85 * (distance / 2.0).min(1.0)
    };
    Scheme::default().particles([count, 1]).graded(grading)
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("l_bracket");
    let reference = include_str!("../tests/reference/l_bracket.csv");
    let exact = ["reaction", "energy"].map(|name| support::csv_value(reference, name));
    let mut summary = Summary::new();
    let mut points = Vec::new();
    for count in [150, 600, 2400] {
        let problem = bracket()?.discretize(&scheme(count))?;
        let path = problem.run()?.completed()?;
        let reaction = problem.reaction(path.last(), "moved")?[1];
        summary.record(format!("reaction_{count}"), reaction, exact[0])?;
        summary.record(format!("energy_{count}"), problem.energy(path.last())?, exact[1])?;
        summary.note(format!("particles_{count}"), problem.cells().positions().len() as f64)?;
        summary.note(format!("iterations_{count}"), path.iterations as f64)?;
        points.push([problem.cells().positions().len() as f64, reaction]);
        if count == 600 {
            shape(&out, &problem, path.last())?;
        }
    }
    summary.note("change_150_600", (points[1][1] / points[0][1] - 1.0).abs())?;
    summary.note("change_600_2400", (points[2][1] / points[1][1] - 1.0).abs())?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Chart::new("Force on the moved end of the bracket")
        .x_log("particles")
        .y("reaction per thickness [MPa cm]")
        .marked_line("RKPM, default", &points)
        .horizontal("Q2/P1", exact[0])
        .write(out.join("reaction.svg"))?;
    println!("results in {}", out.display());
    Ok(())
}

/// The cells at rest and under load.
fn shape(out: &FilePath, problem: &Problem<2>, state: &State) -> Result<(), Box<dyn Error>> {
    let deformed = support::deformed(problem, state)?;
    Chart::new("L-shaped bracket, end moved by 2 cm")
        .x("x [cm]")
        .y("y [cm]")
        .with(Series::outlines("at rest", &support::cells(problem, problem.cells().positions())).colour(Colour::Grey))
        .with(Series::outlines("bent", &support::cells(problem, &deformed)).colour(Colour::Blue))
        .with(Series::markers("", &deformed).marker(Marker::Circle).colour(Colour::Blue))
        .equal_aspect()
        .size(640, 700)
        .write(out.join("shape.svg"))?;
    Ok(())
}
