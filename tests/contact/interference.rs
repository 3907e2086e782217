//! Parts that begin inside each other.

use approx::{abs_diff_eq, assert_abs_diff_eq};
use rkpm::Error;
use rkpm::prelude::*;
use rkpm::scene::Stages;
use rkpm::solve::EquilibriumPath;

const SHEAR: f64 = 0.5;
const BULK: f64 = 20.0;

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5 * SHEAR, BULK).unwrap()
}

fn solved(scene: &Scene<2>, scheme: &Scheme) -> (Problem<2>, EquilibriumPath) {
    let problem = scene.discretize(scheme).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    (problem, path)
}

fn quarter(name: &str, inner: f64, outer: f64) -> Region {
    let part = |what: &str| format!("{name} {what}");
    let outline = if inner > 0.0 {
        Outline::at([inner, 0.0])
            .line(&part("bottom"), [outer, 0.0])
            .arc(&part("rim"), [0.0, outer], [0.0, 0.0], Turn::Left)
            .line(&part("left"), [0.0, inner])
            .arc(&part("bore"), [inner, 0.0], [0.0, 0.0], Turn::Right)
    } else {
        Outline::at([0.0, 0.0])
            .line(&part("bottom"), [outer, 0.0])
            .arc(&part("rim"), [0.0, outer], [0.0, 0.0], Turn::Left)
            .line(&part("left"), [0.0, 0.0])
    };
    Region::new(outline).unwrap()
}

fn held(scene: Scene<2>, name: &str) -> Scene<2> {
    scene.prescribe(&*format!("{name} bottom"), 1, 0.0).prescribe(&*format!("{name} left"), 0, 0.0)
}

/// Mean of the pressures, weighted alike.
fn mean_pressure(problem: &Problem<2>, path: &EquilibriumPath) -> f64 {
    let fit = problem.contact(path.last(), "fit").unwrap();
    let pressures: Vec<f64> = fit.points.iter().filter(|p| p.is_active).map(|p| p.pressure).collect();
    pressures.iter().sum::<f64>() / pressures.len() as f64
}

/// A bush drawn a fifth less than its rigid shaft: its bore comes to lie on the shaft, whatever the stage; a shaft of rubber gives.
#[test]
fn large_interference_does_not_depend_on_the_stage() {
    let scene = |until: f64| {
        held(Scene::new(quarter("bush", 0.8, 2.0), PlaneStrain, rubber()), "bush")
            .contact("bush bore", RigidSurface::shaft([0.0, 0.0], 1.0).named("fit").interference(until))
    };
    let scheme = Scheme::default().particles([12]);
    let (problem, path) = solved(&scene(1.0), &scheme);
    let (other, later) = solved(&scene(0.3), &scheme);
    let (first, second) = (mean_pressure(&problem, &path), mean_pressure(&other, &later));
    assert_abs_diff_eq!(first / second, 1.0, epsilon = 1e-6);
    let fit = problem.contact(path.last(), "fit").unwrap();
    assert!(fit.points.iter().all(|p| p.is_active && abs_diff_eq!(p.gap, 0.0, epsilon = 1e-9)), "{fit:?}");
    // The bore lies on the shaft on the mean.
    let off = fit.points.iter().map(|p| (p.position.norm() - 1.0).abs()).fold(0.0, f64::max);
    assert!(off < 5e-3, "{off}");
    // Two bodies, deep in each other.
    let pair = Scene::assembly(PlaneStrain)
        .body("bush", quarter("bush", 0.8, 2.0), rubber())
        .body("shaft", quarter("shaft", 0.0, 1.0), rubber())
        .press_fit("shaft rim", "bush bore", "fit");
    let (problem, path) = solved(&held(held(pair, "bush"), "shaft"), &scheme);
    let both = mean_pressure(&problem, &path);
    assert!(both < first && both > 0.5 * first, "{both} {first}");
}

