//! Facets of a closed surface, split along the planes of a lattice.

use std::collections::HashMap;

use crate::each::EachOf;
use crate::geometry::Vec3;
use crate::rows::Rows;

/// No plane.
pub(super) const NONE: i32 = i32::MIN;

/// A facet's part in one brick.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub(super) corners: [u32; 3],
    /// The brick, by its place along each axis.
    pub(super) brick: [i32; 3],
    /// The facet that it is part of.
    pub(super) facet: u32,
}

/// A closed surface whose facets end at the planes of integer coordinates: neighbours share their corners, so that it is as closed
/// as it was.
#[derive(Debug, Clone, Default)]
pub(super) struct Split {
    /// Corners of the surface and points where its edges meet planes.
    pub(super) points: Vec<Vec3>,
    /// The plane across each axis that a point lies on.
    pub(super) on: Vec<[i32; 3]>,
    pub(super) patches: Vec<Patch>,
}

/// The interval between planes that a coordinate lies in.
fn place(x: f64) -> i32 {
    x.floor() as i32
}

impl Split {
    /// Corners of a patch.
    pub(super) fn corners(&self, patch: u32) -> [Vec3; 3] {
        self.patches[patch as usize].corners.each(|corner| self.points[corner as usize])
    }

    /// Splits facets; corners that lie exactly on a plane count as above it.
    pub(super) fn new(corners: &[Vec3], facets: &[[u32; 3]]) -> Self {
        let patch =
            |(facet, corners): (usize, &[u32; 3])| Patch { corners: *corners, brick: [0; 3], facet: facet as u32 };
        let patches = facets.iter().enumerate().map(patch).collect();
        let mut split = Split { points: corners.to_vec(), on: vec![[NONE; 3]; corners.len()], patches };
        (0..3).for_each(|axis| split.along(axis));
        split
    }

    /// Splits all patches along the planes across an axis. Edges are split first, so that both patches beside one have its points.
    fn along(&mut self, axis: usize) {
        let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
        let mut split = Vec::with_capacity(self.patches.len());
        // Corners and points on edges, around, with the lowest and the highest interval that they belong to.
        let mut around: Vec<(u32, i32, i32)> = Vec::new();
        let mut polygon: Vec<u32> = Vec::new();
        for patch in std::mem::take(&mut self.patches) {
            let places = patch.corners.each(|corner| place(self.points[corner as usize][axis]));
            let [low, high] = [places.iter().min(), places.iter().max()].each(|place| place.copied().unwrap_or(0));
            let with = |corners, place| {
                let mut brick = patch.brick;
                brick[axis] = place;
                Patch { corners, brick, facet: patch.facet }
            };
            if low == high {
                split.push(with(patch.corners, low));
                continue;
            }
            around.clear();
            for k in 0..3 {
                let (from, to) = (patch.corners[k], patch.corners[(k + 1) % 3]);
                let (first, last) = (places[k], places[(k + 1) % 3]);
                around.push((from, first, first));
                if first == last {
                    continue;
                }
                let crossed = first.min(last) + 1..=first.max(last);
                let new = *edges.entry((from.min(to), from.max(to))).or_insert_with(|| {
                    let new = self.points.len() as u32;
                    crossed.clone().for_each(|plane| self.cross(from.min(to), from.max(to), axis, plane));
                    new
                });
                let point = |plane: i32| (new + (plane - first.min(last) - 1) as u32, plane - 1, plane);
                match first < last {
                    true => around.extend(crossed.map(point)),
                    false => around.extend(crossed.rev().map(point)),
                }
            }
            for place in low..=high {
                polygon.clear();
                polygon.extend(around.iter().filter(|p| p.1 <= place && place <= p.2).map(|p| p.0));
                for k in 2..polygon.len() {
                    split.push(with([polygon[0], polygon[k - 1], polygon[k]], place));
                }
            }
        }
        self.patches = split;
    }

    /// Adds the point where an edge meets a plane.
    fn cross(&mut self, from: u32, to: u32, axis: usize, plane: i32) {
        let [a, b] = [from, to].each(|end| self.points[end as usize]);
        let t = ((f64::from(plane) - a[axis]) / (b[axis] - a[axis])).clamp(0.0, 1.0);
        let mut point = a + (b - a) * t;
        let mut on = [NONE; 3];
        point[axis] = f64::from(plane);
        on[axis] = plane;
        for other in (0..3).filter(|other| *other != axis) {
            let planes = [from, to].each(|end| self.on[end as usize][other]);
            if planes[0] == planes[1] && planes[0] != NONE {
                on[other] = planes[0];
                point[other] = f64::from(planes[0]);
            }
        }
        self.points.push(point);
        self.on.push(on);
    }
}

/// Patches by the brick that they lie in; `brick` numbers the places of bricks below `count`.
pub(super) fn by_brick(split: &Split, count: usize, brick: impl Fn([i32; 3]) -> usize) -> Rows {
    Rows::new(count, &|add| {
        for (number, patch) in split.patches.iter().enumerate() {
            add(brick(patch.brick), number as u32);
        }
    })
}
