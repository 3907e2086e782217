//! Parts of no block: regions, planar meshes, closed surfaces, two bodies, contact, drawn at random and asked for 2 %.
//!
//! References are two runs without a search: of even spacings, and of meshes whose cells have been cut. How far they are apart tells, at first order, how well the finer one is known.

use std::error::Error;

use crate::support::Summary;
use rkpm::mesh::{CellShape, Mesh};
use rkpm::output::{Cell, Table};
use rkpm::prelude::*;
use rkpm::solid::{Select, Shape};
use rkpm::study::{Budget, Quantity, Tolerance, Verdict};

use crate::median;

/// Draws a part, given numbers between two.
type Draw = fn(&mut dyn FnMut(f64, f64) -> f64) -> Result<Drawn<2>, rkpm::Error>;

const ASKED: f64 = 0.02;
/// Cells along a length of one of the coarser and the finer reference in the plane, and in space.
const PLANAR: [f64; 2] = [40.0, 60.0];
const SPATIAL: [f64; 2] = [16.0, 24.0];
/// How often cells of meshes are cut for references.
const CUTS: [usize; 2] = [3, 4];

/// A part, and the models that tell its true value.
struct Drawn<const D: usize> {
    scene: Scene<D>,
    /// The coarser and the finer.
    references: [(Scene<D>, Scheme); 2],
    /// The spacing of the coarser over that of the finer.
    ratio: f64,
}

impl<const D: usize> Drawn<D> {
    /// With references of even spacings, so many to a length of one.
    fn evenly(scene: Scene<D>, cells: [f64; 2]) -> Self {
        let references = cells.map(|cells| (scene.clone(), Scheme::default().spacing(1.0 / cells)));
        Drawn { scene, references, ratio: cells[1] / cells[0] }
    }

    /// Value and displacement unknowns of both references.
    fn values(&self, quantity: &Quantity<D>) -> Result<Vec<(f64, usize)>, rkpm::Error> {
        let one = |(scene, scheme): &(Scene<D>, Scheme)| {
            let problem = scene.discretize(scheme)?;
            let path = problem.run()?.completed()?;
            Ok((quantity.evaluate(&problem, path.last())?, problem.model().unknowns()))
        };
        self.references.iter().map(one).collect()
    }
}

/// What became of one part.
struct Row {
    family: &'static str,
    number: u64,
    reached: bool,
    bound: f64,
    error: f64,
    uncertainty: f64,
    particles: usize,
    /// Those of the first model of the series from which on all are within the tolerance.
    smallest: Option<usize>,
    seconds: f64,
}

