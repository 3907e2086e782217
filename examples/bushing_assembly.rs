//! A rubber bushing pressed between two metal sleeves (paper §6.5): 56 particles beside 672 elements.
//!
//! `cargo run --release --example bushing_assembly [-- --out DIR]` prints a table like Table 1 of the paper
//! and writes `summary.csv`, that table, the meshes of Fig. 11, the shapes of Fig. 12 and files for ParaView. Lengths in cm,
//! stresses in MPa.
//!
//! **The ring before assembly is an assumption**: the paper gives the radii of the sleeves, 1.93 and
//! 4.37 cm, and shows the ring in a figure whose dimensions are lost. The ring here (inner radius 1.6,
//! outer radius 5.2, half height 3 cm) is a guess and nothing was fitted to the paper's 2.256 cm: its
//! displacements are not to be compared with those here, only how its schemes differ among themselves.
//!
//! The benchmark, Q2/P1 elements, is itself known to about 0.1 % only: over the last few per cent of the
//! way its free edge wrinkles from node to node and the state is unstable (negative pivots in the table),
//! which no other scheme does.

mod support;

use std::error::Error;
use std::path::Path as FilePath;

use rkpm::output::chart::{Colour, Marker, Series};
use rkpm::output::{Cell, Chart, PvdCollection, Table};
use rkpm::prelude::*;
use support::Summary;

/// Inner radius, outer radius and half height of the free ring.
const RING: [f64; 3] = [1.6, 5.2, 3.0];
/// Radii of the sleeves.
const SLEEVES: [f64; 2] = [1.93, 4.37];

/// The upper half of the ring between rigid sleeves without friction.
fn bushing() -> Result<Scene<2>, rkpm::Error> {
    let [inner, outer, height] = RING;
    let rubber = Rubber::neo_hookean(2.298, 1e3)?;
    Ok(Scene::new(Block::new([inner, 0.0], [outer, height]), Axisymmetric, rubber)
        .prescribe((0, Side::Min), 0, SLEEVES[0] - inner)
        .prescribe((0, Side::Max), 0, SLEEVES[1] - outer)
        .prescribe((1, Side::Min), 1, 0.0))
}

/// The same with sleeves that come in and touch where they touch.
fn between_sleeves() -> Result<Scene<2>, rkpm::Error> {
    let [inner, outer, height] = RING;
    let sleeve = |name: &str, radius: f64, normal: f64, to: f64| {
        RigidSurface::plane([radius, 0.0], [normal, 0.0]).moving([to - radius, 0.0]).named(name)
    };
    let rubber = Rubber::neo_hookean(2.298, 1e3)?;
    Ok(Scene::new(Block::new([inner, 0.0], [outer, height]), Axisymmetric, rubber)
        .prescribe((1, Side::Min), 1, 0.0)
        .contact((0, Side::Min), sleeve("inner sleeve", inner, 1.0, SLEEVES[0]))
        .contact((0, Side::Max), sleeve("outer sleeve", outer, -1.0, SLEEVES[1])))
}

/// One column of the paper's Table 1.
struct Column {
    /// The row of the summary.
    name: &'static str,
    label: &'static str,
    scheme: Scheme,
    counts: [usize; 2],
    /// By how much the paper's number differs from its own benchmark; NaN for what it has not.
    paper: f64,
}

fn columns() -> Vec<Column> {
    let column = |name, label, scheme, counts, paper| Column { name, label, scheme, counts, paper };
    // The paper steps 50 times.
    let paper = |r| Scheme::paper(r).stepping(Stepping::equal(50));
    vec![
        // The benchmark comes first: the others are compared with it.
        column(BENCHMARK, "Q2/P1, 12 × 14 elements", Scheme::elements(2), [25, 29], f64::NAN),
        column(DEFAULT, "default, 56 particles", Scheme::default(), [7, 8], f64::NAN),
        column("uz_outer_725", "default, 725 particles", Scheme::default(), [25, 29], f64::NAN),
        column(
            "uz_outer_56_paper_r0.8",
            "paper's scheme, r = 0.8, 56 particles",
            paper(0.8),
            [7, 8],
            2.224 / 2.256 - 1.0,
        ),
        column(
            "uz_outer_56_paper_r0.9",
            "paper's scheme, r = 0.9, 56 particles",
            paper(0.9),
            [7, 8],
            2.236 / 2.256 - 1.0,
        ),
        column(PAPER, "paper's scheme, r = 1.0, 56 particles", paper(1.0), [7, 8], 0.0),
        column("uz_outer_q1p0_42", "Q1/P0, 42 elements", Scheme::elements(1), [7, 8], 2.316 / 2.256 - 1.0),
        column("uz_outer_q1p0_168", "Q1/P0, 168 elements", Scheme::elements(1), [13, 15], 2.284 / 2.256 - 1.0),
        column("uz_outer_q1p0_672", "Q1/P0, 672 elements", Scheme::elements(1), [25, 29], 0.0),
    ]
}

