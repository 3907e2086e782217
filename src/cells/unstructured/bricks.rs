//! Bricks at the corners of a mesh's cells, and rules on them.

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
    (0..n.pow(D as u32 - 1))
        .map(|mut point| {
            let mut at = Point::<D>::repeat(end);
            let mut weight = 1.0;
            for i in (0..D).filter(|&i| i != axis) {
                at[i] = rule.0[point % n];
                weight *= rule.1[point % n];
                point /= n;
            }
            (at, weight)
        })
        .collect()
}

/// Points of a rule in a brick and their weights.
pub(super) fn interior<const D: usize>(brick: &[Point<D>; 8], rule: &(Vec<f64>, Vec<f64>)) -> Vec<(Point<D>, f64)> {
    let counts = [rule.0.len(); D];
    (0..counts.iter().product())
        .map(|point| {
            let index = unravel(point, &counts);
            let (position, columns) = multilinear(brick, &Point::<D>::from_fn(|i, _| rule.0[index[i]]));
            (position, index.iter().map(|&i| rule.1[i]).product::<f64>() * determinant(&columns))
        })
        .collect()
}
