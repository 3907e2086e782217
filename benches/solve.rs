//! The sparse direct solver on the reduced matrix of the default scheme: analysis, factorisation, solution.

mod support;

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use rkpm::linear::LinearSystem;
use rkpm::prelude::*;

fn solve<const D: usize>(c: &mut Criterion, name: &str, scene: &Scene<D>, counts: &[usize]) {
    let mut group = c.benchmark_group(format!("solve/{name}"));
    group.sample_size(10);
    for &n in counts {
        let problem = scene.discretize(&support::scheme(n)).expect("a sound scene");
        let (reduction, values, mut solver) = support::reduced(&problem);
        let id = |phase: &str| BenchmarkId::new(phase, values.len());
        group.bench_function(id("analyze"), |b| {
            b.iter_batched_ref(
                || support::bound(&problem),
                |bound| problem.analysis().bound_solver(problem.model(), bound).expect("a pattern"),
                BatchSize::LargeInput,
            );
        });
        // A matrix that comes twice is factorised once: two that differ take turns.
        let others: Vec<f64> = values.iter().map(|v| 2.0 * v).collect();
        let mut turn = false;
        group.bench_function(id("factorize"), |b| {
            b.iter(|| {
                turn = !turn;
                solver.factorize(&LinearSystem::of(if turn { &values } else { &others })).expect("a regular matrix");
            });
        });
        let system = LinearSystem::of(&values);
        solver.factorize(&system).expect("a regular matrix");
        let mut x = vec![1.0; reduction.unknowns()];
        group.bench_function(id("solve"), |b| {
            b.iter(|| {
                x.fill(1.0);
                solver.solve(&system, &mut x, None).expect("a regular matrix");
            });
        });
    }
}

fn sizes(c: &mut Criterion) {
    solve(c, "2d", &support::membrane(), &[9, 32, 100]);
    solve(c, "3d", &support::cube(), &[5, 10]);
}

criterion_group!(benches, sizes);
criterion_main!(benches);
