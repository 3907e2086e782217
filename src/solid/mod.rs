//! Solids enclosed by triangulated surfaces, with named boundary parts.
//!
//! [`Solid3`] is made of facets, of an STL file or of the surface of a mesh. It is closed, faces outwards, and tells inside from
//! outside everywhere; what can't be told is refused with the place.

mod closed;
mod contour;
mod crossing;
mod edges;
mod features;
mod flaws;
mod orient;
mod place;
mod program;
mod select;
mod shape;
mod stl;
mod surface;
mod tree;
mod walls;
mod weld;

pub use closed::{Closest, Solid3};
pub(crate) use edges::{by_edge, ends, half_edges};
pub use flaws::SurfaceFlaws;
pub use select::Select;
pub use shape::Shape;
pub(crate) use tree::{Tree, foot, solid_angle};
pub(crate) use walls::{OPPOSITE, Wall};
