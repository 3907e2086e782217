//! Laws that remember: relaxation, creep and cycles against exact curves, limits of slow and fast, softening on first stretch.

use std::sync::Arc;

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use rkpm::check;
use rkpm::material::{Material, Mullins, OgdenFoam, Past, Prestretched, Prony, TotalStretches, Viscoelastic};
use rkpm::nalgebra::Matrix3;
use rkpm::prelude::*;

const A10: f64 = 0.4;
const BULK: f64 = 100.0;

fn elastic() -> Rubber {
    Rubber::neo_hookean(A10, BULK).unwrap()
}

/// Parts and times of one to five branches: together six tenths of the stress, over three decades.
fn pairs(count: usize) -> Vec<(f64, f64)> {
    (0..count).map(|i| (0.6 / count as f64, 0.05 * 5f64.powi(i as i32))).collect()
}

fn relaxing(count: usize) -> Viscoelastic<Rubber> {
    Viscoelastic::new(elastic(), Prony::of_instantaneous(pairs(count)).unwrap())
}

const SHEAR: f64 = 0.8;

/// A block whose whole boundary follows simple shear.
fn sheared(material: impl Material + 'static, amplitude: Amplitude, clock: Amplitude) -> Scene<2> {
    Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, material)
        .with(
            Condition::on(Part::Whole)
                .component(0, Value::field(|x: &Point<2>| SHEAR * x[1]))
                .component(1, 0.0)
                .amplitude(amplitude),
        )
        .with_clock(clock)
}

/// Two cells across, whose whole boundary is fixed: the field is uniform, so that no displacement has to follow a pressure.
fn scheme() -> Scheme {
    Scheme::default().particles([3, 3]).thin_walls()
}

fn problem(scene: &Scene<2>, stepping: Stepping) -> Problem<2> {
    scene.discretize(&scheme().stepping(stepping)).unwrap()
}

/// Shear stress of a state, the same at all points.
fn shear_stress(problem: &Problem<2>, state: &rkpm::solve::State) -> f64 {
    let stresses = problem.stresses(state).unwrap();
    for stress in &stresses {
        assert!(abs_diff_eq!(stress[(0, 1)], stresses[0][(0, 1)], epsilon = 1e-9), "the field is uniform");
    }
    stresses[0][(0, 1)]
}

