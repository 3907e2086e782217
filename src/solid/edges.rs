//! Edges of facets and what they bound.

/// One side of a facet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct HalfEdge {
    /// The edge, see [`edge`].
    pub key: u64,
    pub facet: u32,
    /// The facet's corner opposite of it.
    pub opposite: u8,
    /// Whether the facet runs along it from the lower to the higher vertex.
    pub rises: bool,
}

/// An edge between two vertices as one number that sorts by the lower vertex, then the higher.
pub(super) fn edge(a: u32, b: u32) -> u64 {
    u64::from(a.min(b)) << 32 | u64::from(a.max(b))
}

/// The ends of an edge, the lower one first.
pub(crate) fn ends(key: u64) -> [u32; 2] {
    [(key >> 32) as u32, key as u32]
}

/// All sides of facets, sorted by edge, then facet.
pub(crate) fn half_edges(facets: impl ExactSizeIterator<Item = [u32; 3]>) -> Vec<HalfEdge> {
    let mut all = Vec::with_capacity(3 * facets.len());
    for (facet, corners) in facets.enumerate() {
        for opposite in 0..3 {
            let (a, b) = (corners[(opposite + 1) % 3], corners[(opposite + 2) % 3]);
            all.push(HalfEdge { key: edge(a, b), facet: facet as u32, opposite: opposite as u8, rises: a < b });
        }
    }
    all.sort_unstable();
    all
}

/// Groups of half-edges of one edge.
pub(crate) fn by_edge(halves: &[HalfEdge]) -> impl Iterator<Item = &[HalfEdge]> {
    halves.chunk_by(|a, b| a.key == b.key)
}

/// Facets on one side minus facets on the other; zero where the edge closes.
pub(super) fn balance(group: &[HalfEdge]) -> i32 {
    group.iter().map(|half| if half.rises { 1 } else { -1 }).sum()
}
