//! Losing nothing: journals hold whole steps whenever a run dies, and resumed runs differ in no bit.
#![cfg(feature = "serde")]

#[path = "../../examples/support/killed.rs"]
mod killed;

use std::fs;
use std::path::PathBuf;
use std::process::Command;

use approx::assert_abs_diff_eq;
use killed::differences;
use rkpm::error::{OutputError, SolveError};
use rkpm::output::{Flush, Journal};
use rkpm::prelude::*;
use rkpm::scene::ConstraintMethod;
use rkpm::solve::{EnclosedVolume, Newton, State, StepControl};
use rkpm::term::TermState;

/// A folder of this test's own, emptied first.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("resume").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    folder
}

fn rubber() -> Rubber {
    Rubber::yeoh(0.373, -0.031, 0.005, 1e3).unwrap()
}

/// A held block that is pulled, in steps that grow.
fn pulled(constraint_method: ConstraintMethod) -> Problem<2> {
    Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
        .hold(Side::Min)
        .prescribe(Side::Max, 0, 0.8)
        .traction((1, Side::Max), [0.0, 0.05])
        .discretize(&Scheme::default().particles([5, 3]).constraint_method(constraint_method).stepping(Stepping {
            first: 0.1,
            control: StepControl::Load,
            ..Stepping::default()
        }))
        .unwrap()
}

/// Takes a path back to its first steps, by way of a file.
fn broken_off(path: &EquilibriumPath, steps: usize, folder: &std::path::Path) -> EquilibriumPath {
    let file = folder.join(format!("{steps}.jsonl"));
    let mut journal = Journal::create(&file, &path.start).unwrap().flush(Flush::System);
    for step in &path.steps[..steps] {
        assert!(journal.step(step).is_continue());
    }
    drop(journal);
    let read = Journal::read(&file).unwrap();
    assert_eq!((read.steps.len(), &read.ending), (steps, &Ending::Interrupted));
    read
}

/// Resumes after each of the steps and requires the whole path again.
fn resumes_everywhere(name: &str, whole: &EquilibriumPath, resume: impl Fn(EquilibriumPath) -> EquilibriumPath) {
    let folder = folder(name);
    assert!(whole.steps.len() >= 3, "{name}: {} steps", whole.steps.len());
    for steps in 0..=whole.steps.len() {
        let resumed = resume(broken_off(whole, steps, &folder));
        assert_eq!(differences(&resumed, whole), 0, "{name}, resumed after {steps} steps");
    }
}

#[test]
fn load_steps_resume_to_the_bit() {
    for constraint_method in [ConstraintMethod::Transformation, ConstraintMethod::Multipliers] {
        let problem = pulled(constraint_method);
        let whole = problem.run().unwrap().completed().unwrap();
        resumes_everywhere("load", &whole, |path| problem.resume(path, &mut ()).unwrap());
    }
}

#[test]
fn steps_after_rejections_resume_to_the_bit() {
    // Few iterations are allowed, so that attempts are rejected on the way.
    let mut problem = pulled(ConstraintMethod::Transformation);
    problem.analysis_mut().stepping = Stepping { first: 1.0, control: StepControl::Load, ..Stepping::default() };
    problem.analysis_mut().newton = Newton { iterations: 3, ..Newton::default() };
    let whole = problem.run().unwrap().completed().unwrap();
    assert!(whole.rejected > 0 && whole.rejected == whole.steps.iter().map(|s| s.rejected).sum::<usize>());
    resumes_everywhere("rejections", &whole, |path| problem.resume(path, &mut ()).unwrap());
}

