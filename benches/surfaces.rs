//! From a closed surface to a force: the STL files of `benches/peers/surfaces.py` read, cut, analysed.
//!
//! `cargo bench -p rkpm-benches --bench surfaces -- DIR` reads DIR/bracket.stl, mount.stl and bush.stl and writes DIR/ours.csv:
//! spacing, particles, iterations, force and processor seconds from the file to the force (known on Linux alone).
//! `benches/peers/surfaces.sh` runs both sides.

use std::fmt::Write;
use std::path::Path;

use rkpm::prelude::*;

#[path = "../examples/support/block.rs"]
mod block;

use block::processor;

/// The part as a solver sees it: its scene, the face whose force is asked for, and the force's direction.
fn scene(part: &str, directory: &Path) -> Result<(Scene<3>, &'static str, usize), rkpm::Error> {
    let solid = Solid3::stl(directory.join(format!("{part}.stl")))?;
    Ok(match part {
        "bracket" => {
            let solid = solid
                .name("base", Select::plane([0.0; 3], [0.0, 0.0, -1.0]))?
                .name("top", Select::plane([0.0, 0.0, 40.0], [0.0, 0.0, 1.0]))?
                .name("hole", Select::cylinder([28.0, 10.0, 0.0], [0.0, 0.0, 1.0], 4.0))?;
            let scene = Scene::new(&solid, Solid, Rubber::mooney_rivlin(0.4, 0.1, 500.0)?)
                .hold("base")
                .hold("hole")
                .with(Condition::on("top").displacement([6.0, 0.0, 0.0]));
            (scene, "top", 0)
        }
        "mount" => {
            let solid = solid
                .name("base", Select::plane([0.0; 3], [0.0, 0.0, -1.0]))?
                .name("middle", Select::plane([0.0; 3], [0.0, -1.0, 0.0]))?
                .name("insert", Select::block([-7.05, -1.0, 9.99], [7.05, 7.05, 24.01]))?;
            let scene = Scene::new(&solid, Solid, Rubber::yeoh(0.55, -0.05, 0.01, 1e3)?)
                .hold("base")
                .prescribe("middle", 1, 0.0)
                .with(Condition::on("insert").displacement([1.5, 0.0, -2.0]));
            (scene, "insert", 2)
        }
        _ => {
            let solid = solid
                .name("outer", Select::cylinder([0.0; 3], [0.0, 0.0, 1.0], 2.0))?
                .name("inner", Select::cylinder([0.0; 3], [0.0, 0.0, 1.0], 1.0))?;
            let scene = Scene::new(&solid, Solid, Rubber::neo_hookean(0.5, 1e3)?)
                .hold("outer")
                .with(Condition::on("inner").displacement([0.2, 0.0, 0.0]));
            (scene, "inner", 0)
        }
    })
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let directory = std::env::args().skip(1).find(|word| !word.starts_with("--")).unwrap_or_else(|| ".".to_string());
    let directory = Path::new(&directory);
    let mut rows = "part,spacing,particles,iterations,force,discretise_seconds,seconds\n".to_string();
    for (part, spacings) in [
        ("bracket", [8.0, 5.0, 4.0, 3.0, 2.5, 2.0]),
        ("mount", [6.0, 5.0, 4.0, 3.0, 2.5, 2.0]),
        ("bush", [0.5, 0.4, 0.3, 0.25, 0.2, 0.15]),
    ] {
        for spacing in spacings {
            let begin = processor();
            let run = || -> Result<_, rkpm::Error> {
                let (scene, face, direction) = scene(part, directory)?;
                let problem = scene.discretize(&Scheme::default().spacing(spacing))?;
                let discretised = processor() - begin;
                let path = problem.run()?.completed()?;
                let force = problem.reaction(path.last(), face)?[direction];
                Ok((problem.cells().positions().len(), path.iterations, force, discretised))
            };
            match run() {
                Ok((particles, iterations, force, discretised)) => {
                    let seconds = processor() - begin;
                    let row =
                        format!("{part},{spacing},{particles},{iterations},{force:.6},{discretised:.3},{seconds:.3}");
                    println!("{row}");
                    writeln!(rows, "{row}")?;
                }
                Err(error) => println!("{part} {spacing}: {error}"),
            }
        }
    }
    std::fs::write(directory.join("ours.csv"), rows)?;
    Ok(())
}
