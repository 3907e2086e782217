//! What ends an analysis; the same bits for any number of threads.
#![cfg(feature = "solve")]

use std::ops::ControlFlow;

use approx::assert_abs_diff_eq;
use rkpm::prelude::*;
use rkpm::scene::{ConstraintKind, ConstraintMethod};
use rkpm::solve::{Cause, Driven, EquilibriumPath, Iteration, MatrixUse, State, Step};

/// The rubber of §6 of the paper [MPa].
fn rubber(k: f64) -> Rubber {
    Rubber::yeoh(0.373, -0.031, 0.005, k).unwrap()
}

fn tube(material: Rubber, pressure: f64) -> Problem<1> {
    Scene::new(Block::new([6.0], [8.0]), RadialCylinder, material)
        .pressure(Side::Min, pressure)
        .discretize(&Scheme::default().particles([9]))
        .unwrap()
}

/// Counts iterations and breaks off after a number of steps.
#[derive(Default)]
struct Stopper {
    iterations: usize,
    steps: usize,
    stop_after: Option<usize>,
    stop_within: Option<usize>,
}

impl Observer for Stopper {
    fn iteration(&mut self, iteration: &Iteration) -> ControlFlow<()> {
        // Iterations with a reused tangent are not counted.
        self.iterations += usize::from(iteration.matrix == MatrixUse::Formed);
        assert!(iteration.factor > 0.0 && iteration.factor <= 1.0);
        if self.stop_within == Some(self.iterations) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn step(&mut self, step: &Step) -> ControlFlow<()> {
        self.steps += 1;
        assert!(step.iterations > 0 && step.energy > 0.0);
        if self.stop_after == Some(self.steps) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Also inside a step: nothing is lost of what was reached before it.
#[test]
fn an_observer_breaks_off_inside_a_step() {
    let mut problem = tube(rubber(1e5), 0.3);
    problem.analysis_mut().stepping = Stepping::equal(10);
    let whole = problem.run().unwrap();
    let within = whole.steps[0].iterations + whole.steps[1].iterations + 1;
    let path = problem.run_with(&mut Stopper { stop_within: Some(within), ..Stopper::default() }).unwrap();
    assert_eq!((path.ending.clone(), path.steps.len()), (Ending::Stopped, 2));
    assert_eq!(path.last(), &whole.steps[1].state);
    let path = problem.run_with(&mut Stopper { stop_within: Some(1), ..Stopper::default() }).unwrap();
    assert!(path.ending == Ending::Stopped && path.steps.is_empty() && path.iterations == 1);
}

#[test]
fn an_observer_breaks_off_and_the_path_so_far_is_kept() {
    let mut problem = tube(rubber(1e5), 0.3);
    problem.analysis_mut().stepping = Stepping::equal(10);
    let mut watch = Stopper { stop_after: Some(3), ..Stopper::default() };
    let path = problem.run_with(&mut watch).unwrap();
    assert_eq!(path.ending, Ending::Stopped);
    assert_eq!((path.steps.len(), watch.steps), (3, 3));
    // Three tenths, added up.
    assert_abs_diff_eq!(path.last().load, 0.3, epsilon = 1e-12);
    assert_eq!(path.iterations, watch.iterations);
    let error = path.completed().unwrap_err();
    assert!(error.to_string().contains("after 3 converged steps: an observer broke off"), "{error}");
    // Without the break the same analysis is complete.
    let mut watch = Stopper::default();
    let path = problem.run_with(&mut watch).unwrap().completed().unwrap();
    assert_eq!((path.steps.len(), watch.steps, path.last().load), (10, 10, 1.0));
    assert_eq!(path.steps.iter().map(|s| s.iterations).sum::<usize>(), path.iterations);
}

#[test]
fn a_stalled_analysis_returns_the_path_so_far_and_why() {
    // A neo-Hookean tube carries p = µ ln(B/A) = 2 · 0.373 · ln(8/6) = 0.2146 MPa at most.
    let problem = tube(Rubber::neo_hookean(0.373, 1e5).unwrap(), 0.46);
    let path = problem.run().unwrap();
    let Ending::Stalled(why) = path.ending.clone() else { panic!("{:?}", path.ending) };
    assert!(matches!(why.driven, Driven::ByLoads | Driven::ByControl) && why.largest_load >= why.load, "{why:?}");
    let bound = 2.0 * 0.373 * (8.0f64 / 6.0).ln() / 0.46;
    let reached = path.last().load;
    // Up to 1 % beyond it: nine particles are a little too stiff.
    assert!(reached > 0.8 * bound && reached < 1.01 * bound, "{reached} of {bound}");
    assert!(!path.steps.is_empty() && path.rejected > 0);
    // What is there of the path is sound: states in equilibrium, loads rising, the last one usable.
    assert!(path.steps.windows(2).all(|w| w[0].state.load < w[1].state.load));
    let bore = problem.displacement(path.last(), &[6.0].into()).unwrap()[0];
    assert!(bore > 3.0, "{bore}");
    let (load, steps) = (reached, path.steps.len());
    let error = path.completed().unwrap_err();
    match &error.error {
        rkpm::error::SolveError::Stalled { steps: s, stalled } => {
            assert_eq!((stalled.load, *s), (load, steps));
            assert_eq!(*stalled, why);
        }
        other => panic!("{other}"),
    }
}

#[test]
fn a_body_left_free_stalls_and_says_so() {
    let scene =
        Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber(1e3)).traction(Side::Max, [0.1, 0.0]);
    let path = scene.discretize(&Scheme::default().particles([5])).unwrap().run().unwrap();
    let Ending::Stalled(why) = &path.ending else { panic!("{:?}", path.ending) };
    assert!(matches!(&why.cause, Cause::FreeMotion { motions, .. } if motions.len() == 3), "{why:?}");
}

// --- Threads -------------------------------------------------------------------------------------------------

/// Every number of a path, as bits.
fn bits(path: &EquilibriumPath) -> Vec<u64> {
    let mut bits = vec![path.iterations as u64, path.rejected as u64];
    for step in &path.steps {
        let state = &step.state;
        let own = state.terms.iter().flat_map(|own| own.condensed.iter().chain(&own.history));
        let numbers = state.displacement.iter().chain(own).chain(&state.multipliers);
        bits.extend(numbers.map(|x| x.to_bits()));
        bits.extend([state.load.to_bits(), step.energy.to_bits(), step.iterations as u64]);
        bits.extend(step.inertia.iter().flat_map(|i| [i.positive as u64, i.negative as u64]));
    }
    bits
}

#[cfg(feature = "rayon")]
fn same_bits<const D: usize>(scene: &Scene<D>, scheme: &Scheme) {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            assert_eq!(rayon::current_num_threads(), threads);
            let path = scene.discretize(scheme).unwrap().run().unwrap();
            assert!(!path.steps.is_empty(), "{:?}", path.ending);
            bits(&path)
        })
    };
    let one = run(1);
    for threads in [2, 3] {
        let others = run(threads);
        assert_eq!(one.len(), others.len());
        let different = one.iter().zip(&others).filter(|(a, b)| a != b).count();
        assert_eq!(different, 0, "{different} of {} numbers differ with {threads} threads", one.len());
    }
}

