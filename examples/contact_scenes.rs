//! Scenes of contact drawn at random: how many reach the end of their load, and whether they are right there.
//!
//! `cargo run --release --example contact_scenes [-- --scenes N] [--seed S] [--refined N] [--out DIR]` prints a table and writes
//! `scenes.csv` with a row for each scene, and `summary.csv` with the rows `scenes`, `completed`, `doubtful` (reached the end in a state
//! that is no answer), `told` (completed with a doubt by `Problem::verdict`), `folded` (completed with a point that has lost more than 0.6 of
//! its volume), `completed_unstable`, `iterations_median`, `iterations_total`. With `--refined N` as many scenes of all kinds run again with half and a quarter of the
//! spacing; `wrong` of them, of `compared`, are completed without a doubt and more than 12 % off in the energy, or half the spacing is
//! farther from the finest model than the whole one, by more than 1 %. A fifth of the scenes is in 3D; a scene whose rigid surface is drawn into the body
//! resolves the overlap first.

#[path = "support/drawn_contact.rs"]
mod drawn_contact;
mod support;

use std::error::Error;
use std::path::PathBuf;

use drawn_contact::{in_space, in_the_plane, itself_in_the_plane, of_revolution, pair_in_space, pair_in_the_plane};
use rkpm::output::Table;
use rkpm::prelude::*;
use support::Summary;

/// What the command line asks for.
struct Request {
    scenes: usize,
    seed: u64,
    refined: usize,
    out: PathBuf,
}

