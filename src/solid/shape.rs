//! Shapes put together of primitives, level sets and voxels.

use std::sync::Arc;

use nalgebra::{Rotation3, Unit};

use crate::each::{EachOf, array_of, list_of, point_of, sum_of};
use crate::error::{GeometryError, Invalid, SolidError};
use crate::geometry::{Bounds, Point, Vec3};

use super::closed::Solid3;
use super::contour::contour;
use super::program::Node;
use super::surface::{Field, Surface};

/// How often a surface that came out wrong is drawn on a finer grid, and by how much finer.
const TRIES: usize = 4;
const FINER: f64 = 0.91;

/// A shape in space: primitives, level sets and voxels, united, cut from each other, turned and shifted.
///
/// [`solid`](Shape::solid) makes its surface: vertices lie on the primitives, sharp edges on the curves where they cross and corners
/// at their points, so that plane faces are exact and volumes converge with the square of the spacing. Parts named by
/// [`named`](Shape::named) are boundary parts of the solid.
///
/// ```
/// use rkpm::solid::Shape;
/// let pipe = Shape::cylinder([0.0, 0.0, 0.0], [0.0, 0.0, 2.0], 1.0)
///     .minus(Shape::cylinder([0.0, 0.0, -1.0], [0.0, 0.0, 3.0], 0.5).named("bore"))
///     .solid(0.1)?;
/// let volume = 2.0 * std::f64::consts::PI * (1.0 - 0.25);
/// assert!((pipe.volume() / volume - 1.0).abs() < 5e-3);
/// assert!(pipe.facets_of("bore")?.len() > 100);
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Shape {
    node: Node,
    bounds: Bounds<3>,
    /// What a primitive was given and can't be.
    invalid: Option<GeometryError>,
}

