//! Round bodies between surfaces without friction.

use approx::assert_abs_diff_eq;
use rkpm::prelude::*;

const RADIUS: f64 = 0.2;

/// A whole ring between two plates.
fn ring(closure: f64, bore: [f64; 2], friction: f64) -> Scene<2> {
    let rim = Outline::circle("rim", [0.0, 0.0], RADIUS);
    let region = Region::with_holes(rim, [Outline::circle("bore", bore, 0.12)]).unwrap();
    let plate = |y: f64, up: f64| RigidSurface::plane([0.0, y], [0.0, up]).friction(friction);
    Scene::new(region, PlaneStrain, Rubber::mooney_rivlin(0.293, 0.177, 1410.0).unwrap())
        .contact("rim", plate(-RADIUS, 1.0).named("floor"))
        .contact("rim", plate(RADIUS, -1.0).moving([0.0, -closure]).named("top"))
}

/// A ring that is free to roll is told and held, by next to nothing; it stays where it is, and is stable.
#[test]
fn a_ring_does_not_roll() {
    let problem = ring(0.08, [0.0, 0.0], 0.0).discretize(&Scheme::default().particles([20])).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let top = problem.contact(path.last(), "top").unwrap();
    let held = problem.neutral_motions(path.last()).unwrap();
    println!("{held:?}, {} iterations in {} steps", path.iterations, path.steps.len());
    assert_eq!(held.len(), 1);
    assert!(held[0].moment.abs() < 2e-2 * RADIUS * top.force[1].abs(), "{held:?} {}", top.force);
    let [left, right] = [-0.16, 0.16].map(|x| problem.displacement(path.last(), &[x, 0.0].into()).unwrap());
    assert_abs_diff_eq!(left[1], right[1], epsilon = 0.02 * RADIUS);
    assert!(path.iterations <= 60 && path.steps.last().unwrap().unstable == Some(0));
}

/// What friction holds, or what is not round, is not held.
#[test]
fn only_neutral_motions_are_held() {
    for (bore, friction) in [([0.0, 0.0], 0.3), ([0.02, 0.0], 0.0)] {
        let problem = ring(0.08, bore, friction).discretize(&Scheme::default().particles([16])).unwrap();
        assert!(problem.neutral_motions(&problem.at_rest()).unwrap().is_empty());
    }
}
