//! Fields for ParaView: `.vtu` (an unstructured grid as XML) and `.pvd` (a path of such files).
//!
//! Arrays are written inline as base64 of little-endian binary behind a 64-bit byte count, so that
//! every number arrives with all its bits and a file needs no companion.

use super::{base64, escaped, write_file};
use crate::each::{Each, EachOf, array_of};
use crate::error::OutputError;
use crate::geometry::{Mat3, padded};
use nalgebra::SVector;
use std::collections::HashSet;
use std::fmt::Write as _;
use std::path::{Component, Path, PathBuf};

/// One cell of a [`VtkGrid`]: indices into its points, in VTK's order.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum VtkCell {
    /// A point: what a particle is.
    Vertex(usize),
    /// A segment.
    Line([usize; 2]),
    /// A triangle.
    Triangle([usize; 3]),
    /// A quadrilateral, around.
    Quad([usize; 4]),
    /// A tetrahedron, the fourth corner on the side the first three turn to.
    Tetrahedron([usize; 4]),
    /// A hexahedron: the lower face around, then the upper one.
    Hexahedron([usize; 8]),
    /// A prism: one triangle, its normal pointing out of the prism, then the other.
    Wedge([usize; 6]),
    /// A polygon with at least three corners, around.
    Polygon(Vec<usize>),
}

impl VtkCell {
    /// The points of the cell.
    #[must_use]
    pub fn corners(&self) -> &[usize] {
        match self {
            Self::Vertex(corner) => std::slice::from_ref(corner),
            Self::Line(corners) => corners,
            Self::Triangle(corners) => corners,
            Self::Quad(corners) | Self::Tetrahedron(corners) => corners,
            Self::Wedge(corners) => corners,
            Self::Hexahedron(corners) => corners,
            Self::Polygon(corners) => corners,
        }
    }

    /// The same cell between points of other numbers.
    pub(super) fn renumbered(&self, number: impl Fn(usize) -> usize) -> Self {
        let number = &number;
        match self {
            Self::Vertex(corner) => Self::Vertex(number(*corner)),
            Self::Line(corners) => Self::Line(corners.each(number)),
            Self::Triangle(corners) => Self::Triangle(corners.each(number)),
            Self::Quad(corners) => Self::Quad(corners.each(number)),
            Self::Tetrahedron(corners) => Self::Tetrahedron(corners.each(number)),
            Self::Hexahedron(corners) => Self::Hexahedron(corners.each(number)),
            Self::Wedge(corners) => Self::Wedge(corners.each(number)),
            Self::Polygon(corners) => Self::Polygon(corners.mapped(|&corner| number(corner))),
        }
    }

    /// VTK's number for the shape (vtkCellType.h).
    fn code(&self) -> u8 {
        match self {
            Self::Vertex(_) => 1,
            Self::Line(_) => 3,
            Self::Triangle(_) => 5,
            Self::Polygon(_) => 7,
            Self::Quad(_) => 9,
            Self::Tetrahedron(_) => 10,
            Self::Hexahedron(_) => 12,
            Self::Wedge(_) => 13,
        }
    }
}

/// The values of a field, one entry per point or per cell.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum VtkValues {
    /// Whole numbers: indices, counts, marks.
    Integers(Vec<i64>),
    /// Numbers.
    Scalars(Vec<f64>),
    /// Vectors with three components.
    Vectors(Vec<[f64; 3]>),
    /// Tensors with nine components, row by row: 11, 12, 13, 21, …
    Tensors(Vec<[f64; 9]>),
}

impl VtkValues {
    /// Number of entries: points or cells, not components.
    #[must_use]
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::Integers(values) => values.len(),
            Self::Scalars(values) => values.len(),
            Self::Vectors(values) => values.len(),
            Self::Tensors(values) => values.len(),
        }
    }

    /// VTK's name of the numbers, and how many of them an entry has.
    pub(super) fn kind(&self) -> (&'static str, usize) {
        match self {
            Self::Integers(_) => ("Int64", 1),
            Self::Scalars(_) => ("Float64", 1),
            Self::Vectors(_) => ("Float64", 3),
            Self::Tensors(_) => ("Float64", 9),
        }
    }
}

/// A named field.
#[derive(Debug, Clone, PartialEq)]
pub struct VtkField {
    /// The name ParaView shows, unique among the fields of the points or of the cells.
    pub name: String,
    /// The values.
    pub values: VtkValues,
}

impl VtkField {
    /// A field of whole numbers.
    pub fn integers(name: impl Into<String>, values: impl IntoIterator<Item = i64>) -> Self {
        Self { name: name.into(), values: VtkValues::Integers(values.into_iter().collect()) }
    }

    /// A scalar field.
    pub fn scalars(name: impl Into<String>, values: impl IntoIterator<Item = f64>) -> Self {
        Self { name: name.into(), values: VtkValues::Scalars(values.into_iter().collect()) }
    }

