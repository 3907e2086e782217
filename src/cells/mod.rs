//! Background cells: one partition hands out everything that must agree — Gauss points, smoothed
//! sub-cells, pressure zones, boundary facets and the edge points of weak constraint equations.
//!
//! [`Lattice`] has bricks between rows of particles; [`Triangulation`] and [`Voronoi`] serve scattered particles in
//! planar regions, [`Unstructured`] has the cells of a mesh.

mod boundary;
mod brick;
mod cut;
mod edges;
mod inertia;
mod lattice;
mod lattice_particles;
mod lattice_rules;
mod layout;
mod locator;
mod mesh;
mod nodal_polygons;
mod partition;
mod pieces;
mod polygons;
mod refined;
mod scatter;
mod smoothing;
mod triangulation;
mod unstructured;
mod voronoi;
mod walls;
mod zones;

pub use crate::neighbours::Connections;
pub(crate) use boundary::CORNER;
pub use boundary::{BoundaryCells, TraceChoice};
pub(crate) use brick::{area_vector, determinant, interpolated, lagrange, ravel, unravel};
pub use cut::CutLattice;
pub use lattice::Lattice;
pub use layout::Layout;
pub(crate) use locator::Locator;
pub(crate) use mesh::circumcentre;
pub use partition::Cells;
pub(crate) use partition::{EDGE, member, members};
pub use refined::Refined;
pub use scatter::Scatter;
pub use smoothing::Smoothing;
pub use triangulation::Triangulation;
pub use unstructured::Unstructured;
pub use voronoi::Voronoi;
pub use zones::{ZoneParticles, Zones};
