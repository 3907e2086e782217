//! Points on boundary faces and the trace functions of weak constraint equations on them.

use std::collections::{HashMap, HashSet};

use nalgebra::{DMatrix, DVector};

use crate::cells::BoundaryCells;
use crate::cells::brick::{area_vector, multilinear};
use crate::each::Each;
use crate::geometry::{Point, Vec3, padded};
use crate::quadrature::LineRule;

use super::Unstructured;
use super::bricks::{opposite, side_points};
use super::faces::{Faces, Piece};

/// Rings of faces around one whose particles may carry its trace functions.
const RINGS: usize = 3;
/// What may be missing of the sum of trace functions and of the normal.
const EXACT: f64 = 1e-10;

impl<const D: usize> Unstructured<D> {
    /// Facets of one piece with the points of a rule on each.
    ///
    /// Trace functions are the linear (bilinear) functions of each face. Rows reproduce the tractions of homogeneous stress exactly
    /// where trace functions can combine to the normal: on flat pieces those that sum to one do. On curved ones normals jump from face
    /// to face: there the weights of the particles around a face are the trace functions with the smallest change for which
    /// $\sum_J f_J = 1$ and $\sum_J f_J\\,n_J = n$, with $n_J$ the mean normal at particle $J$; those on a rim
    /// between two curved pieces carry trace functions of one of them. These may be negative: contact takes the linear ones, without `bends`.
    pub(super) fn facets(&self, piece: &Piece, rule: &LineRule, bends: bool) -> BoundaryCells<D> {
        let mut cells = BoundaryCells::empty();
        let bent = (bends && piece.curved).then(|| Bent::new(self, piece));
        for &face in &piece.faces {
            let cell = self.faces.beside(face as usize)[0] as usize;
            let (shape, nodes) = self.mesh.cell(cell);
            let corners = self.faces.corners(face as usize);
            let window = bent.as_ref().map_or_else(Vec::new, |bent| bent.window(&self.faces, face));
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
                    let normal = area / size;
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
                    let plain = || corners.iter().copied().zip(traces.iter().copied()).collect::<Vec<(u32, f64)>>();
                    let traces = bent
                        .as_ref()
                        .and_then(|bent| bent.traces(&window, &plain(), &padded(&normal)))
                        .unwrap_or_else(plain);
                    cells.push(position, size, normal, traces);
                }
            }
            cells.points.close_group();
        }
        cells
    }
}

/// A curved piece: mean normals of its particles, and which of them carry no trace functions.
struct Bent {
    dimension: usize,
    normals: HashMap<u32, Vec3>,
    lent: HashSet<u32>,
    faces_at: HashMap<u32, Vec<u32>>,
}

impl Bent {
    fn new<const D: usize>(cells: &Unstructured<D>, piece: &Piece) -> Self {
        let mut normals: HashMap<u32, Vec3> = HashMap::new();
        let mut faces_at: HashMap<u32, Vec<u32>> = HashMap::new();
        for &face in &piece.faces {
            let corners = cells.faces.corners(face as usize);
            let normal: Vec3 = padded(&cells.faces.normal(cells.mesh.points(), face as usize));
            for &corner in corners {
                *normals.entry(corner).or_insert_with(Point::zeros) += normal;
                faces_at.entry(corner).or_default().push(face);
            }
        }
        for normal in normals.values_mut() {
            *normal = normal.normalize();
        }
        Bent { dimension: D, normals, lent: piece.lent.iter().copied().collect(), faces_at }
    }

    /// Particles around a face that carry trace functions, in rings.
    fn window(&self, faces: &Faces, face: u32) -> Vec<Vec<u32>> {
        let mut seen: Vec<u32> = Vec::new();
        let mut own = vec![face];
        let mut rings: Vec<Vec<u32>> = Vec::new();
        for _ in 0..=RINGS {
            let mut ring: Vec<u32> = Vec::new();
            for &face in &own {
                for &corner in faces.corners(face as usize) {
                    if !seen.contains(&corner) && !ring.contains(&corner) {
                        ring.push(corner);
                    }
                }
            }
            ring.sort_unstable();
            own = ring.iter().flat_map(|corner| self.faces_at[corner].iter().copied()).collect();
            own.sort_unstable();
            own.dedup();
            seen.extend(&ring);
            let before = rings.last().cloned().unwrap_or_default();
            let own = ring.into_iter().filter(|corner| !self.lent.contains(corner));
            rings.push(before.into_iter().chain(own).collect());
        }
        rings
    }

    /// Trace functions moved as little as possible to sum to one and to the normal, on as few rings as can; none where the piece has too
    /// few particles.
    fn traces(&self, rings: &[Vec<u32>], plain: &[(u32, f64)], normal: &Vec3) -> Option<Vec<(u32, f64)>> {
        let count = self.dimension + 1;
        let entry = |particle: u32, i: usize| if i == 0 { 1.0 } else { self.normals[&particle][i - 1] };
        rings.iter().skip(1).find_map(|window| {
            if window.is_empty() {
                return None;
            }
            let of = |particle: &u32| plain.iter().find(|trace| trace.0 == *particle).map_or(0.0, |trace| trace.1);
            let mut weights: Vec<f64> = window.mapped(of);
            let rows = DMatrix::from_fn(count, window.len(), |i, k| entry(window[k], i));
            let requested = DVector::from_fn(count, |i, _| if i == 0 { 1.0 } else { normal[i - 1] });
            let missing = &requested - &rows * DVector::from_row_slice(&weights);
            // Normals that hardly differ make the Gram matrix singular: what is in its range is solved, the rest is zero.
            let eigen = (&rows * rows.transpose()).symmetric_eigen();
            let largest = eigen.eigenvalues.max();
            let mut solution = DVector::zeros(count);
            for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
                if *value > 1e-12 * largest {
                    solution += vector * (vector.dot(&missing) / value);
                }
            }
            let moved = rows.transpose() * &solution;
            for (weight, moved) in weights.iter_mut().zip(moved.iter()) {
                *weight += moved;
            }
            let left = (&requested - &rows * DVector::from_row_slice(&weights)).norm();
            (left < EXACT).then(|| window.iter().copied().zip(weights).collect())
        })
    }
}
