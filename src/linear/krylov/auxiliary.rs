//! What a large model is preconditioned with.

use std::ops::Range;
use std::sync::Arc;

use crate::assembly::{Model, Ranks};

/// Elements beside the particles, which are stiff where these are: what a large model is preconditioned with.
#[derive(Clone)]
pub(crate) struct Auxiliary {
    /// Linear elements on the particles, or fits of linear fields to them, with the material and the zones of the body.
    pub model: Arc<Model>,
    /// Which term of the model to be solved has the same condensed unknowns.
    pub term: usize,
    /// Values of the shape functions at the particles by rows: first entry of each, particles, values. Empty where the
    /// functions interpolate. Where ranks share the model, the rows of this rank's share.
    pub values: (Vec<usize>, Vec<u32>, Vec<f64>),
    /// Places of the particles in the unit cube, and how many times their spacing it is wide.
    pub places: Vec<[f64; 3]>,
    /// Cells along each axis of the unit cube.
    pub cells: [usize; 3],
    /// Unknowns that conditions hold.
    pub held: Vec<usize>,
}

impl Auxiliary {
    /// The nodes whose part of vectors a rank keeps.
    pub(crate) fn share(ranks: Option<&dyn Ranks>, nodes: usize) -> Range<usize> {
        match ranks {
            Some(ranks) => nodes * ranks.rank() / ranks.count()..nodes * (ranks.rank() + 1) / ranks.count(),
            None => 0..nodes,
        }
    }
}

/// Replaces values by their sums over the ranks.
pub(super) fn total(ranks: &Option<Arc<dyn Ranks>>, values: &mut [f64]) {
    if let Some(ranks) = ranks {
        ranks.sum(values);
    }
}
