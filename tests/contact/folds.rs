//! States that jump to folded ones under a plate.

use rkpm::error::Cause;
use rkpm::prelude::*;
use rkpm::solve::Ending;

/// How evenly volume changes in a state: the largest J over the smallest.
fn unevenness(problem: &Problem<2>, state: &State) -> f64 {
    let jacobians = problem.deformation_gradients(state).unwrap().into_iter().map(|f| f.determinant());
    let [low, high] = jacobians.fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], j| [low.min(j), high.max(j)]);
    high / low
}

/// A sleeve that tapers, held at its base and pressed by a plate on its rounded top by 0.4 of its height: from 0.6 of that on its inside
/// creases, and fine models jump to states whose force has fallen by a third and more, with J from 0.1 to 2 at k/µ = 500. Such a jump
/// is no step, however short: the run ends with its cause, and with the states before it. On coarse models nothing jumps.
#[test]
fn a_jump_to_a_folded_state_ends_the_run() {
    let mut jumps = 0;
    for spacing in [2.0, 1.6, 1.25, 1.0, 0.8] {
        let outline = Outline::at([6.0, 0.0])
            .line("bottom", [15.0, 0.0])
            .line("outside", [12.0, 18.0])
            .arc("top", [9.0, 18.0], [10.5, 18.0], Turn::Left)
            .close("bore");
        let plate = RigidSurface::plane([0.0, 19.5], [0.0, -1.0]).moving([0.0, -7.8]).named("plate");
        let sleeve = Scene::new(Region::new(outline).unwrap(), Axisymmetric, Rubber::neo_hookean(0.5, 500.0).unwrap())
            .hold("bottom")
            .contact("top", plate);
        let eighths = Stepping { first: 0.125, largest: 0.125, ..Stepping::default() };
        let problem = sleeve.discretize(&Scheme::default().spacing(spacing).stepping(eighths)).unwrap();
        let path = problem.run().unwrap();
        let forces: Vec<f64> =
            path.steps.iter().map(|step| -problem.contact(&step.state, "plate").unwrap().force[1]).collect();
        let particles = problem.cells().positions().len();
        let (load, uneven) = (path.last().load, unevenness(&problem, path.last()));
        println!("{particles} particles: {:.2} N at {load:.3}, J uneven by {uneven:.1}", forces[forces.len() - 1]);
        // The sleeve softens by up to 23 % in an eighth of the way; what jumped lost a third and more at once.
        let fall = forces.windows(2).map(|pair| 1.0 - pair[1] / pair[0]).fold(0.0, f64::max);
        assert!(fall < 0.25, "{particles} particles: {fall}");
        if let Ending::Stalled(stalled) = &path.ending {
            let Cause::Folded { before, after } = stalled.cause else { panic!("{stalled:?}") };
            assert!(load > 0.6 && after > 1.8 * before && uneven < 10.0, "{particles} particles: {uneven}");
            jumps += 1;
        }
    }
    assert_eq!(jumps, 3);
}
