//! GOAL: whatever is asked of a sound block that can't be meant is refused by a typed error that names the place and what to
//! do, and where a scene or a scheme is at fault `check::scene` finds it before anything runs.
#![cfg(feature = "solve")]

use std::sync::Arc;

use rkpm::check;
use rkpm::error::{Error, GeometryError};
use rkpm::material::{Mullins, Prony, Viscoelastic};
use rkpm::prelude::*;
use rkpm::scene::{ConstraintKind, Stages};
use rkpm::solve::{Ending, Newton, StepControl};
use rkpm::study::{Budget, Quantity, Tolerance};
use rkpm::term::PressureField;

const NAN: f64 = f64::NAN;
const BOTTOM: (usize, Side) = (1, Side::Min);
const TOP: (usize, Side) = (1, Side::Max);
const LEFT: (usize, Side) = (0, Side::Min);

fn rubber() -> Rubber {
    Rubber::neo_hookean(0.5, 100.0).unwrap()
}

fn shape() -> Block<2> {
    Block::new([1.0, 0.0], [3.0, 1.0])
}

/// A block held at its foot and moved at its head.
fn sound() -> Scene<2> {
    Scene::new(shape(), PlaneStrain, rubber()).hold(BOTTOM).with(Condition::on(TOP).displacement([0.1, -0.05]))
}

/// The same without the condition on its head.
fn held() -> Scene<2> {
    Scene::new(shape(), PlaneStrain, rubber()).hold(BOTTOM)
}

fn coarse() -> Scheme {
    Scheme::default().particles([5, 4])
}

/// What words of remedies begin with.
const REMEDIES: &[&str] = &[
    "give",
    "take",
    "use",
    "hold",
    "name",
    "remove",
    "add",
    "raise",
    "lower",
    "draw",
    "make",
    "move",
    "pass",
    "need",
    "at most",
    "at least",
    "between",
    "there are",
    "let",
    "turn",
    "leave",
    "tie",
    "check",
    "call",
    "only",
    "for the",
    "is a",
    "prescribe",
    "lies",
    "are possible",
    "allow",
    "set",
    "keep",
    "mesh",
    "its part lies",
    "nearest",
    "project",
    "finite",
    "above",
    "may be",
];

#[track_caller]
fn says(number: usize, error: &Error, place: &str, faults: &mut Vec<String>) {
    let text = error.to_string();
    if !text.to_lowercase().contains(&place.to_lowercase()) {
        faults.push(format!("{number}: “{place}” is missing in: {text}"));
    } else if !REMEDIES.iter().any(|word| text.contains(word)) {
        faults.push(format!("{number}: no remedy in: {text}"));
    }
}

fn on(place: (usize, Side)) -> Condition<2> {
    Condition::on(place)
}

fn falling() -> Amplitude {
    Amplitude::Table(vec![(0.0, 0.0), (0.6, 1.0), (0.4, 2.0), (1.0, 3.0)])
}

fn lone() -> Amplitude {
    Amplitude::Table(vec![(0.0, 0.0)])
}

fn wild() -> Amplitude {
    Amplitude::Function(Arc::new(|t: f64| if t > 0.4 { NAN } else { t }))
}

fn plane() -> RigidSurface<2> {
    RigidSurface::plane([2.0, 1.2], [0.0, -1.0]).moving([0.0, -0.3]).named("plate")
}

fn sheet(thickness: f64) -> Scene<2> {
    Scene::new(shape(), PlaneStress { thickness }, rubber()).hold(BOTTOM)
}

fn relaxing() -> Scene<2> {
    let law = Viscoelastic::new(rubber(), Prony::of_instantaneous([(0.4, 2.0)]).unwrap());
    Scene::new(shape(), PlaneStrain, law).hold(BOTTOM)
}

fn two() -> Scene<2> {
    Scene::assembly(PlaneStrain)
        .body("lower", shape(), rubber())
        .body("upper", Block::new([1.0, 1.0], [3.0, 2.0]), rubber())
        .hold(Place::on(BOTTOM).of("lower"))
}

