//! Closed surfaces of shapes: dual contouring, with a vertex for each sheet of the surface in a cell.
//!
//! Each edge of a grid that the surface crosses becomes a quadrangle between vertices in the cells around it (Ju et al. 2002;
//! Schaefer, Ju & Warren 2007). A quadrangle belongs to the surface that its edge crosses, and a vertex lies on the surfaces of all
//! quadrangles around it: on one, on the curve of two, at the point of three. So sharp edges are chains of edges of facets.

use std::collections::{BTreeSet, HashMap};

use crate::each::{Each, EachOf, array_of, list_of, point_of};
use crate::error::{GeometryError, SolidError};
use crate::geometry::{Bounds, Vec3, double_area, mean};
use crate::parallel::map_with;

use super::closed::{SAME, Solid3};
use super::crossing::crossings;
use super::place::{Crossed, Sheet, draw_back, place};
use super::program::{Node, Program};
use super::tree::Tree;

/// Points of a grid: 256 MB of signs.
const MOST: usize = 1 << 28;
/// Halvings of the edges of the grid.
const HALVINGS: usize = 20;
/// Points that are dropped where they are fewer.
const SPECK: usize = 8;
/// Rounds of drawing back vertices of facets that cross.
const ROUNDS: usize = 8;
/// Where the grid begins, in spacings before the shape: planes of a drawing lie on none of its own.
const BEFORE: [f64; 3] = [0.618_034, 0.569_840, 0.682_328];

/// The grid and which of its points are inside.
pub(super) struct Grid {
    low: Vec3,
    pub h: f64,
    counts: [usize; 3],
    inside: Vec<bool>,
}

impl Grid {
    fn new(program: &Program, bounds: &Bounds<3>, h: f64) -> Result<Self, GeometryError> {
        let low = point_of::<3>(|i| bounds.low[i] - BEFORE[i] * h);
        let wide: [f64; 3] = array_of(|i| ((bounds.high[i] - low[i]) / h).ceil() + 2.0);
        ensure!(
            wide.iter().product::<f64>() <= MOST as f64,
            GeometryError::Count {
                what: "points of the grid of a surface",
                count: wide.iter().product::<f64>() as usize,
                needed: "give a wider spacing: up to 2^28 are possible"
            }
        );
        let counts = wide.each(|count| count as usize);
        let mut grid = Grid { low, h, counts, inside: Vec::new() };
        let layers = map_with(
            counts[2],
            2,
            || (),
            |(), k| {
                let layer = counts[0] * counts[1];
                (k * layer..(k + 1) * layer).map(|point| program.at(&grid.at(point)).value < 0.0).collect::<Vec<bool>>()
            },
        );
        grid.inside = layers.concat();
        grid.drop_specks();
        Ok(grid)
    }

    fn neighbours(&self, point: usize) -> impl Iterator<Item = usize> + '_ {
        let index = self.index(point);
        (0..3).flat_map(move |axis| {
            let stride = self.stride(axis);
            let before = (index[axis] > 0).then(|| point - stride);
            [before, (index[axis] + 1 < self.counts[axis]).then_some(point + stride)].into_iter().flatten()
        })
    }

    /// Turns groups of few points: sharp edges of less than a right angle leave them apart from what they belong to.
    fn drop_specks(&mut self) {
        for point in 0..self.inside.len() {
            let side = self.inside[point];
            if self.neighbours(point).any(|other| self.inside[other] == side && other < point) {
                // Its group was looked at with that one, or is large.
                continue;
            }
            let mut group = vec![point];
            let mut next = 0;
            while next < group.len() && group.len() < SPECK {
                for other in self.neighbours(group[next]) {
                    if self.inside[other] == side && !group.contains(&other) {
                        group.push(other);
                    }
                }
                next += 1;
            }
            if group.len() < SPECK {
                group.iter().for_each(|&member| self.inside[member] = !side);
            }
        }
    }

    fn stride(&self, axis: usize) -> usize {
        self.counts[..axis].iter().product()
    }

    fn index(&self, point: usize) -> [usize; 3] {
        [point % self.counts[0], point / self.counts[0] % self.counts[1], point / (self.counts[0] * self.counts[1])]
    }

    fn at(&self, point: usize) -> Vec3 {
        let index = self.index(point);
        point_of::<3>(|i| self.low[i] + index[i] as f64 * self.h)
    }

    /// Crossed edges by rising point, then axis, and where they are crossed.
    fn crossed(&self, program: &Program) -> Vec<Crossed> {
        let layer = self.counts[0] * self.counts[1];
        let layers = map_with(
            self.counts[2],
            2,
            || (),
            |(), k| {
                let mut found = Vec::new();
                for point in k * layer..(k + 1) * layer {
                    let index = self.index(point);
                    for axis in 0..3 {
                        let next = point + self.stride(axis);
                        if index[axis] + 1 == self.counts[axis] || self.inside[point] == self.inside[next] {
                            continue;
                        }
                        let (mut inner, mut outer) = (self.at(point), self.at(next));
                        if !self.inside[point] {
                            std::mem::swap(&mut inner, &mut outer);
                        }
                        for _ in 0..HALVINGS {
                            let middle = (inner + outer) * 0.5;
                            if program.at(&middle).value < 0.0 { inner = middle } else { outer = middle }
                        }
                        let at = (inner + outer) * 0.5;
                        let found_there = program.at(&at);
                        found.push(Crossed {
                            edge: 3 * point + axis,
                            rises: self.inside[point],
                            at,
                            surface: found_there.surface,
                            sign: found_there.sign,
                            sheets: [u32::MAX; 4],
                        });
                    }
                }
                found
            },
        );
        layers.concat()
    }

    /// Whether the grid's outermost points are all outside.
    fn is_closed(&self) -> bool {
        (0..self.inside.len()).filter(|&point| self.inside[point]).all(|point| {
            let index = self.index(point);
            (0..3).all(|i| index[i] > 0 && index[i] + 1 < self.counts[i])
        })
    }
}

