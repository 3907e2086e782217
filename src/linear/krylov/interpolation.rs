//! Systems with the values of shape functions at particles.

use std::ops::Range;
use std::sync::Arc;

use crate::assembly::Ranks;
use crate::parallel::for_each_mut;

use super::super::vector::dot;
use super::auxiliary::Auxiliary;

/// Rows that one thread at a time multiplies.
const ROWS: usize = 2048;

/// Solutions with the values of shape functions at particles, by a polynomial of fixed degree.
pub(super) struct Interpolation {
    /// Of all nodes, or of those of a rank.
    rows: Sparse,
    /// Empty where ranks share the rows.
    columns: Sparse,
    own: Range<usize>,
    ranks: Option<Arc<dyn Ranks>>,
    /// Least eigenvalue that the polynomial sees, and its degree.
    least: f64,
    degree: usize,
}

#[derive(Default)]
struct Sparse {
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<f64>,
}

impl Sparse {
    /// $y = x - A z$ for three components of each node.
    fn residual(&self, x: &[f64], z: &[f64], y: &mut [f64]) {
        let mut pieces: Vec<&mut [f64]> = y[..3 * self.starts.len().saturating_sub(1)].chunks_mut(3 * ROWS).collect();
        for_each_mut(&mut pieces, |piece, y| {
            for (row, y) in (piece * ROWS..).zip(y.as_chunks_mut::<3>().0) {
                let mut sum = [x[3 * row], x[3 * row + 1], x[3 * row + 2]];
                for k in self.starts[row]..self.starts[row + 1] {
                    let z = &z[3 * self.columns[k] as usize..][..3];
                    for i in 0..3 {
                        sum[i] -= self.values[k] * z[i];
                    }
                }
                *y = sum;
            }
        });
    }

    /// $y \mathrel{-}= A^T z$.
    fn subtract_transposed(&self, z: &[f64], y: &mut [f64]) {
        for row in 0..self.starts.len().saturating_sub(1) {
            for k in self.starts[row]..self.starts[row + 1] {
                let y = &mut y[3 * self.columns[k] as usize..][..3];
                for i in 0..3 {
                    y[i] -= self.values[k] * z[3 * row + i];
                }
            }
        }
    }

    fn transposed(&self) -> Sparse {
        let n = self.starts.len().saturating_sub(1);
        let mut starts = vec![0usize; n + 1];
        self.columns.iter().for_each(|&c| starts[c as usize + 1] += 1);
        for k in 0..n {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let (mut columns, mut values) = (vec![0u32; self.columns.len()], vec![0.0; self.columns.len()]);
        for row in 0..n {
            for k in self.starts[row]..self.starts[row + 1] {
                let place = &mut next[self.columns[k] as usize];
                (columns[*place], values[*place]) = (row as u32, self.values[k]);
                *place += 1;
            }
        }
        Sparse { starts, columns, values }
    }
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
        let rows = Sparse { starts: starts.clone(), columns: columns.clone(), values: values.clone() };
        let n = 3 * nodes;
        let columns = if ranks.is_none() { rows.transposed() } else { Sparse::default() };
        let own = Auxiliary::share(ranks.as_deref(), nodes);
        let mut all = Interpolation { rows, columns, own, ranks, least: 0.0, degree: 0 };
        // Splines of the third order on regular lattices have 1/27 and more; wider supports less.
        let b: Vec<f64> = (0..n).map(|k| (1.7 * k as f64).sin()).collect();
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
            return matrix.residual(x, z, y);
        };
        y.fill(0.0);
        if transposed {
            self.rows.subtract_transposed(&z[3 * self.own.start..], y);
        } else {
            let zeros = vec![0.0; 3 * self.own.len()];
            self.rows.residual(&zeros, z, &mut y[3 * self.own.start..3 * self.own.end]);
        }
        ranks.sum(y);
        y.iter_mut().zip(x).for_each(|(y, x)| *y += x);
    }

    /// Chebyshev's iteration from zero, for the matrix or its transpose.
    pub(super) fn solve(&self, transposed: bool, b: &mut [f64]) {
        let (middle, half) = (0.5 * (1.0 + self.least), 0.5 * (1.0 - self.least));
        let mut x = vec![0.0; b.len()];
        let mut left = b.to_vec();
        let mut step: Vec<f64> = b.iter().map(|b| b / middle).collect();
        let mut rho = half / middle;
        for _ in 0..self.degree {
            x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
            self.residual(transposed, b, &x, &mut left);
            let next = 1.0 / (2.0 * middle / half - rho);
            step.iter_mut().zip(&left).for_each(|(s, l)| *s = next * rho * *s + 2.0 * next / half * l);
            rho = next;
        }
        b.copy_from_slice(&x);
    }
}
