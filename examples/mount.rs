//! A rubber mount from a Gmsh file: load and deflection, the picture, ParaView files.
//!
//! GOAL: from a file with named parts to force, stiffness and stretches in few lines.
//! GEOMETRY: half of a cone of rubber on a base plate with a steel insert bonded into it [mm]; `meshes/make.py`.
//! BOUNDARY: the base is held; the insert is rigid, pressed down by 4 mm and then aside by 3 mm without turning; the plane
//! y = 0 is one of symmetry.
//! REFERENCE: none for the mesh; `bushing_3d` has closed forms. Beside it a round mount as an axisymmetric outline, its insert pressed down by
//! 2 mm: graded Q2/P1 elements, extrapolated, 295.0 to 295.4 N on half a turn. `error_…` are means of seven spacings within 6 %, because
//! forces scatter with the places of particles.

#[path = "support/progress.rs"]
mod progress;
#[path = "support/mount.rs"]
mod round;
#[path = "support/mod.rs"]
mod support;

use rkpm::prelude::*;
use rkpm::scene::Field;
use support::Summary;

/// The error of the force on the round mount with particles some spacing apart, a part of the force, and their number: means of seven spacings.
fn error_around(spacing: f64) -> Result<[f64; 2], rkpm::Error> {
    let factors = [0.94, 0.96, 0.98, 1.0, 1.02, 1.04, 1.06];
    let mut sums = [0.0; 2];
    for factor in factors {
        let down = |part: &str| Condition::on(part).displacement([0.0, -2.0]);
        let scene = Scene::new(round::section(false)?, Axisymmetric, round::rubber()?)
            .hold("base")
            .prescribe("axis", 0, 0.0)
            .with(down("wall"))
            .with(down("floor"));
        let problem = scene.discretize(&Scheme::default().spacing(factor * spacing))?;
        let path = problem.run()?.completed()?;
        // Half a turn.
        let force = problem.reaction(path.last(), "base")?[1].abs() / 2.0;
        sums[0] += (force / round::FORCE - 1.0).abs();
        sums[1] += problem.cells().positions().len() as f64;
    }
    Ok(sums.map(|sum| sum / factors.len() as f64))
}

fn main() -> Result<(), rkpm::Error> {
    let out = support::out_dir("mount");
    let mount = Mesh::<3>::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/meshes/mount.msh"))?.refined()?;
    println!("rubber {:.0} mm³, insert {:.0} mm³", mount.measure("rubber")?, mount.measure("insert")?);
    // Down, then aside.
    let way = |load: f64| [3.0 * (2.0 * load - 1.0).max(0.0), 0.0, -4.0 * (2.0 * load).min(1.0)];
    let scene = Scene::new(mount, Solid, Rubber::yeoh(0.55, -0.05, 0.01, 1e3)?) // MPa
        .hold("base")
        .prescribe("middle", 1, 0.0)
        .rigid("insert", "insert")
        .with(Condition::on("insert").displacement(Value::motion(move |_: &Point<3>, load| way(load))));
    let scheme = Scheme::default().stepping(Stepping { first: 0.125, largest: 0.125, ..Stepping::default() });
    let problem = scene.discretize(&scheme)?;
    let path = problem.run_with(&mut progress::Progress::new())?.completed()?;
    support::print_doubts(&problem, &path)?;
    problem.write(&path, out.join("mount.pvd"))?; // and mount.csv: forces, moments and displacements, step by step
    let last = path.last();
    problem.picture(last, Field::LargestStretch)?.title("A mount, pressed and sheared").write(out.join("mount.svg"))?;
    let force = problem.reaction(last, "insert")? * 2.0; // half of the mount was modelled
    let tilt = problem.moment(last, "insert", [3.0, 0.0, 24.0])?[1] * 2.0;
    let mut summary = Summary::new();
    summary.note("force_down_N", -force[2])?;
    summary.note("force_aside_N", force[0])?;
    summary.note("moment_Nmm", tilt)?;
    summary.note("iterations", path.iterations as f64)?;
    for (name, spacing) in [("coarse", 3.0), ("middle", 2.04), ("fine", 1.01)] {
        let [error, particles] = error_around(spacing)?;
        summary.note(format!("error_{name}"), error)?;
        summary.note(format!("particles_{name}"), particles)?;
    }
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
