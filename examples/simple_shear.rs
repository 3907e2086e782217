//! A rubber block sheared to 200 % (paper §6.2): the volume stays, so that the exact stress is that of an
//! incompressible material, σ₁₂ = 2 K₁ γ.
//!
//! `cargo run --release --example simple_shear [-- --out DIR]` prints a table and writes `summary.csv`,
//! the stress curve (Fig. 7), the same by the paper's scheme, and the sheared shapes. Lengths in cm, stresses in MPa.

mod support;

use std::error::Error;
use std::path::Path as FilePath;

use rkpm::output::chart::{Colour, Series};
use rkpm::output::{Cell, Chart, Table};
use rkpm::prelude::*;
use rkpm::scene::ConstraintMethod;
use rkpm::solve::State;
use support::Summary;

/// Engineering shear strain at the full load.
const SHEAR: f64 = 2.0;
/// Equal steps on the way: γ = 0.05, 0.1, … 2, the strains of the reference.
const STEPS: usize = 40;

/// A sheet whose whole boundary follows F = I + γ e₁ ⊗ e₂.
fn sheet() -> Result<Scene<2>, rkpm::Error> {
    let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?;
    Ok(Scene::new(Block::new([0.0, 0.0], [1.0, 0.25]), PlaneStrain, rubber)
        .prescribe(Part::Whole, 0, Value::field(|x: &Point<2>| SHEAR * x[1]))
        .prescribe(Part::Whole, 1, 0.0))
}

/// Cauchy stress σ₁₂ at the point of the body where it is farthest from `exact`.
fn worst_stress(problem: &Problem<2>, state: &State, exact: f64) -> Result<f64, rkpm::Error> {
    let stresses = problem.stresses(state)?.into_iter().map(|stress| stress[(0, 1)]);
    Ok(stresses.max_by(|a, b| (a - exact).abs().total_cmp(&(b - exact).abs())).unwrap_or(f64::NAN))
}

/// Stresses over the steps by one scheme, each at the point where it is farthest from the exact one.
struct Sheared {
    problem: Problem<2>,
    path: EquilibriumPath,
    stresses: Vec<f64>,
}

fn shear(scheme: Scheme, exact: &[f64]) -> Result<Sheared, rkpm::Error> {
    let problem = sheet()?.discretize(&scheme.particles([9, 3]).stepping(Stepping::equal(STEPS)))?;
    let path = problem.run()?.completed()?;
    let steps = path.steps.iter().zip(exact);
    let stresses = steps.map(|(step, &exact)| worst_stress(&problem, &step.state, exact)).collect::<Result<_, _>>()?;
    Ok(Sheared { problem, path, stresses })
}

