//! What an iteration needs of a state: elements beside the particles, conditions, and the mass of the pressures.

use std::cell::RefCell;
use std::sync::Arc;

use nalgebra::Matrix4;

use crate::assembly::{Assembler, Pattern, Ranks, StateRef, System, release};
use crate::each::Each;
use crate::error::LinearError;
use crate::term::{TermState, Zone};

use super::super::multilevel::{BlockMatrix, Multilevel};
use super::super::{Direct, LinearSolver, LinearSystem};
use super::auxiliary::{Auxiliary, total};
use super::convergence::{ConvergenceHistory, Progress};
use super::interpolation::Interpolation;
use super::product::{Inner, Piece, Pressures, Solved, pieces};

/// Element matrices of an earlier state go on preconditioning while the iterations per decade of the residual are at most so many
/// times those that they took at first.
const STALE: f64 = 1.3;

/// Stiffness of held nodes in the preconditioner, in the largest of its diagonal.
const HELD: f64 = 10.0;

/// Schur's complement of the pressures is taken for $1/(c\\,\mu) + H^{-1}$ with this $c$: an unconfined change of volume meets
/// $\lambda + 2\mu$, of which the pointwise part of the volumetric energy leaves $2.3\mu$.
const COMPLEMENT: f64 = 2.0;

/// Column and coefficient of each entry, condition by condition.
type Rows = Vec<Vec<(u32, f64)>>;

/// What an iteration knows of a pattern, and of the last system with it.
pub(super) struct Iteration {
    pub(super) auxiliary: Arc<Auxiliary>,
    pub(super) pattern: Pattern,
    pub(super) unknowns: usize,
    /// Columns that one thread at a time multiplies.
    pub(super) ends: Vec<usize>,
    /// Unknown and place of each entry of a condition.
    pub(super) entries: Vec<Vec<(u32, usize)>>,
    /// Pattern of $G G^T$.
    pub(super) products: Pattern,
    pub(super) projector: Option<Direct>,
    pub(super) product_values: Vec<f64>,
    pub(super) values_at: Option<Interpolation>,
    pub(super) ranks: Option<Arc<dyn Ranks>>,
    pub(super) assembler: Assembler,
    pub(super) preconditioner: Option<Box<dyn LinearSolver>>,
    pub(super) system: System,
    pub(super) multilevel: Option<Multilevel>,
    /// The largest diagonal entry of the elements.
    pub(super) stiffness: f64,
    /// Conditions with a largest entry of one, and what they are multiplied with in the matrix.
    pub(super) rows: (Rows, f64),
    pub(super) pressures: Vec<Pressures>,
    pub(super) pieces: Vec<Piece>,
    pub(super) progress: Progress,
}

impl Iteration {
    /// The stiffness of the elements at a state.
    fn stiffness(&mut self, at: StateRef<'_>) -> Result<(), LinearError> {
        // The levels of the state before make room for the matrix of this one.
        self.multilevel = None;
        let Auxiliary { model, term, places, cells, held, .. } = &*self.auxiliary;
        let own: Vec<f64> = match &self.values_at {
            Some(values) => {
                let mut moved = vec![0.0; at.displacement.len()];
                values.residual(false, &moved.clone(), at.displacement, &mut moved);
                moved.iter_mut().for_each(|u| *u = -*u);
                moved
            }
            None => at.displacement.to_vec(),
        };
        let terms: Vec<TermState> = at.terms.get(*term).into_iter().cloned().collect();
        let own_state = StateRef { time: at.time, ..StateRef::new(&own, &terms, at.load) };
        let formed = self.assembler.assemble(model, own_state, &mut self.system);
        let finite = formed.is_ok() && self.system.values.iter().all(|v| v.is_finite());
        let mut wrong = [f64::from(u8::from(!finite))];
        total(&self.ranks, &mut wrong);
        if wrong[0] > 0.0 {
            // Elements may turn over where averages over particles do not: those at rest are stiff in the same places.
            let rest = vec![0.0; own.len()];
            self.assembler.assemble_own(model, StateRef::new(&rest, &model.start(), 0.0), &mut self.system);
        }
        if self.preconditioner.is_some() {
            let first = &self.assembler.pattern().columns;
            let mut diagonal: Vec<f64> = first[..own.len()].mapped(|&first| self.system.values[first].abs());
            total(&self.ranks, &mut diagonal);
            self.stiffness = diagonal.iter().fold(0.0, |largest: f64, d| largest.max(*d));
            let stiff = HELD * self.stiffness;
            if self.ranks.as_ref().is_none_or(|ranks| ranks.rank() == 0) {
                held.iter().for_each(|&unknown| self.system.values[first[unknown]] += stiff);
            }
            return Ok(());
        }
        let mut blocks = BlockMatrix::from_lower(self.assembler.pattern(), &self.system.values);
        // The levels are all that is needed until the next state.
        release(&mut self.system.values);
        self.stiffness = blocks.largest_diagonal();
        let stiff = HELD * self.stiffness;
        held.iter().for_each(|&unknown| blocks.add_diagonal(unknown, stiff));
        self.multilevel = Some(Multilevel::new(blocks, places, *cells)?);
        Ok(())
    }

