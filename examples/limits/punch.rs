//! A block punched on half of its top, which is held sideways: how far meshes and particles of like size go.

use std::error::Error;
use std::path::Path as FilePath;

use crate::support::Summary;
use rkpm::nalgebra::Vector3;
use rkpm::output::chart::{Colour, Series};
use rkpm::output::{Chart, Table};
use rkpm::prelude::*;
use rkpm::solve::{CriticalKind, State, StepControl};
use rkpm::term::{PointDerivatives, PointState, Sparsity};

use crate::{Stops, support};

const SIDE: f64 = 10.0;
const MU: f64 = 80.194;
const BULK: f64 = 5000.0 * MU;
/// Loads in µ at which settlements are compared.
const LOADS: [f64; 17] = [0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 16.0, 20.0];
/// The load in µ to which every scheme is driven.
const LAST: f64 = 100.0;
/// Particles or nodes per side: 578 unknowns, those of the conditions included.
const COUNT: usize = 17;
/// Those of the refined run.
const REFINED: usize = 49;

/// A dead traction downwards on the half of the top beside the plane of symmetry.
struct Punch {
    traction: f64,
}

impl Integrand for Punch {
    fn sparsity(&self) -> Sparsity {
        Sparsity { force: true, ..Sparsity::default() }
    }

    fn evaluate(&self, at: &PointState, flux: &mut PointDerivatives) {
        if at.position[0] < 0.5 * SIDE {
            let force = Vector3::new(0.0, self.traction, 0.0);
            flux.force = force * at.load;
            flux.force_by_load = force;
        }
    }
}

/// The block under a scheme with n × n particles or nodes and a traction in µ at load factor 1. Cells end where
/// the load ends, at an even number of them.
fn block(scheme: &Scheme, n: usize, traction: f64) -> Result<Problem<2>, rkpm::Error> {
    let scene = Scene::new(Block::new([0.0; 2], [SIDE; 2]), PlaneStrain, Rubber::neo_hookean(0.5 * MU, BULK)?)
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 0, 0.0)
        .with(Load::integrand((1, Side::Max), Punch { traction: traction * MU }));
    scene.discretize(&scheme.clone().particles([n]))
}

/// Settlement of the middle of the punch over the height.
fn settlement(problem: &Problem<2>, state: &State) -> Result<f64, rkpm::Error> {
    Ok(-problem.displacement(state, &[0.0, SIDE].into())?[1] / SIDE)
}

/// Settlements at [`LOADS`], as far as the scheme gets: each analysis starts from the state of the last one.
fn settlements(scheme: &Scheme, n: usize) -> Result<Vec<[f64; 2]>, rkpm::Error> {
    let mut curve = Vec::new();
    let mut last: Option<(State, f64)> = None;
    for load in LOADS {
        let stepping = Stepping { control: StepControl::Load, ..Stepping::default() };
        let problem = block(&scheme.clone().stepping(stepping), n, load)?;
        let start = match last {
            None => problem.at_rest(),
            Some((state, before)) => State { load: before / load, ..state },
        };
        let path = problem.analysis().resume(problem.model(), problem.equations(), start, &mut ())?;
        if path.ending != Ending::Completed {
            break;
        }
        curve.push([load, settlement(&problem, path.last())?]);
        last = Some((path.last().clone(), load));
    }
    Ok(curve)
}

/// The largest load up to which all settlements are within 2 % of those of a refined run; 0 if none is.
fn agrees_to(curve: &[[f64; 2]], refined: &[[f64; 2]]) -> f64 {
    let good = curve.iter().zip(refined).take_while(|(ours, theirs)| (ours[1] / theirs[1] - 1.0).abs() <= 0.02);
    good.last().map_or(0.0, |(ours, _)| ours[0])
}

