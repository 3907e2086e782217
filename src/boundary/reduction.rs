//! The equations of equilibrium under constraint equations, as their enforcement reduces them.

use crate::assembly::{Pattern, System};
use crate::each::{Each, IntoEach, add};
use crate::error::BoundaryError;
use crate::linear::MatrixClass;

use super::block::{Block, columns};
use super::enforced::Enforced;
use super::numbering::Numbering;
use super::{Constraints, check_unknowns};

/// The equations of a model under enforced constraint equations: they reduce the full system.
pub struct Reduction {
    pub(crate) pattern: Pattern,
    numbering: Numbering,
    blocks: Vec<Block>,
    rows: Vec<Row>,
    /// Whether the rows have multipliers.
    multipliers: bool,
    /// Place of each entry of the full pattern; `u32::MAX` in rows and columns of unknowns that a block expresses.
    destinations: Vec<u32>,
    /// What the rows add to the matrix, in terms of `stiffness`.
    added: Vec<(u32, f64)>,
    /// The largest entry of the matrix that was reduced last.
    stiffness: f64,
}

/// A constraint equation that is not eliminated, scaled to a largest entry of one.
struct Row {
    equation: usize,
    entries: Vec<(usize, f64)>,
    scale: f64,
    penalty: f64,
}

/// The constraint equations that no block eliminates.
fn rows(enforced: &Enforced, unknowns: usize, equations: &Constraints) -> Result<Vec<Row>, BoundaryError> {
    let (mut expressed, mut eliminated) = (vec![false; unknowns], vec![false; equations.len()]);
    for block in &enforced.eliminated {
        block.unknowns.iter().for_each(|&unknown| expressed[unknown] = true);
        block.equations.iter().for_each(|&equation| eliminated[equation] = true);
    }
    let left = equations.equations().iter().enumerate().filter(|(number, _)| !eliminated[*number]);
    left.map(|(number, equation)| {
        let (entries, scale) = equation.scaled();
        if entries.is_empty() {
            return Err(BoundaryError::Dependent { equation: number, what: equation.label.clone(), pivot: 0.0 });
        }
        let penalty = enforced.penalty.get(number).copied().unwrap_or(0.0);
        let reason = if !enforced.multipliers && penalty == 0.0 {
            "is not enforced: eliminate it, or take multipliers or a penalty"
        } else if entries.iter().any(|&(k, _)| expressed[k]) {
            "has unknowns that others express: eliminate it together with them"
        } else {
            return Ok(Row { equation: number, entries, scale, penalty });
        };
        Err(BoundaryError::Unsuitable { enforcement: "enforcement", reason: format!("{} {reason}", equation.label) })
    })
    .collect()
}

impl Row {
    /// What it adds to the lower matrix, in terms of its stiffness: its penalty, and its coefficients in the row of its multiplier.
    fn added(&self, places: &[u32], multiplier: Option<u32>) -> Vec<([u32; 2], f64)> {
        let mut added = Vec::new();
        for &(a, x) in &self.entries {
            added.extend(multiplier.map(|row| ([row, places[a]], x)));
            for &(b, y) in self.entries.iter().filter(|entry| self.penalty > 0.0 && entry.0 >= a) {
                added.push(([places[b], places[a]], self.penalty * (x * y)));
            }
        }
        added
    }
}

