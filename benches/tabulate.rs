//! Tabulation: smoothed tables of regular particles, over sizes, supports and threads.

mod support;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rkpm::prelude::*;

/// Particles with supports, sub-cells of their lattice, and the table.
fn tabulate<const D: usize>(c: &mut Criterion, name: &str, counts: &[usize], r: f64, threads: usize) {
    let mut group = c.benchmark_group(format!("tabulate/{name}"));
    group.sample_size(10);
    for &n in counts {
        let block = Block::new([0.0; D], [1.0; D]);
        let lattice = block.lattice([n; D]).expect("a sound lattice");
        let smoothing = lattice.smoothing(2, 2, &lattice.zones(2)).expect("a sound rule");
        let particles = lattice.particles(r).expect("a sound dilation");
        let rk = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear()).expect("enough particles");
        group.throughput(Throughput::Elements(lattice.positions().len() as u64));
        group.bench_function(BenchmarkId::from_parameter(n.pow(D as u32)), |b| {
            support::on_threads(threads, || {
                b.iter(|| ShapeTable::smoothed(&rk, &smoothing, &Flat).expect("every point covered"));
            });
        });
    }
}

/// Plain coordinates in any dimension.
struct Flat;

impl<const D: usize> Kinematics<D> for Flat {
    fn hoop_components(&self) -> &'static [usize] {
        &[]
    }
    fn measure(&self, _: &rkpm::geometry::Point<D>) -> f64 {
        1.0
    }
}

fn sizes(c: &mut Criterion) {
    tabulate::<2>(c, "2d", &[10, 32, 100, 316], 1.0, 1);
    tabulate::<3>(c, "3d", &[5, 10, 22, 27], 0.75, 1);
}

fn supports(c: &mut Criterion) {
    for r in [1.0, 1.5, 2.5] {
        tabulate::<2>(c, &format!("2d_r{r}"), &[32], r, 1);
    }
    for r in [0.75, 1.0] {
        tabulate::<3>(c, &format!("3d_r{r}"), &[10], r, 1);
    }
}

fn threads(c: &mut Criterion) {
    for threads in [1, 2] {
        tabulate::<3>(c, &format!("3d_threads{threads}"), &[22], 0.75, threads);
    }
}

criterion_group!(benches, sizes, supports, threads);
criterion_main!(benches);
