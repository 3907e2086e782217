//! Problems around models that were composed by hand.

use std::sync::Arc;

use crate::assembly::Model;
use crate::boundary::Constraints;
use crate::cells::Cells;
use crate::error::{Error, SolveError};
use crate::geometry::Part;
use crate::shape::Approximation;
use crate::solve::Analysis;
use crate::term::Body;

use super::conditions::Placed;
use super::discrete_body::DiscreteBody;
use super::facet_rule::{FacetRule, Facets};
use super::problem::Problem;
use crate::scene::{FIRST, Place};

impl<const D: usize> Problem<D> {
    /// A problem of one body with a basis, an approximation or a rule of one's own, which has all answers of one made from a
    /// scene: reactions, stresses, pictures and files.
    ///
    /// `cells` lie between the nodes of `approximation`, and the table of `body` is made with it. Loads follow by
    /// [`add`](Problem::add), conditions by [`constrain`](Problem::constrain), strategies by [`analysis_mut`](Problem::analysis_mut).
    /// ```
    /// use std::sync::Arc;
    /// use rkpm::prelude::*;
    /// let lattice = Block::new([0.0, 0.0], [2.0, 1.0]).lattice([9, 5])?;
    /// let rk = ReproducingKernel::new(lattice.particles(2.0)?, CubicSpline, Polynomial::new(2))?; // second order
    /// let table = ShapeTable::new(&rk, &lattice.coarsened(2).gauss(6)?, &PlaneStrain)?;
    /// let rubber: Arc<dyn Material> = Arc::new(Rubber::neo_hookean(0.5, 1e2)?);
    /// let held = lattice.boundary(&Side::Min.into(), 2, 3)?;
    /// let pulled = lattice.boundary(&Side::Max.into(), 2, 3)?;
    /// let functions = rk.clone();
    /// let mut problem = Problem::compose(lattice, rk, Body::new(table, rubber, PressureField::Linear))?;
    /// for (name, face, value) in [("held", &held, 0.0), ("pulled", &pulled, 0.2)] {
    ///     problem.constrain(name, |equations| {
    ///         equations.over_boundary(&functions, face, &PlaneStrain, 0, &|_| value, &Amplitude::Ramp, name)?;
    ///         equations.over_boundary(&functions, face, &PlaneStrain, 1, &|_| 0.0, &Amplitude::Ramp, name)
    ///     })?;
    /// }
    /// let path = problem.run()?.completed()?;
    /// let [left, right] = ["held", "pulled"].map(|name| problem.reaction(path.last(), name));
    /// assert!((left?[0] + right?[0]).abs() < 1e-8);
    /// assert!(problem.stress(path.last(), &[1.0, 0.5].into())?[(0, 0)] > 0.1);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// Where nodes of the approximation, particles of the cells and nodes of the table are not as many.
    pub fn compose(
        cells: impl Cells<D> + 'static,
        approximation: impl Approximation<D> + 'static,
        body: Body<D>,
    ) -> Result<Self, Error> {
        let needed = approximation.nodes().len();
        let counts = [("particles of the cells", cells.positions().len()), ("the table", body.table().node_count())];
        if let Some(&(what, given)) = counts.iter().find(|(_, given)| *given != needed) {
            return Err(SolveError::Length { what, given, needed }.into());
        }
        let body = Arc::new(body);
        let mut model = Model::new(approximation.nodes());
        model.add_shared(body.clone());
        let each = if D == 1 { 1 } else { 2 };
        let discrete_body = DiscreteBody {
            sheet: None,
            name: FIRST.into(),
            nodes: 0..needed,
            body,
            cells: Arc::new(cells),
            approximation: Box::new(approximation),
            facets: Facets::OfCells(FacetRule { parts: each, gauss: each }),
            dilations: Vec::new(),
            raised: 0,
        };
        Ok(Problem {
            model,
            equations: Constraints::new(),
            analysis: Analysis::default(),
            discrete_bodies: vec![discrete_body],
            loads: Vec::new(),
            contacts: Vec::new(),
            frames: Vec::new(),
            placed: Vec::new(),
            names: Vec::new(),
            rolling: Vec::new(),
        })
    }

    /// Adds constraint equations of one's own under a name, by which [`reaction`](Problem::reaction) and
    /// [`moment`](Problem::moment) find them.
    ///
    /// # Errors
    /// Those of the equations.
    pub fn constrain(
        &mut self,
        name: impl Into<String>,
        add: impl FnOnce(&mut Constraints) -> Result<(), Error>,
    ) -> Result<&mut Self, Error> {
        let (first, name) = (self.equations.len(), name.into());
        add(&mut self.equations)?;
        let place = Place::on(Part::Named(name.clone()));
        let (equations, nodes) = (first..self.equations.len(), 0..self.model.node_count());
        self.placed.push(Placed { name: Some(name), place, equations, nodes });
        Ok(self)
    }
}
