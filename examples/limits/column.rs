//! A column pressed between held ends: where it buckles, and what becomes of it when it is not quite straight.

use std::error::Error;
use std::f64::consts::PI;
use std::path::Path as FilePath;

use crate::support::Summary;
use rkpm::output::Chart;
use rkpm::output::chart::{Colour, Series};
use rkpm::prelude::*;
use rkpm::solve::{CriticalKind, Following};

use crate::{Stops, support};

const WIDTH: f64 = 1.0;
const LENGTH: f64 = 10.0;
/// µ = 1, k/µ = 1e3.
const BULK: f64 = 1e3;

/// A column whose ends come `shortening` closer; its axis is bent by `imperfection` in the middle.
fn column(shortening: f64, imperfection: f64) -> Result<Scene<2>, rkpm::Error> {
    let rubber = Rubber::neo_hookean(0.5, BULK)?;
    let domain = Mapped(move |unit: &Point<2>| {
        let bend = 0.5 * imperfection * (1.0 - (2.0 * PI * unit[1]).cos());
        Point::<2>::new(WIDTH * unit[0] + bend, LENGTH * unit[1])
    });
    Ok(Scene::new(domain, PlaneStrain, rubber).hold((1, Side::Min)).prescribe((1, Side::Max), 0, 0.0).prescribe(
        (1, Side::Max),
        1,
        -shortening,
    ))
}

/// The force on the upper end, positive in compression.
fn force(problem: &Problem<2>, state: &rkpm::solve::State) -> Result<f64, rkpm::Error> {
    Ok(-problem.reaction(state, (1, Side::Max))?[1])
}

/// Euler's load of a clamped column, softened by shear (Engesser): $P = P_E/(1 + P_E/\kappa GA)$ with
/// $P_E = 4\pi^2 E'I/L^2$, plane strain modulus $E' = 4\mu$ and $\kappa = 5/6$, for the column as it is when its
/// length has shrunk by a part and its width has grown as much.
fn euler(shortening: f64) -> f64 {
    let (length, width) = (LENGTH * (1.0 - shortening), WIDTH / (1.0 - shortening));
    let (modulus, inertia) = (4.0, width.powi(3) / 12.0);
    let bending = 4.0 * PI.powi(2) * modulus * inertia / length.powi(2);
    bending / (1.0 + bending / (5.0 / 6.0 * width))
}

/// What is known of the first bifurcation.
struct Buckling {
    force: f64,
    shortening: f64,
    bracket: f64,
}

/// The shortening at which a straight column is looked at; it buckles before.
const PRESSED: f64 = 0.06;

fn buckling(counts: [usize; 2], stops: &mut Stops) -> Result<Buckling, Box<dyn Error>> {
    let stepping = Stepping { follow: Following::Path, ..Stepping::default() };
    let scheme = Scheme::default().particles(counts).stepping(stepping);
    let problem = column(PRESSED * LENGTH, 0.0)?.discretize(&scheme)?;
    let path = problem.run()?;
    stops.add("column, straight", &format!("default {} × {}", counts[0], counts[1]), PRESSED, &path)?;
    let point = path.critical_points().next().ok_or("the column does not buckle")?;
    if point.kind != CriticalKind::Bifurcation {
        return Err("the column has a limit point".into());
    }
    // The force is nearly proportional to the shortening over a bracket of a thousandth.
    let [low, high] = point.loads;
    let force = force(&problem, &point.state)? * point.load() / low;
    Ok(Buckling { force, shortening: PRESSED * point.load(), bracket: high / low - 1.0 })
}

pub fn run(out: &FilePath, summary: &mut Summary, stops: &mut Stops) -> Result<(), Box<dyn Error>> {
    let (coarse, fine) = (buckling([5, 41], stops)?, buckling([9, 81], stops)?);
    summary.record("column_load", coarse.force, fine.force)?;
    summary.note("column_load_bracket", coarse.bracket)?;
    summary.note("column_shortening", coarse.shortening)?;
    summary.note("column_load_euler_sheared", euler(0.0))?;
    summary.note("column_load_euler_sheared_and_shortened", euler(coarse.shortening))?;

    let mut chart = Chart::new("A column 1 × 10 between held ends").x("end shortening / length").y("force / (µ width)");
    let mut shapes = Chart::new("A bent column at its end shortenings").x("x").y("y").equal_aspect();
    for (name, imperfection, colour) in [("1e-3", 1e-3, Colour::Blue), ("1e-2", 1e-2, Colour::Green)] {
        let stepping = Stepping { first: 0.05, largest: 0.05, follow: Following::Path, ..Stepping::default() };
        let scheme = Scheme::default().particles([5, 41]).stepping(stepping);
        let problem = column(0.2 * LENGTH, imperfection)?.discretize(&scheme)?;
        let path = problem.run()?;
        stops.add("column, bent", &format!("default 5 × 41, imperfection {name}"), 0.2, &path)?;
        let states = std::iter::once(&path.start).chain(path.steps.iter().map(|step| &step.state));
        let curve = states.map(|state| Ok([0.2 * state.load, force(&problem, state)?]));
        let curve = curve.collect::<Result<Vec<_>, rkpm::Error>>()?;
        chart = chart.with(Series::line(format!("imperfection {name}"), &curve).colour(colour));
        if imperfection == 1e-3 {
            summary.note("column_bent_end_shortening", 0.2 * path.last().load)?;
            summary.note("column_bent_force", force(&problem, path.last())?)?;
            let unstable = path.steps.iter().filter(|step| step.unstable != Some(0)).count();
            summary.note("column_bent_unstable_steps", unstable as f64)?;
            let middle = [0.5 * WIDTH + imperfection, 0.5 * LENGTH];
            let sideways = problem.displacement(path.last(), &middle.into())?[0].abs();
            summary.note("column_bent_sideways", sideways / LENGTH)?;
            let mut place = 0.0;
            for (wanted, colour) in
                [(0.0, Colour::Grey), (0.04, Colour::Sky), (0.1, Colour::Blue), (0.2, Colour::Vermilion)]
            {
                let near = |state: &&rkpm::solve::State| (0.2 * state.load - wanted).abs();
                let states = std::iter::once(&path.start).chain(path.steps.iter().map(|step| &step.state));
                let state = states.min_by(|a, b| near(a).total_cmp(&near(b))).unwrap_or(&path.start);
                let moved = |x: &Point<2>| [x[0] + place, x[1]];
                let lines: Vec<Vec<[f64; 2]>> = support::grid_lines(&problem, state, 2)?
                    .iter()
                    .map(|line| line.iter().map(moved).collect())
                    .collect();
                shapes = shapes.with(Series::outlines(format!("{:.0} %", 20.0 * state.load), &lines).colour(colour));
                place += 4.0;
            }
        }
    }
    chart = chart.horizontal("bifurcation of the straight column", coarse.force);
    chart = chart.horizontal("Euler, clamped, sheared, shortened", euler(coarse.shortening));
    chart.write(out.join("column.svg"))?;
    shapes.write(out.join("column_shape.svg"))?;
    Ok(())
}