fn request() -> Option<Request> {
    let out = ["target", "rkpm", "contact_scenes"].iter().collect();
    let mut request = Request { scenes: 300, seed: 1000, refined: 0, out };
    let mut arguments = std::env::args().skip(1);
    while let Some(flag) = arguments.next() {
        let value = arguments.next()?;
        match flag.as_str() {
            "--scenes" => request.scenes = value.parse().ok().filter(|n| *n > 0)?,
            "--seed" => request.seed = value.parse().ok()?,
            "--refined" => request.refined = value.parse().ok()?,
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
    /// The smallest volume of a point over that of the undeformed one.
    smallest: f64,
    energy: f64,
    /// Whether the last load was reached.
    reached: bool,
    /// Why there is no answer.
    why: String,
    /// Whether the verdict has a doubt.
    told: bool,
}

/// Runs a scene with so many times the particles along each axis.
fn run<const D: usize>(
    kind: &'static str,
    (seed, times): (u64, usize),
    scene: impl Fn(bool) -> Scene<D>,
    particles: [usize; D],
) -> Found {
    let none = Found {
        kind,
        seed,
        load: 0.0,
        iterations: 0,
        unstable: 0,
        smallest: 1.0,
        energy: f64::NAN,
        reached: false,
        why: String::new(),
        told: false,
    };
    let scheme = Scheme::default().particles(particles.map(|count| (count - 1) * times + 1));
    // Blocks in 3D are lattices, which nothing scatters.
    let scheme = if D == 2 { scheme.seed(seed) } else { scheme };
    let problem = match scene(false).discretize(&scheme) {
        Err(rkpm::Error::Contact(_)) => scene(true).discretize(&scheme),
        other => other,
    };
    let run = |problem: Problem<D>| {
        let path = problem.run()?;
        let told = !problem.verdict(&path)?.is_empty();
        Ok((path, told))
    };
    let (path, told) = match problem.and_then(run) {
        Ok(found) => found,
        Err(error) => return Found { why: error.to_string(), ..none },
    };
    let last = path.steps.last();
    Found {
        load: path.last().load,
        iterations: path.iterations,
        unstable: last.and_then(|step| step.unstable).unwrap_or(0),
        smallest: last.and_then(|step| step.diagnostics.jacobians).map_or(1.0, |[low, _]| low),
        energy: last.map_or(f64::NAN, |step| step.energy),
        told,
        reached: path.ending == Ending::Completed,
        why: path.completed().err().map_or_else(String::new, |none| none.to_string()),
        ..none
    }
}

/// Ten kinds in turn, two of them in 3D: the seed tells which, so that one scene can be drawn again by itself.
fn scene(seed: u64, times: usize) -> Found {
    let of = (seed, times);
    match seed % 10 {
        0 => run("3D", of, |fit| in_space(seed, fit), [6, 6, 4]),
        1 => run("pair in 3D", of, |_| pair_in_space(seed), [5, 5, 4]),
        2 | 3 => run("axisymmetric", of, |fit| of_revolution(seed, fit), [9, 9]),
        4 => run("itself", of, |_| itself_in_the_plane(seed), [9, 15]),
        5 | 6 => run("pair", of, |_| pair_in_the_plane(seed), [9, 9]),
        _ => run("plane", of, |fit| in_the_plane(seed, fit), [11, 11]),
    }
}

/// From one scene that is compared to the next.
const STRIDE: usize = 37;
/// How far an energy may be off, and how much farther from the finest model half the spacing may be than the whole one.
const RIGHT: [f64; 2] = [0.12, 0.01];

/// Compares scenes with half and a quarter of their spacing: how many could be compared, and how many are wrong.
fn refine(found: &[Found], count: usize) -> [usize; 2] {
    let (mut compared, mut wrong) = (0, 0);
    for number in 0..count.min(found.len()) {
        // A step that has no divisor in common with the ten kinds.
        let first = &found[number * STRIDE % found.len()];
        if !first.reached {
            continue;
        }
        let [half, quarter] = [2, 4].map(|times| scene(first.seed, times));
        let off = |other: &Found| (other.energy / quarter.energy - 1.0).abs();
        let comparable = half.reached && quarter.why.is_empty();
        let is_wrong = comparable
            && first.why.is_empty()
            && !first.told
            && (off(first) > RIGHT[0] || off(&half) > off(first) + RIGHT[1]);
        compared += usize::from(comparable);
        wrong += usize::from(is_wrong);
        let word = if is_wrong {
            "WRONG"
        } else if first.told && first.why.is_empty() {
            "told"
        } else if first.why.is_empty() {
            "answer"
        } else {
            "doubtful"
        };
        let energies = [first, &half, &quarter].map(|model| model.energy);
        println!("{word} {} {}: energies {energies:.5?} {}{}", first.kind, first.seed, half.why, quarter.why);
    }
    [compared, wrong]
}

fn main() -> Result<(), Box<dyn Error>> {
    let Some(request) = request() else {
        eprintln!("usage: contact_scenes [--scenes N] [--seed S] [--refined N] [--out DIR]");
        std::process::exit(2);
    };
    let mut table = Table::new(["number", "seed", "load", "iterations", "unstable", "smallest_volume", "energy"]);
    let mut all = Vec::new();
    for number in 0..request.scenes as u64 {
        let found = scene(request.seed + number, 1);
        if !found.why.is_empty() {
            println!("{} {}: load {:.3}: {}", found.kind, found.seed, found.load, found.why);
        }
        let Found { seed, load, iterations, unstable, smallest, energy, .. } = found;
        table.push([number as f64, seed as f64, load, iterations as f64, unstable as f64, smallest, energy])?;
        all.push(found);
    }
    let count = |of: &dyn Fn(&Found) -> bool| all.iter().filter(|found| of(found)).count() as f64;
    let mut iterations: Vec<usize> = all.iter().filter(|found| found.reached).map(|found| found.iterations).collect();
    iterations.sort_unstable();
    let mut summary = Summary::new();
    summary.note("scenes", request.scenes as f64)?;
    summary.note("completed", count(&|found| found.why.is_empty()))?;
    summary.note("doubtful", count(&|found| found.reached && !found.why.is_empty()))?;
    summary.note("told", count(&|found| found.why.is_empty() && found.told))?;
    summary.note("folded", count(&|found| found.why.is_empty() && found.smallest < 0.4))?;
    summary.note("completed_unstable", count(&|found| found.why.is_empty() && found.unstable > 0))?;
    summary.note("iterations_median", iterations.get(iterations.len() / 2).map_or(f64::NAN, |n| *n as f64))?;
    summary.note("iterations_total", iterations.iter().sum::<usize>() as f64)?;
    if request.refined > 0 {
        let [compared, wrong] = refine(&all, request.refined);
        summary.note("compared", compared as f64)?;
        summary.note("wrong", wrong as f64)?;
    }
    print!("{summary}");
    std::fs::create_dir_all(&request.out)?;
    summary.write(request.out.join("summary.csv"))?;
    table.write(request.out.join("scenes.csv"))?;
    println!("results in {}", request.out.display());
    Ok(())
}
