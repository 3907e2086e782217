//! Errors of materials.

use thiserror::Error;

use super::Invalid;

/// What is wrong with a material.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MaterialError {
    /// A constant is NaN, infinite or out of its range.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// No constants were given.
    #[error("no material constants: give at least one term A_mn with m + n >= 1 (2.9)")]
    Empty,
}
