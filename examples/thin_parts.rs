//! Parts with thin walls, drawn at random: plates, cups, rings, ribs and pockets, walls of 0.3 to 3 spacings.
//!
//! GOAL: no thin wall is wrong without a word.
//! GEOMETRY: bodies of revolution and angles, drawn as outlines (axisymmetric, plane strain) and as closed surfaces in 3D (a quarter turn
//! between planes of symmetry, a slice between fixed planes).
//! BOUNDARY: walls with both faces bonded and moved by one two-hundredth of the thickness, or with free faces and bent.
//! REFERENCE: Q2/P1 elements of the crate on a mapped block, graded towards edges and corners, 2D for both; energies. With half the elements
//! they differ by 1.9 % at most, those of the table from the limit by about 0.7 % (`CHECK=1`).
//!
//! `PARTS=60 SEED=62` are what is drawn, `FROM=30` leaves out those before it; `ACROSS=2` prints the same parts
//! with spacings of half of the wall at most.

#[path = "support/mod.rs"]
mod support;

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use rkpm::cells::Layout;
use rkpm::geometry::{Mapped, Part};
use rkpm::prelude::*;
use rkpm::scene::Problem;
use rkpm::solve::DoubtCause;
use support::Summary;

/// An error of the energy beyond which a part counts as wrong.
const RIGHT: f64 = 0.05;
/// Depth of a slice.
const DEPTH: f64 = 2.0;
/// Segments of a quarter turn.
const SEGMENTS: usize = 32;
/// Power of the distance from an edge that evenly spaced nodes of the reference are moved to.
const GRADED: f64 = 2.5;
/// Elements of the reference across a wall.
const ACROSS: usize = 16;
/// A length within which a point lies on a side.
const ON: f64 = 1e-9;

/// What happens on a side of a profile.
#[derive(Clone, Copy)]
enum Happens {
    Nothing,
    /// The axis of revolution.
    Axis,
    /// A displacement (across, along) the axis.
    Moved([f64; 2]),
    Pressed(f64),
}
use Happens::{Axis, Moved, Nothing, Pressed};

const FIXED: Happens = Moved([0.0; 2]);

/// A profile: a strip that may turn a corner, each side with its name and what happens there.
struct Drawn {
    kind: &'static str,
    thickness: f64,
    /// Corners of one long side and of the other one, from the same end.
    chains: [Vec<[f64; 2]>; 2],
    /// What happens on the pieces of the long sides, and on both ends.
    along: [Vec<Happens>; 2],
    ends: [Happens; 2],
    /// Whether it is turned around the second axis, or long.
    is_round: bool,
}

/// A side with its name.
struct Named {
    name: String,
    corners: [[f64; 2]; 2],
    happens: Happens,
}

fn rectangle(low: [f64; 2], high: [f64; 2]) -> [Vec<[f64; 2]>; 2] {
    [vec![low, [high[0], low[1]]], vec![[low[0], high[1]], high]]
}

/// A leg upwards and one along the first axis, towards it where `towards` is 1: the outer and the inner chain from the upper end on.
fn angle(corner: [f64; 2], towards: f64, [width, height]: [f64; 2], [length, base]: [f64; 2]) -> [Vec<[f64; 2]>; 2] {
    let at = |x: f64, y: f64| [corner[0] + towards * x, corner[1] + y];
    [vec![at(0.0, height), at(0.0, 0.0), at(length, 0.0)], vec![at(width, height), at(width, base), at(length, base)]]
}

