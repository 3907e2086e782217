//! Cells and shape functions of one's own, looked at where they hand something over.

use std::sync::Arc;

use nalgebra::SMatrix;

use crate::cells::{BoundaryCells, Cells, Connections, Lattice, Smoothing, TraceChoice, ZoneParticles, Zones};
use crate::error::{ApproximationError, GeometryError};
use crate::geometry::{Part, Point};
use crate::particles::Particles;
use crate::quadrature::Points;
use crate::shape::{Approximation, Scratch, ShapeFunctions};
use crate::table::check_values;

/// The cells with every answer looked at: whoever asks them need not do so.
///
/// # Errors
/// Where cells, or what is drawn of them, have corners that do not exist.
pub(crate) fn checked_cells<const D: usize>(cells: Arc<dyn Cells<D>>) -> Result<Arc<dyn Cells<D>>, GeometryError> {
    let particles = cells.positions().len();
    for cell in 0..cells.cell_count() {
        exist(&cells.corners(cell), particles, "corner of a cell, by Cells::corners")?;
    }
    for corners in cells.drawn() {
        exist(&corners, particles, "corner of a cell, by Cells::drawn")?;
    }
    if let Some((vertices, facets)) = cells.drawn_surface() {
        for facet in facets {
            exist(&facet, vertices.len(), "corner of a facet, by Cells::drawn_surface")?;
        }
    }
    Ok(Arc::new(CheckedCells(cells)))
}

fn exist(numbers: &[usize], count: usize, what: &'static str) -> Result<(), GeometryError> {
    let needed = "name particles or vertices that exist, counted from 0";
    match numbers.iter().find(|number| **number >= count) {
        Some(&count) => Err(GeometryError::Count { what, count, needed }),
        None => Ok(()),
    }
}

struct CheckedCells<const D: usize>(Arc<dyn Cells<D>>);

impl<const D: usize> CheckedCells<D> {
    fn facets(&self, facets: BoundaryCells<D>) -> Result<BoundaryCells<D>, GeometryError> {
        facets.validate(self.0.positions().len())?;
        Ok(BoundaryCells { points: faced(facets.points)?, ..facets })
    }

    fn pieces(&self, pieces: Vec<BoundaryCells<D>>) -> Result<Vec<BoundaryCells<D>>, GeometryError> {
        pieces.into_iter().map(|piece| self.facets(piece)).collect()
    }
}

/// Points on a boundary, each with its normal.
fn faced<const D: usize>(points: Points<D>) -> Result<Points<D>, GeometryError> {
    points.validate()?;
    ensure!(
        points.normals.len() == points.positions.len(),
        GeometryError::Count {
            what: "normals of boundary points, by Cells::boundary",
            count: points.normals.len(),
            needed: "give one for each point"
        }
    );
    Ok(points)
}

impl<const D: usize> Cells<D> for CheckedCells<D> {
    fn positions(&self) -> &[Point<D>] {
        self.0.positions()
    }

    fn cell_count(&self) -> usize {
        self.0.cell_count()
    }

    fn corners(&self, cell: usize) -> Vec<usize> {
        self.0.corners(cell)
    }

    fn drawn(&self) -> Vec<Vec<usize>> {
        self.0.drawn()
    }

    fn drawn_surface(&self) -> Option<(Vec<Point<D>>, Vec<Vec<usize>>)> {
        self.0.drawn_surface()
    }

    fn connections(&self) -> Option<Connections<D>> {
        self.0.connections()
    }

    fn local_spacing(&self, particle: usize) -> f64 {
        self.0.local_spacing(particle)
    }

    fn spacings(&self, particle: usize) -> Point<D> {
        self.0.spacings(particle)
    }

    fn particles(&self, r: f64) -> Result<Particles<D>, ApproximationError> {
        self.0.particles(r)
    }

    fn particles_global(&self, r: f64) -> Result<Particles<D>, ApproximationError> {
        self.0.particles_global(r)
    }

    fn is_thin(&self) -> bool {
        self.0.is_thin()
    }

    fn zones(&self, size: usize) -> Zones {
        self.0.zones(size)
    }

    fn pressure_directions(&self, zones: &Zones) -> Option<Vec<SMatrix<f64, D, D>>> {
        self.0.pressure_directions(zones)
    }

    fn left_thin(&self) -> Option<&GeometryError> {
        self.0.left_thin()
    }

    fn free_particles(&self, zones: &Zones, free: &dyn Fn(usize) -> f64) -> Vec<ZoneParticles<D>> {
        self.0.free_particles(zones, free)
    }

    fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<D>, GeometryError> {
        zones.validate(self.0.cell_count())?;
        self.0.gauss_in(n, zones)
    }

    fn gauss(&self, n: usize) -> Result<Points<D>, GeometryError> {
        self.0.gauss(n)
    }

    fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<D>, GeometryError> {
        zones.validate(self.0.cell_count())?;
        self.0.smoothing(parts, gauss, zones)
    }

    fn nodal_cells(&self, gauss: usize) -> Result<Smoothing<D>, GeometryError> {
        self.0.nodal_cells(gauss)
    }

    fn boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<D>, GeometryError> {
        self.facets(self.0.boundary(part, parts, gauss)?)
    }

    fn boundary_points(&self, part: &Part, parts: usize, gauss: usize) -> Result<Points<D>, GeometryError> {
        faced(self.0.boundary_points(part, parts, gauss)?)
    }

    fn boundary_pieces(&self, part: &Part, parts: usize, gauss: usize) -> Result<Vec<BoundaryCells<D>>, GeometryError> {
        self.pieces(self.0.boundary_pieces(part, parts, gauss)?)
    }

    fn boundary_pieces_for(
        &self,
        part: &Part,
        parts: usize,
        gauss: usize,
        choice: &TraceChoice<'_, D>,
    ) -> Result<Vec<BoundaryCells<D>>, GeometryError> {
        self.pieces(self.0.boundary_pieces_for(part, parts, gauss, choice)?)
    }

    fn rebuilds_traces(&self) -> bool {
        self.0.rebuilds_traces()
    }

    fn contact_boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<D>, GeometryError> {
        self.facets(self.0.contact_boundary(part, parts, gauss)?)
    }

    fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        let nodes = self.0.boundary_nodes(part)?;
        exist(&nodes, self.0.positions().len(), "particle on a boundary, by Cells::boundary_nodes")?;
        Ok(nodes)
    }

    fn contains(&self, at: &Point<D>) -> bool {
        self.0.contains(at)
    }

    fn encloses(&self, at: &Point<D>) -> bool {
        self.0.encloses(at)
    }

    fn lattice(&self) -> Option<&Lattice<D>> {
        self.0.lattice()
    }
}

/// Shape functions with every answer looked at: whoever sums over them need not do so.
pub(crate) struct CheckedFunctions<A>(pub A);

impl<A> CheckedFunctions<A> {
    fn values<const D: usize>(&self, out: &ShapeFunctions<D>, at: &Point<D>) -> Result<(), ApproximationError>
    where
        A: Approximation<D>,
    {
        check_values(out, self.0.nodes().len(), at)?;
        ensure!(
            !out.nodes.is_empty(),
            ApproximationError::Function {
                what: "the number of nodes that an approximation lists",
                value: 0.0,
                at: format!("X = {:?}", at.as_slice()),
                remedy: "list the nodes with a nonzero function, and return an error where there is none"
            }
        );
        Ok(())
    }
}

impl<const D: usize, A: Approximation<D>> Approximation<D> for CheckedFunctions<A> {
    fn nodes(&self) -> &[Point<D>] {
        self.0.nodes()
    }

    fn evaluate(
        &self,
        at: &Point<D>,
        scratch: &mut Scratch,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        self.0.evaluate(at, scratch, out)?;
        self.values(out, at)?;
        let (what, particles) = ("gradients at a point", out.nodes.len());
        let given = out.gradients.len();
        ensure!(given == particles, ApproximationError::Length { what, given, particles });
        match out.gradients.iter().flatten().find(|slope| !slope.is_finite()) {
            Some(&value) => Err(ApproximationError::Function {
                what: "the gradient of a shape function",
                value,
                at: format!("X = {:?}", at.as_slice()),
                remedy: "an approximation gives finite values and gradients",
            }),
            None => Ok(()),
        }
    }

    fn evaluate_values(
        &self,
        at: &Point<D>,
        scratch: &mut Scratch,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        self.0.evaluate_values(at, scratch, out)?;
        self.values(out, at)
    }

    fn evaluate_at_node(
        &self,
        node: usize,
        scratch: &mut Scratch,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        self.0.evaluate_at_node(node, scratch, out)?;
        self.values(out, &self.0.nodes().get(node).copied().unwrap_or_else(Point::zeros))
    }

    fn surroundings(&self, low: &Point<D>, high: &Point<D>, nodes: &mut Vec<u32>, numbers: &mut Vec<f64>) -> bool {
        self.0.surroundings(low, high, nodes, numbers)
    }
}
