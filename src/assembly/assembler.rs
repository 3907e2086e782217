//! Assembly: clusters summed into one fixed pattern.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use crate::parallel::{for_each_mut, threads};
use crate::term::{Element, LowerBlocks, Term, View};

use super::model::{Model, SERIAL_BELOW, System};
use super::pattern::Pattern;
use super::streams::{Gathered, Schedule, Streams, Turn};

/// Nodes whose columns are locked together, as a power of two.
const PART: u32 = 5;
/// How long a thread waits for another before it leaves the rest to the others.
const PATIENCE: Duration = Duration::from_millis(200);
/// Floats that one thread clears at a time.
const CLEARED: usize = 1 << 16;

/// The fixed pattern of a model and the places of all cluster blocks in it.
#[derive(Debug, Clone, Default)]
pub struct Assembler {
    pattern: Pattern,
    /// Entries of the pattern.
    entries: usize,
    /// Node columns: first scalar entry and node rows below and on the diagonal.
    node_columns: Vec<usize>,
    /// For each term and cluster the first entry in `places`.
    first_place: Vec<Vec<usize>>,
    /// For each pair (a ≥ b) of a cluster's nodes, by columns b, the place of the block in its node column.
    places: Vec<u32>,
    /// The order of the sums, for each term.
    streams: Vec<Streams>,
    /// One for each thread.
    elements: Vec<Element>,
}

/// The columns of consecutive nodes.
struct Part<'a> {
    /// The first unknown.
    first: usize,
    values: &'a mut [f64],
    residual: &'a mut [f64],
    load_slope: &'a mut [f64],
}

