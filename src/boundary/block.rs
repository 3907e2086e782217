//! Unknowns that others express, in dense blocks bound to a pattern.

use crate::assembly::Pattern;
use crate::each::{EachOf, IntoEach, add};
use crate::simd::{Arithmetic, Task, dispatch};

use super::enforced::Eliminated;
use super::numbering::Numbering;

/// Unknowns that are expressed by others, with what of the matrix is theirs.
#[derive(Default)]
pub(super) struct Block {
    pub unknowns: Vec<usize>,
    /// The places of what they are expressed by.
    pub free: Vec<u32>,
    pub transfer: Vec<f64>,
    pub equations: Vec<usize>,
    pub offsets: Vec<f64>,
    /// The places that are coupled with the rows, `free` among them: rising until they are renumbered.
    pub coupled: Vec<u32>,
    /// The place in the reduced values of each pair of `free` and `coupled`.
    places: Vec<u32>,
    /// Entries of the matrix of the model in the rows: entry, row of the block, and the other unknown, which no block expresses.
    pub beside: Vec<[u32; 3]>,
    /// The same where a block expresses the other unknown; two rows of blocks have an entry in both.
    pub between: Vec<[u32; 3]>,
    /// Their values in the matrix that was reduced last.
    values: Vec<f64>,
}

impl Block {
    pub(super) fn new(eliminated: Eliminated, places: &[u32]) -> Self {
        let Eliminated { unknowns, free, transfer, equations, offsets } = eliminated;
        let free: Vec<u32> = free.into_mapped(|unknown| places[unknown]);
        Block { unknowns, coupled: free.clone(), free, transfer, equations, offsets, ..Block::default() }
    }

    /// Takes note of an entry beside an unknown at a place.
    pub(super) fn touch(&mut self, entry: [u32; 3], place: u32) {
        self.beside.push(entry);
        self.coupled.push(place);
    }

    /// The pairs of `free` and `coupled` as lower entries of the reduced matrix.
    pub(super) fn pairs(&self) -> impl Iterator<Item = [usize; 2]> {
        let all = self.free.iter().flat_map(|&a| self.coupled.iter().map(move |&b| [a.max(b), a.min(b)]));
        all.map(|pair| pair.each(|place| place as usize))
    }

    /// Finds the pairs of `free` and `coupled`, which are in the reduced pattern.
    pub(super) fn find(&mut self, reduced: &Pattern) {
        self.places = self.pairs().map(|[row, column]| reduced.find(row, column).unwrap_or(0) as u32).collect();
        self.beside.shrink_to_fit();
    }

    /// Gives all places their new numbers, and those of the values theirs.
    pub(super) fn renumber(&mut self, new: &[u32], values: &[u32]) {
        self.places.iter_mut().for_each(|place| *place = values[*place as usize]);
        self.free.iter_mut().chain(&mut self.coupled).for_each(|place| *place = new[*place as usize]);
    }

    /// The row of $W$ of an unknown, by place.
    pub(super) fn row(&self, unknown: usize) -> impl Iterator<Item = (usize, f64)> {
        let n = self.free.len();
        let row = &self.transfer[unknown * n..(unknown + 1) * n];
        self.free.iter().zip(row).map(|(&free, &w)| (free as usize, w))
    }

    /// $V\\,\text{violation}$.
    pub(super) fn offset(&self, violation: &[f64]) -> impl Iterator<Item = (usize, f64)> {
        let m = self.equations.len();
        self.unknowns.iter().enumerate().map(move |(p, &unknown)| {
            let row = self.equations.iter().zip(&self.offsets[p * m..(p + 1) * m]);
            (unknown, row.map(|(&equation, v)| v * violation[equation]).sum())
        })
    }

