//! Which particles the points of a cell see, found once for all of them.
//!
//! A box around point and particle grows with the distance between them. Where a particle is reached through the part that the boxes of all
//! points of a cell have in common each of them sees it; where it is not through the box around all of these none does. Points in between
//! are looked at one by one. One flood from a cell, or from a point, answers for all particles that are asked for.

use std::collections::HashMap;

use crate::each::Each;
use crate::geometry::{Bounds, Point};

use super::adjacent::Adjacent;
use super::flood::{Flood, GOALS, Goal};

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
#[derive(Debug, Clone, Copy)]
pub(crate) struct Target<const D: usize> {
    pub(crate) particle: u32,
    pub(crate) position: Point<D>,
    pub(crate) margin: Point<D>,
}

/// A cell around a point, and where its answers are.
#[derive(Debug, Clone, Copy)]
struct Near {
    cell: u32,
    place: u32,
}

/// Buffers of a search for what a point sees, and what is known of the cells of points before.
#[derive(Debug, Clone)]
pub(crate) struct Sights<const D: usize> {
    /// Whose answers these are.
    of: u64,
    /// Answers for each cell that points were in, by rising particle.
    answers: Vec<Vec<(u32, Seen)>>,
    places: HashMap<u32, u32>,
    count: usize,
    /// Cells among which are all that hold the point and whose boxes do; none where there are others.
    near: Vec<Near>,
    /// The point, and in the coordinates of boxes.
    at: Point<D>,
    from: Point<D>,
    /// Cells that hold the point, where they are known; before that those near it.
    start: Vec<u32>,
    is_located: bool,
    /// What is asked for, and the answers.
    targets: Vec<Target<D>>,
    seen: Vec<bool>,
    /// Places among the targets of those that are still open, and of those that a flood is for.
    open: Vec<u32>,
    asked: Vec<u32>,
    flood: Flood,
}

impl<const D: usize> Default for Sights<D> {
    fn default() -> Self {
        Sights {
            of: 0,
            answers: Vec::new(),
            places: HashMap::new(),
            count: 0,
            near: Vec::new(),
            at: Point::zeros(),
            from: Point::zeros(),
            start: Vec::new(),
            is_located: false,
            targets: Vec::new(),
            seen: Vec::new(),
            open: Vec::new(),
            asked: Vec::new(),
            flood: Flood::default(),
        }
    }
}

impl<const D: usize> Sights<D> {
    /// Which of some particles a point is connected to through cells in the box around both and a margin; a point that is
    /// in no cell sees all. What is known of cells is forgotten where it was found among others than `of`.
    pub(crate) fn from(
        &mut self,
        of: u64,
        cells: &dyn Adjacent<D>,
        at: &Point<D>,
        targets: impl Iterator<Item = Target<D>>,
    ) -> &[bool] {
        if self.of != of || self.count > KEPT {
            self.answers.clear();
            self.places.clear();
            (self.of, self.count) = (of, 0);
        }
        self.targets.clear();
        self.targets.extend(targets);
        self.seen.clear();
        self.seen.resize(self.targets.len(), false);
        self.open.clear();
        self.open.extend(0..self.targets.len() as u32);
        (self.at, self.from) = (*at, cells.in_boxes(at));
        self.start.clear();
        self.is_located = cells.near(at, &mut self.start);
        self.list(cells);
        self.close_known(cells);
        if !self.open.is_empty() && !self.is_located {
            self.start.clear();
            cells.at(at, &mut self.start);
            self.is_located = true;
            self.list(cells);
            self.close_known(cells);
        }
        if !self.open.is_empty() {
            self.close(cells);
        }
        &self.seen
    }

    /// Lists the cells around the point with their answers; none where the box of one does not hold it.
    fn list(&mut self, cells: &dyn Adjacent<D>) {
        self.near.clear();
        if !self.start.iter().all(|&cell| cells.bounds(cell).is_some_and(|own| own.holds(&self.from))) {
            return;
        }
        for &cell in &self.start {
            let place = *self.places.entry(cell).or_insert(self.answers.len() as u32);
            if place as usize == self.answers.len() {
                self.answers.push(Vec::new());
            }
            self.near.push(Near { cell, place });
        }
    }

    /// Answers what the cells around the point tell.
    fn close_known(&mut self, cells: &dyn Adjacent<D>) {
        if self.near.is_empty() {
            return;
        }
        for near in 0..self.near.len() {
            self.learn(cells, near);
        }
        let Sights { open, near, answers, targets, seen, is_located, .. } = self;
        open.retain(|&number| {
            let particle = targets[number as usize].particle;
            let (mut any, mut all, mut none) = (false, true, true);
            for Near { place, .. } in &*near {
                let seen = known(&answers[*place as usize], particle).unwrap_or(Seen::Somewhere);
                any |= seen == Seen::Everywhere;
                all &= seen == Seen::Everywhere;
                none &= seen == Seen::Nowhere;
            }
            // One of them is enough where each holds the point.
            let sees = all || (*is_located && any);
            seen[number as usize] = sees;
            !(sees || none)
        });
    }

