//! Lattices in solids that are refined where walls are thin or a field asks for it.

use std::sync::Arc;

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use rkpm::cells::CutLattice;
use rkpm::check::{patch_test, spurious_modes};
use rkpm::error::GeometryError;
use rkpm::nalgebra::Matrix3;
use rkpm::prelude::*;

use super::{Shape as Surface, ball, block, cylinder, drawn, gear, moved, volume};

fn solid(shape: &Surface) -> Solid3 {
    Solid3::new(shape.0.clone(), shape.1.clone()).unwrap()
}

/// A quarter of the spacing around a corner of a surface.
fn graded(shape: &Surface, spacing: f64) -> CutLattice {
    let centre = shape.0[shape.0.len() / 3];
    let wanted = move |x: &Point<3>| (0.6 * (x - centre).norm() / spacing).clamp(0.25, 1.0);
    CutLattice::refined(&solid(shape), spacing, 0, wanted).unwrap()
}

#[test]
fn what_nothing_refines_has_the_bits_of_an_even_lattice() {
    for (name, shape) in drawn() {
        let solid = solid(&shape);
        let even = CutLattice::new(&solid, 0.26).unwrap();
        let same = CutLattice::refined(&solid, 0.26, 1, |_| 1.0).unwrap();
        assert_eq!(even.positions(), same.positions(), "{name}");
        let zones = even.zones(2);
        assert_eq!(zones, same.zones(2), "{name}");
        assert_eq!(even.smoothing(2, 2, &zones).unwrap(), same.smoothing(2, 2, &zones).unwrap(), "{name}");
        let [traces, others] = [&even, &same].map(|cells| cells.boundary(&Part::Whole, 2, 2).unwrap().traces);
        assert_eq!(traces, others, "{name}");
    }
}

#[test]
fn refined_sub_cells_are_closed_and_fill_the_solid() {
    let mut random = fastrand::Rng::with_seed(12);
    let mut all = drawn();
    all.push(("gear", moved(gear(6.0, 48), &mut random)));
    for (name, shape) in all {
        let cells = graded(&shape, 0.3);
        let spacings: Vec<f64> = (0..cells.positions().len()).map(|particle| cells.spacings(particle)[0]).collect();
        let least = spacings.iter().copied().fold(f64::INFINITY, f64::min);
        // The ball is smaller than the macro cells that are not halved, which are 0.6 wide.
        assert!(
            abs_diff_eq!(least, 0.075, epsilon = 1e-12)
                && spacings.iter().any(|own| abs_diff_eq!(*own, 0.15, epsilon = 1e-12)),
            "{name}"
        );
        // Particles that are next to each other differ by one halving at most.
        for (k, x) in cells.positions().iter().enumerate() {
            for (y, other) in cells.positions()[..k].iter().zip(&spacings) {
                let [low, high] = [spacings[k].min(*other), spacings[k].max(*other)];
                assert!((x - y).norm() > 0.75 * low || high < 2.5 * low, "{name}: {low} beside {high}");
            }
        }
        for parts in [1, 2] {
            let smoothing = cells.smoothing(parts, 2, &cells.zones(2)).unwrap();
            smoothing.validate().unwrap();
            assert!(smoothing.volumes().iter().all(|own| *own > 0.0), "{name}");
            let total: f64 = smoothing.volumes().iter().sum();
            assert!(relative_eq!(total, volume(&shape), max_relative = 1e-12), "{name}: {total}");
        }
        let gauss: f64 = cells.gauss(4).unwrap().weights.iter().sum();
        assert!(relative_eq!(gauss, volume(&shape), max_relative = 1e-12), "{name}: {gauss}");
        for piece in cells.boundary_pieces(&Part::Whole, 2, 2).unwrap() {
            let sums = piece.traces.iter().map(|functions| functions.iter().map(|own| own.1).sum::<f64>());
            assert!(sums.into_iter().all(|sum| abs_diff_eq!(sum, 1.0, epsilon = 1e-10)), "{name}");
        }
    }
}

/// The patch test's error and the smallest eigenvalue θ of a rule's energy beside the exact one.
fn measures(cells: &Arc<CutLattice>) -> [f64; 2] {
    let gradient = Matrix3::new(0.1, 0.05, -0.03, 0.02, -0.08, 0.04, 0.06, -0.02, 0.05);
    let scene = |bulk| Scene::new(Geometry::cells(cells.clone()), Solid, Rubber::neo_hookean(0.5, bulk).unwrap());
    let patch = patch_test(&scene(1e3), &gradient, &Scheme::default()).unwrap().error;
    [patch, spurious_modes(&scene(5.0 / 6.0), &Scheme::default()).unwrap().smallest]
}

