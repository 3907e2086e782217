//! How well a model resolves the part of a face that a predicate selects.

use crate::each::Each;
use crate::geometry::Point;
use crate::scene::discretisation::conditions::Placed;
use crate::scene::discretisation::facet_rule::Facets;
use crate::scene::{Problem, Spot};
use crate::shape::FiniteElements;

/// Points by which a predicate is integrated, per direction, over those of the model.
const DENSER: usize = 8;

impl<const D: usize> Problem<D> {
    /// The largest relative difference between the area on which a condition acts and that which its predicate selects. Coarse models may
    /// all end a condition at the same node, so that the difference between them does not tell it.
    pub(crate) fn missed_parts(&self) -> f64 {
        self.placed.iter().filter_map(|placed| self.missed(placed)).fold(0.0, f64::max)
    }

    fn missed(&self, placed: &Placed<D>) -> Option<f64> {
        let place = placed.place.as_ref().filter(|place| !place.within.is_empty())?;
        let Spot::Part(part) = &place.spot else { return None };
        let body = self.discrete_bodies.iter().find(|body| body.nodes.start == placed.nodes.start)?;
        let holds = |x: &Point<D>| place.holds(x);
        let (held, dense) = match body.facets {
            Facets::OfCells(rule) => {
                let own = body.cells.facets(part, rule.parts, rule.gauss).ok()?.within(&holds);
                let dense = body.cells.facets(part, DENSER * rule.parts, rule.gauss).ok()?;
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
