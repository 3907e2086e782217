//! Systems with the values of shape functions at particles.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;
use std::sync::Arc;

use crate::assembly::Ranks;
use crate::each::{Each, add, list_of};
use crate::parallel::for_each_mut;
use crate::simd::{Arithmetic, Task, dispatch};

use super::super::vector::dot;
use super::auxiliary::Auxiliary;

/// Rows that one thread at a time multiplies.
const ROWS: usize = 2048;
/// Rows that are multiplied together.
const TOGETHER: usize = 8;
/// Values are the same where they differ by no more.
const ROUNDING: f64 = 1e-12;

/// Solutions with the values of shape functions at particles, by a polynomial of fixed degree.
pub(super) struct Interpolation {
    /// Of all nodes, or of those of a rank.
    rows: Stencils,
    /// Empty where ranks share the rows.
    columns: Stencils,
    own: Range<usize>,
    ranks: Option<Arc<dyn Ranks>>,
    /// Least eigenvalue that the polynomial sees, and its degree.
    least: f64,
    degree: usize,
}

/// A sparse matrix by rows: those with the same values at the same distances share them.
#[derive(Default)]
struct Stencils {
    /// Rows in a row that share a stencil: the first of them and the stencil, and the number of rows at the end.
    runs: Vec<[u32; 2]>,
    /// First entry of each stencil.
    starts: Vec<usize>,
    /// Columns behind the row.
    offsets: Vec<i32>,
    values: Vec<f64>,
}

impl Stencils {
    /// Of rows of which the first is that of column `first`.
    fn new(starts: &[usize], columns: &[u32], values: &[f64], first: usize) -> Stencils {
        let mut all = Stencils { starts: vec![0], ..Stencils::default() };
        let mut known: HashMap<u64, u32> = HashMap::new();
        let mut offsets: Vec<i32> = Vec::new();
        let rows = starts.len().saturating_sub(1);
        for row in 0..rows {
            let values = &values[starts[row]..starts[row + 1]];
            offsets.clear();
            offsets.extend(
                columns[starts[row]..starts[row + 1]].iter().map(|&c| (i64::from(c) - (first + row) as i64) as i32),
            );
            let last = all.runs.last().map(|run| run[1]).filter(|&last| all.is(last, &offsets, values));
            if last.is_some() {
                continue;
            }
            let mut hasher = DefaultHasher::new();
            offsets.hash(&mut hasher);
            values.iter().for_each(|v| ((v / (100.0 * ROUNDING)).round() as i64).hash(&mut hasher));
            let new = all.starts.len() as u32 - 1;
            let found = *known.entry(hasher.finish()).or_insert(new);
            let stencil = if found != new && all.is(found, &offsets, values) { found } else { new };
            if stencil == new {
                all.offsets.extend_from_slice(&offsets);
                all.values.extend_from_slice(values);
                all.starts.push(all.values.len());
            }
            all.runs.push([row as u32, stencil]);
        }
        all.runs.push([rows as u32, 0]);
        all
    }

    fn is(&self, stencil: u32, offsets: &[i32], values: &[f64]) -> bool {
        let own = self.starts[stencil as usize]..self.starts[stencil as usize + 1];
        let same = |(a, b): (&f64, &f64)| (a - b).abs() <= ROUNDING;
        self.offsets[own.clone()] == *offsets && self.values[own].iter().zip(values).all(same)
    }

    fn rows(&self) -> usize {
        self.runs.last().map_or(0, |run| run[0] as usize)
    }

