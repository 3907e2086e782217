//! Cells of scattered particles: Voronoi cells clipped by the boundary.

use crate::error::{ApproximationError, GeometryError};
use crate::geometry::{Part, Point, Region};
use crate::particles::Particles;
use crate::quadrature::{Points, check_point_count, gauss_legendre};

use super::mesh::{Mesh, NONE, circumcentre, collapse, cross};
use super::polygons::Polygons;
use super::{BoundaryCells, Cells, Scatter, Smoothing, Triangulation, Zones};

/// Where a vertex is pulled into its triangle, its barycentric coordinates are at least this: fans keep an area.
const INSIDE: f64 = 0.05;

/// Particles in a planar region and their Voronoi cells, clipped by the boundary.
///
/// With one `part` the cell is its own sub-cell: stabilised conforming nodal integration; with two it is
/// cut into the fan of triangles between the particle and the sides of its cell. Zones are clusters
/// of cells around inner particles two edges apart. Where a boundary chord is shorter than the triangle on it is wide (given
/// particles close to the boundary), the Voronoi vertex would lie outside and is pulled back into its triangle.
///
/// ```
/// use rkpm::cells::{Cells, Scatter, Triangulation, Voronoi};
/// use rkpm::geometry::{Outline, Region};
/// let circle = Region::new(Outline::circle("rim", [0.0, 0.0], 1.0))?;
/// let cells = Voronoi::new(Triangulation::scattered(&circle, |_| 0.2, &Scatter::default())?);
/// let volumes = cells.nodal_cells(2)?.volumes();
/// assert_eq!(volumes.len(), cells.positions().len());
/// assert!((volumes.iter().sum::<f64>() - std::f64::consts::PI).abs() < 0.05);
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Voronoi {
    triangles: Triangulation,
}

impl Voronoi {
    /// The Voronoi cells of a triangulation's particles.
    pub fn new(triangles: Triangulation) -> Self {
        Voronoi { triangles }
    }

    /// Scatters particles as [`Triangulation::scattered`].
    ///
    /// # Errors
    /// As there.
    pub fn scattered(
        region: &Region,
        spacing: impl Fn(&Point<2>) -> f64,
        settings: &Scatter,
    ) -> Result<Self, GeometryError> {
        Ok(Voronoi::new(Triangulation::scattered(region, spacing, settings)?))
    }

    /// The dual triangles.
    pub fn triangles(&self) -> &Triangulation {
        &self.triangles
    }
}

/// The Voronoi vertex of each triangle: its circumcentre, pulled inside where a fan would fold over.
fn vertices(mesh: &Mesh) -> Vec<Point<2>> {
    let mut vertices: Vec<Point<2>> = (0..mesh.triangles.len()).map(|t| circumcentre(mesh.corners(t))).collect();
    let mut pulled = vec![false; vertices.len()];
    // Each round pulls at least one triangle; few are ever pulled.
    loop {
        let mut folded = Vec::new();
        for ((edge, &[first, second]), bulge) in mesh.edges.iter().zip(&mesh.beside).zip(&mesh.bulges) {
            // The edge runs counter-clockwise in its first triangle.
            let (a, b) = (mesh.positions[edge[0] as usize], mesh.positions[edge[1] as usize]);
            let size = (b - a).norm_squared();
            let inner = vertices[first as usize];
            let outer = if second == NONE { (a + b) * 0.5 + bulge } else { vertices[second as usize] };
            // Half a fan on each side of the edge: from the vertex outside to the one inside.
            if cross(a, outer, inner) < -1e-12 * size || cross(b, inner, outer) < -1e-12 * size {
                folded.push(first);
                if second != NONE {
                    folded.push(second);
                }
            }
        }
        folded.retain(|t| !pulled[*t as usize]);
        if folded.is_empty() {
            return vertices;
        }
        for triangle in folded {
            let triangle = triangle as usize;
            pulled[triangle] = true;
            let [a, b, c] = mesh.corners(triangle);
            let area = cross(a, b, c);
            let centre = (a + b + c) / 3.0;
            let offset = vertices[triangle] - centre;
            // Along the way from the centroid (⅓, ⅓, ⅓) until a coordinate falls to INSIDE.
            let mut step: f64 = 1.0;
            for ((p, q), bulge) in [(a, b), (b, c), (c, a)].into_iter().zip(mesh.sides(triangle)) {
                let coordinate = cross(centre + offset, p, q) / area;
                // Sides that curve inward are as far away as others.
                let curved = cross((p + q) * 0.5 + bulge, p, q) / area;
                let inside = (INSIDE + curved.max(0.0)).min(0.3);
                if coordinate < inside {
                    step = step.min((1.0 / 3.0 - inside) / (1.0 / 3.0 - coordinate));
                }
            }
            vertices[triangle] = centre + offset * step;
        }
    }
}