impl Reduction {
    /// Binds the matrices that enforce constraint equations to the pattern of a model.
    ///
    /// # Errors
    /// For malformed patterns, and matrices that do not fit the model or the constraint equations.
    pub fn new(enforced: Enforced, pattern: &Pattern, equations: &Constraints) -> Result<Self, BoundaryError> {
        if let Err(error) = pattern.validate() {
            return Err(BoundaryError::Unsuitable { enforcement: "pattern", reason: error.to_string() });
        }
        let unknowns = pattern.size();
        check_unknowns(equations.equations(), unknowns)?;
        enforced.check(unknowns, equations.len())?;
        let rows = rows(&enforced, unknowns, equations)?;
        enforced.satisfies(unknowns, equations)?;
        let Enforced { eliminated, multipliers, .. } = enforced;
        let numbering = Numbering::new(unknowns, &eliminated, if multipliers { rows.len() } else { 0 });
        let blocks = eliminated.into_iter().map(|block| Block::new(block, &numbering.places));
        let mut blocks: Vec<Block> = blocks.collect();
        let mut columns = columns(&numbering, pattern, &mut blocks);
        let mut added = Vec::new();
        for (r, row) in rows.iter().enumerate() {
            added.extend(row.added(&numbering.places, numbering.places.get(unknowns + r).copied()));
        }
        added.iter().for_each(|&([row, column], _)| columns[column as usize].push(row));
        let reduced = Pattern::from_columns(columns);
        blocks.iter_mut().for_each(|block| block.find(&reduced));
        let find = |[row, column]: [u32; 2]| reduced.find(row as usize, column as usize).unwrap_or(0) as u32;
        let added = added.into_mapped(|(entry, value)| (find(entry), value));
        let destinations = numbering.destinations(pattern, &reduced);
        Ok(Reduction { pattern: reduced, numbering, blocks, rows, multipliers, destinations, added, stiffness: 1.0 })
    }

    /// Class of the reduced matrix.
    pub(crate) fn class(&self) -> MatrixClass {
        if self.multipliers { MatrixClass::Saddle { constraints: self.rows.len() } } else { MatrixClass::Definite }
    }

    /// Number of reduced unknowns, multipliers included.
    pub fn unknowns(&self) -> usize {
        self.numbering.numbers.len()
    }

    /// The unknown of the model that a reduced one stands for, for an elimination order; multipliers stand for none, and last until the
    /// unknowns are renumbered.
    pub(crate) fn full_index(&self, reduced: usize) -> Option<usize> {
        let number = self.numbering.numbers.get(reduced)?;
        Some(*number as usize).filter(|&number| number < self.numbering.unknowns())
    }

    /// Renumbers the reduced unknowns so that `order[k]` becomes `k`, a permutation of all of them. A matrix that comes in the order of its
    /// elimination is factorised without another copy.
    pub(crate) fn renumber(&mut self, order: &[usize]) {
        let (pattern, places) = self.pattern.permuted(order);
        self.pattern = pattern;
        let moved = |place: &mut u32| *place = places[*place as usize];
        self.destinations.iter_mut().filter(|place| **place != u32::MAX).for_each(moved);
        self.added.iter_mut().for_each(|(place, _)| moved(place));
        self.numbering.renumber(order);
        let mut new = vec![0; order.len()];
        order.iter().enumerate().for_each(|(place, &old)| new[old] = place as u32);
        self.blocks.iter_mut().for_each(|block| block.renumber(&new, &places));
    }

    /// Writes the values of the reduced matrix from the symmetric part of the full one, which may be gone later on; NaN where that has
    /// other entries than the pattern.
    pub fn reduce(&mut self, full: &System, values: &mut Vec<f64>) {
        values.clear();
        values.resize(self.pattern.entries(), 0.0);
        if full.values.len() != self.destinations.len() {
            values.fill(f64::NAN);
            return;
        }
        for (value, &place) in full.values.iter().zip(&self.destinations) {
            if place != u32::MAX {
                values[place as usize] += value;
            }
        }
        self.blocks.iter_mut().for_each(|block| block.keep(&full.values));
        let mut columns = vec![0; self.unknowns()];
        self.blocks.iter().for_each(|block| block.add(values, &self.numbering, &self.blocks, &mut columns));
        if self.rows.is_empty() {
            return;
        }
        let mut stiffness = full.values.largest(|value| value.abs());
        if let Some(ranks) = &full.ranks {
            stiffness = -ranks.least(-stiffness);
        }
        self.stiffness = if stiffness > 0.0 { stiffness } else { 1.0 };
        // The contribution of the constraint equations is counted once in the sum over the ranks.
        if full.ranks.as_ref().is_none_or(|ranks| ranks.rank() == 0) {
            for &(place, value) in &self.added {
                values[place as usize] += self.stiffness * value;
            }
        }
    }

