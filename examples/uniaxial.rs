//! A rubber sheet pulled to ten times its length and pressed to a tenth of it (paper §6.1): the stretch is
//! homogeneous, so that a consistent method must find it to rounding, however its particles lie.
//!
//! `cargo run --release --example uniaxial [-- --out DIR]` prints a table and writes `summary.csv`, the
//! curve of the reduced stress (Fig. 5) and the deformed shapes (Fig. 6) by the default and by the paper's scheme, and the same
//! test on a cube. Rows with `ball` have circular supports (3.27). Lengths in cm, stresses in MPa.

mod support;

use std::error::Error;
use std::path::Path as FilePath;

use rkpm::nalgebra::{Matrix3, Vector3};
use rkpm::output::chart::{Colour, Series};
use rkpm::output::{Cell, Chart, Table};
use rkpm::prelude::*;
use support::Summary;

const LENGTH: f64 = 1.0;
const HEIGHT: f64 = 0.25;
/// Particles of the irregular sets leave their places by up to this part of the spacing.
const JITTER_2D: Layout = Layout::Jittered { amount: 0.3, seed: 1 };
const JITTER_3D: Layout = Layout::Jittered { amount: 0.2, seed: 1 };

fn rubber() -> Result<Rubber, rkpm::error::MaterialError> {
    Rubber::yeoh(0.373, -0.031, 0.005, 1e5)
}

/// A sheet in plane strain whose ends are pulled apart and may contract; one particle is held sideways.
fn sheet(stretch: f64) -> Result<Scene<2>, rkpm::Error> {
    Ok(Scene::new(Block::new([0.0, 0.0], [LENGTH, HEIGHT]), PlaneStrain, rubber()?)
        .prescribe(Side::Min, 0, 0.0)
        .prescribe(Side::Max, 0, (stretch - 1.0) * LENGTH)
        .prescribe(Place::at([0.0, 0.0]), 1, 0.0))
}

/// An eighth of a cube: three faces on planes of symmetry, one pulled, two free.
fn cube(stretch: f64) -> Result<Scene<3>, rkpm::Error> {
    Ok(Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber()?)
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((0, Side::Max), 0, stretch - 1.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((2, Side::Min), 2, 0.0))
}

/// The exact stretches along the axes: the first is given, those of the `free` axes leave no stress on
/// their sides. Newton's method on P = 0, from the incompressible stretch.
fn exact_stretches(stretch: f64, free: &[usize]) -> Result<Vector3<f64>, rkpm::Error> {
    let material = rubber()?;
    let mut stretches = Vector3::new(stretch, 1.0, 1.0);
    for &axis in free {
        stretches[axis] = stretch.powf(-1.0 / free.len() as f64);
    }
    for _ in 0..50 {
        let response = material.response(&Matrix3::from_diagonal(&stretches));
        // All free sides are alike. Entry (4i, 4j) of the tangent is ∂P_ii/∂F_jj.
        let slope: f64 = free.iter().map(|&axis| response.tangent[(4 * free[0], 4 * axis)]).sum();
        let change = response.stress[(free[0], free[0])] / slope;
        for &axis in free {
            stretches[axis] -= change;
        }
        if change.abs() < 1e-15 * stretches[free[0]] {
            break;
        }
    }
    Ok(stretches)
}

/// What one analysis tells.
struct Outcome<const D: usize> {
    /// max |u − u_exact| / max |u_exact| over the particles.
    error: f64,
    /// Nominal stress P11 of the pulled face: its force over its first area.
    nominal: f64,
    path: EquilibriumPath,
    problem: Problem<D>,
}

