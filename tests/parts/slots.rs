//! Slots narrower than the distance between particles: functions do not reach across, so that they open as they do where half a body is
//! taken by symmetry.

use std::sync::Arc;

use approx::abs_diff_eq;
use rkpm::cells::CutLattice;
use rkpm::check::{patch_test, spurious_modes};
use rkpm::mesh::{CellShape, Mesh};
use rkpm::nalgebra::{Matrix2, Matrix3, Rotation3, Vector3};
use rkpm::prelude::*;

/// A fiftieth of a square, a fifth of the distance between particles.
const WIDTH: f64 = 0.02;
const ROOT: f64 = 0.25;
const SPACING: f64 = 0.125;
const TRACTION: f64 = 0.02;

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 500.0).unwrap()
}

/// A unit square with a slot from the middle of its upper side down, or its right half.
fn square(whole: bool) -> Region {
    let right = 0.5 + WIDTH / 2.0;
    let outline = if whole {
        Outline::at([0.0, 0.0])
            .line("base", [1.0, 0.0])
            .line("right", [1.0, 1.0])
            .line("top", [right, 1.0])
            .line("slot", [right, ROOT])
            .line("slot", [1.0 - right, ROOT])
            .line("slot", [1.0 - right, 1.0])
            .line("top", [0.0, 1.0])
            .close("left")
    } else {
        Outline::at([0.5, 0.0])
            .line("base", [1.0, 0.0])
            .line("right", [1.0, 1.0])
            .line("top", [right, 1.0])
            .line("slot", [right, ROOT])
            .line("slot", [0.5, ROOT])
            .close("middle")
    };
    Region::new(outline).unwrap()
}

#[test]
fn slots_of_regions_open() {
    let opened = |whole: bool| {
        let scene = Scene::new(square(whole), PlaneStrain, rubber()).hold("base").traction("right", [TRACTION, 0.0]);
        let scene = if whole { scene.traction("left", [-TRACTION, 0.0]) } else { scene.prescribe("middle", 0, 0.0) };
        let problem = scene.discretize(&Scheme::default().spacing(SPACING)).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let at = |x: f64| problem.displacement(path.last(), &[x, 1.0].into()).unwrap()[0];
        let right = 0.5 + WIDTH / 2.0;
        if whole { at(right) - at(1.0 - right) } else { 2.0 * at(right) }
    };
    let (slot, half) = (opened(true), opened(false));
    println!("region {slot:.6}, half {half:.6}");
    // Supports that reach across leave a tenth of the opening. At the root particles of both sides see each other, and are few.
    assert!(abs_diff_eq!(slot / half, 1.0, epsilon = 0.1), "{slot:.3e}, by symmetry {half:.3e}");
    let whole = Scene::new(square(true), PlaneStrain, rubber());
    let test = patch_test(&whole, &Matrix2::new(0.2, 0.1, -0.05, -0.1), &Scheme::default().spacing(SPACING));
    assert!(test.unwrap().error < 1e-11);
}

/// A split ring of radii 16 and 20 whose ends, 0.2 apart, are moved away from each other, or half of it: spacings ten and five times the slot.
#[test]
fn split_rings_open() {
    let force = |whole: bool, spacing: f64| {
        let at = |radius: f64, side: f64| [0.1 * side, (radius * radius - 0.01f64).sqrt()];
        let outline = if whole {
            Outline::at(at(16.0, 1.0))
                .arc("inner", at(16.0, -1.0), [0.0, 0.0], Turn::Right)
                .line("left", at(20.0, -1.0))
                .arc("outer", at(20.0, 1.0), [0.0, 0.0], Turn::Left)
                .close("right")
        } else {
            Outline::at([0.0, -20.0])
                .arc("outer", at(20.0, 1.0), [0.0, 0.0], Turn::Left)
                .line("right", at(16.0, 1.0))
                .arc("inner", [0.0, -16.0], [0.0, 0.0], Turn::Right)
                .close("middle")
        };
        let scene = Scene::new(Region::new(outline).unwrap(), PlaneStrain, rubber());
        let scene = scene.with(Condition::on("right").displacement([2.0, 0.0]));
        let scene = if whole {
            scene.with(Condition::on("left").displacement([-2.0, 0.0]))
        } else {
            scene.prescribe("middle", 0, 0.0)
        };
        let problem = scene.discretize(&Scheme::default().spacing(spacing)).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        problem.reaction(path.last(), "right").unwrap()[0]
    };
    for spacing in [2.0, 1.0] {
        let (ring, half) = (force(true, spacing), force(false, spacing));
        println!("spacing {spacing}: {ring:.6}, half {half:.6}");
        assert!(abs_diff_eq!(ring / half, 1.0, epsilon = 0.01), "{ring:.3e}, by symmetry {half:.3e}");
    }
}

