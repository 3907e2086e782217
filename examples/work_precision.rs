//! Error against time for four problems: the paper's scheme, the default and its relatives, and this
//! crate's own finite elements.
//!
//! `cargo run --release --example work_precision [-- --out DIR] [--peers FILE]` writes `points.csv` (a row per
//! run), `details.csv` (errors by quantity, seconds by phase, bytes), `work_precision.svg` and `summary.csv`.
//! Rows of other programs in FILE, with the columns of `points.csv`, are merged into all of them; the script
//! `benches/peers/run.sh` makes such a file. Set `RAYON_NUM_THREADS=1` to compare with single-threaded
//! programs.
//!
//! The tube is a one-dimensional problem here (radial kinematics); other programs solve it in two.

mod support;

use std::error::Error;
use std::path::PathBuf;

use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use rkpm::scene::{Dilation, Rule};
use rkpm::solve::StepControl;
use rkpm::study::{Quantity, Reference, Run, Study, WorkPrecision};
use rkpm::term::PressureField;
use support::Summary;

/// The name of the first series of every problem.
const DEFAULT: &str = "default";

/// A tube under inner pressure, its energy exact from an initial value problem.
fn tube() -> Result<Study, rkpm::Error> {
    let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?; // MPa
    let scene = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber).pressure(Side::Min, 0.46); // cm, MPa
    let reference = support::csv_columns(include_str!("../tests/reference/tube_inflation.csv"));
    let column = |name: &str| &reference.iter().find(|(n, _)| n == name).expect("the column is in the file").1;
    let row = column("p_MPa").iter().position(|p| (p - 0.46).abs() < 1e-12).expect("0.46 MPa is in the file");
    let energy = column("U_k1e5")[row] * 2.0 * std::f64::consts::PI; // of the whole turn
    let counts = [3, 5, 7, 9, 13, 17, 25, 33];
    let with = |scheme: Scheme| counts.map(|n| scheme.clone().particles([n]));
    WorkPrecision::new("tube", scene)
        .quantity(Quantity::energy(), Reference::Given { value: energy, uncertainty: 1e-9 })
        .series(DEFAULT, with(Scheme::default()))
        .series("quadratic", [5, 9, 17, 33].map(|n| Scheme::default().order(2).particles([n])))
        .series("smoothed cells", with(Scheme::default().rule(Rule::Smoothed { parts: 2 })))
        .series("paper, r = 1.6", with(Scheme::paper(1.6)))
        .series("Q1/P0", with(Scheme::elements(1)))
        .series("Q2/P1", [3, 5, 9, 17, 33].map(|n| Scheme::elements(2).particles([n])))
        .run()
}

/// A thin disk with a held rim, blown up to a deflection of one radius.
fn disk() -> Result<Study, rkpm::Error> {
    let rubber = Rubber::mooney_rivlin(0.5516, 0.1379, 689.5)?; // MPa
    let scene = Scene::new(Block::new([0.0, 0.0], [18.923, 0.635]), Axisymmetric, rubber) // cm
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((0, Side::Max))
        .pressure((1, Side::Min), 0.1035);
    let counts = [[11, 2], [15, 2], [21, 2], [25, 2], [29, 2], [41, 2], [61, 2], [81, 2], [121, 2]];
    let thin = |scheme: Scheme| counts.map(|n| scheme.clone().particles(n));
    let by_load = Stepping { control: StepControl::Load, ..Stepping::default() };
    let thick = [[21, 3], [41, 3], [81, 3], [121, 5]];
    WorkPrecision::new("disk", scene)
        .quantity(
            Quantity::displacement([0.0, 0.0], 1).named("w"),
            // The finest of several finite element meshes; the second number is its distance from the next.
            Reference::Given { value: 17.949637, uncertainty: 4.1e-4 },
        )
        .series(DEFAULT, thin(Scheme::default()))
        // Other programs step the load; the default controls the deflection where that is shorter.
        .series("default, load in control", thin(Scheme::default().stepping(by_load)))
        .series("default, 3 to 5 layers", thick.map(|n| Scheme::default().particles(n)))
        .series("paper, r = 1", thin(Scheme::paper(1.0).dilation(Dilation::Local(1.0)))[..6].to_vec())
        .series("Q1/P0", thin(Scheme::elements(1)))
        .series("Q2/P1", [[21, 3], [41, 3], [81, 3], [81, 5], [161, 5]].map(|n| Scheme::elements(2).particles(n)))
        .run()
}