fn run<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    stretches: &Vector3<f64>,
    area: f64,
) -> Result<Outcome<D>, rkpm::Error> {
    let problem = scene.discretize(scheme)?;
    // Compressed beyond Biot's limit the homogeneous state is exact and unstable.
    let path = problem.run()?.reached()?;
    let (mut farthest, mut largest) = (0.0_f64, 0.0_f64);
    for (x, u) in problem.cells().positions().iter().zip(problem.particle_displacements(path.last())?) {
        let exact = Point::<D>::from_fn(|i, _| (stretches[i] - 1.0) * x[i]);
        farthest = farthest.max((u - exact).norm());
        largest = largest.max(exact.norm());
    }
    let force = problem.reaction(path.last(), Side::Max)?[0];
    Ok(Outcome { error: farthest / largest, nominal: force / area, path, problem })
}

/// The reduced stress t / (λ² − λ⁻²) of Fig. 5, with the Cauchy stress t on the pulled face.
fn reduced_stress(outcome: &Outcome<2>, stretch: f64) -> Result<f64, rkpm::Error> {
    let moved = |y: f64| outcome.problem.displacement(outcome.path.last(), &[LENGTH, y].into());
    let height = HEIGHT + moved(HEIGHT)?[1] - moved(0.0)?[1];
    Ok(outcome.nominal * HEIGHT / height / difference(stretch))
}

/// λ² − λ⁻².
fn difference(stretch: f64) -> f64 {
    stretch.powi(2) - stretch.powi(-2)
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("uniaxial");
    let summary = summary()?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    let default = Scheme::default().particles([9, 3]);
    stress_curve(&out, &default)?;
    paper_curve(&out)?;
    shapes(&out, "", &default.layout(JITTER_2D))?;
    shapes(&out, "_paper", &paper(1.0).layout(JITTER_2D))?;
    for (stretch, name) in CUBES {
        let outcome = pulled_cube(stretch)?;
        outcome.problem.vtk_grid(outcome.path.last())?.write(out.join(format!("cube_{name}.vtu")))?;
    }
    println!("results in {}", out.display());
    Ok(())
}

/// Stretches of the cube.
const CUBES: [(f64, &str); 3] = [(0.1, "0.1"), (4.0, "4"), (10.0, "10")];

fn pulled_cube(stretch: f64) -> Result<Outcome<3>, rkpm::Error> {
    run(&cube(stretch)?, &Scheme::default().particles([5]).layout(JITTER_3D), &exact_stretches(stretch, &[1, 2])?, 1.0)
}

/// The columns of the exact solution: stretches, reduced stresses for k = 1e5 MPa and without compressibility.
fn reference() -> [Vec<f64>; 3] {
    let columns = support::csv_columns(include_str!("../tests/reference/uniaxial_plane_strain.csv"));
    let column = |name: &str| columns.iter().find(|c| c.0 == name).map(|c| c.1.clone()).unwrap_or_default();
    [column("lambda"), column("reduced_k1e5"), column("reduced_incompressible")]
}

/// The paper's scheme: 4 × 1 zones of Gauss points, conditions at particles.
fn paper(r: f64) -> Scheme {
    // At r = 0.5 a point on a column of particles is covered by nearly no other column: what the
    // guard of the moment matrix refuses has to pass here.
    Scheme::paper(r).integration_zones([4, 1]).rcond_limit(1e-15).particles([9, 3])
}

