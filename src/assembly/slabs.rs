//! The order of sums: slabs of clusters that several threads work on at once.

use crate::term::{Coupling, Term, Zone};

use super::model::Model;

/// Most slabs of a term.
const MOST: usize = 16;
/// Clusters below which a term has one slab.
const FEWEST: usize = 32;
/// Most clusters that a thread sums before it looks for another slab.
const PIECE: usize = 16;
/// Pieces that fewer clusters are cut into.
const PIECES: usize = 64;

/// The order in which the clusters of a term are summed.
///
/// The body is divided into slabs. Each is summed from its first cluster to its last, the last slab first: where two
/// neighbours overlap, the head of the later one comes before the tail of the earlier one. So threads may work on
/// different slabs at the same time and hardly ever wait for each other, they write to different parts of the
/// matrix, and the terms of each entry are added in the same order whatever the number of threads.
#[derive(Debug, Clone, Default)]
pub(super) struct SlabSchedule {
    /// The clusters in their order, empty where it is their own.
    order: Vec<u32>,
    /// Where each slab starts in the order, and the end.
    starts: Vec<usize>,
    /// Clusters that are further apart in the order share no node.
    reach: usize,
    /// Clusters that a thread sums before it looks for another slab.
    piece: usize,
}

impl SlabSchedule {
    pub(super) fn new(model: &Model, term: &dyn Term) -> Self {
        let count = term.clusters();
        let piece = (count / PIECES).clamp(1, PIECE);
        let mut slabs = SlabSchedule { order: Vec::new(), starts: vec![0, count], reach: count, piece };
        if count < FEWEST {
            return slabs;
        }
        let mut seen = vec![u32::MAX; model.node_count()];
        slabs.reach = reach(term, &[], &mut seen);
        // Along which axis do clusters overlap with the fewest others?
        let mut centres = vec![0.0; count];
        for axis in 0..model.dim() {
            for (cluster, centre) in centres.iter_mut().enumerate() {
                let nodes = term.nodes(cluster);
                let sum: f64 = nodes.iter().map(|&node| model.coordinates(node as usize)[axis]).sum();
                *centre = sum / nodes.len() as f64;
            }
            let mut order: Vec<u32> = (0..count as u32).collect();
            crate::order::sort(&mut order, &|&a, &b| centres[a as usize].total_cmp(&centres[b as usize]));
            let reach = reach(term, &order, &mut seen);
            if reach < slabs.reach {
                (slabs.order, slabs.reach) = (order, reach);
            }
        }
        // A slab that is longer than the reach overlaps with its neighbours alone.
        let number = (count / (slabs.reach + piece)).clamp(1, MOST);
        slabs.starts = (0..=number).map(|slab| count * slab / number).collect();
        slabs
    }

    pub(super) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Places of a slab in the order.
    pub(super) fn places(&self, slab: usize) -> std::ops::Range<usize> {
        self.starts[slab]..self.starts[slab + 1]
    }

    /// The cluster at a place of the order.
    pub(super) fn cluster(&self, place: usize) -> usize {
        self.order.get(place).map_or(place, |&cluster| cluster as usize)
    }
}

/// The largest distance of two clusters that share a node; `seen` is overwritten.
fn reach(term: &dyn Term, order: &[u32], seen: &mut [u32]) -> usize {
    seen.fill(u32::MAX);
    let mut reach = 0;
    for place in 0..term.clusters() as u32 {
        let cluster = order.get(place as usize).copied().unwrap_or(place);
        for &node in term.nodes(cluster as usize) {
            let first = &mut seen[node as usize];
            *first = (*first).min(place);
            reach = reach.max(place - *first);
        }
    }
    reach as usize
}

/// What the clusters of a slab have in common.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    /// $\sum f^2$ over the forces of the clusters.
    pub scale: f64,
    /// Skew parts of their matrices.
    pub skew: Vec<(u32, u32, f64)>,
    /// Pressures that are kept uncondensed.
    pub zones: Vec<Zone>,
    /// What neither the symmetric part nor the skew one holds.
    pub coupling: Vec<Coupling>,
}

/// Which slab goes on where.
pub(super) struct Schedule<'a> {
    slabs: &'a SlabSchedule,
    states: Vec<State>,
}

#[derive(Default)]
struct State {
    next: usize,
    busy: bool,
    gathered: Gathered,
}

/// A piece of a slab that a thread sums.
pub(super) struct Piece {
    slab: usize,
    pub places: std::ops::Range<usize>,
    pub gathered: Gathered,
}

/// What a thread does next.
pub(super) enum Turn {
    Sum(Piece),
    /// All that is left overlaps with what others are at.
    Wait,
    Done,
}

impl<'a> Schedule<'a> {
    pub(super) fn new(slabs: &'a SlabSchedule) -> Self {
        let state = |slab| State { next: slabs.places(slab).start, ..State::default() };
        Schedule { slabs, states: (0..slabs.len()).map(state).collect() }
    }

    /// Takes a piece back that has been summed.
    pub(super) fn finish(&mut self, piece: Piece) -> usize {
        let state = &mut self.states[piece.slab];
        *state = State { next: piece.places.end, busy: false, gathered: piece.gathered };
        piece.slab
    }