/// Nothing that a part holds is broken by a panic: it is summed anew.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Assembler {
    pub(super) fn new<const D: usize>(model: &Model<D>) -> Self {
        let nodes = model.positions.len();
        // Clusters that hold each node, so that a column is the union of its clusters' nodes.
        let mut holders: Vec<Vec<(u32, u32)>> = vec![Vec::new(); nodes];
        for (t, term) in model.terms.iter().enumerate() {
            for cluster in 0..term.clusters() {
                for &node in term.nodes(cluster) {
                    holders[node as usize].push((t as u32, cluster as u32));
                }
            }
        }
        let mut node_columns = vec![0usize];
        let mut node_rows: Vec<u32> = Vec::new();
        let mut seen = vec![u32::MAX; nodes];
        for column in 0..nodes {
            let start = node_rows.len();
            node_rows.push(column as u32);
            seen[column] = column as u32;
            for &(t, cluster) in &holders[column] {
                for &row in model.terms[t as usize].nodes(cluster as usize) {
                    if row as usize > column && seen[row as usize] != column as u32 {
                        seen[row as usize] = column as u32;
                        node_rows.push(row);
                    }
                }
            }
            node_rows[start..].sort_unstable();
            node_columns.push(node_rows.len());
        }
        let (mut columns, mut all) = (vec![0], Vec::with_capacity(node_rows.len() * D * D));
        for column in 0..nodes {
            let rows = &node_rows[node_columns[column]..node_columns[column + 1]];
            for j in 0..D {
                for i in j..D {
                    all.push((column * D + i) as u32);
                }
                for &row in &rows[1..] {
                    for i in 0..D {
                        all.push(row * D as u32 + i as u32);
                    }
                }
                columns.push(all.len());
            }
        }
        let pattern = Pattern { columns, rows: Arc::new(all) };
        let mut first_place = Vec::new();
        let pairs = |nodes: usize| nodes * (nodes + 1) / 2;
        let count = |term: &dyn Term<D>| (0..term.clusters()).map(|c| pairs(term.nodes(c).len())).sum::<usize>();
        let mut places = Vec::with_capacity(model.terms.iter().map(|term| count(&**term)).sum());
        for term in &model.terms {
            let mut firsts = Vec::with_capacity(term.clusters());
            for cluster in 0..term.clusters() {
                firsts.push(places.len());
                let list = term.nodes(cluster);
                for (b, &column) in list.iter().enumerate() {
                    let rows = &node_rows[node_columns[column as usize]..node_columns[column as usize + 1]];
                    let mut k = 0;
                    for &row in &list[b..] {
                        while rows[k] < row {
                            k += 1;
                        }
                        places.push(k as u32);
                    }
                }
            }
            first_place.push(firsts);
        }
        Assembler {
            entries: pattern.entries(),
            pattern,
            node_columns,
            first_place,
            places,
            streams: model.terms.iter().map(|term| Streams::new(model, &**term)).collect(),
            elements: Vec::new(),
        }
    }

    /// The pattern of the symmetric part.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// Gives back the rows of the pattern, which the sums don't need, once the conditions have been bound to them.
    #[cfg(feature = "solve")]
    pub(crate) fn forget_rows(&mut self) {
        self.pattern.rows = Arc::default();
    }

    /// Assembles the system of `model` at a state. The sums run in one order whatever the number of threads.
    pub fn assemble<const D: usize>(
        &mut self,
        model: &Model<D>,
        displacement: &[f64],
        locals: &[Vec<f64>],
        load: f64,
        system: &mut System,
    ) {
        clear(&mut system.values, self.entries);
        system.skew.clear();
        self.sum(model, View { displacement, locals: &[], load }, locals, true, system);
    }

    /// Assembles residual and load slope alone: the matrix of `system` is left as it is.
    pub fn assemble_forces<const D: usize>(
        &mut self,
        model: &Model<D>,
        displacement: &[f64],
        locals: &[Vec<f64>],
        load: f64,
        system: &mut System,
    ) {
        self.sum(model, View { displacement, locals: &[], load }, locals, false, system);
    }

    /// Sums over all clusters; `at` lacks the local unknowns.
    fn sum<const D: usize>(
        &mut self,
        model: &Model<D>,
        at: View<'_>,
        locals: &[Vec<f64>],
        with_matrix: bool,
        system: &mut System,
    ) {
        let unknowns = model.unknowns();
        system.residual.clear();
        system.residual.resize(unknowns, 0.0);
        system.load_slope.clear();
        system.load_slope.resize(unknowns, 0.0);
        system.scale = 0.0;
        let workers = if unknowns >= SERIAL_BELOW { threads() } else { 1 };
        let mut elements = std::mem::take(&mut self.elements);
        elements.resize_with(workers.max(elements.len()), Element::default);
        let System { residual, load_slope, values, skew, scale } = system;
        let whole = Part { first: 0, values: if with_matrix { values } else { &mut [] }, residual, load_slope };
        let one;
        let (several, mut sum);
        if workers > 1 {
            several = self.parts::<D>(whole);
            sum = Sum { assembler: self, model, at, term: 0, with_matrix, parts: &several, part: PART };
        } else {
            one = [Mutex::new(whole)];
            sum = Sum { assembler: self, model, at, term: 0, with_matrix, parts: &one, part: usize::BITS - 1 };
        }
        for term in 0..model.terms.len() {
            (sum.term, sum.at.locals) = (term, &locals[term]);
            let workers = workers.min(self.streams[term].len());
            if workers > 1 {
                for mut gathered in sum.in_parallel(&mut elements[..workers]) {
                    *scale += gathered.scale;
                    skew.append(&mut gathered.skew);
                }
                continue;
            }
            for stream in (0..self.streams[term].len()).rev() {
                let mut gathered = Gathered { scale: 0.0, skew: std::mem::take(skew) };
                sum.add_clusters(self.streams[term].places(stream), &mut elements[0], &mut gathered);
                *scale += gathered.scale;
                *skew = gathered.skew;
            }
        }
        *scale = scale.sqrt();
        self.elements = elements;
    }

    /// The columns in parts that can be locked one by one.
    fn parts<'a, const D: usize>(&self, whole: Part<'a>) -> Vec<Mutex<Part<'a>>> {
        let nodes = whole.residual.len() / D;
        let mut parts = Vec::with_capacity((nodes >> PART) + 1);
        let Part { mut values, mut residual, mut load_slope, .. } = whole;
        let with_matrix = !values.is_empty();
        for first in (0..nodes).step_by(1 << PART) {
            let (first, end) = (first * D, (first + (1 << PART)).min(nodes) * D);
            let entries = if with_matrix { self.pattern.columns[end] - self.pattern.columns[first] } else { 0 };
            let mine;
            (mine, values) = values.split_at_mut(entries);
            let (forces, slopes);
            (forces, residual) = residual.split_at_mut(end - first);
            (slopes, load_slope) = load_slope.split_at_mut(end - first);
            parts.push(Mutex::new(Part { first, values: mine, residual: forces, load_slope: slopes }));
        }
        parts
    }

    /// Bytes held by pattern, places and element buffers.
    pub fn bytes(&self) -> usize {
        8 * (self.pattern.columns.len() + self.node_columns.len())
            + 4 * (self.pattern.rows.len() + self.places.len())
            + self.streams.iter().map(Streams::bytes).sum::<usize>()
            + self
                .elements
                .iter()
                .map(|e| 8 * (e.matrix.capacity() + e.scratch.capacity()) + e.lower.bytes())
                .sum::<usize>()
    }
}

