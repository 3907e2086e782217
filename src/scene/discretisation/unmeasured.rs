//! Plain coordinates, for what weighs no volume.

use crate::geometry::Point;
use crate::kinematics::Kinematics;

/// Plain coordinates without hoops: the measure of a point.
pub(crate) struct Unmeasured;

impl<const D: usize> Kinematics<D> for Unmeasured {
    fn hoop_components(&self) -> &'static [usize] {
        &[]
    }

    fn measure(&self, _: &Point<D>) -> f64 {
        1.0
    }
}
