//! What a touching trace function does along a surface with friction.

use crate::geometry::Point;

/// What friction does at a trace function.
pub(super) enum StickSlip<const D: usize> {
    /// It sticks, with this slip to take back.
    Stick(Point<D>),
    /// It slides, its traction along this unit vector; $c/|\tau - c s|$ beside it.
    Slip(Point<D>, f64),
}