/// The sum over the clusters of one term.
#[derive(Clone, Copy)]
struct Sum<'a, const D: usize> {
    assembler: &'a Assembler,
    model: &'a Model<D>,
    at: View<'a>,
    term: usize,
    with_matrix: bool,
    parts: &'a [Mutex<Part<'a>>],
    /// Nodes of a part, as a power of two.
    part: u32,
}

impl<const D: usize> Sum<'_, D> {
    /// Sums all clusters, a thread for each element; what the streams gathered, in the order of the sums.
    fn in_parallel(&self, elements: &mut [Element]) -> impl Iterator<Item = Gathered> {
        let schedule = Mutex::new(Schedule::new(&self.assembler.streams[self.term]));
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
    fn add_clusters(&self, places: std::ops::Range<usize>, element: &mut Element, gathered: &mut Gathered) {
        let term = &*self.model.terms[self.term];
        let (has_matrix, lower) = (self.with_matrix && term.has_matrix(), term.fills_lower_blocks());
        for cluster in places.map(|place| self.assembler.streams[self.term].cluster(place)) {
            let nodes = term.nodes(cluster);
            if has_matrix && lower {
                element.reset_lower::<D>(nodes.len());
            } else {
                element.reset(nodes.len() * D, has_matrix);
            }
            term.linearize(cluster, self.at, element);
            if has_matrix && !term.is_symmetric() {
                symmetrise(element);
                collect_skew::<D>(nodes, element, &mut gathered.skew);
            }
            for force in &element.residual {
                gathered.scale += force * force;
            }
            let mut from = 0;
            while from < nodes.len() {
                let part = nodes[from] as usize >> self.part;
                let to = from + nodes[from..].partition_point(|&node| node as usize >> self.part == part);
                let part = &mut *lock(&self.parts[part]);
                for (a, &node) in nodes.iter().enumerate().take(to).skip(from) {
                    let first = node as usize * D - part.first;
                    for i in 0..D {
                        part.residual[first + i] += element.residual[a * D + i];
                        part.load_slope[first + i] += element.load_slope[a * D + i];
                    }
                }
                if has_matrix {
                    self.add_columns(cluster, nodes, from..to, element, part);
                }
                from = to;
            }
        }
    }

    /// Adds some node columns of an element's matrix to the part that holds them.
    fn add_columns(
        &self,
        cluster: usize,
        nodes: &[u32],
        columns: std::ops::Range<usize>,
        element: &Element,
        part: &mut Part<'_>,
    ) {
        let Assembler { pattern, first_place, places, .. } = self.assembler;
        let base = pattern.columns[part.first];
        let size = nodes.len() * D;
        // Blocks of earlier columns: Σ (len − b) for b < from.
        let from = columns.start;
        let mut place = first_place[self.term][cluster] + from * nodes.len() - from * from.saturating_sub(1) / 2;
        for b in columns {
            let column = nodes[b] as usize;
            let blocks = &places[place..place + nodes.len() - b];
            place += nodes.len() - b;
            for j in 0..D {
                let target = pattern.columns[column * D + j] - base;
                // Component i of the a-th node from b on stands at `source[i * by_component + a * by_node]`.
                let (source, by_component, by_node) = if element.lower.wanted {
                    let (source, rows) = element.lower.column::<D>(b, j);
                    (&source[b - LowerBlocks::start(b)..], rows, 1)
                } else {
                    (&element.matrix[(b * D + j) * size + b * D..(b * D + j + 1) * size], 1, D)
                };
                for i in j..D {
                    part.values[target + i - j] += source[i * by_component];
                }
                for (a, &block) in blocks.iter().enumerate().skip(1) {
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

/// Makes a list of zeros: on all threads where it is long and its memory is there, for threads that touch new memory
/// at the same time hold each other up.
fn clear(values: &mut Vec<f64>, count: usize) {
    if values.len() != count || threads() < 2 || count < 2 * CLEARED {
        values.clear();
        values.resize(count, 0.0);
        return;
    }
    let mut parts: Vec<&mut [f64]> = values.chunks_mut(CLEARED).collect();
    for_each_mut(&mut parts, |_, part| part.fill(0.0));
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
fn collect_skew<const D: usize>(nodes: &[u32], element: &Element, skew: &mut Vec<(u32, u32, f64)>) {
    let size = element.residual.len();
    let unknown = |local: usize| nodes[local / D] * D as u32 + (local % D) as u32;
    for column in 0..size {
        for row in column + 1..size {
            let value = element.matrix[row * size + column];
            if value != 0.0 {
                skew.push((unknown(row), unknown(column), value));
            }
        }
    }
}
