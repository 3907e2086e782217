//! GOAL: particles scattered over planar shapes keep the promises of lattices: exact on the patch test, stable, not
//! locked; bad input is refused with a reason.
//! GEOMETRY: an L-shaped polygon with a round hole; Cook's membrane; a square.
//! BOUNDARY: linear fields on the whole boundary; Cook's clamp and traction.
//! REFERENCE: the field itself; 8 Gauss points per direction and triangle; `tests/reference/cook_membrane.csv`.
//!
//! What is only reported: `cargo test --release --test laws scattered -- --ignored --nocapture`
#![cfg(feature = "solve")]

use approx::{abs_diff_eq, assert_abs_diff_eq, relative_eq};
use rkpm::Error;
use rkpm::cells::Scatter;
use rkpm::check::{inf_sup, patch_test, spurious_modes};
use rkpm::error::{ApproximationError, GeometryError};
use rkpm::nalgebra::Matrix2;
use rkpm::prelude::*;
use rkpm::scene::{Dilation, Partition, Rule};

const SEEDS: std::ops::Range<u64> = 0..10;

/// Shear modulus 1, bulk modulus 5/3: what is tested is the rule, not the cure.
fn moderate() -> Rubber {
    Rubber::neo_hookean(0.5, 5.0 / 3.0).unwrap()
}

/// The rubber of §6 of the paper [MPa], k/µ = 1.3e5.
fn paper() -> Rubber {
    Rubber::yeoh(0.373, -0.031, 0.005, 1e5).unwrap()
}

/// Legs of width 1, a hole of radius 0.25 in the corner.
fn l_shape() -> Region {
    let outline = Outline::at([0.0, 0.0])
        .line("bottom", [2.0, 0.0])
        .line("end", [2.0, 1.0])
        .line("inner", [1.0, 1.0])
        .line("inner", [1.0, 2.0])
        .line("top", [0.0, 2.0])
        .close("left");
    Region::with_holes(outline, [Outline::circle("hole", [0.5, 0.5], 0.25)]).unwrap()
}

fn square() -> Outline {
    Outline::at([0.0, 0.0]).line("bottom", [1.0, 0.0]).line("right", [1.0, 1.0]).line("top", [0.0, 1.0]).close("left")
}

fn l_scene(rubber: Rubber) -> Scene<2> {
    Scene::new(l_shape(), PlaneStrain, rubber)
}

/// About 150 particles in the L.
fn scattered(scheme: &Scheme, seed: u64) -> Scheme {
    scheme.clone().spacing(0.17).seed(seed)
}

/// The same as blue noise, its triangles as they come.
fn noisy(scheme: &Scheme, seed: u64) -> Scheme {
    let scatter = Scatter { seed, relaxations: 0 };
    scheme.clone().spacing(0.17).scatter(scatter)
}

/// The worst patch test over all seeds, relaxed particles and blue noise.
fn worst_patch(rubber: fn() -> Rubber, scheme: &Scheme) -> f64 {
    let gradient = Matrix2::new(0.2, 0.1, -0.05, -0.1);
    let test = |scheme: Scheme| patch_test(&l_scene(rubber()), &gradient, &scheme).unwrap().error;
    SEEDS.flat_map(|seed| [test(scattered(scheme, seed)), test(noisy(scheme, seed))]).fold(0.0, f64::max)
}

#[test]
fn linear_fields_come_out_exactly() {
    let linear = worst_patch(moderate, &Scheme::default());
    let voronoi = worst_patch(moderate, &Scheme::default().partition(Partition::Voronoi));
    let scni = worst_patch(moderate, &Scheme::default().rule(Rule::Scni));
    // Three sub-cells per direction, three points on each edge.
    let quadratic = worst_patch(moderate, &Scheme::default().order(2));
    println!("linear {linear:.1e}, Voronoi {voronoi:.1e}, SCNI {scni:.1e}, quadratic {quadratic:.1e}");
    // Rounding alone, k/µ = 1e3 times 1e-16 and a few: found 4e-14 at most, 1e-14 with quadratic functions.
    assert!(linear <= 1e-12 && voronoi <= 1e-12 && scni <= 1e-12, "{linear:e} {voronoi:e} {scni:e}");
    assert!(quadratic <= 1e-12, "{quadratic:e}");
    // Rounding is multiplied by k/µ = 1.3e5.
    let stiff = worst_patch(paper, &Scheme::default());
    println!("linear, paper's rubber {stiff:.1e}");
    assert!(stiff <= 1e-9, "{stiff:e}");
}

