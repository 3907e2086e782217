//! Particles at the nodes of a mesh and its cells between them.

mod bricks;
mod faces;
mod inside;
mod traces;

use crate::each::{Each, EachOf, list_of, point_of};
use crate::error::{ApproximationError, Error, GeometryError, MeshError};
use crate::geometry::{Part, Point, padded};
use crate::mesh::Mesh;
use crate::quadrature::{LineRule, Points, check_halves, check_point_count, gauss_legendre, in_pieces};
use crate::rows::Rows;

use super::brick::{Shape, area_vector, multilinear};
use super::inertia::Inertia;
use super::locator::Locator;
use super::smoothing::interior_rule;
use super::zones::stars;
use super::{BoundaryCells, Cells, EDGE, Smoothing, Zones};
use bricks::{opposite, side_points};
use faces::Faces;

/// Particles at the nodes of a mesh, its cells between them: tetrahedra, hexahedra and prisms in space, triangles and
/// quadrangles in the plane, mixed as they come.
///
/// Each cell is cut into one sub-cell for each of its corners, along the middles of its edges, faces and itself: bricks in
/// space, quadrangles in the plane. Neighbours of any two shapes share their facets. Zones are the stars of inner particles
/// that share no cell. Supports are balls.
///
/// ```
/// use std::sync::Arc;
/// use rkpm::cells::Unstructured;
/// use rkpm::mesh::{CellShape, Mesh};
/// use rkpm::prelude::*;
/// // Two tetrahedra, by hand; `Mesh::read("part.msh")?` has more.
/// let points = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [1., 1., 1.]].map(Point::<3>::from);
/// let blocks = [(CellShape::Tetrahedron, vec![0, 1, 2, 3, 1, 2, 3, 4]), (CellShape::Triangle, vec![0, 1, 2])];
/// let mesh = Mesh::new(points.to_vec(), &blocks, &[("base".to_string(), vec![2])])?;
/// let cells = Unstructured::new(&mesh)?;
/// assert_eq!(cells.boundary_nodes(&"base".into())?, [0, 1, 2]);
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Unstructured<const D: usize> {
    mesh: Mesh<D>,
    faces: Faces,
    /// Particles that share a cell with each.
    around: Rows,
    on_boundary: Vec<bool>,
    spacings: Vec<f64>,
    locator: Locator<D>,
}

impl<const D: usize> Unstructured<D> {
    /// Four points of a cell in space that have its moments of second order, by a rule in its bricks.
    fn by_moments(&self, cell: usize, rule: &LineRule) -> Vec<(Point<D>, f64)> {
        let (mut inertia, mut points) = (Inertia::default(), Vec::with_capacity(4));
        for corner in 0..self.mesh.cell(cell).1.len() {
            for (at, weight) in interior_rule(&Shape::Straight(self.brick(cell, corner)), rule) {
                inertia.add_point(&padded(&at), weight);
            }
        }
        inertia.in_body(|at, weight| points.push((point_of(|i| at[i]), weight)));
        points
    }

    /// The brick at a corner of a cell: its corners along three edges, axis 0 running fastest.
    fn brick(&self, cell: usize, corner: usize) -> [Point<D>; 8] {
        let (shape, corners) = self.mesh.cell(cell);
        let x = |k: usize| self.mesh.points()[corners[k] as usize];
        let around = shape.neighbours()[corner];
        let mut brick = [Point::zeros(); 8];
        for (place, out) in brick.iter_mut().enumerate().take(1 << D) {
            *out = match place.count_ones() as usize {
                0 => x(corner),
                1 => (x(corner) + x(around[place.trailing_zeros() as usize])) * 0.5,
                n if n == D => (0..corners.len()).map(x).sum::<Point<D>>() / corners.len() as f64,
                _ => {
                    // The face between two of the edges of a cell in space.
                    let lacks = (0..D).find(|k| (place >> k) & 1 == 0).unwrap_or(0);
                    let face = shape.faces()[opposite(shape, corner, lacks)];
                    face.iter().map(|&k| x(k)).sum::<Point<D>>() / face.len() as f64
                }
            };
        }
        brick
    }

