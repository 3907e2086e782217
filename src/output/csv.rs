//! Tables of numbers and words as CSV, and the summary every example leaves behind.

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

/// One line of a [`Summary`].
#[derive(Debug, Clone, PartialEq)]
pub struct SummaryRow {
    /// Its name, unique within the summary.
    pub name: String,
    /// Its value, in the unit the name ends in.
    pub value: f64,
    /// What it is compared with, in the same unit.
    pub reference: Option<f64>,
}

impl SummaryRow {
    /// value/reference − 1, signed; none without a reference or where the ratio is not finite.
    #[must_use]
    pub fn relative_error(&self) -> Option<f64> {
        let ratio = self.value / self.reference?;
        Some(ratio - 1.0).filter(|error| error.is_finite())
    }
}

/// What an example found, beside what it should have found.
///
/// As CSV the columns are `quantity,value,reference,relative_error`; [`Display`](fmt::Display)
/// prints the same rows for people.
///
/// ```
/// use rkpm::output::Summary;
/// let mut summary = Summary::default();
/// summary
///     .record("bore_displacement_cm", 5.01, 5.0)?
///     .note("iterations", 14.0)?;
/// assert!(summary.to_csv()?.starts_with("quantity,value,reference,relative_error\n"));
/// # Ok::<(), rkpm::error::OutputError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Summary {
    quantities: Vec<SummaryRow>,
}

impl Summary {
    /// An empty summary.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a value and its reference, both in the same unit.
    ///
    /// # Errors
    /// [`OutputError::Length`] where the name was used before; the first entry stays.
    pub fn record(&mut self, name: impl Into<String>, value: f64, reference: f64) -> Result<&mut Self, OutputError> {
        self.add(name.into(), value, Some(reference))
    }

    /// Adds a value that stands by itself: an error, a ratio, a count, a time.
    ///
    /// # Errors
    /// [`OutputError::Length`] where the name was used before; the first entry stays.
    pub fn note(&mut self, name: impl Into<String>, value: f64) -> Result<&mut Self, OutputError> {
        self.add(name.into(), value, None)
    }

    /// The entries, in the order they were made.
    #[must_use]
    pub fn quantities(&self) -> &[SummaryRow] {
        &self.quantities
    }

    /// The summary as a table; the last two cells of a note are empty.
    fn table(&self) -> Table {
        let row = |q: &SummaryRow| {
            vec![
                Cell::from(q.name.as_str()),
                Cell::from(q.value),
                Cell::from(q.reference),
                Cell::from(q.relative_error()),
            ]
        };
        Table { rows: self.quantities.mapped(row), ..Table::new(["quantity", "value", "reference", "relative_error"]) }
    }

    /// The summary as CSV.
    ///
    /// # Errors
    /// As [`Table::to_csv`]; a summary's rows have the right length by construction.
    pub fn to_csv(&self) -> Result<String, OutputError> {
        self.table().to_csv()
    }

    /// Writes the summary as CSV, with the directories above it.
    ///
    /// # Errors
    /// [`OutputError::Io`] where the file system refuses.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        self.table().write(path)
    }

    fn add(&mut self, name: String, value: f64, reference: Option<f64>) -> Result<&mut Self, OutputError> {
        // A name that stood for two numbers would let a reader of the file pick either.
        let used = self.quantities.iter().filter(|q| q.name == name).count();
        if used > 0 {
            return Err(OutputError::Length {
                what: format!("quantity {name} (each name may be used once)"),
                given: used + 1,
                needed: 1,
            });
        }
        self.quantities.push(SummaryRow { name, value, reference });
        Ok(self)
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let header = ["quantity", "value", "reference", "relative error"].map(str::to_owned);
        let mut rows = vec![header];
        rows.extend(self.quantities.iter().map(|q| {
            [
                q.name.clone(),
                readable(q.value),
                q.reference.map_or_else(String::new, readable),
                q.relative_error().map_or_else(String::new, |error| format!("{error:+.2e}")),
            ]
        }));
        let mut widths = [0; 4];
        for row in &rows {
            for (width, cell) in widths.iter_mut().zip(row) {
                *width = (*width).max(cell.chars().count());
            }
        }
        let [w0, w1, w2, w3] = widths;
        for (index, [name, value, reference, error]) in rows.iter().enumerate() {
            let line = format!("{name:<w0$}  {value:>w1$}  {reference:>w2$}  {error:>w3$}");
            writeln!(f, "{}", line.trim_end())?;
            if index == 0 {
                writeln!(f, "{}", "-".repeat(w0 + w1 + w2 + w3 + 6))?;
            }
        }
        Ok(())
    }
}

/// Six significant digits, without an exponent where people would write none.
fn readable(value: f64) -> String {
    if value.is_nan() {
        return String::new();
    }
    let magnitude = value.abs();
    if value == value.trunc() && magnitude < 1e7 {
        return format!("{value}");
    }
    if !(1e-3..1e6).contains(&magnitude) {
        return format!("{value:.5e}");
    }
    // Digits after the point that leave six in all; at most 8 because of the lower bound above.
    let decimals = (5 - magnitude.log10().floor() as i32).max(0) as usize;
    format!("{value:.decimals$}")
}
