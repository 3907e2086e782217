//! Several bodies and rigid ones: bonded, apart, tied, held, loaded, in sound and in bad ways.

use rkpm::prelude::*;
use rkpm::scene::ApproximationChoice;
use rkpm::solve::Newton;

use super::harness::Input;

pub fn planes(input: &mut Input) {
    assembly(input, PlaneStrain);
}

pub fn solids(input: &mut Input) {
    assembly(input, Solid);
}

const NAMES: [&str; 4] = ["lower", "upper", "aside", "lower"];

fn place<const D: usize>(input: &mut Input, bodies: usize) -> Place<D> {
    let face = (input.index(D).min(D), input.pick(&[Side::Min, Side::Max]));
    let at: [f64; D] = std::array::from_fn(|_| input.number(0.0, 2.0));
    let of = input.random.usize(0..bodies.max(1));
    match input.random.usize(0..14) {
        0 => Place::on(face),
        1 => Place::at(at),
        2 => Place::at(at).of("plate"),
        3 | 4 => Place::on("plate"),
        5 => Place::on(Part::Whole).of(NAMES[of]),
        6 => Place::on("nothing"),
        7 => Place::on(face).of("nobody"),
        8 => Place::on(face).of(NAMES[of]).within(move |x| x[0] <= at[0]),
        _ => Place::on(face).of(NAMES[of]),
    }
}

fn assembly<const D: usize>(input: &mut Input, kinematics: impl Kinematics<D> + 'static) {
    let bodies = if input.once_in(20) { 0 } else { input.random.usize(1..4) };
    let bulk = if input.once_in(12) { input.bad() } else { 10.0 };
    let Ok(rubber) = Rubber::neo_hookean(0.5, bulk) else { return };
    let mut scene = Scene::assembly(kinematics);
    for (number, name) in NAMES.iter().enumerate().take(bodies) {
        // One on the other, sometimes with a gap, an overlap or a shift; the third beside the first.
        let mut low = [0.0; D];
        let axis = if number == 1 { D - 1 } else { 0 };
        if number > 0 {
            low[axis] = 1.0 + if input.once_in(6) { input.number(-0.2, 0.2) } else { 0.0 };
            low[(axis + 1) % D] += if input.once_in(4) { input.number(-0.5, 0.5) } else { 0.0 };
        }
        let high = low.map(|x| x + if input.once_in(30) { input.bad() } else { 1.0 });
        let name = if input.once_in(30) { NAMES[3] } else { name };
        let counts: Vec<usize> = (0..D).map(|_| input.random.usize(2..=[5, 3][D - 2])).collect();
        let order = input.random.usize(1..3) as u8;
        let elements = input.once_in(3);
        let _ = input.saw("name, low, high, counts, elements", (name, low, high, &counts, elements.then_some(order)));
        scene = scene.body(name, Block::new(low, high), rubber.clone()).scheme_of(name, move |scheme| {
            let scheme = scheme.particles(counts.clone());
            if elements { scheme.approximation(ApproximationChoice::Elements).order(order) } else { scheme }
        });
    }
    if input.once_in(5) {
        scene = scene.unbonded("lower", input.pick(&["upper", "aside", "nobody"]));
    }
    if !input.once_in(10) {
        scene = scene.hold(Place::on((D - 1, Side::Min)).of("lower"));
    }
    for _ in 0..input.random.usize(0..2) {
        let name = input.pick(&["plate", "plate", "plate", "insert", "lower"]);
        let tied = match input.once_in(3) {
            true => place(input, bodies),
            false => Place::on((D - 1, Side::Max)).of(NAMES[usize::from(bodies > 1)]),
        };
        let _ = input.saw("rigid", (name, &tied));
        scene = scene.rigid(name, tied);
    }
    for _ in 0..input.random.usize(0..3) {
        let (kind, place, value) = (input.random.usize(0..10), place(input, bodies), input.number(-0.1, 0.1));
        let vector: [f64; D] = std::array::from_fn(|_| input.number(-0.05, 0.05));
        let component = input.index(D);
        let _ = input.saw("kind, place, value, vector, component", (kind, &place, value, vector, component));
        let on = Condition::on(place.clone());
        scene = match kind {
            0 => scene.with(on.displacement(vector)),
            1 => scene.with(on.component(component, value)),
            2 => scene.with(on.along(Direction::Along(vector), value)),
            3 => scene.with(on.displacement(Value::motion(move |x: &Point<D>, load| (x * (load * value)).into()))),
            4 => scene.with(Load::force(place, vector)),
            5 => scene.with(Load::moment(input.pick(&["plate", "plate", "insert", "lower"]), [0.0, 0.0, value])),
            6 => scene.pressure(place, value),
            7 => scene.with(Load::elastic_foundation(place, value.abs())),
            8 => scene.with(on.along(Direction::Normal, value)),
            _ => scene.traction(place, vector),
        };
    }
    let mut scheme = Scheme::default().particles([3]);
    scheme = scheme.newton(Newton { iterations: 8, ..Newton::default() });
    scheme = scheme.stepping(Stepping { smallest: 0.4, steps: 2, ..Stepping::default() });
    if input.once_in(8)
        && let Ok(diagnosis) = rkpm::check::scene(&scene, &scheme)
    {
        let _ = diagnosis.report().to_string();
    }
    let Ok(problem) = scene.discretize(&scheme) else { return };
    let Ok(path) = problem.run() else { return };
    let state = path.last();
    let requested = place(input, bodies);
    let _ = (problem.reaction(state, requested.clone()), problem.moment(state, requested, [0.0; D]));
    let _ = (problem.rigid_motion(state, "plate").is_ok(), problem.vtk_grid(state).is_ok());
    let history = problem.history(&path).expect("a path has its history");
    assert!(history.rows.iter().all(|row| row.len() == history.header.len()));
    input.passed = path.completed().is_ok();
}