    /// The entries with the values that they had in the matrix that was reduced last.
    fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let all = self.beside.iter().chain(&self.between).zip(&self.values);
        all.map(|(&[_, row, other], &value)| (row as usize, other as usize, value))
    }

    /// Adds the product with the entries: all of $K v$ in the rows, and all of it elsewhere where $v$ is zero but in the rows of blocks.
    pub(super) fn multiply_add(&self, v: &[f64], product: &mut [f64]) {
        for (k, (row, other, value)) in self.entries().enumerate() {
            let own = self.unknowns[row];
            product[own] += value * v[other];
            if k < self.beside.len() {
                product[other] += value * v[own];
            }
        }
    }

    /// Keeps the values of its entries.
    pub(super) fn keep(&mut self, full: &[f64]) {
        let Block { values, beside, between, .. } = self;
        values.clear();
        values.extend(beside.iter().chain(between.iter()).map(|&[entry, ..]| full[entry as usize]));
    }

    /// Adds its part of $W^T Y + Y^T W$ with $Y = K_{pf} + \tfrac12 K_{pp} W$ to the reduced values. `columns` has room for
    /// the columns of $Y$ by place.
    pub(super) fn add(&self, values: &mut [f64], numbering: &Numbering, blocks: &[Block], columns: &mut [u32]) {
        let (n, width) = (self.free.len(), self.coupled.len());
        self.coupled.iter().enumerate().for_each(|(k, &place)| columns[place as usize] = k as u32);
        let mut y = vec![0.0; self.unknowns.len() * width];
        for (row, other, value) in self.entries() {
            let y = &mut y[row * width..(row + 1) * width];
            match numbering.rows[other] {
                None => y[columns[numbering.places[other] as usize] as usize] += value,
                Some([block, of]) => {
                    let half = 0.5 * value;
                    for (place, w) in blocks[block as usize].row(of as usize) {
                        y[columns[place] as usize] += half * w;
                    }
                }
            }
        }
        let mut block = vec![0.0; n * width];
        dispatch(Product { w: &self.transfer, n, y: &y, width, block: &mut block });
        for (s, (sums, places)) in
            block.chunks_exact(width.max(1)).zip(self.places.chunks_exact(width.max(1))).enumerate()
        {
            for ((sum, &place), &coupled) in sums.iter().zip(places).zip(&self.coupled) {
                let twice = if self.free[s] == coupled { 2.0 } else { 1.0 };
                values[place as usize] += twice * sum;
            }
        }
    }
}

/// The lower columns of the pattern between places, as far as it comes from that of the model; blocks are told what their rows are
/// coupled with.
pub(super) fn columns(numbering: &Numbering, pattern: &Pattern, blocks: &mut [Block]) -> Vec<Vec<u32>> {
    let mut columns: Vec<Vec<u32>> = vec![Vec::new(); numbering.numbers.len()];
    let Numbering { rows, places, .. } = numbering;
    // Blocks whose rows are coupled with each other.
    let mut partners: Vec<(usize, usize)> = Vec::new();
    for column in 0..pattern.size() {
        if rows[column].is_none() {
            columns[places[column] as usize].reserve(pattern.column(column).len());
        }
        for (entry, row) in (pattern.columns[column] as u32..).zip(pattern.column(column)) {
            let row = *row as usize;
            match (rows[row], rows[column]) {
                (None, None) => columns[places[column] as usize].push(places[row]),
                (Some(own), None) => blocks[own[0] as usize].touch([entry, own[1], column as u32], places[column]),
                (None, Some(own)) => blocks[own[0] as usize].touch([entry, own[1], row as u32], places[row]),
                (Some([a, p]), Some([b, q])) => {
                    blocks[a as usize].between.push([entry, p, column as u32]);
                    if row != column {
                        blocks[b as usize].between.push([entry, q, row as u32]);
                    }
                    if a != b {
                        partners.push((a.min(b) as usize, a.max(b) as usize));
                    }
                }
            }
        }
    }
    partners.sort_unstable();
    partners.dedup();
    for (a, b) in partners {
        let [of_a, of_b] = [a, b].map(|block| blocks[block].free.clone());
        blocks[a].coupled.extend(of_b);
        blocks[b].coupled.extend(of_a);
    }
    for block in blocks {
        block.coupled.sort_unstable();
        block.coupled.dedup();
        block.coupled.shrink_to_fit();
        block.between.shrink_to_fit();
        for [row, column] in block.pairs() {
            columns[column].push(row as u32);
        }
    }
    columns
}

/// Rows and columns whose sums fill the registers.
const TILE: [usize; 2] = [4, 16];

/// Adds $W^T Y$, for $W$ of `n` and $Y$ of `width` columns, by rows.
struct Product<'a> {
    w: &'a [f64],
    n: usize,
    y: &'a [f64],
    width: usize,
    block: &'a mut [f64],
}

impl Task for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let Product { w, n, y, width, block } = self;
        for column in (0..width).step_by(TILE[1]) {
            let across = TILE[1].min(width - column);
            for row in (0..n).step_by(TILE[0]) {
                let down = TILE[0].min(n - row);
                let mut sums = [[0.0; TILE[1]]; TILE[0]];
                for (w, y) in w.chunks_exact(n).zip(y.chunks_exact(width)) {
                    let (mut factors, mut numbers) = ([0.0; TILE[0]], [0.0; TILE[1]]);
                    if [down, across] == TILE {
                        factors.copy_from_slice(&w[row..row + TILE[0]]);
                        numbers.copy_from_slice(&y[column..column + TILE[1]]);
                    } else {
                        factors[..down].copy_from_slice(&w[row..row + down]);
                        numbers[..across].copy_from_slice(&y[column..column + across]);
                    }
                    for (sums, factor) in sums.iter_mut().zip(factors) {
                        for (sum, number) in sums.iter_mut().zip(numbers) {
                            *sum = A::multiply_add(factor, number, *sum);
                        }
                    }
                }
                for (k, sums) in sums[..down].iter().enumerate() {
                    let target = &mut block[(row + k) * width + column..][..across];
                    add(target, 1.0, sums);
                }
            }
        }
    }
}
