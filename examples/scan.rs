//! Stiffness against porosity of a block with pores, from voxels as a scan has them.
//!
//! GOAL: from a stack of voxels and a threshold to stiffness.
//! GEOMETRY: a cube of 1 mm with eight round pores; 40 voxels a side, their values falling from the pores' middles outwards.
//! BOUNDARY: the lower face is held, the upper one pressed by 2 % without moving aside.
//! REFERENCE: none; the stiffness of the cube without pores is 1.
//!
//! `cargo run --release --example scan [-- --out DIR]`.

#[path = "support/mod.rs"]
mod support;

use rkpm::output::Chart;
use rkpm::prelude::*;
use rkpm::scene::Field;
use support::Summary;

const SIDE: usize = 40;
const PRESSED: f64 = 0.02;

/// A scan: the distance from the nearest pore's middle.
fn scanned() -> Vec<f64> {
    let off = |k: usize| {
        let x = (k as f64 + 0.5) / SIDE as f64;
        if x < 0.5 { x - 0.25 } else { x - 0.75 }
    };
    let at = |voxel: usize| [voxel % SIDE, voxel / SIDE % SIDE, voxel / (SIDE * SIDE)].map(off);
    (0..SIDE * SIDE * SIDE).map(|voxel| at(voxel).iter().map(|x| x * x).sum::<f64>().sqrt()).collect()
}

fn main() -> Result<(), rkpm::Error> {
    let out = support::out_dir("scan");
    let mut summary = Summary::new();
    let (mut line, mut whole) = (Vec::new(), f64::NAN);
    for radius in [0.0, 0.14, 0.17, 0.2] {
        let shape = match radius > 0.0 {
            true => Shape::voxels([SIDE; 3], [1.0 / SIDE as f64; 3], scanned(), radius)?,
            false => Shape::block([0.0; 3], [1.0; 3]),
        };
        let block = shape
            .solid(0.04)?
            .name("base", Select::plane([0.0; 3], [0.0, 0.0, -1.0]))?
            .name("top", Select::plane([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]))?;
        let porosity = 1.0 - block.volume();
        let scene = Scene::new(&block, Solid, Rubber::neo_hookean(0.5, 50.0)?) // MPa
            .hold("base")
            .with(Condition::on("top").displacement([0.0, 0.0, -PRESSED]).named("top"));
        let problem = scene.discretize(&Scheme::default().spacing(0.1))?;
        let path = problem.run()?.completed()?;
        let stiffness = -problem.reaction(path.last(), "top")?[2] / PRESSED;
        if radius == 0.0 {
            whole = stiffness;
        }
        println!("{} particles", problem.cells().positions().len());
        summary.note(format!("porosity_{}", line.len()), porosity)?;
        summary.note(format!("stiffness_{}", line.len()), stiffness / whole)?;
        line.push([porosity, stiffness / whole]);
        problem.picture(path.last(), Field::MisesStress)?.write(out.join(format!("pores_{}.svg", line.len() - 1)))?;
    }
    Chart::new("Stiffness of a block with pores")
        .x("porosity")
        .y("stiffness, parts of that without")
        .marked_line("", &line)
        .write(out.join("stiffness.svg"))?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
