//! Materials: laws, published curves, the paper's formulas.

mod laws;
mod oracle;
