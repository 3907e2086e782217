//! The sum over the clusters of a term, by one thread or several.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::compiled::by_dim;
use crate::parallel::for_each_mut;
use crate::term::{Coupling, Element, Form, LowerBlocks, PointMotion, View, Zone};

use super::fault::fault;
use super::model::Model;
use super::pattern::{Pattern, UNCOUPLED};
use super::slabs::{Gathered, Schedule, SlabSchedule, Turn};

/// How long a thread waits for another before it leaves the rest to the others.
const PATIENCE: Duration = Duration::from_millis(200);

/// The columns of consecutive nodes.
pub(super) struct Part<'a> {
    /// The first unknown.
    pub(super) first: usize,
    pub(super) values: &'a mut [f64],
    pub(super) residual: &'a mut [f64],
    pub(super) load_slope: &'a mut [f64],
}

/// Nothing that a part holds is broken by a panic: it is summed anew.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Where the blocks of clusters go and in which order, for all terms.
#[derive(Clone, Copy)]
pub(super) struct Places<'a> {
    pub(super) pattern: &'a Pattern,
    /// For each term and cluster the first entry in `blocks`.
    pub(super) first_block: &'a [Vec<usize>],
    /// For each pair (a ≥ b) of a cluster's nodes, by columns b, the place of the block in its node column.
    pub(super) blocks: &'a [u32],
    pub(super) slabs: &'a [SlabSchedule],
    /// Whether pressures of zones are kept uncondensed, and nothing of terms with such zones is summed.
    pub(super) kept: bool,
}

/// The sum over the clusters of one term.
#[derive(Clone, Copy)]
pub(super) struct Sum<'a> {
    pub(super) places: Places<'a>,
    pub(super) model: &'a Model,
    pub(super) at: View<'a>,
    pub(super) term: usize,
    pub(super) with_matrix: bool,
    pub(super) parts: &'a [Mutex<Part<'a>>],
    /// Nodes of a part, as a power of two.
    pub(super) part: u32,
}

