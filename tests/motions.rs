//! Conditions that do not grow in proportion to the load, and the fields of a problem's states.
#![cfg(feature = "solve")]

use std::f64::consts::PI;

use rkpm::prelude::*;
use rkpm::scene::RowKind;

fn block() -> Result<Scene<2>, rkpm::Error> {
    Ok(Scene::new(Block::new([-0.5, -1.0], [0.5, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?))
}

/// Both ends of the block turn about the origin by `angle`.
fn turned(angle: f64) -> Result<Scene<2>, rkpm::Error> {
    let turn = move |load: f64| (angle * load).sin_cos();
    Ok([Side::Min, Side::Max].into_iter().fold(block()?, |scene, side| {
        scene
            .prescribe_motion((1, side), 0, move |x, load| x[0] * (turn(load).1 - 1.0) - x[1] * turn(load).0)
            .prescribe_motion((1, side), 1, move |x, load| x[0] * turn(load).0 + x[1] * (turn(load).1 - 1.0))
    }))
}

#[test]
fn a_rigid_turn_of_both_ends_turns_the_body() -> Result<(), rkpm::Error> {
    for rows in [RowKind::AtParticles, RowKind::OverBoundary] {
        // Small turns: Newton from half a turn away may end in a wrinkled equilibrium.
        let scheme = Scheme::default().particles([4, 5]).rows(rows).stepping(Stepping::equal(8));
        let problem = turned(PI)?.discretize(&scheme)?;
        let path = problem.run(&mut ())?.completed()?;
        for (x, u) in problem.cells.positions().iter().zip(problem.particle_displacements(path.last())?) {
            assert!((u + 2.0 * x).norm() < 1e-10, "{rows:?}: {x} moved by {u}");
        }
        assert!(problem.energy(path.last()) < 1e-15);
    }
    Ok(())
}

#[test]
fn a_motion_in_proportion_is_a_field() -> Result<(), rkpm::Error> {
    let half = Amplitude::table(vec![(0.0, 0.0), (1.0, 0.5)])?;
    let fields = block()?
        .hold((1, Side::Min))
        .prescribe_field((1, Side::Max), 0, |x| 0.2 + 0.1 * x[0])
        .with_amplitude(half.clone())
        .prescribe((1, Side::Max), 1, 0.3);
    let motions = block()?
        .hold((1, Side::Min))
        .prescribe_motion((1, Side::Max), 0, |x, load| (0.2 + 0.1 * x[0]) * load)
        .with_amplitude(half)
        .prescribe_motion((1, Side::Max), 1, |_, load| 0.3 * load);
    for rows in [RowKind::AtParticles, RowKind::OverBoundary] {
        let scheme = Scheme::default().particles([4, 5]).rows(rows);
        let state = |scene: &Scene<2>| -> Result<Vec<f64>, rkpm::Error> {
            Ok(scene.discretize(&scheme)?.run(&mut ())?.completed()?.last().displacement.clone())
        };
        for (a, b) in state(&fields)?.iter().zip(state(&motions)?) {
            assert!((a - b).abs() < 1e-12, "{rows:?}: {a} and {b}");
        }
    }
    Ok(())
}

#[test]
fn two_faces_may_share_a_motion_and_must_not_contradict_it() -> Result<(), rkpm::Error> {
    let corner = |factor: f64| -> Result<Scene<2>, rkpm::Error> {
        Ok(block()?.prescribe_motion((1, Side::Max), 0, |x, load| x[0] * load.sin()).prescribe_motion(
            (0, Side::Max),
            0,
            move |x, load| factor * x[0] * load.sin(),
        ))
    };
    for rows in [RowKind::AtParticles, RowKind::OverBoundary] {
        let scheme = Scheme::default().particles([4, 5]).rows(rows);
        assert!(corner(1.0)?.discretize(&scheme).is_ok());
        let refused = corner(2.0)?.discretize(&scheme).err().expect("the corner cannot move both ways").to_string();
        assert!(refused.contains("u_0 on face (1, Max)"), "{refused}");
        let endless = block()?.prescribe_motion(Side::Max, 0, |_, load| 1.0 / (load - 1.0));
        assert!(endless.discretize(&scheme).is_err());
    }
    Ok(())
}

/// Motions that agree at the full load alone contradict each other on the way.
#[test]
fn motions_are_compared_on_the_way() -> Result<(), rkpm::Error> {
    for (power, agree) in [(1, true), (3, false)] {
        let scene = block()?.prescribe_motion((1, Side::Min), 0, |_, load| 0.1 * load).prescribe_motion(
            (0, Side::Min),
            0,
            move |_, load| 0.1 * load.powi(power),
        );
        for rows in [RowKind::AtParticles, RowKind::OverBoundary] {
            let scheme = Scheme::default().particles([4, 5]).rows(rows);
            assert_eq!(scene.discretize(&scheme).is_ok(), agree, "{rows:?}");
        }
    }
    Ok(())
}

#[test]
fn pressures_are_those_of_the_volume_change() -> Result<(), rkpm::Error> {
    // The whole boundary follows a homogeneous deformation: p = k (J − 1) everywhere, however it is projected.
    let scene =
        block()?
            .prescribe_field(Part::Whole, 0, |x| 0.02 * x[0] + 0.1 * x[1])
            .prescribe_field(Part::Whole, 1, |x| -0.03 * x[1]);
    let jacobian = 1.02 * 0.97;
    use PressureField::*;
    for field in [Displacement, Pointwise, Constant, Linear] {
        let problem = scene.discretize(&Scheme::default().particles([5, 5]).volume(field, 2))?;
        let path = problem.run(&mut ())?.completed()?;
        let pressures = problem.pressures(path.last()).expect("this rubber can be split");
        let gradients = problem.deformation_gradients(path.last());
        assert_eq!(pressures.len(), problem.body.table().len());
        for (p, f) in pressures.iter().zip(&gradients) {
            assert!((p - 1e3 * (jacobian - 1.0)).abs() < 1e-8, "{field:?}: pressure {p}");
            assert!((f.determinant() - jacobian).abs() < 1e-11);
        }
    }
    Ok(())
}
