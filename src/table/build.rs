//! How tables are built: runs of clusters, each into buffers of its own, joined in order.

use std::ops::Range;

use crate::error::{Error, GeometryError};
use crate::parallel::map_ranges;

use super::Clusters;
use super::alike::Likeness;

/// Points below which a table is built on one thread: waking the pool costs more than this many points.
pub(super) const SERIAL_BELOW: usize = 64;

/// Nodes that the points of a cluster may see between them: places among them are stored in 16 bits.
const GROUP_LIMIT: usize = 1 << 16;

/// Nodes of a cluster up to which rows are merged into them one by one: with longer lists, those of large groups, that
/// would take quadratic time.
const MERGED: usize = 1024;

/// Rows of consecutive clusters; buffers grow from run to run and not from point to point.
#[derive(Debug, Default)]
pub(super) struct Rows {
    /// Lists of nodes, one after the other: points of a cluster in a row that see the same share one.
    pub nodes: Vec<u32>,
    pub values: Vec<f64>,
    pub gradients: Vec<f64>,
    pub weights: Vec<f64>,
    /// What tells rows apart that are not written yet.
    pub likeness: Vec<Likeness>,
    /// Entries of the rows before each.
    pub starts: Vec<usize>,
    /// The smallest reciprocal condition number met.
    pub rcond: f64,
    /// Entries of all rows.
    entries: usize,
    /// The list of each row, and the end of each list in `nodes`.
    lists: Vec<u32>,
    ends: Vec<usize>,
    local: Vec<u16>,
    cluster_nodes: Vec<u32>,
    cluster_ends: Vec<usize>,
    /// Lists that belong to closed clusters.
    closed: usize,
    union: Vec<u32>,
    merged: Vec<u32>,
}

impl Rows {
    /// Room for `points` rows as wide as the first one turns out to be.
    fn reserve(&mut self, points: usize) {
        let width = self.entries + self.entries / 8;
        let slots = self.gradients.len().checked_div(self.entries).unwrap_or(0);
        self.gradients.reserve(points * width * slots);
        if !self.values.is_empty() {
            self.values.reserve(points * width);
        }
    }

    /// The entries of a list.
    fn list(&self, list: usize) -> Range<usize> {
        if list == 0 { 0..self.ends[0] } else { self.ends[list - 1]..self.ends[list] }
    }

    /// Ends a row, whose nodes stand behind those of all lists.
    fn end(&mut self) {
        let first = self.ends.last().copied().unwrap_or(0);
        self.starts.push(self.entries);
        self.entries += self.nodes.len() - first;
        let last = self.ends.len();
        if last > self.closed && self.nodes[self.list(last - 1)] == self.nodes[first..] {
            self.nodes.truncate(first);
        } else {
            self.ends.push(self.nodes.len());
        }
        self.lists.push(self.ends.len() as u32 - 1);
    }

    /// Ends a cluster: its nodes are those of the rows since the last one ended.
    fn close(&mut self, cluster: usize) -> Result<(), GeometryError> {
        self.union.clear();
        let mut sorted = MERGED;
        for list in self.closed..self.ends.len() {
            let entries = self.list(list);
            if self.union.len() <= MERGED {
                merge(&self.union, &self.nodes[entries], &mut self.merged);
                std::mem::swap(&mut self.union, &mut self.merged);
                continue;
            }
            // Sorted whenever it has doubled: in no more memory than a few times the union.
            self.union.extend_from_slice(&self.nodes[entries]);
            if self.union.len() > 2 * sorted {
                self.union.sort_unstable();
                self.union.dedup();
                sorted = self.union.len();
            }
        }
        let long = self.union.len() > MERGED;
        if long {
            self.union.sort_unstable();
            self.union.dedup();
        }
        if self.union.len() > GROUP_LIMIT {
            return Err(GeometryError::CrowdedGroup { group: cluster, nodes: self.union.len(), limit: GROUP_LIMIT });
        }
        for list in self.closed..self.ends.len() {
            let entries = self.list(list);
            let mut place = 0;
            for &node in &self.nodes[entries] {
                if long {
                    place += self.union[place..].partition_point(|&other| other < node);
                }
                while self.union[place] < node {
                    place += 1;
                }
                self.local.push(place as u16);
            }
        }
        self.cluster_nodes.extend_from_slice(&self.union);
        self.cluster_ends.push(self.cluster_nodes.len());
        self.closed = self.ends.len();
        Ok(())
    }