/// Sizes `count` parts of each family, or of those that are named, and makes a row for each; names of what is noted get an ending.
pub fn run(
    (count, seed): (u64, u64),
    families: &[String],
    ending: &str,
    summary: &mut Summary,
    table: &mut Table,
) -> Result<(), Box<dyn Error>> {
    let mut rows = Vec::new();
    let flat: [(&'static str, Draw); 4] =
        [("region", region), ("planar mesh", mesh), ("two bodies", bodies), ("contact", contact)];
    let wanted = |name: &str| families.is_empty() || families.iter().any(|family| family == name);
    for number in 0..count {
        let mut random = fastrand::Rng::with_seed(seed + number);
        let mut between = |low: f64, high: f64| low + (high - low) * random.f64();
        for (family, draw) in flat.into_iter().filter(|(name, _)| wanted(name)) {
            let moved = Quantity::reaction("moved", 1);
            judge((family, number), &draw(&mut between)?, moved, 60_000, &mut rows);
        }
        if wanted("closed surface") {
            let moved = Quantity::reaction("top", 2);
            judge(("closed surface", number), &solid(&mut between)?, moved, 60_000, &mut rows);
        }
    }
    let judged = rows.iter().filter(|row| row.error.is_finite()).count() as f64;
    let of = |all: f64, holds: &dyn Fn(&Row) -> bool| rows.iter().filter(|row| holds(row)).count() as f64 / all;
    let mut note = |name: &str, value: f64| summary.note(format!("{name}{ending}"), value).map(|_| ());
    note("parts", rows.len() as f64)?;
    note("parts_reached", of(rows.len() as f64, &|row| row.reached))?;
    // Those whose references come to the end of their load.
    note("parts_judged", judged)?;
    let reached = rows.iter().filter(|row| row.reached && row.error.is_finite()).count() as f64;
    note("parts_kept", of(reached, &|row| row.reached && row.error <= ASKED + row.uncertainty))?;
    note("parts_bounds_held", of(judged, &|row| row.error <= row.bound + row.uncertainty))?;
    note("parts_kept_strictly", of(reached, &|row| row.reached && row.error <= ASKED))?;
    note("parts_bounds_held_strictly", of(judged, &|row| row.error <= row.bound))?;
    let reached = rows.iter().filter(|row| row.reached);
    let sizes = reached.filter_map(|row| Some(row.particles as f64 / row.smallest? as f64));
    note("particles_over_smallest_parts", median(sizes.collect()))?;
    for row in rows {
        let numbers = [row.bound, row.error, row.uncertainty, row.particles as f64, row.seconds].map(Cell::from);
        let words =
            [Cell::from(row.family), Cell::from(row.number as f64), Cell::from(f64::from(u8::from(row.reached)))];
        table.rows.push(words.into_iter().chain(numbers).collect());
    }
    Ok(())
}

/// The columns of the rows.
pub fn table() -> Table {
    Table::new(["family", "number", "reached", "bound", "error", "uncertainty", "particles", "seconds"])
}

/// Sizes a part, and solves its references.
fn judge<const D: usize>(
    (family, number): (&'static str, u64),
    part: &Drawn<D>,
    quantity: Quantity<D>,
    unknowns: usize,
    rows: &mut Vec<Row>,
) {
    let budget = Budget { unknowns, ..Budget::default() };
    let answer = part.scene.solve_within(&Tolerance::of(quantity.clone(), ASKED), budget);
    let mut row = Row {
        family,
        number,
        reached: false,
        bound: f64::NAN,
        error: f64::NAN,
        uncertainty: f64::NAN,
        particles: 0,
        smallest: None,
        seconds: f64::NAN,
    };
    let references = part.values(&quantity);
    for error in [answer.as_ref().err(), references.as_ref().err()].into_iter().flatten() {
        println!("{family} {number}: {error}");
    }
    if let Ok(answer) = answer {
        row.reached = answer.reached();
        row.bound = answer.bound;
        row.particles = answer.problem.model().unknowns() / D;
        row.seconds = answer.seconds();
        if let Verdict::NotReached(why) = &answer.verdict {
            println!("{family} {number}: not reached: {why}");
        }
        if let Ok(references) = references {
            let exact = references[1].0;
            row.error = (answer.values()[0] / exact - 1.0).abs();
            row.uncertainty = (references[0].0 / exact - 1.0).abs() / (part.ratio - 1.0);
            let levels = answer.levels.iter().map(|level| (level.values[0], level.unknowns));
            row.smallest = smallest(&levels.chain(references).collect::<Vec<_>>(), exact).map(|unknowns| unknowns / D);
        }
    }
    println!(
        "{family} {number}: bound {:.4}, error {:.4} to {:.4}, {} particles, {:.2} s",
        row.bound, row.error, row.uncertainty, row.particles, row.seconds
    );
    rows.push(row);
}

/// Unknowns of the first model of a series whose value is within the tolerance, and those of all finer ones.
fn smallest(series: &[(f64, usize)], exact: f64) -> Option<usize> {
    let off = |(value, _): &&(f64, usize)| (value / exact - 1.0).abs() <= ASKED;
    series.iter().rev().take_while(off).last().map(|&(_, unknowns)| unknowns)
}

fn rubber(between: &mut dyn FnMut(f64, f64) -> f64) -> Result<Rubber, rkpm::Error> {
    Ok(Rubber::neo_hookean(between(0.2, 1.0), 10f64.powf(between(2.0, 4.0)))?)
}

/// A motion of an upper face: down, and aside.
fn motion(between: &mut dyn FnMut(f64, f64) -> f64) -> [f64; 2] {
    [between(0.0, 0.2), between(-0.15, -0.05)]
}

/// A plate with a round hole.
fn region(between: &mut dyn FnMut(f64, f64) -> f64) -> Result<Drawn<2>, rkpm::Error> {
    let (width, radius) = (between(1.0, 2.5), between(0.12, 0.3));
    let outline = Outline::at([0.0, 0.0]).line("bottom", [width, 0.0]).line("side", [width, 1.0]);
    let hole = Outline::circle("hole", [between(0.4, 0.6) * width, between(0.4, 0.6)], radius);
    let part = Region::with_holes(outline.line("top", [0.0, 1.0]).close("side"), [hole])?;
    let scene = Scene::new(part, PlaneStrain, rubber(between)?)
        .hold("bottom")
        .with(Condition::on("top").displacement(motion(between)).named("moved"));
    Ok(Drawn::evenly(scene, PLANAR))
}

/// Quadrangles of a trapezium, their inner nodes moved.
fn mesh(between: &mut dyn FnMut(f64, f64) -> f64) -> Result<Drawn<2>, rkpm::Error> {
    let counts = [between(3.0, 6.9) as usize, between(3.0, 5.9) as usize];
    let (width, slant) = (between(0.8, 2.0), between(-0.3, 0.3));
    let along = counts[0] + 1;
    let mut points = Vec::new();
    for j in 0..=counts[1] {
        for i in 0..=counts[0] {
            let inside = i > 0 && i < counts[0] && j > 0 && j < counts[1];
            let mut shifted =
                |k: usize, n: usize| (k as f64 + if inside { between(-0.2, 0.2) } else { 0.0 }) / n as f64;
            let (x, y) = (shifted(i, counts[0]), shifted(j, counts[1]));
            points.push(Point::<2>::new(x * width + slant * y * (1.0 - 2.0 * x), y));
        }
    }
    let cells: Vec<usize> = (0..counts[1])
        .flat_map(|j| (0..counts[0]).map(move |i| j * along + i))
        .flat_map(|k| [k, k + 1, k + along + 1, k + along])
        .collect();
    let row = |first: usize| (0..counts[0]).flat_map(move |i| [first + i, first + i + 1]);
    let edges: Vec<usize> = row(0).chain(row(counts[1] * along)).collect();
    let first = counts[0] * counts[1];
    let groups = [
        ("bottom".to_string(), (first..first + counts[0]).collect()),
        ("top".to_string(), (first + counts[0]..first + 2 * counts[0]).collect()),
    ];
    let part = Mesh::new(points, &[(CellShape::Quadrangle, cells), (CellShape::Line, edges)], &groups)?;
    let (rubber, motion) = (rubber(between)?, motion(between));
    let scene = |part: Mesh<2>| {
        Scene::new(part, PlaneStrain, rubber.clone())
            .hold("bottom")
            .with(Condition::on("top").displacement(motion).named("moved"))
    };
    let cut = |times: usize| (0..times).try_fold(part.clone(), |mesh, _| mesh.refined());
    let references = [cut(CUTS[0])?, cut(CUTS[1])?].map(|mesh| (scene(mesh), Scheme::default()));
    Ok(Drawn { scene: scene(part), references, ratio: 2.0 })
}

/// Two bonded layers.
fn bodies(between: &mut dyn FnMut(f64, f64) -> f64) -> Result<Drawn<2>, rkpm::Error> {
    let (width, joint) = (between(0.8, 3.0), between(0.3, 0.7));
    let scene = Scene::assembly(PlaneStrain)
        .body("lower", Block::new([0.0, 0.0], [width, joint]), rubber(between)?)
        .body("upper", Block::new([0.0, joint], [width, 1.0]), rubber(between)?)
        .hold(Place::on((1, Side::Min)).of("lower"))
        .with(Condition::on(Place::on((1, Side::Max)).of("upper")).displacement(motion(between)).named("moved"));
    Ok(Drawn::evenly(scene, PLANAR))
}

/// A half of a round cord on a plate, pressed by its flat side.
fn contact(between: &mut dyn FnMut(f64, f64) -> f64) -> Result<Drawn<2>, rkpm::Error> {
    let radius = between(0.6, 1.4);
    let outline =
        Outline::at([0.0, -radius]).arc("round", [radius, 0.0], [0.0, 0.0], Turn::Left).line("top", [0.0, 0.0]);
    let down = between(0.08, 0.25) * radius;
    let floor = RigidSurface::plane([0.0, -radius], [0.0, 1.0]).named("floor");
    let scene = Scene::new(Region::new(outline.close("axis"))?, PlaneStrain, rubber(between)?)
        .prescribe("axis", 0, 0.0)
        .with(Condition::on("top").displacement([0.0, -down]).named("moved"))
        .contact("round", floor);
    Ok(Drawn::evenly(scene, PLANAR))
}

/// A block with a bore along its width.
fn solid(between: &mut dyn FnMut(f64, f64) -> f64) -> Result<Drawn<3>, rkpm::Error> {
    let (width, depth, radius) = (between(0.8, 1.5), between(0.8, 1.5), between(0.15, 0.3));
    let middle = [between(0.4, 0.6) * width, between(0.4, 0.6)];
    let bore = Shape::cylinder([middle[0], -0.1, middle[1]], [middle[0], depth + 0.1, middle[1]], radius);
    let part = Shape::block([0.0; 3], [width, depth, 1.0]).minus(bore).solid(0.1)?;
    let at = |height: f64| [0.5 * width, 0.5 * depth, height];
    let part = part.name("bottom", Select::plane(at(0.0), [0.0, 0.0, -1.0]))?;
    let part = part.name("top", Select::plane(at(1.0), [0.0, 0.0, 1.0]))?;
    let [aside, down] = motion(between);
    let scene = Scene::new(part, Solid, rubber(between)?)
        .hold("bottom")
        .with(Condition::on("top").displacement([aside, 0.0, down]));
    Ok(Drawn::evenly(scene, SPATIAL))
}
