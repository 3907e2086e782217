//! Where to look for the cell that holds a point.

use std::sync::OnceLock;

use crate::geometry::Point;

use super::Lattice;
use super::brick::{determinant, ravel, unravel};

/// Cells per direction in a block of the finest level, which are looked at one by one.
const FINEST: usize = 4;

/// How far outside a cell a point may lie, as a part of the cell.
const SLACK: f64 = 0.1;

/// Boxes around blocks of a lattice's cells, coarser and coarser ones, made when they are first asked for.
#[derive(Clone, Default)]
pub(super) struct Locator<const D: usize>(OnceLock<Vec<Level<D>>>);

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
    pub(super) fn any(
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

impl<const D: usize> Lattice<D> {
    /// Whether a point lies in the body, up to a tenth of a cell.
    pub fn contains(&self, at: &Point<D>) -> bool {
        if !at.iter().all(|x| x.is_finite()) {
            return false;
        }
        let holds = |cell| self.holds(cell, at);
        self.locator.any(&self.cell_counts(), at, |cell| self.around(cell), holds)
    }

    /// The box of a cell and its margin.
    fn around(&self, cell: usize) -> [Point<D>; 2] {
        let shape = self.shape(cell);
        let nodes = shape.nodes();
        let low = nodes.iter().fold(Point::<D>::repeat(f64::INFINITY), |low, x| low.zip_map(x, f64::min));
        let high = nodes.iter().fold(Point::<D>::repeat(f64::NEG_INFINITY), |high, x| high.zip_map(x, f64::max));
        let margin = (high - low) * SLACK;
        [low - margin, high + margin]
    }

    /// Whether a cell holds a point.
    fn holds(&self, cell: usize, at: &Point<D>) -> bool {
        let [low, high] = self.around(cell);
        if (0..D).any(|i| at[i] < low[i] || at[i] > high[i]) {
            return false;
        }
        // Newton on the cell's map, by Cramer's rule; a few steps from the middle.
        let shape = self.shape(cell);
        let mut local = Point::<D>::repeat(0.5);
        for _ in 0..20 {
            let (x, columns) = shape.map(&local);
            let total = determinant(&columns);
            let step = Point::<D>::from_fn(|i, _| {
                let mut replaced = columns;
                replaced[i] = at - x;
                determinant(&replaced) / total
            });
            local += step;
            if step.norm() < 1e-12 {
                break;
            }
        }
        local.iter().all(|t| *t >= -SLACK && *t <= 1.0 + SLACK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::Layout;
    use crate::geometry::{Block, Mapped};

    /// The cells that hold a point, each of the lattice asked.
    fn holders<const D: usize>(lattice: &Lattice<D>, at: &Point<D>) -> usize {
        (0..lattice.cell_count()).filter(|&cell| lattice.holds(cell, at)).count()
    }

    #[test]
    fn a_lattice_holds_what_one_of_its_cells_holds() {
        let mut random = fastrand::Rng::with_seed(4);
        let ring = Mapped(|unit: &Point<2>| {
            let (radius, angle) = (1.0 + unit[0], 4.0 * unit[1]);
            Point::<2>::new(radius * angle.cos(), radius * angle.sin())
        });
        let ring = Lattice::new(&ring, [6, 23], &Layout::Jittered { amount: 0.3, seed: 1 }).unwrap();
        let block = Block::new([0.0; 3], [1.0, 2.0, 1.0]).lattice([6, 10, 5]).unwrap();
        let (mut inside, mut outside) = (0, 0);
        for _ in 0..400 {
            let at = Point::<2>::from_fn(|_, _| 5.0 * random.f64() - 2.5);
            let held = ring.contains(&at);
            assert_eq!(held, holders(&ring, &at) > 0, "{at:?}");
            let at = Point::<3>::from_fn(|_, _| 2.5 * random.f64() - 0.25);
            assert_eq!(block.contains(&at), holders(&block, &at) > 0, "{at:?}");
            inside += usize::from(held);
            outside += usize::from(!held);
        }
        assert!(inside > 50 && outside > 50);
        assert_eq!(ring.clone(), ring);
    }

    #[test]
    fn few_cells_are_looked_at_however_many_there_are() {
        let lattice = Block::new([0.0, 0.0], [1.0, 1.0]).lattice([301, 301]).unwrap();
        let around = |cell: usize| {
            let corners = lattice.corners(cell);
            [corners[0], corners[3]]
        };
        for k in 0..200 {
            let at = Point::<2>::new(0.99, f64::from(k) / 200.0);
            let looked_at = std::cell::Cell::new(0);
            let none = |_| {
                looked_at.set(looked_at.get() + 1);
                false
            };
            assert!(!lattice.locator.any(&lattice.cell_counts(), &at, around, none));
            // A point on an edge or a corner of blocks lies in two or four of them.
            assert!((1..=4 * FINEST * FINEST).contains(&looked_at.get()), "{} at {at:?}", looked_at.get());
            assert!(lattice.contains(&at));
        }
    }
}