    /// Appends the rows of another run.
    fn append(&mut self, run: Rows) {
        let (nodes, lists, cluster_nodes, entries) =
            (self.nodes.len(), self.ends.len(), self.cluster_nodes.len(), self.entries);
        self.nodes.extend(run.nodes);
        self.values.extend(run.values);
        self.gradients.extend(run.gradients);
        self.weights.extend(run.weights);
        self.likeness.extend(run.likeness);
        self.starts.extend(run.starts.iter().map(|start| entries + start));
        self.entries += run.entries;
        self.lists.extend(run.lists.iter().map(|list| lists as u32 + list));
        self.ends.extend(run.ends.iter().map(|end| nodes + end));
        self.local.extend(run.local);
        self.cluster_nodes.extend(run.cluster_nodes);
        self.cluster_ends.extend(run.cluster_ends.iter().map(|end| cluster_nodes + end));
        self.rcond = self.rcond.min(run.rcond);
    }
}

/// The sorted union of two sorted lists.
fn merge(a: &[u32], b: &[u32], out: &mut Vec<u32>) {
    out.clear();
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        out.push(a[i].min(b[j]));
        let (x, y) = (a[i], b[j]);
        i += usize::from(x <= y);
        j += usize::from(y <= x);
    }
    out.extend_from_slice(&a[i..]);
    out.extend_from_slice(&b[j..]);
}

/// Fills the rows of all points, cluster by cluster: `fill(scratch, point, rows)` appends one row.
///
/// `groups` are the clusters, as in [`Points`](crate::quadrature::Points). Each row is computed by one thread
/// from its point alone, so that its bits do not depend on how the clusters are shared out.
pub(super) fn rows<S: Default>(
    groups: &[usize],
    fill: &(dyn Fn(&mut S, usize, &mut Rows) -> Result<(), Error> + Sync),
) -> Result<(Rows, Clusters), Error> {
    joined(groups, &|range| {
        let mut scratch = S::default();
        run(groups, range, &mut |point, rows| fill(&mut scratch, point, rows))
    })
}

/// The rows of some clusters.
fn run(
    groups: &[usize],
    range: Range<usize>,
    fill: &mut dyn FnMut(usize, &mut Rows) -> Result<(), Error>,
) -> Result<Rows, Error> {
    let mut rows = Rows { rcond: 1.0, ..Rows::default() };
    let first = groups.get(range.start).copied().unwrap_or(0);
    for cluster in range.clone() {
        for point in groups[cluster]..groups[cluster + 1] {
            fill(point, &mut rows)?;
            rows.end();
            if point == first {
                rows.reserve(groups[range.end] - first);
            }
        }
        rows.close(cluster)?;
    }
    Ok(rows)
}

