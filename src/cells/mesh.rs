//! Constrained Delaunay triangulations of particles in planar regions.

use std::collections::{HashMap, HashSet};

use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};

use crate::each::{Each, EachOf, IntoEach};
use crate::error::GeometryError;
use crate::geometry::{Curve, Region, Vec2};
use crate::order;
use crate::quadrature::{LineRule, Points};
use crate::rows::Rows;

/// A piece of the boundary that was drawn in one go: particles along a line or an arc.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Piece {
    /// Index of the part's name.
    pub part: usize,
    /// Particles along the piece, the body on their left; a closed piece begins with its last one.
    pub particles: Vec<u32>,
    /// Whether its chords have different normals.
    pub curved: bool,
}

impl Piece {
    /// The particles that belong to the pieces beside it: both ends, unless it is closed.
    pub(super) fn lent(&self) -> HashSet<u32> {
        let [first, last] = [self.particles.first(), self.particles.last()];
        [first, last].into_iter().flatten().filter(|_| first != last).copied().collect()
    }
}

/// Particles in a region and the triangles between them.
///
/// Triangles are Delaunay, the chords between neighbouring particles on the boundary are edges.
#[derive(Debug, Clone)]
pub(crate) struct Mesh {
    pub positions: Vec<Vec2>,
    pub pieces: Vec<Piece>,
    /// Particles of each triangle, counter-clockwise.
    pub triangles: Vec<[u32; 3]>,
    /// Edges of each triangle: edge k from corner k to the next.
    pub triangle_edges: Vec<[u32; 3]>,
    /// Ends of each edge.
    pub edges: Vec<[u32; 2]>,
    /// Triangles beside each edge; on the boundary the second is `NONE`.
    pub beside: Vec<[u32; 2]>,
    /// How far the middle of each edge stands off its chord: on arcs, where a parabola follows them.
    pub bulges: Vec<Vec2>,
    /// Curved edges by their ends, the lower one first.
    curved: HashMap<[u32; 2], u32>,
}

/// No triangle beyond an edge.
pub(crate) const NONE: u32 = u32::MAX;

/// Particles closer than this part of the region's extent are at one place.
const ONE_PLACE: f64 = 1e-9;

impl Mesh {
    /// Triangulates particles with the given boundary pieces.
    pub(crate) fn new(positions: Vec<Vec2>, pieces: Vec<Piece>) -> Result<Self, GeometryError> {
        let refuse = |what, particle: usize, remedy| {
            let at = positions.get(particle).map(|x| x.as_slice().to_vec()).unwrap_or_default();
            Err(GeometryError::Shape { what, at, remedy })
        };
        let vertices = positions.mapped(|x| Point2::new(x[0], x[1]));
        let constraints: Vec<[usize; 2]> = pieces
            .iter()
            .flat_map(|piece| piece.particles.windows(2).map(|w| [w[0] as usize, w[1] as usize]))
            .collect();
        let mut conflict = None;
        let delaunay =
            ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(vertices, constraints.clone(), |edge| {
                conflict.get_or_insert(edge[0]);
            });
        let Ok(delaunay) = delaunay else {
            return refuse("particles could not be triangulated", 0, "give coordinates of ordinary size");
        };
        if delaunay.num_vertices() != positions.len() {
            return refuse("two particles are at one place", 0, "remove one of them");
        }
        if let Some(particle) = conflict {
            let remedy = "reduce the spacing: chords between particles on the boundary cross";
            return refuse("the spacing is too large for the shape", particle, remedy);
        }
        let inside = inside(&delaunay);
        let mut mesh = Mesh {
            positions: Vec::new(),
            pieces: Vec::new(),
            triangles: Vec::new(),
            triangle_edges: Vec::new(),
            edges: Vec::new(),
            beside: Vec::new(),
            bulges: Vec::new(),
            curved: HashMap::new(),
        };
        let mut number = vec![NONE; delaunay.num_undirected_edges()];
        for face in delaunay.inner_faces() {
            if !inside[face.fix().index()] {
                continue;
            }
            let triangle = mesh.triangles.len() as u32;
            let mut corners = [0; 3];
            let mut edges = [0; 3];
            for (k, edge) in face.adjacent_edges().into_iter().enumerate() {
                let vertex: FixedVertexHandle = edge.from().fix();
                corners[k] = vertex.index() as u32;
                let slot = &mut number[edge.as_undirected().fix().index()];
                if *slot == NONE {
                    *slot = mesh.edges.len() as u32;
                    mesh.edges.push([vertex.index() as u32, edge.to().fix().index() as u32]);
                    mesh.beside.push([triangle, NONE]);
                } else {
                    mesh.beside[*slot as usize][1] = triangle;
                }
                edges[k] = *slot;
            }
            mesh.triangles.push(corners);
            mesh.triangle_edges.push(edges);
        }
        if mesh.triangles.is_empty() {
            return refuse("there is no triangle between the particles", 0, "give particles that are not on one line");
        }
        let mut used = vec![false; positions.len()];
        for &particle in mesh.triangles.iter().flatten() {
            used[particle as usize] = true;
        }
        if let Some(particle) = used.iter().position(|u| !u) {
            return refuse("a particle lies outside of the region", particle, "give particles in the region");
        }
        mesh.bulges = vec![Vec2::zeros(); mesh.edges.len()];
        mesh.positions = positions;
        mesh.pieces = pieces;
        Ok(mesh)
    }

