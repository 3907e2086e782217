//! States as models see them.

use crate::term::View;

/// A state as a model sees it.
#[derive(Debug, Clone, Copy)]
pub struct StateRef<'a> {
    /// Coefficients $d$, node by node \[length\].
    pub displacement: &'a [f64],
    /// Condensed unknowns with the memory behind them, one list per term.
    pub condensed: &'a [Vec<f64>],
    /// Load factor $\lambda$.
    pub load: f64,
}

impl<'a> StateRef<'a> {
    /// A state of these vectors at a load factor.
    pub fn new(displacement: &'a [f64], condensed: &'a [Vec<f64>], load: f64) -> Self {
        StateRef { displacement, condensed, load }
    }

    /// What a term of the model sees of it.
    pub(crate) fn of_term(self, term: usize) -> View<'a> {
        View { displacement: self.displacement, condensed: &self.condensed[term], load: self.load }
    }
}
