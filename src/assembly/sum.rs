//! The sum over the clusters of a term, by one thread or several.

use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use crate::compiled::by_dim;
use crate::parallel::{for_each_mut, lock};
use crate::term::{Coupling, Element, Form, LowerBlocks, View, Zone};

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
                symmetrise(dim, nodes, element, &mut gathered.skew);
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
                    if has_matrix && !(matches!(form, Form::Points(_)) && element.points.is_empty()) {
                        self.add_columns::<D>(cluster, nodes, from..to, (form, &mut *element), part);
                    }
                });
                from = to;
            }
        }
    }

    /// Adds some node columns of an element's matrix to the part that holds them.
    fn add_columns<const D: usize>(
        &self,
        cluster: usize,
        nodes: &[u32],
        columns: std::ops::Range<usize>,
        (form, element): (Form<'_>, &mut Element),
        part: &mut Part<'_>,
    ) {
        let Places { pattern, first_block, blocks: places, .. } = self.places;
        let (base, n) = (pattern.columns[part.first], nodes.len());
        let Element { matrix, lower, points, columns: own, .. } = element;
        for b in columns {
            // Blocks of earlier columns: Σ (n − a) for a < b.
            let blocks = &places[first_block[self.term][cluster] + b * n - b * b.saturating_sub(1) / 2..][..n - b];
            if let Form::Points(motion) = form {
                motion.columns::<D>(points, b, own);
            }
            for j in 0..D {
                let target = pattern.columns[nodes[b] as usize * D + j] - base;
                let mut add = |block: u32, source: &[f64], by_component: usize| match block {
                    0 => (j..D).for_each(|i| part.values[target + i - j] += source[i * by_component]),
                    UNCOUPLED => {}
                    _ => {
                        let entries = &mut part.values[target + block as usize * D - j..][..D];
                        for (i, entry) in entries.iter_mut().enumerate() {
                            *entry += source[i * by_component];
                        }
                    }
                };
                match form {
                    Form::Nodes => {
                        let column = matrix[(b * D + j) * n * D..][b * D..n * D].chunks_exact(D);
                        blocks.iter().zip(column).for_each(|(&block, source)| add(block, source, 1));
                    }
                    Form::Blocks { .. } => {
                        let (source, rows) = lower.column::<D>(b, j);
                        let first = b - LowerBlocks::start(b);
                        blocks.iter().enumerate().for_each(|(a, &block)| add(block, &source[first + a..], rows));
                    }
                    Form::Points(_) => {
                        own.rows.iter().for_each(|&row| add(blocks[row as usize - b], &own.block::<D>(row)[j], 1));
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

/// Replaces the matrix by its symmetric part below the diagonal, and appends its skew part.
fn symmetrise(dim: usize, nodes: &[u32], element: &mut Element, skew: &mut Vec<(u32, u32, f64)>) {
    let size = element.residual.len();
    let unknown = |local: usize| nodes[local / dim] * dim as u32 + (local % dim) as u32;
    for column in 0..size {
        for row in column + 1..size {
            let [lower, upper] = [column * size + row, row * size + column].map(|place| element.matrix[place]);
            element.matrix[column * size + row] = 0.5 * (lower + upper);
            if lower != upper {
                skew.push((unknown(row), unknown(column), 0.5 * (lower - upper)));
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
