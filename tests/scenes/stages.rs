//! Stages: each begins where the one before ended.

use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
use nalgebra::{Rotation3, Unit, UnitQuaternion, Vector3};
use rkpm::error::{BoundaryError, Incompatible};
use rkpm::material::{Prony, Viscoelastic};
use rkpm::prelude::*;
use rkpm::scene::{StagePath, Stages, history, write_stages};
use rkpm::solve::{State, StepControl};

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 500.0).unwrap()
}

fn block() -> Scene<2> {
    Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).hold((1, Side::Min))
}

fn scheme() -> Scheme {
    Scheme::default().particles([9, 5])
}

/// Pushed in by a plate, partly released, then loaded aside.
fn fit() -> Stages<2> {
    let plate = RigidSurface::plane([0.0, 1.0], [0.0, -1.0]).moving([0.0, -0.15]).named("plate");
    let quarters = Stepping { first: 0.25, largest: 0.25, ..Stepping::default() };
    Stages::new("push in", block().contact((1, Side::Max), plate))
        .then("release", |scene| scene.move_on("plate", [0.0, 0.1]))
        .stepping(quarters)
        .then("load", |scene| scene.with(Load::traction((0, Side::Max), [0.05, 0.0]).named("side")))
}

/// The floor, the plate and the load at the side are in equilibrium to 1e-8 of the reaction.
fn in_balance(stage: &StagePath<2>, is_loaded: bool) {
    let StagePath { name, problem, path } = stage;
    let state = path.last();
    let (floor, plate) = (problem.reaction(state, (1, Side::Min)).unwrap(), problem.contact(state, "plate").unwrap());
    let load = Point::<2>::new(if is_loaded { 0.05 } else { 0.0 }, 0.0);
    let left = (floor + plate.force + load).norm() / floor.norm();
    assert!(left < 1e-8, "{name}: {left:e} of the reaction is not balanced");
}

/// Steps of a quarter of the load.
fn quarters() -> Stepping {
    Stepping { first: 0.25, largest: 0.25, ..Stepping::default() }
}

/// The displacement by which a turn about a point moves another one.
fn turned(about: [f64; 2], angle: f64, x: &Point<2>) -> [f64; 2] {
    let ((sin, cos), y) = (angle.sin_cos(), [x[0] - about[0], x[1] - about[1]]);
    [cos * y[0] - sin * y[1] - y[0], sin * y[0] + cos * y[1] - y[1]]
}

/// A condition that turns the plate on [`block`] from one angle to another.
fn turn(from: f64, to: f64) -> Condition<2> {
    let way = move |x: &Point<2>, load| turned([1.0, 1.0], from + (to - from) * load, x);
    Condition::on("plate").named("turn").displacement(Value::motion(way))
}

/// The angle of a plate in a state of a stage.
fn angle(stage: &StagePath<2>, state: &State) -> f64 {
    stage.problem.rigid_motion(state, "plate").unwrap().rotation_vector()[2]
}

