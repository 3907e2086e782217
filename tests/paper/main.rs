//! The paper, formula by formula and example by example.

// Each example brings its own support.
#![allow(clippy::duplicate_mod)]

mod estimate;
mod examples;
mod formulas;
mod full_transformation;
