//! One row of the essential conditions.

use crate::error::BoundaryError;
use crate::term::Amplitude;

/// One condition $\sum_k c_k d_k = g\\,a(\lambda)$ on the coefficients $d$.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// (unknown, coefficient) pairs.
    pub entries: Vec<(usize, f64)>,
    /// The unknown that the row owns: component of the particle it belongs to.
    pub dependent: usize,
    /// $g$ \[length; length × measure for rows over a boundary\].
    pub target: f64,
    /// Its factor $a(\lambda)$.
    pub amplitude: Amplitude,
    /// The condition that the row comes from, for messages.
    pub label: String,
}

impl Row {
    /// $\sum_k |c_k|$: what makes values of rows over a boundary lengths, of those at particles about 1.
    pub(crate) fn measure(&self) -> f64 {
        self.entries.iter().map(|(_, c)| c.abs()).sum()
    }
}

/// Refuses rows that name unknowns beyond the `unknowns` of a model.
pub(crate) fn check_unknowns(rows: &[Row], unknowns: usize) -> Result<(), BoundaryError> {
    let beyond = |row: &&Row| row.dependent >= unknowns || row.entries.iter().any(|e| e.0 >= unknowns);
    match rows.iter().find(beyond) {
        Some(row) => Err(BoundaryError::Unsuitable {
            enforcement: "row",
            reason: format!("{} names an unknown beyond the {unknowns} of the model", row.label),
        }),
        None => Ok(()),
    }
}

pub(crate) fn check_component(component: usize, dimension: usize, label: &str) -> Result<(), BoundaryError> {
    if component < dimension {
        Ok(())
    } else {
        Err(BoundaryError::Component { what: label.to_string(), component, dimension })
    }
}
