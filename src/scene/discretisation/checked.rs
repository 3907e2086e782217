//! Cells and shape functions of one's own, looked at where they hand something over.

use crate::cells::{BoundaryCells, Cells, TraceChoice};
use crate::error::{ApproximationError, GeometryError};
use crate::geometry::{Part, Point};
use crate::quadrature::Points;
use crate::shape::{Approximation, Scratch, ShapeFunctions};
use crate::table::check_values;

/// Refuses cells with corners that do not exist, their own or those of what is drawn of them.
pub(crate) fn check_cells<const D: usize>(cells: &dyn Cells<D>) -> Result<(), GeometryError> {
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
    Ok(())
}

fn exist(numbers: &[usize], count: usize, what: &'static str) -> Result<(), GeometryError> {
    let needed = "name particles or vertices that exist, counted from 0";
    match numbers.iter().find(|number| **number >= count) {
        Some(&count) => Err(GeometryError::Count { what, count, needed }),
        None => Ok(()),
    }
}

/// Boundaries as scenes ask for them: cells may be a user's, so what they answer is looked at here, and whoever asks need not do so.
impl<const D: usize> dyn Cells<D> + '_ {
    /// [`Cells::boundary`].
    pub(crate) fn facets(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<D>, GeometryError> {
        self.sound(self.boundary(part, parts, gauss)?)
    }

    /// [`Cells::contact_boundary`].
    pub(crate) fn contact_facets(
        &self,
        part: &Part,
        parts: usize,
        gauss: usize,
    ) -> Result<BoundaryCells<D>, GeometryError> {
        self.sound(self.contact_boundary(part, parts, gauss)?)
    }

    /// [`Cells::boundary_pieces_for`].
    pub(crate) fn pieces(
        &self,
        part: &Part,
        parts: usize,
        gauss: usize,
        choice: &TraceChoice<'_, D>,
    ) -> Result<Vec<BoundaryCells<D>>, GeometryError> {
        let pieces = self.boundary_pieces_for(part, parts, gauss, choice)?;
        pieces.into_iter().map(|piece| self.sound(piece)).collect()
    }

    /// [`Cells::boundary_points`].
    pub(crate) fn facet_points(&self, part: &Part, parts: usize, gauss: usize) -> Result<Points<D>, GeometryError> {
        faced(self.boundary_points(part, parts, gauss)?)
    }

    /// [`Cells::boundary_nodes`].
    pub(crate) fn particles_on(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        let nodes = self.boundary_nodes(part)?;
        exist(&nodes, self.positions().len(), "particle on a boundary, by Cells::boundary_nodes")?;
        Ok(nodes)
    }

    fn sound(&self, facets: BoundaryCells<D>) -> Result<BoundaryCells<D>, GeometryError> {
        facets.validate(self.positions().len())?;
        Ok(BoundaryCells { points: faced(facets.points)?, ..facets })
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
