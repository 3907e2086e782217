//! The smooth patches between sharp edges.

use crate::each::IntoEach;
use crate::geometry::{Disjoint, double_area};

use super::closed::Solid3;
use super::edges::{HalfEdge, by_edge, half_edges};

impl Solid3 {
    /// The smooth patches between edges at which normals differ by more than `angle` \[rad\], each by its facets, the largest
    /// patch first.
    pub fn patches(&self, angle: f64) -> Vec<Vec<u32>> {
        let mut sets = Disjoint::new(self.facets.len());
        for group in by_edge(&self.half_edges()).filter(|group| !self.is_sharp(group, angle)) {
            sets.join(group[0].facet as usize, group[1].facet as usize);
        }
        let (patch_of, count) = sets.numbered();
        let mut patches: Vec<(f64, Vec<u32>)> = vec![(0.0, Vec::new()); count];
        for (facet, patch) in patch_of.iter().enumerate() {
            let patch = &mut patches[*patch as usize];
            patch.0 += 0.5 * double_area(&self.corners(facet)).norm();
            patch.1.push(facet as u32);
        }
        patches.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1[0].cmp(&b.1[0])));
        // Areas that follow each other and differ by rounding alone keep the order of the facets. Tolerance is no order, so that
        // it can't stand in the comparison.
        let mut start = 0;
        for end in 1..=patches.len() {
            if end == patches.len() || patches[end - 1].0 - patches[end].0 > 1e-9 * patches[end - 1].0 {
                patches[start..end].sort_by_key(|patch| patch.1[0]);
                start = end;
            }
        }
        patches.into_mapped(|(_, facets)| facets)
    }

    fn half_edges(&self) -> Vec<HalfEdge> {
        half_edges(self.facets.iter().copied())
    }

    fn is_sharp(&self, group: &[HalfEdge], angle: f64) -> bool {
        let [a, b] = group else { return true };
        self.normals[a.facet as usize].angle(&self.normals[b.facet as usize]) > angle
    }
}
