//! Parts without a mesher: drawn solids at drawn angles in lattices that their surfaces cut, with the laws that a discretisation keeps;
//! a block in a lattice turned under it; a bonded bush against closed forms.
//!
//! `cargo run --release --example cut_parts [-- --out DIR]` writes `summary.csv`: of 30 solids, or as many as the
//! variable `SOLIDS` says, drawn from seed 33, or what `SEED` says, the largest error of volume and patch test, the least θ and inf-sup
//! constant, the least of those below 0.15 over that of a finer lattice, and the part of them that is pressed by a quarter and sheared by 0.3;
//! errors and spreads are parts of one. Volume, patch test and θ of a tenth as many in refined lattices have rows of their own.
//! Parts with thin walls: `thin_parts`. `BORES=12` prints, in place of all this, the seconds that as many drawn plates with bores narrower than a
//! spacing take to discretise.

mod support;

use std::error::Error;
use std::f64::consts::TAU;
use std::sync::Arc;

use rkpm::cells::CutLattice;
use rkpm::check::{inf_sup, patch_test, spurious_modes};
use rkpm::nalgebra::{Matrix3, Rotation3, Vector3};
use rkpm::prelude::*;
use support::Summary;

type Surface = (Vec<Point<3>>, Vec<[u32; 3]>);

/// Particles of a drawn solid that the spacing is chosen for; with those on its surface it has twice as many.
const PARTICLES: f64 = 120.0;

/// Inf-sup constant below which that of a finer lattice is looked at as well, and its spacing.
const BOUND: f64 = 0.15;
const FINER: f64 = 0.75;

fn random_rotation(random: &mut fastrand::Rng) -> Matrix3<f64> {
    let axis = loop {
        let draw = Vector3::from_fn(|_, _| 2.0 * random.f64() - 1.0);
        if draw.norm() < 1.0 && draw.norm() > 0.1 {
            break draw.normalize();
        }
    };
    *Rotation3::from_scaled_axis(axis * (TAU * random.f64())).matrix()
}

/// A closed strip of sections around an axis: points of a closed line in the half plane, swept through a turn.
fn revolved(line: &[[f64; 2]], count: usize) -> Surface {
    let at = |k: usize, angle: f64| {
        let [r, z] = line[k];
        Point::<3>::new(r * angle.cos(), r * angle.sin(), z)
    };
    let rows = line.len();
    let points = (0..count).flat_map(|s| (0..rows).map(move |k| (s, k)));
    let points = points.map(|(s, k)| at(k, TAU * s as f64 / count as f64)).collect();
    let number = |s: usize, k: usize| ((s % count) * rows + k % rows) as u32;
    let quads = (0..count).flat_map(|s| (0..rows).map(move |k| (s, k)));
    let facets = quads.flat_map(|(s, k)| {
        let [a, b, c, d] = [number(s, k), number(s + 1, k), number(s + 1, k + 1), number(s, k + 1)];
        [[a, b, c], [a, c, d]]
    });
    (points, facets.collect())
}

/// A wheel of a height between a bore and an outline around it.
fn wheel(outline: impl Fn(f64) -> f64, bore: f64, height: f64, count: usize) -> Surface {
    let (mut points, mut facets) = (Vec::new(), Vec::new());
    for s in 0..count {
        let angle = TAU * s as f64 / count as f64;
        for (radius, z) in [(bore, 0.0), (outline(angle), 0.0), (outline(angle), height), (bore, height)] {
            points.push(Point::<3>::new(radius * angle.cos(), radius * angle.sin(), z));
        }
    }
    let number = |s: usize, k: usize| ((s % count) * 4 + k % 4) as u32;
    for s in 0..count {
        for k in 0..4 {
            let [a, b, c, d] = [number(s, k), number(s + 1, k), number(s + 1, k + 1), number(s, k + 1)];
            facets.extend([[a, b, c], [a, c, d]]);
        }
    }
    (points, facets)
}

