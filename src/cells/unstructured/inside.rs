//! Whether a cell of a mesh holds a point.

use crate::cells::brick::{inverse, multilinear};
use crate::each::{array_of, point_of};
use crate::geometry::{Bounds, Point};
use crate::mesh::{CellShape, Mesh};

/// How far outside its cell a point may lie, as a part of it: chords cut arcs.
pub(super) const SLACK: f64 = 0.1;

/// The box of a cell and its margin.
pub(super) fn around<const D: usize>(mesh: &Mesh<D>, cell: usize) -> Bounds<D> {
    Bounds::of(mesh.cell(cell).1.iter().map(|&corner| &mesh.points()[corner as usize])).grown(SLACK)
}

/// Whether a cell holds a point, up to the slack.
pub(super) fn holds<const D: usize>(mesh: &Mesh<D>, cell: usize, at: &Point<D>, slack: f64) -> bool {
    let (shape, corners) = mesh.cell(cell);
    let mut x = [Point::<D>::zeros(); 8];
    for (x, &corner) in x.iter_mut().zip(corners) {
        *x = mesh.points()[corner as usize];
    }
    let start = match shape {
        CellShape::Triangle | CellShape::Tetrahedron => Point::repeat(0.25),
        CellShape::Prism => point_of(|i| if i == 2 { 0.5 } else { 1.0 / 3.0 }),
        _ => Point::repeat(0.5),
    };
    let local = inverse(at, start, &|local| map(shape, &x, local));
    let simplex = match shape {
        CellShape::Triangle | CellShape::Tetrahedron => D,
        CellShape::Prism => 2,
        _ => 0,
    };
    let left = 1.0 - local.iter().take(simplex).sum::<f64>();
    local.iter().all(|t| *t >= -slack && *t <= 1.0 + slack) && left >= -slack
}

/// Position and derivative columns of a cell's map at local coordinates.
fn map<const D: usize>(shape: CellShape, x: &[Point<D>; 8], local: &Point<D>) -> (Point<D>, [Point<D>; D]) {
    match shape {
        CellShape::Triangle | CellShape::Tetrahedron => {
            let columns: [Point<D>; D] = array_of(|i| x[i + 1] - x[0]);
            let position = columns.iter().zip(local.iter()).fold(x[0], |sum, (column, t)| sum + column * *t);
            (position, columns)
        }
        CellShape::Prism => {
            let (s, t, w) = (local[0], local[1], local[D - 1]);
            let level = |base: usize| x[base] * (1.0 - s - t) + x[base + 1] * s + x[base + 2] * t;
            let along = |k: usize| (x[k] - x[0]) * (1.0 - w) + (x[3 + k] - x[3]) * w;
            let position = level(0) * (1.0 - w) + level(3) * w;
            (position, array_of(|i| if i < 2 { along(i + 1) } else { level(3) - level(0) }))
        }
        _ => {
            // Around, where bricks count along their axes.
            let brick = [x[0], x[1], x[3], x[2], x[4], x[5], x[7], x[6]];
            multilinear(&brick, local)
        }
    }
}
