//! What terms of this crate arrange with the assembler.

use super::at_points::PointMotion;
use super::uncondensed::{Product, Zone};

/// What terms of this crate arrange with the assembler; those of users arrange nothing.
pub trait Protocol: Send + Sync {
    /// Whether the lower blocks are filled that the assembler wants.
    fn fills_lower_blocks(&self) -> bool {
        false
    }

    /// The points that a matrix is over which is filled instead of one over the nodes, as contact does: what comes into contact is
    /// not known before, and couples a few of many nodes at a time.
    fn points(&self) -> Option<&PointMotion> {
        None
    }

    /// Whether its pressures, condensed otherwise, can be kept as unknowns beside the matrix.
    fn separates(&self) -> bool {
        false
    }

    /// Whether it keeps its own pressures as unknowns beside the matrix of its nodes, where the assembler asks for zones.
    fn keeps_pressures(&self) -> bool {
        false
    }

    /// Writes the product of the kept part of a cluster's matrix with a vector, node by node: $K x$ beside $C^T H C x$.
    fn multiply(&self, _zone: &Zone, _x: &[f64], _product: &mut Product) {}

    /// Takes increments of uncondensed pressures, instead of those that follow from the step.
    fn take_pressures(&self, _pressures: &[f64; 4], _condensed_step: &mut [f64]) {}

    /// Lets the search for what faces what rest as it was at the last state, or go on; whether there is one.
    fn hold_search(&self, _hold: bool) -> bool {
        false
    }

    /// Whether the matrix acts on the steps of Newton's method alone and resists nothing.
    fn is_artificial(&self) -> bool {
        false
    }

    /// Visits lists of nodes, by their places in the cluster, that the matrix couples beside condensed unknowns.
    fn couplings(&self, _cluster: usize, _visit: &mut dyn FnMut(&[u16])) {}
}

/// Nothing is arranged.
pub(super) struct Plain;

impl Protocol for Plain {}