/// Triangles around each particle in counter-clockwise order, from the boundary to the boundary where there is one.
fn ordered_stars(mesh: &Mesh) -> Vec<Vec<u32>> {
    let (offsets, stars) = mesh.stars();
    // The triangle beyond the edge that ends at (or starts from) a corner.
    let side = |triangle: u32, particle: u32| -> usize {
        mesh.triangles[triangle as usize].iter().position(|&p| p == particle).unwrap_or(0)
    };
    let across = |triangle: u32, edge: usize| -> u32 {
        let [a, b] = mesh.beside[mesh.triangle_edges[triangle as usize][edge] as usize];
        if a == triangle { b } else { a }
    };
    (0..mesh.positions.len())
        .map(|particle| {
            let star = &stars[offsets[particle]..offsets[particle + 1]];
            let own = |t: u32| side(t, particle as u32);
            // Clockwise to the boundary, or once around.
            let first = star.iter().copied().find(|&t| across(t, own(t)) == NONE).unwrap_or(star[0]);
            let mut ordered = vec![first];
            let mut triangle = first;
            loop {
                // Counter-clockwise: over the edge that comes into the particle.
                triangle = across(triangle, (own(triangle) + 2) % 3);
                if triangle == NONE || triangle == first || ordered.len() > star.len() {
                    break;
                }
                ordered.push(triangle);
            }
            ordered
        })
        .collect()
}

/// Vertices of all Voronoi cells: particles, middles of edges, Voronoi vertices.
fn vertex_list(mesh: &Mesh) -> (Vec<Point<2>>, u32, u32) {
    let mut list = mesh.positions.clone();
    let middles = list.len() as u32;
    // From the lower particle to the higher one, as everywhere.
    list.extend(
        mesh.edges
            .iter()
            .map(|&[a, b]| (mesh.positions[a.min(b) as usize] * 0.5) + (mesh.positions[a.max(b) as usize] * 0.5)),
    );
    let centres = list.len() as u32;
    list.extend(vertices(mesh));
    (list, middles, centres)
}

/// Lets both halves of curved edges follow their arcs.
fn bend(mesh: &Mesh, middles: u32, polygons: &mut Polygons) {
    for (edge, bulge) in mesh.curved() {
        let [a, b] = mesh.edges[edge];
        polygons.bend(&[a, middles + edge as u32, b], &bulge);
    }
}

/// The rim of a particle's cell without the particle, counter-clockwise, and whether it is closed.
fn rim(mesh: &Mesh, particle: usize, star: &[u32], middles: u32, centres: u32) -> (Vec<u32>, bool) {
    let own = |t: u32| mesh.triangles[t as usize].iter().position(|&p| p as usize == particle).unwrap_or(0);
    let (first, last) = (star[0], star[star.len() - 1]);
    let out = mesh.triangle_edges[first as usize][own(first)];
    let back = mesh.triangle_edges[last as usize][(own(last) + 2) % 3];
    let closed = out == back;
    let mut rim: Vec<u32> = Vec::with_capacity(star.len() + 2);
    if !closed {
        rim.push(middles + out);
    }
    rim.extend(star.iter().map(|t| centres + t));
    if !closed {
        rim.push(middles + back);
    }
    (rim, closed)
}

/// Whole Voronoi cells, one group each.
pub(crate) fn dual_polygons(mesh: &Mesh) -> Polygons {
    let (list, middles, centres) = vertex_list(mesh);
    let mut polygons = Polygons::new(list);
    bend(mesh, middles, &mut polygons);
    for (particle, star) in ordered_stars(mesh).iter().enumerate() {
        let (rim, closed) = rim(mesh, particle, star, middles, centres);
        if closed {
            polygons.push(rim);
        } else {
            polygons.push(std::iter::once(particle as u32).chain(rim));
        }
        polygons.close_group();
    }
    polygons
}

impl Cells<2> for Voronoi {
    fn positions(&self) -> &[Point<2>] {
        self.triangles.positions()
    }

    fn cell_count(&self) -> usize {
        self.triangles.positions().len()
    }

    fn corners(&self, cell: usize) -> Vec<usize> {
        vec![cell]
    }