/// A folder of a test's own, emptied first.
fn folder(name: &str) -> std::path::PathBuf {
    let folder = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("stages").join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

#[test]
fn a_press_fit_in_three_stages() {
    let paths = fit().run(&scheme()).unwrap();
    assert_eq!(paths.iter().map(|stage| stage.name.as_str()).collect::<Vec<_>>(), ["push in", "release", "load"]);
    let mut pressed = Vec::new();
    for (number, stage) in paths.iter().enumerate() {
        in_balance(stage, number == 2);
        pressed.push(-stage.problem.contact(stage.path.last(), "plate").unwrap().force[1]);
    }
    assert!(pressed[1] < 0.5 * pressed[0] && pressed[1] > 0.1 * pressed[0], "{pressed:?}");
    // The same as a single run to where the plate stands: an elastic body does not remember.
    let plate = RigidSurface::plane([0.0, 1.0], [0.0, -1.0]).moving([0.0, -0.05]).named("plate");
    let whole = block().contact((1, Side::Max), plate).traction((0, Side::Max), [0.05, 0.0]);
    let problem = whole.discretize(&scheme()).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let expected = -problem.contact(path.last(), "plate").unwrap().force[1];
    assert_relative_eq!(pressed[2], expected, max_relative = 1e-8);
    let table = history(&paths).unwrap();
    assert_eq!(table.header[0], "stage");
    assert_eq!(table.rows.len(), paths.iter().map(|stage| stage.path.steps.len() + 1).sum::<usize>());
}

#[test]
fn a_run_broken_off_in_the_second_stage_goes_on_with_the_same_bits() {
    let whole = fit().run(&scheme()).unwrap();
    assert!(whole[1].path.steps.len() >= 4);
    let mut torn: Vec<_> = whole.iter().take(2).map(|stage| stage.path.clone()).collect();
    torn[1].steps.truncate(2);
    torn[1].ending = Ending::Interrupted;
    let again = fit().resume(&scheme(), torn.clone(), &mut ()).unwrap();
    assert_eq!(again.len(), 3);
    for (stage, other) in whole.iter().zip(&again) {
        assert_eq!(stage.path.steps, other.path.steps, "{}", stage.name);
    }
    torn[1].start.displacement[0] += 1e-3;
    assert!(fit().resume(&scheme(), torn, &mut ()).is_err());
}

/// One journal of all stages: whatever piece of it a kill leaves, the history goes on from there with the same bits, and in the end
/// its file is that of a run without a break, byte by byte.
#[cfg(feature = "serde")]
#[test]
fn one_journal_holds_all_stages() {
    use rkpm::output::Journal;

    let folder = folder("journal");
    let file = folder.join("fit.jsonl");
    let whole = fit().run_journaled(&scheme(), &file, &mut ()).unwrap();
    let bytes = std::fs::read(&file).unwrap();
    let recorded = Journal::read_stages(&file).unwrap();
    assert_eq!(recorded.len(), 3);
    for (stage, (name, path)) in whole.iter().zip(&recorded) {
        assert_eq!((&stage.name, &stage.path), (name, path));
        assert_eq!(path.ending, Ending::Completed);
        in_balance(stage, stage.name == "load");
    }
    let line = |of: &str| bytes.windows(of.len()).position(|window| window == of.as_bytes()).unwrap();
    let ends: Vec<usize> = (0..bytes.len()).filter(|&k| bytes[k] == b'\n').map(|k| k + 1).collect();
    let second = ends.iter().position(|&end| end > line("\"stage\":\"release\"")).unwrap();
    let steps = whole[1].path.steps.len();
    assert!(steps >= 4);
    // Before the second stage, behind its start, after each of its steps, each time with a piece of the next line, and behind its end.
    for (k, &end) in ends[second - 1..=second + steps + 1].iter().enumerate() {
        std::fs::write(&file, &bytes[..end + 7 * k]).unwrap();
        let resumed = fit().run_journaled(&scheme(), &file, &mut ()).unwrap();
        for (stage, other) in whole.iter().zip(&resumed) {
            assert_eq!(stage.path, other.path, "{} torn at {end}", stage.name);
        }
        assert!(std::fs::read(&file).unwrap() == bytes, "torn at {end}");
    }
    // What is done stays as it is.
    assert_eq!(fit().run_journaled(&scheme(), &file, &mut ()).unwrap()[2].path, whole[2].path);
    assert!(std::fs::read(&file).unwrap() == bytes);
}

/// Journals of other histories, of single runs, and with stages that can't follow each other are told by what they are.
#[cfg(feature = "serde")]
#[test]
fn journals_of_something_else_are_refused() {
    use rkpm::error::OutputError;
    use rkpm::output::Journal;

    let folder = folder("refused");
    let file = folder.join("fit.jsonl");
    fit().run_journaled(&scheme(), &file, &mut ()).unwrap();
    let says = |error: Error, words: &str| {
        let what = error.to_string();
        assert!(matches!(error, Error::Output(OutputError::Journal { .. })) && what.contains(words), "{what}");
    };
    says(Journal::read(&file).unwrap_err().into(), "read_stages");
    says(Journal::reopen(&file).err().unwrap().into(), "run_journaled");
    let press = |name: &str| Stages::new(name, block());
    let refusal = |stages: Stages<2>, file| Error::from(stages.run_journaled(&scheme(), file, &mut ()).err().unwrap());
    says(refusal(press("press"), &file), "calls it press");
    says(refusal(press("push in"), &file), "has no such stage");
    // The same names and another scene.
    let other = press("push in").then("release", |scene| scene).then("load", |scene| scene);
    assert!(matches!(refusal(other, &file), Error::Solve(_)));
    let text = std::fs::read_to_string(&file).unwrap();
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    let end = lines.iter().position(|line| line.contains("\"end\"")).unwrap();
    std::fs::write(&file, [&lines[..end], &lines[end + 1..]].concat().concat()).unwrap();
    says(Journal::read_stages(&file).unwrap_err().into(), "not completed");
    let single = folder.join("single.jsonl");
    let problem = block().discretize(&scheme()).unwrap();
    drop(Journal::create(&single, &problem.at_rest()).unwrap());
    says(Journal::read_stages(&single).unwrap_err().into(), "without stages");
    says(refusal(fit(), &single), "Journal::reopen");
}

/// One collection for ParaView and one table for all stages.
#[test]
fn stages_are_written_as_one_series() {
    let folder = folder("series");
    let paths = fit().run(&scheme()).unwrap();
    write_stages(&paths, folder.join("fit.pvd")).unwrap();
    let series = std::fs::read_to_string(folder.join("fit.pvd")).unwrap();
    // The start of a later stage is the end of the one before.
    let states = 1 + paths.iter().map(|stage| stage.path.steps.len()).sum::<usize>();
    assert_eq!(series.matches("<DataSet").count(), states);
    let files = std::fs::read_dir(&folder)
        .unwrap()
        .filter(|entry| entry.as_ref().unwrap().path().extension().is_some_and(|extension| extension == "vtu"));
    assert_eq!(files.count(), states);
    let times: Vec<f64> =
        series.split("timestep=\"").skip(1).map(|rest| rest.split('"').next().unwrap().parse().unwrap()).collect();
    assert!(
        times[0] == 0.0 && *times.last().unwrap() == 3.0 && times.windows(2).all(|pair| pair[0] < pair[1]),
        "{times:?}"
    );
    let table = std::fs::read_to_string(folder.join("fit.csv")).unwrap();
    assert_eq!(table.lines().count(), history(&paths).unwrap().rows.len() + 1);
}

/// What is prescribed anew is reached from where the body is, and what is taken away falls off: pressed by a traction, sheared by a
/// plate, let go.
#[test]
fn conditions_take_over_and_let_go() {
    let pressed = block().with(Load::traction((1, Side::Max), [0.0, -0.1]).named("press"));
    let stages = Stages::new("press", pressed)
        .then("shear", |scene| {
            scene.without("press").with(Condition::on((1, Side::Max)).displacement([0.3, -0.05]).named("plate"))
        })
        .then("hold", |scene| scene)
        .then("release", |scene| scene.without("plate"));
    let paths = stages.run(&scheme()).unwrap();
    let force = |number: usize| paths[number].problem.reaction(paths[number].path.last(), "plate").unwrap();
    let alone = block().with(Condition::on((1, Side::Max)).displacement([0.3, -0.05]).named("plate"));
    let problem = alone.discretize(&scheme()).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let expected = problem.reaction(path.last(), "plate").unwrap();
    assert!(expected.norm() > 0.0);
    for number in [1, 2] {
        assert!(abs_diff_eq!(force(number), expected, epsilon = 5e-9 * expected.norm()), "{number}: {}", force(number));
    }
    let released = &paths[3].path.last().displacement;
    assert_abs_diff_eq!(released[..], vec![0.0; released.len()][..], epsilon = 1e-8);
}

/// A clock goes on through the stages: sheared within a second and held for nine, as in one run.
#[test]
fn time_goes_on() {
    let law = || Viscoelastic::new(rubber(), Prony::of_instantaneous([(0.5, 3.0)]).unwrap());
    let pad = || Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, law()).hold((1, Side::Min));
    let top = || Condition::on((1, Side::Max)).displacement([0.2, 0.0]).named("top");
    let stages = Stages::new("shear", pad().with(top()).over_time(1.0)).then("hold", |scene| scene.over_time(9.0));
    let paths = stages.run(&scheme()).unwrap();
    let last = &paths[1];
    assert_eq!(last.problem.time(last.path.last()), 10.0);
    let course = Amplitude::table(vec![(0.0, 0.0), (0.1, 1.0), (1.0, 1.0)]).unwrap();
    let problem = pad().with(top().amplitude(course)).over_time(10.0).discretize(&scheme()).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let expected = problem.reaction(path.last(), "top").unwrap()[0];
    let force = last.problem.reaction(last.path.last(), "top").unwrap()[0];
    assert_abs_diff_eq!(force / expected, 1.0, epsilon = 1e-3);
}

