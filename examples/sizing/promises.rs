//! Promises on drawn scenes that no rule was made with, against references that are independent of the scheme judged.

use std::error::Error;
use std::path::Path as FilePath;
use std::sync::Arc;
use std::time::Instant;

use crate::support::Summary;
use rkpm::output::{Cell, Table};
use rkpm::prelude::*;
use rkpm::study::{Answer, Budget, Quantity, Tolerance, Verdict};

use crate::{Uniform, median};

const TOLERANCES: [f64; 5] = [0.02, 0.01, 0.005, 0.002, 0.001];
/// First seed of the scenes.
const SEED: u64 = 7001;
/// Nodes along the longest side of the references: each is the last of these, its own uncertainty the change from the one
/// before, or half the change before that where it is larger.
const REFERENCES: [usize; 3] = [41, 57, 81];
/// The same in space.
const REFERENCES_SPACE: [usize; 3] = [9, 13, 17];
/// Powers of the distance to the edges by which references are graded: the first that leads to the last load. Strongly graded
/// elements fold at the corners of bodies that are bonded.
const GRADINGS: [f64; 3] = [2.0, 1.5, 1.0];
/// Cells along the shortest side of the models that answers are compared with.
const SERIES: [usize; 12] = [2, 4, 6, 8, 10, 12, 16, 20, 24, 32, 40, 48];

/// A drawn scene, its sides and what is requested of it.
struct Drawn<const D: usize> {
    family: &'static str,
    scene: Scene<D>,
    sides: [f64; D],
    requested: Vec<Quantity<D>>,
}

/// Sides, scene and what is requested of it.
type Parts = ([f64; 2], Scene<2>, Vec<Quantity<2>>);

/// A body of revolution between bonded plates: a cylinder has an axis, a ring a bore that is free.
fn of_revolution(family: &str, rubber: Rubber, between: &mut impl FnMut(f64, f64) -> f64) -> Parts {
    let height = 10.0;
    let inner = if family == "ring" { between(3.0, 30.0) } else { 0.0 };
    let width = height * between(0.5, 3.0);
    let press = height * between(0.02, 0.25);
    let sides = [width, height];
    let bonded = Scene::new(Block::new([inner, 0.0], [inner + width, height]), Axisymmetric, rubber)
        .hold((1, Side::Min))
        .prescribe((1, Side::Max), 0, 0.0)
        .prescribe((1, Side::Max), 1, -press);
    let scene = if inner > 0.0 { bonded } else { bonded.prescribe((0, Side::Min), 0, 0.0) };
    let middle = Point::<2>::new(inner + 0.5 * width, 0.5 * height);
    let stress = move |problem: &Problem<2>, state: &State| Ok(problem.stress(state, &middle)?[(1, 1)]);
    let requested = vec![
        Quantity::reaction((1, Side::Max), 1),
        Quantity::energy(),
        Quantity::displacement([inner + width, 0.5 * height], 0),
        Quantity::new("stress", stress),
    ];
    (sides, scene, requested)
}

/// A sleeve that is held outside; its bore is moved along the axis.
fn sleeve(rubber: Rubber, between: &mut impl FnMut(f64, f64) -> f64) -> Parts {
    let (inner, width, height) = (between(4.0, 20.0), between(4.0, 12.0), between(5.0, 30.0));
    let sides = [width, height];
    let scene = Scene::new(Block::new([inner, 0.0], [inner + width, height]), Axisymmetric, rubber)
        .hold((0, Side::Max))
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((0, Side::Min), 1, width * between(0.1, 0.5));
    let requested = vec![Quantity::reaction((0, Side::Min), 1), Quantity::energy()];
    (sides, scene, requested)
}

