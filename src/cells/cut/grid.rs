//! Bricks of a lattice, and the leaves that they make up where it is coarser.

use std::sync::Arc;

use crate::each::{EachOf, array_of};
use crate::geometry::{Vec3, places};

/// Bricks along each side of a macro cell of the finest level: two cells of two.
pub(super) const MACRO: usize = 4;
/// Distance within which a point counts as on a face between leaves.
const ON_FACE: f64 = 1e-3;

/// Bricks of unit size from the origin on. They belong to leaves of one, two, four … bricks along each side, whose places are multiples of
/// their sizes; in an even lattice each brick is a leaf. Leaves are half as wide as the spacing of particles around them, and a quarter in
/// cells that touch finer ones: particles on the faces between have functions that leaves as coarse as the cell would not see.
#[derive(Debug, Clone, Default)]
pub(super) struct Grid {
    pub(super) counts: [usize; 3],
    /// How the spacing in each macro cell of the finest level is to the finest one; empty where the lattice is even.
    blocks: Arc<[Block]>,
}

/// The spacing and the leaves in a macro cell of the finest level.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Block {
    /// How often the spacing doubles the finest one.
    doublings: u8,
    /// How often the size of leaves doubles that of a brick.
    of_leaves: u8,
}

impl Grid {
    /// A lattice of one level.
    pub(super) fn even(counts: [usize; 3]) -> Self {
        Grid { counts, blocks: Arc::new([]) }
    }

    /// The same with macro cells as they are given, by how often those of the coarsest level are halved and their places in units of
    /// their own widths; `deepest` is the largest number of halvings.
    pub(super) fn with_macros(self, deepest: u32, macros: impl Iterator<Item = (u32, [i32; 3])>) -> Self {
        if deepest == 0 {
            return self;
        }
        let counts = self.counts.each(|count| (count / MACRO) as i32);
        let number = |[i, j, k]: [i32; 3]| (i + counts[0] * (j + counts[1] * k)) as usize;
        let mut doublings = vec![deepest as u8; counts.iter().product::<i32>() as usize];
        for (level, place) in macros {
            let width = 1 << (deepest - level);
            let low = place.each(|at| at * width);
            within(low, low.each(|at| at + width), counts)
                .for_each(|at| doublings[number(at)] = (deepest - level) as u8);
        }
        let mut of_leaves = doublings.clone();
        for at in within([0; 3], counts, counts) {
            let own = doublings[number(at)];
            // Cells are four leaves of half the spacing wide, as a macro cell of the finest level is.
            let width = if own > 0 { 1 << (own - 1) } else { continue };
            if at.iter().any(|at| at % width != 0) {
                continue;
            }
            let beyond = at.each(|at| at + width + 1);
            if within(at.each(|at| at - 1), beyond, counts).any(|beside| doublings[number(beside)] < own) {
                within(at, at.each(|at| at + width), counts).for_each(|inside| of_leaves[number(inside)] = own - 1);
            }
        }
        let blocks = doublings.into_iter().zip(of_leaves).map(|(doublings, of_leaves)| Block { doublings, of_leaves });
        Grid { blocks: blocks.collect(), ..self }
    }

    /// Whether all leaves are single bricks.
    pub(super) fn is_even(&self) -> bool {
        self.blocks.is_empty()
    }

    fn block_at(&self, at: [i32; 3]) -> Block {
        if self.is_even() {
            return Block { doublings: 0, of_leaves: 0 };
        }
        let block: [usize; 3] =
            array_of(|i| (at[i].max(0) as usize / MACRO).min((self.counts[i] / MACRO).saturating_sub(1)));
        let [n, m, _] = self.counts.each(|count| count / MACRO);
        self.blocks[block[0] + n * (block[1] + m * block[2])]
    }

    /// Half the spacing of particles around a brick.
    pub(super) fn half_spacing(&self, at: [i32; 3]) -> i32 {
        1 << self.block_at(at).doublings
    }

    /// Bricks along each side of the leaf that a brick belongs to.
    pub(super) fn size(&self, at: [i32; 3]) -> i32 {
        1 << self.block_at(at).of_leaves
    }

    /// The lowest brick of the leaf that a brick belongs to.
    pub(super) fn leaf(&self, at: [i32; 3]) -> [i32; 3] {
        let size = self.size(at);
        at.each(|at| at.div_euclid(size) * size)
    }

    /// The same by numbers of bricks.
    pub(super) fn leaf_of(&self, brick: u32) -> u32 {
        if self.is_even() { brick } else { self.brick(self.leaf(self.place(brick as usize))) as u32 }
    }

