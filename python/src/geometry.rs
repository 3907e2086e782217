//! Bodies: blocks, drawn regions, meshes, solids and shapes.

use std::ops::Range;

use numpy::PyReadonlyArrayDyn;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rkpm::error::MeshError;
use rkpm::geometry::{Block as BlockOf, Outline as Drawn, Point, Region as RegionOf, Turn};
use rkpm::mesh::{CellShape, Mesh as MeshOf};
use rkpm::scene::Geometry;
use rkpm::solid::{Select, Shape as ShapeOf, Solid3};

use crate::fault::{Error, mistyped, refused};
use crate::place::array;

/// The geometry of a body of one, two or three dimensions.
#[derive(Clone)]
pub(crate) enum AnyGeometry {
    One(Geometry<1>),
    Two(Geometry<2>),
    Three(Geometry<3>),
}

impl AnyGeometry {
    pub(crate) fn of(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(block) = given.cast::<Block>() {
            let Block { min, max } = block.get();
            return Ok(match min.len() {
                1 => AnyGeometry::One(BlockOf::<1>::new(array(min, "block")?, array(max, "block")?).into()),
                2 => AnyGeometry::Two(BlockOf::<2>::new(array(min, "block")?, array(max, "block")?).into()),
                _ => AnyGeometry::Three(BlockOf::<3>::new(array(min, "block")?, array(max, "block")?).into()),
            });
        }
        if let Ok(region) = given.cast::<Region>() {
            return Ok(AnyGeometry::Two(region.get().0.clone().into()));
        }
        if let Ok(solid) = given.cast::<Solid>() {
            return Ok(AnyGeometry::Three((&solid.get().0).into()));
        }
        if let Ok(mesh) = given.cast::<Mesh>() {
            return Ok(match &mesh.get().0 {
                AnyMesh::Two(mesh) => AnyGeometry::Two(mesh.into()),
                AnyMesh::Three(mesh) => AnyGeometry::Three(mesh.into()),
            });
        }
        Err(mistyped("body: give a Block, a Region, a Mesh or a Solid (of a Shape: Solid.shape(shape, spacing))"))
    }

    pub(crate) fn dimension(&self) -> usize {
        match self {
            AnyGeometry::One(_) => 1,
            AnyGeometry::Two(_) => 2,
            AnyGeometry::Three(_) => 3,
        }
    }
}

/// A block between two corners, of one, two or three dimensions [length]. Its faces are `(axis, "min")` and `(axis, "max")`.
#[pyclass(frozen, module = "rkpm")]
pub(crate) struct Block {
    min: Vec<f64>,
    max: Vec<f64>,
}

#[pymethods]
impl Block {
    #[new]
    fn new(min: Vec<f64>, max: Vec<f64>) -> PyResult<Self> {
        if min.len() != max.len() || !(1..=3).contains(&min.len()) {
            let (a, b) = (min.len(), max.len());
            return Err(Error::new_err(format!("block: corners of {a} and {b} components, give 1, 2 or 3 of both")));
        }
        Ok(Block { min, max })
    }
}

/// A closed line of the plane, drawn piece by piece; pieces have names. Draw around the area counter-clockwise.
#[pyclass(frozen, module = "rkpm", from_py_object)]
#[derive(Clone)]
pub(crate) struct Outline(Drawn);

#[pymethods]
impl Outline {
    #[new]
    fn new(start: [f64; 2]) -> Self {
        Outline(Drawn::at(start))
    }

    /// A whole circle.
    #[staticmethod]
    fn circle(name: &str, centre: [f64; 2], radius: f64) -> Self {
        Outline(Drawn::circle(name, centre, radius))
    }

    /// A line to a point.
    fn line(&self, name: &str, to: [f64; 2]) -> Self {
        Outline(self.0.clone().line(name, to))
    }

    /// An arc about a centre to a point, counter-clockwise, or clockwise.
    #[pyo3(signature = (name, to, centre, *, clockwise=false))]
    fn arc(&self, name: &str, to: [f64; 2], centre: [f64; 2], clockwise: bool) -> Self {
        Outline(self.0.clone().arc(name, to, centre, if clockwise { Turn::Right } else { Turn::Left }))
    }

    /// A line back to the start.
    fn close(&self, name: &str) -> Self {
        Outline(self.0.clone().close(name))
    }
}

/// What an outline encloses, without holes. Particles are scattered over it by `spacing` or `particles`.
#[pyclass(frozen, module = "rkpm")]
pub(crate) struct Region(RegionOf);

