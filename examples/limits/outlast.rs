//! Badly shaped cells: particles and the nodes of finite elements at the same jittered places, driven to the same last load.
//!
//! A set counts where it reaches the last load with an energy within 2 % of that of a regular model three times as fine.

use std::error::Error;
use std::f64::consts::PI;
use std::path::Path as FilePath;

use rkpm::geometry::Mapped;
use rkpm::output::{Cell, Summary, Table};
use rkpm::prelude::*;

/// Drawn sets of each scene.
const SETS: u64 = 20;
/// Inner nodes leave their places by up to this part of the spacing: cells have angles up to nearly 180°.
const JITTER: f64 = 0.3;
const WITHIN: f64 = 0.02;

fn rubber() -> Result<Rubber, rkpm::error::MaterialError> {
    Rubber::neo_hookean(0.5, 1e3) // µ = 1, k/µ = 1e3
}

/// A square between bonded plates, whose upper one is moved.
fn square(by: [f64; 2]) -> Result<Scene<2>, rkpm::Error> {
    Ok(Scene::new(Block::new([0.0; 2], [1.0; 2]), PlaneStrain, rubber()?)
        .hold((1, Side::Min))
        .prescribe((1, Side::Max), 0, by[0])
        .prescribe((1, Side::Max), 1, by[1]))
}

/// A square whose bonded upper half of a side is pressed in, half of it modelled.
fn punched() -> Result<Scene<2>, rkpm::Error> {
    let under = |x: &Point<2>| x[0] < 0.5;
    Ok(Scene::new(Block::new([0.0; 2], [1.0; 2]), PlaneStrain, rubber()?)
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((1, Side::Min))
        .with(Condition::on(Place::on((1, Side::Max)).within(under)).component(0, 0.0).component(1, -0.3)))
}

/// A quarter of a square around a hole, pressed by its upper side until the hole nearly closes.
fn hole() -> Result<Scene<2>, rkpm::Error> {
    let quarter = |unit: &Point<2>| -> Point<2> {
        let angle = 0.5 * PI * unit[1];
        let (s, c) = angle.sin_cos();
        let edge = 1.0 / s.max(c);
        let radius = 0.4 + (edge - 0.4) * unit[0];
        Point::<2>::new(radius * c, radius * s)
    };
    let top = |x: &Point<2>| x[1] > 1.0 - 1e-9;
    Ok(Scene::new(Mapped(quarter), PlaneStrain, rubber()?)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 0, 0.0)
        .with(Condition::on(Place::on((0, Side::Max)).within(top)).component(1, -0.3)))
}

/// A bar whose ends are turned towards each other: its inner side is crushed.
fn bent() -> Result<Scene<2>, rkpm::Error> {
    let end = |sign: f64| {
        Value::motion(move |x: &Point<2>, load: f64| {
            let (angle, middle) = (sign * 0.45 * PI * load, Point::<2>::new(if sign > 0.0 { 0.0 } else { 3.0 }, 0.5));
            let (s, c) = angle.sin_cos();
            let arm = x - middle;
            [c * arm[0] + s * arm[1] - arm[0] + sign * 0.25 * load, c * arm[1] - s * arm[0] - arm[1]]
        })
    };
    Ok(Scene::new(Block::new([0.0; 2], [3.0, 1.0]), PlaneStrain, rubber()?)
        .with(Condition::on((0, Side::Min)).displacement(end(1.0)))
        .with(Condition::on((0, Side::Max)).displacement(end(-1.0))))
}

type Named = (&'static str, Result<Scene<2>, rkpm::Error>, [usize; 2]);

fn scenes() -> Vec<Named> {
    vec![
        ("pressed", square([0.0, -0.45]), [17, 17]),
        ("sheared", square([1.5, 0.0]), [17, 17]),
        ("pulled", square([0.0, 1.5]), [17, 17]),
        ("punched", punched(), [17, 17]),
        ("hole", hole(), [13, 25]),
        ("bent", bent(), [25, 9]),
    ]
}

/// Share of the sets that reach the last load within 2 %, and their iterations.
pub fn run(out: &FilePath, summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let mut table = Table::new(["scene", "scheme", "seed", "last_load", "energy_over_reference", "iterations"]);
    for (name, scene, counts) in scenes() {
        let scene = scene?;
        let fine = Scheme::default().particles(counts.map(|n| 3 * (n - 1) + 1));
        let problem = scene.discretize(&fine)?;
        // Without a refined model at the last load there is nothing to compare with.
        let path = match problem.run(&mut ())?.completed() {
            Ok(path) => path,
            Err(error) => {
                println!("{name}, refined: {error}");
                continue;
            }
        };
        let reference = problem.energy(path.last());
        let schemes = [("particles", Scheme::default()), ("q2p1", Scheme::elements(2)), ("q1p0", Scheme::elements(1))];
        for (label, scheme) in schemes {
            let (mut kept, mut iterations) = (0usize, 0usize);
            for seed in 1..=SETS {
                let layout = Layout::Jittered { amount: JITTER, seed };
                let problem = match scene.discretize(&scheme.clone().particles(counts).layout(layout)) {
                    Ok(problem) => problem,
                    // Cells of these nodes are refused as inverted.
                    Err(error) => {
                        println!("{name}, {label}, {seed}: {error}");
                        continue;
                    }
                };
                let path = problem.run(&mut ())?;
                let ratio = problem.energy(path.last()) / reference;
                let whole = matches!(path.ending, Ending::Completed);
                kept += usize::from(whole && (ratio - 1.0).abs() <= WITHIN);
                iterations += path.iterations;
                let cells = [Cell::from(name), Cell::from(label), Cell::from(seed as f64)];
                let numbers = [path.last().load, ratio, path.iterations as f64].map(Cell::from);
                table.push(cells.into_iter().chain(numbers))?;
            }
            summary.note(format!("outlast_{name}_{label}"), kept as f64 / SETS as f64)?;
            summary.note(format!("outlast_{name}_{label}_iterations"), iterations as f64 / SETS as f64)?;
        }
    }
    table.write(out.join("outlast.csv"))?;
    Ok(())
}
