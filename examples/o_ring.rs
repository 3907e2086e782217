//! An O-ring in its groove: squeezed by a lid, then pressed by gas against the far wall.
//!
//! `cargo run --release --example o_ring [-- --out DIR]` prints a table and writes `summary.csv`, pressures and pictures.
//! Lengths in mm, stresses in MPa; plane strain, for a ring much wider than its cord.
//!
//! The gas acts on the left half of the cord, up to the middle of either contact. Where a surface touches, contact carries
//! the rest of the pressure: it opens exactly where the pressure between rubber and metal would fall below that of the gas, and
//! the gas follows. The seal leaks once that has come to the middle of a contact.

mod support;

use std::error::Error;

use rkpm::geometry::Part;
use rkpm::output::Chart;
use rkpm::output::chart::{Colour, Series};
use rkpm::prelude::*;
use support::Summary;

/// Radius of the cord, width of the groove, squeeze as a part of the cord, pressure of the gas.
const CORD: f64 = 1.765;
const WIDTH: f64 = 4.8;
const SQUEEZE: f64 = 0.25;
const GAS: f64 = 10.0;

fn seal() -> Result<(Scene<2>, Profile), rkpm::Error> {
    let cord = Outline::at([0.0, 2.0 * CORD]).arc("wet", [0.0, 0.0], [0.0, CORD], Turn::Left).arc(
        "dry",
        [0.0, 2.0 * CORD],
        [0.0, CORD],
        Turn::Left,
    );
    let (half, round, top) = (0.5 * WIDTH, 0.3, 4.0 * CORD);
    let groove = Profile::at([half, top])
        .line([half, round])
        .arc([half - round, 0.0], [half - round, round], Turn::Right)
        .line([-half + round, 0.0])
        .arc([-half, round], [-half + round, round], Turn::Right)
        .line([-half, top]);
    let rubber = Rubber::mooney_rivlin(1.0, 0.25, 2000.0)?;
    let first = Amplitude::table(vec![(0.0, 0.0), (0.5, 1.0), (1.0, 1.0)])?;
    let steps = (1..=10).map(|k| (0.5 + 0.05 * f64::from(k), 0.1 * f64::from(k)));
    let then = Amplitude::table([(0.0, 0.0), (0.5, 0.0)].into_iter().chain(steps).collect())?;
    let lid = RigidSurface::plane([0.0, 2.0 * CORD], [0.0, -1.0]).moving_along([0.0, -2.0 * CORD * SQUEEZE], first);
    let scene = Scene::new(Region::new(cord)?, PlaneStrain, rubber)
        .with(Load::pressure("wet", GAS).amplitude(then))
        .contact(Part::Whole, lid.named("lid"))
        .contact(Part::Whole, RigidSurface::profile(groove.clone()).named("groove"));
    Ok((scene, groove))
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("o_ring");
    let (scene, groove) = seal()?;
    let problem = scene.discretize(&Scheme::default().particles([27]))?;
    let path = problem.run()?;
    let mut summary = Summary::new();
    summary.note("particles", problem.cells().positions().len() as f64)?;
    summary.note("load", path.last().load)?;
    let squeezed = path.steps.iter().position(|step| step.state.load >= 0.5).unwrap_or(0);
    summary.note("squeeze_steps", squeezed as f64 + 1.0)?;
    summary.note("factorisations", path.iterations as f64)?;
    let mut leak = f64::INFINITY;
    let mut curve = Vec::new();
    for step in &path.steps {
        let lid = problem.contact(&step.state, "lid")?;
        let gas = GAS * (2.0 * step.state.load - 1.0).max(0.0);
        // On the dry side contact carries all; the gas has come through where nothing touches in the middle or beyond.
        let dry = lid.points.iter().filter(|point| point.reference[0] >= -1e-9).map(|point| point.pressure);
        let sealing = dry.fold(0.0, f64::max);
        if sealing <= gas && gas > 0.0 {
            leak = leak.min(gas);
        }
        curve.push([gas, sealing]);
        if step.state.load == 0.5 {
            summary.note("squeeze_force_N_per_mm", -lid.force[1])?;
            summary.note("squeeze_width_mm", lid.extent)?;
            summary.note("squeeze_peak_MPa", lid.peak_pressure())?;
        }
    }
    if leak.is_finite() {
        summary.note("leak_pressure_MPa", leak)?;
    } else {
        summary.note("tight_up_to_MPa", GAS)?;
    }
    let balance = {
        let state = path.last();
        let forces = problem.contact(state, "lid")?.force + problem.contact(state, "groove")?.force;
        let gas = GAS * (2.0 * state.load - 1.0).max(0.0);
        // The gas pushes on what it wets: along the chord between its ends.
        let ends = [[0.0, 0.0], [0.0, 2.0 * CORD]]
            .map(|x| problem.displacement(state, &x.into()).map(|u| u + Point::<2>::from(x)));
        let [low, high] = ends;
        let chord = high? - low?;
        let push = Point::<2>::new(chord[1], -chord[0]) * gas;
        (forces + push).norm() / push.norm()
    };
    summary.note("balance", balance)?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    for name in ["lid", "groove"] {
        problem.contact(path.last(), name)?.table()?.write(out.join(format!("pressure_{name}.csv")))?;
    }
    let wall: Vec<[f64; 2]> = groove.drawn(12).iter().map(|x| [x[0], x[1]]).filter(|x| x[1] <= 2.5 * CORD).collect();
    for (name, state) in [
        ("squeezed", path.steps.get(squeezed).map_or(path.last(), |step| &step.state)),
        ("pressed by gas", path.last()),
    ] {
        let positions = support::deformed(&problem, state)?;
        let lid = problem.contact(state, "lid")?.travel[1] + 2.0 * CORD;
        Chart::new(format!("O-ring, {name}"))
            .x("x [mm]")
            .y("y [mm]")
            .with(Series::outlines("", &support::cells(&problem, &positions)).colour(Colour::Blue))
            .line("groove", &wall)
            .line("lid", &[[-0.6 * WIDTH, lid], [0.6 * WIDTH, lid]])
            .equal_aspect()
            .size(640, 460)
            .write(out.join(format!("{}.svg", name.replace(' ', "_"))))?;
    }
    Chart::new("Does it seal?")
        .x("pressure of the gas [MPa]")
        .y("largest pressure under the lid, dry side [MPa]")
        .marked_line("contact", &curve)
        .dashed("gas", &[[0.0, 0.0], [GAS, GAS]])
        .write(out.join("sealing.svg"))?;
    println!("results in {}", out.display());
    Ok(())
}
