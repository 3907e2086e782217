//! Particles of a lattice that a surface cuts: on corners, along sharp edges, on faces, inside.

use std::collections::HashMap;

use crate::each::{EachOf, IntoEach, array_of};
use crate::geometry::{Bounds, Cubes, Vec3, places};
use crate::neighbours::{Flood, MARGIN};
use crate::order;
use crate::solid::foot;

use super::connected::SubCells;
use super::features::{Crease, Features};
use super::grid::Grid;
use super::split::Split;
use crate::rows::Rows;

/// Bricks between particles along each axis.
const STEP: i32 = 2;
/// Half the spacing of particles, in bricks: those that the surface is nearer to are moved onto it, and of two particles that
/// are closer one goes.
const HALF: f64 = 1.0;
/// Half the side of a cube that meets the faces between the eight bricks around a place, and none beyond.
const AROUND: f64 = 0.9;
/// Distance within which a particle lies on a facet.
const ON: f64 = 1e-6;

/// Particles, in units of bricks.
#[derive(Debug, Clone, Default)]
pub(super) struct Placed {
    pub(super) positions: Vec<Vec3>,
    /// The pieces of the surface that a particle lies on, with the mean normals there; none inside.
    pub(super) on: Vec<Vec<(u32, Vec3)>>,
    /// The particle of each place of the lattice.
    pub(super) at: HashMap<[i32; 3], u32>,
    /// The spacing at each particle over the finest one.
    pub(super) scales: Vec<f64>,
}

/// The nearest point of a triangle.
pub(super) fn nearest(x: &Vec3, triangle: &[Vec3; 3]) -> Vec3 {
    let (at, _) = foot(x, triangle);
    // Without an area it has no inside.
    if at.iter().all(|v| v.is_finite()) { at } else { triangle[0] }
}

/// Segments of a sharp edge that are no longer than a brick, where the spacing varies.
fn divided(points: &[Vec3]) -> Vec<Vec3> {
    let mut divided: Vec<Vec3> = points.first().copied().into_iter().collect();
    for pair in points.windows(2) {
        let count = (pair[1] - pair[0]).norm().ceil().max(1.0) as usize;
        divided.extend((1..=count).map(|k| pair[0] + (pair[1] - pair[0]) * (k as f64 / count as f64)));
    }
    divided
}

/// Places of particles along a sharp edge, evenly in units of the spacing there, its ends left out.
fn along(crease: &Crease, grid: &Grid) -> Vec<Vec3> {
    let points = if grid.is_even() { crease.points.clone() } else { divided(&crease.points) };
    let scaled = |pair: &[Vec3]| (pair[1] - pair[0]).norm() / grid.scale(&((pair[0] + pair[1]) * 0.5));
    let lengths: Vec<f64> = points.windows(2).map(scaled).collect();
    let whole: f64 = lengths.iter().sum();
    let intervals = (whole / f64::from(STEP) - 0.25).ceil().max(if crease.closed { 3.0 } else { 1.0 }) as usize;
    let first = usize::from(!crease.closed);
    let mut places = Vec::with_capacity(intervals);
    let (mut segment, mut before) = (0, 0.0);
    for k in first..intervals {
        let at = whole * k as f64 / intervals as f64;
        while segment + 1 < lengths.len() && before + lengths[segment] < at {
            before += lengths[segment];
            segment += 1;
        }
        let share = ((at - before) / lengths[segment].max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        places.push(points[segment] * (1.0 - share) + points[segment + 1] * share);
    }
    places
}

/// What places particles.
pub(super) struct Placing<'a> {
    pub(super) split: &'a Split,
    pub(super) by_brick: &'a Rows,
    pub(super) grid: &'a Grid,
    pub(super) features: &'a Features,
}

