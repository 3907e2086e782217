//! Where to look for the cell that holds a point.

use std::sync::OnceLock;

use crate::geometry::Point;

use super::brick::{ravel, unravel};

/// Cells per direction in a block of the finest level, which are looked at one by one.
pub(super) const FINEST: usize = 4;

/// Boxes around blocks of a lattice's cells, coarser and coarser ones, made when they are first requested.
#[derive(Clone, Default)]
pub(crate) struct Locator<const D: usize>(OnceLock<Vec<Level<D>>>);

/// What is found with it follows from the lattice.
impl<const D: usize> PartialEq for Locator<D> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl<const D: usize> std::fmt::Debug for Locator<D> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Locator")
    }
}

/// Blocks of cells, the finest first, two of a level per direction in one of the next.
#[derive(Clone)]
struct Level<const D: usize> {
    counts: [usize; D],
    boxes: Vec<[Point<D>; 2]>,
}

impl<const D: usize> Level<D> {
    /// Blocks of `parts` per direction of what has `counts` and boxes.
    fn over(counts: &[usize; D], parts: usize, of: impl Fn(usize) -> [Point<D>; 2]) -> Self {
        let blocks = counts.map(|c| c.div_ceil(parts));
        let nothing: [Point<D>; 2] = [Point::repeat(f64::INFINITY), Point::repeat(f64::NEG_INFINITY)];
        let mut boxes = vec![nothing; blocks.iter().product()];
        for part in 0..counts.iter().product() {
            let [low, high] = of(part);
            let block = &mut boxes[ravel(&unravel(part, counts).map(|i| i / parts), &blocks)];
            *block = [block[0].inf(&low), block[1].sup(&high)];
        }
        Level { counts: blocks, boxes }
    }
}

impl<const D: usize> Locator<D> {
    /// Whether `holds(cell)` for any of the cells whose box, `of(cell)`, holds the point.
    pub(crate) fn any(
        &self,
        counts: &[usize; D],
        at: &Point<D>,
        of: impl Fn(usize) -> [Point<D>; 2],
        holds: impl Fn(usize) -> bool,
    ) -> bool {
        let levels = self.0.get_or_init(|| {
            let mut levels = vec![Level::over(counts, FINEST, of)];
            while let Some(last) = levels.last().filter(|last| last.boxes.len() > 1) {
                levels.push(Level::over(&last.counts, 2, |block| last.boxes[block]));
            }
            levels
        });
        let mut open = vec![(levels.len() - 1, 0)];
        while let Some((level, block)) = open.pop() {
            let Level { counts: blocks, boxes } = &levels[level];
            let [low, high] = boxes[block];
            if (0..D).any(|i| at[i] < low[i] || at[i] > high[i]) {
                continue;
            }
            let (parts, finer) = if level == 0 { (FINEST, counts) } else { (2, &levels[level - 1].counts) };
            let first = unravel(block, blocks).map(|i| i * parts);
            let shape: [usize; D] = std::array::from_fn(|i| parts.min(finer[i] - first[i]));
            for inner in 0..shape.iter().product() {
                let offset = unravel(inner, &shape);
                let part = ravel(&std::array::from_fn(|i| first[i] + offset[i]), finer);
                if level > 0 {
                    open.push((level - 1, part));
                } else if holds(part) {
                    return true;
                }
            }
        }
        false
    }
}