impl Drawn {
    fn new(kind: usize, bonded: bool, thickness: f64, random: &mut fastrand::Rng) -> Self {
        let t = thickness;
        let (long, high) = (2.5 + random.f64(), 2.0 + random.f64());
        // Bends a plate of that radius by about a tenth of its thickness; a twentieth of the shear modulus at most.
        let pressure = |radius: f64| (2.0 * (t / radius).powi(4)).min(0.05);
        let (squeeze, bend) = (-0.005 * t, 0.05 * t.min(1.0));
        let free = |on: Happens| if bonded { on } else { Nothing };
        let only = |on: Happens| if bonded { Nothing } else { on };
        let (kind, chains, along, ends, is_round) = match kind {
            0 => {
                let along = [vec![free(FIXED)], vec![free(Moved([0.0, squeeze]))]];
                let ends = [only(Moved([0.0, bend])), only(FIXED)];
                ("plate", rectangle([1.0, 0.0], [1.0 + long, t]), along, ends, true)
            }
            1 => {
                let (radius, down) = (long + t, free(Moved([0.0, squeeze])));
                let chains = angle([radius, 0.0], -1.0, [t, high + t], [radius, t]);
                let bottom = if bonded { FIXED } else { Pressed(pressure(radius)) };
                ("cup", chains, [vec![free(FIXED), bottom], vec![down, down]], [only(FIXED), Axis], true)
            }
            2 => {
                // Along the axis: the first end is the lower one.
                let (inner, outer) = (long, long + t);
                let chains = [vec![[outer, 0.0], [outer, high]], vec![[inner, 0.0], [inner, high]]];
                let along = [vec![free(Moved([squeeze, 0.0]))], vec![free(FIXED)]];
                ("ring", chains, along, [only(FIXED), only(Moved([bend, 0.0]))], true)
            }
            3 => {
                let chains = angle([0.0; 2], 1.0, [t, high + 1.5], [t + 1.5, 1.5]);
                let aside = free(Moved([squeeze, 0.0]));
                let along = [vec![free(FIXED), FIXED], vec![aside, aside]];
                ("rib", chains, along, [only(Moved([bend, 0.0])), Nothing], false)
            }
            _ => {
                let radius = long + 1.5;
                let chains = angle([radius, 0.0], -1.0, [1.5, t + 1.5], [radius, t]);
                let bottom = if bonded { FIXED } else { Pressed(pressure(long)) };
                let down = free(Moved([0.0, squeeze]));
                let along = [vec![only(FIXED), bottom], vec![down, down]];
                ("pocket", chains, along, [Nothing, Axis], true)
            }
        };
        Drawn { kind, thickness, chains, along, ends, is_round }
    }

    /// Sides, counter-clockwise as the corners are.
    fn sides(&self) -> Vec<Named> {
        let [outer, inner] = &self.chains;
        let last = outer.len() - 1;
        let mut sides = Vec::new();
        let mut add = |name: String, corners, happens| sides.push(Named { name, corners, happens });
        (0..last).for_each(|k| add(format!("outer {k}"), [outer[k], outer[k + 1]], self.along[0][k]));
        add("last end".into(), [outer[last], inner[last]], self.ends[1]);
        (0..last).rev().for_each(|k| add(format!("inner {k}"), [inner[k + 1], inner[k]], self.along[1][k]));
        add("first end".into(), [inner[0], outer[0]], self.ends[0]);
        let area: f64 = sides.iter().map(|side| cross(side.corners[0], side.corners[1])).sum();
        if area < 0.0 {
            sides.reverse();
            sides.iter_mut().for_each(|side| side.corners.reverse());
        }
        sides
    }

    fn region(&self) -> Result<Region, rkpm::Error> {
        let sides = self.sides();
        let (last, before) = sides.split_last().expect("a profile has sides");
        let start = Outline::at(sides[0].corners[0]);
        let outline = before.iter().fold(start, |outline, side| outline.line(&side.name, side.corners[1]));
        Ok(Region::new(outline.close(&last.name))?)
    }

    /// The same as a block that is mapped, its nodes closer at edges and corners.
    fn block(&self) -> (Mapped<impl Fn(&Point<2>) -> Point<2> + Send + Sync + 'static>, Layout) {
        let ([outer, inner], legs) = (self.chains.clone(), self.chains[0].len() - 1);
        let at = |chain: &[[f64; 2]], s: f64| {
            let leg = (s.floor() as usize).min(chain.len() - 2);
            Point::<2>::from(chain[leg]).lerp(&Point::<2>::from(chain[leg + 1]), s - leg as f64)
        };
        let place = move |s: f64, q: f64| at(&outer, s).lerp(&at(&inner, s), q);
        let turned = {
            let (o, s, q) = (place(0.1, 0.1), place(0.2, 0.1), place(0.1, 0.2));
            cross((s - o).into(), (q - o).into()) < 0.0
        };
        let own = move |unit: &Point<2>| {
            let s = legs as f64 * unit[0];
            place(if turned { legs as f64 - s } else { s }, unit[1])
        };
        let half = |t: f64| 0.5 * (2.0 * t).powf(GRADED);
        let closer = move |t: f64| if t < 0.5 { half(t) } else { 1.0 - half(1.0 - t) };
        let layout = move |axis: usize, t: f64| {
            if axis == 1 {
                return closer(t);
            }
            let s = legs as f64 * t;
            let leg = s.floor().min((legs - 1) as f64);
            (leg + closer(s - leg)) / legs as f64
        };
        (Mapped(own), Layout::Graded(Arc::new(layout)))
    }