    /// Conditions with a largest entry of one, and what they were divided by.
    fn rows(&self, values: &[f64]) -> Result<(Rows, f64), LinearError> {
        let mut rows = Vec::with_capacity(self.entries.len());
        let mut stiffness: f64 = 0.0;
        let mut coefficients: Vec<f64> = self.entries.iter().flatten().map(|&(_, place)| values[place]).collect();
        total(&self.ranks, &mut coefficients);
        let mut coefficients = coefficients.into_iter();
        for entries in &self.entries {
            let row: Vec<(u32, f64)> =
                entries.iter().zip(coefficients.by_ref()).map(|(&(column, _), value)| (column, value)).collect();
            stiffness = row.iter().fold(stiffness, |largest, (_, c)| largest.max(c.abs()));
            rows.push(row);
        }
        if rows.is_empty() {
            stiffness = self.stiffness;
        }
        ensure!(
            stiffness > 0.0 && stiffness.is_finite(),
            LinearError::Pivot { pivot: 0, hint: "the matrix has entries that are not finite, or none at all" }
        );
        rows.iter_mut().flatten().for_each(|(_, c)| *c /= stiffness);
        Ok((rows, stiffness))
    }

    /// Writes the entries of $G G^T$.
    fn multiply_rows(&mut self) {
        let rows = &self.rows.0;
        let mut dense = vec![0.0; self.unknowns];
        self.product_values.clear();
        for row in 0..rows.len() {
            rows[row].iter().for_each(|&(column, c)| dense[column as usize] = c);
            for &other in self.products.column(row) {
                let sum = rows[other as usize].summed(|&(column, c)| c * dense[column as usize]);
                self.product_values.push(sum);
            }
            rows[row].iter().for_each(|&(column, _)| dense[column as usize] = 0.0);
        }
    }

    /// Numbers of a zone, in unknowns of the size of the forces.
    fn pressures(&self, zone: &Zone) -> Result<Pressures, LinearError> {
        let singular = LinearError::Pivot { pivot: 0, hint: "the volumetric energy of a zone has no curvature" };
        let compliance = zone.regular_hessian().try_inverse().ok_or(singular)?;
        let soft = if zone.shear > 0.0 { 1.0 / (COMPLEMENT * zone.shear) } else { 0.0 };
        let complement = compliance + Matrix4::identity() * soft;
        let singular = LinearError::Pivot { pivot: 0, hint: "the pressures of a zone have no stiffness" };
        let scale = (self.stiffness / complement[(0, 0)].abs()).sqrt();
        let inverse = complement.try_inverse().ok_or(singular)? / (scale * scale);
        Ok(Pressures { scale, compliance: compliance * (scale * scale), inverse })
    }

    /// Takes what a solution needs of a system.
    pub(super) fn prepare(&mut self, system: &LinearSystem<'_>) -> Result<(), LinearError> {
        let ConvergenceHistory { first, last } = self.progress.convergence;
        if first.is_none_or(|first| !(last <= STALE * first)) {
            self.stiffness(system.state)?;
            self.progress.convergence = ConvergenceHistory::default();
            if let Some(preconditioner) = &mut self.preconditioner {
                preconditioner.factorize(&LinearSystem::of(&self.system.values))?;
            }
        }
        self.rows = self.rows(system.values)?;
        self.multiply_rows();
        self.pressures = system.zones.iter().map(|zone| self.pressures(zone)).collect::<Result<_, _>>()?;
        self.pieces = pieces(system.zones);
        if let Some(projector) = &mut self.projector {
            projector.factorize(&LinearSystem::of(&self.product_values))?;
        }
        Ok(())
    }

    /// Solves for forces, gaps of conditions and gaps of pressures, `fully` or as far as Newton's next iteration makes use of; the part
    /// of the residual that is left.
    pub(super) fn solve(
        &mut self,
        system: &LinearSystem<'_>,
        rhs: &mut [f64],
        pressures: &mut [[f64; 4]],
        fully: bool,
    ) -> Result<f64, LinearError> {
        let nodes = Auxiliary::share(self.ranks.as_deref(), self.unknowns / 3);
        let solved = Solved {
            pattern: &self.pattern,
            unknowns: self.unknowns,
            system,
            pressures: &self.pressures,
            pieces: &self.pieces,
            rows: &self.rows.0,
            stiffness: self.rows.1,
            projector: self.projector.as_mut().map(|projector| Inner::new(projector, &self.product_values)),
            values_at: self.values_at.as_ref(),
            ends: &self.ends,
            multilevel: self.multilevel.as_mut().map(RefCell::new),
            preconditioner: self.preconditioner.as_mut().map(|own| Inner::new(&mut **own, &self.system.values)),
            ranks: &self.ranks,
            own: 3 * nodes.start..3 * nodes.end,
        };
        solved.solve(rhs, pressures, fully, &mut self.progress)
    }
}
