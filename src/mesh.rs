//! Meshes drawn elsewhere: nodes, cells and named groups, from Gmsh's files or from arrays.
//!
//! A mesh is data: particles and background cells are made of it by [`cells::Unstructured`](crate::cells::Unstructured).

mod elements;
mod msh;
mod parts;
mod refine;
mod shape;

use crate::each::{Each, EachOf, array_of, sum_of};
use crate::error::MeshError;
use crate::geometry::{Point, padded};
use elements::{Content, Elements, Group};
pub use shape::CellShape;
pub(crate) use shape::spanned;
use std::collections::HashMap;
use std::path::Path;

/// Nodes, cells, faces and edges with named groups of them, in the plane (`Mesh<2>`) or in space (`Mesh<3>`).
///
/// [`read`](Mesh::read) takes Gmsh's MSH 2.2 and 4.1, ASCII and binary of either byte order: physical groups keep their
/// names, those without one are named by their number. Elements of second order are read by their corners; the middles of
/// their edges are what [`refined`](Mesh::refined) meshes follow. Nodes that no
/// element of the body uses are left out. In the plane all nodes have one Z, which is dropped.
///
/// ```
/// use rkpm::mesh::{CellShape, Mesh};
/// use rkpm::geometry::Point;
/// let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Point::<3>::from);
/// // One tetrahedron and the triangle on which it stands; groups name elements counted through all blocks.
/// let blocks = [(CellShape::Tetrahedron, vec![0, 1, 2, 3]), (CellShape::Triangle, vec![0, 2, 1])];
/// let groups = [("rubber".to_string(), vec![0]), ("base".to_string(), vec![1])];
/// let mesh = Mesh::new(points.to_vec(), &blocks, &groups)?;
/// assert!((mesh.measure("rubber")? - 1.0 / 6.0).abs() < 1e-15);
/// assert!((mesh.measure("base")? - 0.5).abs() < 1e-15);
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh<const D: usize> {
    points: Vec<Point<D>>,
    /// Elements by their dimension.
    elements: [Elements; 4],
    groups: Vec<Group>,
    /// Middles of curved edges by their ends, the lower one first: what refined meshes follow.
    curved: HashMap<[u32; 2], Point<D>>,
}

