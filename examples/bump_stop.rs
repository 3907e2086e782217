//! A bump stop: a rubber sleeve whose fold closes on itself while it is pressed to 70 % of its height.
//!
//! `cargo run --release --example bump_stop [-- --out DIR]` prints a table and writes `summary.csv`, forces and pictures.
//! Lengths in mm, stresses in MPa, forces in N of the full turn; a body of revolution between plates without friction.

mod support;

use std::error::Error;

use rkpm::output::chart::{Colour, Series};
use rkpm::output::{Chart, Summary, Table};
use rkpm::prelude::*;

const BORE: f64 = 6.0;
const OUTER: f64 = 15.0;
const HEIGHT: f64 = 40.0;
/// Root of the fold, its half width at the mouth and the radius of its root.
const FOLD: [f64; 3] = [10.5, 3.5, 1.0];
const STEPS: usize = 20;

fn stop() -> Result<Scene<2>, rkpm::Error> {
    let ([root, half, round], middle) = (FOLD, 0.5 * HEIGHT);
    // The flanks touch the rounded root: from its centre they are seen under this angle to the mouth.
    let centre = root + round;
    let (away, long) = (OUTER - centre, half.hypot(OUTER - centre));
    let turn = (half / away).atan() + (round / long).acos();
    let [x, y] = [centre + round * turn.cos(), round * turn.sin()];
    let outline = Outline::at([BORE, 0.0])
        .line("bottom", [OUTER, 0.0])
        .line("side", [OUTER, middle - half])
        .line("fold", [x, middle - y])
        .arc("fold", [x, middle + y], [centre, middle], Turn::Right)
        .line("fold", [OUTER, middle + half])
        .line("side", [OUTER, HEIGHT])
        .line("top", [BORE, HEIGHT])
        .close("bore");
    let rubber = Rubber::mooney_rivlin(0.6, 0.15, 500.0)?;
    let break_points = Amplitude::table((0..=STEPS).map(|k| k as f64 / STEPS as f64).map(|x| (x, x)).collect())?;
    Ok(Scene::on(Region::new(outline)?, Axisymmetric, rubber)
        .prescribe("bottom", 1, 0.0)
        .with(Condition::on("top").component(1, -0.3 * HEIGHT).amplitude(break_points))
        .contact_itself("fold", "fold"))
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("bump_stop");
    let mut summary = Summary::new();
    let mut table = Table::new(["particles", "closure_mm", "force_N", "fold_width_mm", "fold_peak_MPa"]);
    let mut chart = Chart::new("A bump stop").x("closure [mm]").y("force [N]");
    for spacing in [1.6, 1.2] {
        let problem = stop()?.discretize(&Scheme::default().spacing(spacing))?;
        let path = problem.run(&mut ())?;
        let particles = problem.cells().positions().len();
        let mut curve = vec![[0.0, 0.0]];
        let mut deepest: f64 = 0.0;
        for step in &path.steps {
            let fold = problem.contact(&step.state, "fold")?;
            let force = -problem.reaction(&step.state, "top")?[1];
            let closure = 0.3 * HEIGHT * step.state.load;
            curve.push([closure, force]);
            table.push([particles as f64, closure, force, fold.extent, fold.peak_pressure()])?;
            deepest = fold.points.iter().map(|point| -point.gap).fold(deepest, f64::max);
        }
        let fold = problem.contact(path.last(), "fold")?;
        let name = |what: &str| format!("{what}_{particles}");
        summary.note(name("height"), 1.0 - 0.3 * path.last().load)?;
        summary.note(name("force_N"), -problem.reaction(path.last(), "top")?[1])?;
        summary.note(name("steps"), path.steps.len() as f64)?;
        summary.note(name("factorisations"), path.iterations as f64)?;
        summary.note(name("fold_peak_MPa"), fold.peak_pressure())?;
        summary.note(name("fold_width_mm"), fold.extent)?;
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
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    table.write(out.join("forces.csv"))?;
    chart.write(out.join("force.svg"))?;
    println!("results in {}", out.display());
    Ok(())
}