/// Half a bush: its outer surface is held, its inner one is moved down.
fn bush(rubber: Rubber, between: &mut impl FnMut(f64, f64) -> f64) -> Parts {
    let (inner, outer) = (between(4.0, 10.0), between(12.0, 25.0));
    let ring = Mapped(move |unit: &Point<2>| {
        let (radius, angle) = (inner + (outer - inner) * unit[0], std::f64::consts::PI * (unit[1] - 0.5));
        // Cosines that are exact at both ends keep the straight sides straight.
        let cos = if unit[1] == 0.0 || unit[1] == 1.0 { 0.0 } else { angle.cos() };
        Point::<2>::new(radius * cos, radius * angle.sin())
    });
    let sides = [outer - inner, 0.5 * std::f64::consts::PI * (inner + outer)];
    let down = (outer - inner) * between(0.05, 0.3);
    let scene = Scene::new(ring, PlaneStrain, rubber)
        .hold((0, Side::Max))
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((0, Side::Min), 1, -down)
        .prescribe((1, Side::Min), 0, 0.0)
        .prescribe((1, Side::Max), 0, 0.0);
    let requested = vec![Quantity::reaction((0, Side::Min), 1), Quantity::energy()];
    (sides, scene, requested)
}

/// A scene of a family by its seed. Lengths in mm, stresses in MPa.
fn draw(family: &'static str, seed: u64) -> Result<Drawn<2>, rkpm::Error> {
    let mut random = Uniform(seed);
    let mut between = |low: f64, high: f64| low + (high - low) * random.next();
    let mu = between(0.5, 2.0);
    let rubber = Rubber::mooney_rivlin(0.4 * mu, 0.1 * mu, mu * 10f64.powf(between(2.5, 4.0)))?;
    let (sides, requested, scene);
    match family {
        "membrane" => {
            let (length, left, right) = (between(30.0, 60.0), between(25.0, 50.0), between(12.0, 30.0));
            let rise = between(0.0, 45.0);
            let corners = [[0.0, 0.0], [length, rise], [length, rise + right], [0.0, left]];
            sides = [length, 0.5 * (left + right)];
            let force = mu * between(0.02, 0.15) * right / length;
            scene = Scene::new(Quadrilateral { corners }, PlaneStrain, rubber)
                .hold((0, Side::Min))
                .traction((0, Side::Max), [0.0, force]);
            requested = vec![Quantity::displacement(corners[2], 1), Quantity::energy()];
        }
        "block" | "pad" => {
            let height = 10.0;
            let width = height * if family == "block" { between(0.7, 2.0) } else { between(2.5, 6.0) };
            let shear = height * between(0.1, 0.6);
            let press = height * if family == "block" { between(-0.15, 0.1) } else { between(-0.08, 0.0) };
            sides = [width, height];
            scene = Scene::new(Block::new([0.0, 0.0], [width, height]), PlaneStrain, rubber)
                .hold((1, Side::Min))
                .prescribe((1, Side::Max), 0, shear)
                .prescribe((1, Side::Max), 1, press);
            requested = vec![Quantity::reaction((1, Side::Max), 0), Quantity::energy()];
        }
        "disk" => {
            let thickness = 1.0;
            let radius = between(5.0, 25.0);
            // From hardly bent to a bubble half as high as wide.
            let pressure = mu * (thickness / radius) * between(0.1, 0.6);
            sides = [radius, thickness];
            scene = Scene::new(Block::new([0.0, 0.0], sides), Axisymmetric, rubber)
                .prescribe((0, Side::Min), 0, 0.0)
                .hold((0, Side::Max))
                .pressure((1, Side::Min), pressure);
            requested = vec![Quantity::displacement([0.0, 0.0], 1), Quantity::energy()];
        }
        "cylinder" | "ring" => (sides, scene, requested) = of_revolution(family, rubber, &mut between),
        "sleeve" => (sides, scene, requested) = sleeve(rubber, &mut between),
        "bush" => (sides, scene, requested) = bush(rubber, &mut between),
        _ => {
            let thickness = 1.0;
            let length = between(4.0, 16.0);
            let pressure = mu * (thickness / length) * between(0.1, 0.6);
            sides = [length, thickness];
            scene = Scene::new(Block::new([0.0, 0.0], sides), PlaneStrain, rubber)
                .hold((0, Side::Min))
                .hold((0, Side::Max))
                .pressure((1, Side::Min), pressure);
            requested = vec![Quantity::displacement([0.5 * length, 0.0], 1), Quantity::energy()];
        }
    }
    Ok(Drawn { family, scene, sides, requested })
}

