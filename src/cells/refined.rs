//! Lattices refined where it matters: macro cells of four, halved again and again.

mod cells;
mod subcells;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use nalgebra::Matrix2;

use crate::each::{Each, EachOf, array_of, list_of};
use crate::error::{ApproximationError, GeometryError};
use crate::geometry::{Domain, Point, Side, Vec2};
use crate::order;
use crate::particles::{Particles, Support};

use super::brick::{Shape, determinant, multilinear};
use super::{Lattice, Layout};

/// Halvings of a cell at most: spacings stay above 1/16 of the coarsest.
const DEEPEST: u32 = 4;
/// Integer length of a cell of the coarsest level: its halvings and their middles are whole numbers.
const UNIT: u32 = 1 << (DEEPEST + 1);

/// A macro cell that is not refined further: four cells, lower corner and level.
type Macro = (u32, u32, u32);

/// One cell: its corners around it, and the particle in the middle of each side where a finer cell has one.
#[derive(Debug, Clone, PartialEq)]
struct Cell {
    corners: [u32; 4],
    hanging: [Option<u32>; 4],
}

/// A lattice in two dimensions whose macro cells (2 × 2 cells, the default's pressure zones) are refined one by one.
///
/// Neighbouring macro cells differ by one halving at most. Where they differ, a *hanging* particle lies on the
/// side of the coarser cell: a particle like all others, since shape functions need no matching mesh; the sub-cells
/// on both sides share their facets, so that the patch test stays exact.
///
/// ```
/// use std::sync::Arc;
/// use rkpm::cells::{Cells, Refined};
/// use rkpm::prelude::*;
/// let coarse = Refined::new(Arc::new(Block::new([0.0, 0.0], [1.0, 1.0])), [4, 4])?;
/// let fine = coarse.refined(&[0])?; // the macro cell in the lower left
/// assert_eq!((coarse.positions().len(), fine.positions().len()), (25, 41));
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Clone)]
pub struct Refined {
    domain: Arc<dyn Domain<2>>,
    base: Lattice<2>,
    macros: BTreeSet<Macro>,
    positions: Vec<Vec2>,
    /// Integer coordinates of the particles.
    places: Vec<(u32, u32)>,
    /// Four cells for each macro cell, in its order.
    cells: Vec<Cell>,
    spacing: Vec<Vec2>,
    /// Directions along the axes of the domain at each particle, as long as its spacing along them.
    axes: Vec<Matrix2<f64>>,
    /// How far the middles of curved sides on the boundary stand off their chords, by their ends, the lower one first.
    bulges: BTreeMap<(u32, u32), Vec2>,
}

impl std::fmt::Debug for Refined {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Refined").field("base", &self.base.counts()).field("macros", &self.macros.len()).finish()
    }
}

/// Cell and side that lie on a face of the unit square, and the face's order along it.
fn sides_of(face: (usize, Side)) -> usize {
    match face {
        (1, Side::Min) => 0,
        (0, Side::Max) => 1,
        (1, Side::Max) => 2,
        _ => 3,
    }
}

impl Refined {
    /// A regular lattice with `cells` cells along each axis of the unit square, nothing refined yet.
    ///
    /// # Errors
    /// For odd or absent numbers of cells, and as [`Lattice::new`].
    pub fn new(domain: Arc<dyn Domain<2>>, cells: [usize; 2]) -> Result<Self, GeometryError> {
        let base = Lattice::new(&*domain, cells.each(|c| c.saturating_add(1)), &Layout::Regular)?;
        if let Some(&count) = cells.iter().find(|&&c| c == 0 || c % 2 == 1 || c > (u32::MAX / UNIT) as usize) {
            let needed = "an even number is needed: macro cells are two cells wide";
            return Err(GeometryError::Count { what: "cells along an axis", count, needed });
        }
        let place = |k: usize| k as u32 * 2 * UNIT;
        let macros = (0..cells[1] / 2).flat_map(|j| (0..cells[0] / 2).map(move |i| (place(j), place(i), 0))).collect();
        Refined {
            domain,
            base,
            macros,
            positions: Vec::new(),
            places: Vec::new(),
            cells: Vec::new(),
            spacing: Vec::new(),
            axes: Vec::new(),
            bulges: BTreeMap::new(),
        }
        .built()
    }

