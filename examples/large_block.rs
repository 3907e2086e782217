//! A large block of rubber, sheared between bonded plates by a fifth of its height: progress, phases, memory.
//!
//! `cargo run --release --example large_block [-- --particles N] [--ratio K] [--iterations I] [--out DIR]`: about `N`
//! particles (100 000 unless set), a bulk modulus of `K` shear moduli (1000), at most `I` iterations of Newton's method
//! (0: the whole analysis). Writes `summary.csv`: `seconds` from the particles to the last state, `peak_bytes`,
//! `directions_most` of the Krylov solutions, `unknowns` and more.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;

use rkpm::output::Summary;
use rkpm::prelude::*;
use rkpm::scene::SolverChoice;
use rkpm::solve::Iteration;

#[path = "support/block.rs"]
mod block;

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

fn main() -> Result<(), Box<dyn Error>> {
    let out = PathBuf::from(flag("--out", "target/rkpm/large_block"));
    let (particles, ratio): (f64, f64) = (flag("--particles", "1e5").parse()?, flag("--ratio", "1e3").parse()?);
    let most: usize = flag("--iterations", "0").parse()?;
    let (block, scheme) = (scene(ratio)?, scheme(particles, most).solver_choice(SolverChoice::Krylov));
    let start = Instant::now();
    let problem = block.discretize(&scheme)?;
    let tables = start.elapsed().as_secs_f64();
    let count = problem.model().positions().len() as f64;
    println!("{count} particles, {} unknowns: tables in {tables:.1} s", problem.model().unknowns());
    println!("{:.2} GB so far", 1e-9 * peak());
    let mut progress = Progress { start: Instant::now(), last: 0.0, taken: Vec::new() };
    let path = problem.run_with(&mut progress)?;
    let seconds = start.elapsed().as_secs_f64();
    let krylov_iterations = problem.analysis().solver.krylov_iterations();
    println!("{:?}; directions {krylov_iterations:?}", path.ending);
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
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
