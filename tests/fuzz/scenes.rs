use rkpm::check;
use rkpm::prelude::*;
use rkpm::scene::{ApproximationChoice, ConstraintKind, ConstraintMethod, Dilation, Rule};
use rkpm::solve::Newton;

use super::geometry::layout;
use super::harness::Input;
use super::linear::amplitude;

pub fn lines(input: &mut Input) {
    if input.once_in(2) { scene(input, RadialCylinder) } else { scene(input, RadialSphere) }
}

pub fn planes(input: &mut Input) {
    if input.once_in(2) { scene(input, PlaneStrain) } else { scene(input, Axisymmetric) }
}

pub fn solids(input: &mut Input) {
    scene(input, Solid);
}

fn part<const D: usize>(input: &mut Input) -> Part {
    match input.random.usize(0..14) {
        0 => Part::Whole,
        1 => Part::Named("nothing".into()),
        2 => Part::Face { axis: input.index(D), side: Side::Min },
        _ => Part::Face { axis: input.random.usize(0..D), side: input.pick(&[Side::Min, Side::Max]) },
    }
}

fn scheme<const D: usize>(input: &mut Input) -> Scheme {
    let most = [6, 4, 3][D - 1];
    let mut scheme = Scheme::default().layout(if input.once_in(4) { layout(input) } else { Layout::Regular });
    // One thing in a few is spoilt, so that the others are looked at too.
    let counts: Vec<usize> = if input.once_in(6) {
        (0..input.length(D)).map(|_| input.count(2, most)).collect()
    } else {
        (0..D).map(|_| input.random.usize(2..=most)).collect()
    };
    scheme = match input.random.usize(0..12) {
        0 => scheme.spacing(if input.once_in(2) { input.bad() } else { 0.5 }),
        _ => scheme.particles(counts),
    };
    scheme = scheme.order(if input.once_in(8) { input.pick(&[0, 2, 3, 255]) } else { 1 });
    scheme = scheme.dilation(match input.random.usize(0..5) {
        0 => Dilation::Local(input.number(0.51, 2.0)),
        1 => Dilation::Global(input.number(0.51, 2.0)),
        _ => Dilation::Auto,
    });
    if input.once_in(20) {
        scheme = scheme.rcond_limit(input.bad());
    }
    let points = input.count(1, 3);
    let zones = (0..input.length(D)).map(|_| input.count(1, 2)).collect();
    scheme = scheme.rule(match input.random.usize(0..14) {
        0 => Rule::Gauss { zones: None, points: Some(points) },
        1 => Rule::Gauss { zones: Some(zones), points: if input.once_in(2) { None } else { Some(points) } },
        2 => Rule::Smoothed { parts: points },
        3 => Rule::Scni,
        4 => Rule::Nodal,
        _ => Rule::Auto,
    });
    let fields =
        [PressureField::Displacement, PressureField::Pointwise, PressureField::Constant, PressureField::Linear];
    if input.once_in(3) {
        scheme = scheme.pressure_field(input.pick(&fields), input.count(1, 3));
    }
    scheme = scheme.constraint_kind(input.pick(&[
        ConstraintKind::Auto,
        ConstraintKind::Auto,
        ConstraintKind::Auto,
        ConstraintKind::AtParticles,
        ConstraintKind::OverBoundary,
    ]));
    scheme = scheme.constraint_method(input.pick(&[
        ConstraintMethod::Auto,
        ConstraintMethod::Auto,
        ConstraintMethod::Multipliers,
        ConstraintMethod::Transformation,
    ]));
    if input.once_in(5) {
        scheme = scheme.approximation(ApproximationChoice::Elements);
    }
    scheme = scheme.newton(Newton { iterations: 6, ..Newton::default() });
    scheme = scheme.stepping(Stepping { smallest: 0.4, steps: 2, ..Stepping::default() });
    scheme
}

fn scene<const D: usize>(input: &mut Input, kinematics: impl Kinematics<D> + 'static) {
    let corner = |input: &mut Input, low: f64, high: f64| -> [f64; D] {
        std::array::from_fn(|_| if input.once_in(60) { input.bad() } else { input.good(low, high) })
    };
    let (min, max) = (corner(input, 0.0, 0.5), corner(input, 1.0, 2.0));
    let bulk = if input.once_in(10) { input.bad() } else { 10.0 };
    let _ = input.saw("min, max, bulk", (min, max, bulk));
    let Ok(rubber) = Rubber::neo_hookean(0.5, bulk) else { return };
    let mut scene = Scene::new(Block::new(min, max), kinematics, rubber);
    if !input.once_in(4) {
        scene = scene.hold((input.random.usize(0..D), Side::Min));
    }
    for _ in 0..input.random.usize(0..3) {
        let kind = input.random.usize(0..13);
        let part = part::<D>(input);
        let value = input.number(-0.2, 0.2);
        let vector: [f64; D] = std::array::from_fn(|_| input.number(-0.1, 0.1));
        let at = if input.once_in(2) { min } else { corner(input, 0.0, 2.0) };
        let component = input.index(D);
        let _ = input.saw("kind, part, value, vector, at, component", (kind, &part, value, vector, at, component));
        let amplitude = if input.once_in(3) { amplitude(input) } else { Amplitude::Ramp };
        let place = if input.once_in(6) { Place::on(part).within(move |x| x[0] <= value) } else { Place::on(part) };
        let (on, at) = (Condition::on(place.clone()), Place::at(at));
        let motion = Value::motion(move |x: &Point<D>, load| x[0] * load * value);
        let field = Value::field(move |x: &Point<D>| x[0] * value);
        scene = match kind {
            0 => scene.with(on.component(component, value).amplitude(amplitude)),
            1 => scene.with(Condition::on(at).component(component, value).amplitude(amplitude)),
            2 => scene.with(on.component(component, motion).amplitude(amplitude)),
            3 => scene.with(Load::pressure(place, field).amplitude(amplitude)),
            4 => scene.with(Load::traction(place, vector).amplitude(amplitude)),
            5 => scene.with(Load::body_force(vector).amplitude(amplitude)),
            6 => scene.with(Load::force(at, vector).amplitude(amplitude)),
            7 => scene.with(on.along(Direction::Along(vector), value).amplitude(amplitude)),
            8 => scene.with(on.along(Direction::Normal, value).amplitude(amplitude)),
            9 => scene.with(on.along(Direction::radial(vector, [0.0, 0.0, 1.0]), value).amplitude(amplitude)),
            10 => scene.with(Load::normal_elastic_foundation(place, value)),
            11 => scene.with(Load::force(place, vector).amplitude(amplitude)),
            _ => scene.with(on.component(component, field).amplitude(amplitude)),
        };
    }
    let scheme = scheme::<D>(input);
    let _ = input.saw("scheme", &scheme);
    if input.once_in(4)
        && let Ok(diagnosis) = check::scene(&scene, &scheme)
    {
        let _ = diagnosis.report().to_string();
    }
    let Ok(problem) = scene.discretize(&scheme) else { return };
    let Ok(path) = problem.run() else { return };
    let state = path.last();
    let place = part::<D>(input);
    let _ = (problem.energy(state), problem.displacement(state, &max.into()), problem.particle_displacements(state));
    let _ = (problem.reaction(state, place), problem.history(&path).is_ok(), problem.pressures(state));
    input.passed = path.completed().is_ok();
}
