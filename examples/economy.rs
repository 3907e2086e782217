//! What scenes cost against the least that their terms need; one body modelled in one, two and two dimensions.
//!
//! `cargo run --release --example economy [-- --out DIR]` prints and writes `economy.csv` and `summary.csv`.
//! `economy --count SCENE build|run` only builds or only builds and runs one scene, for a counter of instructions:
//! the difference of two counts over the iterations (printed) is what an iteration costs, e.g.
//! `valgrind --tool=callgrind --callgrind-out-file=/dev/null economy --count cook run`.
//!
//! *Least*: unknowns are the displacement components of all particles; bytes of a table are a gradient and a
//! particle number for each neighbour of each point, and a weight; operations are those of the point kernel alone,
//! the symmetric half of $2 d^3$ per pair of neighbours, which any assembly of these tables has to make.

mod support;

use std::error::Error;
use std::f64::consts::PI;
use std::time::Instant;

use rkpm::output::{Cell, Table};
use rkpm::prelude::*;
use support::Summary;

/// A scene with its particles, whatever its dimension.
enum Body {
    Line(Scene<1>, Scheme),
    Plane(Scene<2>, Scheme),
    Space(Scene<3>, Scheme),
}

const NAMES: [&str; 7] = ["tube", "tube_strip", "tube_quarter", "disk", "cook", "bearing", "column"];

fn body(name: &str) -> Result<Body, rkpm::Error> {
    let particles = |counts: &[usize]| Scheme::default().particles(counts.to_vec());
    let yeoh = || Rubber::yeoh(0.373, -0.031, 0.005, 1e5); // MPa
    Ok(match name {
        "tube" => {
            let scene = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, yeoh()?).pressure(Side::Min, 0.46);
            Body::Line(scene, particles(&[9]))
        }
        // One cell high, both ends on rollers.
        "tube_strip" => {
            let scene = Scene::new(Block::new([6.0, 0.0], [8.0, 0.5]), Axisymmetric, yeoh()?)
                .prescribe((1, Side::Min), 1, 0.0)
                .prescribe((1, Side::Max), 1, 0.0)
                .pressure((0, Side::Min), 0.46);
            Body::Plane(scene, particles(&[9, 3]))
        }
        "tube_quarter" => {
            let ring = Mapped(|unit: &Point<2>| {
                let (sin, cos) = if unit[1] == 1.0 { (1.0, 0.0) } else { (0.5 * PI * unit[1]).sin_cos() };
                Point::<2>::new((6.0 + 2.0 * unit[0]) * cos, (6.0 + 2.0 * unit[0]) * sin)
            });
            let scene = Scene::new(ring, PlaneStrain, yeoh()?)
                .prescribe((1, Side::Min), 1, 0.0)
                .prescribe((1, Side::Max), 0, 0.0)
                .pressure((0, Side::Min), 0.46);
            Body::Plane(scene, particles(&[9, 33]))
        }
        "disk" => {
            let rubber = Rubber::mooney_rivlin(0.5516, 0.1379, 689.5)?;
            let scene = Scene::new(Block::new([0.0, 0.0], [18.923, 0.635]), Axisymmetric, rubber)
                .prescribe((0, Side::Min), 0, 0.0)
                .hold((0, Side::Max))
                .pressure((1, Side::Min), 0.1035);
            Body::Plane(scene, particles(&[41, 2]))
        }
        "cook" => {
            let corners = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]];
            let scene = Scene::new(Quadrilateral { corners }, PlaneStrain, Rubber::neo_hookean(40.097, 4e5)?)
                .hold((0, Side::Min))
                .traction((0, Side::Max), [0.0, 6.25]);
            Body::Plane(scene, particles(&[17]))
        }
        "bearing" => {
            let scene = Scene::new(Block::new([0.0, 0.0], [40.0, 10.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
                .hold((1, Side::Min))
                .prescribe((1, Side::Max), 0, 5.0)
                .prescribe((1, Side::Max), 1, -1.0);
            Body::Plane(scene, particles(&[33, 9]))
        }
        _ => {
            let block = Block::new([-0.5, -0.5, 0.0], [0.5, 0.5, 4.0]);
            let scene = Scene::new(block, Solid, Rubber::neo_hookean(0.5, 1e4)?)
                .hold((2, Side::Min))
                .prescribe((2, Side::Max), 0, 0.0)
                .prescribe((2, Side::Max), 1, 0.0)
                .prescribe((2, Side::Max), 2, 1.0);
            Body::Space(scene, particles(&[5, 5, 17]))
        }
    })
}

/// What one scene costs.
struct Cost {
    name: &'static str,
    unknowns: usize,
    points: usize,
    neighbours: f64,
    bytes: usize,
    least_bytes: usize,
    least_operations: f64,
    iterations: usize,
    seconds: f64,
}