    /// Finds which points of a cell around the point see the open ones, where that is not known.
    fn learn(&mut self, cells: &dyn Adjacent<D>, near: usize) {
        let Near { cell, place } = self.near[near];
        let Some(&Bounds { low, high }) = cells.bounds(cell) else { return };
        let Sights { answers, targets, open, flood, asked, count, .. } = self;
        let answers = &mut answers[place as usize];
        let particle = |number: u32| targets[number as usize].particle;
        asked.clear();
        asked.extend(open.iter().filter(|number| known(answers, particle(**number)).is_none()));
        if asked.is_empty() {
            return;
        }
        *count += asked.len();
        let start = [cell];
        // The part that all boxes have in common, and the box around all of them.
        let common = |x: &Point<D>| Bounds { low: high.inf(x), high: low.sup(x) };
        keep_unreached(flood, cells, &start, (targets, asked), &common, &mut |number| {
            answers.push((particle(number), Seen::Everywhere));
        });
        let around = |x: &Point<D>| Bounds::of([&low, &high, x]);
        keep_unreached(flood, cells, &start, (targets, asked), &around, &mut |number| {
            answers.push((particle(number), Seen::Somewhere));
        });
        answers.extend(asked.iter().map(|&number| (particle(number), Seen::Nowhere)));
        sort(answers);
    }

    /// Answers what is still open by a flood from the point.
    fn close(&mut self, cells: &dyn Adjacent<D>) {
        let Sights { from, start, targets, open, seen, flood, .. } = self;
        if start.is_empty() {
            return open.iter().for_each(|&number| seen[number as usize] = true);
        }
        let own = |x: &Point<D>| Bounds::of([&*from, x]);
        keep_unreached(flood, cells, start, (targets, open), &own, &mut |number| seen[number as usize] = true);
    }
}

/// Sorts answers by particle.
fn sort(answers: &mut [(u32, Seen)]) {
    answers.sort_unstable_by_key(|own| own.0);
}

/// What is known of a particle.
fn known(answers: &[(u32, Seen)], particle: u32) -> Option<Seen> {
    answers.binary_search_by_key(&particle, |known| known.0).ok().map(|at| answers[at].1)
}

/// Keeps of some targets, by their places, those that floods from some cells do not reach through their boxes and a margin, and hands out
/// the others.
fn keep_unreached<const D: usize>(
    flood: &mut Flood,
    cells: &dyn Adjacent<D>,
    start: &[u32],
    (targets, asked): (&[Target<D>], &mut Vec<u32>),
    corners: &dyn Fn(&Point<D>) -> Bounds<D>,
    reached: &mut dyn FnMut(u32),
) {
    let mut kept = 0;
    for first in (0..asked.len()).step_by(GOALS) {
        let last = asked.len().min(first + GOALS);
        let goal = |number: &u32| {
            let Target { particle, position, margin } = targets[*number as usize];
            Goal { cells: cells.around(particle), within: corners(&position).widened(&margin) }
        };
        let found = flood.reached(cells, start, &asked[first..last].mapped(goal));
        for place in first..last {
            let number = asked[place];
            if (found >> (place - first)) & 1 == 1 {
                reached(number);
            } else {
                asked[kept] = number;
                kept += 1;
            }
        }
    }
    asked.truncate(kept);
}

#[cfg(test)]
mod tests {
    use crate::geometry::Vec3;
    use nalgebra::Rotation3;

    use super::super::visibility::MARGIN;
    use super::*;
    use crate::cells::{Cells, CutLattice};
    use crate::mesh::{CellShape, Mesh};
    use crate::solid::Solid3;

    /// Buffers of a search for one goal.
    #[derive(Default)]
    struct Search {
        open: Vec<(f64, u32)>,
        /// The last search that met each cell.
        met: Vec<u32>,
        number: u32,
        /// Cells looked at so far.
        visits: usize,
    }

