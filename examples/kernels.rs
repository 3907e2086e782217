//! Kernel functions, their corrections, and why rubber wants a material kernel (paper §3.1, §4.3).
//!
//! `cargo run --release --example kernels [-- --out DIR]` writes Fig. 1 (kernel and modified kernel), Figs. 2 and 3
//! (material and spatial kernel of a stretched bar), the kernels of the crate, and `summary.csv`: the stretch at
//! which a spatial kernel of fixed dilation loses its cover at particles (`lost_r…`), and the smaller one at
//! which the certificate warns (`warned_r…`).

mod support;

use std::error::Error;
use std::path::Path as FilePath;

use rkpm::output::{Chart, Summary, Table};
use rkpm::prelude::*;

/// Nine particles one unit apart with their volumes inside the sum (3.24).
fn bar(r: f64) -> Result<ReproducingKernel<1, CubicSpline, Polynomial<1>>, rkpm::Error> {
    let particles = Block::new([0.0], [8.0]).particles([9], r)?;
    let volumes = (0..9).map(|i| if i == 0 || i == 8 { 0.5 } else { 1.0 }).collect();
    Ok(ReproducingKernel::new(particles.with_volumes(volumes)?, CubicSpline, Polynomial::linear())?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("kernels");
    modified_kernels(&out)?;
    stretched_kernels(&out)?;
    all_kernels(&out)?;
    lost_cover(&out)?;
    println!("results in {}", out.display());
    Ok(())
}

/// Fig. 1: the correction changes the kernel near an end and leaves its shape alone inside.
fn modified_kernels(out: &FilePath) -> Result<(), Box<dyn Error>> {
    let rk = bar(1.0)?;
    let mut chart =
        Chart::new("Kernel and modified kernel, nine particles, r = 1").x("x").y("kernel × particle volume");
    for particle in [0, 1, 4] {
        let mut plain = Vec::new();
        let mut modified = Vec::new();
        for i in 0..=320 {
            let x = [i as f64 / 40.0].into();
            let weights = rk.kernel_weights(&x);
            let weight = weights.iter().find(|w| w.0 == particle).map_or(0.0, |w| w.1);
            // (3.25) integrates to 1/2: twice the kernel estimates a constant inside the bar.
            plain.push([x[0], 2.0 * weight]);
            modified.push([x[0], rk.modified_kernel(&x, particle as usize)?]);
        }
        let name = format!("particle {particle}");
        chart = chart.line(format!("{name}, modified"), &modified).dashed(format!("{name}, 2Φ"), &plain);
    }
    chart.write(out.join("modified_kernel.svg"))?;
    Ok(())
}

/// Figs. 2 and 3: a bar stretched by x = (1 + t) X; the support of a material kernel follows the particles, that
/// of a spatial one does not. Each kernel over the original and over the current configuration.
fn stretched_kernels(out: &FilePath) -> Result<(), Box<dyn Error>> {
    // The support covers five particles at rest, as in the paper.
    let rk = bar(1.5)?;
    let middle = 4;
    for (name, material) in [("material_kernel", true), ("spatial_kernel", false)] {
        let equation = if material { "Material kernel (4.52)" } else { "Spatial kernel (4.55)" };
        let mut original = Chart::new(format!("{equation}, original configuration"))
            .x("X")
            .y("kernel of the middle particle, stretch by stretch below");
        let mut current = Chart::new(format!("{equation}, current configuration"))
            .x("x")
            .y("kernel of the middle particle, stretch by stretch below");
        for (row, t) in [0.0, 0.5, 1.0, 2.0].into_iter().enumerate() {
            let stretch = 1.0 + t;
            let base = -(row as f64);
            let moved = rk.nodes().iter().map(|x| x * stretch).collect::<Vec<_>>();
            // A spatial kernel stands at the moved particles and is requested at points of the moved bar.
            let spatial = rk.spatial(moved.clone())?;
            let kernel = |x: f64| {
                let weights = if material {
                    rk.kernel_weights(&[x].into())
                } else {
                    spatial.kernel_weights(&[x * stretch].into())
                };
                weights.iter().find(|w| w.0 == middle).map_or(0.0, |w| w.1)
            };
            let places = (0..=640).map(|i| f64::from(i) / 80.0);
            let values: Vec<[f64; 2]> = places.map(|x| [x, base + kernel(x)]).collect();
            let stretched: Vec<[f64; 2]> = values.iter().map(|q| [q[0] * stretch, q[1]]).collect();
            let at_rest: Vec<[f64; 2]> = rk.nodes().iter().map(|x| [x[0], base]).collect();
            let now: Vec<[f64; 2]> = moved.iter().map(|x| [x[0], base]).collect();
            original = original.line(format!("stretch {stretch}"), &values).markers("", &at_rest);
            current = current.line(format!("stretch {stretch}"), &stretched).markers("", &now);
        }
        std::fs::write(out.join(format!("{name}.svg")), support::panels(&[original, current])?)?;
    }
    Ok(())
}

/// The kernels of the crate side by side.
fn all_kernels(out: &FilePath) -> Result<(), Box<dyn Error>> {
    let gaussian = Gaussian::default();
    let kernels: [(&str, &dyn Kernel); 4] = [
        ("cubic B-spline (3.25)", &CubicSpline),
        ("quintic B-spline", &QuinticSpline),
        ("Gaussian, width 0.4", &gaussian),
        ("Wendland C2", &WendlandC2),
    ];
    let mut chart = Chart::new("Kernels, scaled to one at the centre").x("z = |x − x_I| / a").y("Φ(z) / Φ(0)");
    for (name, kernel) in kernels {
        let top = kernel.value_and_slope(0.0).0;
        let curve: Vec<[f64; 2]> =
            (0..=120).map(|i| f64::from(i) / 100.0).map(|z| [z, kernel.value_and_slope(z).0 / top]).collect();
        chart = chart.line(name, &curve);
    }
    chart.write(out.join("kernels.svg"))?;
    Ok(())
}

/// The stretch at which a spatial kernel loses its cover at particles, found by bisection, and its warning.
fn lost_cover(out: &FilePath) -> Result<(), Box<dyn Error>> {
    let mut summary = Summary::new();
    let mut table = Table::new(["r", "stretch", "smallest_rcond"]);
    let mut chart = Chart::new("Certificate of a spatial kernel at its particles")
        .x("stretch 1 + t")
        .y_log("smallest reciprocal condition of M");
    for r in [0.75, 1.0, 1.25, 1.5, 2.0] {
        let rk = bar(r)?;
        let cover = |stretch: f64| -> Result<_, rkpm::Error> {
            // As far as the arithmetic goes: the usual guard would refuse a hair earlier.
            let spatial = rk.spatial(rk.nodes().iter().map(|x| x * stretch).collect())?.with_rcond_limit(1e-300);
            Ok(spatial.cover(spatial.nodes()))
        };
        let bisect = |bad: &dyn Fn(&rkpm::paper::Cover) -> bool| -> Result<f64, rkpm::Error> {
            let (mut good, mut lost) = (1.0, 8.0);
            for _ in 0..50 {
                let middle = 0.5 * (good + lost);
                if bad(&cover(middle)?) { lost = middle } else { good = middle }
            }
            Ok(lost)
        };
        // Linear basis: both neighbours leave the support together, at 2r.
        summary.record(format!("lost_r{r}"), bisect(&|c| c.is_lost())?, 2.0 * r)?;
        summary.note(format!("warned_r{r}"), bisect(&|c| c.is_warned())?)?;
        let mut curve = Vec::new();
        for i in 0..=150 {
            let stretch = 1.0 + f64::from(i) / 50.0;
            let rcond = cover(stretch)?.rcond;
            table.push([r, stretch, rcond])?;
            curve.push([stretch, if rcond > 1e-8 { rcond } else { f64::NAN }]);
        }
        chart = chart.line(format!("r = {r}"), &curve);
    }
    chart.horizontal("warning", rkpm::paper::COVER_WARNING).write(out.join("cover.svg"))?;
    table.write(out.join("cover.csv"))?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
