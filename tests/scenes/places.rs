//! Conditions and loads by place: directions, parts of parts, names, total forces, elastic foundations.

use approx::{abs_diff_eq, assert_abs_diff_eq};
use nalgebra::Rotation2;
use rkpm::prelude::*;

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 1e2).unwrap()
}

/// A block turned about the origin.
fn turned(angle: f64) -> Mapped<impl Fn(&Point<2>) -> Point<2> + Send + Sync + Clone> {
    Mapped(move |unit: &Point<2>| Rotation2::new(angle) * Point::<2>::new(2.0 * unit[0], unit[1]))
}

/// Symmetry planes at any angle: a block between two rollers, pulled and sheared along its own axes, is the same body turned.
#[test]
fn inclined_planes_of_symmetry_are_those_of_the_axes_turned() {
    for scheme in [Scheme::default().particles([7, 5]), Scheme::elements(2).particles([7, 5])] {
        let answer = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let scene = Scene::new(turned(angle), PlaneStrain, rubber())
                .with(Condition::on(Side::Min).along(Direction::Normal, 0.0).named("left"))
                .with(Condition::on((1, Side::Min)).along(Direction::Along([-3.0 * sin, 3.0 * cos]), 0.0))
                .with(Condition::on(Side::Max).along(Direction::Along([cos, sin]), 0.4).named("pull"));
            let problem = scene.discretize(&scheme).unwrap();
            let path = problem.run().unwrap().completed().unwrap();
            let pulled = problem.reaction(path.last(), "pull").unwrap();
            let left = problem.reaction(path.last(), "left").unwrap();
            assert_abs_diff_eq!(pulled, -left, epsilon = 5e-9 * pulled.norm());
            (problem.energy(path.last()).unwrap(), Rotation2::new(-angle) * pulled)
        };
        let (energy, force) = answer(0.0);
        for angle in [0.3, 0.8, 2.0] {
            let (same, turned) = answer(angle);
            assert_abs_diff_eq!(same / energy, 1.0, epsilon = 1e-9);
            assert_abs_diff_eq!(turned, force, epsilon = 5e-8 * force.norm());
        }
    }
}

/// A quarter ring between planes of symmetry, given by components, normals and cylindrical directions: one body. Pushed
/// out along the radius and turned along the tangent.
#[test]
fn cylindrical_directions_and_normals_agree_with_components() {
    let ring = Mapped(|unit: &Point<2>| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * unit[1]).sin_cos();
        Point::<2>::new(cos, sin) * (1.0 + unit[0])
    });
    let (around, axis) = ([0.0, 0.0], [0.0, 0.0, 1.0]);
    let scheme = Scheme::default().particles([5, 9]);
    let run = |scene: Scene<2>| {
        let problem = scene.discretize(&scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        problem.energy(path.last()).unwrap()
    };
    let body = || Scene::new(ring, PlaneStrain, rubber());
    let push = |direction| Condition::on(Side::Min).along(direction, 0.2);
    let inwards = |x: &Point<2>| [-x[0], -x[1]];
    let energies = [
        run(body()
            .prescribe((1, Side::Min), 1, 0.0)
            .prescribe((1, Side::Max), 0, 0.0)
            .with(push(Direction::radial(around, axis)))),
        run(body()
            .with(Condition::on((1, Side::Min)).along(Direction::Normal, 0.0))
            .with(Condition::on((1, Side::Max)).along(Direction::tangential(around, axis), 0.0))
            .with(Condition::on(Side::Min).along(Direction::Field(std::sync::Arc::new(inwards)), -0.2))),
    ];
    assert_abs_diff_eq!(energies[0] / energies[1], 1.0, epsilon = 1e-10);
    // Turned as a whole, to first order: nearly no energy; turned against a fixed bore, some.
    let turn = |size: f64| Condition::on(Side::Max).along(Direction::tangential(around, axis), size);
    let against = run(body().hold(Side::Min).with(turn(0.02)));
    assert!(against > 1e-4, "{against}");
}