    /// The number of the block of so many half spacings per direction that a brick belongs to.
    pub(super) fn block(&self, brick: u32, width: usize) -> usize {
        let at = self.place(brick as usize);
        let doublings = self.block_at(at).doublings;
        let [i, j, k] = at.each(|at| (at as usize / width) >> doublings);
        let [n, m, _] = self.counts.each(|count| count.div_ceil(width));
        i + n * (j + m * k) + doublings as usize * self.len()
    }

    /// The bricks in which the corners of a cube around a point lie.
    fn at_corners(x: &Vec3, half: f64) -> impl Iterator<Item = [i32; 3]> {
        (0..8).map(move |corner: i32| {
            let side = |i: usize| if (corner >> i) & 1 == 1 { half } else { -half };
            array_of(|i| (x[i] + side(i)).floor() as i32)
        })
    }

    /// Half the spacing at a point: the smaller one on a face between two levels.
    pub(super) fn scale(&self, x: &Vec3) -> f64 {
        let least = || Self::at_corners(x, ON_FACE).map(|at| self.half_spacing(at)).min().unwrap_or(1);
        if self.is_even() { 1.0 } else { f64::from(least()) }
    }

    /// The leaves that have bricks in a box.
    pub(super) fn leaves_in(&self, low: &Vec3, high: &Vec3) -> impl Iterator<Item = [i32; 3]> {
        let [low, high]: [[i32; 3]; 2] =
            [low, high].each(|end| array_of(|i| (end[i].floor() as i32).clamp(0, self.counts[i] as i32 - 1)));
        // Each at its first brick among these.
        places(low, high).filter_map(move |place| {
            let leaf = self.leaf(place);
            let first: [i32; 3] = array_of(|i| leaf[i].max(low[i]));
            (first == place).then_some(leaf)
        })
    }

    /// The size of the smallest leaf that a point lies in or on.
    pub(super) fn leaf_scale(&self, x: &Vec3) -> f64 {
        let least = || Self::at_corners(x, ON_FACE).map(|at| self.size(at)).min().unwrap_or(1);
        if self.is_even() { 1.0 } else { f64::from(least()) }
    }

    /// The largest of half the spacings that a cube of one spacing around a point meets where a leaf counts: what lies on a face between two
    /// levels belongs to the coarser one.
    pub(super) fn widest(&self, x: &Vec3, counts: impl Fn([i32; 3]) -> bool) -> f64 {
        if self.is_even() {
            return 1.0;
        }
        let scale = self.scale(x);
        let inside = |at: &[i32; 3]| (0..3).all(|i| (0..self.counts[i] as i32).contains(&at[i]));
        let met = Self::at_corners(x, scale).filter(|at| inside(at) && counts(self.leaf(*at)));
        met.map(|at| f64::from(self.half_spacing(at))).fold(scale, f64::max)
    }

    /// Whether a place is a corner of cells, which are one spacing wide.
    pub(super) fn is_corner(&self, at: [i32; 3]) -> bool {
        self.is_even()
            || (0..8).any(|k| {
                let beside: [i32; 3] = array_of(|i| at[i] - ((k >> i) & 1));
                let inside = (0..3).all(|i| (0..self.counts[i] as i32).contains(&beside[i]));
                inside && at.iter().all(|at| at % (2 * self.half_spacing(beside)) == 0)
            })
    }

    /// Number of bricks.
    pub(super) fn len(&self) -> usize {
        self.counts.iter().product()
    }

    /// The number of a brick.
    pub(super) fn brick(&self, at: [i32; 3]) -> usize {
        at[0] as usize + self.counts[0] * (at[1] as usize + self.counts[1] * at[2] as usize)
    }

    /// The place of a brick.
    pub(super) fn place(&self, brick: usize) -> [i32; 3] {
        let [n, m, _] = self.counts;
        [(brick % n) as i32, (brick / n % m) as i32, (brick / n / m) as i32]
    }

    /// The number of a corner between bricks.
    pub(super) fn node(&self, at: [i32; 3]) -> usize {
        let [n, m, _] = self.counts;
        at[0] as usize + (n + 1) * (at[1] as usize + (m + 1) * at[2] as usize)
    }

    /// The place of a corner between bricks.
    pub(super) fn node_place(&self, node: usize) -> [i32; 3] {
        let [n, m, _] = self.counts.each(|count| count + 1);
        [(node % n) as i32, (node / n % m) as i32, (node / n / m) as i32]
    }

    /// Number of corners between bricks.
    pub(super) fn nodes(&self) -> usize {
        self.counts.iter().map(|count| count + 1).product()
    }
}

/// The places of a box, its end left out, that lie within counts.
fn within(low: [i32; 3], end: [i32; 3], counts: [i32; 3]) -> impl Iterator<Item = [i32; 3]> {
    places(low.each(|at| at.max(0)), array_of(|i| end[i].min(counts[i]) - 1))
}