/// The edges of a cell: the axis, and the bits of their first corner.
const fn cell_edges() -> [(usize, usize); 12] {
    let mut edges = [(0, 0); 12];
    let (mut count, mut axis) = (0, 0);
    while axis < 3 {
        let mut corner = 0;
        while corner < 8 {
            if corner >> axis & 1 == 0 {
                edges[count] = (axis, corner);
                count += 1;
            }
            corner += 1;
        }
        axis += 1;
    }
    edges
}

const EDGES: [(usize, usize); 12] = cell_edges();

fn edge_of(axis: usize, corner: usize) -> usize {
    EDGES.iter().position(|edge| *edge == (axis, corner)).unwrap_or(0)
}

/// The sheets of the surface in a cell with these corners inside (bits): for each crossed edge the number of its sheet.
/// Inside corners that meet across a face alone are kept apart, so that cells on both sides of it agree.
fn sheets(inside: usize) -> ([u8; 12], u8) {
    const NONE: u8 = u8::MAX;
    let is_in = |corner: usize| inside >> corner & 1 == 1;
    // The two edges that each edge is joined with, by its two faces.
    let mut joined = [[NONE; 2]; 12];
    let mut join = |a: usize, b: usize| {
        for (a, b) in [(a, b), (b, a)] {
            let place = usize::from(joined[a][0] != NONE);
            joined[a][place] = b as u8;
        }
    };
    for axis in 0..3 {
        let (u, v) = (1usize << ((axis + 1) % 3), 1usize << ((axis + 2) % 3));
        for base in [0, 1 << axis] {
            let around = [base, base | u, base | u | v, base | v];
            // The edge from each corner to the next one around.
            let edges: [usize; 4] = array_of(|k| {
                let (from, to) = (around[k], around[(k + 1) % 4]);
                edge_of((from ^ to).trailing_zeros() as usize, from & to)
            });
            let crossed: Vec<usize> = (0..4).filter(|&k| is_in(around[k]) != is_in(around[(k + 1) % 4])).collect();
            match crossed[..] {
                [a, b] => join(edges[a], edges[b]),
                [_, _, _, _] => {
                    (0..4).filter(|&k| is_in(around[k])).for_each(|k| join(edges[(k + 3) % 4], edges[k]));
                }
                _ => {}
            }
        }
    }
    let mut sheet = [NONE; 12];
    let mut count = 0;
    for first in 0..12 {
        if joined[first][0] == NONE || sheet[first] != NONE {
            continue;
        }
        let mut edge = first;
        while sheet[edge] == NONE {
            sheet[edge] = count;
            let [a, b] = joined[edge];
            edge = usize::from(if sheet[usize::from(a)] == NONE { a } else { b });
        }
        count += 1;
    }
    (sheet, count)
}