    /// The energy by quadratic elements, so many across and four times as many along each leg.
    fn by_elements(&self, across: usize) -> Result<f64, rkpm::Error> {
        let (block, layout) = self.block();
        let mut scene = match self.is_round {
            true => Scene::new(block, Axisymmetric, rubber()?),
            false => Scene::new(block, PlaneStrain, rubber()?),
        };
        for side in self.sides() {
            let [a, b] = side.corners.map(Point::<2>::from);
            let on_side = move |x: &Point<2>| {
                let (along, off) = (b - a, x - a);
                let share = (along.dot(&off) / along.norm_squared()).clamp(0.0, 1.0);
                (off - along * share).norm() < ON
            };
            scene = happens(scene, Place::on(Part::Whole).within(on_side), side.happens);
        }
        let legs = self.chains[0].len() - 1;
        let scheme = Scheme::elements(2).particles([8 * across * legs + 1, 2 * across + 1]).layout(layout);
        Ok(energy(&scene.discretize(&scheme)?)?.energy)
    }

    fn outlined(&self) -> Result<Scene<2>, rkpm::Error> {
        let region = self.region()?;
        let scene = match self.is_round {
            true => Scene::new(region, Axisymmetric, rubber()?),
            false => Scene::new(region, PlaneStrain, rubber()?),
        };
        let sides = self.sides().into_iter();
        Ok(sides.fold(scene, |scene, side| happens(scene, side.name.as_str().into(), side.happens)))
    }

    /// A quarter turn, or a slice two spacings deep, between planes of symmetry.
    fn in_3d(&self) -> Result<Scene<3>, rkpm::Error> {
        let solid = self.solid()?;
        let mut scene = Scene::new(&solid, Solid, rubber()?);
        let planes = if self.is_round { [1, 0] } else { [2, 2] };
        for (plane, component) in planes.into_iter().enumerate() {
            scene = scene.prescribe(format!("plane {plane}"), component, 0.0);
        }
        for side in self.sides() {
            scene = match side.happens {
                Nothing | Axis => scene,
                Pressed(pressure) => scene.pressure(side.name.as_str(), pressure),
                Moved([across, along]) if self.is_round => {
                    let value = Value::field(move |x: &Point<3>| {
                        let r = x[0].hypot(x[1]);
                        [across * x[0] / r, across * x[1] / r, along]
                    });
                    scene.with(Condition::on(side.name.as_str()).displacement(value))
                }
                Moved([x, y]) => scene.with(Condition::on(side.name.as_str()).displacement([x, y, 0.0])),
            };
        }
        Ok(scene)
    }

    fn solid(&self) -> Result<Solid3, rkpm::Error> {
        let (sides, steps) = (self.sides(), if self.is_round { SEGMENTS } else { 1 });
        let corners: Vec<[f64; 2]> = sides.iter().map(|side| side.corners[0]).collect();
        let mut points: Vec<Point<3>> = Vec::new();
        let mut known: Vec<Vec<u32>> = Vec::new();
        for step in 0..=steps {
            let share = step as f64 / steps as f64;
            let (sin, cos) = (FRAC_PI_2 * share).sin_cos();
            let mut row = Vec::new();
            for (k, [x, y]) in corners.iter().copied().enumerate() {
                if self.is_round && x == 0.0 && step > 0 {
                    row.push(known[0][k]);
                    continue;
                }
                row.push(points.len() as u32);
                points.push(if self.is_round {
                    Point::<3>::new(x * cos, x * sin, y)
                } else {
                    Point::<3>::new(x, y, DEPTH * share)
                });
            }
            known.push(row);
        }
        let mut facets: Vec<[u32; 3]> = Vec::new();
        let mut names: Vec<(String, Vec<u32>)> = Vec::new();
        let mut add = |name: &str, triangles: &[[u32; 3]], turned: bool| {
            for &[a, b, c] in triangles.iter().filter(|[a, b, c]| a != b && b != c && c != a) {
                match names.iter_mut().find(|named| named.0 == name) {
                    Some(named) => named.1.push(facets.len() as u32),
                    None => names.push((name.to_string(), vec![facets.len() as u32])),
                }
                facets.push(if turned { [a, c, b] } else { [a, b, c] });
            }
        };
        for step in 0..steps {
            for (k, side) in sides.iter().enumerate() {
                let next = (k + 1) % sides.len();
                let [a, b, c, d] = [known[step][k], known[step + 1][k], known[step + 1][next], known[step][next]];
                if !matches!(side.happens, Axis) {
                    add(&side.name, &[[a, b, c], [a, c, d]], !self.is_round);
                }
            }
        }
        for (plane, row) in [&known[0], &known[steps]].into_iter().enumerate() {
            let of = |corner: [f64; 2]| row[corners.iter().position(|own| *own == corner).expect("a corner")];
            let [outer, inner] = &self.chains;
            for k in 0..outer.len() - 1 {
                let quad = [outer[k], outer[k + 1], inner[k + 1], inner[k]];
                let area: f64 = (0..4).map(|i| cross(quad[i], quad[(i + 1) % 4])).sum();
                let [a, b, c, d] = quad.map(of);
                // The first plane of a turn looks against it, that of a slice downwards.
                let turned = (area < 0.0) != ((plane == 1) == self.is_round);
                add(&format!("plane {plane}"), &[[a, b, c], [a, c, d]], turned);
            }
        }
        let solid = Solid3::new(points, facets)?;
        Ok(names.into_iter().try_fold(solid, |solid, (name, own)| solid.name(&name, Select::facets(own)))?)
    }

