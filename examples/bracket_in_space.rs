//! A bracket of tetrahedra with a hole and a fillet: force, reference by refinement, picture.
//!
//! GOAL: a part from a Gmsh file held and pushed by named faces, and how far its answer is from that of finer meshes.
//! GEOMETRY: an angle of 40 × 20 × 40 mm, 8 mm thick, fillet of 5 mm, hole of 8 mm in its foot (`meshes/make.py`).
//! BOUNDARY: base and bore are held, the top is moved by 6 mm away from the foot and held in height.
//! REFERENCE: the same on the mesh with each cell cut in eight.

#[path = "support/progress.rs"]
mod progress;
#[path = "support/mod.rs"]
mod support;

use rkpm::prelude::*;
use rkpm::scene::Field;
use support::Summary;

fn bracket(mesh: &Mesh<3>) -> Result<Problem<3>, rkpm::Error> {
    Scene::new(mesh, Solid, Rubber::mooney_rivlin(0.4, 0.1, 500.0)?) // MPa
        .hold("base")
        .hold("hole")
        .with(Condition::on("top").displacement([6.0, 0.0, 0.0]))
        .discretize(&Scheme::default())
}

fn main() -> Result<(), rkpm::Error> {
    let out = support::out_dir("bracket_in_space");
    let mesh = Mesh::<3>::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/meshes/bracket.msh"))?;
    let mut answers = Vec::new();
    for mesh in [mesh.clone(), mesh.refined()?] {
        let problem = bracket(&mesh)?;
        let path = problem.run_with(&mut progress::Progress::new())?.completed()?;
        let last = path.last();
        let force = problem.reaction(last, "top")?;
        println!(
            "{} particles, {} cells: {:.3} N along x, energy {:.3} N mm, {} iterations",
            mesh.points().len(),
            mesh.cell_count(),
            force[0],
            problem.energy(last)?,
            path.iterations
        );
        answers.push((force[0], problem.energy(last)?));
        let picture = problem.picture(last, Field::MisesStress)?.title("A bracket: von Mises stress [MPa]");
        picture.view(-50.0, 20.0).write(out.join(format!("bracket_{}.svg", mesh.points().len())))?;
        problem.vtk_grid(last)?.write(out.join(format!("bracket_{}.vtu", mesh.points().len())))?;
    }
    let mut summary = Summary::new();
    summary.record("force_N", answers[0].0, answers[1].0)?;
    summary.record("energy_Nmm", answers[0].1, answers[1].1)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
