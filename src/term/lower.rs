//! The lower half of a cluster's matrix, in blocks that whole registers are added to.

use crate::each::array_of;
use crate::simd::Arithmetic;

/// Nodes of a window: one register of four numbers.
pub(crate) const WIDTH: usize = 4;

/// The lower half of a cluster's matrix by blocks: for each node $b$ and component $j$ one column of rows for
/// every component $i$, the nodes $a$ running fastest from the first whose window may hold $b$.
#[derive(Debug, Clone, Default)]
pub(crate) struct LowerBlocks {
    values: Vec<f64>,
    /// Where the columns of each node start.
    firsts: Vec<usize>,
    nodes: usize,
}

impl LowerBlocks {
    /// First row of the columns of a node: a window that holds it starts there at the earliest.
    #[inline(always)]
    pub(crate) fn start(b: usize) -> usize {
        b.saturating_sub(WIDTH - 1)
    }

    /// Rows per component, with room for the last window; whole registers.
    #[inline(always)]
    fn rows(nodes: usize, b: usize) -> usize {
        (nodes + WIDTH - 1 - Self::start(b)).next_multiple_of(WIDTH)
    }

    /// Length of a vector over the nodes, by components: as long as a column's rows reach.
    #[inline(always)]
    pub(crate) fn stride(nodes: usize) -> usize {
        nodes + 2 * WIDTH
    }

    /// Zeroes the blocks for a cluster of so many nodes.
    pub(crate) fn reset(&mut self, nodes: usize, dim: usize) {
        if self.nodes != nodes || self.firsts.len() != nodes + 1 {
            self.nodes = nodes;
            self.firsts.clear();
            self.firsts.push(0);
            let mut place = 0;
            for b in 0..nodes {
                place += dim * dim * Self::rows(nodes, b);
                self.firsts.push(place);
            }
        }
        self.values.clear();
        self.values.resize(self.firsts[nodes], 0.0);
    }

    /// The column of unknown $(b, j)$ and its rows per component.
    #[inline(always)]
    pub(crate) fn column<const D: usize>(&self, b: usize, j: usize) -> (&[f64], usize) {
        let rows = Self::rows(self.nodes, b);
        let first = self.firsts[b] + j * D * rows;
        (&self.values[first..first + D * rows], rows)
    }

    #[inline(always)]
    pub(super) fn column_mut<const D: usize>(&mut self, b: usize, j: usize) -> (&mut [f64], usize) {
        let rows = Self::rows(self.nodes, b);
        let first = self.firsts[b] + j * D * rows;
        (&mut self.values[first..first + D * rows], rows)
    }

    /// The columns of all unknowns of a node, and their rows per component.
    #[inline(always)]
    pub(super) fn block_mut<const D: usize>(&mut self, b: usize) -> (&mut [f64], usize) {
        let rows = Self::rows(self.nodes, b);
        (&mut self.values[self.firsts[b]..][..D * D * rows], rows)
    }

    /// Adds $\sum_k p_k c_k^T$ for vectors over the cluster's unknowns, by components of a padded length.
    #[inline(always)]
    pub(crate) fn add_products<A: Arithmetic, const D: usize, const N: usize>(
        &mut self,
        stride: usize,
        vectors: &[f64],
        products: &[f64],
    ) {
        for b in 0..self.nodes {
            let start = Self::start(b);
            for j in 0..D {
                let factors: [f64; N] = array_of(|k| products[(k * D + j) * stride + b]);
                let (column, rows) = self.column_mut::<D>(b, j);
                for i in 0..D {
                    let target = column[i * rows..(i + 1) * rows].as_chunks_mut::<WIDTH>().0;
                    let sources: [&[[f64; WIDTH]]; N] =
                        array_of(|k| &vectors[(k * D + i) * stride + start..].as_chunks::<WIDTH>().0[..target.len()]);
                    for (a, entries) in target.iter_mut().enumerate() {
                        let mut sum = *entries;
                        for k in 0..N {
                            for l in 0..WIDTH {
                                sum[l] = A::multiply_add(factors[k], sources[k][a][l], sum[l]);
                            }
                        }
                        *entries = sum;
                    }
                }
            }
        }
    }

    /// Adds the blocks to an element's matrix, which has whole blocks on the diagonal.
    pub(crate) fn add_to<const D: usize>(&self, matrix: &mut [f64]) {
        let size = self.nodes * D;
        for b in 0..self.nodes {
            for j in 0..D {
                let (column, rows) = self.column::<D>(b, j);
                for a in b..self.nodes {
                    for i in 0..D {
                        matrix[(b * D + j) * size + a * D + i] += column[i * rows + a - Self::start(b)];
                    }
                }
            }
        }
    }
}
