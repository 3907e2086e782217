//! Scenes of contact drawn at random: how many reach the end of their load.
//!
//! `cargo run --release --example contact_scenes [-- --scenes N] [--seed S] [--out DIR]` prints a table and writes `summary.csv` with
//! the rows `scenes`, `completed`, `iterations_median`, and `scenes.csv` with a row for each. A fifth of the scenes is in space;
//! a scene whose rigid surface is drawn into the body resolves the overlap first.

#[path = "support/drawn_contact.rs"]
mod drawn_contact;
mod support;

use std::error::Error;
use std::path::PathBuf;

use drawn_contact::{in_space, in_the_plane, itself_in_the_plane, of_revolution, pair_in_space, pair_in_the_plane};
use rkpm::output::{Summary, Table};
use rkpm::prelude::*;

/// What the command line asks for.
struct Request {
    scenes: usize,
    seed: u64,
    out: PathBuf,
}

fn request() -> Option<Request> {
    let mut request = Request { scenes: 300, seed: 1000, out: ["target", "rkpm", "contact_scenes"].iter().collect() };
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments.next()?;
        match flag.as_str() {
            "--scenes" => request.scenes = value.parse().ok().filter(|n| *n > 0)?,
            "--seed" => request.seed = value.parse().ok()?,
            "--out" => request.out = value.into(),
            _ => return None,
        }
    }
    Some(request)
}

/// What became of a scene.
struct Found {
    kind: &'static str,
    seed: u64,
    load: f64,
    iterations: usize,
    unstable: usize,
    why: String,
}

fn run<const D: usize>(
    kind: &'static str,
    seed: u64,
    scene: impl Fn(bool) -> Scene<D>,
    particles: [usize; D],
) -> Found {
    let lost = |why: String| Found { kind, seed, load: 0.0, iterations: 0, unstable: 0, why };
    let scheme = Scheme::default().particles(particles);
    // Blocks in space are lattices, which nothing scatters.
    let scheme = if D == 2 { scheme.seed(seed) } else { scheme };
    let problem = match scene(false).discretize(&scheme) {
        Err(rkpm::Error::Contact(_)) => scene(true).discretize(&scheme),
        other => other,
    };
    let problem = match problem {
        Ok(problem) => problem,
        Err(error) => return lost(error.to_string()),
    };
    match problem.run() {
        Ok(path) => Found {
            kind,
            seed,
            load: path.last().load,
            iterations: path.iterations,
            unstable: path.steps.last().and_then(|step| step.unstable).unwrap_or(0),
            why: match &path.ending {
                Ending::Completed => String::new(),
                other => format!("{other:?}"),
            },
        },
        Err(error) => lost(error.to_string()),
    }
}

/// Ten kinds in turn, two of them in space: the seed tells which, so that one scene can be drawn again by itself.
fn scene(seed: u64) -> Found {
    match seed % 10 {
        0 => run("space", seed, |fit| in_space(seed, fit), [6, 6, 4]),
        1 => run("pair in space", seed, |_| pair_in_space(seed), [5, 5, 4]),
        2 | 3 => run("revolution", seed, |fit| of_revolution(seed, fit), [9, 9]),
        4 => run("itself", seed, |_| itself_in_the_plane(seed), [9, 15]),
        5 | 6 => run("pair", seed, |_| pair_in_the_plane(seed), [9, 9]),
        _ => run("plane", seed, |fit| in_the_plane(seed, fit), [11, 11]),
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let Some(request) = request() else {
        eprintln!("usage: contact_scenes [--scenes N] [--seed S] [--out DIR]");
        std::process::exit(2);
    };
    let mut table = Table::new(["number", "seed", "load", "iterations", "unstable"]);
    let (mut completed, mut unstable, mut iterations) = (0, 0, Vec::new());
    for number in 0..request.scenes as u64 {
        let found = scene(request.seed + number);
        if found.why.is_empty() {
            completed += 1;
            unstable += usize::from(found.unstable > 0);
            iterations.push(found.iterations);
        } else {
            println!("{} {}: load {:.3}: {}", found.kind, found.seed, found.load, found.why);
        }
        table.push([number as f64, found.seed as f64, found.load, found.iterations as f64, found.unstable as f64])?;
    }
    iterations.sort_unstable();
    let mut summary = Summary::new();
    summary.note("scenes", request.scenes as f64)?;
    summary.note("completed", completed as f64)?;
    summary.note("iterations_median", iterations.get(iterations.len() / 2).map_or(f64::NAN, |n| *n as f64))?;
    summary.note("completed_unstable", unstable as f64)?;
    print!("{summary}");
    std::fs::create_dir_all(&request.out)?;
    summary.write(request.out.join("summary.csv"))?;
    table.write(request.out.join("scenes.csv"))?;
    println!("results in {}", request.out.display());
    Ok(())
}
