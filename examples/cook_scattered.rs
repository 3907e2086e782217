//! Cook's membrane from scattered particles: the default keeps its accuracy off the lattice, from every draw, and does
//! not lock.
//!
//! `cargo run --release --example cook_scattered [-- --out DIR]` prints a table and writes `summary.csv`, the errors of
//! all draws, and pictures of the cells at rest and under load. Lengths in mm, stresses in MPa.

mod support;

use std::error::Error;
use std::path::Path as FilePath;

use rkpm::output::chart::{Colour, Marker, Series};
use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use support::Summary;

const SHEAR_MODULUS: f64 = 80.194;
const BULK_MODULUS: f64 = 4e5;
const SEEDS: std::ops::RangeInclusive<u64> = 1..=8;

/// The membrane in plane strain: clamped on the left, a dead traction upwards on the right.
fn membrane(bulk_modulus: f64) -> Result<Scene<2>, rkpm::Error> {
    let outline = Outline::at([0.0, 0.0])
        .line("bottom", [48.0, 44.0])
        .line("right", [48.0, 60.0])
        .line("top", [0.0, 44.0])
        .close("left");
    let rubber = Rubber::neo_hookean(SHEAR_MODULUS / 2.0, bulk_modulus)?;
    Ok(Scene::new(Region::new(outline)?, PlaneStrain, rubber).hold("left").traction("right", [0.0, 6.25]))
}

/// Deflections of the upper corner and of the middle of the right edge, and the energy stored.
fn quantities(bulk_modulus: f64, scheme: &Scheme) -> Result<([f64; 3], usize), rkpm::Error> {
    let problem = membrane(bulk_modulus)?.discretize(scheme)?;
    let path = problem.run()?.completed()?;
    let deflection = |x: [f64; 2]| problem.displacement(path.last(), &x.into()).map(|u| u[1]);
    let found = [deflection([48.0, 60.0])?, deflection([48.0, 52.0])?, problem.energy(path.last())?];
    Ok((found, problem.cells().positions().len()))
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("cook_scattered");
    let reference = include_str!("../tests/reference/cook_membrane.csv");
    let exact = ["uy_48_60", "uy_48_52", "U_stored"].map(|name| support::csv_value(reference, name));

    let mut summary = Summary::new();
    let mut table = Table::new(["particles", "seed", "tip_mm", "mid_mm", "energy_N_mm", "largest_error"]);
    let mut chart = Chart::new("Cook's membrane, scattered particles: worst of tip, middle and energy")
        .x_log("particles")
        .y_log("largest relative error");
    let mut falling = 0;
    let mut worst = [0.0f64; 2];
    for seed in SEEDS {
        let mut points = Vec::new();
        for (k, count) in [9, 17, 33].into_iter().enumerate() {
            let (found, particles) = quantities(BULK_MODULUS, &Scheme::default().particles([count]).seed(seed))?;
            let error = found.iter().zip(exact).map(|(v, e)| (v / e - 1.0).abs()).fold(0.0, f64::max);
            if k < 2 {
                worst[k] = worst[k].max(error);
            }
            points.push([particles as f64, error]);
            let [tip, mid, energy] = found;
            let row = [particles as f64, seed as f64, tip, mid, energy, error];
            table.push(row)?;
        }
        falling += usize::from(points[1][1] < points[0][1]);
        chart = chart.with(Series::line(if seed == 1 { "eight draws" } else { "" }, &points).colour(Colour::Blue));
    }
    summary.note("worst_81", worst[0])?;
    summary.note("worst_289", worst[1])?;
    summary.note("seeds_that_fall", falling as f64)?;

    // The energy over k / µ = 10 … 1e6, relative to that at the largest, less what compressibility explains: the
    // same on 33² particles.
    let mut spread: f64 = 0.0;
    let mut errors = Vec::new();
    for ratio in [1e1, 1e2, 1e3, 1e4, 1e5, 1e6] {
        let bulk = ratio * SHEAR_MODULUS;
        let (coarse, _) = quantities(bulk, &Scheme::default().particles([9]).seed(1))?;
        let (fine, _) = quantities(bulk, &Scheme::default().particles([33]).seed(1))?;
        errors.push([ratio, 100.0 * (coarse[0] / fine[0] - 1.0)]);
    }
    for a in &errors {
        for b in &errors {
            spread = spread.max((a[1] - b[1]).abs());
        }
    }
    summary.note("locking_spread", spread)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    table.write(out.join("errors.csv"))?;
    chart.horizontal("uncertainty of the reference", 2e-4).write(out.join("errors.svg"))?;
    Chart::new("Tip of the membrane with 81 particles against 1089")
        .x_log("bulk modulus / shear modulus")
        .y("difference [%]")
        .marked_line("seed 1", &errors)
        .write(out.join("locking.svg"))?;
    shape(&out)?;
    println!("results in {}", out.display());
    Ok(())
}

/// The cells at rest and under load.
fn shape(out: &FilePath) -> Result<(), Box<dyn Error>> {
    let problem = membrane(BULK_MODULUS)?.discretize(&Scheme::default().particles([17]).seed(1))?;
    let path = problem.run()?.completed()?;
    let deformed = support::deformed(&problem, path.last())?;
    Chart::new("Cook's membrane, about 289 scattered particles")
        .x("x [mm]")
        .y("y [mm]")
        .with(Series::outlines("at rest", &support::cells(&problem, problem.cells().positions())).colour(Colour::Grey))
        .with(Series::outlines("under load", &support::cells(&problem, &deformed)).colour(Colour::Blue))
        .with(Series::markers("", &deformed).marker(Marker::Circle).colour(Colour::Blue))
        .equal_aspect()
        .size(560, 600)
        .write(out.join("shape.svg"))?;
    Ok(())
}
