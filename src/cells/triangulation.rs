//! Cells of scattered particles: triangles.

use crate::each::{Each, EachOf};
use crate::error::GeometryError;
use crate::geometry::{Bounds, Part, Region, Vec2};
use crate::quadrature::{Points, check_parts, check_point_count, gauss_legendre};

use super::edges::facets;
use super::locator::Locator;
use super::mesh::{Mesh, collapse, cross};
use super::nodal_polygons::dual_polygons;
use super::polygons::Polygons;
use super::scatter::{Spacing, factor_for, scatter};
use super::unstructured::smoothed_spacings;
use super::{BoundaryCells, Cells, EDGE, Scatter, Smoothing, Zones};

/// How far outside its triangle a point may lie, as a part of its height: chords cut arcs.
const SLACK: f64 = 0.1;

/// Particles in a planar region and the triangles between them: a constrained Delaunay triangulation.
///
/// Sub-cells are the `parts`² congruent triangles of each triangle; sides on arcs are parabolas. Zones are the triangles around inner particles
/// two edges apart. Supports are balls.
///
/// ```
/// use rkpm::cells::{Cells, Scatter, Triangulation};
/// use rkpm::geometry::{Outline, Region};
/// let square = Outline::at([0.0, 0.0])
///     .line("bottom", [1.0, 0.0]).line("right", [1.0, 1.0]).line("top", [0.0, 1.0]).close("left");
/// let plate = Region::with_holes(square, [Outline::circle("hole", [0.5, 0.5], 0.2)])?;
/// let cells = Triangulation::scattered(&plate, |_| 0.1, &Scatter::default())?;
/// let area: f64 = cells.gauss(2)?.weights.iter().sum();
/// assert!((area / plate.area() - 1.0).abs() < 0.01);
/// assert!(cells.boundary_nodes(&"hole".into())?.len() > 8);
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Triangulation {
    pub(crate) mesh: Mesh,
    names: Vec<String>,
    spacings: Vec<f64>,
    locator: Locator<2>,
    /// Walls that are left with too few spacings across.
    pub(super) left: Option<GeometryError>,
}

impl Triangulation {
    /// Scatters particles over a region with a local spacing \[length\].
    ///
    /// # Errors
    /// For spacings that are not positive or larger than the shape.
    pub fn scattered(
        region: &Region,
        spacing: impl Fn(&Vec2) -> f64,
        settings: &Scatter,
    ) -> Result<Self, GeometryError> {
        Ok(Triangulation::over(scatter(region, &Spacing::of(&spacing, 1.0), settings)?, region))
    }

    /// Scatters about `count` particles over a region, their spacing in proportion to a function.
    ///
    /// # Errors
    /// As [`scattered`](Triangulation::scattered).
    pub fn about(
        region: &Region,
        count: usize,
        spacing: impl Fn(&Vec2) -> f64,
        settings: &Scatter,
    ) -> Result<Self, GeometryError> {
        let mut factor = factor_for(region, &spacing, count)?;
        let mut mesh = scatter(region, &Spacing::of(&spacing, factor), settings)?;
        // The estimate knows neither corners nor the least number of particles on a line: correct it once.
        let ratio = mesh.positions.len() as f64 / count as f64;
        if (ratio - 1.0).abs() > 0.02 {
            factor *= ratio.sqrt();
            if let Ok(better) = scatter(region, &Spacing::of(&spacing, factor), settings) {
                let miss = |mesh: &Mesh| mesh.positions.len().abs_diff(count);
                if miss(&better) < miss(&mesh) {
                    mesh = better;
                }
            }
        }
        Ok(Triangulation::over(mesh, region))
    }

    /// Given particles; those on lines and arcs of the region become its boundary, those in corners are needed.
    ///
    /// # Errors
    /// Where two particles are at one place, one is outside, a corner has none, or all are on one line.
    pub fn of_particles(region: &Region, positions: &[Vec2]) -> Result<Self, GeometryError> {
        Ok(Triangulation::over(Mesh::of_particles(region, positions)?, region))
    }

    fn over(mut mesh: Mesh, region: &Region) -> Self {
        mesh.bend(region);
        let spacings = smoothed_spacings(&mesh.positions, &mesh.neighbours());
        Triangulation { mesh, names: region.names.clone(), spacings, locator: Locator::default(), left: None }
    }

    /// Pieces of a part, or of the whole boundary.
    fn pieces(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        let all = 0..self.mesh.pieces.len();
        let found: Vec<usize> = match part {
            Part::Whole => all.collect(),
            Part::Named(name) => all.filter(|&k| self.names[self.mesh.pieces[k].part] == *name).collect(),
            _ => Vec::new(),
        };
        ensure!(!found.is_empty(), part.unknown(&self.names.mapped(String::as_str), ""));
        Ok(found)
    }