/// Values of a scene under a scheme.
fn values<const D: usize>(drawn: &Drawn<D>, scheme: &Scheme) -> Result<Vec<f64>, rkpm::Error> {
    let problem = drawn.scene.discretize(scheme)?;
    let path = problem.run()?.completed()?;
    drawn.requested.iter().map(|q| q.evaluate(&problem, path.last())).collect()
}

/// Even numbers of cells in proportion to the sides, plus one.
fn particles<const D: usize>(sides: [f64; D], across: usize, most: usize) -> [usize; D] {
    let shortest = sides.into_iter().fold(f64::INFINITY, f64::min);
    sides.map(|side| {
        let cells = (across as f64 * side / shortest).min(most as f64);
        2 * (0.5 * cells).round().max(1.0) as usize + 1
    })
}

/// References by elements of order 2, graded towards all edges, with their own uncertainty: what the last refinement changed.
fn reference<const D: usize>(drawn: &Drawn<D>) -> Result<(Vec<f64>, f64), Box<dyn Error>> {
    let longest = drawn.sides.into_iter().fold(0.0, f64::max);
    let shortest = drawn.sides.into_iter().fold(f64::INFINITY, f64::min);
    let at = |nodes: usize, power: f64| {
        let across = ((nodes as f64 * shortest / longest) as usize).max(nodes / 4);
        let counts = drawn.sides.map(|s| if s == longest { nodes } else { 2 * (across / 2) + 1 });
        values(drawn, &Scheme::elements(2).layout(graded(power, counts)).particles(counts))
    };
    let mut found = None;
    for power in GRADINGS.into_iter().skip(usize::from(drawn.family != "membrane" && !drawn.family.starts_with("cook")))
    {
        let three = if D == 3 { REFERENCES_SPACE } else { REFERENCES }.map(|nodes| at(nodes, power));
        if let [Ok(a), Ok(b), Ok(c)] = three {
            found = Some([a, b, c]);
            break;
        }
    }
    let [a, b, c] = found.ok_or("no grading led to the last load")?;
    let change = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| (x / y - 1.0).abs()).fold(0.0, f64::max);
    let own = change(&b, &c).max(0.5 * change(&a, &b));
    Ok((c, own))
}

/// Nodes that crowd towards all edges, by a power of the distance; middle nodes of elements stay in the middle.
fn graded<const D: usize>(power: f64, counts: [usize; D]) -> Layout {
    let elements = counts.map(|n| ((n - 1) / 2) as f64);
    Layout::Graded(Arc::new(move |axis, t| {
        let half = |t: f64| 0.5 * (2.0 * t).powf(power);
        let place = |t: f64| if t <= 0.5 { half(t) } else { 1.0 - half(1.0 - t) };
        let x = t * elements[axis];
        let element = (x + 1e-9).floor().min(elements[axis] - 1.0);
        let [a, b] = [element, element + 1.0].map(|x| place(x / elements[axis]));
        a + (b - a) * (x - element)
    }))
}

/// The particles of the smallest even model of any approximation that meets a tolerance and keeps it when refined.
struct Smallest(Vec<Vec<(usize, Vec<f64>)>>);

impl Smallest {
    fn of<const D: usize>(drawn: &Drawn<D>, exact: &[f64]) -> Self {
        let (most, largest) = if D == 3 { (24, 800) } else { (96, 4000) };
        let schemes = [Scheme::default(), Scheme::default().order(2), Scheme::elements(2)];
        let series = schemes.map(|scheme| {
            let mut runs: Vec<(usize, Vec<f64>)> = Vec::new();
            for across in SERIES {
                let counts = particles(drawn.sides, across, most);
                let total = counts.iter().product();
                if total > largest || runs.iter().any(|run| run.0 == total) {
                    continue;
                }
                // Models that can't be solved keep no tolerance.
                let errors = match values(drawn, &scheme.clone().particles(counts)) {
                    Ok(values) => values.iter().zip(exact).map(|(v, e)| (v / e - 1.0).abs()).collect(),
                    Err(_) => vec![f64::INFINITY; exact.len()],
                };
                runs.push((total, errors));
            }
            runs
        });
        Smallest(series.into())
    }

