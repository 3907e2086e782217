//! The model and its sparse system: terms over clusters, summed into one fixed pattern.

mod assembler;
mod elsewhere;
mod model;
mod pattern;
mod ranks;
mod slabs;
mod sum;

pub use assembler::Assembler;
#[cfg(feature = "solve")]
pub(crate) use model::release;
pub use model::{Model, System};
pub use pattern::Pattern;
#[cfg(feature = "solve")]
pub(crate) use pattern::add_column;
pub use ranks::Ranks;
