//! Finds the cell of a mesh that holds a point, by a grid of lists.

use crate::cells::brick::{determinant, multilinear, ravel, unravel};
use crate::geometry::Point;
use crate::mesh::{CellShape, Mesh};

/// How far outside its cell a point may lie, as a part of it: chords cut arcs.
const SLACK: f64 = 0.1;

#[derive(Debug, Clone)]
pub(super) struct Locator<const D: usize> {
    min: Point<D>,
    inverse: Point<D>,
    counts: [usize; D],
    offsets: Vec<u32>,
    entries: Vec<u32>,
}

impl<const D: usize> Locator<D> {
    pub fn new(mesh: &Mesh<D>) -> Self {
        let (mut min, mut max) = (Point::<D>::repeat(f64::INFINITY), Point::<D>::repeat(f64::NEG_INFINITY));
        for x in mesh.points() {
            (min, max) = (min.inf(x), max.sup(x));
        }
        let extent = max - min;
        let cells = mesh.cell_count();
        // About as many bins as cells, along axes that are longer than a bin: flat bodies must not take the square of that.
        let mut long = [true; D];
        let mut width;
        loop {
            let axes = (0..D).filter(|&i| long[i]);
            let measure: f64 = axes.clone().map(|i| extent[i]).product();
            width = (measure / cells as f64).powf(1.0 / axes.clone().count().max(1) as f64);
            let Some(short) = axes.clone().find(|&i| extent[i] < width) else { break };
            long[short] = false;
        }
        let counts: [usize; D] =
            std::array::from_fn(|i| if long[i] { ((extent[i] / width) as usize + 1).min(cells) } else { 1 });
        let inverse = Point::<D>::from_fn(|i, _| counts[i] as f64 / extent[i]);
        let total: usize = counts.iter().product();
        let mut locator = Locator { min, inverse, counts, offsets: vec![0; total + 1], entries: Vec::new() };
        for cell in 0..cells {
            for bin in locator.bins(mesh, cell) {
                locator.offsets[bin + 1] += 1;
            }
        }
        for bin in 0..total {
            locator.offsets[bin + 1] += locator.offsets[bin];
        }
        let mut cursor = locator.offsets.clone();
        locator.entries = vec![0; locator.offsets[total] as usize];
        for cell in 0..cells {
            for bin in locator.bins(mesh, cell) {
                locator.entries[cursor[bin] as usize] = cell as u32;
                cursor[bin] += 1;
            }
        }
        locator
    }

    /// The bins that a cell and its margin touch.
    fn bins(&self, mesh: &Mesh<D>, cell: usize) -> Vec<usize> {
        let (mut low, mut high) = (Point::<D>::repeat(f64::INFINITY), Point::<D>::repeat(f64::NEG_INFINITY));
        for &corner in mesh.cell(cell).1 {
            let x = &mesh.points()[corner as usize];
            (low, high) = (low.inf(x), high.sup(x));
        }
        let margin = (high - low) * SLACK;
        let first: [usize; D] = std::array::from_fn(|i| self.bin(low[i] - margin[i], i));
        let shape: [usize; D] = std::array::from_fn(|i| self.bin(high[i] + margin[i], i) + 1 - first[i]);
        (0..shape.iter().product())
            .map(|bin| {
                let offset = unravel(bin, &shape);
                ravel(&std::array::from_fn(|i| first[i] + offset[i]), &self.counts)
            })
            .collect()
    }

    fn bin(&self, value: f64, axis: usize) -> usize {
        (((value - self.min[axis]) * self.inverse[axis]).max(0.0) as usize).min(self.counts[axis] - 1)
    }

    pub fn contains(&self, mesh: &Mesh<D>, at: &Point<D>) -> bool {
        if !at.iter().all(|x| x.is_finite()) {
            return false;
        }
        let bin = ravel(&std::array::from_fn(|i| self.bin(at[i], i)), &self.counts);
        let cells = &self.entries[self.offsets[bin] as usize..self.offsets[bin + 1] as usize];
        cells.iter().any(|&cell| holds(mesh, cell as usize, at))
    }
}

/// Whether a cell holds a point, up to the slack.
fn holds<const D: usize>(mesh: &Mesh<D>, cell: usize, at: &Point<D>) -> bool {
    let (shape, corners) = mesh.cell(cell);
    let mut x = [Point::<D>::zeros(); 8];
    for (x, &corner) in x.iter_mut().zip(corners) {
        *x = mesh.points()[corner as usize];
    }
    // Newton on the cell's map, by Cramer's rule; one step does for straight simplices, a few from the middle for others.
    let mut local = match shape {
        CellShape::Triangle | CellShape::Tetrahedron => Point::repeat(0.25),
        CellShape::Prism => Point::from_fn(|i, _| if i == 2 { 0.5 } else { 1.0 / 3.0 }),
        _ => Point::repeat(0.5),
    };
    for _ in 0..20 {
        let (position, columns) = map(shape, &x, &local);
        let total = determinant(&columns);
        let step = Point::<D>::from_fn(|i, _| {
            let mut replaced = columns;
            replaced[i] = at - position;
            determinant(&replaced) / total
        });
        local += step;
        if step.norm() < 1e-12 {
            break;
        }
    }
    let simplex = match shape {
        CellShape::Triangle | CellShape::Tetrahedron => D,
        CellShape::Prism => 2,
        _ => 0,
    };
    let left = 1.0 - local.iter().take(simplex).sum::<f64>();
    local.iter().all(|t| *t >= -SLACK && *t <= 1.0 + SLACK) && left >= -SLACK
}

/// Position and derivative columns of a cell's map at local coordinates.
fn map<const D: usize>(shape: CellShape, x: &[Point<D>; 8], local: &Point<D>) -> (Point<D>, [Point<D>; D]) {
    match shape {
        CellShape::Triangle | CellShape::Tetrahedron => {
            let columns: [Point<D>; D] = std::array::from_fn(|i| x[i + 1] - x[0]);
            let position = columns.iter().zip(local.iter()).fold(x[0], |sum, (column, t)| sum + column * *t);
            (position, columns)
        }
        CellShape::Prism => {
            let (s, t, w) = (local[0], local[1], local[D - 1]);
            let level = |base: usize| x[base] * (1.0 - s - t) + x[base + 1] * s + x[base + 2] * t;
            let along = |k: usize| (x[k] - x[0]) * (1.0 - w) + (x[3 + k] - x[3]) * w;
            let position = level(0) * (1.0 - w) + level(3) * w;
            (position, std::array::from_fn(|i| if i < 2 { along(i + 1) } else { level(3) - level(0) }))
        }
        _ => {
            // Around, where bricks count along their axes.
            let brick = [x[0], x[1], x[3], x[2], x[4], x[5], x[7], x[6]];
            multilinear(&brick, local)
        }
    }
}