/// What keeps a rigid body's shape goes on: a plate on a block is pulled, then turned by a moment, in two stages as in one run, state by
/// state.
#[test]
fn a_rigid_body_goes_on() {
    let quarters = Stepping { first: 0.25, largest: 0.25, ..Stepping::default() };
    let rigid = || block().rigid("plate", (1, Side::Max));
    let stages = Stages::new("pull", rigid().with(Load::force("plate", [0.0, 1.0])))
        .then("turn", |scene| scene.with(Load::moment("plate", [0.0, 0.0, 0.1])));
    let paths = stages.run(&scheme().stepping(quarters)).unwrap();
    let pull = Amplitude::table(vec![(0.0, 0.0), (0.5, 1.0), (1.0, 1.0)]).unwrap();
    let turn = Amplitude::table(vec![(0.0, 0.0), (0.5, 0.0), (1.0, 1.0)]).unwrap();
    let whole = rigid()
        .with(Load::force("plate", [0.0, 1.0]).amplitude(pull))
        .with(Load::moment("plate", [0.0, 0.0, 0.1]).amplitude(turn));
    let eighths = Stepping { first: 0.125, largest: 0.125, ..Stepping::default() };
    let problem = whole.discretize(&scheme().stepping(eighths)).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let last = &paths[1];
    assert_eq!(last.path.steps.len(), 4);
    for (step, expected) in last.path.steps.iter().zip(&path.steps[4..]) {
        let angle = last.problem.rigid_motion(&step.state, "plate").unwrap().rotation_vector()[2];
        let other = problem.rigid_motion(&expected.state, "plate").unwrap().rotation_vector()[2];
        assert!(
            other > 1e-3 && relative_eq!(angle, other, max_relative = 1e-6),
            "{}: {angle} {other}",
            step.state.load
        );
    }
}