/// All rows of `summary.csv`.
pub fn summary() -> Result<Summary, Box<dyn Error>> {
    let [stretches, reduced, _] = reference();
    let default = Scheme::default().particles([9, 3]);
    let mut summary = Summary::new();
    for (stretch, name) in [(10.0, "10"), (0.1, "0.1")] {
        let exact = exact_stretches(stretch, &[1])?;
        let row = stretches.iter().position(|&s| s == stretch).ok_or("the reference lacks this stretch")?;
        for (layout, kind) in [(Layout::Regular, "regular"), (JITTER_2D, "irregular")] {
            let outcome = run(&sheet(stretch)?, &default.clone().layout(layout.clone()), &exact, HEIGHT)?;
            summary.note(format!("error_{kind}_{name}"), outcome.error)?;
            summary.note(format!("steps_{kind}_{name}"), outcome.path.steps.len() as f64)?;
            summary.note(format!("iterations_{kind}_{name}"), outcome.path.iterations as f64)?;
            if kind == "irregular" {
                summary.record(format!("reduced_stress_{name}"), reduced_stress(&outcome, stretch)?, reduced[row])?;
            }
            // The paper's error comes from integration and conditions that do not match, not from the particles.
            for r in DILATIONS {
                let outcome = run(&sheet(stretch)?, &paper(r).layout(layout.clone()), &exact, HEIGHT)?;
                summary.note(format!("paper_error_{kind}_{name}_r{r}"), outcome.error)?;
                let value = reduced_stress(&outcome, stretch)?;
                summary.record(format!("paper_reduced_stress_{kind}_{name}_r{r}"), value, reduced[row])?;
            }
            for (scheme, whose) in [(default.clone(), "default"), (paper(1.0), "paper")] {
                let scheme = scheme.dilation(BALLS).layout(layout.clone());
                let outcome = run(&sheet(stretch)?, &scheme, &exact, HEIGHT)?;
                summary.note(format!("ball_{whose}_error_{kind}_{name}"), outcome.error)?;
                let value = reduced_stress(&outcome, stretch)?;
                summary.record(format!("ball_{whose}_reduced_stress_{kind}_{name}"), value, reduced[row])?;
            }
        }
    }
    for (stretch, name) in CUBES {
        let outcome = pulled_cube(stretch)?;
        summary.note(format!("error_3d_{name}"), outcome.error)?;
        summary.note(format!("steps_3d_{name}"), outcome.path.steps.len() as f64)?;
        summary.note(format!("iterations_3d_{name}"), outcome.path.iterations as f64)?;
    }
    Ok(summary)
}

/// Normalised dilations of Fig. 5; at 0.5 itself particles at the end of a support are not covered.
const DILATIONS: [f64; 3] = [0.50001, 0.75, 1.0];

/// Circular supports (3.27) of twice the distance to the nearest particle: those of r = 1, for spacings are the same along both axes.
const BALLS: Dilation = Dilation::Neighbour { rank: 1, factor: 2.0 };

/// Fig. 5 by the paper's scheme: reduced stress against stretch for three dilations, regular and irregular.
fn paper_curve(out: &FilePath) -> Result<(), Box<dyn Error>> {
    let [stretches, _, incompressible] = reference();
    let mut table = Table::new(["layout", "r", "lambda", "reduced_stress_MPa"]);
    let exact: Vec<[f64; 2]> = stretches.iter().zip(&incompressible).map(|(&x, &y)| [x, y]).collect();
    let mut charts = Vec::new();
    for (layout, kind) in [(Layout::Regular, "regular"), (JITTER_2D, "irregular")] {
        let mut chart = Chart::new(format!("The paper's scheme, 9 × 3 {kind} particles"))
            .x_log("axial stretch λ")
            .y_log("reduced stress t / (λ² − λ⁻²) [MPa]")
            .line("exact, incompressible", &exact);
        for r in DILATIONS {
            let mut points = Vec::new();
            for &stretch in stretches.iter().step_by(4).filter(|&&stretch| stretch != 1.0) {
                let scheme = paper(r).layout(layout.clone());
                let outcome = run(&sheet(stretch)?, &scheme, &exact_stretches(stretch, &[1])?, HEIGHT)?;
                let value = reduced_stress(&outcome, stretch)?;
                table.push([Cell::from(kind), Cell::from(r), Cell::from(stretch), Cell::from(value)])?;
                points.push([stretch, value]);
            }
            chart = chart.markers(format!("r = {r:.2}"), &points);
        }
        charts.push(chart);
    }
    table.write(out.join("paper_curve.csv"))?;
    std::fs::write(out.join("paper_curve.svg"), support::panels(&charts)?)?;
    Ok(())
}

