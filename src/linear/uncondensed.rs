//! Data for solvers that keep pressures as unknowns beside the matrix.

use std::fmt;

use crate::term::{Product, Zone};

/// The product of a zone's own matrix, $C^T H C$ left out, with a vector over all unknowns: node by node of the zone.
pub type ZoneProduct<'a> = &'a (dyn Fn(&Zone, &[f64], &mut Product) + Sync);

/// A linearised system: its reduced matrix, and the pressures that are not condensed into it.
#[derive(Clone, Copy)]
pub struct Linearised<'a> {
    /// Values of the reduced matrix.
    pub values: &'a [f64],
    /// Skew part, over the unknowns of the displacement alone, as [`System::skew`](crate::assembly::System::skew).
    pub skew: &'a [(u32, u32, f64)],
    /// Pressures that were not condensed into the matrix; none for solvers that don't ask for them.
    pub zones: &'a [Zone],
    /// What else the terms with such pressures would have added.
    pub product: ZoneProduct<'a>,
}

impl fmt::Debug for Linearised<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Linearised { values, skew, zones, .. } = self;
        f.debug_struct("Linearised").field("values", values).field("skew", skew).field("zones", zones).finish()
    }
}