/// A rigid body that a moment has turned is led back in steps: it turns evenly, for its nodes can't go straight, and the block is at rest in
/// the end.
#[test]
fn a_turned_rigid_body_is_led_back() {
    let turned = block().rigid("plate", (1, Side::Max)).with(Load::moment("plate", [0.0, 0.0, 0.3]).named("turn"));
    let back = |scene: Scene<2>| scene.without("turn").with(Condition::on("plate").displacement([0.0, 0.0]));
    let paths = Stages::new("turn", turned).then("back", back).run(&scheme().stepping(quarters())).unwrap();
    let first = angle(&paths[0], paths[0].path.last());
    assert!(first > 0.05, "{first}");
    for (step, left) in paths[1].path.steps.iter().zip([0.75, 0.5, 0.25, 0.0]) {
        assert_abs_diff_eq!(angle(&paths[1], &step.state), left * first, epsilon = 1e-9);
    }
    let energy = paths[1].problem.energy(paths[1].path.last()).unwrap();
    assert!(energy < 1e-15 * paths[0].problem.energy(paths[0].path.last()).unwrap(), "{energy}");
}

/// A plate that was turned by 0.3 goes on by conditions of all kinds: it keeps its shape, turns evenly from where it is, or as a motion says,
/// and moves on a line.
#[test]
fn a_turned_rigid_body_goes_on_from_where_it_is() {
    let field = |angle: f64, up: f64| {
        let to = Value::field(move |x: &Point<2>| {
            let [a, b] = turned([1.0, 1.0], angle, x);
            [a, b + up]
        });
        Condition::on("plate").displacement(to)
    };
    type Change = Box<dyn Fn(Scene<2>) -> Scene<2> + Send + Sync>;
    let led =
        |condition: Condition<2>| -> Change { Box::new(move |scene| scene.without("turn").with(condition.clone())) };
    let side = Load::traction((0, Side::Max), [0.01, 0.0]);
    let late = Amplitude::table(vec![(0.0, 0.0), (0.5, 0.0), (1.0, 1.0)]).unwrap();
    // What changes, the angle at the end of its own way, at its start, and the displacement of the middle.
    let cases: [(&str, Change, [f64; 3]); 8] = [
        ("stays", led(field(0.3, 0.0)), [0.3, 0.3, 0.0]),
        ("lifted", led(field(0.3, 0.1)), [0.3, 0.3, 0.1]),
        ("held", Box::new(|scene| scene), [0.3, 0.3, 0.0]),
        ("loaded", Box::new(move |scene| scene.with(side.clone())), [0.3, 0.3, 0.0]),
        ("on", led(field(0.6, 0.0)), [0.6, 0.3, 0.0]),
        ("back and up", led(field(-0.2, 0.1)), [-0.2, 0.3, 0.1]),
        ("a motion from elsewhere", led(turn(0.1, 0.5)), [0.5, 0.3, 0.0]),
        ("a table", led(field(0.0, 0.1).amplitude(late)), [0.0, 0.3, 0.1]),
    ];
    for (name, change, [end, start, up]) in cases {
        let stages = Stages::new("to", block().rigid("plate", (1, Side::Max)).with(turn(0.0, start)));
        let paths = stages.then("go on", change).run(&scheme().stepping(quarters())).unwrap();
        let stage = &paths[1];
        assert!(stage.path.ending == Ending::Completed, "{name}: {:?}", stage.path.ending);
        for step in &stage.path.steps {
            let (load, motion) = (step.state.load, stage.problem.rigid_motion(&step.state, "plate").unwrap());
            let (found, expected) = (motion.rotation_vector()[2], start + (end - start) * load);
            assert_abs_diff_eq!(found, expected, epsilon = 1e-9);
            let rise = if name == "a table" { (2.0 * load - 1.0).max(0.0) } else { load };
            assert_abs_diff_eq!(motion.displacement, Point::<2>::new(0.0, up * rise), epsilon = 1e-9);
            assert_abs_diff_eq!((motion.rotation.transpose() * motion.rotation)[(0, 0)], 1.0, epsilon = 3e-11);
        }
    }
}

/// A block between two plates of one rigid body, which turns with it without a strain.
fn rigid_block(angle: f64) -> Scene<2> {
    let way = move |x: &Point<2>, load: f64| turned([0.0; 2], angle * load, x);
    Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
        .rigid("plate", (1, Side::Min))
        .rigid("plate", (1, Side::Max))
        .with(Condition::on("plate").named("turn").displacement(Value::motion(way)))
}

