//! Which particles a point sees where a body has slots: those that it is connected to through cells near both.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, SMatrix};

use crate::geometry::{Bounds, Point};
use crate::particles::Particles;

use super::BoxTree;

/// Part of the local spacing by which the box around point and particle is widened: about a half, and no simple fraction, so that the
/// sides of the box and those of cells do not coincide where particles stand in rows.
const MARGIN: f64 = 0.4871;
/// Two boundary facets face each other where the product of their unit normals is below this: reentrant right angles are no slots.
const FACING: f64 = -0.1;
/// A point lies in all cells that are this part of their size nearer to it or less.
const ROUNDING: f64 = 1e-9;

/// The cells of a body as a search for connected ones reads them, and the particles near slots.
#[derive(Debug, Clone)]
pub(crate) struct Visibility<const D: usize> {
    /// Whether boundary facets within the support of a particle face each other: points see all others.
    near_slot: Vec<bool>,
    positions: Vec<Point<D>>,
    margins: Vec<f64>,
    corners: Vec<Vec<usize>>,
    /// Cells that share a face with each, and the box of the face.
    beside: Vec<Vec<(u32, Bounds<D>)>>,
    /// Simplices that cells are split into: cell, first corner, and what takes an offset from that to barycentric coordinates.
    simplices: Vec<(u32, Point<D>, SMatrix<f64, D, D>)>,
    tree: BoxTree<D>,
}

/// Buffers of a search.
#[derive(Debug, Clone, Default)]
pub(crate) struct Search {
    near: Vec<(f64, u32)>,
    /// Cells that hold the point.
    start: Vec<u32>,
    open: Vec<u32>,
    /// The last search that met each cell.
    met: Vec<u32>,
    number: u32,
}

/// Corners of the simplices that a cell is split into; those of flat cells with four corners overlap, whatever their order.
fn split(dimension: usize, corners: usize) -> Vec<Vec<usize>> {
    match (dimension, corners) {
        (2, 4) => vec![vec![0, 1, 2], vec![0, 1, 3], vec![0, 2, 3], vec![1, 2, 3]],
        (2, n) => (2..n).map(|k| vec![0, k - 1, k]).collect(),
        (3, 6) => vec![vec![0, 1, 2, 3], vec![1, 2, 3, 4], vec![2, 3, 4, 5]],
        // One for each way from the first corner to the last along three edges.
        (3, 8) => {
            let ways = [[1, 3], [1, 5], [2, 3], [2, 6], [4, 5], [4, 6]];
            ways.iter().map(|[a, b]| vec![0, *a, *b, 7]).collect()
        }
        (_, n) => vec![(0..n.min(dimension + 1)).collect()],
    }
}

/// The particles whose supports hold boundary facets that face each other.
fn near_slots<const D: usize>(particles: &Particles<D>, margins: &[f64], facets: &[(Point<D>, Point<D>)]) -> Vec<bool> {
    let around = |particle: usize| {
        let reach = particles.supports()[particle].half_widths().map(|half| half + 2.0 * margins[particle]);
        let x = particles.positions()[particle];
        Bounds { low: x - reach, high: x + reach }
    };
    let tree = BoxTree::new((0..margins.len()).map(around).collect());
    let mut within: Vec<Vec<u32>> = vec![Vec::new(); margins.len()];
    for (number, (at, _)) in facets.iter().enumerate() {
        tree.any_at(at, |particle| {
            within[particle].push(number as u32);
            false
        });
    }
    let faces = |a: u32, b: u32| {
        let ((x, n), (y, m)) = (facets[a as usize], facets[b as usize]);
        n.dot(&m) < FACING && n.dot(&(y - x)) > 0.0 && m.dot(&(x - y)) > 0.0
    };
    within.iter().map(|own| own.iter().enumerate().any(|(k, a)| own[..k].iter().any(|b| faces(*a, *b)))).collect()
}

