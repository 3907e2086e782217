//! Elements of one dimension, flat.

use std::collections::HashMap;

use crate::each::Each;
use crate::geometry::{Point, Vec3, double_area, padded};

use super::shape::CellShape;

/// A named group of elements of one dimension.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Group {
    pub name: String,
    pub dimension: usize,
    /// Places in the list of that dimension, rising.
    pub members: Vec<u32>,
}

/// What a mesh is made of, its places with three components.
pub(crate) struct Content {
    pub points: Vec<[f64; 3]>,
    pub elements: [Elements; 4],
    pub groups: Vec<Group>,
    /// Middles of curved edges by the places of their ends.
    pub middles: HashMap<[u32; 2], [f64; 3]>,
}

/// Elements of one dimension and their corners, one after the other.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Elements {
    shapes: Vec<CellShape>,
    /// Where the corners of each element end.
    ends: Vec<u32>,
    corners: Vec<u32>,
}

impl Elements {
    pub(crate) fn len(&self) -> usize {
        self.shapes.len()
    }

    pub(crate) fn reserve(&mut self, count: usize, corners: usize) {
        self.shapes.reserve_exact(count);
        self.ends.reserve_exact(count);
        self.corners.reserve_exact(count * corners);
    }

    pub(crate) fn push(&mut self, shape: CellShape, corners: impl IntoIterator<Item = u32>) {
        self.corners.extend(corners);
        self.shapes.push(shape);
        self.ends.push(self.corners.len() as u32);
    }

    pub(crate) fn shape(&self, element: usize) -> CellShape {
        self.shapes[element]
    }

    fn range(&self, element: usize) -> std::ops::Range<usize> {
        let end = self.ends[element] as usize;
        end - self.shapes[element].corner_count()..end
    }

    pub(crate) fn corners(&self, element: usize) -> &[u32] {
        &self.corners[self.range(element)]
    }

    pub(crate) fn corners_mut(&mut self, element: usize) -> &mut [u32] {
        let range = self.range(element);
        &mut self.corners[range]
    }

    pub(crate) fn all_corners(&self) -> &[u32] {
        &self.corners
    }

    pub(crate) fn all_corners_mut(&mut self) -> &mut [u32] {
        &mut self.corners
    }

    pub(crate) fn shrink(&mut self) {
        self.shapes.shrink_to_fit();
        self.ends.shrink_to_fit();
        self.corners.shrink_to_fit();
    }
}

/// Gauss points of two per direction on the unit interval.
const TWO: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];

/// A point of a face and $n\\,\mathrm dA$ there.
type FacePoint = (Vec3, Vec3);

/// Points and $n\\,\mathrm dA$ on a triangle or a bilinear quadrangle in space, exact for $\oint x\cdot n$.
pub(crate) fn surface(x: &[Vec3]) -> ([FacePoint; 4], usize) {
    let mut points = [(Vec3::zeros(), Vec3::zeros()); 4];
    if let &[a, b, c] = x {
        points[0] = ((a + b + c) / 3.0, double_area(&[a, b, c]) * 0.5);
        return (points, 1);
    }
    for (k, point) in points.iter_mut().enumerate() {
        let (s, t) = (TWO[k % 2], TWO[k / 2]);
        let at = x[0] * (1.0 - s) * (1.0 - t) + x[1] * s * (1.0 - t) + x[2] * s * t + x[3] * (1.0 - s) * t;
        let along_s = (x[1] - x[0]) * (1.0 - t) + (x[2] - x[3]) * t;
        let along_t = (x[3] - x[0]) * (1.0 - s) + (x[2] - x[1]) * s;
        *point = (at, along_s.cross(&along_t) * 0.25);
    }
    (points, 4)
}

/// Length, area or volume of an element \[length^k\]; a point counts as one. Plane cells and volumes have a sign.
pub(crate) fn measure<const D: usize>(shape: CellShape, corners: &[u32], points: &[Point<D>]) -> f64 {
    let mut x = [Vec3::zeros(); 8];
    for (x, &corner) in x.iter_mut().zip(corners) {
        *x = padded(&points[corner as usize]);
    }
    let x = &x[..corners.len()];
    let facing = |x: &[Vec3]| {
        let (points, count) = surface(x);
        let areas = points[..count].iter().map(|p| p.1);
        if D == 2 { areas.map(|a| a[2]).sum() } else { areas.map(|a| a.norm()).sum() }
    };
    match shape.dimension() {
        0 => 1.0,
        1 => (x[1] - x[0]).norm(),
        2 => facing(x),
        _ if shape == CellShape::Tetrahedron => double_area(&[x[0], x[1], x[2]]).dot(&(x[3] - x[0])) / 6.0,
        _ => {
            // From a corner of the cell: about a distant origin the fluxes would cancel.
            let flux = |face: &&[usize]| -> f64 {
                let mut corners = [Vec3::zeros(); 4];
                for (to, &k) in corners.iter_mut().zip(*face) {
                    *to = x[k] - x[0];
                }
                let (points, count) = surface(&corners[..face.len()]);
                points[..count].summed(|(at, area)| at.dot(area))
            };
            shape.faces().summed(flux) / 3.0
        }
    }
}