/// Fig. 5: reduced stress against stretch.
fn stress_curve(out: &FilePath, scheme: &Scheme) -> Result<(), Box<dyn Error>> {
    let [stretches, reduced, incompressible] = reference();
    let mut table = Table::new([
        "lambda",
        "reduced_stress_regular_MPa",
        "reduced_stress_irregular_MPa",
        "reduced_stress_exact_MPa",
        "reduced_stress_incompressible_MPa",
    ]);
    let mut points = [const { Vec::new() }; 2];
    for (row, (&stretch, &incompressible)) in stretches.iter().zip(&incompressible).enumerate() {
        if stretch == 1.0 {
            // At rest the reduced stress is 0/0.
            continue;
        }
        let exact = exact_stretches(stretch, &[1])?;
        // The stretches of the reference are rounded; here is the exact stress at just this one.
        let stress = rubber()?.response(&Matrix3::from_diagonal(&exact)).stress[(0, 0)];
        let mut cells = vec![stretch];
        for (k, layout) in [Layout::Regular, JITTER_2D].into_iter().enumerate() {
            let outcome = run(&sheet(stretch)?, &scheme.clone().layout(layout), &exact, HEIGHT)?;
            let value = reduced_stress(&outcome, stretch)?;
            cells.push(value);
            // Every fourth one is enough for the eye, in turn so that markers do not cover each other.
            if row % 4 == 2 * k {
                points[k].push([stretch, value]);
            }
        }
        cells.extend([stress / exact[1] / difference(stretch), incompressible]);
        table.push(cells)?;
    }
    table.write(out.join("curve.csv"))?;

    let line = |values: &[f64]| -> Vec<[f64; 2]> { stretches.iter().zip(values).map(|(&x, &y)| [x, y]).collect() };
    Chart::new("Rubber sheet in tension and compression, 9 × 3 particles")
        .x_log("axial stretch λ")
        .y_log("reduced stress t / (λ² − λ⁻²) [MPa]")
        .line("exact, k = 1e5 MPa", &line(&reduced))
        .dashed("exact, incompressible", &line(&incompressible))
        .markers("RKPM, regular", &points[0])
        .markers("RKPM, irregular", &points[1])
        .write(out.join("curve.svg"))?;
    Ok(())
}

/// Fig. 6: the irregular particles under tension and compression, by a scheme that file names tell.
fn shapes(out: &FilePath, whose: &str, scheme: &Scheme) -> Result<(), Box<dyn Error>> {
    for (name, title, stretches) in [
        ("tension", "Rubber sheet in tension", [1.0, 2.0, 4.0, 10.0]),
        ("compression", "Rubber sheet in compression", [1.0, 0.5, 0.2, 0.1]),
    ] {
        let by = if whose.is_empty() { "" } else { ", paper's scheme" };
        let mut chart = Chart::new(format!("{title}{by}")).x("x [cm]").y("y [cm]").equal_aspect();
        let colours = [Colour::Grey, Colour::Sky, Colour::Blue, Colour::Vermilion];
        // Tall pieces stand side by side, long ones lie above each other.
        let mut place = [0.0, 0.0];
        for (stretch, colour) in stretches.into_iter().zip(colours) {
            let exact = exact_stretches(stretch, &[1])?;
            let outcome = run(&sheet(stretch)?, scheme, &exact, HEIGHT)?;
            let state = outcome.path.last();
            let (width, height) = (stretch * LENGTH, exact[1] * HEIGHT);
            if name == "tension" {
                place[1] -= height + 0.3;
            }
            let moved = |x: &Point<2>| [x[0] + place[0], x[1] + place[1]];
            let lines: Vec<Vec<[f64; 2]>> = support::grid_lines(&outcome.problem, state, 1)?
                .iter()
                .map(|line| line.iter().map(moved).collect())
                .collect();
            chart = chart.with(Series::outlines(format!("λ = {stretch}"), &lines).colour(colour));
            if name == "compression" {
                place[0] += width + 0.3;
            }
            outcome.problem.vtk_grid(state)?.write(out.join(format!("sheet_{stretch}{whose}.vtu")))?;
        }
        chart.write(out.join(format!("{name}{whose}.svg")))?;
    }
    Ok(())
}