impl<const D: usize> Visibility<D> {
    /// The connections of cells, given by the particles at their corners; none where no boundary facets, by middle and outward unit
    /// normal, face each other within a support. `spacings` are those of particles.
    pub(crate) fn new(
        particles: &Particles<D>,
        spacings: &[f64],
        facets: &[(Point<D>, Point<D>)],
        corners: Vec<Vec<usize>>,
    ) -> Option<Self> {
        let margins: Vec<f64> = spacings.iter().map(|spacing| MARGIN * spacing).collect();
        let near_slot = near_slots(particles, &margins, facets);
        if !near_slot.contains(&true) {
            return None;
        }
        let positions = particles.positions().to_vec();
        let mut around: Vec<Vec<u32>> = vec![Vec::new(); positions.len()];
        for (cell, own) in corners.iter().enumerate() {
            own.iter().for_each(|&corner| around[corner].push(cell as u32));
        }
        let beside = |cell: usize| {
            let mut shared: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
            for &corner in &corners[cell] {
                around[corner].iter().for_each(|&other| shared.entry(other).or_default().push(corner));
            }
            let faces = shared.into_iter().filter(|(other, face)| *other as usize != cell && face.len() >= D);
            faces.map(|(other, face)| (other, Bounds::of(face.iter().map(|&corner| &positions[corner])))).collect()
        };
        let beside = (0..corners.len()).map(beside).collect();
        let (mut simplices, mut boxes) = (Vec::new(), Vec::new());
        for (cell, own) in corners.iter().enumerate() {
            for simplex in split(D, own.len()) {
                let Some(first) = simplex.first().filter(|_| simplex.len() == D + 1) else { continue };
                let x = |k: usize| positions[own[simplex[k]]];
                let origin = positions[own[*first]];
                let Some(inverse) = DMatrix::from_fn(D, D, |i, k| (x(k + 1) - origin)[i]).try_inverse() else {
                    continue;
                };
                simplices.push((cell as u32, origin, SMatrix::from_fn(|i, k| inverse[(i, k)])));
                boxes.push((0..=D).map(x).fold(Bounds::none(), |all, x| all.join(&Bounds { low: x, high: x })));
            }
        }
        let tree = BoxTree::new(boxes);
        Some(Visibility { near_slot, positions, margins, corners, beside, simplices, tree })
    }

    /// Whether points may not see a particle that covers them.
    pub(crate) fn is_near_slot(&self, particle: u32) -> bool {
        self.near_slot[particle as usize]
    }

    /// How far a point lies beyond the farthest face of a simplex; negative inside.
    fn beyond(&self, simplex: usize, x: &Point<D>) -> f64 {
        let (_, origin, inverse) = &self.simplices[simplex];
        let share = inverse * (x - origin);
        let mut sum = Point::<D>::zeros();
        let mut beyond = f64::NEG_INFINITY;
        for k in 0..D {
            let slope = Point::<D>::from_fn(|i, _| inverse[(k, i)]);
            sum += slope;
            beyond = beyond.max(-share[k] / slope.norm());
        }
        beyond.max((share.sum() - 1.0) / sum.norm())
    }

    /// Finds the cells that hold a point, the nearest ones where it lies a little outside of all.
    pub(crate) fn locate(&self, x: &Point<D>, search: &mut Search) {
        search.near.clear();
        search.start.clear();
        let mut least = f64::INFINITY;
        self.tree.approach(x, |simplex, distance| {
            let (cell, ..) = self.simplices[simplex];
            let beyond = self.beyond(simplex, x).max(distance);
            least = least.min(beyond.max(ROUNDING * self.margins[self.corners[cell as usize][0]]));
            search.near.push((beyond, cell));
            2.0 * least
        });
        search.start.extend(search.near.iter().filter(|(beyond, _)| *beyond <= least).map(|(_, cell)| *cell));
        search.start.sort_unstable();
        search.start.dedup();
    }

    /// Whether a located point is connected to a particle through cells in the box around both and a margin.
    pub(crate) fn sees(&self, x: &Point<D>, particle: u32, search: &mut Search) -> bool {
        let (to, margin) = (self.positions[particle as usize], Point::repeat(self.margins[particle as usize]));
        let (low, high) = (x.inf(&to) - margin, x.sup(&to) + margin);
        search.met.resize(self.corners.len(), 0);
        search.number += 1;
        search.open.clear();
        for &cell in &search.start {
            search.met[cell as usize] = search.number;
            search.open.push(cell);
        }
        while let Some(cell) = search.open.pop() {
            if self.corners[cell as usize].contains(&(particle as usize)) {
                return true;
            }
            for (other, face) in &self.beside[cell as usize] {
                let meets = (0..D).all(|i| face.low[i] <= high[i] && low[i] <= face.high[i]);
                if meets && search.met[*other as usize] != search.number {
                    search.met[*other as usize] = search.number;
                    search.open.push(*other);
                }
            }
        }
        false
    }
}