    /// Lets the edges on arcs follow them, where their triangles keep their orientation.
    pub(crate) fn bend(&mut self, region: &Region) {
        let outer = (0..self.edges.len()).filter(|&edge| self.beside[edge][1] == NONE);
        let known: HashMap<[u32; 2], usize> = outer.map(|edge| (sorted(self.edges[edge]), edge)).collect();
        let mut bulges = vec![Vec2::zeros(); self.edges.len()];
        // Pieces were made curve by curve.
        for (piece, (curve, _)) in self.pieces.iter().zip(region.loops.iter().flatten()) {
            for ends in piece.particles.windows(2).filter(|_| piece.curved) {
                let middle = (self.positions[ends[0] as usize] + self.positions[ends[1] as usize]) * 0.5;
                if let Some(&edge) = known.get(&sorted([ends[0], ends[1]])) {
                    bulges[edge] = curve.at(curve.nearest(&middle).0) - middle;
                }
            }
        }
        self.bulges = bulges;
        for triangle in 0..self.triangles.len() {
            let (corners, sides) = (self.corners(triangle), self.sides(triangle));
            let places = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];
            if places.iter().any(|&[s, t]| !(bent(&corners, &sides, s, t).1 > 0.0)) {
                for edge in self.triangle_edges[triangle] {
                    self.bulges[edge as usize] = Vec2::zeros();
                }
            }
        }
        self.curved = self.curved().map(|(edge, _)| (sorted(self.edges[edge]), edge as u32)).collect();
    }

    /// Whether any edge follows an arc.
    pub(crate) fn is_curved(&self) -> bool {
        !self.curved.is_empty()
    }

    /// How far the middle of the edge between two particles stands off its chord.
    pub(crate) fn bulge(&self, a: u32, b: u32) -> Vec2 {
        self.curved.get(&sorted([a, b])).map_or_else(Vec2::zeros, |&edge| self.bulges[edge as usize])
    }

    /// Curved edges and their bulges.
    pub(crate) fn curved(&self) -> impl Iterator<Item = (usize, Vec2)> {
        self.bulges.iter().copied().enumerate().filter(|(_, bulge)| *bulge != Vec2::zeros())
    }

    /// Bulges of a triangle's sides, side k from corner k to the next.
    pub(crate) fn sides(&self, triangle: usize) -> [Vec2; 3] {
        self.triangle_edges[triangle].each(|edge| self.bulges[edge as usize])
    }

    /// Given particles in a region: those on its lines and arcs become the boundary.
    pub(crate) fn of_particles(region: &Region, positions: &[Vec2]) -> Result<Self, GeometryError> {
        let refuse = |what, at: &Vec2, remedy| Err(GeometryError::Shape { what, at: at.as_slice().to_vec(), remedy });
        // Coordinates written with nine digits still lie on the boundary.
        let near = 1e-8 * region.extent();
        if let Some(at) = positions.iter().find(|x| !x.iter().all(|v| v.is_finite())) {
            return refuse("a particle is not finite", at, "give finite coordinates");
        }
        if let Some([a, b]) = close_pair(positions, ONE_PLACE * region.extent()) {
            debug_assert!(a != b);
            return refuse("two particles are at one place", &positions[a], "remove one of them");
        }
        let mut pieces = Vec::new();
        let mut on_boundary = vec![false; positions.len()];
        for curves in &region.loops {
            for (curve, part) in curves {
                let mut along: Vec<(f64, u32)> = Vec::new();
                for (particle, x) in positions.iter().enumerate() {
                    let (t, distance) = curve.nearest(x);
                    if distance <= near {
                        along.push((t, particle as u32));
                        on_boundary[particle] = true;
                    }
                }
                let closed = curve.at(0.0) == curve.at(1.0);
                order::sort(&mut along, &|a, b| a.0.total_cmp(&b.0));
                let ends = [along.first(), along.last()];
                for (end, t) in ends.iter().zip([0.0, 1.0]) {
                    let corner = curve.at(t);
                    let there = end.is_some_and(|&(_, p)| (positions[p as usize] - corner).norm() <= near);
                    if !there && !closed {
                        return refuse("no particle is at this corner of the outline", &corner, "add one there");
                    }
                }
                let mut particles: Vec<u32> = along.mapped(|a| a.1);
                if closed {
                    if particles.len() < 3 {
                        let remedy = "put at least three particles on the circle";
                        return refuse("too few particles are on a circle", &curve.at(0.0), remedy);
                    }
                    particles.push(particles[0]);
                }
                pieces.push(Piece { part: *part, particles, curved: matches!(curve, Curve::Arc { .. }) });
            }
        }
        for (particle, x) in positions.iter().enumerate() {
            if !on_boundary[particle] && !region.contains(x) {
                return refuse(
                    "a particle lies outside of the region",
                    x,
                    "give particles in the region or on its boundary",
                );
            }
        }
        let curves = region.loops.iter().flatten();
        for (piece, (curve, _)) in pieces.iter().zip(curves) {
            for chord in piece.particles.windows(2).filter(|_| piece.curved) {
                let ends = [&positions[chord[0] as usize], &positions[chord[1] as usize]];
                let beyond = |p: &usize| !on_boundary[*p] && curve.beyond_chord(ends, &positions[*p]);
                if let Some(particle) = (0..positions.len()).find(beyond) {
                    return refuse(
                        "a particle lies between an arc and the chord of two particles on it",
                        &positions[particle],
                        "add particles on the arc there, or move this one inwards",
                    );
                }
            }
        }
        Mesh::new(positions.to_vec(), pieces)
    }

    /// Neighbours of each particle.
    pub(crate) fn neighbours(&self) -> Rows {
        Rows::new(self.positions.len(), &|add| {
            for &[a, b] in &self.edges {
                add(a as usize, b);
                add(b as usize, a);
            }
        })
    }

    /// Triangles around each particle.
    pub(crate) fn stars(&self) -> Rows {
        Rows::new(self.positions.len(), &|add| {
            for (triangle, corners) in self.triangles.iter().enumerate() {
                corners.iter().for_each(|&corner| add(corner as usize, triangle as u32));
            }
        })
    }

    /// Whether each particle is on the boundary.
    pub(crate) fn on_boundary(&self) -> Vec<bool> {
        let mut on = vec![false; self.positions.len()];
        for (edge, beside) in self.edges.iter().zip(&self.beside) {
            if beside[1] == NONE {
                on[edge[0] as usize] = true;
                on[edge[1] as usize] = true;
            }
        }
        on
    }

    /// Which corner of a triangle a particle is.
    pub(crate) fn corner_at(&self, triangle: u32, particle: usize) -> usize {
        self.triangles[triangle as usize].iter().position(|&p| p as usize == particle).unwrap_or(0)
    }

    /// Corners of a triangle.
    pub(crate) fn corners(&self, triangle: usize) -> [Vec2; 3] {
        self.triangles[triangle].each(|p| self.positions[p as usize])
    }
}