/// Boxes of a drawn grid, joined by their faces.
fn boxes(random: &mut fastrand::Rng) -> Surface {
    const SIDE: usize = 3;
    let lines: [Vec<f64>; 3] = std::array::from_fn(|_| {
        let mut at = 0.0;
        let widths = (0..SIDE).map(|_| 0.5 + 0.5 * random.f64());
        std::iter::once(0.0)
            .chain(widths.map(|width| {
                at += width;
                at
            }))
            .collect()
    });
    let mut filled = [[[false; SIDE]; SIDE]; SIDE];
    let mut place = [1usize; 3];
    for _ in 0..12 {
        filled[place[0]][place[1]][place[2]] = true;
        let axis = random.usize(0..3);
        place[axis] = if random.bool() { (place[axis] + 1).min(SIDE - 1) } else { place[axis].saturating_sub(1) };
    }
    let is_filled = |at: [i64; 3]| {
        at.iter().all(|x| (0..SIDE as i64).contains(x)) && filled[at[0] as usize][at[1] as usize][at[2] as usize]
    };
    let (mut points, mut facets) = (Vec::new(), Vec::new());
    for cell in 0..(SIDE * SIDE * SIDE) as i64 {
        let at = [cell % 3, cell / 3 % 3, cell / 9];
        for (axis, step) in (0..3).flat_map(|axis| [(axis, -1), (axis, 1)]) {
            let mut beyond = at;
            beyond[axis] += step;
            if !is_filled(at) || is_filled(beyond) {
                continue;
            }
            let first = points.len() as u32;
            for [b, c] in [[0, 0], [1, 0], [1, 1], [0, 1]] {
                let mut corner = at;
                corner[axis] += (step + 1) / 2;
                corner[(axis + 1) % 3] += b;
                corner[(axis + 2) % 3] += c;
                points.push(Point::<3>::from_fn(|i, _| lines[i][corner[i] as usize]));
            }
            let quad = if step > 0 { [0, 1, 2, 3] } else { [0, 3, 2, 1] };
            facets.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k| first + quad[k])));
        }
    }
    (points, facets)
}

/// A drawn solid at a drawn angle and place.
fn drawn(random: &mut fastrand::Rng) -> Solid3 {
    loop {
        let [size, height, share] =
            [[0.8, 1.2], [0.6, 1.6], [0.3, 0.5]].map(|[low, high]| low + (high - low) * random.f64());
        let count = 48;
        let (mut points, facets) = match random.usize(0..5) {
            0 => boxes(random),
            // A gear with a bore, its teeth as wide as its slots.
            1 => {
                let teeth = random.usize(5..9) as f64;
                let steep = |angle: f64| (4.0 * (teeth * angle).sin()).clamp(-1.0, 1.0);
                wheel(|angle| size * (1.0 + 0.15 * steep(angle)), size * share, 0.6 * height, 96)
            }
            // A torus.
            2 => {
                let tube = |k: usize| TAU * k as f64 / 24.0;
                let line: Vec<[f64; 2]> =
                    (0..24).map(|k| [size + size * share * tube(k).cos(), size * share * tube(k).sin()]).collect();
                revolved(&line, count)
            }
            // A tube that widens.
            3 => revolved(
                &[[size * share, 0.0], [size, 0.0], [size * (1.3 - share), height], [size * 0.2, height]],
                count,
            ),
            // A flat prism of few sides with a bore.
            _ => {
                let sides = random.usize(3..7) as f64;
                let angle = move |a: f64| (a * sides / TAU).fract() * TAU / sides - TAU / 2.0 / sides;
                wheel(|a| size * (TAU / 2.0 / sides).cos() / angle(a).cos(), 0.3 * size, 0.5 * height, 60)
            }
        };
        let (turn, shift) = (random_rotation(random), Vector3::from_fn(|_, _| random.f64()));
        points.iter_mut().for_each(|x| *x = turn * *x + shift);
        // Boxes that touch along an edge alone are no solid.
        if let Ok(solid) = Solid3::new(points, facets) {
            return solid;
        }
    }
}

fn rubber(bulk: f64) -> Result<impl Material + 'static, rkpm::Error> {
    Ok(Rubber::neo_hookean(0.5, bulk)?)
}

