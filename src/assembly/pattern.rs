//! Sparsity patterns: lower triangles by columns.

use std::sync::Arc;

use crate::error::LinearError;

/// Marks a pair of nodes that the sparse matrix does not couple.
pub(super) const UNCOUPLED: u32 = u32::MAX;

/// The lower triangle of a symmetric sparse matrix by columns, rows rising, the diagonal first.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Pattern {
    /// Column $c$ holds the entries `columns[c]..columns[c + 1]`.
    pub columns: Vec<usize>,
    /// Row of each entry; shared with the solver that was given the pattern, for they are half as large as the values.
    pub rows: Arc<Vec<u32>>,
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

    /// Rows of a column; none where there is no such column.
    pub fn column(&self, column: usize) -> &[u32] {
        match self.columns.get(column..).and_then(|ends| ends.first_chunk()) {
            Some(&[first, end]) => self.rows.get(first..end).unwrap_or(&[]),
            None => &[],
        }
    }

    /// The place of an entry, `None` outside the pattern or above the diagonal.
    pub fn find(&self, row: usize, column: usize) -> Option<usize> {
        let rows = self.column(column);
        let row = u32::try_from(row).ok()?;
        rows.binary_search(&row).ok().map(|k| self.columns[column] + k)
    }

    /// The lower pattern from the sorted-or-not rows of each column; the diagonal is always present.
    pub fn from_columns(columns: Vec<Vec<u32>>) -> Self {
        let mut columns = columns;
        for (column, rows) in columns.iter_mut().enumerate() {
            // Most come sorted, their diagonal first.
            if rows.first() != Some(&(column as u32)) {
                rows.push(column as u32);
            }
            if !rows.is_sorted_by(|a, b| a < b) {
                rows.sort_unstable();
                rows.dedup();
            }
        }
        let entries = columns.iter().map(Vec::len).sum();
        let (mut ends, mut all) = (vec![0], Vec::with_capacity(entries));
        for (column, rows) in columns.into_iter().enumerate() {
            all.extend(rows.into_iter().filter(|&r| r as usize >= column));
            ends.push(all.len());
        }
        Pattern { columns: ends, rows: Arc::new(all) }
    }

    /// The pattern with unknown `order[k]` renumbered to `k`, and the new place of each entry.
    pub(crate) fn permuted(&self, order: &[usize]) -> (Pattern, Vec<u32>) {
        let size = self.size();
        let mut inverse = vec![0u32; size];
        for (new, &old) in order.iter().enumerate() {
            inverse[old] = new as u32;
        }
        let renumbered = |row: u32, column: usize| {
            let (a, b) = (inverse[row as usize], inverse[column]);
            (a.max(b), a.min(b))
        };
        // By rows first, so that rows rise in each column without sorting.
        let mut row_ends = vec![0usize; size + 1];
        let mut columns = vec![0usize; size + 1];
        for column in 0..size {
            for &row in self.column(column) {
                let (row, column) = renumbered(row, column);
                row_ends[row as usize + 1] += 1;
                columns[column as usize + 1] += 1;
            }
        }
        for k in 0..size {
            row_ends[k + 1] += row_ends[k];
            columns[k + 1] += columns[k];
        }
        let mut by_rows = vec![(0u32, 0u32); self.entries()];
        let mut next = row_ends.clone();
        for column in 0..size {
            for entry in self.columns[column]..self.columns[column + 1] {
                let (row, column) = renumbered(self.rows[entry], column);
                by_rows[next[row as usize]] = (column, entry as u32);
                next[row as usize] += 1;
            }
        }
        let mut next = columns.clone();
        let mut rows = vec![0u32; self.entries()];
        let mut places = vec![0u32; self.entries()];
        for row in 0..size {
            for &(column, entry) in &by_rows[row_ends[row]..row_ends[row + 1]] {
                let place = next[column as usize];
                next[column as usize] += 1;
                rows[place] = row as u32;
                places[entry as usize] = place as u32;
            }
        }
        (Pattern { columns, rows: Arc::new(rows) }, places)
    }

    /// $y \mathrel{+}= A x$ for the symmetric matrix with these lower values; NaN for vectors that are too short.
    pub fn multiply_add(&self, values: &[f64], x: &[f64], y: &mut [f64]) {
        if values.len() < self.entries() || x.len().min(y.len()) < self.size() {
            y.fill(f64::NAN);
            return;
        }
        for column in 0..self.size() {
            let entries = self.columns[column]..self.columns[column + 1];
            add_column(&self.rows[entries.clone()], &values[entries], 1.0, x, y);
        }
    }
}

/// $y \mathrel{+}= s A x$, the part of one column of the lower triangle and of the row above it.
#[inline(always)]
pub(crate) fn add_column(rows: &[u32], values: &[f64], sign: f64, x: &[f64], y: &mut [f64]) {
    // The diagonal comes first: what follows needs no question about it.
    let (Some((&column, rows)), Some((diagonal, values))) = (rows.split_first(), values.split_first()) else { return };
    let factor = x[column as usize];
    let mut sum = diagonal * factor;
    for (value, &row) in values.iter().zip(rows) {
        sum += value * x[row as usize];
        y[row as usize] += sign * (value * factor);
    }
    y[column as usize] += sign * sum;
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_permuted_matrix_is_the_same_matrix() {
        use super::Pattern;
        let pattern = Pattern::from_columns(vec![vec![2, 4], vec![3], vec![3, 4], vec![], vec![]]);
        let values: Vec<f64> = (0..pattern.entries()).map(|k| 1.0 + k as f64).collect();
        let order = [3, 0, 4, 1, 2];
        let (permuted, places) = pattern.permuted(&order);
        permuted.validate().unwrap();
        let mut moved = vec![0.0; values.len()];
        for (value, &place) in values.iter().zip(&places) {
            moved[place as usize] = *value;
        }
        let x = [1.0, -2.0, 3.0, 0.5, 7.0];
        let (mut y, mut z) = ([0.0; 5], [0.0; 5]);
        pattern.multiply_add(&values, &x, &mut y);
        permuted.multiply_add(&moved, &order.map(|old| x[old]), &mut z);
        assert_eq!(order.map(|old| y[old]), z);
    }
}
