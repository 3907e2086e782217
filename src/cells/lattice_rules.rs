//! Zones, integration points, boundary nodes and points inside of a lattice.

use crate::each::{array_of, point_of};
use crate::error::GeometryError;
use crate::geometry::{Bounds, Part, Point, Side};
use crate::quadrature::{Points, check_point_count, gauss_legendre};

use super::brick::{determinant, inverse, ravel, unravel};
use super::zones::block_starts;
use super::{Lattice, Zones};

/// How far outside a cell a point may lie, as a part of the cell.
const SLACK: f64 = 0.1;

impl<const D: usize> Lattice<D> {
    /// Zones of `size` cells per direction; left-over cells join their neighbour's zone, because a
    /// macro cell of one fails the inf-sup test.
    pub(crate) fn zones(&self, size: usize) -> Zones {
        let cells = self.cell_counts();
        let starts: [Vec<usize>; D] = std::array::from_fn(|i| block_starts(cells[i], size.max(1)));
        let zone_counts: [usize; D] = std::array::from_fn(|i| starts[i].len() - 1);
        let total: usize = zone_counts.iter().product();
        let mut zones = Zones::new(Vec::with_capacity(self.cell_count()), vec![0]);
        for zone in 0..total {
            let index = unravel(zone, &zone_counts);
            let low: [usize; D] = array_of(|i| starts[i][index[i]]);
            let widths: [usize; D] = array_of(|i| starts[i][index[i] + 1] - low[i]);
            for inner in 0..widths.iter().product() {
                let offset = unravel(inner, &widths);
                zones.cells.push(ravel(&array_of(|i| low[i] + offset[i]), &cells) as u32);
            }
            zones.offsets.push(zones.cells.len());
        }
        zones
    }
}

impl<const D: usize> Lattice<D> {
    /// Gauss–Legendre points, `n` per direction in each cell, grouped by zone.
    ///
    /// # Errors
    /// For an impossible number of points.
    pub(crate) fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<D>, GeometryError> {
        let (abscissae, weights) = gauss_legendre(n)?;
        let shape = [n; D];
        let per_cell = n.pow(D as u32);
        check_point_count(zones.cells.len(), per_cell)?;
        zones.points(self.cell_count(), |cell, points| {
            let cell = self.shape(cell);
            for point in 0..per_cell {
                let index = unravel(point, &shape);
                let at = point_of::<D>(|i| abscissae[index[i]]);
                let (position, jacobian) = cell.map(&at);
                let weight: f64 = index.iter().map(|&i| weights[i]).product();
                points.push(position, weight * determinant(&jacobian));
            }
        })
    }

    /// The faces a part consists of.
    ///
    /// # Errors
    /// Where the part does not exist.
    pub(crate) fn faces(&self, part: &Part) -> Result<Vec<(usize, Side)>, GeometryError> {
        match part {
            Part::Face { axis, side } if *axis < D => Ok(vec![(*axis, *side)]),
            Part::Whole => {
                let mut all = Vec::with_capacity(2 * D);
                for axis in 0..D {
                    all.extend_from_slice(&[(axis, Side::Min), (axis, Side::Max)]);
                }
                Ok(all)
            }
            _ => Err(GeometryError::UnknownPart {
                part: part.to_string(),
                known: format!("faces (axis, Side) with axis below {D}, and the whole boundary"),
            }),
        }
    }

    /// Nodes on a boundary part, by rising index.
    ///
    /// # Errors
    /// Where the part does not exist.
    pub(crate) fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        let faces = self.faces(part)?;
        Ok((0..self.positions.len())
            .filter(|&node| {
                let index = unravel(node, &self.counts);
                faces.iter().any(|&(axis, side)| match side {
                    Side::Min => index[axis] == 0,
                    Side::Max => index[axis] + 1 == self.counts[axis],
                })
            })
            .collect())
    }
}

impl<const D: usize> Lattice<D> {
    /// Whether a point lies in the body, up to a tenth of a cell.
    pub(crate) fn contains(&self, at: &Point<D>) -> bool {
        self.within(at, SLACK)
    }

    /// The same with a margin in place of a tenth of a cell.
    pub(crate) fn within(&self, at: &Point<D>, slack: f64) -> bool {
        if !at.iter().all(|x| x.is_finite()) {
            return false;
        }
        let holds = |cell| self.holds(cell, at, slack);
        self.locator.any(self.cell_count(), at, |cell| self.around(cell), holds)
    }

    /// The box of a cell and its margin.
    fn around(&self, cell: usize) -> Bounds<D> {
        Bounds::of(self.shape(cell).nodes()).grown(SLACK)
    }

    /// Whether a cell holds a point.
    fn holds(&self, cell: usize, at: &Point<D>, slack: f64) -> bool {
        if !self.around(cell).holds(at) {
            return false;
        }
        let shape = self.shape(cell);
        let local = inverse(at, Point::repeat(0.5), &|local| shape.map(local));
        local.iter().all(|t| *t >= -slack && *t <= 1.0 + slack)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cells::Layout;
    use crate::geometry::{Block, Mapped};
    use crate::geometry::{Vec2, Vec3};

    /// The cells that contain a point, found by testing each cell of the lattice.
    fn holders<const D: usize>(lattice: &Lattice<D>, at: &Point<D>) -> usize {
        (0..lattice.cell_count()).filter(|&cell| lattice.holds(cell, at, SLACK)).count()
    }

    #[test]
    fn a_lattice_holds_what_one_of_its_cells_holds() {
        let mut random = fastrand::Rng::with_seed(4);
        let ring = Mapped(|unit: &Vec2| {
            let (radius, angle) = (1.0 + unit[0], 4.0 * unit[1]);
            Vec2::new(radius * angle.cos(), radius * angle.sin())
        });
        let ring = Lattice::new(&ring, [6, 23], &Layout::Jittered { amount: 0.3, seed: 1 }).unwrap();
        let block = Block::new([0.0; 3], [1.0, 2.0, 1.0]).lattice([6, 10, 5]).unwrap();
        let (mut inside, mut outside) = (0, 0);
        for _ in 0..400 {
            let at = Vec2::from_fn(|_, _| 5.0 * random.f64() - 2.5);
            let held = ring.contains(&at);
            assert_eq!(held, holders(&ring, &at) > 0, "{at:?}");
            let at = Vec3::from_fn(|_, _| 2.5 * random.f64() - 0.25);
            assert_eq!(block.contains(&at), holders(&block, &at) > 0, "{at:?}");
            inside += usize::from(held);
            outside += usize::from(!held);
        }
        assert!(inside > 50 && outside > 50);
        assert_eq!(ring.clone(), ring);
    }
}