/// Where a rigid body was turned by half a turn or more, it turns back as it came if it is to be nearer to rest than to where it is, else the
/// shortest way.
#[test]
fn rigid_bodies_turn_back_as_they_came() {
    let (pi, tau) = (std::f64::consts::PI, std::f64::consts::TAU);
    let eighths = Stepping { first: 0.125, largest: 0.125, ..Stepping::default() };
    let cases = [
        (pi, 0.0, -pi),
        (-pi, 0.0, pi),
        (pi - 1e-7, 0.0, 1e-7 - pi),
        (pi + 1e-7, 0.0, -pi - 1e-7),
        (3.5, 0.0, -3.5),
        (3.5, 0.2, -3.3),
        (2.9, 3.5, 0.6),
        (3.5, 3.5, 0.0),
        (3.5, 2.9, -0.6),
        (7.0, 0.2, -6.8),
        (7.0, 0.5, tau - 6.5),
    ];
    for (first, second, by) in cases {
        let to = Value::field(move |x: &Point<2>| turned([0.0; 2], second, x));
        let led = move |scene: Scene<2>| scene.without("turn").with(Condition::on("plate").displacement(to.clone()));
        let sixteenths = Stepping { first: 0.0625, largest: 0.0625, ..Stepping::default() };
        let paths = Stages::new("to", rigid_block(first)).stepping(sixteenths).then("go on", led).stepping(eighths);
        let paths = paths.run(&Scheme::elements(1).particles([3, 2])).unwrap();
        let stage = &paths[1];
        assert!(stage.path.ending == Ending::Completed, "{first} to {second}: {:?}", stage.path.ending);
        for step in &stage.path.steps {
            let expected = first + by * step.state.load;
            let found = angle(stage, &step.state);
            let off = ((found - expected + pi).rem_euclid(tau) - pi).abs();
            assert!(off < 1e-8 && step.energy.abs() < 1e-12, "{first} to {second}: {found}, energy {:e}", step.energy);
        }
    }
}

/// In space from one axis to another: about the axis between both, at an even rate, near half a turn and at it too.
#[test]
fn rigid_bodies_turn_from_axis_to_axis() {
    let pi = std::f64::consts::PI;
    let (x, y, oblique) = (Vector3::x(), Vector3::y(), Vector3::new(1.0, -2.0, 0.5).normalize());
    let cases = [
        (x * 0.5, y * 0.7, None),
        (oblique * pi, oblique * 0.0, Some(oblique * pi)),
        (oblique * (pi + 0.3), x * 0.0, Some(oblique * (pi + 0.3))),
        (x * 0.5, x * (0.5 - pi + 1e-6), None),
        (x * (pi - 1e-6), y * 0.1, None),
    ];
    for (first, second, back) in cases {
        let moved = |turn: Vector3<f64>, at: &Point<3>| -> [f64; 3] { (Rotation3::new(turn) * at - at).into() };
        let scene = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber())
            .rigid("plate", (2, Side::Min))
            .rigid("plate", (2, Side::Max))
            .with(
                Condition::on("plate")
                    .named("turn")
                    .displacement(Value::motion(move |at: &Point<3>, load: f64| moved(first * load, at))),
            );
        let to = Value::field(move |at: &Point<3>| moved(second, at));
        let led = move |scene: Scene<3>| scene.without("turn").with(Condition::on("plate").displacement(to.clone()));
        let eighths = Stepping { first: 0.125, largest: 0.125, ..Stepping::default() };
        let scheme = Scheme::elements(1).particles([2]).stepping(eighths);
        let paths = Stages::new("to", scene).then("go on", led).run(&scheme).unwrap();
        let stage = &paths[1];
        assert!(stage.path.ending == Ending::Completed, "{first} to {second}: {:?}", stage.path.ending);
        let [start, end] = [first, second].map(Rotation3::new);
        let between = UnitQuaternion::from_rotation_matrix(&(end * start.inverse())).scaled_axis();
        let between = back.map_or(between, |back| -back);
        for step in &stage.path.steps {
            let rotation = stage.problem.rigid_motion(&step.state, "plate").unwrap().rotation;
            let expected = Rotation3::new(between * step.state.load) * start;
            assert_abs_diff_eq!(rotation, expected.into_inner(), epsilon = 1e-8);
            assert!(step.energy.abs() < 1e-12, "{first} to {second}: {:e}", step.energy);
        }
    }
}

/// A plate in space that a moment has tilted is levelled by its height alone: its normal comes up evenly.
#[test]
fn a_tilted_plate_is_levelled_by_its_height() {
    let cube = Scene::new(Block::new([0.0; 3], [1.0; 3]), Solid, rubber()).hold((2, Side::Min));
    let tilted = cube.rigid("plate", (2, Side::Max)).with(Load::moment("plate", [0.05, -0.02, 0.01]).named("tilt"));
    let level = |scene: Scene<3>| scene.without("tilt").with(Condition::on("plate").component(2, -0.05));
    let paths = Stages::new("tilt", tilted).then("level", level);
    let paths = paths.run(&Scheme::elements(1).particles([3]).stepping(quarters())).unwrap();
    let tilt = |stage: &StagePath<3>, state: &State| {
        let row = stage.problem.rigid_motion(state, "plate").unwrap().rotation.row(2).transpose();
        Unit::new_normalize(row.cross(&Vector3::z())).into_inner() * row.xy().norm().atan2(row[2])
    };
    let [first, levelled] = &paths[..] else { panic!() };
    let start = tilt(first, first.path.last());
    assert!(start.norm() > 0.02 && levelled.path.ending == Ending::Completed, "{start}");
    for step in &levelled.path.steps {
        let left = (1.0 - step.state.load) * start.norm();
        let found =
            levelled.problem.rigid_motion(&step.state, "plate").unwrap().rotation.row(2).transpose().xy().norm();
        assert_abs_diff_eq!(found, left.sin(), epsilon = 1e-8);
    }
}