#[cfg(feature = "rayon")]
#[test]
fn one_and_more_threads_give_the_same_bits_in_2d() {
    let scene = Scene::new(Block::new([1.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber(1e4))
        .hold((0, Side::Min))
        .prescribe((0, Side::Max), 1, 0.2)
        .pressure((1, Side::Max), 0.05);
    let scheme = Scheme::default().particles([41]);
    same_bits(&scene, &scheme.clone().constraint_method(ConstraintMethod::Transformation));
    same_bits(&scene, &scheme.constraint_method(ConstraintMethod::Multipliers));
    let round = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), Axisymmetric, rubber(1e4))
        .prescribe((0, Side::Min), 0, 0.0)
        .hold((1, Side::Min))
        .traction((1, Side::Max), [0.0, 0.1]);
    same_bits(&round, &Scheme::default().particles([21]));
}

#[cfg(feature = "rayon")]
#[test]
fn one_and_more_threads_give_the_same_bits_in_3d() {
    let scene = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber(1e4)).hold((2, Side::Min)).prescribe(
        (2, Side::Max),
        2,
        -0.1,
    );
    same_bits(&scene, &Scheme::default().particles([9]));
}

#[test]
fn values_that_differ_by_rounding_where_conditions_meet_are_the_same() {
    let scene = Scene::new(Block::new([1.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 10.0).unwrap())
        .prescribe((0, Side::Min), 0, 0.0)
        // 8e-17 at the corner.
        .prescribe((1, Side::Min), 0, Value::field(|x: &Point<2>| 1.1 * x[0] - x[0] - 0.1))
        .prescribe((1, Side::Min), 1, 0.0);
    let schemes =
        [Scheme::default(), Scheme::default().constraint_kind(ConstraintKind::AtParticles), Scheme::elements(1)];
    for scheme in schemes {
        assert!(scene.discretize(&scheme.particles([5])).is_ok());
    }
    let contradicted = scene.prescribe((0, Side::Min), 0, Value::field(|_: &Point<2>| 1e-9));
    assert!(contradicted.discretize(&Scheme::elements(1).particles([5])).is_err());
}

#[test]
fn the_axis_stays_where_it_is() {
    let rubber = || Rubber::neo_hookean(0.5, 10.0).unwrap();
    let rod = Scene::new(Block::new([0.0], [1.0]), RadialCylinder, rubber()).prescribe(Side::Max, 0, 0.1);
    assert!(rod.clone().prescribe(Side::Min, 0, 0.0).discretize(&Scheme::default()).is_ok());
    let error = rod.prescribe(Side::Min, 0, 0.1).discretize(&Scheme::default()).err().unwrap();
    assert!(error.to_string().contains("axis"), "{error}");
}

#[test]
fn runs_start_at_most_where_they_end() {
    let problem = tube(Rubber::neo_hookean(0.5, 10.0).unwrap(), 0.01);
    let beyond = State { load: 1.5, ..problem.run().unwrap().completed().unwrap().last().clone() };
    let error = problem.analysis().resume(problem.model(), problem.equations(), beyond, &mut ()).unwrap_err();
    assert!(error.to_string().contains("load factor of the first state"), "{error}");
    // Equal steps however many.
    let path = |steps| {
        let mut problem = tube(Rubber::neo_hookean(0.5, 10.0).unwrap(), 0.01);
        problem.analysis_mut().stepping = Stepping::equal(steps);
        problem.run().unwrap().completed().unwrap().steps.len()
    };
    assert_eq!(path(20_000), 20_000);
}
