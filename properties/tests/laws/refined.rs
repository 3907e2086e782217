//! Locally refined lattices keep the laws of regular ones: exact patch test, no spurious modes, stable pressures.
#![cfg(feature = "solve")]

use std::sync::Arc;

use approx::{assert_abs_diff_eq, assert_relative_eq};
use rkpm::cells::{Cells, Refined};
use rkpm::check;
use rkpm::prelude::*;
use rkpm::study::{Budget, Quantity, Tolerance};

const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]];

/// A quadrilateral refined twice, towards two places.
fn twice() -> Refined {
    let base = Refined::new(Arc::new(Quadrilateral { corners: CORNERS }), [4, 4]).unwrap();
    base.refined(&[0, 2]).unwrap().refined(&[1, 5]).unwrap()
}

/// A square of curved lattice lines, whose hanging particles do not lie on the chords of the coarser cells. Its
/// outline is straight: on arcs trace functions of any lattice reproduce tractions to 1e-5 only.
fn bulged() -> Refined {
    let bulge = Mapped(|unit: &Point<2>| {
        let wave = |t: f64| (std::f64::consts::PI * t).sin();
        let moved = 0.1 * wave(unit[0]) * wave(unit[1]);
        Point::<2>::new(2.0 * unit[0] + moved, unit[1] + 0.5 * moved)
    });
    let base = Refined::new(Arc::new(bulge), [4, 4]).unwrap();
    base.refined(&[0]).unwrap().refined(&[3]).unwrap()
}

fn soft() -> Rubber {
    Rubber::neo_hookean(0.5, 5.0 / 3.0).unwrap()
}

#[test]
fn homogeneous_fields_are_exact_on_both_sides_of_hanging_particles() {
    for cells in [twice(), bulged()] {
        let cells: Arc<dyn Cells<2>> = Arc::new(cells);
        for order in [1, 2] {
            let scene = Scene::new(cells.clone(), PlaneStrain, soft())
                .prescribe(Part::Whole, 0, Value::field(|x: &Point<2>| 0.1 * x[0] + 0.05 * x[1]))
                .prescribe(Part::Whole, 1, Value::field(|x: &Point<2>| -0.02 * x[0] + 0.08 * x[1]));
            let problem = scene.discretize(&Scheme::default().order(order)).unwrap();
            let path = problem.run().unwrap().completed().unwrap();
            let largest = problem
                .particle_displacements(path.last())
                .unwrap()
                .iter()
                .zip(problem.cells().positions())
                .map(|(u, x)| (u - Point::<2>::new(0.1 * x[0] + 0.05 * x[1], -0.02 * x[0] + 0.08 * x[1])).amax())
                .fold(0.0, f64::max);
            // Displacements are up to 8 in the quadrilateral: rounding.
            assert!(largest < 1e-12, "order {order}: {largest:e}");
        }
    }
}

/// Bounds that these two bodies hold; regular lattices have 0.60 and 0.50.
#[test]
fn refinement_brings_no_spurious_modes() {
    for cells in [twice(), bulged()] {
        let scene = Scene::new(Geometry::cells(Arc::new(cells)), PlaneStrain, soft());
        let modes = check::spurious_modes(&scene, &Scheme::default()).unwrap();
        assert_eq!(modes.zero_modes, 0);
        assert!(modes.smallest > 0.3, "{modes:?}");
        let pressures = check::inf_sup(&scene, &Scheme::default()).unwrap();
        assert!(pressures.spurious == 0 && pressures.constant > 0.2, "{pressures:?}");
    }
}

