//! Smoothed sub-cells from polygons that share their vertices.

use std::collections::HashMap;

use crate::error::GeometryError;
use crate::geometry::Vec2;
use crate::quadrature::{Points, gauss_legendre};

use super::Smoothing;
use super::mesh::{collapse, cross, parabola, three_points};
use super::smoothing::on_facets;

/// Polygons over shared vertices, counter-clockwise, in groups.
pub(crate) struct Polygons {
    pub vertices: Vec<Vec2>,
    /// Vertices of all polygons, one after the other; each is star-shaped about its first vertex.
    pub corners: Vec<u32>,
    /// Polygon $c$ has the corners `offsets[c]..offsets[c + 1]`.
    pub offsets: Vec<usize>,
    /// Offsets of the groups of polygons.
    pub groups: Vec<usize>,
    /// How far the middle of a side stands off its chord, by its vertices, the lower one first; sides not listed are
    /// straight.
    pub bulges: HashMap<(u32, u32), Vec2>,
}

impl Polygons {
    pub(crate) fn new(vertices: Vec<Vec2>) -> Self {
        Polygons { vertices, corners: Vec::new(), offsets: vec![0], groups: vec![0], bulges: HashMap::new() }
    }

    pub(crate) fn push(&mut self, corners: impl IntoIterator<Item = u32>) {
        self.corners.extend(corners);
        self.offsets.push(self.corners.len());
    }

    /// Moves a chain of vertices at equal parts of a chord onto its parabola, whose pieces follow it.
    pub(crate) fn bend(&mut self, chain: &[u32], bulge: &Vec2) {
        let parts = chain.len() - 1;
        for (k, ends) in chain.windows(2).enumerate() {
            if k > 0 {
                let t = k as f64 / parts as f64;
                self.vertices[ends[0] as usize] += bulge * (4.0 * t * (1.0 - t));
            }
            // A piece of a parabola is one again.
            self.bulges.insert((ends[0].min(ends[1]), ends[0].max(ends[1])), bulge / (parts * parts) as f64);
        }
    }

    pub(crate) fn bulge(&self, a: u32, b: u32) -> Vec2 {
        self.bulges.get(&(a.min(b), a.max(b))).copied().unwrap_or_else(Vec2::zeros)
    }

    pub(crate) fn close_group(&mut self) {
        self.groups.push(self.offsets.len() - 1);
    }

    /// Sub-cells with `gauss` points on each edge; an edge between two polygons is stored once.
    pub(crate) fn smoothing(&self, gauss: usize) -> Result<Smoothing<2>, GeometryError> {
        // Curved sides take one point more: the patch test stays exact on parabolas in bodies of revolution too.
        let gauss = on_facets(gauss, !self.bulges.is_empty());
        let (abscissae, weights) = gauss_legendre(gauss)?;
        let curved = gauss_legendre(3)?;
        let mut smoothing = Smoothing {
            cells: Vec::with_capacity(self.offsets.len() - 1),
            interior: Vec::with_capacity(self.offsets.len() - 1),
            centres: Vec::with_capacity(self.offsets.len() - 1),
            groups: self.groups.clone(),
            ..Smoothing::empty()
        };
        let mut known: HashMap<(u32, u32), u32> = HashMap::with_capacity(self.corners.len());
        for range in self.offsets.windows(2) {
            let corners = &self.corners[range[0]..range[1]];
            let mut facets = Vec::with_capacity(corners.len());
            for (k, &a) in corners.iter().enumerate() {
                let b = corners[(k + 1) % corners.len()];
                let next = known.len() as u32;
                let facet = *known.entry((a.min(b), a.max(b))).or_insert(next);
                if facet == next {
                    let (from, to) = (self.vertices[a as usize], self.vertices[b as usize]);
                    let bulge = self.bulge(a, b);
                    for (t, w) in abscissae.iter().zip(&weights) {
                        let (position, along) = parabola(&from, &to, &bulge, *t);
                        smoothing.facet_points.push(position);
                        smoothing.facet_areas.push(Vec2::new(along[1], -along[0]) * *w);
                    }
                }
                // The first polygon stores its edge outward; the second runs it the other way.
                facets.push((facet, if facet == next { 1.0 } else { -1.0 }));
            }
            smoothing.cells.push(facets);
            let at = |k: usize| self.vertices[corners[k] as usize];
            let mut interior = Vec::with_capacity(3 * (corners.len() - 2));
            let (mut centre, mut area) = (Vec2::zeros(), 0.0);
            for k in 1..corners.len() - 1 {
                let (a, b, c) = (at(0), at(k), at(k + 1));
                let part = 0.5 * cross(a, b, c);
                centre += (a + b + c) * (part / 3.0);
                area += part;
                let side = |first: usize, second: usize| self.bulge(corners[first], corners[second]);
                // Diagonals are straight.
                let bulges = [
                    if k == 1 { side(0, 1) } else { Vec2::zeros() },
                    side(k, k + 1),
                    if k + 2 == corners.len() { side(k + 1, 0) } else { Vec2::zeros() },
                ];
                if bulges == [Vec2::zeros(); 3] {
                    interior.extend(three_points([a, b, c], part));
                } else {
                    let mut points = Points::empty();
                    collapse(&curved, &[a, b, c], &bulges, &mut points);
                    interior.extend(points.positions.into_iter().zip(points.weights));
                }
            }
            smoothing.centres.push(centre / area);
            smoothing.interior.push(interior);
        }
        smoothing.facet_offsets = Smoothing::<2>::even_offsets(known.len(), gauss);
        Ok(smoothing)
    }
}