/// A face in two halves is the face, and a load on a half acts on that half, with its whole force.
#[test]
fn parts_of_parts_and_total_forces() {
    for scheme in [Scheme::default().particles([9, 5]), Scheme::elements(2).particles([9, 5])] {
        let body = || Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).hold((1, Side::Min));
        let top = || Place::on((1, Side::Max));
        let run = |scene: Scene<2>| {
            let problem = scene.discretize(&scheme).unwrap();
            let path = problem.run().unwrap().completed().unwrap();
            let force = problem.reaction(path.last(), (1, Side::Min)).unwrap();
            (
                problem.energy(path.last()).unwrap(),
                force,
                problem.moment(path.last(), (1, Side::Min), [0.0, 0.0]).unwrap()[2],
            )
        };
        let whole = run(body().traction((1, Side::Max), [0.1, 0.05]));
        let total = run(body().with(Load::force((1, Side::Max), [0.2, 0.1])));
        assert_abs_diff_eq!(whole.0 / total.0, 1.0, epsilon = 1e-10);
        assert_abs_diff_eq!(whole.1, total.1, epsilon = 5e-10);
        let halves = run(body()
            .traction(top().within(|x: &Point<2>| x[0] < 1.0), [0.1, 0.05])
            .name("right half", top().within(|x: &Point<2>| x[0] > 1.0))
            .traction("right half", [0.1, 0.05]));
        assert_abs_diff_eq!(whole.0 / halves.0, 1.0, epsilon = 2e-4);
        let patch = top().within(|x: &Point<2>| (x[0] - 0.7).abs() < 0.3);
        let (_, force, moment) = run(body().with(Load::force(patch, [0.0, -0.03])));
        assert_abs_diff_eq!(force, Point::<2>::new(0.0, 0.03), epsilon = 5e-11);
        assert_abs_diff_eq!(moment, 0.03 * 0.7, epsilon = 2e-3);
        // Fields: a pressure that grows along the face has its resultant at two thirds of it.
        let (_, force, moment) = run(body().pressure((1, Side::Max), Value::field(|x: &Point<2>| 1e-5 * x[0])));
        assert_abs_diff_eq!(force[1], 2e-5, epsilon = 2e-8);
        assert_abs_diff_eq!(moment / force[1], 4.0 / 3.0, epsilon = 1e-3);
        // A condition on half a face holds it as far as its facets reach.
        let held = Condition::on(top().within(|x: &Point<2>| x[0] < 1.0)).displacement([0.1, 0.0]);
        let (energy, ..) = run(body().with(held));
        let (all, ..) = run(body().with(Condition::on(top()).displacement([0.1, 0.0])));
        assert!(energy > 0.1 * all && energy < 0.9 * all, "{energy} {all}");
    }
}

/// A stiff elastic foundation holds as a condition does; a soft one gives by force over stiffness. Normal elastic foundations let slide.
#[test]
fn beddings_give_by_force_over_stiffness() {
    let body = || Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber());
    let run = |scene: Scene<2>| {
        let problem = scene.discretize(&Scheme::default().particles([7, 4])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        problem.displacement(path.last(), &[1.0, 0.0].into()).unwrap()
    };
    let soft = run(body().with(Load::elastic_foundation((1, Side::Min), 1e-3)).traction((1, Side::Max), [1e-6, -2e-6]));
    assert_abs_diff_eq!(soft, Point::<2>::new(1e-3, -2e-3), epsilon = 1e-5);
    let sliding = body()
        .with(Load::normal_elastic_foundation((1, Side::Min), 1e-3))
        .prescribe((1, Side::Max), 0, 0.7)
        .traction((1, Side::Max), [0.0, -2e-6]);
    let sliding = run(sliding);
    assert_abs_diff_eq!(sliding, Point::<2>::new(0.7, -2e-3), epsilon = 5e-5);
    // A load of one's own is part of the scene: tolerances and reports know it.
    let spring = body().with(Load::elastic_foundation((1, Side::Min), 1.0)).pressure((1, Side::Max), 0.1);
    assert!(rkpm::check::scene(&spring, &Scheme::default().particles([5, 3])).unwrap().report().holds());
    let requested = rkpm::study::Tolerance::of(rkpm::study::Quantity::displacement([1.0, 1.0], 1), 0.05);
    let answer = spring.solve_within(&requested, rkpm::study::Budget::default()).unwrap();
    assert_abs_diff_eq!(answer.values()[0], -0.1, epsilon = 0.05);
}