/// Cook's membrane: bending, shear, a singular corner.
fn cook() -> Result<Study, rkpm::Error> {
    let rubber = Rubber::neo_hookean(40.097, 4e5)?; // MPa
    let corners = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]]; // mm
    let scene = Scene::new(Quadrilateral { corners }, PlaneStrain, rubber)
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.0, 6.25]);
    let reference = include_str!("../tests/reference/cook_membrane.csv");
    let given = |name| Reference::Given { value: support::csv_value(reference, name), uncertainty: 2e-4 };
    let counts = [5, 7, 9, 11, 13, 17, 21, 25, 33];
    let with = |scheme: Scheme, most: usize| counts.into_iter().take(most).map(move |n| scheme.clone().particles([n]));
    WorkPrecision::new("cook", scene)
        .quantity(Quantity::displacement([48.0, 60.0], 1).named("tip"), given("uy_48_60"))
        .quantity(Quantity::displacement([48.0, 52.0], 1).named("mid"), given("uy_48_52"))
        .quantity(Quantity::energy(), given("U_stored"))
        .series(DEFAULT, with(Scheme::default(), 9))
        .series("quadratic", with(Scheme::default().order(2), 7))
        .series("Gauss 2 × 2", with(gauss(2), 9))
        .series("paper, r = 1.6", with(Scheme::paper(1.6), 6))
        .series("Q1/P0", with(Scheme::elements(1), 9))
        .series("Q2/P1", with(Scheme::elements(2), 9))
        .run()
}

/// The default with plain Gauss points in each cell.
fn gauss(points: usize) -> Scheme {
    Scheme::default().rule(Rule::Gauss { zones: None, points: Some(points) }).pressure_field(PressureField::Linear, 2)
}

/// A bonded cube, its top moved aside by 30 %: three dimensions, singular edges. The axial force decides.
fn cube() -> Result<Study, rkpm::Error> {
    let rubber = Rubber::neo_hookean(40.097, 400_889.8)?; // MPa
    let top = || (2, Side::Max);
    let scene = Scene::new(Block::new([0.0; 3], [10.0; 3]), Solid, rubber) // mm
        .hold((2, Side::Min))
        .prescribe(top(), 0, 3.0)
        .prescribe(top(), 1, 0.0)
        .prescribe(top(), 2, 0.0);
    let reference = include_str!("../tests/reference/sheared_cube.csv");
    let given = |name, uncertainty| Reference::Given { value: support::csv_value(reference, name), uncertainty };
    let with = |scheme: Scheme, counts: &[usize]| -> Vec<Scheme> {
        counts.iter().map(|&n| scheme.clone().particles([n])).collect()
    };
    // Twice as fine at the edges as evenly spaced particles would be, and coarser between.
    let graded = Layout::Graded(std::sync::Arc::new(|_, t: f64| {
        let half = |t: f64| 0.5 * (2.0 * t).powf(1.5);
        if t < 0.5 { half(t) } else { 1.0 - half(1.0 - t) }
    }));
    let force = |component: usize, name: &str| Quantity::reaction((2, Side::Max), component).named(name);
    WorkPrecision::new("cube", scene)
        .quantity(Quantity::energy(), given("E", 4e-4))
        .quantity(force(0, "Fx"), given("Fx", 4e-4))
        .quantity(force(2, "Fz"), given("Fz", 2e-3))
        .series(DEFAULT, with(Scheme::default(), &[5, 7, 9, 11, 13]))
        .series("quadratic", with(Scheme::default().order(2), &[5, 7, 9]))
        .series("graded", with(Scheme::default().layout(graded), &[5, 7, 9, 11, 13]))
        .series("Q1/P0", with(Scheme::elements(1), &[5, 9, 13, 17]))
        .series("Q2/P1", with(Scheme::elements(2), &[5, 7, 9, 13]))
        .repeated(2)
        .run()
}

/// The rows of other programs for one problem; their series carry the program's name.
fn peers(table: &str, problem: &str) -> Vec<Run> {
    let mut lines = table.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let column = |name: &str| header.iter().position(|h| *h == name);
    lines
        .map(|line| line.split(',').collect::<Vec<_>>())
        .filter(|cells| column("problem").and_then(|k| cells.get(k)) == Some(&problem))
        .map(|cells| {
            let text = |name: &str| column(name).and_then(|k| cells.get(k)).copied().unwrap_or_default();
            let count = |name: &str| text(name).parse().unwrap_or(0);
            let number = |name: &str| text(name).parse().unwrap_or(f64::NAN);
            Run {
                series: text("scheme").to_string(),
                particles: count("particles"),
                unknowns: count("unknowns"),
                steps: count("steps"),
                iterations: count("iterations"),
                // Other programs factorise and solve once in each iteration.
                factorizations: count("iterations"),
                solutions: count("iterations"),
                error: number("error"),
                seconds: number("seconds"),
                ..Run::default()
            }
        })
        .collect()
}

