//! One whole analysis of the tube: particles, tables, Newton under the full load.

use criterion::{Criterion, criterion_group, criterion_main};
use rkpm::prelude::*;

fn tube(c: &mut Criterion) {
    let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5).expect("the paper's rubber");
    let scene = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber).pressure(Side::Min, 0.46);
    for (name, scheme) in [
        ("tube/default", Scheme::default().particles([9])),
        ("tube/quadratic", Scheme::default().particles([9]).order(2)),
        ("tube/paper_r1.6", Scheme::paper(1.6).particles([9]).integration_zones([4])),
    ] {
        c.bench_function(name, |b| {
            b.iter(|| {
                let problem = scene.discretize(&scheme).expect("a sound scene");
                problem.run().expect("a sound model").completed().expect("full load")
            });
        });
    }
}

criterion_group!(benches, tube);
criterion_main!(benches);
