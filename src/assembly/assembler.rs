//! Assembly: clusters summed into one fixed pattern.

use std::mem::take;
use std::sync::Mutex;

use crate::error::SolveError;
use crate::parallel::{for_each_mut, threads};
use crate::term::{Element, View};

use super::layout::NodeColumns;
use super::model::{Model, SERIAL_BELOW};
use super::pattern::Pattern;
use super::slabs::{Gathered, SlabSchedule};
use super::state_ref::StateRef;
use super::sum::{Part, Places, Sum};
use super::system::System;

/// Nodes whose columns are locked together, as a power of two.
const PART: u32 = 5;
/// Floats that one thread clears at a time.
const CLEARED: usize = 1 << 16;

/// The fixed pattern of a model and the places of all cluster blocks in it.
#[derive(Debug, Clone, Default)]
pub struct Assembler {
    pub(super) pattern: Pattern,
    /// Entries of the pattern.
    entries: usize,
    /// Node columns: first scalar entry and node rows below and on the diagonal.
    node_columns: Vec<usize>,
    /// For each term and cluster the first entry in `places`.
    pub(super) first_place: Vec<Vec<usize>>,
    /// For each pair (a ≥ b) of a cluster's nodes, by columns b, the place of the block in its node column.
    pub(super) places: Vec<u32>,
    /// The order of the sums, for each term.
    pub(super) slabs: Vec<SlabSchedule>,
    /// Whether pressures of zones are kept uncondensed, and the rest of the matrices of such terms in tangents at points.
    kept: bool,
    /// One for each thread.
    elements: Vec<Element>,
}

impl Model {
    /// The assembler of this model.
    pub fn assembler(&self) -> Assembler {
        Assembler::with(self, false)
    }

    /// The assembler of this model that keeps pressures of zones apart, in [`System::zones`], and sums nothing of the terms with
    /// such zones into [`System::values`]: solvers are given products with what they keep at points.
    /// [`System::residual`] has the forces with the current pressures; what the local equations leave is in the zones.
    pub fn assembler_free(&self) -> Assembler {
        Assembler::with(self, true)
    }
}

impl Assembler {
    fn with(model: &Model, kept: bool) -> Self {
        if model.misfit.is_some() {
            return Assembler::default();
        }
        let columns = NodeColumns::new(model, kept);
        let pattern = columns.pattern(model.dim());
        let (first_place, places) = columns.places(model, kept);
        Assembler {
            entries: pattern.entries(),
            pattern,
            node_columns: columns.first,
            first_place,
            places,
            slabs: model.terms.iter().map(|term| SlabSchedule::new(model, &**term)).collect(),
            kept,
            elements: Vec::new(),
        }
    }

    /// The pattern of the symmetric part.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// Gives back the rows of the pattern, which the sums don't need, once the conditions have been bound to them.
    pub(crate) fn forget_rows(&mut self) {
        self.pattern.rows = Default::default();
    }

    /// Whether a model is the one that this assembler was made of, as far as numbers of nodes, terms and clusters tell.
    fn is_of(&self, model: &Model) -> bool {
        let clusters = || self.first_place.iter().zip(&model.terms).all(|(mine, term)| mine.len() == term.clusters());
        self.node_columns.len() == model.node_count() + 1 && self.slabs.len() == model.terms.len() && clusters()
    }

