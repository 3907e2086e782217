//! A large block of rubber, sheared between bonded plates by a fifth of its height, on any number of ranks: seconds by phase,
//! memory of each rank, directions of the iteration.
//!
//! `petsc/run RANKS cargo run --release -p rkpm-petsc --example large_block -- [--particles N] [--ratio K] [--iterations I]
//! [--solver gamg|mumps|krylov|direct]`: about `N` particles (10 000 unless set), a bulk modulus of `K` shear moduli (1000),
//! at most `I` iterations of Newton's method (2; 0 runs the whole analysis). The last two solvers are this crate's own and
//! solve on one rank.

use std::process::ExitCode;
use std::time::Instant;

use rkpm::assembly::{Ranks, StateRef};
use rkpm::scene::SolverChoice;
use rkpm_petsc::{Gamg, Mumps, Session, on_all_ranks};

#[path = "../../examples/support/block.rs"]
mod block;

use block::{flag, peak, processor, scene, scheme};

fn main() -> ExitCode {
    on_all_ranks(run)
}

fn run(session: &Session) -> Result<(), Box<dyn std::error::Error>> {
    let particles: f64 = flag("--particles", "10000").parse()?;
    let (ratio, most): (f64, usize) = (flag("--ratio", "1000").parse()?, flag("--iterations", "2").parse()?);
    let solver = flag("--solver", "gamg");
    let (block, mut scheme) = (scene(ratio)?, scheme(particles, most));
    scheme = match solver.as_str() {
        "gamg" => scheme.solver(Gamg::new(session)),
        "mumps" => scheme.solver(Mumps::new(session)),
        "krylov" => scheme.solver_choice(SolverChoice::Krylov),
        "direct" => scheme.solver_choice(SolverChoice::Direct),
        other => return Err(format!("--solver {other}: gamg, mumps, krylov or direct").into()),
    };
    let mut watch = Stopwatch::start();
    let problem = block.discretize(&scheme)?;
    let tables = watch.lap();
    let after_tables = peak();
    let model = problem.model();
    let (rest, terms) = (vec![0.0; model.unknowns()], model.start());
    let mut assembler = if solver == "gamg" || solver == "krylov" { model.assembler_free() } else { model.assembler() };
    let pattern = watch.lap();
    let mut system = Default::default();
    assembler.assemble(model, StateRef::new(&rest, &terms, 0.0), &mut system).unwrap();
    watch.lap();
    assembler.assemble(model, StateRef::new(&rest, &terms, 0.0), &mut system).unwrap();
    let assembly = watch.lap();
    let entries = assembler.pattern().entries() as f64;
    drop((assembler, system));
    watch.lap();
    let path = problem.run()?;
    let whole = watch.lap();
    let peak = 1e-9 * peak();
    let phases = [tables, pattern, assembly, whole];
    let mut largest = [1e-9 * after_tables, peak, entries];
    let mut sums = [peak, entries, problem.body().table().point_count() as f64];
    let (mut wall, mut processor) = (phases.map(|[wall, _]| wall), phases.map(|[_, processor]| processor));
    for values in [&mut largest[..], &mut wall, &mut processor] {
        session.largest(values);
    }
    session.sum(&mut sums);
    if session.rank() == 0 {
        let (count, ranks) = (model.node_count(), session.count());
        println!("{ranks} ranks, {solver}: {count} particles, k/µ {ratio:e}; {:?}", path.ending);
        for (what, seconds) in [("wall", wall), ("processor", processor)] {
            println!(
                "  {what} seconds: tables {:.2}, pattern {:.2}, assembly {:.3}, run {:.2} ({} iterations)",
                seconds[0], seconds[1], seconds[2], seconds[3], path.iterations
            );
        }
        println!(
            "  GB: {:.3} after tables, peak of a rank {:.3}, of all {:.3}; entries of a rank {:.3e}, of all {:.3e}; points {}",
            largest[0], largest[1], sums[0], largest[2], sums[1], sums[2]
        );
        println!("  Krylov iterations {:?}", problem.analysis().solver.krylov_iterations());
        if let Some(step) = path.steps.last() {
            println!("  energy {:.12e}", step.energy);
        }
    }
    Ok(())
}

/// Seconds of phases, by the clock on the wall and by the processor, which counts waiting for other ranks as well.
struct Stopwatch(Instant, f64);

impl Stopwatch {
    fn start() -> Self {
        Stopwatch(Instant::now(), processor())
    }

    /// Since the last lap.
    fn lap(&mut self) -> [f64; 2] {
        let next = Stopwatch::start();
        let seconds = [(next.0 - self.0).as_secs_f64(), next.1 - self.1];
        *self = next;
        seconds
    }
}