/// A pair of points closer than `distance`.
fn close_pair(positions: &[Vec2], distance: f64) -> Option<[usize; 2]> {
    let mut order: Vec<usize> = (0..positions.len()).collect();
    order::sort(&mut order, &|&a, &b| positions[a][0].total_cmp(&positions[b][0]));
    for (i, &a) in order.iter().enumerate() {
        for &b in order[i + 1..].iter().take_while(|&&b| positions[b][0] - positions[a][0] <= distance) {
            if (positions[a] - positions[b]).norm() <= distance {
                return Some([a, b]);
            }
        }
    }
    None
}

/// The ends of an edge, the lower one first.
fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Twice the signed area of a triangle.
pub(crate) fn cross(a: Vec2, b: Vec2, c: Vec2) -> f64 {
    (b - a).perp(&(c - a))
}

/// Position and Jacobian of a triangle whose sides are parabolas, `s` of the way to corner 1 and `t` to corner 2.
pub(crate) fn bent([a, b, c]: &[Vec2; 3], bulges: &[Vec2; 3], s: f64, t: f64) -> (Vec2, f64) {
    let r = 1.0 - s - t;
    let position = a * r + b * s + c * t + (bulges[0] * (r * s) + bulges[1] * (s * t) + bulges[2] * (t * r)) * 4.0;
    let along_s = b - a + (bulges[0] * (r - s) + bulges[1] * t - bulges[2] * t) * 4.0;
    let along_t = c - a + (bulges[2] * (r - t) + bulges[1] * s - bulges[0] * s) * 4.0;
    (position, along_s.perp(&along_t))
}