fn cost<const D: usize>(name: &'static str, scene: &Scene<D>, scheme: &Scheme) -> Result<Cost, rkpm::Error> {
    let mut seconds = Vec::new();
    let mut last = None;
    for _ in 0..7 {
        let start = Instant::now();
        let problem = scene.discretize(scheme)?;
        let path = problem.run()?.completed()?;
        seconds.push(start.elapsed().as_secs_f64());
        last = Some((problem, path));
    }
    seconds.sort_by(f64::total_cmp);
    let (problem, path) = last.expect("the loop ran");
    let table = problem.body().table();
    let neighbours: Vec<usize> = (0..table.point_count()).map(|p| table.nodes(p).len()).collect();
    let total: usize = neighbours.iter().sum();
    let pairs: f64 = neighbours.iter().map(|&n| 0.5 * (n * (n + 1)) as f64).sum();
    Ok(Cost {
        name,
        unknowns: problem.model().unknowns(),
        points: table.point_count(),
        neighbours: total as f64 / table.point_count() as f64,
        bytes: table.bytes(),
        least_bytes: total * (8 * (D + usize::from(!table.hoop_components().is_empty())) + 4) + 8 * table.point_count(),
        least_operations: 2.0 * (D * D * D) as f64 * pairs,
        iterations: path.iterations,
        seconds: seconds[seconds.len() / 2],
    })
}

/// Builds a scene, and runs it where requested; the iterations.
fn count<const D: usize>(scene: &Scene<D>, scheme: &Scheme, run: bool) -> Result<usize, rkpm::Error> {
    let problem = scene.discretize(scheme)?;
    Ok(if run { problem.run()?.completed()?.iterations } else { 0 })
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, name, what] = &arguments[..]
        && flag == "--count"
    {
        let run = what == "run";
        let iterations = match body(name)? {
            Body::Line(scene, scheme) => count(&scene, &scheme, run)?,
            Body::Plane(scene, scheme) => count(&scene, &scheme, run)?,
            Body::Space(scene, scheme) => count(&scene, &scheme, run)?,
        };
        println!("{iterations}");
        return Ok(());
    }
    let out = support::out_dir("economy");
    let mut table = Table::new([
        "scene",
        "unknowns",
        "points",
        "neighbours",
        "table_bytes",
        "least_bytes",
        "kernel_operations",
        "iterations",
        "seconds",
    ]);
    let mut costs = Vec::new();
    for name in NAMES {
        costs.push(match body(name)? {
            Body::Line(scene, scheme) => cost(name, &scene, &scheme)?,
            Body::Plane(scene, scheme) => cost(name, &scene, &scheme)?,
            Body::Space(scene, scheme) => cost(name, &scene, &scheme)?,
        });
    }
    println!(
        "{:<14}{:>9}{:>8}{:>12}{:>12}{:>7}{:>14}{:>6}{:>10}",
        "", "unknowns", "points", "neighbours", "table kB", "least", "kernel Mflop", "its", "ms"
    );
    for c in &costs {
        println!(
            "{:<14}{:>9}{:>8}{:>12.1}{:>12.1}{:>6.0}%{:>14.4}{:>6}{:>10.3}",
            c.name,
            c.unknowns,
            c.points,
            c.neighbours,
            c.bytes as f64 / 1e3,
            100.0 * c.least_bytes as f64 / c.bytes as f64,
            1e-6 * c.least_operations,
            c.iterations,
            1e3 * c.seconds
        );
        table.push([
            Cell::from(c.name),
            Cell::from(c.unknowns),
            Cell::from(c.points),
            Cell::from(c.neighbours),
            Cell::from(c.bytes),
            Cell::from(c.least_bytes),
            Cell::from(c.least_operations),
            Cell::from(c.iterations),
            Cell::from(c.seconds),
        ])?;
    }
    let mut summary = Summary::new();
    for c in &costs {
        summary.note(format!("table_over_least_{}", c.name), c.bytes as f64 / c.least_bytes as f64)?;
    }
    summary.note("strip_over_radial", costs[1].seconds / costs[0].seconds)?;
    summary.note("quarter_over_radial", costs[2].seconds / costs[0].seconds)?;
    println!(
        "\nthe tube: a strip takes {:.0}, a quarter ring {:.0} times the seconds of the radial model of the same spacing",
        costs[1].seconds / costs[0].seconds,
        costs[2].seconds / costs[0].seconds
    );
    table.write(out.join("economy.csv"))?;
    summary.write(out.join("summary.csv"))?;
    println!("results are in {}", out.display());
    Ok(())
}