    /// The same lattice with these macro cells (zones, in the order of [`zones`](super::Cells::zones) of size 2) cut into
    /// four, and with them neighbours that would else be more than one halving coarser. Macro cells that are
    /// refined four times already stay as they are.
    ///
    /// # Errors
    /// For a macro cell that does not exist, and where cells would be turned inside out.
    pub fn refined(&self, zones: &[usize]) -> Result<Self, GeometryError> {
        let all: Vec<Macro> = self.macros.iter().copied().collect();
        let mut fine = self.clone();
        for &zone in zones {
            let Some(&chosen) = all.get(zone) else {
                let needed = "name macro cells by their place among all of them";
                return Err(GeometryError::Count { what: "macro cell to refine", count: zone, needed });
            };
            fine.refine(chosen);
        }
        fine.built()
    }

    /// Whether each macro cell may be cut once more, in the order of [`zones`](super::Cells::zones) of size 2: a marker's bulk
    /// should be filled with these alone.
    pub fn refinable(&self) -> impl Iterator<Item = bool> {
        self.macros.iter().map(|m| m.2 < DEEPEST)
    }

    /// Whether each macro cell and all that come of it may be cut once more.
    pub(crate) fn refinable_twice(&self) -> impl Iterator<Item = bool> {
        self.macros.iter().map(|m| m.2 + 1 < DEEPEST)
    }

    /// For each macro cell of this lattice with all of its macro cells cut, the one of this lattice that it is part of.
    pub(crate) fn parents(&self, cut: &Self) -> Vec<usize> {
        let places: BTreeMap<Macro, usize> = self.macros.iter().copied().zip(0..).collect();
        let parent = |&(y, x, level): &Macro| {
            let level = level.saturating_sub(1);
            let width = (2 * UNIT) >> level;
            places.get(&(y / width * width, x / width * width, level)).copied().unwrap_or_default()
        };
        cut.macros.iter().map(parent).collect()
    }

    /// Cuts one macro cell, its coarser neighbours first.
    fn refine(&mut self, (y, x, level): Macro) {
        if level >= DEEPEST || !self.macros.contains(&(y, x, level)) {
            return;
        }
        let width = (2 * UNIT) >> level;
        for (dy, dx) in [(0i64, -1i64), (0, 1), (-1, 0), (1, 0)] {
            let (ny, nx) = (i64::from(y) + dy * i64::from(width), i64::from(x) + dx * i64::from(width));
            if level == 0 || ny < 0 || nx < 0 {
                continue;
            }
            // The neighbour of twice the width that covers this place, if there is one.
            let coarse = u64::from(2 * width);
            let snap = |v: i64| ((v as u64 / coarse) * coarse) as u32;
            let neighbour = (snap(ny), snap(nx), level - 1);
            if self.macros.contains(&neighbour) {
                self.refine(neighbour);
            }
        }
        self.macros.remove(&(y, x, level));
        let half = width / 2;
        for (dy, dx) in [(0, 0), (0, half), (half, 0), (half, half)] {
            self.macros.insert((y + dy, x + dx, level + 1));
        }
    }

