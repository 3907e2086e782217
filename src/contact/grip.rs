//! What a touching hat does along a surface with friction.

use crate::geometry::Point;

/// What friction does at a hat.
pub(super) enum Grip<const D: usize> {
    /// It sticks, with this slip to take back.
    Sticks(Point<D>),
    /// It slides, its traction along this unit vector; $c/|\tau - c s|$ beside it.
    Slides(Point<D>, f64),
}
