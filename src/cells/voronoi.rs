//! Cells of scattered particles: Voronoi cells clipped by the boundary.

use crate::each::EachOf;
use crate::error::GeometryError;
use crate::geometry::{Part, Vec2};
use crate::quadrature::{Points, check_point_count, gauss_legendre};

use super::mesh::{Mesh, collapse, cross};
use super::nodal_polygons::{bend, dual_polygons, ordered_stars, rim, vertex_list};
use super::polygons::Polygons;
use super::{BoundaryCells, Cells, Smoothing, Triangulation, Zones};

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

    /// The dual triangles.
    pub fn triangles(&self) -> &Triangulation {
        &self.triangles
    }
}

impl Cells<2> for Voronoi {
    fn left_thin(&self) -> Option<&GeometryError> {
        self.triangles.left_thin()
    }

    fn positions(&self) -> &[Vec2] {
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
                let sides = [0, 1, 2].each(|k| fans.bulge(corners[k], corners[(k + 1) % 3]));
                collapse(&rule, &[0, 1, 2].each(|k| fans.vertices[corners[k] as usize]), &sides, &mut points);
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
            1 => dual_polygons(mesh, zones).smoothing(gauss),
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

    fn contains(&self, at: &Vec2) -> bool {
        self.triangles.contains(at)
    }

    fn encloses(&self, at: &Vec2) -> bool {
        self.triangles.encloses(at)
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
    for zone in zones.each() {
        for &particle in zone {
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
