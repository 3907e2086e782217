//! The model and its sparse system: terms over clusters, summed into one fixed pattern.

mod assembler;
mod layout;
mod measures;
mod model;
mod pattern;
mod ranks;
mod remote;
mod slabs;
mod sum;
mod system;

pub use assembler::Assembler;
pub use model::Model;
pub use pattern::Pattern;
#[cfg(feature = "solve")]
pub(crate) use pattern::add_column;
pub use ranks::Ranks;
pub use system::System;
#[cfg(feature = "solve")]
pub(crate) use system::release;