const BENCHMARK: &str = "uz_outer_q2p1";
const DEFAULT: &str = "uz_outer_56";
const PAPER: &str = "uz_outer_56_paper_r1.0";

/// One analysis of the assembly with prescribed sleeves.
pub struct Assembled {
    column: Column,
    problem: Problem<2>,
    path: EquilibriumPath,
    /// How far the upper edge rises at the outer sleeve: the room that the assembled bushing takes.
    rise: f64,
}

/// All columns of Table 1; the benchmark comes first.
pub fn assemblies() -> Result<Vec<Assembled>, rkpm::Error> {
    let assemble = |column: Column| -> Result<Assembled, rkpm::Error> {
        let problem = bushing()?.discretize(&column.scheme.clone().particles(column.counts))?;
        // States of the paper's own scheme are unstable where it integrates at particles.
        let path = problem.run()?.reached()?;
        let rise = problem.displacement(path.last(), &[RING[1], RING[2]].into())?[1];
        Ok(Assembled { column, problem, path, rise })
    };
    columns().into_iter().map(assemble).collect()
}

/// All rows of `summary.csv`.
pub fn summary(assemblies: &[Assembled]) -> Result<Summary, Box<dyn Error>> {
    let mut summary = Summary::new();
    let benchmark = assemblies[0].rise;
    for Assembled { column, path, rise, .. } in assemblies {
        if column.name == BENCHMARK {
            summary.note(column.name, *rise)?;
        } else {
            summary.record(column.name, *rise, benchmark)?;
        }
        if column.name == DEFAULT {
            summary.note("steps_56", path.steps.len() as f64)?;
            summary.note("iterations_56", path.iterations as f64)?;
        }
    }
    for counts in [[7, 8], [13, 15], [25, 29]] {
        let rise = |scene: &Scene<2>| -> Result<(f64, Problem<2>, EquilibriumPath), rkpm::Error> {
            let problem = scene.discretize(&Scheme::default().particles(counts))?;
            let path = problem.run()?.completed()?;
            let rise = problem.displacement(path.last(), &[RING[1], RING[2]].into())?[1];
            Ok((rise, problem, path))
        };
        let (prescribed, held, held_path) = rise(&bushing()?)?;
        let (touching, problem, path) = rise(&between_sleeves()?)?;
        let particles = counts[0] * counts[1];
        summary.record(format!("uz_outer_{particles}_contact"), touching, prescribed)?;
        summary.note(format!("iterations_{particles}_contact"), path.iterations as f64)?;
        let (mut open, mut least) = (0, f64::INFINITY);
        for (name, side) in [("inner sleeve", Side::Min), ("outer sleeve", Side::Max)] {
            let sleeve = problem.contact(path.last(), name)?;
            // Closed trace functions obey the rows that prescribed faces obey, so both sleeves must carry what the prescribed ones do.
            let force = held.reaction(held_path.last(), (0, side))?[0];
            // MPa cm² are a tenth of a kN.
            let row = format!("{}_kN_{particles}_contact", name.replace(' ', "_"));
            summary.record(row, 0.1 * sleeve.force[0], 0.1 * force)?;
            open += sleeve.points.iter().filter(|point| !point.is_active).count();
            least = sleeve.points.iter().map(|point| point.pressure).fold(least, f64::min);
        }
        summary.note(format!("open_{particles}_contact"), open as f64)?;
        summary.note(format!("least_pressure_{particles}_contact"), least)?;
    }
    Ok(summary)
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("bushing_assembly");
    let assemblies = assemblies()?;
    let summary = summary(&assemblies)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    table(&assemblies)?.write(out.join("table_1.csv"))?;
    draw_meshes(&out, &assemblies)?;
    for (name, set) in [(DEFAULT, "particles"), (PAPER, "paper"), ("uz_outer_q1p0_672", "elements")] {
        for assembled in assemblies.iter().filter(|a| a.column.name == name) {
            draw_shapes(&out, set, assembled)?;
        }
    }
    println!("results in {}", out.display());
    Ok(())
}

