//! Materials: laws, published curves, the paper's formulas, homogeneous states, fits to tests, memory, prestress.

#[cfg(feature = "fit")]
mod fit;
mod homogeneous;
mod laws;
mod oracle;
mod prestress;
mod time;
