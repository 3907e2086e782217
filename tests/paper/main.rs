//! The paper, formula by formula and example by example.

mod examples;
mod formulas;
