//! A large block of rubber, sheared between bonded plates by a fifth of its height: progress, phases, memory.
//!
//! `cargo run --release --example large_block [-- --particles N] [--ratio K] [--iterations I] [--out DIR]`: about `N`
//! particles (100 000 unless set), a bulk modulus of `K` shear moduli (1000), at most `I` iterations of Newton's method
//! (2; 0 runs the whole analysis). Writes `summary.csv`.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;

use rkpm::output::Summary;
use rkpm::prelude::*;
use rkpm::scene::Solving;
use rkpm::solve::{Iteration, Newton};

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

/// The most memory that this process has held, in bytes; known on Linux alone.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM:"));
    let number = line.and_then(|line| line.split_whitespace().nth(1)).and_then(|n| n.parse::<f64>().ok());
    1024.0 * number.unwrap_or(f64::NAN)
}

/// The number behind a flag.
fn number(flag: &str, default: f64) -> f64 {
    let arguments: Vec<String> = std::env::args().collect();
    let place = arguments.iter().position(|a| a == flag);
    place.and_then(|k| arguments.get(k + 1)).and_then(|n| n.parse().ok()).unwrap_or(default)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let named = arguments.iter().position(|a| a == "--out").and_then(|k| arguments.get(k + 1));
    let out = named.map_or_else(|| ["target", "rkpm", "large_block"].iter().collect(), PathBuf::from);
    let (particles, ratio) = (number("--particles", 1e5), number("--ratio", 1e3));
    let most = number("--iterations", 2.0) as usize;
    // A block twice as wide as high: µ = 1.
    let h = (4.0 / particles).cbrt();
    let counts = [2.0, 2.0, 1.0].map(|length: f64| ((length / h).round() as usize).max(2) + 1);
    let rubber = Rubber::neo_hookean(0.5, ratio)?;
    let block = Scene::new(Block::new([0.0; 3], [2.0, 2.0, 1.0]), Solid, rubber)
        .hold((2, Side::Min))
        .prescribe((2, Side::Max), 0, 0.2)
        .prescribe((2, Side::Max), 1, 0.0)
        .prescribe((2, Side::Max), 2, 0.0);
    let mut scheme = Scheme::default().particles(counts).solving(Solving::Krylov);
    if most > 0 {
        scheme = scheme.newton(Newton { iterations: most, ..Newton::default() });
        // One attempt, for the time that an iteration takes.
        scheme = scheme.stepping(Stepping { smallest: 0.9, ..Stepping::equal(1) });
    }
    let start = Instant::now();
    let problem = block.discretize(&scheme)?;
    let tables = start.elapsed().as_secs_f64();
    let count = problem.model().positions().len() as f64;
    println!("{count} particles, {} unknowns: tables in {tables:.1} s", problem.model().unknowns());
    println!("{:.2} GB so far", 1e-9 * peak());
    let mut progress = Progress { start: Instant::now(), last: 0.0, taken: Vec::new() };
    let path = problem.run(&mut progress)?;
    let directions = problem.analysis().solver.directions();
    println!("{:?}; directions {directions:?}", path.ending);
    let mut summary = Summary::new();
    summary.note("particles", count)?;
    summary.note("tables_seconds", tables)?;
    summary.note("first_iteration_seconds", progress.taken.first().copied().unwrap_or(f64::NAN))?;
    summary.note("last_iteration_seconds", progress.taken.last().copied().unwrap_or(f64::NAN))?;
    summary.note("most_directions", directions.iter().copied().max().unwrap_or(0) as f64)?;
    summary.note("peak_bytes", peak())?;
    summary.note("peak_bytes_per_particle", peak() / count)?;
    if most == 0 {
        summary.note("energy", problem.energy(path.last()))?;
    }
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
