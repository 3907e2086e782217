//! The state of an analysis.

use crate::assembly::Model;
use crate::boundary::Constraints;
use crate::error::SolveError;

/// Everything that an analysis iterates on; predicted, halved and kept as a whole.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    /// Coefficients $d$, node by node \[length\].
    pub displacement: Vec<f64>,
    /// Condensed unknowns (pressures), one vector per term.
    pub condensed: Vec<Vec<f64>>,
    /// Multipliers of the rows \[force; stress for rows over a boundary\].
    pub multipliers: Vec<f64>,
    /// Load factor $\lambda$.
    pub load: f64,
}

impl State {
    /// The state of a model at rest: no displacement, condensed unknowns to match, load factor 0.
    pub fn at_rest<const D: usize>(model: &Model<D>, equations: &Constraints) -> Self {
        State {
            displacement: vec![0.0; model.unknowns()],
            condensed: model.start(),
            multipliers: vec![0.0; equations.len()],
            load: 0.0,
        }
    }

    /// Refuses a state whose vectors are not as long as a model and its rows need them.
    ///
    /// # Errors
    /// [`SolveError::Length`] with the vector.
    pub fn check_lengths<const D: usize>(&self, model: &Model<D>, equations: &Constraints) -> Result<(), SolveError> {
        let check = |what, given, needed| {
            if given == needed { Ok(()) } else { Err(SolveError::Length { what, given, needed }) }
        };
        check("displacement", self.displacement.len(), model.unknowns())?;
        check("multipliers", self.multipliers.len(), equations.len())?;
        let start = model.start();
        // In all, then term by term: as many, shared out otherwise, would be read beyond their ends.
        check("condensed unknowns", self.condensed.iter().map(Vec::len).sum(), start.iter().map(Vec::len).sum())?;
        check("condensed unknowns", self.condensed.len(), start.len())?;
        self.condensed
            .iter()
            .zip(&start)
            .try_for_each(|(given, needed)| check("condensed unknowns", given.len(), needed.len()))
    }
}