#[test]
fn steps_around_a_turn_resume_to_the_bit() {
    let turn = |load: f64| (load * std::f64::consts::TAU).sin_cos();
    let problem = Scene::new(Block::new([-0.5, -1.0], [0.5, 1.0]), PlaneStrain, rubber())
        .prescribe(
            (1, Side::Max),
            0,
            Value::motion(move |x: &Point<2>, load| x[0] * (turn(load).1 - 1.0) - x[1] * turn(load).0),
        )
        .prescribe(
            (1, Side::Max),
            1,
            Value::motion(move |x: &Point<2>, load| x[0] * turn(load).0 + x[1] * (turn(load).1 - 1.0)),
        )
        .discretize(&Scheme::default().particles([4, 5]))
        .unwrap();
    let whole = problem.run().unwrap().completed().unwrap();
    resumes_everywhere("turn", &whole, |path| problem.resume(path, &mut ()).unwrap());
}

#[test]
fn deflection_control_resumes_to_the_bit() {
    let problem = killed::problem().unwrap();
    let whole = problem.run().unwrap().completed().unwrap();
    // The first step is a part of the load that no load stepping would take: the deflection is in control.
    assert!(whole.steps[0].state.load < 0.5 && whole.steps[0].control_state.increment > 0.0);
    resumes_everywhere("deflection", &whole, |path| problem.resume(path, &mut ()).unwrap());
}

#[test]
fn a_beam_whose_first_step_was_too_far_resumes_to_the_bit() {
    // Dead loads: the first attempt tells that a deflection should lead, and has to tell a resumed run the same.
    let problem = Scene::new(Block::new([0.0, 0.0], [10.0, 1.0]), PlaneStrain, rubber())
        .hold((0, Side::Min))
        .traction((0, Side::Max), [0.0, -0.02])
        .discretize(&Scheme::default().particles([11, 3]))
        .unwrap();
    let whole = problem.run().unwrap().completed().unwrap();
    let first = &whole.steps[0];
    assert!(first.state.load < 0.5 && first.control_state.increment > 0.0 && first.rejected == 0);
    resumes_everywhere("far", &whole, |path| problem.resume(path, &mut ()).unwrap());
}