    /// The next piece for a thread that was at slab `last`.
    pub(super) fn turn(&mut self, last: Option<usize>) -> Turn {
        let left = |slab: usize| self.slabs.places(slab).end - self.states[slab].next;
        let mut best: Option<usize> = None;
        let (mut any_left, mut waiting) = (false, false);
        for slab in (0..self.states.len()).rev().filter(|&slab| left(slab) > 0) {
            any_left = true;
            if self.states[slab].busy {
                continue;
            }
            if !self.is_ready(slab) {
                waiting = true;
                continue;
            }
            // Another slab than the last is worth while only where it has fallen behind.
            let lag = |slab: usize| {
                let bonus = if Some(slab) == last { self.slabs.places(slab).len() / 4 } else { 0 };
                left(slab) + bonus
            };
            if best.is_none_or(|best| lag(slab) > lag(best)) {
                best = Some(slab);
            }
        }
        match best {
            Some(slab) => {
                let places = self.piece(slab);
                let state = &mut self.states[slab];
                state.busy = true;
                Turn::Sum(Piece { slab, places, gathered: std::mem::take(&mut state.gathered) })
            }
            None if any_left && waiting => Turn::Wait,
            None => Turn::Done,
        }
    }

    fn piece(&self, slab: usize) -> std::ops::Range<usize> {
        let next = self.states[slab].next;
        next..(next + self.slabs.piece).min(self.slabs.places(slab).end)
    }

    /// Whether the slab behind has summed all that overlaps with the next piece.
    fn is_ready(&self, slab: usize) -> bool {
        let behind = slab + 1;
        let Some(state) = self.states.get(behind) else { return true };
        let needed = self.piece(slab).end + self.slabs.reach;
        state.next >= needed.min(self.slabs.places(behind).end)
    }

    /// What the slabs gathered, in the order of the sums.
    pub(super) fn gathered(self) -> impl Iterator<Item = Gathered> {
        self.states.into_iter().rev().map(|state| state.gathered)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec2;
    use crate::term::{Element, View};

    /// Cells of a strip or block that reach `overlap` cells beyond their own nodes, in any order.
    struct Cells(Vec<Vec<u32>>);

    impl Cells {
        fn new(counts: [usize; 2], overlap: usize, shuffle: usize) -> Self {
            let [nx, ny] = counts;
            let total = nx * ny;
            let cell = |k: usize| {
                let (x, y) = (k % nx, k / nx);
                let columns = x.saturating_sub(overlap)..=(x + overlap).min(nx - 1);
                let rows = y.saturating_sub(overlap)..=(y + overlap).min(ny - 1);
                rows.flat_map(|row| columns.clone().map(move |column| (row * nx + column) as u32)).collect()
            };
            // A permutation where the factor has no divisor in common with the number of cells.
            Cells((0..total).map(|k| cell(k * shuffle % total)).collect())
        }
    }

    impl Term for Cells {
        fn dim(&self) -> usize {
            2
        }

        fn clusters(&self) -> usize {
            self.0.len()
        }

        fn nodes(&self, cluster: usize) -> &[u32] {
            &self.0[cluster]
        }

        fn linearize(&self, _: usize, _: View<'_>, _: &mut Element) {}

        fn energy(&self, _: usize, _: View<'_>) -> f64 {
            0.0
        }
    }

    #[test]
    fn however_threads_meet_every_node_sees_its_clusters_in_one_order() {
        // Deep, wide, shuffled, too small to part.
        for (counts, overlap, shuffle, least) in
            [([12, 60], 1, 1, 8), ([90, 7], 2, 1, 4), ([40, 41], 1, 997, 8), ([9, 9], 2, 1, 1), ([3, 4], 1, 1, 1)]
        {
            let term = Cells::new(counts, overlap, shuffle);
            let at = |k: usize| Vec2::new((k % counts[0]) as f64, (k / counts[0]) as f64);
            let model = Model::new(&(0..counts[0] * counts[1]).map(at).collect::<Vec<_>>());
            let slabs = SlabSchedule::new(&model, &term);
            assert!(slabs.len() >= least, "{counts:?}: {} slabs of reach {}", slabs.len(), slabs.reach);
            let visits = |order: &mut dyn Iterator<Item = usize>| {
                let mut visits = vec![Vec::new(); model.node_count()];
                for cluster in order.map(|place| slabs.cluster(place)) {
                    term.nodes(cluster).iter().for_each(|&node| visits[node as usize].push(cluster));
                }
                visits
            };
            let alone = visits(&mut (0..slabs.len()).rev().flat_map(|slab| slabs.places(slab)));
            let mut random = 1u64;
            for threads in [1, 2, 3, 7] {
                let mut schedule = Schedule::new(&slabs);
                let mut held: Vec<Option<(Piece, bool)>> = (0..threads).map(|_| None).collect();
                let mut last = vec![None; threads];
                let mut order = Vec::new();
                while order.len() < term.clusters() {
                    random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                    let thread = (random >> 33) as usize % threads;
                    // A thread sums soon after it takes a piece, or just before it gives it back.
                    let soon = random >> 63 == 0;
                    match held[thread].take() {
                        Some((piece, summed)) => {
                            order.extend(if summed { 0..0 } else { piece.places.clone() });
                            last[thread] = Some(schedule.finish(piece));
                        }
                        None => {
                            if let Turn::Sum(piece) = schedule.turn(last[thread]) {
                                order.extend(if soon { piece.places.clone() } else { 0..0 });
                                held[thread] = Some((piece, soon));
                            }
                        }
                    }
                }
                assert_eq!(order.len(), term.clusters());
                assert!(visits(&mut order.into_iter()) == alone, "{counts:?} with {threads} threads");
            }
        }
    }
}
