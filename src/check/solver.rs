//! The contract of linear solvers.

use std::f64::consts::PI;

use crate::assembly::Pattern;
use crate::each::{Each, list_of};
use crate::error::LinearError;
use crate::linear::{Inertia, LinearSolver, LinearSystem, MatrixClass, after_their_rows};

use super::{Finding, Report};

/// Unknowns along each side of the square of the test systems.
const SIDE: usize = 14;
/// Relative residual of a direct solution; the systems have condition numbers up to about 1e4.
const RESIDUAL: f64 = 1e-10;

/// A symmetric system with what is known of it.
struct Case {
    name: &'static str,
    pattern: Pattern,
    values: Vec<f64>,
    class: MatrixClass,
    /// An elimination order that the caller gives.
    order: Option<Vec<usize>>,
    /// Signs of the pivots, where the case is regular.
    inertia: Option<Inertia>,
}

/// Checks the contract of [`LinearSolver`]: definite, indefinite and saddle-point systems are solved (a second
/// factorisation with the same symbolic phase too), pivots have the right signs where the solver tells
/// them, and singular or non-finite systems are refused by the factorisation or the solution.
///
/// ```
/// let report = rkpm::check::solver(&rkpm::linear::Direct::default());
/// assert!(report.finding("definite, indefinite and saddle-point systems are solved").is_some_and(|f| f.holds()));
/// ```
pub fn solver(solver: &dyn LinearSolver) -> Report {
    let mut solved = Finding::new("definite, indefinite and saddle-point systems are solved", RESIDUAL);
    let mut again = Finding::new("a second factorisation starts afresh", RESIDUAL);
    let mut signs = Finding::new("the inertia is right (pivots of wrong sign)", 0.0);
    let mut refused = Finding::new("singular systems are refused", 0.0);
    let mut reported = false;
    for case in regular() {
        let place = || case.name.to_string();
        match solve(solver, &case) {
            Ok([first, second, wrong]) => {
                solved.see(first, place);
                again.see(second, place);
                if wrong.is_finite() {
                    reported = true;
                    signs.see(wrong, place);
                }
            }
            Err(error) => solved.see(f64::INFINITY, || format!("{}: {error}", case.name)),
        }
    }
    for case in singular() {
        let accepted = solve(solver, &case).is_ok();
        refused.see(f64::from(u8::from(accepted)), || case.name.to_string());
    }
    let report = Report::default().with([solved, again, refused]);
    if reported { report.with([signs]) } else { report.unchecked("inertia: the solver does not report it") }
}

/// Relative residuals of two factorisations, the second of the doubled matrix, and the number of pivots of
/// wrong sign (NaN where unknown).
fn solve(solver: &dyn LinearSolver, case: &Case) -> Result<[f64; 3], LinearError> {
    let n = case.pattern.size();
    let rhs: Vec<f64> = list_of(n, |i| 1.0 + (i as f64).sin());
    let mut solver = solver.fresh();
    solver.analyze(&case.pattern, case.class, case.order.as_deref())?;
    let mut residual = |values: &[f64]| -> Result<(f64, Option<Inertia>), LinearError> {
        let system = LinearSystem::of(values);
        let inertia = solver.factorize(&system)?;
        let mut x = rhs.clone();
        solver.solve(&system, &mut x, None)?;
        let mut product = vec![0.0; n];
        case.pattern.multiply_add(values, &x, &mut product);
        let error = product.pair_sum(&rhs, |a, b| (a - b) * (a - b)).sqrt();
        Ok((error / rhs.summed(|b| b * b).sqrt(), inertia))
    };
    let (first, inertia) = residual(&case.values)?;
    let doubled: Vec<f64> = case.values.mapped(|v| 2.0 * v);
    let (second, _) = residual(&doubled)?;
    let wrong = match (inertia, case.inertia) {
        (Some(given), Some(right)) => given.negative.abs_diff(right.negative) + given.positive.abs_diff(right.positive),
        _ => return Ok([first, second, f64::NAN]),
    };
    Ok([first, second, wrong as f64])
}

/// The five-point Laplacian of a square with Dirichlet sides plus `shift` times the identity; `constraints`
/// rows that tie pairs of unknowns are appended.
fn square(shift: f64, constraints: usize) -> (Pattern, Vec<f64>) {
    let n = SIDE * SIDE;
    let mut columns: Vec<Vec<(u32, f64)>> = list_of(n, |k| {
        let mut column = vec![(k as u32, 4.0 + shift)];
        if (k + 1) % SIDE != 0 {
            column.push((k as u32 + 1, -1.0));
        }
        if k + SIDE < n {
            column.push(((k + SIDE) as u32, -1.0));
        }
        column
    });
    for c in 0..constraints {
        // Pairs without common unknowns: the rows are independent.
        columns[4 * c].push(((n + c) as u32, 1.0));
        columns[4 * c + 2].push(((n + c) as u32, -1.0));
        columns.push(vec![((n + c) as u32, 0.0)]);
    }
    assemble(columns)
}

fn assemble(columns: Vec<Vec<(u32, f64)>>) -> (Pattern, Vec<f64>) {
    let pattern = Pattern::from_columns(columns.mapped(|c| c.mapped(|e| e.0)));
    let mut values = vec![0.0; pattern.entries()];
    for (column, entries) in columns.iter().enumerate() {
        for &(row, value) in entries {
            if let Some(place) = pattern.find(row as usize, column) {
                values[place] += value;
            }
        }
    }
    (pattern, values)
}

