//! A bonded rubber pad sheared, held and released: its force relaxes by the Prony series of its material.
//!
//! A pad 40 × 10 in plane strain between rigid plates is sheared by half of its height, suddenly, and held for 100 s. Held, an incompressible
//! body keeps its shape while all of its stresses fall alike, so that the force is the elastic one times $G(t)/G_0$: exact. Then the
//! same pad is sheared to and fro, and steps of time are halved to measure their order; infinitely fast and slow
//! loading are compared with the two elastic laws.
//!
//! `cargo run --release --example relaxation [-- --out DIR]` prints a table and writes `summary.csv` and the chart of the force. mm, N, MPa,
//! s.

mod support;

use std::error::Error;
use std::sync::Arc;

use rkpm::material::{Material, Prony, Viscoelastic};
use rkpm::output::Chart;
use rkpm::prelude::*;
use support::Summary;

const A10: f64 = 0.4;
/// Ten thousand shear moduli.
const BULK: f64 = 8e3;
const SERIES: [(f64, f64); 4] = [(0.2, 0.1), (0.15, 1.0), (0.1, 10.0), (0.1, 50.0)];
const DURATION: f64 = 100.0;

fn prony() -> Result<Prony, rkpm::error::MaterialError> {
    Prony::of_instantaneous(SERIES)
}

fn relaxing() -> Result<Viscoelastic<Rubber>, rkpm::error::MaterialError> {
    Ok(Viscoelastic::new(Rubber::neo_hookean(A10, BULK)?, prony()?))
}

fn pad(material: impl Material + 'static, course: Amplitude, clock: Amplitude) -> Scene<2> {
    Scene::new(Block::new([0.0, 0.0], [40.0, 10.0]), PlaneStrain, material)
        .hold((1, Side::Min))
        .with(Condition::on((1, Side::Max)).displacement([5.0, 0.0]).amplitude(course))
        .with_clock(clock)
}

fn problem(scene: &Scene<2>, stepping: Stepping) -> Result<Problem<2>, rkpm::Error> {
    scene.discretize(&Scheme::default().particles([17, 5]).stepping(stepping))
}

fn force(problem: &Problem<2>, state: &rkpm::solve::State) -> Result<f64, rkpm::Error> {
    Ok(problem.reaction(state, (1, Side::Max))?[0])
}

fn line(duration: f64) -> Amplitude {
    Amplitude::Table(vec![(0.0, 0.0), (1.0, duration)])
}

/// The force at the end of a run of equal steps.
fn last_force(
    material: impl Material + 'static,
    course: Amplitude,
    duration: f64,
    steps: usize,
) -> Result<f64, Box<dyn Error>> {
    let problem = problem(&pad(material, course, line(duration)), Stepping::equal(steps))?;
    let path = problem.run()?.completed()?;
    Ok(force(&problem, path.last())?)
}

