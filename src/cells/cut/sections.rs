//! Sections of a solid on the planes of a lattice, face by face.

use std::ops::Range;

use crate::each::{Each, EachOf, IntoEach};
use crate::geometry::{Point, Vec2, Vec3};
use crate::order;

use super::grid::Grid;
use super::polygon::{Corner, area, holds, triangles};
use super::split::Split;

/// A connected part of the solid's section on a face between two bricks, the normal along the axis.
#[derive(Debug, Clone)]
pub(super) struct Section {
    pub(super) axis: u8,
    /// The brick above the face.
    pub(super) brick: u32,
    /// Bricks along each side of the face: more than one between whole leaves.
    pub(super) size: i32,
    /// Its triangles among those of all sections; none for a whole face.
    pub(super) triangles: Range<usize>,
    pub(super) area: f64,
}

/// The sections on all faces.
#[derive(Debug, Clone, Default)]
pub(super) struct Sections {
    pub(super) grid: Grid,
    /// Number of points of the split surface: corners between bricks are counted behind them.
    first_node: u32,
    pub(super) sections: Vec<Section>,
    /// Triangles by their corners: points of the split surface and corners between bricks.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Offsets of the sections on the lower face of each brick, axis by axis.
    offsets: Vec<u32>,
    /// Whether the corners between bricks lie in the solid.
    inside: Vec<bool>,
    /// Whether the surface cuts leaves, by their lowest bricks; empty where the lattice is even.
    cut: Vec<bool>,
}

/// An edge of a section: axis, brick above the face, and its ends, the solid on their left.
type Edge = (u8, u32, u32, u32);

impl Sections {
    pub(super) fn new(split: &Split, grid: Grid) -> Self {
        let mut edges: Vec<Edge> = Vec::new();
        for patch in &split.patches {
            for axis in 0..3 {
                for k in 0..3 {
                    let (from, to) = (patch.corners[k], patch.corners[(k + 1) % 3]);
                    if [from, to].iter().all(|end| split.on[*end as usize][axis] == patch.brick[axis]) {
                        edges.push((axis as u8, grid.brick(patch.brick) as u32, from, to));
                    }
                }
            }
        }
        edges.sort_unstable();
        let bricks = grid.len();
        let mut sections = Sections {
            grid,
            first_node: split.points.len() as u32,
            sections: Vec::new(),
            triangles: Vec::new(),
            offsets: Vec::with_capacity(3 * bricks + 1),
            inside: Vec::new(),
            cut: Vec::new(),
        };
        sections.mark_nodes(split, &edges);
        sections.mark_leaves(split, &edges);
        let mut next = 0;
        for axis in 0..3 {
            for brick in 0..bricks {
                sections.offsets.push(sections.sections.len() as u32);
                let first = next;
                while next < edges.len() && (edges[next].0, edges[next].1) == (axis, brick as u32) {
                    next += 1;
                }
                let place = sections.grid.place(brick);
                if next > first {
                    sections.cut(split, axis as usize, place, &edges[first..next]);
                    continue;
                }
                if !sections.inside[sections.grid.node(place)] {
                    continue;
                }
                let size = sections.whole_face(axis as usize, place);
                if size > 0 {
                    let triangles = sections.triangles.len()..sections.triangles.len();
                    let area = f64::from(size * size);
                    sections.sections.push(Section { axis, brick: brick as u32, size, triangles, area });
                }
            }
        }
        sections.offsets.push(sections.sections.len() as u32);
        sections
    }

    /// The sections on the lower face of a brick.
    pub(super) fn on(&self, axis: usize, brick: usize) -> Range<usize> {
        let face = axis * self.grid.len() + brick;
        self.offsets[face] as usize..self.offsets[face + 1] as usize
    }

    /// Whether a corner between bricks lies in the solid.
    pub(super) fn is_inside(&self, node: usize) -> bool {
        self.inside[node]
    }

    /// The place of a corner of sections.
    pub(super) fn point(&self, split: &Split, corner: u32) -> Vec3 {
        match split.points.get(corner as usize) {
            Some(point) => *point,
            None => Point::from(self.grid.node_place((corner - self.first_node) as usize).each(f64::from)),
        }
    }

    /// The corners of a whole face, around its axis.
    pub(super) fn corners(&self, section: &Section) -> [u32; 4] {
        let (place, [b, c]) = (self.grid.place(section.brick as usize), others(section.axis as usize));
        [[0, 0], [1, 0], [1, 1], [0, 1]].each(|[along, across]| {
            let mut at = place;
            at[b] += along * section.size;
            at[c] += across * section.size;
            self.first_node + self.grid.node(at) as u32
        })
    }

