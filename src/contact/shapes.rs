//! Planes, balls, cylinders and cones.

use nalgebra::SMatrix;

use crate::error::{GeometryError, Invalid};
use crate::geometry::{Mat3, Point, Vec3};

use super::{Nearest, Surface};

/// A half-space: the rigid body lies behind the plane, opposite to its normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane<const D: usize> {
    /// A point of the plane \[length\].
    pub through: Point<D>,
    /// The normal out of the rigid body, of any length above zero.
    pub normal: Point<D>,
}

impl<const D: usize> Surface<D> for Plane<D> {
    fn nearest(&self, x: &Point<D>) -> Nearest<D> {
        let normal = self.normal.normalize();
        Nearest::flat((x - self.through).dot(&normal), normal)
    }

    fn validate(&self) -> Result<(), GeometryError> {
        direction("normal of a rigid plane", &self.normal)?;
        finite(&self.through)
    }
}

/// A disc in the plane (a cylinder that stands on it), a sphere in space; or the bore of that shape in a rigid body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ball<const D: usize> {
    /// Centre \[length\].
    pub centre: Point<D>,
    /// Radius \[length\].
    pub radius: f64,
    /// Whether the rigid body lies outside.
    pub hollow: bool,
}

impl<const D: usize> Surface<D> for Ball<D> {
    fn nearest(&self, x: &Point<D>) -> Nearest<D> {
        let found = Nearest::round(x - self.centre, self.radius, SMatrix::identity());
        if self.hollow { found.hollow() } else { found }
    }

    fn depth(&self) -> f64 {
        self.radius
    }

    fn validate(&self) -> Result<(), GeometryError> {
        length("radius of a rigid surface", self.radius)?;
        finite(&self.centre)
    }
}

/// An endless cylinder in space, or the bore of that shape in a rigid body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// A point of the axis \[length\].
    pub through: Vec3,
    /// The direction of the axis, of any length above zero.
    pub along: Vec3,
    /// Radius \[length\].
    pub radius: f64,
    /// Whether the rigid body lies outside.
    pub hollow: bool,
}

impl Surface<3> for Cylinder {
    fn nearest(&self, x: &Vec3) -> Nearest<3> {
        let axis = self.along.normalize();
        let across = Mat3::identity() - axis * axis.transpose();
        let found = Nearest::round(across * (x - self.through), self.radius, across);
        if self.hollow { found.hollow() } else { found }
    }

    fn depth(&self) -> f64 {
        self.radius
    }

    fn validate(&self) -> Result<(), GeometryError> {
        direction("axis of a rigid cylinder", &self.along)?;
        length("radius of a rigid surface", self.radius)?;
        finite(&self.through)
    }
}

/// An endless cone in space, solid around its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    /// The tip \[length\].
    pub tip: Vec3,
    /// From the tip into the cone, of any length above zero.
    pub along: Vec3,
    /// Angle between the axis and the surface \[rad\], between 0 and π/2.
    pub half_angle: f64,
}

impl Surface<3> for Cone {
    fn nearest(&self, x: &Vec3) -> Nearest<3> {
        let axis = self.along.normalize();
        let offset = x - self.tip;
        let height = offset.dot(&axis);
        let across = offset - axis * height;
        let radius = across.norm();
        let (sine, cosine) = self.half_angle.sin_cos();
        // Before the tip the tip itself is nearest.
        if height * cosine + radius * sine < 0.0 {
            return Nearest::round(offset, 0.0, SMatrix::identity());
        }
        let outward = if radius > 0.0 { across / radius } else { perpendicular(&axis) };
        let normal = outward * cosine - axis * sine;
        let around = axis.cross(&outward);
        let curvature = around * around.transpose() * (cosine / radius.max(f64::MIN_POSITIVE));
        Nearest { gap: radius * cosine - height * sine, normal, curvature, passed_end: false }
    }

    fn validate(&self) -> Result<(), GeometryError> {
        direction("axis of a rigid cone", &self.along)?;
        ensure!(
            self.half_angle > 0.0 && self.half_angle < std::f64::consts::FRAC_PI_2,
            Invalid::new(
                "half angle of a rigid cone",
                self.half_angle,
                "give an angle between 0 and π/2; a plane is RigidSurface::plane",
            )
        );
        finite(&self.tip)
    }
}

fn perpendicular(axis: &Vec3) -> Vec3 {
    let least = axis.iamin();
    let unit = Vec3::from_fn(|i, _| f64::from(u8::from(i == least)));
    (unit - axis * axis[least]).normalize()
}

fn length(what: &'static str, value: f64) -> Result<(), GeometryError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(Invalid::new(what, value, "give a finite length above zero: there is no inside otherwise").into())
}

fn direction<const D: usize>(what: &'static str, vector: &Point<D>) -> Result<(), GeometryError> {
    let value = vector.norm();
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(Invalid::new(what, value, "give a vector of finite length above zero").into())
}

fn finite<const D: usize>(at: &Point<D>) -> Result<(), GeometryError> {
    match at.iter().find(|x| !x.is_finite()) {
        None => Ok(()),
        Some(&value) => Err(Invalid::new("coordinate of a rigid surface", value, "give finite numbers").into()),
    }
}
