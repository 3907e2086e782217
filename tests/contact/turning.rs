//! Rigid surfaces that turn by an angle or under a moment.

use approx::{assert_abs_diff_eq, assert_relative_eq};
use rkpm::prelude::*;
use rkpm::scene::Stages;
use rkpm::solve::{EquilibriumPath, Rhs};

const RADIUS: f64 = 0.5;

fn rubber() -> Rubber {
    Rubber::mooney_rivlin(0.293, 0.177, 100.0).unwrap()
}

/// A rubber layer held at its base and a roller above it that is pressed in and then does something else.
fn rolled(sunk: f64, then: impl Fn(RigidSurface<2>) -> RigidSurface<2>) -> (Problem<2>, EquilibriumPath) {
    let shaft = RigidSurface::shaft([0.0, 1.0 + RADIUS - sunk], RADIUS).named("roller");
    let scene = Scene::new(Block::new([-2.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
        .hold((1, Side::Min))
        .contact((1, Side::Max), then(shaft));
    let problem = scene.discretize(&Scheme::default().particles([33, 7])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    println!("{} iterations in {} steps", path.iterations, path.steps.len());
    (problem, path)
}

/// Moment on the body about a point.
fn about(state: &rkpm::scene::ContactState<2>, at: [f64; 2]) -> f64 {
    state.moment[2] - (at[0] * state.force[1] - at[1] * state.force[0])
}

fn pressed_until(load: f64) -> Amplitude {
    Amplitude::table(vec![(0.0, 0.0), (load, 1.0), (1.0, 1.0)]).unwrap()
}

fn from(load: f64) -> Amplitude {
    Amplitude::table(vec![(0.0, 0.0), (load, 0.0), (1.0, 1.0)]).unwrap()
}

/// A roller turned far beyond the limit slides everywhere: its torque is the radius times μ times the sum of the pressures. The work of
/// friction is the torque times the turn once all slides.
#[test]
fn a_turned_roller_slides() {
    let (friction, down, angle) = (0.3, 0.1, 0.6);
    let (problem, path) = rolled(0.0, |shaft| {
        shaft
            .moving_along([0.0, -down], pressed_until(0.3))
            .turning([0.0, 1.0 + RADIUS], angle)
            .turning_along(from(0.3))
            .friction(friction)
    });
    let roller = problem.contact(path.last(), "roller").unwrap();
    assert_abs_diff_eq!(roller.angle, angle, epsilon = 1e-12);
    let centre = [0.0, 1.0 + RADIUS - down];
    let torque = about(&roller, centre);
    let mut expected = 0.0;
    for point in roller.points.iter().filter(|point| point.is_active) {
        assert!(point.slips);
        let normal = (point.position - Point::<2>::from(centre)).normalize();
        expected += friction * point.force.dot(&normal) * RADIUS;
    }
    println!("torque {torque}, {expected}");
    assert!(torque > 0.0);
    assert_abs_diff_eq!(torque / expected, 1.0, epsilon = 2e-3);
    // Over the last step.
    let last = path.steps.len() - 1;
    let mut part = path.clone();
    part.steps.truncate(last);
    let work = problem.friction_work(&path, "roller").unwrap() - problem.friction_work(&part, "roller").unwrap();
    let turned = angle - problem.contact(&path.steps[last - 1].state, "roller").unwrap().angle;
    assert_abs_diff_eq!(work / (torque * turned), 1.0, epsilon = 0.02);
}

/// A roller that is driven by a moment below the limit turns until the layer balances it.
#[test]
fn a_driven_roller_is_balanced() {
    let moment = 5e-3;
    let (problem, path) = rolled(0.0, |shaft| {
        shaft
            .moving_along([0.0, -0.1], pressed_until(0.3))
            .driven([0.0, 1.0 + RADIUS], moment)
            .turning_along(from(0.3))
            .friction(0.5)
    });
    let roller = problem.contact(path.last(), "roller").unwrap();
    let torque = about(&roller, [0.0, 0.9 + RADIUS]);
    println!("torque {torque}, angle {}", roller.angle);
    assert_relative_eq!(torque, moment, max_relative = 1e-7);
    assert!(roller.angle > 0.0 && roller.angle < 0.2, "{}", roller.angle);
}

/// A roller that is drawn along and free to turn rolls, without a moment.
#[test]
fn a_drawn_roller_rolls() {
    let (way, sunk) = (0.3, 0.1);
    let (problem, path) = rolled(sunk, |shaft| {
        let about = [0.0, 1.0 + RADIUS - sunk];
        shaft.moving_along([way, 0.0], from(0.2)).driven(about, 0.0).friction(0.5).interference(0.2)
    });
    let roller = problem.contact(path.last(), "roller").unwrap();
    println!("angle {}", roller.angle);
    assert_abs_diff_eq!(about(&roller, [way, 1.0 + RADIUS - sunk]), 0.0, epsilon = 1e-8 * roller.force[1].abs());
    assert_abs_diff_eq!(roller.angle * RADIUS / way, -1.0, epsilon = 0.15);
}

/// A plate pushed beside the middle of a block tilts about where it is pushed until it has no moment there.
#[test]
fn a_plate_tilts() {
    let at = [1.2, 1.0];
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).hold((1, Side::Min)).contact(
        (1, Side::Max),
        RigidSurface::plane(at, [0.0, -1.0]).pushed([0.0, -0.2]).driven(at, 0.0).named("plate"),
    );
    let problem = scene.discretize(&Scheme::default().particles([13, 7])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let plate = problem.contact(path.last(), "plate").unwrap();
    println!("angle {}, travel {}, {} iterations", plate.angle, plate.travel, path.iterations);
    assert_abs_diff_eq!(plate.force[1], -0.2, epsilon = 1e-9);
    assert!(plate.travel[1] < 0.0);
    assert!(plate.angle < -1e-3 && plate.angle > -0.2);
    let now = [at[0] + plate.travel[0], at[1] + plate.travel[1]];
    assert_abs_diff_eq!(about(&plate, now), 0.0, epsilon = 1e-9);
}

/// In space a plate that turns about its normal under friction takes a body's top along.
#[test]
fn a_plate_twists_in_space() {
    let scene =
        Scene::new(Block::new([-0.5, -0.5, 0.0], [0.5, 0.5, 0.5]), Solid, rubber()).hold((2, Side::Min)).contact(
            (2, Side::Max),
            RigidSurface::plane([0.0, 0.0, 0.5], [0.0, 0.0, -1.0])
                .moving_along([0.0, 0.0, -0.05], pressed_until(0.3))
                .turning([0.0, 0.0, 0.5], [0.0, 0.0, 2.0], 0.2)
                .turning_along(from(0.3))
                .friction(2.0)
                .named("plate"),
        );
    let problem = scene.discretize(&Scheme::default().particles([5, 5, 4])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let plate = problem.contact(path.last(), "plate").unwrap();
    let at: Point<3> = [0.25, 0.25, 0.5].into();
    let u = problem.displacement(path.last(), &at).unwrap();
    let (sine, cosine) = 0.2f64.sin_cos();
    let turned = [0.25 * (cosine - 1.0 - sine), 0.25 * (cosine - 1.0 + sine)];
    println!("{u} {turned:?} {} iterations", path.iterations);
    assert_abs_diff_eq!(u[0], turned[0], epsilon = 0.01);
    assert_abs_diff_eq!(u[1], turned[1], epsilon = 0.01);
    assert!(plate.moment[2] > 0.0);
}

/// The force of friction is its traction, however far the surface turns in a step: that of all points is the force of the base on the
/// layer, and a stage that changes nothing leaves it. A roller that slides all over has the same force by few and by many steps.
#[test]
fn friction_of_a_turn_does_not_depend_on_its_steps() {
    let roller = RigidSurface::shaft([0.0, 1.0 + RADIUS], RADIUS)
        .moving_along([0.0, -0.1], pressed_until(0.5))
        .turning([0.0, 1.0 + RADIUS], 0.6)
        .turning_along(from(0.5))
        .friction(0.3)
        .named("roller");
    let layer = Scene::new(Block::new([-2.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
        .hold((1, Side::Min))
        .contact((1, Side::Max), roller);
    let found = [0.1, 0.02].map(|step| {
        let stepping = Stepping { first: step, largest: step, ..Stepping::default() };
        let scheme = Scheme::default().particles([33, 7]).stepping(stepping);
        let stages = Stages::new("turn", layer.clone()).then("stay", |scene| scene).run(&scheme).unwrap();
        let forces = [0, 1].map(|k| {
            let (problem, state) = (&stages[k].problem, stages[k].path.last());
            let force = problem.contact(state, "roller").unwrap().force;
            let base = problem.reaction(state, (1, Side::Min)).unwrap();
            assert_abs_diff_eq!(force, -base, epsilon = 1e-8);
            force
        });
        // Newton's tolerance.
        assert_abs_diff_eq!(forces[0], forces[1], epsilon = 1e-7);
        let path = &stages[0].path;
        println!("{} iterations in {} steps: {}", path.iterations, path.steps.len(), forces[0].transpose());
        (path.steps.len(), forces[0])
    });
    let [(few, first), (many, second)] = found;
    assert!(few < many && first[0] > 0.05, "{few} {many} {first}");
    assert_abs_diff_eq!(first, second, epsilon = 1e-6 * first.norm());
}

/// The solution for a unit of the load is the slope of the path, where a round surface moves sideways over a body, where a cam turns, and where
/// one that is free to turn rises. What contacts give in one solution is as much as their stiffness of an iteration, 1e4 shear moduli.
#[test]
fn a_unit_of_the_load_is_the_slope_of_the_path() {
    const CENTRE: [f64; 2] = [0.0, 1.0 + RADIUS];
    const BESIDE: [f64; 2] = [0.3, 1.0 + RADIUS];
    let moved = |shaft: RigidSurface<2>| shaft.moving([0.1, -0.3]);
    let cam = |shaft: RigidSurface<2>| shaft.turning(BESIDE, 0.5);
    let both = |shaft: RigidSurface<2>| shaft.moving([0.05, -0.2]).turning(BESIDE, 0.3);
    let free = |shaft: RigidSurface<2>| shaft.moving([0.0, -0.2]).driven(BESIDE, 0.05);
    for (way, then) in [moved as fn(RigidSurface<2>) -> RigidSurface<2>, cam, both, free].into_iter().enumerate() {
        let scene = Scene::new(Block::new([-1.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber())
            .hold((1, Side::Min))
            .contact((1, Side::Max), then(RigidSurface::shaft(CENTRE, RADIUS)));
        let problem = scene.discretize(&Scheme::default().particles([17, 5])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        for load in [0.6, 0.9] {
            let by = 1e-4;
            let states = problem.states_at(&path, &[load - by, load, load + by]).unwrap();
            let mut equilibrium = problem.equilibrium().unwrap();
            equilibrium.linearize(&states[1]).unwrap();
            let slope = equilibrium.solve(Rhs::Load).unwrap().displacement;
            let (mut off, mut size) = (0.0, 0.0);
            for (k, slope) in slope.iter().enumerate() {
                let difference = (states[2].displacement[k] - states[0].displacement[k]) / (2.0 * by);
                off += (slope - difference).powi(2);
                size += difference.powi(2);
            }
            assert!(off < 1e-6 * size, "way {way}, load factor {load}: off by {:.1e}", (off / size).sqrt());
        }
    }
}
