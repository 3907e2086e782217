//! One body of a scene on its way to a problem: its definition, its material and clock, and the tables of its loads.

use std::ops::Range;
use std::sync::Arc;

use crate::boundary::Constraints;
use crate::cells::Cells;
use crate::error::{BoundaryError, Error, Incompatible};
use crate::geometry::{Bounds, Part};
use crate::linear::Krylov;
use crate::material::Material;
use crate::quadrature::Points;
use crate::shape::Approximation;
use crate::table::ShapeTable;
use crate::term::Body;

use super::conditions::{Conditioned, Nowhere, Placed, Prescribed, Refused, TiedPrescription, equations};
use super::discrete_body::DiscreteBody;
use super::facet_rule::{FacetRule, Facets};
use super::sharing::Sharing;
use super::unmeasured::Unmeasured;
use crate::scene::{BodyOf, LoadKind, Place, Scene, Scheme, Sheet, Spot};

/// How many times finer facets are integrated where a load acts on a part of a part.
pub(crate) const FINER: usize = 4;

/// A body that is discretised: what of the scene is about it, and its nodes among all.
pub(crate) struct BodyInput<'a, const D: usize> {
    pub(crate) scene: &'a Scene<D>,
    pub(crate) body: &'a BodyOf<D>,
    pub(crate) scheme: &'a Scheme,
    pub(crate) cells: Arc<dyn Cells<D>>,
    pub(crate) conditions: &'a [(usize, Place<D>)],
    pub(crate) loads: &'a [(usize, Place<D>)],
    /// The parts tied to rigid bodies, by their numbers among all of them.
    pub(crate) ties: &'a [(usize, Place<D>)],
    pub(crate) first: usize,
    pub(crate) total: usize,
    pub(crate) sharing: &'a Sharing,
}

/// A body that was discretised; rows and conditions count nodes within the body.
pub(crate) struct BuiltBody<const D: usize> {
    pub(crate) discrete_body: DiscreteBody<D>,
    pub(crate) facets: FacetRule,
    pub(crate) equations: Constraints,
    pub(crate) placed: Vec<Placed<D>>,
    /// Loads with the tables of their places.
    pub(crate) loads: Vec<(usize, ShapeTable<D>)>,
    /// The rows that tie parts to rigid bodies, by the numbers of these.
    pub(crate) ties: Vec<(usize, Range<usize>)>,
    /// What conditions prescribe at particles that are tied to rigid bodies.
    pub(crate) at_ties: Vec<TiedPrescription>,
    /// Conditions, parts tied to rigid bodies, and loads that select nothing here.
    pub(crate) nowhere: [Nowhere; 3],
    /// An iterative solver, where one is chosen.
    pub(crate) krylov: Option<Krylov>,
}

/// Where tables of loads come from: boundary parts and the body.
pub(crate) struct Tables<'a, const D: usize> {
    pub(crate) boundary: &'a dyn Fn(&Part, &Place<D>) -> Result<ShapeTable<D>, Error>,
    pub(crate) body: &'a dyn Fn(&Place<D>) -> Result<ShapeTable<D>, Error>,
}

impl<const D: usize> BodyInput<'_, D> {
    /// A table of the body with the numbers that its nodes have among all.
    pub(crate) fn among_all(&self, table: ShapeTable<D>) -> ShapeTable<D> {
        if self.first == 0 && table.node_count() == self.total { table } else { table.shifted(self.first, self.total) }
    }

    /// The body of a table and of its material, with the scene's free expansion.
    pub(crate) fn body_of(
        &self,
        table: ShapeTable<D>,
        of: impl FnOnce(ShapeTable<D>, Arc<dyn Material>) -> Body<D>,
    ) -> Result<Body<D>, Error> {
        let table = self.among_all(expanding(self.scene, table)?);
        Ok(of(table, self.body.material.clone()))
    }

    /// The equations of the conditions on the body and of its parts tied to rigid ones.
    pub(crate) fn prescribed(
        &self,
        approximation: &dyn Approximation<D>,
        facets: Option<FacetRule>,
        refused: Refused<'_>,
    ) -> Result<Prescribed<D>, Error> {
        let of = Conditioned { scene: self.scene, cells: &*self.cells, approximation, facets };
        equations(&of, self.conditions, self.ties, refused)
    }

    pub(crate) fn discrete_body(
        &self,
        body: Body<D>,
        approximation: Box<dyn Approximation<D>>,
        facets: Facets,
        dilations: Vec<f64>,
        raised: usize,
    ) -> DiscreteBody<D> {
        let nodes = self.first..self.first + self.cells.positions().len();
        let (name, cells, body) = (self.body.name.clone(), self.cells.clone(), Arc::new(body));
        let expansion = self.scene.expansion.clone();
        let sheet = Sheet::of(&body, expansion.clone());
        DiscreteBody { name, nodes, body, cells, approximation, sheet, expansion, facets, dilations, raised }
    }
}

/// The table of the body, with the scene's free expansion.
pub(crate) fn expanding<const D: usize>(scene: &Scene<D>, table: ShapeTable<D>) -> Result<ShapeTable<D>, Error> {
    match &scene.expansion {
        None => Ok(table),
        Some(stretch) => table.expanding(|x| stretch.at(x, 1.0)),
    }
}

/// The refusal of a load whose place selects nothing, with the boundary particles that it is among.
fn empty<const D: usize>(definition: &BodyInput<'_, D>, what: String, place: &Place<D>) -> BoundaryError {
    let part = match &place.spot {
        Spot::Part(part) => part.clone(),
        _ => Part::Whole,
    };
    let positions = definition.cells.positions();
    let nodes = definition.cells.particles_on(&part).unwrap_or_default();
    let Bounds { low, high } = Bounds::of(nodes.iter().map(|&node| &positions[node]));
    BoundaryError::NoFacet { what, low: low.as_slice().to_vec(), high: high.as_slice().to_vec() }
}

/// The tables of the loads on a body, and the loads that select nothing on it.
pub(crate) fn load_tables<const D: usize>(
    definition: &BodyInput<'_, D>,
    approximation: &dyn Approximation<D>,
    tables: &Tables<'_, D>,
) -> Result<(Vec<(usize, ShapeTable<D>)>, Nowhere), Error> {
    let (mut built, mut nowhere) = (Vec::with_capacity(definition.loads.len()), Vec::new());
    for (number, place) in definition.loads {
        let load = &definition.scene.loads[*number];
        if let LoadKind::Moment(_) = load.kind {
            let remedy = "tie the part to a rigid body by Scene::rigid";
            return Err(Incompatible::new(load.label(), "a part that may deform", remedy).into());
        }
        let table = || match &place.spot {
            Spot::Part(part) => (tables.boundary)(part, place),
            // A point load is a force already: it takes no measure.
            Spot::Point(at) => {
                ensure!(
                    definition.cells.contains(at),
                    BoundaryError::Outside { what: load.label(), at: at.as_slice().to_vec() }
                );
                Ok(ShapeTable::new(approximation, &definition.sharing.points(Points::single(*at)), &Unmeasured)?)
            }
            Spot::Body => (tables.body)(place),
        };
        let table = definition.sharing.agreed(table())?;
        let mut points = [table.weights().len() as f64];
        definition.sharing.total(&mut points);
        match points[0] {
            0.0 => nowhere.push((*number, empty(definition, load.label(), place).into())),
            _ => built.push((*number, definition.among_all(table))),
        }
    }
    Ok((built, nowhere))
}