/// A solid of the law below, a spacing of a third to a quarter of its size, and a refinement around a corner or its middle.
fn refined_by_chance(number: usize, random: &mut fastrand::Rng) -> (Surface, CutLattice) {
    let shape = match number % 4 {
        0 => block([1.0, 0.7 + 0.6 * random.f64(), 0.7 + 0.6 * random.f64()]),
        1 => ball(0.6, 24),
        2 => cylinder(0.5, 0.7 + random.f64(), 24),
        _ => gear(6.0, 48),
    };
    let shape = moved(shape, random);
    let spacing = volume(&shape).cbrt() * (0.24 + 0.12 * random.f64());
    let corner = shape.0[random.usize(0..shape.0.len())];
    let middle = shape.0.iter().sum::<Point<3>>() / shape.0.len() as f64;
    let centre = if random.bool() { middle } else { corner };
    let slope = 0.5 + 0.5 * random.f64();
    let least = if random.bool() { 0.5 } else { 0.25 };
    let wanted = move |x: &Point<3>| (slope * (x - centre).norm() / spacing).clamp(least, 1.0);
    let cells = CutLattice::refined(&solid(&shape), spacing, 0, wanted).unwrap();
    (shape, cells)
}

/// θ ≥ 0.3: even lattices of drawn solids have 0.33 and more; in cells that touch finer ones, sub-cells of half the spacing leave 0.25.
#[test]
fn refined_lattices_keep_homogeneous_fields_and_have_no_spurious_modes() {
    let mut random = fastrand::Rng::with_seed(1);
    for number in 0..8 {
        let (_, cells) = refined_by_chance(number, &mut random);
        let cells = Arc::new(cells);
        // Larger ones take minutes; they are for the law below.
        if cells.positions().len() > 350 {
            continue;
        }
        let [patch, theta] = measures(&cells);
        println!("{number}: {} particles, patch test {patch:.1e}, θ {theta:.3}", cells.positions().len());
        assert!(patch < 1e-10 && theta > 0.3, "{number}: {patch:e} {theta}");
    }
}

/// `SEED=2 COUNT=40 cargo test --profile quick --all-features --test cut drawn_refinements -- --ignored --nocapture`.
#[test]
#[ignore = "minutes"]
fn drawn_refinements_have_no_spurious_modes() {
    let given = |name: &str, otherwise: u64| std::env::var(name).map_or(otherwise, |own| own.parse().unwrap());
    let mut random = fastrand::Rng::with_seed(given("SEED", 2));
    let mut worst = [0.0, f64::INFINITY];
    for number in 0..given("COUNT", 20) as usize {
        let (shape, cells) = refined_by_chance(number, &mut random);
        let cells = Arc::new(cells);
        let count = cells.positions().len();
        if count > given("LARGEST", 900) as usize {
            println!("{number}: {count} particles, left out");
            continue;
        }
        let [patch, theta] = measures(&cells);
        let total: f64 = cells.smoothing(2, 2, &cells.zones(2)).unwrap().volumes().iter().sum();
        assert_relative_eq!(total, volume(&shape), max_relative = 1e-12);
        println!("{number}: {count} particles, patch test {patch:.1e}, θ {theta:.3}");
        worst = [worst[0].max(patch), worst[1].min(theta)];
    }
    println!("patch test {:.1e} at most, θ {:.3} at least", worst[0], worst[1]);
    assert!(worst[0] < 1e-10 && worst[1] > 0.3, "{worst:?}");
}

/// What an outline in the plane, with its triangles, sweeps along the third axis.
fn prism(outline: &[[f64; 2]], triangles: &[[usize; 3]], depth: f64) -> Solid3 {
    let count = outline.len();
    let at = |z: f64| outline.iter().map(move |[x, y]| Point::<3>::new(*x, *y, z));
    let mut facets: Vec<[usize; 3]> = triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    facets.extend(triangles.iter().map(|t| t.map(|k| k + count)));
    for k in 0..count {
        let next = (k + 1) % count;
        facets.extend([[k, next, count + next], [k, count + next, count + k]]);
    }
    Solid3::new(at(0.0).chain(at(depth)).collect(), facets.iter().map(|f| f.map(|k| k as u32)).collect()).unwrap()
}

/// A base and a fin on it, a fifth of the spacing thick.
fn finned() -> Solid3 {
    let outline = [[0.0, 0.0], [5.6, 0.0], [5.6, 1.0], [1.07, 1.0], [1.07, 2.0], [0.93, 2.0], [0.93, 1.0], [0.0, 1.0]];
    prism(&outline, &[[0, 1, 2], [0, 2, 3], [0, 3, 6], [0, 6, 7], [3, 4, 5], [3, 5, 6]], 1.5)
}

