use rkpm::assembly::Pattern;
use rkpm::boundary::{ConstraintEquation, Enforcement, Reduction};
use rkpm::linear::{LinearSolver, LinearSystem, MatrixClass};
use rkpm::prelude::*;

use super::harness::Input;

pub fn amplitude(input: &mut Input) -> Amplitude {
    match input.random.usize(0..5) {
        0 => Amplitude::Constant,
        1 => {
            let bad = input.once_in(2);
            let pairs: Vec<(f64, f64)> = (0..input.random.usize(0..5))
                .map(
                    |k| if bad { (input.number(0.0, 1.0), input.number(0.0, 1.0)) } else { (0.3 * k as f64, k as f64) },
                )
                .collect();
            let pairs = input.saw("amplitude", pairs);
            match Amplitude::table(pairs.clone()) {
                Ok(table) => table,
                // Put together without the check.
                Err(_) => Amplitude::Table(pairs),
            }
        }
        2 => {
            let value = input.number(0.0, 1.0);
            let value = input.saw("function", value);
            Amplitude::Function(std::sync::Arc::new(move |load| load * value))
        }
        _ => Amplitude::Ramp,
    }
}

fn row(input: &mut Input, unknowns: usize) -> ConstraintEquation {
    ConstraintEquation {
        entries: (0..input.random.usize(0..4)).map(|_| (input.index(unknowns), input.number(-1.0, 1.0))).collect(),
        dependent: input.index(unknowns),
        target: input.number(-1.0, 1.0),
        amplitude: amplitude(input),
        label: "row".into(),
    }
}

pub fn rows(input: &mut Input) {
    let particles = Block::new([0.0, 0.0], [1.0, 1.0]).particles([3, 3], 1.0).unwrap();
    let kernel = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear()).unwrap();
    let mut rows = Constraints::default();
    for _ in 0..input.random.usize(0..4) {
        let row = row(input, 18);
        let _ = input.saw("row", &row);
        let _ = rows.push(row);
    }
    let nodes: Vec<usize> = (0..input.random.usize(0..5)).map(|_| input.index(9)).collect();
    let component = input.index(2);
    let value = input.number(-1.0, 1.0);
    let amplitude = amplitude(input);
    let _ = input.saw("nodes, component, value, amplitude", (&nodes, component, value, &amplitude));
    let _ = rows.at_particles(&kernel, &nodes, component, &|_| value, &amplitude, "values");
    let load = input.number(0.0, 1.0);
    let _ = amplitude.evaluate(load);
    let size = if input.once_in(6) { input.random.usize(0..20) } else { 18 };
    let size = input.saw("size", size);
    let pattern = Pattern::from_columns((0..size).map(|c| (c as u32..size as u32).collect()).collect());
    let bound = |enforcement: &dyn Enforcement| Reduction::new(enforcement.bind(&pattern, &rows)?, &pattern, &rows);
    input.passed = bound(&MixedTransformation::default()).is_ok();
    let _ = bound(&LagrangeMultipliers);
}

pub fn matrices(input: &mut Input) {
    let size = input.random.usize(0..8);
    let mut pattern = Pattern::from_columns((0..size).map(|c| (c as u32..size as u32).collect()).collect());
    if input.once_in(3) {
        let rows = std::sync::Arc::make_mut(&mut pattern.rows);
        match input.random.usize(0..6) {
            0 => pattern.columns.clear(),
            1 if !rows.is_empty() => rows[0] = input.index(size) as u32,
            2 => drop(rows.pop()),
            3 if !pattern.columns.is_empty() => {
                let k = input.random.usize(0..pattern.columns.len());
                pattern.columns[k] = input.index(20);
            }
            4 => rows.reverse(),
            _ => drop(pattern.columns.pop()),
        }
    }
    let class =
        if input.once_in(2) { MatrixClass::Definite } else { MatrixClass::Saddle { constraints: input.count(0, 3) } };
    let order: Option<Vec<usize>> = match input.random.usize(0..4) {
        0 => Some((0..size).rev().collect()),
        1 => Some((0..input.length(size)).map(|_| input.index(size)).collect()),
        _ => None,
    };
    let values_length = input.length(pattern.rows.len());
    let spd = input.once_in(2);
    let values: Vec<f64> = if spd && values_length == pattern.rows.len() && pattern.columns.len() == size + 1 {
        let mut values = vec![-0.1; values_length];
        pattern.columns[..size].iter().filter(|&&c| c < values_length).for_each(|&c| values[c] = size as f64);
        values
    } else {
        input.numbers(values_length, -1.0, 1.0)
    };
    let right_length = input.length(size);
    let mut right = input.numbers(right_length, -1.0, 1.0);
    let _ = input.saw("pattern, class, order, values, right", (&pattern, class, &order, &values, &right));
    let (mut solver, system) = (Direct::default(), LinearSystem::of(&values));
    if solver.analyze(&pattern, class, order.as_deref()).is_err() || solver.factorize(&system).is_err() {
        return;
    }
    input.passed = solver.solve(&system, &mut right, None).is_ok();
}
