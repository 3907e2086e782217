//! Rigid motions of bodies.

use super::Point;
use crate::each::point_of;

/// An infinitesimal rigid motion: a translation along an axis, or a rotation in the plane of it and of a lower one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RigidMode {
    pub(crate) axis: usize,
    pub(crate) lower: Option<usize>,
}

impl RigidMode {
    /// The translations, then the rotations.
    pub(crate) fn all(dim: usize) -> Vec<RigidMode> {
        let mut modes: Vec<RigidMode> = Vec::with_capacity(dim * (dim + 1) / 2);
        for axis in 0..dim {
            modes.push(RigidMode { axis, lower: None });
        }
        for axis in 0..dim {
            for lower in 0..axis {
                modes.push(RigidMode { axis, lower: Some(lower) });
            }
        }
        modes
    }

    /// The displacement at an offset from the centre.
    pub(crate) fn at<const D: usize>(&self, offset: &Point<D>) -> Point<D> {
        point_of(|k| match self.lower {
            None => f64::from(u8::from(k == self.axis)),
            Some(lower) if k == self.axis => offset[lower],
            Some(lower) if k == lower => -offset[self.axis],
            Some(_) => 0.0,
        })
    }
}
