//! What is promised, tried.

use super::*;
use crate::linear::{after_their_rows, nested_dissection};
use approx::assert_abs_diff_eq;

/// A path graph's Laplacian plus `shift` on the diagonal, as lower pattern and values.
fn chain(n: usize, shift: f64) -> (Pattern, Vec<f64>) {
    let pattern = Pattern::from_columns((0..n).map(|c| if c + 1 < n { vec![c as u32 + 1] } else { vec![] }).collect());
    let mut values = Vec::new();
    for c in 0..n {
        values.push(2.0 + shift);
        if c + 1 < n {
            values.push(-1.0);
        }
    }
    (pattern, values)
}

#[test]
fn definite_and_indefinite_matrices_are_solved_and_counted() {
    let n = 200;
    for (shift, order) in [(0.0, false), (0.1, true), (-0.5, false), (-1.7, true)] {
        let (pattern, values) = chain(n, shift);
        let order = order.then(|| nested_dissection(&pattern, n, 1, &|i, _| i as f64));
        let mut solver = Direct::of(&pattern, MatrixClass::Definite, order.as_deref()).unwrap();
        let system = LinearSystem::of(&values);
        let inertia = solver.factorize(&system).unwrap();
        // Eigenvalues of the chain: 2 + shift − 2 cos(π k/(n+1)).
        let negative = (1..=n)
            .filter(|&k| 2.0 + shift - 2.0 * (std::f64::consts::PI * k as f64 / (n + 1) as f64).cos() < 0.0)
            .count();
        assert_eq!(inertia.unwrap(), Inertia { positive: n - negative, negative });
        let b: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        let mut x = b.clone();
        solver.solve(&system, &mut x, None).unwrap();
        let mut product = vec![0.0; n];
        pattern.multiply_add(&values, &x, &mut product);
        for i in 0..n {
            assert_abs_diff_eq!(product[i], b[i], epsilon = 1e-9);
        }
    }
}

#[test]
fn multiplications_of_factors_are_counted() {
    // Of a dense matrix n³/6, of a chain two for each unknown, or those of the blocks of 16 that it is padded to.
    let n = 60;
    let dense = Pattern::from_columns((0..n).map(|c| (c as u32..n as u32).collect()).collect());
    let order: Vec<usize> = (0..n).collect();
    let found = multiplications(&dense, &order).unwrap() / (n as f64).powi(3);
    assert_abs_diff_eq!(found, 1.0 / 6.0, epsilon = 1e-12);
    let few = multiplications(&chain(1000, 0.0).0, &(0..1000).collect::<Vec<_>>()).unwrap();
    assert!((1000.0..1000.0 * 16.0 * 16.0).contains(&few), "{few}");
}

#[test]
fn saddle_points_are_solved_and_counted_stable_or_not() {
    let (n, constraints) = (60, 5);
    let (chain, _) = chain(n, 0.0);
    let mut columns: Vec<Vec<u32>> = (0..n).map(|c| chain.column(c).to_vec()).collect();
    for c in 0..constraints {
        for unknown in [10 * c, 10 * c + 2] {
            columns[unknown].push((n + c) as u32);
        }
    }
    columns.resize(n + constraints, Vec::new());
    let pattern = Pattern::from_columns(columns);
    let order = after_their_rows(&pattern, &nested_dissection(&pattern, n, 1, &|i, _| i as f64));
    let class = MatrixClass::Saddle { constraints };
    let mut given = Direct::of(&pattern, class, Some(&order)).unwrap();
    let mut own = Direct::of(&pattern, class, None).unwrap();
    // Stable, unstable, and stable again with the same factoriser.
    for shift in [0.0, -0.3, -1.1, 0.2] {
        let value = |row: usize, column: usize| match (row < n, row == column) {
            (true, true) => 2.0 + shift,
            (true, false) => -1.0,
            (false, true) => 0.0,
            (false, false) => 1.0 + column as f64 / n as f64,
        };
        let size = n + constraints;
        let values: Vec<f64> = (0..size)
            .flat_map(|column| pattern.column(column).iter().map(move |&row| (row as usize, column)))
            .map(|(row, column)| value(row, column))
            .collect();
        let mut dense = nalgebra::DMatrix::zeros(size, size);
        for column in 0..size {
            for entry in pattern.columns[column]..pattern.columns[column + 1] {
                let row = pattern.rows[entry] as usize;
                dense[(row, column)] = values[entry];
                dense[(column, row)] = values[entry];
            }
        }
        let negative = dense.symmetric_eigenvalues().iter().filter(|&&e| e < 0.0).count();
        assert_eq!(negative > constraints, shift < 0.0);
        for solver in [&mut given, &mut own] {
            let system = LinearSystem::of(&values);
            let inertia = solver.factorize(&system).unwrap();
            assert_eq!(inertia.unwrap(), Inertia { positive: size - negative, negative });
            let b: Vec<f64> = (0..size).map(|i| (i as f64).sin()).collect();
            let mut x = b.clone();
            solver.solve(&system, &mut x, None).unwrap();
            let mut product = vec![0.0; size];
            pattern.multiply_add(&values, &x, &mut product);
            let error = product.iter().zip(&b).map(|(p, b)| (p - b).abs()).fold(0.0, f64::max);
            let scale = x.iter().map(|x| x.abs()).fold(1.0, f64::max);
            assert!(error < 1e-12 * scale, "{shift}: {error:e} at {scale:e}");
        }
    }
}

#[test]
fn a_singular_matrix_is_an_error() {
    let pattern = Pattern::from_columns(vec![vec![1], vec![]]);
    let mut solver = Direct::of(&pattern, MatrixClass::Definite, None).unwrap();
    let zeros = LinearSystem::of(&[0.0, 0.0, 0.0]);
    assert!(solver.factorize(&zeros).is_err() || solver.solve(&zeros, &mut [1.0, 1.0], None).is_err());
    assert!(solver.factorize(&LinearSystem::of(&[f64::NAN, 0.0, 1.0])).is_err());
    // Nothing to solve with.
    assert!(solver.solve(&zeros, &mut [1.0, 1.0], None).is_err());
    assert!(Direct::default().factorize(&zeros).is_err());
}