#[test]
fn direct_nodal_integration_fails_the_patch_test() {
    let gradient = Matrix2::new(0.2, 0.1, -0.05, -0.1) * 0.1;
    let errors: Vec<f64> = SEEDS
        .map(|seed| {
            let scheme = scattered(&Scheme::default().rule(Rule::Nodal), seed);
            patch_test(&l_scene(moderate()), &gradient, &scheme).unwrap().error
        })
        .collect();
    println!("nodal {errors:.2?}");
    // Found 0.02 to 0.06; a rule that is nearly consistent would be far below a hundredth of that.
    assert!(errors.iter().all(|e| *e > 1e-3));
}

#[test]
fn bodies_of_revolution_are_exact_too() {
    let gradient = Matrix2::new(0.2, 0.0, 0.0, -0.1);
    for scheme in [Scheme::default(), Scheme::default().rule(Rule::Scni)] {
        for seed in 0..3 {
            // The L touches the axis.
            let scene = Scene::new(l_shape(), Axisymmetric, moderate());
            let error = patch_test(&scene, &gradient, &scattered(&scheme, seed)).unwrap().error;
            assert!(error <= 1e-12, "{error:e}");
        }
    }
}

#[test]
fn the_default_sees_every_deformation_and_its_pressures_are_stable() {
    for seed in SEEDS {
        for (name, scheme) in
            [("relaxed", scattered(&Scheme::default(), seed)), ("noise", noisy(&Scheme::default(), seed))]
        {
            let modes = spurious_modes(&l_scene(moderate()), &scheme).unwrap();
            let pressures = inf_sup(&l_scene(moderate()), &scheme).unwrap();
            println!(
                "seed {seed} {name}: theta {:.3}, inf-sup {:.3}, {} pressures to {} displacements",
                modes.smallest, pressures.constant, pressures.pressures, pressures.displacements
            );
            assert_eq!((modes.zero_modes, modes.rigid_motions, pressures.spurious), (0, 3, 0));
            // What all seeds hold: 0.49 to 0.60 and 0.088 to 0.17. The domain itself allows 0.19 (constants on large zones);
            // modes that cost nothing, and pressures that nothing sees, are below 0.01.
            assert!(modes.smallest >= 0.45, "{modes:?}");
            assert!(pressures.constant >= 0.07, "{pressures:?}");
            assert!(pressures.displacements as f64 >= 1.8 * pressures.pressures as f64);
        }
    }
}

#[test]
fn inf_sup_does_not_depend_on_the_spacing() {
    let scene = Scene::new(Region::new(square()).unwrap(), PlaneStrain, moderate());
    for count in [7, 13, 19] {
        let smallest = (0..4)
            .map(|seed| inf_sup(&scene, &Scheme::default().particles([count]).seed(seed)).unwrap().constant)
            .fold(f64::INFINITY, f64::min);
        println!("{count}: {smallest:.3}");
        // The worst patch of a cloud decides: 0.30 to 0.53 on 64 clouds of 49 to 784 particles. From the first to the last
        // of these counts β would fall to a third, 0.14, if it went with the spacing.
        assert!(smallest >= 0.3, "{count}: {smallest}");
    }
}

/// Cook's membrane [mm, MPa].
fn cook(bulk: f64) -> Scene<2> {
    let outline = Outline::at([0.0, 0.0])
        .line("bottom", [48.0, 44.0])
        .line("right", [48.0, 60.0])
        .line("top", [0.0, 44.0])
        .close("left");
    Scene::new(Region::new(outline).unwrap(), PlaneStrain, Rubber::neo_hookean(40.097, bulk).unwrap())
        .hold("left")
        .traction("right", [0.0, 6.25])
}

/// Deflections of the corner and of the middle of the right side, energy.
fn cook_quantities(bulk: f64, scheme: &Scheme) -> [f64; 3] {
    let problem = cook(bulk).discretize(scheme).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let u = |x: [f64; 2]| problem.displacement(path.last(), &x.into()).unwrap()[1];
    [u([48.0, 60.0]), u([48.0, 52.0]), problem.energy(path.last()).unwrap()]
}

