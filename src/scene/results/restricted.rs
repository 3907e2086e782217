//! How a model holds parts of faces that predicates restrict.

use crate::each::Each;
use crate::geometry::Point;
use crate::scene::discretisation::conditions::Placed;
use crate::scene::discretisation::facet_rule::Facets;
use crate::scene::{Problem, Spot};
use crate::shape::FiniteElements;

/// Times as dense as a model's own points are those by which it is compared with its predicates.
const DENSER: usize = 8;

impl<const D: usize> Problem<D> {
    /// The largest part of a face's part that conditions leave out, or hold beyond it, where a predicate ends it between facets or nodes:
    /// models that end it at the same place agree.
    pub(crate) fn missed_parts(&self) -> f64 {
        let restricted = self.placed.iter().filter(|placed| !placed.place.within.is_empty());
        restricted.filter_map(|placed| self.missed(placed)).fold(0.0, f64::max)
    }

    fn missed(&self, placed: &Placed<D>) -> Option<f64> {
        let Spot::Part(part) = &placed.place.spot else { return None };
        let body = self.discrete_bodies.iter().find(|body| body.nodes.start == placed.nodes.start)?;
        let holds = |x: &Point<D>| placed.place.holds(x);
        let (held, dense) = match body.facets {
            Facets::OfCells(rule) => {
                let own = body.cells.boundary(part, rule.parts, rule.gauss).ok()?.within(&holds);
                let dense = body.cells.boundary(part, DENSER * rule.parts, rule.gauss).ok()?;
                (own.points.weights.summed(|weight| *weight), dense.points)
            }
            Facets::OfElements { order, gauss } => {
                let elements = FiniteElements::new(body.cells.lattice()?.clone(), order).ok()?;
                let (own, _) = elements.contact_boundary(part, gauss, &|_| true).ok()?;
                let nodes = body.approximation.nodes();
                // What lies between nodes that are held.
                let within = |traces: &[(u32, f64)]| traces.iter().all(|trace| holds(&nodes[trace.0 as usize]));
                let points = own.traces.iter().zip(&own.points.weights).filter(|(traces, _)| within(traces));
                (points.map(|(_, weight)| weight).sum(), elements.boundary(part, DENSER * gauss).ok()?.points)
            }
        };
        let inside = dense.positions.iter().zip(&dense.weights).filter(|(x, _)| holds(x));
        let whole: f64 = inside.map(|(_, weight)| weight).sum();
        (whole > 0.0).then(|| (held - whole).abs() / whole)
    }
}