#[pymethods]
impl Region {
    #[new]
    #[pyo3(signature = (outline, holes=Vec::new()))]
    fn new(outline: Outline, holes: Vec<Outline>) -> PyResult<Self> {
        let holes = holes.into_iter().map(|hole| hole.0);
        Ok(Region(RegionOf::with_holes(outline.0, holes).map_err(refused)?))
    }

    /// The area [length²].
    #[getter]
    fn area(&self) -> f64 {
        self.0.area()
    }

    /// The names of its parts.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.0.parts().to_vec()
    }
}

/// A shape of space made of balls, blocks, cylinders and others by `|`, `&` and `-`. `Solid.shape(shape, spacing)` gives its body.
#[pyclass(frozen, module = "rkpm", from_py_object)]
#[derive(Clone)]
pub(crate) struct Shape(ShapeOf);

#[pymethods]
impl Shape {
    /// A ball.
    #[staticmethod]
    fn sphere(centre: [f64; 3], radius: f64) -> Self {
        Shape(ShapeOf::sphere(centre, radius))
    }

    /// A block between two corners.
    #[staticmethod]
    fn block(min: [f64; 3], max: [f64; 3]) -> Self {
        Shape(ShapeOf::block(min, max))
    }

    /// A cylinder between the centres of its ends.
    #[staticmethod]
    #[pyo3(signature = (start, end, radius))]
    fn cylinder(start: [f64; 3], end: [f64; 3], radius: f64) -> Self {
        Shape(ShapeOf::cylinder(start, end, radius))
    }

    /// A cone between the centres of its ends, with a radius at each.
    #[staticmethod]
    fn cone(start: [f64; 3], end: [f64; 3], first: f64, second: f64) -> Self {
        Shape(ShapeOf::cone(start, end, first, second))
    }

    /// A ring of circular section.
    #[staticmethod]
    fn torus(centre: [f64; 3], axis: [f64; 3], major: f64, minor: f64) -> Self {
        Shape(ShapeOf::torus(centre, axis, major, minor))
    }

    /// All that is behind a plane.
    #[staticmethod]
    fn half_space(point: [f64; 3], normal: [f64; 3]) -> Self {
        Shape(ShapeOf::half_space(point, normal))
    }

    fn __or__(&self, other: &Shape) -> Self {
        Shape(self.0.clone().union(other.0.clone()))
    }

    fn __and__(&self, other: &Shape) -> Self {
        Shape(self.0.clone().intersect(other.0.clone()))
    }

    fn __sub__(&self, other: &Shape) -> Self {
        Shape(self.0.clone().minus(other.0.clone()))
    }

    /// Turned about an axis through the origin [rad].
    fn rotated(&self, axis: [f64; 3], angle: f64) -> Self {
        Shape(self.0.clone().rotated(axis, angle))
    }

    /// Shifted.
    fn translated(&self, by: [f64; 3]) -> Self {
        Shape(self.0.clone().translated(by))
    }

    /// Names the surfaces that have no name yet.
    fn named(&self, name: &str) -> Self {
        Shape(self.0.clone().named(name))
    }
}

/// What a closed surface of triangles encloses; a lattice of particles is laid through it.
#[pyclass(frozen, module = "rkpm")]
pub(crate) struct Solid(Solid3);

#[pymethods]
impl Solid {
    /// The solid of an STL file.
    #[staticmethod]
    fn stl(py: Python<'_>, file: std::path::PathBuf) -> PyResult<Self> {
        Ok(Solid(py.detach(|| Solid3::stl(file)).map_err(refused)?))
    }

    /// The solid of a shape, with facets of about the spacing [length].
    #[staticmethod]
    fn shape(py: Python<'_>, shape: &Shape, spacing: f64) -> PyResult<Self> {
        Ok(Solid(py.detach(|| shape.0.solid(spacing)).map_err(refused)?))
    }

