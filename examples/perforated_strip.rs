//! A perforated strip stretched to twice its length between held ends: particles graded to the hole.
//!
//! A strip 20 × 10 with a central hole of diameter 4 in plane strain, a quarter of it by symmetry, of the rubber of the
//! paper.
//!
//! `cargo run --release --example perforated_strip [-- --out DIR]` prints a table beside quadratic elements and
//! writes `summary.csv` and pictures of the cells at rest and under load. Lengths in cm, stresses in MPa.

mod support;

use std::error::Error;
use std::path::Path as FilePath;

use rkpm::output::Chart;
use rkpm::output::chart::{Colour, Marker, Series};
use rkpm::prelude::*;
use rkpm::solve::State;
use support::Summary;

/// The quarter: its lower and left sides are lines of symmetry.
fn strip() -> Result<Scene<2>, rkpm::Error> {
    let outline = Outline::at([2.0, 0.0])
        .line("x axis", [10.0, 0.0])
        .line("end", [10.0, 5.0])
        .line("side", [0.0, 5.0])
        .line("y axis", [0.0, 2.0])
        .arc("hole", [2.0, 0.0], [0.0, 0.0], Turn::Right);
    let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?;
    Ok(Scene::new(Region::new(outline)?, PlaneStrain, rubber)
        .prescribe("x axis", 1, 0.0)
        .prescribe("y axis", 0, 0.0)
        .prescribe("end", 0, 10.0)
        .prescribe("end", 1, 0.0))
}

/// About `count` particles, three times finer at the hole than four centimetres from it.
fn scheme(count: usize) -> Scheme {
    let grading = |x: &[f64]| 0.3 + 0.7 * ((x[0].hypot(x[1]) - 2.0) / 4.0).clamp(0.0, 1.0);
    // In one step, halved where it fails, some clouds end where the rim of the hole creases, pressed along itself.
    let quarters = Stepping { first: 0.25, ..Stepping::default() };
    Scheme::default().particles([count, 1]).graded(grading).stepping(quarters)
}

/// Mean stretch of the rim over the last 5° before the top of the hole.
fn stretch_at_hole(problem: &Problem<2>, state: &State) -> Result<f64, rkpm::Error> {
    let place = |degrees: f64| -> Result<(Point<2>, Point<2>), rkpm::Error> {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let x = Point::<2>::new(2.0 * cos, 2.0 * sin);
        Ok((x, x + problem.displacement(state, &x)?))
    };
    let (a, b) = (place(90.0)?, place(85.0)?);
    Ok((a.1 - b.1).norm() / (a.0 - b.0).norm())
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("perforated_strip");
    let reference = include_str!("../tests/reference/perforated_strip.csv");
    let exact = ["energy", "stretch_at_hole"].map(|name| support::csv_value(reference, name));
    let mut summary = Summary::new();
    for count in [150, 590] {
        let problem = strip()?.discretize(&scheme(count))?;
        let path = problem.run()?.completed()?;
        // At most 600.
        let name = if count == 590 { 600 } else { count };
        summary.record(format!("energy_{name}"), problem.energy(path.last())?, exact[0])?;
        summary.record(format!("stretch_at_hole_{name}"), stretch_at_hole(&problem, path.last())?, exact[1])?;
        summary.note(format!("particles_{name}"), problem.cells().positions().len() as f64)?;
        summary.note(format!("steps_{name}"), path.steps.len() as f64)?;
        summary.note(format!("iterations_{name}"), path.iterations as f64)?;
        summary.note(format!("rcond_{name}"), problem.certificate()?.smallest_rcond)?;
        if count == 590 {
            shape(&out, &problem, path.last())?;
        }
    }
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    println!("results in {}", out.display());
    Ok(())
}

/// The cells at rest and under load.
fn shape(out: &FilePath, problem: &Problem<2>, state: &State) -> Result<(), Box<dyn Error>> {
    let deformed = support::deformed(problem, state)?;
    Chart::new("Perforated strip, a quarter, stretched by 100 %")
        .x("x [cm]")
        .y("y [cm]")
        .with(Series::outlines("at rest", &support::cells(problem, problem.cells().positions())).colour(Colour::Grey))
        .with(Series::outlines("stretched", &support::cells(problem, &deformed)).colour(Colour::Blue))
        .with(Series::markers("", &deformed).marker(Marker::Circle).colour(Colour::Blue))
        .equal_aspect()
        .size(1000, 420)
        .write(out.join("shape.svg"))?;
    Ok(())
}