    impl Search {
        /// Whether one of some cells, around a point, is connected to the first ones through faces that meet a box.
        fn reaches<const D: usize>(
            &mut self,
            cells: &dyn Adjacent<D>,
            start: &[u32],
            (goal, to): (&[u32], &Point<D>),
            within: &Bounds<D>,
        ) -> bool {
            if start.iter().any(|cell| goal.contains(cell)) {
                return true;
            }
            self.met.resize(cells.count(), 0);
            self.number += 1;
            let Search { open, met, number, .. } = self;
            open.clear();
            for &cell in start {
                met[cell as usize] = *number;
                open.push((0.0, cell));
            }
            let mut found = false;
            while let Some((_, cell)) = open.pop() {
                self.visits += 1;
                let first = open.len();
                cells.beside(cell, &mut |other, face| {
                    if met[other as usize] != *number && face.meets(within) {
                        met[other as usize] = *number;
                        found |= goal.contains(&other);
                        open.push((face.distance(to), other));
                    }
                });
                if found {
                    return true;
                }
                // The one nearest to the goal is taken first: where nothing is in between that leads straight there.
                open[first..].sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
            }
            false
        }
    }

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
        let points = |z: f64| outline.iter().map(move |x| Vec3::new(x[0], x[1], z));
        let quads = [[0, 5, 6, 7], [1, 2, 3, 4], [0, 1, 4, 5]];
        let cells = quads.iter().flat_map(|quad| quad.iter().copied().chain(quad.iter().map(|corner| corner + 8)));
        let points = points(0.0).chain(points(0.3)).collect();
        Solid3::of_mesh(&Mesh::new(points, &[(CellShape::Hexahedron, cells.collect())], &[]).unwrap()).unwrap()
    }

    /// Compares what points see with a search for each of them; how many pairs are not seen and seen, how many points are
    /// located, and how many cells floods and searches visit.
    fn compared(cells: &CutLattice, points: &[Vec3]) -> [usize; 5] {
        let connections = cells.connections().unwrap();
        let all = connections.cells();
        let (mut sights, mut search, mut start) = (Sights::<3>::default(), Search::default(), Vec::new());
        let mut counts = [0; 5];
        for x in points {
            start.clear();
            all.at(x, &mut start);
            let from = all.in_boxes(x);
            let is_near =
                |particle: &usize| (x - cells.positions()[*particle]).norm() <= 2.0 * cells.spacings(*particle).norm();
            let near: Vec<usize> = (0..cells.positions().len()).filter(is_near).collect();
            let target = |particle: usize| {
                let margin = all.margin_of_boxes(&(cells.spacings(particle) * MARGIN));
                Target { particle: particle as u32, position: all.in_boxes(&cells.positions()[particle]), margin }
            };
            let answers = sights.from(1, all, x, near.iter().map(|&particle| target(particle))).to_vec();
            for (&particle, seen) in near.iter().zip(answers) {
                let Target { position, margin, .. } = target(particle);
                let within = Bounds { low: from.inf(&position) - margin, high: from.sup(&position) + margin };
                let goal = (all.around(particle as u32), &position);
                let found = start.is_empty() || search.reaches(all, &start, goal, &within);
                assert_eq!(seen, found, "{x:?}, {particle}");
                counts[usize::from(seen)] += 1;
            }
            counts[2] += usize::from(sights.is_located);
        }
        [counts[3], counts[4]] = [sights.flood.visits, search.visits];
        counts
    }

    #[test]
    fn points_see_what_a_search_for_each_of_them_finds() {
        let mut random = fastrand::Rng::with_seed(26);
        let mut draw = |low: f64, high: f64| low + (high - low) * random.f64();
        let mut sums = [0; 5];
        for count in 0..6 {
            let solid = slotted(&mut draw);
            let turn = Vec3::from_fn(|_, _| draw(-1.0, 1.0)) * f64::from(count % 2);
            let axes = *Rotation3::from_scaled_axis(turn).matrix();
            let cells = match count {
                0..4 => CutLattice::with_axes(&solid, draw(0.07, 0.13), axes),
                _ => CutLattice::refined(&solid, 0.15, 0, |x| if x[1] > 0.6 { 0.5 } else { 1.0 }),
            };
            let cells = cells.unwrap();
            let smoothing = cells.smoothing(2, 2, &cells.zones(2)).unwrap();
            // On faces between cells, on the surface, and inside.
            let mut points: Vec<Vec3> = smoothing.facet_points.iter().copied().step_by(7).collect();
            points.extend(&cells.gauss(2).unwrap().positions);
            let counts = compared(&cells, &points);
            (0..5).for_each(|k| sums[k] += counts[k]);
        }
        let [unseen, seen, located, flooded, searched] = sums;
        println!(
            "{unseen} not seen, {seen} seen, {located} points located, {flooded} cells flooded, {searched} searched"
        );
        assert!(unseen > 1000 && seen > 1000);
        // One flood for all particles looks at fewer cells than a search for each.
        assert!(4 * flooded < searched, "{sums:?}");
    }
}
