//! GOAL: with J itself projected everything derives from one potential: work is energy, and states do not depend on how they
//! were reached. Units change nothing with either measure.
//! GEOMETRY: a bonded pad pulled to a tension of 16 shear moduli; Cook's membrane; a disk.
//! BOUNDARY: prescribed displacements; a dead load; a pressure that follows.
//! REFERENCE: the stored energy; the same body in other units.

use approx::relative_eq;
use rkpm::check;
use rkpm::prelude::*;

fn one_potential() -> Scheme {
    Scheme::default().projected_measure(ProjectedMeasure::Jacobian)
}

/// A quarter of a bonded pad of 20 × 2 whose upper plate is moved by so much.
fn pad(by: f64) -> Scene<2> {
    Scene::new(Block::new([0.0, 0.0], [10.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .prescribe((1, Side::Max), 0, 0.0)
        .prescribe((1, Side::Max), 1, by)
}

fn solved(scene: &Scene<2>, scheme: &Scheme) -> (Problem<2>, State) {
    let problem = scene.discretize(scheme).unwrap();
    let state = problem.run().unwrap().completed().unwrap().last().clone();
    (problem, state)
}

/// The largest difference of two vectors over the largest entry.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let largest = a.iter().fold(0.0, |largest: f64, a| largest.max(a.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs() / largest).fold(0.0, f64::max)
}

#[test]
fn work_is_stored() {
    let scheme = one_potential().particles([33, 7]);
    for stroke in [0.1, -0.1] {
        // Ten Gauss points over the stroke, each solved on its own: the force is a smooth function of it.
        let rule = [
            (0.148874338981631, 0.295524224714753),
            (0.433395394129247, 0.269266719309996),
            (0.679409568299024, 0.219086362515982),
            (0.865063366688985, 0.149451349150581),
            (0.973906528517172, 0.066671344308688),
        ];
        let mut work = 0.0;
        for (at, weight) in rule.iter().flat_map(|&(at, weight)| [(at, weight), (-at, weight)]) {
            let (problem, state) = solved(&pad(0.5 * stroke * (1.0 + at)), &scheme);
            work += 0.5 * stroke * weight * problem.reaction(&state, Place::on((1, Side::Max))).unwrap()[1];
        }
        let (problem, state) = solved(&pad(stroke), &scheme);
        let energy = problem.energy(&state).unwrap();
        println!("work over energy - 1 = {:.1e}", work / energy - 1.0);
        assert!(relative_eq!(work, energy, max_relative = 1e-8), "{stroke}: {work} {energy}");
    }
}

#[test]
fn states_do_not_depend_on_how_they_were_reached() {
    let scheme = one_potential().particles([33, 7]);
    let same = |a: &State, b: &State| {
        let off = apart(&a.displacement, &b.displacement).max(apart(&a.terms[0].condensed, &b.terms[0].condensed));
        println!("states apart by {off:.1e}");
        assert!(off < 1e-8, "{off:.1e}");
    };
    for stroke in [0.1, -0.1] {
        let (problem, at_once) = solved(&pad(stroke), &scheme);
        let (_, in_steps) = solved(&pad(stroke), &scheme.clone().stepping(Stepping::equal(10)));
        same(&at_once, &in_steps);
        // From a lattice half as fine a correction of the pressed pad goes elsewhere: its free edge bulges out between particles.
        if stroke > 0.0 {
            let (coarse, guess) = solved(&pad(stroke), &one_potential().particles([17, 5]));
            let guess = problem.transfer(&coarse, &guess).unwrap();
            let path = problem.analysis().correct(problem.model(), problem.equations(), guess, &mut ()).unwrap();
            same(&at_once, path.completed().unwrap().last());
        }
    }
}

#[test]
fn forces_and_tangent_are_derivatives_under_large_pressures() {
    for stroke in [0.1, -0.1] {
        let (problem, state) = solved(&pad(stroke), &one_potential().particles([17, 5]));
        let extreme = problem.pressures(&state).unwrap().unwrap().into_iter().fold(0.0, |e: f64, p| e.max(p.abs()));
        assert!(extreme > 10.0, "{extreme}");
        let report = check::term(&**problem.body(), &state.displacement, 1.0).unwrap();
        assert!(report.holds(), "{report}");
    }
}

/// The same body in N and mm, in N and m, in kN and m, …: lengths times one factor, stresses times another.
#[test]
fn units_change_nothing() {
    let membrane = |length: f64, stress: f64| {
        let corners = [[0.0, 0.0], [48.0, 44.0], [48.0, 60.0], [0.0, 44.0]].map(|x| x.map(|x| length * x));
        Scene::new(Quadrilateral { corners }, PlaneStrain, Rubber::neo_hookean(stress * 40.097, stress * 4e5).unwrap())
            .hold((0, Side::Min))
            .traction((0, Side::Max), [0.0, stress * 6.25])
    };
    let disk = |length: f64, stress: f64| {
        let rubber = Rubber::mooney_rivlin(stress * 0.5516, stress * 0.1379, stress * 689.5).unwrap();
        Scene::new(Block::new([0.0, 0.0], [length * 18.923, length * 0.635]), Axisymmetric, rubber)
            .prescribe((0, Side::Min), 0, 0.0)
            .hold((0, Side::Max))
            .pressure((1, Side::Min), stress * 0.1035)
    };
    let pad = |length: f64, stress: f64| {
        let rubber = Rubber::neo_hookean(stress * 0.5, stress * 1e3).unwrap();
        Scene::new(Block::new([0.0, 0.0], [length * 10.0, length]), PlaneStrain, rubber)
            .prescribe((0, Side::Min), 0, 0.0)
            .prescribe((1, Side::Min), 1, 0.0)
            .prescribe((1, Side::Max), 0, 0.0)
            .prescribe((1, Side::Max), 1, length * 0.1)
    };
    type Units<'a> = &'a dyn Fn(f64, f64) -> Scene<2>;
    let cases: [(Units<'_>, &[usize]); 3] = [(&membrane, &[9, 9]), (&disk, &[11, 2]), (&pad, &[33, 7])];
    for ((scene, counts), scheme) in cases.iter().flat_map(|case| [(case, one_potential()), (case, Scheme::default())])
    {
        let run = |length: f64, stress: f64| {
            let problem = scene(length, stress).discretize(&scheme.clone().particles(*counts)).unwrap();
            problem.run().unwrap().completed().unwrap()
        };
        // The first in mm and MPa.
        let first = run(1.0, 1.0);
        for (length, stress) in [(1.0, 1e-3), (1.0, 1e6), (1e-3, 1.0), (1e-3, 1e6), (1e-3, 1e-3)] {
            let path = run(length, stress);
            let counts = |path: &EquilibriumPath| (path.steps.len(), path.iterations, path.rejected);
            assert_eq!(counts(&path), counts(&first), "length {length}, stress {stress}");
            let d: Vec<f64> = path.last().displacement.iter().map(|d| d / length).collect();
            let off = apart(&first.last().displacement, &d);
            println!("length {length}, stress {stress}: {:?}, {off:.1e}", counts(&path));
            assert!(off < 1e-10, "length {length}, stress {stress}: {off:.1e}");
        }
    }
}
