//! Smoothed sub-cells from polygons that share their vertices.

use std::collections::HashMap;

use crate::error::GeometryError;
use crate::geometry::Point;
use crate::quadrature::gauss_legendre;

use super::Smoothing;
use super::mesh::cross;

/// Polygons over shared vertices, counter-clockwise, in groups.
pub(crate) struct Polygons {
    pub vertices: Vec<Point<2>>,
    /// Vertices of all polygons, one after the other; each is star-shaped about its first vertex.
    pub corners: Vec<u32>,
    /// Polygon $c$ has the corners `offsets[c]..offsets[c + 1]`.
    pub offsets: Vec<usize>,
    /// Offsets of the groups of polygons.
    pub groups: Vec<usize>,
}

impl Polygons {
    pub fn new(vertices: Vec<Point<2>>) -> Self {
        Polygons { vertices, corners: Vec::new(), offsets: vec![0], groups: vec![0] }
    }

    pub fn push(&mut self, corners: impl IntoIterator<Item = u32>) {
        self.corners.extend(corners);
        self.offsets.push(self.corners.len());
    }

    pub fn close_group(&mut self) {
        self.groups.push(self.offsets.len() - 1);
    }

    /// Sub-cells with `gauss` points on each edge; an edge between two polygons is stored once.
    pub fn smoothing(self, gauss: usize) -> Result<Smoothing<2>, GeometryError> {
        let (abscissae, weights) = gauss_legendre(gauss)?;
        let mut smoothing = Smoothing {
            facet_points: Vec::new(),
            facet_areas: Vec::new(),
            points_per_facet: gauss,
            cells: Vec::with_capacity(self.offsets.len() - 1),
            interior: Vec::with_capacity(self.offsets.len() - 1),
            centres: Vec::with_capacity(self.offsets.len() - 1),
            groups: self.groups,
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
                    let normal = Point::<2>::new(to[1] - from[1], from[0] - to[0]);
                    for (t, w) in abscissae.iter().zip(&weights) {
                        smoothing.facet_points.push(from * (1.0 - t) + to * *t);
                        smoothing.facet_areas.push(normal * *w);
                    }
                }
                // The first polygon stores its edge outward; the second runs it the other way.
                facets.push((facet, if facet == next { 1.0 } else { -1.0 }));
            }
            smoothing.cells.push(facets);
            let at = |k: usize| self.vertices[corners[k] as usize];
            let mut interior = Vec::with_capacity(3 * (corners.len() - 2));
            let (mut centre, mut area) = (Point::<2>::zeros(), 0.0);
            for k in 1..corners.len() - 1 {
                let (a, b, c) = (at(0), at(k), at(k + 1));
                let part = 0.5 * cross(a, b, c);
                centre += (a + b + c) * (part / 3.0);
                area += part;
                // Mid-edge points: exact to degree 2.
                interior.extend([(a + b) * 0.5, (b + c) * 0.5, (c + a) * 0.5].map(|x| (x, part / 3.0)));
            }
            smoothing.centres.push(centre / area);
            smoothing.interior.push(interior);
        }
        Ok(smoothing)
    }
}