/// Takes nodes, elements and groups of a body out of what a file has.
fn gathered(dimension: usize, content: Content) -> Result<Content, MeshError> {
    let Content { points: all, mut elements, mut groups, middles } = content;
    let highest = (0..=3).rev().find(|&k| elements[k].len() > 0).unwrap_or(0);
    ensure!(
        highest == dimension,
        MeshError::Dimension {
            what: format!("the mesh has cells of dimension {highest}, but is read as Mesh<{dimension}>"),
            remedy: if highest > dimension {
                "read it as Mesh<3>, with the kinematics Solid"
            } else {
                "export the cells of the body too (in Gmsh: a physical group of its volumes or surfaces), or read it as Mesh<2>"
            }
        }
    );
    // Nodes of the body, in the order of the file; corners of arcs and middles of edges are no particles.
    const UNUSED: u32 = u32::MAX;
    let mut number = vec![UNUSED; all.len()];
    for &node in elements[dimension].all_corners() {
        number[node as usize] = 0;
    }
    let mut points = Vec::with_capacity(number.iter().filter(|n| **n == 0).count());
    let level = number.iter().position(|n| *n == 0).map_or(0.0, |first| all[first][2]);
    let mut extent = 0.0f64;
    for (number, x) in number.iter_mut().zip(&all).filter(|(number, _)| **number == 0) {
        if let Some(value) = x.iter().find(|value| !value.is_finite()) {
            let what = format!("coordinate {value} of a node");
            return Err(MeshError::Array { what, remedy: "give finite coordinates" });
        }
        *number = points.len() as u32;
        points.push(array_of(|i| if i < dimension { x[i] } else { 0.0 }));
        extent = extent.max((x[0] - all[0][0]).abs()).max((x[1] - all[0][1]).abs());
    }
    if dimension == 2 && all.iter().zip(&number).any(|(x, n)| *n != UNUSED && (x[2] - level).abs() > 1e-9 * extent) {
        let what =
            "the cells are triangles or quadrangles on a surface in 3D, but the mesh is read as a body in the plane";
        let remedy = "draw the body in the plane Z = 0; shells are not modelled";
        return Err(MeshError::Dimension { what: what.to_string(), remedy });
    }
    let mut curved = HashMap::new();
    for (ends, middle) in middles {
        let [a, b] = ends.each(|end| number[end as usize]);
        if a != UNUSED && b != UNUSED && middle.iter().all(|x| x.is_finite()) {
            curved.insert([a.min(b), a.max(b)], middle);
        }
    }
    drop(all);
    // Elements on nodes that the body does not have belong to something else.
    for lower in 0..dimension {
        let list = std::mem::take(&mut elements[lower]);
        let whole = |element: usize| list.corners(element).iter().all(|&node| number[node as usize] != UNUSED);
        if (0..list.len()).all(whole) {
            elements[lower] = list;
            continue;
        }
        let mut kept = Elements::default();
        let mut place = vec![UNUSED; list.len()];
        for element in (0..list.len()).filter(|&element| whole(element)) {
            place[element] = kept.len() as u32;
            kept.push(list.shape(element), list.corners(element).iter().copied());
        }
        for group in groups.iter_mut().filter(|group| group.dimension == lower) {
            group.members = group.members.iter().map(|&m| place[m as usize]).filter(|m| *m != UNUSED).collect();
        }
        elements[lower] = kept;
    }
    for list in &mut elements {
        for corner in list.all_corners_mut() {
            *corner = number[*corner as usize];
        }
    }
    groups.retain(|group| group.dimension <= dimension && !group.members.is_empty());
    Ok(Content { points, elements, groups, middles: curved })
}

