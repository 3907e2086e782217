//! Voronoi cells of a mesh as polygons.

use crate::each::list_of;
use crate::geometry::Vec2;

use super::Zones;
use super::mesh::{Mesh, NONE, circumcentre, cross};
use super::polygons::Polygons;

/// Where a vertex is pulled into its triangle, its barycentric coordinates are at least this: fans keep an area.
const INSIDE: f64 = 0.05;

/// The Voronoi vertex of each triangle: its circumcentre, pulled inside where a fan would fold over.
fn vertices(mesh: &Mesh) -> Vec<Vec2> {
    let mut vertices: Vec<Vec2> = list_of(mesh.triangles.len(), |t| circumcentre(mesh.corners(t)));
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
pub(super) fn ordered_stars(mesh: &Mesh) -> Vec<Vec<u32>> {
    let stars = mesh.stars();
    // The triangle beyond the edge that ends at (or starts from) a corner.
    let across = |triangle: u32, edge: usize| -> u32 {
        let [a, b] = mesh.beside[mesh.triangle_edges[triangle as usize][edge] as usize];
        if a == triangle { b } else { a }
    };
    list_of(mesh.positions.len(), |particle| {
        let star = stars.row(particle);
        let own = |t: u32| mesh.corner_at(t, particle);
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
}

/// Vertices of all Voronoi cells: particles, middles of edges, Voronoi vertices.
pub(super) fn vertex_list(mesh: &Mesh) -> (Vec<Vec2>, u32, u32) {
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
pub(super) fn bend(mesh: &Mesh, middles: u32, polygons: &mut Polygons) {
    for (edge, bulge) in mesh.curved() {
        let [a, b] = mesh.edges[edge];
        polygons.bend(&[a, middles + edge as u32, b], &bulge);
    }
}

/// The rim of a particle's cell without the particle, counter-clockwise, and whether it is closed.
pub(super) fn rim(mesh: &Mesh, particle: usize, star: &[u32], middles: u32, centres: u32) -> (Vec<u32>, bool) {
    let own = |t: u32| mesh.corner_at(t, particle);
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

/// Whole Voronoi cells, grouped by zone.
pub(crate) fn dual_polygons(mesh: &Mesh, zones: &Zones) -> Polygons {
    let (list, middles, centres) = vertex_list(mesh);
    let mut polygons = Polygons::new(list);
    bend(mesh, middles, &mut polygons);
    let stars = ordered_stars(mesh);
    for zone in zones.each() {
        for &particle in zone {
            let (rim, closed) = rim(mesh, particle as usize, &stars[particle as usize], middles, centres);
            polygons.push(Some(particle).filter(|_| !closed).into_iter().chain(rim));
        }
        polygons.close_group();
    }
    polygons
}