pub fn run(out: &FilePath, summary: &mut Summary, stops: &mut Stops) -> Result<(), Box<dyn Error>> {
    let refined = settlements(&Scheme::elements(2), REFINED)?;
    let refined_default = settlements(&Scheme::default(), REFINED)?;
    // How well the refined run itself is known: two methods side by side.
    let apart = refined.iter().zip(&refined_default).map(|(a, b)| (b[1] / a[1] - 1.0).abs()).fold(0.0, f64::max);
    summary.note("entangle_refined_last_common_load", refined[refined.len().min(refined_default.len()) - 1][0])?;
    summary.note("entangle_refined_runs_apart", apart)?;

    let mut table = Table::new(["scheme", "load_mu", "settlement", "error"]);
    let mut chart = Chart::new("A punched block: settlement of its middle")
        .x("traction / µ")
        .y("settlement / height")
        .with(Series::line("Q2/P1, 49 × 49 nodes", &refined).colour(Colour::Black));
    let mut errors = Chart::new("Against the refined run").x("traction / µ").y("error of the settlement [%]");
    let mut shapes = Chart::new("The last states").x("x").y("y").equal_aspect();
    for (k, (name, title, scheme, colour)) in [
        ("default", "default, 17 × 17 particles", Scheme::default(), Colour::Blue),
        ("q1p0", "Q1/P0, 17 × 17 nodes", Scheme::elements(1), Colour::Vermilion),
        ("q2p1", "Q2/P1, 17 × 17 nodes", Scheme::elements(2), Colour::Green),
    ]
    .into_iter()
    .enumerate()
    {
        let curve = settlements(&scheme, COUNT)?;
        let mut percent = Vec::new();
        for (ours, theirs) in curve.iter().zip(&refined) {
            let error = ours[1] / theirs[1] - 1.0;
            percent.push([ours[0], 100.0 * error]);
            let numbers = [ours[0], ours[1], error].map(rkpm::output::Cell::from);
            table.push(std::iter::once(rkpm::output::Cell::from(title)).chain(numbers))?;
        }
        summary.note(format!("entangle_{name}_within_2_percent"), agrees_to(&curve, &refined))?;
        chart = chart.with(Series::markers(title, &curve).colour(colour));
        errors = errors.with(Series::line(title, &percent).colour(colour));

        // To the end in steps of the scheme's own choice.
        let problem = block(&scheme, COUNT, LAST)?;
        let path = problem.run()?;
        stops.add("punch", title, LAST, &path)?;
        if path.ending != Ending::Completed {
            // By arcs: does it end at a limit point of its own equations?
            let stepping = Stepping { control: StepControl::ArcLength, steps: 30, ..Stepping::default() };
            let path = block(&scheme.clone().stepping(stepping), COUNT, LAST)?.run()?;
            stops.add("punch", &format!("{title}; arc length"), LAST, &path)?;
            if let Some(point) = path.critical_points().find(|point| point.kind == CriticalKind::Limit) {
                summary.note(format!("entangle_{name}_limit_point"), LAST * point.load())?;
            }
        }
        summary.note(format!("entangle_{name}_last_load"), LAST * path.last().load)?;
        summary.note(format!("entangle_{name}_last_settlement"), settlement(&problem, path.last())?)?;
        summary.note(format!("entangle_{name}_iterations"), path.iterations as f64)?;
        let smallest = path.steps.last().and_then(|step| step.diagnostics.jacobians).map_or(f64::NAN, |j| j[0]);
        summary.note(format!("entangle_{name}_smallest_J"), smallest)?;
        let title = format!("{title}, {:.0} µ", LAST * path.last().load);
        let lines: Vec<Vec<[f64; 2]>> = support::grid_lines(&problem, path.last(), 2)?
            .iter()
            .map(|line| line.iter().map(|x| [x[0] + 22.0 * k as f64, x[1]]).collect())
            .collect();
        shapes = shapes.with(Series::outlines(title, &lines).colour(colour));
    }
    table.write(out.join("punch.csv"))?;
    chart.write(out.join("punch.svg"))?;
    errors.horizontal("2 %", 2.0).horizontal("−2 %", -2.0).write(out.join("punch_errors.svg"))?;
    shapes.size(900, 360).write(out.join("punch_shapes.svg"))?;
    Ok(())
}