#[test]
fn arcs_that_took_over_from_a_deflection_resume_to_the_bit() {
    // Pressed from below, the strip rolls up until what the deflection measures falls again.
    let problem = Scene::new(Block::new([0.0, 0.0], [20.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap())
        .hold((0, Side::Min))
        .pressure((1, Side::Min), 9e-4)
        .discretize(&Scheme::default().particles([21, 3]))
        .unwrap();
    let whole = problem.run().unwrap().completed().unwrap();
    let arcs = whole.steps.iter().filter(|step| step.control_state.arc).count();
    assert!(arcs > 1 && !whole.steps[0].control_state.arc, "{arcs} of {} steps", whole.steps.len());
    resumes_everywhere("arcs", &whole, |path| problem.resume(path, &mut ()).unwrap());
}

#[test]
fn controlled_runs_resume_to_the_bit() {
    // A spherical shell past its limit pressure; the second target needs halving.
    let lattice = Block::new([1.0], [1.1]).lattice([5]).unwrap();
    let rk = ReproducingKernel::new(lattice.particles(1.0).unwrap(), CubicSpline, Polynomial::linear()).unwrap();
    let body = ShapeTable::new(&rk, &lattice.coarsened(2).gauss(5).unwrap(), &RadialSphere).unwrap();
    let points = lattice.boundary(&Side::Min.into(), 1, 1).unwrap().points;
    let inner = ShapeTable::new(&rk, &points, &RadialSphere).unwrap();
    let mut model = Model::new(rk.nodes());
    model.add(Body::new(body, Rubber::neo_hookean(0.5, 1e5).unwrap(), PressureField::Linear));
    model.add(Pointwise::new(inner.clone(), FollowerPressure { pressure: 1.0, amplitude: Amplitude::Ramp }));
    let volume = EnclosedVolume::new(inner).unwrap();
    let targets = [1.1f64, 4.0, 1.5].map(|s| 4.0 / 3.0 * std::f64::consts::PI * (s.powi(3) - 1.0));
    let rows = Constraints::default();
    let analysis = Analysis { newton: Newton { iterations: 6, ..Newton::default() }, ..Analysis::default() };
    let rest = State::at_rest(&model, &rows);
    let whole = analysis.run_controlled(&model, &rows, rest, &volume, &targets, &mut ()).unwrap();
    assert!(whole.steps.len() > targets.len() && whole.rejected > 0, "{} steps", whole.steps.len());
    assert_eq!(whole.ending, Ending::Completed);
    resumes_everywhere("controlled", &whole, |path| {
        analysis.run_controlled(&model, &rows, path, &volume, &targets, &mut ()).unwrap()
    });
}

#[test]
fn stalled_runs_stall_again_and_go_on_once_they_may() {
    let mut problem = pulled(ConstraintMethod::Transformation);
    problem.analysis_mut().stepping.steps = 3;
    let folder = folder("stalled");
    let file = folder.join("run.jsonl");
    let mut journal = Journal::create(&file, &problem.at_rest()).unwrap();
    let stalled = problem.run_with(&mut journal).unwrap();
    assert!(matches!(stalled.ending, Ending::Stalled(_)));
    journal.close(&stalled).unwrap();
    // The same settings end it at the same place; more steps finish it, in the same file.
    let (mut journal, so_far) = Journal::reopen(&file).unwrap();
    assert_eq!(so_far, stalled);
    let again = problem.resume(so_far.clone(), &mut journal).unwrap();
    assert_eq!(differences(&again, &stalled), 0);
    problem.analysis_mut().stepping.steps = 1000;
    let finished = problem.resume(so_far, &mut journal).unwrap().completed().unwrap();
    journal.close(&finished).unwrap();
    assert_eq!(Journal::read(&file).unwrap(), finished);
    assert_eq!(differences(&finished, &problem.run().unwrap()), 0);
    // And a finished one stays as it is.
    assert_eq!(problem.resume(finished.clone(), &mut ()).unwrap(), finished);
}

#[test]
fn a_journal_torn_at_any_byte_holds_the_steps_before() {
    let folder = folder("torn");
    let file = folder.join("run.jsonl");
    let tube = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber()).pressure(Side::Min, 0.1);
    let stepping = Stepping { first: 0.3, ..Stepping::default() };
    let problem = tube.discretize(&Scheme::default().particles([3]).stepping(stepping)).unwrap();
    let mut journal = Journal::create(&file, &problem.at_rest()).unwrap();
    let whole = problem.run_with(&mut journal).unwrap();
    journal.close(&whole).unwrap();
    let bytes = fs::read(&file).unwrap();
    let torn = folder.join("torn.jsonl");
    let ends: Vec<usize> = (0..bytes.len()).filter(|&k| bytes[k] == b'\n').map(|k| k + 1).collect();
    assert_eq!(ends.len(), whole.steps.len() + 2);
    for length in 0..=bytes.len() {
        // What a kill leaves, and a loss of power: blocks that were reserved but never written.
        let mut piece = bytes[..length].to_vec();
        piece.resize(length + 64 * (length % 2), 0);
        fs::write(&torn, &piece).unwrap();
        let records = ends.iter().filter(|&&end| end <= length).count();
        let read = Journal::read(&torn);
        if records == 0 {
            assert!(matches!(read, Err(OutputError::Journal { .. })), "{length}");
            continue;
        }
        let read = read.unwrap();
        let steps = (records - 1).min(whole.steps.len());
        assert_eq!(read.steps, whole.steps[..steps], "{length}");
        assert_eq!(read.ending, if records == ends.len() { Ending::Completed } else { Ending::Interrupted });
        // Reopening cuts the piece off, so that what follows stands on a line of its own.
        if length % 97 == 0 && length >= ends[0] {
            fs::write(&torn, &bytes[..length]).unwrap();
            let (journal, so_far) = Journal::reopen(&torn).unwrap();
            let mut journal = journal.flush(Flush::System);
            let resumed = problem.resume(so_far, &mut journal).unwrap();
            journal.close(&resumed).unwrap();
            assert_eq!(differences(&Journal::read(&torn).unwrap(), &whole), 0);
        }
    }
}

#[test]
fn damage_within_a_journal_is_named() {
    let folder = folder("damage");
    let file = folder.join("run.jsonl");
    let problem = pulled(ConstraintMethod::Transformation);
    let mut journal = Journal::create(&file, &problem.at_rest()).unwrap();
    problem.run_with(&mut journal).unwrap();
    drop(journal);
    let sound = fs::read(&file).unwrap();
    let second = sound.iter().position(|&b| b == b'\n').unwrap() + 1;
    let third = second + sound[second..].iter().position(|&b| b == b'\n').unwrap() + 1;
    let mut random = fastrand::Rng::with_seed(3);
    for _ in 0..200 {
        let mut bytes = sound.clone();
        // Any bit but those of the line's end, which would join two lines.
        bytes[random.usize(second..third - 1)] ^= 1 << random.u8(0..8);
        fs::write(&file, &bytes).unwrap();
        let error = Journal::read(&file).unwrap_err();
        assert!(matches!(error, OutputError::Journal { line: 2, .. }), "{error}");
    }
    for (text, words) in [
        (&b""[..], "empty"),
        (b"\n", "no whole record"),
        (b"a,b\n1,2\n", "no whole record"),
        (&sound[second..], "first record is not the start"),
        (&[&sound[..second], &sound[..second]].concat(), "second start"),
    ] {
        fs::write(&file, text).unwrap();
        let error = Journal::read(&file).unwrap_err();
        assert!(matches!(error, OutputError::Journal { .. }) && error.to_string().contains(words), "{error}");
    }
    for nothing in [folder.join("missing.jsonl"), folder.clone()] {
        assert!(matches!(Journal::read(nothing), Err(OutputError::Io { .. } | OutputError::Journal { .. })));
    }
}

#[test]
fn a_journal_is_never_written_over() {
    let file = folder("twice").join("run.jsonl");
    drop(Journal::create(&file, &State::default()).unwrap());
    let error = Journal::create(&file, &State::default()).unwrap_err();
    assert!(error.to_string().contains("resume it, or remove it"), "{error}");
    assert_eq!(Journal::read(&file).unwrap(), EquilibriumPath::from(State::default()));
}

#[test]
fn every_number_reads_back_to_the_same_bits() {
    // A step of random bits, subnormal numbers and both zeros among them; JSON holds all finite ones.
    let mut random = fastrand::Rng::with_seed(11);
    let mut numbers: Vec<f64> =
        vec![0.0, -0.0, f64::MIN_POSITIVE, -f64::MIN_POSITIVE / 3.0, f64::MAX, f64::EPSILON, 5e-324];
    numbers.extend((0..20_000).map(|_| f64::from_bits(random.u64(..))).filter(|x| x.is_finite()));
    let state = State { displacement: numbers, load: -0.0, ..State::default() };
    let path = EquilibriumPath::from(state);
    let file = folder("bits").join("run.jsonl");
    drop(Journal::create(&file, &path.start).unwrap());
    assert_eq!(differences(&Journal::read(&file).unwrap(), &path), 0);
}

#[test]
fn paths_that_do_not_fit_are_refused() {
    let problem = pulled(ConstraintMethod::Transformation);
    let whole = problem.run().unwrap();
    let refusal = |change: &dyn Fn(&mut EquilibriumPath)| {
        let mut path = whole.clone();
        path.steps.truncate(3);
        change(&mut path);
        problem.resume(path, &mut ()).unwrap_err()
    };
    for (change, what) in [
        (&(|p: &mut EquilibriumPath| p.start.displacement.clear()) as &dyn Fn(&mut EquilibriumPath), "displacement"),
        (&|p: &mut EquilibriumPath| p.steps[1].state.displacement.push(0.0), "displacement"),
        (&|p: &mut EquilibriumPath| p.steps[2].state.multipliers.clear(), "multipliers"),
        (&|p: &mut EquilibriumPath| p.steps[2].state.terms[0].condensed.clear(), "condensed unknowns"),
    ] {
        let error = refusal(change);
        assert!(
            matches!(&error, Error::Solve(SolveError::OtherModel { what: found, .. }) if *found == what),
            "{what}: {error}"
        );
    }
    let error = refusal(&|p: &mut EquilibriumPath| p.steps[2].control_state.increment = f64::NAN);
    assert!(matches!(error, Error::Invalid(_)), "{error}");
    // Counts beyond all reason add up all the same.
    let mut path = whole.clone();
    path.steps.truncate(3);
    path.steps.iter_mut().for_each(|s| (s.iterations, s.rejected) = (usize::MAX, usize::MAX));
    problem.resume(path, &mut ()).unwrap();
}

/// Not a test by itself: the run that [`killed_runs_are_readable_and_resume`] kills, in a process of its own.
#[test]
fn child() {
    killed::is_child().unwrap();
}

#[test]
fn killed_runs_are_readable_and_resume() {
    // The example `resume` kills 50; a few show that it works here too.
    let program = std::env::current_exe().unwrap();
    let command = || {
        let mut command = Command::new(&program);
        command.args(["resume::child", "--exact", "--nocapture", "--test-threads=1"]);
        command
    };
    let killed = killed::kill_and_resume(command, &folder("killed"), 12).unwrap();
    assert_eq!((killed.readable, killed.differences), (12, 0), "{killed:?}");
    assert!(killed.midway >= 3, "{killed:?}: the moments miss the run");
}

/// A path of another scene whose vectors happen to be as long is no path of this one.
#[test]
fn paths_of_other_scenes_are_refused() {
    let scene = |stiffness: f64, pull: f64, lift: f64, length: f64| {
        Scene::new(Block::new([0.0, 0.0], [length, 1.0]), PlaneStrain, Rubber::neo_hookean(stiffness, 1e3).unwrap())
            .hold(Side::Min)
            .prescribe(Side::Max, 0, pull)
            .traction((1, Side::Max), [0.0, lift])
    };
    let equal = |steps| Scheme::default().particles([5, 3]).stepping(Stepping::equal(steps));
    for constraint_method in [ConstraintMethod::Transformation, ConstraintMethod::Multipliers] {
        let problem = |stiffness, pull, lift, length| {
            scene(stiffness, pull, lift, length).discretize(&equal(5).constraint_method(constraint_method)).unwrap()
        };
        let whole = problem(0.5, 0.4, 0.05, 2.0).run().unwrap().completed().unwrap();
        let mut half = whole.clone();
        half.steps.truncate(3);
        half.ending = Ending::Interrupted;
        for (other, what) in [
            (problem(0.6, 0.4, 0.05, 2.0), "unbalanced"),
            (problem(0.5, 0.41, 0.05, 2.0), "prescribed"),
            (problem(0.5, 0.4, 0.06, 2.0), "unbalanced"),
            (problem(0.5, 0.4, 0.05, 2.1), "another problem"),
        ] {
            for path in [&half, &whole] {
                let error = other.resume(path.clone(), &mut ()).unwrap_err();
                let expected =
                    matches!(error, Error::Solve(SolveError::OtherProblem { .. } | SolveError::OtherParticles));
                assert!(expected, "{error:?}");
                assert!(error.to_string().contains(what), "{error}");
            }
        }
        // Another energy gives away what is in balance all the same.
        let mut forged = half.clone();
        forged.steps[2].energy *= 1.001;
        let error = problem(0.5, 0.4, 0.05, 2.0).resume(forged, &mut ()).unwrap_err();
        assert!(error.to_string().contains("energy"), "{error}");
        // Other steps and another strategy are legitimate.
        for other in [ConstraintMethod::Transformation, ConstraintMethod::Multipliers] {
            let scheme = equal(8).constraint_method(other);
            let problem = scene(0.5, 0.4, 0.05, 2.0).discretize(&scheme).unwrap();
            let path = problem.resume(half.clone(), &mut ()).unwrap().completed().unwrap();
            for (d, same) in path.last().displacement.iter().zip(&whole.last().displacement) {
                assert_abs_diff_eq!(d, same, epsilon = 1e-8);
            }
        }
    }
    // Bodies that only move, or are back at rest, have forces of rounding alone.
    let there_and_back = Amplitude::table(vec![(0.0, 0.0), (0.5, 1.0), (1.0, 0.0)]).unwrap();
    let block = || Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber());
    let moved = block().prescribe(Side::Min, 0, 0.7).prescribe(Side::Min, 1, 0.3);
    let back = block().hold(Side::Min).with(Load::traction(Side::Max, [0.2, 0.1]).amplitude(there_and_back));
    for scene in [moved, back, block().hold(Side::Min)] {
        let problem = scene.discretize(&equal(4)).unwrap();
        let path = problem.run().unwrap().completed().unwrap();
        assert_eq!(differences(&problem.resume(path.clone(), &mut ()).unwrap(), &path), 0);
    }
}

