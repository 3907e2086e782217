//! The solid that a closed surface of triangles encloses.

use std::path::Path;

use crate::each::{Each, EachOf, IntoEach};
use crate::error::{GeometryError, Invalid, SolidError};
use crate::geometry::{Block, Bounds, Point, Vec3, double_area, mean};
use crate::mesh::Mesh;

use super::crossing::first_crossing;
use super::tree::Tree;
use super::weld::{ADDED, drop_doubles, drop_spare, turn_flat, weld};
use super::{orient, stl};

/// Vertices closer than this part of the largest coordinate are one: in files of single precision, and of arrays.
const SAME_IN_FILES: f64 = 5e-7;
pub(super) const SAME: f64 = 1e-12;
/// Sizes with which areas and volumes neither overflow nor vanish.
const SIZES: [f64; 2] = [1e-60, 1e60];
/// Facets of one surface: their sides are counted by 32 bits.
const MOST: usize = 1 << 30;

/// The solid that a closed surface of triangles encloses, with named parts of its boundary.
///
/// Facets are counter-clockwise seen from outside. Vertices at one place are one, facets without area are gone, openings of less
/// than a thousandth of the surface are closed, facets and whole parts that face the wrong way are turned. A closed part within
/// another is a cavity, whichever way it faces, and one within a cavity is solid. [`check::surface`](crate::check::surface) lists what is
/// mended.
///
/// ```
/// use rkpm::solid::{Select, Solid3};
/// use rkpm::geometry::Point;
/// // A tetrahedron, one of its facets turned inwards.
/// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Point::<3>::from);
/// let solid = Solid3::new(corners.to_vec(), vec![[0, 1, 2], [0, 1, 3], [1, 2, 3], [2, 0, 3]])?
///     .name("base", Select::plane([0.0, 0.0, 0.0], [0.0, 0.0, -1.0]))?;
/// assert!((solid.volume() - 1.0 / 6.0).abs() < 1e-15);
/// assert_eq!(solid.facets_of("base")?.len(), 1);
/// assert!(solid.contains(&[0.1, 0.1, 0.1].into()) && !solid.contains(&[0.5, 0.5, 0.5].into()));
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Solid3 {
    pub(super) vertices: Vec<Vec3>,
    pub(super) facets: Vec<[u32; 3]>,
    pub(super) normals: Vec<Vec3>,
    pub(super) tree: Tree,
    parts: Vec<(String, Vec<u32>)>,
    bounds: Bounds<3>,
    area: f64,
    volume: f64,
}

/// The nearest point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closest {
    /// The facet that it lies on, the first where several are as near.
    pub facet: usize,
    /// The point.
    pub point: Vec3,
    /// How far it is \[length\].
    pub distance: f64,
}

impl Solid3 {
    /// The solid within facets, three vertices each.
    ///
    /// # Errors
    /// [`GeometryError::Solid`] where the surface is empty, open, one-sided, crosses itself, or has walls within the solid, each
    /// with the place; [`GeometryError::Invalid`] for coordinates that are not finite.
    pub fn new(vertices: Vec<Vec3>, facets: Vec<[u32; 3]>) -> Result<Self, GeometryError> {
        Ok(Self::closed(&vertices, &facets, SAME)?.0)
    }

    /// Reads an STL file, binary or ASCII. Where an ASCII file has several sections, their names are those of boundary parts.
    ///
    /// # Errors
    /// As [`new`](Solid3::new), and where the file can't be read, ends early or is no STL.
    pub fn stl(path: impl AsRef<Path>) -> Result<Self, GeometryError> {
        let path = path.as_ref();
        let read = std::fs::read(path)
            .map_err(|error| SolidError::Read { path: path.display().to_string(), what: error.to_string() })?;
        Self::parse_stl(&read)
    }

