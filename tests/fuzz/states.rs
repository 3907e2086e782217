use rkpm::prelude::*;
use rkpm::solve::{Deflection, Following, Newton, State, Step, StepControl, StepControlState};
use rkpm::term::TermState;

use super::harness::Input;

fn spoil(input: &mut Input, numbers: &mut Vec<f64>) {
    match input.random.usize(0..12) {
        0 => numbers.clear(),
        1 => drop(numbers.pop()),
        2 => numbers.push(0.5),
        3 | 4 if !numbers.is_empty() => {
            let k = input.random.usize(0..numbers.len());
            numbers[k] = input.bad();
        }
        _ => {}
    }
}

fn state(input: &mut Input, sound: &State) -> State {
    let mut state = sound.clone();
    spoil(input, &mut state.displacement);
    spoil(input, &mut state.multipliers);
    match input.random.usize(0..12) {
        0 => state.terms.clear(),
        1 => state.terms.push(TermState { condensed: vec![1.0], history: Vec::new() }),
        2 => state.terms.iter_mut().for_each(|own| own.condensed.clear()),
        3 => state.terms.reverse(),
        4 => state.terms.iter_mut().for_each(|own| own.condensed.fill(f64::NAN)),
        _ => {
            let k = input.random.usize(0..state.terms.len().max(1));
            if let Some(own) = state.terms.get_mut(k) {
                let numbers = if input.once_in(4) { &mut own.history } else { &mut own.condensed };
                spoil(input, numbers);
            }
        }
    }
    if input.once_in(6) {
        state.load = input.bad();
    }
    state
}

pub fn states(input: &mut Input) {
    let block = Block::new([0.0, 0.0], [1.0, 1.0]);
    let scene = Scene::new(block, PlaneStrain, Rubber::neo_hookean(0.5, 1e2).unwrap())
        .hold(Side::Min)
        .prescribe(Side::Max, 0, 0.1)
        .traction((1, Side::Max), [0.0, 0.01]);
    let newton = Newton { iterations: 4, ..Newton::default() };
    let stepping = Stepping {
        first: if input.once_in(8) { input.bad() } else { 0.5 },
        smallest: if input.once_in(8) { input.bad() } else { 0.1 },
        largest: if input.once_in(8) { input.bad() } else { 1.0 },
        growth: if input.once_in(8) { input.bad() } else { 1.5 },
        // More steps than these would be taken, and take their time.
        steps: if input.once_in(8) { input.count(0, 3).min(50) } else { 3 },
        quick: input.count(0, 9),
        control: input.pick(&[StepControl::Auto, StepControl::Load, StepControl::ArcLength]),
        follow: input.pick(&[Following::Load, Following::Path]),
        ..Stepping::default()
    };
    let scheme = Scheme::default().particles([3]).stepping(stepping).newton(newton);
    let mut problem = scene.discretize(&scheme).unwrap();
    if input.once_in(6) {
        problem.analysis_mut().newton =
            Newton { iterations: input.count(0, 4).min(10), tolerance: input.bad(), ..newton };
    }
    let rest = problem.at_rest();
    let state = state(input, &rest);
    let _ = input.saw("stepping, newton, state", (&stepping, problem.analysis().newton, &state));
    let at = input.point::<2>(0.0, 1.0);
    let _ = (problem.displacement(&state, &at), problem.particle_displacements(&state), problem.energy(&state));
    let _ = (problem.deformation_gradients(&state), problem.pressures(&state));
    let place = [Place::on(Side::Min), Place::on((input.index(3), Side::Max)), Place::on("face")]
        [input.random.usize(0..3)]
    .clone();
    let _ = (problem.reaction(&state, place.clone()), problem.moment(&state, place, at.into()));
    let (model, rows, analysis) = (problem.model(), problem.equations(), problem.analysis());
    match input.random.usize(0..3) {
        0 => input.passed = analysis.resume(model, rows, state, &mut ()).is_ok(),
        1 => {
            let length = input.length(model.unknowns());
            let weights = input.numbers(length, 0.0, 1.0);
            let targets: Vec<f64> = (0..input.random.usize(0..3)).map(|_| input.number(0.0, 0.1)).collect();
            let _ = input.saw("weights, targets", (&weights, &targets));
            let start = if input.once_in(2) { rest } else { state };
            let _ = analysis.run_controlled(model, rows, start, &Deflection { weights }, &targets, &mut ());
        }
        _ => {
            let count = |input: &mut Input| if input.once_in(4) { input.count(0, 9) } else { 3 };
            let step = |input: &mut Input, state: State| Step {
                state,
                iterations: count(input),
                rejected: count(input),
                energy: input.number(0.0, 1.0),
                inertia: None,
                unstable: input.once_in(2).then(|| count(input)),
                critical: Vec::new(),
                diagnostics: Default::default(),
                doubts: Vec::new(),
                control_state: StepControlState {
                    increment: input.number(0.0, 1.0),
                    reached: count(input),
                    arc: input.once_in(4),
                },
            };
            let mut path = EquilibriumPath::from(rest.clone());
            for _ in 0..input.random.usize(0..4) {
                let state = if input.once_in(2) { state.clone() } else { State { load: 0.3, ..rest.clone() } };
                let step = step(input, state);
                path.steps.push(step);
            }
            let _ = input.saw("path", &path);
            let weights = vec![0.1; model.unknowns()];
            let _ = analysis.run_controlled(model, rows, path.clone(), &Deflection { weights }, &[0.1], &mut ());
            input.passed = analysis.resume(model, rows, path, &mut ()).is_ok();
        }
    }
}
