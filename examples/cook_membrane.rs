//! Cook's membrane of nearly incompressible rubber: bending, shear and a singular corner at once. Where
//! plain schemes lock, the default is within a percent with 9 × 9 particles, its pressures free of
//! checkerboards.
//!
//! `cargo run --release --example cook_membrane [-- --out DIR]` prints a table and writes `summary.csv`,
//! the convergence of three quantities, and the deformed shape with its pressures. Lengths in mm,
//! stresses in MPa.

mod support;

use std::error::Error;
use std::path::Path as FilePath;

use rkpm::nalgebra::{Matrix3, Vector3};
use rkpm::output::chart::{Colour, Marker, Series};
use rkpm::output::{Chart, Table, VtkCell, VtkField, VtkGrid};
use rkpm::prelude::*;
use rkpm::solve::State;
use support::Summary;

const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]];
const SHEAR_MODULUS: f64 = 80.194;
const BULK_MODULUS: f64 = 4e5;

/// The membrane in plane strain: clamped on the left, a dead traction upwards on the right.
fn membrane() -> Result<Scene<2>, rkpm::Error> {
    let rubber = Rubber::neo_hookean(SHEAR_MODULUS / 2.0, BULK_MODULUS)?;
    Ok(Scene::new(Quadrilateral { corners: CORNERS }, PlaneStrain, rubber)
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.0, 6.25]))
}

/// Deflections of the upper corner and of the middle of the right edge, and the energy stored.
const QUANTITIES: [&str; 3] = ["tip", "mid", "energy"];

fn quantities(problem: &Problem<2>, state: &State) -> Result<[f64; 3], rkpm::Error> {
    let deflection = |x: [f64; 2]| problem.displacement(state, &x.into()).map(|u| u[1]);
    Ok([deflection([48.0, 60.0])?, deflection([48.0, 52.0])?, problem.energy(state)?])
}

fn run(scheme: &Scheme) -> Result<(Problem<2>, EquilibriumPath), rkpm::Error> {
    let problem = membrane()?.discretize(scheme)?;
    let path = problem.run()?.completed()?;
    Ok((problem, path))
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("cook_membrane");
    let reference = include_str!("../tests/reference/cook_membrane.csv");
    let exact = ["uy_48_60", "uy_48_52", "U_stored"].map(|name| support::csv_value(reference, name));

    let mut summary = Summary::new();
    for cells in [8, 16] {
        let (problem, path) = run(&Scheme::default().particles([cells + 1]))?;
        let found = quantities(&problem, path.last())?;
        for ((name, value), exact) in QUANTITIES.iter().zip(found).zip(exact) {
            summary.record(format!("{name}_n{cells}"), value, exact)?;
        }
        summary.note(format!("steps_n{cells}"), path.steps.len() as f64)?;
        summary.note(format!("iterations_n{cells}"), path.iterations as f64)?;
    }

    // Inner particles off their places by up to 30 % of the spacing: the worst of eight draws.
    let mut worst: f64 = 0.0;
    for seed in 1..=8 {
        let layout = Layout::Jittered { amount: 0.3, seed };
        let (problem, path) = run(&Scheme::default().particles([9]).layout(layout))?;
        let found = quantities(&problem, path.last())?;
        worst = found.iter().zip(exact).fold(worst, |worst, (value, exact)| worst.max((value / exact - 1.0).abs()));
    }
    summary.note("cook_jitter_worst_n8", worst)?;

    // The finite elements of this crate beside those of another; 8 quadratic ones have 17 nodes in a row.
    let peers = include_str!("../tests/reference/cook_membrane_elements.csv");
    for (name, order, nodes) in [("q1p0_n8", 1, 9), ("q1p0_n16", 1, 17), ("q1p0_n32", 1, 33), ("q2p1_n8", 2, 17)] {
        let (problem, path) = run(&Scheme::elements(order).particles([nodes]))?;
        summary.record(name, quantities(&problem, path.last())?[0], support::csv_value(peers, name))?;
    }
    summary.note("pressure_rms", pressures(&out)?)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;

    convergence(&out, exact)?;
    shape(&out)?;
    println!("results in {}", out.display());
    Ok(())
}

