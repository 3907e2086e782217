//! A rubber mount from a Gmsh file: load and deflection, the picture, ParaView files.
//!
//! GOAL: from a file with named parts to force, stiffness and stretches in few lines.
//! GEOMETRY: half of a cone of rubber on a base plate with a steel insert bonded into it [mm]; `meshes/make.py`.
//! BOUNDARY: the base is held, the insert pressed down by 4 mm and then aside by 3 mm; the plane y = 0 is one of symmetry.
//! REFERENCE: none; `bushing_3d` has closed forms.

#[path = "support/progress.rs"]
mod progress;
#[path = "support/mod.rs"]
mod support;

use rkpm::output::{PvdCollection, Summary, Table};
use rkpm::prelude::*;
use rkpm::scene::Field;

fn main() -> Result<(), rkpm::Error> {
    let out = support::out_dir("mount");
    let mount = Mesh::<3>::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/meshes/mount.msh"))?;
    println!("rubber {:.0} mm³, insert {:.0} mm³", mount.measure("rubber")?, mount.measure("insert")?);
    let rubber = mount.body("rubber")?;
    // Down, then aside.
    let way = |load: f64| [3.0 * (2.0 * load - 1.0).max(0.0), 0.0, -4.0 * (2.0 * load).min(1.0)];
    let scene = Scene::on(rubber, Solid, Rubber::yeoh(0.55, -0.05, 0.01, 1e3)?) // MPa
        .hold("base")
        .prescribe("middle", 1, 0.0)
        .with(Condition::on("insert").displacement(Value::motion(move |_: &Point<3>, load| way(load))));
    let scheme = Scheme::default().stepping(Stepping { first: 0.125, largest: 0.125, ..Stepping::default() });
    let problem = scene.discretize(&scheme)?;
    let path = problem.run(&mut progress::Progress::new())?.completed()?;

    let mut curve = Table::new(["load", "u_x [mm]", "u_z [mm]", "F_x [N]", "F_z [N]"]);
    let mut films = PvdCollection::default();
    for (number, step) in path.steps.iter().enumerate() {
        // Half of the mount was modelled.
        let (u, force) = (way(step.state.load), problem.reaction(&step.state, "insert")? * 2.0);
        curve.push([step.state.load, u[0], u[2], force[0], force[2]])?;
        let file = out.join(format!("mount_{number}.vtu"));
        problem.vtk_grid(&step.state)?.write(&file)?;
        films.push(step.state.load, file);
    }
    films.write(out.join("mount.pvd"))?;
    curve.write(out.join("mount.csv"))?;
    let last = path.last();
    problem.picture(last, Field::LargestStretch)?.title("A mount, pressed and sheared").write(out.join("mount.svg"))?;
    let force = problem.reaction(last, "insert")? * 2.0;
    let mut summary = Summary::new();
    summary.note("force_down_N", -force[2])?;
    summary.note("force_aside_N", force[0])?;
    summary.note("iterations", path.iterations as f64)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
