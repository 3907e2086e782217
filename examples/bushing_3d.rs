//! A bonded bushing from a Gmsh file: torsional, axial and radial stiffness, and a radial stroke of 30 % of the wall.
//!
//! GOAL: stiffness from a mesh against closed forms; forces and moments in balance; large strokes.
//! GEOMETRY: the rubber between two rigid sleeves, radii 10 and 20 mm, a slice of 4 mm of a long bushing; hexahedra with
//! chords in place of arcs, 12 to a quarter (`meshes/make.py`).
//! BOUNDARY: both sleeves are bonded, the inner one is a rigid body that moves; torsion: free ends; axial: ends without radial motion; radial: ends
//! without axial motion, as in the middle of a long bushing.
//! REFERENCE: closed forms of small strains of incompressible rubber between radii a and b, length L, shear modulus µ:
//! torsion $4\pi\mu L/(a^{-2} - b^{-2})$, axial $2\pi\mu L/\ln(b/a)$, radial
//! $4\pi\mu L(a^2 + b^2)/((a^2 + b^2)\ln(b/a) - (b^2 - a^2))$.

#[path = "support/progress.rs"]
mod progress;
#[path = "support/mod.rs"]
mod support;

use std::f64::consts::PI;

use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use rkpm::scene::Field;
use support::Summary;

/// Radii and length \[mm\], shear and bulk modulus \[MPa\].
const A: f64 = 10.0;
const B: f64 = 20.0;
const L: f64 = 4.0;
const MU: f64 = 1.0;
const BULK: f64 = 2000.0;

/// The rubber between held outer and moved inner sleeve.
fn bushing(motion: Value<3, [f64; 3]>) -> Result<Scene<3>, rkpm::Error> {
    let mesh = Mesh::<3>::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/meshes/bushing.msh"))?;
    Ok(Scene::new(mesh, Solid, Rubber::neo_hookean(0.5 * MU, BULK)?)
        .hold("outer")
        .rigid("sleeve", "inner")
        .with(Condition::on("sleeve").displacement(motion)))
}

/// Force and moment on the inner sleeve, and what is left of them with the outer one and the ends.
fn results(scene: &Scene<3>, with_ends: bool) -> Result<([f64; 3], f64, f64), rkpm::Error> {
    let problem = scene.discretize(&Scheme::default())?;
    let path = problem.run()?.completed()?;
    let last = path.last();
    let mut places = vec!["sleeve", "outer"];
    places.extend(with_ends.then_some("ends"));
    let (mut force, mut moment, mut left) = ([0.0; 3], 0.0, [0.0; 6]);
    for place in places {
        let f = problem.reaction(last, place)?;
        let m = problem.moment(last, place, [0.0; 3])?;
        if place == "sleeve" {
            (force, moment) = (f.into(), m[2]);
        }
        for i in 0..3 {
            left[i] += f[i];
            left[3 + i] += m[i] / B;
        }
    }
    let size = force.iter().map(|f| f * f).sum::<f64>().sqrt().max((moment / B).abs());
    Ok((force, moment, left.iter().map(|x| x.abs()).fold(0.0, f64::max) / size))
}

fn main() -> Result<(), rkpm::Error> {
    let out = support::out_dir("bushing_3d");
    let mut summary = Summary::new();

    let angle = 1e-3;
    let turn = Value::motion(move |x: &Point<3>, load| {
        let (sin, cos) = (angle * load).sin_cos();
        [(cos - 1.0) * x[0] - sin * x[1], sin * x[0] + (cos - 1.0) * x[1], 0.0]
    });
    let (_, moment, left) = results(&bushing(turn)?, false)?;
    summary.record("torsion_Nmm_per_rad", moment / angle, 4.0 * PI * MU * L / (A.powi(-2) - B.powi(-2)))?;
    summary.note("torsion_imbalance", left)?;

    let scene = bushing(Value::from([0.0, 0.0, 0.01]))?.prescribe("ends", 0, 0.0).prescribe("ends", 1, 0.0);
    let (force, _, left) = results(&scene, true)?;
    summary.record("axial_N_per_mm", force[2] / 0.01, 2.0 * PI * MU * L / (B / A).ln())?;
    summary.note("axial_imbalance", left)?;

    let scene = bushing(Value::from([0.01, 0.0, 0.0]))?.prescribe("ends", 2, 0.0);
    let (force, _, left) = results(&scene, true)?;
    let squares = A * A + B * B;
    let radial = 4.0 * PI * MU * L * squares / (squares * (B / A).ln() - (B * B - A * A));
    summary.record("radial_N_per_mm", force[0] / 0.01, radial)?;
    summary.note("radial_imbalance", left)?;

    // 30 % of the wall.
    let scene = bushing(Value::from([3.0, 0.0, 0.0]))?.prescribe("ends", 2, 0.0);
    let problem = scene.discretize(&Scheme::default().stepping(Stepping::equal(6)))?;
    let path = problem.run_with(&mut progress::Progress::new())?.completed()?;
    support::print_doubts(&problem, &path)?;
    let mut table = Table::new(["u [mm]", "F [N]"]);
    let mut curve = vec![(0.0, 0.0)];
    for step in &path.steps {
        let (u, force) = (3.0 * step.state.load, problem.reaction(&step.state, "sleeve")?[0]);
        table.push([u, force])?;
        curve.push((u, force));
    }
    table.write(out.join("radial.csv"))?;
    Chart::new("A bushing, radially")
        .x("stroke [mm]")
        .y("force on 4 mm [N]")
        .marked_line("particles at the nodes", &curve)
        .dashed("small strains", &[(0.0, 0.0), (3.0, 3.0 * radial)])
        .write(out.join("radial.svg"))?;
    let picture = problem.picture(path.last(), Field::LargestStretch)?;
    picture.title("A bushing at 30 % of its wall").view(-90.0, 65.0).write(out.join("bushing.svg"))?;
    problem.write(&path, out.join("bushing.pvd"))?;
    summary.note("force_at_30_percent_N", curve.last().map_or(f64::NAN, |c| c.1))?;
    summary.note("iterations", path.iterations as f64)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
