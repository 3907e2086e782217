//! Assembly: clusters summed into one fixed pattern, batch by batch.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::parallel::{for_each_mut, threads};
use crate::term::{Element, LowerBlocks, Term, View};

use super::model::{Model, SERIAL_BELOW, System};
use super::pattern::Pattern;

/// Floats that the element matrices of one batch may hold for each thread: 256 kB stay in the cache of a core
/// until they are scattered.
const BATCH_FLOATS: usize = 32_768;
/// Clusters of a batch for each thread where there are several, so that the threads finish together.
const BATCH_CLUSTERS: usize = 4;

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
    batches: Vec<Batch>,
    elements: Vec<Element>,
}

/// Consecutive clusters of one term whose element matrices are held at the same time.
#[derive(Debug, Clone)]
struct Batch {
    term: usize,
    clusters: std::ops::Range<usize>,
    /// Where the node columns of each thread end.
    splits: Vec<usize>,
}

impl Batch {
    /// Deals the columns out by what the clusters add to them: neighbouring ones, as in a batch, fill few columns.
    fn new<const D: usize>(model: &Model<D>, term: usize, clusters: std::ops::Range<usize>, threads: usize) -> Self {
        let mut work: BTreeMap<u32, usize> = BTreeMap::new();
        for cluster in clusters.clone() {
            let list = model.terms[term].nodes(cluster);
            for (b, &column) in list.iter().enumerate() {
                *work.entry(column).or_default() += list.len() - b;
            }
        }
        let total: usize = work.values().sum();
        let (mut end, mut done) = (0, 0);
        let mut columns = work.into_iter();
        let split = |task: usize| {
            while done * threads < total * (task + 1) {
                let Some((column, blocks)) = columns.next() else { break };
                done += blocks;
                end = column as usize + 1;
            }
            end
        };
        let splits = if threads > 1 { (0..threads).map(split).collect() } else { Vec::new() };
        Batch { term, clusters, splits }
    }
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
        let mut batches = Vec::new();
        let mut widest = 0;
        let threads = threads();
        let fewest = if threads > 1 { BATCH_CLUSTERS * threads } else { 1 };
        for (t, term) in model.terms.iter().enumerate() {
            let mut firsts = Vec::with_capacity(term.clusters());
            let mut batch_start = 0;
            let mut floats = 0;
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
                let size = match (term.has_matrix(), term.fills_lower_blocks()) {
                    (true, true) => LowerBlocks::size::<D>(list.len()),
                    (true, false) => (list.len() * D).pow(2),
                    (false, _) => list.len() * D,
                };
                if cluster - batch_start >= fewest && floats + size > BATCH_FLOATS * threads {
                    batches.push(Batch::new(model, t, batch_start..cluster, threads));
                    widest = widest.max(cluster - batch_start);
                    batch_start = cluster;
                    floats = 0;
                }
                floats += size;
            }
            if term.clusters() > batch_start {
                batches.push(Batch::new(model, t, batch_start..term.clusters(), threads));
                widest = widest.max(term.clusters() - batch_start);
            }
            first_place.push(firsts);
        }
        Assembler {
            entries: pattern.entries(),
            pattern,
            node_columns,
            first_place,
            places,
            batches,
            elements: vec![Element::default(); widest],
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

    /// Assembles the system of `model` at a state. The sums run in the order of terms and clusters
    /// whatever the number of threads.
    pub fn assemble<const D: usize>(
        &mut self,
        model: &Model<D>,
        displacement: &[f64],
        locals: &[Vec<f64>],
        load: f64,
        system: &mut System,
    ) {
        system.values.clear();
        system.values.resize(self.entries, 0.0);
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
        let parallel = unknowns >= SERIAL_BELOW && threads() > 1;
        for batch in &self.batches {
            let term = &*model.terms[batch.term];
            let view = View { locals: &locals[batch.term], ..at };
            let elements = &mut self.elements[..batch.clusters.len()];
            let first = batch.clusters.start;
            let (has_matrix, lower) = (with_matrix && term.has_matrix(), term.fills_lower_blocks());
            let fill = |k: usize, element: &mut Element| {
                let nodes = term.nodes(first + k).len();
                if has_matrix && lower {
                    element.reset_lower::<D>(nodes);
                } else {
                    element.reset(nodes * D, has_matrix);
                }
                term.linearize(first + k, view, element);
                if has_matrix && !term.is_symmetric() {
                    symmetrise(element);
                }
            };
            if parallel {
                for_each_mut(elements, fill);
            } else {
                elements.iter_mut().enumerate().for_each(|(k, e)| fill(k, e));
            }
            for (k, element) in elements.iter().enumerate() {
                for (a, &node) in term.nodes(first + k).iter().enumerate() {
                    for i in 0..D {
                        let force = element.residual[a * D + i];
                        system.residual[node as usize * D + i] += force;
                        system.load_slope[node as usize * D + i] += element.load_slope[a * D + i];
                        system.scale += force * force;
                    }
                }
                if has_matrix && !term.is_symmetric() {
                    collect_skew::<D>(term.nodes(first + k), element, &mut system.skew);
                }
            }
            if has_matrix {
                self.scatter(model, batch, &mut system.values, parallel);
            }
        }
        system.scale = system.scale.sqrt();
    }

    /// Adds the element matrices of a batch; each task owns a range of columns and adds in cluster order.
    fn scatter<const D: usize>(&self, model: &Model<D>, batch: &Batch, values: &mut [f64], parallel: bool) {
        // An assembler made on one thread has no splits.
        if !parallel || batch.splits.is_empty() {
            return self.add_columns(model, batch, 0..model.positions.len(), values);
        }
        let mut ranges = Vec::with_capacity(batch.splits.len());
        let mut rest = values;
        let mut start = 0;
        for &end in &batch.splits {
            let split = self.pattern.columns[end * D] - self.pattern.columns[start * D];
            let (mine, others) = rest.split_at_mut(split);
            ranges.push((start..end, mine));
            rest = others;
            start = end;
        }
        for_each_mut(&mut ranges, |_, (columns, values)| self.add_columns(model, batch, columns.clone(), values));
    }

    /// Adds the element matrices of a batch to a range of node columns.
    fn add_columns<const D: usize>(
        &self,
        model: &Model<D>,
        batch: &Batch,
        columns: std::ops::Range<usize>,
        values: &mut [f64],
    ) {
        let term = &*model.terms[batch.term];
        let base = self.pattern.columns[columns.start * D];
        for (k, element) in self.elements[..batch.clusters.len()].iter().enumerate() {
            let cluster = batch.clusters.start + k;
            let list = term.nodes(cluster);
            let size = list.len() * D;
            let from = list.partition_point(|&n| (n as usize) < columns.start);
            let to = list.partition_point(|&n| (n as usize) < columns.end);
            // Blocks of earlier columns: Σ (len − b) for b < from.
            let mut place =
                self.first_place[batch.term][cluster] + from * list.len() - from * from.saturating_sub(1) / 2;
            for b in from..to {
                let column = list[b] as usize;
                let blocks = &self.places[place..place + list.len() - b];
                place += list.len() - b;
                for j in 0..D {
                    let target = self.pattern.columns[column * D + j] - base;
                    // Component i of the a-th node from b on stands at `source[i * by_component + a * by_node]`.
                    let (source, by_component, by_node) = if element.lower.wanted {
                        let (source, rows) = element.lower.column::<D>(b, j);
                        (&source[b - LowerBlocks::start(b)..], rows, 1)
                    } else {
                        (&element.matrix[(b * D + j) * size + b * D..(b * D + j + 1) * size], 1, D)
                    };
                    for i in j..D {
                        values[target + i - j] += source[i * by_component];
                    }
                    for (a, &block) in blocks.iter().enumerate().skip(1) {
                        let at = target + D - j + (block as usize - 1) * D;
                        let entries = &mut values[at..at + D];
                        for (i, entry) in entries.iter_mut().enumerate() {
                            *entry += source[i * by_component + a * by_node];
                        }
                    }
                }
            }
        }
    }

    /// Bytes held by pattern, places and element buffers.
    pub fn bytes(&self) -> usize {
        8 * (self.pattern.columns.len() + self.node_columns.len())
            + 4 * (self.pattern.rows.len() + self.places.len())
            + self
                .elements
                .iter()
                .map(|e| 8 * (e.matrix.capacity() + e.scratch.capacity()) + e.lower.bytes())
                .sum::<usize>()
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