    /// Whether the surface leaves a leaf alone that is larger than a brick, and the faces around it.
    pub(super) fn is_whole_leaf(&self, leaf: [i32; 3]) -> bool {
        self.cut.get(self.grid.brick(leaf)).is_some_and(|cut| !cut) && self.grid.size(leaf) > 1
    }

    /// Marks the leaves that have patches in them or edges of sections on their faces.
    fn mark_leaves(&mut self, split: &Split, edges: &[Edge]) {
        if self.grid.is_even() {
            return;
        }
        self.cut = vec![false; self.grid.len()];
        let grid = &self.grid;
        let mut mark = |place: [i32; 3]| self.cut[grid.brick(grid.leaf(place))] = true;
        split.patches.iter().for_each(|patch| mark(patch.brick));
        for &(axis, brick, ..) in edges {
            let mut place = grid.place(brick as usize);
            mark(place);
            place[axis as usize] -= 1;
            if place[axis as usize] >= 0 {
                mark(place);
            }
        }
    }

    /// The size of the whole face that begins at the lower face of a brick: that of the smaller leaf between two whole ones, and one
    /// beside leaves that the surface cuts; none within whole leaves.
    fn whole_face(&self, axis: usize, place: [i32; 3]) -> i32 {
        if self.grid.is_even() || place[axis] == 0 {
            return 1;
        }
        let mut below = place;
        below[axis] -= 1;
        let sizes = [place, below].each(|place| self.grid.size(place));
        let leaves = [place, below].each(|place| self.grid.leaf(place));
        if !leaves.iter().all(|leaf| self.is_whole_leaf(*leaf)) {
            return 1;
        }
        let size = sizes[0].min(sizes[1]);
        let begins = others(axis).iter().all(|&other| place[other] % size == 0);
        if leaves[0] != leaves[1] && begins { size } else { 0 }
    }

    /// Marks the corners between bricks that lie in the solid: along lines of the last axis the surface is crossed at points of
    /// two planes, and the section's edge there tells whether the line enters or leaves.
    fn mark_nodes(&mut self, split: &Split, edges: &[Edge]) {
        self.inside = vec![false; self.grid.nodes()];
        let mut crossings: Vec<(usize, i32, i32)> = Vec::new();
        for &(axis, brick, from, to) in edges.iter().filter(|edge| edge.0 == 0) {
            let mut place = self.grid.place(brick as usize);
            for (end, step) in [(from, 1), (to, -1)] {
                if split.on[end as usize][1] == place[1] {
                    let height = split.points[end as usize][2].floor() as i32;
                    place[2] = 0;
                    crossings.push((self.grid.node(place), height, step));
                }
            }
            debug_assert_eq!(axis, 0);
        }
        crossings.sort_unstable();
        let layer = (self.grid.counts[0] + 1) * (self.grid.counts[1] + 1);
        for line in crossings.chunk_by(|a, b| a.0 == b.0) {
            let mut depth = 0;
            for pair in line.windows(2) {
                depth += pair[0].2;
                if depth > 0 {
                    (pair[0].1 + 1..=pair[1].1)
                        .for_each(|height| self.inside[line[0].0 + layer * height as usize] = true);
                }
            }
        }
    }

    /// The sections on the lower face of a brick that the surface cuts.
    fn cut(&mut self, split: &Split, axis: usize, place: [i32; 3], edges: &[Edge]) {
        let [b, c] = others(axis);
        let corner = |point: u32| -> Corner {
            let x = self.point(split, point);
            (point, Vec2::new(x[b] - f64::from(place[b]), x[c] - f64::from(place[c])))
        };
        let mut loops: Vec<Vec<u32>> = Vec::new();
        let mut paths: Vec<Vec<u32>> = Vec::new();
        chains(edges, |path, closed| if closed { loops.push(path) } else { paths.push(path) });
        let around = self.perimeter(axis, place);
        let parameter = |point: u32| -> f64 {
            let on = split.on[point as usize];
            let (_, at) = corner(point);
            let (x, y) = (at[0], at[1]);
            if on[c] == place[c] {
                x
            } else if on[b] == place[b] + 1 {
                1.0 + y
            } else if on[c] == place[c] + 1 {
                3.0 - x
            } else {
                4.0 - y
            }
        };
        let closed = self.linked(paths, &around, parameter);
        loops.extend(closed);
        let mut outer: Vec<(Vec<Corner>, Vec<Vec<Corner>>)> = Vec::new();
        let mut holes: Vec<Vec<Corner>> = Vec::new();
        for polygon in loops {
            let polygon: Vec<Corner> = polygon.into_mapped(corner);
            match polygon.len() > 2 && area(&polygon) < 0.0 {
                true => holes.push(polygon),
                false => outer.push((polygon, Vec::new())),
            }
        }
        for hole in holes {
            let around = outer.iter().enumerate().filter(|(_, other)| holds(&other.0, hole[0].1));
            let smallest = around.min_by(|x, y| area(&x.1.0).total_cmp(&area(&y.1.0))).map(|(place, _)| place);
            match smallest {
                Some(place) => outer[place].1.push(hole),
                // Rounding of a section without width.
                None => outer.push((hole, Vec::new())),
            }
        }
        for (polygon, holes) in outer {
            let whole = holes.summed(|hole| area(hole)) + if polygon.len() > 2 { area(&polygon) } else { 0.0 };
            let first = self.triangles.len();
            self.triangles.extend(triangles(polygon, holes));
            let triangles = first..self.triangles.len();
            if !triangles.is_empty() {
                let brick = self.grid.brick(place) as u32;
                self.sections.push(Section { axis: axis as u8, brick, size: 1, triangles, area: 0.5 * whole });
            }
        }
    }

