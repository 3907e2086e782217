//! A thin rubber disk blown up to a balloon (paper §6.4): 22 particles beside finite elements.
//!
//! `cargo run --release --example disk_inflation [-- --out DIR]` prints a table beside independent finite
//! element computations and writes `summary.csv`, the curves, charts after Figs. 9 and 10 of the paper and
//! the inflated disk for ParaView. Lengths in cm, stresses in MPa.
//!
//! The paper's edge is "simply supported" without saying where. A held corner is a point support: finite
//! elements run away there under refinement. So the whole rim is held wherever a result is compared; with
//! the lower corner alone the paper's remark on finite elements that stop early comes out.

mod support;

use std::error::Error;
use std::path::Path as FilePath;

use rkpm::error::SolveError;
use rkpm::output::chart::{Colour, Marker, Series, Stroke};
use rkpm::output::{Cell, Chart, PvdCollection, Table};
use rkpm::prelude::*;
use rkpm::solve::State;
use support::Summary;

const RADIUS: f64 = 18.923;
const THICKNESS: f64 = 0.635;
/// The paper's last pressure, reached in 207 steps there.
const PRESSURE: f64 = 0.207;
/// Pressures up to which the reference is converged; a deflection of five radii beyond is not.
const CONVERGED: f64 = 0.1449;

/// What is held at the outer radius.
#[derive(Clone, Copy, PartialEq)]
enum Held {
    Rim,
    LowerCorner,
}

