//! A rubber bush between two steel sleeves, pushed sideways: load and deflection, a picture, ParaView files.
//!
//! `cargo run --release --example bush [-- --out DIR]` prints a table and writes it, `summary.csv`, a chart, a picture and
//! files for ParaView. Lengths in mm, stresses in MPa, forces in N per mm of the bush's length.
//!
//! GOAL: the part of the README, from its drawing to a force that can be signed.
//! GEOMETRY: the rubber's cross section, radii 10 and 20 mm; a long bush, so plane strain.
//! BOUNDARY: bonded to both sleeves; the outer one is fixed, the inner one moves down by 5 mm, half of the wall.
//! REFERENCE: felupe with 32 × 128 quadratic elements, known to 0.01 % (`tests/reference/bush.csv`); for small strokes the
//! closed form of incompressible rubber, $4\pi\mu(a^2 + b^2)/((a^2 + b^2)\ln(b/a) - (b^2 - a^2))$.

#[path = "support/progress.rs"]
mod progress;
#[path = "support/mod.rs"]
mod support;

use std::f64::consts::PI;

use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use rkpm::scene::Field;
use support::Summary;

/// Radii of the sleeves \[mm\], the stroke \[mm\], Yeoh's coefficients and the bulk modulus \[MPa\].
const INNER: f64 = 10.0;
const OUTER: f64 = 20.0;
const STROKE: f64 = 5.0;
const RUBBER: [f64; 4] = [0.5, -0.02, 0.002, 1000.0];
/// Distance between particles \[mm\].
const SPACING: f64 = 1.0;

fn bush() -> Result<Scene<2>, rkpm::Error> {
    let inner = Outline::circle("inner sleeve", [0.0, 0.0], INNER);
    let outer = Outline::circle("outer sleeve", [0.0, 0.0], OUTER);
    let [c10, c20, c30, bulk] = RUBBER;
    let section = Region::with_holes(outer, [inner])?;
    Ok(Scene::new(section, PlaneStrain, Rubber::yeoh(c10, c20, c30, bulk)?)
        .hold("outer sleeve")
        .with(Condition::on("inner sleeve").displacement([0.0, -STROKE])))
}

fn main() -> Result<(), rkpm::Error> {
    let out = support::out_dir("bush");
    let columns = support::csv_columns(include_str!("../tests/reference/bush.csv"));
    let (strokes, forces, uncertainty) = (&columns[0].1, &columns[1].1, columns[2].1[columns[2].1.len() - 1]);

    let scheme = Scheme::default().spacing(SPACING).stepping(Stepping::equal(strokes.len()));
    let problem = bush()?.discretize(&scheme)?;
    let path = problem.run_with(&mut progress::Progress::new())?.completed()?;
    support::print_doubts(&problem, &path)?;

    let (mut summary, mut table) = (Summary::new(), Table::new(["stroke_mm", "force_N_per_mm", "felupe_N_per_mm"]));
    let (mut curve, mut reference) = (vec![[0.0, 0.0]], vec![[0.0, 0.0]]);
    let mut last = f64::NAN;
    for ((step, &stroke), &known) in path.steps.iter().zip(strokes).zip(forces) {
        let force = -problem.reaction(&step.state, "inner sleeve")?[1];
        summary.record(format!("force_at_{stroke}_mm_N_per_mm"), force, known)?;
        table.push([stroke, force, known])?;
        curve.push([stroke, force]);
        reference.push([stroke, known]);
        last = force / known - 1.0;
    }
    summary.note("particles", problem.cells().positions().len() as f64)?;
    summary.note("iterations", path.iterations as f64)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    table.write(out.join("curve.csv"))?;

    let (squares, mu) = (INNER * INNER + OUTER * OUTER, 2.0 * RUBBER[0]);
    let small = 4.0 * PI * mu * squares / (squares * (OUTER / INNER).ln() - (OUTER * OUTER - INNER * INNER));
    Chart::new("A bush pushed sideways")
        .x("stroke [mm]")
        .y("force [N per mm of length]")
        .line("felupe, 32 × 128 elements", &reference)
        .markers("rkpm, particles 1 mm apart", &curve)
        .dashed("closed form, small strokes", &[[0.0, 0.0], [STROKE, small * STROKE]])
        .write(out.join("curve.svg"))?;
    let picture = |state, title: &str| Ok::<_, Error>(problem.picture(state, Field::LargestStretch)?.title(title));
    picture(&path.start, "undeformed")?
        .beside(picture(path.last(), "inner sleeve 5 mm down")?)
        .write(out.join("bush.svg"))?;
    problem.write(&path, out.join("bush.pvd"))?;
    println!(
        "results in {}; force at {STROKE} mm {:+.2} % from felupe's, which is known to {:.2} %",
        out.display(),
        100.0 * last,
        100.0 * uncertainty
    );
    Ok(())
}
