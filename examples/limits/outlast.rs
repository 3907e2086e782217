//! Badly placed nodes: particles and finite elements with the same jittered nodes, driven to the same last load.
//!
//! A set counts where it reaches the last load with an energy within 2 % of that of a refined regular model. With 30 % of jitter the
//! quadrilaterals between the nodes are bad, with 45 % some are inverted: then elements are refused, and particles take the Voronoi cells
//! of the same places instead. (Linear triangles between these nodes would carry finite elements too; the crate has none.)

use std::error::Error;
use std::f64::consts::PI;
use std::path::Path as FilePath;
use std::sync::Arc;

use crate::support::Summary;
use rkpm::cells::{Cells, Lattice, Triangulation, Voronoi};
use rkpm::geometry::{Outline, Region};
use rkpm::output::{Cell, Chart, Table};
use rkpm::prelude::*;

/// Drawn sets of each scene and jitter.
const SETS: u64 = 20;
/// Inner nodes leave their places by up to this part of the spacing along each axis.
const JITTERS: [(&str, f64); 2] = [("30", 0.3), ("45", 0.45)];
const WITHIN: f64 = 0.02;
/// Refinements of the regular lattice by which the energy is judged: the first that reaches the last load.
const REFINED: [usize; 2] = [3, 2];

/// Faces of a quadrilateral and the names of its sides, from its first corner on.
const SIDES: [((usize, Side), &str); 4] =
    [((1, Side::Min), "bottom"), ((0, Side::Max), "right"), ((1, Side::Max), "top"), ((0, Side::Min), "left")];

/// A quadrilateral body and its conditions.
struct Given {
    name: &'static str,
    corners: [[f64; 2]; 4],
    counts: [usize; 2],
    rubber: [f64; 2],
    conditions: fn(Scene<2>, &dyn Fn(usize, Side) -> Part) -> Scene<2>,
}

const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
const BAR: [[f64; 2]; 4] = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [0.0, 1.0]];
const COOK: [[f64; 2]; 4] = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]]; // mm
/// µ = 1, k/µ = 1e3.
const SOFT: [f64; 2] = [0.5, 1e3];

/// A body between bonded plates, the upper one moved.
fn between(scene: Scene<2>, face: &dyn Fn(usize, Side) -> Part, by: [f64; 2]) -> Scene<2> {
    scene.hold(face(1, Side::Min)).prescribe(face(1, Side::Max), 0, by[0]).prescribe(face(1, Side::Max), 1, by[1])
}

/// A square whose bonded upper half of a side is pressed in, half of it modelled.
fn punched(scene: Scene<2>, face: &dyn Fn(usize, Side) -> Part) -> Scene<2> {
    let under = |x: &Point<2>| x[0] < 0.5 + 1e-9;
    scene
        .prescribe(face(0, Side::Min), 0, 0.0)
        .hold(face(1, Side::Min))
        .with(Condition::on(Place::on(face(1, Side::Max)).within(under)).component(0, 0.0).component(1, -0.3))
}

/// A bar whose ends are turned towards each other: its inner side is crushed.
fn bent(scene: Scene<2>, face: &dyn Fn(usize, Side) -> Part) -> Scene<2> {
    let end = |sign: f64| {
        Value::motion(move |x: &Point<2>, load: f64| {
            let (angle, middle) = (sign * 0.45 * PI * load, Point::<2>::new(if sign > 0.0 { 0.0 } else { 3.0 }, 0.5));
            let (s, c) = angle.sin_cos();
            let arm = x - middle;
            [c * arm[0] + s * arm[1] - arm[0] + sign * 0.25 * load, c * arm[1] - s * arm[0] - arm[1]]
        })
    };
    scene
        .with(Condition::on(face(0, Side::Min)).displacement(end(1.0)))
        .with(Condition::on(face(0, Side::Max)).displacement(end(-1.0)))
}

fn scenes() -> [Given; 6] {
    let square = |name, conditions| Given { name, corners: SQUARE, counts: [17, 17], rubber: SOFT, conditions };
    [
        square("pressed", |scene, face| between(scene, face, [0.0, -0.45])),
        square("sheared", |scene, face| between(scene, face, [1.5, 0.0])),
        square("pulled", |scene, face| between(scene, face, [0.0, 1.5])),
        square("punched", punched),
        Given { name: "bent", corners: BAR, counts: [25, 9], rubber: SOFT, conditions: bent },
        Given {
            name: "cook",
            corners: COOK,
            counts: [17, 17],
            rubber: [40.097, 4e5],
            // Four times the usual load.
            conditions: |scene, face| scene.hold(face(0, Side::Min)).traction(face(0, Side::Max), [0.0, 25.0]),
        },
    ]
}

impl Given {
    /// The scene over given cells, whose faces are known by their names or by their axes.
    fn over(&self, cells: Arc<dyn Cells<2>>, named: bool) -> Result<Scene<2>, rkpm::Error> {
        let rubber = Rubber::neo_hookean(self.rubber[0], self.rubber[1])?;
        let face = |axis: usize, side: Side| {
            let name = SIDES.iter().find(|(face, _)| *face == (axis, side)).map_or("", |(_, name)| name);
            if named { Part::from(name) } else { Part::from((axis, side)) }
        };
        Ok((self.conditions)(Scene::new(cells, PlaneStrain, rubber), &face))
    }