#[test]
fn cooks_membrane_converges_from_every_seed() {
    let error = |count: usize, seed: u64| {
        let found = cook_quantities(4e5, &Scheme::default().particles([count]).seed(seed));
        // uy(48, 60), uy(48, 52), stored energy; to 2e-4.
        found.iter().zip([6.9355, 6.9635, 334.97]).map(|(v, exact)| (v / exact - 1.0f64).abs()).fold(0.0, f64::max)
    };
    for seed in 1..=8 {
        let (coarse, fine) = (error(9, seed), error(17, seed));
        println!("seed {seed}: {:.2} % with 81, {:.2} % with 289", 100.0 * coarse, 100.0 * fine);
        // Twice what the worst of these seeds has, 0.62 and 0.19 %: other rounding may scatter particles otherwise.
        assert!(coarse <= 0.012 && fine <= 0.004 && fine < coarse, "{coarse} {fine}");
    }
}

#[test]
fn nothing_locks() {
    // Percent between 81 and 289 particles at each ratio of moduli: locking would let it grow with the ratio.
    let differences: Vec<f64> = [1e1, 1e3, 1e6]
        .map(|ratio| {
            let tip = |count: usize| cook_quantities(ratio * 80.194, &Scheme::default().particles([count]).seed(1))[0];
            100.0 * (tip(9) / tip(17) - 1.0)
        })
        .into();
    let spread = differences.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b))
        - differences.iter().fold(f64::INFINITY, |a, b| a.min(*b));
    println!("{differences:.3?}");
    // Found 0.1; functions that lock lose half of the deflection and more.
    assert!(spread <= 0.5, "{differences:?}");
}

#[test]
fn a_perforated_strip_is_stretched_to_twice_its_length() {
    let outline = Outline::at([2.0, 0.0])
        .line("x axis", [10.0, 0.0])
        .line("end", [10.0, 5.0])
        .line("side", [0.0, 5.0])
        .line("y axis", [0.0, 2.0])
        .arc("hole", [2.0, 0.0], [0.0, 0.0], Turn::Right);
    let scene = Scene::new(Region::new(outline).unwrap(), PlaneStrain, paper())
        .prescribe("x axis", 1, 0.0)
        .prescribe("y axis", 0, 0.0)
        .prescribe("end", 0, 10.0)
        .prescribe("end", 1, 0.0);
    let grading = |x: &[f64]| 0.3 + 0.7 * ((x[0].hypot(x[1]) - 2.0) / 4.0).clamp(0.0, 1.0);
    let problem = scene.discretize(&Scheme::default().particles([150, 1]).graded(grading)).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    // `tests/reference/perforated_strip.csv`, 1.2e-3; 150 particles come to within a few times that.
    let error = problem.energy(path.last()).unwrap() / 34.768606 - 1.0;
    assert!(error.abs() <= 5e-3, "{error}");
}

#[test]
fn cells_tile_the_shape() {
    let region = l_shape();
    for relaxations in [0, 4] {
        let cells = Triangulation::scattered(&region, |_| 0.1, &Scatter { seed: 2, relaxations }).unwrap();
        // Chords around the hole add what is between them and the arc.
        let area: f64 = cells.gauss(2).unwrap().weights.iter().sum();
        assert!(area > region.area() && area < region.area() * 1.003);
        let voronoi = Voronoi::new(cells.clone());
        let zones = [cells.zones(2), voronoi.zones(2)];
        let partitions = [
            cells.smoothing(1, 2, &zones[0]).unwrap(),
            cells.smoothing(2, 2, &zones[0]).unwrap(),
            cells.smoothing(3, 2, &zones[0]).unwrap(),
            voronoi.smoothing(1, 2, &zones[1]).unwrap(),
            voronoi.smoothing(2, 2, &zones[1]).unwrap(),
            cells.nodal_cells(2).unwrap(),
        ];
        for smoothing in partitions {
            let volumes = smoothing.volumes();
            assert!(volumes.iter().all(|v| *v > 0.0));
            assert_abs_diff_eq!(volumes.iter().sum::<f64>(), area, epsilon = 1e-12);
            // A facet inside has two sides of opposite sign, one on the boundary has one.
            let mut sides = vec![(0, 0.0); smoothing.facet_offsets.len() - 1];
            for &(facet, sign) in smoothing.cells.iter().flatten() {
                sides[facet as usize].0 += 1;
                sides[facet as usize].1 += sign;
            }
            assert!(sides.iter().all(|&(count, sum)| (count, sum) == (2, 0.0) || (count, sum) == (1, 1.0)));
            // Interior points have the volume of their sub-cell: hoop strains rely on it.
            for (points, volume) in smoothing.interior.iter().zip(&volumes) {
                assert_abs_diff_eq!(points.iter().map(|p| p.1).sum::<f64>(), volume, epsilon = 1e-14);
            }
        }
    }
}