/// Numbers the sheets of all cells and tells the crossed edges of theirs.
fn link(grid: &Grid, crossed: &mut [Crossed]) -> Vec<Sheet> {
    let table: Vec<([u8; 12], u8)> = list_of(256, sheets);
    let shift: [usize; 8] = array_of(|corner| (0..3).filter(|i| corner >> i & 1 == 1).map(|i| grid.stride(i)).sum());
    let mut cells: HashMap<usize, u32> = HashMap::new();
    let mut list = Vec::new();
    for place in 0..crossed.len() {
        let (point, axis) = (crossed[place].edge / 3, crossed[place].edge % 3);
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        // Cells around the edge, counter-clockwise seen against it.
        for (k, (du, dv)) in [(0, 0), (1, 0), (1, 1), (0, 1)].into_iter().enumerate() {
            let cell = point - du * grid.stride(u) - dv * grid.stride(v);
            let inside =
                (0..8).filter(|&corner| grid.inside[cell + shift[corner]]).map(|corner| 1 << corner).sum::<usize>();
            let (sheet, count) = &table[inside];
            let first = *cells.entry(cell).or_insert_with(|| {
                let middle = grid.at(cell) + Vec3::repeat(0.5 * grid.h);
                list.extend((0..*count).map(|_| Sheet::new(middle)));
                list.len() as u32 - u32::from(*count)
            });
            let number = first + u32::from(sheet[edge_of(axis, du << u | dv << v)]);
            crossed[place].sheets[k] = number;
            list[number as usize].crossed.push(place as u32);
        }
    }
    list
}

/// The solid within the surface of a shape, on a grid of spacing `h` over its bounds.
pub(super) fn contour(node: &Node, bounds: &Bounds<3>, h: f64) -> Result<Solid3, GeometryError> {
    let program = Program::new(node, bounds.extent().amax());
    let grid = Grid::new(&program, bounds, h)?;
    ensure!(grid.is_closed(), SolidError::Coarse { at: bounds.low.into(), spacing: h });
    let mut crossed = grid.crossed(&program);
    ensure!(
        !crossed.is_empty(),
        SolidError::Empty {
            what: "nothing is inside of the shape",
            remedy: "check its sizes and signs, or give a finer spacing"
        }
    );
    let mut sheets = link(&grid, &mut crossed);
    let mut vertices = place(&program, &mut crossed, &mut sheets, h);
    let (mut facets, mut surfaces) = triangles(&program, &crossed, &vertices);
    for _ in 0..ROUNDS {
        let crossing = crossings(&vertices, &facets, &Tree::new(&vertices, &facets));
        if crossing.is_empty() {
            break;
        }
        let corners = crossing.iter().flat_map(|pair| pair.facets).flat_map(|facet| facets[facet as usize]);
        let which: BTreeSet<u32> = corners.collect();
        draw_back(&program, &crossed, &mut sheets, &mut vertices, h, which);
        (facets, surfaces) = triangles(&program, &crossed, &vertices);
    }
    let names = &program.names;
    Solid3::named_by(&vertices, &facets, SAME, |facet| names[surfaces[facet] as usize].as_deref())
}

/// Two triangles for each crossed edge, and the surfaces that they are of.
fn triangles(program: &Program, crossed: &[Crossed], vertices: &[Vec3]) -> (Vec<[u32; 3]>, Vec<u32>) {
    let mut facets = Vec::with_capacity(2 * crossed.len());
    let mut surfaces = Vec::with_capacity(2 * crossed.len());
    for crossing in crossed {
        let quad = crossing.outward();
        let x = quad.each(|vertex| vertices[vertex as usize]);
        let centre = mean(&x);
        let normal = program.surfaces[crossing.surface as usize].gradient(&centre) * crossing.sign;
        // The diagonal whose worse triangle is the better one, seen along the normal.
        let quality = |corners: [usize; 3]| {
            let x = corners.each(|k| x[k]);
            let longest = [0, 1, 2].largest(|&k| (x[k] - x[(k + 1) % 3]).norm_squared());
            double_area(&x).dot(&normal) / longest.max(f64::MIN_POSITIVE)
        };
        let pairs = [[[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]];
        let worst = pairs.each(|pair| quality(pair[0]).min(quality(pair[1])));
        for triangle in pairs[usize::from(worst[1] > worst[0])] {
            facets.push(triangle.each(|k| quad[k]));
            surfaces.push(crossing.surface);
        }
    }
    (facets, surfaces)
}
