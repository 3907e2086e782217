//! Problems: a scene under a scheme, ready to run and to ask.

use std::sync::Arc;

use nalgebra::Matrix3;

use crate::assembly::Model;
use crate::boundary::Constraints;
use crate::cells::{Cells, Lattice};
use crate::error::{ApproximationError, Error, SolveError};
use crate::geometry::Point;
use crate::kinematics::Kinematics;
use crate::material::Material;
use crate::parallel::map_with;
use crate::quadrature::Points;
use crate::shape::{Approximation, ShapeFunctions};
use crate::solve::{Analysis, EquilibriumPath, Observer, State};
use crate::table::ShapeTable;
use crate::term::{Body, View};

use super::Place;
use super::conditions::Placed;
use super::contact::Contact;

/// Fewer points are evaluated by one thread.
pub(super) const SERIAL_BELOW: usize = 64;

/// Shape functions of any approximation, with the type erased.
pub(crate) trait Evaluate<const D: usize>: Send + Sync {
    fn shape_functions_at(&self, at: &Point<D>) -> Result<ShapeFunctions<D>, ApproximationError>;

    /// Displacements at many points, by their values alone.
    fn displacements_at(&self, points: &[Point<D>], state: &State) -> Vec<Result<Point<D>, ApproximationError>>;

    /// Values at a node; interpolating functions know them without looking.
    fn values_at_node(&self, node: usize) -> Result<ShapeFunctions<D>, ApproximationError>;

    /// A table at points inside cells; on edges between finite elements gradients are ambiguous.
    fn tabulate(&self, points: &Points<D>, kinematics: &dyn Kinematics<D>) -> Result<ShapeTable<D>, Error>;
}

impl<const D: usize, A: Approximation<D> + Send> Evaluate<D> for A {
    fn shape_functions_at(&self, at: &Point<D>) -> Result<ShapeFunctions<D>, ApproximationError> {
        self.shape_functions(at)
    }

    fn displacements_at(&self, points: &[Point<D>], state: &State) -> Vec<Result<Point<D>, ApproximationError>> {
        map_with(points.len(), SERIAL_BELOW, <(A::Scratch, ShapeFunctions<D>)>::default, |(scratch, psi), point| {
            self.evaluate_values(&points[point], scratch, psi)?;
            Ok(weighted(psi, state))
        })
    }

    fn values_at_node(&self, node: usize) -> Result<ShapeFunctions<D>, ApproximationError> {
        let mut out = ShapeFunctions::default();
        self.evaluate_at_node(node, &mut A::Scratch::default(), &mut out)?;
        Ok(out)
    }

    fn tabulate(&self, points: &Points<D>, kinematics: &dyn Kinematics<D>) -> Result<ShapeTable<D>, Error> {
        ShapeTable::new(self, points, kinematics)
    }
}

/// $\sum_I \Psi_I d_I$.
pub(super) fn weighted<const D: usize>(psi: &ShapeFunctions<D>, state: &State) -> Point<D> {
    let mut u = Point::zeros();
    for (&node, &value) in psi.nodes.iter().zip(&psi.values) {
        for i in 0..D {
            u[i] += value * state.displacement[node as usize * D + i];
        }
    }
    u
}

/// A discretised scene: model, rows and analysis, and the fields of its states.
pub struct Problem<const D: usize> {
    /// The terms.
    pub model: Model<D>,
    /// The essential conditions.
    pub rows: Constraints,
    /// Strategies and stepping.
    pub analysis: Analysis,
    /// The body, also the first term of the model.
    pub body: Arc<Body<D, Arc<dyn Material>>>,
    /// The particles and the cells between them.
    pub cells: Arc<dyn Cells<D>>,
    pub(crate) approximation: Box<dyn Evaluate<D>>,
    /// Largest half-widths of the supports; spacings of finite elements.
    pub(crate) dilations: Vec<f64>,
    /// Particles whose supports were raised to cover the body.
    pub(crate) raised: usize,
    /// What touches what.
    pub(crate) contacts: Vec<Contact<D>>,
    /// The conditions and their rows.
    pub(crate) placed: Vec<Placed<D>>,
    pub(crate) names: Vec<(String, Place<D>)>,
}

