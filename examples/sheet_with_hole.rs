//! A thin sheet with a hole, stretched in its frame: plane stress beside a solid model.
//!
//! A square sheet 10 × 10, a tenth of its width thick, with a central hole of diameter 4; the frame that holds its edges is pulled to
//! 1.5 times its length one way and keeps its width. A quarter by symmetry, of the rubber of the paper. The thickness is free everywhere.
//!
//! `cargo run --release --example sheet_with_hole [-- --out DIR]` prints a table and writes `summary.csv` and a picture of the sheet at
//! rest and stretched. Lengths in cm, stresses in MPa.

mod support;

use std::error::Error;

use rkpm::output::Chart;
use rkpm::output::chart::{Colour, Series};
use rkpm::prelude::*;
use rkpm::solve::State;
use support::Summary;

const HALF_WIDTH: f64 = 5.0;
const RADIUS: f64 = 2.0;
const THICKNESS: f64 = 1.0;
const PULL: f64 = 0.5;

/// The quarter around the hole: axis 0 from the hole to the frame, axis 1 around, with the frame's corner in the middle.
fn quarter(s: f64, t: f64) -> [f64; 2] {
    let (sin, cos) = (std::f64::consts::FRAC_PI_2 * t).sin_cos();
    let frame = if t <= 0.5 { [1.0, 2.0 * t] } else { [2.0 - 2.0 * t, 1.0] };
    // Finer towards the hole.
    let s = 0.5 * s * (1.0 + s);
    let between = |hole: f64, frame: f64| RADIUS * hole * (1.0 - s) + HALF_WIDTH * frame * s;
    [between(cos, frame[0]), between(sin, frame[1])]
}

fn rubber() -> Result<Rubber, rkpm::error::MaterialError> {
    Rubber::yeoh(0.373, -0.031, 0.005, 1e5)
}

fn sheet() -> Result<Scene<2>, rkpm::Error> {
    let domain = Mapped(|unit: &Point<2>| quarter(unit[0], unit[1]).into());
    Ok(Scene::new(domain, PlaneStress { thickness: THICKNESS }, rubber()?)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 0, 0.0)
        .prescribe((0, Side::Max), 0, Value::field(|x| PULL * x[0]))
        .prescribe((0, Side::Max), 1, 0.0))
}

/// The upper half of the thickness.
fn solid() -> Result<Scene<3>, rkpm::Error> {
    let domain = Mapped(|unit: &Point<3>| {
        let [x, y] = quarter(unit[0], unit[1]);
        Point::<3>::new(x, y, 0.5 * THICKNESS * unit[2])
    });
    Ok(Scene::new(domain, Solid, rubber()?)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 0, 0.0)
        .prescribe((2, Side::Min), 2, 0.0)
        .prescribe((0, Side::Max), 0, Value::field(|x| PULL * x[0]))
        .prescribe((0, Side::Max), 1, 0.0))
}

/// Stored energy of the whole sheet, openings of the hole along and across the pull.
fn quantities(energy: f64, along: f64, across: f64) -> [(&'static str, f64); 3] {
    [("energy", 4.0 * energy), ("opening_along", 2.0 * along), ("opening_across", 2.0 * across)]
}

fn of_sheet(problem: &Problem<2>, state: &State) -> Result<[(&'static str, f64); 3], rkpm::Error> {
    let along = problem.displacement(state, &[RADIUS, 0.0].into())?[0];
    let across = problem.displacement(state, &[0.0, RADIUS].into())?[1];
    Ok(quantities(problem.energy(state)?, along, across))
}

/// The openings are means over the thickness, by Simpson's rule.
fn of_solid(problem: &Problem<3>, state: &State) -> Result<[(&'static str, f64); 3], rkpm::Error> {
    let mean = |x: f64, y: f64, component: usize| -> Result<f64, rkpm::Error> {
        let at = |z: f64| Ok::<_, rkpm::Error>(problem.displacement(state, &[x, y, z].into())?[component]);
        Ok((at(0.0)? + 4.0 * at(0.25 * THICKNESS)? + at(0.5 * THICKNESS)?) / 6.0)
    };
    Ok(quantities(2.0 * problem.energy(state)?, mean(RADIUS, 0.0, 0)?, mean(0.0, RADIUS, 1)?))
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("sheet_with_hole");
    let model = solid()?.discretize(&Scheme::elements(2).particles([13, 25, 5]))?;
    let path = model.run()?.completed()?;
    let reference = of_solid(&model, path.last())?;

    let mut summary = Summary::new();
    let schemes = [
        ("particles_9", Scheme::default().particles([9, 17])),
        ("particles_17", Scheme::default().particles([17, 33])),
        ("elements_17", Scheme::elements(2).particles([17, 33])),
    ];
    let mut last = None;
    for (name, scheme) in schemes {
        let problem = sheet()?.discretize(&scheme)?;
        let path = problem.run()?.completed()?;
        for ((quantity, value), (_, exact)) in of_sheet(&problem, path.last())?.into_iter().zip(reference) {
            summary.record(format!("{quantity}_{name}"), value, exact)?;
        }
        summary.note(format!("iterations_{name}"), path.iterations as f64)?;
        last = Some((problem, path));
    }
    // How far the solid model is from its own limit.
    let finer = solid()?.discretize(&Scheme::elements(2).particles([17, 33, 5]))?;
    let path = finer.run()?.completed()?;
    for ((quantity, value), (_, exact)) in of_solid(&finer, path.last())?.into_iter().zip(reference) {
        summary.record(format!("{quantity}_finer_solid"), value, exact)?;
    }
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;

    if let Some((problem, path)) = last {
        let mut chart = Chart::new("A sheet with a hole, stretched in its frame").x("x [cm]").y("y [cm]");
        for (name, state, colour) in [("at rest", &path.start, Colour::Grey), ("stretched", path.last(), Colour::Blue)]
        {
            let lines = support::grid_lines(&problem, state, 1)?;
            let lines: Vec<Vec<[f64; 2]>> =
                lines.iter().map(|line| line.iter().map(|x| [x[0], x[1]]).collect()).collect();
            chart = chart.with(Series::outlines(name, &lines).colour(colour));
        }
        chart.equal_aspect().write(out.join("sheet.svg"))?;
        problem.vtk_grid(path.last())?.write(out.join("sheet.vtu"))?;
    }
    println!("results in {}", out.display());
    Ok(())
}