    /// Number of the facet of a brick at the lower end of an axis, which lies on a face of its cell, and whether it was
    /// stored outward of this cell.
    fn outer_facet(&self, cell: usize, corner: usize, axis: usize) -> (usize, bool) {
        let (shape, corners) = self.mesh.cell(cell);
        let face = self.faces.of(cell, opposite(shape, corner, axis));
        (self.faces.facet(face, corners[corner]), self.faces.beside(face)[0] as usize == cell)
    }
}

impl<const D: usize> Unstructured<D> {
    /// Particles at the nodes of a mesh.
    ///
    /// # Errors
    /// Where faces are shared by more than two cells, or two nodes are at one place.
    pub fn new(mesh: &Mesh<D>) -> Result<Self, Error> {
        let faces = Faces::new(mesh)?;
        let around = Rows::sharing(mesh.points().len(), &list_of(mesh.cell_count(), |cell| mesh.cell(cell).1));
        let mut on_boundary = vec![false; mesh.points().len()];
        for face in faces.boundary() {
            for &node in faces.corners(face) {
                on_boundary[node as usize] = true;
            }
        }
        let mut edges = Vec::new();
        for cell in 0..mesh.cell_count() {
            let (shape, corners) = mesh.cell(cell);
            for edge in shape.edges() {
                edges.push(edge.each(|k| corners[k]));
            }
        }
        let edges = Rows::sharing(mesh.points().len(), &edges.mapped(|edge| &edge[..]));
        let spacings = smoothed_spacings(mesh.points(), &edges);
        let cells =
            Unstructured { mesh: mesh.clone(), faces, around, on_boundary, spacings, locator: Locator::default() };
        // Torn meshes have nodes at one place.
        if let Err(error) = cells.particles(1.0) {
            let ApproximationError::Particle { particle, .. } = error else { return Err(error.into()) };
            let x = mesh.points()[particle];
            let distance = |k: &usize| (mesh.points()[*k] - x).norm_squared();
            let others = (0..mesh.points().len()).filter(|k| *k != particle);
            let other = others.min_by(|a, b| distance(a).total_cmp(&distance(b))).ok_or(error)?;
            let nodes = [other.min(particle), other.max(particle)];
            return Err(MeshError::CoincidentNodes { nodes, at: x.as_slice().to_vec() }.into());
        }
        Ok(cells)
    }

    /// The facets of the pieces of a part; on curved ones with trace functions that combine to the normal where it `bends`.
    fn traces(
        &self,
        part: &Part,
        [parts, gauss]: [usize; 2],
        bends: bool,
    ) -> Result<Vec<BoundaryCells<D>>, GeometryError> {
        // The facets of a face are one at each corner; more parts are pieces of these.
        let pieces = parts.div_ceil(2);
        if parts != 2 * pieces {
            check_halves(parts, HALVES)?;
        }
        check_point_count(self.faces.facet_count(), pieces.saturating_mul(gauss).saturating_pow(D as u32 - 1))?;
        let rule = in_pieces(&gauss_legendre(gauss)?, pieces);
        Ok(self.faces.pieces_of(part)?.mapped(|piece| {
            let plain = self.facets(piece, &rule);
            if bends { plain.bent(Some(&piece.lent)) } else { plain }
        }))
    }
}

/// Mean distances to the neighbours, averaged over them: supports of unequal size beside each other cost accuracy.
pub(super) fn smoothed_spacings<const D: usize>(positions: &[Point<D>], neighbours: &Rows) -> Vec<f64> {
    let mean = |particle: usize, value: &dyn Fn(u32) -> f64| {
        let row = neighbours.row(particle);
        row.summed(|&other| value(other)) / row.len() as f64
    };
    let distances: Vec<f64> = list_of(positions.len(), |particle| {
        mean(particle, &|other| (positions[other as usize] - positions[particle]).norm())
    });
    list_of(positions.len(), |particle| {
        0.5 * (distances[particle] + mean(particle, &|other| distances[other as usize]))
    })
}

