//! Problems around models that were composed by hand.

use std::sync::Arc;

use crate::assembly::Model;
use crate::boundary::{Constraints, rounding};
use crate::cells::Cells;
use crate::error::{BoundaryError, Error, Invalid, SolveError};
use crate::geometry::Part;
use crate::shape::Approximation;
use crate::solve::Analysis;
use crate::term::Body;

use super::checked::{CheckedFunctions, check_cells};
use super::conditions::Placed;
use super::discrete_body::DiscreteBody;
use super::facet_rule::{FacetRule, Facets};
use super::problem::Problem;
use crate::scene::{FIRST, Place, Sheet};

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
    /// Where nodes of the approximation, particles of the cells and nodes of the table are not as many, or particles and nodes of one
    /// number lie apart, and for cells with corners that do not exist.
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
        let least = rounding(approximation.nodes());
        let apart = |node: &usize| (cells.positions()[*node] - approximation.nodes()[*node]).amax();
        if let Some(node) = (0..needed).find(|node| !(apart(node) <= least)) {
            let what = format!("distance of particle {node} of the cells from node {node} of the approximation");
            let needed =
                "make both over the same particles in the same order: fields are drawn and averaged by their numbers";
            return Err(Invalid::new(what, apart(&node), needed).into());
        }
        check_cells(&cells)?;
        let (cells, body) = (Arc::new(cells), Arc::new(body));
        let mut model = Model::new(approximation.nodes());
        model.add_shared(body.clone());
        let each = if D == 1 { 1 } else { 2 };
        let discrete_body = DiscreteBody {
            sheet: Sheet::of(&body, None),
            expansion: None,
            name: FIRST.into(),
            nodes: 0..needed,
            body,
            cells,
            approximation: Box::new(CheckedFunctions(approximation)),
            facets: Facets::OfCells(FacetRule { parts: each, gauss: each }),
            dilations: Vec::new(),
            raised: 0,
        };
        Ok(Problem {
            model,
            equations: Constraints::default(),
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
    /// Those of the equations, none of which then stays; where another condition is on a part of that name.
    pub fn constrain(
        &mut self,
        name: impl Into<String>,
        add: impl FnOnce(&mut Constraints) -> Result<(), Error>,
    ) -> Result<&mut Self, Error> {
        let (first, mark, name) = (self.equations.len(), self.equations.mark(), name.into());
        let place = Place::on(Part::Named(name.clone()));
        // Results are asked for by either.
        if self.placed_at(&place).iter().any(|placed| placed.name.as_ref() != Some(&name)) {
            return Err(BoundaryError::NameOfPart { name, place: "unknowns of the problem".into() }.into());
        }
        if let Err(error) = add(&mut self.equations) {
            self.equations.take_back(mark);
            return Err(error);
        }
        let (equations, nodes) = (first..self.equations.len(), 0..self.model.node_count());
        self.placed.push(Placed { name: Some(name), place: None, equations, nodes });
        Ok(self)
    }
}
