//! Linear systems as solvers see them.

use std::fmt;

use crate::assembly::StateRef;
use crate::term::{Product, Zone};

/// A linearised system: its reduced matrix, the pressures that are not condensed into it, and the state.
#[derive(Clone, Copy)]
pub struct LinearSystem<'a> {
    /// Lower values of the reduced matrix, in the pattern that the solver has analysed.
    pub values: &'a [f64],
    /// Skew part, over the unknowns of the displacement alone, as [`System::skew`](crate::assembly::System::skew).
    pub skew: &'a [(u32, u32, f64)],
    /// Pressures that were not condensed into the matrix; none for solvers that don't ask for them.
    pub zones: &'a [Zone],
    /// What else the terms with such pressures would have added: the product of a zone's own matrix, $C^T H C$ left out, with a vector
    /// over all unknowns, node by node of the zone.
    pub product: &'a (dyn Fn(&Zone, &[f64], &mut Product) + Sync),
    /// The state that it was linearised at; empty vectors where nothing is known of it.
    pub state: StateRef<'a>,
}

impl<'a> LinearSystem<'a> {
    /// A matrix alone.
    pub fn of(values: &'a [f64]) -> Self {
        LinearSystem { values, skew: &[], zones: &[], product: &|_, _, _| {}, state: StateRef::new(&[], &[], 0.0) }
    }
}

impl fmt::Debug for LinearSystem<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LinearSystem { values, skew, zones, state, .. } = self;
        f.debug_struct("LinearSystem")
            .field("values", values)
            .field("skew", skew)
            .field("zones", zones)
            .field("state", state)
            .finish_non_exhaustive()
    }
}
