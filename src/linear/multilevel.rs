//! A multilevel solver for sparse matrices of blocks: the stiffness of linear elements on the particles.

use std::ops::Range;

use crate::assembly::Pattern;
use crate::each::{Each, EachOf, array_of, list_of};
use crate::error::LinearError;
use crate::parallel::{for_each_mut, map_with, threads};
use crate::simd::{Arithmetic, Task, dispatch};
use crate::tensor::inverse;

use super::{Direct, LinearSolver, LinearSystem, MatrixClass};

/// Components of a block.
pub(super) const BLOCK: usize = 3;
/// By columns. In single precision, as all of the levels: they are gone through several times in each direction and are
/// a large part of what a model keeps, and a cycle only stands for a solution.
type Block = [f32; BLOCK * BLOCK];

/// Nodes up to which a level is factorised: some thousand unknowns with 81 entries a row take milliseconds.
const COARSEST: usize = 1500;
/// Rows that one thread at a time multiplies.
const ROWS: usize = 2048;
/// Sweeps before and after the coarser level.
const SWEEPS: usize = 2;

/// A square matrix of blocks by rows, both triangles, columns rising.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockMatrix {
    starts: Vec<usize>,
    columns: Vec<u32>,
    values: Vec<Block>,
}

/// Weights of coarse nodes by fine nodes.
#[derive(Debug, Clone, Default)]
struct Transfer {
    starts: Vec<usize>,
    nodes: Vec<u32>,
    weights: Vec<f64>,
}

impl Transfer {
    fn row(&self, node: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[node]..self.starts[node + 1];
        self.nodes[range.clone()].iter().map(|&n| n as usize).zip(self.weights[range].iter().copied())
    }
}

