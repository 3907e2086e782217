//! Assembly of the default scheme's system, over sizes, supports and threads.

mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rkpm::assembly::{StateRef, System};
use rkpm::prelude::*;
use rkpm::solve::State;

fn assemble<const D: usize>(
    c: &mut Criterion,
    name: &str,
    scene: &Scene<D>,
    schemes: impl Iterator<Item = Scheme>,
    threads: usize,
) {
    let mut group = c.benchmark_group(format!("assemble/{name}"));
    group.sample_size(10);
    for scheme in schemes {
        let problem = scene.discretize(&scheme).expect("a sound scene");
        let (model, state) = (problem.model(), State::at_rest(problem.model(), problem.equations()));
        let d = support::moved(model);
        group.throughput(Throughput::Elements(problem.body().table().point_count() as u64));
        group.bench_function(BenchmarkId::from_parameter(model.unknowns()), |b| {
            support::on_threads(threads, || {
                let mut assembler = model.assembler();
                let mut system = System::default();
                b.iter(|| assembler.assemble(model, StateRef::new(&d, &state.terms, 1.0), &mut system).unwrap());
            });
        });
    }
}

fn sizes(c: &mut Criterion) {
    assemble(c, "2d", &support::membrane(), [9, 32, 100, 224].into_iter().map(support::scheme), 1);
    assemble(c, "3d", &support::cube(), [5, 10, 22].into_iter().map(support::scheme), 1);
}

fn supports(c: &mut Criterion) {
    for r in [1.0, 1.5, 2.5] {
        let schemes = std::iter::once(support::scheme(32).dilation(r));
        assemble(c, &format!("2d_r{r}"), &support::membrane(), schemes, 1);
    }
}

fn threads(c: &mut Criterion) {
    for threads in [1, 2] {
        let schemes = std::iter::once(support::scheme(22));
        assemble(c, &format!("3d_threads{threads}"), &support::cube(), schemes, threads);
    }
}

criterion_group!(benches, sizes, supports, threads);
criterion_main!(benches);
