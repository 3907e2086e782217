//! A spherical shell past its limit pressure: the load falls while the balloon grows.

use std::error::Error;
use std::ops::ControlFlow;
use std::path::Path as FilePath;

use crate::support::Summary;
use rkpm::output::Chart;
use rkpm::prelude::*;
use rkpm::solve::{CriticalKind, Observer, State, Step, StepControl};

use crate::Stops;

/// Inner and outer radius.
const SHELL: [f64; 2] = [1.0, 1.1];
/// Bulk modulus over the shear modulus, which is 1.
const BULK: f64 = 1e5;
/// The last inner stretch.
const LAST: f64 = 4.0;

/// A shell under an inner pressure of 1 at load factor 1: far more than it holds, so that the load never gets there.
fn shell(c10: f64, c01: f64, scheme: &Scheme) -> Result<Problem<1>, rkpm::Error> {
    let rubber = Rubber::mooney_rivlin(c10, c01, BULK)?;
    Scene::new(Block::new([SHELL[0]], [SHELL[1]]), RadialSphere, rubber).pressure(Side::Min, 1.0).discretize(scheme)
}

/// The pressure of an incompressible shell at an inner stretch, $p = \int\lambda W'(\lambda)\,R^2/r^3\,dR$ with
/// $W' = 4c_{10}(\lambda - \lambda^{-5}) + 4c_{01}(\lambda^3 - \lambda^{-3})$, by Gauss points in many parts.
fn exact(c10: f64, c01: f64, stretch: f64) -> f64 {
    const PARTS: usize = 50;
    // Three Gauss points: an error of the sixth order in a fiftieth of the wall.
    let gauss = [(-(0.6_f64.sqrt()), 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.6_f64.sqrt(), 5.0 / 9.0)];
    let width = (SHELL[1] - SHELL[0]) / PARTS as f64;
    let mut pressure = 0.0;
    for part in 0..PARTS {
        for (at, weight) in gauss {
            let reference = SHELL[0] + width * (part as f64 + 0.5 + 0.5 * at);
            let radius = (reference.powi(3) + (stretch * SHELL[0]).powi(3) - SHELL[0].powi(3)).cbrt();
            let hoop: f64 = radius / reference;
            let slope = 4.0 * c10 * (hoop - hoop.powi(-5)) + 4.0 * c01 * (hoop.powi(3) - hoop.powi(-3));
            pressure += 0.5 * weight * width * hoop * slope * reference.powi(2) / radius.powi(3);
        }
    }
    pressure
}

/// The largest exact pressure below a stretch of 2, by golden section.
fn exact_limit(c10: f64, c01: f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (1.0, 2.0);
    for _ in 0..60 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if exact(c10, c01, a) > exact(c10, c01, b) { high = b } else { low = a }
    }
    exact(c10, c01, 0.5 * (low + high))
}

/// Stops once the inner wall has come far enough.
struct Until<'a> {
    problem: &'a Problem<1>,
    stretch: f64,
}

fn inner_stretch(problem: &Problem<1>, state: &State) -> Result<f64, rkpm::Error> {
    Ok(1.0 + problem.displacement(state, &[SHELL[0]].into())?[0] / SHELL[0])
}

impl Observer for Until<'_> {
    fn step(&mut self, step: &Step) -> ControlFlow<()> {
        match inner_stretch(self.problem, &step.state) {
            Ok(stretch) if stretch < self.stretch => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
        }
    }
}

/// Follows a shell by arc length from rest to a stretch.
fn follow(c10: f64, c01: f64, stretch: f64) -> Result<(Problem<1>, EquilibriumPath), rkpm::Error> {
    let stepping = Stepping { control: StepControl::ArcLength, ..Stepping::default() };
    let problem = shell(c10, c01, &Scheme::default().particles([9]).stepping(stepping))?;
    let path = problem.run_with(&mut Until { problem: &problem, stretch })?;
    Ok((problem, path))
}

/// Stretches and pressures of a path.
fn curve(problem: &Problem<1>, path: &EquilibriumPath) -> Result<Vec<[f64; 2]>, rkpm::Error> {
    let states = std::iter::once(&path.start).chain(path.steps.iter().map(|step| &step.state));
    states.map(|state| Ok([inner_stretch(problem, state)?, state.load])).collect()
}

pub fn run(out: &FilePath, summary: &mut Summary, stops: &mut Stops) -> Result<(), Box<dyn Error>> {
    let mut chart = Chart::new("Balloons, 9 particles, followed by arc length").x("inner stretch").y("pressure / µ");
    for (name, title, c10, c01, last) in [
        ("balloon", "neo-Hookean", 0.5, 0.0, LAST),
        ("balloon_mooney", "Mooney–Rivlin, C01/C10 = 0.2", 0.5 / 1.2, 0.1 / 1.2, 8.0),
    ] {
        let (problem, path) = follow(c10, c01, last)?;
        let limits: Vec<_> = path.critical_points().filter(|point| point.kind == CriticalKind::Limit).collect();
        let first = limits.first().ok_or("the balloon has no limit point")?;
        summary.record(format!("{name}_limit_pressure"), first.load(), exact_limit(c10, c01))?;
        summary.note(format!("{name}_limit_points"), limits.len() as f64)?;
        summary.note(format!("{name}_steps"), path.steps.len() as f64)?;
        summary.note(format!("{name}_iterations"), path.iterations as f64)?;
        if name == "balloon" {
            // To the stretch itself: the inner wall leads from the last state before it.
            let mut start = &path.start;
            for step in &path.steps {
                if inner_stretch(&problem, &step.state)? < LAST {
                    start = &step.state;
                }
            }
            let wall = inner_wall(&problem);
            let rest = problem.analysis().run_controlled(
                problem.model(),
                problem.equations(),
                start.clone(),
                &wall,
                &[(LAST - 1.0) * SHELL[0]],
                &mut (),
            )?;
            summary.record("balloon_p_at_4", rest.completed()?.last().load, exact(c10, c01, LAST))?;
        }
        stops.add(name, "default; arc length", 1.0, &path)?;
        let fine: Vec<[f64; 2]> =
            (0..=200).map(|k| 1.0 + (last - 1.0) * f64::from(k) / 200.0).map(|s| [s, exact(c10, c01, s)]).collect();
        let mut points = curve(&problem, &path)?;
        points.retain(|point| point[0] <= last);
        chart = chart.line(format!("exact, {title}"), &fine).markers(title, &points);
    }
    // The load alone ends at the limit pressure.
    let stepping = Stepping { control: StepControl::Load, ..Stepping::default() };
    let problem = shell(0.5, 0.0, &Scheme::default().particles([9]).stepping(stepping))?;
    let path = problem.run()?;
    summary.note("balloon_load_control_ends_at", path.last().load)?;
    stops.add("balloon", "default; load control", 1.0, &path)?;
    chart.write(out.join("balloon.svg"))?;
    Ok(())
}

/// The displacement of the inner wall, whose particle is the first one and interpolates nothing: at the end of a
/// row of particles with r = 1 its shape function is 1.
fn inner_wall(problem: &Problem<1>) -> rkpm::solve::Deflection {
    let mut weights = vec![0.0; problem.model().unknowns()];
    weights[0] = 1.0;
    rkpm::solve::Deflection { weights }
}
