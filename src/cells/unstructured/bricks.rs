//! Bricks at the corners of a mesh's cells, and rules on them.

use crate::each::{list_of, point_of};
use crate::geometry::Point;
use crate::mesh::CellShape;

use super::super::brick::{determinant, multilinear, unravel};

/// The face of a shape at one of its corners that does not hold the edge `axis` of the corner.
pub(super) fn opposite(shape: CellShape, corner: usize, axis: usize) -> usize {
    let lacks = shape.neighbours()[corner][axis];
    let holds = |face: &&[usize]| face.contains(&corner) && !face.contains(&lacks);
    shape.faces().iter().position(holds).unwrap_or(0)
}

/// Unit-cube coordinates and weights of the points of a rule on the side of a brick at one end of an axis.
pub(super) fn side_points<const D: usize>(axis: usize, end: f64, rule: &(Vec<f64>, Vec<f64>)) -> Vec<(Point<D>, f64)> {
    let n = rule.0.len();
    list_of(n.pow(D as u32 - 1), |mut point| {
        let mut at = Point::<D>::repeat(end);
        let mut weight = 1.0;
        for i in (0..D).filter(|&i| i != axis) {
            at[i] = rule.0[point % n];
            weight *= rule.1[point % n];
            point /= n;
        }
        (at, weight)
    })
}

/// Points of a rule in a brick and their weights.
pub(super) fn interior<const D: usize>(brick: &[Point<D>; 8], rule: &(Vec<f64>, Vec<f64>)) -> Vec<(Point<D>, f64)> {
    let counts = [rule.0.len(); D];
    list_of(counts.iter().product(), |point| {
        let index = unravel(point, &counts);
        let (position, columns) = multilinear(brick, &point_of::<D>(|i| rule.0[index[i]]));
        (position, index.iter().map(|&i| rule.1[i]).product::<f64>() * determinant(&columns))
    })
}