    /// Places of a lattice, inner ones moved by up to `jitter` of the spacing.
    fn places(&self, jitter: f64, seed: u64) -> Result<Vec<Point<2>>, rkpm::Error> {
        let body = Quadrilateral { corners: self.corners };
        let mut places = Lattice::new(&body, self.counts, &Layout::Regular)?.positions().to_vec();
        let corner = |k: usize| Point::<2>::from(self.corners[k]);
        let mut random = Random(seed);
        for (node, place) in places.iter_mut().enumerate() {
            let index = [node % self.counts[0], node / self.counts[0]];
            let draws = [random.next(), random.next()];
            if (0..2).any(|axis| index[axis] == 0 || index[axis] + 1 == self.counts[axis]) {
                continue;
            }
            let [s, t] = [0, 1].map(|axis| index[axis] as f64 / (self.counts[axis] - 1) as f64);
            let along = (corner(1) - corner(0)) * (1.0 - t) + (corner(2) - corner(3)) * t;
            let across = (corner(3) - corner(0)) * (1.0 - s) + (corner(2) - corner(1)) * s;
            for (axis, way) in [along, across].into_iter().enumerate() {
                *place += way * (jitter * (2.0 * draws[axis] - 1.0) / (self.counts[axis] - 1) as f64);
            }
        }
        Ok(places)
    }

    /// The scene over the quadrilaterals between these places; where some are inverted, over their Voronoi cells, by request.
    fn scene(&self, places: &[Point<2>], voronoi: bool) -> Result<Scene<2>, rkpm::Error> {
        match Lattice::from_positions(self.counts, places.to_vec()) {
            Ok(lattice) => self.over(Arc::new(lattice), false),
            Err(_) if voronoi => {
                let [a, b, c, d] = self.corners;
                let outline = Outline::at(a).line("bottom", b).line("right", c).line("top", d).close("left");
                let cells = Voronoi::new(Triangulation::of_particles(&Region::new(outline)?, places)?);
                self.over(Arc::new(cells), true)
            }
            Err(error) => Err(error.into()),
        }
    }

    /// The energy of a refined regular model at the last load; none where no refinement reaches it.
    fn reference(&self) -> Result<Option<f64>, rkpm::Error> {
        for refined in REFINED {
            let counts = self.counts.map(|n| refined * (n - 1) + 1);
            let lattice = Lattice::new(&Quadrilateral { corners: self.corners }, counts, &Layout::Regular)?;
            let problem = self.over(Arc::new(lattice), false)?.discretize(&Scheme::default())?;
            match problem.run()?.completed() {
                Ok(path) => return Ok(Some(problem.energy(path.last())?)),
                Err(error) => println!("{}, refined by {refined}: {error}", self.name),
            }
        }
        Ok(None)
    }
}

/// Random numbers between 0 and 1 (splitmix64): the same sets everywhere.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut bits = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Share of the sets that reach the last load within 2 %, and the iterations of those that are not refused.
pub fn run(out: &FilePath, summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let mut table = Table::new([
        "scene",
        "jitter",
        "scheme",
        "seed",
        "last_load",
        "energy_over_reference",
        "iterations",
        "refused",
    ]);
    let schemes = [("particles", Scheme::default()), ("q2p1", Scheme::elements(2)), ("q1p0", Scheme::elements(1))];
    let mut energies: Vec<(String, Vec<[f64; 2]>)> = Vec::new();
    let mut titles = Vec::new();
    for given in scenes() {
        // Without a refined model at the last load there is nothing to compare with.
        let Some(reference) = given.reference()? else { continue };
        titles.push(format!("{} {}", titles.len() + 1, given.name));
        for (percent, jitter) in JITTERS {
            for (label, scheme) in &schemes {
                let (mut kept, mut ran, mut iterations) = (0usize, 0usize, 0usize);
                for seed in 1..=SETS {
                    let places = given.places(jitter, seed)?;
                    let problem =
                        given.scene(&places, *label == "particles").and_then(|scene| scene.discretize(scheme));
                    let names = [given.name, percent, label].map(Cell::from);
                    let row = names.into_iter().chain([Cell::from(seed as f64)]);
                    let Ok(problem) = problem else {
                        let none = [Cell::from(0.0), Cell::from(f64::NAN), Cell::from(0.0), Cell::from(1.0)];
                        table.push(row.chain(none))?;
                        continue;
                    };
                    let path = problem.run()?;
                    let ratio = problem.energy(path.last())? / reference;
                    let whole = matches!(path.ending, Ending::Completed);
                    kept += usize::from(whole && (ratio - 1.0).abs() <= WITHIN);
                    ran += 1;
                    if whole {
                        let series = format!("{label}, {percent} %");
                        let place = energies.iter().position(|(name, _)| *name == series).unwrap_or_else(|| {
                            energies.push((series, Vec::new()));
                            energies.len() - 1
                        });
                        // Schemes beside each other.
                        let at = titles.len() as f64 + 0.15 * place as f64 - 0.2;
                        energies[place].1.push([at, ratio]);
                    }
                    iterations += path.iterations;
                    let numbers = [path.last().load, ratio, path.iterations as f64, 0.0].map(Cell::from);
                    table.push(row.chain(numbers))?;
                }
                let name = format!("outlast_{}_{percent}_{label}", given.name);
                summary.note(&name, kept as f64 / SETS as f64)?;
                if ran > 0 {
                    summary.note(format!("{name}_iterations"), iterations as f64 / ran as f64)?;
                }
            }
        }
    }
    table.write(out.join("outlast.csv"))?;
    let mut chart = Chart::new("Badly placed nodes: sets that reach the last load")
        .x(titles.join(", "))
        .y("energy over that of a refined model")
        .horizontal("2 %", 1.0 + WITHIN)
        .horizontal("", 1.0 - WITHIN);
    for (name, points) in &energies {
        chart = chart.markers(name, points);
    }
    chart.write(out.join("outlast.svg"))?;
    Ok(())
}