    /// Assembles the system of `model` at a state. The sums run in one order whatever the number of threads.
    ///
    /// # Errors
    /// [`SolveError::OtherModel`] for another model than the assembler's, or a state of one.
    pub fn assemble<'a>(
        &mut self,
        model: &Model,
        state: impl Into<StateRef<'a>>,
        system: &mut System,
    ) -> Result<(), SolveError> {
        let at = self.check(model, state.into())?;
        self.assemble_own(model, at, system);
        Ok(())
    }

    /// As [`assemble`](Assembler::assemble), for a model and a state that are known to fit.
    pub(crate) fn assemble_own(&mut self, model: &Model, at: StateRef<'_>, system: &mut System) {
        clear(&mut system.values, self.entries);
        system.skew.clear();
        system.zones.clear();
        system.coupling.clear();
        self.sum(model, at, true, system);
    }

    /// Residual and load slope alone: the matrix of `system` is left as it is.
    pub(crate) fn forces_own(&mut self, model: &Model, at: StateRef<'_>, system: &mut System) {
        self.sum(model, at, false, system);
    }

    fn check<'a>(&self, model: &Model, at: StateRef<'a>) -> Result<StateRef<'a>, SolveError> {
        model.check(at)?;
        ensure!(
            self.is_of(model),
            SolveError::OtherModel {
                what: "terms of the assembler's own clusters",
                given: model.terms.len(),
                needed: self.slabs.len()
            }
        );
        Ok(at)
    }

    /// Sums over all clusters.
    fn sum(&mut self, model: &Model, at: StateRef<'_>, with_matrix: bool, system: &mut System) {
        let unknowns = model.unknowns();
        system.residual.clear();
        system.residual.resize(unknowns, 0.0);
        system.load_slope.clear();
        system.load_slope.resize(unknowns, 0.0);
        system.scale = 0.0;
        let workers = if unknowns >= SERIAL_BELOW { threads() } else { 1 };
        let mut elements = take(&mut self.elements);
        elements.resize_with(workers.max(elements.len()), Element::default);
        system.ranks.clone_from(&model.ranks);
        let System { residual, load_slope, values, skew, scale, zones, coupling, .. } = system;
        let whole = Part { first: 0, values: if with_matrix { values } else { &mut [] }, residual, load_slope };
        let one;
        let (several, mut sum);
        let places = Places {
            pattern: &self.pattern,
            first_block: &self.first_place,
            blocks: &self.places,
            slabs: &self.slabs,
            kept: self.kept,
        };
        let none = View::at_rest(at.displacement, at.load);
        let over = |parts, part| Sum { places, model, at: none, term: 0, with_matrix, parts, part };
        if workers > 1 {
            several = self.parts(model.dim(), whole);
            sum = over(&several, PART);
        } else {
            one = [Mutex::new(whole)];
            sum = over(&one, usize::BITS - 1);
        }
        // Lists keep their memory from one state to the next.
        let mut all = Gathered { scale: 0.0, skew: take(skew), zones: take(zones), coupling: take(coupling) };
        for (term, _) in model.summed() {
            (sum.term, sum.at) = (term, model.at_own(at).view(term));
            let workers = workers.min(self.slabs[term].len());
            if workers > 1 {
                for mut gathered in sum.in_parallel(&mut elements[..workers]) {
                    *scale += gathered.scale;
                    all.skew.append(&mut gathered.skew);
                    all.zones.append(&mut gathered.zones);
                    all.coupling.append(&mut gathered.coupling);
                }
                continue;
            }
            for slab in (0..self.slabs[term].len()).rev() {
                all.scale = 0.0;
                sum.add_clusters(self.slabs[term].places(slab), &mut elements[0], &mut all);
                *scale += all.scale;
            }
        }
        (*skew, *zones, *coupling) = (all.skew, all.zones, all.coupling);
        if let Some(ranks) = &model.ranks {
            // One message for all that is whole on every rank.
            let mut all = Vec::with_capacity(2 * unknowns + 1);
            all.extend_from_slice(residual);
            all.extend_from_slice(load_slope);
            all.push(*scale);
            ranks.sum(&mut all);
            residual.copy_from_slice(&all[..unknowns]);
            load_slope.copy_from_slice(&all[unknowns..2 * unknowns]);
            *scale = all[2 * unknowns];
        }
        *scale = scale.sqrt();
        self.elements = elements;
    }

    /// The columns in parts that can be locked one by one.
    fn parts<'a>(&self, dim: usize, whole: Part<'a>) -> Vec<Mutex<Part<'a>>> {
        let nodes = whole.residual.len() / dim;
        let mut parts = Vec::with_capacity((nodes >> PART) + 1);
        let Part { mut values, mut residual, mut load_slope, .. } = whole;
        let with_matrix = !values.is_empty();
        for first in (0..nodes).step_by(1 << PART) {
            let (first, end) = (first * dim, (first + (1 << PART)).min(nodes) * dim);
            let entries = if with_matrix { self.pattern.columns[end] - self.pattern.columns[first] } else { 0 };
            let mine;
            (mine, values) = values.split_at_mut(entries);
            let (forces, slopes);
            (forces, residual) = residual.split_at_mut(end - first);
            (slopes, load_slope) = load_slope.split_at_mut(end - first);
            parts.push(Mutex::new(Part { first, values: mine, residual: forces, load_slope: slopes }));
        }
        parts
    }
}

/// Makes a list of zeros: on all threads where it is long and its memory is there, for threads that touch new memory
/// at the same time hold each other up.
fn clear(values: &mut Vec<f64>, count: usize) {
    if values.len() != count || threads() < 2 || count < 2 * CLEARED {
        values.clear();
        values.resize(count, 0.0);
        return;
    }
    let mut parts: Vec<&mut [f64]> = values.chunks_mut(CLEARED).collect();
    for_each_mut(&mut parts, |_, part| part.fill(0.0));
}