/// Why a run has ended is read as it was written, also where a number of it is none.
#[test]
fn endings_are_read_as_they_were_written() {
    use rkpm::error::{Cause, Driven, Stalled};
    let (folder, start) = (folder("endings"), State { displacement: vec![0.0], ..State::default() });
    let causes = [
        Cause::Rounding { now: 0.5, next: f64::NAN },
        Cause::Rounding { now: f64::INFINITY, next: 0.5 },
        Cause::Diverging { increment: f64::INFINITY },
        Cause::StepLimited { factor: f64::NAN },
        Cause::TimeError { error: f64::NAN, tolerance: 1e-4 },
        Cause::TimeError { error: 0.5, tolerance: 1e-4 },
    ];
    for (number, cause) in causes.into_iter().enumerate() {
        let file = folder.join(format!("{number}.jsonl"));
        let stalled = Stalled { cause: cause.clone(), load: 0.5, largest_load: 0.5, driven: Driven::ByLoads };
        let path = EquilibriumPath { ending: Ending::Stalled(stalled), ..EquilibriumPath::from(start.clone()) };
        Journal::create(&file, &start).unwrap().close(&path).unwrap();
        let Ending::Stalled(read) = Journal::read(&file).unwrap().ending else { panic!("{cause:?} is lost") };
        // NaN stands for all that is no number.
        let words = |cause: &Cause| format!("{cause:?}").replace("inf", "NaN");
        assert_eq!(words(&read.cause), words(&cause));
    }
}