/// A condition at a point of a plate where a node of its frame lies is one at a point: the point goes straight.
#[test]
fn a_point_of_a_rigid_body_goes_straight() {
    let end = || Place::at([2.0, 1.0]).of("plate");
    let turned = block().rigid("plate", (1, Side::Max)).with(Load::moment("plate", [0.0, 0.0, 0.3]).named("turn"));
    let back = move |scene: Scene<2>| scene.with(Condition::on(end()).displacement([0.1, 0.2]).named("end"));
    let scheme = Scheme::elements(1).particles([5, 3]).stepping(quarters());
    let paths = Stages::new("turn", turned).then("back", back).run(&scheme).unwrap();
    let stage = &paths[1];
    assert!(stage.path.ending == Ending::Completed);
    let at = |state: &State| {
        let motion = stage.problem.rigid_motion(state, "plate").unwrap();
        let arm = Point::<2>::new(2.0, 1.0) - motion.centre;
        motion.displacement + motion.rotation * arm - arm
    };
    let start = at(&stage.path.start);
    assert!(start.norm() > 0.05);
    for step in &stage.path.steps {
        let load = step.state.load;
        assert_abs_diff_eq!(at(&step.state), start * (1.0 - load) + Point::<2>::new(0.1, 0.2) * load, epsilon = 1e-9);
    }
}

/// A stage that adds conditions at both ends of a plate takes ties away, and leaves the plate where it is.
#[test]
fn a_rigid_body_with_fewer_ties_stays_where_it_is() {
    let plate = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber())
        .hold((1, Side::Min))
        .rigid("plate", (1, Side::Max))
        .with(Load::moment("plate", [0.0, 0.0, 0.1]));
    let stages = Stages::new("turn", plate).then("hold", |scene| scene.hold((0, Side::Min)).hold((0, Side::Max)));
    let paths = stages.run(&Scheme::elements(1).particles([5, 3])).unwrap();
    let [turned, held] = &paths[..] else { panic!() };
    let motion = |stage: &StagePath<2>, state| stage.problem.rigid_motion(state, "plate").unwrap();
    let (before, after) = (motion(turned, turned.path.last()), motion(held, &held.path.start));
    assert!(before.rotation[(1, 0)].abs() > 1e-3);
    assert_abs_diff_eq!(before.rotation, after.rotation, epsilon = 1e-12);
    assert_abs_diff_eq!(before.displacement, after.displacement, epsilon = 1e-12);
}

/// A stage that makes its scene anew goes on in time: what relaxes goes on from where it was.
#[test]
fn a_scene_made_anew_goes_on_in_time() {
    let scene = || {
        let law = Viscoelastic::new(rubber(), Prony::of_instantaneous([(0.5, 10.0)]).unwrap());
        Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, law)
            .hold((1, Side::Min))
            .with(Condition::on((1, Side::Max)).displacement([0.2, 0.0]).named("top").amplitude(Amplitude::Constant))
            .over_time(10.0)
    };
    let force = |stages: Stages<2>| {
        let paths = stages.run(&scheme()).unwrap();
        let last = paths.last().unwrap();
        assert_eq!(last.problem.time(last.path.last()), 20.0);
        last.problem.reaction(last.path.last(), "top").unwrap()[0]
    };
    let anew = force(Stages::new("a", scene()).then("b", move |_| scene()));
    let kept = force(Stages::new("a", scene()).then("b", |scene| scene.over_time(10.0)));
    assert_abs_diff_eq!(anew / kept, 1.0, epsilon = 1e-9);
}

#[test]
fn stages_that_can_not_be() {
    let refusal = |stages: Stages<2>| Error::from(stages.run(&scheme()).err().unwrap());
    let warm = Stages::new("cold", block()).then("warm", |scene| scene.with_expansion(1.01));
    assert!(matches!(refusal(warm), Error::Incompatible(Incompatible { .. })));
    let error = refusal(fit().then("again", |scene| scene.without("nothing")));
    assert!(matches!(&error, Error::Boundary(BoundaryError::UnknownName { known, .. }) if known.contains("plate")));
    let error = refusal(fit().then("load", |scene| scene));
    assert!(matches!(error, Error::Boundary(BoundaryError::StageTwice { .. })), "{error}");
    let error = refusal(Stages::new("first", block()).then(" ", |scene| scene));
    assert!(matches!(error, Error::Boundary(BoundaryError::Nameless { .. })), "{error}");
    let late = Stages::new("first", block()).then("rigid", |scene| scene.rigid("plate", (1, Side::Max)));
    assert!(matches!(refusal(late), Error::Incompatible(Incompatible { .. })));
    // A stage that stalls ends the history.
    let arc = Stepping { control: StepControl::ArcLength, steps: 1, ..Stepping::default() };
    let paths = fit().stepping(Stepping { steps: 1, first: 0.1, ..arc }).then("never", |scene| scene);
    let paths = paths.run(&scheme()).unwrap();
    assert!(paths.len() == 3 && matches!(paths[2].path.ending, Ending::Stalled(_)));
}