/// Runs over all clusters, joined.
fn joined(
    groups: &[usize],
    run: &(dyn Fn(Range<usize>) -> Result<Rows, Error> + Sync),
) -> Result<(Rows, Clusters), Error> {
    let clusters = groups.len().saturating_sub(1);
    let points = groups.last().copied().unwrap_or(0);
    let serial_below = if points < SERIAL_BELOW { usize::MAX } else { 2 };
    let runs = map_ranges(clusters, serial_below, run);
    let mut runs = runs.into_iter().collect::<Result<Vec<_>, _>>()?;
    let mut all = if runs.is_empty() { Rows::default() } else { runs.remove(0) };
    let total = |of: &dyn Fn(&Rows) -> usize| runs.iter().map(of).sum::<usize>();
    all.nodes.reserve_exact(total(&|r| r.nodes.len()));
    all.values.reserve_exact(total(&|r| r.values.len()));
    all.gradients.reserve_exact(total(&|r| r.gradients.len()));
    all.local.reserve_exact(total(&|r| r.local.len()));
    all.cluster_nodes.reserve_exact(total(&|r| r.cluster_nodes.len()));
    runs.into_iter().for_each(|run| all.append(run));
    // What was reserved for wider rows is given back; the table lives as long as the problem.
    all.nodes.shrink_to_fit();
    all.values.shrink_to_fit();
    all.gradients.shrink_to_fit();
    all.local.shrink_to_fit();
    let offsets = |ends: &[usize]| std::iter::once(0).chain(ends.iter().copied()).collect::<Vec<_>>();
    let clusters = Clusters {
        points: groups.to_vec(),
        node_offsets: offsets(&all.cluster_ends),
        nodes: std::mem::take(&mut all.cluster_nodes),
        local: std::mem::take(&mut all.local),
        lists: std::mem::take(&mut all.lists),
        offsets: offsets(&all.ends),
    };
    Ok((all, clusters))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_know_their_nodes_and_the_places_of_each_point() {
        let lists: [&[u32]; 5] = [&[1, 4, 6], &[1, 4, 6], &[0, 4, 9], &[7], &[2, 3]];
        let groups = [0, 3, 3, 5];
        let (rows, clusters) = rows(&groups, &|(): &mut (), point, rows| {
            rows.nodes.extend_from_slice(lists[point]);
            rows.weights.push(1.0);
            Ok(())
        })
        .unwrap();
        // The first two rows share a list.
        assert_eq!(rows.nodes.len(), 9);
        assert_eq!(rows.starts, [0, 3, 6, 9, 10]);
        assert_eq!(clusters.count(), 3);
        assert_eq!(clusters.nodes(0), [0, 1, 4, 6, 9]);
        assert!(clusters.nodes(1).is_empty());
        assert_eq!(clusters.nodes(2), [2, 3, 7]);
        for cluster in 0..3 {
            for point in clusters.points(cluster) {
                let found: Vec<u32> =
                    clusters.local(point).iter().map(|&l| clusters.nodes(cluster)[l as usize]).collect();
                assert_eq!(found, lists[point]);
            }
        }
    }

    /// Rows over one group of `points`, each with three nodes that lie far apart and come in no order.
    fn one_group(points: u32) -> Result<(Rows, Clusters), Error> {
        rows(&[0, points as usize], &|(): &mut (), point, rows| {
            let node = (point as u32 * 7919) % points;
            rows.nodes.extend([node, node + points, node + 2 * points]);
            rows.weights.push(1.0);
            Ok(())
        })
    }

    #[test]
    fn a_group_of_many_points_has_the_places_of_all_its_nodes() {
        // A third of the limit: 65 535 nodes.
        let points = 21_845;
        let (rows, clusters) = one_group(points).unwrap();
        assert_eq!(clusters.nodes(0).len(), 65_535);
        for point in 0..points as usize {
            let found = clusters.local(point).iter().map(|&l| clusters.nodes(0)[l as usize]);
            assert!(found.eq(rows.nodes[3 * point..3 * point + 3].iter().copied()), "{point}");
        }
    }

    #[test]
    fn a_group_of_more_nodes_than_places_is_refused() {
        let error = one_group(21_846).unwrap_err();
        let expected = GeometryError::CrowdedGroup { group: 0, nodes: 65_538, limit: 65_536 };
        assert!(matches!(&error, Error::Geometry(found) if *found == expected), "{error}");
        assert!(error.to_string().contains("make groups smaller"), "{error}");
    }
}
