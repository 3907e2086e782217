//! A bump stop: a rubber sleeve whose groove closes on itself while it is pressed to 70 % of its height.
//!
//! `cargo run --release --example bump_stop [-- --out DIR]` prints a table and writes `summary.csv`, forces and pictures.
//! Lengths in mm, stresses in MPa, forces in N of the full turn; a body of revolution between plates without friction.

mod support;

use std::error::Error;

use rkpm::output::chart::{Colour, Series};
use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use rkpm::scene::ContactPoint;
use support::Summary;

const BORE: f64 = 6.0;
const OUTER: f64 = 15.0;
const HEIGHT: f64 = 40.0;
/// Centre of the round groove and its radius.
const GROOVE: [f64; 2] = [16.0, 3.0];
const STEPS: usize = 20;

fn stop() -> Result<Scene<2>, rkpm::Error> {
    let ([centre, radius], middle) = (GROOVE, 0.5 * HEIGHT);
    let half = (radius * radius - (centre - OUTER).powi(2)).sqrt();
    let outline = Outline::at([BORE, 0.0])
        .line("bottom", [OUTER, 0.0])
        .line("outside", [OUTER, middle - half])
        .arc("outside", [OUTER, middle + half], [centre, middle], Turn::Right)
        .line("outside", [OUTER, HEIGHT])
        .line("top", [BORE, HEIGHT])
        .close("bore");
    let rubber = Rubber::mooney_rivlin(0.6, 0.15, 500.0)?;
    let break_points = Amplitude::table((0..=STEPS).map(|k| k as f64 / STEPS as f64).map(|x| (x, x)).collect())?;
    Ok(Scene::new(Region::new(outline)?, Axisymmetric, rubber)
        .prescribe("bottom", 1, 0.0)
        .with(Condition::on("top").component(1, -0.3 * HEIGHT).amplitude(break_points))
        .contact_itself("outside", "groove"))
}

/// How deep any particle of the outside lies behind the line between two others that it faces: trace functions meet on the mean.
fn depth(points: &[ContactPoint<2>]) -> f64 {
    let across = |along: Point<2>| Point::<2>::new(along[1], -along[0]).normalize();
    // Particles along the outline from below, outward to the right.
    let mut deepest: f64 = 0.0;
    for (k, point) in points.iter().enumerate() {
        let (before, behind) = (k.saturating_sub(1), (k + 1).min(points.len() - 1));
        let outward = across(points[behind].position - points[before].position);
        for (_, pair) in points.windows(2).enumerate().filter(|(l, _)| l.abs_diff(k) > 3) {
            let along = pair[1].position - pair[0].position;
            if along.norm() == 0.0 {
                continue;
            }
            let (normal, away) = (across(along), point.position - pair[0].position);
            let (at, gap) = (away.dot(&along) / along.norm_squared(), away.dot(&normal));
            if (0.0..1.0).contains(&at) && outward.dot(&normal) < -0.2 && gap < 0.0 && -gap < 0.2 * (OUTER - BORE) {
                deepest = deepest.max(-gap);
            }
        }
    }
    deepest
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("bump_stop");
    let mut summary = Summary::new();
    let mut table = Table::new(["particles", "closure_mm", "force_N", "contact_width_mm", "contact_peak_MPa"]);
    let mut chart = Chart::new("A bump stop").x("closure [mm]").y("force [N]");
    let mut penetration: f64 = 0.0;
    for (spacing, size) in [(1.6, 182), (1.2, 301), (0.84, 600)] {
        let problem = stop()?.discretize(&Scheme::default().spacing(spacing))?;
        let path = problem.run()?;
        let particles = problem.cells().positions().len();
        let mut curve = vec![[0.0, 0.0]];
        let mut deepest: f64 = 0.0;
        for step in &path.steps {
            let groove = problem.contact(&step.state, "groove")?;
            let force = -problem.reaction(&step.state, "top")?[1];
            let closure = 0.3 * HEIGHT * step.state.load;
            curve.push([closure, force]);
            table.push([particles as f64, closure, force, groove.extent, groove.peak_pressure()])?;
            deepest = deepest.max(depth(&groove.points));
        }
        let groove = problem.contact(path.last(), "groove")?;
        let name = |what: &str| format!("{what}_{size}");
        // What part of the way was reached: 1 at 70 % of the height.
        summary.note(name("reached"), path.last().load)?;
        summary.note(name("particles"), particles as f64)?;
        penetration = penetration.max(deepest / (OUTER - BORE));
        summary.note(name("height"), 1.0 - 0.3 * path.last().load)?;
        summary.note(name("force_N"), -problem.reaction(path.last(), "top")?[1])?;
        summary.note(name("steps"), path.steps.len() as f64)?;
        summary.note(name("factorisations"), path.iterations as f64)?;
        summary.note(name("contact_peak_MPa"), groove.peak_pressure())?;
        summary.note(name("contact_width_mm"), groove.extent)?;
        summary.note(name("penetration_of_wall"), deepest / (OUTER - BORE))?;
        chart = chart.marked_line(format!("{particles} particles"), &curve);
        let positions = support::deformed(&problem, path.last())?;
        Chart::new("A bump stop at 70 % of its height")
            .x("R [mm]")
            .y("Z [mm]")
            .with(
                Series::outlines("at rest", &support::cells(&problem, problem.cells().positions()))
                    .colour(Colour::Grey),
            )
            .with(Series::outlines("pressed", &support::cells(&problem, &positions)).colour(Colour::Blue))
            .equal_aspect()
            .size(460, 720)
            .write(out.join(format!("shape_{particles}.svg")))?;
    }
    summary.note("penetration", penetration)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    table.write(out.join("forces.csv"))?;
    chart.write(out.join("force.svg"))?;
    println!("results in {}", out.display());
    Ok(())
}
