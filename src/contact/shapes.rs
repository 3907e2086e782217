//! Planes, balls, cylinders and cones.

use nalgebra::SMatrix;

use crate::error::{GeometryError, Invalid};
use crate::geometry::{Point, Vec3};

use super::{Nearest, Surface};

/// A half-space: the rigid body lies behind the plane, opposite to its normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plane<const D: usize> {
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

/// A disc in the plane (a cylinder that stands on it), a sphere or an endless cylinder in space; or the bore of that shape in a rigid body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Round<const D: usize> {
    /// Centre, or a point of the axis \[length\].
    pub centre: Point<D>,
    /// The direction of the axis of a cylinder, of any length above zero.
    pub along: Option<Point<D>>,
    /// Radius \[length\].
    pub radius: f64,
    /// Whether the rigid body lies outside.
    pub hollow: bool,
}

impl<const D: usize> Surface<D> for Round<D> {
    fn nearest(&self, x: &Point<D>) -> Nearest<D> {
        let away = x - self.centre;
        let found = match self.along.map(|along| along.normalize()) {
            None => Nearest::round(away, self.radius, SMatrix::identity()),
            Some(axis) => {
                let across = SMatrix::identity() - axis * axis.transpose();
                Nearest::round(across * away, self.radius, across)
            }
        };
        if self.hollow { found.hollow() } else { found }
    }

    fn depth(&self) -> f64 {
        self.radius
    }

    fn validate(&self) -> Result<(), GeometryError> {
        if let Some(along) = &self.along {
            direction("axis of a rigid cylinder", along)?;
        }
        let needed = "give a finite length above zero: there is no inside otherwise";
        positive("radius of a rigid surface", self.radius, needed)?;
        finite(&self.centre)
    }
}

/// An endless cone in space, solid around its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Cone {
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

fn direction<const D: usize>(what: &'static str, vector: &Point<D>) -> Result<(), GeometryError> {
    positive(what, vector.norm(), "give a vector of finite length above zero")
}

fn positive(what: &'static str, value: f64, needed: &'static str) -> Result<(), GeometryError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(Invalid::new(what, value, needed).into()) }
}

