//! The measure of the kinematics in averages over sub-cells.

use crate::cells::Smoothing;
use crate::error::GeometryError;
use crate::geometry::Point;
use crate::kinematics::{Kinematics, measure};

/// What differences of the measure rounding may leave, relative to it.
const ROUNDING: f64 = 1e-9;

/// Refuses measures that the averages are wrong for: the divergence theorem takes them for constant, or with hoops for
/// proportional to $R$ to their number.
pub(super) struct Measured<'a, const D: usize> {
    kinematics: &'a dyn Kinematics<D>,
    pub(super) hoops: usize,
    /// The first facet point off the axis, and the measure there.
    reference: Option<(f64, f64)>,
}

impl<'a, const D: usize> Measured<'a, D> {
    pub(super) fn new(
        kinematics: &'a dyn Kinematics<D>,
        hoops: usize,
        smoothing: &Smoothing<D>,
    ) -> Result<Self, GeometryError> {
        let reference = match smoothing.facet_points.iter().find(|at| hoops == 0 || at[0] > 0.0) {
            Some(at) => Some((at[0], measure(kinematics, hoops > 0, at)?)),
            None => None,
        };
        Ok(Measured { kinematics, hoops, reference })
    }

    /// The measure at a point.
    pub(super) fn at(&self, at: &Point<D>) -> Result<f64, GeometryError> {
        let found = measure(self.kinematics, self.hoops > 0, at)?;
        let Some((radius, first)) = self.reference.filter(|_| self.hoops == 0 || at[0] > 0.0) else { return Ok(found) };
        let expected = if self.hoops == 0 { first } else { first * (at[0] / radius).powi(self.hoops as i32) };
        if (found - expected).abs() <= ROUNDING * found.abs().max(expected.abs()) {
            return Ok(found);
        }
        Err(GeometryError::Kinematics {
            what: "the measure of the kinematics is not constant or, with hoops, proportional to R to their number",
            at: at.as_slice().to_vec(),
            remedy: "averages over sub-cells are made for such measures alone: integrate at Gauss points (Rule::Gauss)",
        })
    }

    /// The measure and $1/R$ at an interior point with its weight: a little off the axis for one on it, where $m/R$ has a
    /// limit, $2\pi$ for the measure $2\pi R$.
    pub(super) fn hoop(&self, at: &Point<D>, weight: f64) -> Result<[f64; 2], GeometryError> {
        let mut off_axis = *at;
        if at[0] == 0.0 {
            off_axis[0] = 1e-8 * weight.abs().sqrt();
        }
        let measure = self.at(&off_axis)?;
        Ok([measure, inverse_radius(off_axis[0], at.as_slice(), measure)?])
    }
}

/// $1/R$, zero at a point on the axis that carries no weight.
pub(super) fn inverse_radius(radius: f64, at: &[f64], measure: f64) -> Result<f64, GeometryError> {
    if radius > 0.0 {
        Ok(1.0 / radius)
    } else if radius == 0.0 && measure == 0.0 {
        Ok(0.0)
    } else {
        Err(GeometryError::Kinematics {
            what: "negative radius",
            at: at.to_vec(),
            remedy: "coordinate 0 of an axisymmetric body is the distance from the axis and may not be negative",
        })
    }
}
