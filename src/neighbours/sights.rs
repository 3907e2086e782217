//! Which particles the points of a cell see, found once for all of them.
//!
//! A box around point and particle grows with the distance between them. Where a particle is reached through the part that the boxes of all
//! points of a cell have in common each of them sees it; where it is not through the box around all of these none does. Points in between
//! are looked at one by one.

use std::collections::HashMap;

use crate::geometry::{Bounds, Point};

use super::search::{Adjacent, Search};

/// Answers that are kept at once, for the memory that they take.
const KEPT: usize = 1 << 20;

/// Where in a cell a particle is seen from.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Seen {
    Everywhere,
    Nowhere,
    Somewhere,
}

/// A particle, and the margin of boxes around it and points, in the coordinates of boxes.
#[derive(Clone, Copy)]
pub(crate) struct Target<'a, const D: usize> {
    pub(crate) particle: u32,
    pub(crate) position: &'a Point<D>,
    pub(crate) margin: &'a Point<D>,
}

/// A cell around a point: where its answers are, and the one behind the last that was taken.
#[derive(Debug, Clone, Copy)]
struct Near {
    cell: u32,
    place: u32,
    next: u32,
}

/// Buffers of a search for what a point sees, and what is known of the cells of points before.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sights {
    /// Whose answers these are.
    of: u64,
    /// Answers for each cell that points were in, by rising particle.
    answers: Vec<Vec<(u32, Seen)>>,
    places: HashMap<u32, u32>,
    count: usize,
    /// Cells among which are all that hold the point and whose boxes do; none where there are others.
    near: Vec<Near>,
    /// The point, and in the coordinates of boxes.
    at: [f64; 3],
    from: [f64; 3],
    /// Cells that hold the point, where they are known; before that those near it.
    start: Vec<u32>,
    is_located: bool,
    search: Search,
}

impl Sights {
    /// Begins with a point; what is known of cells is forgotten where it was found among others than `of`.
    pub(crate) fn start<const D: usize>(&mut self, of: u64, cells: &dyn Adjacent<D>, at: &Point<D>) {
        if self.of != of || self.count > KEPT {
            self.answers.clear();
            self.places.clear();
            (self.of, self.count) = (of, 0);
        }
        let from = cells.in_boxes(at);
        self.at[..D].copy_from_slice(at.as_slice());
        self.from[..D].copy_from_slice(from.as_slice());
        self.start.clear();
        self.is_located = cells.near(at, &mut self.start);
        self.list(cells);
    }

    /// Lists the cells around the point with their answers; none where the box of one does not hold it.
    fn list<const D: usize>(&mut self, cells: &dyn Adjacent<D>) {
        let from = Point::<D>::from_column_slice(&self.from[..D]);
        self.near.clear();
        if !self.start.iter().all(|&cell| cells.bounds(cell).is_some_and(|own| own.holds(&from))) {
            return;
        }
        for &cell in &self.start {
            let place = *self.places.entry(cell).or_insert(self.answers.len() as u32);
            if place as usize == self.answers.len() {
                self.answers.push(Vec::new());
            }
            self.near.push(Near { cell, place, next: 0 });
        }
    }

    /// Whether the point is connected to a particle through cells in the box around both and a margin; one that is in no cell sees all.
    pub(crate) fn sees<const D: usize>(&mut self, cells: &dyn Adjacent<D>, target: Target<D>) -> bool {
        if let Some(known) = self.known(cells, target) {
            return known;
        }
        if !self.is_located {
            self.start.clear();
            cells.at(&Point::<D>::from_column_slice(&self.at[..D]), &mut self.start);
            self.is_located = true;
            self.list(cells);
            if let Some(known) = self.known(cells, target) {
                return known;
            }
        }
        if self.start.is_empty() {
            return true;
        }
        let (from, x) = (Point::<D>::from_column_slice(&self.from[..D]), target.position);
        reaches(&mut self.search, cells, &self.start, target, [from.inf(x), from.sup(x)])
    }

    /// Whether the point sees a particle, where the cells around it tell.
    fn known<const D: usize>(&mut self, cells: &dyn Adjacent<D>, target: Target<D>) -> Option<bool> {
        let (mut all, mut none) = (!self.near.is_empty(), !self.near.is_empty());
        for k in 0..self.near.len() {
            let seen = self.seen(cells, k, target);
            // One of them is enough where each holds the point.
            if self.is_located && seen == Seen::Everywhere {
                return Some(true);
            }
            (all, none) = (all && seen == Seen::Everywhere, none && seen == Seen::Nowhere);
        }
        (all || none).then_some(all)
    }

    /// Which points of a cell around the point see a particle.
    fn seen<const D: usize>(&mut self, cells: &dyn Adjacent<D>, near: usize, target: Target<D>) -> Seen {
        let Near { cell, place, next } = &mut self.near[near];
        let Some(Bounds { low, high }) = cells.bounds(*cell) else { return Seen::Somewhere };
        let known = &mut self.answers[*place as usize];
        // Particles mostly come in the order in which they came before.
        let at = match known.get(*next as usize).is_some_and(|known| known.0 == target.particle) {
            true => Ok(*next as usize),
            false => known.binary_search_by_key(&target.particle, |known| known.0),
        };
        let at = at.unwrap_or_else(|at| {
            let x = target.position;
            let mut through = |corners| reaches(&mut self.search, cells, &[*cell], target, corners);
            let seen = match through([high.inf(x), low.sup(x)]) {
                true => Seen::Everywhere,
                false if through([low.inf(x), high.sup(x)]) => Seen::Somewhere,
                false => Seen::Nowhere,
            };
            known.insert(at, (target.particle, seen));
            self.count += 1;
            at
        });
        *next = at as u32 + 1;
        known[at].1
    }
}