/// A bush cut from its surface takes a shaft in at most two iterations more than a lattice does, and presses on it as hard: a trace function of its surface
/// reaches over a large angle of the bore, and is one.
#[test]
fn cut_bores_take_shafts() {
    let shaft = || RigidSurface::cylinder([0.0; 3], [0.0, 0.0, 1.0], 1.05).named("shaft").interference(1.0);
    let pressed = |scene: Scene<3>, spacing: f64| {
        let problem = scene.discretize(&Scheme::default().spacing(spacing)).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let points = problem.contact(path.last(), "shaft").unwrap().points;
        (points.iter().map(|point| point.force.norm()).sum::<f64>(), path.iterations)
    };
    let (axis, bounds) = ([0.0, 0.0, 1.0], [([0.0; 3], [0.0, 0.0, 2.0]), ([0.0, 0.0, -0.1], [0.0, 0.0, 2.1])]);
    let part = Shape::cylinder(bounds[0].0, bounds[0].1, 2.0).minus(Shape::cylinder(bounds[1].0, bounds[1].1, 1.0));
    let part = part.solid(0.1).unwrap().name("bore", Select::cylinder([0.0; 3], axis, 1.0)).unwrap();
    let part = part.name("outer", Select::cylinder([0.0; 3], axis, 2.0)).unwrap();
    let (found, iterations) = pressed(Scene::new(&part, Solid, rubber()).hold("outer").contact("bore", shaft()), 0.4);
    let quarter = Mapped(|t: &Point<3>| {
        let (r, angle) = (1.0 + t[0], 0.5 * std::f64::consts::PI * t[1]);
        Point::<3>::new(r * angle.cos(), r * angle.sin(), 2.0 * t[2])
    });
    let quarter = Scene::new(quarter, Solid, rubber()).prescribe((1, Side::Min), 1, 0.0);
    let quarter = quarter.prescribe((1, Side::Max), 0, 0.0).hold((0, Side::Max)).contact((0, Side::Min), shaft());
    let (reference, fewest) = pressed(quarter, 0.25);
    let off = found / (4.0 * reference) - 1.0;
    println!("{iterations} and {fewest} iterations; force {off:.4}");
    assert!(iterations <= fewest + 2, "{iterations}, {fewest}");
    // Two and a half spacings across the wall.
    assert!(off.abs() < 0.03, "{off}");
}

/// Blocks between fixed ends that overlap: each gives by the half of it, with a uniform pressure.
#[test]
fn overlap_is_shared() {
    let overlap = 0.2;
    let (top, bottom, left) = ((1, Side::Max), (1, Side::Min), (0, Side::Min));
    let scene = Scene::assembly(PlaneStrain)
        .body("lower", Block::new([0.0, 0.0], [1.0, 1.0]), rubber())
        .body("upper", Block::new([0.0, 1.0 - overlap], [1.0, 2.0 - overlap]), rubber())
        .scheme_of("upper", |scheme| scheme.particles([7, 5]))
        .prescribe(Place::on(bottom).of("lower"), 1, 0.0)
        .prescribe(Place::on(left).of("lower"), 0, 0.0)
        .prescribe(Place::on(left).of("upper"), 0, 0.0)
        .prescribe(Place::on(top).of("upper"), 1, 0.0)
        .press_fit(Place::on(top).of("lower"), Place::on(bottom).of("upper"), "fit");
    let (problem, path) = solved(&scene, &Scheme::default().particles([5, 5]));
    for f in problem.deformation_gradients(path.last()).unwrap() {
        assert_abs_diff_eq!(f[(1, 1)], 1.0 - 0.5 * overlap, epsilon = 1e-8);
    }
}

#[test]
fn stages_that_are_none() {
    let block = || Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber());
    let refused = |scene: Scene<2>| scene.discretize(&Scheme::default().particles([4])).map(|_| ()).unwrap_err();
    let top = (1, Side::Max);
    for until in [0.0, -1.0, 2.0, f64::NAN] {
        let plane = RigidSurface::plane([0.0, 0.9], [0.0, -1.0]).interference(until);
        assert!(matches!(refused(block().contact(top, plane)), Error::Invalid(_)));
    }
    assert!(matches!(refused(block().with(ContactPair::itself(top, "fit").interference(1.0))), Error::Geometry(_)));
}