    /// Reads the bytes of such a file.
    ///
    /// # Errors
    /// As [`stl`](Solid3::stl).
    pub fn parse_stl(bytes: &[u8]) -> Result<Self, GeometryError> {
        let stl::Listed { vertices, sections } = stl::parse(bytes)?;
        let count = vertices.len() / 3;
        let facets: Vec<[u32; 3]> = (0..count as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        let many = sections.len() > 1;
        let section = |facet: usize| sections.partition_point(|(_, first)| *first <= facet).checked_sub(1);
        let name = |facet| section(facet).filter(|_| many).map(|section| sections[section].0.as_str());
        Self::named_by(&vertices, &facets, SAME_IN_FILES, name)
    }

    /// The solid within the surface of a mesh: the faces of one cell alone, quadrangles cut in two. Groups of faces keep their
    /// names.
    ///
    /// # Errors
    /// As [`new`](Solid3::new).
    pub fn of_mesh(mesh: &Mesh<3>) -> Result<Self, GeometryError> {
        let (facets, named) = mesh.surface();
        let (mut solid, origins) = Self::closed(mesh.points(), &facets, SAME)?;
        for (name, members) in named {
            let mut given = vec![false; facets.len()];
            members.iter().for_each(|&member| given[member as usize] = true);
            for (facet, &origin) in origins.iter().enumerate() {
                if origin != ADDED && given[origin as usize] {
                    solid.part_mut(&name).push(facet as u32);
                }
            }
        }
        Ok(solid)
    }

    /// The solid within facets that may have names.
    pub(super) fn named_by<'a>(
        vertices: &[Vec3],
        facets: &[[u32; 3]],
        same: f64,
        name: impl Fn(usize) -> Option<&'a str>,
    ) -> Result<Self, GeometryError> {
        let (mut solid, origins) = Self::closed(vertices, facets, same)?;
        for (facet, &origin) in origins.iter().enumerate().filter(|(_, origin)| **origin != ADDED) {
            if let Some(name) = name(origin as usize) {
                solid.part_mut(name).push(facet as u32);
            }
        }
        Ok(solid)
    }

    /// The solid, and for each of its facets the one given that it comes from.
    fn closed(vertices: &[Vec3], facets: &[[u32; 3]], same: f64) -> Result<(Self, Vec<u32>), GeometryError> {
        let largest = checked(vertices, facets)?;
        let tolerance = same * largest;
        let (vertices, mut facets) = weld(vertices, facets, tolerance);
        drop_doubles(&mut facets);
        drop_spare(&vertices, &mut facets, tolerance);
        orient::agree(&vertices, &mut facets)?;
        turn_flat(&vertices, &mut facets, tolerance);
        orient::close(&vertices, &mut facets)?;
        turn_flat(&vertices, &mut facets, tolerance);
        ensure!(
            !facets.is_empty(),
            SolidError::Empty {
                what: "no facet encloses anything",
                remedy: "give a closed surface of facets with areas"
            }
        );
        let origins: Vec<u32> = facets.mapped(|facet| facet.origin);
        let solid = Self::measured(vertices, facets.mapped(|facet| facet.corners));
        if let Some((count, first)) = first_crossing(&solid.vertices, &solid.facets, &solid.tree) {
            // A facet that closes an opening has no number but its own.
            let given = |facet: u32| match origins[facet as usize] {
                ADDED => facet as usize,
                origin => origin as usize,
            };
            let facets = first.facets.each(given);
            return Err(SolidError::Crossing { count, facets, at: first.at }.into());
        }
        Ok((solid.outward()?, origins))
    }

