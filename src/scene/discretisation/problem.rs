//! Problems: a scene under a scheme, ready to run and to ask.

use std::ops::Range;
use std::sync::Arc;

use crate::assembly::Model;
use crate::boundary::Constraints;
use crate::cells::{Cells, Lattice, member};
use crate::error::{ApproximationError, Error, SolveError};
use crate::geometry::{Mat3, Point, all_padded};
use crate::solve::{Analysis, State};
use crate::term::{Body, Term};

use super::conditions::Placed;
use super::discrete_body::DiscreteBody;
use super::frame::RigidFrame;
use super::neutral::Rolling;
use crate::scene::{Contact, Load, LoadKind, Place};

/// A discretised scene: model, rows and analysis, and the fields of its states.
///
/// Fields are those of all bodies, one after the other in the order of the scene; [`discrete_bodies`](Problem::discrete_bodies) has them one
/// by one.
pub struct Problem<const D: usize> {
    pub(crate) model: Model,
    pub(crate) equations: Constraints,
    pub(crate) analysis: Analysis,
    pub(crate) discrete_bodies: Vec<DiscreteBody<D>>,
    /// Loads on deformable bodies.
    pub(crate) loads: Vec<LoadTerms>,
    /// What touches what.
    pub(crate) contacts: Vec<Contact>,
    /// Bodies that are free to roll.
    pub(crate) rolling: Vec<Rolling>,
    /// The frames of the rigid bodies.
    pub(crate) frames: Vec<RigidFrame>,
    /// The conditions and their rows.
    pub(crate) placed: Vec<Placed<D>>,
    pub(crate) names: Vec<(String, Place<D>)>,
}

/// The terms of a load, one for each body that it acts on.
pub(crate) struct LoadTerms {
    pub label: String,
    pub terms: Range<usize>,
    /// Whether it turns with the surface.
    pub follows: bool,
}

impl LoadTerms {
    pub(crate) fn of<const D: usize>(load: &Load<D>, terms: Range<usize>) -> Self {
        LoadTerms { label: load.label(), terms, follows: matches!(load.kind, LoadKind::Pressure(_)) }
    }
}

impl<const D: usize> Problem<D> {
    /// The terms of the potential.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Adds a term of one's own, over tables made by [`tabulate`](Problem::tabulate). Where ranks share the scene, all of them
    /// add it and the first sums it.
    pub fn add(&mut self, term: impl Term + 'static) -> &mut Self {
        self.model.add_replicated(Arc::new(term));
        self
    }

    /// The essential conditions.
    pub fn equations(&self) -> &Constraints {
        &self.equations
    }

    /// Strategies and stepping.
    pub fn analysis(&self) -> &Analysis {
        &self.analysis
    }

    /// Strategies and stepping, to exchange one.
    pub fn analysis_mut(&mut self) -> &mut Analysis {
        &mut self.analysis
    }

    /// The bodies.
    pub fn discrete_bodies(&self) -> &[DiscreteBody<D>] {
        &self.discrete_bodies
    }

    /// The first body.
    pub(crate) fn first(&self) -> &DiscreteBody<D> {
        // A scene without a body is refused.
        &self.discrete_bodies[0]
    }

    /// The term of the first body, also the first one of the model.
    pub fn body(&self) -> &Arc<Body<D>> {
        &self.first().body
    }

    /// The particles of the first body and the cells between them.
    pub fn cells(&self) -> &Arc<dyn Cells<D>> {
        &self.first().cells
    }

    /// The body that a point lies in, the first one on an interface.
    pub(crate) fn member_at(&self, at: &Point<D>) -> Result<&DiscreteBody<D>, ApproximationError> {
        let found = member(self.discrete_bodies.iter().map(|body| &*body.cells), at);
        found
            .map(|body| &self.discrete_bodies[body])
            .ok_or_else(|| ApproximationError::Outside { at: at.as_slice().to_vec() })
    }

    /// The lattice of particles, where the only body is on one.
    pub fn lattice(&self) -> Option<&Lattice<D>> {
        self.cells().lattice().filter(|_| self.discrete_bodies.len() == 1)
    }

