//! Clusters of points that are assembled together.

/// From one offset to the next; nothing where there are none.
#[inline]
fn between(offsets: &[usize], k: usize) -> std::ops::Range<usize> {
    match (offsets.get(k), offsets.get(k.saturating_add(1))) {
        (Some(&first), Some(&end)) => first..end,
        _ => 0..0,
    }
}

/// Points of one cell or zone with the nodes they see between them.
///
/// A cluster plays the part of a finite element: its points are summed into one dense matrix over its
/// nodes, which is then added to the sparse one. Points of a cluster share most of their nodes, so the
/// sparse matrix is touched once per cluster and not once per point.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Clusters {
    /// The first point and the first node of each cluster, of which each is a run.
    pub(super) points: Vec<usize>,
    pub(super) node_offsets: Vec<usize>,
    /// The nodes of each cluster, by rising index.
    pub(super) nodes: Vec<u32>,
    /// For each node of a list its place among those of the cluster.
    pub(super) local: Vec<u16>,
    /// The list of each point, and where the lists start.
    pub(super) lists: Vec<u32>,
    pub(super) offsets: Vec<usize>,
}

impl Clusters {
    /// Adds a number to the index of each node.
    pub(super) fn shift(&mut self, first: u32) {
        self.nodes.iter_mut().for_each(|node| *node += first);
    }

    /// Number of clusters.
    pub fn count(&self) -> usize {
        self.points.len().saturating_sub(1)
    }

    /// The points of a cluster; none where there is no such cluster.
    #[inline]
    pub fn points(&self, cluster: usize) -> std::ops::Range<usize> {
        between(&self.points, cluster)
    }

    /// The nodes of a cluster, by rising index; none where there is no such cluster.
    #[inline]
    pub fn nodes(&self, cluster: usize) -> &[u32] {
        &self.nodes[between(&self.node_offsets, cluster)]
    }

    /// For each node of a point, its place among the nodes of the point's cluster; none where there is no such point.
    #[inline]
    pub fn local(&self, point: usize) -> &[u16] {
        &self.local[self.entries(point)]
    }

    /// The entries of a point's list of nodes; none where there is no such point.
    #[inline]
    pub(super) fn entries(&self, point: usize) -> std::ops::Range<usize> {
        self.lists.get(point).map_or(0..0, |&list| between(&self.offsets, list as usize))
    }

    /// Bytes held.
    pub(crate) fn bytes(&self) -> usize {
        8 * (self.points.len() + self.node_offsets.len() + self.offsets.len())
            + 4 * (self.nodes.len() + self.lists.len())
            + 2 * self.local.len()
    }
}
