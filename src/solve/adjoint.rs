//! Dual solutions: how quantities answer to forces on a converged state.

use crate::assembly::Model;
use crate::boundary::Constraints;
use crate::error::Error;

use super::analysis::Analysis;
use super::increment::Buffers;
use super::newton::Workspace;
use super::rejection::Rejection;
use super::state::State;

/// The right-hand side of a dual problem $K^Tz = \partial q/\partial d$.
pub(crate) struct Dual {
    /// $\partial q/\partial d$ at fixed conditions.
    pub force: Vec<f64>,
    /// What the conditions prescribe of $z$, row by row.
    pub prescribed: Vec<f64>,
}

impl Workspace<'_> {
    /// The solutions $z$ of dual problems at a state, by one matrix.
    pub(crate) fn duals(&mut self, state: &State, requested: &[Dual]) -> Result<Vec<Vec<f64>>, Rejection> {
        let mut sides = vec![Vec::new(); requested.len()];
        let mut linear = self.tangent.linearise(&mut self.assembler, state, 0.0, |enforced, system| {
            // The transpose of the skew part.
            system.skew.iter_mut().for_each(|entry| entry.2 = -entry.2);
            for (dual, rhs) in requested.iter().zip(&mut sides) {
                enforced.restrict(&dual.force, &dual.prescribed, system, rhs);
            }
        })?;
        let mut buffers = Buffers::new(self.equations.len());
        let mut multipliers = vec![0.0; self.equations.len()];
        let mut solutions = Vec::with_capacity(requested.len());
        for (dual, rhs) in requested.iter().zip(sides) {
            linear.solve_fully(rhs, &mut buffers)?;
            let mut z = vec![0.0; self.model.unknowns()];
            linear.enforced.recover(&buffers.solution, &dual.prescribed, &mut z, &mut multipliers);
            solutions.push(z);
        }
        Ok(solutions)
    }
}

impl Analysis {
    /// The dual solutions at a state, none where its matrix has no factors, and the bytes that matrix and factors take.
    pub(crate) fn duals(
        &self,
        model: &Model,
        equations: &Constraints,
        state: &State,
        requested: &[Dual],
    ) -> Result<(Vec<Vec<f64>>, usize), Error> {
        let mut workspace = self.workspace(model, equations)?;
        let solved = workspace.duals(state, requested);
        match (solved, &self.factors) {
            (Err(_), Some(factors)) => factors.duals(model, equations, state, requested),
            (solved, _) => Ok((solved.unwrap_or_default(), workspace.tangent.bytes())),
        }
    }
}