    /// Turns closed parts outwards, those within others inwards, and so on: parts do not cross, and so a place that one more of them goes around
    /// is hollow where the one before is solid.
    fn outward(self) -> Result<Self, GeometryError> {
        let (part, widest) = self.widest_of_parts();
        let stray = |solid: &Self| widest.iter().copied().find(|&facet| solid.sides(facet) != [0, 1]);
        if stray(&self).is_none() {
            return Ok(self);
        }
        let mut volumes = vec![0.0; widest.len()];
        let middle = self.bounds.middle();
        for (facet, &part) in self.facets.iter().zip(&part) {
            volumes[part as usize] += (self.vertices[facet[0] as usize] - middle).dot(&normal(&self.vertices, *facet));
        }
        let outward = self.turned(&part, |part| volumes[part] < 0.0);
        // As many as go around the part.
        let around: Vec<i64> = widest.mapped(|&facet| outward.sides(facet)[0]);
        let solid = outward.turned(&part, |part| around[part] % 2 != 0);
        match stray(&solid) {
            None => Ok(solid),
            Some(facet) => Err(SolidError::Nested { at: solid.centre(facet).into() }.into()),
        }
    }

    /// The same with parts turned for which a predicate holds.
    fn turned(self, part: &[u32], is_turned: impl Fn(usize) -> bool) -> Self {
        let mut facets = self.facets;
        for (facet, _) in facets.iter_mut().zip(part).filter(|(_, part)| is_turned(**part as usize)) {
            facet.swap(1, 2);
        }
        Self::measured(self.vertices, facets)
    }

    /// The connected part of each facet, and the largest facet of each part, which tells which side of it is inside.
    pub(super) fn widest_of_parts(&self) -> (Vec<u32>, Vec<usize>) {
        let (part, count) = orient::parts(&self.facets);
        let mut widest = vec![(0.0, 0); count];
        for (k, &part) in part.iter().enumerate() {
            let area = normal(&self.vertices, self.facets[k]).norm();
            if !(area <= widest[part as usize].0) {
                widest[part as usize] = (area, k);
            }
        }
        (part, widest.into_mapped(|(_, facet)| facet))
    }

    /// How often the surface winds about points just in front of and just behind a facet.
    pub(super) fn sides(&self, facet: usize) -> [i64; 2] {
        let corners = self.corners(facet);
        let size = normal(&self.vertices, self.facets[facet]).norm().sqrt();
        let height = 1e-3 * size.min(2.0 * size * size / corners.summed(|x| (x - corners[0]).norm()));
        let step = self.normals[facet] * height;
        [1.0, -1.0].each(|side| self.winding_number(&(self.centre(facet) + step * side)).round() as i64)
    }

    /// Normals, tree, area and volume of facets that face outwards.
    pub(super) fn measured(vertices: Vec<Vec3>, facets: Vec<[u32; 3]>) -> Self {
        let bounds = Bounds::of(facets.iter().flatten().map(|vertex| &vertices[*vertex as usize]));
        let middle = bounds.middle();
        let (mut area, mut volume) = (0.0, 0.0);
        let normals = facets.iter().map(|&facet| {
            let normal = normal(&vertices, facet);
            let double = normal.norm();
            area += 0.5 * double;
            // About the middle: about a distant origin the shares would cancel.
            volume += (vertices[facet[0] as usize] - middle).dot(&normal) / 6.0;
            if double > 0.0 { normal / double } else { Point::zeros() }
        });
        let normals = normals.collect();
        let tree = Tree::new(&vertices, &facets);
        Solid3 { vertices, facets, normals, tree, parts: Vec::new(), bounds, area, volume }
    }

    pub(super) fn part_mut(&mut self, name: &str) -> &mut Vec<u32> {
        let place = self.parts.iter().position(|(known, _)| known == name).unwrap_or_else(|| {
            self.parts.push((name.to_string(), Vec::new()));
            self.parts.len() - 1
        });
        &mut self.parts[place].1
    }

    /// The facets of a named part, rising.
    ///
    /// # Errors
    /// [`GeometryError::UnknownPart`] where no part has the name.
    pub fn facets_of(&self, name: &str) -> Result<&[u32], GeometryError> {
        let found = self.parts.iter().find(|(known, _)| known == name);
        found.map(|(_, facets)| facets.as_slice()).ok_or_else(|| {
            let known: Vec<&str> = self.names().collect();
            let known = if known.is_empty() { "no names yet".to_string() } else { known.join(", ") };
            GeometryError::UnknownPart { part: name.to_string(), known }
        })
    }

