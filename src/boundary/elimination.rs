//! Constraint equations that share unknowns: which they are, their elimination, and which depend on others.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use crate::assembly::Pattern;
use crate::each::{Each, IntoEach, list_of};
use crate::error::BoundaryError;
use crate::geometry::Disjoint;
use crate::linear::{Direct, LinearSolver, LinearSystem, MatrixClass};
use crate::order::{grouped, merged};

use super::ConstraintEquation;
use super::enforced::{DEPENDENT, Eliminated};

/// Expresses as many unknowns as there are constraint equations by the other unknowns, those that share unknowns together.
pub(super) fn eliminate(equations: &[ConstraintEquation], limit: usize) -> Result<Vec<Eliminated>, BoundaryError> {
    let group = |members: Vec<usize>| {
        let m = members.len();
        if m > limit {
            return Err(BoundaryError::Unsuitable {
                enforcement: "mixed transformation",
                reason: format!(
                    "{m} constraint equations share unknowns and would be eliminated together, the limit is {limit}; take Lagrange multipliers"
                ),
            });
        }
        let (mut a, unknowns) = tableau(equations, &members);
        let n = unknowns.len();
        let pivots = echelon(&mut a, m, n, false);
        if let Some((&equation, Err(left))) = members.iter().zip(&pivots).find(|(_, pivot)| pivot.is_err()) {
            return Err(refusal(equations, equation, *left));
        }
        let pivots: Vec<usize> = pivots.into_iter().flatten().collect();
        let free: Vec<usize> = (0..n).filter(|j| !pivots.contains(j)).collect();
        let (mut transfer, mut offsets) = (Vec::with_capacity(m * free.len()), Vec::with_capacity(m * m));
        for row in a.chunks_exact(n + m) {
            transfer.extend(free.iter().map(|&j| -row[j]));
            offsets.extend_from_slice(&row[n..]);
        }
        let [expressed, free] = [pivots, free].map(|columns| columns.into_mapped(|j| unknowns[j]));
        Ok(Eliminated { unknowns: expressed, free, transfer, equations: members, offsets })
    };
    connected(equations).into_iter().map(group).collect()
}

/// The constraint equations that depend on earlier ones, by rising number.
pub(crate) fn dependent(equations: &[ConstraintEquation]) -> Vec<BoundaryError> {
    if independent(equations) {
        return Vec::new();
    }
    let mut dependent: BTreeMap<usize, f64> = BTreeMap::new();
    for members in connected(equations) {
        let (mut a, unknowns) = tableau(equations, &members);
        let pivots = echelon(&mut a, members.len(), unknowns.len(), true);
        dependent
            .extend(members.into_iter().zip(pivots).filter_map(|(equation, pivot)| Some((equation, pivot.err()?))));
    }
    dependent.into_iter().map(|(equation, left)| refusal(equations, equation, left)).collect()
}

fn refusal(equations: &[ConstraintEquation], equation: usize, pivot: f64) -> BoundaryError {
    BoundaryError::Dependent { equation, what: equations[equation].label.clone(), pivot }
}

/// The constraint equations in sets that share no unknowns with each other.
fn connected(equations: &[ConstraintEquation]) -> Vec<Vec<usize>> {
    let mut sets = Disjoint::new(equations.len());
    let mut first_equation: BTreeMap<usize, usize> = BTreeMap::new();
    for (r, equation) in equations.iter().enumerate() {
        for &(unknown, coefficient) in &equation.entries {
            if coefficient != 0.0 {
                sets.join(r, *first_equation.entry(unknown).or_insert(r));
            }
        }
    }
    let leaders: Vec<usize> = list_of(equations.len(), |r| sets.leader(r));
    grouped(&leaders)
}

