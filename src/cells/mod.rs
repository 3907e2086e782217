//! Background cells: one partition hands out everything that must agree — Gauss points, smoothed
//! sub-cells, pressure zones, boundary facets and the edge points of weak rows.
//!
//! [`Lattice`] has bricks between rows of particles; [`Triangulation`] and [`Voronoi`] serve scattered particles in
//! drawn regions.

mod edges;
mod lattice;
mod mesh;
mod partition;
mod polygons;
mod refined;
mod scatter;
mod smoothing;
mod triangulation;
mod voronoi;
mod zones;

pub use lattice::{Lattice, Layout, Zones};
pub(crate) use lattice::{determinant, ravel, unravel};
pub use partition::Cells;
pub use refined::Refined;
pub use scatter::Scatter;
pub use smoothing::{BoundaryCells, Smoothing};
pub use triangulation::Triangulation;
pub use voronoi::Voronoi;