/// The elastic law's stress seen by the material, $\bar S$, in simple shear.
fn seen(shear: f64) -> Matrix3<f64> {
    let f = Matrix3::new(1.0, shear, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let inverse = f.try_inverse().unwrap();
    let b = f * f.transpose();
    let kirchhoff = 2.0 * A10 * (b - Matrix3::identity() * (b.trace() / 3.0));
    inverse * kirchhoff * inverse.transpose()
}

/// The exact shear stress at a time for a smooth course of the shear that starts from rest: the hereditary integral by parts and by
/// Simpson's rule with many intervals.
fn exact(count: usize, time: f64, shear: impl Fn(f64) -> f64) -> f64 {
    const INTERVALS: usize = 20_000;
    let now = seen(shear(time));
    let mut held = now * (1.0 - 0.6);
    for (part, tau) in pairs(count) {
        let mut sum = Matrix3::zeros();
        let h = time / INTERVALS as f64;
        for k in 0..=INTERVALS {
            let s = h * k as f64;
            let weight = if k == 0 || k == INTERVALS {
                1.0
            } else if k % 2 == 1 {
                4.0
            } else {
                2.0
            };
            sum += seen(shear(s)) * (weight * (-(time - s) / tau).exp());
        }
        held += (now - sum * (h / 3.0 / tau)) * part;
    }
    let f = Matrix3::new(1.0, shear(time), 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    (f * held * f.transpose())[(0, 1)]
}

#[test]
fn sudden_shear_relaxes_by_its_prony_series() {
    let hold = Amplitude::table(vec![(0.0, 0.0), (0.1, 1.0), (1.0, 1.0)]).unwrap();
    let clock = Amplitude::table(vec![(0.0, 0.0), (0.1, 0.0), (0.5, 1.0), (1.0, 50.0)]).unwrap();
    for count in 1..=5 {
        let problem = problem(&sheared(relaxing(count), hold.clone(), clock.clone()), Stepping::default());
        let path = problem.run().unwrap().completed().unwrap();
        let prony = Prony::of_instantaneous(pairs(count)).unwrap();
        let mut last = f64::INFINITY;
        for step in path.steps.iter().filter(|step| step.state.load >= 0.1) {
            let stress = shear_stress(&problem, &step.state);
            let expected = 2.0 * A10 * SHEAR * prony.relaxation(problem.time(&step.state));
            assert!(relative_eq!(stress, expected, max_relative = 1e-8), "{count}: {stress} {expected}");
            assert!(stress <= last);
            last = stress;
        }
    }
}

/// What is moved at once, before any time has passed, relaxes from there, and so does what was stretched before it was built in.
#[test]
fn what_acts_from_the_start_relaxes_from_the_start() {
    let before = Matrix3::new(1.0, SHEAR, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let stretched = Prestretched::new(relaxing(3), before).unwrap();
    let around = Prestretched::new(elastic(), before).unwrap();
    let around = Viscoelastic::new(around, Prony::of_instantaneous(pairs(3)).unwrap());
    let held = |y: f64| Amplitude::Table(vec![(0.0, y), (1.0, y)]);
    let prony = Prony::of_instantaneous(pairs(3)).unwrap();
    for (scene, what) in [
        (sheared(relaxing(3), Amplitude::Constant, seconds(2.0)), "constant"),
        (sheared(relaxing(3), held(1.0), seconds(2.0)), "a table"),
        (sheared(stretched, held(0.0), seconds(2.0)), "stretched before"),
        (sheared(around, held(0.0), seconds(2.0)), "stretched before"),
    ] {
        for stepping in [Stepping::default(), Stepping::equal(2)] {
            let problem = problem(&scene, stepping);
            let path = problem.run().unwrap().completed().unwrap();
            for step in &path.steps {
                let expected = 2.0 * A10 * SHEAR * prony.relaxation(problem.time(&step.state));
                assert_relative_eq!(shear_stress(&problem, &step.state), expected, max_relative = 1e-8);
            }
            assert_eq!(path.steps[0].state.load == 0.0, what != "stretched before", "{what}");
        }
    }
}

/// What expands against a hold is stressed before any time passes, also where the thickness of a sheet or a foam gives way; so is a
/// sheet that was stretched before.
#[test]
fn what_is_held_while_it_expands_relaxes_from_the_start() {
    let prony = || Prony::of_instantaneous(pairs(3)).unwrap();
    let stiff = || Rubber::neo_hookean(A10, 1e5).unwrap();
    let foam = || TotalStretches(OgdenFoam::blatz_ko(0.5, 0.25, 0.5).unwrap());
    let before = || Prestretched::new(stiff(), Matrix3::from_diagonal(&[1.2, 1.2, 1.0].into())).unwrap();
    fn sheet(law: impl Material + 'static, stretch: f64) -> Scene<2> {
        let square = Block::new([0.0, 0.0], [1.0, 1.0]);
        Scene::new(square, PlaneStress { thickness: 1.0 }, law).hold(Part::Whole).with_expansion(stretch)
    }
    fn cube(law: impl Material + 'static) -> Scene<3> {
        Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, law).hold(Part::Whole).with_expansion(1.1)
    }
    fn stresses<const D: usize>(scene: Scene<D>) -> Vec<(f64, f64)> {
        let scheme = Scheme::default().particles([4]).stepping(Stepping::equal(2));
        let problem = scene.over_time(2.0).discretize(&scheme).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let stress = |step: &rkpm::solve::Step| problem.stresses(&step.state).unwrap()[0][(0, 0)];
        path.steps.iter().map(|step| (problem.time(&step.state), stress(step))).collect()
    }
    let runs = [
        ("sheet", stresses(sheet(Viscoelastic::new(stiff(), prony()), 1.1)), stresses(sheet(stiff(), 1.1))),
        ("foam", stresses(cube(Viscoelastic::new(foam(), prony()))), stresses(cube(foam()))),
        (
            "stretched before",
            stresses(sheet(Viscoelastic::new(before(), prony()), 1.0)),
            stresses(sheet(before(), 1.0)),
        ),
    ];
    for (what, relaxing, elastic) in runs {
        for ((time, stress), (_, at_once)) in relaxing.into_iter().zip(elastic) {
            assert!(at_once.abs() > 0.05, "{what}: {at_once}");
            assert_relative_eq!(stress, at_once * prony().relaxation(time), max_relative = 1e-3);
        }
    }
}

/// The pressure of rubber that is held while it expands, which relaxes nowhere, is there from the start, whatever part of it stays pointwise.
#[test]
fn pressures_of_what_is_held_while_it_expands_stay() {
    let soft = Rubber::neo_hookean(A10, 20.0).unwrap();
    let law = Viscoelastic::new(soft.clone(), Prony::of_instantaneous(pairs(3)).unwrap());
    let scheme = Scheme::default().particles([5]).stepping(Stepping::equal(4));
    let block = Block::new([0.0, 0.0], [1.0, 1.0]);
    let scene = Scene::new(block, PlaneStrain, law).hold(Part::Whole).with_expansion(1.05).over_time(2.0);
    let problem = scene.discretize(&scheme).unwrap();
    assert_ne!(problem.body().field(), PressureField::Displacement);
    let path = problem.run().unwrap().completed().unwrap();
    // No step before time passes.
    assert!(path.steps[0].state.load > 0.0);
    // Cauchy: U'(J) of the elastic part.
    let pressure = soft.volumetric().unwrap().evaluate(1.05f64.powi(-3)).slope;
    for step in &path.steps {
        for stress in problem.stresses(&step.state).unwrap() {
            assert_relative_eq!(stress[(0, 0)], pressure, max_relative = 1e-8);
        }
    }
}

/// Rubber that was stretched before it was built in is softened by that.
#[test]
fn what_was_stretched_before_is_softened() {
    let softening = || Mullins::new(elastic(), 1.5, 0.1, 0.1).unwrap();
    let before = Matrix3::new(1.0, SHEAR, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    let back = Amplitude::Table(vec![(0.0, 0.0), (1.0, -0.5)]);
    let there_and_back = Amplitude::Table(vec![(0.0, 0.0), (0.5, 1.0), (1.0, 0.5)]);
    let stress = |scene: Scene<2>| {
        let problem = problem(&scene, Stepping::default());
        let path = problem.run().unwrap().completed().unwrap();
        shear_stress(&problem, path.last())
    };
    let stretched = Prestretched::new(softening(), before).unwrap();
    let around = Mullins::new(Prestretched::new(elastic(), before).unwrap(), 1.5, 0.1, 0.1).unwrap();
    let pulled = stress(sheared(softening(), there_and_back, seconds(1.0)));
    for built_in in [sheared(stretched, back.clone(), seconds(1.0)), sheared(around, back, seconds(1.0))] {
        assert_relative_eq!(stress(built_in), pulled, max_relative = 1e-8);
    }
    assert!(pulled < 0.9 * A10 * SHEAR, "{pulled} of {}", A10 * SHEAR);
}

/// Between the steps of a run as well: exact where the shear is held, whatever lies between the steps.
#[test]
fn states_between_steps_relax_as_well() {
    let hold = Amplitude::table(vec![(0.0, 0.0), (0.1, 1.0), (1.0, 1.0)]).unwrap();
    let clock = Amplitude::table(vec![(0.0, 0.0), (0.1, 0.0), (1.0, 2.0)]).unwrap();
    let stepping = Stepping { time_tolerance: f64::INFINITY, ..Stepping::default() };
    let problem = problem(&sheared(relaxing(3), hold, clock), stepping);
    let path = problem.run().unwrap().completed().unwrap();
    let prony = Prony::of_instantaneous(pairs(3)).unwrap();
    for state in problem.states_at(&path, &[0.15, 0.2, 0.4, 0.7]).unwrap() {
        let expected = 2.0 * A10 * SHEAR * prony.relaxation(problem.time(&state));
        let stress = shear_stress(&problem, &state);
        assert!(relative_eq!(stress, expected, max_relative = 1e-8), "{}: {stress} {expected}", state.load);
    }
}

/// Two periods and a half of a sine over two seconds and a half.
fn sine() -> Amplitude {
    Amplitude::Function(Arc::new(|load| (std::f64::consts::TAU * 2.5 * load).sin()))
}

fn seconds(duration: f64) -> Amplitude {
    Amplitude::Table(vec![(0.0, 0.0), (1.0, duration)])
}

/// The largest error of a run beside the largest stress, at up to twenty of its states.
fn error_of_sine(count: usize, stepping: Stepping) -> (f64, usize) {
    let problem = problem(&sheared(relaxing(count), sine(), seconds(2.5)), stepping);
    let path = problem.run().unwrap().completed().unwrap();
    let course = |t: f64| SHEAR * (std::f64::consts::TAU * t).sin();
    let (mut error, mut largest) = (0.0f64, 0.0f64);
    for step in path.steps.iter().step_by(path.steps.len().div_ceil(20)) {
        let expected = exact(count, problem.time(&step.state), course);
        error = error.max((shear_stress(&problem, &step.state) - expected).abs());
        largest = largest.max(expected.abs());
    }
    (error / largest, path.steps.len())
}

#[test]
fn cycles_follow_the_hereditary_integral() {
    for count in 1..=5 {
        let first = Stepping { first: 0.01, smallest: 1e-6, ..Stepping::default() };
        let (error, steps) = error_of_sine(count, first);
        assert!(error < 1e-3, "{count} branches: {error:e} in {steps} steps");
    }
}

#[test]
fn steps_of_time_are_of_second_order() {
    for count in [1, 3] {
        let errors = [40, 80, 160].map(|steps| error_of_sine(count, Stepping::equal(steps)).0);
        let order = (errors[1] / errors[2]).log2();
        assert!(order >= 1.9, "{count} branches: {errors:?}, order {order:.3}");
    }
}

#[test]
fn fast_and_slow_are_the_two_elastic_laws() {
    for (duration, part) in [(1e-11, 1.0), (1e16, 0.4)] {
        let problem = problem(&sheared(relaxing(3), Amplitude::Ramp, seconds(duration)), Stepping::equal(4));
        let path = problem.run().unwrap().completed().unwrap();
        let stress = shear_stress(&problem, path.last());
        assert!(relative_eq!(stress, part * 2.0 * A10 * SHEAR, max_relative = 1e-8), "{duration:e}: {stress}");
    }
    // Without a clock nothing relaxes; constants of the relaxed law add their branches to it.
    let prony = Prony::of_relaxed([(0.5, 1.0), (0.25, 3.0)]).unwrap();
    let scene = sheared(Viscoelastic::new(elastic(), prony), Amplitude::Ramp, seconds(1e-12));
    let problem = problem(&scene, Stepping::equal(2));
    let path = problem.run().unwrap().completed().unwrap();
    assert_relative_eq!(shear_stress(&problem, path.last()), 1.75 * 2.0 * A10 * SHEAR, max_relative = 1e-8);
}

/// Bonded, where pressures vary and what stabilises the scheme has its part of the force: pressed suddenly the instantaneous law under the
/// same scheme, held for ever from then on, or pressed slowly, the relaxed one. In between all stresses fall alike, but for the bulk modulus.
#[test]
fn a_bonded_disc_is_the_instantaneous_law_and_relaxes_to_the_relaxed_one() {
    let disc = |material: Arc<dyn Material>, course: Amplitude, clock: Amplitude| {
        let down = Condition::on((1, Side::Max)).displacement([0.0, -0.1]).amplitude(course).named("top");
        let disc = Scene::new(Block::new([0.0, 0.0], [4.0, 1.0]), Axisymmetric, material)
            .prescribe((0, Side::Min), 0, 0.0)
            .hold((1, Side::Min))
            .with(down)
            .with_clock(clock);
        let problem = disc.discretize(&Scheme::default().particles([9, 5])).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        let forces = path.steps.iter().map(|step| problem.reaction(&step.state, "top").unwrap()[1]);
        (forces.collect::<Vec<f64>>(), path)
    };
    let elastic = |part: f64| -> f64 {
        let law = Arc::new(Rubber::neo_hookean(part * A10, BULK).unwrap());
        *disc(law, Amplitude::Ramp, seconds(1.0)).0.last().unwrap()
    };
    let held = |duration: f64| {
        let course = Amplitude::table(vec![(0.0, 0.0), (0.1, 1.0), (1.0, 1.0)]).unwrap();
        let clock = Amplitude::table(vec![(0.0, 0.0), (0.1, 0.0), (1.0, duration)]).unwrap();
        disc(Arc::new(relaxing(3)), course, clock)
    };
    let (instantaneous, relaxed) = (elastic(1.0), elastic(0.4));
    let (forces, path) = held(1e16);
    assert_relative_eq!(forces[0], instantaneous, max_relative = 1e-8);
    assert_relative_eq!(*forces.last().unwrap(), relaxed, max_relative = 1e-8);
    assert_eq!(path.rejected, 0);
    let slow = disc(Arc::new(relaxing(3)), Amplitude::Ramp, seconds(1e16)).0;
    assert_relative_eq!(*slow.last().unwrap(), relaxed, max_relative = 1e-8);
}

/// A small dead load, put on suddenly, on a body nearly incompressible: it creeps by the compliance of the standard solid.
#[test]
fn dead_loads_creep() {
    let (g, tau) = (0.5, 2.0);
    let material =
        Viscoelastic::new(Rubber::neo_hookean(A10, 1e5).unwrap(), Prony::of_instantaneous([(g, tau)]).unwrap());
    let sudden = Amplitude::table(vec![(0.0, 0.0), (0.1, 1.0), (1.0, 1.0)]).unwrap();
    let clock = Amplitude::table(vec![(0.0, 0.0), (0.1, 0.0), (1.0, 12.0)]).unwrap();
    let scene = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, material)
        .prescribe((0, Side::Min), 0, 0.0)
        .prescribe((1, Side::Min), 1, 0.0)
        .with(Load::traction((0, Side::Max), [1e-4, 0.0]).amplitude(sudden))
        .with_clock(clock);
    let problem = problem(&scene, Stepping::default());
    let path = problem.run().unwrap().completed().unwrap();
    // Plane strain, incompressible: strain = stress/(4 µ).
    let initial = 1e-4 / (4.0 * 2.0 * A10);
    let mut seen = 0;
    for step in path.steps.iter().filter(|step| step.state.load >= 0.1) {
        let t = problem.time(&step.state);
        let compliance = (1.0 - g * (-(1.0 - g) * t / tau).exp()) / (1.0 - g);
        let moved = problem.displacement(&step.state, &[1.0, 0.5].into()).unwrap()[0];
        assert!(
            abs_diff_eq!(moved / (initial * compliance), 1.0, epsilon = 1e-3),
            "{t}: {moved} {}",
            initial * compliance
        );
        seen += 1;
    }
    assert!(seen > 5);
}

#[test]
fn runs_that_remember_are_resumed_bit_for_bit() {
    let problem = problem(
        &sheared(relaxing(2), sine(), seconds(2.5)),
        Stepping { first: 0.02, smallest: 1e-6, ..Stepping::default() },
    );
    let whole = problem.run().unwrap().completed().unwrap();
    for kept in [1, 2, whole.steps.len() / 2] {
        let mut broken = whole.clone();
        broken.steps.truncate(kept);
        let resumed = problem.resume(broken, &mut ()).unwrap().completed().unwrap();
        assert_eq!(resumed.steps.len(), whole.steps.len());
        for (a, b) in resumed.steps.iter().zip(&whole.steps) {
            assert_eq!(a.state, b.state);
        }
    }
}

/// The memory goes along to another discretisation: relaxed there, the stress is that of the one before.
#[test]
fn memories_are_transferred() {
    let hold = Amplitude::table(vec![(0.0, 0.0), (0.1, 1.0), (1.0, 1.0)]).unwrap();
    let scene = sheared(relaxing(2), hold, seconds(10.0));
    let (particles, elements) =
        (|n: usize| scheme().particles([n, n]), |n: usize| Scheme::elements(2).particles([n, n]));
    for [coarse, fine] in [[particles(3), particles(5)], [elements(3), particles(5)], [particles(3), elements(5)]] {
        let [coarse, fine] = [coarse, fine].map(|scheme| scene.discretize(&scheme).unwrap());
        let path = coarse.run().unwrap().completed().unwrap();
        let state = fine.transfer(&coarse, path.last()).unwrap();
        let [before, after] = [shear_stress(&coarse, path.last()), shear_stress(&fine, &state)];
        assert_abs_diff_eq!(before / after, 1.0, epsilon = 1e-9);
        assert!(before < 0.75 * 2.0 * A10 * SHEAR);
    }
}

#[test]
fn bodies_that_do_not_remember_carry_nothing() {
    let scene = sheared(elastic(), Amplitude::Ramp, seconds(1.0));
    let plain = problem(&scene, Stepping::default());
    let clusters = 0..plain.body().table().clusters().count();
    let condensed = clusters.map(|cluster| plain.body().unknowns(cluster).end).max().unwrap();
    assert_eq!(plain.at_rest().terms[0].condensed.len(), condensed);
    assert_eq!(plain.body().layout().history, 0);
    let path = plain.run().unwrap().completed().unwrap();
    assert_eq!(path.steps.len(), 1, "time is no reason for steps where nothing relaxes");
}

/// GOAL: a sheet in plane stress whose law remembers is the body in space with free faces, pulled, held and let go by half.
#[test]
fn sheets_that_remember_are_bodies_with_free_faces() {
    let course = || Amplitude::table(vec![(0.0, 0.0), (0.25, 1.0), (0.75, 1.0), (1.0, 0.5)]).unwrap();
    let stepping = Stepping { time_tolerance: f64::INFINITY, ..Stepping::equal(16) };
    let laws: [Arc<dyn Material>; 2] =
        [Arc::new(relaxing(2)), Arc::new(Mullins::new(elastic(), 1.6, 0.02, 0.1).unwrap())];
    for law in laws {
        let sheet = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStress { thickness: 1.0 }, law.clone())
            .prescribe((0, Side::Min), 0, 0.0)
            .prescribe((1, Side::Min), 1, 0.0)
            .with(Condition::on((0, Side::Max)).component(0, 0.6).amplitude(course()).named("pull"))
            .over_time(3.0);
        let body = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, law)
            .prescribe((0, Side::Min), 0, 0.0)
            .prescribe((1, Side::Min), 1, 0.0)
            .prescribe((2, Side::Min), 2, 0.0)
            .with(Condition::on((0, Side::Max)).component(0, 0.6).amplitude(course()).named("pull"))
            .over_time(3.0);
        let sheet = sheet.discretize(&Scheme::default().particles([3, 3]).stepping(stepping)).unwrap();
        let body = body.discretize(&Scheme::default().particles([3, 3, 3]).stepping(stepping)).unwrap();
        let (flat, thick) = (sheet.run().unwrap().completed().unwrap(), body.run().unwrap().completed().unwrap());
        assert_eq!(flat.steps.len(), thick.steps.len());
        for (a, b) in flat.steps.iter().zip(&thick.steps) {
            let (force, other) =
                (sheet.reaction(&a.state, "pull").unwrap()[0], body.reaction(&b.state, "pull").unwrap()[0]);
            assert!(abs_diff_eq!(force, other, epsilon = 1e-6 * A10), "{} {force} {other}", a.state.load);
            for stress in sheet.stresses(&a.state).unwrap() {
                assert_abs_diff_eq!(stress[(2, 2)], 0.0, epsilon = 1e-9);
                assert_abs_diff_eq!(stress[(0, 1)], 0.0, epsilon = 1e-8);
            }
        }
    }
}

