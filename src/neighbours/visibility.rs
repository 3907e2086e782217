//! Which particles a point sees where a body has slots: those that it is connected to through cells near both.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use nalgebra::SMatrix;

use crate::each::{Each, list_of, point_of};
use crate::geometry::{Bounds, Point};
use crate::order;
use crate::particles::Particles;
use crate::tensor::small_inverse;

use super::BoxTree;
use super::adjacent::Adjacent;
use super::sights::{Sights, Target};

/// Part of the local spacing by which the box around point and particle is widened: wider ones see around the root of a slot, and it is
/// no simple fraction, so that the sides of the box and those of cells do not coincide where particles stand in rows.
pub(crate) const MARGIN: f64 = 0.0871;
/// Two boundary facets face each other where the product of their unit normals is below this: reentrant right angles are no slots.
pub(crate) const FACING: f64 = -0.1;
/// A point lies in all cells that are this part of their size nearer to it or less.
const ROUNDING: f64 = 1e-9;

/// The cells of a body and which of them share faces: what tells a slot from a body that goes on.
#[derive(Clone)]
pub struct Connections<const D: usize>(Arc<dyn Adjacent<D>>);

impl<const D: usize> fmt::Debug for Connections<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Connections").field("cells", &self.0.count()).finish()
    }
}

impl<const D: usize> Connections<D> {
    pub(crate) fn new(cells: impl Adjacent<D> + 'static) -> Self {
        Connections(Arc::new(cells))
    }

    /// The cells.
    #[cfg(test)]
    pub(crate) fn cells(&self) -> &dyn Adjacent<D> {
        &*self.0
    }

    /// Those of cells between particles: positions \[length\], and cells by the particles at their corners in the order of
    /// [`Cells::corners`](crate::cells::Cells::corners). Cells with $D$ common corners share a face. None where there are no cells, or
    /// corners that are no particles.
    pub fn between(positions: &[Point<D>], corners: Vec<Vec<usize>>) -> Option<Self> {
        let known = corners.iter().flatten().all(|&corner| corner < positions.len());
        (known && !corners.is_empty()).then(|| Self::new(Between::new(positions.to_vec(), corners)))
    }
}

/// Cells between particles.
struct Between<const D: usize> {
    corners: Vec<Vec<usize>>,
    /// The cells around each particle.
    around: Vec<Vec<u32>>,
    beside: Vec<Vec<(u32, Bounds<D>)>>,
    bounds: Vec<Bounds<D>>,
    /// Simplices that cells are split into: cell, first corner, and what takes an offset from that to barycentric coordinates.
    simplices: Vec<(u32, Point<D>, SMatrix<f64, D, D>)>,
    /// Their sizes.
    sizes: Vec<f64>,
    tree: BoxTree<D>,
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
            ways.mapped(|[a, b]| vec![0, *a, *b, 7])
        }
        (_, n) => vec![(0..n.min(dimension + 1)).collect()],
    }
}

impl<const D: usize> Between<D> {
    fn new(positions: Vec<Point<D>>, corners: Vec<Vec<usize>>) -> Self {
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
        let beside = list_of(corners.len(), beside);
        let bounds = corners.mapped(|own| Bounds::of(own.iter().map(|&corner| &positions[corner])));
        let (mut simplices, mut boxes) = (Vec::new(), Vec::new());
        for (cell, own) in corners.iter().enumerate() {
            for simplex in split(D, own.len()) {
                let Some(first) = simplex.first().filter(|_| simplex.len() == D + 1) else { continue };
                let x = |k: usize| positions[own[simplex[k]]];
                let origin = positions[own[*first]];
                let Some(inverse) = small_inverse(&SMatrix::from_fn(|i, k| (x(k + 1) - origin)[i])) else { continue };
                simplices.push((cell as u32, origin, inverse));
                boxes.push(Bounds::of(&list_of(D + 1, x)));
            }
        }
        let sizes = boxes.mapped(|own: &Bounds<D>| own.extent().norm());
        Between { corners, around, beside, bounds, simplices, sizes, tree: BoxTree::new(boxes) }
    }

    /// How far a point lies beyond the farthest face of a simplex; negative inside.
    fn beyond(&self, simplex: usize, x: &Point<D>) -> f64 {
        let (_, origin, inverse) = &self.simplices[simplex];
        let share = inverse * (x - origin);
        let mut sum = Point::<D>::zeros();
        let mut beyond = f64::NEG_INFINITY;
        for k in 0..D {
            let slope = point_of::<D>(|i| inverse[(k, i)]);
            sum += slope;
            beyond = beyond.max(-share[k] / slope.norm());
        }
        beyond.max((share.sum() - 1.0) / sum.norm())
    }
}

impl<const D: usize> Adjacent<D> for Between<D> {
    fn count(&self) -> usize {
        self.corners.len()
    }

