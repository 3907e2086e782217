//! Where the particles of a lattice stand in the unit cube.

use std::fmt;
use std::sync::Arc;

/// How the particles of a lattice are spaced in the unit cube.
#[derive(Clone, Default)]
pub enum Layout {
    /// Evenly along each axis.
    #[default]
    Regular,
    /// At $t' = f(\text{axis}, t)$ for evenly spaced $t$; $f$ maps $\[0,1\]$ onto itself and rises.
    Graded(Arc<dyn Fn(usize, f64) -> f64 + Send + Sync>),
    /// Inner particles moved by up to `amount` of the spacing in each direction.
    Jittered {
        /// Largest move as a part of the spacing, below 0.5.
        amount: f64,
        /// Seed of the random numbers.
        seed: u64,
    },
}

impl fmt::Debug for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Layout::Regular => write!(f, "Regular"),
            Layout::Graded(_) => write!(f, "Graded(..)"),
            Layout::Jittered { amount, seed } => write!(f, "Jittered {{ amount: {amount}, seed: {seed} }}"),
        }
    }
}