/// States at given loads are those that a run with break points there comes to, and the run keeps its own steps.
#[test]
fn states_at_loads_are_equilibria_of_the_same_path() {
    let scene = |amplitude| {
        Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
            .hold(Side::Min)
            .with(Condition::on(Side::Max).displacement([1.5, 0.5]).amplitude(amplitude))
    };
    // J itself: how far a zone under tension has gone from roots of J to J depends on the steps.
    let scheme = Scheme::default().particles([9, 5]).projected_measure(ProjectedMeasure::Jacobian);
    let problem = scene(Amplitude::Ramp).discretize(&scheme).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let loads = [0.1, 0.35, 1.0];
    let stops = loads.iter().chain(&[0.0]).map(|&load| (load, load));
    let mut stops: Vec<(f64, f64)> = stops.collect();
    stops.sort_by(|a, b| a.0.total_cmp(&b.0));
    let stopping = scene(Amplitude::table(stops).unwrap()).discretize(&scheme).unwrap();
    let stopped = stopping.run().unwrap().completed().unwrap();
    for (state, load) in problem.states_at(&path, &loads).unwrap().iter().zip(loads) {
        let other = stopped.steps.iter().find(|step| step.state.load == load).unwrap();
        let same = stopping.reaction(&other.state, Side::Max).unwrap();
        assert!(same.norm() > 0.0, "{load}");
        let between = problem.reaction(state, Side::Max).unwrap();
        assert!(abs_diff_eq!(between, same, epsilon = 5e-9 * same.norm()), "{load}: {between} {same}");
    }
    assert!(problem.states_at(&path, &[1.2]).is_err());
}

/// Some of a named face is asked for as some of the face itself; what lies within two predicates lies within each of them.
#[test]
fn some_of_a_named_part_is_found_by_it() {
    let left = Place::on("top").within(|x: &Point<2>| x[0] < 1.0);
    let corner = left.clone().within(|x: &Point<2>| x[0] < 0.5);
    for (held, asked) in [(&left, vec![&left]), (&corner, vec![&corner, &left])] {
        let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
            .name("top", (1, Side::Max))
            .hold((1, Side::Min))
            .with(Condition::on(held.clone()).displacement([0.1, 0.0]));
        let problem = scene.discretize(&Scheme::default().particles([9, 5])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let base = problem.reaction(path.last(), (1, Side::Min)).unwrap();
        for place in asked {
            let force = problem.reaction(path.last(), place.clone()).unwrap();
            assert_abs_diff_eq!(force, -base, epsilon = 1e-8);
        }
    }
}

/// A condition with the name of its own part hides no other condition there.
#[test]
fn a_condition_named_as_its_part_hides_no_other() {
    let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
        .name("top", (1, Side::Max))
        .hold((1, Side::Min))
        .with(Condition::on("top").component(0, 0.2).named("top"))
        .prescribe("top", 1, -0.1);
    let problem = scene.discretize(&Scheme::default().particles([9, 5])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let of = |place: Place<2>| problem.reaction(path.last(), place).unwrap();
    let (top, base) = (of("top".into()), of((1, Side::Min).into()));
    assert!(base[0].abs() > 0.01 && base[1].abs() > 0.01);
    assert_abs_diff_eq!(top, -base, epsilon = 1e-8);
}
