//! What tells whether a zone has free particles enough for its pressures.

use std::ops::AddAssign;

use nalgebra::{Matrix3, SymmetricEigen};

use crate::geometry::Point;

use super::parts::Part;

/// Free particles that a zone has at least: as many displacements as linear pressures, and more.
pub(super) const FREE: f64 = 3.0;
/// How far free particles spread in a zone at least, as a part of the variance of its volume along any axis: a corner of a lattice has
/// 0.67, and a strip whose free particles stand in one layer none.
const SPREAD: f64 = 0.25;

/// Weight, and its first and second moments.
#[derive(Debug, Clone, Default)]
pub(super) struct Moments {
    weight: f64,
    first: Point<3>,
    second: Matrix3<f64>,
}

impl Moments {
    pub(super) fn add(&mut self, x: &Point<3>, weight: f64) {
        self.weight += weight;
        self.first += x * weight;
        self.second += x * x.transpose() * weight;
    }

    fn variance(&self) -> Matrix3<f64> {
        let mean = self.first / self.weight;
        self.second / self.weight - mean * mean.transpose()
    }
}

impl AddAssign for Moments {
    fn add_assign(&mut self, other: Self) {
        self.weight += other.weight;
        self.first += other.first;
        self.second += other.second;
    }
}

/// The free particles of a zone and its volume.
#[derive(Debug, Clone, Default)]
pub(super) struct Inner {
    pub(super) free: Moments,
    volume: Moments,
}

impl AddAssign for Inner {
    fn add_assign(&mut self, other: Self) {
        self.free += other.free;
        self.volume += other.volume;
    }
}

impl Inner {
    /// Adds a sub-cell, its own variance that of a cube.
    pub(super) fn add_part(&mut self, part: &Part) {
        self.volume.add(&part.centre, part.volume);
        self.volume.second += Matrix3::identity() * (part.volume * part.volume.max(0.0).cbrt().powi(2) / 12.0);
    }

    /// The number of free particles, less where they do not spread.
    pub(super) fn worth(&self) -> f64 {
        if self.free.weight < FREE {
            return self.free.weight;
        }
        let Some(factor) = self.volume.variance().cholesky() else { return self.free.weight };
        let inverse = factor.l().try_inverse().unwrap_or_else(Matrix3::identity);
        let spread = SymmetricEigen::new(inverse * self.free.variance() * inverse.transpose()).eigenvalues.min();
        if spread < SPREAD { FREE * spread.max(0.0) / SPREAD * 0.999 } else { self.free.weight }
    }
}