    /// Writes the reduced right-hand side for the full one `force` ($-r$) and `violation` ($g - Gd$).
    pub(crate) fn restrict(&self, force: &[f64], violation: &[f64], full: &System, rhs: &mut Vec<f64>) {
        let mut jump = vec![0.0; force.len()];
        self.blocks.iter().flat_map(|block| block.offset(violation)).for_each(|(unknown, value)| jump[unknown] = value);
        if jump.iter().any(|value| *value != 0.0) {
            let mut left = vec![0.0; force.len()];
            self.stiffen(&jump, full, &mut left);
            left.iter_mut().zip(force).for_each(|(left, force)| *left = force - *left);
            self.project(&left, rhs);
        } else {
            self.project(force, rhs);
        }
        for (row, &multiplier) in self.rows.iter().zip(self.multipliers()) {
            rhs[multiplier as usize] = self.stiffness * row.scale * violation[row.equation];
        }
        for row in self.rows.iter().filter(|row| row.penalty > 0.0) {
            let scaled = self.stiffness * row.scale * violation[row.equation];
            for &(k, c) in &row.entries {
                rhs[self.numbering.places[k] as usize] += c * (row.penalty * scaled);
            }
        }
    }

    /// The places of the multipliers.
    fn multipliers(&self) -> &[u32] {
        &self.numbering.places[self.numbering.unknowns()..]
    }

    /// $T^T v$ for a full vector, zero at the multipliers.
    pub(crate) fn project(&self, full: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.extend(self.numbering.kept(full));
        for block in &self.blocks {
            for (p, &unknown) in block.unknowns.iter().enumerate() {
                block.row(p).for_each(|(place, w)| out[place] += w * full[unknown]);
            }
        }
    }

    /// What is left of a residual once the conditions have taken their reactions, unknown by reduced unknown: zero at
    /// equilibrium.
    pub(crate) fn imbalance(&self, residual: &[f64], multipliers: &[f64], out: &mut Vec<f64>) {
        self.project(residual, out);
        for row in &self.rows {
            for &(k, c) in &row.entries {
                out[self.numbering.places[k] as usize] += c / row.scale * multipliers[row.equation];
            }
        }
    }

    /// Adds $K\\,\delta d$ of the matrix that was reduced last to a residual at unknowns that blocks express, where
    /// [`react`](Reduction::react) looks at it; all of it for a step of such unknowns alone.
    pub(crate) fn stiffen(&self, step: &[f64], full: &System, residual: &mut [f64]) {
        if self.blocks.is_empty() {
            return;
        }
        let mut product = vec![0.0; residual.len()];
        self.blocks.iter().for_each(|block| block.multiply_add(step, &mut product));
        full.skew_multiply_add(step, &mut product);
        full.over_ranks(&mut product);
        add(residual, 1.0, &product);
    }

    /// Writes the multipliers $\mu$ of eliminated equations that balance a residual, $r + G^T\mu = 0$: as $GV = 1$ and $T^T r = 0$, they
    /// are $-V^T r$.
    pub(crate) fn react(&self, residual: &[f64], multipliers: &mut [f64]) {
        for block in &self.blocks {
            let m = block.equations.len();
            for (i, &equation) in block.equations.iter().enumerate() {
                let unknowns = block.unknowns.iter().enumerate();
                multipliers[equation] = -unknowns.map(|(p, &k)| block.offsets[p * m + i] * residual[k]).sum::<f64>();
            }
        }
    }

    /// Writes the full increment for a reduced solution and violation, and the multipliers of equations that are not eliminated.
    pub(crate) fn recover(&self, solved: &[f64], violation: &[f64], step: &mut [f64], multipliers: &mut [f64]) {
        for (step, &place) in step.iter_mut().zip(&self.numbering.places) {
            *step = solved.get(place as usize).copied().unwrap_or(0.0);
        }
        for block in &self.blocks {
            for (p, (unknown, jump)) in block.offset(violation).enumerate() {
                step[unknown] = jump + block.row(p).map(|(place, w)| w * solved[place]).sum::<f64>();
            }
        }
        for (r, row) in self.rows.iter().enumerate() {
            let multiplier = match self.multipliers().get(r) {
                Some(&place) => solved[place as usize],
                None => {
                    let value: f64 = row.entries.summed(|&(k, c)| c * step[k]);
                    row.penalty * (value - row.scale * violation[row.equation])
                }
            };
            multipliers[row.equation] = multiplier * self.stiffness * row.scale;
        }
    }
}