impl BlockMatrix {
    pub(super) fn rows(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// From the lower triangle of a pattern whose columns come in blocks.
    pub(super) fn from_lower(pattern: &Pattern, values: &[f64]) -> BlockMatrix {
        let nodes = pattern.size() / BLOCK;
        let node_rows = |node: usize| {
            let rows = pattern.column(node * BLOCK + BLOCK - 1);
            rows.iter().copied().filter(|row| *row as usize % BLOCK == BLOCK - 1).map(|row| row as usize / BLOCK)
        };
        let mut counts = vec![0usize; nodes + 1];
        for column in 0..nodes {
            for row in node_rows(column) {
                counts[row + 1] += 1;
                if row != column {
                    counts[column + 1] += 1;
                }
            }
        }
        for k in 0..nodes {
            counts[k + 1] += counts[k];
        }
        let starts = counts.clone();
        let (mut columns, mut blocks) = (vec![0u32; starts[nodes]], vec![[0.0; 9]; starts[nodes]]);
        let mut next = starts.clone();
        // Columns rise in each row: what comes by earlier columns is there before a row's own column comes.
        for column in 0..nodes {
            for (k, row) in node_rows(column).enumerate() {
                let (mut block, mut turned): (Block, Block) = ([0.0; 9], [0.0; 9]);
                for j in 0..BLOCK {
                    let first = pattern.columns[column * BLOCK + j];
                    for i in 0..BLOCK {
                        let value = match (k, i >= j) {
                            (0, true) => values[first + i - j],
                            (0, false) => values[pattern.columns[column * BLOCK + i] + j - i],
                            _ => values[first + BLOCK - j + (k - 1) * BLOCK + i],
                        };
                        (block[j * BLOCK + i], turned[i * BLOCK + j]) = (value as f32, value as f32);
                    }
                }
                (columns[next[row]], blocks[next[row]]) = (column as u32, block);
                next[row] += 1;
                if row != column {
                    (columns[next[column]], blocks[next[column]]) = (row as u32, turned);
                    next[column] += 1;
                }
            }
        }
        BlockMatrix { starts, columns, values: blocks }
    }

    /// Adds to the diagonal of an unknown.
    pub(super) fn add_diagonal(&mut self, unknown: usize, value: f64) {
        let i = unknown % BLOCK;
        let mut block = [0.0; BLOCK * BLOCK];
        block[i * BLOCK + i] = value;
        self.add_block(unknown / BLOCK, &block);
    }

    /// Adds to the diagonal block of a node.
    pub(super) fn add_block(&mut self, node: usize, block: &[f64; BLOCK * BLOCK]) {
        let range = self.starts[node]..self.starts[node + 1];
        if let Ok(at) = self.columns[range.clone()].binary_search(&(node as u32)) {
            self.values[range.start + at].iter_mut().zip(block).for_each(|(b, value)| *b += *value as f32);
        }
    }

    /// The largest diagonal entry.
    pub(super) fn largest_diagonal(&self) -> f64 {
        let diagonals = (0..self.rows()).flat_map(|row| self.diagonal(row).map(|b| [b[0], b[4], b[8]]));
        f64::from(diagonals.flatten().fold(0.0, f32::max))
    }

    fn diagonal(&self, row: usize) -> Option<&Block> {
        let range = self.starts[row]..self.starts[row + 1];
        let at = self.columns[range.clone()].binary_search(&(row as u32)).ok()?;
        Some(&self.values[range.start + at])
    }

    /// Rows cut where no row of a part sees further than the parts beside it: even parts may be relaxed at the same time, and odd
    /// ones.
    fn parts(&self) -> Vec<usize> {
        let far = |row: usize| {
            let columns = &self.columns[self.starts[row]..self.starts[row + 1]];
            columns.iter().map(|&column| row.abs_diff(column as usize)).max().unwrap_or(0)
        };
        let reach = (0..self.rows()).map(far).max().unwrap_or(0).max(1);
        let count = (self.rows() / reach).max(1);
        list_of(count + 1, |part| self.rows() * part / count)
    }

    /// $b - A x$.
    fn residuals(&self, b: &[f32], x: &[f32]) -> Vec<f32> {
        let mut left = vec![0.0; self.rows() * BLOCK];
        let mut pieces: Vec<&mut [f32]> = left.chunks_mut(BLOCK * ROWS).collect();
        for_each_mut(&mut pieces, |piece, left| {
            dispatch(Residuals { matrix: self, first: piece * ROWS, b, x, left });
        });
        left
    }

    /// $b - A x$ in one row of blocks; `x` begins with the row `first`.
    #[inline(always)]
    fn residual<A: Arithmetic>(&self, row: usize, b: &[f32], x: &[f32], first: usize) -> [f32; BLOCK] {
        // A sum for each column of the blocks, for products wait for each other; the last one's rows stand a place further.
        let mut sums = [[0.0f32; 4]; BLOCK];
        let range = self.starts[row]..self.starts[row + 1];
        for (&column, block) in self.columns[range.clone()].iter().zip(&self.values[range]) {
            let x = &x[(column as usize - first) * BLOCK..][..BLOCK];
            for (j, from) in [0, BLOCK, 5].into_iter().enumerate() {
                for i in 0..4 {
                    sums[j][i] = A::multiply_add_single(block[from + i], x[j], sums[j][i]);
                }
            }
        }
        array_of(|i| b[row * BLOCK + i] - (sums[0][i] + sums[1][i] + sums[2][i + 1]))
    }

    /// $P^T A P$.
    fn coarsened(&self, transfer: &Transfer, coarse: usize) -> BlockMatrix {
        // One part a thread: neighbouring parts both go through the fine rows between them.
        let parts = threads();
        let part = |k: usize| coarse * k / parts..coarse * (k + 1) / parts;
        let rows = map_with(parts, 2, || (), |(), k| self.coarse_rows(transfer, part(k), coarse));
        let mut all = BlockMatrix { starts: vec![0], ..BlockMatrix::default() };
        for (node, mut row) in rows.into_iter().flatten().enumerate() {
            if row.is_empty() {
                // No fine node sees it.
                row.push((node as u32, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]));
            }
            for (column, block) in row {
                all.columns.push(column);
                all.values.push(block);
            }
            all.starts.push(all.columns.len());
        }
        all
    }

    /// Some rows of $P^T A P$, each a sum over fine rows in their order.
    fn coarse_rows(&self, transfer: &Transfer, some: Range<usize>, coarse: usize) -> Vec<Vec<(u32, Block)>> {
        let mut rows: Vec<Vec<(u32, Block)>> = vec![Vec::new(); some.len()];
        let mut place = vec![u32::MAX; coarse];
        let mut sums: Vec<(u32, Block)> = Vec::new();
        for row in 0..self.rows() {
            if !transfer.row(row).any(|(node, _)| some.contains(&node)) {
                continue;
            }
            sums.clear();
            for k in self.starts[row]..self.starts[row + 1] {
                for (node, weight) in transfer.row(self.columns[k] as usize) {
                    if place[node] == u32::MAX {
                        place[node] = sums.len() as u32;
                        sums.push((node as u32, [0.0; 9]));
                    }
                    let sum = &mut sums[place[node] as usize].1;
                    for (s, b) in sum.iter_mut().zip(&self.values[k]) {
                        *s += weight as f32 * b;
                    }
                }
            }
            for &(node, _) in &sums {
                place[node as usize] = u32::MAX;
            }
            for (node, weight) in transfer.row(row).filter(|(node, _)| some.contains(node)) {
                for (column, block) in &sums {
                    let row = &mut rows[node - some.start];
                    let at = match row.binary_search_by_key(column, |entry| entry.0) {
                        Ok(at) => at,
                        Err(at) => {
                            row.insert(at, (*column, [0.0; 9]));
                            at
                        }
                    };
                    for (s, b) in row[at].1.iter_mut().zip(block) {
                        *s += weight as f32 * b;
                    }
                }
            }
        }
        rows
    }

