//! Rigid surfaces of triangles, from the hull of a mesh.

use std::collections::HashMap;

use nalgebra::SMatrix;

use crate::error::GeometryError;
use crate::geometry::Point;
use crate::mesh::Mesh;

use super::{Nearest, Surface};

/// The surface of a rigid body as triangles, counter-clockwise seen from outside.
///
/// The gap is the distance from the nearest triangle; its sign is that of the normal there, at edges and corners of the mean
/// normal of the triangles around, weighted by their angles (Bærentzen & Aanæs 2005).
///
/// ```
/// use rkpm::contact::{Surface, Triangulated};
/// use rkpm::mesh::{CellShape, Mesh};
/// use rkpm::geometry::Point;
/// // A rigid cube drawn as one hexahedron.
/// let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
/// let points: Vec<Point<3>> =
///     [0.0, 1.0].iter().flat_map(|&z| corners.map(|[x, y]| [x, y, z].into())).collect();
/// let cube = Mesh::new(points, &[(CellShape::Hexahedron, (0..8).collect())], &[])?;
/// let surface = Triangulated::hull(&cube);
/// assert!((surface.nearest(&[0.5, 0.5, 1.25].into()).gap - 0.25).abs() < 1e-12);
/// assert!((surface.nearest(&[0.5, 0.9, 0.5].into()).gap + 0.1).abs() < 1e-12);
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Triangulated {
    points: Vec<Point<3>>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<Point<3>>,
    /// Mean normals at corners.
    at_points: Vec<Point<3>>,
    /// Sums of the normals on both sides of an edge, its lower corner first, and how many there are.
    at_edges: HashMap<[u32; 2], (Point<3>, usize)>,
    /// Whether a corner lies at a border, beyond which there are no triangles.
    at_borders: Vec<bool>,
    low: Point<3>,
    high: Point<3>,
    size: f64,
    bins: HashMap<[i32; 3], Vec<u32>>,
}

/// Part of the cube around a closed surface below which its volume is rounding.
const ROUNDING: f64 = 1e-8;

fn edge(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Triangulated {
    /// Triangles between points \[length\].
    pub fn new(points: Vec<Point<3>>, triangles: Vec<[u32; 3]>) -> Self {
        let mut surface = Triangulated {
            at_points: vec![Point::zeros(); points.len()],
            points,
            triangles: Vec::new(),
            normals: Vec::new(),
            at_edges: HashMap::new(),
            at_borders: Vec::new(),
            low: Point::repeat(f64::INFINITY),
            high: Point::repeat(f64::NEG_INFINITY),
            size: 0.0,
            bins: HashMap::new(),
        };
        let count = surface.points.len() as u32;
        // What has no area or no such corner is refused by `validate`.
        let good = triangles.iter().all(|triangle| triangle.iter().all(|&corner| corner < count));
        surface.triangles = if good { triangles } else { Vec::new() };
        let mut total = 0.0;
        for &triangle in &surface.triangles {
            let x = triangle.map(|corner| surface.points[corner as usize]);
            let normal = (x[1] - x[0]).cross(&(x[2] - x[0])).normalize();
            surface.normals.push(normal);
            for k in 0..3 {
                let (next, last) = (x[(k + 1) % 3] - x[k], x[(k + 2) % 3] - x[k]);
                surface.at_points[triangle[k] as usize] += normal * next.angle(&last);
                let both =
                    surface.at_edges.entry(edge(triangle[k], triangle[(k + 1) % 3])).or_insert((Point::zeros(), 0));
                *both = (both.0 + normal, both.1 + 1);
                total += next.norm();
                surface.low = surface.low.zip_map(&x[k], f64::min);
                surface.high = surface.high.zip_map(&x[k], f64::max);
            }
        }
        surface.at_borders = vec![false; surface.points.len()];
        for (ends, _) in surface.at_edges.iter().filter(|(_, (_, count))| *count < 2) {
            ends.iter().for_each(|&end| surface.at_borders[end as usize] = true);
        }
        surface.size = total / (3 * surface.triangles.len()).max(1) as f64;
        for k in 0..surface.triangles.len() {
            let x = surface.triangles[k].map(|corner| surface.points[corner as usize]);
            let low = surface.bin(&x[0].zip_map(&x[1], f64::min).zip_map(&x[2], f64::min));
            let high = surface.bin(&x[0].zip_map(&x[1], f64::max).zip_map(&x[2], f64::max));
            for i in low[0]..=high[0] {
                for j in low[1]..=high[1] {
                    for l in low[2]..=high[2] {
                        surface.bins.entry([i, j, l]).or_default().push(k as u32);
                    }
                }
            }
        }
        surface
    }

    /// The hull of a mesh: the faces that belong to one cell alone, quadrangles cut in two.
    pub fn hull(mesh: &Mesh<3>) -> Self {
        Triangulated::new(mesh.points().to_vec(), mesh.surface().0)
    }

    /// Whether it has no border.
    fn is_closed(&self) -> bool {
        !self.at_borders.contains(&true)
    }

    /// What a closed surface encloses, negative where it is the wall of a cavity.
    fn volume(&self) -> f64 {
        let of = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|corner| self.points[corner as usize] - self.low);
            a.dot(&b.cross(&c)) / 6.0
        };
        self.triangles.iter().map(of).sum()
    }

    fn bin(&self, x: &Point<3>) -> [i32; 3] {
        std::array::from_fn(|i| ((x[i] - self.low[i]) / self.size).floor().clamp(0.0, 1e6) as i32)
    }

    /// The nearest point of a triangle, and the corners that span where it lies: one, two or three.
    fn foot(&self, triangle: usize, x: &Point<3>) -> (Point<3>, Vec<usize>) {
        let [a, b, c] = self.triangles[triangle].map(|corner| self.points[corner as usize]);
        let (first, second) = (b - a, c - a);
        let across = first.cross(&second);
        let square = across.norm_squared();
        let away = x - a;
        let eta = away.cross(&second).dot(&across) / square;
        let zeta = first.cross(&away).dot(&across) / square;
        if eta > 0.0 && zeta > 0.0 && eta + zeta < 1.0 {
            return (a + first * eta + second * zeta, vec![0, 1, 2]);
        }
        let corners = [a, b, c];
        let sides = (0..3).map(|k| {
            let (from, to) = (corners[k], corners[(k + 1) % 3]);
            let along = to - from;
            let at = ((x - from).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
            let ends = match at {
                0.0 => vec![k],
                1.0 => vec![(k + 1) % 3],
                _ => vec![k, (k + 1) % 3],
            };
            (from + along * at, ends)
        });
        sides.min_by(|p, q| (x - p.0).norm_squared().total_cmp(&(x - q.0).norm_squared())).unwrap_or((a, vec![0]))
    }
}

