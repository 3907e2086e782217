//! Bricks at the corners of a mesh's cells, and rules on them.

use crate::each::list_of;
use crate::geometry::Point;
use crate::mesh::CellShape;
use crate::quadrature::LineRule;

use super::super::smoothing::facet_point;

/// The face of a shape at one of its corners that does not hold the edge `axis` of the corner.
pub(super) fn opposite(shape: CellShape, corner: usize, axis: usize) -> usize {
    let lacks = shape.neighbours()[corner][axis];
    let holds = |face: &&[usize]| face.contains(&corner) && !face.contains(&lacks);
    shape.faces().iter().position(holds).unwrap_or(0)
}

/// Unit-cube coordinates and weights of the points of a rule on the side of a brick at one end of an axis.
pub(super) fn side_points<const D: usize>(axis: usize, end: f64, rule: &LineRule) -> Vec<(Point<D>, f64)> {
    list_of(rule.0.len().pow(D as u32 - 1), |point| facet_point(axis, end, point, &rule.0, &rule.1))
}