#[test]
fn measures_do_not_depend_on_the_place_of_the_shape() {
    for (at, size) in [(0.0, 1.0), (1e6, 1e-3), (-3e5, 2.0), (1.0, 1e-6)] {
        let (low, high) = (at, at + size);
        // What is drawn: corners are rounded, the area between them should not be.
        let side: f64 = high - low;
        let square = Outline::at([low, low]).line("b", [high, low]).line("r", [high, high]).line("t", [low, high]);
        let region = Region::new(square.clone().close("l")).unwrap();
        assert!(
            relative_eq!(region.area(), side * side, epsilon = 0.0, max_relative = 1e-14),
            "{at} {size}: {}",
            region.area()
        );
        let hole = Outline::circle("hole", [low + 0.5 * side, low + 0.5 * side], 0.2 * side);
        let holed = Region::with_holes(square.close("l"), [hole]).unwrap();
        // The radius is a difference of rounded coordinates.
        let rounding = 1e-12 + 8.0 * f64::EPSILON * at.abs() / size;
        let exact = 1.0 - 0.04 * std::f64::consts::PI;
        assert!(abs_diff_eq!(holed.area() / (side * side), exact, epsilon = rounding), "{at} {size}: {}", holed.area());
        let cells = Triangulation::about(&holed, 200, |_| 1.0, &Scatter::default()).unwrap();
        assert!(cells.positions().len().abs_diff(200) < 20, "{at} {size}: {}", cells.positions().len());
        let sum: f64 = cells.gauss(2).unwrap().weights.iter().sum();
        let smoothing = cells.smoothing(2, 2, &cells.zones(2)).unwrap();
        let kernel = ReproducingKernel::new(cells.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
        let table = ShapeTable::smoothed(&kernel, &smoothing, &PlaneStrain).unwrap();
        let measures = smoothing.volumes();
        for (measure, weight) in measures.iter().zip(table.weights()) {
            assert!(
                abs_diff_eq!(weight / measure, 1.0, epsilon = 1e-9 + 10.0 * rounding),
                "{at} {size}: {measure} {weight}"
            );
        }
        for total in [measures.iter().sum::<f64>(), table.weights().iter().sum()] {
            assert!(abs_diff_eq!(total / sum, 1.0, epsilon = 1e-12 + rounding), "{at} {size}: {total} {sum}");
        }
    }
}

#[test]
fn spacing_follows_its_function() {
    let graded = |x: &Point<2>| 0.02 + 0.1 * (x - Point::<2>::new(1.0, 1.0)).norm();
    let cells = Triangulation::scattered(&l_shape(), graded, &Scatter::default()).unwrap();
    let ratios: Vec<f64> =
        cells.positions().iter().enumerate().map(|(p, x)| cells.local_spacing(p) / graded(x)).collect();
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    // Relaxed particles settle where their neighbours allow; smoothing spreads the function over a spacing or two.
    assert!(
        abs_diff_eq!(mean, 1.0, epsilon = 0.15) && ratios.iter().all(|r| *r > 0.6 && *r < 1.7),
        "{mean} {ratios:?}"
    );
    // Boundary particles are on it to the bit of its own arithmetic.
    for particle in cells.boundary_nodes(&"hole".into()).unwrap() {
        let radius = (cells.positions()[particle] - Point::<2>::new(0.5, 0.5)).norm();
        assert_abs_diff_eq!(radius, 0.25, epsilon = 1e-15);
    }
    let about = Triangulation::about(&l_shape(), 500, graded, &Scatter::default()).unwrap();
    assert!(about.positions().len().abs_diff(500) < 25, "{}", about.positions().len());
}

#[test]
fn given_particles_make_the_same_cells() {
    let region = l_shape();
    let scattered = Triangulation::scattered(&region, |_| 0.2, &Scatter::default()).unwrap();
    let given = Triangulation::of_particles(&region, scattered.positions()).unwrap();
    assert_eq!(given.cell_count(), scattered.cell_count());
    for part in ["hole", "inner", "left"] {
        assert_eq!(given.boundary_nodes(&part.into()).unwrap(), scattered.boundary_nodes(&part.into()).unwrap());
    }
    let scene = Scene::new(Geometry::cells(std::sync::Arc::new(given)), PlaneStrain, moderate());
    let test = patch_test(&scene, &Matrix2::new(0.2, 0.1, -0.05, -0.1), &Scheme::default()).unwrap();
    assert!(test.error <= 1e-12, "{test:?}");
}

#[test]
fn every_discretisation_has_a_certificate() {
    for dilation in [Dilation::Auto, Dilation::Neighbour { rank: 6, factor: 1.5 }] {
        for seed in 0..4 {
            let scheme = noisy(&Scheme::default(), seed).dilation(dilation);
            let certificate = l_scene(moderate()).discretize(&scheme).unwrap().certificate().unwrap();
            println!("{dilation:?} {certificate:.1?}");
            assert!(certificate.smallest_rcond > 1e-4 && certificate.cover >= 4, "{certificate:?}");
            assert!(certificate.largest_slope < 10.0, "{certificate:?}");
        }
    }
    // Supports that leave gaps are raised until they cover.
    let small = noisy(&Scheme::default(), 1).dilation(Dilation::Local(0.55));
    let certificate = l_scene(moderate()).discretize(&small).unwrap().certificate().unwrap();
    println!("small {certificate:?}");
    assert!(certificate.raised > 0 && certificate.cover >= 3);
}

#[test]
fn shapes_that_cannot_be_are_refused() {
    let shape = |result: Result<Region, GeometryError>, words: &str| match result {
        Err(GeometryError::Shape { what, .. }) => assert!(what.contains(words), "{what}"),
        other => panic!("{other:?}"),
    };
    let bow = Outline::at([0.0, 0.0]).line("a", [1.0, 1.0]).line("b", [1.0, 0.0]).line("c", [0.0, 1.0]).close("d");
    shape(Region::new(bow), "cross");
    shape(Region::with_holes(square(), [Outline::circle("hole", [3.0, 0.5], 0.2)]), "not inside");
    shape(Region::with_holes(square(), [Outline::circle("hole", [1.0, 0.5], 0.2)]), "cross");
    let rings = [0.3, 0.1].map(|r| Outline::circle("hole", [0.5, 0.5], r));
    shape(Region::with_holes(square(), rings), "not inside");
    shape(Region::new(Outline::at([0.0, 0.0]).line("a", [1.0, 0.0]).line("b", [1.0, 1.0])), "does not end");
    shape(Region::new(Outline::at([0.0, 0.0]).line("a", [0.0, 0.0]).close("b")), "no length");
    shape(Region::new(Outline::at([0.0, 0.0]).line("a", [1.0, 0.0]).line("b", [2.0, 0.0]).close("c")), "");
    shape(Region::new(Outline::at([0.0, 0.0]).line("a", [f64::NAN, 0.0]).close("c")), "not finite");
    let bent = Outline::at([0.0, 0.0]).arc("a", [1.0, 0.0], [0.2, 0.0], Turn::Left).close("b");
    shape(Region::new(bent), "different distances");
}

#[test]
fn particles_that_cannot_be_are_refused() {
    let region = Region::new(square()).unwrap();
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Point::<2>::from);
    let given = |more: &[[f64; 2]]| {
        let positions: Vec<Point<2>> =
            corners.iter().copied().chain(more.iter().map(|x| Point::<2>::from(*x))).collect();
        Triangulation::of_particles(&region, &positions)
    };
    let refused = |result: Result<Triangulation, GeometryError>, words: &str| match result {
        Err(GeometryError::Shape { what, .. }) => assert!(what.contains(words), "{what}"),
        other => panic!("{words}: {:?}", other.map(|_| ())),
    };
    assert!(given(&[[0.5, 0.5], [0.5, 0.0], [0.25, 0.7]]).is_ok());
    refused(given(&[[0.5, 0.5], [0.5, 0.5]]), "at one place");
    refused(given(&[[0.5, 0.5], [0.5, 0.5 + 1e-12]]), "at one place");
    refused(given(&[[1.5, 0.5]]), "outside");
    refused(given(&[[f64::NAN, 0.5]]), "not finite");
    refused(Triangulation::of_particles(&region, &corners[..3]), "corner");
    let line: Vec<Point<2>> = (0..5).map(|k| Point::<2>::new(f64::from(k) / 4.0, 0.0)).collect();
    refused(Triangulation::of_particles(&region, &line), "corner");

    for (spacing, words) in [(5.0, "below the smaller extent"), (0.0, "above zero"), (f64::NAN, "above zero")] {
        let error = Triangulation::scattered(&region, |_| spacing, &Scatter::default()).unwrap_err();
        assert!(error.to_string().contains(words), "{error}");
    }
    // A dip that no sample meets, and chords without end: both took forever.
    let dip = |x: &Point<2>| 0.1 * (x[0] - 0.123_456).abs() + 1e-70;
    let error = Triangulation::scattered(&region, dip, &Scatter::default()).unwrap_err();
    assert!(matches!(&error, GeometryError::Invalid(invalid) if invalid.what == "particle spacing"), "{error}");
    let error = region.clone().with_tolerance(1e-60).unwrap_err();
    assert!(matches!(&error, GeometryError::Invalid(invalid) if invalid.what == "tolerance of arcs"), "{error}");
    let error = Triangulation::scattered(&region, |_| 1e-6, &Scatter::default()).unwrap_err();
    assert!(matches!(error, GeometryError::Count { .. }), "{error}");
    let scene = Scene::new(region, PlaneStrain, moderate());
    let error = scene.clone().hold("nowhere").discretize(&Scheme::default()).err().unwrap();
    assert!(matches!(error, Error::Geometry(GeometryError::UnknownPart { .. })), "{error}");
    assert!(error.to_string().contains("bottom"), "{error}");
    let error = scene.discretize(&Scheme::elements(1)).err().unwrap();
    assert!(matches!(error, Error::Incompatible(_)), "{error}");
    let zones = Scheme::default().integration_zones([2]);
    assert!(matches!(scene.discretize(&zones).err().unwrap(), Error::Incompatible(_)));
    let rank = Scheme::default().dilation(Dilation::Neighbour { rank: 0, factor: 1.5 });
    let error = scene.discretize(&rank).err().unwrap();
    assert!(matches!(error, Error::Approximation(ApproximationError::Particle { .. })), "{error}");
}

