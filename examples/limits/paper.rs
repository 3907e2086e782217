//! The sets on which an independent prototype of the method stopped.

use std::error::Error;
use std::path::Path as FilePath;

use crate::support::Summary;
use rkpm::output::Chart;
use rkpm::prelude::*;
use rkpm::scene::Rule;
use rkpm::solve::{CriticalKind, StepControl};

use crate::Stops;

/// The last pressure of the paper's disk [MPa].
const PRESSURE: f64 = 0.207;

/// The disk of §6.4, its edge held.
fn disk() -> Result<Scene<2>, rkpm::Error> {
    let rubber = Rubber::mooney_rivlin(0.5516, 0.1379, 689.5)?;
    Ok(Scene::new(Block::new([0.0, 0.0], [18.923, 0.635]), Axisymmetric, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((0, Side::Max))
        .pressure((1, Side::Min), PRESSURE))
}

/// The sheet of §6.1 pressed to a tenth of its length.
fn sheet() -> Result<Scene<2>, rkpm::Error> {
    Ok(Scene::new(Block::new([0.0, 0.0], [1.0, 0.25]), PlaneStrain, Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?)
        .prescribe(Side::Min, 0, 0.0)
        .prescribe(Side::Max, 0, -0.9)
        .prescribe(Place::at([0.0, 0.0]), 1, 0.0))
}

/// Runs a scheme by its default stepping and by arc length. The first critical load tells whether its own equations
/// have a limit point, past which no load control gets but by a jump; the arcs, whether there is a way round it.
fn both_ways(
    row: &str,
    title: &str,
    scale: f64,
    scene: &Scene<2>,
    scheme: &Scheme,
    summary: &mut Summary,
    stops: &mut Stops,
) -> Result<EquilibriumPath, Box<dyn Error>> {
    let path = scene.discretize(scheme)?.run()?;
    summary.note(row, scale * path.last().load)?;
    stops.add(row, title, scale, &path)?;
    let most = path.steps.iter().filter_map(|step| step.unstable).max().unwrap_or_default();
    summary.note(format!("{row}_most_unstable_modes"), most as f64)?;
    let stepping = Stepping { control: StepControl::ArcLength, steps: 200, ..Stepping::default() };
    let path = scene.discretize(&scheme.clone().stepping(stepping))?.run()?;
    stops.add(row, &format!("{title}; arc length"), scale, &path)?;
    let limits: Vec<_> = path.critical_points().filter(|point| point.kind == CriticalKind::Limit).collect();
    let first = limits.first().map_or(f64::NAN, |point| scale * point.load());
    summary.note(format!("{row}_limit_point"), first)?;
    summary.note(format!("{row}_limit_points"), limits.len() as f64)?;
    summary.note(format!("{row}_by_arcs"), scale * path.last().load)?;
    let locking = path.steps.last().and_then(rkpm::solve::Step::locking).unwrap_or(f64::NAN);
    summary.note(format!("{row}_locking"), locking)?;
    Ok(path)
}

/// Loads over the way along a path, the sum of the root mean squares of its steps.
fn along(path: &EquilibriumPath, scale: f64) -> Vec<[f64; 2]> {
    let mut curve = vec![[0.0, scale * path.start.load]];
    let (mut way, mut before) = (0.0, &path.start);
    for step in &path.steps {
        let pairs = step.state.displacement.iter().zip(&before.displacement);
        let square: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
        way += (square / before.displacement.len() as f64).sqrt();
        curve.push([way, scale * step.state.load]);
        before = &step.state;
    }
    curve
}

pub fn run(out: &FilePath, summary: &mut Summary, stops: &mut Stops) -> Result<(), Box<dyn Error>> {
    let default = Scheme::default().particles([11, 2]);
    let path = disk()?.discretize(&default)?.run()?;
    summary.note("disk_limit", PRESSURE * path.last().load)?;
    stops.add("disk_limit", "default 11 × 2", PRESSURE, &path)?;
    let gauss = Rule::Gauss { zones: Some(vec![10, 1]), points: Some(4) };
    let paper = Scheme::paper(1.5).particles([11, 2]).rule(gauss);
    let title = "paper's, r = 1.5, 4 × 4 Gauss points";
    let path = both_ways("disk_gauss4_r1.5", title, PRESSURE, &disk()?, &paper, summary, stops)?;
    Chart::new("The disk, paper's scheme, r = 1.5, 4 × 4 points")
        .x("way along the path [cm]")
        .y("pressure [MPa]")
        .y_range(0.15, 0.21)
        .marked_line("arc length", &along(&path, PRESSURE))
        .write(out.join("disk_snap.svg"))?;

    // Several irregular sets: that of the prototype is not known.
    let mut chart = Chart::new("Sheets pressed to a tenth, paper's scheme, r = 2, irregular")
        .x("way along the path [cm]")
        .y("part of the compression");
    for seed in 1..=3 {
        let layout = Layout::Jittered { amount: 0.3, seed };
        let row = if seed == 1 { "bar_0.1_irregular_r2".into() } else { format!("bar_0.1_irregular_r2_set{seed}") };
        let scheme = Scheme::paper(2.0).particles([9, 3]).integration_zones([4, 1]).layout(layout.clone());
        let title = format!("paper's, r = 2, set {seed}");
        let path = both_ways(&row, &title, 1.0, &sheet()?, &scheme, summary, stops)?;
        chart = chart.line(format!("set {seed}"), &along(&path, 1.0));
        if seed == 1 {
            // The remedy: the default scheme on the same set.
            let scheme = Scheme::default().particles([9, 3]).layout(layout);
            let path = sheet()?.discretize(&scheme)?.run()?;
            summary.note("bar_0.1_irregular_default", path.last().load)?;
            summary.note("bar_0.1_irregular_default_iterations", path.iterations as f64)?;
            stops.add("bar_0.1_irregular", "default, set 1", 1.0, &path)?;
        }
    }
    chart.write(out.join("sheet_snaps.svg"))?;
    Ok(())
}