/// The stages before one that can't be discretised, begun or run are not lost.
#[test]
fn a_stage_that_can_not_be_run_leaves_those_before() {
    let whole = fit().run(&scheme()).unwrap();
    let nowhere = fit().then("nowhere", |scene| scene.hold("no such part"));
    let warm = fit().then("warm", |scene| scene.with_expansion(1.01));
    let singular = fit().stepping(Stepping { first: f64::NAN, ..Stepping::default() });
    for (history, done) in [(nowhere, 3), (warm, 3), (singular, 2)] {
        let broken = history.run(&scheme()).err().unwrap();
        assert_eq!(broken.stages.len(), done, "{broken:?}");
        for (stage, expected) in broken.stages.iter().zip(&whole) {
            assert_eq!((&stage.name, &stage.path), (&expected.name, &expected.path));
        }
        let words = broken.to_string();
        assert_eq!(Error::from(broken).to_string(), words);
    }
}

/// What keeps a plate's shape where a condition by its name keeps it too tells nothing: turned to and fro in two stages and let go in a third,
/// the plate is at rest from the first state of the third on.
#[test]
fn a_plate_that_was_turned_by_its_name_is_let_go_without_forces() {
    let stages = Stages::new("to", block().rigid("plate", (1, Side::Max)).with(turn(0.0, 0.3)))
        .then("fro", |scene| scene.without("turn").with(turn(0.3, 0.0)))
        .then("let go", |scene| scene.without("turn"));
    let paths = stages.run(&scheme()).unwrap();
    let [turned, _, free] = &paths[..] else { panic!() };
    let moment = |stage: &StagePath<2>, state| stage.problem.moment(state, "plate", [1.0, 1.0]).unwrap()[2];
    let size = moment(turned, turned.path.last());
    assert!(size > 0.1 && matches!(free.path.ending, Ending::Completed));
    assert_abs_diff_eq!(moment(free, &free.path.start), 0.0, epsilon = 1e-8 * size);
    assert_abs_diff_eq!(moment(free, free.path.last()), 0.0, epsilon = 1e-8 * size);
}

/// What stays carries in the first state of a stage what it carried in the last one of the stage before: the moment of a plate that is let
/// go, and the force of the floor.
#[test]
fn what_stays_carries_what_it_carried() {
    let plate = Condition::on(Place::at([1.0, 1.0]).of("plate")).displacement([0.2, -0.1]).named("push");
    let turned = block().rigid("plate", (1, Side::Max)).with(plate).with(Load::moment("plate", [0.0, 0.0, 0.1]));
    let paths = Stages::new("push", turned).then("let go", |scene| scene.without("push")).run(&scheme()).unwrap();
    let [pushed, free] = &paths[..] else { panic!() };
    for place in [Place::on("plate"), (1, Side::Min).into()] {
        let of = |stage: &StagePath<2>, state| {
            let force = stage.problem.reaction(state, place.clone()).unwrap();
            (force, stage.problem.moment(state, place.clone(), [1.0, 1.0]).unwrap()[2])
        };
        let ((force, moment), (other, turn)) = (of(pushed, pushed.path.last()), of(free, &free.path.start));
        assert!(force.norm() > 0.1);
        assert_abs_diff_eq!(force, other, epsilon = 1e-8);
        assert_abs_diff_eq!(moment, turn, epsilon = 1e-8);
    }
}

/// Two calls in one stage move a surface by both vectors.
#[test]
fn a_surface_moves_on_by_all_vectors() {
    let stages = fit().then("on", |scene| scene.move_on("plate", [0.02, 0.0]).move_on("plate", [0.0, -0.01]));
    let paths = stages.run(&scheme()).unwrap();
    let found = paths.last().map(|stage| stage.problem.contact(stage.path.last(), "plate").unwrap().travel);
    assert_abs_diff_eq!(found.unwrap(), Point::<2>::new(0.02, -0.06), epsilon = 1e-12);
}

