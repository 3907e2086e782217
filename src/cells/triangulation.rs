//! Cells of scattered particles: triangles.

use crate::error::{ApproximationError, GeometryError};
use crate::geometry::{Part, Point, Region};
use crate::particles::{Particles, Support, check_dilation};
use crate::quadrature::{Points, check_point_count, gauss_legendre};

use super::edges::{facets, plain_facets};
use super::mesh::{Mesh, NONE, collapse, cross};
use super::nodal_polygons::dual_polygons;
use super::polygons::Polygons;
use super::scatter::{Spacing, factor_for, scatter};
use super::{BoundaryCells, Cells, Scatter, Smoothing, Zones};

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
    locator: Locator,
}

impl Triangulation {
    /// Scatters particles over a region with a local spacing \[length\].
    ///
    /// # Errors
    /// For spacings that are not positive or larger than the shape.
    pub fn scattered(
        region: &Region,
        spacing: impl Fn(&Point<2>) -> f64,
        settings: &Scatter,
    ) -> Result<Self, GeometryError> {
        let spacing = Spacing { function: &spacing, factor: 1.0, floor: 0.0 };
        Ok(Triangulation::over(scatter(region, &spacing, settings)?, region))
    }

    /// Scatters about `count` particles over a region, their spacing in proportion to a function.
    ///
    /// # Errors
    /// As [`scattered`](Triangulation::scattered).
    pub fn about(
        region: &Region,
        count: usize,
        spacing: impl Fn(&Point<2>) -> f64,
        settings: &Scatter,
    ) -> Result<Self, GeometryError> {
        let mut factor = factor_for(region, &spacing, count)?;
        let mut mesh = scatter(region, &Spacing { function: &spacing, factor, floor: 0.0 }, settings)?;
        // The estimate knows neither corners nor the least number of particles on a line: correct it once.
        let ratio = mesh.positions.len() as f64 / count as f64;
        if (ratio - 1.0).abs() > 0.02 {
            factor *= ratio.sqrt();
            if let Ok(better) = scatter(region, &Spacing { function: &spacing, factor, floor: 0.0 }, settings) {
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
    pub fn of_particles(region: &Region, positions: &[Point<2>]) -> Result<Self, GeometryError> {
        Ok(Triangulation::over(Mesh::of_particles(region, positions)?, region))
    }

    fn over(mut mesh: Mesh, region: &Region) -> Self {
        mesh.bend(region);
        let (offsets, neighbours) = mesh.neighbours();
        let row = |p: usize| &neighbours[offsets[p]..offsets[p + 1]];
        let distances: Vec<f64> = (0..mesh.positions.len())
            .map(|p| {
                let sum: f64 = row(p).iter().map(|&q| (mesh.positions[q as usize] - mesh.positions[p]).norm()).sum();
                sum / row(p).len() as f64
            })
            .collect();
        // Mean over the neighbours: supports of unequal size beside each other cost accuracy.
        let spacings = (0..mesh.positions.len())
            .map(|p| {
                let sum: f64 = row(p).iter().map(|&q| distances[q as usize]).sum();
                0.5 * (distances[p] + sum / row(p).len() as f64)
            })
            .collect();
        let locator = Locator::new(&mesh);
        Triangulation { mesh, names: region.names.clone(), spacings, locator }
    }

    /// Particles of each triangle, counter-clockwise.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.mesh.triangles
    }

    /// Pieces of a part, or of the whole boundary.
    fn pieces(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        let all = 0..self.mesh.pieces.len();
        let found: Vec<usize> = match part {
            Part::Whole => all.collect(),
            Part::Named(name) => all.filter(|&k| self.names[self.mesh.pieces[k].part] == *name).collect(),
            _ => Vec::new(),
        };
        if found.is_empty() {
            let known = format!("{}, and the whole boundary", self.names.join(", "));
            return Err(GeometryError::UnknownPart { part: part.to_string(), known });
        }
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
        for zone in zones.offsets.windows(2) {
            for &triangle in &zones.cells[zone[0]..zone[1]] {
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
    fn positions(&self) -> &[Point<2>] {
        &self.mesh.positions
    }

    fn cell_count(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn corners(&self, cell: usize) -> Vec<usize> {
        self.mesh.triangles[cell].map(|p| p as usize).to_vec()
    }

    fn local_spacing(&self, particle: usize) -> f64 {
        self.spacings.get(particle).copied().unwrap_or(f64::NAN)
    }

    fn particles(&self, r: f64) -> Result<Particles<2>, ApproximationError> {
        check_dilation(r)?;
        let supports = self.spacings.iter().map(|h| Support::Ball(2.0 * r * h)).collect();
        Particles::new(self.mesh.positions.clone(), supports)
    }

    fn particles_global(&self, r: f64) -> Result<Particles<2>, ApproximationError> {
        check_dilation(r)?;
        let largest = self.spacings.iter().copied().fold(0.0, f64::max);
        Particles::new(self.mesh.positions.clone(), vec![Support::Ball(2.0 * r * largest); self.spacings.len()])
    }

    fn is_thin(&self) -> bool {
        self.mesh.on_boundary().iter().all(|b| *b)
    }

    fn zones(&self, size: usize) -> Zones {
        super::zones::zones(&self.mesh, size)
    }

    fn gauss_in(&self, n: usize, zones: &Zones) -> Result<Points<2>, GeometryError> {
        zones.validate(self.cell_count())?;
        let rule = gauss_legendre(n)?;
        let mut points = Points::empty();
        for zone in zones.offsets.windows(2) {
            for &triangle in &zones.cells[zone[0]..zone[1]] {
                let (corners, sides) = (self.mesh.corners(triangle as usize), self.mesh.sides(triangle as usize));
                collapse(&rule, &corners, &sides, &mut points);
            }
            points.close_group();
        }
        Ok(points)
    }

    fn smoothing(&self, parts: usize, gauss: usize, zones: &Zones) -> Result<Smoothing<2>, GeometryError> {
        zones.validate(self.cell_count())?;
        check_point_count(self.cell_count().saturating_mul(2), parts.saturating_mul(parts).saturating_mul(gauss))?;
        if parts == 0 {
            let needed = "at least 1 is needed";
            return Err(GeometryError::Count { what: "sub-cells per direction", count: 0, needed });
        }
        self.polygons(parts, zones).smoothing(gauss)
    }

    fn nodal_cells(&self, gauss: usize) -> Result<Smoothing<2>, GeometryError> {
        dual_polygons(&self.mesh).smoothing(gauss)
    }

    fn boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<2>, GeometryError> {
        let mut all = BoundaryCells { points: Points::empty(), traces: Vec::new() };
        for piece in self.pieces(part)? {
            let cells = facets(&self.mesh, &self.mesh.pieces[piece], parts, gauss)?;
            all.points.append(cells.points);
            all.traces.extend(cells.traces);
        }
        Ok(all)
    }

    fn boundary_pieces(&self, part: &Part, parts: usize, gauss: usize) -> Result<Vec<BoundaryCells<2>>, GeometryError> {
        let pieces = self.pieces(part)?;
        pieces.into_iter().map(|piece| facets(&self.mesh, &self.mesh.pieces[piece], parts, gauss)).collect()
    }

    fn contact_boundary(&self, part: &Part, parts: usize, gauss: usize) -> Result<BoundaryCells<2>, GeometryError> {
        let mut all = BoundaryCells { points: Points::empty(), traces: Vec::new() };
        for piece in self.pieces(part)? {
            let cells = plain_facets(&self.mesh, &self.mesh.pieces[piece], parts, gauss)?;
            all.points.append(cells.points);
            all.traces.extend(cells.traces);
        }
        Ok(all)
    }

    fn boundary_nodes(&self, part: &Part) -> Result<Vec<usize>, GeometryError> {
        let pieces = self.pieces(part)?;
        let mut nodes: Vec<usize> =
            pieces.into_iter().flat_map(|k| self.mesh.pieces[k].particles.iter().map(|&p| p as usize)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        Ok(nodes)
    }

    fn contains(&self, at: &Point<2>) -> bool {
        self.locator.contains(&self.mesh, at)
    }
}

/// Finds the triangle of a point by a grid of lists.
#[derive(Debug, Clone)]
struct Locator {
    min: Point<2>,
    inverse: Point<2>,
    counts: [usize; 2],
    offsets: Vec<u32>,
    entries: Vec<u32>,
}

/// How far outside its triangle a point may lie, as a part of its height: chords cut arcs.
const SLACK: f64 = 0.1;

impl Locator {
    fn new(mesh: &Mesh) -> Self {
        let mut min = Point::<2>::repeat(f64::INFINITY);
        let mut max = Point::<2>::repeat(f64::NEG_INFINITY);
        for x in &mesh.positions {
            min = min.zip_map(x, f64::min);
            max = max.zip_map(x, f64::max);
        }
        let extent = max - min;
        let width = (extent[0] * extent[1] / mesh.triangles.len() as f64).sqrt();
        let counts = [0, 1].map(|i| ((extent[i] / width) as usize + 1).min(mesh.triangles.len()));
        let inverse = Point::<2>::new(counts[0] as f64 / extent[0], counts[1] as f64 / extent[1]);
        let mut locator =
            Locator { min, inverse, counts, offsets: vec![0; counts[0] * counts[1] + 1], entries: Vec::new() };
        for triangle in 0..mesh.triangles.len() {
            locator.bins(mesh, triangle, |bin, this| this.offsets[bin + 1] += 1);
        }
        for bin in 0..counts[0] * counts[1] {
            locator.offsets[bin + 1] += locator.offsets[bin];
        }
        let mut cursor = locator.offsets.clone();
        locator.entries = vec![NONE; *cursor.last().unwrap_or(&0) as usize];
        for triangle in 0..mesh.triangles.len() {
            locator.bins(mesh, triangle, |bin, this| {
                this.entries[cursor[bin] as usize] = triangle as u32;
                cursor[bin] += 1;
            });
        }
        locator
    }

    fn bins(&mut self, mesh: &Mesh, triangle: usize, mut visit: impl FnMut(usize, &mut Self)) {
        let corners = mesh.corners(triangle);
        let low = corners[0].zip_map(&corners[1], f64::min).zip_map(&corners[2], f64::min);
        let high = corners[0].zip_map(&corners[1], f64::max).zip_map(&corners[2], f64::max);
        let margin = (high - low) * SLACK;
        let (low, high) = (low - margin, high + margin);
        for row in self.bin(low[1], 1)..=self.bin(high[1], 1) {
            for column in self.bin(low[0], 0)..=self.bin(high[0], 0) {
                visit(row * self.counts[0] + column, self);
            }
        }
    }

    fn bin(&self, value: f64, axis: usize) -> usize {
        (((value - self.min[axis]) * self.inverse[axis]).max(0.0) as usize).min(self.counts[axis] - 1)
    }

    fn contains(&self, mesh: &Mesh, at: &Point<2>) -> bool {
        if !at.iter().all(|x| x.is_finite()) {
            return false;
        }
        let bin = self.bin(at[1], 1) * self.counts[0] + self.bin(at[0], 0);
        self.entries[self.offsets[bin] as usize..self.offsets[bin + 1] as usize].iter().any(|&triangle| {
            let [a, b, c] = mesh.corners(triangle as usize);
            let slack = -SLACK * cross(a, b, c);
            [cross(*at, a, b), cross(*at, b, c), cross(*at, c, a)].iter().all(|part| *part >= slack)
        })
    }
}
