//! Rigid bodies: held, moved, loaded; their forces and moments balance those of the opposite face.

use std::sync::Arc;

use approx::{abs_diff_eq, assert_abs_diff_eq};
use nalgebra::{Matrix2, Matrix3, Rotation3, Vector3};
use rkpm::prelude::*;
use rkpm::scene::{ConstraintKind, RigidMotion};

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 1e3).unwrap()
}

fn block() -> Scene<2> {
    Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).hold((1, Side::Min))
}

fn schemes() -> [Scheme; 2] {
    [Scheme::default().particles([9, 5]), Scheme::elements(2).particles([9, 5])]
}

/// A quarter turn about the middle of the plate, and a shift.
fn turn(x: &Point<2>, load: f64) -> [f64; 2] {
    let (sin, cos) = (0.5 * std::f64::consts::FRAC_PI_2 * load).sin_cos();
    let (a, b) = (x[0] - 1.0, x[1] - 1.0);
    [cos * a - sin * b - a + 0.2 * load, sin * a + cos * b - b + 0.1 * load]
}

#[test]
fn a_moved_rigid_body_is_a_face_moved_the_same_way() {
    for scheme in schemes() {
        let solve = |scene: Scene<2>, place: Place<2>| {
            let problem = scene.discretize(&scheme).unwrap();
            // Coarse for a quarter turn.
            let path = problem.run().unwrap().reached().unwrap();
            let (force, moment) = (
                problem.reaction(path.last(), place.clone()).unwrap(),
                problem.moment(path.last(), place, [0.0, 0.0]).unwrap()[2],
            );
            (problem.energy(path.last()).unwrap(), force, moment)
        };
        let top = || Place::on((1, Side::Max));
        for value in [Value::Constant([0.3, -0.05]), Value::motion(turn)] {
            let face = solve(block().with(Condition::on(top()).displacement(value.clone())), top());
            let scene = block().rigid("plate", top()).with(Condition::on("plate").displacement(value));
            let rigid = solve(scene, Place::on("plate"));
            assert_abs_diff_eq!(rigid.0 / face.0, 1.0, epsilon = 1e-9);
            assert_abs_diff_eq!(rigid.1, face.1, epsilon = 5e-8 * face.1.norm());
            assert_abs_diff_eq!(rigid.2, face.2, epsilon = 1e-7 * face.2.abs());
        }
    }
}