#[test]
fn partitions_are_complete_and_balanced() {
    let cells = twice();
    // Areas by the divergence theorem, by interior points, by Gauss points, and by hand: a trapezoid.
    let smoothing = cells.smoothing(2, 2, &cells.zones(2)).unwrap();
    let area = 48.0 * (44.0 + 16.0) / 2.0;
    for sum in [
        smoothing.volumes().iter().sum::<f64>(),
        smoothing.interior.iter().flatten().map(|(_, w)| w).sum(),
        cells.gauss(2).unwrap().weights.iter().sum(),
    ] {
        assert_relative_eq!(sum, area, max_relative = 1e-13);
    }
    // Trace functions sum to one everywhere on the boundary, whose length they measure.
    for part in [(0, Side::Min), (0, Side::Max), (1, Side::Min), (1, Side::Max)].map(Part::from) {
        let boundary = cells.boundary(&part, 2, 2).unwrap();
        for traces in &boundary.traces {
            assert_abs_diff_eq!(traces.iter().map(|h| h.1).sum::<f64>(), 1.0, epsilon = 1e-14);
        }
        let nodes = cells.boundary_nodes(&part).unwrap();
        assert!(boundary.traces.iter().flatten().all(|(node, _)| nodes.contains(&(*node as usize))));
    }
    // However often one corner is refined, neighbours follow, and it ends at a sixteenth.
    let mut corner = Refined::new(Arc::new(Block::new([0.0, 0.0], [1.0, 1.0])), [4, 4]).unwrap();
    for _ in 0..6 {
        corner = corner.refined(&[0]).unwrap();
    }
    // The four macro cells at the corner have reached it, no others.
    assert_eq!(corner.refinable().filter(|refinable| !refinable).count(), 4);
    let nearest = corner.positions().iter().map(|x| x.norm()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    assert_abs_diff_eq!(nearest, 0.25 / 16.0, epsilon = 1e-15);
    assert!(Refined::new(Arc::new(Block::new([0.0, 0.0], [1.0, 1.0])), [3, 4]).is_err());
    assert!(Refined::new(Arc::new(Block::new([0.0, 0.0], [0.0, 1.0])), [2, 2]).is_err());
    assert!(corner.refined(&[usize::MAX]).is_err());
}

/// A corner asks for refinement: linear models as near to the references take less than two thirds of the particles of evenly spaced ones
/// (values as they are solved: those of evenly spaced ones can be extrapolated, which local refinement can't). Quadratic ones take as
/// many as evenly spaced ones: of them the bound is looked at alone. A tolerance that the smallest spacing at the corner does not allow is not called reached. References:
/// `tests/reference/cook_membrane.csv`.
#[test]
fn local_refinement_pays_at_a_corner() {
    let scene = Scene::new(Quadrilateral { corners: CORNERS }, PlaneStrain, Rubber::neo_hookean(40.097, 4e5).unwrap())
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.0, 6.25]);
    let requested = Tolerance::of(Quantity::displacement([48.0, 60.0], 1), 0.005).and(Quantity::energy());
    let error = |values: &[f64]| (values[0] / 6.9355 - 1.0).abs().max((values[1] / 334.97 - 1.0).abs());
    let series = Tolerance { error: 1e-6, ..requested.clone() };
    for (scheme, pays) in [(Scheme::default(), true), (Scheme::default().order(2), false)] {
        let series = scene
            .solve_within_by(
                std::slice::from_ref(&scheme),
                &series,
                Budget { unknowns: 10_000, ..Budget::default() },
                &mut (),
            )
            .unwrap();
        let answer = scene.solve_within_locally(&scheme, &requested, Budget::default()).unwrap();
        assert!(answer.reached() && error(answer.values()) < answer.bound, "{:?}", answer.levels);
        let (local, own) = (answer.problem.model().unknowns(), error(answer.values()));
        // All finer ones are as near, or there is none.
        let all = series.levels.iter().chain(&series.tried);
        let even = all.filter(|level| error(&level.values) > own).map(|level| level.unknowns).max().unwrap();
        println!("local {local}, off by {own:.1e}; even models are further off up to {even}");
        assert!(!pays || 3 * local < 2 * even, "{local} {even}");
    }

    let beyond = Tolerance { error: 5e-4, ..requested };
    let budget = Budget { unknowns: 6000, levels: 20, ..Budget::default() };
    let last = scene.solve_within_locally(&Scheme::default(), &beyond, budget).unwrap();
    assert!(!last.reached() && error(last.values()) < last.bound, "{:?}", last.levels);

    // Whatever a cluster of the body is: macro cells, single cells, points.
    for scheme in [Scheme::default().pressure_field(PressureField::Constant, 1), Scheme::paper(1.3).order(2)] {
        let coarse = Tolerance { error: 0.03, ..beyond.clone() };
        let scheme = scheme.constraint_kind(rkpm::scene::ConstraintKind::OverBoundary);
        let answer = scene.solve_within_locally(&scheme, &coarse, Budget { levels: 4, ..Budget::default() }).unwrap();
        assert!(answer.levels.len() >= 2 && answer.levels.iter().skip(1).all(|l| l.estimate.is_some()));
    }

    let thin = Scene::new(Block::new([0.0, 0.0], [20.0, 1.0]), PlaneStrain, soft());
    assert!(
        thin.solve_within_locally(&Scheme::default(), &Tolerance::of(Quantity::energy(), 0.1), Budget::default())
            .is_err()
    );
}

/// Errors of cells that no model has cut are in all models alike, and their differences small: the uneven gradients say
/// more. Bonded blocks, against quadratic elements (33 × 33 nodes, 0.01 % from 65 × 65), and an annulus against the exact
/// stiffness at small displacements.
#[test]
fn errors_that_all_models_share_are_seen() {
    for (width, across) in [(2.1, 0.041), (1.97, 0.184), (1.59, 0.043)] {
        let scene =
            Scene::new(Block::new([0.0, 0.0], [width, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
                .hold((1, Side::Min))
                .prescribe((1, Side::Max), 0, 0.0)
                .prescribe((1, Side::Max), 1, across);
        let force = Quantity::reaction((1, Side::Max), 1);
        let elements = scene.discretize(&Scheme::elements(2).particles([33])).unwrap();
        let path = elements.run().unwrap().completed().unwrap();
        let exact = force.evaluate(&elements, path.last()).unwrap();
        for error in [0.005, 0.003] {
            let requested = Tolerance::of(force.clone(), error).and(Quantity::energy());
            let answer = scene.solve_within_locally(&Scheme::default(), &requested, Budget::default()).unwrap();
            let off = (answer.values()[0] / exact - 1.0).abs();
            assert!(answer.reached() && off < answer.bound, "{width} {across}: {off:.2e} {:?}", answer.levels);
        }
    }

    let pi = std::f64::consts::PI;
    let half = Mapped(move |unit: &Point<2>| {
        let (radius, angle) = (10.0 + 10.0 * unit[0], pi * unit[1]);
        Point::<2>::new(radius * angle.cos(), radius * angle.sin())
    });
    let bushing = Scene::new(half, PlaneStrain, Rubber::neo_hookean(0.5, 1e5).unwrap())
        .hold((0, Side::Max))
        .prescribe((0, Side::Min), 0, 0.01)
        .prescribe((0, Side::Min), 1, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 1, 0.0);
    // Half of 4πµ / (ln(b/a) − (b² − a²)/(b² + a²)), µ = 1.
    let exact = 2.0 * pi * 0.01 / (2f64.ln() - 0.6);
    let requested = Tolerance::of(Quantity::reaction((0, Side::Min), 0), 0.005);
    let answer = bushing.solve_within_locally(&Scheme::default(), &requested, Budget::default()).unwrap();
    let off = (answer.values()[0] / exact - 1.0).abs();
    assert!(answer.reached() && off < answer.bound, "{off:.2e} {:?}", answer.levels);
}
