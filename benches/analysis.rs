//! Whole analyses of the default scheme, particles to last state, on one thread.

mod support;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rkpm::prelude::*;

fn analyses<const D: usize>(c: &mut Criterion, name: &str, scene: &Scene<D>, counts: &[&[usize]]) {
    let mut group = c.benchmark_group(format!("analysis/{name}"));
    group.sample_size(10);
    for &counts in counts {
        let scheme = Scheme::default().particles(counts);
        let id = counts.iter().map(usize::to_string).collect::<Vec<_>>().join("x");
        group.bench_function(BenchmarkId::from_parameter(id), |b| {
            support::on_threads(1, || {
                b.iter(|| {
                    let problem = scene.discretize(&scheme).expect("a sound scene");
                    problem.run().expect("a sound model").completed().expect("full load")
                });
            });
        });
    }
}

fn all(c: &mut Criterion) {
    analyses(c, "tube", &support::tube(), &[&[5], &[9], &[17]]);
    analyses(c, "cook", &support::membrane(), &[&[9], &[17], &[25], &[33]]);
    analyses(c, "disk", &support::disk(), &[&[11, 2], &[41, 2], &[41, 3]]);
    analyses(c, "cube", &support::cube(), &[&[5], &[7]]);
}

criterion_group!(benches, all);
criterion_main!(benches);