/// A disc between bonded plates, 9 × 5 particles over half of its height: the part of its force that is left after the relaxation,
/// compared with quadratic elements, and the steps that were rejected. Pressed by 1 and 5 % of its height.
fn disc(summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let hold = Amplitude::table(vec![(0.0, 0.0), (0.1, 1.0), (1.0, 1.0)])?;
    let clock = Amplitude::table(vec![(0.0, 0.0), (0.1, 0.0), (0.4, 1.0), (1.0, DURATION)])?;
    for press in [0.01, 0.05] {
        let left = |scheme: &Scheme| -> Result<(f64, usize), Box<dyn Error>> {
            let down = Condition::on((1, Side::Max)).displacement([0.0, -5.0 * press]).amplitude(hold.clone());
            let disc = Scene::new(Block::new([0.0, 0.0], [10.0, 5.0]), Axisymmetric, relaxing()?)
                .prescribe((0, Side::Min), 0, 0.0)
                .prescribe((1, Side::Min), 1, 0.0)
                .with(down)
                .with_clock(clock.clone());
            let problem = disc.discretize(scheme)?;
            let path = problem.run()?.completed()?;
            let force = |state: &rkpm::solve::State| problem.reaction(state, (1, Side::Max)).map(|force| force[1]);
            let pressed =
                path.steps.iter().find(|step| step.state.load >= 0.1 - 1e-12).ok_or("no step ends at the press")?;
            Ok((force(path.last())? / force(&pressed.state)?, path.rejected))
        };
        let (reference, _) = left(&Scheme::elements(2).particles([33, 17]))?;
        let (own, rejected) = left(&Scheme::default().particles([9, 5]))?;
        summary.record(format!("disc_{press}_left"), own, reference)?;
        summary.note(format!("disc_{press}_rejected"), rejected as f64)?;
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("relaxation");
    let mut summary = Summary::new();

    let hold = Amplitude::table(vec![(0.0, 0.0), (0.1, 1.0), (1.0, 1.0)])?;
    let clock = Amplitude::table(vec![(0.0, 0.0), (0.1, 0.0), (0.4, 1.0), (1.0, DURATION)])?;
    let held = problem(&pad(relaxing()?, hold, clock), Stepping::default())?;
    let path = held.run()?.completed()?;
    let elastic = last_force(Rubber::neo_hookean(A10, BULK)?, Amplitude::Ramp, 1.0, 1)?;
    let mut course = Vec::new();
    let mut worst = (0.0, elastic, elastic);
    for step in path.steps.iter().filter(|step| step.state.load >= 0.1) {
        let (time, found) = (held.time(&step.state), force(&held, &step.state)?);
        let exact = elastic * prony()?.relaxation(time);
        course.push([time, found]);
        if (found / exact - 1.0).abs() > worst.0 {
            worst = ((found / exact - 1.0).abs(), found, exact);
        }
    }
    summary.record("force_at_worst_time", worst.1, worst.2)?;
    summary.record("force_relaxed", force(&held, path.last())?, elastic * prony()?.relaxation(DURATION))?;
    summary.note("steps", path.steps.len() as f64)?;

    // To and fro: the error of second order falls by four where steps are halved.
    let sine = || Amplitude::Function(Arc::new(|load| (std::f64::consts::TAU * 1.25 * load).sin()));
    let forces = [20, 40, 80, 160].map(|steps| last_force(relaxing().map_err(rkpm::Error::from)?, sine(), 10.0, steps));
    let [a, b, c, d] = forces;
    let (a, b, c, d) = (a?, b?, c?, d?);
    summary.note("order_20_40_80", ((a - b) / (b - c)).log2())?;
    summary.note("order_40_80_160", ((b - c) / (c - d)).log2())?;

    // The two elastic laws.
    let relaxed = prony()?.relaxation(f64::INFINITY);
    let slow_elastic = last_force(Rubber::neo_hookean(A10 * relaxed, BULK)?, Amplitude::Ramp, 1.0, 1)?;
    summary.record("force_infinitely_fast", last_force(relaxing()?, Amplitude::Ramp, 1e-11, 1)?, elastic)?;
    summary.record("force_infinitely_slow", last_force(relaxing()?, Amplitude::Ramp, 1e16, 1)?, slow_elastic)?;

    disc(&mut summary)?;

    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    let exact: Vec<[f64; 2]> = (0..=200)
        .map(|k| 1e-2 * 1e4f64.powf(f64::from(k) / 200.0))
        .map(|t| Ok::<_, rkpm::Error>([t, elastic * prony()?.relaxation(t)]))
        .collect::<Result<_, _>>()?;
    Chart::new("A pad sheared suddenly and held")
        .x_log("time t [s]")
        .y("force F [N/mm]")
        .line("exact, F₀ G(t)/G₀", &exact)
        .markers("17 × 5 particles, steps chosen by their error", &course)
        .write(out.join("relaxation.svg"))?;
    println!("results in {}", out.display());
    Ok(())
}
