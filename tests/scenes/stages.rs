//! Stages: each begins where the one before ended.

use rkpm::error::{BoundaryError, Incompatible};
use rkpm::material::{Prony, Viscoelastic};
use rkpm::prelude::*;
use rkpm::scene::{StagePath, Stages, history};
use rkpm::solve::StepControl;

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

#[test]
fn a_press_fit_in_three_stages() {
    let paths = fit().run(&scheme()).unwrap();
    assert_eq!(paths.iter().map(|stage| stage.name.as_str()).collect::<Vec<_>>(), ["push in", "release", "load"]);
    let mut pressed = Vec::new();
    for (number, StagePath { name, problem, path }) in paths.iter().enumerate() {
        let state = path.last();
        let (floor, plate) =
            (problem.reaction(state, (1, Side::Min)).unwrap(), problem.contact(state, "plate").unwrap());
        let load = Point::<2>::new(if number == 2 { 0.05 } else { 0.0 }, 0.0);
        let left = (floor + plate.force + load).norm() / floor.norm();
        assert!(left < 1e-8, "{name}: {left:e} of the reaction is not balanced");
        pressed.push(-plate.force[1]);
    }
    assert!(pressed[1] < 0.5 * pressed[0] && pressed[1] > 0.1 * pressed[0], "{pressed:?}");
    // The same as a single run to where the plate stands: an elastic body does not remember.
    let plate = RigidSurface::plane([0.0, 1.0], [0.0, -1.0]).moving([0.0, -0.05]).named("plate");
    let whole = block().contact((1, Side::Max), plate).traction((0, Side::Max), [0.05, 0.0]);
    let problem = whole.discretize(&scheme()).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let expected = -problem.contact(path.last(), "plate").unwrap().force[1];
    assert!((pressed[2] / expected - 1.0).abs() < 1e-8, "{} beside {expected}", pressed[2]);
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
    let mut seen = Vec::new();
    let again = fit().resume(&scheme(), torn.clone(), &mut |name| {
        seen.push(name.to_string());
        Ok(Box::new(()))
    });
    let again = again.unwrap();
    assert_eq!(seen, ["release", "load"]);
    for (stage, other) in whole.iter().zip(&again) {
        assert_eq!(stage.path.steps, other.path.steps, "{}", stage.name);
    }
    torn[1].start.displacement[0] += 1e-3;
    assert!(fit().resume(&scheme(), torn, &mut |_| Ok(Box::new(()))).is_err());
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
    for number in [1, 2] {
        assert!((force(number) - expected).norm() < 1e-8 * expected.norm(), "{number}: {}", force(number));
    }
    assert!(paths[3].path.last().displacement.iter().all(|d| d.abs() < 1e-8));
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
    assert!((force / expected - 1.0).abs() < 1e-3, "{force} beside {expected}");
}

#[test]
fn stages_that_can_not_be() {
    let refusal = |stages: Stages<2>| stages.run(&scheme()).err().unwrap();
    let error = refusal(fit().then("again", |scene| scene.without("nothing")));
    assert!(
        matches!(&error, Error::Boundary(BoundaryError::UnknownCondition { known, .. }) if known.contains("plate"))
    );
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
