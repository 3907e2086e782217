//! A large block of rubber, sheared between bonded plates by a fifth of its height: progress, phases, memory.
//!
//! `cargo run --release --example large_block [-- --particles N] [--ratio K] [--iterations I] [--out DIR]`: about `N`
//! particles (100 000 unless set), a bulk modulus of `K` shear moduli (1000), at most `I` iterations of Newton's method
//! (0: the whole analysis). Writes `summary.csv`: `seconds` from the particles to the last state, `peak_bytes`,
//! `directions_most` of the Krylov solutions, `unknowns` and more. `--sizes 1e4,1e5,1e6` analyses each of these and writes `cost.csv` and
//! the chart `cost.svg` of seconds against particles with their exponent.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use rkpm::scene::SolverChoice;
use rkpm::solve::Iteration;
use support::Summary;

#[path = "support/block.rs"]
mod block;
mod support;

use block::{flag, peak, scene, scheme};

/// Prints what happens, and breaks off after some iterations.
struct Progress {
    start: Instant,
    last: f64,
    taken: Vec<f64>,
}

impl Observer for Progress {
    fn iteration(&mut self, iteration: &Iteration) -> ControlFlow<()> {
        let now = self.start.elapsed().as_secs_f64();
        println!(
            "{now:8.1} s  load {:.3}, iteration {}: residual {:.2e}, increment {:.2e}, {:.1} s",
            iteration.load,
            iteration.number,
            iteration.residual,
            iteration.increment,
            now - self.last
        );
        self.taken.push(now - self.last);
        self.last = now;
        ControlFlow::Continue(())
    }
}

/// One analysis: its rows, and what there is to be seen.
fn measure(particles: f64) -> Result<Summary, Box<dyn Error>> {
    let ratio: f64 = flag("--ratio", "1e3").parse()?;
    let most: usize = flag("--iterations", "0").parse()?;
    let (block, scheme) = (scene(ratio)?, scheme(particles, most).solver_choice(SolverChoice::Krylov));
    let start = Instant::now();
    let problem = block.discretize(&scheme)?;
    let tables = start.elapsed().as_secs_f64();
    let count = problem.model().node_count() as f64;
    println!("{count} particles, {} unknowns: tables in {tables:.1} s", problem.model().unknowns());
    println!("{:.2} GB so far", 1e-9 * peak());
    let mut progress = Progress { start: Instant::now(), last: 0.0, taken: Vec::new() };
    let path = problem.run_with(&mut progress)?;
    let seconds = start.elapsed().as_secs_f64();
    let krylov_iterations = problem.analysis().solver.krylov_iterations();
    println!("{:?}; Krylov iterations {krylov_iterations:?}", path.ending);
    let mut summary = Summary::new();
    summary.note("particles", count)?;
    summary.note("unknowns", problem.model().unknowns() as f64)?;
    summary.note("seconds", seconds)?;
    summary.note("tables_seconds", tables)?;
    summary.note("first_iteration_seconds", progress.taken.first().copied().unwrap_or(f64::NAN))?;
    summary.note("last_iteration_seconds", progress.taken.last().copied().unwrap_or(f64::NAN))?;
    summary.note("directions_most", krylov_iterations.iter().copied().max().unwrap_or(0) as f64)?;
    summary.note("peak_bytes", peak())?;
    summary.note("peak_bytes_per_particle", peak() / count)?;
    if most == 0 {
        summary.note("energy", problem.energy(path.last())?)?;
    }
    Ok(summary)
}

/// Seconds against particles of whole analyses, and their exponent from the first size to the last.
fn cost(sizes: &str, out: &Path) -> Result<(), Box<dyn Error>> {
    let mut table = Table::new(["particles", "unknowns", "seconds", "directions_most", "peak_bytes"]);
    let mut points = Vec::new();
    for size in sizes.split(',') {
        let summary = measure(size.trim().parse()?)?;
        let row = |name: &str| summary.rows.iter().find(|row| row.name == name).map_or(f64::NAN, |row| row.value);
        points.push([row("particles"), row("seconds")]);
        table.push(["particles", "unknowns", "seconds", "directions_most", "peak_bytes"].map(row))?;
    }
    let [first, .., last] = points[..] else {
        return Err("--sizes takes two numbers of particles at least: --sizes 1e4,1e5".into());
    };
    let exponent = (last[1] / first[1]).ln() / (last[0] / first[0]).ln();
    println!("exponent {exponent:.2}");
    let linear = [first, [last[0], first[1] * last[0] / first[0]]];
    let chart = Chart::new(format!("Whole analyses of a sheared block: exponent {exponent:.2}"))
        .x_log("particles")
        .y_log("seconds")
        .marked_line("default, by iteration", &points)
        .dashed("exponent 1", &linear)
        .names_beside_curves();
    table.write(out.join("cost.csv"))?;
    chart.write(out.join("cost.svg"))?;
    let mut summary = Summary::new();
    summary.note("exponent", exponent)?;
    summary.write(out.join("cost_summary.csv"))?;
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(flag("--out", "target/rkpm/large_block"));
    let sizes = flag("--sizes", "");
    if !sizes.is_empty() {
        return cost(&sizes, &out);
    }
    let summary = measure(flag("--particles", "1e5").parse()?)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
