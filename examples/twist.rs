//! A rubber column turned by 180° between rigid ends: 1275 unknowns beside quadratic finite elements
//! with 8019.
//!
//! `cargo run --release --example twist [-- --out DIR]` prints a table and writes `summary.csv`, the
//! torque curve, a picture and the turned column for ParaView. Lengths in units of the column's width,
//! stresses in units of the shear modulus.

mod support;

use std::error::Error;
use std::f64::consts::PI;
use std::path::Path as FilePath;

use rkpm::output::chart::{Colour, Series};
use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use rkpm::solve::State;
use support::Summary;

const HEIGHT: f64 = 4.0;
const ANGLE: f64 = PI;
/// Bulk over shear modulus.
const STIFFNESS: f64 = 1e4;
/// Axis of the column.
const Z: usize = 2;

/// A column around the z axis: the lower end is held, the upper one turns as a rigid plate.
fn column() -> Result<Scene<3>, rkpm::Error> {
    let rubber = Rubber::neo_hookean(0.5, STIFFNESS)?; // shear modulus 2 A10 = 1
    let end = (Z, Side::Max);
    // A straight way to the last position would lead through the axis: particles have to run on circles.
    let turn = |load: f64| (ANGLE * load).sin_cos();
    Ok(Scene::new(Block::new([-0.5, -0.5, 0.0], [0.5, 0.5, HEIGHT]), Solid, rubber)
        .hold((Z, Side::Min))
        .prescribe(end, 0, Value::motion(move |x: &Point<3>, load| x[0] * (turn(load).1 - 1.0) - x[1] * turn(load).0))
        .prescribe(end, 1, Value::motion(move |x: &Point<3>, load| x[0] * turn(load).0 + x[1] * (turn(load).1 - 1.0)))
        .prescribe(end, Z, 0.0))
}

fn torque(problem: &Problem<3>, state: &State) -> Result<f64, rkpm::Error> {
    Ok(problem.moment(state, (Z, Side::Max), [0.0; 3])?[Z])
}

/// The largest |mean of J − 1| over the zones that share a pressure.
fn volume_change(problem: &Problem<3>, state: &State) -> Result<f64, rkpm::Error> {
    let gradients = problem.deformation_gradients(state)?;
    let table = problem.body().table();
    let zones = (0..table.clusters().count()).map(|zone| {
        let (mut volume, mut change) = (0.0, 0.0);
        for point in table.clusters().points(zone) {
            volume += table.weights()[point];
            change += table.weights()[point] * (gradients[point].determinant() - 1.0);
        }
        (change / volume).abs()
    });
    Ok(zones.fold(0.0, f64::max))
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("twist");
    let particles = Scheme::default().particles([5, 5, 17]);
    let elements = Scheme::elements(2).particles([9, 9, 33]);

    let problem = column()?.discretize(&particles)?;
    let path = problem.run()?.completed()?;
    let reference = column()?.discretize(&elements)?;
    let reference_path = reference.run()?.completed()?;
    let reference_torque = torque(&reference, reference_path.last())?;

    let mut summary = Summary::new();
    summary.note("unknowns", problem.model().unknowns() as f64)?;
    summary.note("unknowns_q2p1", reference.model().unknowns() as f64)?;
    summary.note("steps", path.steps.len() as f64)?;
    summary.note("iterations", path.iterations as f64)?;
    summary.record("torque", torque(&problem, path.last())?, reference_torque)?;
    summary.note("torque_q2p1", reference_torque)?;
    summary.note("zone_j", volume_change(&problem, path.last())?)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;

    problem.vtk_grid(path.last())?.write(out.join("twisted.vtu"))?;
    torque_curve(&out, &particles, &reference, &reference_path)?;
    picture(&out, &problem, path.last())?;
    println!("results in {}", out.display());
    Ok(())
}

/// Torque against angle in equal steps, beside the steps that the elements took.
fn torque_curve(
    out: &FilePath,
    particles: &Scheme,
    reference: &Problem<3>,
    reference_path: &EquilibriumPath,
) -> Result<(), Box<dyn Error>> {
    let problem = column()?.discretize(&particles.clone().stepping(Stepping::equal(12)))?;
    let path = problem.run()?.completed()?;
    let curve = |problem: &Problem<3>, path: &EquilibriumPath| -> Result<Vec<[f64; 2]>, rkpm::Error> {
        let states = std::iter::once(&path.start).chain(path.steps.iter().map(|step| &step.state));
        states.map(|state| Ok([180.0 * state.load, torque(problem, state)?])).collect()
    };
    let rkpm = curve(&problem, &path)?;
    let mut table = Table::new(["angle_degrees", "torque"]);
    for &[angle, torque] in &rkpm {
        table.push([angle, torque])?;
    }
    table.write(out.join("torque.csv"))?;
    Chart::new("Rubber column in torsion, k = 1e4 µ")
        .x("angle [°]")
        .y("torque / (µ · width³)")
        .marked_line("RKPM, 1275 unknowns", &rkpm)
        .markers("Q2/P1, 8019 unknowns", &curve(reference, reference_path)?)
        .write(out.join("torque.svg"))?;
    Ok(())
}

/// The column at rest and turned, as seen from the side: all facets between particles that face the eye.
fn picture(out: &FilePath, problem: &Problem<3>, state: &State) -> Result<(), Box<dyn Error>> {
    // An orthographic view: right and up of the picture in the coordinates of the column.
    let ahead = Point::<3>::new(1.0, 2.0, -0.7).normalize();
    let right = ahead.cross(&Point::<3>::z()).normalize();
    let up = right.cross(&ahead);
    let lattice = problem.lattice().expect("a scene on a block has a lattice");
    let outlines = |positions: &[Point<3>], shift: f64| {
        let mut facets: Vec<Vec<[f64; 2]>> = Vec::new();
        for axis in 0..3 {
            let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
            let cells = lattice.counts().map(|count| count - 1);
            for (end, i, j) in (0..cells[b]).flat_map(|i| (0..cells[c]).flat_map(move |j| [(0, i, j), (1, i, j)])) {
                // Around the outer normal of the facet.
                let around = if end == 1 { [(0, 0), (1, 0), (1, 1), (0, 1)] } else { [(0, 0), (0, 1), (1, 1), (1, 0)] };
                let corner = |(di, dj): (usize, usize)| {
                    let mut index = [end * cells[axis]; 3];
                    (index[b], index[c]) = (i + di, j + dj);
                    let x = positions[lattice.node(index)];
                    [x.dot(&right) + shift, x.dot(&up)]
                };
                let [p, q, r, s] = around.map(corner);
                let area = (r[0] - p[0]) * (s[1] - q[1]) - (r[1] - p[1]) * (s[0] - q[0]);
                if area > 0.0 {
                    facets.push(vec![p, q, r, s, p]);
                }
            }
        }
        facets
    };
    Chart::new("Rubber column turned by 180°")
        .with(Series::outlines("at rest", &outlines(lattice.positions(), 0.0)).colour(Colour::Grey))
        .with(Series::outlines("turned", &outlines(&support::deformed(problem, state)?, 2.0)).colour(Colour::Blue))
        .equal_aspect()
        .size(480, 520)
        .write(out.join("shape.svg"))?;
    Ok(())
}
