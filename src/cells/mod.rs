//! Background cells: one partition hands out everything that must agree — Gauss points, smoothed
//! sub-cells, pressure zones, boundary facets and the edge points of weak rows.

mod lattice;
mod partition;
mod smoothing;

pub use lattice::{Lattice, Layout, Zones};
pub(crate) use lattice::{determinant, ravel, unravel};
pub use partition::Cells;
pub use smoothing::{BoundaryCells, Smoothing};