/// A mapped block bent to a ring of radii 16 and 20, whose ends stand 0.2 apart and are moved away from each other, or half of it.
#[test]
fn ends_of_a_bent_block_open() {
    let force = |whole: bool| {
        let [from, to] = [0.1 / 18.0, if whole { std::f64::consts::TAU - 0.1 / 18.0 } else { std::f64::consts::PI }];
        let ring = Mapped(move |unit: &Point<2>| {
            let angle = from + (to - from) * unit[0];
            (16.0 + 4.0 * unit[1]) * Point::<2>::new(angle.sin(), angle.cos())
        });
        let scene = Scene::new(ring, PlaneStrain, rubber()).with(Condition::on(Side::Min).displacement([1.0, 0.0]));
        let scene = if whole {
            scene.with(Condition::on(Side::Max).displacement([-1.0, 0.0]))
        } else {
            scene.prescribe(Side::Max, 0, 0.0)
        };
        let problem = scene.discretize(&Scheme::default().particles([if whole { 65 } else { 33 }, 5])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        problem.reaction(path.last(), Side::Min).unwrap()[0]
    };
    let (ring, half) = (force(true), force(false));
    println!("bent block {ring:.6}, half {half:.6}");
    assert!(abs_diff_eq!(ring / half, 1.0, epsilon = 0.01), "{ring:.3e}, by symmetry {half:.3e}");
}

/// The square of hexahedra, half as thick, with particles on both sides of the slot.
fn hexahedra(whole: bool) -> Mesh<3> {
    const N: usize = 8;
    let rows = N + 1;
    let layers = N / 2 + 1;
    let (mut points, mut cells) = (Vec::new(), Vec::new());
    let halves: &[f64] = if whole { &[-1.0, 1.0] } else { &[1.0] };
    for side in halves {
        for k in 0..layers {
            for j in 0..rows {
                for i in 0..layers {
                    let y = j as f64 / N as f64;
                    let inner = if y > ROOT + 1e-9 || (y > ROOT - 1e-9 && i > 0) { WIDTH / 2.0 } else { 0.0 };
                    let x = inner + (0.5 - inner) * i as f64 / (layers - 1) as f64;
                    points.push([0.5 + side * x, y, k as f64 / N as f64]);
                }
            }
        }
    }
    let at = |side: usize, i: usize, j: usize, k: usize| -> usize {
        // Below the root both halves have the same particles on the plane between.
        let side = if i == 0 && j as f64 / N as f64 <= ROOT { 0 } else { side };
        ((side * layers + k) * rows + j) * layers + i
    };
    for side in 0..halves.len() {
        for k in 0..layers - 1 {
            for j in 0..N {
                for i in 0..layers - 1 {
                    // From left to right on both sides.
                    let [a, b] = if whole && side == 0 { [i + 1, i] } else { [i, i + 1] };
                    for k in [k, k + 1] {
                        cells.extend([
                            at(side, a, j, k),
                            at(side, b, j, k),
                            at(side, b, j + 1, k),
                            at(side, a, j + 1, k),
                        ]);
                    }
                }
            }
        }
    }
    let mut used = vec![usize::MAX; points.len()];
    let mut kept = Vec::new();
    for corner in &mut cells {
        let number = &mut used[*corner];
        if *number == usize::MAX {
            *number = kept.len();
            kept.push(Point::<3>::from(points[*corner]));
        }
        *corner = *number;
    }
    Mesh::new(kept, &[(CellShape::Hexahedron, cells)], &[]).unwrap()
}

/// The opening of a slotted block that is pulled at both sides, by whole and by half, and the error of the patch test.
fn openings(body: impl Fn(bool) -> Scene<3>, scheme: &Scheme) -> [f64; 3] {
    let on = |holds: fn(&Point<3>) -> bool| Place::from(Part::Whole).within(holds);
    let opened = |whole: bool| {
        let scene = body(whole).hold(on(|x| x[1] < 1e-9));
        let scene = scene.traction(on(|x| x[0] > 1.0 - 1e-9), [TRACTION, 0.0, 0.0]);
        let scene = if whole {
            scene.traction(on(|x| x[0] < 1e-9), [-TRACTION, 0.0, 0.0])
        } else {
            scene.prescribe(on(|x| x[0] < 0.5 + 1e-9), 0, 0.0)
        };
        let problem = scene.discretize(scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let at = |x: f64| problem.displacement(path.last(), &[x, 1.0, 0.25].into()).unwrap()[0];
        let right = 0.5 + WIDTH / 2.0;
        if whole { at(right) - at(1.0 - right) } else { 2.0 * at(right) }
    };
    let gradient = Matrix3::new(0.1, 0.05, 0.0, -0.05, -0.1, 0.02, 0.03, 0.0, 0.05);
    [opened(true), opened(false), patch_test(&body(true), &gradient, scheme).unwrap().error]
}

#[test]
fn slots_of_solid_meshes_open() {
    let [slot, half, patch] = openings(|whole| Scene::new(hexahedra(whole), Solid, rubber()), &Scheme::default());
    println!("hexahedra {slot:.6}, half {half:.6}");
    assert!(abs_diff_eq!(slot / half, 1.0, epsilon = 0.1), "{slot:.3e}, by symmetry {half:.3e}");
    assert!(patch < 1e-11, "{patch:.1e}");
}

#[test]
fn slots_of_surfaces_open() {
    let body = |whole: bool| Scene::new(Solid3::of_mesh(&hexahedra(whole)).unwrap(), Solid, rubber());
    let [slot, half, patch] = openings(body, &Scheme::default().spacing(0.1));
    println!("surface {slot:.6}, half {half:.6}");
    // The half is a model of the same spacing, whose particles lie elsewhere around the root.
    assert!(abs_diff_eq!(slot / half, 1.0, epsilon = 0.05), "{slot:.3e}, by symmetry {half:.3e}");
    assert!(patch < 1e-10, "{patch:.1e}");
}

/// A prism over plane quadrilaterals, their corners counterclockwise.
fn prism(corners: &[Point<2>], quads: &[[usize; 4]], height: f64) -> Solid3 {
    let points = |z: f64| corners.iter().map(move |x| Point::<3>::new(x[0], x[1], z));
    let count = corners.len();
    let cells = quads.iter().flat_map(|quad| quad.iter().copied().chain(quad.iter().map(move |corner| corner + count)));
    let points = points(0.0).chain(points(height)).collect();
    Solid3::of_mesh(&Mesh::new(points, &[(CellShape::Hexahedron, cells.collect())], &[]).unwrap()).unwrap()
}

/// A variable of the environment.
fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).ok().and_then(|value| value.parse().ok()).unwrap_or(default)
}

