//! Failures that certificates see before anything is solved: lost cover, spurious modes.

use std::error::Error;
use std::path::Path as FilePath;

use crate::support::Summary;
use rkpm::check::spurious_modes;
use rkpm::output::Chart;
use rkpm::prelude::*;
use rkpm::scene::Rule;

/// The stretch at which the certificate of a spatial kernel at its particles says so, by bisection.
fn stretch_where(r: f64, bad: impl Fn(&rkpm::paper::Cover) -> bool) -> Result<f64, rkpm::Error> {
    let particles = Block::new([0.0], [8.0]).particles([9], r)?;
    let bar = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear())?;
    let (mut good, mut failed) = (1.0, 8.0);
    for _ in 0..50 {
        let middle = 0.5 * (good + failed);
        let spatial = bar.spatial(bar.nodes().iter().map(|x| x * middle).collect())?.with_rcond_limit(1e-300);
        if bad(&spatial.cover(spatial.nodes())) { failed = middle } else { good = middle }
    }
    Ok(failed)
}

pub fn run(out: &FilePath, summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let (mut warned, mut lost) = (Vec::new(), Vec::new());
    for r in [0.75, 1.0, 1.25, 1.5, 2.0] {
        let (warning, loss) = (stretch_where(r, |c| c.is_warned())?, stretch_where(r, |c| c.is_lost())?);
        // Beside it the stretch at which the cover is gone.
        summary.record(format!("spatial_warning_r{r}"), warning, loss)?;
        warned.push([r, warning]);
        lost.push([r, loss]);
    }
    Chart::new("A spatial kernel of fixed dilation warns before its cover is lost")
        .x("normalised dilation r")
        .y("stretch")
        .marked_line("warned", &warned)
        .marked_line("lost", &lost)
        .write(out.join("spatial_warning.svg"))?;

    // Compressible, so that it is the shear that counts and not the pressure alone. Free edges see what a nodal rule
    // can't: its modes are weak and not void, the weaker the larger the set.
    let scene = Scene::new(Block::new([0.0; 2], [1.0; 2]), PlaneStrain, Rubber::neo_hookean(0.5, 5.0 / 3.0)?);
    let mut chart =
        Chart::new("The deformation that a rule sees least, r = 0.75").x_log("particles per side").y_log("smallest θ");
    for (name, title, rule) in [
        ("nodal_modes", "direct nodal integration", Rule::Nodal),
        ("nodal_modes_scni", "SCNI", Rule::Scni),
        ("nodal_modes_default", "default", Rule::Auto),
    ] {
        let mut curve = Vec::new();
        for count in [9, 13, 17, 25] {
            let scheme = Scheme::default().particles([count]).dilation(0.75).rule(rule.clone());
            let stability = spurious_modes(&scene, &scheme)?;
            curve.push([count as f64, stability.smallest]);
            if count == 25 {
                summary.note(name, stability.zero_modes as f64)?;
                summary.note(format!("{name}_smallest_theta"), stability.smallest)?;
                summary.note(format!("{name}_largest_theta"), stability.largest)?;
            }
        }
        chart = chart.marked_line(title, &curve);
    }
    chart.write(out.join("nodal_modes.svg"))?;
    Ok(())
}