/// A block between smooth plates, shortened beyond its stability: what would follow does not begin there.
#[test]
fn no_stage_follows_a_state_that_is_no_answer() {
    for (shortened, stages) in [(0.1, 2), (0.48, 1)] {
        let square = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber())
            .prescribe((0, Side::Min), 0, 0.0)
            .prescribe((1, Side::Min), 1, 0.0)
            .with(Condition::on((1, Side::Max)).component(1, -shortened).named("press"));
        let history = Stages::new("press", square)
            .then("pull aside", |scene| scene.with(Load::traction((0, Side::Max), [1e-3, 0.0])));
        let paths = history.run(&Scheme::elements(2).particles([5, 5])).unwrap();
        assert_eq!(paths.len(), stages, "{shortened}: {:?}", paths.last().map(|stage| stage.path.doubts()));
        assert_eq!(paths.last().unwrap().path.clone().completed().is_ok(), stages == 2);
    }
}

/// Bodies that touched are not glued together in a stage without their contact.
#[test]
fn a_contact_that_is_taken_away_leaves_no_bond() {
    let pair = Scene::assembly(PlaneStrain)
        .body("lower", Block::new([0.0, 0.0], [2.0, 1.0]), rubber())
        .body("upper", Block::new([0.0, 1.0], [2.0, 2.0]), rubber())
        .hold(Place::on((1, Side::Min)).of("lower"))
        .contact_between(Place::on((1, Side::Max)).of("lower"), Place::on((1, Side::Min)).of("upper"), "joint")
        .with(Condition::on(Place::on((1, Side::Max)).of("upper")).displacement([0.0, -0.1]).named("press"));
    let lift = |scene: Scene<2>| {
        let up = Condition::on(Place::on((1, Side::Max)).of("upper")).displacement([0.0, 0.3]).named("lift");
        scene.without("joint").without("press").with(up)
    };
    let paths = Stages::new("press", pair).then("lift", lift).run(&scheme()).unwrap();
    let last = &paths[1];
    let force = |name: &str| last.problem.reaction(last.path.last(), name).unwrap();
    assert_abs_diff_eq!(force("lift").norm(), 0.0, epsilon = 1e-8);
    let held = last.problem.reaction(last.path.last(), Place::on((1, Side::Min)).of("lower")).unwrap();
    assert_abs_diff_eq!(held.norm(), 0.0, epsilon = 1e-8);
}

/// What was moved before a rough surface or another rough body was there has not slipped on it: pressed after a shift both carry what
/// they carry without the shift. A rough plate in place of one that has dragged leaves what that carried.
#[test]
fn slips_begin_where_bodies_meet() {
    let tenths = scheme().stepping(Stepping { first: 0.1, largest: 0.1, ..Stepping::default() });
    let plate =
        |from: [f64; 2], by: [f64; 2]| RigidSurface::plane(from, [0.0, -1.0]).moving(by).friction(0.3).named("plate");
    let forces = |stages: Stages<2>| -> Vec<Point<2>> {
        let force =
            |stage: &StagePath<2>| stage.problem.contact(stage.path.last(), "plate").map(|contact| contact.force);
        stages.run(&tenths).unwrap().iter().filter_map(|stage| force(stage).ok()).collect()
    };
    let press = move |at: f64| plate([at, 1.0], [0.05, -0.1]);
    let at_once = forces(Stages::new("press", block().contact((1, Side::Max), press(0.0))));
    let base = Condition::on((1, Side::Min)).displacement([0.5, 0.0]);
    let free = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber()).with(base);
    let later = Stages::new("shift", free).then("press", move |scene| scene.contact((1, Side::Max), press(0.5)));
    assert_abs_diff_eq!(forces(later)[0], at_once[0], epsilon = 1e-6 * at_once[0].norm());

    let [from, by] = [[0.0, 1.0], [0.3, -0.1]];
    let dragged = forces(
        Stages::new("drag", block().contact((1, Side::Max), plate(from, by)))
            .then("replace", move |scene| scene.without("plate").contact((1, Side::Max), plate([0.3, 0.9], [0.0; 2]))),
    );
    assert!(dragged[0][0] > 0.1);
    assert_abs_diff_eq!(dragged[0], dragged[1], epsilon = 1e-6 * dragged[0].norm());

    let low = || Place::on((1, Side::Max)).of("low");
    let two = |aside: f64| {
        Scene::assembly(PlaneStrain)
            .body("low", Block::new([-1.0, 0.0], [3.0, 1.0]), rubber())
            .body("high", Block::new([0.5 - aside, 1.0], [1.5 - aside, 2.0]), rubber())
            .unbonded("low", "high")
            .hold(Place::on((1, Side::Min)).of("low"))
    };
    let pushed = |by: [f64; 2]| Condition::on(Place::on((1, Side::Max)).of("high")).displacement(by).named("push");
    let rough = move || ContactPair::between(low(), Place::on((1, Side::Min)).of("high"), "plate").friction(0.3);
    let at_once = forces(Stages::new("press", two(0.0).with(pushed([0.05, -0.1])).with(rough())));
    let later = Stages::new("shift", two(0.4).with(pushed([0.4, 0.0])))
        .then("press", move |scene| scene.without("push").with(pushed([0.45, -0.1])).with(rough()));
    assert_abs_diff_eq!(forces(later)[0], at_once[0], epsilon = 1e-5 * at_once[0].norm());
}
