//! The rows of the essential conditions.

use std::collections::HashMap;

use crate::error::BoundaryError;

use super::claims::{Claim, spans};
use super::row::Row;

/// The rows of a problem.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Constraints {
    pub(super) rows: Vec<Row>,
    /// By particle: what boundary integrals have claimed of it.
    pub(super) claimed: HashMap<usize, Vec<Claim>>,
    /// By particle: its values that are prescribed, to find repeated and conflicting conditions.
    pub(super) at_particles: HashMap<usize, Vec<Claim>>,
    /// Kinks of motions, whose rows don't know them.
    pub(super) kinks: Vec<f64>,
}

impl Constraints {
    /// No rows.
    pub fn new() -> Self {
        Constraints::default()
    }

    /// The rows, in the order in which they were added.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Load factors inside $(0, 1)$ at which prescribed values have kinks: steps of the load stop there.
    pub fn break_points(&self) -> Vec<f64> {
        self.rows.iter().flat_map(|row| row.amplitude.break_points()).chain(self.kinks.iter().copied()).collect()
    }

    /// Adds load factors at which motions have kinks.
    pub(crate) fn add_knots(&mut self, loads: Vec<f64>) {
        self.kinks.extend(loads);
    }

    /// How far rows and kinks have come, to [`take_back`](Constraints::take_back) what is added from here on.
    pub(crate) fn mark(&self) -> [usize; 2] {
        [self.rows.len(), self.kinks.len()]
    }

    /// Takes back what was added since a mark: copies of all rows would cost as many as there are for each condition.
    pub(crate) fn take_back(&mut self, [rows, kinks]: [usize; 2]) {
        for claims in [&mut self.at_particles, &mut self.claimed] {
            claims.retain(|_, of_particle| {
                of_particle.retain(|claim| claim.row < rows);
                !of_particle.is_empty()
            });
        }
        self.rows.truncate(rows);
        self.kinks.truncate(kinks);
    }

    /// Whether a condition prescribes a component of a particle.
    pub(crate) fn claims(&self, particle: usize, component: usize) -> bool {
        [&self.claimed, &self.at_particles]
            .iter()
            .any(|claims| claims.get(&particle).is_some_and(|claims| spans(claims, component)))
    }

    /// Appends the rows of a body whose particles stand `nodes` behind the first, each with `dimension` components.
    pub(crate) fn append(&mut self, other: Constraints, nodes: usize, dimension: usize) {
        let before = self.rows.len();
        let shift = nodes * dimension;
        self.rows.extend(other.rows.into_iter().map(|mut row| {
            row.dependent += shift;
            row.entries.iter_mut().for_each(|entry| entry.0 += shift);
            row
        }));
        for (mine, others) in [(&mut self.claimed, other.claimed), (&mut self.at_particles, other.at_particles)] {
            mine.extend(others.into_iter().map(|(particle, mut claims)| {
                claims.iter_mut().for_each(|claim| claim.row += before);
                (particle + nodes, claims)
            }));
        }
        self.kinks.extend(other.kinks);
    }

    /// Adds entries to a row.
    pub(crate) fn extend_row(&mut self, row: usize, entries: Vec<(usize, f64)>) {
        if let Some(row) = self.rows.get_mut(row) {
            row.entries.extend(entries);
        }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Adds a row as it is.
    ///
    /// # Errors
    /// Where a number is not finite or the row has no entry.
    pub fn push(&mut self, row: Row) -> Result<(), BoundaryError> {
        if let Some(&(_, value)) = row.entries.iter().find(|(_, c)| !c.is_finite()) {
            return Err(BoundaryError::Value { what: row.label, value, load: 1.0 });
        }
        for load in [0.0, 1.0] {
            let value = row.target * row.amplitude.evaluate(load).0;
            if !value.is_finite() {
                return Err(BoundaryError::Value { what: row.label, value, load });
            }
        }
        if row.entries.iter().all(|(_, c)| *c == 0.0) {
            return Err(BoundaryError::Dependent { row: self.rows.len(), what: row.label, pivot: 0.0 });
        }
        self.rows.push(row);
        Ok(())
    }

    /// Writes $g\\,a(\lambda) - Gd$, row by row.
    pub fn violation(&self, displacement: &[f64], load: f64, violation: &mut Vec<f64>) {
        violation.clear();
        violation.extend(self.rows.iter().map(|row| {
            let value: f64 = row.entries.iter().map(|&(k, c)| c * displacement[k]).sum();
            row.target * row.amplitude.evaluate(load).0 - value
        }));
    }

    /// Writes $g\\,a'(\lambda)$, row by row.
    pub fn load_slope(&self, load: f64, slope: &mut Vec<f64>) {
        slope.clear();
        slope.extend(self.rows.iter().map(|row| row.target * row.amplitude.evaluate(load).1));
    }
}
