//! Rigid surfaces: signed distance, normal and curvature at a point.

use nalgebra::SMatrix;

use crate::error::GeometryError;
use crate::geometry::{Mat3, Point, Vec3, padded};

/// Where a point stands beside a rigid surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest<const D: usize> {
    /// Signed distance $g(x)$ \[length\], negative inside the rigid body.
    pub gap: f64,
    /// $\partial g/\partial x$: the unit normal at the nearest point, out of the rigid body.
    pub normal: Point<D>,
    /// $\partial^2 g/\partial x\\,\partial x$ \[1/length\].
    pub curvature: SMatrix<f64, D, D>,
    /// Whether the nearest point is an open end of the surface that the point has passed.
    pub passed_end: bool,
}

impl<const D: usize> Nearest<D> {
    /// Beside a face without curvature.
    pub fn flat(gap: f64, normal: Point<D>) -> Self {
        Nearest { gap, normal, curvature: SMatrix::zeros(), passed_end: false }
    }

    /// At the vector `away` from the nearest point, across `across` directions of equal curvature, of a surface that
    /// lies at distance `radius` from its centre, axis or corner.
    pub(crate) fn round(away: Point<D>, radius: f64, projector: SMatrix<f64, D, D>) -> Self {
        let distance = away.norm();
        // At the centre all directions are as good: the first one is taken.
        let normal = if distance > 0.0 { away / distance } else { Point::from_fn(|i, _| f64::from(u8::from(i == 0))) };
        let curvature =
            if distance > 0.0 { (projector - normal * normal.transpose()) / distance } else { SMatrix::zeros() };
        Nearest { gap: distance - radius, normal, curvature, passed_end: false }
    }

    /// The same surface seen from within: the rigid body lies outside.
    pub(crate) fn hollow(self) -> Self {
        Nearest { gap: -self.gap, normal: -self.normal, curvature: -self.curvature, ..self }
    }
}

/// The surface of a rigid body, as a signed distance.
///
/// ```
/// use rkpm::contact::{Nearest, Surface};
/// use rkpm::geometry::Point;
/// /// The half-space below the parabola's vertex tangent: a floor at a height.
/// struct Floor(f64);
/// impl Surface<2> for Floor {
///     fn nearest(&self, x: &Point<2>) -> Nearest<2> {
///         Nearest::flat(x[1] - self.0, [0.0, 1.0].into())
///     }
/// }
/// assert_eq!(Floor(1.0).nearest(&[3.0, 4.0].into()).gap, 3.0);
/// ```
pub trait Surface<const D: usize>: Send + Sync {
    /// Gap, normal and curvature at a point. A gap that is NaN, or a normal that is not finite, beside the body is refused.
    fn nearest(&self, x: &Point<D>) -> Nearest<D>;

    /// How deep a point may be inside before its nearest point is another one than where it came in \[length\]: steps of the load
    /// move surfaces by no more than a half of it. Infinite for planes.
    fn depth(&self) -> f64 {
        f64::INFINITY
    }

    /// Refuses a surface that bounds no body.
    ///
    /// # Errors
    /// What is wrong with it.
    fn validate(&self) -> Result<(), GeometryError> {
        Ok(())
    }
}

/// A surface by three components, whatever its dimension is.
pub(super) struct Padded<const D: usize, S>(pub S);

impl<const D: usize, S: Surface<D>> Surface<3> for Padded<D, S> {
    fn nearest(&self, x: &Vec3) -> Nearest<3> {
        let found = self.0.nearest(&padded(x));
        let mut curvature = Mat3::zeros();
        for i in 0..D.min(3) {
            for j in 0..D.min(3) {
                curvature[(i, j)] = found.curvature[(i, j)];
            }
        }
        Nearest { gap: found.gap, normal: padded(&found.normal), curvature, passed_end: found.passed_end }
    }

    fn depth(&self) -> f64 {
        self.0.depth()
    }

    fn validate(&self) -> Result<(), GeometryError> {
        self.0.validate()
    }
}
