//! A large block of rubber, sheared between bonded plates by a fifth of its height, on any number of ranks: seconds by phase,
//! memory of each rank, directions of the iteration.
//!
//! `petsc/run RANKS cargo run --release -p rkpm-petsc --example large_block -- [--particles N] [--ratio K] [--iterations I]
//! [--solver gamg|mumps|krylov|direct]`: about `N` particles (10 000 unless set), a bulk modulus of `K` shear moduli (1000),
//! at most `I` iterations of Newton's method (2; 0 runs the whole analysis). The last two solvers are this crate's own and
//! solve on one rank.

use std::process::ExitCode;
use std::time::Instant;

use rkpm::assembly::Ranks;
use rkpm::prelude::*;
use rkpm::scene::Solving;
use rkpm::solve::Newton;
use rkpm_petsc::{Gamg, Mumps, Session, on_all_ranks};

/// The most memory that this process has held, in GB; known on Linux alone.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM:"));
    let number = line.and_then(|line| line.split_whitespace().nth(1)).and_then(|n| n.parse::<f64>().ok());
    1.024e-6 * number.unwrap_or(f64::NAN)
}

/// What stands behind a flag.
fn flag(name: &str, default: &str) -> String {
    let arguments: Vec<String> = std::env::args().collect();
    let place = arguments.iter().position(|a| a == name);
    place.and_then(|k| arguments.get(k + 1)).cloned().unwrap_or_else(|| default.to_string())
}

fn main() -> ExitCode {
    on_all_ranks(run)
}

fn run(session: &Session) -> Result<(), Box<dyn std::error::Error>> {
    let particles: f64 = flag("--particles", "10000").parse()?;
    let (ratio, most): (f64, usize) = (flag("--ratio", "1000").parse()?, flag("--iterations", "2").parse()?);
    let solver = flag("--solver", "gamg");
    let h = (4.0 / particles).cbrt();
    let counts = [2.0, 2.0, 1.0].map(|length: f64| ((length / h).round() as usize).max(2) + 1);
    let block = Scene::new(Block::new([0.0; 3], [2.0, 2.0, 1.0]), Solid, Rubber::neo_hookean(0.5, ratio)?)
        .hold((2, Side::Min))
        .prescribe((2, Side::Max), 0, 0.2)
        .prescribe((2, Side::Max), 1, 0.0)
        .prescribe((2, Side::Max), 2, 0.0);
    let mut scheme = Scheme::default().particles(counts);
    scheme = match solver.as_str() {
        "gamg" => scheme.solver(Gamg::new(session)),
        "mumps" => scheme.solver(Mumps::new(session)),
        "krylov" => scheme.solving(Solving::Krylov),
        "direct" => scheme.solving(Solving::Direct),
        other => return Err(format!("--solver {other}: gamg, mumps, krylov or direct").into()),
    };
    if most > 0 {
        scheme = scheme.newton(Newton { iterations: most, ..Newton::default() });
        // One attempt, for the time that an iteration takes.
        scheme = scheme.stepping(Stepping { smallest: 0.9, ..Stepping::equal(1) });
    }
    let start = Instant::now();
    let problem = block.discretize(&scheme)?;
    let tables = start.elapsed().as_secs_f64();
    let after_tables = peak();
    let model = problem.model();
    let (rest, condensed) = (vec![0.0; model.unknowns()], model.start());
    let start = Instant::now();
    let mut assembler =
        if solver == "gamg" || solver == "krylov" { model.assembler_apart() } else { model.assembler() };
    let pattern = start.elapsed().as_secs_f64();
    let mut system = Default::default();
    assembler.assemble(model, &rest, &condensed, 0.0, &mut system);
    let start = Instant::now();
    assembler.assemble(model, &rest, &condensed, 0.0, &mut system);
    let assembly = start.elapsed().as_secs_f64();
    let entries = assembler.pattern().entries() as f64;
    drop((assembler, system));
    let start = Instant::now();
    let path = problem.run(&mut ())?;
    let whole = start.elapsed().as_secs_f64();
    let mut largest = [tables, pattern, assembly, whole, after_tables, peak(), entries];
    let mut sums = [peak(), entries, problem.body().table().len() as f64];
    session.largest(&mut largest);
    session.sum(&mut sums);
    if session.rank() == 0 {
        let (count, ranks) = (model.positions().len(), session.count());
        println!("{ranks} ranks, {solver}: {count} particles, k/µ {ratio:e}; {:?}", path.ending);
        println!(
            "  seconds: tables {:.2}, pattern {:.2}, assembly {:.3}, run {:.2} ({} iterations)",
            largest[0], largest[1], largest[2], largest[3], path.iterations
        );
        println!(
            "  GB: {:.3} after tables, peak of a rank {:.3}, of all {:.3}; entries of a rank {:.3e}, of all {:.3e}; points {}",
            largest[4], largest[5], sums[0], largest[6], sums[1], sums[2]
        );
        println!("  directions {:?}", problem.analysis().solver.directions());
        if let Some(step) = path.steps.last() {
            println!("  energy {:.12e}", step.energy);
        }
    }
    Ok(())
}
