//! Bricks at the corners of a mesh's cells, and rules on them.

use crate::geometry::Point;
use crate::mesh::CellShape;

use super::super::brick::{determinant, multilinear, unravel};
use super::Unstructured;

impl<const D: usize> Unstructured<D> {
    /// The brick at a corner of a cell: its corners along three edges, axis 0 running fastest.
    pub(super) fn brick(&self, cell: usize, corner: usize) -> [Point<D>; 8] {
        let (shape, corners) = self.mesh.cell(cell);
        let x = |k: usize| self.mesh.points()[corners[k] as usize];
        let around = shape.neighbours()[corner];
        let mut brick = [Point::zeros(); 8];
        for (place, out) in brick.iter_mut().enumerate().take(1 << D) {
            *out = match place.count_ones() as usize {
                0 => x(corner),
                1 => (x(corner) + x(around[place.trailing_zeros() as usize])) * 0.5,
                n if n == D => (0..corners.len()).map(x).sum::<Point<D>>() / corners.len() as f64,
                _ => {
                    // The face between two of the edges of a cell in space.
                    let lacks = (0..D).find(|k| (place >> k) & 1 == 0).unwrap_or(0);
                    let face = shape.faces()[opposite(shape, corner, lacks)];
                    face.iter().map(|&k| x(k)).sum::<Point<D>>() / face.len() as f64
                }
            };
        }
        brick
    }

    /// Number of the facet of a brick at the lower end of an axis, which lies on a face of its cell, and whether it was
    /// stored outward of this cell.
    pub(super) fn outer_facet(&self, cell: usize, corner: usize, axis: usize) -> (usize, bool) {
        let (shape, corners) = self.mesh.cell(cell);
        let face = self.faces.of(cell, opposite(shape, corner, axis));
        (self.faces.facet(face, corners[corner]), self.faces.beside(face)[0] as usize == cell)
    }
}

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