/// A point on a parabola at $t \in \[0,1\]$ from one end to the other, and its derivative.
pub(crate) fn parabola(from: &Vec2, to: &Vec2, bulge: &Vec2, t: f64) -> (Vec2, Vec2) {
    (from * (1.0 - t) + to * t + bulge * (4.0 * t * (1.0 - t)), to - from + bulge * (4.0 - 8.0 * t))
}

/// Three points of a triangle and their weights, exact to degree 2. They lie inside: points on its sides would lose their
/// measure on an axis of revolution, and what is left would not tell linear fields apart.
pub(crate) fn three_points([a, b, c]: [Vec2; 3], area: f64) -> [(Vec2, f64); 3] {
    let third = (a + b + c) / 6.0;
    [a, b, c].each(|corner| (third + corner * 0.5, area / 3.0))
}

/// Adds the Gauss points of the square collapsed onto a triangle, exact to degree $2n - 2$ for a rule of $n$ points.
pub(crate) fn collapse(rule: &LineRule, corners: &[Vec2; 3], bulges: &[Vec2; 3], points: &mut Points<2>) {
    for (s, ws) in rule.0.iter().zip(&rule.1) {
        for (t, wt) in rule.0.iter().zip(&rule.1) {
            let (position, jacobian) = bent(corners, bulges, (1.0 - t) * s, t * s);
            points.push(position, jacobian * ws * wt * s);
        }
    }
}

/// The centre of the circle through the corners.
pub(crate) fn circumcentre([a, b, c]: [Vec2; 3]) -> Vec2 {
    let (u, v) = (b - a, c - a);
    let (uu, vv) = (u.norm_squared(), v.norm_squared());
    let twice = 2.0 * u.perp(&v);
    a + Vec2::new(v[1] * uu - u[1] * vv, u[0] * vv - v[0] * uu) / twice
}
/// Which faces lie in the region.
fn inside(delaunay: &ConstrainedDelaunayTriangulation<Point2<f64>>) -> Vec<bool> {
    // Flood from outside: crossing the boundary turns outside into inside and back.
    let mut inside: Vec<Option<bool>> = vec![None; delaunay.num_all_faces()];
    let mut stack = Vec::new();
    for edge in delaunay.convex_hull() {
        let face = edge.rev().face();
        if inside[face.fix().index()].is_none() {
            inside[face.fix().index()] = Some(edge.is_constraint_edge());
            stack.push(face);
        }
    }
    while let Some(face) = stack.pop() {
        let Some(triangle) = face.as_inner() else { continue };
        let here = inside[face.fix().index()] == Some(true);
        for edge in triangle.adjacent_edges() {
            let other = edge.rev().face();
            if !other.is_outer() && inside[other.fix().index()].is_none() {
                inside[other.fix().index()] = Some(here != edge.is_constraint_edge());
                stack.push(other);
            }
        }
    }
    inside.into_mapped(|inside| inside == Some(true))
}
