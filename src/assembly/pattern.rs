//! Sparsity patterns: lower triangles by columns.

use crate::error::LinearError;

/// The lower triangle of a symmetric sparse matrix by columns, rows rising, the diagonal first.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pattern {
    /// Column $c$ holds the entries `columns[c]..columns[c + 1]`.
    pub columns: Vec<usize>,
    /// Row of each entry.
    pub rows: Vec<u32>,
}

impl Pattern {
    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.columns.len().saturating_sub(1)
    }

    /// Number of stored entries.
    pub fn entries(&self) -> usize {
        self.rows.len()
    }

    /// Refuses columns that do not rise from 0 to the number of entries, and rows of a column that do not rise from
    /// its diagonal to the last row.
    ///
    /// # Errors
    /// [`LinearError::Pattern`] with the column.
    pub fn validate(&self) -> Result<(), LinearError> {
        let size = self.size();
        let wrong = |column, what| Err(LinearError::Pattern { column, what });
        if self.columns.first() != Some(&0) || self.columns.last() != Some(&self.rows.len()) {
            return wrong(0, "columns run from 0 to the number of entries");
        }
        for (column, ends) in self.columns.windows(2).enumerate() {
            let Some(rows) = self.rows.get(ends[0]..ends[1]) else {
                return wrong(column, "columns rise");
            };
            let rise = rows.windows(2).all(|w| w[0] < w[1]) && rows.last().is_none_or(|&last| (last as usize) < size);
            if !rise || rows.first().is_none_or(|&first| first as usize != column) {
                return wrong(column, "rows rise from the diagonal, which is always there, to the last one");
            }
        }
        Ok(())
    }

    /// Rows of a column.
    pub fn column(&self, column: usize) -> &[u32] {
        &self.rows[self.columns[column]..self.columns[column + 1]]
    }

    /// The place of an entry, `None` outside the pattern or above the diagonal.
    pub fn find(&self, row: usize, column: usize) -> Option<usize> {
        let rows = self.column(column);
        rows.binary_search(&(row as u32)).ok().map(|k| self.columns[column] + k)
    }

    /// The lower pattern from the sorted-or-not rows of each column; the diagonal is always present.
    pub fn from_columns(columns: Vec<Vec<u32>>) -> Self {
        let mut columns = columns;
        for (column, rows) in columns.iter_mut().enumerate() {
            rows.push(column as u32);
            rows.sort_unstable();
            rows.dedup();
        }
        let entries = columns.iter().map(Vec::len).sum();
        let mut pattern = Pattern { columns: vec![0], rows: Vec::with_capacity(entries) };
        for (column, rows) in columns.into_iter().enumerate() {
            pattern.rows.extend(rows.into_iter().filter(|&r| r as usize >= column));
            pattern.columns.push(pattern.rows.len());
        }
        pattern
    }

    /// $y \mathrel{+}= A x$ for the symmetric matrix with these lower values.
    pub fn multiply_add(&self, values: &[f64], x: &[f64], y: &mut [f64]) {
        for column in 0..self.size() {
            let mut sum = 0.0;
            for k in self.columns[column]..self.columns[column + 1] {
                let row = self.rows[k] as usize;
                sum += values[k] * x[row];
                if row != column {
                    y[row] += values[k] * x[column];
                }
            }
            y[column] += sum;
        }
    }
}