/// Numbers that have to be positive.
fn needs(sizes: &[(&'static str, f64)]) -> Option<GeometryError> {
    let bad = sizes.iter().find(|(_, size)| !(*size > 0.0 && size.is_finite()));
    bad.map(|&(what, size)| Invalid::new(what, size, "give a positive finite length").into())
}

/// Numbers of a place that have to be finite.
fn place(what: &'static str, at: &Vec3) -> Option<GeometryError> {
    let bad = at.iter().find(|x| !x.is_finite());
    bad.map(|&value| Invalid::new(what, value, "give finite numbers").into())
}

/// A unit vector along a direction, or why there is none.
fn direction(what: &'static str, along: [f64; 3]) -> Result<Vec3, GeometryError> {
    let (along, length) = (Point::from(along), Point::from(along).norm());
    let exists = length > 0.0 && length.is_finite();
    if exists {
        Ok(along / length)
    } else {
        Err(Invalid::new(what, length, "give a finite vector of some length").into())
    }
}

fn leaf(surface: Surface) -> Node {
    Node::Surface { surface, flipped: false, name: None }
}

fn plane(point: Vec3, normal: Vec3) -> Node {
    leaf(Surface::Plane { point, normal })
}

/// The bounds of a disc.
fn disc(centre: &Vec3, axis: &Vec3, radius: f64) -> Bounds<3> {
    Bounds::of([centre]).widened(&point_of::<3>(|i| radius * (1.0 - axis[i] * axis[i]).max(0.0).sqrt()))
}

impl Shape {
    fn of(node: Node, bounds: Bounds<3>, invalid: Option<GeometryError>) -> Self {
        Shape { node, bounds, invalid }
    }

    /// A ball.
    pub fn sphere(centre: [f64; 3], radius: f64) -> Self {
        let centre = Point::from(centre);
        let bounds = Bounds::of([&centre]).widened(&Vec3::repeat(radius));
        let invalid = needs(&[("radius of a sphere", radius)]).or_else(|| place("centre of a sphere", &centre));
        Self::of(leaf(Surface::Sphere { centre, radius }), bounds, invalid)
    }

    /// A block between two corners.
    pub fn block(min: [f64; 3], max: [f64; 3]) -> Self {
        let bounds = Bounds { low: min.into(), high: max.into() };
        let sides = (0..6).map(|k| {
            let (axis, corner) = (k / 2, if k % 2 == 0 { bounds.low } else { bounds.high });
            let mut normal = Vec3::zeros();
            normal[axis] = if k % 2 == 0 { -1.0 } else { 1.0 };
            plane(corner, normal)
        });
        let extents = bounds.extent().map(|extent| ("extent of a block", extent));
        Self::of(Node::Intersection(sides.collect()), bounds, needs(extents.as_slice()))
    }

    /// A cylinder between the centres of its ends.
    pub fn cylinder(from: [f64; 3], to: [f64; 3], radius: f64) -> Self {
        Self::cone(from, to, radius, radius)
    }

    /// A cone between the centres of its ends, with the radius of each; one of them may be zero.
    pub fn cone(from: [f64; 3], to: [f64; 3], first: f64, second: f64) -> Self {
        let (from, to) = (Point::from(from), Point::from(to));
        let length = (to - from).norm();
        let axis = (to - from) / length;
        let largest = first.max(second);
        let mut invalid = needs(&[("length of a cylinder or cone", length), ("radius of a cylinder or cone", largest)]);
        if let Some(&value) = [first, second].iter().find(|radius| !(**radius >= 0.0)) {
            invalid = Some(Invalid::new("radius of a cone", value, "give a length that is not negative").into());
        }
        let side = if first == second {
            Surface::Cylinder { point: from, axis, radius: first }
        } else {
            let (apex, axis) = (from + axis * (length * first / (first - second)), axis * (second - first).signum());
            let slant = length.hypot(second - first);
            Surface::Cone { apex, axis, cos: length / slant, sin: (second - first).abs() / slant }
        };
        let bounds = disc(&from, &axis, first).join(&disc(&to, &axis, second));
        let mut sides = vec![leaf(side)];
        sides.extend(
            [(from, -axis, first), (to, axis, second)].iter().filter(|end| end.2 > 0.0).map(|e| plane(e.0, e.1)),
        );
        Self::of(Node::Intersection(sides), bounds, invalid)
    }

    /// A ring of circular section: the radius of its middle line and that of its section, which is smaller.
    pub fn torus(centre: [f64; 3], axis: [f64; 3], major: f64, minor: f64) -> Self {
        let (centre, along) = (Point::from(centre), direction("axis of a torus", axis));
        let axis = along.clone().unwrap_or_else(|_| Point::z());
        let bounds = disc(&centre, &axis, major).widened(&Vec3::repeat(minor));
        let lengths = [("section of a torus", minor), ("radius of a torus, less that of its section", major - minor)];
        let invalid = needs(&lengths).or(along.err()).or_else(|| place("centre of a torus", &centre));
        Self::of(leaf(Surface::Torus { centre, axis, major, minor }), bounds, invalid)
    }

    /// All that is behind a plane, seen along its outward normal: to be intersected with, or taken from, something bounded.
    pub fn half_space(point: [f64; 3], normal: [f64; 3]) -> Self {
        let all = Vec3::repeat(f64::INFINITY);
        let (point, normal) = (Point::from(point), direction("normal of a half space", normal));
        let invalid = normal.clone().err().or_else(|| place("point of a half space", &point));
        Self::of(plane(point, normal.unwrap_or_else(|_| Point::z())), Bounds { low: -all, high: all }, invalid)
    }

    /// The points of a block where a function is negative; it should be smooth, and about as steep everywhere near its zeros.
    /// Edges within it come out sharp to the second order of the spacing.
    pub fn level_set(min: [f64; 3], max: [f64; 3], f: impl Fn(&Vec3) -> f64 + Send + Sync + 'static) -> Self {
        Self::field(min, max, Arc::new(f), true)
    }

    fn field(min: [f64; 3], max: [f64; 3], field: Field, creased: bool) -> Self {
        let step = 1e-5 * (Point::from(max) - Point::from(min)).amax();
        let (turn, shift) = (Rotation3::identity(), Point::zeros());
        let mut shape = Self::block(min, max);
        if let Node::Intersection(sides) = &mut shape.node {
            sides.insert(0, leaf(Surface::Field { field, turn, shift, step, creased }));
        }
        shape
    }

    /// Where a stack of voxels is above a threshold, as from a scan: their counts and sizes \[length\] along the axes, and their
    /// values, axis 0 fastest. The stack begins at the origin; values are those at the middles of voxels and linear between
    /// them, so that the surface has no steps where they change gradually.
    ///
    /// # Errors
    /// Where values and counts do not fit, a value is not finite, sizes are not positive, or all voxels are on one side of the threshold
    /// ([`SolidError::Empty`]).
    pub fn voxels(
        counts: [usize; 3],
        sizes: [f64; 3],
        values: Vec<f64>,
        threshold: f64,
    ) -> Result<Self, GeometryError> {
        let total = counts.iter().try_fold(1usize, |product, &count| product.checked_mul(count));
        ensure!(
            total == Some(values.len()),
            GeometryError::Count {
                what: "values of voxels",
                count: values.len(),
                needed: "give as many as the counts along the axes multiply to"
            }
        );
        if let Some(invalid) = needs(&sizes.each(|size| ("size of a voxel", size))) {
            return Err(invalid);
        }
        if let Some(value) = values.iter().copied().find(|value| !value.is_finite()) {
            return Err(
                Invalid::new("value of a voxel", value, "give finite values; a voxel without one cuts a hole").into()
            );
        }
        ensure!(
            threshold.is_finite(),
            Invalid::new("threshold of voxels", threshold, "give a finite value between those of the voxels",)
        );
        let above = values.iter().filter(|value| **value > threshold).count();
        ensure!(
            above != 0 && above != values.len(),
            SolidError::Empty {
                what: "all voxels are on one side of the threshold",
                remedy: "choose one between their values"
            }
        );
        let end = array_of(|i| counts[i] as f64 * sizes[i]);
        let field = move |x: &Vec3| threshold - interpolated(&counts, &sizes, &values, x);
        Ok(Self::field([0.0; 3], end, Arc::new(field), false))
    }

    /// Both shapes together.
    pub fn union(self, other: Shape) -> Self {
        let bounds = self.bounds.join(&other.bounds);
        let mut members = Vec::new();
        for node in [self.node, other.node] {
            match node {
                Node::Union(inner) => members.extend(inner),
                node => members.push(node),
            }
        }
        Self::of(Node::Union(members), bounds, self.invalid.or(other.invalid))
    }

    /// What both shapes share.
    pub fn intersect(self, other: Shape) -> Self {
        let bounds = self.bounds.common(&other.bounds);
        let mut members = Vec::new();
        for node in [self.node, other.node] {
            match node {
                Node::Intersection(inner) => members.extend(inner),
                node => members.push(node),
            }
        }
        Self::of(Node::Intersection(members), bounds, self.invalid.or(other.invalid))
    }

    /// This shape without another.
    pub fn minus(self, other: Shape) -> Self {
        let bounds = self.bounds;
        let outside = Self::of(other.node.complement(), bounds, other.invalid);
        self.intersect(outside)
    }

    /// Turned about an axis through the origin by an angle \[rad\].
    pub fn rotated(self, axis: [f64; 3], angle: f64) -> Self {
        let along = direction("axis of a turn of a shape", axis);
        let finite = if angle.is_finite() {
            None
        } else {
            Some(Invalid::new("angle of a turn of a shape", angle, "give a finite angle").into())
        };
        let (axis, angle) = (along.clone().unwrap_or_else(|_| Point::z()), if angle.is_finite() { angle } else { 0.0 });
        let turn = Rotation3::from_axis_angle(&Unit::new_unchecked(axis), angle);
        let ends = [self.bounds.low, self.bounds.high];
        let corner = |corner: usize| turn * point_of::<3>(|i| ends[corner >> i & 1][i]);
        let all = Vec3::repeat(f64::INFINITY);
        let bounds = match ends.iter().flatten().all(|x| x.is_finite()) {
            true => Bounds::of(&list_of(8, corner)),
            false => Bounds { low: -all, high: all },
        };
        Self::of(self.node.moved(&turn, &Point::zeros()), bounds, self.invalid.or(along.err()).or(finite))
    }

    /// Shifted by a vector \[length\].
    pub fn translated(self, by: [f64; 3]) -> Self {
        let by = Point::from(by);
        let bounds = Bounds { low: self.bounds.low + by, high: self.bounds.high + by };
        let invalid = self.invalid.or_else(|| place("translation of a shape", &by));
        Self::of(self.node.moved(&Rotation3::identity(), &by), bounds, invalid)
    }

    /// Gives the surfaces that have no name yet one: the facets on them become a part of the boundary.
    pub fn named(mut self, name: &str) -> Self {
        if name.trim().is_empty() {
            self.invalid.get_or_insert(GeometryError::Nameless { what: "a surface of a shape" });
        }
        self.node.named(&Arc::from(name));
        self
    }

    /// The solid, with facets of a size of about `spacing` \[length\]. What is thinner than that may be lost. Where edges and
    /// corners are closer to each other than the grid can tell, it is made finer by up to a third of the spacing.
    ///
    /// # Errors
    /// [`SolidError::Empty`] where nothing is inside, [`SolidError::Coarse`] where the spacing is too wide for the shape,
    /// [`GeometryError::Invalid`] for sizes that can't be and where the shape has no bounds.
    pub fn solid(&self, spacing: f64) -> Result<Solid3, GeometryError> {
        if let Some(invalid) = &self.invalid {
            return Err(invalid.clone());
        }
        ensure!(
            spacing > 0.0 && spacing.is_finite(),
            Invalid::new("spacing of a surface", spacing, "give a positive finite length")
        );
        for axis in 0..3 {
            let extent = self.bounds.extent()[axis];
            ensure!(
                !(extent < 0.0),
                SolidError::Empty { what: "the shapes share nothing", remedy: "move them to where they meet" }
            );
            ensure!(
                extent.is_finite(),
                Invalid::new(
                    "extent of a shape",
                    extent,
                    "give finite numbers, and intersect half spaces with something bounded"
                )
            );
        }
        let mut last = None;
        let mut size = spacing;
        for _ in 0..TRIES {
            match contour(&self.node, &self.bounds, size) {
                Err(GeometryError::Solid(
                    error @ (SolidError::Crossing { .. } | SolidError::Branching { .. } | SolidError::Coarse { .. }),
                )) => last = Some(error),
                found => return found,
            }
            size *= FINER;
        }
        let at = match last {
            Some(
                SolidError::Crossing { at, .. } | SolidError::Branching { at, .. } | SolidError::Coarse { at, .. },
            ) => at,
            _ => self.bounds.low.into(),
        };
        Err(SolidError::Coarse { at, spacing }.into())
    }
}

/// The value at a point, trilinear between the middles of voxels and constant beyond.
fn interpolated(counts: &[usize; 3], sizes: &[f64; 3], values: &[f64], x: &Vec3) -> f64 {
    let at: [f64; 3] = array_of(|i| (x[i] / sizes[i] - 0.5).clamp(0.0, (counts[i] - 1) as f64));
    let low = at.each(|at| at as usize);
    let value = |corner: usize| {
        let place: [usize; 3] = array_of(|i| (low[i] + (corner >> i & 1)).min(counts[i] - 1));
        values[place[0] + counts[0] * (place[1] + counts[1] * place[2])]
    };
    let weight = |corner: usize| -> f64 {
        let part = |i: usize| at[i] - low[i] as f64;
        (0..3).map(|i| if corner >> i & 1 == 1 { part(i) } else { 1.0 - part(i) }).product()
    };
    sum_of(8, |corner| weight(corner) * value(corner))
}
