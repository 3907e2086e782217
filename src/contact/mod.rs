//! Contact: rigid surfaces, and the law of touching as terms with pressures of their own.
//!
//! Nothing is tuned: pressures are iterates of Newton's method, and where they come to rest gaps are closed to rounding.

mod bins;
mod chain;
mod chains;
mod contact_surface;
mod counted;
mod face_table;
mod faces;
mod facets;
mod facing;
mod friction;
mod interference;
mod jet;
mod law;
mod mortar;
mod neutral;
mod obstacle;
mod overlap;
mod pair;
mod pair_term;
mod profile;
mod rigid;
mod rigid_dof;
mod shapes;
mod surface;
mod triangulated;
mod turning;
mod vertices;

pub use crate::error::ContactError;
pub use profile::Profile;
pub use rigid::RigidSurface;
pub use shapes::{Ball, Cone, Cylinder, Plane};
pub use surface::{Nearest, Surface};
pub use triangulated::Triangulated;

pub(crate) use chains::chains;
pub(crate) use contact_surface::{ContactSurface, Trace};
pub(crate) use interference::{Interference, validate};
pub(crate) use law::{ContactLaw, Stiffness};
pub(crate) use neutral::RollingSpring;
pub(crate) use obstacle::RigidContact;
pub(crate) use pair::PairContact;
pub(crate) use rigid::{Drive, Obstacle};
pub(crate) use rigid_dof::{ArtificialSpring, RigidBodyDof};