impl<const D: usize> Mesh<D> {
    /// Reads a file of Gmsh, MSH 2.2 or 4.1, ASCII or binary.
    ///
    /// # Errors
    /// Where the file can't be read, is of another version, truncated or malformed, names nodes that it does not have or
    /// gives one twice; for cells that are inverted or not of dimension `D`.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, MeshError> {
        let path = path.as_ref();
        let refused =
            |error: std::io::Error| MeshError::Read { path: path.display().to_string(), what: error.to_string() };
        Self::parse(&std::fs::read(path).map_err(refused)?)
    }

    /// Reads the bytes of such a file.
    ///
    /// # Errors
    /// As [`read`](Mesh::read).
    pub fn parse(bytes: &[u8]) -> Result<Self, MeshError> {
        Self::assemble(msh::parse(bytes)?)
    }

    /// A mesh of arrays, as any reader has them: positions, blocks of elements of one shape with their corners one after
    /// the other, and named groups of elements, counted through all blocks.
    ///
    /// # Errors
    /// For corners that don't exist, numbers that are not finite, groups of mixed dimension, inverted cells, and where no
    /// cell is of dimension `D`.
    pub fn new(
        points: Vec<Point<D>>,
        blocks: &[(CellShape, Vec<usize>)],
        groups: &[(String, Vec<usize>)],
    ) -> Result<Self, MeshError> {
        let mut elements: [Elements; 4] = Default::default();
        let mut places: Vec<(u8, u32)> = Vec::new();
        for (shape, corners) in blocks {
            let each = shape.corner_count();
            ensure!(
                corners.len() % each == 0,
                MeshError::Array {
                    what: format!("{} corners in a block of {}s", corners.len(), shape.name()),
                    remedy: "give each cell all of its corners"
                }
            );
            let list = &mut elements[shape.dimension()];
            for cell in corners.chunks(each) {
                if let Some(&node) = cell.iter().find(|node| **node >= points.len()) {
                    return Err(MeshError::DanglingNode { element: places.len() as u64, node: node as u64 });
                }
                places.push((shape.dimension() as u8, list.len() as u32));
                list.push(*shape, cell.iter().map(|&node| node as u32));
            }
        }
        let mut named = Vec::with_capacity(groups.len());
        for (name, members) in groups {
            ensure!(
                !name.trim().is_empty(),
                MeshError::Array {
                    what: "a group has an empty name".into(),
                    remedy: "give it a name, by which conditions and results find it"
                }
            );
            let mut dimension = None;
            let mut found = Vec::with_capacity(members.len());
            for &member in members {
                let Some(&(own, place)) = places.get(member) else {
                    let what = format!("group {name} names element {member} of {}", places.len());
                    return Err(MeshError::Array { what, remedy: "count elements from 0 through all blocks" });
                };
                ensure!(
                    *dimension.get_or_insert(own) == own,
                    MeshError::Dimension {
                        what: format!("group {name} holds elements of dimension {own} and another one"),
                        remedy: "give each dimension a group of its own"
                    }
                );
                found.push(place);
            }
            found.sort_unstable();
            found.dedup();
            let dimension = dimension.map_or(D, usize::from);
            named.push(Group { name: name.clone(), dimension, members: found });
        }
        let points = points.iter().map(padded::<D, 3>).map(|x| x.into()).collect();
        Self::assemble(Content { points, elements, groups: named, middles: HashMap::new() })
    }

    /// Drops what the body does not use and checks the cells.
    fn assemble(content: Content) -> Result<Self, MeshError> {
        crate::geometry::check_dimension::<D>()
            .map_err(|error| MeshError::Dimension { what: error.to_string(), remedy: "read Mesh<2> or Mesh<3>" })?;
        let Content { points, elements, groups, middles } = gathered(D, content)?;
        let place = |x: &[f64; 3]| padded::<3, D>(&(*x).into());
        let curved = middles.iter().map(|(ends, middle)| (*ends, place(middle))).collect();
        let mut mesh = Mesh { points: points.mapped(place), elements, groups, curved };
        mesh.orient()?;
        Ok(mesh)
    }

    /// Turns mirrored cells round and refuses inverted ones.
    fn orient(&mut self) -> Result<(), MeshError> {
        let mut ways = [Point::<D>::zeros(); 3];
        for cell in 0..self.elements[D].len() {
            let shape = self.elements[D].shape(cell);
            let corners = self.elements[D].corners(cell);
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            let mut largest = 0.0f64;
            for (corner, around) in shape.neighbours().iter().enumerate() {
                let origin = self.points[corners[corner] as usize];
                let mut size = 1.0;
                for (way, &other) in ways.iter_mut().zip(*around) {
                    *way = self.points[corners[other] as usize] - origin;
                    size *= way.norm();
                }
                let measure = spanned(&ways[..D]);
                low = low.min(measure);
                high = high.max(measure);
                largest = largest.max(size);
            }
            // Rounding leaves flat cells 1e-16 of the box of their edges.
            let flat = 1e-14 * largest;
            if low > flat {
                continue;
            }
            if high < -flat {
                let mirrored: [u32; 8] = array_of(|k| shape.mirrored().get(k).map_or(0, |&k| corners[k]));
                let count = corners.len();
                self.elements[D].corners_mut(cell).copy_from_slice(&mirrored[..count]);
                continue;
            }
            let at = self.points[corners[0] as usize].as_slice().to_vec();
            return Err(MeshError::InvertedCell { cell, shape: shape.name(), measure: low, at });
        }
        Ok(())
    }

    /// Positions of the nodes \[length\].
    pub fn points(&self) -> &[Point<D>] {
        &self.points
    }

    /// Number of cells of the body: volumes in space, faces in the plane.
    pub fn cell_count(&self) -> usize {
        self.elements[D].len()
    }

    /// Shape and corners of a cell.
    ///
    /// # Panics
    /// For a cell beyond [`cell_count`](Mesh::cell_count).
    pub fn cell(&self, cell: usize) -> (CellShape, &[u32]) {
        (self.elements[D].shape(cell), self.elements[D].corners(cell))
    }

    /// Corners of a cell as lattices count them: axis 0 runs fastest in hexahedra.
    pub(crate) fn lattice_corners(&self, cell: usize) -> Vec<usize> {
        let (shape, corners) = self.cell(cell);
        let at = |k: &usize| corners[*k] as usize;
        match shape {
            CellShape::Hexahedron => [0, 1, 3, 2, 4, 5, 7, 6].mapped(at),
            _ => corners.mapped(|&node| node as usize),
        }
    }

    /// Names of the groups of elements of a dimension: bodies have dimension `D`, boundary parts one less.
    pub fn groups(&self, dimension: usize) -> impl Iterator<Item = &str> {
        self.groups.iter().filter(move |group| group.dimension == dimension).map(|group| group.name.as_str())
    }

    /// Volume, area or length \[length^k\] of the elements of a group; of the largest dimension where groups share a name.
    ///
    /// # Errors
    /// Where no group has the name.
    pub fn measure(&self, name: &str) -> Result<f64, MeshError> {
        let found = (0..=D).rev().find_map(|dimension| self.group(dimension, name));
        let group = found.ok_or_else(|| self.missing("group", name, 0..=D))?;
        let list = &self.elements[group.dimension];
        let measure = |&member: &u32| {
            let element = member as usize;
            elements::measure(list.shape(element), list.corners(element), &self.points).abs()
        };
        Ok(group.members.summed(measure))
    }

    /// Area or volume of the whole body \[length^D\].
    pub fn total(&self) -> f64 {
        let list = &self.elements[D];
        sum_of(list.len(), |cell| elements::measure(list.shape(cell), list.corners(cell), &self.points).abs())
    }

    /// Corners of the faces of a cell.
    fn faces_of(&self, cell: usize) -> impl Iterator<Item = Vec<u32>> + '_ {
        let (shape, corners) = self.cell(cell);
        shape.faces().iter().map(move |face| face.mapped(|&k| corners[k]))
    }

    pub(crate) fn group(&self, dimension: usize, name: &str) -> Option<&Group> {
        self.groups.iter().find(|group| group.dimension == dimension && group.name == name)
    }

    /// Whether cells alone have a name, and not all of them.
    pub(crate) fn is_volume(&self, name: &str) -> bool {
        let some = |group: &Group| group.members.len() < self.cell_count();
        self.group(D, name).is_some_and(some) && self.group(D - 1, name).is_none()
    }

    /// Corners of the elements of a group.
    pub(crate) fn members(&self, dimension: usize, name: &str) -> impl Iterator<Item = &[u32]> {
        let members = self.group(dimension, name).into_iter().flat_map(|group| &group.members);
        members.map(move |&member| self.elements[dimension].corners(member as usize))
    }

    /// Cells of a body.
    pub(crate) fn member_cells(&self, name: &str) -> impl Iterator<Item = usize> {
        self.group(D, name).into_iter().flat_map(|group| &group.members).map(|&member| member as usize)
    }

    /// The error for a name that does not exist.
    pub(crate) fn missing(
        &self,
        what: &'static str,
        name: &str,
        dimensions: std::ops::RangeInclusive<usize>,
    ) -> MeshError {
        let known: Vec<&str> =
            self.groups.iter().filter(|g| dimensions.contains(&g.dimension)).map(|g| g.name.as_str()).collect();
        let known = if known.is_empty() { "none: name physical groups in Gmsh".to_string() } else { known.join(", ") };
        MeshError::MissingGroup { what, name: name.to_string(), known }
    }
}

/// The corners of a face in one order, whoever names it; places that are not used hold the largest number.
pub(crate) fn face_key(corners: &[u32]) -> [u32; 4] {
    sorted(corners)
}

/// The same of up to `N` corners.
fn sorted<const N: usize>(corners: &[u32]) -> [u32; N] {
    let mut key = [u32::MAX; N];
    key[..corners.len()].copy_from_slice(corners);
    key.sort_unstable();
    key
}