    fn for_tolerance(&self, quantity: usize, tolerance: f64) -> Option<usize> {
        let needed = |runs: &Vec<(usize, Vec<f64>)>| {
            let first = runs.iter().rposition(|(_, errors)| errors[quantity] > tolerance).map_or(0, |last| last + 1);
            runs.get(first).map(|run| run.0)
        };
        self.0.iter().filter_map(needed).min()
    }
}

/// Seconds of the model of an answer, solved at once.
fn seconds_of_the_same<const D: usize>(drawn: &Drawn<D>, answer: &Answer<D>) -> Option<f64> {
    let level = &answer.levels[answer.levels.len() - 1];
    let counts: [usize; D] = std::array::from_fn(|axis| level.counts[axis]);
    let scheme = if level.functions.contains("elements") {
        Scheme::elements(2).layout(graded(1.25, counts))
    } else {
        Scheme::default()
    };
    let start = Instant::now();
    values(drawn, &scheme.particles(counts)).ok().map(|_| start.elapsed().as_secs_f64())
}

/// What became of the promises of a group of scenes.
#[derive(Default)]
pub struct Tally {
    scenes: usize,
    requested: usize,
    /// Requested 0.2 % or more, and reached of these.
    looser: [usize; 2],
    reached: usize,
    kept: usize,
    held: usize,
    ratios: Vec<f64>,
    sizes: Vec<f64>,
    times: Vec<f64>,
    longest: f64,
}

impl Tally {
    /// Asks a scene for each of its quantities within each tolerance, a row for each answer.
    fn judge<const D: usize>(&mut self, drawn: &Drawn<D>, seed: u64, table: &mut Table) -> Result<(), Box<dyn Error>> {
        let Ok((exact, own)) = reference(drawn) else {
            println!("no reference: {} {seed}", drawn.family);
            return Ok(());
        };
        self.scenes += 1;
        let before = (self.requested, self.reached, self.kept, self.held);
        let smallest = Smallest::of(drawn, &exact);
        for (k, quantity) in drawn.requested.iter().enumerate() {
            for tolerance in TOLERANCES {
                // The reference must be ten times as good.
                if own > 0.1 * tolerance {
                    continue;
                }
                let start = Instant::now();
                let requested = Tolerance::of(quantity.clone(), tolerance);
                let answer = drawn.scene.solve_within(&requested, Budget::default())?;
                let seconds = start.elapsed().as_secs_f64();
                let error = (answer.values()[0] / exact[k] - 1.0).abs();
                let least = smallest.for_tolerance(k, tolerance);
                let direct = self.count(drawn, &answer, [tolerance, error, own, seconds], least);
                let cells = [tolerance, answer.bound, error, own, seconds, direct];
                table.rows.push(row(drawn, seed, quantity.name(), &answer, least, cells));
            }
        }
        println!(
            "{} {seed}: {} promises, {} reached, {} kept, {} bounds held",
            drawn.family,
            self.requested - before.0,
            self.reached - before.1,
            self.kept - before.2,
            self.held - before.3
        );
        Ok(())
    }

    /// Counts an answer; the seconds of its model alone.
    fn count<const D: usize>(
        &mut self,
        drawn: &Drawn<D>,
        answer: &Answer<D>,
        [tolerance, error, own, seconds]: [f64; 4],
        least: Option<usize>,
    ) -> f64 {
        self.longest = self.longest.max(seconds);
        self.requested += 1;
        if tolerance >= 0.002 {
            self.looser[0] += 1;
            self.looser[1] += usize::from(answer.reached());
        }
        if !answer.reached() {
            return f64::NAN;
        }
        self.reached += 1;
        self.kept += usize::from(error <= tolerance);
        self.held += usize::from(error <= answer.bound);
        self.ratios.push(answer.bound / error.max(own));
        let particles = answer.problem.model().unknowns() / D;
        self.sizes.extend(least.map(|least| particles as f64 / least as f64));
        let direct = seconds_of_the_same(drawn, answer);
        self.times.extend(direct.map(|direct| seconds / direct));
        direct.unwrap_or(f64::NAN)
    }