/// Eigenvalues of [`square`] below zero: $4 + s - 2\cos(\pi i/(m+1)) - 2\cos(\pi j/(m+1))$.
fn negative(shift: f64) -> usize {
    let cosine = |i: usize| 2.0 * (PI * i as f64 / (SIDE + 1) as f64).cos();
    (1..=SIDE)
        .flat_map(|i| (1..=SIDE).map(move |j| (i, j)))
        .filter(|&(i, j)| 4.0 + shift < cosine(i) + cosine(j))
        .count()
}

fn regular() -> Vec<Case> {
    let n = SIDE * SIDE;
    let mut cases = Vec::new();
    for (name, shift) in
        [("definite Laplacian", 0.0), ("indefinite shifted Laplacian", -1.3), ("negative definite Laplacian", -9.0)]
    {
        let (pattern, values) = square(shift, 0);
        let negative = negative(shift);
        let inertia = Some(Inertia { positive: n - negative, negative });
        cases.push(Case { name, pattern, values, class: MatrixClass::Definite, order: None, inertia });
    }
    let constraints = 12;
    let (pattern, values) = square(0.0, constraints);
    let inertia = Some(Inertia { positive: n, negative: constraints });
    let class = MatrixClass::Saddle { constraints };
    // In the order of its analyses each multiplier follows the unknowns of its row, and stands there in the matrix.
    let among = after_their_rows(&pattern, &(0..n).collect::<Vec<_>>());
    let (renumbered, places) = pattern.permuted(&among);
    let mut moved = values.clone();
    places.iter().zip(&values).for_each(|(&place, value)| moved[place as usize] = *value);
    let name = "saddle point with an elimination order";
    let order = Some(among);
    cases.push(Case { name, pattern: pattern.clone(), values: values.clone(), class, order, inertia });
    let (name, order) = ("saddle point numbered in its elimination order", Some((0..n + constraints).collect()));
    cases.push(Case { name, pattern: renumbered, values: moved, class, order, inertia });
    cases.push(Case { name: "saddle point of 12 constraints", pattern, values, class, order: None, inertia });
    cases
}

fn singular() -> Vec<Case> {
    let class = MatrixClass::Definite;
    let mut cases = Vec::new();
    let mut add = |name, columns, class| {
        let (pattern, values) = assemble(columns);
        cases.push(Case { name, pattern, values, class, order: None, inertia: None });
    };
    add("two equal rows", vec![vec![(0, 1.0), (1, 1.0)], vec![(1, 1.0)]], class);
    add("an unknown without stiffness", vec![vec![(0, 2.0), (1, -1.0)], vec![(1, 2.0)], vec![(2, 0.0)]], class);
    // A chain of springs held nowhere: all pivots but the last are 1.
    let chain = |count: u32| -> Vec<Vec<(u32, f64)>> {
        (0..count)
            .map(|k| {
                let own = if k == 0 || k + 1 == count { 1.0 } else { 2.0 };
                if k + 1 < count { vec![(k, own), (k + 1, -1.0)] } else { vec![(k, own)] }
            })
            .collect()
    };
    add("a free chain of springs", chain(30), class);
    let mut tied = chain(4);
    tied[0][0].1 = 2.0;
    tied[0].extend([(4, 1.0), (5, 1.0)]);
    tied.extend([vec![(4, 0.0)], vec![(5, 0.0)]]);
    add("a constraint given twice", tied, MatrixClass::Saddle { constraints: 2 });
    let (pattern, mut values) = square(0.0, 0);
    values[7] = f64::NAN;
    cases.push(Case { name: "an entry that is not a number", pattern, values, class, order: None, inertia: None });
    cases
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::Direct;

    #[test]
    fn the_direct_solver_holds() {
        let report = solver(&Direct::default());
        assert!(report.holds() && report.unchecked.is_empty(), "{report}");
    }

    /// Divides by the diagonal.
    #[derive(Default)]
    struct Diagonal(Vec<usize>);

    impl LinearSolver for Diagonal {
        fn fresh(&self) -> Box<dyn LinearSolver> {
            Box::new(Diagonal::default())
        }

        fn analyze(&mut self, pattern: &Pattern, _: MatrixClass, _: Option<&[usize]>) -> Result<(), LinearError> {
            self.0 = pattern.columns[..pattern.size()].to_vec();
            Ok(())
        }

        fn factorize(&mut self, _: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError> {
            Ok(None)
        }

        fn solve(
            &mut self,
            system: &LinearSystem<'_>,
            rhs: &mut [f64],
            _: Option<&mut [[f64; 4]]>,
        ) -> Result<f64, LinearError> {
            rhs.iter_mut().zip(&self.0).for_each(|(b, &diagonal)| *b /= system.values[diagonal]);
            Ok(0.0)
        }
    }

    #[test]
    fn a_solver_that_does_not_solve_is_found_out() {
        let report = solver(&Diagonal::default());
        let broken: Vec<_> = report.violations().map(|f| f.law).collect();
        assert!(broken.contains(&"definite, indefinite and saddle-point systems are solved"));
        assert!(broken.contains(&"singular systems are refused"));
        assert_eq!(report.unchecked.len(), 1);
    }
}
