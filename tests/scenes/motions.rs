//! Conditions that do not grow in proportion to the load, and the fields of a problem's states.
#![cfg(feature = "solve")]

use std::f64::consts::PI;

use approx::{abs_diff_eq, assert_abs_diff_eq, relative_eq};
use rkpm::prelude::*;
use rkpm::scene::ConstraintKind;

fn block() -> Result<Scene<2>, rkpm::Error> {
    Ok(Scene::new(Block::new([-0.5, -1.0], [0.5, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?))
}

/// Both ends of the block turn about the origin by `angle`.
fn turned(angle: f64) -> Result<Scene<2>, rkpm::Error> {
    let turn = move |load: f64| (angle * load).sin_cos();
    Ok([Side::Min, Side::Max].into_iter().fold(block()?, |scene, side| {
        scene
            .prescribe(
                (1, side),
                0,
                Value::motion(move |x: &Point<2>, load| x[0] * (turn(load).1 - 1.0) - x[1] * turn(load).0),
            )
            .prescribe(
                (1, side),
                1,
                Value::motion(move |x: &Point<2>, load| x[0] * turn(load).0 + x[1] * (turn(load).1 - 1.0)),
            )
    }))
}

#[test]
fn a_rigid_turn_of_both_ends_turns_the_body() -> Result<(), rkpm::Error> {
    for rows in [ConstraintKind::AtParticles, ConstraintKind::OverBoundary] {
        // Small turns: Newton from half a turn away may end in a wrinkled equilibrium.
        let scheme = Scheme::default().particles([4, 5]).constraint_kind(rows).stepping(Stepping::equal(8));
        let problem = turned(PI)?.discretize(&scheme)?;
        let path = problem.run()?.completed()?;
        for (x, u) in problem.cells().positions().iter().zip(problem.particle_displacements(path.last())?) {
            assert!(abs_diff_eq!(u, -2.0 * x, epsilon = 5e-11), "{rows:?}: {x} moved by {u}");
        }
        assert!(problem.energy(path.last()).unwrap() < 1e-15);
    }
    Ok(())
}

#[test]
fn a_motion_in_proportion_is_a_field() -> Result<(), rkpm::Error> {
    let half = Amplitude::table(vec![(0.0, 0.0), (1.0, 0.5)])?;
    let fields = block()?
        .hold((1, Side::Min))
        .with(
            Condition::on((1, Side::Max))
                .component(0, Value::field(|x: &Point<2>| 0.2 + 0.1 * x[0]))
                .amplitude(half.clone()),
        )
        .prescribe((1, Side::Max), 1, 0.3);
    let motions = block()?
        .hold((1, Side::Min))
        .with(
            Condition::on((1, Side::Max))
                .component(0, Value::motion(|x: &Point<2>, load| (0.2 + 0.1 * x[0]) * load))
                .amplitude(half),
        )
        .prescribe((1, Side::Max), 1, Value::motion(|_: &Point<2>, load| 0.3 * load));
    for rows in [ConstraintKind::AtParticles, ConstraintKind::OverBoundary] {
        let scheme = Scheme::default().particles([4, 5]).constraint_kind(rows);
        let state = |scene: &Scene<2>| -> Result<Vec<f64>, rkpm::Error> {
            Ok(scene.discretize(&scheme)?.run()?.completed()?.last().displacement.clone())
        };
        for (a, b) in state(&fields)?.iter().zip(state(&motions)?) {
            assert!(abs_diff_eq!(*a, b, epsilon = 1e-12), "{rows:?}: {a} and {b}");
        }
    }
    Ok(())
}

/// What the check of a scene says of conditions that contradict each other: refused ones at particles; over the boundary those whose
/// values do not hold at an edge.
fn contradictions(scene: &Scene<2>, scheme: &Scheme) -> Result<Vec<String>, rkpm::Error> {
    let diagnosis = rkpm::check::scene(scene, scheme)?;
    let refused = diagnosis.refused.iter().map(ToString::to_string);
    Ok(refused.chain(diagnosis.overruled.iter().map(ToString::to_string)).collect())
}

#[test]
fn two_faces_may_share_a_motion_and_must_not_contradict_it() -> Result<(), rkpm::Error> {
    let corner = |factor: f64| -> Result<Scene<2>, rkpm::Error> {
        Ok(block()?.prescribe((1, Side::Max), 0, Value::motion(|x: &Point<2>, load| x[0] * load.sin())).prescribe(
            (0, Side::Max),
            0,
            Value::motion(move |x: &Point<2>, load| factor * x[0] * load.sin()),
        ))
    };
    for rows in [ConstraintKind::AtParticles, ConstraintKind::OverBoundary] {
        let scheme = Scheme::default().particles([4, 5]).constraint_kind(rows);
        assert_eq!(contradictions(&corner(1.0)?, &scheme)?, [""; 0]);
        let said = contradictions(&corner(2.0)?, &scheme)?;
        assert!(said.len() == 1 && said[0].contains("u_0 on face (1, Max)"), "{said:?}");
        let endless = block()?.prescribe(Side::Max, 0, Value::motion(|_: &Point<2>, load| 1.0 / (load - 1.0)));
        assert!(endless.discretize(&scheme).is_err());
    }
    Ok(())
}

/// Motions that agree at the full load alone contradict each other on the way.
#[test]
fn motions_are_compared_on_the_way() -> Result<(), rkpm::Error> {
    for (power, agree) in [(1, true), (3, false)] {
        let scene = block()?.prescribe((1, Side::Min), 0, Value::motion(|_: &Point<2>, load| 0.1 * load)).prescribe(
            (0, Side::Min),
            0,
            Value::motion(move |_: &Point<2>, load| 0.1 * load.powi(power)),
        );
        for rows in [ConstraintKind::AtParticles, ConstraintKind::OverBoundary] {
            let scheme = Scheme::default().particles([4, 5]).constraint_kind(rows);
            assert_eq!(contradictions(&scene, &scheme)?.is_empty(), agree, "{rows:?}");
        }
    }
    Ok(())
}

#[test]
fn pressures_are_those_of_the_volume_change() -> Result<(), rkpm::Error> {
    // The whole boundary follows a homogeneous deformation: p = k (J − 1) everywhere, however it is projected.
    let scene = block()?.prescribe(Part::Whole, 0, Value::field(|x: &Point<2>| 0.02 * x[0] + 0.1 * x[1])).prescribe(
        Part::Whole,
        1,
        Value::field(|x: &Point<2>| -0.03 * x[1]),
    );
    let jacobian = 1.02 * 0.97;
    use PressureField::*;
    for field in [Displacement, Pointwise, Constant, Linear] {
        let problem = scene.discretize(&Scheme::default().particles([5, 5]).pressure_field(field, 2))?;
        let path = problem.run()?.completed()?;
        let pressures = problem.pressures(path.last()).unwrap().expect("this rubber can be split");
        let gradients = problem.deformation_gradients(path.last()).unwrap();
        assert_eq!(pressures.len(), problem.body().table().point_count());
        for (p, f) in pressures.iter().zip(&gradients) {
            assert!(abs_diff_eq!(*p, 1e3 * (jacobian - 1.0), epsilon = 1e-8), "{field:?}: pressure {p}");
            assert_abs_diff_eq!(f.determinant(), jacobian, epsilon = 1e-11);
        }
    }
    Ok(())
}

/// A column around axis 2 whose upper end turns about it as a rigid plate, in the given steps.
fn twisted(degrees: f64, stepping: Stepping) -> Result<(Problem<3>, EquilibriumPath), rkpm::Error> {
    let turn = move |load: f64| (load * degrees.to_radians()).sin_cos();
    let end = (2, Side::Max);
    let scene = Scene::new(Block::new([-0.5, -0.5, 0.0], [0.5, 0.5, 3.0]), Solid, Rubber::neo_hookean(0.5, 1e2)?)
        .hold((2, Side::Min))
        .prescribe(end, 0, Value::motion(move |x: &Point<3>, load| x[0] * (turn(load).1 - 1.0) - x[1] * turn(load).0))
        .prescribe(end, 1, Value::motion(move |x: &Point<3>, load| x[0] * turn(load).0 + x[1] * (turn(load).1 - 1.0)))
        .prescribe(end, 2, 0.0);
    let problem = scene.discretize(&Scheme::default().particles([3, 3, 7]).stepping(stepping))?;
    // At whole turns the twisted block may be unstable: what is compared are equilibria.
    let path = problem.run()?.reached()?;
    Ok((problem, path))
}

/// Motions that come back, or nearly, have been away: the way between two loads is input as well as its ends.
#[test]
fn turns_are_made_all_the_way() -> Result<(), rkpm::Error> {
    let small = Stepping { first: 0.05, largest: 0.05, ..Stepping::default() };
    for degrees in [90.0, 270.0, 340.0, 360.0] {
        let answer = |stepping| -> Result<[f64; 2], rkpm::Error> {
            let (problem, path) = twisted(degrees, stepping)?;
            println!(
                "{degrees}: {} steps, {} iterations, {} rejected",
                path.steps.len(),
                path.iterations,
                path.rejected
            );
            Ok([problem.energy(path.last()).unwrap(), problem.moment(path.last(), (2, Side::Max), [0.0; 3])?[2]])
        };
        let (whole, fine) = (answer(Stepping::default())?, answer(small)?);
        for (a, b) in whole.iter().zip(fine) {
            assert!(b > 0.05 && relative_eq!(*a, b, max_relative = 1e-6), "{degrees}: {whole:?} {fine:?}");
        }
    }
    Ok(())
}

/// Straight ways are not cut, whoever tells them: neither motions in proportion, nor those that hurry along a line.
#[test]
fn straight_ways_are_gone_in_one_step() -> Result<(), rkpm::Error> {
    let straight: [fn(f64) -> f64; 3] = [|load| load, |load| load * load, |load| (1.5 * load).sin()];
    for way in straight {
        let scene = block()?
            .hold((1, Side::Min))
            .prescribe((1, Side::Max), 0, Value::motion(move |x: &Point<2>, load| (0.2 + 0.1 * x[0]) * way(load)))
            .prescribe((1, Side::Max), 1, Value::motion(move |_: &Point<2>, load| 0.1 * way(load)));
        let path = scene.discretize(&Scheme::default().particles([4, 5]))?.run()?.completed()?;
        assert_eq!(path.steps.len(), 1);
    }
    // There and back is a way as well, and so is a hundred times around.
    let back = Amplitude::Function(std::sync::Arc::new(|load: f64| (PI * load).sin()));
    let scene = block()?.hold((1, Side::Min)).with(Condition::on((1, Side::Max)).component(0, 0.4).amplitude(back));
    let scene = scene.prescribe((1, Side::Max), 1, 0.0);
    let path = scene.discretize(&Scheme::default().particles([4, 5]))?.run()?.completed()?;
    let energies: Vec<f64> = path.steps.iter().map(|step| step.energy).collect();
    assert!(energies.len() >= 2 && energies[0] > 0.01 && energies[energies.len() - 1] < 1e-12, "{energies:?}");
    let path = turned(200.0 * PI)?.discretize(&Scheme::default().particles([4, 5]))?.run()?.completed()?;
    assert!(path.steps.len() >= 400, "{}", path.steps.len());
    Ok(())
}

/// Amplitudes and motions that end where the load begins, as roots and powers do, lead where a ramp leads.
#[test]
fn amplitudes_may_end_where_the_load_begins() {
    let tip = |load: Load<2>| {
        let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
            .hold((1, Side::Min))
            .with(load);
        let problem = scene.discretize(&Scheme::default().particles([7, 5])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        problem.displacement(path.last(), &[2.0, 1.0].into()).unwrap()
    };
    let pressure = || Load::pressure((1, Side::Max), 0.1);
    let ramp = tip(pressure());
    let power = |exponent: f64| Amplitude::Function(std::sync::Arc::new(move |load: f64| load.powf(exponent)));
    for exponent in [0.5, 1.5] {
        let motion =
            Load::pressure((1, Side::Max), Value::motion(move |_: &Point<2>, load: f64| 0.1 * load.powf(exponent)));
        for load in [pressure().amplitude(power(exponent)), motion] {
            assert_abs_diff_eq!(tip(load), ramp, epsilon = 1e-9);
        }
    }
}