    /// The energy of particles a spacing apart, their number and the iterations, by a wish for so many spacings across.
    fn by_particles(&self, in_3d: bool, across: usize) -> Result<Found, rkpm::Error> {
        let scheme = Scheme::default().spacing(1.0);
        if in_3d {
            let found = energy(&self.in_3d()?.discretize(&scheme.across(across))?)?;
            let energy = if self.is_round { 4.0 * found.energy } else { found.energy / DEPTH };
            return Ok(Found { energy, ..found });
        }
        let least = (self.thickness / across as f64).min(1.0);
        energy(&self.outlined()?.discretize(&scheme.spacing(least))?)
    }
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn rubber() -> Result<Rubber, rkpm::Error> {
    Ok(Rubber::neo_hookean(0.5, 1e3)?)
}

fn happens(scene: Scene<2>, place: Place<2>, what: Happens) -> Scene<2> {
    match what {
        Nothing => scene,
        Axis => scene.prescribe(place, 0, 0.0),
        Moved(displacement) => scene.with(Condition::on(place).displacement(displacement)),
        Pressed(pressure) => scene.pressure(place, pressure),
    }
}

/// What a run gives, and what it says of thin walls.
struct Found {
    energy: f64,
    particles: usize,
    iterations: usize,
    told: Option<String>,
}

fn energy<const D: usize>(problem: &Problem<D>) -> Result<Found, rkpm::Error> {
    let path = problem.run()?.completed()?;
    let told = problem.verdict(&path)?.into_iter().find(|doubt| matches!(doubt.cause, DoubtCause::ThinWall { .. }));
    Ok(Found {
        energy: problem.energy(path.last())?,
        particles: problem.cells().positions().len(),
        iterations: path.iterations,
        told: told.map(|doubt| doubt.to_string()),
    })
}

fn number(name: &str) -> Option<usize> {
    std::env::var(name).ok().and_then(|value| value.parse().ok())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let out = support::out_dir("thin_parts");
    let (count, seed, across) =
        (number("PARTS").unwrap_or(60), number("SEED").unwrap_or(62), number("ACROSS").unwrap_or(0));
    let mut random = fastrand::Rng::with_seed(seed as u64);
    let [mut right, mut silent, mut errors] = [0; 3];
    let mut worst: f64 = 0.0;
    for k in 0..count {
        let (kind, bonded, in_3d) = (k % 5, k / 5 % 2 == 0, k / 10 % 2 == 1);
        let thickness = 0.3 * 10f64.powf(random.f64());
        let part = Drawn::new(kind, bonded, thickness, &mut random);
        if number("FROM").is_some_and(|from| k < from) {
            continue;
        }
        let reference = part.by_elements(ACROSS)?;
        let faces = if bonded { "bonded" } else { "free" };
        print!("{k:3} {:6} {faces:6} {} t {thickness:.2}: ", part.kind, if in_3d { "3D" } else { "2D" });
        if number("CHECK").is_some() {
            let error = part.by_elements(ACROSS / 2)? / reference - 1.0;
            worst = worst.max(error.abs());
            println!("{:+.2} % with half the elements", 100.0 * error);
            continue;
        }
        match part.by_particles(in_3d, across) {
            Ok(Found { energy, particles, iterations, told }) => {
                let error = energy / reference - 1.0;
                *match told {
                    _ if error.abs() < RIGHT => &mut right,
                    Some(_) => &mut errors,
                    None => &mut silent,
                } += 1;
                println!("{:+.1} %, {particles} particles, {iterations} iterations", 100.0 * error);
                told.iter().for_each(|told| println!("    {told}"));
            }
            Err(error) => {
                errors += 1;
                println!("{error}");
            }
        }
    }
    if number("CHECK").is_some() {
        println!("half the elements differ by {:.2} % at most", 100.0 * worst);
        return Ok(());
    }
    let mut summary = Summary::new();
    summary.note("thin_right", f64::from(right))?;
    summary.note("thin_silent", f64::from(silent))?;
    summary.note("thin_errors", f64::from(errors))?;
    print!("{summary}");
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
