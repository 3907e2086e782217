//! Tables of numbers and words as CSV.

use super::write_file;
use crate::each::Each;
use crate::error::OutputError;
use std::fmt;
use std::path::Path;

/// One cell of a [`Table`].
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub enum Cell {
    /// No value: an empty cell.
    #[default]
    Empty,
    /// A real number, written with the fewest digits that read back to the same bits. NaN is
    /// written as an empty cell, an infinity as `inf` or `-inf`.
    Number(f64),
    /// A whole number, such as a count.
    Integer(i128),
    /// Words; quoted where CSV asks for it.
    Text(String),
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

macro_rules! integer_cells {
    ($($integer:ty),*) => {$(
        impl From<$integer> for Cell {
            fn from(value: $integer) -> Self {
                // Every type listed fits into 128 bits on every platform.
                Self::Integer(value as i128)
            }
        }
    )*};
}
integer_cells!(i32, i64, u32, u64, usize);

impl From<&str> for Cell {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}

impl From<String> for Cell {
    fn from(value: String) -> Self {
        Self::Text(value)
    }
}

impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::Empty, Into::into)
    }
}

impl fmt::Display for Cell {
    /// The cell as CSV spells it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => Ok(()),
            Self::Number(value) if value.is_nan() => Ok(()),
            Self::Number(value) => f.write_str(&shortest(*value)),
            Self::Integer(value) => write!(f, "{value}"),
            Self::Text(text) if text.contains([',', '"', '\n', '\r']) => {
                write!(f, "\"{}\"", text.replace('"', "\"\""))
            }
            Self::Text(text) => f.write_str(text),
        }
    }
}

/// The shorter of the two spellings that read back to the same bits.
fn shortest(value: f64) -> String {
    let (plain, exponential) = (format!("{value}"), format!("{value:e}"));
    if exponential.len() < plain.len() { exponential } else { plain }
}

/// A table: one header line and rows of as many cells.
///
/// ```
/// use rkpm::output::Table;
/// let mut path = Table::new(["pressure_MPa", "bore_displacement_cm"]);
/// path.push([0.1, 0.62])?;
/// path.push([0.2, 1.55])?;
/// assert_eq!(path.to_csv()?, "pressure_MPa,bore_displacement_cm\n0.1,0.62\n0.2,1.55\n");
/// # Ok::<(), rkpm::error::OutputError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// Names of the columns, with their units.
    pub header: Vec<String>,
    /// The rows, each as long as the header.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// An empty table with these columns.
    pub fn new<N: Into<String>>(header: impl IntoIterator<Item = N>) -> Self {
        Self { header: header.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Appends a row.
    ///
    /// # Errors
    /// [`OutputError::Length`] where the row is not as long as the header; the table stays as it was.
    pub fn push<C: Into<Cell>>(&mut self, row: impl IntoIterator<Item = C>) -> Result<(), OutputError> {
        let row: Vec<Cell> = row.into_iter().map(Into::into).collect();
        self.check(self.rows.len(), &row)?;
        self.rows.push(row);
        Ok(())
    }

    /// The table as CSV: lines end in `\n`, numbers read back to the same bits. An empty cell that is all of its row is quoted, for
    /// readers skip empty lines.
    ///
    /// # Errors
    /// [`OutputError::Length`] where a row is not as long as the header.
    pub fn to_csv(&self) -> Result<String, OutputError> {
        let header = self.header.iter().map(|name| Cell::Text(name.clone()).to_string());
        let mut csv = header.collect::<Vec<_>>().join(",");
        csv.push('\n');
        for (index, row) in self.rows.iter().enumerate() {
            self.check(index, row)?;
            let cells: Vec<String> = row.mapped(Cell::to_string);
            match &cells[..] {
                [only] if only.is_empty() => csv.push_str("\"\""),
                _ => csv.push_str(&cells.join(",")),
            }
            csv.push('\n');
        }
        Ok(csv)
    }

    /// Writes the table, with the directories above it.
    ///
    /// # Errors
    /// [`OutputError::Length`] where a row is not as long as the header, [`OutputError::Io`] where
    /// the file system refuses.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        write_file(path.as_ref(), &["csv", "txt", "dat"], &self.to_csv()?)
    }

    fn check(&self, index: usize, row: &[Cell]) -> Result<(), OutputError> {
        if row.len() == self.header.len() {
            return Ok(());
        }
        Err(OutputError::Length {
            what: format!("row {index} of the table"),
            given: row.len(),
            needed: self.header.len(),
        })
    }
}