/// `--out DIR` and `--peers FILE`.
fn arguments() -> (PathBuf, Option<PathBuf>) {
    let (mut out, mut peers) = (["target", "rkpm", "work_precision"].iter().collect(), None);
    let mut arguments = std::env::args_os().skip(1);
    while let Some(flag) = arguments.next() {
        match (flag.to_str(), arguments.next()) {
            (Some("--out"), Some(directory)) => out = directory.into(),
            (Some("--peers"), Some(file)) => peers = Some(file.into()),
            _ => {
                eprintln!("usage: work_precision [--out DIR] [--peers FILE]");
                std::process::exit(2);
            }
        }
    }
    (out, peers)
}

/// Errors at which programs are compared.
const TARGETS: [(&str, f64, f64); 6] = [
    ("tube", 1e-5, 50.0),
    ("disk", 1.5e-2, 5.0),
    ("cook", 5e-3, 3.0),
    ("cook", 2e-3, 2.0),
    ("cube", 3e-2, 6.0),
    ("cube", 2.5e-2, 40.0),
];

fn main() -> Result<(), Box<dyn Error>> {
    let (out, file) = arguments();
    let others = file.map(std::fs::read_to_string).transpose()?.unwrap_or_default();
    let mut studies = [tube()?, disk()?, cook()?, cube()?];
    let mut points = Table::new(studies[0].points().header);
    let mut summary = Summary::new();
    let mut charts: Vec<Chart> = Vec::new();
    for study in &mut studies {
        study.include(peers(&others, &study.name));
        println!("\n{}: worst of {}", study.name, study.quantities.join(", "));
        println!(
            "{:<24} {:>9} {:>8} {:>5} {:>5} {:>5} {:>5} {:>11} {:>14} {:>10}",
            "", "particles", "unknowns", "steps", "its", "fact", "solve", "error", "error_envelope", "ms"
        );
        for run in &study.runs {
            println!(
                "{:<24} {:>9} {:>8} {:>5} {:>5} {:>5} {:>5} {:>11.2e} {:>14.2e} {:>10.3}{}",
                run.series,
                run.particles,
                run.unknowns,
                run.steps,
                run.iterations,
                run.factorizations,
                run.solutions,
                run.error,
                run.error_envelope,
                1e3 * run.seconds,
                run.failure.as_deref().map(|why| format!("  {why}")).unwrap_or_default()
            );
        }
        points.rows.extend(study.points().rows);
        study.table().write(out.join(format!("details_{}.csv", study.name)))?;
        charts.push(if study.name == "tube" && !others.is_empty() {
            let name = format!("{} (1D here, 2D elsewhere)", study.name);
            Study { name, ..study.clone() }.chart().size(480, 420)
        } else {
            study.chart().size(480, 420)
        });
    }
    points.write(out.join("points.csv"))?;
    println!();
    for (problem, error, requested) in TARGETS {
        let study = studies.iter().find(|study| study.name == problem).expect("the problem is one of the four");
        let label = format!("{problem}_{error:e}");
        let Some(ours) = study.seconds_at(DEFAULT, error) else { continue };
        summary.note(format!("{label}_seconds"), ours)?;
        let mut programs: Vec<&str> = study.runs.iter().map(|run| run.series.as_str()).filter(|s| is_peer(s)).collect();
        programs.dedup();
        let fastest =
            programs.iter().filter_map(|p| Some((study.seconds_at(p, error)?, *p))).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((theirs, name)) = fastest {
            println!(
                "{problem} at {error:e}: {:.2} ms; {name} {:.2} ms: ratio {:.1} (requested {requested})",
                1e3 * ours,
                1e3 * theirs,
                theirs / ours
            );
            summary.note(format!("{label}_ratio"), theirs / ours)?;
        } else {
            println!("{problem} at {error:e}: {:.2} ms", 1e3 * ours);
        }
    }
    summary.write(out.join("summary.csv"))?;
    let svg = support::panels(&charts)?;
    std::fs::write(out.join("work_precision.svg"), svg)?;
    println!("\nresults are in {}", out.display());
    Ok(())
}

/// Series of other programs are named "program element".
fn is_peer(series: &str) -> bool {
    ["dolfinx", "felupe", "getfem", "ccx"].iter().any(|program| series.starts_with(program))
}
