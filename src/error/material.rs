//! Errors of materials.

use thiserror::Error;

/// What is wrong with a material.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MaterialError {
    /// A constant is out of its range.
    #[error("material constant {name} = {value:e}: {needed}")]
    Constant {
        /// The constant's name.
        name: String,
        /// The value given.
        value: f64,
        /// What would be accepted.
        needed: &'static str,
    },
    /// No constants were given.
    #[error("no material constants: give at least one term A_mn with m + n >= 1 (2.9)")]
    Empty,
}