#[test]
fn refusals_of_time_say_why() {
    let falling = Amplitude::table(vec![(0.0, 0.0), (0.5, 1.0), (1.0, 0.5)]).unwrap();
    let scene = sheared(relaxing(1), Amplitude::Ramp, falling);
    let error = scene.discretize(&scheme()).err().unwrap().to_string();
    assert!(error.contains("clock"), "{error}");
    assert!(Prony::of_instantaneous([(0.6, 1.0), (0.4, 2.0)]).is_err());
    assert!(Prony::of_instantaneous([(0.6, 0.0)]).is_err() && Prony::of_relaxed([]).is_err());
    assert!(Mullins::new(elastic(), 1.0, 0.1, 0.1).is_err() && Mullins::new(elastic(), 2.0, 0.0, 0.0).is_err());
    // A tolerance below what the smallest step keeps.
    let stepping = Stepping { smallest: 0.05, time_tolerance: 1e-15, ..Stepping::default() };
    let path = problem(&sheared(relaxing(1), sine(), seconds(2.5)), stepping).run().unwrap();
    let why = path.completed().unwrap_err().to_string();
    assert!(why.contains("smallest time step"), "{why}");
}

/// A body held for a duration of up to 2e5 times what its law needs to relax follows the law all the same.
#[test]
fn short_relaxation_in_a_long_time_is_followed() {
    let sudden = Amplitude::table(vec![(0.0, 0.0), (1e-5, 1.0), (1.0, 1.0)]).unwrap();
    for duration in [1e3, 1e4] {
        let problem = problem(&sheared(relaxing(1), sudden.clone(), seconds(duration)), Stepping::default());
        let path = problem.run().unwrap().completed().unwrap();
        let ramp = 1e-5 * duration;
        for step in &path.steps {
            let time = duration * step.state.load;
            let relaxed = 0.4 * 2.0 * A10 * SHEAR;
            // Twenty times the time of the law.
            let expected = if time < 1.0 { exact(1, time, |t| SHEAR * (t / ramp).min(1.0)) } else { relaxed };
            let given = shear_stress(&problem, &step.state);
            assert!(relative_eq!(given, expected, max_relative = 2e-3), "{duration} {time} {given} {expected}");
        }
    }
}