/// Regular and irregular particles.
fn layouts() -> [(&'static str, Layout); 2] {
    [("regular", Layout::Regular), ("irregular", Layout::Jittered { amount: 0.3, seed: 1 })]
}

/// Normalised dilations of Fig. 7; at 0.5 itself particles at the end of a support are not covered.
const DILATIONS: [f64; 3] = [0.50001, 1.0, 2.0];

/// The paper's scheme under one treatment of its boundary conditions.
fn paper(r: f64, constraint_method: ConstraintMethod, layout: Layout) -> Scheme {
    Scheme::paper(r).integration_zones([4, 1]).rcond_limit(1e-15).constraint_method(constraint_method).layout(layout)
}

/// Strains and exact stresses of the steps.
fn reference() -> [Vec<f64>; 2] {
    let columns = support::csv_columns(include_str!("../tests/reference/simple_shear.csv"));
    [columns[0].1.clone(), columns[1].1.clone()]
}

/// All rows of `summary.csv`.
pub fn summary() -> Result<Summary, Box<dyn Error>> {
    let [_, exact] = reference();
    let mut curves = Vec::new();
    for (_, layout) in layouts() {
        curves.push(shear(Scheme::default().layout(layout), &exact)?.stresses);
    }
    let mut summary = Summary::new();
    for strain in [0.5, 1.0, 1.5, 2.0] {
        // The worse of both sets of particles.
        let row = (strain / SHEAR * STEPS as f64).round() as usize - 1;
        let off = |k: usize| (curves[k][row] - exact[row]).abs();
        let worse = if off(1) > off(0) { 1 } else { 0 };
        summary.record(format!("sigma12_{strain}"), curves[worse][row], exact[row])?;
    }
    let last = exact[STEPS - 1];
    for r in DILATIONS {
        for (kind, layout) in layouts() {
            for (way, constraint_method) in
                [("multipliers", ConstraintMethod::Multipliers), ("transformation", ConstraintMethod::Transformation)]
            {
                let sheared = shear(paper(r, constraint_method, layout.clone()), &exact)?;
                summary.record(format!("paper_sigma12_2_{kind}_r{r}_{way}"), sheared.stresses[STEPS - 1], last)?;
            }
        }
    }
    // Circular supports (3.27) of twice the distance to the nearest particle, those of r = 1.
    let balls = Dilation::Neighbour { rank: 1, factor: 2.0 };
    for (kind, layout) in layouts() {
        let scheme = paper(1.0, ConstraintMethod::Transformation, layout).dilation(balls);
        summary.record(format!("ball_sigma12_2_{kind}"), shear(scheme, &exact)?.stresses[STEPS - 1], last)?;
    }
    Ok(summary)
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("simple_shear");
    let summary = summary()?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;

    let [strains, exact] = reference();
    let mut runs = Vec::new();
    for (_, layout) in layouts() {
        runs.push(shear(Scheme::default().layout(layout), &exact)?);
    }
    let mut table = Table::new(["gamma", "sigma12_regular_MPa", "sigma12_irregular_MPa", "sigma12_exact_MPa"]);
    for (row, (&strain, &exact)) in strains.iter().zip(&exact).enumerate() {
        table.push([strain, runs[0].stresses[row], runs[1].stresses[row], exact])?;
    }
    table.write(out.join("curve.csv"))?;
    paper_curves(&out, &strains, &exact)?;

    let line = |values: &[f64]| -> Vec<[f64; 2]> { strains.iter().zip(values).map(|(&x, &y)| [x, y]).collect() };
    // Regular and irregular in turn, so that markers do not cover each other.
    let every =
        |k: usize| -> Vec<[f64; 2]> { line(&runs[k].stresses).into_iter().skip(1 + 2 * k).step_by(4).collect() };
    Chart::new("Simple shear of rubber, 9 × 3 particles")
        .x("shear strain γ")
        .y("shear stress σ₁₂ [MPa]")
        .line("exact", &line(&exact))
        .markers("RKPM, regular", &every(0))
        .markers("RKPM, irregular", &every(1))
        .write(out.join("curve.svg"))?;

    // The shapes above each other.
    let Sheared { problem, path, .. } = &runs[1];
    let mut chart = Chart::new("Irregular particles in simple shear").x("x [cm]").y("y [cm]");
    for (place, colour) in [Colour::Grey, Colour::Blue, Colour::Vermilion].into_iter().enumerate() {
        let step = place * STEPS / 2;
        let state = if step == 0 { &path.start } else { &path.steps[step - 1].state };
        let moved = |x: &Point<2>| [x[0], x[1] - 0.35 * place as f64];
        let lines = support::grid_lines(problem, state, 1)?;
        let lines: Vec<Vec<_>> = lines.iter().map(|line| line.iter().map(moved).collect()).collect();
        let name = format!("γ = {:.1}", SHEAR * state.load);
        chart = chart.with(Series::outlines(name, &lines).colour(colour));
    }
    chart.equal_aspect().write(out.join("shapes.svg"))?;
    problem.vtk_grid(path.last())?.write(out.join("sheared.vtu"))?;
    println!("results in {}", out.display());
    Ok(())
}

/// Fig. 7 by the paper's scheme: the stress farthest from the exact one, for three dilations, by the transformation.
fn paper_curves(out: &FilePath, strains: &[f64], exact: &[f64]) -> Result<(), Box<dyn Error>> {
    let line = |values: &[f64]| -> Vec<[f64; 2]> { strains.iter().zip(values).map(|(&x, &y)| [x, y]).collect() };
    let mut table = Table::new(["layout", "r", "gamma", "sigma12_MPa"]);
    let mut charts = Vec::new();
    for (kind, layout) in layouts() {
        let mut chart = Chart::new(format!("The paper's scheme, 9 × 3 {kind} particles"))
            .x("shear strain γ")
            .y("shear stress σ₁₂, worst point [MPa]")
            .line("exact", &line(exact));
        for r in DILATIONS {
            let sheared = shear(paper(r, ConstraintMethod::Transformation, layout.clone()), exact)?;
            for (&strain, &stress) in strains.iter().zip(&sheared.stresses) {
                table.push([Cell::from(kind), Cell::from(r), Cell::from(strain), Cell::from(stress)])?;
            }
            let points: Vec<[f64; 2]> = line(&sheared.stresses).into_iter().skip(1).step_by(4).collect();
            chart = chart.markers(format!("r = {r:.1}"), &points);
        }
        charts.push(chart);
    }
    table.write(out.join("paper_curve.csv"))?;
    std::fs::write(out.join("paper_curve.svg"), support::panels(&charts)?)?;
    Ok(())
}
