//! Bricks of a lattice, and the leaves that they make up where it is coarser.

use std::sync::Arc;

use crate::geometry::Point;

/// Bricks along each side of a macro cell of the finest level: two cells of two.
pub(super) const MACRO: usize = 4;
/// Distance within which a point counts as on a face between leaves.
const ON_FACE: f64 = 1e-3;

/// Bricks of unit size from the origin on. They belong to leaves of one, two, four … bricks along each side, whose places are multiples of
/// their sizes; in an even lattice each brick is a leaf.
#[derive(Debug, Clone, Default)]
pub(super) struct Grid {
    pub(super) counts: [usize; 3],
    /// How often the size of leaves doubles that of a brick in each macro cell of the finest level; empty where the lattice is even.
    doublings: Arc<[u8]>,
}

impl Grid {
    /// A lattice of one level.
    pub(super) fn even(counts: [usize; 3]) -> Self {
        Grid { counts, doublings: Arc::new([]) }
    }

    /// The same with leaves as they are given, by how often macro cells of the coarsest level are halved and their places in units of
    /// their own widths; `deepest` is the largest number of halvings.
    pub(super) fn with_leaves(self, deepest: u32, leaves: impl Iterator<Item = (u32, [i32; 3])>) -> Self {
        if deepest == 0 {
            return self;
        }
        let blocks = self.counts.map(|count| (count / MACRO) as i32);
        let mut doublings = vec![deepest as u8; blocks.iter().product::<i32>() as usize];
        for (level, place) in leaves {
            let width = 1 << (deepest - level);
            let [a, b, c] = place.map(|at| at * width);
            let inside = |k: i32, axis: usize| k..(k + width).min(blocks[axis]);
            for (k, j) in inside(c, 2).flat_map(|k| inside(b, 1).map(move |j| (k, j))) {
                for i in inside(a, 0) {
                    doublings[(i + blocks[0] * (j + blocks[1] * k)) as usize] = (deepest - level) as u8;
                }
            }
        }
        Grid { doublings: doublings.into(), ..self }
    }

    /// Whether all leaves are single bricks.
    pub(super) fn is_even(&self) -> bool {
        self.doublings.is_empty()
    }

    /// How often the size of a leaf doubles that of a brick.
    fn doublings(&self, at: [i32; 3]) -> u32 {
        if self.is_even() {
            return 0;
        }
        let block: [usize; 3] =
            std::array::from_fn(|i| (at[i].max(0) as usize / MACRO).min((self.counts[i] / MACRO).saturating_sub(1)));
        let [n, m, _] = self.counts.map(|count| count / MACRO);
        u32::from(self.doublings[block[0] + n * (block[1] + m * block[2])])
    }

    /// Bricks along each side of the leaf that a brick belongs to.
    pub(super) fn size(&self, at: [i32; 3]) -> i32 {
        1 << self.doublings(at)
    }

    /// The lowest brick of the leaf that a brick belongs to.
    pub(super) fn leaf(&self, at: [i32; 3]) -> [i32; 3] {
        let size = self.size(at);
        at.map(|at| at.div_euclid(size) * size)
    }

    /// The same by numbers of bricks.
    pub(super) fn leaf_of(&self, brick: u32) -> u32 {
        if self.is_even() { brick } else { self.brick(self.leaf(self.place(brick as usize))) as u32 }
    }

    /// The number of the block of so many leaves per direction that a brick belongs to.
    pub(super) fn block(&self, brick: u32, width: usize) -> usize {
        let at = self.place(brick as usize);
        let doublings = self.doublings(at);
        let [i, j, k] = at.map(|at| (at as usize / width) >> doublings);
        let [n, m, _] = self.counts.map(|count| count.div_ceil(width));
        i + n * (j + m * k) + doublings as usize * self.len()
    }

    /// The least and the largest size of the leaves that a cube around a point meets.
    fn sizes(&self, x: &Point<3>, half: f64) -> [i32; 2] {
        let size = |corner: i32| {
            let side = |i: usize| if (corner >> i) & 1 == 1 { half } else { -half };
            self.size(std::array::from_fn(|i| (x[i] + side(i)).floor() as i32))
        };
        let all = || (0..8).map(size);
        [all().min().unwrap_or(1), all().max().unwrap_or(1)]
    }

    /// The size of the smallest leaf that a point lies in or on, in bricks.
    pub(super) fn scale(&self, x: &Point<3>) -> f64 {
        if self.is_even() { 1.0 } else { f64::from(self.sizes(x, ON_FACE)[0]) }
    }

    /// The size of the largest leaf within half the spacing around a point: what lies on a face between two levels belongs to the
    /// coarser one.
    pub(super) fn widest(&self, x: &Point<3>) -> f64 {
        if self.is_even() { 1.0 } else { f64::from(self.sizes(x, self.scale(x))[1]) }
    }

    /// Whether a place is a corner of cells, which are two leaves wide.
    pub(super) fn is_corner(&self, at: [i32; 3]) -> bool {
        self.is_even()
            || (0..8).any(|k| {
                let beside: [i32; 3] = std::array::from_fn(|i| at[i] - ((k >> i) & 1));
                let inside = (0..3).all(|i| (0..self.counts[i] as i32).contains(&beside[i]));
                inside && at.iter().all(|at| at % (2 * self.size(beside)) == 0)
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
        let [n, m, _] = self.counts.map(|count| count + 1);
        [(node % n) as i32, (node / n % m) as i32, (node / n / m) as i32]
    }

    /// Number of corners between bricks.
    pub(super) fn nodes(&self) -> usize {
        self.counts.iter().map(|count| count + 1).product()
    }
}