    /// The corners of a face around it, and whether they lie in the solid.
    fn perimeter(&self, axis: usize, place: [i32; 3]) -> [(u32, bool); 4] {
        let brick = self.grid.brick(place) as u32;
        let section = Section { axis: axis as u8, brick, size: 1, triangles: 0..0, area: 1.0 };
        self.corners(&section).each(|corner| (corner, self.inside[(corner - self.first_node) as usize]))
    }

    /// Paths through a face linked along its perimeter to loops, counterclockwise. Where paths end and begin takes turns;
    /// points that rounding has put in the other order are taken in turn too.
    fn linked(&self, paths: Vec<Vec<u32>>, around: &[(u32, bool); 4], parameter: impl Fn(u32) -> f64) -> Vec<Vec<u32>> {
        if paths.is_empty() {
            return if around[0].1 { vec![around.each(|corner| corner.0).to_vec()] } else { Vec::new() };
        }
        // Parameter, path, whether it begins.
        let mut events: Vec<(f64, usize, bool)> = Vec::with_capacity(2 * paths.len());
        for (number, path) in paths.iter().enumerate() {
            events.push((parameter(path[0]), number, true));
            events.push((parameter(path[path.len() - 1]), number, false));
        }
        order::sort(&mut events, &|x, y| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1)));
        let mut begins = around[0].1;
        for k in 0..events.len() {
            if let Some(other) = (k..events.len()).find(|&other| events[other].2 == begins) {
                events[k..=other].rotate_right(1);
            }
            begins = !begins;
        }
        // Where each path leads to, with the corners in between.
        let mut next: Vec<(usize, Vec<u32>)> = vec![(usize::MAX, Vec::new()); paths.len()];
        for (k, &(from, path, begins)) in events.iter().enumerate() {
            if begins {
                continue;
            }
            let (to, follower, _) = events[(k + 1) % events.len()];
            let wraps = k + 1 == events.len();
            let corners = (0..8).filter(|&side| {
                let at = side as f64;
                if wraps { at > from && at <= to + 4.0 && side >= 1 } else { at > from && at <= to && side < 4 }
            });
            next[path] = (follower, corners.map(|side: usize| around[side % 4].0).collect());
        }
        let mut seen = vec![false; paths.len()];
        let mut loops = Vec::new();
        for first in 0..paths.len() {
            let mut polygon = Vec::new();
            let mut path = first;
            while path != usize::MAX && !std::mem::replace(&mut seen[path], true) {
                polygon.extend_from_slice(&paths[path]);
                polygon.extend_from_slice(&next[path].1);
                path = next[path].0;
            }
            if !polygon.is_empty() {
                loops.push(polygon);
            }
        }
        loops
    }
}

/// The axes that follow one.
pub(super) fn others(axis: usize) -> [usize; 2] {
    [(axis + 1) % 3, (axis + 2) % 3]
}

/// Edges joined end to end: hands out each path with whether it is closed.
fn chains(edges: &[Edge], mut found: impl FnMut(Vec<u32>, bool)) {
    // Edges are sorted by where they begin.
    let mut used = vec![false; edges.len()];
    let mut ends: Vec<u32> = edges.mapped(|edge| edge.3);
    ends.sort_unstable();
    let follower = |point: u32, used: &[bool]| {
        let first = edges.partition_point(|edge| edge.2 < point);
        (first..edges.len()).take_while(|&k| edges[k].2 == point).find(|&k| !used[k])
    };
    let starts = |k: &usize| ends.binary_search(&edges[*k].2).is_err();
    let order: Vec<usize> = (0..edges.len()).filter(starts).chain(0..edges.len()).collect();
    for first in order {
        if used[first] {
            continue;
        }
        let mut path = vec![edges[first].2];
        let mut next = Some(first);
        while let Some(edge) = next {
            used[edge] = true;
            path.push(edges[edge].3);
            next = follower(edges[edge].3, &used);
        }
        let closed = path.first() == path.last();
        if closed {
            path.pop();
        }
        found(path, closed);
    }
}
