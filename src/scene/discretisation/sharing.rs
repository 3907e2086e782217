//! What each of several ranks holds of a scene.

use std::sync::Arc;

use crate::assembly::Ranks;
use crate::cells::{Cells, Smoothing, Zones};
use crate::error::{Error, GeometryError, Incompatible};
use crate::geometry::{Morton, Point};
use crate::quadrature::Points;
use crate::shape::ElementPoints;
use crate::term::Body;

use crate::scene::{ApproximationChoice, BodyCells, Rule, Scheme};

/// The ranks that share a scene, if any: zones of cells along a space-filling curve, facets of loads in turn.
pub(crate) struct Sharing(Option<Arc<dyn Ranks>>);

impl Sharing {
    /// The ranks of a scheme's solver.
    ///
    /// # Errors
    /// For rules whose points are not those of zones of cells.
    pub(crate) fn of<const D: usize>(scheme: &Scheme, all: &BodyCells<D>) -> Result<Self, Incompatible> {
        let ranks = scheme.solver.as_ref().and_then(|solver| solver.ranks()).filter(|ranks| ranks.count() > 1);
        let by_zones = |own: &Scheme| match own.rule {
            Rule::Auto => true,
            Rule::Smoothed { .. } | Rule::Gauss { .. } => true,
            Rule::Scni | Rule::Nodal => own.approximation == ApproximationChoice::Elements,
        };
        let refused = |with, remedy| Err(Incompatible::new("a solver on several ranks", with, remedy));
        if ranks.is_some() && !all.iter().all(|(own, _)| by_zones(own)) {
            return refused("a rule at particles", "take one over cells: the default, sub-cells or Gauss points");
        }
        Ok(Sharing(ranks))
    }

    /// The ranks.
    pub(crate) fn ranks(&self) -> Option<Arc<dyn Ranks>> {
        self.0.clone()
    }

    /// A body whose smallest zones are those of all ranks, of those that have any.
    pub(crate) fn smallest_zones_of<const D: usize>(&self, mut body: Body<D>) -> Body<D> {
        if let Some(ranks) = &self.0 {
            // A rank without zones asks for nothing.
            let fewest = ranks.least(if body.fewest > 0 { body.fewest as f64 } else { f64::INFINITY });
            body.fewest = if fewest.is_finite() { fewest as usize } else { 0 };
        }
        body
    }

    /// What this rank has built of its share, where all could build theirs: one that goes on alone waits for the others for ever.
    ///
    /// # Errors
    /// Its own, or that another rank has one.
    pub(crate) fn agreed<T>(&self, built: Result<T, Error>) -> Result<T, Error> {
        let Some(ranks) = &self.0 else { return built };
        let all = ranks.least(f64::from(u8::from(built.is_ok()))) > 0.5;
        let refused = |_| {
            let (with, remedy) = ("a share that another rank cannot discretise", "the error of that rank says why");
            Err(Incompatible::new("a solver on several ranks", with, remedy).into())
        };
        if all { built } else { built.map_or_else(Err, refused) }
    }

    /// Replaces values by their sums over the ranks.
    pub(crate) fn total(&self, values: &mut [f64]) {
        if let Some(ranks) = &self.0 {
            ranks.sum(values);
        }
    }

    /// This rank's zones.
    pub(crate) fn zones<const D: usize>(&self, cells: &dyn Cells<D>, zones: Zones) -> Result<Zones, GeometryError> {
        zones.validate(cells.cell_count())?;
        Ok(self.share(zones, |zones, rank, count| {
            let curve = Morton::through(D, cells.positions().iter().map(Point::as_slice));
            zones.share(rank, count, |cell| {
                let corners = cells.corners(cell as usize);
                let sum: Point<D> = corners.iter().map(|&corner| cells.positions()[corner]).sum();
                curve.place((sum / corners.len().max(1) as f64).as_slice())
            })
        }))
    }

    /// This rank's part of a whole, of which its number and that of all ranks take the part.
    fn share<T>(&self, whole: T, part: impl FnOnce(&T, usize, usize) -> T) -> T {
        match &self.0 {
            Some(ranks) => part(&whole, ranks.rank(), ranks.count()),
            None => whole,
        }
    }

    /// The smoothing over this rank's zones.
    ///
    /// # Errors
    /// As [`Cells::smoothing`].
    pub(crate) fn smoothing<const D: usize>(
        &self,
        cells: &dyn Cells<D>,
        [parts, gauss]: [usize; 2],
        zones: Zones,
    ) -> Result<Smoothing<D>, GeometryError> {
        let smoothing = cells.smoothing(parts, gauss, &self.zones(cells, zones)?)?;
        Ok(if self.0.is_some() { smoothing.pruned() } else { smoothing })
    }

    /// This rank's zones of numbered cells that follow each other in space.
    pub(crate) fn run(&self, zones: Zones) -> Zones {
        self.share(zones, |zones, rank, count| zones.share(rank, count, u64::from))
    }

    /// This rank's points of faces of elements.
    pub(crate) fn element_points<const D: usize>(&self, points: ElementPoints<D>) -> ElementPoints<D> {
        self.share(points, ElementPoints::share)
    }

    /// This rank's points of a boundary, of other zones than those of cells, or of a single force.
    pub(crate) fn points<const D: usize>(&self, points: Points<D>) -> Points<D> {
        self.share(points, Points::share)
    }
}
