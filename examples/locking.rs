//! Volumetric locking: the error on Cook's membrane against the bulk modulus, for rules with and without a
//! cure. What is cured does not care how incompressible the rubber is.
//!
//! `cargo run --release --example locking [-- --out DIR]` prints a table and writes `summary.csv`,
//! `locking.csv` and a chart. Lengths in mm, stresses in MPa.

mod support;

use std::error::Error;

use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use rkpm::scene::Rule;
use support::Summary;

const SHEAR_MODULUS: f64 = 80.194;

/// Cook's membrane with bulk modulus `ratio` times the shear modulus.
fn membrane(ratio: f64) -> Result<Scene<2>, rkpm::Error> {
    let rubber = Rubber::neo_hookean(SHEAR_MODULUS / 2.0, ratio * SHEAR_MODULUS)?;
    let corners = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]];
    Ok(Scene::new(Quadrilateral { corners }, PlaneStrain, rubber)
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.0, 6.25]))
}

/// Deflections of the upper corner and of the middle of the right edge, and the energy stored: one
/// quantity alone may be right by chance.
fn quantities(ratio: f64, scheme: &Scheme) -> Result<[f64; 3], rkpm::Error> {
    let problem = membrane(ratio)?.discretize(scheme)?;
    let path = problem.run()?.completed()?;
    let deflection = |x: [f64; 2]| problem.displacement(path.last(), &x.into()).map(|u| u[1]);
    Ok([deflection([48.0, 60.0])?, deflection([48.0, 52.0])?, problem.energy(path.last())?])
}

/// The limit of quadratic elements with linear pressures: 8, 16 and 32 per direction, extrapolated by
/// Aitken's rule, which finds the rate that the clamped corner leaves by itself.
fn reference(ratio: f64) -> Result<[f64; 3], rkpm::Error> {
    let level = |nodes: usize| quantities(ratio, &Scheme::elements(2).particles([nodes]));
    let (coarse, middle, fine) = (level(17)?, level(33)?, level(65)?);
    Ok(std::array::from_fn(|i| {
        let (first, second) = (middle[i] - coarse[i], fine[i] - middle[i]);
        let rate = second / first;
        // Without a steady approach the finest level is all there is.
        if rate > 0.0 && rate < 1.0 { fine[i] + second * rate / (1.0 - rate) } else { fine[i] }
    }))
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("locking");
    let default = Scheme::default().particles([9]);
    let uncured = |rule: Rule| default.clone().rule(rule).pressure_field(PressureField::Pointwise, 1);
    let schemes = [
        ("default", "default: smoothed, linear pressures", default.clone()),
        ("smoothed_uncured", "smoothed, no cure", uncured(Rule::Smoothed { parts: 2 })),
        ("gauss_uncured", "Gauss 4 × 4, no cure", uncured(Rule::Gauss { zones: None, points: Some(4) })),
        ("paper", "the paper's scheme", Scheme::paper(1.0).particles([9])),
        ("q1p0", "finite elements Q1/P0", Scheme::elements(1).particles([9])),
    ];

    // For each scheme the worst relative error of the three quantities, with its sign, at each k/µ.
    let mut curves = vec![Vec::new(); schemes.len()];
    for exponent in 0..=6 {
        let ratio = 10f64.powi(exponent);
        let exact = reference(ratio)?;
        for (curve, (.., scheme)) in curves.iter_mut().zip(&schemes) {
            let errors = quantities(ratio, scheme)?.into_iter().zip(exact).map(|(value, exact)| value / exact - 1.0);
            curve.push([ratio, errors.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(f64::NAN)]);
        }
    }

    let mut summary = Summary::new();
    let mut table = Table::new(["scheme", "k_over_mu", "worst_relative_error"]);
    let mut chart = Chart::new("Cook's membrane, 9 × 9 particles: worst of tip, middle and energy")
        .x_log("bulk modulus over shear modulus k / µ")
        .y_log("largest relative error");
    for ((name, title, _), curve) in schemes.iter().zip(&curves) {
        for (exponent, &[ratio, error]) in curve.iter().enumerate() {
            summary.note(format!("worst_{name}_1e{exponent}"), error)?;
            table.push([name.to_string(), ratio.to_string(), error.to_string()])?;
        }
        let sizes: Vec<[f64; 2]> = curve.iter().map(|&[ratio, error]| [ratio, error.abs()]).collect();
        chart = chart.marked_line(*title, &sizes);
    }
    // Percentage points between the best and the worst of k/µ = 10 … 1e6.
    let sizes = || curves[0][1..].iter().map(|point| point[1].abs());
    summary.note("locking_spread", 100.0 * (sizes().fold(0.0, f64::max) - sizes().fold(f64::INFINITY, f64::min)))?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    table.write(out.join("locking.csv"))?;
    chart.write(out.join("locking.svg"))?;
    println!("results in {}", out.display());
    Ok(())
}