/// Between a chord and its arc a particle is inside of the region; where the chord is that of two particles there is no triangle
/// for it, which is said.
#[test]
fn particles_between_chords_and_arcs_are_inside() {
    let disk = Region::new(Outline::circle("rim", [0.0, 0.0], 1.0)).unwrap();
    let plate =
        Outline::at([-2.0, -2.0]).line("a", [2.0, -2.0]).line("b", [2.0, 2.0]).line("c", [-2.0, 2.0]).close("d");
    let plate = Region::with_holes(plate, [Outline::circle("rim", [0.0, 0.0], 1.0)]).unwrap();
    for k in 0..500 {
        let direction = Point::<2>::new((f64::from(k) * 0.037).cos(), (f64::from(k) * 0.037).sin());
        for (radius, inside) in [(1.0 - 1e-9, true), (1.0 - 1e-6, true), (1.0 + 1e-9, false), (1.0 + 1e-3, false)] {
            let at = direction * radius;
            assert_eq!((disk.contains(&at), plate.contains(&at)), (inside, !inside), "{radius} at {k}");
        }
    }
    let rim = |count: usize| {
        (0..count).map(move |k| {
            let angle = std::f64::consts::TAU * k as f64 / count as f64;
            Point::<2>::new(angle.cos(), angle.sin())
        })
    };
    let inner = |count: usize, radius: f64| {
        let angle = std::f64::consts::PI / count as f64;
        [Point::<2>::zeros(), Point::<2>::new(angle.cos(), angle.sin()) * radius]
    };
    // Chords of 200 particles stand off the rim by 1.2e-4, those of the region's tolerance by up to 2e-3.
    let fine: Vec<Point<2>> = rim(200).chain(inner(200, 0.9996)).collect();
    let triangles = Triangulation::of_particles(&disk, &fine).unwrap();
    assert_eq!(triangles.positions().len(), 202);
    let coarse: Vec<Point<2>> = rim(12).chain(inner(12, 0.99)).collect();
    match Triangulation::of_particles(&disk, &coarse) {
        Err(GeometryError::Shape { what, remedy, at }) => {
            assert!(what.contains("between an arc and the chord") && remedy.contains("on the arc"), "{what}: {remedy}");
            assert_eq!(at, coarse[13].as_slice());
        }
        other => panic!("{:?}", other.map(|_| ())),
    }
}