    /// The displacement $u(X) = \sum_I\Psi_I(X)\\,d_I$ \[length\] at a point of the body.
    ///
    /// # Errors
    /// Where the point lies outside the body by more than a tenth of a cell, though supports reach there.
    pub fn displacement(&self, state: &State, at: &Point<D>) -> Result<Point<D>, Error> {
        self.check_length(state)?;
        let discrete_body = self.member_at(at)?;
        Ok(discrete_body.weighted(&discrete_body.approximation.shape_functions(at)?, state))
    }

    /// Reference positions of the nodes \[length\]: the particles, body by body, then the nodes of surfaces that are pushed and of rigid
    /// bodies.
    pub fn positions(&self) -> Vec<Point<D>> {
        self.model.points()
    }

    /// Displacements at all particles \[length\].
    ///
    /// # Errors
    /// Where a particle is not covered.
    pub fn particle_displacements(&self, state: &State) -> Result<Vec<Point<D>>, Error> {
        self.check_length(state)?;
        Ok(all_padded(&self.view().particle_displacements(state)?))
    }

    /// The displacement at a particle.
    pub(crate) fn node_displacement(&self, node: usize, state: &State) -> Result<Point<D>, Error> {
        let holds = |discrete_body: &&DiscreteBody<D>| discrete_body.nodes.contains(&node);
        let discrete_body = self.discrete_bodies.iter().find(holds).unwrap_or(self.first());
        Ok(discrete_body.weighted(&discrete_body.values_at_node(node - discrete_body.nodes.start)?, state))
    }

    /// Refuses states of other particles, and displacement vectors that are not as long as this problem has them.
    pub(crate) fn check_length(&self, state: &State) -> Result<(), SolveError> {
        let (given, needed) = (state.displacement.len(), self.model.unknowns());
        ensure!(given == needed, SolveError::OtherModel { what: "displacement", given, needed });
        if state.origin.differs(self.model.origin()) { Err(SolveError::OtherParticles) } else { Ok(()) }
    }

    /// Energy stored in a state, of the whole revolution for bodies of revolution. Where a law relaxes or softens it is the potential of a step
    /// from what is remembered, whose derivatives are the forces: what is stored in the branches of a Prony series is not known from them, and
    /// the value may be below zero.
    ///
    /// # Errors
    /// [`SolveError::OtherModel`] for a state of another problem.
    pub fn energy(&self, state: &State) -> Result<f64, Error> {
        Ok(self.model.at(state)?.energy())
    }

    /// Time at a state, by the clock of the scene \[time\]; 0 without one.
    pub fn time(&self, state: &State) -> f64 {
        self.model.time(state.load)
    }

    /// Positions of the points of the bodies' tables \[length\], at which fields are given.
    pub fn points(&self) -> impl Iterator<Item = &Point<D>> {
        self.discrete_bodies.iter().flat_map(|discrete_body| discrete_body.body.table().positions())
    }

    /// Weights of the points of the bodies' tables: parts of the reference volume.
    pub fn weights(&self) -> impl Iterator<Item = f64> {
        self.discrete_bodies.iter().flat_map(|discrete_body| discrete_body.body.table().weights().iter().copied())
    }

    /// Deformation gradients at the [`points`](Problem::points) of the bodies' tables.
    ///
    /// # Errors
    /// [`SolveError::OtherModel`] for a state of another problem.
    pub fn deformation_gradients(&self, state: &State) -> Result<Vec<Mat3>, Error> {
        self.check_length(state)?;
        Ok(self.view().deformation_gradients(state))
    }

    /// Hydrostatic pressures $p = U'$ (2.15) \[stress\], positive in tension, at the [`points`](Problem::points) of the bodies' tables;
    /// those of the zones where pressures are projected. `None` where a material has no volumetric part.
    ///
    /// # Errors
    /// [`SolveError::OtherModel`] for a state of another problem.
    pub fn pressures(&self, state: &State) -> Result<Option<Vec<f64>>, Error> {
        self.model.at(state)?;
        Ok(self.view().pressures(state))
    }
}