    /// Notes shares, medians and means, each name with an ending.
    fn note(self, ending: &str, summary: &mut Summary) -> Result<(), Box<dyn Error>> {
        let share = |some: usize, of: usize| some as f64 / of as f64;
        let mean = |values: &[f64]| (values.iter().map(|v| v.ln()).sum::<f64>() / values.len() as f64).exp();
        let mut note = |name: &str, value: f64| summary.note(format!("{name}{ending}"), value).map(|_| ());
        note("scenes", self.scenes as f64)?;
        note("requested", self.requested as f64)?;
        note("accepted", share(self.looser[1], self.looser[0]))?;
        note("kept", share(self.kept, self.reached))?;
        note("bound_held", share(self.held, self.reached))?;
        note("bound_over_error_median", median(self.ratios))?;
        note("particles_over_smallest", mean(&self.sizes))?;
        note("particles_over_smallest_median", median(self.sizes))?;
        note("seconds_over_direct", mean(&self.times))?;
        note("seconds_over_direct_median", median(self.times))?;
        note("longest_answer_seconds", self.longest)?;
        Ok(())
    }
}

/// A row of the table.
fn row<const D: usize>(
    drawn: &Drawn<D>,
    seed: u64,
    quantity: &str,
    answer: &Answer<D>,
    least: Option<usize>,
    [tolerance, bound, error, own, seconds, direct]: [f64; 6],
) -> Vec<Cell> {
    let why = match &answer.verdict {
        Verdict::NotReached(why) => why.clone(),
        Verdict::Reached => String::new(),
    };
    vec![
        Cell::from(drawn.family),
        Cell::from(seed as usize),
        Cell::from(quantity),
        Cell::from(tolerance),
        Cell::from(usize::from(answer.reached())),
        Cell::from(bound),
        Cell::from(error),
        Cell::from(own),
        Cell::from(answer.problem.model().unknowns()),
        Cell::from(answer.levels[answer.levels.len() - 1].functions),
        Cell::from(answer.levels.len()),
        Cell::from(least),
        Cell::from(seconds),
        Cell::from(direct),
        Cell::from(why),
    ]
}

fn table() -> Table {
    let columns = "family seed quantity tolerance reached bound error uncertainty unknowns functions models smallest seconds \
                   direct_seconds why";
    Table::new(columns.split(' '))
}

/// Draws `each` scenes of every family, asks for each quantity within each tolerance, and notes what became of it.
pub fn promises(each: u64, out: &FilePath, summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let (mut table, mut tally) = (table(), Tally::default());
    for family in ["membrane", "block", "pad", "disk", "strip"] {
        for seed in SEED..SEED + each {
            tally.judge(&draw(family, seed)?, seed, &mut table)?;
            // A run of an hour leaves what it has.
            table.write(out.join("promises.csv"))?;
        }
    }
    tally.note("", summary)
}

/// Blocks in space between bonded plates, pressed and sheared.
fn draw_in_space(seed: u64) -> Result<Drawn<3>, rkpm::Error> {
    let mut random = Uniform(seed);
    let mut between = |low: f64, high: f64| low + (high - low) * random.next();
    let mu = between(0.5, 2.0);
    let rubber = Rubber::mooney_rivlin(0.4 * mu, 0.1 * mu, mu * 10f64.powf(between(2.5, 4.0)))?;
    let height = 10.0;
    let sides = [height * between(0.8, 2.0), height * between(0.8, 2.0), height];
    let moved = [height * between(0.1, 0.5), 0.0, -height * between(0.0, 0.1)];
    let scene = Scene::new(Block::new([0.0; 3], sides), Solid, rubber)
        .hold((2, Side::Min))
        .with(Condition::on((2, Side::Max)).displacement(moved));
    let requested = vec![Quantity::reaction((2, Side::Max), 0), Quantity::energy()];
    Ok(Drawn { family: "block in space", scene, sides, requested })
}