/// What could not be read back is not written: a journal whose states are no numbers has no file, or ends with the step before.
#[test]
fn states_that_are_no_numbers_are_not_written() {
    let folder = folder("numbers");
    let state = |number| State {
        displacement: vec![0.0],
        terms: vec![TermState { condensed: vec![number], ..TermState::default() }],
        ..State::default()
    };
    let step = |number| rkpm::solve::Step {
        state: state(number),
        iterations: 1,
        rejected: 0,
        energy: f64::NAN,
        inertia: None,
        unstable: None,
        critical: Vec::new(),
        diagnostics: Default::default(),
        doubts: Vec::new(),
        control_state: Default::default(),
    };
    for number in [f64::NAN, f64::INFINITY] {
        let file = folder.join(format!("{number}.jsonl"));
        assert!(matches!(Journal::create(&file, &state(number)), Err(OutputError::Io { .. })) && !file.exists());
        let mut journal = Journal::create(&file, &state(0.0)).unwrap();
        assert!(journal.step(&step(0.5)).is_continue() && journal.step(&step(number)).is_break());
        let refused = journal.close(&EquilibriumPath::from(state(0.0))).unwrap_err();
        assert!(refused.to_string().contains("only finite ones"), "{refused}");
        assert_eq!(Journal::read(&file).unwrap().steps.len(), 1);
    }
}
