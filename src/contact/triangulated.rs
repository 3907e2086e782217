//! Rigid surfaces of triangles.

use std::collections::HashMap;

use nalgebra::SMatrix;

use crate::error::GeometryError;
use crate::geometry::{Bounds, Mat3, Point, Vec3};
use crate::solid::{Tree, foot};

use super::{Nearest, Surface};

/// The surface of a rigid body as triangles, counter-clockwise seen from outside.
///
/// The gap is the distance from the nearest triangle; its sign is that of the normal there, at edges and corners of the mean
/// normal of the triangles around, weighted by their angles (Bærentzen & Aanæs 2005).
///
/// ```
/// use rkpm::contact::{Surface, Triangulated};
/// // A square sheet at z = 1 that faces upwards.
/// let corners = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
/// let sheet = Triangulated::new(corners.map(Into::into).to_vec(), vec![[0, 1, 2], [0, 2, 3]]);
/// assert!((sheet.nearest(&[0.5, 0.5, 1.25].into()).gap - 0.25).abs() < 1e-12);
/// assert!((sheet.nearest(&[0.5, 0.5, 0.9].into()).gap + 0.1).abs() < 1e-12);
/// ```
#[derive(Debug, Clone)]
pub struct Triangulated {
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<Vec3>,
    /// Mean normals at corners.
    at_points: Vec<Vec3>,
    /// Sums of the normals on both sides of an edge, its lower corner first, and how many there are.
    at_edges: HashMap<[u32; 2], (Vec3, usize)>,
    /// Whether a corner lies at a border, beyond which there are no triangles.
    at_borders: Vec<bool>,
    bounds: Bounds<3>,
    tree: Tree,
}

/// Part of the cube around a closed surface below which its volume is rounding.
const ROUNDING: f64 = 1e-8;
/// Part of the extent within which a point lies on the surface.
const ON: f64 = 1e-12;

fn edge(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Triangulated {
    /// Triangles between points \[length\].
    pub fn new(points: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        let count = points.len() as u32;
        // What has no area or no such corner is refused by `validate`.
        let good = triangles.iter().all(|triangle| triangle.iter().all(|&corner| corner < count));
        let triangles = if good { triangles } else { Vec::new() };
        let (mut normals, mut bounds) = (Vec::with_capacity(triangles.len()), Bounds::none());
        let (mut at_points, mut at_edges) = (vec![Point::zeros(); points.len()], HashMap::new());
        for &triangle in &triangles {
            let x = triangle.map(|corner| points[corner as usize]);
            let normal = (x[1] - x[0]).cross(&(x[2] - x[0])).normalize();
            normals.push(normal);
            bounds = bounds.join(&Bounds::of(&x));
            for k in 0..3 {
                let (next, last) = (x[(k + 1) % 3] - x[k], x[(k + 2) % 3] - x[k]);
                at_points[triangle[k] as usize] += normal * next.angle(&last);
                let both = at_edges.entry(edge(triangle[k], triangle[(k + 1) % 3])).or_insert((Point::zeros(), 0));
                *both = (both.0 + normal, both.1 + 1);
            }
        }
        let mut at_borders = vec![false; points.len()];
        for (ends, _) in at_edges.iter().filter(|(_, (_, count))| *count < 2) {
            ends.iter().for_each(|&end| at_borders[end as usize] = true);
        }
        let tree = Tree::new(&points, &triangles);
        Triangulated { points, triangles, normals, at_points, at_edges, at_borders, bounds, tree }
    }

    /// Whether it has no border.
    fn is_closed(&self) -> bool {
        !self.at_borders.contains(&true)
    }

    /// What a closed surface encloses, negative where it is the wall of a cavity.
    fn volume(&self) -> f64 {
        let of = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|corner| self.points[corner as usize] - self.bounds.low);
            a.dot(&b.cross(&c)) / 6.0
        };
        self.triangles.iter().map(of).sum()
    }
}

impl Surface<3> for Triangulated {
    fn nearest(&self, x: &Vec3) -> Nearest<3> {
        let Some((k, _, distance)) = self.tree.closest(x) else { return Nearest::flat(f64::INFINITY, Point::zeros()) };
        let (k, triangle) = (k as usize, self.triangles[k as usize]);
        let (foot, corners) = foot(x, &triangle.map(|corner| self.points[corner as usize]));
        let away = x - foot;
        if corners.len() == 3 || distance <= ON * self.bounds.extent().amax() {
            return Nearest::flat(away.dot(&self.normals[k]), self.normals[k]);
        }
        let (outward, projector, open) = if let [a, b] = *corners {
            let (a, b) = (triangle[a], triangle[b]);
            let (sum, count) = self.at_edges[&edge(a, b)];
            let along = (self.points[b as usize] - self.points[a as usize]).normalize();
            (sum, Mat3::identity() - along * along.transpose(), count < 2)
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
        let extent = self.bounds.extent();
        if self.is_closed() { 0.5 * extent.min() } else { 0.5 * extent.max() }
    }

    fn validate(&self) -> Result<(), GeometryError> {
        let at = self.points.first().map_or_else(Vec::new, |x| x.as_slice().to_vec());
        ensure!(
            !self.triangles.is_empty(),
            GeometryError::Shape {
                what: "a rigid surface has no triangles, or corners that do not exist",
                at,
                remedy: "give some of each"
            }
        );
        match self.normals.iter().position(|normal| !normal.norm().is_finite()) {
            None if self.is_closed() && self.volume().abs() <= ROUNDING * self.bounds.extent().amax().powi(3) => {
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