impl<const D: usize> Problem<D> {
    /// The lattice of particles, where they are on one.
    pub fn lattice(&self) -> Option<&Lattice<D>> {
        self.cells.lattice()
    }

    /// Runs the analysis from rest to load factor 1.
    ///
    /// # Errors
    /// As [`Analysis::run`]; a stalled analysis returns its path.
    pub fn run(&self, observer: &mut dyn Observer) -> Result<EquilibriumPath, Error> {
        self.analysis.run(&self.model, &self.rows, observer)
    }

    /// The state at rest, from which [`run`](Problem::run) starts.
    pub fn at_rest(&self) -> State {
        State::at_rest(&self.model, &self.rows)
    }

    /// Goes on from the last step of a path, with the same bits as if it had never been broken off.
    ///
    /// # Errors
    /// As [`Analysis::resume`].
    pub fn resume(&self, path: EquilibriumPath, observer: &mut dyn Observer) -> Result<EquilibriumPath, Error> {
        self.analysis.resume(&self.model, &self.rows, path, observer)
    }

    /// The displacement $u(X) = \sum_I\Psi_I(X)\\,d_I$ \[length\] at a point of the body.
    ///
    /// # Errors
    /// Where the point lies outside the body by more than a tenth of a cell, though supports reach there.
    pub fn displacement(&self, state: &State, at: &Point<D>) -> Result<Point<D>, Error> {
        if !self.cells.contains(at) {
            return Err(ApproximationError::Outside { at: at.as_slice().to_vec() }.into());
        }
        self.check_length(state)?;
        Ok(weighted(&self.approximation.shape_functions_at(at)?, state))
    }

    /// Displacements at all particles \[length\].
    ///
    /// # Errors
    /// Where a particle is not covered.
    pub fn particle_displacements(&self, state: &State) -> Result<Vec<Point<D>>, Error> {
        self.check_length(state)?;
        let particles = 0..self.cells.positions().len();
        particles.map(|p| Ok(weighted(&self.approximation.values_at_node(p)?, state))).collect()
    }

    /// A displacement vector as long as this problem has it.
    pub(super) fn check_length(&self, state: &State) -> Result<(), SolveError> {
        let (given, needed) = (state.displacement.len(), self.model.unknowns());
        if given == needed { Ok(()) } else { Err(SolveError::Length { what: "displacement", given, needed }) }
    }

    /// Energy stored in a state, of the whole revolution for bodies of revolution; NaN for a state of another problem.
    pub fn energy(&self, state: &State) -> f64 {
        if state.check_lengths(&self.model, &self.rows).is_err() {
            return f64::NAN;
        }
        self.model.energy(&state.displacement, &state.condensed, state.load)
    }

    /// Time at a state, by the clock of the scene \[time\]; 0 without one.
    pub fn time(&self, state: &State) -> f64 {
        self.body.time(state.load)
    }

    /// Deformation gradients at the points of the body's table, whose positions are
    /// `problem.body.table().positions()`; none for a state of another problem.
    pub fn deformation_gradients(&self, state: &State) -> Vec<Matrix3<f64>> {
        if self.check_length(state).is_err() {
            return Vec::new();
        }
        let points = 0..self.body.table().len();
        points.map(|point| self.body.deformation_gradient(point, &state.displacement)).collect()
    }

    /// Hydrostatic pressures \[stress\] at the points of the body's table, see [`Body::pressures`].
    pub fn pressures(&self, state: &State) -> Option<Vec<f64>> {
        let condensed = state.condensed.first()?;
        self.body.pressures(View { displacement: &state.displacement, condensed, load: state.load })
    }
}
