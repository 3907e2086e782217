//! Cells of a body and which of them share faces.

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