    /// Names facets by one of: `plane=(point, normal)`, `cylinder=(point, axis, radius)`, `block=(min, max)`, `nearest=point` (the
    /// smooth patch next to it).
    #[pyo3(signature = (name, *, plane=None, cylinder=None, block=None, nearest=None))]
    fn name(
        &self,
        name: &str,
        plane: Option<([f64; 3], [f64; 3])>,
        cylinder: Option<([f64; 3], [f64; 3], f64)>,
        block: Option<([f64; 3], [f64; 3])>,
        nearest: Option<[f64; 3]>,
    ) -> PyResult<Self> {
        let select = match (plane, cylinder, block, nearest) {
            (Some((point, normal)), None, None, None) => Select::plane(point, normal),
            (None, Some((point, axis, radius)), None, None) => Select::cylinder(point, axis, radius),
            (None, None, Some((min, max)), None) => Select::block(min, max),
            (None, None, None, Some(point)) => Select::nearest(point),
            _ => return Err(mistyped("name: give one of plane, cylinder, block and nearest")),
        };
        Ok(Solid(self.0.clone().name(name, select).map_err(refused)?))
    }

    /// The volume [length³].
    #[getter]
    fn volume(&self) -> f64 {
        self.0.volume()
    }

    /// Least and largest coordinates.
    #[getter]
    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let BlockOf { min, max } = self.0.bounds();
        (min.into(), max.into())
    }

    /// The names of its parts.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.0.names().map(String::from).collect()
    }
}

enum AnyMesh {
    Two(MeshOf<2>),
    Three(MeshOf<3>),
}

/// A mesh of the plane or of space: particles at its nodes. From a Gmsh file (`Mesh.read`), from arrays, or from an object of meshio or
/// pyvista (`Mesh.of`).
#[pyclass(frozen, module = "rkpm")]
pub(crate) struct Mesh(AnyMesh);

#[pymethods]
impl Mesh {
    /// Points (n × 2 or n × 3); cells by their shape, `{"tetra": corners}`, as meshio names them, of which those of higher order
    /// (`"tetra10"`) are taken by their corners; groups of cells,
    /// `{"base": {"triangle": numbers}}`, counted among those of their shape.
    #[new]
    #[pyo3(signature = (points, cells, groups=None))]
    fn new(points: &Bound<'_, PyAny>, cells: &Bound<'_, PyDict>, groups: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let (points, width) = table(points, "points", |v: f64| v)?;
        let mut blocks: Vec<(CellShape, Vec<usize>)> = Vec::new();
        let mut numbered: Vec<(String, Range<usize>)> = Vec::new();
        let mut count = 0;
        for (name, corners) in cells.iter() {
            let name: String = name.extract()?;
            let Some((shape, needed, nodes)) = shape(&name) else {
                return Err(Error::new_err(format!(
                    "mesh: no cells {name:?}; give vertex, line, triangle, quad, tetra, hexahedron or wedge"
                )));
            };
            let (corners, width) = table(&corners, "cells", |v: i64| usize::try_from(v).unwrap_or(usize::MAX))?;
            if width != nodes {
                return Err(Error::new_err(format!("mesh: {name} cells of {width} corners, give {nodes} for each")));
            }
            numbered.push((name, count..count + corners.len()));
            count += corners.len();
            blocks.push((shape, corners.into_iter().flat_map(|nodes| nodes.into_iter().take(needed)).collect()));
        }
        let mut named: Vec<(String, Vec<usize>)> = Vec::new();
        for (group, by_shape) in groups.into_iter().flatten() {
            let mut elements = Vec::new();
            for (name, numbers) in by_shape.cast::<PyDict>().map_err(|_| mistyped(GROUPS))? {
                let name: String = name.extract()?;
                let Some((_, own)) = numbered.iter().find(|(other, _)| *other == name) else {
                    return Err(Error::new_err(format!("mesh: group {group} has cells {name:?}, the mesh has none")));
                };
                for number in flat(&numbers)? {
                    let element = own.start.saturating_add(number);
                    if !own.contains(&element) {
                        let (what, count) =
                            (format!("mesh: group {group} names a {name} that does not exist"), own.len());
                        return Err(Error::new_err(format!("{what}: count the {count} of them from 0")));
                    }
                    elements.push(element);
                }
            }
            named.push((group.extract()?, elements));
        }
        // Readers give three coordinates in the plane too.
        let solid = blocks
            .iter()
            .any(|(shape, _)| matches!(shape, CellShape::Tetrahedron | CellShape::Hexahedron | CellShape::Prism));
        Ok(Mesh(match solid {
            true => AnyMesh::Three(MeshOf::new(positions(&points, width)?, &blocks, &named).map_err(refused)?),
            false => {
                level(&points, &blocks)?;
                AnyMesh::Two(MeshOf::new(positions(&points, width)?, &blocks, &named).map_err(refused)?)
            }
        }))
    }

