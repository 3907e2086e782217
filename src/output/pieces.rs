//! A grid in pieces, as ranks write it: one `.vtu` file for each, and a `.pvtu` file that names them.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::vtk::{VtkField, VtkGrid, VtkValues, open_array};
use super::{check_ending, escaped, write_file};
use crate::each::{Each, share_of};
use crate::error::OutputError;

impl VtkValues {
    /// The entries at some places.
    fn at(&self, places: &[usize]) -> VtkValues {
        fn pick<T: Copy>(values: &[T], places: &[usize]) -> Vec<T> {
            places.mapped(|&place| values[place])
        }
        match self {
            Self::Integers(values) => Self::Integers(pick(values, places)),
            Self::Scalars(values) => Self::Scalars(pick(values, places)),
            Self::Vectors(values) => Self::Vectors(pick(values, places)),
            Self::Tensors(values) => Self::Tensors(pick(values, places)),
        }
    }
}

/// The entries of fields at some places.
fn fields_at(fields: &[VtkField], places: &[usize]) -> Vec<VtkField> {
    fields.mapped(|field| VtkField { name: field.name.clone(), values: field.values.at(places) })
}

impl VtkGrid {
    /// Piece `part` of `parts`, counted from 0: a run of the cells, the points that they name, and the fields on both. Points
    /// at a border stand in the pieces on both sides, points of no cell in the first piece.
    ///
    /// # Errors
    /// As [`to_xml`](Self::to_xml).
    pub fn piece(&self, part: usize, parts: usize) -> Result<VtkGrid, OutputError> {
        self.check()?;
        let run: Vec<usize> = share_of(self.cells.len(), part, parts).collect();
        let mut named = vec![part == 0; self.points.len()];
        if part == 0 {
            self.cells.iter().flat_map(|cell| cell.corners()).for_each(|&corner| named[corner] = false);
        }
        run.iter().flat_map(|&cell| self.cells[cell].corners()).for_each(|&corner| named[corner] = true);
        let points: Vec<usize> = (0..named.len()).filter(|&point| named[point]).collect();
        let mut number = vec![0; named.len()];
        points.iter().enumerate().for_each(|(own, &point)| number[point] = own);
        Ok(VtkGrid {
            points: points.mapped(|&point| self.points[point]),
            cells: run.mapped(|&cell| self.cells[cell].renumbered(|corner| number[corner])),
            point_data: fields_at(&self.point_data, &points),
            cell_data: fields_at(&self.cell_data, &run),
        })
    }

    /// The text of the `.pvtu` file that names pieces of this grid, by their places relative to it.
    ///
    /// # Errors
    /// As [`to_xml`](Self::to_xml).
    pub(crate) fn index_of_pieces<N: AsRef<str>>(
        &self,
        pieces: impl IntoIterator<Item = N>,
    ) -> Result<String, OutputError> {
        self.check()?;
        let mut xml = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PUnstructuredGrid GhostLevel=\"0\">\n",
        );
        // Writing into a String cannot fail, here and below.
        for (element, fields) in [("PPointData", &self.point_data), ("PCellData", &self.cell_data)] {
            let _ = writeln!(xml, "<{element}>");
            for field in fields {
                open_array(&mut xml, "PDataArray", &field.name, field.values.kind());
                xml.push_str("/>\n");
            }
            let _ = writeln!(xml, "</{element}>");
        }
        xml.push_str(
            "<PPoints>\n<PDataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"/>\n</PPoints>\n",
        );
        for piece in pieces {
            let _ = writeln!(xml, "<Piece Source=\"{}\"/>", escaped(piece.as_ref()));
        }
        xml.push_str("</PUnstructuredGrid>\n</VTKFile>\n");
        Ok(xml)
    }

    /// Writes piece `part` of `parts` beside the `.pvtu` file at `path`, with the directories above it: `run.pvtu` has
    /// `run_0.vtu`, `run_1.vtu` and so on. The first piece's writer also writes the `.pvtu` file.
    ///
    /// Each of several ranks hands in its own number:
    /// ```
    /// use rkpm::nalgebra::Vector2;
    /// use rkpm::output::{VtkCell, VtkGrid};
    /// # let directory = std::env::temp_dir().join(format!("rkpm-pieces-{}", std::process::id()));
    /// let grid = VtkGrid::new(&[Vector2::new(0.0, 0.0), Vector2::new(1.0, 0.0)], vec![VtkCell::Line([0, 1])]);
    /// for rank in 0..2 {
    ///     grid.write_piece(directory.join("cloud.pvtu"), rank, 2)?;
    /// }
    /// assert!(directory.join("cloud_1.vtu").exists());
    /// # std::fs::remove_dir_all(&directory).unwrap();
    /// # Ok::<(), rkpm::error::OutputError>(())
    /// ```
    ///
    /// # Errors
    /// As [`write`](Self::write).
    pub fn write_piece(&self, path: impl AsRef<Path>, part: usize, parts: usize) -> Result<(), OutputError> {
        let path = path.as_ref();
        check_ending(path, &["pvtu"])?;
        self.piece(part, parts)?.write(beside(path, part))?;
        if part > 0 {
            return Ok(());
        }
        let name = |part| beside(path, part).file_name().unwrap_or_default().to_string_lossy().into_owned();
        write_file(path, &["pvtu"], &self.index_of_pieces((0..parts.max(1)).map(name))?)
    }
}

/// The file of a piece.
fn beside(path: &Path, part: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}_{part}.vtu"))
}