impl Placing<'_> {
    /// Patches in the bricks that a cube around a point meets.
    pub(super) fn near<'a>(&'a self, x: &Vec3, half: f64) -> impl Iterator<Item = u32> + 'a {
        let low: [i32; 3] = array_of(|i| ((x[i] - half).floor() as i32).max(0));
        let high: [i32; 3] = array_of(|i| ((x[i] + half).ceil() as i32).min(self.grid.counts[i] as i32));
        places(low, high.each(|end| end - 1))
            .flat_map(|place| self.by_brick.row(self.grid.brick(place)).iter().copied())
    }

    /// The pieces of the surface that a point lies on, with the mean of their facets' normals there: a mean lies in their affine hull, which
    /// a unit vector along it does not where the normals are those of a cone.
    fn pieces(&self, x: &Vec3) -> Vec<(u32, Vec3)> {
        let mut found: Vec<(u32, Vec3, Vec<u32>)> = Vec::new();
        for patch in self.near(x, ON) {
            if (nearest(x, &self.split.corners(patch)) - x).norm() > ON {
                continue;
            }
            let facet = self.split.patches[patch as usize].facet;
            let (piece, normal) = (self.features.pieces[facet as usize], self.features.normals[facet as usize]);
            match found.iter_mut().find(|known| known.0 == piece) {
                Some(known) if known.2.contains(&facet) => {}
                Some(known) => {
                    known.1 += normal;
                    known.2.push(facet);
                }
                None => found.push((piece, normal, vec![facet])),
            }
        }
        order::sort(&mut found, &|a, b| a.0.cmp(&b.0));
        found.into_mapped(|(piece, normal, facets)| (piece, normal / facets.len() as f64))
    }

    /// Particles on corners, along sharp edges, and those of the lattice: inside, or moved onto the surface where it is nearer than
    /// half a spacing; of two that are closer than that and not on either side of a slot the later one goes, those from outside come last.
    /// Where a slot divides the solid around a place of the lattice, each part has a particle of its own.
    pub(super) fn place(&self, connected: &SubCells) -> Placed {
        let mut placed = Placed::default();
        // Numbers of particles, and the spacings there over the finest one.
        let (mut known, mut flood) = (Cubes::<3, (usize, f64)>::new(1.0), Flood::default());
        let mut add = |placed: &mut Placed, at: Vec3, on: Vec<(u32, Vec3)>| {
            let mut around = Vec::new();
            let scale = self.grid.scale(&at);
            for &(close, other) in known.near(&at, HALF * scale) {
                let close = placed.positions[close];
                if (close - at).norm() >= HALF * scale.min(other) * (1.0 - 1e-9) {
                    continue;
                }
                if around.is_empty() {
                    connected.at(&at, &mut around);
                }
                if is_connected(connected, &mut flood, [&at, &close], &around) {
                    return None;
                }
            }
            let number = placed.positions.len();
            known.add(&at, (number, scale));
            placed.positions.push(at);
            placed.scales.push(self.grid.widest(&at, |leaf| connected.holds(self.grid.brick(leaf))));
            placed.on.push(on);
            Some(number as u32)
        };
        let edges = self.features.creases.iter().flat_map(|crease| along(crease, self.grid));
        for at in self.features.corners.iter().copied().chain(edges) {
            add(&mut placed, at, self.pieces(&at));
        }
        let mut inner: Vec<[i32; 3]> = Vec::new();
        let mut near: [Vec<([i32; 3], Vec3)>; 2] = [Vec::new(), Vec::new()];
        let counts = self.grid.counts.each(|count| count as i32);
        let mut flood = Flood::default();
        let corners = places([0; 3], counts.each(|count| count / STEP)).map(|at| at.each(|at| at * STEP));
        for place in corners.filter(|place| self.grid.is_corner(*place)) {
            let mut inside = connected.sections.is_inside(self.grid.node(place));
            let x = Vec3::from(place.each(f64::from));
            for at in self.nearest_by_part(connected, &mut flood, &x, inside) {
                match at {
                    Some(at) => near[usize::from(!inside)].push((place, at)),
                    None if inside => inner.push(place),
                    None => {}
                }
                inside = false;
            }
        }
        for (place, at) in near.into_iter().flatten() {
            if let Some(number) = add(&mut placed, at, self.pieces(&at)) {
                placed.at.entry(place).or_insert(number);
            }
        }
        for place in inner {
            if let Some(number) = add(&mut placed, Vec3::from(place.each(f64::from)), Vec::new()) {
                placed.at.insert(place, number);
            }
        }
        placed
    }

    /// The nearest point of the surface within half a spacing of a place, for each part of the solid around it that is connected there: the one
    /// that holds the place first, if it lies inside.
    fn nearest_by_part(&self, connected: &SubCells, flood: &mut Flood, x: &Vec3, inside: bool) -> Vec<Option<Vec3>> {
        // The sub-cell, the point and its distance over half the spacing there, which is the last one.
        let mut by_part: Vec<(u32, Option<Vec3>, f64, f64)> = Vec::new();
        let scale = self.grid.scale(x);
        if inside {
            let mut around = Vec::new();
            connected.at(x, &mut around);
            by_part.extend(around.first().map(|&part| (part, None, HALF, scale)));
        }
        for patch in self.near(x, HALF * self.grid.widest(x, |_| true)) {
            // In units of half the spacing where the surface is.
            let size = f64::from(self.grid.half_spacing(self.split.patches[patch as usize].brick));
            connected.each_wall(patch, |part, corners| {
                let at = nearest(x, &corners);
                let distance = (at - x).norm() / size;
                let known = match by_part.iter().position(|known| known.0 == part) {
                    Some(known) => known,
                    None => {
                        by_part.push((part, None, HALF, size.max(scale)));
                        by_part.len() - 1
                    }
                };
                if distance < by_part[known].2 {
                    (by_part[known].1, by_part[known].2) = (Some(at), distance);
                }
            });
        }
        let mut groups: Vec<(u32, Option<Vec3>, f64)> = Vec::new();
        for (part, at, distance, size) in by_part {
            let around = AROUND * size;
            let within = Bounds::of([x]).widened(&Vec3::repeat(around));
            let reached = |group: &&mut (u32, Option<Vec3>, f64)| {
                group.0 == part || flood.reaches(connected, &[part], &[group.0], &within)
            };
            match groups.iter_mut().find(reached) {
                Some(group) if distance < group.2 => (group.1, group.2) = (at, distance),
                Some(_) => {}
                None => groups.push((part, at, distance)),
            }
        }
        if groups.is_empty() && inside {
            groups.push((0, None, HALF));
        }
        groups.into_mapped(|group| group.1)
    }
}

/// Whether two points are connected through sub-cells near both; the first lies in the given ones.
fn is_connected(connected: &SubCells, flood: &mut Flood, [x, y]: [&Vec3; 2], around: &[u32]) -> bool {
    let margin = Vec3::repeat(MARGIN * f64::from(STEP) * connected.sections.grid.scale(x));
    let mut goal = Vec::new();
    connected.at(y, &mut goal);
    flood.reaches(connected, around, &goal, &Bounds::of([x, y]).widened(&margin))
}