    /// A vector field from D ≤ 3 components; the missing ones are zero.
    pub fn vectors<const D: usize>(name: impl Into<String>, values: &[SVector<f64, D>]) -> Self {
        Self { name: name.into(), values: VtkValues::Vectors(threes(values)) }
    }

    /// A tensor field: deformation gradients, stresses.
    pub fn tensors(name: impl Into<String>, values: &[Mat3]) -> Self {
        // nalgebra stores columns and VTK wants rows.
        let rows = |m: &Mat3| array_of(|k| m[(k / 3, k % 3)]);
        Self { name: name.into(), values: VtkValues::Tensors(values.mapped(rows)) }
    }
}

/// Vectors of D ≤ 3 components padded with zeros.
fn threes<const D: usize>(vectors: &[SVector<f64, D>]) -> Vec<[f64; 3]> {
    const { assert!(D <= 3, "VTK's points have three components") };
    vectors.mapped(|vector| padded::<D, 3>(vector).into())
}

/// Points, cells between them and fields on both.
///
/// ```
/// use rkpm::nalgebra::Vector2;
/// use rkpm::output::{VtkCell, VtkField, VtkGrid};
/// let particles = [Vector2::new(0.0, 0.0), Vector2::new(1.0, 0.0)];
/// let mut grid = VtkGrid::new(&particles, vec![VtkCell::Line([0, 1])]);
/// grid.point_data.push(VtkField::scalars("pressure", [0.3, 0.4]));
/// assert!(grid.to_xml()?.contains("Name=\"pressure\""));
/// # Ok::<(), rkpm::error::OutputError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct VtkGrid {
    /// Positions, `[length]`.
    pub points: Vec<[f64; 3]>,
    /// Cells; a point that belongs to none is not drawn by ParaView.
    pub cells: Vec<VtkCell>,
    /// Fields with one entry per point.
    pub point_data: Vec<VtkField>,
    /// Fields with one entry per cell.
    pub cell_data: Vec<VtkField>,
}

impl VtkGrid {
    /// A grid from points of D ≤ 3 coordinates and cells, without fields yet.
    #[must_use]
    pub fn new<const D: usize>(points: &[SVector<f64, D>], cells: Vec<VtkCell>) -> Self {
        Self { points: threes(points), cells, ..Self::default() }
    }

    /// The grid as the text of a `.vtu` file.
    ///
    /// # Errors
    /// [`OutputError::Length`] where a field is not as long as the points or cells it belongs to,
    /// two fields share a name, a cell names a point that does not exist, or a polygon has fewer
    /// than three corners.
    pub fn to_xml(&self) -> Result<String, OutputError> {
        self.check()?;
        let mut offsets = Vec::with_capacity(self.cells.len());
        let mut connectivity = Vec::new();
        for cell in &self.cells {
            connectivity.extend(cell.corners().iter().map(|&corner| corner as i64));
            offsets.push(connectivity.len() as i64);
        }
        let types: Vec<u8> = self.cells.mapped(VtkCell::code);

        let mut xml = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n",
        );
        let (points, cells) = (self.points.len(), self.cells.len());
        // Writing into a String cannot fail, here and below.
        let _ = writeln!(xml, "<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"{cells}\">");
        xml.push_str("<Points>\n");
        let coordinates = floats(self.points.as_flattened());
        array(&mut xml, "Points", "Float64", 3, &coordinates);
        xml.push_str("</Points>\n<Cells>\n");
        array(&mut xml, "connectivity", "Int64", 1, &integers(&connectivity));
        array(&mut xml, "offsets", "Int64", 1, &integers(&offsets));
        array(&mut xml, "types", "UInt8", 1, &types);
        xml.push_str("</Cells>\n");
        for (element, fields) in [("PointData", &self.point_data), ("CellData", &self.cell_data)] {
            let _ = writeln!(xml, "<{element}>");
            for field in fields {
                let (kind, components) = field.values.kind();
                let bytes = match &field.values {
                    VtkValues::Integers(values) => integers(values),
                    VtkValues::Scalars(values) => floats(values),
                    VtkValues::Vectors(values) => floats(values.as_flattened()),
                    VtkValues::Tensors(values) => floats(values.as_flattened()),
                };
                array(&mut xml, &field.name, kind, components, &bytes);
            }
            let _ = writeln!(xml, "</{element}>");
        }
        xml.push_str("</Piece>\n</UnstructuredGrid>\n</VTKFile>\n");
        Ok(xml)
    }

    /// Writes the grid as a `.vtu` file, with the directories above it.
    ///
    /// # Errors
    /// As [`to_xml`](Self::to_xml), and [`OutputError::Io`] where the file system refuses.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        write_file(path.as_ref(), &["vtu"], &self.to_xml()?)
    }

    pub(super) fn check(&self) -> Result<(), OutputError> {
        let length = |what: String, given: usize, needed: usize| Err(OutputError::Length { what, given, needed });
        for (index, cell) in self.cells.iter().enumerate() {
            let corners = cell.corners();
            if matches!(cell, VtkCell::Polygon(_)) && corners.len() < 3 {
                return length(format!("corners of polygon {index}"), corners.len(), 3);
            }
            if let Some(&corner) = corners.iter().find(|&&c| c >= self.points.len()) {
                let what = format!("points of the grid, of which cell {index} names {corner}");
                return length(what, self.points.len(), corner.saturating_add(1));
            }
        }
        for (place, fields, needed) in
            [("point", &self.point_data, self.points.len()), ("cell", &self.cell_data, self.cells.len())]
        {
            let mut names = HashSet::new();
            for field in fields {
                if field.values.len() != needed {
                    let what = format!("{place} field {}", field.name);
                    return length(what, field.values.len(), needed);
                }
                // As readers see it: characters that XML forbids have become spaces.
                if !names.insert(escaped(&field.name)) {
                    return length(format!("{place} fields named {}", field.name), 2, 1);
                }
            }
        }
        Ok(())
    }
}