/// Scenes of a misused block, each with a word for the place.
type Misuses = Vec<(Scene<2>, &'static str)>;

fn scenes() -> Misuses {
    [conditions(), loads(), contacts(), bodies()].concat()
}

fn conditions() -> Misuses {
    vec![
        (sound().prescribe(LEFT, 2, 0.0), "component 2"),
        (sound().prescribe(LEFT, 0, NAN), "NaN"),
        (sound().prescribe(LEFT, 0, f64::INFINITY), "inf"),
        (sound().with(on(LEFT)), "face (0, Min)"),
        (held().with(on(BOTTOM).component(1, 0.2)), "face (1, Min)"),
        (sound().hold("lid"), "lid"),
        (sound().hold(Place::on(TOP).of("shell")), "shell"),
        (sound().hold(Place::at([9.0, 9.0])), "9.0"),
        (sound().hold(Place::at([1.77, 0.41])), "1.77"),
        (sound().hold(Place::on(LEFT).within(|x: &Point<2>| x[1] > 5.0)), "face (0, Min)"),
        (sound().with(on(LEFT).along(rkpm::scene::Direction::Along([0.0, 0.0]), 0.1)), "face (0, Min)"),
        (sound().with(on(LEFT).along(rkpm::scene::Direction::Along([NAN, 1.0]), 0.1)), "face (0, Min)"),
        (held().with(on(TOP).component(0, 0.1).amplitude(lone())), "amplitude"),
        (held().with(on(TOP).component(0, 0.1).amplitude(falling())), "amplitude"),
        (held().with(on(TOP).component(0, 0.1).amplitude(wild())), "face (1, Max)"),
        (held().with(on(TOP).component(0, 0.1).named(" ")), "empty name"),
        (
            sound().name("base", BOTTOM).hold("base").with(on(TOP).component(0, 0.1).named("base")),
            "the name of the part base",
        ),
        (
            sound().rigid("plate", TOP).with(on(BOTTOM).component(0, 0.0).named("plate")),
            "the name of the rigid body plate",
        ),
        (sound().without("press"), "press"),
        (sound().move_on("plate", [0.0, 0.1]), "plate"),
    ]
}

fn loads() -> Misuses {
    vec![
        (held().traction(TOP, [NAN, 0.0]), "face (1, Max)"),
        (held().traction("lid", [0.1, 0.0]), "lid"),
        (held().pressure(TOP, f64::INFINITY), "face (1, Max)"),
        (held().pressure("lid", 0.1), "lid"),
        (held().with(Load::pressure(Place::body(), 0.1)), "normal"),
        (held().with(Load::pressure(Place::at([2.0, 0.5]), 0.1)), "normal"),
        (held().with(Load::force(Place::at([9.0, 0.5]), [0.1, 0.0])), "9.0"),
        (held().with(Load::force(Place::at([2.0, 1.0]), [NAN, 0.0])), "point load"),
        (held().with(Load::body_force([0.0, f64::NEG_INFINITY])), "body force"),
        (held().with(Load::traction(TOP, [0.1, 0.0]).amplitude(lone())), "amplitude"),
        (held().with(Load::traction(TOP, [0.1, 0.0]).amplitude(wild())), "face (1, Max)"),
        (held().with(Load::traction(TOP, [0.1, 0.0]).named("")), "empty name"),
        (held().traction(Place::on(TOP).within(|x: &Point<2>| x[0] > 7.0), [0.1, 0.0]), "face (1, Max)"),
        (held().traction(TOP, [1e9, 0.0]), "face (1, Max)"),
        (held().pressure(TOP, -1e8), "face (1, Max)"),
        (held().with(Load::moment("plate", [0.0, 0.0, 1.0])), "plate"),
        (held().rigid("plate", TOP).with(Load::moment("plate", [0.0, 0.0, NAN])), "plate"),
        (held().rigid("plate", TOP).with(Load::pressure("plate", 0.1)), "plate"),
        (held().rigid("", TOP), "empty name"),
        (held().rigid("plate", "lid"), "lid"),
        (two().rigid("upper", Place::on(TOP).of("upper")), "upper"),
        (Scene::new(shape(), PlaneStrain, rubber()).rigid("plate", TOP), "plate"),
        (held().rigid("plate", TOP).with(on(BOTTOM).displacement([0.1, 0.0])), "face (1, Min)"),
    ]
}

fn contacts() -> Misuses {
    vec![
        (held().contact(TOP, plane().friction(NAN)), "friction"),
        (held().contact(TOP, plane().friction(-0.1)), "friction"),
        (held().contact(TOP, RigidSurface::plane([2.0, 1.2], [0.0, 0.0]).named("plate")), "plate"),
        (held().contact(TOP, RigidSurface::plane([2.0, NAN], [0.0, -1.0]).named("plate")), "plate"),
        (held().contact(TOP, plane().moving([NAN, 0.0])), "plate"),
        (held().contact(TOP, plane().pushed([0.0, 0.0])), "plate"),
        (held().contact(TOP, plane()).contact(LEFT, plane()), "plate"),
        (held().contact("lid", plane()), "lid"),
        (held().contact(Place::body(), plane()), "contact"),
        (held().contact(Place::at([2.0, 1.0]), plane()), "contact"),
        (held().contact(TOP, RigidSurface::plane([2.0, 0.8], [0.0, -1.0]).named("plate")), "plate"),
        (held().contact(TOP, RigidSurface::plane([2.0, 1.2], [0.0, 1.0]).named("plate")), "plate"),
        (held().contact(TOP, plane().interference(0.0)), "interference"),
        (held().contact(TOP, plane().interference(1.5)), "interference"),
        (held().contact(TOP, plane().named("")), "empty name"),
        (held().contact_between(TOP, "lid", "fit"), "lid"),
        (two().contact_between(Place::on(TOP).of("lower"), Place::on(BOTTOM).of("lid"), "fit"), "lid"),
        (held().with(ContactPair::itself(TOP, "fold").interference(0.5)), "interference"),
        (held().with(ContactPair::between(TOP, LEFT, "fit").interference(NAN)), "interference"),
        (held().contact_itself(TOP, " "), "empty name"),
    ]
}

fn bodies() -> Misuses {
    vec![
        (sheet(0.0), "measure"),
        (sheet(-2.0), "measure"),
        (sheet(NAN), "measure"),
        (Scene::new(Block::new([-1.0, 0.0], [1.0, 1.0]), Axisymmetric, rubber()).hold(BOTTOM), "radius"),
        (
            Scene::new(shape(), Axisymmetric, rubber()).hold(BOTTOM).with(on(TOP).displacement([-4.0, 0.0])),
            "face (1, Max)",
        ),
        (
            Scene::new(shape(), Axisymmetric, rubber())
                .hold(BOTTOM)
                .rigid("plate", TOP)
                .with(Load::moment("plate", [0.0, 0.0, 1.0])),
            "axisymmetric",
        ),
        (
            Scene::new(shape(), Axisymmetric, rubber())
                .hold(BOTTOM)
                .rigid("plate", TOP)
                .with(Condition::on("plate").displacement([0.1, 0.0])),
            "axisymmetric",
        ),
        (relaxing().over_time(NAN), "clock"),
        (relaxing().over_time(-4.0), "clock"),
        (relaxing().with_clock(falling()), "amplitude"),
        (sound().with_expansion(NAN), "expansion"),
        (sound().with_expansion(0.0), "expansion"),
        (sound().with_expansion(-1.1), "expansion"),
        (sound().with_expansion(30.0), "expansion"),
        (sound().with_expansion(1e4), "expansion"),
        (sound().with_expansion(Value::field(|x: &Point<2>| 1.0 + 300.0 * x[1])), "expansion"),
        (two().unbonded("lower", "shell"), "shell"),
        (two().scheme_of("shell", |scheme| scheme.order(2)), "shell"),
        (two().hold(TOP), "lower"),
        (two().traction(TOP, [0.1, 0.0]), "lower"),
        (two().body("lower", Block::new([5.0, 0.0], [6.0, 1.0]), rubber()), "lower"),
        (Scene::assembly(PlaneStrain), "body"),
        (Scene::new(Block::new([1.0, 0.0], [1.0, 1.0]), PlaneStrain, rubber()).hold(BOTTOM), "axis 0"),
        (Scene::new(Block::new([1.0, 0.0], [3.0, NAN]), PlaneStrain, rubber()).hold(BOTTOM), "axis 1"),
        (Scene::new(shape(), PlaneStrain, Rubber::neo_hookean(0.5, 1e14).unwrap()).hold(BOTTOM), "bulk"),
        (Scene::new(shape(), PlaneStrain, rubber()).prescribe(LEFT, 0, 0.0).traction(TOP, [0.0, 0.1]), "translation"),
        (Scene::new(shape(), PlaneStrain, rubber()).traction(TOP, [0.1, 0.0]), "translation"),
    ]
}

/// Schemes for the sound block that it can't have.
fn schemes() -> Vec<(Scheme, &'static str)> {
    let stepping = |change: &dyn Fn(&mut Stepping)| {
        let mut stepping = Stepping::default();
        change(&mut stepping);
        coarse().stepping(stepping)
    };
    let newton =
        |tolerance: f64, iterations: usize| coarse().newton(Newton { tolerance, iterations, ..Newton::default() });
    vec![
        (Scheme::default().particles([5, 0]), "nodes along an axis"),
        (Scheme::default().particles([1]), "nodes along an axis"),
        (Scheme::default().particles([3, 3, 3]), "particle counts"),
        (Scheme::default().particles(Vec::new()), "particle counts"),
        (Scheme::default().particles([100_000, 100_000]), "lattice"),
        (Scheme::default().spacing(0.0), "spacing"),
        (Scheme::default().spacing(NAN), "spacing"),
        (Scheme::default().spacing(1e-9), "lattice"),
        (coarse().dilation(0.2), "r = 0.2"),
        (coarse().dilation(NAN), "NaN"),
        (coarse().dilation(Dilation::Neighbour { rank: 0, factor: 1.5 }), "neighbour"),
        (coarse().order(0), "order"),
        (coarse().order(9), "basis"),
        (coarse().rcond_limit(NAN), "reciprocal condition"),
        (coarse().layout(Layout::Jittered { amount: 0.7, seed: 1 }), "jitter"),
        (coarse().layout(Layout::Graded(Arc::new(|_, t| 0.3 * t))), "graded"),
        (coarse().rule(Rule::Smoothed { parts: 0 }), "sub-cells"),
        (coarse().rule(Rule::Smoothed { parts: 5000 }), "sub-cells"),
        (coarse().rule(Rule::Gauss { zones: None, points: Some(0) }), "points"),
        (coarse().rule(Rule::Gauss { zones: None, points: Some(5000) }), "points"),
        (coarse().integration_zones([0, 3]), "zones"),
        (coarse().pressure_field(PressureField::Linear, 0), "zone"),
        (coarse().pressure_field(PressureField::Linear, 40_000), "zone"),
        (Scheme::elements(0).particles([5, 5]), "order"),
        (Scheme::elements(3).particles([5, 5]), "order"),
        (Scheme::elements(2).particles([4, 4]), "elements"),
        (Scheme::elements(1).particles([5, 5]).constraint_kind(ConstraintKind::OverBoundary), "elements"),
        (Scheme::elements(1).particles([5, 5]).rule(Rule::Scni), "elements"),
        (Scheme::elements(1).particles([5, 5]).dilation(1.4), "elements"),
        (coarse().seed(4), "Scheme::seed"),
        (coarse().graded(|_| 1.0), "Scheme::graded"),
        (newton(0.0, 30), "tolerance"),
        (newton(NAN, 30), "tolerance"),
        (newton(1e-9, 0), "iterations"),
        (stepping(&|s| s.first = 0.0), "first"),
        (stepping(&|s| s.first = NAN), "first"),
        (stepping(&|s| s.smallest = -1.0), "smallest"),
        (stepping(&|s| s.growth = 0.0), "growth"),
        (stepping(&|s| s.steps = 0), "steps"),
        (stepping(&|s| s.time_tolerance = -1.0), "time"),
    ]
}

#[test]
fn invalid_input_returns_errors() {
    let mut faults = Vec::new();
    let mut check = |number: usize, scene: &Scene<2>, scheme: &Scheme, place: &str| {
        let refusal = scene.discretize(scheme).and_then(|problem| problem.run());
        match refusal {
            Err(error) => says(number, &error, place, &mut faults),
            // What is free is told by the check.
            // What moves freely ends the run where it is.
            Ok(path) if place == "translation" && matches!(path.ending, Ending::Stalled(_)) => {}
            Ok(path) => faults.push(format!("{number}: {place}: accepted, {:?}", path.ending)),
        }
        match check::scene(scene, scheme) {
            Ok(diagnosis) if diagnosis.holds() => faults.push(format!("{number}: {place}: check::scene finds nothing")),
            _ => {}
        }
    };
    let (scenes, schemes) = (scenes(), schemes());
    assert!(scenes.len() + schemes.len() >= 100);
    for (number, (scene, place)) in scenes.iter().enumerate() {
        check(number, scene, &coarse(), place);
    }
    for (number, (scheme, place)) in schemes.iter().enumerate() {
        check(1000 + number, &sound(), scheme, place);
    }
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn questions_that_have_no_answer() {
    let problem = sound().discretize(&coarse()).unwrap();
    let path = problem.run().unwrap().completed().unwrap();
    let state = path.last();
    let other = sound().discretize(&Scheme::default().particles([6, 4])).unwrap();
    let force = || Quantity::reaction(TOP, 0);
    let within = |error: f64| sound().solve_within(&Tolerance::of(force(), error), Budget::default()).map(|_| ());
    let beyond = Stages::new("press", sound()).then("press", |scene| scene);
    let arc = {
        let law = Viscoelastic::new(rubber(), Prony::of_instantaneous([(0.4, 2.0)]).unwrap());
        let scene = Scene::new(shape(), PlaneStrain, law).hold(BOTTOM).prescribe(TOP, 0, 0.1).over_time(3.0);
        let stepping = Stepping { control: StepControl::ArcLength, ..Stepping::default() };
        scene.discretize(&coarse().stepping(stepping)).unwrap()
    };
    let asked: Vec<(Result<(), Error>, &str)> = vec![
        (problem.displacement(state, &[9.0, 0.5].into()).map(|_| ()), "outside"),
        (problem.stress(state, &[9.0, 0.5].into()).map(|_| ()), "outside"),
        (problem.reaction(state, "lid").map(|_| ()), "lid"),
        (problem.moment(state, "lid", [0.0, 0.0]).map(|_| ()), "lid"),
        (problem.contact(state, "plate").map(|_| ()), "plate"),
        (problem.rigid_motion(state, "plate").map(|_| ()), "plate"),
        (other.energy(state).map(|_| ()), "another problem"),
        (other.reaction(state, TOP).map(|_| ()), "another problem"),
        (other.stresses(state).map(|_| ()), "another problem"),
        (problem.states_at(&path, &[2.0]).map(|_| ()), "load factor"),
        (problem.deflection(&[2.0, 0.5].into(), 2).map(|_| ()), "component 2"),
        (problem.deflection(&[9.0, 0.5].into(), 0).map(|_| ()), "outside"),
        (within(0.0), "tolerance"),
        (within(1.0), "tolerance"),
        (within(NAN), "tolerance"),
        (
            sound().solve_within(&Tolerance { error: 0.1, quantities: Vec::new() }, Budget::default()).map(|_| ()),
            "quantities",
        ),
        (sound().solve_within(&Tolerance::of(force().relative_to(-1.0), 0.1), Budget::default()).map(|_| ()), "size"),
        (sound().solve_within(&Tolerance::of(Quantity::reaction("lid", 0), 0.1), Budget::default()).map(|_| ()), "lid"),
        (beyond.run(&coarse()).map(|_| ()).map_err(Error::from), "press"),
        (arc.run().map(|_| ()), "ArcLength"),
        (other.resume(path.clone(), &mut ()).map(|_| ()), "another problem"),
        (Rubber::neo_hookean(-0.5, 1e3).map(|_| ()).map_err(Error::from), "A_10"),
        (Rubber::neo_hookean(NAN, 1e3).map(|_| ()).map_err(Error::from), "NaN"),
        (Mullins::new(rubber(), 0.9, 0.1, 0.1).map(|_| ()).map_err(Error::from), "constant r"),
        (Prony::of_instantaneous([(1.4, 2.0)]).map(|_| ()).map_err(Error::from), "1"),
        (Prony::of_instantaneous([(0.4, -2.0)]).map(|_| ()).map_err(Error::from), "tau_1"),
    ];
    let mut faults = Vec::new();
    for (number, (answer, place)) in asked.iter().enumerate() {
        match answer {
            Err(error) => says(number, error, place, &mut faults),
            Ok(()) => faults.push(format!("{number}: {place}: answered")),
        }
    }
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
    assert!(matches!(Block::new([0.0, 0.0], [1.0, -1.0]).validate(), Err(GeometryError::Degenerate { axis: 1, .. })));
}
