//! Constraint equations that share unknowns: which they are, and their elimination.

use std::collections::BTreeMap;

use crate::error::BoundaryError;
use crate::geometry::Disjoint;

use super::Constraints;

/// A constraint equation of which elimination leaves less than this part of its size depends on others.
const DEPENDENT: f64 = 1e-10;

/// Constraint equations that share unknowns, eliminated together.
pub(super) struct Group {
    /// Numbers of its constraint equations in the problem.
    pub equations: Vec<usize>,
    /// Eliminated unknowns, one per constraint equation.
    pub pivots: Vec<usize>,
    /// Unknowns they are expressed by, as reduced indices.
    pub free: Vec<u32>,
    /// W, `pivots × free`, row by row.
    pub w: Vec<f64>,
    /// V, `pivots × equations`, row by row.
    pub v: Vec<f64>,
    /// Reduced unknowns that couple with the pivots (a superset of `free`).
    pub coupled: Vec<u32>,
    /// Place of (free, coupled) pairs in the reduced values.
    pub places: Vec<u32>,
    /// Groups whose pivots couple with those of this one, itself among them, by rising number: the place of each of their free
    /// unknowns among the coupled ones.
    pub partners: Vec<(u32, Vec<u32>)>,
}

impl Group {
    /// The places of a partner's free unknowns among the coupled ones, which are there by construction.
    pub(super) fn places_of(&self, partner: u32) -> &[u32] {
        let at = self.partners.partition_point(|(other, _)| *other < partner);
        &self.partners[at].1
    }
}

/// Groups constraint equations that share unknowns and brings each group to reduced echelon form; free unknowns by full index.
pub(super) fn eliminate(equations: &Constraints, limit: usize) -> Result<Vec<(Group, Vec<usize>)>, BoundaryError> {
    connected(equations).into_iter().map(|members| eliminate_group(equations, members, limit)).collect()
}

/// The constraint equations in sets that share no unknowns with each other.
fn connected(equations: &Constraints) -> Vec<Vec<usize>> {
    let mut sets = Disjoint::new(equations.len());
    let mut first_equation: BTreeMap<usize, usize> = BTreeMap::new();
    for (r, equation) in equations.equations().iter().enumerate() {
        for &(unknown, coefficient) in &equation.entries {
            if coefficient != 0.0 {
                sets.join(r, *first_equation.entry(unknown).or_insert(r));
            }
        }
    }
    let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for r in 0..equations.len() {
        members.entry(sets.leader(r)).or_default().push(r);
    }
    members.into_values().collect()
}

/// Expresses as many unknowns as there are constraint equations in a group by the other unknowns.
fn eliminate_group(
    equations: &Constraints,
    members: Vec<usize>,
    limit: usize,
) -> Result<(Group, Vec<usize>), BoundaryError> {
    let m = members.len();
    if m > limit {
        return Err(BoundaryError::Unsuitable {
            enforcement: "mixed transformation",
            reason: format!(
                "{m} constraint equations share unknowns and would be eliminated together, the limit is {limit}; take Lagrange multipliers"
            ),
        });
    }
    let mut unknowns: Vec<usize> = members
        .iter()
        .flat_map(|&r| equations.equations()[r].entries.iter().filter(|e| e.1 != 0.0).map(|e| e.0))
        .collect();
    unknowns.sort_unstable();
    unknowns.dedup();
    let n = unknowns.len();
    // [G | I], constraint equations scaled to a largest entry of one.
    let width = n + m;
    let mut a = vec![0.0; m * width];
    for (i, &r) in members.iter().enumerate() {
        let equation = &equations.equations()[r];
        let largest = equation.largest();
        for &(unknown, coefficient) in &equation.entries {
            if coefficient != 0.0 {
                a[i * width + unknowns.partition_point(|&u| u < unknown)] += coefficient / largest;
            }
        }
        a[i * width + n + i] = 1.0 / largest;
    }
    let pivot_column = echelon(&mut a, m, n).map_err(|(i, pivot)| {
        let equation = members[i];
        BoundaryError::Dependent { equation, what: equations.equations()[equation].label.clone(), pivot }
    })?;
    let free_columns: Vec<usize> = (0..n).filter(|j| !pivot_column.contains(j)).collect();
    let mut w = Vec::with_capacity(m * free_columns.len());
    let mut v = Vec::with_capacity(m * m);
    for i in 0..m {
        w.extend(free_columns.iter().map(|&j| -a[i * width + j]));
        v.extend_from_slice(&a[i * width + n..(i + 1) * width]);
    }
    let group = Group {
        equations: members,
        pivots: pivot_column.iter().map(|&j| unknowns[j]).collect(),
        free: Vec::new(),
        w,
        v,
        coupled: Vec::new(),
        places: Vec::new(),
        partners: Vec::new(),
    };
    Ok((group, free_columns.iter().map(|&j| unknowns[j]).collect()))
}

/// Gauss–Jordan with complete pivoting among the first `n` columns of `m` rows: the column of each row's pivot, or a row that
/// depends on others and its largest entry.
fn echelon(a: &mut [f64], m: usize, n: usize) -> Result<Vec<usize>, (usize, f64)> {
    let width = n + m;
    let mut pivot_column = vec![usize::MAX; m];
    for _ in 0..m {
        let mut best = (0.0, 0, 0);
        for i in (0..m).filter(|&i| pivot_column[i] == usize::MAX) {
            for (j, value) in a[i * width..i * width + n].iter().enumerate() {
                if value.abs() > best.0 {
                    best = (value.abs(), i, j);
                }
            }
        }
        let (size, i, j) = best;
        if !(size > DEPENDENT) {
            return Err(((0..m).find(|&i| pivot_column[i] == usize::MAX).unwrap_or(0), size));
        }
        pivot_column[i] = j;
        let scale = 1.0 / a[i * width + j];
        let pivot_row: Vec<f64> = a[i * width..(i + 1) * width].iter().map(|v| v * scale).collect();
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
    Ok(pivot_column)
}