/// Root mean square of the difference between the pressures of the particles and of quadratic elements,
/// over that of the elements, on the quarter of the membrane farthest from the singular corner.
fn pressures(out: &FilePath) -> Result<f64, Box<dyn Error>> {
    // 9 nodes per direction: the macro cells of the particles are the elements.
    let (elements, elements_path) = run(&Scheme::elements(2).particles([9]))?;
    let (problem, path) = run(&Scheme::default().particles([9]))?;
    let coarse = elements.pressures(elements_path.last())?.ok_or("the elements have no pressures")?;
    let pressures = problem.pressures(path.last())?.ok_or("the particles have no pressures")?;
    let table = problem.body().table();

    // (distance from the clamped corner, weight, pressure of the particles, of the elements) at points.
    let mut points = Vec::new();
    for zone in 0..table.clusters().count() {
        let plane = plane(elements.body().table(), zone, &coarse)?;
        for point in table.clusters().points(zone) {
            let at = table.positions()[point];
            let distance = (at - Point::<2>::from(CORNERS[3])).norm();
            points.push((
                distance,
                table.weights()[point],
                pressures[point],
                plane.dot(&Vector3::new(1.0, at[0], at[1])),
            ));
        }
    }
    points.sort_by(|a, b| b.0.total_cmp(&a.0));
    let area: f64 = points.iter().map(|p| p.1).sum();
    let (mut seen, mut difference, mut size) = (0.0, 0.0, 0.0);
    for (_, weight, particles, elements) in points {
        if seen < area / 4.0 {
            difference += weight * (particles - elements).powi(2);
            size += weight * elements.powi(2);
        }
        seen += weight;
    }

    let mut grid = VtkGrid::new(table.positions(), (0..table.point_count()).map(VtkCell::Vertex).collect());
    grid.point_data.push(VtkField::scalars("pressure", pressures));
    grid.write(out.join("pressure.vtu"))?;
    Ok((difference / size).sqrt())
}

/// The linear function a + b x + c y that the pressures at the points of a zone lie on.
fn plane(table: &ShapeTable<2>, zone: usize, pressures: &[f64]) -> Result<Vector3<f64>, Box<dyn Error>> {
    let (mut matrix, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for point in table.clusters().points(zone) {
        let at = table.positions()[point];
        let row = Vector3::new(1.0, at[0], at[1]);
        matrix += row * row.transpose();
        right += row * pressures[point];
    }
    Ok(matrix.try_inverse().ok_or("the points of a zone lie on a line")? * right)
}

/// Errors of the three quantities against the number of cells.
fn convergence(out: &FilePath, exact: [f64; 3]) -> Result<(), Box<dyn Error>> {
    let mut table = Table::new(["scheme", "cells", "tip_mm", "mid_mm", "energy_N_mm"]);
    let mut chart = Chart::new("Cook's membrane: worst error of tip, middle and energy")
        .x_log("spacings of particles or nodes per direction")
        .y_log("largest relative error");
    let schemes = [
        ("RKPM, default", Scheme::default()),
        ("RKPM, no cure", Scheme::default().pressure_field(PressureField::Pointwise, 2)),
        ("Q1/P0", Scheme::elements(1)),
        ("Q2/P1", Scheme::elements(2)),
    ];
    for (name, scheme) in schemes {
        let mut points = Vec::new();
        for cells in [4, 8, 16, 32] {
            let (problem, path) = run(&scheme.clone().particles([cells + 1]))?;
            let found = quantities(&problem, path.last())?;
            let worst =
                found.iter().zip(exact).fold(0.0, |worst, (value, exact)| f64::max(worst, (value / exact - 1.0).abs()));
            points.push([cells as f64, worst]);
            let [tip, mid, energy] = found;
            table.push([name.to_string(), cells.to_string(), tip.to_string(), mid.to_string(), energy.to_string()])?;
        }
        chart = chart.marked_line(name, &points);
    }
    table.write(out.join("convergence.csv"))?;
    chart.horizontal("uncertainty of the reference", 2e-4).write(out.join("convergence.svg"))?;
    Ok(())
}

/// The membrane before and after, with its particles.
fn shape(out: &FilePath) -> Result<(), Box<dyn Error>> {
    let (problem, path) = run(&Scheme::default().particles([9]))?;
    let state = path.last();
    Chart::new("Cook's membrane, 9 × 9 particles")
        .x("x [mm]")
        .y("y [mm]")
        .with(
            Series::outlines("at rest", &support::grid_lines_at_rest(problem.lattice().expect("a lattice")))
                .colour(Colour::Grey),
        )
        .with(Series::outlines("", &support::grid_lines(&problem, state, 4)?).colour(Colour::Blue))
        .with(
            Series::markers("particles under load", &support::deformed(&problem, state)?)
                .marker(Marker::Circle)
                .colour(Colour::Blue),
        )
        .equal_aspect()
        .size(560, 600)
        .write(out.join("shape.svg"))?;
    problem.vtk_grid(state)?.write(out.join("shape.vtu"))?;
    Ok(())
}
