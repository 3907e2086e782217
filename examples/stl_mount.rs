//! A rubber mount from two STL files beside the same part from a mesh.
//!
//! GOAL: rubber and insert as closed surfaces; the forces of both routes, each with two models.
//! GEOMETRY: the mount of `mount` [mm]: STL files of rubber and insert, here written from the mesh's own surface.
//! BOUNDARY: the base is held, the insert pressed down by 2 mm and aside by 1.5 mm; the plane y = 0 is one of symmetry.
//! REFERENCE: none for this mount. `mount_error_…` are errors of the force on half of the round mount of `mount`, a closed surface of 48 segments:
//! axisymmetric Q2/P1 elements, extrapolated, 295.0 to 295.4 N.
//!
//! `cargo run --release --example stl_mount [-- --out DIR]`.

#[path = "support/mount.rs"]
mod round;
#[path = "support/mod.rs"]
mod support;

use std::path::Path;

use rkpm::prelude::*;
use rkpm::scene::Field;
use support::Summary;

/// A binary STL file.
fn write_stl(solid: &Solid3, path: &Path) -> std::io::Result<()> {
    let mut bytes = vec![0u8; 80];
    bytes.extend((solid.facets().len() as u32).to_le_bytes());
    for facet in 0..solid.facets().len() {
        let numbers = std::iter::once(Point::<3>::zeros()).chain(solid.corners(facet));
        numbers.for_each(|x| x.iter().for_each(|x| bytes.extend((*x as f32).to_le_bytes())));
        bytes.extend([0; 2]);
    }
    std::fs::write(path, bytes)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = support::out_dir("stl_mount");
    std::fs::create_dir_all(&out)?;
    let mesh = Mesh::<3>::read(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/meshes/mount.msh"))?;
    for name in ["rubber", "insert"] {
        write_stl(&Solid3::of_mesh(&mesh.body(name)?)?, &out.join(format!("{name}.stl")))?;
    }

    // The rubber's surface where the insert's is: bonded.
    let (rubber, insert) = (Solid3::stl(out.join("rubber.stl"))?, Solid3::stl(out.join("insert.stl"))?);
    let bonded = (0..rubber.facets().len()).filter(|&facet| {
        let middle = rubber.corners(facet).iter().sum::<Point<3>>() / 3.0;
        insert.closest(&middle).distance < 1e-3
    });
    let bonded: Vec<u32> = bonded.map(|facet| facet as u32).collect();
    let mount = rubber
        .name("base", Select::plane([0.0, 0.0, 0.0], [0.0, 0.0, -1.0]))?
        .name("middle", Select::plane([0.0, 0.0, 0.0], [0.0, -1.0, 0.0]))?
        .name("insert", Select::facets(bonded))?;

    let law = || Rubber::yeoh(0.55, -0.05, 0.01, 1e3); // MPa
    let way = [1.5, 0.0, -2.0];
    let by_surface = || -> Result<Scene<3>, rkpm::Error> {
        Ok(Scene::new(&mount, Solid, law()?)
            .hold("base")
            .prescribe("middle", 1, 0.0)
            .with(Condition::on("insert").displacement(way).named("insert")))
    };
    let by_mesh = |mesh: Mesh<3>| -> Result<Scene<3>, rkpm::Error> {
        Ok(Scene::new(mesh, Solid, law()?)
            .hold("base")
            .prescribe("middle", 1, 0.0)
            .rigid("insert", "insert")
            .with(Condition::on("insert").displacement(way)))
    };

    let mut summary = Summary::new();
    for (route, scene, scheme) in [
        ("surface_coarse", by_surface()?, Scheme::default().spacing(2.5)),
        ("surface", by_surface()?, Scheme::default().spacing(1.8)),
        ("mesh_coarse", by_mesh(mesh.clone())?, Scheme::default()),
        ("mesh", by_mesh(mesh.refined()?)?, Scheme::default()),
    ] {
        let problem = scene.discretize(&scheme)?;
        let path = problem.run()?.completed()?;
        let force = problem.reaction(path.last(), "insert")? * 2.0; // half of the mount was modelled
        summary.note(format!("force_{route}"), -force[2])?;
        summary.note(format!("force_aside_{route}"), force[0])?;
        summary.note(format!("particles_{route}"), problem.cells().positions().len() as f64)?;
        let picture = problem.picture(path.last(), Field::LargestStretch)?.title("A mount, pressed and sheared");
        picture.write(out.join(format!("{route}.svg")))?;
    }
    let solid = round::half(48)?;
    for (particles, spacing) in [(900, 3.0), (2500, 2.0)] {
        let scene = Scene::new(&solid, Solid, round::rubber()?)
            .hold("base")
            .prescribe("middle", 1, 0.0)
            .with(Condition::on("insert").displacement([0.0, 0.0, -2.0]));
        let problem = scene.discretize(&Scheme::default().spacing(spacing))?;
        let path = problem.run()?.completed()?;
        let force = problem.reaction(path.last(), "base")?[2];
        summary.note(format!("mount_error_{particles}"), (force / round::FORCE - 1.0).abs())?;
    }
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
