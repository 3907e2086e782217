//! What an example found, beside what it should have found.

use std::fmt;
use std::path::Path;

use rkpm::error::OutputError;
use rkpm::output::{Cell, Table};

/// A value and what it is compared with, both in the unit that the name ends in.
pub struct Row {
    pub name: String,
    pub value: f64,
    pub reference: Option<f64>,
}

impl Row {
    /// value/reference − 1, signed; none without a reference or where the ratio is not finite.
    pub fn relative_error(&self) -> Option<f64> {
        let ratio = self.value / self.reference?;
        Some(ratio - 1.0).filter(|error| error.is_finite())
    }
}

/// The rows of an example. As CSV the columns are `quantity,value,reference,relative_error`; [`Display`](fmt::Display)
/// prints the same rows for people.
#[derive(Default)]
pub struct Summary {
    pub rows: Vec<Row>,
}

impl Summary {
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a value and its reference.
    pub fn record(&mut self, name: impl Into<String>, value: f64, reference: f64) -> Result<&mut Self, OutputError> {
        self.add(name.into(), value, Some(reference))
    }

    /// Adds a value that stands by itself: an error, a ratio, a count, a time.
    pub fn note(&mut self, name: impl Into<String>, value: f64) -> Result<&mut Self, OutputError> {
        self.add(name.into(), value, None)
    }

    /// Writes the summary as CSV, with the directories above it.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), OutputError> {
        let mut table = Table::new(["quantity", "value", "reference", "relative_error"]);
        for row in &self.rows {
            let (value, reference) = (Cell::from(row.value), Cell::from(row.reference));
            table.push([Cell::from(row.name.as_str()), value, reference, Cell::from(row.relative_error())])?;
        }
        table.write(path)
    }

    fn add(&mut self, name: String, value: f64, reference: Option<f64>) -> Result<&mut Self, OutputError> {
        // A name that stood for two numbers would let a reader of the file pick either.
        let used = self.rows.iter().filter(|q| q.name == name).count();
        if used > 0 {
            return Err(OutputError::Length {
                what: format!("quantity {name} (each name may be used once)"),
                given: used + 1,
                needed: 1,
            });
        }
        self.rows.push(Row { name, value, reference });
        Ok(self)
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let header = ["quantity", "value", "reference", "relative error"].map(str::to_owned);
        let mut rows = vec![header];
        rows.extend(self.rows.iter().map(|q| {
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