    fn drawn(&self) -> Vec<Vec<usize>> {
        self.triangles.drawn()
    }

    fn local_spacing(&self, particle: usize) -> f64 {
        self.triangles.local_spacing(particle)
    }

    fn particles(&self, r: f64) -> Result<Particles<2>, ApproximationError> {
        self.triangles.particles(r)
    }

    fn particles_global(&self, r: f64) -> Result<Particles<2>, ApproximationError> {
        self.triangles.particles_global(r)
    }

    fn is_thin(&self) -> bool {
        self.triangles.is_thin()
    }

    fn zones(&self, size: usize) -> Zones {
        let mesh = &self.triangles.mesh;
        super::zones::particle_zones(mesh, size)
    }

    fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<2>, GeometryError> {
        zones.validate(self.positions().len())?;
        let rule = gauss_legendre(n)?;
        let fans = fans(&self.triangles.mesh, zones);
        let mut points = Points::empty();
        for group in fans.groups.windows(2) {
            for fan in group[0]..group[1] {
                let corners = &fans.corners[fans.offsets[fan]..fans.offsets[fan + 1]];
                let sides = [0, 1, 2].map(|k| fans.bulge(corners[k], corners[(k + 1) % 3]));
                collapse(&rule, &[0, 1, 2].map(|k| fans.vertices[corners[k] as usize]), &sides, &mut points);
            }
            points.close_group();
        }
        Ok(points)
    }

    fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<2>, GeometryError> {
        zones.validate(self.positions().len())?;
        check_point_count(self.cell_count().saturating_mul(2), parts.saturating_mul(parts).saturating_mul(gauss))?;
        let mesh = &self.triangles.mesh;
        match parts {
            1 => {
                let cells = dual_polygons(mesh);
                let mut grouped = Polygons { bulges: cells.bulges, ..Polygons::new(cells.vertices) };
                for zone in zones.offsets.windows(2) {
                    for &cell in &zones.cells[zone[0]..zone[1]] {
                        let range = cells.offsets[cell as usize]..cells.offsets[cell as usize + 1];
                        grouped.push(cells.corners[range].iter().copied());
                    }
                    grouped.close_group();
                }
                grouped.smoothing(gauss)
            }
            2 => fans(mesh, zones).smoothing(gauss),
            _ => {
                let needed = "1 (whole Voronoi cells) and 2 (their fans) are built; triangles have more";
                Err(GeometryError::Count { what: "sub-cells per direction", count: parts, needed })
            }
        }
    }

    fn nodal_cells(&self, gauss: usize) -> Result<Smoothing<2>, GeometryError> {
        self.triangles.nodal_cells(gauss)
    }

    fn boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<2>, GeometryError> {
        // Whole cells too end at the middles of chords.
        self.triangles.boundary(part, parts.max(2), gauss)
    }

    fn boundary_pieces(&self, part: &Part, parts: usize, gauss: usize) -> Result<Vec<BoundaryCells<2>>, GeometryError> {
        self.triangles.boundary_pieces(part, parts.max(2), gauss)
    }

    fn contact_boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<2>, GeometryError> {
        self.triangles.contact_boundary(part, parts.max(2), gauss)
    }

    fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        self.triangles.boundary_nodes(part)
    }

    fn contains(&self, at: &Point<2>) -> bool {
        self.triangles.contains(at)
    }
}

/// Triangles between each particle and the sides of its cell.
fn fans(mesh: &Mesh, zones: &Zones) -> Polygons {
    let (list, middles, centres) = vertex_list(mesh);
    let stars = ordered_stars(mesh);
    let mut polygons = Polygons::new(list);
    bend(mesh, middles, &mut polygons);
    // A side of no length (four particles on a circle) has no triangle.
    let shortest = |p: &Polygons, particle: u32, a: u32, b: u32| {
        let at = |v: u32| p.vertices[v as usize];
        cross(at(particle), at(a), at(b)) > 1e-12 * (at(a) - at(particle)).norm_squared()
    };
    for zone in zones.offsets.windows(2) {
        for &particle in &zones.cells[zone[0]..zone[1]] {
            let (mut rim, closed) = rim(mesh, particle as usize, &stars[particle as usize], middles, centres);
            if closed {
                rim.push(rim[0]);
            }
            for side in rim.windows(2) {
                if shortest(&polygons, particle, side[0], side[1]) {
                    polygons.push([particle, side[0], side[1]]);
                }
            }
        }
        polygons.close_group();
    }
    polygons
}