    /// Reads a file of Gmsh, MSH 2.2 or 4.1: names are those of its physical groups.
    #[staticmethod]
    fn read(py: Python<'_>, file: std::path::PathBuf) -> PyResult<Self> {
        py.detach(|| match MeshOf::<3>::read(&file) {
            Ok(mesh) => Ok(Mesh(AnyMesh::Three(mesh))),
            // A mesh of the plane has no cells of space.
            Err(error) => match MeshOf::<2>::read(&file) {
                Ok(mesh) => Ok(Mesh(AnyMesh::Two(mesh))),
                // What is wrong with a mesh of the plane, but that it is one.
                Err(flat) => Err(refused(if matches!(error, MeshError::Dimension { .. }) { flat } else { error })),
            },
        })
    }

    /// The mesh of an object of meshio (with its `cell_sets`) or pyvista.
    #[staticmethod]
    fn of(py: Python<'_>, mesh: &Bound<'_, PyAny>) -> PyResult<Self> {
        let cells = PyDict::new(py);
        let given =
            mesh.getattr("cells_dict").map_err(|_| mistyped("mesh: give an object with points and cells_dict"))?;
        for (kind, corners) in given.cast::<PyDict>().map_err(|_| mistyped("mesh: cells_dict is no dictionary"))? {
            // pyvista counts kinds as VTK does.
            let name = match kind.extract::<u32>() {
                Ok(number) => VTK.iter().find(|(own, _)| *own == number).map(|(_, name)| name.to_string()),
                Err(_) => Some(kind.extract::<String>()?),
            };
            let Some(name) = name else {
                return Err(Error::new_err(format!("mesh: cells of VTK's kind {kind} can't be taken, convert them")));
            };
            cells.set_item(name, corners)?;
        }
        let groups = PyDict::new(py);
        if mesh.hasattr("cell_sets_dict")? {
            let sets = mesh.getattr("cell_sets_dict")?;
            let sets = sets.cast::<PyDict>().map_err(|_| mistyped("mesh: cell_sets_dict is no dictionary"))?;
            // Sets of the file's own bookkeeping are no parts.
            for (name, set) in sets.iter().filter(|(name, _)| !name.to_string().starts_with("gmsh:")) {
                groups.set_item(name, set)?;
            }
        }
        Mesh::new(&mesh.getattr("points")?, &cells, Some(&groups))
    }

    /// The mesh of a named volume, or area in the plane, alone.
    fn body(&self, name: &str) -> PyResult<Self> {
        Ok(Mesh(match &self.0 {
            AnyMesh::Two(mesh) => AnyMesh::Two(mesh.body(name).map_err(refused)?),
            AnyMesh::Three(mesh) => AnyMesh::Three(mesh.body(name).map_err(refused)?),
        }))
    }

    /// The names of its parts.
    #[getter]
    fn names(&self) -> Vec<String> {
        fn names<const D: usize>(mesh: &MeshOf<D>) -> Vec<String> {
            (0..=D).flat_map(|dimension| mesh.groups(dimension).map(String::from)).collect()
        }
        match &self.0 {
            AnyMesh::Two(mesh) => names(mesh),
            AnyMesh::Three(mesh) => names(mesh),
        }
    }

    /// Its volume [length³], or area in the plane.
    #[getter]
    fn volume(&self) -> f64 {
        match &self.0 {
            AnyMesh::Two(mesh) => mesh.total(),
            AnyMesh::Three(mesh) => mesh.total(),
        }
    }
}

const GROUPS: &str = "mesh: give groups as {name: {shape: numbers of cells}}";
const VTK: [(u32, &str); 17] = [
    (1, "vertex"),
    (3, "line"),
    (5, "triangle"),
    (9, "quad"),
    (10, "tetra"),
    (12, "hexahedron"),
    (13, "wedge"),
    (21, "line3"),
    (22, "triangle6"),
    (23, "quad8"),
    (24, "tetra10"),
    (25, "hexahedron20"),
    (26, "wedge15"),
    (28, "quad9"),
    (29, "hexahedron27"),
    (32, "wedge18"),
    (34, "triangle7"),
];

