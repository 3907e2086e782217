//! What a touching trace function does along a surface with friction.

use crate::geometry::Point;

/// What friction does at a trace function.
pub(super) enum StickSlip<const D: usize> {
    /// It sticks, with this slip to take back.
    Stick(Point<D>),
    /// It slides.
    Slip {
        /// A unit vector along its traction.
        direction: Point<D>,
        /// The slip across that, which is none at rest.
        across: Point<D>,
        /// What the traction turns by with the slip across it \[stress/length\]: $\mu\pi/|s|$ at rest.
        turning: f64,
    },
}