    /// Numbers particles and cells.
    fn built(mut self) -> Result<Self, GeometryError> {
        let mut numbers: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        let mut squares = Vec::with_capacity(4 * self.macros.len());
        for &(y, x, level) in &self.macros {
            let side = UNIT >> level;
            for (dy, dx) in [(0, 0), (0, side), (side, 0), (side, side)] {
                squares.push((y + dy, x + dx, side));
            }
            for dy in 0..3 {
                for dx in 0..3 {
                    numbers.insert((y + dy * side, x + dx * side), 0);
                }
            }
        }
        for (number, (_, slot)) in numbers.iter_mut().enumerate() {
            *slot = number as u32;
        }
        let total = self.base.cell_counts().each(|c| c as f64 * f64::from(UNIT));
        self.places = numbers.keys().copied().collect();
        let unit = |&(y, x): &(u32, u32)| Vec2::new(f64::from(x) / total[0], f64::from(y) / total[1]);
        self.positions = self.places.mapped(|place| self.domain.position(&unit(place)));
        self.cells = squares.mapped(|&(y, x, side)| {
            let corners = [(y, x), (y, x + side), (y + side, x + side), (y + side, x)];
            let half = side / 2;
            let middles = [(y, x + half), (y + half, x + side), (y + side, x + half), (y + half, x)];
            Cell { corners: corners.each(|c| numbers[&c]), hanging: middles.each(|m| numbers.get(&m).copied()) }
        });
        // What leads from each particle to its neighbours along either axis of the domain.
        let mut directions = vec![[const { Vec::new() }; 2]; self.positions.len()];
        for (number, cell) in self.cells.iter().enumerate() {
            let x = cell.corners.each(|c| self.positions[c as usize]);
            let measure = determinant(&[x[1] - x[0], x[3] - x[0]]).min(determinant(&[x[3] - x[2], x[1] - x[2]]));
            ensure!(measure > 0.0 && measure.is_finite(), GeometryError::InvertedCell { cell: number, measure });
            for k in 0..4 {
                for (axis, other) in [(k % 2, (k + 1) % 4), (1 - k % 2, (k + 3) % 4)] {
                    directions[cell.corners[k] as usize][axis].push(x[other] - x[k]);
                }
                if let Some(middle) = cell.hanging[k] {
                    let at = self.positions[middle as usize];
                    let across = (x[(k + 2) % 4] + x[(k + 3) % 4]) * 0.5;
                    for (axis, to) in [(k % 2, x[k]), (k % 2, x[(k + 1) % 4]), (1 - k % 2, across)] {
                        directions[middle as usize][axis].push(to - at);
                    }
                }
            }
        }
        self.spacing = directions.mapped(|directions| largest(directions.iter().flatten().copied()));
        self.axes = directions.mapped(half_axes);
        let middles = self.sides_between(|a, b| self.domain.position(&((unit(&a) + unit(&b)) * 0.5)));
        self.bend(middles);
        Ok(self)
    }

    /// Curved sides on the boundary, with the middles that `middle(place, place)` gives.
    fn sides_between(&self, middle: impl Fn((u32, u32), (u32, u32)) -> Vec2) -> BTreeMap<(u32, u32), Vec2> {
        if !self.base.is_curved() {
            return BTreeMap::new();
        }
        let faces = [(0, Side::Min), (0, Side::Max), (1, Side::Min), (1, Side::Max)];
        let chords = faces.into_iter().flat_map(|face| self.face_chords(face));
        let middle = |(a, b): (u32, u32)| {
            let chord = (self.positions[a as usize] + self.positions[b as usize]) * 0.5;
            ((a.min(b), a.max(b)), middle(self.places[a as usize], self.places[b as usize]) - chord)
        };
        chords.map(middle).collect()
    }

    /// Lets sides follow these bulges where their cells keep their orientation.
    fn bend(&mut self, bulges: BTreeMap<(u32, u32), Vec2>) {
        self.bulges = bulges;
        for cell in 0..self.cells.len() {
            let shape = self.shape(cell);
            let measure = |place: usize| {
                let at = Vec2::new((place % 3) as f64, (place / 3) as f64) * 0.5;
                determinant(&shape.map(&at).1)
            };
            if (0..9).any(|place| !(measure(place) > 0.0)) {
                for side in 0..4 {
                    let (a, b) = self.side(cell, side);
                    self.bulges.remove(&(a.min(b), a.max(b)));
                }
            }
        }
    }

    /// The corners at the ends of a side, around the cell.
    fn side(&self, cell: usize, side: usize) -> (u32, u32) {
        let corners = &self.cells[cell].corners;
        (corners[side], corners[(side + 1) % 4])
    }

    /// How far the middle between two particles stands off their chord.
    fn bulge(&self, a: u32, b: u32) -> Vec2 {
        self.bulges.get(&(a.min(b), a.max(b))).copied().unwrap_or_else(Vec2::zeros)
    }

