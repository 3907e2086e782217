//! Essential conditions: constraint equations, and the strategies that enforce them.

mod at_particles;
mod block;
mod constraints;
mod elimination;
mod enforced;
mod enforcement;
mod equation;
mod numbering;
mod over_boundary;
mod ownership;
mod prescribed_directions;
mod reduction;
mod row_values;

pub use constraints::Constraints;
pub(crate) use elimination::dependent;
pub use enforced::{Eliminated, Enforced};
pub(crate) use enforcement::Unaugmented;
pub use enforcement::{Enforcement, LagrangeMultipliers, MixedTransformation};
pub use equation::ConstraintEquation;
pub(crate) use equation::{check_component, check_unknowns};
pub(crate) use over_boundary::{FacetFunctions, Order, Sums, facet_order, rounding};
pub(crate) use ownership::{Claims, Owners};
pub(crate) use prescribed_directions::{PrescribedDirection, follows, is_redundant};
pub use reduction::Reduction;
pub(crate) use row_values::{Prescription, moved, scaled};