    /// Polygons of the sub-cells of each triangle.
    fn polygons(&self, parts: usize, zones: &Zones) -> Polygons {
        let mesh = &self.mesh;
        let particles = mesh.positions.len() as u32;
        let mut polygons = Polygons::new(mesh.positions.clone());
        let inner = parts as u32 - 1;
        // `parts` − 1 vertices on each edge, from its lower particle to its higher one.
        for &[a, b] in &mesh.edges {
            let (low, high) = (mesh.positions[a.min(b) as usize], mesh.positions[a.max(b) as usize]);
            for k in 1..parts {
                let t = k as f64 / parts as f64;
                polygons.vertices.push(low * (1.0 - t) + high * t);
            }
        }
        for (edge, bulge) in mesh.curved() {
            let [a, b] = mesh.edges[edge];
            let first = particles + edge as u32 * inner;
            let chain: Vec<u32> = [a.min(b)].into_iter().chain(first..first + inner).chain([a.max(b)]).collect();
            polygons.bend(&chain, &bulge);
        }
        // Vertex k of `parts` along edge `side` of a triangle, seen from its own start.
        let along = |triangle: usize, side: usize, k: u32| -> u32 {
            let corners = mesh.triangles[triangle];
            let (a, b) = (corners[side], corners[(side + 1) % 3]);
            if k == 0 {
                a
            } else if k == parts as u32 {
                b
            } else {
                let k = if a < b { k } else { parts as u32 - k };
                particles + mesh.triangle_edges[triangle][side] * inner + k - 1
            }
        };
        for zone in zones.each() {
            for &triangle in zone {
                let triangle = triangle as usize;
                // Rows of vertices from the first edge to the opposite corner.
                let [a, b, c] = mesh.corners(triangle);
                let n = parts as u32;
                let mut vertex = |i: u32, j: u32| -> u32 {
                    // i steps towards corner 1, j towards corner 2.
                    if j == 0 {
                        along(triangle, 0, i)
                    } else if i == 0 {
                        along(triangle, 2, n - j)
                    } else if i + j == n {
                        along(triangle, 1, j)
                    } else {
                        let (s, t) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                        polygons.vertices.push(a * (1.0 - s - t) + b * s + c * t);
                        polygons.vertices.len() as u32 - 1
                    }
                };
                let rows: Vec<Vec<u32>> = (0..=n).map(|j| (0..=n - j).map(|i| vertex(i, j)).collect()).collect();
                for j in 0..parts {
                    for i in 0..parts - j {
                        polygons.push([rows[j][i], rows[j][i + 1], rows[j + 1][i]]);
                        if i + 1 < parts - j {
                            polygons.push([rows[j][i + 1], rows[j + 1][i + 1], rows[j + 1][i]]);
                        }
                    }
                }
            }
            polygons.close_group();
        }
        polygons
    }
}

impl Cells<2> for Triangulation {
    fn left_thin(&self) -> Option<&GeometryError> {
        self.left.as_ref()
    }

    fn positions(&self) -> &[Vec2] {
        &self.mesh.positions
    }

    fn cell_count(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn corners(&self, cell: usize) -> Vec<usize> {
        self.mesh.triangles[cell].each(|p| p as usize).to_vec()
    }

    fn local_spacing(&self, particle: usize) -> f64 {
        self.spacings.get(particle).copied().unwrap_or(f64::NAN)
    }

    fn is_thin(&self) -> bool {
        self.mesh.on_boundary().iter().all(|b| *b)
    }

    fn zones(&self, size: usize) -> Zones {
        super::zones::zones(&self.mesh, size)
    }

    fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<2>, GeometryError> {
        let rule = gauss_legendre(n)?;
        zones.points(self.cell_count(), |triangle, points| {
            collapse(&rule, &self.mesh.corners(triangle), &self.mesh.sides(triangle), points);
        })
    }

    fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<2>, GeometryError> {
        zones.validate(self.cell_count())?;
        check_point_count(self.cell_count().saturating_mul(2), parts.saturating_mul(parts).saturating_mul(gauss))?;
        check_parts(parts)?;
        self.polygons(parts, zones).smoothing(gauss)
    }

    fn nodal_cells(&self, gauss: usize) -> Result<Smoothing<2>, GeometryError> {
        dual_polygons(&self.mesh, &Zones::single(self.mesh.positions.len())).smoothing(gauss)
    }

    fn boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<2>, GeometryError> {
        Ok(BoundaryCells::joined(self.boundary_pieces(part, parts, gauss)?))
    }

    fn boundary_pieces(&self, part: &Part, parts: usize, gauss: usize) -> Result<Vec<BoundaryCells<2>>, GeometryError> {
        self.pieces(part)?.try_mapped(|&piece| {
            let piece = &self.mesh.pieces[piece];
            Ok(facets(&self.mesh, piece, parts, gauss)?.bent(Some(&piece.lent())))
        })
    }

    fn contact_boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<2>, GeometryError> {
        let of = |&piece: &usize| facets(&self.mesh, &self.mesh.pieces[piece], parts, gauss);
        Ok(BoundaryCells::joined(self.pieces(part)?.try_mapped(of)?))
    }

    fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        let pieces = self.pieces(part)?;
        let mut nodes: Vec<usize> =
            pieces.into_iter().flat_map(|k| self.mesh.pieces[k].particles.iter().map(|&p| p as usize)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        Ok(nodes)
    }

    fn contains(&self, at: &Vec2) -> bool {
        self.within(at, SLACK)
    }

    fn encloses(&self, at: &Vec2) -> bool {
        self.within(at, EDGE)
    }
}

impl Triangulation {
    fn within(&self, at: &Vec2, slack: f64) -> bool {
        let around = |triangle| Bounds::of(&self.mesh.corners(triangle)).grown(SLACK);
        self.locator.any(self.mesh.triangles.len(), at, around, |triangle| {
            let [a, b, c] = self.mesh.corners(triangle);
            let least = -slack * cross(a, b, c);
            [cross(*at, a, b), cross(*at, b, c), cross(*at, c, a)].iter().all(|part| *part >= least)
        })
    }
}
