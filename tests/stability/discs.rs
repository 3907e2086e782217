//! GOAL: no unstable modes of the default scheme in states that have none, whatever the sides of cells.
//! GEOMETRY: thin discs blown up to a bubble, with cells from flat to three times as high as wide; a block held at two ends, pulled,
//! pressed and sheared, with cells from 1:8 to 8:1.
//! REFERENCE: inflated discs and blocks so deformed are stable under a fixed load.

use rkpm::prelude::*;

/// A disc of 7.5 in by 0.5 in under 45 psi.
fn disc(particles: [usize; 2]) -> (f64, usize) {
    let rubber = Rubber::mooney_rivlin(80.0, 20.0, 1e5).unwrap();
    let scene = Scene::new(Block::new([0.0, 0.0], [7.5, 0.5]), Axisymmetric, rubber)
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((0, Side::Max))
        .pressure((1, Side::Min), 45.0);
    let problem = scene.discretize(&Scheme::default().particles(particles)).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let most = path.steps.iter().filter_map(|step| step.unstable).max().unwrap();
    (problem.displacement(path.last(), &[0.0, 0.0].into()).unwrap()[1], most)
}

#[test]
fn thin_discs() {
    for particles in [[41, 3], [61, 3], [77, 3], [97, 3], [161, 3], [41, 5], [81, 5], [161, 5], [61, 9]] {
        let (deflection, unstable) = disc(particles);
        println!("{particles:?}: {deflection:.3} in, {unstable} unstable modes");
        assert_eq!(unstable, 0, "{particles:?}");
    }
}

#[test]
fn blocks_of_long_cells() {
    let rubber = || Rubber::neo_hookean(0.5, 1e4).unwrap();
    for moved in [[0.8, 0.0], [-0.3, 0.0], [0.0, 0.6]] {
        for particles in [[33, 3], [33, 5], [17, 5], [9, 5], [9, 9], [5, 9], [5, 17]] {
            let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
                .hold((0, Side::Min))
                .with(Condition::on((0, Side::Max)).displacement(moved));
            let problem = scene.discretize(&Scheme::default().particles(particles)).unwrap();
            let path = problem.run().unwrap().completed().unwrap();
            let unstable = path.steps.iter().filter_map(|step| step.unstable).max().unwrap();
            println!("{moved:?} {particles:?}: {unstable} unstable modes, {} iterations", path.iterations);
            assert_eq!(unstable, 0, "{moved:?} {particles:?}");
        }
    }
}
