//! A ring pressed between two plates without friction: its quarter, its half and the whole, far past where it may buckle.

use rkpm::prelude::*;

const OUTER: f64 = 0.2;
const INNER: f64 = 0.12;

fn rubber() -> Rubber {
    Rubber::mooney_rivlin(0.293, 0.177, 1410.0).unwrap()
}

fn floor() -> RigidSurface<2> {
    RigidSurface::plane([0.0, -OUTER], [0.0, 1.0]).named("floor")
}

fn top(closure: f64) -> RigidSurface<2> {
    RigidSurface::plane([0.0, OUTER], [0.0, -1.0]).moving([0.0, -closure]).named("top")
}

fn full(closure: f64) -> Scene<2> {
    let rim = Outline::circle("rim", [0.0, 0.0], OUTER);
    let region = Region::with_holes(rim, [Outline::circle("bore", [0.0, 0.0], INNER)]).unwrap();
    Scene::new(region, PlaneStrain, rubber()).contact("rim", floor()).contact("rim", top(closure))
}

fn half(closure: f64) -> Scene<2> {
    let outline = Outline::at([0.0, -OUTER])
        .arc("rim", [0.0, OUTER], [0.0, 0.0], Turn::Left)
        .line("middle", [0.0, INNER])
        .arc("bore", [0.0, -INNER], [0.0, 0.0], Turn::Right)
        .close("middle");
    let scene = Scene::new(Region::new(outline).unwrap(), PlaneStrain, rubber()).prescribe("middle", 0, 0.0);
    scene.contact("rim", floor()).contact("rim", top(closure))
}

fn quarter(closure: f64) -> Scene<2> {
    let outline = Outline::at([OUTER, 0.0])
        .arc("rim", [0.0, OUTER], [0.0, 0.0], Turn::Left)
        .line("middle", [0.0, INNER])
        .arc("bore", [INNER, 0.0], [0.0, 0.0], Turn::Right)
        .close("equator");
    Scene::new(Region::new(outline).unwrap(), PlaneStrain, rubber())
        .prescribe("middle", 0, 0.0)
        .prescribe("equator", 1, 0.0)
        .contact("rim", top(0.5 * closure))
}

/// The force of the whole ring.
fn pressed(scene: Scene<2>, spacing: f64, parts: f64) -> f64 {
    let problem = scene.discretize(&Scheme::default().spacing(spacing)).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let force = -parts * problem.contact(path.last(), "top").unwrap().force[1];
    let unstable = path.steps.last().unwrap().unstable;
    let count = problem.cells().positions().len();
    println!("{count} particles: {force:.6} MN/m in {} iterations, {} steps", path.iterations, path.steps.len());
    assert_eq!(unstable, Some(0), "completed on an unstable state");
    assert!(path.iterations <= 60 && path.steps.len() <= 6);
    force
}

/// Symmetric models find the symmetric state, and the whole ring one that is stable: the same force.
#[test]
fn quarters_halves_and_whole_rings_are_stable_and_agree() {
    for closure in [0.04, 0.08, 0.12, 0.16] {
        let fine = [
            pressed(quarter(closure), 0.013, 2.0),
            pressed(half(closure), 0.013, 2.0),
            pressed(full(closure), 0.013, 1.0),
        ];
        let coarse = [
            pressed(quarter(closure), 0.02, 2.0),
            pressed(half(closure), 0.02, 2.0),
            pressed(full(closure), 0.02, 1.0),
        ];
        let mean = fine.iter().sum::<f64>() / 3.0;
        let off = |forces: [f64; 3]| forces.iter().map(|force| (force / mean - 1.0).abs()).fold(0.0, f64::max);
        println!("closed by {closure}: {:.2e}, {:.2e}", off(fine), off(coarse));
        assert!(off(fine) < 5e-3 && off(coarse) < 3e-2);
    }
}