/// The `.vtu` files of a path, in time or load.
///
/// Write it again after each step: the file is complete each time and so can be opened while the
/// analysis still runs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PvdCollection {
    /// Times or load factors and the files, in the order ParaView shall list them.
    entries: Vec<(f64, PathBuf)>,
}

impl PvdCollection {
    /// Appends a file. Its path is written relative to the collection's own directory, so that both may move together; on
    /// another drive it is written in full.
    pub fn push(&mut self, time: f64, file: impl Into<PathBuf>) -> &mut Self {
        self.entries.push((time, file.into()));
        self
    }

    /// Writes the collection as a `.pvd` file, with the directories above it.
    ///
    /// # Errors
    /// [`OutputError::Io`] where the file system refuses, and, with kind `InvalidInput`, where a
    /// time is not finite.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        let path = path.as_ref();
        // However both are written: `./out/run.pvd` and `out/step.vtu` are in one directory.
        let own = located(path);
        let directory = own.parent().unwrap_or_else(|| Path::new(""));
        let mut xml = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n",
        );
        for (time, file) in &self.entries {
            ensure!(
                time.is_finite(),
                OutputError::Io {
                    path: path.display().to_string(),
                    source: std::io::Error::new(
                        std::io::ErrorKind::InvalidInput,
                        format!("time {time} of {} is not finite", file.display()),
                    ),
                }
            );
            let beside = relative(&located(file), directory);
            // ParaView reads forward slashes on every system.
            let name = escaped(&beside.display().to_string().replace('\\', "/"));
            let _ = writeln!(xml, "<DataSet timestep=\"{time}\" part=\"0\" file=\"{name}\"/>");
        }
        xml.push_str("</Collection>\n</VTKFile>\n");
        write_file(path, &["pvd"], &xml)
    }
}

/// The place of a file from the root, without dots and links on the way: `a/../b` is not `b` where `a` is a link.
fn located(file: &Path) -> PathBuf {
    let whole = std::path::absolute(file).unwrap_or_else(|_| file.to_path_buf());
    let (directory, name) = match (whole.parent(), whole.file_name()) {
        (Some(directory), Some(name)) => (directory, Path::new(name)),
        _ => (&*whole, Path::new("")),
    };
    // What is not there yet will be, and no link.
    let known = |there: &Path| Some((there.canonicalize().ok()?, directory.strip_prefix(there).ok()?.to_path_buf()));
    let (mut place, rest) = directory.ancestors().find_map(known).unwrap_or_else(|| (directory.into(), PathBuf::new()));
    for part in rest.components() {
        match part {
            Component::ParentDir => _ = place.pop(),
            part => place.push(part),
        }
    }
    place.join(name)
}

/// The way to a file from a directory, both from the root; the file as it is where they have no root in common.
fn relative(file: &Path, directory: &Path) -> PathBuf {
    let common = file.components().zip(directory.components()).take_while(|(own, other)| own == other).count();
    if common == 0 {
        return file.to_path_buf();
    }
    let up = directory.components().skip(common).map(|_| Component::ParentDir);
    up.chain(file.components().skip(common)).collect()
}

/// Appends one inline binary array: base64 of (byte count, bytes) as a single stream.
fn array(xml: &mut String, name: &str, kind: &str, components: usize, bytes: &[u8]) {
    open_array(xml, "DataArray", name, (kind, components));
    xml.push_str(" format=\"binary\">");
    let mut stream = (bytes.len() as u64).to_le_bytes().to_vec();
    stream.extend_from_slice(bytes);
    xml.push_str(&base64(&stream));
    xml.push_str("</DataArray>\n");
}

/// Appends the beginning of the element of an array.
pub(super) fn open_array(xml: &mut String, element: &str, name: &str, (kind, components): (&str, usize)) {
    let _ = write!(xml, "<{element} type=\"{kind}\" Name=\"{}\"", escaped(name));
    // One is the default; some readers turn an explicit one into a second dimension.
    if components > 1 {
        let _ = write!(xml, " NumberOfComponents=\"{components}\"");
    }
}

fn floats(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

fn integers(values: &[i64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}
