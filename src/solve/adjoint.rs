//! Dual solutions: how quantities answer to forces on a converged state.

use crate::assembly::Model;
use crate::boundary::Constraints;
use crate::error::{Cause, Error};

use super::analysis::Analysis;
use super::solution::Rhs;
use super::state::State;

/// The right-hand side of a dual problem $K^Tz = \partial q/\partial d$.
pub(crate) struct Dual {
    /// $\partial q/\partial d$ at fixed conditions.
    pub force: Vec<f64>,
    /// What the conditions prescribe of $z$, row by row.
    pub prescribed: Vec<f64>,
}

impl Analysis {
    /// The dual solutions at a state by one matrix, none where it has no factors, and the bytes that matrix and factors take.
    pub(crate) fn duals(
        &self,
        model: &Model,
        equations: &Constraints,
        state: &State,
        requested: &[Dual],
    ) -> Result<(Vec<Vec<f64>>, usize), Error> {
        let mut equilibrium = self.equilibrium(model, equations)?;
        let mut solve = || {
            equilibrium.linearize(state)?;
            let dual = |Dual { force, prescribed }: &Dual| equilibrium.solve(Rhs::Dual { force, prescribed });
            requested.iter().map(dual).map(|step| step.map(|step| step.displacement)).collect::<Result<_, Cause>>()
        };
        match (solve(), &self.factors) {
            (Err(_), Some(factors)) => factors.duals(model, equations, state, requested),
            (solved, _) => Ok((solved.unwrap_or_default(), equilibrium.bytes())),
        }
    }
}
