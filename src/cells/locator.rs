//! Where to look for the cell that holds a point.

use std::sync::OnceLock;

use crate::each::list_of;
use crate::geometry::{Bounds, Point};
use crate::neighbours::BoxTree;

/// A tree of the boxes around cells, built when it is first used.
#[derive(Debug, Clone, Default)]
pub(crate) struct Locator<const D: usize>(OnceLock<BoxTree<D>>);

/// What is found with it follows from the cells.
impl<const D: usize> PartialEq for Locator<D> {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl<const D: usize> Locator<D> {
    /// Whether `holds(cell)` for any of the cells whose box, `around(cell)`, holds the point.
    pub(crate) fn any(
        &self,
        cells: usize,
        at: &Point<D>,
        around: impl Fn(usize) -> Bounds<D>,
        holds: impl FnMut(usize) -> bool,
    ) -> bool {
        self.0.get_or_init(|| BoxTree::new(list_of(cells, around))).any_at(at, holds)
    }
}