    /// The runs that rows lie in, cut to them, and the entries of each.
    #[inline(always)]
    fn runs(&self, rows: Range<usize>) -> impl Iterator<Item = (Range<usize>, Range<usize>)> + '_ {
        let first = self.runs.partition_point(|run| run[0] as usize <= rows.start).saturating_sub(1);
        let pairs = self.runs[first..].windows(2).map(|w| (w[0][0] as usize..w[1][0] as usize, w[0][1] as usize));
        pairs.take_while(move |(run, _)| run.start < rows.end).map(move |(run, stencil)| {
            (run.start.max(rows.start)..run.end.min(rows.end), self.starts[stencil]..self.starts[stencil + 1])
        })
    }

    /// $y = x - A z$ for three components of each node, in the rows from `rows.start` on; columns are counted from `first`.
    fn residual(&self, rows: Range<usize>, first: usize, x: &[f64], z: &[f64], y: &mut [f64]) {
        dispatch(Residual { matrix: self, rows, first, x, z, y });
    }

    /// $y \mathrel{-}= A^T z$.
    fn subtract_transposed(&self, first: usize, z: &[f64], y: &mut [f64]) {
        for (rows, entries) in self.runs(0..self.rows()) {
            for row in rows {
                for k in entries.clone() {
                    let y = &mut y[3 * column(first + row, self.offsets[k])..][..3];
                    for i in 0..3 {
                        y[i] -= self.values[k] * z[3 * row + i];
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn column(row: usize, offset: i32) -> usize {
    row.wrapping_add_signed(offset as isize)
}

struct Residual<'a> {
    matrix: &'a Stencils,
    rows: Range<usize>,
    first: usize,
    x: &'a [f64],
    z: &'a [f64],
    y: &'a mut [f64],
}

impl Task for Residual<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let Residual { matrix, rows, first, x, z, y } = self;
        let start = rows.start;
        for (run, entries) in matrix.runs(rows) {
            let (offsets, values) = (&matrix.offsets[entries.clone()], &matrix.values[entries]);
            let mut row = run.start;
            while row < run.end {
                if row + TOGETHER <= run.end {
                    minus::<A, { 3 * TOGETHER }>(row, start, first, (offsets, values), x, z, y);
                    row += TOGETHER;
                } else {
                    minus::<A, 3>(row, start, first, (offsets, values), x, z, y);
                    row += 1;
                }
            }
        }
    }
}

/// Some rows of a residual, `N` numbers.
#[inline(always)]
fn minus<A: Arithmetic, const N: usize>(
    row: usize,
    start: usize,
    first: usize,
    (offsets, values): (&[i32], &[f64]),
    x: &[f64],
    z: &[f64],
    y: &mut [f64],
) {
    let mut sum = [0.0; N];
    sum.copy_from_slice(&x[3 * row..][..N]);
    for (&offset, &value) in offsets.iter().zip(values) {
        let z = &z[3 * column(first + row, offset)..][..N];
        for l in 0..N {
            sum[l] = A::multiply_add(-value, z[l], sum[l]);
        }
    }
    y[3 * (row - start)..][..N].copy_from_slice(&sum);
}

/// The transpose of a square matrix by rows.
fn transposed(starts: &[usize], columns: &[u32], values: &[f64]) -> (Vec<usize>, Vec<u32>, Vec<f64>) {
    let n = starts.len().saturating_sub(1);
    let mut ends = vec![0usize; n + 1];
    columns.iter().for_each(|&c| ends[c as usize + 1] += 1);
    for k in 0..n {
        ends[k + 1] += ends[k];
    }
    let mut next = ends.clone();
    let (mut rows, mut turned) = (vec![0u32; columns.len()], vec![0.0; columns.len()]);
    for row in 0..n {
        for k in starts[row]..starts[row + 1] {
            let place = &mut next[columns[k] as usize];
            (rows[*place], turned[*place]) = (row as u32, values[k]);
            *place += 1;
        }
    }
    (ends, rows, turned)
}

impl Interpolation {
    pub(super) fn new(
        (starts, columns, values): &(Vec<usize>, Vec<u32>, Vec<f64>),
        nodes: usize,
        ranks: Option<Arc<dyn Ranks>>,
    ) -> Option<Self> {
        if values.is_empty() && ranks.is_none() {
            return None;
        }
        let n = 3 * nodes;
        let own = Auxiliary::share(ranks.as_deref(), nodes);
        let rows = Stencils::new(starts, columns, values, own.start);
        let columns = match ranks {
            Some(_) => Stencils::default(),
            None => {
                let (starts, rows, values) = transposed(starts, columns, values);
                Stencils::new(&starts, &rows, &values, 0)
            }
        };
        let mut all = Interpolation { rows, columns, own, ranks, least: 0.0, degree: 0 };
        // Splines of the third order on regular lattices have 1/27 and more; wider supports less.
        let b: Vec<f64> = list_of(n, |k| (1.7 * k as f64).sin());
        for (least, degree) in [(0.03, 10), (0.01, 18), (0.003, 32), (0.001, 56)] {
            (all.least, all.degree) = (least, degree);
            let mut x = b.clone();
            all.solve(false, &mut x);
            let mut left = vec![0.0; n];
            all.residual(false, &b, &x, &mut left);
            if dot(&left, &left) <= 0.01 * dot(&b, &b) {
                break;
            }
        }
        Some(all)
    }

    /// $y = x - A z$ for the matrix or its transpose.
    pub(super) fn residual(&self, transposed: bool, x: &[f64], z: &[f64], y: &mut [f64]) {
        let Some(ranks) = &self.ranks else {
            let matrix = if transposed { &self.columns } else { &self.rows };
            let mut pieces: Vec<&mut [f64]> = y.chunks_mut(3 * ROWS).collect();
            return for_each_mut(&mut pieces, |piece, y| {
                matrix.residual(piece * ROWS..piece * ROWS + y.len() / 3, 0, x, z, y);
            });
        };
        y.fill(0.0);
        let own = 3 * self.own.start..3 * self.own.end;
        if transposed {
            self.rows.subtract_transposed(self.own.start, &z[own], y);
        } else {
            let zeros = vec![0.0; own.len()];
            self.rows.residual(0..self.own.len(), self.own.start, &zeros, z, &mut y[own]);
        }
        ranks.sum(y);
        add(y, 1.0, x);
    }

    /// Chebyshev's iteration from zero, for the matrix or its transpose.
    pub(super) fn solve(&self, transposed: bool, b: &mut [f64]) {
        let (middle, half) = (0.5 * (1.0 + self.least), 0.5 * (1.0 - self.least));
        let mut step: Vec<f64> = b.mapped(|b| b / middle);
        let mut x = step.clone();
        let mut left = vec![0.0; b.len()];
        let mut rho = half / middle;
        for _ in 1..self.degree {
            self.residual(transposed, b, &x, &mut left);
            let next = 1.0 / (2.0 * middle / half - rho);
            let (along, ahead) = (next * rho, 2.0 * next / half);
            let step = step.chunks_mut(3 * ROWS).zip(left.chunks(3 * ROWS));
            let mut pieces: Vec<_> = x.chunks_mut(3 * ROWS).zip(step).collect();
            for_each_mut(&mut pieces, |_, (x, (step, left))| {
                for ((x, s), l) in x.iter_mut().zip(&mut **step).zip(&**left) {
                    *s = along * *s + ahead * l;
                    *x += *s;
                }
            });
            rho = next;
        }
        b.copy_from_slice(&x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn rows_that_share_a_stencil_multiply_as_each_by_itself() {
        // Twenty rows alike in the middle, others before and behind them, one of them changed a little.
        let n = 30usize;
        let (mut starts, mut columns, mut values) = (vec![0], Vec::new(), Vec::new());
        for row in 0..n {
            for column in row.saturating_sub(2)..(row + 3).min(n) {
                columns.push(column as u32);
                let own = if row < 4 { 1e-3 * row as f64 } else { 0.0 };
                let moved = if row == 17 { 1e-6 } else { 0.0 };
                values.push(1.0 / (1.0 + row.abs_diff(column) as f64) + own + moved);
            }
            starts.push(columns.len());
        }
        let rows = Stencils::new(&starts, &columns, &values, 0);
        assert!(rows.rows() == n && rows.values.len() < values.len() / 2);
        let z: Vec<f64> = (0..3 * n).map(|k| (0.7 * k as f64).sin()).collect();
        let mut y = vec![0.0; 3 * n];
        rows.residual(0..n, 0, &z, &z, &mut y);
        let (turned_starts, turned_columns, turned_values) = transposed(&starts, &columns, &values);
        let turned = Stencils::new(&turned_starts, &turned_columns, &turned_values, 0);
        let (mut by_columns, mut by_rows) = (vec![0.0; 3 * n], z.clone());
        turned.residual(0..n, 0, &z, &z, &mut by_columns);
        rows.subtract_transposed(0, &z, &mut by_rows);
        for row in 0..n {
            for i in 0..3 {
                let sum: f64 = (starts[row]..starts[row + 1]).map(|k| values[k] * z[3 * columns[k] as usize + i]).sum();
                assert_abs_diff_eq!(y[3 * row + i], z[3 * row + i] - sum, epsilon = 1e-11);
                assert_abs_diff_eq!(by_columns[3 * row + i], by_rows[3 * row + i], epsilon = 1e-11);
            }
        }
        // In pieces that cut runs.
        let mut piece = vec![0.0; 3 * 11];
        rows.residual(7..18, 0, &z, &z, &mut piece);
        assert_eq!(piece, y[21..54]);
    }
}