/// Slots of drawn width (0.2 to 1.7 of the spacing), depth, angle and lattice, in plane strain, beside a fine model in the plane: as many as
/// the variable `SLOTS` says, drawn from `SEED`.
#[test]
fn drawn_slots_of_surfaces_open() {
    const FINE: f64 = 0.02;
    let mut random = fastrand::Rng::with_seed(number("SEED", 4021));
    let mut draw = |low: f64, high: f64| low + (high - low) * random.f64();
    for count in 0..number("SLOTS", 2) {
        let (width, depth, angle) = (draw(0.02, 0.12), draw(0.3, 0.8), draw(-0.5, 0.5));
        // Turned about the slot's edge and at all.
        let turn = Vector3::new(draw(-1.0, 1.0), draw(-1.0, 1.0), draw(-1.0, 1.0));
        let turn = if count % 2 == 0 { Vector3::new(0.0, 0.0, turn[2]) } else { turn };
        let [across, down] = [Point::<2>::new(angle.cos(), angle.sin()), Point::<2>::new(angle.tan(), -1.0)];
        let middle = Point::<2>::new(0.5 - angle.tan() * depth / 2.0, 1.0);
        let (mouth, root) = (Point::<2>::new(width / 2.0 / angle.cos(), 0.0), middle + down * depth);
        let corners = [
            Point::<2>::new(0.0, 0.0),
            Point::<2>::new(1.0, 0.0),
            Point::<2>::new(1.0, 1.0),
            middle + mouth,
            root + across * (width / 2.0),
            root - across * (width / 2.0),
            middle - mouth,
            Point::<2>::new(0.0, 1.0),
        ];
        let outline = ["base", "right", "top", "slot", "slot", "slot", "top"].iter().zip(&corners[1..]);
        let outline = outline.fold(Outline::at([0.0, 0.0]), |line, (name, x)| line.line(name, [x[0], x[1]]));
        let plane = Scene::new(Region::new(outline.close("left")).unwrap(), PlaneStrain, rubber())
            .hold("base")
            .traction("right", [TRACTION, 0.0])
            .traction("left", [-TRACTION, 0.0]);
        let problem = plane.discretize(&Scheme::default().spacing(FINE)).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let at = |x: &Point<2>| problem.displacement(path.last(), x).unwrap()[0];
        let fine = at(&corners[3]) - at(&corners[6]);
        for spacing in [0.1, 0.07] {
            let height = 2.0 * spacing;
            let solid = prism(&corners, &[[0, 5, 6, 7], [1, 2, 3, 4], [0, 1, 4, 5]], height);
            let axes = *Rotation3::from_scaled_axis(turn).matrix();
            let cells = Geometry::cells(Arc::new(CutLattice::with_axes(&solid, spacing, axes).unwrap()));
            let on = |holds: fn(&Point<3>) -> bool| Place::from(Part::Whole).within(holds);
            let body = |rubber: Rubber| Scene::new(cells.clone(), Solid, rubber);
            let scene = body(rubber())
                .hold(on(|x| x[1] < 1e-9))
                .traction(on(|x| x[0] > 1.0 - 1e-9), [TRACTION, 0.0, 0.0])
                .traction(on(|x| x[0] < 1e-9), [-TRACTION, 0.0, 0.0])
                .prescribe(Place::from(Part::Whole).within(move |x| x[2] < 1e-9 || x[2] > height - 1e-9), 2, 0.0);
            let problem = scene.discretize(&Scheme::default()).unwrap();
            let path = problem.run().unwrap().completed().unwrap();
            let at = |x: &Point<2>| problem.displacement(path.last(), &[x[0], x[1], height / 2.0].into()).unwrap()[0];
            let error = (at(&corners[3]) - at(&corners[6])) / fine - 1.0;
            let gradient = Matrix3::new(0.1, 0.05, 0.0, -0.05, -0.1, 0.02, 0.03, 0.0, 0.05);
            let patch = patch_test(&body(rubber()), &gradient, &Scheme::default()).unwrap().error;
            let soft = body(Rubber::neo_hookean(0.5, 5.0 / 3.0).unwrap());
            let theta = spurious_modes(&soft, &Scheme::default()).unwrap().smallest;
            println!(
                "width {width:.3}, depth {depth:.2}, angle {angle:+.2}, spacing {spacing}: opening {error:+.3}, patch test {patch:.1e}, θ {theta:.3}"
            );
            assert!(error.abs() < 0.05 && patch < 1e-10 && theta > 0.3);
        }
    }
}
