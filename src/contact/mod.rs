//! Contact: rigid surfaces, and the law of touching as terms with pressures of their own.
//!
//! Nothing is tuned: pressures are iterates of Newton's method, and where they come to rest gaps are closed to rounding.

mod obstacle;
mod pair;
mod profile;
mod rigid;
mod shapes;
mod skin;
mod surface;

pub use crate::error::ContactError;
pub use profile::Profile;
pub(crate) use rigid::Drive;
pub use rigid::RigidSurface;
pub use shapes::{Ball, Cone, Cylinder, Plane};
pub use surface::{Nearest, Surface};

pub(crate) use obstacle::{Carriage, Leash, RigidContact, Stiffness};
pub(crate) use pair::{Chain, PairContact};
pub(crate) use skin::Skin;