/// A shape by its name, how many corners it has, and how many nodes: those of higher order follow the corners, and end the name by their
/// number.
fn shape(name: &str) -> Option<(CellShape, usize, usize)> {
    let plain = name.trim_end_matches(|c: char| c.is_ascii_digit());
    let (shape, corners) = match plain {
        "vertex" => (CellShape::Vertex, 1),
        "line" => (CellShape::Line, 2),
        "triangle" => (CellShape::Triangle, 3),
        "quad" => (CellShape::Quadrangle, 4),
        "tetra" => (CellShape::Tetrahedron, 4),
        "hexahedron" => (CellShape::Hexahedron, 8),
        "wedge" => (CellShape::Prism, 6),
        _ => return None,
    };
    let nodes = match &name[plain.len()..] {
        "" => corners,
        count => count.parse().ok().filter(|nodes| *nodes > corners)?,
    };
    Some((shape, corners, nodes))
}

/// Refuses triangles and quadrangles on a surface in space: its third coordinate would be dropped.
fn level(points: &[Vec<f64>], blocks: &[(CellShape, Vec<usize>)]) -> PyResult<()> {
    let faces = blocks.iter().filter(|(shape, _)| matches!(shape, CellShape::Triangle | CellShape::Quadrangle));
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in faces.flat_map(|(_, corners)| corners).filter_map(|&corner| points.get(corner)) {
        for (axis, value) in point.iter().take(3).enumerate() {
            (low[axis], high[axis]) = (low[axis].min(*value), high[axis].max(*value));
        }
    }
    let extent = |axis: usize| (high[axis] - low[axis]).max(0.0);
    if extent(2) > 1e-9 * extent(0).max(extent(1)) {
        return Err(Error::new_err(
            "mesh: triangles or quads on a surface in space; draw the body in a plane z = const, or give its volumes",
        ));
    }
    Ok(())
}

/// The rows of an array of two dimensions and its width.
fn table<T: numpy::Element + Copy, U>(
    given: &Bound<'_, PyAny>,
    what: &str,
    own: impl Fn(T) -> U,
) -> PyResult<(Vec<Vec<U>>, usize)> {
    let array = numbers::<T>(given, what)?;
    let array = array.as_array();
    let [_, width] = *array.shape() else {
        return Err(Error::new_err(format!("{what}: an array of {:?}, give a row for each", array.shape())));
    };
    Ok((array.rows().into_iter().map(|row| row.iter().map(|value| own(*value)).collect()).collect(), width))
}

fn flat(given: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
    Ok(numbers::<i64>(given, "group")?.as_array().iter().map(|v| usize::try_from(*v).unwrap_or(usize::MAX)).collect())
}

/// An array of one type of numbers, whatever numbers it is given.
pub(crate) fn numbers<'py, T: numpy::Element>(
    given: &Bound<'py, PyAny>,
    what: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    let numpy = given.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (given,))?;
    if array.getattr("dtype")?.getattr("kind")?.extract::<String>()? == "b" {
        return Err(mistyped(format!("{what}: give numbers in place of marks, those of numpy.flatnonzero")));
    }
    // Parts of numbers are not dropped: neither fractions nor imaginary parts. An empty list is of any type.
    let casting = if array.getattr("size")?.extract::<usize>()? == 0 { "unsafe" } else { "same_kind" };
    let keywords = PyDict::new(given.py());
    keywords.set_item("casting", casting)?;
    let array = array.call_method("astype", (T::get_dtype(given.py()),), Some(&keywords));
    let array = array.map_err(|_| mistyped(format!("{what}: give an array of numbers")))?;
    array.extract().map_err(|_| mistyped(format!("{what}: give an array of numbers")))
}

/// Points of a body; coordinates beyond its dimension are dropped.
pub(crate) fn positions<const D: usize>(points: &[Vec<f64>], width: usize) -> PyResult<Vec<Point<D>>> {
    if width < D {
        return Err(Error::new_err(format!("points: {width} coordinates, give {D}")));
    }
    Ok(points.iter().map(|point| Point::from_fn(|i, _| point[i])).collect())
}

/// Points as Python gives them: an array of one for each row, or a single one.
pub(crate) fn points<const D: usize>(given: &Bound<'_, PyAny>) -> PyResult<Vec<Point<D>>> {
    let array = numbers::<f64>(given, "points")?;
    let array = array.as_array();
    if array.shape().last() != Some(&D) || array.ndim() > 2 {
        return Err(Error::new_err(format!("points: an array of {:?}, give rows of {D} coordinates", array.shape())));
    }
    let flat: Vec<f64> = array.iter().copied().collect();
    Ok(flat.chunks(D).map(Point::from_column_slice).collect())
}
