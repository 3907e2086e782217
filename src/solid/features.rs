//! Sharp edges, corners, and the smooth patches between them.

use std::collections::HashMap;

use crate::each::IntoEach;
use crate::geometry::{Disjoint, Vec3};

use super::closed::Solid3;
use super::edges::{HalfEdge, by_edge, ends, half_edges};

/// Turns of a sharp edge beyond which a vertex on it is a corner, in radians: circles of eight chords have none.
const TURN: f64 = 1.0;

/// Sharp edges and corners of a surface.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Features {
    /// Pairs of vertices, the lower one first, rising.
    pub edges: Vec<[u32; 2]>,
    /// Vertices where sharp edges end, meet or bend by more than one radian, and tips without sharp edges; rising.
    pub corners: Vec<u32>,
}

impl Solid3 {
    /// Edges at which the normals of the facets differ by more than `angle` \[rad\], or more than two facets meet, and corners.
    pub fn features(&self, angle: f64) -> Features {
        let mut edges = Vec::new();
        let mut along: HashMap<u32, Vec<Vec3>> = HashMap::new();
        for group in by_edge(&self.half_edges()).filter(|group| self.is_sharp(group, angle)) {
            let [a, b] = ends(group[0].key);
            let way = (self.vertices[b as usize] - self.vertices[a as usize]).normalize();
            edges.push([a, b]);
            along.entry(a).or_default().push(way);
            along.entry(b).or_default().push(-way);
        }
        let mut sum = vec![Vec3::zeros(); self.vertices.len()];
        for (facet, normal) in self.facets.iter().zip(&self.normals) {
            facet.iter().for_each(|&vertex| sum[vertex as usize] += normal);
        }
        let mut is_corner = vec![false; self.vertices.len()];
        for (facet, normal) in self.facets.iter().zip(&self.normals) {
            for &vertex in facet {
                // A tip: the normals around it lie wide of their mean.
                let tip = !along.contains_key(&vertex) && sum[vertex as usize].angle(normal) > angle;
                is_corner[vertex as usize] |= tip;
            }
        }
        for (&vertex, ways) in &along {
            is_corner[vertex as usize] = match ways[..] {
                [a, b] => std::f64::consts::PI - a.angle(&b) > TURN,
                _ => true,
            };
        }
        let corners = (0..self.vertices.len() as u32).filter(|&vertex| is_corner[vertex as usize]).collect();
        Features { edges, corners }
    }

    /// The smooth patches between edges at which normals differ by more than `angle` \[rad\], each by its facets, the largest
    /// patch first.
    pub fn patches(&self, angle: f64) -> Vec<Vec<u32>> {
        let mut sets = Disjoint::new(self.facets.len());
        for group in by_edge(&self.half_edges()).filter(|group| !self.is_sharp(group, angle)) {
            sets.join(group[0].facet as usize, group[1].facet as usize);
        }
        let mut patches: Vec<(f64, Vec<u32>)> = Vec::new();
        let mut place = vec![usize::MAX; self.facets.len()];
        for facet in 0..self.facets.len() {
            let root = sets.leader(facet);
            if place[root] == usize::MAX {
                place[root] = patches.len();
                patches.push((0.0, Vec::new()));
            }
            let [a, b, c] = self.corners(facet);
            let patch = &mut patches[place[root]];
            patch.0 += 0.5 * (b - a).cross(&(c - a)).norm();
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
