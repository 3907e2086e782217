//! Constants of laws, refused where they can't be meant.

use std::fmt::Display;

use crate::error::{Invalid, MaterialError};

/// Refuses a constant unless it is as needed.
pub(super) fn check(name: impl Display, value: f64, holds: bool, needed: &'static str) -> Result<(), MaterialError> {
    ensure!(holds, Invalid::new(format!("material constant {name}"), value, needed));
    Ok(())
}

pub(super) fn finite(name: impl Display, value: f64) -> Result<(), MaterialError> {
    check(name, value, value.is_finite(), "give a finite number")
}

pub(super) fn positive(name: impl Display, value: f64) -> Result<(), MaterialError> {
    check(name, value, value.is_finite() && value > 0.0, "give a finite number above zero")
}

pub(super) fn not_negative(name: impl Display, value: f64) -> Result<(), MaterialError> {
    check(name, value, value.is_finite() && value >= 0.0, "give a finite number not below zero")
}

/// The exponent of the term of a number, which counts from zero.
pub(super) fn exponent(term: usize, value: f64) -> Result<(), MaterialError> {
    let holds = value.is_finite() && value != 0.0;
    check(format!("alpha_{}", term + 1), value, holds, "give a finite exponent other than zero")
}
