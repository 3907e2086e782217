//! Points on boundary faces and their plain trace functions.

use crate::cells::BoundaryCells;
use crate::cells::brick::{area_vector, multilinear};
use crate::quadrature::LineRule;

use super::Unstructured;
use super::bricks::{opposite, side_points};
use super::faces::Piece;

impl<const D: usize> Unstructured<D> {
    /// Facets of one piece with the points of a rule on each, and plain trace functions: the linear (bilinear) ones of each face.
    pub(super) fn facets(&self, piece: &Piece, rule: &LineRule) -> BoundaryCells<D> {
        let mut cells = BoundaryCells::empty();
        for &face in &piece.faces {
            let cell = self.faces.beside(face as usize)[0] as usize;
            let (shape, nodes) = self.mesh.cell(cell);
            let corners = self.faces.corners(face as usize);
            for (place, &node) in corners.iter().enumerate() {
                let Some(corner) = nodes.iter().position(|n| *n == node) else { continue };
                let on_face = |axis: &usize| {
                    let side = opposite(shape, corner, *axis);
                    self.faces.of(cell, side) == face as usize
                };
                let Some(axis) = (0..D).find(on_face) else { continue };
                let brick = self.brick(cell, corner);
                // Trace functions at the corners of the facet, which a multilinear map carries as it does positions.
                let around = shape.neighbours()[corner];
                let trace_at = |place: usize| -> Vec<f64> {
                    let mut traces = vec![0.0; corners.len()];
                    let of = |k: usize| corners.iter().position(|c| *c == nodes[k]);
                    match place.count_ones() {
                        0 => {
                            if let Some(own) = of(corner) {
                                traces[own] = 1.0;
                            }
                        }
                        1 => {
                            let along = place.trailing_zeros() as usize;
                            for k in [of(corner), of(around[along])].into_iter().flatten() {
                                traces[k] = 0.5;
                            }
                        }
                        _ => traces.fill(1.0 / corners.len() as f64),
                    }
                    traces
                };
                let mut ends: Vec<(usize, Vec<f64>)> = Vec::new();
                for place in 0..1 << D {
                    if (place >> axis) & 1 == 0 {
                        ends.push((place, trace_at(place)));
                    }
                }
                debug_assert!(place < corners.len());
                for (at, weight) in side_points::<D>(axis, 0.0, rule) {
                    let (position, columns) = multilinear(&brick, &at);
                    let area = area_vector(axis, &columns) * -weight;
                    let size = area.norm();
                    let mut traces = vec![0.0; corners.len()];
                    for (place, values) in &ends {
                        let mut share = 1.0;
                        for i in 0..D {
                            if i != axis {
                                share *= if (place >> i) & 1 == 1 { at[i] } else { 1.0 - at[i] };
                            }
                        }
                        for (trace, value) in traces.iter_mut().zip(values) {
                            *trace += share * value;
                        }
                    }
                    cells.push(position, size, area / size, corners.iter().copied().zip(traces).collect());
                }
            }
            cells.points.close_group();
        }
        cells
    }
}