#[test]
fn walls_are_followed_where_that_is_asked_for() {
    let solid = finned();
    let even = CutLattice::new(&solid, 0.7).unwrap();
    for particle in 0..even.positions().len() {
        assert_abs_diff_eq!(even.spacings(particle)[0], 0.7, epsilon = 1e-12);
    }
    for across in [1, 2] {
        let cells = CutLattice::refined(&solid, 0.7, across, |_| 1.0).unwrap();
        let wanted = 0.14 / across as f64;
        // In the fin's middle, and as coarse as asked for at the far end of the base.
        for (x, spacing) in cells.positions().iter().zip((0..).map(|particle| cells.spacings(particle)[0])) {
            let in_fin = x[1] > 1.2 && x[1] < 1.8 && x[2] > 0.3 && x[2] < 1.2;
            assert!(!in_fin || (spacing <= wanted && spacing > 0.49 * wanted), "{spacing} at {x}");
        }
        let far = cells.positions().iter().position(|x| (x - Point::<3>::new(5.6, 0.0, 0.0)).norm() < 1e-9).unwrap();
        // The base is a wall of 1.0 itself: one spacing of 0.7 fits across it, two of 0.35.
        let coarse = 0.7 / across as f64;
        assert_abs_diff_eq!(cells.spacings(far)[0], coarse, epsilon = 1e-12);
    }
    let scene = Scene::new(&solid, Solid, Rubber::neo_hookean(0.5, 1e3).unwrap());
    let problem = scene.discretize(&Scheme::default().spacing(0.7).across(1)).unwrap();
    let same = CutLattice::refined(&solid, 0.7, 1, |_| 1.0).unwrap();
    assert_eq!(problem.cells().positions(), same.positions());
    let finer = scene.discretize(&Scheme::default().spacing(0.7).across(1).graded(|_| 0.5)).unwrap();
    assert!(finer.cells().positions().len() > same.positions().len());
}

#[test]
fn gradings_that_cannot_be_followed_are_refused() {
    let (points, facets) = block([1.0; 3]);
    let solid = Solid3::new(points, facets).unwrap();
    for grading in [0.0, -1.0, 1.0 / 32.0, f64::NAN, f64::INFINITY] {
        let error = CutLattice::refined(&solid, 0.5, 0, |_| grading).unwrap_err();
        assert!(matches!(error, GeometryError::Invalid(_)) && error.to_string().contains("grading"), "{error}");
    }
    assert!(CutLattice::refined(&solid, -0.5, 0, |_| 1.0).is_err());
    let (points, facets) = block([1.0, 1.0, 0.05]);
    let plate = Solid3::new(points, facets).unwrap();
    let error = CutLattice::refined(&plate, 0.5, 2, |_| 1.0).unwrap_err();
    let GeometryError::WallAcross { thickness, across: 2, needed, .. } = error else { panic!("{error}") };
    assert_abs_diff_eq!(thickness, 0.05, epsilon = 1e-12);
    assert_abs_diff_eq!(needed, 0.4, epsilon = 1e-12);
    assert!(CutLattice::refined(&plate, 0.4, 2, |_| 1.0).is_ok());
}

/// The opening of a block with a slot of a seventh of the spacing, pulled at both sides, or twice that of its half.
fn opening(whole: bool, scheme: &Scheme) -> f64 {
    let body = match whole {
        true => {
            let outline =
                [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.51, 1.0], [0.51, 0.25], [0.49, 0.25], [0.49, 1.0], [0.0, 1.0]];
            prism(&outline, &[[1, 2, 3], [1, 3, 4], [0, 1, 4], [0, 4, 5], [0, 5, 6], [0, 6, 7]], 0.4)
        }
        false => {
            let outline = [[0.5, 0.0], [1.0, 0.0], [1.0, 1.0], [0.51, 1.0], [0.51, 0.25], [0.5, 0.25]];
            prism(&outline, &[[1, 2, 3], [1, 3, 4], [0, 1, 4], [0, 4, 5]], 0.4)
        }
    };
    let on = |holds: fn(&Point<3>) -> bool| Place::from(Part::Whole).within(holds);
    let scene = Scene::new(&body, Solid, Rubber::neo_hookean(0.5, 1e3).unwrap()).hold(on(|x| x[1] < 1e-6));
    let scene = scene.traction(on(|x| x[0] > 1.0 - 1e-6), [1e-4, 0.0, 0.0]);
    let scene = match whole {
        true => scene.traction(on(|x| x[0] < 1e-6), [-1e-4, 0.0, 0.0]),
        false => scene.prescribe(on(|x| x[0] < 0.5 + 1e-6), 0, 0.0),
    };
    let problem = scene.discretize(scheme).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let at = |x: f64| problem.displacement(path.last(), &[x, 1.0, 0.2].into()).unwrap()[0];
    if whole { at(0.51) - at(0.49) } else { 2.0 * at(0.51) }
}

/// What is left of the error is around the root, and about in proportion to the spacing there, which is halved.
#[test]
fn slots_open_where_their_roots_are_refined() {
    // The wall below the root has less than two spacings: the rule for walls would refine both.
    let even = Scheme::default().spacing(0.14).thin_walls();
    let root = |x: &[f64]| (5.0 * (x[0] - 0.5).hypot(x[1] - 0.3)).clamp(0.5, 1.0);
    let refined = even.clone().graded(root);
    let [closed, open] = [&even, &refined].map(|scheme| opening(true, scheme) / opening(false, scheme) - 1.0);
    println!("opening beside that of a half: {closed:.3}, refined {open:.3}");
    assert!(open.abs() < 0.03 && open.abs() < 0.7 * closed.abs(), "{closed} {open}");
}