/// erf by its series.
fn erf(x: f64) -> f64 {
    let (mut term, mut sum) = (x, x);
    for n in 1..200 {
        term *= -x * x / f64::from(n);
        sum += term / f64::from(2 * n + 1);
    }
    sum * 2.0 / std::f64::consts::PI.sqrt()
}

/// GOAL: unloading and reloading curves of Ogden and Roxburgh in planar tension, plane strain with free sides.
#[test]
fn softened_rubber_unloads_and_reloads_on_one_curve() {
    let (r, m, beta) = (1.4, 0.3, 0.15);
    // To 2, back to 1.2, on to 2.5.
    let course = Amplitude::table(vec![(0.0, 0.0), (0.3, 1.0), (0.6, 0.2), (1.0, 1.5)]).unwrap();
    let scene =
        Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, Mullins::new(elastic(), r, m, beta).unwrap())
            .prescribe((0, Side::Min), 0, 0.0)
            .prescribe((1, Side::Min), 1, 0.0)
            .with(Condition::on((0, Side::Max)).component(0, 1.0).amplitude(course));
    let problem = problem(&scene, Stepping::equal(20));
    let path = problem.run().unwrap().completed().unwrap();

    let energy = |l: f64, x: f64| A10 * ((l * l + x * x + 1.0) * (l * x).powf(-2.0 / 3.0) - 3.0);
    let (mut largest, mut softened) = (0.0, 0);
    for step in &path.steps {
        let f = problem.deformation_gradients(&step.state).unwrap()[0];
        let l = f[(0, 0)];
        // The free side by bisection: η ∂W̄/∂x + k (J - 1) l = 0.
        let stress = |x: f64, along: bool| {
            let w = energy(l, x);
            let eta = if w < largest { 1.0 - erf((largest - w) / (m + beta * largest)) / r } else { 1.0 };
            let (c, i1) = ((l * x).powf(-2.0 / 3.0), l * l + x * x + 1.0);
            let own = if along { l } else { x };
            let shape = A10 * c * (2.0 * own - 2.0 / 3.0 * i1 / own);
            eta * shape + BULK * (l * x - 1.0) * (l * x / own)
        };
        let (mut low, mut high) = (0.5 / l, 2.0 / l);
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if stress(middle, false) < 0.0 { low = middle } else { high = middle }
        }
        let expected = stress(low, true);
        let force = problem.reaction(&step.state, (0, Side::Max)).unwrap()[0];
        assert!(abs_diff_eq!(force, expected, epsilon = 1e-8 * (1.0 + expected.abs())), "{l}: {force} {expected}");
        assert_abs_diff_eq!(f[(1, 1)], low, epsilon = 1e-8);
        softened += usize::from(energy(l, low) < largest * (1.0 - 1e-9));
        largest = f64::max(largest, energy(l, low));
    }
    assert!(softened >= 8, "{softened}");
}