/// A bush shrunk on a thick sleeve, as radial lines: the pressure of Lamé's solution at a small interference, and both faces where the
/// other one is at a large one.
#[test]
fn shrink_fit_of_radial_lines() {
    let (shear, bulk) = (1.0, 30.0);
    let rubber = || Rubber::neo_hookean(0.5 * shear, bulk).unwrap();
    let [inner, joint, outer] = [3.0, 5.0, 8.0];
    let fit = |interference: f64| {
        let scene = Scene::assembly(RadialCylinder)
            .body("sleeve", Block::new([inner], [joint + interference]), rubber())
            .body("bush", Block::new([joint], [outer]), rubber())
            .press_fit(Place::on(Side::Max).of("sleeve"), Place::on(Side::Min).of("bush"), "fit");
        let problem = scene.discretize(&Scheme::default().particles([25])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        (problem, path)
    };
    let interference = 1e-4;
    let (problem, path) = fit(interference);
    // Plane strain: 1 − 2ν = 3µ/(3k + µ), both compliances at the joint over the pressure.
    let less = 3.0 * shear / (3.0 * bulk + shear);
    let give =
        |free: f64| joint / (2.0 * shear) * (less * joint * joint + free * free) / (joint * joint - free * free).abs();
    let pressure = interference / (give(inner) + give(outer));
    let found = problem.contact(path.last(), "fit").unwrap();
    assert_abs_diff_eq!(found.peak_pressure() / pressure, 1.0, epsilon = 2e-3);
    let (problem, path) = fit(0.6);
    let found = problem.contact(path.last(), "fit").unwrap();
    let places: Vec<f64> = found.points.iter().map(|point| point.position[0]).collect();
    assert_eq!(places.len(), 2);
    assert_abs_diff_eq!(places[0], places[1], epsilon = 1e-9);
    assert_abs_diff_eq!(found.points.iter().map(|point| point.force[0]).sum::<f64>(), 0.0, epsilon = 1e-9);
}

/// Bodies that are pressed into each other with all of their boundary are so where they overlap, and not from far side to far side: in the
/// plane and of radial lines, with the forces of the faces that meet.
#[test]
fn whole_boundaries_fit_where_bodies_overlap() {
    fn forces<const D: usize>(kinematics: impl Kinematics<D> + Clone + 'static) -> [f64; 2] {
        let up = D - 1;
        let block = |low: f64| {
            let (mut min, mut max) = ([0.0; D], [1.0; D]);
            (min[up], max[up]) = (low, low + 1.0);
            Block::new(min, max)
        };
        [true, false].map(|whole| {
            let face = |side: Side, of: &str| {
                let part = if whole { Part::Whole } else { (up, side).into() };
                Place::<D>::on(part).of(of)
            };
            let mut scene = Scene::assembly(kinematics.clone())
                .body("lower", block(3.0), rubber())
                .body("upper", block(3.9), rubber())
                .scheme_of("upper", |scheme| scheme.particles([5; D]))
                .prescribe(Place::on((up, Side::Min)).of("lower"), up, 0.0)
                .prescribe(Place::on((up, Side::Max)).of("upper"), up, 0.0)
                .press_fit(face(Side::Max, "lower"), face(Side::Min, "upper"), "fit");
            for axis in 0..up {
                for body in ["lower", "upper"] {
                    scene = scene.prescribe(Place::on((axis, Side::Min)).of(body), axis, 0.0);
                }
            }
            let problem = scene.discretize(&Scheme::default().particles([4; D])).unwrap();
            let path = problem.run().unwrap().completed().unwrap();
            problem.contact(path.last(), "fit").unwrap().force[up]
        })
    }
    for [whole, named] in [forces(RadialCylinder), forces(PlaneStrain)] {
        assert!(named < -0.01, "{named}");
        assert_abs_diff_eq!(whole / named, 1.0, epsilon = 1e-7);
    }
}

/// A fit of a later stage resolves the overlap that the bodies have come to by then, between two of them and with a rigid surface: that of
/// blocks that are drawn so. Apart, there is nothing to resolve.
#[test]
fn fits_of_later_stages_resolve_what_has_come_to_overlap() {
    let (scheme, by) = (Scheme::default().particles([5, 5]), 0.05);
    let low = |scene: Scene<2>| scene.hold(Place::from((1, Side::Min)).of("low"));
    let blocks = |from: f64| {
        let scene = Scene::assembly(PlaneStrain).body("low", Block::new([0.0, 0.0], [1.0, 1.0]), rubber());
        low(scene.body("high", Block::new([0.2, from], [0.8, from + 1.0]), rubber()))
    };
    let lid = || Place::from((1, Side::Max)).of("high");
    let pressed = |scene: Scene<2>| {
        scene.press_fit(Place::from((1, Side::Min)).of("high"), Place::from((1, Side::Max)).of("low"), "fit")
    };
    let drawn = solved(&pressed(blocks(1.0 - by).with(Condition::on(lid()).displacement([0.0, 0.0]))), &scheme);
    let led = |down: f64| blocks(1.1).with(Condition::on(lid()).displacement([0.0, -down]));
    let moved = Stages::new("down", led(0.1 + by)).then("fit", pressed).run(&scheme).unwrap();
    let force = |problem: &Problem<2>, path: &EquilibriumPath| problem.contact(path.last(), "fit").unwrap().force[1];
    let expected = force(&drawn.0, &drawn.1);
    assert!(expected.abs() > 0.01);
    assert_abs_diff_eq!(force(&moved[1].problem, &moved[1].path) / expected, 1.0, epsilon = 1e-8);
    let apart = Stages::new("down", led(0.05)).then("fit", pressed).run(&scheme).err().unwrap().to_string();
    assert!(apart.contains("apart where they begin"), "{apart}");

    let wall = |at: f64| RigidSurface::plane([0.0, at], [0.0, -1.0]).named("fit").interference(1.0);
    let block = || Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber());
    let (problem, path) = solved(&block().hold((1, Side::Min)).contact((1, Side::Max), wall(1.0 - by)), &scheme);
    let lifted = block().with(Condition::on((1, Side::Min)).displacement([0.0, by]));
    let stages = Stages::new("up", lifted).then("fit", move |scene| scene.contact((1, Side::Max), wall(1.0)));
    let moved = stages.run(&scheme).unwrap();
    let expected = force(&problem, &path);
    assert!(expected.abs() > 0.01);
    assert_abs_diff_eq!(force(&moved[1].problem, &moved[1].path) / expected, 1.0, epsilon = 1e-8);
}