/// Table 1.
fn table(assemblies: &[Assembled]) -> Result<Table, Box<dyn Error>> {
    let mut table = Table::new([
        "scheme",
        "nodes",
        "uz_outer_cm",
        "relative_difference",
        "relative_difference_in_paper",
        "steps",
        "iterations",
        "negative_pivots",
    ]);
    let benchmark = assemblies[0].rise;
    for Assembled { column, path, rise, .. } in assemblies {
        // Negative pivots: directions in which the state is unstable.
        let unstable = path.steps.last().and_then(|step| step.inertia).map_or(Cell::Empty, |i| Cell::from(i.negative));
        table.push([
            Cell::from(column.label),
            Cell::from(column.counts[0] * column.counts[1]),
            Cell::from(*rise),
            Cell::from(rise / benchmark - 1.0),
            Cell::from(column.paper),
            Cell::from(path.steps.len()),
            Cell::from(path.iterations),
            unstable,
        ])?;
    }
    Ok(table)
}

/// The three meshes and the particles of the free ring (Fig. 11).
fn draw_meshes(out: &FilePath, assemblies: &[Assembled]) -> Result<(), Box<dyn Error>> {
    let mut charts = Vec::new();
    let drawn = [DEFAULT, "uz_outer_q1p0_42", "uz_outer_q1p0_168", "uz_outer_q1p0_672"];
    for Assembled { column, problem, path, .. } in assemblies.iter().filter(|a| drawn.contains(&a.column.name)) {
        let chart = Chart::new(column.label).x("R [cm]").y("Z [cm]").equal_aspect();
        let particles = support::deformed(problem, &path.start)?;
        charts.push(if column.name == DEFAULT {
            chart.with(Series::markers("particles", &particles).marker(Marker::Circle))
        } else {
            chart
                .with(Series::outlines("elements", &support::grid_lines(problem, &path.start, 1)?).colour(Colour::Grey))
        });
    }
    std::fs::write(out.join("meshes.svg"), support::panels(&charts)?)?;
    Ok(())
}

/// The ring before and after assembly, with its particles where it has some (Fig. 12), and both for ParaView.
fn draw_shapes(out: &FilePath, set: &str, assembled: &Assembled) -> Result<(), Box<dyn Error>> {
    let Assembled { column, problem, path, .. } = assembled;
    let has_particles = set != "elements";
    let title = format!("Rubber ring before and after assembly, {}", column.label);
    let mut chart = Chart::new(title).x("R [cm]").y("Z [cm]");
    let mut animation = PvdCollection::default();
    let states = [("free ring (assumed)", &path.start, Colour::Grey), ("assembled", path.last(), Colour::Blue)];
    for (k, (name, state, colour)) in states.into_iter().enumerate() {
        let parts = if has_particles { 6 } else { 1 };
        chart = chart.with(Series::outlines(name, &support::grid_lines(problem, state, parts)?).colour(colour));
        if has_particles {
            let particles = support::deformed(problem, state)?;
            chart = chart.with(Series::markers("", &particles).marker(Marker::Circle).colour(colour));
        }
        let file = format!("bushing_{set}_{k}.vtu");
        problem.vtk_grid(state)?.write(out.join(&file))?;
        animation.push(state.load, file);
    }
    let [inner, outer] = SLEEVES;
    chart
        .vertical(format!("inner sleeve, {inner} cm"), inner)
        .vertical(format!("outer sleeve, {outer} cm"), outer)
        .equal_aspect()
        .write(out.join(format!("shapes_{set}.svg")))?;
    animation.write(out.join(format!("bushing_{set}.pvd")))?;
    Ok(())
}
