//! Coulomb's friction on rigid surfaces.

use approx::{assert_abs_diff_eq, assert_relative_eq, relative_eq};
use rkpm::prelude::*;

/// A block on a rough floor whose top is pressed down by 0.02 and then moved along as a table says.
fn block(friction: f64, along: &[(f64, f64)]) -> Scene<2> {
    let rubber = Rubber::mooney_rivlin(0.293, 0.177, 1410.0).unwrap();
    let mut pairs = vec![(0.0, 0.0)];
    pairs.extend(along);
    let pressed = Amplitude::table(vec![(0.0, 0.0), (0.2, 1.0), (1.0, 1.0)]).unwrap();
    Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber)
        .with(Condition::on((1, Side::Max)).component(1, -0.02).amplitude(pressed))
        .with(Condition::on((1, Side::Max)).component(0, 1.0).amplitude(Amplitude::table(pairs).unwrap()))
        .contact((1, Side::Min), RigidSurface::plane([0.0, 0.0], [0.0, 1.0]).friction(friction).named("floor"))
}

fn run(scene: &Scene<2>) -> (Problem<2>, rkpm::solve::EquilibriumPath) {
    let problem = scene.discretize(&Scheme::default().particles([13, 7])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    (problem, path)
}

/// Below the limit nothing on the floor moves; beyond it everything slides at μ times the normal force.
#[test]
fn sticks_below_and_slides_at_the_limit() {
    for friction in [0.1, 0.3] {
        let (problem, path) = run(&block(friction, &[(0.2, 0.0), (1.0, 0.4)]));
        let floor = problem.contact(path.last(), "floor").unwrap();
        assert!(floor.points.iter().filter(|p| p.is_active).all(|p| p.slips));
        let ratio = -floor.force[0] / floor.force[1];
        assert_relative_eq!(ratio, friction, max_relative = 1e-8);
        for point in floor.points.iter().filter(|p| p.is_active) {
            assert!(relative_eq!(-point.traction[0] / point.pressure, friction, max_relative = 1e-7), "{point:?}");
        }
    }
    let (problem, path) = run(&block(0.9, &[(0.2, 0.0), (1.0, 0.001)]));
    let pressed = path.steps.iter().find(|step| step.state.load == 0.2).unwrap();
    let before = problem.contact(&pressed.state, "floor").unwrap();
    let after = problem.contact(path.last(), "floor").unwrap();
    assert!(after.force[0] < 0.0 && after.force[0].abs() < 0.9 * after.force[1], "{}", after.force);
    // Trace functions stick on the mean; their particles move by what is left beside it.
    let moved = 0.001;
    let sliding = |trace: usize| {
        let since = path.steps.iter().filter(|step| step.state.load > 0.2);
        since.into_iter().any(|step| problem.contact(&step.state, "floor").unwrap().points[trace].slips)
    };
    for (trace, (a, b)) in before.points.iter().zip(&after.points).enumerate() {
        if b.is_active && !sliding(trace) {
            let (way, limit) = ((a.position - b.position).norm(), 0.9 * b.pressure);
            assert!(way < 1e-2 * moved && b.traction[0].abs() < limit, "{:?} moves by {way:e}", a.position);
        }
    }
    assert!(after.points.iter().filter(|p| p.is_active && !p.slips).count() > 8);
}

/// What the moved top puts in over a closed cycle is what friction takes.
#[test]
fn a_closed_cycle_balances() {
    let cycle: Vec<(f64, f64)> =
        [0.2, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0].into_iter().zip([0.0, 0.1, -0.1, 0.1, -0.1, 0.1, 0.1]).collect();
    let (problem, path) = run(&block(0.1, &cycle));
    let top = |state: &rkpm::solve::State| problem.reaction(state, (1, Side::Max)).unwrap()[0];
    let moved = |state: &rkpm::solve::State| problem.displacement(state, &[1.0, 1.0].into()).unwrap()[0];
    // From the second forth to the third: the same state.
    let from = path.steps.iter().position(|step| step.state.load == 0.6).unwrap();
    let to = path.steps.iter().position(|step| step.state.load == 0.9).unwrap();
    let mut work = 0.0;
    for pair in path.steps[from..=to].windows(2) {
        let (a, b) = (&pair[0].state, &pair[1].state);
        work += 0.5 * (top(a) + top(b)) * (moved(b) - moved(a));
    }
    let until = |last: usize| {
        let mut part = path.clone();
        part.steps.truncate(last + 1);
        problem.friction_work(&part, "floor").unwrap()
    };
    let taken = until(to) - until(from);
    let kept = path.steps[to].energy - path.steps[from].energy;
    assert!(taken > 0.0, "{taken}");
    assert_abs_diff_eq!(work, taken + kept, epsilon = 1e-6 * taken);
}

/// Units: the same iterations and digits with friction as well.
#[test]
fn units_do_not_matter() {
    let run = |metre: f64, pascal: f64| {
        let rubber = Rubber::neo_hookean(0.4 * pascal, 400.0 * pascal).unwrap();
        let floor = RigidSurface::plane([0.0, 0.0], [0.0, 1.0]).friction(0.2).named("floor");
        let scene = Scene::new(Block::new([0.0, 0.0], [2.0 * metre, metre]), PlaneStrain, rubber)
            .prescribe((1, Side::Max), 1, -0.1 * metre)
            .prescribe((1, Side::Max), 0, 0.2 * metre)
            .contact((1, Side::Min), floor);
        let problem = scene.discretize(&Scheme::default().particles([9, 5])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let floor = problem.contact(path.last(), "floor").unwrap();
        (path.iterations, floor.force[0] / (metre * pascal))
    };
    let (first, second) = (run(1.0, 1e6), run(1e3, 1.0));
    assert_eq!(first.0, second.0);
    assert_abs_diff_eq!(first.1 / second.1, 1.0, epsilon = 1e-10);
}

/// In space: a block sliding askew carries its friction against the way it goes.
#[test]
fn askew_in_space() {
    let rubber = Rubber::neo_hookean(0.4, 40.0).unwrap();
    let floor = RigidSurface::plane([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]).friction(0.2).named("floor");
    let scene = Scene::new(Block::new([0.0, 0.0, 0.0], [1.0, 1.0, 0.5]), Solid, rubber)
        .prescribe((2, Side::Max), 2, -0.02)
        .prescribe((2, Side::Max), 0, 0.3)
        .prescribe((2, Side::Max), 1, 0.4)
        .contact((2, Side::Min), floor);
    let problem = scene.discretize(&Scheme::default().particles([4, 4, 3])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let floor = problem.contact(path.last(), "floor").unwrap();
    for point in floor.points.iter().filter(|p| p.is_active) {
        let along = (point.traction[0].powi(2) + point.traction[1].powi(2)).sqrt();
        assert!(point.slips && relative_eq!(along / point.pressure, 0.2, max_relative = 1e-7), "{point:?}");
    }
    let ratio = floor.force[0] / floor.force[1];
    assert!(floor.force[0] < 0.0);
    assert_abs_diff_eq!(ratio, 0.75, epsilon = 0.03);
}

/// In space a slip has a direction, which turns with what the block does: each point that slides is rubbed against it, at μ times its
/// pressure, and steps come to rest in a few iterations. Six blocks, drawn.
#[test]
fn slides_against_its_slip_in_space() {
    let mut random = fastrand::Rng::with_seed(31);
    for _ in 0..6 {
        let mut between = |low: f64, high: f64| low + (high - low) * random.f64();
        let (friction, bulk) = (between(0.1, 0.5), 10f64.powf(between(0.5, 3.0)));
        let sides = [between(0.7, 1.6), between(0.7, 1.6), 1.0];
        let (down, angle, aside) = (between(0.04, 0.12), between(0.0, 6.0), between(0.02, 0.3));
        let along = [aside * angle.cos(), aside * angle.sin()];
        let rubber = Rubber::neo_hookean(0.5, bulk).unwrap();
        let plate = RigidSurface::plane([0.0, 0.0, 1.0], [0.0, 0.0, -1.0])
            .moving([along[0], along[1], -down])
            .friction(friction)
            .named("plate");
        let scene =
            Scene::new(Block::new([0.0; 3], sides), Solid, rubber).hold((2, Side::Min)).contact((2, Side::Max), plate);
        let what = format!("{sides:?} {bulk} {friction} {down} {along:?}");
        let problem = scene.discretize(&Scheme::default().particles([4, 4, 4])).unwrap();
        // Four particles along a side are too few for an answer.
        let path = problem.run().unwrap().reached().unwrap_or_else(|error| panic!("{what}: {error}"));
        for step in &path.steps {
            assert!(step.iterations <= 20, "{what}: {} iterations", step.iterations);
        }
        let contact = |state: &rkpm::solve::State| problem.contact(state, "plate").unwrap();
        let steps = path.steps.len();
        let (before, now) = (contact(&path.steps[steps - 2].state), contact(path.last()));
        let moved = now.travel - before.travel;
        let mut slides = 0;
        for (was, point) in before.points.iter().zip(&now.points).filter(|(_, point)| point.is_active) {
            let tangential = Point::<3>::new(point.traction[0], point.traction[1], 0.0);
            assert!(tangential.norm() <= friction * point.pressure * (1.0 + 1e-6), "{what}: {point:?}");
            if !point.slips {
                continue;
            }
            slides += 1;
            assert!(
                relative_eq!(tangential.norm(), friction * point.pressure, max_relative = 1e-5),
                "{what}: {point:?}"
            );
            // The particle is near the mean of its trace function.
            let slip = point.position - was.position - moved;
            let slip = Point::<3>::new(slip[0], slip[1], 0.0);
            if slip.norm() > 2e-3 {
                let cosine = tangential.dot(&slip) / (tangential.norm() * slip.norm());
                assert!(cosine < -0.9, "{what}: {cosine} at {:?}", point.reference);
            }
        }
        assert!(slides > 0 || aside < 0.1, "{what}: nothing slides");
    }
}

/// A tube between planes of symmetry that is pressed on a shaft does not slip, so that friction changes nothing: conditions at the edges of
/// the face fix what sticking would fix again. With both, tractions are undetermined and Newton's method finds no state.
#[test]
fn edges_that_conditions_keep_take_no_friction() {
    let rubber = Rubber::neo_hookean(0.5, 200.0).unwrap();
    let tube = |friction: f64, scheme: &Scheme| {
        let shaft = RigidSurface::plane([5.02, 0.0], [1.0, 0.0]).interference(1.0).friction(friction);
        let scene = Scene::new(Block::new([5.0, 0.0], [9.0, 4.0]), Axisymmetric, rubber.clone())
            .prescribe((1, Side::Min), 1, 0.0)
            .prescribe((1, Side::Max), 1, 0.0)
            .contact(Side::Min, shaft.named("shaft"));
        let problem = scene.discretize(scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        (problem.contact(path.last(), "shaft").unwrap().force, path.iterations)
    };
    let particles = |along: usize| Scheme::default().particles([9, along]);
    // Of seven cells three share a zone at one end, which is not symmetric: particles move by 1e-6, and friction holds them.
    for (scheme, axial) in [(particles(8), 1e-4), (particles(9), 1e-10), (Scheme::elements(2).particles([9, 9]), 1e-10)]
    {
        let (smooth, _) = tube(0.0, &scheme);
        for friction in [0.05, 0.3, 100.0] {
            let (rough, iterations) = tube(friction, &scheme);
            // Friction takes ten steps, of one or two iterations where nothing slips.
            assert!(iterations <= 25, "{friction}: {iterations} iterations");
            assert_relative_eq!(rough[0], smooth[0], max_relative = 1e-6);
            assert_abs_diff_eq!(rough[1], 0.0, epsilon = axial * smooth[0].abs());
        }
    }
    // Of a block that gives to one side a rough lid takes more than a smooth one, and no more than one that it is bonded to.
    let cube = || {
        let block = Block::new([0.0; 3], [1.0; 3]);
        let mut scene = Scene::new(block, Solid, Rubber::neo_hookean(0.5, 20.0).unwrap());
        for (axis, side) in [(0, Side::Min), (0, Side::Max), (1, Side::Min), (2, Side::Min)] {
            scene = scene.prescribe((axis, side), axis, 0.0);
        }
        scene
    };
    let pressed = |scene: Scene<3>| {
        let problem = scene.discretize(&Scheme::default().particles([5, 5, 4])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        // Ten steps with friction, of at most six iterations where part of the face slips.
        assert!(path.iterations <= 60, "{} iterations", path.iterations);
        problem.reaction(path.last(), (2, Side::Min)).unwrap()[2]
    };
    let lid = |friction: f64| {
        let lid = RigidSurface::plane([0.0, 0.0, 1.0], [0.0, 0.0, -1.0]).moving([0.0, 0.0, -0.05]);
        pressed(cube().contact((2, Side::Max), lid.friction(friction)))
    };
    let bonded = pressed(cube().with(Condition::on((2, Side::Max)).displacement([0.0, 0.0, -0.05])));
    let (smooth, rough, rougher) = (lid(0.0), lid(0.2), lid(0.5));
    assert!(smooth < rough && rough < rougher && rougher < bonded, "{smooth}, {rough}, {rougher}, {bonded}");
}

/// Beside a rigid body that moves along a wall, and beside a face that a later stage moves back, all of the wall has its friction: the
/// equations there hold nothing.
#[test]
fn friction_acts_beside_what_moves() {
    let rubber = Rubber::neo_hookean(0.5, 100.0).unwrap();
    let wall = RigidSurface::plane([1.0, 0.0], [-1.0, 0.0]).friction(0.3).named("wall");
    let pressed = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber)
        .pressure((0, Side::Min), 0.05)
        .contact((0, Side::Max), wall);
    let ratio = |problem: &Problem<2>, state: &rkpm::solve::State| {
        let force = problem.contact(state, "wall").unwrap().force;
        (force[1] / force[0]).abs()
    };
    let scheme = Scheme::default().particles([5, 5]);
    let plate = pressed.clone().rigid("plate", (1, Side::Max)).with(Condition::on("plate").component(1, 0.2));
    let (problem, path) = {
        let problem = plate.discretize(&scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        (problem, path)
    };
    assert_relative_eq!(ratio(&problem, path.last()), 0.3, max_relative = 1e-6);
    let stages =
        rkpm::scene::Stages::new("up", pressed.with(Condition::on((1, Side::Max)).component(1, 0.2).named("up")))
            .then("down", |scene| scene.without("up").prescribe((1, Side::Max), 1, 0.0));
    let done = stages.run(&scheme).unwrap();
    for stage in &done {
        assert_relative_eq!(ratio(&stage.problem, stage.path.last()), 0.3, max_relative = 1e-6);
    }
}

/// A contact that is replaced by one of its name goes on with its pressures, with friction or without, whether the surface turns or not.
#[test]
fn pressures_go_on_where_friction_comes_and_goes() {
    let rubber = Rubber::neo_hookean(0.5, 100.0).unwrap();
    let block = Scene::new(Block::new([0.0, 0.0], [4.0, 1.0]), PlaneStrain, rubber).hold((1, Side::Min));
    fn tool(height: f64, friction: f64) -> RigidSurface<2> {
        RigidSurface::shaft([2.0, height], 1.0).friction(friction).named("tool")
    }
    for (before, then, angle) in [(0.0, 0.3, 0.0), (0.3, 0.0, 0.0), (0.3, 0.3, 0.05)] {
        let sunk = block.clone().contact((1, Side::Max), tool(2.0, before).moving([0.0, -0.2]));
        let next = move |scene: Scene<2>| {
            let again = tool(1.8, then);
            let again = if angle > 0.0 { again.turning([2.0, 1.8], angle) } else { again };
            scene.without("tool").contact((1, Side::Max), again)
        };
        let stages = rkpm::scene::Stages::new("press", sunk).then("again", next);
        let done = stages.run(&Scheme::default().particles([17, 5])).unwrap();
        let pressures = |stage: usize, state: &rkpm::solve::State| -> Vec<f64> {
            let found = done[stage].problem.contact(state, "tool").unwrap();
            found.points.iter().filter(|point| point.is_active).map(|point| point.pressure).collect()
        };
        let (ended, begun) = (pressures(0, done[0].path.last()), pressures(1, &done[1].path.start));
        assert!(ended.len() > 1 && ended.len() == begun.len(), "{ended:?} {begun:?}");
        for (begun, ended) in begun.iter().zip(&ended) {
            assert_relative_eq!(begun, ended, max_relative = 1e-9);
        }
    }
}