impl Sum<'_> {
    /// Sums all clusters, a thread for each element; what the slabs gathered, in the order of the sums.
    pub(super) fn in_parallel(&self, elements: &mut [Element]) -> impl Iterator<Item = Gathered> {
        let schedule = Mutex::new(Schedule::new(&self.places.slabs[self.term]));
        let work = |element: &mut Element| {
            let (mut last, mut since): (_, Option<Instant>) = (None, None);
            loop {
                let turn = lock(&schedule).turn(last);
                match turn {
                    Turn::Sum(mut piece) => {
                        self.add_clusters(piece.places.clone(), element, &mut piece.gathered);
                        last = Some(lock(&schedule).finish(piece));
                        since = None;
                    }
                    Turn::Wait if since.get_or_insert_with(Instant::now).elapsed() < PATIENCE => {
                        std::thread::yield_now();
                    }
                    _ => break,
                }
            }
        };
        for_each_mut(elements, |_, element| work(element));
        // What was left where threads gave up waiting: only terms that hand work to other threads can make all of them.
        work(&mut elements[0]);
        schedule.into_inner().unwrap_or_else(PoisonError::into_inner).gathered()
    }

    /// Adds the clusters at some places of the order.
    pub(super) fn add_clusters(&self, places: std::ops::Range<usize>, element: &mut Element, gathered: &mut Gathered) {
        let (dim, term) = (self.model.dim(), &*self.model.terms[self.term]);
        let (layout, form) = (term.layout(), term.form());
        let wanted = self.with_matrix && layout.has_matrix;
        let has_matrix = wanted && !form.stays(self.places.kept);
        let dense = matches!(form, Form::Nodes);
        for cluster in places.map(|place| self.places.slabs[self.term].cluster(place)) {
            let nodes = term.nodes(cluster);
            element.reset(nodes.len() * dim, wanted && dense);
            element.with_matrix = wanted;
            element.uncondensed = (wanted && self.places.kept)
                .then(|| Zone { owner: [self.term as u32, cluster as u32], ..Zone::default() });
            term.linearize(cluster, self.at, element);
            // A scale that is NaN refuses the state; `ModelAt::fault` then names the term.
            if dense && fault(nodes.len() * dim, layout, element).is_some() {
                gathered.scale = f64::NAN;
                continue;
            }
            if let Some(mut zone) = element.uncondensed.take().filter(|zone| !zone.slopes.is_empty()) {
                zone.nodes.extend_from_slice(nodes);
                gathered.zones.push(zone);
            }
            if has_matrix && !layout.symmetric {
                symmetrise(element);
                collect_skew(dim, nodes, element, &mut gathered.skew);
            }
            gathered.coupling.extend(element.coupling.drain(..).map(|own| over_all(dim, nodes, own)));
            let squares = || element.residual.iter().map(|force| force * force).sum();
            gathered.scale += element.force_squares.unwrap_or_else(squares);
            let mut from = 0;
            while from < nodes.len() {
                let part = nodes[from] as usize >> self.part;
                let to = from + nodes[from..].partition_point(|&node| node as usize >> self.part == part);
                let part = &mut *lock(&self.parts[part]);
                by_dim!(dim, D => {
                    add_forces::<D>(nodes, from..to, element, part);
                    match form {
                        _ if !has_matrix => {}
                        Form::Points(_) if element.points.is_empty() => {}
                        Form::Points(motion) => {
                            self.add_point_columns::<D>(cluster, nodes, from..to, (motion, &mut *element), part);
                        }
                        _ => self.add_columns::<D>(cluster, nodes, from..to, (dense, element), part),
                    }
                });
                from = to;
            }
        }
    }

    /// Adds some node columns of a matrix over points to the part that holds them.
    fn add_point_columns<const D: usize>(
        &self,
        cluster: usize,
        nodes: &[u32],
        columns: std::ops::Range<usize>,
        (motion, element): (&PointMotion, &mut Element),
        part: &mut Part<'_>,
    ) {
        let Places { pattern, first_block, blocks: places, .. } = self.places;
        let (base, Element { points, columns: own, .. }) = (pattern.columns[part.first], element);
        for b in columns {
            motion.columns::<D>(points, b, own);
            let column = nodes[b] as usize * D;
            let first = first_block[self.term][cluster] + b * nodes.len() - b * b.saturating_sub(1) / 2;
            for &row in &own.rows {
                let block = own.block::<D>(row);
                let place = places[first + row as usize - b] as usize;
                for j in 0..D {
                    let target = pattern.columns[column + j] - base;
                    if place == 0 {
                        (j..D).for_each(|i| part.values[target + i - j] += block[j][i]);
                    } else {
                        let target = &mut part.values[target + place * D - j..][..D];
                        target.iter_mut().zip(&block[j]).for_each(|(target, value)| *target += value);
                    }
                }
            }
        }
    }

    /// Adds some node columns of an element's matrix to the part that holds them.
    fn add_columns<const D: usize>(
        &self,
        cluster: usize,
        nodes: &[u32],
        columns: std::ops::Range<usize>,
        (dense, element): (bool, &Element),
        part: &mut Part<'_>,
    ) {
        let Places { pattern, first_block, blocks: places, .. } = self.places;
        let base = pattern.columns[part.first];
        let size = nodes.len() * D;
        // Blocks of earlier columns: Σ (len − b) for b < from.
        let from = columns.start;
        let mut place = first_block[self.term][cluster] + from * nodes.len() - from * from.saturating_sub(1) / 2;
        for b in columns {
            let column = nodes[b] as usize;
            let blocks = &places[place..place + nodes.len() - b];
            place += nodes.len() - b;
            for j in 0..D {
                let target = pattern.columns[column * D + j] - base;
                // Component i of the a-th node from b on stands at `source[i * by_component + a * by_node]`.
                let (source, by_component, by_node) = if dense {
                    (&element.matrix[(b * D + j) * size + b * D..(b * D + j + 1) * size], 1, D)
                } else {
                    let (source, rows) = element.lower.column::<D>(b, j);
                    (&source[b - LowerBlocks::start(b)..], rows, 1)
                };
                for i in j..D {
                    part.values[target + i - j] += source[i * by_component];
                }
                for (a, &block) in blocks.iter().enumerate().skip(1) {
                    if block == UNCOUPLED {
                        continue;
                    }
                    let at = target + D - j + (block as usize - 1) * D;
                    let entries = &mut part.values[at..at + D];
                    for (i, entry) in entries.iter_mut().enumerate() {
                        *entry += source[i * by_component + a * by_node];
                    }
                }
            }
        }
    }
}

/// Adds forces and load slopes of some nodes of an element to the part that holds them.
fn add_forces<const D: usize>(nodes: &[u32], some: std::ops::Range<usize>, element: &Element, part: &mut Part<'_>) {
    for (a, &node) in nodes.iter().enumerate().take(some.end).skip(some.start) {
        let first = node as usize * D - part.first;
        for i in 0..D {
            part.residual[first + i] += element.residual[a * D + i];
            part.load_slope[first + i] += element.load_slope[a * D + i];
        }
    }
}

/// Replaces the matrix by its symmetric part below and on the diagonal, its skew part above.
fn symmetrise(element: &mut Element) {
    let size = element.residual.len();
    for column in 0..size {
        for row in column + 1..size {
            let lower = element.matrix[column * size + row];
            let upper = element.matrix[row * size + column];
            element.matrix[column * size + row] = 0.5 * (lower + upper);
            element.matrix[row * size + column] = 0.5 * (lower - upper);
        }
    }
}

/// Appends the skew part that [`symmetrise`] left above the diagonal.
fn collect_skew(dim: usize, nodes: &[u32], element: &Element, skew: &mut Vec<(u32, u32, f64)>) {
    let size = element.residual.len();
    let unknown = |local: usize| nodes[local / dim] * dim as u32 + (local % dim) as u32;
    for column in 0..size {
        for row in column + 1..size {
            let value = element.matrix[row * size + column];
            if value != 0.0 {
                skew.push((unknown(row), unknown(column), value));
            }
        }
    }
}

/// What a cluster couples, over the unknowns of all nodes.
fn over_all(dim: usize, nodes: &[u32], mut own: Coupling) -> Coupling {
    for (k, _) in own.left.iter_mut().chain(&mut own.right) {
        *k = nodes[*k as usize / dim] * dim as u32 + *k % dim as u32;
    }
    own
}