/// $[G\ |\ 1]$ of some constraint equations, scaled to a largest entry of one, row by row, and the unknowns of the columns of $G$.
fn tableau(equations: &[ConstraintEquation], members: &[usize]) -> (Vec<f64>, Vec<usize>) {
    let rows: Vec<_> = members.mapped(|&r| equations[r].scaled());
    let mut unknowns: Vec<usize> = rows.iter().flat_map(|(entries, _)| entries.iter().map(|entry| entry.0)).collect();
    unknowns.sort_unstable();
    unknowns.dedup();
    let n = unknowns.len();
    let width = n + members.len();
    let mut a = vec![0.0; members.len() * width];
    for (i, (entries, scale)) in rows.iter().enumerate() {
        for (unknown, coefficient) in entries {
            a[i * width + unknowns.partition_point(|u| u < unknown)] += coefficient;
        }
        a[i * width + n + i] = *scale;
    }
    (a, unknowns)
}

/// Gauss–Jordan among the first `n` columns of `m` rows, with complete pivoting or `in_order` of the rows: the column of each row's
/// pivot, or the largest entry that is left of a row that depends on others.
fn echelon(a: &mut [f64], m: usize, n: usize, in_order: bool) -> Vec<Result<usize, f64>> {
    let width = n + m;
    let mut pivots = vec![Err(0.0); m];
    for step in 0..m {
        let mut best = (0.0, 0, 0);
        let candidates = if in_order { step..step + 1 } else { 0..m };
        for i in candidates.filter(|&i| pivots[i].is_err()) {
            for (j, value) in a[i * width..i * width + n].iter().enumerate() {
                if value.abs() > best.0 {
                    best = (value.abs(), i, j);
                }
            }
        }
        let (size, i, j) = best;
        if !(size > DEPENDENT) {
            continue;
        }
        pivots[i] = Ok(j);
        let scale = 1.0 / a[i * width + j];
        let pivot_row: Vec<f64> = a[i * width..(i + 1) * width].mapped(|v| v * scale);
        for k in 0..m {
            let factor = a[k * width + j];
            if k != i && factor != 0.0 {
                for (entry, pivot) in a[k * width..(k + 1) * width].iter_mut().zip(&pivot_row) {
                    *entry -= factor * pivot;
                }
                a[k * width + j] = 0.0;
            }
        }
        a[i * width..(i + 1) * width].copy_from_slice(&pivot_row);
    }
    for (row, pivot) in a.chunks_exact(width.max(1)).zip(&mut pivots) {
        *pivot = pivot.map_err(|_| row[..n].largest(|value| value.abs()));
    }
    pivots
}

/// Whether $G G^T$ has factors that solve: it tells at once what elimination tells at the third power of the number of equations.
fn independent(equations: &[ConstraintEquation]) -> bool {
    let scaled: Vec<_> = equations.mapped(|equation| equation.scaled().0);
    let mut users: HashMap<usize, Vec<(u32, f64)>> = HashMap::new();
    for (r, equation) in scaled.iter().enumerate() {
        equation.iter().for_each(|&(k, c)| users.entry(k).or_default().push((r as u32, c)));
    }
    let (mut columns, mut values) = (vec![0], Vec::new());
    let mut all = Vec::new();
    for (r, equation) in scaled.iter().enumerate() {
        let mut products: Vec<(u32, f64)> = Vec::new();
        for (k, c) in equation {
            products.extend(users[k].iter().filter(|user| user.0 as usize >= r).map(|&(other, d)| (other, c * d)));
        }
        for (other, product) in merged(products) {
            all.push(other);
            values.push(product);
        }
        columns.push(all.len());
    }
    let pattern = Pattern { columns, rows: Arc::new(all) };
    let Ok(mut direct) = Direct::of(&pattern, MatrixClass::Definite, None) else { return false };
    let system = LinearSystem::of(&values);
    if !matches!(direct.factorize(&system), Ok(Some(inertia)) if inertia.negative == 0) {
        return false;
    }
    let mut x: Vec<f64> = list_of(scaled.len(), |k| (1.3 * k as f64).sin());
    // Products of independent constraint equations are mass matrices with a condition of some thousand.
    direct.solve(&system, &mut x, None).is_ok() && x.iter().all(|x| x.abs() < 1e10)
}