    /// The names of boundary parts.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.parts.iter().map(|(name, _)| name.as_str())
    }

    /// Positions of the vertices \[length\].
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// The vertices of each facet, counter-clockwise seen from outside.
    pub fn facets(&self) -> &[[u32; 3]] {
        &self.facets
    }

    /// The outward unit normal of each facet.
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// Positions of a facet's vertices.
    ///
    /// # Panics
    /// For a facet beyond the last.
    pub fn corners(&self, facet: usize) -> [Vec3; 3] {
        self.facets[facet].each(|vertex| self.vertices[vertex as usize])
    }

    pub(super) fn centre(&self, facet: usize) -> Vec3 {
        mean(&self.corners(facet))
    }

    /// The volume enclosed \[length³\].
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// The area of the surface \[length²\].
    pub fn area(&self) -> f64 {
        self.area
    }

    /// The smallest block around the solid.
    pub fn bounds(&self) -> Block<3> {
        Block { min: self.bounds.low, max: self.bounds.high }
    }

    /// How often the surface winds about a point: one inside, zero outside, to a few hundredths; on the surface a half.
    ///
    /// $w(x) = \frac1{4\pi}\int_{\partial\Omega} \frac{n\cdot(y-x)}{|y-x|^3}\mathrm dA_y$; far facets count by their moments
    /// (Barill et al. 2018).
    pub(crate) fn winding_number(&self, x: &Vec3) -> f64 {
        self.tree.winding_number(x)
    }

    /// Whether a point is inside: its winding number is above a half.
    pub fn contains(&self, x: &Vec3) -> bool {
        self.bounds.holds(x) && self.winding_number(x) > 0.5
    }

    /// The nearest point of the surface.
    pub fn closest(&self, x: &Vec3) -> Closest {
        // A solid has facets.
        let (facet, point, distance) = self.tree.closest(x).unwrap_or((0, *x, f64::NAN));
        Closest { facet: facet as usize, point, distance }
    }
}

/// Twice a facet's area along its normal.
fn normal(vertices: &[Vec3], facet: [u32; 3]) -> Vec3 {
    double_area(&facet.each(|vertex| vertices[vertex as usize]))
}

/// The largest coordinate of vertices in use; refuses what can't be computed with.
pub(super) fn checked(vertices: &[Vec3], facets: &[[u32; 3]]) -> Result<f64, GeometryError> {
    ensure!(
        !facets.is_empty(),
        SolidError::Empty { what: "the surface has no facets", remedy: "give a closed surface" }
    );
    ensure!(
        facets.len() <= MOST,
        GeometryError::Count { what: "facets", count: facets.len(), needed: "up to 2^30 are possible" }
    );
    let mut largest = 0.0f64;
    let mut bounds = Bounds::none();
    for (facet, corners) in facets.iter().enumerate() {
        for &vertex in corners {
            let dangling = SolidError::DanglingVertex { facet, vertex, count: vertices.len() };
            let x = vertices.get(vertex as usize).ok_or(dangling)?;
            if let Some(&value) = x.iter().find(|value| !(value.abs() <= SIZES[1])) {
                let what = format!("coordinate of vertex {vertex}, facet {facet}");
                return Err(Invalid::new(what, value, "give finite coordinates of a size below 1e60").into());
            }
            bounds = bounds.join(&Bounds::of([x]));
            largest = largest.max(x.amax());
        }
    }
    let extent = bounds.extent().amax();
    ensure!(
        extent >= SIZES[0],
        Invalid::new("extent of the surface", extent, "all vertices are at one place: give a solid")
    );
    Ok(largest)
}
