//! The discretised bodies of a problem.

use std::ops::Range;
use std::sync::Arc;

use crate::cells::Cells;
use crate::error::{ApproximationError, Error, SolveError};
use crate::geometry::{Point, padded};
use crate::scene::{Sheet, Value};
use crate::shape::{Approximation, Scratch, ShapeFunctions};
use crate::solve::State;
use crate::term::Body;

/// Fewer points are evaluated by one thread.
pub(crate) const SERIAL_BELOW: usize = 64;

/// A body of a problem: its particles, the cells between them, and its term of the potential.
///
/// Its particles are the nodes [`nodes`](DiscreteBody::nodes) of the problem; what it answers of a state is about itself alone.
pub struct DiscreteBody<const D: usize> {
    pub(crate) name: String,
    pub(crate) nodes: Range<usize>,
    pub(crate) body: Arc<Body<D>>,
    pub(crate) cells: Arc<dyn Cells<D>>,
    /// Its shape functions; nodes are counted within the body.
    pub(crate) approximation: Box<dyn Approximation<D>>,
    /// What it is in plane stress.
    pub(crate) sheet: Option<Sheet<D>>,
    /// The stretch of its free expansion, where it has one.
    pub(crate) expansion: Option<Value<D>>,
    /// How its surface is integrated.
    pub(crate) facets: super::facet_rule::Facets,
    /// Largest half-widths of the supports; spacings of finite elements.
    pub(crate) dilations: Vec<f64>,
    /// Particles whose supports were raised to cover the body.
    pub(crate) raised: usize,
}

impl<const D: usize> DiscreteBody<D> {
    /// The name of the body; `body` where the scene has but one.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its nodes among those of the problem.
    pub fn nodes(&self) -> Range<usize> {
        self.nodes.clone()
    }

    /// Its term of the potential.
    pub fn body(&self) -> &Arc<Body<D>> {
        &self.body
    }

    /// Its particles and the cells between them.
    pub fn cells(&self) -> &Arc<dyn Cells<D>> {
        &self.cells
    }

    /// Values of its functions at one of its particles.
    pub(crate) fn values_at_node(&self, node: usize) -> Result<ShapeFunctions<D>, ApproximationError> {
        let mut psi = ShapeFunctions::default();
        self.approximation.evaluate_at_node(node, &mut Scratch::default(), &mut psi)?;
        Ok(psi)
    }

    /// $\sum_I \Psi_I d_I$ for functions whose nodes are counted within the body.
    pub(crate) fn weighted(&self, psi: &ShapeFunctions<D>, state: &State) -> Point<D> {
        padded(&psi.weighted(D, &state.displacement[self.nodes.start * D..]))
    }

    /// The displacement \[length\] at a point of the body.
    ///
    /// # Errors
    /// Where the point lies outside the body by more than a tenth of a cell, and for a state of another problem.
    pub fn displacement(&self, state: &State, at: &Point<D>) -> Result<Point<D>, Error> {
        ensure!(self.cells.contains(at), ApproximationError::Outside { at: at.as_slice().to_vec() });
        self.reads(state)?;
        Ok(self.weighted(&self.approximation.shape_functions(at)?, state))
    }

    fn reads(&self, state: &State) -> Result<(), SolveError> {
        let (given, needed) = (state.displacement.len(), self.nodes.end * D);
        let what = "displacement";
        if given < needed { Err(SolveError::OtherModel { what, given, needed }) } else { Ok(()) }
    }
}
