//! The system that a model makes at one state.

use std::sync::Arc;

use crate::each::Each;
use crate::term::{Coupling, Zone};

use super::Ranks;

/// The assembled system at one state: $r$, $\partial r/\partial\lambda$ and $K$.
#[derive(Debug, Clone, Default)]
pub struct System {
    /// $r = \partial\Pi/\partial d$: internal minus external forces.
    pub residual: Vec<f64>,
    /// $\sqrt{\sum r_e^2}$ over the forces of all clusters: what the residual is measured against (reactions included).
    pub scale: f64,
    /// $\partial r/\partial\lambda$.
    pub load_slope: Vec<f64>,
    /// Symmetric part of $K$, lower triangle in the model's pattern.
    pub values: Vec<f64>,
    /// Skew part $N$ of $K$ as (row, column, value) with row > column; $N_{cr} = -N_{rc}$.
    pub skew: Vec<(u32, u32, f64)>,
    /// What condensed pressures would add to $K$, where an assembler keeps them apart.
    pub zones: Vec<Zone>,
    /// Further parts of $K$, over its unknowns.
    pub coupling: Vec<Coupling>,
    /// The ranks that share the matrix: values and skew part are what this one has summed of them. Residual, scale and load
    /// slope are whole.
    pub ranks: Option<Arc<dyn Ranks>>,
}

/// Entries of a matrix beyond which its memory is not kept while another form of it is in use: 2 MB.
const KEPT: usize = 1 << 18;

/// Gives back the memory of the values of a large matrix.
pub(crate) fn release(values: &mut Vec<f64>) {
    if values.capacity() > KEPT {
        *values = Vec::new();
    }
}

impl System {
    /// Gives back the memory of a large matrix, once its reduced form is all that is needed.
    pub(crate) fn release(&mut self) {
        release(&mut self.values);
    }

    /// Adds up over the ranks what each has found with its share of the matrix.
    pub(crate) fn over_ranks(&self, product: &mut [f64]) {
        if let Some(ranks) = &self.ranks {
            ranks.sum(product);
        }
    }

    /// Whether the symmetric part is all of $K$, on every rank.
    pub(crate) fn is_symmetric(&self) -> bool {
        let mine = self.skew.is_empty() && self.coupling.is_empty();
        match &self.ranks {
            Some(ranks) => ranks.least(f64::from(u8::from(mine))) > 0.0,
            None => mine,
        }
    }

    /// $y \mathrel{+}= N x$, the skew part and the coupling alone; NaN for vectors that are too short.
    pub fn skew_multiply_add(&self, x: &[f64], y: &mut [f64]) {
        let size = x.len().min(y.len());
        for &(row, column, value) in &self.skew {
            let (row, column) = (row as usize, column as usize);
            if row.max(column) >= size {
                return y.fill(f64::NAN);
            }
            y[row] += value * x[column];
            y[column] -= value * x[row];
        }
        for Coupling { left, right } in &self.coupling {
            if left.iter().chain(right).any(|entry| entry.0 as usize >= size) {
                return y.fill(f64::NAN);
            }
            let factor = right.summed(|&(k, value)| value * x[k as usize]);
            left.iter().for_each(|&(k, value)| y[k as usize] += factor * value);
        }
    }
}