#[test]
fn a_loaded_rigid_body_balances_the_opposite_face() {
    for scheme in schemes() {
        let (force, moment, at) = ([0.05, -0.1], 0.06, [1.4, 1.2]);
        let scene = block()
            .rigid("plate", (1, Side::Max))
            .with(Load::force(Place::at(at).of("plate"), force))
            .with(Load::moment("plate", [0.0, 0.0, moment]));
        let problem = scene.discretize(&scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let state = path.last();
        let motion = problem.rigid_motion(state, "plate").unwrap();
        let rotation = motion.rotation;
        assert_abs_diff_eq!(rotation.transpose() * rotation, Matrix2::identity(), epsilon = 3e-11);
        assert!(rotation[(1, 0)].abs() > 1e-3, "{rotation}");
        let held = problem.reaction(state, (1, Side::Min)).unwrap();
        let plate = problem.reaction(state, "plate").unwrap();
        assert_abs_diff_eq!(held, -Point::<2>::from(force), epsilon = 5e-9 * held.norm());
        assert_abs_diff_eq!(plate, Point::<2>::from(force), epsilon = 5e-9 * held.norm());
        let arm = Point::<2>::from(at) - motion.centre;
        let now = motion.centre + motion.displacement + rotation * arm;
        let applied = now[0] * force[1] - now[1] * force[0] + moment;
        let of = |place: Place<2>| problem.moment(state, place, [0.0, 0.0]).unwrap()[2];
        let (below, above) = (of(Place::on((1, Side::Min))), of(Place::on("plate")));
        assert_abs_diff_eq!(below, -applied, epsilon = 1e-8);
        assert_abs_diff_eq!(above, applied, epsilon = 1e-8);
        // The face moved the same way has the same energy.
        let (centre, shift) = (motion.centre, motion.displacement);
        let way = Value::field(move |x: &Point<2>| (rotation * (x - centre) - (x - centre) + shift).into());
        let moved = block().with(Condition::on((1, Side::Max)).displacement(way)).discretize(&scheme).unwrap();
        let same = moved.energy(moved.run().unwrap().completed().unwrap().last()).unwrap();
        assert_abs_diff_eq!(same / problem.energy(state).unwrap(), 1.0, epsilon = 1e-8);
    }
}

#[test]
fn a_plate_in_space_turns_as_its_moment_asks() {
    let cube = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber()).hold((2, Side::Min));
    let scene = cube
        .rigid("plate", (2, Side::Max))
        .with(Load::force("plate", [0.02, 0.01, -0.05]))
        .with(Load::moment("plate", [0.005, -0.01, 0.05]));
    let problem = scene.discretize(&Scheme::default().particles([4])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let state = path.last();
    let motion = problem.rigid_motion(state, "plate").unwrap();
    assert_abs_diff_eq!(motion.rotation.transpose() * motion.rotation, Matrix3::identity(), epsilon = 3e-11);
    assert!(Rotation3::from_matrix(&motion.rotation).angle() > 0.2);
    let force = Vector3::new(0.02, 0.01, -0.05);
    let applied = (motion.centre + motion.displacement).cross(&force) + Vector3::new(0.005, -0.01, 0.05);
    for (place, sign) in [(Place::on((2, Side::Min)), -1.0), (Place::on("plate"), 1.0)] {
        let found = problem.reaction(state, place.clone()).unwrap();
        assert_abs_diff_eq!(found, force * sign, epsilon = 5e-9);
        let moment = Vector3::from(problem.moment(state, place, [0.0; 3]).unwrap());
        assert_abs_diff_eq!(moment, applied * sign, epsilon = 5e-9);
    }
}

/// A plate between two bonded pads, pushed at a point: free to turn there, it turns; by its name, it does not.
#[test]
fn points_of_rigid_bodies_leave_them_free_to_turn() {
    let scene = |place: Place<2>| {
        block()
            .rigid("plate", (1, Side::Max))
            .with(Condition::on(place).component(0, 0.3).named("push"))
            .with(Load::force("plate", [0.0, -0.05]))
    };
    let turned = |scene: Scene<2>| {
        let problem = scene.discretize(&Scheme::default().particles([9, 5])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let pushed = problem.reaction(path.last(), "push").unwrap();
        assert_abs_diff_eq!(
            problem.reaction(path.last(), "plate").unwrap() - pushed,
            Point::<2>::new(0.0, -0.05),
            epsilon = 5e-10
        );
        problem.rigid_motion(path.last(), "plate").unwrap().rotation[(1, 0)]
    };
    assert_abs_diff_eq!(turned(scene(Place::on("plate"))), 0.0, epsilon = 1e-9);
    assert!(turned(scene(Place::at([1.0, 1.0]).of("plate"))).abs() > 1e-3);
}

/// GOAL: a rigid ring on a body of revolution is a bonded plate: it moves along the axis alone, by a force or a displacement.
#[test]
fn rigid_rings_of_revolution_move_along_their_axis() {
    let bush = || Scene::new(Block::new([1.0, 0.0], [2.0, 1.0]), Axisymmetric, rubber()).hold((1, Side::Min));
    let scheme = Scheme::default().particles([6, 6]);
    let held = bush().with(Condition::on((1, Side::Max)).displacement([0.0, -0.2]).named("plate"));
    let held = held.discretize(&scheme).unwrap();
    // Coarse at its edges.
    let path = held.run().unwrap().reached().unwrap();
    let force = held.reaction(path.last(), "plate").unwrap()[1];
    let pressed = bush().rigid("plate", (1, Side::Max)).with(Load::force("plate", [0.0, force]));
    let moved = bush().rigid("plate", (1, Side::Max)).with(Condition::on("plate").component(1, -0.2));
    for scene in [pressed, moved] {
        let problem = scene.discretize(&scheme).unwrap();
        let found = problem.run().unwrap().reached().unwrap();
        let motion = problem.rigid_motion(found.last(), "plate").unwrap();
        assert!(
            abs_diff_eq!(motion.displacement[1], -0.2, epsilon = 1e-7)
                && abs_diff_eq!(motion.displacement[0], 0.0, epsilon = 1e-12),
            "{motion:?}"
        );
        assert_abs_diff_eq!(problem.reaction(found.last(), "plate").unwrap()[1] / force, 1.0, epsilon = 1e-7);
        let energies = [problem.energy(found.last()).unwrap(), held.energy(path.last()).unwrap()];
        assert_abs_diff_eq!(energies[0] / energies[1], 1.0, epsilon = 1e-7);
    }
}

#[test]
fn rigid_bodies_that_nothing_holds_are_refused() {
    let free = || Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).rigid("plate", (1, Side::Max));
    let refused = |scene: Scene<2>| scene.discretize(&Scheme::default().particles([5, 4])).err().unwrap();
    let error = refused(free().with(Load::force("plate", [0.0, 1.0])));
    assert!(matches!(error, Error::Boundary(rkpm::error::BoundaryError::Free { .. })), "{error}");
    let half = free().with(Condition::on("plate").component(1, 0.1));
    assert!(refused(half.clone()).to_string().contains("rigid body plate can move freely, without any force"));
    half.with(Load::elastic_foundation((1, Side::Min), 1.0)).discretize(&Scheme::default().particles([5, 4])).unwrap();
    let all =
        block().prescribe((1, Side::Max), 0, 0.0).prescribe((1, Side::Max), 1, 0.0).rigid("plate", (1, Side::Max));
    assert!(refused(all).to_string().contains("rigid body plate, all of whose parts"));
    assert!(refused(block().rigid("plate", (1, Side::Max)).pressure("plate", 0.1)).to_string().contains("rigid body"));
    assert!(refused(block().with(Load::moment("top", [0.0; 3]))).to_string().contains("rigid body"));
    let revolved = || {
        let block = Scene::new(Block::new([1.0, 0.0], [2.0, 1.0]), Axisymmetric, rubber()).hold((1, Side::Min));
        block.rigid("plate", (1, Side::Max))
    };
    assert!(refused(revolved().with(Load::moment("plate", [0.0; 3]))).to_string().contains("an axisymmetric body"));
    let wider = revolved().with(Condition::on("plate").displacement([0.1, 0.0]));
    assert!(refused(wider).to_string().contains("a rigid ring keeps its radius"));
    let problem = block().rigid("plate", (1, Side::Max)).discretize(&Scheme::default().particles([5, 4])).unwrap();
    assert!(problem.rigid_motion(&problem.at_rest(), "plat").unwrap_err().to_string().contains("there are: plate"));
}

/// Turns about any axis, from angles that rounding nearly hides to half a turn, give their rotation vector back; so do the matrices of
/// frames, which are orthogonal to the tolerance of Newton's method.
#[test]
fn rotation_vectors_are_those_of_the_turn() {
    let axis = Vector3::new(1.0, -2.0, 0.5).normalize();
    let vector = |rotation| {
        let motion = RigidMotion::<3> { centre: Point::zeros(), displacement: Point::zeros(), rotation };
        Vector3::from(motion.rotation_vector())
    };
    let pi = std::f64::consts::PI;
    for angle in [1e-14, 1e-11, 1e-8, 1e-5, 1e-2, 1.0, 3.0, pi - 1e-6] {
        let turn = axis * angle;
        let (found, rotation) =
            (vector(Rotation3::new(turn).into_inner()), Rotation3::new(turn).into_inner() * (1.0 + 1e-10));
        assert_abs_diff_eq!(found, turn, epsilon = 4e-15 * angle);
        assert_abs_diff_eq!(vector(rotation), turn, epsilon = 1e-9 * angle);
    }
    // Both ways round by half a turn are the same.
    let found = vector(Matrix3::from_fn(|i, j| 2.0 * axis[i] * axis[j] - f64::from(u8::from(i == j))));
    assert_abs_diff_eq!(found * found.dot(&axis).signum(), axis * pi, epsilon = 1e-14);
    assert_eq!(vector(Matrix3::identity()), Vector3::zeros());
}

/// A condition may have the name of its rigid body: by it results are what the body exerts, once.
#[test]
fn a_condition_named_as_its_rigid_body_counts_once() {
    let push = || Condition::on("plate").displacement([0.1, -0.1]);
    let answer = |condition| {
        let problem = block().rigid("plate", (1, Side::Max)).with(condition).discretize(&schemes()[0]).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let history = problem.history(&path).unwrap();
        let moment = problem.moment(path.last(), "plate", [1.0, 1.0]).unwrap()[2];
        (problem.reaction(path.last(), "plate").unwrap(), moment, history.header.len())
    };
    let (own, other) = (answer(push().named("plate")), answer(push()));
    assert!(other.0.norm() > 0.1);
    assert_abs_diff_eq!(own.0, other.0, epsilon = 1e-9);
    assert_abs_diff_eq!(own.1, other.1, epsilon = 1e-9);
    assert_eq!(own.2, other.2);
}

/// The middle of a rigid body is that of its area, however the nodes of the face are spaced and whatever ties them, symmetry planes too: a
/// force there does not turn it.
#[test]
fn the_middle_of_a_rigid_body_is_that_of_its_area() {
    let graded = || Layout::Graded(Arc::new(|axis, t| if axis == 0 { t * t } else { t }));
    let scene = block().rigid("plate", (1, Side::Max)).with(Load::force("plate", [0.0, -0.3]));
    let bound = Scheme::default().constraint_kind(ConstraintKind::AtParticles);
    for scheme in [Scheme::elements(2), bound, Scheme::default()] {
        let problem = scene.discretize(&scheme.particles([9, 5]).layout(graded())).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let motion = problem.rigid_motion(path.last(), "plate").unwrap();
        assert!(motion.displacement[1] < -1e-3, "{motion:?}");
        // As symmetric as the coarse model is: a middle that is the nodes' turned it by 0.03.
        assert!(motion.rotation_vector()[2].abs() < 1e-3, "{motion:?}");
    }
}

/// What bonds bodies is no condition on the body: a slice that keeps its plane has the force of that alone.
#[test]
fn the_reaction_of_a_condition_on_the_body_is_its_own() {
    let scene = Scene::assembly(Solid)
        .body("left", Block::new([0.0; 3], [1.0; 3]), rubber())
        .body("right", Block::new([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]), rubber())
        .hold(Place::from((0, Side::Min)).of("left"))
        .with(Condition::on(Place::body()).component(2, 0.0))
        .traction(Place::from((0, Side::Max)).of("right"), [0.05, 0.02, 0.0]);
    for scheme in [Scheme::elements(1), Scheme::default()] {
        let problem = scene.discretize(&scheme.particles([4, 4, 3])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let slice = problem.reaction(path.last(), Place::body()).unwrap();
        assert_abs_diff_eq!(slice, Vector3::new(0.0, 0.0, slice[2]), epsilon = 1e-9);
        let held = problem.reaction(path.last(), Place::from((0, Side::Min)).of("left")).unwrap();
        assert_abs_diff_eq!(held.xy(), Vector3::new(-0.05, -0.02, 0.0).xy(), epsilon = 1e-8);
    }
}

/// A part of a part that no facet sees is no face of a rigid body.
#[test]
fn a_rigid_body_over_nothing_is_refused() {
    let nowhere = Place::on((1, Side::Max)).within(|x| (x[0] - 1.0).abs() < 1e-6);
    let scene = block().rigid("plate", nowhere).with(Load::force("plate", [0.0, -0.1]));
    for scheme in schemes() {
        assert!(scene.discretize(&scheme).is_err());
    }
}

/// The middle of a rigid body does not depend on the unit of length, whatever kinds of places it has: the largest dimension counts.
#[test]
fn the_middle_of_a_rigid_body_does_not_depend_on_the_unit() {
    let middle = |unit: f64| {
        let block = Block::new([0.0, 0.0], [2.0 * unit, unit]);
        let scene = Scene::new(block, PlaneStrain, rubber())
            .hold((1, Side::Min))
            .rigid("plate", (1, Side::Max))
            .rigid("plate", Place::body().within(move |x: &Point<2>| x[0] > 1.4 * unit && x[1] > 0.6 * unit))
            .rigid("plate", Place::at([0.0, 0.5 * unit]));
        let problem = scene.discretize(&Scheme::elements(1).particles([9, 5])).unwrap();
        problem.rigid_motion(&problem.at_rest(), "plate").unwrap().centre / unit
    };
    assert_abs_diff_eq!(middle(1.0), middle(1000.0), epsilon = 1e-9);
    assert_abs_diff_eq!(middle(1.0), Point::<2>::new(1.7, 0.8), epsilon = 0.06);
}

/// A place that holds particles and no point of an integral is a rigid body with its middle in theirs.
#[test]
fn a_rigid_body_of_a_few_particles() {
    let place = Place::body().within(|x: &Point<2>| (x[0] - 1.0).abs() < 1e-3 && (x[1] - 0.5).abs() < 0.3);
    let scene = block().rigid("core", place).with(Load::force("core", [0.0, -0.01]));
    for scheme in schemes() {
        let problem = scene.discretize(&scheme).unwrap();
        let centre = problem.rigid_motion(&problem.at_rest(), "core").unwrap().centre;
        assert_abs_diff_eq!(centre, Point::<2>::new(1.0, 0.5), epsilon = 1e-12);
    }
}

/// A rigid core that a plane of symmetry cuts stays on the plane, and moves with a face that moves, whatever the scheme and whichever part
/// of the plane it takes.
#[test]
fn a_rigid_core_keeps_to_the_planes_that_cut_it() {
    let bound = Scheme::default().constraint_kind(ConstraintKind::AtParticles);
    // A T of which a half is modelled, with rubber in all cells: it takes a part of the plane, or all of it.
    for high in [0.3, 0.6] {
        let is_core =
            move |x: &Point<2>| (x[0] < 0.07 && (x[1] - 0.5).abs() < high) || (x[0] < 0.6 && (x[1] - 0.5).abs() < 0.07);
        let scene = move |across: f64| {
            Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
                .with(Condition::on((0, Side::Min)).component(0, across).named("plane"))
                .prescribe((1, Side::Min), 1, 0.0)
                .rigid("core", Place::body().within(is_core))
        };
        for scheme in [Scheme::default(), bound.clone(), Scheme::elements(1), Scheme::elements(2)] {
            let scheme = scheme.particles([17, 9]);
            let solve = |scene: Scene<2>| {
                let problem = scene.discretize(&scheme).unwrap();
                let path = problem.run().unwrap().completed().unwrap();
                let motion = problem.rigid_motion(path.last(), "core").unwrap();
                let plane = problem.reaction(path.last(), "plane").unwrap();
                let floor = problem.reaction(path.last(), (1, Side::Min)).unwrap();
                (motion, plane, floor)
            };
            let (motion, plane, floor) = solve(scene(0.0).traction((0, Side::Max), [0.2, 0.0]));
            assert_abs_diff_eq!(motion.displacement[0], 0.0, epsilon = 1e-9);
            assert_abs_diff_eq!(motion.rotation[(1, 0)], 0.0, epsilon = 1e-9);
            assert_abs_diff_eq!(plane, Point::<2>::new(-0.2, 0.0), epsilon = 1e-8);
            assert_abs_diff_eq!(floor, Point::<2>::zeros(), epsilon = 1e-8);
            let led = scene(0.02).traction((0, Side::Max), [0.2, 0.0]);
            assert_abs_diff_eq!(solve(led).0.displacement[0], 0.02, epsilon = 1e-9);
            let error = scene(0.0).with(Condition::on("core").component(0, 0.1)).discretize(&scheme).err().unwrap();
            assert!(matches!(error, Error::Boundary(rkpm::error::BoundaryError::Conflict { .. })), "{error}");
        }
    }
}

/// What holds a component of a whole body holds the rigid bodies that are tied to it: a slice keeps its plane with a plate on it.
#[test]
fn a_component_of_a_whole_body_is_one_of_its_rigid_bodies() {
    let bound = Scheme::default().constraint_kind(ConstraintKind::AtParticles);
    for scheme in [Scheme::default(), bound, Scheme::elements(1), Scheme::elements(2)] {
        let planar =
            block().rigid("plate", (1, Side::Max)).with(Load::force(Place::at([1.4, 1.0]).of("plate"), [0.05, -0.1]));
        let planar = planar.discretize(&scheme.clone().particles([9, 5])).unwrap();
        let path = planar.run().unwrap().completed().unwrap();
        let expected = planar.rigid_motion(path.last(), "plate").unwrap();
        let scene = |plate: f64| {
            Scene::new(Block::new([0.0; 3], [2.0, 1.0, 0.5]), Solid, rubber())
                .hold((1, Side::Min))
                .with(Condition::on(Place::body()).component(2, 0.0).named("slice"))
                .rigid("plate", (1, Side::Max))
                .with(Load::force(Place::at([1.4, 1.0, 0.25]).of("plate"), [0.025, -0.05, 0.01]))
                .with(Load::moment("plate", [0.02, 0.0, 0.0]))
                .with(Condition::on(Place::at([1.0, 1.0, 0.25]).of("plate")).component(2, plate))
        };
        let scheme = scheme.particles([9, 5, 3]);
        let problem = scene(0.0).discretize(&scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let motion = problem.rigid_motion(path.last(), "plate").unwrap();
        // Functions of bricks are others than those of squares.
        assert_abs_diff_eq!(
            motion.displacement.xy(),
            expected.displacement,
            epsilon = 0.01 * expected.displacement.norm()
        );
        assert_abs_diff_eq!(motion.displacement[2], 0.0, epsilon = 1e-9);
        assert_abs_diff_eq!(motion.rotation.fixed_view::<2, 1>(0, 2).into_owned().norm(), 0.0, epsilon = 1e-9);
        let floor = problem.reaction(path.last(), (1, Side::Min)).unwrap();
        let slice = problem.reaction(path.last(), "slice").unwrap();
        assert_abs_diff_eq!(floor + slice, Vector3::new(-0.025, 0.05, -0.01), epsilon = 1e-8);
        let error = scene(0.1).discretize(&scheme).err().unwrap();
        assert!(matches!(error, Error::Boundary(rkpm::error::BoundaryError::Conflict { .. })), "{error}");
    }
}

/// A face that two bodies share counts once in the middle of a rigid body, whichever of them is first and however their facets lie.
#[test]
fn a_face_of_two_bodies_counts_once() {
    let scene = |order: [usize; 2]| {
        let halves = [("left", 0.0), ("right", 1.0)];
        let [first, second] = order.map(|half| halves[half]);
        let block = |low: f64| Block::new([low, 0.0], [low + 1.0, 1.0]);
        Scene::assembly(PlaneStrain)
            .body(first.0, block(first.1), rubber())
            .body(second.0, block(second.1), rubber())
            .scheme_of("right", |scheme| scheme.spacing(0.1))
            .rigid("frame", Place::on((0, Side::Min)).of("left"))
            .rigid("frame", Place::on((0, Side::Max)).of("left"))
            .rigid("frame", Place::on((0, Side::Min)).of("right"))
            .hold(Place::on((0, Side::Max)).of("right"))
    };
    for order in [[0, 1], [1, 0]] {
        for scheme in [Scheme::default(), Scheme::elements(1)] {
            let problem = scene(order).discretize(&scheme.spacing(0.25)).unwrap();
            let centre = problem.rigid_motion(&problem.at_rest(), "frame").unwrap().centre;
            assert_abs_diff_eq!(centre, Point::<2>::new(0.5, 0.5), epsilon = 1e-12);
        }
    }
}
