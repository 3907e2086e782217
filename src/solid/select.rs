//! Facets of a solid chosen by place.

use crate::each::Each;
use crate::error::{GeometryError, Invalid, SolidError};
use crate::geometry::Vec3;

use super::closed::Solid3;

/// How far vertices may lie off a plane, cylinder or block, over the largest side of the solid's bounds.
const OFF: f64 = 1e-4;
/// Largest angle between normals of one plane; of a cylinder and its radii; of facets of one patch \[rad\].
const PLANE: f64 = 0.1;
const CYLINDER: f64 = 0.6;
const SMOOTH: f64 = 0.5;

/// A choice of whole facets of a [`Solid3`] by their place.
///
/// ```
/// # use rkpm::solid::{Select, Solid3};
/// # use rkpm::mesh::{CellShape, Mesh};
/// # let points = [0.0, 1.0].iter().flat_map(|&z| [[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]]);
/// # let points = points.map(rkpm::geometry::Point::<3>::from).collect();
/// # let cube = Solid3::of_mesh(&Mesh::new(points, &[(CellShape::Hexahedron, (0..8).collect())], &[])?)?;
/// let cube = cube // of side 1
///     .name("base", Select::plane([0.0, 0.0, 0.0], [0.0, 0.0, -1.0]))?
///     .name("right", Select::nearest([1.0, 0.5, 0.5]))?
///     .name("upper half", Select::block([0.0, 0.0, 0.5], [1.0, 1.0, 1.0]))?;
/// assert_eq!(cube.facets_of("right")?.len(), 2);
/// let missing = cube.name("hole", Select::cylinder([0.5, 0.5, 0.0], [0.0, 0.0, 1.0], 0.1));
/// assert!(missing.is_err_and(|error| error.to_string().contains("\"hole\" selects no facet")));
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Select {
    shape: Shape,
    off: Option<f64>,
    angle: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    Plane { point: Vec3, normal: Vec3 },
    Cylinder { point: Vec3, axis: Vec3, radius: f64 },
    Block { min: Vec3, max: Vec3 },
    Nearest(Vec3),
    Patch(usize),
    Facets(Vec<u32>),
}

impl Select {
    fn of(shape: Shape, angle: f64) -> Self {
        Select { shape, off: None, angle }
    }

    /// Facets in the plane through a point whose outward normals are along `normal`, of any length.
    pub fn plane(point: [f64; 3], normal: [f64; 3]) -> Self {
        Self::of(Shape::Plane { point: point.into(), normal: normal.into() }, PLANE)
    }

    /// Facets with all vertices at a distance `radius` \[length\] from the line through a point, whose normals are along the radii to these.
    pub fn cylinder(point: [f64; 3], axis: [f64; 3], radius: f64) -> Self {
        Self::of(Shape::Cylinder { point: point.into(), axis: axis.into(), radius }, CYLINDER)
    }

    /// Facets that lie wholly in a block.
    pub fn block(min: [f64; 3], max: [f64; 3]) -> Self {
        Self::of(Shape::Block { min: min.into(), max: max.into() }, 0.0)
    }

    /// The smooth patch, up to edges of more than 0.5 rad, with the facet nearest to a point.
    pub fn nearest(point: [f64; 3]) -> Self {
        Self::of(Shape::Nearest(point.into()), SMOOTH)
    }

    /// A smooth patch between edges of more than 0.5 rad, by its number in [`Solid3::patches`].
    pub fn patch(number: usize) -> Self {
        Self::of(Shape::Patch(number), SMOOTH)
    }

    /// Facets by their numbers.
    pub fn facets(numbers: impl IntoIterator<Item = u32>) -> Self {
        Self::of(Shape::Facets(numbers.into_iter().collect()), 0.0)
    }

    /// How far vertices may lie off a plane, cylinder or block \[length\]; 1e-4 of the solid's largest side if not said.
    pub fn within(mut self, distance: f64) -> Self {
        self.off = Some(distance);
        self
    }

    /// The angle \[rad\] at which patches end; for planes and cylinders how far normals may be off.
    pub fn angle(mut self, angle: f64) -> Self {
        self.angle = angle;
        self
    }

