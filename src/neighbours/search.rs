//! Which cells of a body are connected within a box.

use crate::geometry::{Bounds, Point};

/// Cells of a body, which of them share faces, and which hold a point.
pub(crate) trait Adjacent<const D: usize>: Send + Sync {
    /// How many cells there are.
    fn count(&self) -> usize;

    /// Adds the cells that hold a point, the nearest ones where it lies a little outside of all.
    fn at(&self, x: &Point<D>, found: &mut Vec<u32>);

    /// Adds cells among which are all that hold a point, and maybe others: without a look into them, where that takes long. Whether these
    /// are the ones that hold it and no others.
    fn near(&self, x: &Point<D>, found: &mut Vec<u32>) -> bool {
        self.at(x, found);
        true
    }

    /// A box around a cell, in the coordinates of the boxes, where one is known.
    fn bounds(&self, _cell: u32) -> Option<&Bounds<D>> {
        None
    }

    /// The cells that hold a particle.
    fn around(&self, particle: u32) -> &[u32];

    /// Hands out the cells that share a face with a cell, and a box around the face.
    fn beside(&self, cell: u32, with: &mut dyn FnMut(u32, &Bounds<D>));

    /// A point in the coordinates of the boxes.
    fn in_boxes(&self, x: &Point<D>) -> Point<D> {
        *x
    }

    /// A margin along each axis in those coordinates.
    fn margin_of_boxes(&self, margin: &Point<D>) -> Point<D> {
        *margin
    }
}

/// Buffers of a search.
#[derive(Debug, Clone, Default)]
pub(crate) struct Search {
    open: Vec<(f64, u32)>,
    /// The last search that met each cell.
    met: Vec<u32>,
    number: u32,
    /// Cells looked at so far.
    #[cfg(test)]
    pub(crate) visits: usize,
}

impl Search {
    /// Whether one of some cells, around a point, is connected to the first ones through faces that meet a box.
    pub(crate) fn reaches<const D: usize>(
        &mut self,
        cells: &dyn Adjacent<D>,
        start: &[u32],
        (goal, to): (&[u32], &Point<D>),
        within: &Bounds<D>,
    ) -> bool {
        if start.iter().any(|cell| goal.contains(cell)) {
            return true;
        }
        self.met.resize(cells.count(), 0);
        self.number += 1;
        let Search { open, met, number, .. } = self;
        open.clear();
        for &cell in start {
            met[cell as usize] = *number;
            open.push((0.0, cell));
        }
        let mut found = false;
        while let Some((_, cell)) = open.pop() {
            #[cfg(test)]
            {
                self.visits += 1;
            }
            let first = open.len();
            cells.beside(cell, &mut |other, face| {
                if met[other as usize] != *number && face.meets(within) {
                    met[other as usize] = *number;
                    found |= goal.contains(&other);
                    open.push((face.distance(to), other));
                }
            });
            if found {
                return true;
            }
            // The one nearest to the goal is taken first: where nothing is in between that leads straight there.
            farthest_first(&mut open[first..]);
        }
        false
    }
}

fn farthest_first(cells: &mut [(f64, u32)]) {
    cells.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
}