/// Pressed by a quarter between slices of 15 % at its ends, or sheared by 0.3.
fn loaded(solid: &Solid3, scheme: &Scheme, shear: bool) -> Result<bool, rkpm::Error> {
    let Block { min, max } = solid.bounds();
    let height = max[2] - min[2];
    let [low, high] = [min[2] + 0.15 * height, max[2] - 0.15 * height];
    let moved = if shear { [0.3 * (high - low), 0.0, 0.0] } else { [0.0, 0.0, -0.25 * (high - low)] };
    let scene = Scene::new(solid, Solid, rubber(1e3)?)
        .hold(Place::from(Part::Whole).within(move |x| x[2] < low))
        .with(Condition::on(Place::from(Part::Whole).within(move |x| x[2] > high)).displacement(moved));
    // Whether the run reaches its last load: `completed` refuses solids this coarse.
    Ok(scene.discretize(scheme)?.run()?.reached().is_ok())
}

fn solids(count: usize, summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let seed = std::env::var("SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(33);
    let mut random = fastrand::Rng::with_seed(seed);
    let gradient = Matrix3::new(0.1, 0.05, -0.03, 0.02, -0.08, 0.04, 0.06, -0.02, 0.05);
    let (mut volume, mut patch) = (0.0f64, 0.0f64);
    let [mut theta, mut beta, mut kept] = [f64::INFINITY; 3];
    let (mut refused, mut completed) = (0, 0);
    for number in 0..count {
        let solid = drawn(&mut random);
        let spacing = (solid.volume() / PARTICLES).cbrt();
        let scheme = Scheme::default().spacing(spacing);
        let measured = || -> Result<[f64; 6], rkpm::Error> {
            let cells = Arc::new(CutLattice::new(&solid, spacing)?);
            let particles = cells.positions().len() as f64;
            let found: f64 = cells.smoothing(2, 2, &cells.zones(2))?.volumes().iter().sum();
            let scene =
                |bulk: f64| Ok::<_, rkpm::Error>(Scene::new(Geometry::cells(cells.clone()), Solid, rubber(bulk)?));
            let patch = patch_test(&scene(1e3)?, &gradient, &scheme)?.error;
            let theta = spurious_modes(&scene(5.0 / 3.0)?, &scheme)?.smallest;
            let beta = inf_sup(&scene(1e3)?, &scheme)?.constant;
            // That of slender solids is small whatever the lattice: beside it stands that of a finer one.
            let kept = match beta < BOUND {
                true => {
                    let fine = Arc::new(CutLattice::new(&solid, FINER * spacing)?);
                    let scene = Scene::new(Geometry::cells(fine), Solid, rubber(1e3)?);
                    beta / inf_sup(&scene, &Scheme::default())?.constant
                }
                false => 1.0,
            };
            Ok([particles, (found / solid.volume() - 1.0).abs(), patch, theta, beta, kept])
        };
        match measured() {
            Ok(own) => {
                println!(
                    "{number:4}: {:4} particles, volume {:.1e}, patch {:.1e}, θ {:.3}, β {:.3}, {:.2} of that of a finer lattice",
                    own[0], own[1], own[2], own[3], own[4], own[5]
                );
                (volume, patch) = (volume.max(own[1]), patch.max(own[2]));
                (theta, beta, kept) = (theta.min(own[3]), beta.min(own[4]), kept.min(own[5]));
            }
            Err(error) => {
                println!("{number:4}: {error}");
                refused += 1;
            }
        }
        let reached = [false, true].map(|shear| loaded(&solid, &scheme, shear).unwrap_or(false));
        completed += reached.iter().filter(|reached| **reached).count();
        if reached != [true; 2] {
            println!("      pressed and sheared to the end: {reached:?}");
        }
    }
    summary.note("volume_worst", volume)?;
    summary.note("patch_worst", patch)?;
    summary.note("theta_least", theta)?;
    summary.note("infsup_least", beta)?;
    summary.note("infsup_kept_least", kept)?;
    summary.note("completed", completed as f64 / (2 * count) as f64)?;
    summary.note("refused", f64::from(refused))?;
    Ok(())
}

/// Drawn solids in lattices of half the particles, refined where walls are thinner than a spacing, and where a field that is drawn asks
/// for a quarter of the spacing around a point of the surface.
fn refined(count: usize, summary: &mut Summary) -> Result<(), Box<dyn Error>> {
    let seed = std::env::var("SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(33);
    let mut random = fastrand::Rng::with_seed(seed);
    let gradient = Matrix3::new(0.1, 0.05, -0.03, 0.02, -0.08, 0.04, 0.06, -0.02, 0.05);
    let (mut volume, mut patch, mut theta, mut refused) = (0.0f64, 0.0f64, f64::INFINITY, 0);
    for number in 0..count {
        let solid = drawn(&mut random);
        let spacing = (2.0 * solid.volume() / PARTICLES).cbrt();
        let centre = solid.vertices()[random.usize(0..solid.vertices().len())];
        let slope = 0.3 + 0.3 * random.f64();
        let field = move |x: &Point<3>| (slope * (x - centre).norm() / spacing).clamp(0.25, 1.0);
        for by_field in [false, true] {
            let measured = || -> Result<[f64; 5], rkpm::Error> {
                let cells = match by_field {
                    true => CutLattice::refined(&solid, spacing, 1, field)?,
                    false => CutLattice::refined(&solid, spacing, 1, |_| 1.0)?,
                };
                let spacings = (0..cells.positions().len()).map(|particle| cells.spacings(particle)[0]);
                let [particles, least] = [cells.positions().len() as f64, spacings.fold(f64::INFINITY, f64::min)];
                let cells = Arc::new(cells);
                let found: f64 = cells.smoothing(2, 2, &cells.zones(2))?.volumes().iter().sum();
                let scene =
                    |bulk: f64| Ok::<_, rkpm::Error>(Scene::new(Geometry::cells(cells.clone()), Solid, rubber(bulk)?));
                let patch = patch_test(&scene(1e3)?, &gradient, &Scheme::default())?.error;
                let theta = spurious_modes(&scene(5.0 / 3.0)?, &Scheme::default())?.smallest;
                Ok([particles, spacing / least, (found / solid.volume() - 1.0).abs(), patch, theta])
            };
            let by = if by_field { "by a field" } else { "by thickness" };
            match measured() {
                Ok(own) => {
                    println!(
                        "{number:4}, {by}: {:4} particles, halved to 1/{:.0}, volume {:.1e}, patch {:.1e}, θ {:.3}",
                        own[0], own[1], own[2], own[3], own[4]
                    );
                    (volume, patch, theta) = (volume.max(own[2]), patch.max(own[3]), theta.min(own[4]));
                }
                Err(error) => {
                    println!("{number:4}, {by}: {error}");
                    refused += 1;
                }
            }
        }
    }
    summary.note("refined_volume_worst", volume)?;
    summary.note("refined_patch_worst", patch)?;
    summary.note("refined_theta_least", theta)?;
    summary.note("refined_refused", f64::from(refused))?;
    Ok(())
}

/// A cylinder bonded at its ends and pressed by a tenth: its force in lattices that are turned under it.
fn turned(across: usize, draws: usize) -> Result<f64, rkpm::Error> {
    let mut random = fastrand::Rng::with_seed(8);
    let (points, facets) = wheel(|_| 0.5, 0.15, 1.0, 64);
    let solid = Solid3::new(points, facets)?
        .name("base", Select::plane([0.0; 3], [0.0, 0.0, -1.0]))?
        .name("top", Select::plane([0.0, 0.0, 1.0], [0.0, 0.0, 1.0]))?;
    let spacing = 1.0 / (across - 1) as f64;
    let mut forces = Vec::new();
    for _ in 0..draws {
        let cells = CutLattice::with_axes(&solid, spacing, random_rotation(&mut random))?;
        let scene = Scene::new(Geometry::cells(Arc::new(cells)), Solid, rubber(1e3)?)
            .hold("base")
            .with(Condition::on("top").displacement([0.0, 0.0, -0.1]).named("top"));
        let problem = scene.discretize(&Scheme::default())?;
        let path = problem.run()?.completed()?;
        forces.push(problem.reaction(path.last(), "top")?[2]);
    }
    let mean = forces.iter().sum::<f64>() / forces.len() as f64;
    Ok(forces.iter().map(|force| (force / mean - 1.0).abs()).fold(0.0, f64::max))
}

/// A bush of radii 1 and 2 bonded to its insert and its sleeve, the insert turned or pushed; on the ends displacements are those of the
/// closed forms. Errors of the energy of an incompressible neo-Hookean bush, $2\pi\mu L\psi^2/(a^{-2} - b^{-2})$ and
/// $\pi\mu L d^2/\ln(b/a)$.
fn bush(axial: bool, spacing: f64) -> Result<[f64; 2], rkpm::Error> {
    const TURN: f64 = 0.1;
    let (points, facets) = wheel(|_| 2.0, 1.0, 1.0, 192);
    let solid = Solid3::new(points, facets)?;
    let exact = move |x: &Point<3>| {
        let radius = x[0].hypot(x[1]);
        if axial {
            return [0.0, 0.0, TURN * (radius / 2.0).ln() / 0.5f64.ln()];
        }
        let angle = TURN * (radius.powi(-2) - 0.25) / 0.75;
        let (sine, cosine) = angle.sin_cos();
        [x[0] * (cosine - 1.0) - x[1] * sine, x[0] * sine + x[1] * (cosine - 1.0), 0.0]
    };
    let scene = (0..3).fold(Scene::new(&solid, Solid, rubber(1e4)?), |scene, component| {
        scene.prescribe(Part::Whole, component, Value::field(move |x: &Point<3>| exact(x)[component]))
    });
    let problem = scene.discretize(&Scheme::default().spacing(spacing))?;
    let path = problem.run()?.completed()?;
    let closed = if axial { TAU / 2.0 * TURN * TURN / 2f64.ln() } else { TAU * TURN * TURN / 0.75 };
    Ok([problem.energy(path.last())? / closed - 1.0, problem.cells().positions().len() as f64])
}

/// Plates of random sizes with four to sixteen bores of 0.4 to 0.9 spacings: the seconds of a discretisation.
fn bores(count: usize) -> Result<(), rkpm::Error> {
    const SPACING: f64 = 0.5;
    let mut random = fastrand::Rng::with_seed(41);
    for number in 0..count {
        let [across, along] = [random.usize(2..5), random.usize(2..5)];
        let thickness = 0.5 + random.f64();
        let mut plate = Shape::block([0.0; 3], [across as f64, along as f64, thickness]);
        for k in 0..across * along {
            let radius = SPACING * (0.2 + 0.25 * random.f64());
            let place = |k: usize, shift: f64| k as f64 + 0.5 + 0.4 * (shift - 0.5);
            let [x, y] = [place(k % across, random.f64()), place(k / across, random.f64())];
            plate = plate.minus(Shape::cylinder([x, y, -1.0], [x, y, thickness + 1.0], radius));
        }
        let solid = plate.solid(0.04)?.name("low", Select::plane([0.0; 3], [0.0, 0.0, -1.0]))?;
        let scene = Scene::new(&solid, Solid, rubber(1e3)?).hold("low");
        let clock = std::time::Instant::now();
        let problem = scene.discretize(&Scheme::default().spacing(SPACING))?;
        let (seconds, particles) = (clock.elapsed().as_secs_f64(), problem.cells().positions().len());
        println!("{number:3}: {:2} bores, {particles:4} particles, {seconds:5.2} s", across * along);
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    if let Some(count) = std::env::var("BORES").ok().and_then(|count| count.parse().ok()) {
        return Ok(bores(count)?);
    }
    let out = support::out_dir("cut_parts");
    let count = std::env::var("SOLIDS").ok().and_then(|count| count.parse().ok()).unwrap_or(30);
    let mut summary = Summary::new();
    solids(count, &mut summary)?;
    refined(count.div_ceil(10), &mut summary)?;
    for (name, axial) in [("bush_torsion_error", false), ("bush_axial_error", true)] {
        let [error, particles] = bush(axial, 0.15)?;
        println!("{name}: {error:.2e} with {particles} particles");
        summary.note(name, error.abs())?;
    }
    for across in [8, 16] {
        let spread = turned(across, 20.min(count))?;
        println!("turned lattices, {across} across: {spread:.2e}");
        summary.note(format!("turned_spread_{across}"), spread)?;
    }
    summary.write(out.join("summary.csv"))?;
    Ok(())
}
