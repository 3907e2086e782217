//! The model and its sparse system: terms over clusters, summed into one fixed pattern.

mod assembler;
mod fault;
mod layout;
mod measures;
mod model;
mod model_at;
mod pattern;
mod ranks;
mod slabs;
mod state_ref;
mod sum;
mod system;

pub use assembler::Assembler;
pub(crate) use fault::fault;
pub use model::Model;
pub(crate) use model::misnumbered;
pub use model_at::ModelAt;
pub use pattern::Pattern;
pub(crate) use pattern::add_column;
pub use ranks::Ranks;
pub use state_ref::{Origin, StateRef};
pub use system::System;
pub(crate) use system::release;