    fn at(&self, x: &Point<D>, found: &mut Vec<u32>) {
        let mut least = f64::INFINITY;
        let mut near: Vec<(f64, u32)> = Vec::new();
        self.tree.approach(x, |simplex, distance| {
            let beyond = self.beyond(simplex, x).max(distance);
            least = least.min(beyond.max(ROUNDING * self.sizes[simplex]));
            near.push((beyond, self.simplices[simplex].0));
            2.0 * least
        });
        let first = found.len();
        found.extend(near.iter().filter(|(beyond, _)| *beyond <= least).map(|(_, cell)| *cell));
        found[first..].sort_unstable();
        found.dedup();
    }

    fn bounds(&self, cell: u32) -> Option<&Bounds<D>> {
        self.bounds.get(cell as usize)
    }

    fn around(&self, particle: u32) -> &[u32] {
        &self.around[particle as usize]
    }

    fn beside(&self, cell: u32, with: &mut dyn FnMut(u32, &Bounds<D>)) {
        self.beside[cell as usize].iter().for_each(|(other, face)| with(*other, face));
    }
}

/// The cells of a body and the particles near slots.
#[derive(Debug, Clone)]
pub(crate) struct Visibility<const D: usize> {
    /// Whether boundary facets within the support of a particle face each other: points see all others.
    near_slot: Vec<bool>,
    /// In the coordinates of boxes.
    positions: Vec<Point<D>>,
    margins: Vec<Point<D>>,
    connections: Connections<D>,
    /// One of a kind, as long as the program runs.
    number: u64,
}

/// Boundary facets, by middle and outward unit normal: one for all that look alike in a cube of a side.
fn merged<const D: usize>(facets: &[(Point<D>, Point<D>)], side: f64) -> Vec<(Point<D>, Point<D>)> {
    let keys = facets.mapped(|(x, n)| {
        let mut key = [0; 6];
        for i in 0..D {
            (key[i], key[D + i]) = ((x[i] / side).floor() as i64, n[i].round() as i64);
        }
        key
    });
    order::grouped(&keys).mapped(|alike| {
        let (mut position, mut normal) = (Point::<D>::zeros(), Point::<D>::zeros());
        for &facet in alike {
            position += facets[facet].0;
            normal += facets[facet].1;
        }
        (position / alike.len() as f64, normal.normalize())
    })
}

/// The particles whose supports hold boundary facets that face each other.
fn near_slots<const D: usize>(
    particles: &Particles<D>,
    margins: &[Point<D>],
    facets: &[(Point<D>, Point<D>)],
) -> Vec<bool> {
    let around = |particle: usize| {
        let reach = particles.supports()[particle].half_widths() + margins[particle] * 2.0;
        Bounds::of([&particles.positions()[particle]]).widened(&reach)
    };
    let tree = BoxTree::new(list_of(margins.len(), around));
    let facets = merged(facets, margins.iter().fold(f64::INFINITY, |least, margin| least.min(margin.min() / MARGIN)));
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
    within.mapped(|own| own.iter().enumerate().any(|(k, a)| own[..k].iter().any(|b| faces(*a, *b))))
}

impl<const D: usize> Visibility<D> {
    /// What points see; none where no boundary facets, by middle and outward unit normal, face each other within a support, or where it is
    /// not known which cells are connected. `spacings` are those of particles.
    pub(crate) fn new(
        particles: &Particles<D>,
        spacings: impl Iterator<Item = Point<D>>,
        facets: &[(Point<D>, Point<D>)],
        connections: impl FnOnce() -> Option<Connections<D>>,
    ) -> Option<Self> {
        let margins: Vec<Point<D>> = spacings.map(|spacing| spacing * MARGIN).collect();
        let near_slot = near_slots(particles, &margins, facets);
        if !near_slot.contains(&true) {
            return None;
        }
        let connections = connections()?;
        let positions = particles.positions().mapped(|x| connections.0.in_boxes(x));
        let margins = margins.mapped(|margin| connections.0.margin_of_boxes(margin));
        static NUMBERS: AtomicU64 = AtomicU64::new(1);
        let number = NUMBERS.fetch_add(1, Ordering::Relaxed);
        Some(Visibility { near_slot, positions, margins, connections, number })
    }

    /// Whether points may not see a particle that covers them.
    pub(crate) fn is_near_slot(&self, particle: u32) -> bool {
        self.near_slot[particle as usize]
    }

    /// Which of some particles near slots a point is connected to through cells in the box around both and a margin; one
    /// that is in no cell sees all.
    pub(crate) fn seen<'a>(
        &self,
        x: &Point<D>,
        particles: impl Iterator<Item = u32>,
        sights: &'a mut Sights<D>,
    ) -> &'a [bool] {
        let target = |particle: u32| {
            let (position, margin) = (self.positions[particle as usize], self.margins[particle as usize]);
            Target { particle, position, margin }
        };
        sights.from(self.number, &*self.connections.0, x, particles.map(target))
    }
}
