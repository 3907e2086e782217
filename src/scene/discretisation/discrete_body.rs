//! The discretised bodies of a problem.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::Matrix3;

use crate::cells::Cells;
use crate::error::{ApproximationError, Error, SolveError};
use crate::geometry::Point;
use crate::parallel::map_with;
use crate::scene::Sheet;
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

    /// Values of its functions at points, nodes counted within the body.
    pub(crate) fn values_at(&self, points: &[Point<D>]) -> Result<Vec<ShapeFunctions<D>>, Error> {
        Ok(self.each_at(points).into_iter().collect::<Result<_, ApproximationError>>()?)
    }

    /// Values of its functions at each of several points, or why there are none.
    fn each_at(&self, points: &[Point<D>]) -> Vec<Result<ShapeFunctions<D>, ApproximationError>> {
        map_with(points.len(), SERIAL_BELOW, Scratch::default, |scratch, point| {
            let mut psi = ShapeFunctions::default();
            self.approximation.evaluate_values(&points[point], scratch, &mut psi)?;
            Ok(psi)
        })
    }

    /// Values of its functions at one of its particles.
    pub(crate) fn values_at_node(&self, node: usize) -> Result<ShapeFunctions<D>, ApproximationError> {
        let mut psi = ShapeFunctions::default();
        self.approximation.evaluate_at_node(node, &mut Scratch::default(), &mut psi)?;
        Ok(psi)
    }

    /// Values of its functions at points of faces, each with what makes it of particles: points of a plane face that a curved body
    /// does not reach, in a bore say, move as these particles do.
    pub(crate) fn values_on(
        &self,
        points: &[Point<D>],
        weights: &[Vec<(usize, f64)>],
    ) -> Result<Vec<ShapeFunctions<D>>, Error> {
        let found = self.each_at(points).into_iter().zip(weights);
        let each = found.map(|(found, weights)| match found {
            Err(ApproximationError::Outside { .. }) => self.joined(weights),
            found => found,
        });
        Ok(each.collect::<Result<_, _>>()?)
    }

    /// The functions of several particles, weighted.
    fn joined(&self, weights: &[(usize, f64)]) -> Result<ShapeFunctions<D>, ApproximationError> {
        let mut sum: BTreeMap<u32, f64> = BTreeMap::new();
        for &(particle, weight) in weights {
            let psi = self.values_at_node(particle)?;
            for (node, value) in psi.nodes.iter().zip(&psi.values) {
                *sum.entry(*node).or_default() += weight * value;
            }
        }
        let (nodes, values) = sum.into_iter().unzip();
        Ok(ShapeFunctions { nodes, values, rcond: 1.0, ..ShapeFunctions::default() })
    }

    /// $\sum_I \Psi_I d_I$ for functions whose nodes are counted within the body.
    pub(crate) fn weighted(&self, psi: &ShapeFunctions<D>, state: &State) -> Point<D> {
        let mut u = Point::zeros();
        for (&node, &value) in psi.nodes.iter().zip(&psi.values) {
            for i in 0..D {
                u[i] += value * state.displacement[(self.nodes.start + node as usize) * D + i];
            }
        }
        u
    }

    /// The displacement \[length\] at a point of the body.
    ///
    /// # Errors
    /// Where the point lies outside the body by more than a tenth of a cell, and for a state of another problem.
    pub fn displacement(&self, state: &State, at: &Point<D>) -> Result<Point<D>, Error> {
        if !self.cells.contains(at) {
            return Err(ApproximationError::Outside { at: at.as_slice().to_vec() }.into());
        }
        self.reads(state)?;
        Ok(self.weighted(&self.approximation.shape_functions(at)?, state))
    }

    /// Displacements at its particles \[length\].
    ///
    /// # Errors
    /// Where a particle is not covered, and for a state of another problem.
    pub fn particle_displacements(&self, state: &State) -> Result<Vec<Point<D>>, Error> {
        self.reads(state)?;
        let (mut scratch, mut psi) = (Scratch::default(), ShapeFunctions::default());
        let mut displacements = Vec::with_capacity(self.nodes.len());
        for particle in 0..self.nodes.len() {
            self.approximation.evaluate_at_node(particle, &mut scratch, &mut psi)?;
            displacements.push(self.weighted(&psi, state));
        }
        Ok(displacements)
    }

    fn reads(&self, state: &State) -> Result<(), SolveError> {
        let (given, needed) = (state.displacement.len(), self.nodes.end * D);
        let what = "displacement";
        if given < needed { Err(SolveError::OtherModel { what, given, needed }) } else { Ok(()) }
    }

    /// Deformation gradients at the points of the body's table.
    ///
    /// # Errors
    /// [`SolveError::OtherModel`] for a state of another problem.
    pub fn deformation_gradients(&self, state: &State) -> Result<Vec<Matrix3<f64>>, SolveError> {
        self.reads(state)?;
        let points = 0..self.body.table().len();
        Ok(points.map(|point| self.body.deformation_gradient(point, &state.displacement)).collect())
    }

    /// Hydrostatic pressures \[stress\] at the points of the body's table; `number` is that of its term.
    pub(crate) fn pressures(&self, number: usize, state: &State) -> Option<Vec<f64>> {
        self.body.pressures(state.view(number)?)
    }

    /// The same of the part that is proportional to the bulk modulus.
    pub(crate) fn bulk_pressures(&self, number: usize, state: &State) -> Option<Vec<f64>> {
        self.body.bulk_pressures(state.view(number)?)
    }
}