/// A law that softens has a kink where it has been before: `check::material` takes the side on which it looks.
#[test]
fn softening_laws_keep_the_contract() {
    for law in
        [Rubber::neo_hookean(0.5, BULK), Rubber::neo_hookean(0.2, BULK), Rubber::yeoh(0.373, -0.031, 0.005, BULK)]
    {
        for (r, m, beta) in [(1.5, 0.5, 0.1), (2.0, 0.1, 0.0)] {
            let report = check::material(&Mullins::new(law.clone().unwrap(), r, m, beta).unwrap());
            assert!(report.holds(), "{report}");
        }
    }
}

/// Stress and tangent are derivatives of the energy of a step, and with no time elapsed the memory gives the stress back.
#[test]
fn steps_of_laws_that_remember_are_hyperelastic() {
    let ogden = Rubber::ogden([(0.6, 1.3), (-0.01, -2.0)], BULK).unwrap();
    let foam = Rubber::blatz_ko(0.4, 0.25, 0.3).unwrap();
    let prony = || Prony::of_instantaneous([(0.3, 0.5), (0.2, 4.0)]).unwrap();
    let laws: [Box<dyn Material>; 4] = [
        Box::new(Viscoelastic::new(ogden.clone(), prony())),
        Box::new(Viscoelastic::new(foam, prony())),
        Box::new(Mullins::new(ogden, 1.5, 0.2, 0.1).unwrap()),
        Box::new(relaxing(4)),
    ];
    let first = Matrix3::new(1.4, 0.3, -0.1, 0.1, 0.8, 0.2, -0.2, 0.1, 1.1);
    let second = Matrix3::new(1.15, 0.1, 0.1, -0.1, 0.95, 0.15, 0.1, -0.1, 1.05);
    for (k, law) in laws.iter().enumerate() {
        let rest = law.rest();
        let mut memory = rest.clone();
        law.remember(&first, Past { memory: &rest, elapsed: 0.3 }, &mut memory);
        let all = [0, 1, 2, 3, 4, 5, 6, 7, 8];
        let respond = |f: &Matrix3<f64>, memory: &[f64], elapsed: f64| {
            let (mut p, mut a) = ([0.0; 9], [0.0; 81]);
            law.respond(f, Past { memory, elapsed }, &all, &mut p, &mut a);
            (p, a)
        };
        let (p, a) = respond(&second, &memory, 0.7);
        const H: f64 = 1e-5;
        for c in 0..9 {
            let mut ahead = second;
            let mut behind = second;
            ahead[(c / 3, c % 3)] += H;
            behind[(c / 3, c % 3)] -= H;
            let past = Past { memory: &memory, elapsed: 0.7 };
            let slope = (law.energy_from(&ahead, past) - law.energy_from(&behind, past)) / (2.0 * H);
            assert!(abs_diff_eq!(slope, p[c], epsilon = 1e-8), "law {k}, P {c}: {slope} {}", p[c]);
            let (ahead, behind) = (respond(&ahead, &memory, 0.7).0, respond(&behind, &memory, 0.7).0);
            for d in 0..9 {
                let slope = (ahead[d] - behind[d]) / (2.0 * H);
                assert!(
                    abs_diff_eq!(slope, a[9 * d + c], epsilon = 1e-7),
                    "law {k}, A {d} {c}: {slope} {}",
                    a[9 * d + c]
                );
            }
        }
        let mut next = vec![0.0; law.memory()];
        law.remember(&second, Past { memory: &memory, elapsed: 0.7 }, &mut next);
        let again = respond(&second, &next, 0.0).0;
        for c in 0..9 {
            assert!(abs_diff_eq!(again[c], p[c], epsilon = 1e-13), "law {k}: {} {}", again[c], p[c]);
        }
        // Nothing is felt at rest.
        assert_abs_diff_eq!(respond(&Matrix3::identity(), &rest, 1.0).0[..], [0.0; 9][..], epsilon = 1e-15);
    }
}

