//! Discretisations of scattered particles: cells, supports, tables, certificate; and the slope of their time.
//!
//! `cargo bench -p rkpm-benches --bench scatter` prints seconds (best of three; one at 1e5) and $\mathrm d\log t/\mathrm d\log n$.
//! Time in proportion to $n\log n$ has slopes of 1.1 here.

use std::time::Instant;

use rkpm::prelude::*;

fn main() {
    let plate = Outline::at([0.0, 0.0])
        .line("bottom", [2.0, 0.0])
        .line("right", [2.0, 1.0])
        .line("top", [0.0, 1.0])
        .close("left");
    let hole = Outline::circle("hole", [1.0, 0.5], 0.25);
    let region = Region::with_holes(plate, [hole]).expect("a plate with a hole");
    let rubber = Rubber::neo_hookean(0.5, 1e3).expect("a rubber");
    println!(
        "{:>10} {:>10} {:>12} {:>12} {:>12} {:>7}",
        "particles", "cells [s]", "problem [s]", "certif. [s]", "sum [s]", "slope"
    );
    let mut before: Option<(f64, f64)> = None;
    for (count, rounds) in [(1_000usize, 3), (10_000, 3), (30_000, 3), (100_000, 1)] {
        let mut best: Option<(usize, [f64; 3])> = None;
        for _ in 0..rounds {
            let start = Instant::now();
            let cells = Triangulation::about(&region, count, |_| 1.0, &Default::default()).expect("cells");
            let placed = start.elapsed().as_secs_f64();
            let particles = cells.positions().len();
            let scene =
                Scene::new(Geometry::cells(std::sync::Arc::new(cells)), PlaneStrain, rubber.clone()).hold("left");
            let start = Instant::now();
            let problem = scene.discretize(&Scheme::default()).expect("a sound scene");
            let tabled = start.elapsed().as_secs_f64();
            let start = Instant::now();
            let certificate = problem.certificate().expect("covered");
            let certified = start.elapsed().as_secs_f64();
            assert!(certificate.smallest_rcond > 1e-4);
            let times = [placed, tabled, certified];
            let sum = |t: &[f64; 3]| t.iter().sum::<f64>();
            if best.as_ref().is_none_or(|(_, b)| sum(&times) < sum(b)) {
                best = Some((particles, times));
            }
        }
        let (particles, [placed, tabled, certified]) = best.expect("at least one round");
        let sum = placed + tabled + certified;
        let n = particles as f64;
        let slope = before.map_or(f64::NAN, |(m, t)| (sum / t).ln() / (n / m).ln());
        println!("{particles:>10} {placed:>10.3} {tabled:>12.3} {certified:>12.3} {sum:>12.3} {slope:>7.2}");
        before = Some((n, sum));
    }
}