/// Whether a search from some cells reaches those of a particle through a box with these corners and a margin.
fn reaches<const D: usize>(
    search: &mut Search,
    cells: &dyn Adjacent<D>,
    start: &[u32],
    target: Target<D>,
    [low, high]: [Point<D>; 2],
) -> bool {
    let within = Bounds { low: low - target.margin, high: high + target.margin };
    search.reaches(cells, start, (cells.around(target.particle), target.position), &within)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::super::visibility::MARGIN;
    use super::*;
    use crate::cells::{Cells, CutLattice};
    use crate::mesh::{CellShape, Mesh};
    use crate::solid::Solid3;

    /// A block with a slot of drawn width, depth and angle.
    fn slotted(draw: &mut impl FnMut(f64, f64) -> f64) -> Solid3 {
        let (width, depth, angle) = (draw(0.01, 0.12), draw(0.3, 0.8), draw(-0.5, 0.5));
        let (middle, shift) = (0.5 - 0.5 * angle * depth, angle * depth);
        let [left, right] = [-0.5 * width, 0.5 * width];
        let outline = [
            [0.0, 0.0],
            [1.0, 0.0],
            [1.0, 1.0],
            [middle + right, 1.0],
            [middle + shift + right, 1.0 - depth],
            [middle + shift + left, 1.0 - depth],
            [middle + left, 1.0],
            [0.0, 1.0],
        ];
        let points = |z: f64| outline.iter().map(move |x| Point::<3>::new(x[0], x[1], z));
        let quads = [[0, 5, 6, 7], [1, 2, 3, 4], [0, 1, 4, 5]];
        let cells = quads.iter().flat_map(|quad| quad.iter().copied().chain(quad.iter().map(|corner| corner + 8)));
        let points = points(0.0).chain(points(0.3)).collect();
        Solid3::of_mesh(&Mesh::new(points, &[(CellShape::Hexahedron, cells.collect())], &[]).unwrap()).unwrap()
    }

    /// Compares what points see with a search for each of them; how many pairs are not seen and seen, and how many points are located.
    fn compared(cells: &CutLattice, points: &[Point<3>]) -> [usize; 3] {
        let connections = cells.connections().unwrap();
        let all = connections.cells();
        let (mut sights, mut search, mut start) = (Sights::default(), Search::default(), Vec::new());
        let mut counts = [0; 3];
        for x in points {
            sights.start(1, all, x);
            start.clear();
            all.at(x, &mut start);
            let from = all.in_boxes(x);
            for (particle, y) in cells.positions().iter().enumerate() {
                let spacing = cells.spacings(particle);
                let (position, margin) = (all.in_boxes(y), all.margin_of_boxes(&(spacing * MARGIN)));
                if (x - y).norm() > 2.0 * spacing.norm() {
                    continue;
                }
                let target = Target { particle: particle as u32, position: &position, margin: &margin };
                let corners = [from.inf(&position), from.sup(&position)];
                let seen = start.is_empty() || reaches(&mut search, all, &start, target, corners);
                assert_eq!(sights.sees(all, target), seen, "{x:?}, {y:?}");
                counts[usize::from(seen)] += 1;
            }
            counts[2] += usize::from(sights.is_located);
        }
        counts
    }

    #[test]
    fn points_see_what_a_search_for_each_of_them_finds() {
        let mut random = fastrand::Rng::with_seed(26);
        let mut draw = |low: f64, high: f64| low + (high - low) * random.f64();
        let mut sums = [0; 3];
        for count in 0..6 {
            let solid = slotted(&mut draw);
            let turn = Vector3::from_fn(|_, _| draw(-1.0, 1.0)) * f64::from(count % 2);
            let axes = *Rotation3::from_scaled_axis(turn).matrix();
            let cells = match count {
                0..4 => CutLattice::with_axes(&solid, draw(0.07, 0.13), axes),
                _ => CutLattice::refined(&solid, 0.15, 0, |x| if x[1] > 0.6 { 0.5 } else { 1.0 }),
            };
            let cells = cells.unwrap();
            let smoothing = cells.smoothing(2, 2, &cells.zones(2)).unwrap();
            // On faces between cells, on the surface, and inside.
            let mut points: Vec<Point<3>> = smoothing.facet_points.iter().copied().step_by(7).collect();
            points.extend(&cells.gauss(2).unwrap().positions);
            let counts = compared(&cells, &points);
            (0..3).for_each(|k| sums[k] += counts[k]);
        }
        println!("{} not seen, {} seen, {} points located", sums[0], sums[1], sums[2]);
        assert!(sums[0] > 1000 && sums[1] > 1000);
    }
}
