//! The smooth surfaces that shapes are made of.

use std::fmt;
use std::sync::Arc;

use nalgebra::Rotation3;

use crate::each::point_of;
use crate::geometry::Vec3;

/// A function whose negative values are inside.
pub(super) type Field = Arc<dyn Fn(&Vec3) -> f64 + Send + Sync>;

/// A smooth surface: the zeros of a function that is negative inside.
#[derive(Clone)]
pub(super) enum Surface {
    Plane {
        point: Vec3,
        normal: Vec3,
    },
    Sphere {
        centre: Vec3,
        radius: f64,
    },
    Cylinder {
        point: Vec3,
        axis: Vec3,
        radius: f64,
    },
    /// Opens along `axis`; cosine and sine of the angle between axis and side.
    Cone {
        apex: Vec3,
        axis: Vec3,
        cos: f64,
        sin: f64,
    },
    Torus {
        centre: Vec3,
        axis: Vec3,
        major: f64,
        minor: f64,
    },
    /// A given function, turned and then shifted; differences over `step` are its slopes. It may have edges within it.
    Field {
        field: Field,
        turn: Rotation3<f64>,
        shift: Vec3,
        step: f64,
        creased: bool,
    },
}

impl fmt::Debug for Surface {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Surface::Plane { .. } => "plane",
            Surface::Sphere { .. } => "sphere",
            Surface::Cylinder { .. } => "cylinder",
            Surface::Cone { .. } => "cone",
            Surface::Torus { .. } => "torus",
            Surface::Field { .. } => "level set",
        })
    }
}

/// Part of a vector along an axis, and what is left.
fn split(way: Vec3, axis: &Vec3) -> (f64, Vec3) {
    let along = way.dot(axis);
    (along, way - axis * along)
}

impl Surface {
    pub(crate) fn value(&self, x: &Vec3) -> f64 {
        match self {
            Surface::Plane { point, normal } => normal.dot(&(x - point)),
            Surface::Sphere { centre, radius } => (x - centre).norm() - radius,
            Surface::Cylinder { point, axis, radius } => split(x - point, axis).1.norm() - radius,
            Surface::Cone { apex, axis, cos, sin } => {
                let (along, across) = split(x - apex, axis);
                across.norm() * cos - along * sin
            }
            Surface::Torus { centre, axis, major, minor } => {
                let (along, across) = split(x - centre, axis);
                along.hypot(across.norm() - major) - minor
            }
            Surface::Field { field, turn, shift, .. } => field(&turn.inverse_transform_vector(&(x - shift))),
        }
    }

    pub(crate) fn gradient(&self, x: &Vec3) -> Vec3 {
        let unit = |x: Vec3| x.try_normalize(0.0).unwrap_or_default();
        match self {
            Surface::Plane { normal, .. } => *normal,
            Surface::Sphere { centre, .. } => unit(x - centre),
            Surface::Cylinder { point, axis, .. } => unit(split(x - point, axis).1),
            Surface::Cone { apex, axis, cos, sin } => unit(split(x - apex, axis).1) * *cos - axis * *sin,
            Surface::Torus { centre, axis, major, .. } => {
                let (along, across) = split(x - centre, axis);
                unit(axis * along + unit(across) * (across.norm() - major))
            }
            Surface::Field { step, .. } => point_of::<3>(|i| {
                let mut ends = [*x, *x];
                ends[0][i] -= step;
                ends[1][i] += step;
                (self.value(&ends[1]) - self.value(&ends[0])) / (2.0 * step)
            }),
        }
    }

    /// Turned about the origin, then shifted.
    pub(crate) fn moved(mut self, by: &Rotation3<f64>, to: &Vec3) -> Self {
        let place = |x: &mut Vec3| *x = by * *x + to;
        match &mut self {
            Surface::Plane { point, normal: axis } | Surface::Cylinder { point, axis, .. } => {
                place(point);
                *axis = by * *axis;
            }
            Surface::Sphere { centre, .. } => place(centre),
            Surface::Cone { apex: centre, axis, .. } | Surface::Torus { centre, axis, .. } => {
                place(centre);
                *axis = by * *axis;
            }
            Surface::Field { turn, shift, .. } => {
                *turn = by * *turn;
                place(shift);
            }
        }
        self
    }

    /// Whether another surface has the same zeros, to rounding.
    pub(crate) fn is_same(&self, other: &Surface, size: f64) -> bool {
        let near = |a: &Vec3, b: &Vec3| (a - b).norm() <= 1e-9 * size;
        match (self, other) {
            (Surface::Plane { point, normal }, Surface::Plane { point: p, normal: n }) => {
                normal.cross(n).norm() < 1e-9 && normal.dot(&(p - point)).abs() <= 1e-9 * size
            }
            (Surface::Sphere { centre, radius }, Surface::Sphere { centre: c, radius: r }) => {
                near(centre, c) && (radius - r).abs() <= 1e-9 * size
            }
            (Surface::Cylinder { point, axis, radius }, Surface::Cylinder { point: p, axis: a, radius: r }) => {
                axis.cross(a).norm() < 1e-9
                    && split(p - point, axis).1.norm() <= 1e-9 * size
                    && (radius - r).abs() <= 1e-9 * size
            }
            _ => false,
        }
    }
}
