//! What tells whether a zone has free particles enough for its pressures.

use nalgebra::SymmetricEigen;

use crate::geometry::{Mat3, Vec3};
use crate::order::falling;
use crate::tensor;

use super::super::inertia::Inertia;
use super::parts::Part;

/// Free particles that a zone with linear pressures has at least: as many displacements as pressures, and more. In proportion for fewer
/// functions.
const FREE: f64 = 3.0;
/// Free particles that a zone has at least.
pub(super) const FEWEST: f64 = 1.0;
/// How far free particles spread in a zone at least, as a part of the variance of its volume along any axis: a corner of a lattice has
/// 0.67, and a strip whose free particles stand in one layer none.
const SPREAD: f64 = 0.25;

/// The free particles of a zone and its volume.
#[derive(Debug, Clone, Default)]
pub(super) struct Inner {
    pub(super) free: Inertia,
    volume: Inertia,
}

impl Inner {
    /// Adds a sub-cell, its own variance that of a cube.
    pub(super) fn add_part(&mut self, part: &Part) {
        self.volume.add_point(&part.centre, part.volume);
        self.volume.spread(part.volume * part.volume.max(0.0).cbrt().powi(2) / 12.0);
    }

    /// The number of free particles.
    pub(super) fn worth(&self) -> f64 {
        self.free.measure
    }

    /// The middle of its volume, and the least side of a block with its variance.
    pub(super) fn extent(&self) -> (Vec3, f64) {
        let least = SymmetricEigen::new(self.volume.variance()).eigenvalues.min().max(0.0);
        (self.volume.centre(), (12.0 * least).sqrt())
    }

    /// Directions along which a pressure may vary, those in which free particles spread, as many as there are particles enough for; the
    /// other columns are zero.
    pub(super) fn directions(&self) -> Mat3 {
        let mut found = Mat3::zeros();
        if self.free.measure < 1.0 {
            return found;
        }
        let Some(factor) = self.volume.variance().cholesky() else { return found };
        let inverse = tensor::inverse(&factor.l()).unwrap_or_else(Mat3::identity);
        let spread = SymmetricEigen::new(inverse * self.free.variance() * inverse.transpose());
        for (place, k) in falling(spread.eigenvalues.into()).into_iter().enumerate() {
            if spread.eigenvalues[k] < SPREAD || self.free.measure < FREE * (place + 2) as f64 / 4.0 {
                break;
            }
            found.set_column(place, &inverse.tr_mul(&spread.eigenvectors.column(k)));
        }
        found
    }
}