fn finite<const D: usize>(at: &Point<D>) -> Result<(), GeometryError> {
    match at.iter().find(|x| !x.is_finite()) {
        None => Ok(()),
        Some(&value) => Err(Invalid::new("coordinate of a rigid surface", value, "give finite numbers").into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::{Profile, Surface, Triangulated};
    use crate::geometry::{Point, Turn};
    use crate::mesh::{CellShape, Mesh};
    use approx::abs_diff_eq;

    /// Draws of numbers in (-1, 1).
    fn draws(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
    }

    /// Central differences at points drawn around a surface; points whose nearest one changes within a difference are left out.
    fn check<const D: usize>(name: &str, surface: &impl Surface<D>, size: f64) {
        surface.validate().unwrap();
        let mut draw = draws(7);
        let h = 1e-5;
        let mut checked = 0;
        for _ in 0..400 {
            let x = Point::<D>::from_fn(|_, _| size * draw());
            let at = surface.nearest(&x);
            assert!(abs_diff_eq!(at.normal.norm(), 1.0, epsilon = 1e-12), "{name}: normal {:?} at {x:?}", at.normal);
            let moved = |i: usize, by: f64| {
                let mut y = x;
                y[i] += by;
                surface.nearest(&y)
            };
            // The nearest point lies on the surface.
            let foot = surface.nearest(&(x - at.normal * at.gap));
            let near_kink = (0..D).any(|i| (moved(i, h).normal - moved(i, -h).normal).norm() > 1e-2);
            if near_kink || at.passed_end || at.curvature.norm() > 1e2 {
                continue;
            }
            checked += 1;
            assert!(abs_diff_eq!(foot.gap, 0.0, epsilon = 1e-9 * size), "{name}: foot of {x:?} is {:e} off", foot.gap);
            for i in 0..D {
                let (ahead, behind) = (moved(i, h), moved(i, -h));
                let slope = (ahead.gap - behind.gap) / (2.0 * h);
                assert!(abs_diff_eq!(slope, at.normal[i], epsilon = 1e-6), "{name} at {x:?}: {slope} {}", at.normal[i]);
                for j in 0..D {
                    let turn = (ahead.normal[j] - behind.normal[j]) / (2.0 * h);
                    let curvature = at.curvature[(i, j)];
                    assert!(
                        abs_diff_eq!(turn, curvature, epsilon = 1e-4 * (1.0 + curvature.abs())),
                        "{name} at {x:?}: {turn} {curvature}"
                    );
                }
            }
        }
        assert!(checked > 200, "{name}: {checked}");
    }

    #[test]
    fn normals_and_curvatures_are_derivatives_of_gaps() {
        check("plane", &Plane { through: [0.3, 0.2].into(), normal: [1.0, 2.0].into() }, 2.0);
        check("plane", &Plane { through: [0.3, 0.2, 0.1].into(), normal: [1.0, 2.0, -1.0].into() }, 2.0);
        for hollow in [false, true] {
            check("disc", &Round::<2> { centre: [0.1, 0.2].into(), along: None, radius: 0.7, hollow }, 2.0);
            check("sphere", &Round::<3> { centre: [0.1, 0.2, -0.3].into(), along: None, radius: 0.7, hollow }, 2.0);
            let (centre, along) = ([0.1, 0.0, 0.2].into(), Some([1.0, 1.0, 0.3].into()));
            check("cylinder", &Round::<3> { centre, along, radius: 0.6, hollow }, 2.0);
        }
        check("cone", &Cone { tip: [0.1, 0.2, 0.0].into(), along: [0.2, 0.1, 1.0].into(), half_angle: 0.6 }, 2.0);
        let groove = Profile::at([1.5, 1.0])
            .line([1.5, -0.5])
            .arc([1.2, -0.8], [1.2, -0.5], Turn::Right)
            .line([-1.0, -0.8])
            .line([-1.0, 1.0]);
        check("groove", &groove, 1.4);
        let cam =
            Profile::at([0.8, 0.0]).arc([0.0, 0.8], [0.0, 0.0], Turn::Left).line([-0.8, 0.8]).line([-0.8, 0.0]).close();
        check("cam", &cam, 2.0);
    }

    #[test]
    fn profiles_know_their_inside() {
        let square = Profile::at([0.0, 0.0]).line([1.0, 0.0]).line([1.0, 1.0]).line([0.0, 1.0]).close();
        for (x, gap) in
            [([0.5, 0.4], -0.4), ([0.5, 1.5], 0.5), ([4.0, 5.0], 5.0), ([-0.3, 0.5], 0.3), ([0.9, 0.5], -0.1)]
        {
            assert!(abs_diff_eq!(square.nearest(&x.into()).gap, gap, epsilon = 1e-12), "{x:?}");
        }
        // The same way the other way round bounds a cavity.
        let cavity = Profile::at([0.0, 0.0]).line([0.0, 1.0]).line([1.0, 1.0]).line([1.0, 0.0]).close();
        for (x, gap) in [([0.5, 0.4], 0.4), ([0.5, 1.5], -0.5), ([4.0, 5.0], -5.0)] {
            assert!(abs_diff_eq!(cavity.nearest(&x.into()).gap, gap, epsilon = 1e-12), "{x:?}");
        }
        let open = Profile::at([1.0, 0.0]).line([0.0, 0.0]);
        assert!(open.nearest(&[2.0, 0.3].into()).passed_end && !open.nearest(&[0.5, 0.3].into()).passed_end);
    }

    /// Two hexahedra side by side, as a mesh.
    fn bricks() -> Mesh<3> {
        let corner = |k: usize| [(k % 3) as f64 - 1.0, ((k / 3) % 2) as f64 - 0.5, (k / 6) as f64 - 0.5].into();
        let cells = vec![0, 1, 4, 3, 6, 7, 10, 9, 1, 2, 5, 4, 7, 8, 11, 10];
        Mesh::new((0..12).map(corner).collect(), &[(CellShape::Hexahedron, cells)], &[]).unwrap()
    }

    #[test]
    fn hulls_of_meshes_are_signed_distances() {
        let hull = Triangulated::new(bricks().points().to_vec(), bricks().surface().0);
        check("hull", &hull, 2.0);
        // Beside the distance of a box.
        let mut draw = draws(11);
        for _ in 0..200 {
            let x = Point::<3>::from_fn(|_, _| 2.0 * draw());
            let away = Point::<3>::new(x[0].abs() - 1.0, x[1].abs() - 0.5, x[2].abs() - 0.5);
            let outside = away.map(|v| v.max(0.0)).norm();
            let gap = if outside > 0.0 { outside } else { away.max() };
            assert!(abs_diff_eq!(hull.nearest(&x).gap, gap, epsilon = 1e-12), "{x:?}: {} {gap}", hull.nearest(&x).gap);
        }
    }
}