    /// Lower pattern and values.
    fn lower(&self) -> (Pattern, Vec<f64>) {
        let mut columns = vec![0];
        let (mut rows, mut values) = (Vec::new(), Vec::new());
        for node in 0..self.rows() {
            for j in 0..BLOCK {
                for k in self.starts[node]..self.starts[node + 1] {
                    let other = self.columns[k] as usize;
                    for i in 0..BLOCK {
                        if other * BLOCK + i >= node * BLOCK + j {
                            rows.push((other * BLOCK + i) as u32);
                            // The matrix is symmetric: its row is its column.
                            values.push(f64::from(self.values[k][i * BLOCK + j]));
                        }
                    }
                }
                columns.push(rows.len());
            }
        }
        (Pattern { columns, rows: std::sync::Arc::new(rows) }, values)
    }
}

/// Weights of the nodes of a regular grid at points of the unit cube: multilinear. `cells` along each axis.
fn multilinear(points: &[[f64; 3]], cells: [usize; 3]) -> Transfer {
    let mut transfer = Transfer { starts: vec![0], ..Transfer::default() };
    for at in points {
        let mut low = [0usize; 3];
        let mut part = [0.0; 3];
        for i in 0..3 {
            let x = at[i].clamp(0.0, 1.0) * cells[i] as f64;
            low[i] = (x as usize).min(cells[i] - 1);
            part[i] = x - low[i] as f64;
        }
        for corner in 0..8usize {
            let mut weight = 1.0;
            let mut node = 0;
            for i in (0..3).rev() {
                let up = (corner >> i) & 1;
                weight *= if up == 1 { part[i] } else { 1.0 - part[i] };
                node = node * (cells[i] + 1) + low[i] + up;
            }
            if weight > 1e-9 {
                transfer.nodes.push(node as u32);
                transfer.weights.push(weight);
            }
        }
        transfer.starts.push(transfer.nodes.len());
    }
    transfer
}

struct Level {
    matrix: BlockMatrix,
    /// Where the parts of its rows start, and the end.
    parts: Vec<usize>,
    inverse: Vec<Block>,
    transfer: Transfer,
    /// Nodes of the next level.
    coarse: usize,
    right: Vec<f32>,
    x: Vec<f32>,
}

/// Levels, finest first, and the factors of the coarsest.
pub(super) struct Multilevel {
    levels: Vec<Level>,
    coarsest: Direct,
    values: Vec<f64>,
}

impl Multilevel {
    /// Coarsens a matrix whose nodes stand at points of the unit cube, `cells` apart along each axis, until it can be
    /// factorised.
    pub(super) fn new(matrix: BlockMatrix, points: &[[f64; 3]], cells: [usize; 3]) -> Result<Self, LinearError> {
        let mut levels: Vec<Level> = Vec::new();
        let (mut matrix, mut points, mut cells) = (matrix, points.to_vec(), cells);
        while matrix.rows() > COARSEST && cells.iter().any(|&c| c > 1) {
            let coarser = cells.each(|c| c.div_ceil(2));
            let transfer = multilinear(&points, coarser);
            let counts = coarser.each(|c| c + 1);
            let coarse = matrix.coarsened(&transfer, counts.iter().product());
            let next = coarse.rows();
            points = list_of(counts.iter().product(), |node| {
                let index = [node % counts[0], node / counts[0] % counts[1], node / counts[0] / counts[1]];
                array_of(|i| index[i] as f64 / coarser[i] as f64)
            });
            cells = coarser;
            let inverse = list_of(matrix.rows(), |row| inverted(matrix.diagonal(row)));
            let n = matrix.rows() * BLOCK;
            let parts = matrix.parts();
            levels.push(Level { matrix, parts, inverse, transfer, coarse: next, right: vec![0.0; n], x: vec![0.0; n] });
            matrix = coarse;
        }
        let (pattern, values) = matrix.lower();
        let mut coarsest = Direct::of(&pattern, MatrixClass::Definite, None)?;
        coarsest.factorize(&LinearSystem::of(&values))?;
        Ok(Multilevel { levels, coarsest, values })
    }

