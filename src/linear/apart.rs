//! What solvers need that keep pressures apart from the matrix.

use crate::term::Zone;

/// A linearised system: its reduced matrix, and what is kept apart from it.
#[derive(Debug, Clone, Copy)]
pub struct Linearised<'a> {
    /// Values of the reduced matrix.
    pub values: &'a [f64],
    /// Skew part, over the unknowns of the displacement alone, as [`System::skew`](crate::assembly::System::skew).
    pub skew: &'a [(u32, u32, f64)],
    /// Pressures that were not condensed into the matrix; none for solvers that don't ask for them.
    pub zones: &'a [Zone],
}

/// The state that a system was linearised at.
#[derive(Debug, Clone, Copy)]
pub struct At<'a> {
    /// Coefficients $d$ \[length\].
    pub displacement: &'a [f64],
    /// Condensed unknowns, one list per term.
    pub condensed: &'a [Vec<f64>],
    /// Load factor.
    pub load: f64,
}