impl Surface<3> for Triangulated {
    fn nearest(&self, x: &Point<3>) -> Nearest<3> {
        // Distances from beyond the box: at least those to it and within it.
        let inside = x.zip_map(&self.low, f64::max).zip_map(&self.high, f64::min);
        let beyond = (x - inside).norm();
        let middle = self.bin(&inside);
        let extent = self.high - self.low;
        let rings = (extent.amax() / self.size).ceil() as i32 + 1;
        let mut best: Option<(f64, usize, Point<3>, Vec<usize>)> = None;
        for ring in 0..=rings {
            let within = (f64::from(ring) - 1.0).max(0.0) * self.size;
            if best.as_ref().is_some_and(|found| found.0 < beyond.hypot(within)) {
                break;
            }
            for i in -ring..=ring {
                for j in -ring..=ring {
                    let whole = i.abs() == ring || j.abs() == ring || ring == 0;
                    for l in (-ring..=ring).step_by(if whole { 1 } else { 2 * ring as usize }) {
                        let bin = [middle[0] + i, middle[1] + j, middle[2] + l];
                        for &k in self.bins.get(&bin).into_iter().flatten() {
                            let (foot, corners) = self.foot(k as usize, x);
                            let distance = (x - foot).norm();
                            if best.as_ref().is_none_or(|found| distance < found.0) {
                                best = Some((distance, k as usize, foot, corners));
                            }
                        }
                    }
                }
            }
        }
        let Some((distance, k, foot, corners)) = best else { return Nearest::flat(f64::INFINITY, Point::zeros()) };
        let triangle = self.triangles[k];
        let away = x - foot;
        if corners.len() == 3 || distance <= 1e-12 * self.size {
            return Nearest::flat(away.dot(&self.normals[k]), self.normals[k]);
        }
        let (outward, projector, open) = if let [a, b] = corners[..] {
            let (a, b) = (triangle[a], triangle[b]);
            let (sum, count) = self.at_edges[&edge(a, b)];
            let along = (self.points[b as usize] - self.points[a as usize]).normalize();
            (sum, SMatrix::<f64, 3, 3>::identity() - along * along.transpose(), count < 2)
        } else {
            let corner = triangle[corners[0]] as usize;
            (self.at_points[corner], SMatrix::identity(), self.at_borders[corner])
        };
        if open {
            // On straight beyond a border.
            return Nearest { passed_end: true, ..Nearest::flat(away.dot(&self.normals[k]), self.normals[k]) };
        }
        let found = Nearest::round(away, 0.0, projector);
        if away.dot(&outward) >= 0.0 { found } else { found.hollow() }
    }

    /// An open surface has no far side: a flat one, whose box has no height, would let nothing move otherwise.
    fn depth(&self) -> f64 {
        let extent = self.high - self.low;
        if self.is_closed() { 0.5 * extent.min() } else { 0.5 * extent.max() }
    }

    fn validate(&self) -> Result<(), GeometryError> {
        let at = self.points.first().map_or_else(Vec::new, |x| x.as_slice().to_vec());
        if self.triangles.is_empty() {
            let (what, remedy) =
                ("a rigid surface has no triangles, or corners that do not exist", "give some of each");
            return Err(GeometryError::Shape { what, at, remedy });
        }
        match self.normals.iter().position(|normal| !normal.norm().is_finite()) {
            None if self.is_closed() && self.volume().abs() <= ROUNDING * (self.high - self.low).amax().powi(3) => {
                let (what, remedy) =
                    ("a closed rigid surface has no inside", "give it a volume, or leave out one of its two sides");
                Err(GeometryError::Shape { what, at, remedy })
            }
            None => Ok(()),
            Some(k) => {
                let at = self.points[self.triangles[k][0] as usize].as_slice().to_vec();
                let (what, remedy) =
                    ("a triangle of a rigid surface has no area", "leave it out, or merge its corners");
                Err(GeometryError::Shape { what, at, remedy })
            }
        }
    }
}