/// Scenes of revolution (`n` each of four families), in the plane (six tenths of that each of five) and in space (twice `n`), drawn from
/// a seed on: what became of their promises, group by group.
pub fn groups(n: u64, first: u64, out: &FilePath, summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let mut table = table();
    let groups: [(&str, &[&'static str], u64); 2] = [
        ("revolution", &["disk", "cylinder", "ring", "sleeve"], n),
        ("plane", &["membrane", "block", "pad", "strip", "bush"], (6 * n).div_ceil(10)),
    ];
    for (group, families, each) in groups {
        let mut tally = Tally::default();
        for &family in families {
            for seed in first..first + each {
                tally.judge(&draw(family, seed)?, seed, &mut table)?;
                table.write(out.join("scenes.csv"))?;
            }
        }
        tally.note(&format!("_{group}"), summary)?;
    }
    let mut tally = Tally::default();
    for seed in first..first + 2 * n {
        tally.judge(&draw_in_space(seed)?, seed, &mut table)?;
        table.write(out.join("scenes.csv"))?;
    }
    tally.note("_space", summary)
}

/// Of scenes of all families, drawn from a seed on, the part of the answers that keep their tolerance and of the bounds that hold;
/// nothing is said of what they cost.
pub fn bounds(each: u64, first: u64, families: &[String], summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let all = ["membrane", "block", "pad", "disk", "strip", "cylinder", "ring", "bush"];
    for family in all.into_iter().filter(|name| families.is_empty() || families.iter().any(|f| f == name)) {
        let (mut reached, mut kept, mut held, mut requested, mut seconds) = (0usize, 0usize, 0usize, 0usize, 0.0);
        let mut worse = 0usize;
        for seed in first..first + each {
            let drawn = draw(family, seed)?;
            let Ok((exact, own)) = reference(&drawn) else {
                println!("no reference: {family} {seed}");
                continue;
            };
            for (k, quantity) in drawn.requested.iter().enumerate() {
                let mut looser = f64::INFINITY;
                for tolerance in TOLERANCES.into_iter().filter(|tolerance| own <= 0.1 * tolerance) {
                    requested += 1;
                    let start = Instant::now();
                    let answer =
                        drawn.scene.solve_within(&Tolerance::of(quantity.clone(), tolerance), Budget::default())?;
                    seconds += start.elapsed().as_secs_f64();
                    let error = (answer.values()[0] / exact[k] - 1.0).abs();
                    // Under one budget a tighter tolerance must not have a larger bound, unless it keeps it.
                    worse += usize::from(!answer.reached() && answer.bound > looser * (1.0 + 1e-9));
                    looser = looser.min(answer.bound);
                    if !answer.reached() {
                        continue;
                    }
                    reached += 1;
                    kept += usize::from(error <= tolerance + own);
                    held += usize::from(error <= answer.bound + own);
                    if error > answer.bound + own {
                        println!(
                            "{family} {seed} {} to {tolerance}: error {error:.1e}, bound {:.1e}, {:?}",
                            quantity.name(),
                            answer.bound,
                            answer.levels.iter().map(|level| level.counts.clone()).collect::<Vec<_>>()
                        );
                    }
                }
            }
        }
        println!(
            "{family}: {requested} requested, {reached} reached, {kept} kept, {held} held, {worse} worse, {seconds:.1} s"
        );
        let share = |some: usize| if reached > 0 { some as f64 / reached as f64 } else { f64::NAN };
        summary.note(format!("reached_{family}"), reached as f64 / requested as f64)?;
        summary.note(format!("kept_{family}"), share(kept))?;
        summary.note(format!("held_{family}"), share(held))?;
        summary.note(format!("worse_{family}"), worse as f64)?;
        summary.note(format!("seconds_{family}"), seconds)?;
    }
    Ok(())
}

/// Thin discs drawn from a seed on, blown to bubbles as high as wide and more, asked for 1 %: what is reached, and with how many matrices.
pub fn drawn_disks(count: u64, first: u64, summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let (mut reached, mut matrices) = (0.0, Vec::new());
    for seed in first..first + count {
        let mut random = Uniform(seed);
        let mut between = |low: f64, high: f64| low + (high - low) * random.next();
        let mu = between(0.5, 2.0);
        let rubber = Rubber::mooney_rivlin(0.4 * mu, 0.1 * mu, mu * 10f64.powf(between(2.5, 3.5)))?;
        let radius = between(15.0, 45.0);
        let pressure = mu / radius * between(2.0, 4.2);
        let disk = Scene::new(Block::new([0.0, 0.0], [radius, 1.0]), Axisymmetric, rubber)
            .prescribe((0, Side::Min), 0, 0.0)
            .hold((0, Side::Max))
            .pressure((1, Side::Min), pressure);
        let requested = Tolerance::of(Quantity::displacement([0.0, 0.0], 1), 0.01);
        let answer = match disk.solve_within(&requested, Budget::default()) {
            Ok(answer) => answer,
            Err(error) => {
                println!("disc {seed}: {error}");
                continue;
            }
        };
        let taken: usize = answer.levels.iter().chain(&answer.tried).map(|level| level.iterations).sum();
        println!(
            "disc {seed}: radius {radius:.1}, {:.2} µ/radius, height {:.2} radii, bound {:.2} %, {:?}, {}, {taken} iterations, {:.2} s",
            pressure * radius / mu,
            answer.values()[0] / radius,
            100.0 * answer.bound,
            answer.verdict,
            answer.choice,
            answer.seconds()
        );
        reached += f64::from(u8::from(answer.reached()));
        matrices.push(taken as f64);
    }
    summary.note("discs_reached", reached / count as f64)?;
    summary.note("discs_iterations_median", median(matrices))?;
    Ok(())
}

/// The thin disk of §6.4 to 1 % where it is blown up to a bubble: seconds of an answer, or of *not reached*.
pub fn disks(summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    for pressure in [0.1035, 0.1449, 0.17, 0.19, 0.205] {
        let rubber = Rubber::mooney_rivlin(0.5516, 0.1379, 689.5)?;
        let disk = Scene::new(Block::new([0.0, 0.0], [18.923, 0.635]), Axisymmetric, rubber)
            .prescribe((0, Side::Min), 0, 0.0)
            .hold((0, Side::Max))
            .pressure((1, Side::Min), pressure);
        let requested = Tolerance::of(Quantity::displacement([0.0, 0.0], 1), 0.01);
        let start = Instant::now();
        let answer = disk.solve_within(&requested, Budget::default())?;
        summary.note(format!("disk_{pressure}_seconds"), start.elapsed().as_secs_f64())?;
        summary.note(format!("disk_{pressure}_reached"), f64::from(u8::from(answer.reached())))?;
        println!(
            "disk at {pressure}: {:.4}, bound {:.2} %, {:?}, {} ({} models)",
            answer.values()[0],
            100.0 * answer.bound,
            answer.verdict,
            answer.choice,
            answer.levels.len()
        );
    }
    Ok(())
}

/// A clamped disc under 45 psi: its deflection at the axis in the middle of its thickness compared with fine elements, and what a tolerance
/// costs. Lengths in in, stresses in psi.
pub fn clamped(summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let middle = [0.0, 0.25];
    let disk = Scene::new(Block::new([0.0, 0.0], [7.5, 0.5]), Axisymmetric, Rubber::mooney_rivlin(80.0, 20.0, 1e5)?)
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((0, Side::Max))
        .pressure((1, Side::Min), 45.0);
    let deflection = |scheme: &Scheme| -> Result<f64, rkpm::Error> {
        let problem = disk.discretize(scheme)?;
        Ok(problem.displacement(problem.run()?.reached()?.last(), &middle.into())?[1])
    };
    let even = |counts: [usize; 2]| deflection(&Scheme::elements(2).particles(counts));
    let [coarse, reference] = [even([161, 9])?, even([241, 13])?];
    summary.note("clamped_reference", reference)?;
    summary.note("clamped_reference_change", (coarse / reference - 1.0).abs())?;
    for counts in [[81, 5], [121, 9]] {
        let name = format!("clamped_{}x{}", counts[0], counts[1]);
        summary.record(name, deflection(&Scheme::default().particles(counts))?, reference)?;
    }
    for tolerance in [0.02, 0.01] {
        let requested = Tolerance::of(Quantity::displacement(middle, 1), tolerance);
        let start = Instant::now();
        let answer = disk.solve_within(&requested, Budget::default())?;
        summary.note(format!("clamped_{tolerance}_seconds"), start.elapsed().as_secs_f64())?;
        summary.note(format!("clamped_{tolerance}_reached"), f64::from(u8::from(answer.reached())))?;
        summary.note(format!("clamped_{tolerance}_bound"), answer.bound)?;
        summary.record(format!("clamped_{tolerance}"), answer.values()[0], reference)?;
        println!("clamped disc within {tolerance}: {:?}, {}", answer.verdict, answer.choice);
        for level in answer.levels.iter().chain(&answer.tried) {
            println!(
                "  {} {:?}: {:.4}, estimate {:?}, {} iterations",
                level.functions, level.counts, level.values[0], level.estimate, level.iterations
            );
        }
    }
    Ok(())
}

/// Cases whose differences vanish by accident: error over bound, at worst over the tolerances.
pub fn accidents(summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let cook = |factor: f64, k: f64| -> Result<Scene<2>, rkpm::Error> {
        Ok(Scene::new(Quadrilateral { corners: crate::COOK }, PlaneStrain, Rubber::neo_hookean(40.097, k)?)
            .hold((0, Side::Min))
            .traction((0, Side::Max), [0.0, 6.25 * factor]))
    };
    let bonded = |width: f64| -> Result<Scene<2>, rkpm::Error> {
        Ok(Scene::new(Block::new([0.0, 0.0], [width, 10.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
            .hold((1, Side::Min))
            .prescribe((1, Side::Max), 0, 5.0)
            .prescribe((1, Side::Max), 1, 0.0))
    };
    let tip = || Quantity::displacement([48.0, 60.0], 1);
    let shear = || Quantity::reaction((1, Side::Max), 0);
    let cases = [
        ("cook", cook(1.0, 4e5)?, tip(), [58.0, 52.0]),
        ("cook_8e3", cook(1.0, 8e3)?, tip(), [58.0, 52.0]),
        ("cook_25", cook(4.0, 4e5)?, tip(), [58.0, 52.0]),
        ("block", bonded(15.0)?, shear(), [15.0, 10.0]),
        ("pad", bonded(40.0)?, shear(), [40.0, 10.0]),
    ];
    for (name, scene, quantity, sides) in cases {
        let drawn = Drawn { family: name, scene, sides, requested: vec![quantity.clone()] };
        let (exact, own) = reference(&drawn)?;
        let mut worst: f64 = 0.0;
        for scheme in [None, Some(Scheme::default())] {
            for tolerance in [0.01, 0.002, 0.001, 0.0005] {
                let requested = Tolerance::of(quantity.clone(), tolerance);
                let answer = match &scheme {
                    None => drawn.scene.solve_within(&requested, Budget::default())?,
                    Some(scheme) => drawn.scene.solve_within_by(
                        std::slice::from_ref(scheme),
                        &requested,
                        Budget::default(),
                        &mut (),
                    )?,
                };
                let error = (answer.values()[0] / exact[0] - 1.0).abs();
                println!(
                    "{name} {tolerance} {}: {:.6} error {error:.2e} bound {:.2e} (own {own:.1e}), {} unknowns, {} models, reached {}",
                    answer.levels[0].functions,
                    answer.values()[0],
                    answer.bound,
                    answer.problem.model().unknowns(),
                    answer.levels.len(),
                    answer.reached()
                );
                worst = worst.max((error - own).max(0.0) / answer.bound);
            }
        }
        summary.note(format!("accident_{name}_error_over_bound"), worst)?;
    }
    Ok(())
}