    /// The shape of a cell, with parabolas on curved sides.
    fn shape(&self, cell: usize) -> Shape<2> {
        let corners = self.eight(cell);
        let bulges: [Vec2; 4] = array_of(|side| {
            let (a, b) = self.side(cell, side);
            self.bulge(a, b)
        });
        if bulges == [Vec2::zeros(); 4] {
            return Shape::Straight(corners);
        }
        let mut nodes = [Vec2::zeros(); 27];
        for (place, node) in nodes.iter_mut().enumerate().take(9) {
            let (s, t) = ((place % 3) as f64 * 0.5, (place / 3) as f64 * 0.5);
            let off = [(s, 1.0 - t), (t, s), (s, t), (t, 1.0 - s)];
            *node = multilinear(&corners, &Vec2::new(s, t)).0;
            for (bulge, (along, near)) in bulges.iter().zip(off) {
                *node += bulge * (4.0 * along * (1.0 - along) * near);
            }
        }
        Shape::Curved(nodes)
    }

    /// Particles along a side of a cell, around it: two, or three with a hanging one.
    fn along(&self, cell: &Cell, side: usize) -> Vec<u32> {
        let ends = [cell.corners[side], cell.corners[(side + 1) % 4]];
        [Some(ends[0]), cell.hanging[side], Some(ends[1])].into_iter().flatten().collect()
    }

    fn supports(&self, dilation: impl Fn(usize) -> Vec2) -> Result<Particles<2>, ApproximationError> {
        let supports = list_of(self.positions.len(), |p| Support::Box(dilation(p)));
        Particles::new(self.positions.clone(), supports)
    }
}

impl Refined {
    /// Corners as the multilinear map wants them, axis 0 running fastest.
    fn eight(&self, cell: usize) -> [Vec2; 8] {
        let mut corners = [Vec2::zeros(); 8];
        for (slot, k) in corners.iter_mut().zip([0, 1, 3, 2]) {
            *slot = self.positions[self.cells[cell].corners[k] as usize];
        }
        corners
    }

    /// Chords between neighbouring particles on a face of the unit square, the body on their left, in order along
    /// the face's axis.
    fn face_chords(&self, face: (usize, Side)) -> Vec<(u32, u32)> {
        let side = sides_of(face);
        let end = if face.1 == Side::Min { 0 } else { self.base.cell_counts()[face.0] as u32 * UNIT };
        let across = |p: u32| if face.0 == 0 { self.places[p as usize].1 } else { self.places[p as usize].0 };
        let along = |p: u32| if face.0 == 0 { self.places[p as usize].0 } else { self.places[p as usize].1 };
        let chord = |cell: &Cell| (cell.corners[side], cell.corners[(side + 1) % 4]);
        let mut chords: Vec<(u32, u32)> =
            self.cells.iter().map(chord).filter(|&(a, b)| across(a) == end && across(b) == end).collect();
        let first = |&(a, b): &(u32, u32)| along(a).min(along(b));
        order::sort(&mut chords, &|a, b| first(a).cmp(&first(b)));
        chords
    }
}

/// The largest components of vectors.
fn largest(vectors: impl Iterator<Item = Vec2>) -> Vec2 {
    vectors.fold(Point::zeros(), |largest, v| largest.zip_map(&v, |l, v| l.max(v.abs())))
}

/// The mean directions to neighbours along both axes of the domain, as long as the farthest of them.
///
/// Lattices have supports half-way to a turned box; but a parallelogram sees no farther than its neighbours, and what
/// it would take from finer ones nearby costs accuracy.
fn half_axes(directions: &[Vec<Vec2>; 2]) -> Matrix2<f64> {
    let column = |directions: &Vec<Vec2>| {
        let up =
            |direction: &Vec2| direction.normalize() * if direction.dot(&directions[0]) < 0.0 { -1.0 } else { 1.0 };
        let longest = directions.largest(|direction| direction.norm());
        directions.iter().map(up).sum::<Vec2>().normalize() * longest
    };
    Matrix2::from_columns(&[column(&directions[0]), column(&directions[1])])
}
