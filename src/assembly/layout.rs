//! The layout of a matrix: which nodes of a model are coupled, and where the blocks of its clusters go.

use std::sync::Arc;

use crate::table::Clusters;
use crate::term::{Form, Term};

use super::Model;
use super::pattern::{Pattern, UNCOUPLED};

/// Node by node, the nodes at and below it that it is coupled with.
pub(super) struct NodeColumns {
    /// The first row of each column, and the end.
    pub first: Vec<usize>,
    rows: Vec<u32>,
}

impl NodeColumns {
    /// Of a complete model; with pressures of zones `kept`, the rest of the matrices of such terms is left to their points.
    pub(crate) fn new(model: &Model, kept: bool) -> Self {
        let nodes = model.node_count();
        // Clusters that hold each node, so that a column is the union of its clusters' nodes.
        let mut holders: Vec<Vec<(u32, u32)>> = vec![Vec::new(); nodes];
        for (t, term) in model.terms.iter().enumerate().filter(|(_, term)| !term.form().stays(kept)) {
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
            let mut see = |row: u32| {
                if row as usize > column && seen[row as usize] != column as u32 {
                    seen[row as usize] = column as u32;
                    node_rows.push(row);
                }
            };
            for &(t, cluster) in &holders[column] {
                let term = &model.terms[t as usize];
                let nodes = term.nodes(cluster as usize);
                if let Form::Blocks { apart: Some(clusters), .. } = term.form() {
                    let own = nodes.partition_point(|&node| (node as usize) < column) as u16;
                    for list in coupled(clusters, cluster as usize).filter(|list| list.binary_search(&own).is_ok()) {
                        list.iter().for_each(|&a| see(nodes[a as usize]));
                    }
                } else {
                    nodes.iter().for_each(|&row| see(row));
                }
            }
            node_rows[start..].sort_unstable();
            node_columns.push(node_rows.len());
        }
        NodeColumns { first: node_columns, rows: node_rows }
    }

    fn column(&self, column: usize) -> &[u32] {
        &self.rows[self.first[column]..self.first[column + 1]]
    }

    /// The pattern over all components.
    pub(crate) fn pattern(&self, dim: usize) -> Pattern {
        let (mut columns, mut all) = (vec![0], Vec::with_capacity(self.rows.len() * dim * dim));
        for column in 0..self.first.len() - 1 {
            let rows = self.column(column);
            for j in 0..dim {
                for i in j..dim {
                    all.push((column * dim + i) as u32);
                }
                for &row in &rows[1..] {
                    for i in 0..dim {
                        all.push(row * dim as u32 + i as u32);
                    }
                }
                columns.push(all.len());
            }
        }
        Pattern { columns, rows: Arc::new(all) }
    }

    /// For each term and cluster its first place, and for each pair of a cluster's nodes the place of the block in its column.
    pub(crate) fn places(&self, model: &Model, kept: bool) -> (Vec<Vec<usize>>, Vec<u32>) {
        let mut first_place = Vec::new();
        let pairs = |nodes: usize| nodes * (nodes + 1) / 2;
        let count = |term: &dyn Term| match term.form().stays(kept) {
            true => 0,
            false => (0..term.clusters()).map(|c| pairs(term.nodes(c).len())).sum::<usize>(),
        };
        let mut places = Vec::with_capacity(model.terms.iter().map(|term| count(&**term)).sum());
        for term in &model.terms {
            let mut firsts = Vec::with_capacity(term.clusters());
            for cluster in 0..term.clusters() {
                firsts.push(places.len());
                let list = term.nodes(cluster);
                let sparse = match term.form() {
                    form if form.stays(kept) => continue,
                    Form::Blocks { apart: Some(clusters), .. } => {
                        Some(pairs_of(list.len(), coupled(clusters, cluster)))
                    }
                    _ => None,
                };
                for (b, &column) in list.iter().enumerate() {
                    let rows = self.column(column as usize);
                    let mut k = 0;
                    for (a, &row) in list.iter().enumerate().skip(b) {
                        if a > b && sparse.as_ref().is_some_and(|pairs| !pairs[b * list.len() + a]) {
                            places.push(UNCOUPLED);
                            continue;
                        }
                        while rows[k] < row {
                            k += 1;
                        }
                        places.push(k as u32);
                    }
                }
            }
            first_place.push(firsts);
        }
        (first_place, places)
    }
}

/// Lists of the nodes of a cluster, by their places there, that share a point.
fn coupled(clusters: &Clusters, cluster: usize) -> impl Iterator<Item = &[u16]> {
    let mut last: &[u16] = &[];
    let lists = clusters.points(cluster).map(|point| clusters.local(point));
    lists.filter(move |list| std::mem::replace(&mut last, list) != *list)
}

/// Which of so many nodes are coupled with which.
fn pairs_of<'a>(n: usize, lists: impl Iterator<Item = &'a [u16]>) -> Vec<bool> {
    let mut coupled = vec![false; n * n];
    for nodes in lists {
        for &b in nodes {
            nodes.iter().for_each(|&a| coupled[b as usize * n + a as usize] = true);
        }
    }
    coupled
}