/// What numbers of sub-cells meshes have.
const HALVES: &str =
    "cells of a mesh are taken whole or cut at their corners, which counts as 2 parts: take a basis of order 1";

impl<const D: usize> Cells<D> for Unstructured<D> {
    fn positions(&self) -> &[Point<D>] {
        self.mesh.points()
    }

    fn cell_count(&self) -> usize {
        self.mesh.cell_count()
    }

    fn corners(&self, cell: usize) -> Vec<usize> {
        self.mesh.lattice_corners(cell)
    }

    fn local_spacing(&self, particle: usize) -> f64 {
        self.spacings.get(particle).copied().unwrap_or(f64::NAN)
    }

    fn zones(&self, size: usize) -> Zones {
        let cells: Vec<&[u32]> = list_of(self.cell_count(), |cell| self.mesh.cell(cell).1);
        let beside = |cell: usize| {
            let mut sides = Vec::new();
            for side in 0..self.mesh.cell(cell).0.faces().len() {
                let face = self.faces.of(cell, side);
                for other in self.faces.beside(face) {
                    if other != faces::NONE && other as usize != cell {
                        sides.push((other, self.faces.measure(self.mesh.points(), face)));
                    }
                }
            }
            sides
        };
        stars(&cells, &self.around, &self.on_boundary, size, &beside)
    }

    fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<D>, GeometryError> {
        gauss_legendre(n)?;
        // Two per direction measure a brick exactly.
        let each = n.div_ceil(2).max(2);
        let rule = gauss_legendre(each)?;
        check_point_count(self.cell_count().saturating_mul(8), each.pow(D as u32))?;
        zones.points(self.cell_count(), |cell, points| {
            for corner in 0..self.mesh.cell(cell).1.len() {
                interior_rule(&Shape::Straight(self.brick(cell, corner)), &rule)
                    .into_iter()
                    .for_each(|(position, weight)| points.push(position, weight));
            }
        })
    }

    fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<D>, GeometryError> {
        zones.validate(self.cell_count())?;
        check_halves(parts, HALVES)?;
        let rule = gauss_legendre(gauss)?;
        let points_per_facet = gauss.pow(D as u32 - 1);
        let mut interiors = Vec::with_capacity(self.cell_count());
        let mut facets = self.faces.facet_count();
        if parts == 2 {
            for cell in 0..self.cell_count() {
                interiors.push(facets);
                facets += self.mesh.cell(cell).0.edges().len();
            }
        }
        check_point_count(facets, points_per_facet)?;
        let mut smoothing = Smoothing {
            facet_points: vec![Point::zeros(); facets * points_per_facet],
            facet_areas: vec![Point::zeros(); facets * points_per_facet],
            facet_offsets: Smoothing::<D>::even_offsets(facets, points_per_facet),
            ..Smoothing::empty()
        };
        let ends: [[Vec<(Point<D>, f64)>; 2]; D] =
            std::array::from_fn(|axis| [0.0, 1.0].map(|end| side_points(axis, end, &rule)));
        let [two, three] = [gauss_legendre(2)?, gauss_legendre(3)?];
        for zone in zones.each() {
            for &cell in zone {
                let cell = cell as usize;
                let (shape, corners) = self.mesh.cell(cell);
                let mut whole = Vec::new();
                let mut inside = Vec::new();
                for corner in 0..corners.len() {
                    let brick = self.brick(cell, corner);
                    let mut store = |facet: usize, axis: usize, upper: usize, sign: f64| {
                        for (place, (at, weight)) in ends[axis][upper].iter().enumerate() {
                            let (position, columns) = multilinear(&brick, at);
                            smoothing.facet_points[facet * points_per_facet + place] = position;
                            smoothing.facet_areas[facet * points_per_facet + place] =
                                area_vector(axis, &columns) * (weight * sign);
                        }
                    };
                    let mut own = Vec::with_capacity(2 * D);
                    for axis in 0..D {
                        let (facet, first) = self.outer_facet(cell, corner, axis);
                        // In a share of the zones the first cell beside a facet may lack.
                        if first || zones.is_share() {
                            store(facet, axis, 0, if first { -1.0 } else { 1.0 });
                        }
                        let entry = (facet as u32, if first { 1.0 } else { -1.0 });
                        own.push(entry);
                        whole.push(entry);
                        if parts == 2 {
                            let other = shape.neighbours()[corner][axis];
                            let ends = [corner.min(other), corner.max(other)];
                            let edge = shape.edges().iter().position(|edge| *edge == ends).unwrap_or(0);
                            let facet = interiors[cell] + edge;
                            if corner < other {
                                store(facet, axis, 1, 1.0);
                            }
                            own.push((facet as u32, if corner < other { 1.0 } else { -1.0 }));
                        }
                    }
                    // Hoops are averaged inside; in space there are none, and whole cells take the points of their moments.
                    let points = if D == 3 { Vec::new() } else { interior_rule(&Shape::Straight(brick), &two) };
                    if parts == 2 {
                        smoothing.cells.push(own);
                        smoothing.centres.push(multilinear(&brick, &Point::repeat(0.5)).0);
                        smoothing.interior.push(points);
                    } else {
                        inside.extend(points);
                    }
                }
                if parts == 1 {
                    smoothing.cells.push(whole);
                    let sum: Point<D> = corners.iter().map(|&node| self.mesh.points()[node as usize]).sum();
                    smoothing.centres.push(sum / corners.len() as f64);
                    smoothing.interior.push(if D == 3 { self.by_moments(cell, &three) } else { inside });
                }
            }
            smoothing.groups.push(smoothing.cells.len());
        }
        Ok(smoothing)
    }

    fn nodal_cells(&self, gauss: usize) -> Result<Smoothing<D>, GeometryError> {
        let bricks = self.smoothing(2, gauss, &Zones::single(self.cell_count()))?;
        let mut owners = Vec::with_capacity(bricks.cells.len());
        for cell in 0..self.cell_count() {
            owners.extend_from_slice(self.mesh.cell(cell).1);
        }
        Ok(bricks.merged(&owners, self.positions()))
    }

    fn boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<D>, GeometryError> {
        Ok(BoundaryCells::joined(self.boundary_pieces(part, parts, gauss)?))
    }

    fn boundary_pieces(&self, part: &Part, parts: usize, gauss: usize) -> Result<Vec<BoundaryCells<D>>, GeometryError> {
        self.traces(part, [parts, gauss], true)
    }

    fn contact_boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<D>, GeometryError> {
        Ok(BoundaryCells::joined(self.traces(part, [parts, gauss], false)?))
    }

    fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        let mut nodes = Vec::new();
        for piece in self.faces.pieces_of(part)? {
            for &face in &piece.faces {
                for &node in self.faces.corners(face as usize) {
                    nodes.push(node as usize);
                }
            }
        }
        nodes.sort_unstable();
        nodes.dedup();
        Ok(nodes)
    }

    fn contains(&self, at: &Point<D>) -> bool {
        self.within(at, inside::SLACK)
    }

    fn encloses(&self, at: &Point<D>) -> bool {
        self.within(at, EDGE)
    }
}

impl<const D: usize> Unstructured<D> {
    fn within(&self, at: &Point<D>, slack: f64) -> bool {
        let around = |cell| inside::around(&self.mesh, cell);
        self.locator.any(self.mesh.cell_count(), at, around, |cell| inside::holds(&self.mesh, cell, at, slack))
    }
}