/// Sheets that remember have the thickness that their history leaves them: that of the body with free faces.
#[test]
fn thickness_follows_from_the_history() {
    let soft = || Rubber::neo_hookean(A10, 2.0).unwrap();
    let course = || Amplitude::table(vec![(0.0, 0.0), (0.5, 1.0), (1.0, 0.3)]).unwrap();
    let stepping = Stepping { time_tolerance: f64::INFINITY, ..Stepping::equal(20) };
    let laws: [Arc<dyn Material>; 2] = [
        Arc::new(Viscoelastic::new(soft(), Prony::of_instantaneous([(0.6, 1.0)]).unwrap())),
        Arc::new(Mullins::new(soft(), 1.5, 0.05, 0.1).unwrap()),
    ];
    for law in laws {
        let pull = || Condition::on((0, Side::Max)).component(0, 1.0).amplitude(course());
        let sheet = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStress { thickness: 1.0 }, law.clone())
            .prescribe((0, Side::Min), 0, 0.0)
            .prescribe((1, Side::Min), 1, 0.0)
            .with(pull())
            .over_time(3.0);
        let body = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, law)
            .prescribe((0, Side::Min), 0, 0.0)
            .prescribe((1, Side::Min), 1, 0.0)
            .prescribe((2, Side::Min), 2, 0.0)
            .with(Condition::on((0, Side::Max)).component(0, 1.0).amplitude(course()))
            .over_time(3.0);
        let sheet = sheet.discretize(&Scheme::default().particles([3, 3]).stepping(stepping)).unwrap();
        let body = body.discretize(&Scheme::default().particles([3, 3, 3]).stepping(stepping)).unwrap();
        let (flat, thick) = (sheet.run().unwrap().completed().unwrap(), body.run().unwrap().completed().unwrap());
        for (a, b) in flat.steps.iter().zip(&thick.steps) {
            let f = |of: Vec<Matrix3<f64>>| of[0][(2, 2)];
            let across = f(sheet.deformation_gradients(&a.state).unwrap());
            let other = f(body.deformation_gradients(&b.state).unwrap());
            assert!(abs_diff_eq!(across, other, epsilon = 1e-6), "{}: {across} {other}", a.state.load);
        }
    }
}
