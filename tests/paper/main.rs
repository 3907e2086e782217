//! The paper's formulas, one by one.

mod formulas;