    /// The facets chosen, rising; how it selects and what comes nearest where there are none.
    fn select(&self, solid: &Solid3) -> Result<Vec<u32>, [String; 2]> {
        let found = match &self.shape {
            Shape::Nearest(point) if point.iter().all(|x| x.is_finite()) => {
                let facet = solid.closest(point).facet as u32;
                let patches = solid.patches(self.angle);
                patches.into_iter().find(|patch| patch.binary_search(&facet).is_ok()).unwrap_or_default()
            }
            Shape::Nearest(_) => Vec::new(),
            Shape::Patch(number) => solid.patches(self.angle).get(*number).cloned().unwrap_or_default(),
            Shape::Facets(numbers) => {
                let mut numbers = numbers.clone();
                numbers.retain(|&facet| (facet as usize) < solid.facets().len());
                numbers.sort_unstable();
                numbers.dedup();
                numbers
            }
            _ => {
                let off = self.off.unwrap_or(OFF * (solid.bounds().max - solid.bounds().min).amax());
                let chosen = |&facet: &u32| self.misses(solid, facet as usize) <= off;
                (0..solid.facets().len() as u32).filter(chosen).collect()
            }
        };
        if found.is_empty() { Err([self.words(), self.nearest_miss(solid)]) } else { Ok(found) }
    }

    /// The furthest distance of a facet's vertices from the shape; infinite where its normal is another.
    fn misses(&self, solid: &Solid3, facet: usize) -> f64 {
        let corners = solid.corners(facet);
        let own = solid.normals()[facet];
        let furthest = |off: &dyn Fn(&Vec3) -> f64| corners.largest(off);
        let limit = |off: f64, fits: bool| if fits { off } else { f64::INFINITY };
        match &self.shape {
            Shape::Plane { point, normal } => {
                let normal = normal.normalize();
                let off = furthest(&|x| nan_far((x - point).dot(&normal).abs()));
                limit(off, own.dot(&normal) >= self.angle.cos())
            }
            Shape::Cylinder { point, axis, radius } => {
                let axis = axis.normalize();
                let out = |x: &Vec3| (x - point) - axis * (x - point).dot(&axis);
                let off = furthest(&|x| nan_far((out(x).norm() - radius).abs()));
                limit(off, corners.iter().all(|x| own.dot(&out(x).normalize()).abs() >= self.angle.cos()))
            }
            Shape::Block { min, max } => furthest(&|x| nan_far((x - x.sup(min).inf(max)).norm())),
            _ => f64::INFINITY,
        }
    }

    fn words(&self) -> String {
        match &self.shape {
            Shape::Plane { point, normal } => {
                format!("the plane at {:?} facing {:?}", point.as_slice(), normal.as_slice())
            }
            Shape::Cylinder { point, axis, radius } => {
                format!("the cylinder of radius {radius} about {:?} along {:?}", point.as_slice(), axis.as_slice())
            }
            Shape::Block { min, max } => format!("the block from {:?} to {:?}", min.as_slice(), max.as_slice()),
            Shape::Nearest(point) => format!("the patch nearest to {:?}", point.as_slice()),
            Shape::Patch(number) => format!("patch {number}"),
            Shape::Facets(numbers) => format!("a list of {} numbers", numbers.len()),
        }
    }

    fn nearest_miss(&self, solid: &Solid3) -> String {
        match &self.shape {
            Shape::Nearest(_) => "give a finite point".to_string(),
            Shape::Patch(_) => format!("there are {} patches, counted from 0", solid.patches(self.angle).len()),
            Shape::Facets(_) => format!("there are {} facets, counted from 0", solid.facets().len()),
            _ => {
                let all = (0..solid.facets().len()).map(|facet| (self.misses(solid, facet), facet));
                match all.min_by(|a, b| a.0.total_cmp(&b.0)) {
                    Some((off, facet)) if off.is_finite() => format!(
                        "the nearest facet, at X = {:?}, lies off it by {off:.3e}; move it, or allow that with `within`",
                        solid.centre(facet).as_slice()
                    ),
                    _ => "no facet faces that way; turn the normal or axis, or allow more with `angle`".to_string(),
                }
            }
        }
    }
}

impl Solid3 {
    /// Names a part of the boundary; facets already named keep their other names, those of the same name stay in it.
    ///
    /// # Errors
    /// [`SolidError::NothingSelected`] where no facet is selected, [`GeometryError::Nameless`] for an empty name.
    pub fn name(mut self, name: &str, select: Select) -> Result<Self, GeometryError> {
        if name.trim().is_empty() {
            return Err(GeometryError::Nameless { what: "a part of a solid" });
        }
        for (what, value) in [("Select::within", select.off.unwrap_or(0.0)), ("Select::angle", select.angle)] {
            ensure!(
                value >= 0.0 && value.is_finite(),
                Invalid::new(format!("{what} of part {name}"), value, "give a finite number from 0 on")
            );
        }
        let found = select.select(&self).map_err(|[by, nearest]| SolidError::NothingSelected {
            name: name.to_string(),
            by,
            nearest,
        })?;
        let part = self.part_mut(name);
        part.extend(found);
        part.sort_unstable();
        part.dedup();
        Ok(self)
    }
}

/// What is no number is as far as can be.
fn nan_far(distance: f64) -> f64 {
    if distance.is_nan() { f64::INFINITY } else { distance }
}