/// A disk under a pressure from below.
fn disk(pressure: f64, held: Held) -> Result<Scene<2>, rkpm::Error> {
    let rubber = Rubber::mooney_rivlin(0.5516, 0.1379, 689.5)?;
    let scene = Scene::new(Block::new([0.0, 0.0], [RADIUS, THICKNESS]), Axisymmetric, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .pressure((1, Side::Min), pressure);
    Ok(match held {
        Held::Rim => scene.hold((0, Side::Max)),
        Held::LowerCorner => {
            scene.prescribe(Place::at([RADIUS, 0.0]), 0, 0.0).prescribe(Place::at([RADIUS, 0.0]), 1, 0.0)
        }
    })
}

/// A disk under a scheme and the states of its inflation, rest first, with load factors in parts of 0.207 MPa.
struct Inflation {
    problem: Problem<2>,
    states: Vec<State>,
    iterations: usize,
}

impl Inflation {
    /// Up to 0.207 MPa, or as far as the stepping of the scheme gets.
    fn run(held: Held, scheme: &Scheme) -> Result<Self, rkpm::Error> {
        let problem = disk(PRESSURE, held)?.discretize(scheme)?;
        let path = problem.run()?;
        let states = std::iter::once(path.start).chain(path.steps.into_iter().map(|step| step.state));
        Ok(Inflation { problem, states: states.collect(), iterations: path.iterations })
    }

    /// Through given pressures, which the default stepping would not meet: each analysis starts from the
    /// state of the last one.
    fn through(pressures: &[f64], scheme: &Scheme) -> Result<Self, rkpm::Error> {
        match Inflation::toward(pressures, scheme)? {
            (inflation, None) => Ok(inflation),
            (_, Some(error)) => Err(error.into()),
        }
    }

    /// The same as far as states are found, and why no further.
    fn toward(pressures: &[f64], scheme: &Scheme) -> Result<(Self, Option<SolveError>), rkpm::Error> {
        let rest = disk(PRESSURE, Held::Rim)?.discretize(scheme)?;
        let start = State {
            displacement: vec![0.0; rest.model().unknowns()],
            terms: rest.model().start(),
            multipliers: vec![0.0; rest.equations().equations().len()],
            ..State::default()
        };
        let mut inflation = Inflation { problem: rest, states: vec![start], iterations: 0 };
        for &pressure in pressures {
            let problem = disk(pressure, Held::Rim)?.discretize(scheme)?;
            let (model, rows, analysis) = (problem.model(), problem.equations(), problem.analysis());
            let mut start = inflation.last().clone();
            start.load *= PRESSURE / pressure;
            let path = match analysis.resume(model, rows, start, &mut ())?.completed() {
                Ok(path) => path,
                Err(none) => return Ok((inflation, Some(none.error))),
            };
            inflation.states.push(State { load: pressure / PRESSURE, ..path.last().clone() });
            inflation.iterations += path.iterations;
        }
        Ok((inflation, None))
    }

    fn last(&self) -> &State {
        &self.states[self.states.len() - 1]
    }

    fn steps(&self) -> usize {
        self.states.len() - 1
    }

    /// Pressure and deflection of the lower centre.
    fn curve(&self) -> Result<Vec<[f64; 2]>, rkpm::Error> {
        let point =
            |state: &State| Ok([PRESSURE * state.load, self.problem.displacement(state, &[0.0, 0.0].into())?[1]]);
        self.states.iter().map(point).collect()
    }
}

/// Deflection of the lower centre at one pressure.
fn deflection(pressure: f64, scheme: &Scheme) -> Result<f64, rkpm::Error> {
    let problem = disk(pressure, Held::Rim)?.discretize(scheme)?;
    let path = problem.run()?.completed()?;
    Ok(problem.displacement(path.last(), &[0.0, 0.0].into())?[1])
}

/// Deflections of the lower centre by independent finite elements, by the name of their column.
struct Reference(Vec<(String, Vec<f64>)>);

impl Reference {
    fn read() -> Self {
        Reference(support::csv_columns(include_str!("../tests/reference/disk_follower_edge.csv")))
    }

    fn column(&self, name: &str) -> &[f64] {
        self.0.iter().find(|c| c.0 == name).map(|c| c.1.as_slice()).unwrap_or_default()
    }

    fn pressures(&self) -> &[f64] {
        self.column("p_MPa")
    }

    fn at(&self, name: &str, pressure: f64) -> f64 {
        let row = self.pressures().iter().position(|q| (q - pressure).abs() < 1e-9);
        row.and_then(|k| self.column(name).get(k)).copied().unwrap_or(f64::NAN)
    }
}

fn default(counts: [usize; 2]) -> Scheme {
    Scheme::default().particles(counts)
}

/// The paper's particles and zones; it does not give its dilation here.
fn paper_with(r: f64) -> Scheme {
    Scheme::paper(r).particles([11, 2]).integration_zones([10, 1])
}

fn paper() -> Scheme {
    paper_with(1.0)
}

/// Dilations at which the paper's scheme is compared with the paper's finest elements.
const DILATIONS: [f64; 3] = [1.0, 1.5, 2.0];

fn q2p1() -> Scheme {
    Scheme::elements(2).particles([161, 9])
}

/// Whole inflations: the summary tells their numbers, the charts show them.
pub struct Inflations {
    default_22: Inflation,
    default_82: Inflation,
    paper_22: Inflation,
    /// The paper's finite elements: 10 × 1, 10 × 2 and 100 × 3.
    elements: Vec<Vec<[f64; 2]>>,
    /// 22 particles through the same pressures, by what they are called: the paper's scheme and the default.
    beside: Vec<(String, Vec<[f64; 2]>)>,
}

const MESHES: [(&str, [usize; 2]); 3] = [("10x1", [11, 2]), ("10x2", [11, 3]), ("100x3", [101, 4])];

impl Inflations {
    /// To the full pressure: the default stepping controls the deflection, the paper takes 207 load steps.
    pub fn run() -> Result<Self, rkpm::Error> {
        let reference = Reference::read();
        let schemes = DILATIONS.map(|r| (format!("paper_r{r}"), paper_with(r)));
        let mut beside = Vec::new();
        for (name, scheme) in schemes.into_iter().chain([("default_22".to_string(), default([11, 2]))]) {
            // Some of the paper's schemes have a limit point before the last pressure.
            beside.push((name, Inflation::toward(reference.pressures(), &scheme)?.0.curve()?));
        }
        let through = |counts: [usize; 2]| {
            Inflation::through(reference.pressures(), &Scheme::elements(1).particles(counts))?.curve()
        };
        Ok(Inflations {
            default_22: Inflation::run(Held::Rim, &default([11, 2]))?,
            default_82: Inflation::run(Held::Rim, &default([41, 2]))?,
            paper_22: Inflation::run(Held::Rim, &paper().stepping(Stepping::equal(207)))?,
            elements: MESHES.into_iter().map(|(_, counts)| through(counts)).collect::<Result<_, _>>()?,
            beside,
        })
    }

    /// All rows of `summary.csv`.
    pub fn summary(&self) -> Result<Summary, Box<dyn Error>> {
        let reference = Reference::read();
        let finest = |pressure: f64| reference.at("w_bottom_ref", pressure);
        let mut summary = Summary::new();
        // The default scheme, and the same with wider supports.
        let requested =
            [(0.0207, "22", [11, 2]), (0.1035, "22", [11, 2]), (0.1035, "41x2", [41, 2]), (0.1449, "41x2", [41, 2])];
        for (p, set, counts) in requested {
            summary.record(format!("w_{p}_{set}"), deflection(p, &default(counts))?, finest(p))?;
            let wide = default(counts).dilation(1.5);
            summary.record(format!("w_{p}_{set}_r1.5"), deflection(p, &wide)?, finest(p))?;
        }
        summary.note("steps_22", self.default_22.steps() as f64)?;
        summary.note("iterations_22", self.default_22.iterations as f64)?;
        summary.note("steps_paper", self.paper_22.steps() as f64)?;

        // The paper's scheme beside as many nodes of finite elements.
        for p in [0.0207, 0.1035] {
            summary.record(format!("w_{p}_paper"), deflection(p, &paper())?, finest(p))?;
            let elements = deflection(p, &Scheme::elements(1).particles([11, 2]))?;
            summary.record(format!("w_{p}_q1p0_10x1"), elements, finest(p))?;
        }
        // At small pressures, where the disk bends, the paper's scheme locks.
        let bent = deflection(0.005, &q2p1())?;
        summary.note("w_q2p1_0.005", bent)?;
        summary.record("w_default_0.005", deflection(0.005, &default([11, 2]))?, bent)?;
        summary.record("w_paper_0.005", deflection(0.005, &paper())?, bent)?;

        // Fig. 9: 22 nodes of each kind beside 404 nodes of elements, over the paper's pressures.
        let elements = [("q1p0_10x1".to_string(), self.elements[0].clone())];
        let at =
            |curve: &[[f64; 2]], p: f64| curve.iter().find(|point| (point[0] - p).abs() < 1e-9).map(|point| point[1]);
        for (name, curve) in self.beside.iter().chain(&elements) {
            summary.note(format!("beside_100x3_reached_{name}"), curve.last().map_or(0.0, |point| point[0]))?;
            for p in [0.01035, 0.0207, 0.05175, 0.1035, 0.15525, 0.207] {
                if let (Some(own), Some(finest)) = (at(curve, p), at(&self.elements[2], p)) {
                    summary.record(format!("beside_100x3_{p}_{name}"), own, finest)?;
                }
            }
        }
        // The paper's finite elements against the same elements of another code.
        for ((mesh, _), curve) in MESHES.into_iter().zip(&self.elements) {
            let theirs = reference.column(&format!("a_Q1P0_{mesh}"));
            let differences = curve[1..].iter().zip(theirs).filter(|(ours, _)| ours[0] < CONVERGED + 1e-9);
            let worst = differences.map(|(ours, theirs)| (ours[1] / theirs - 1.0).abs()).fold(0.0, f64::max);
            summary.note(format!("q1p0_{mesh}_worst"), worst)?;
        }
        // The paper's remark that 10 × 2 elements stop before 10 × 1, in 207 steps without cutting back.
        let stops = support::csv_columns(include_str!("../tests/reference/disk_paper_207_steps.csv"));
        let plain = Stepping { smallest: 1.0 / 207.0, ..Stepping::equal(207) };
        for (row, mesh, counts) in [(0, "10x1", [11, 2]), (1, "10x2", [11, 3])] {
            let pinned = Inflation::run(Held::LowerCorner, &Scheme::elements(1).particles(counts).stepping(plain))?;
            summary.record(format!("pinned_{mesh}_last_p"), PRESSURE * pinned.last().load, stops[2].1[row])?;
        }
        Ok(summary)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let out = support::out_dir("disk_inflation");
    let inflations = Inflations::run()?;
    let summary = inflations.summary()?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;

    let reference = Reference::read();
    let finest = reference.pressures().iter().zip(reference.column("w_bottom_ref"));
    let finest = finest.map(|(&p, &w)| [p, w]).collect::<Vec<_>>();
    let small = Inflation::through(&[5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2], &q2p1())?;
    let line = |name: &str, curve: &[[f64; 2]], colour| Series::line(name, curve).colour(colour);
    let Inflations { default_22, default_82, paper_22, elements, .. } = &inflations;
    let defaults = [
        line("default, 11 × 2 particles", &default_22.curve()?, Colour::Blue).marker(Marker::Circle),
        line("default, 41 × 2 particles", &default_82.curve()?, Colour::Green).marker(Marker::Square),
        line("paper's scheme, 11 × 2 particles", &paper_22.curve()?, Colour::Vermilion),
    ];
    let references = [
        line("Q2/P1, reference", &finest, Colour::Black),
        line("Q1/P0, 100 × 3 elements", &elements[2], Colour::Orange).stroke(Stroke::Dashed),
        line("Q1/P0, 10 × 2 elements", &elements[1], Colour::Purple).stroke(Stroke::Dashed),
        line("Q1/P0, 10 × 1 elements", &elements[0], Colour::Grey),
    ];
    let small = Series::markers("Q2/P1, 80 × 4 elements", &small.curve()?).marker(Marker::Cross).colour(Colour::Black);
    draw_curves(&out, [&references[..], &defaults[..]].concat(), [&defaults[..], &[small]].concat())?;
    draw_shapes(&out, "", &default([11, 2]))?;
    draw_shapes(&out, "_paper", &paper())?;
    println!("results in {}", out.display());
    Ok(())
}

/// Deflection against pressure (Fig. 9), and on logarithmic axes for the start, which Fig. 9 hides.
fn draw_curves(out: &FilePath, all: Vec<Series>, start: Vec<Series>) -> Result<(), Box<dyn Error>> {
    let mut table = Table::new(["curve", "p_MPa", "w_cm"]);
    let mut chart = Chart::new("Inflation of a rubber disk").x("pressure [MPa]").y("deflection of the centre [cm]");
    for series in all {
        for [p, w] in series.paths().iter().flatten() {
            table.push([Cell::from(series.name()), Cell::from(*p), Cell::from(*w)])?;
        }
        chart = chart.with(series);
    }
    table.write(out.join("curves.csv"))?;
    chart.write(out.join("curves.svg"))?;

    let mut chart = Chart::new("The start: without a cure 22 particles lock in bending")
        .x_log("pressure [MPa]")
        .y_log("deflection of the centre [cm]")
        .x_range(4e-4, 0.08)
        .y_range(0.2, 20.0);
    for series in start {
        chart = chart.with(series);
    }
    chart.write(out.join("curves_start.svg"))?;
    Ok(())
}

/// Progressive shapes with particles (Fig. 10), also for ParaView, by a scheme that file names tell.
fn draw_shapes(out: &FilePath, whose: &str, scheme: &Scheme) -> Result<(), Box<dyn Error>> {
    let shapes = [
        (0.0, Colour::Grey),
        (0.0207, Colour::Blue),
        (0.1035, Colour::Vermilion),
        (0.1449, Colour::Green),
        (0.1656, Colour::Purple),
        (0.1863, Colour::Orange),
        (0.207, Colour::Black),
    ];
    let pressures = shapes.map(|(pressure, _)| pressure);
    let Inflation { problem, states, .. } = &Inflation::through(&pressures[1..], scheme)?;
    let mut chart = Chart::new(format!(
        "Half sections of the disk, 11 × 2 particles{}",
        if whose.is_empty() { "" } else { ", paper's scheme" }
    ))
    .x("R [cm]")
    .y("Z [cm]");
    let mut animation = PvdCollection::default();
    for (k, (state, (pressure, colour))) in states.iter().zip(shapes).enumerate() {
        let lines = support::grid_lines(problem, state, 8)?;
        chart = chart
            .with(Series::outlines(format!("{pressure} MPa"), &lines).colour(colour))
            .with(Series::markers("", &support::deformed(problem, state)?).marker(Marker::Circle).colour(colour));
        let file = format!("disk{whose}_{k}.vtu");
        problem.vtk_grid(state)?.write(out.join(&file))?;
        animation.push(pressure, file);
    }
    chart.equal_aspect().size(680, 900).write(out.join(format!("shapes{whose}.svg")))?;
    animation.write(out.join(format!("disk{whose}.pvd")))?;
    Ok(())
}