    /// One cycle from zero; `b` becomes the answer.
    pub(super) fn cycle(&mut self, b: &mut [f64]) -> Result<(), LinearError> {
        let Multilevel { levels, coarsest, values } = self;
        let mut right: Vec<f32> = b.mapped(|&b| b as f32);
        for level in levels.iter_mut() {
            level.right.copy_from_slice(&right);
            level.x.fill(0.0);
            for _ in 0..SWEEPS {
                level.sweep(false);
            }
            right = vec![0.0; level.coarse * BLOCK];
            let left = level.matrix.residuals(&level.right, &level.x);
            for (row, left) in left.as_chunks::<BLOCK>().0.iter().enumerate() {
                for (node, weight) in level.transfer.row(row) {
                    for i in 0..BLOCK {
                        right[node * BLOCK + i] += weight as f32 * left[i];
                    }
                }
            }
        }
        let mut solved: Vec<f64> = right.mapped(|&r| f64::from(r));
        coarsest.solve(&LinearSystem::of(values), &mut solved, None)?;
        right.clear();
        right.extend(solved.iter().map(|&x| x as f32));
        for level in levels.iter_mut().rev() {
            for row in 0..level.matrix.rows() {
                for (node, weight) in level.transfer.row(row) {
                    for i in 0..BLOCK {
                        level.x[row * BLOCK + i] += weight as f32 * right[node * BLOCK + i];
                    }
                }
            }
            for _ in 0..SWEEPS {
                level.sweep(true);
            }
            right.clear();
            right.extend_from_slice(&level.x);
        }
        b.iter_mut().zip(&right).for_each(|(b, &x)| *b = f64::from(x));
        Ok(())
    }
}

impl Level {
    /// One sweep of Gauss and Seidel, over the even parts and then the odd ones, or the other way round.
    fn sweep(&mut self, backward: bool) {
        for colour in if backward { [1, 0] } else { [0, 1] } {
            let all: Vec<usize> = (colour..self.parts.len() - 1).step_by(2).collect();
            let relax = |part| dispatch(Relax { level: self, part, backward });
            let done = map_with(all.len(), 2, || (), |(), k| relax(all[k]));
            for (&part, x) in all.iter().zip(done) {
                self.x[BLOCK * self.parts[part]..][..x.len()].copy_from_slice(&x);
            }
        }
    }
}

/// Residuals of some rows.
struct Residuals<'a> {
    matrix: &'a BlockMatrix,
    first: usize,
    b: &'a [f32],
    x: &'a [f32],
    left: &'a mut [f32],
}

impl Task for Residuals<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        for (row, left) in (self.first..).zip(self.left.as_chunks_mut::<BLOCK>().0) {
            *left = self.matrix.residual::<A>(row, self.b, self.x, 0);
        }
    }
}

/// What a sweep makes of one part, which sees no further than the parts beside it.
struct Relax<'a> {
    level: &'a Level,
    part: usize,
    backward: bool,
}

impl Task for Relax<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn run<A: Arithmetic>(self) -> Vec<f32> {
        let Relax { level: Level { matrix, parts, inverse, right, x, .. }, part, backward } = self;
        let own = parts[part]..parts[part + 1];
        let first = parts[part.saturating_sub(1)];
        let end = parts[(part + 2).min(parts.len() - 1)];
        let mut seen = x[BLOCK * first..BLOCK * end].to_vec();
        for k in 0..own.len() {
            let row = if backward { own.end - 1 - k } else { own.start + k };
            let left = matrix.residual::<A>(row, right, &seen, first);
            let inverse = &inverse[row];
            for (i, x) in seen[(row - first) * BLOCK..][..BLOCK].iter_mut().enumerate() {
                *x += inverse[i] * left[0] + inverse[BLOCK + i] * left[1] + inverse[2 * BLOCK + i] * left[2];
            }
        }
        seen.truncate(BLOCK * (own.end - first));
        seen.drain(..BLOCK * (own.start - first));
        seen
    }
}

fn inverted(block: Option<&Block>) -> Block {
    let inverse = block.and_then(|b| inverse(&nalgebra::Matrix3::from_column_slice(b)));
    let inverse = inverse.filter(|m| m.iter().all(|x| x.is_finite())).unwrap_or_default();
    array_of(|k| inverse[(k % BLOCK, k / BLOCK)])
}
