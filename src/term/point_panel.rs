//! Clusters whose points share their neighbours, as panels of one product.

use crate::simd::{LANES, Panel, Sink};
use crate::table::ShapeTable;

use super::lower::{LowerBlocks, WIDTH};

/// Most points of a group in space: a cell of $2^3$ sub-cells.
const TOGETHER: usize = 8;
/// A group's nodes are at most so many times those that a point sees on average: the others have no gradient there.
const SPREAD: f64 = 1.25;

/// The points of a cell in space, which see nearly the same nodes: their products are summed in registers and added to
/// the cluster's matrix once.
#[derive(Debug, Clone, Default)]
pub(crate) struct PointPanel {
    /// Points that wait, and their nodes in all.
    points: Vec<usize>,
    entries: usize,
    /// Nodes of all of them, by their place in the cluster.
    union: Vec<u16>,
    merged: Vec<u16>,
    /// First nodes of the windows, the node of each row (`u16::MAX` for none), and the row of each node of the cluster.
    windows: Vec<u16>,
    node_of: Vec<u16>,
    row_of: Vec<u32>,
    panel: Panel,
}

impl PointPanel {
    /// Begins with another cluster.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.union.clear();
        self.entries = 0;
        self.panel.tangents.clear();
    }

    /// Takes another point; what waits is added first where they don't fit together.
    #[inline(always)]
    pub(crate) fn push<const D: usize>(
        &mut self,
        table: &ShapeTable<D>,
        point: usize,
        tangent: [[[[f64; 3]; 3]; 3]; 3],
        lower: &mut LowerBlocks,
    ) {
        let local = table.clusters().local(point);
        if self.points.len() == TOGETHER {
            self.flush::<D>(table, lower);
        }
        if self.union.as_slice() != local {
            merge(&self.union, local, &mut self.merged);
            let mean = (self.entries + local.len()) as f64 / (self.points.len() + 1) as f64;
            if self.merged.len() as f64 > SPREAD * mean {
                self.flush::<D>(table, lower);
                self.merged.clear();
                self.merged.extend_from_slice(local);
            }
            std::mem::swap(&mut self.union, &mut self.merged);
        }
        self.points.push(point);
        self.entries += local.len();
        self.panel.tangents.push(tangent);
    }

    /// Adds $g_{as} A_{isjt}\\,g_{bt}$ of what waits to the lower half of the cluster's matrix.
    #[inline(always)]
    pub(crate) fn flush<const D: usize>(&mut self, table: &ShapeTable<D>, lower: &mut LowerBlocks) {
        if self.points.is_empty() {
            return;
        }
        self.windows.clear();
        self.node_of.clear();
        self.row_of.clear();
        self.row_of.resize(self.union.last().map_or(0, |&last| last as usize + 1), u32::MAX);
        for &node in &self.union {
            let start = match self.windows.last() {
                Some(&start) if usize::from(node) < usize::from(start) + WIDTH => start,
                _ => {
                    self.windows.push(node);
                    self.node_of.extend([u16::MAX; WIDTH]);
                    node
                }
            };
            let row = (self.windows.len() - 1) * WIDTH + usize::from(node - start);
            (self.row_of[usize::from(node)], self.node_of[row]) = (row as u32, node);
        }
        let blocks = (self.windows.len() * WIDTH).div_ceil(LANES);
        let Panel { gradients, blocks: known, .. } = &mut self.panel;
        *known = blocks;
        gradients.clear();
        gradients.resize(3 * self.points.len() * blocks, [0.0; LANES]);
        let columns = gradients.as_flattened_mut().chunks_exact_mut(3 * blocks * LANES);
        for (&point, columns) in self.points.iter().zip(columns) {
            let local = table.clusters().local(point);
            let all = table.gradients(point);
            for (s, column) in columns.chunks_exact_mut(blocks * LANES).enumerate() {
                for (&node, g) in local.iter().zip(&all[s * local.len()..]) {
                    column[self.row_of[usize::from(node)] as usize] = *g;
                }
            }
        }
        let PointPanel { windows, node_of, panel, .. } = self;
        panel.multiply(&mut Rows::<D> { windows, node_of, lower });
        self.clear();
    }
}

/// Rows of a panel in the lower half of a cluster's matrix.
struct Rows<'a, const D: usize> {
    windows: &'a [u16],
    node_of: &'a [u16],
    lower: &'a mut LowerBlocks,
}

impl<const D: usize> Sink for Rows<'_, D> {
    #[inline(always)]
    fn wants(&self, row: usize) -> bool {
        self.node_of.get(row).is_some_and(|&node| node != u16::MAX)
    }

    #[inline(always)]
    fn add(&mut self, b: usize, j: usize, first: usize, sums: [&[f64]; 3]) {
        let node = usize::from(self.node_of[b]);
        let start = LowerBlocks::start(node);
        let (column, rows) = self.lower.column_mut::<D>(node, j);
        let from = (b / WIDTH).max(first / WIDTH);
        let to = ((first + sums[0].len()) / WIDTH).min(self.windows.len());
        for (i, sums) in sums.into_iter().enumerate() {
            let sums = sums[from * WIDTH - first..].as_chunks::<WIDTH>().0;
            for (&window, sum) in self.windows[from..to].iter().zip(sums) {
                let target = &mut column[i * rows + usize::from(window) - start..][..WIDTH];
                for l in 0..WIDTH {
                    target[l] += sum[l];
                }
            }
        }
    }
}

/// The union of two rising lists.
#[inline(always)]
fn merge(a: &[u16], b: &[u16], out: &mut Vec<u16>) {
    out.clear();
    let (mut a, mut b) = (a.iter().copied().peekable(), b.iter().copied().peekable());
    while let Some(least) = a.peek().into_iter().chain(b.peek()).min().copied() {
        a.next_if_eq(&least);
        b.next_if_eq(&least);
        out.push(least);
    }
}
