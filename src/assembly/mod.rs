//! The model and its sparse system: terms over clusters, summed into one fixed pattern.

mod model;
mod pattern;

#[cfg(feature = "solve")]
pub(crate) use model::release;
pub use model::{Assembler, Model, System};
pub use pattern::Pattern;
