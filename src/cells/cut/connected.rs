//! Which sub-cells of a cut lattice hold a point, and which are connected.

use std::collections::{BTreeMap, HashMap};
use std::f64::consts::PI;
use std::sync::Arc;

use crate::each::EachOf;
use crate::geometry::{Bounds, Vec3};
use crate::neighbours::Adjacent;
use crate::parallel::map_with;
use crate::rows::Rows;
use crate::solid::solid_angle;

use super::frame::Frame;
use super::parts::{NONE, Parts, each_triangle};
use super::sections::Sections;
use super::split::Split;

/// Divisions of a leaf along each axis.
pub(super) const FINER: i32 = 4;
/// Where the first plane between divisions lies, in their size: no simple fraction, so that the surface seldom lies in one.
pub(super) const FIRST: f64 = 0.4383;
/// Part of the full solid angle that a sub-cell fills around the points that it holds: that of a sharp corner.
const HELD: f64 = 0.01;
/// Triangles whose plane a point lies in to this share of its distances from their corners fill no angle.
const EDGE_ON: f64 = 1e-9;

/// Sub-cells by the bricks that they have volume in, in coordinates of the lattice.
#[derive(Debug, Clone, Default)]
pub(super) struct SubCells {
    pub(super) split: Split,
    pub(super) sections: Sections,
    pub(super) parts: Parts,
    /// Those of each leaf, by its lowest brick.
    by_leaf: Rows,
    /// The one that each patch bounds.
    pub(super) of_patch: Vec<u32>,
    /// What those at the roots of slots are divided into.
    pub(super) divisions: Divisions,
}

/// What sub-cells at the roots of slots are divided into, numbered behind all sub-cells.
#[derive(Debug, Clone, Default)]
pub(super) struct Divisions {
    /// The number of sub-cells and divisions.
    pub(super) count: usize,
    /// By the number of the sub-cell.
    pub(super) of_part: BTreeMap<u32, Divided>,
    /// What lies beside divisions and the sub-cells around them, with a box around the face between.
    pub(super) beside: HashMap<u32, Vec<(u32, Bounds<3>)>>,
}

/// A sub-cell divided by planes of its own: in its coordinates those are integers.
#[derive(Debug, Clone, Default)]
pub(super) struct Divided {
    /// The number of its first division.
    pub(super) first: u32,
    /// Bricks along each side of its leaf.
    pub(super) size: i32,
    /// The corner of leaves that its coordinates are counted from.
    pub(super) low: Vec3,
    pub(super) cells: SubCells,
    /// The pieces of each patch of the surface.
    pub(super) of_patch: HashMap<u32, Vec<u32>>,
}

impl Divided {
    /// Planes per brick.
    fn per_brick(&self) -> f64 {
        f64::from(FINER) / f64::from(self.size)
    }

    /// A place of the lattice in its coordinates.
    pub(super) fn local(&self, x: &Vec3) -> Vec3 {
        (x - self.low).map(|x| x * self.per_brick() + FIRST)
    }

    /// The place of its coordinates in the lattice.
    pub(super) fn place(&self, u: &Vec3) -> Vec3 {
        self.low + u.map(|u| (u - FIRST) / self.per_brick())
    }

    /// The same of a box.
    pub(super) fn in_lattice(&self, face: &Bounds<3>) -> Bounds<3> {
        Bounds { low: self.place(&face.low), high: self.place(&face.high) }
    }

    /// Adds the divisions that hold a place of the lattice, the nearest one where it lies outside of all.
    fn at(&self, x: &Vec3, found: &mut Vec<u32>) {
        let (u, first) = (self.local(x), found.len());
        self.cells.at(&u, found);
        if found.len() == first {
            let away = |part: &u32| (self.cells.parts.parts[*part as usize].centre - u).norm_squared();
            found.extend((0..self.cells.parts.parts.len() as u32).min_by(|a, b| away(a).total_cmp(&away(b))));
        }
        found[first..].iter_mut().for_each(|number| *number += self.first);
    }
}

impl SubCells {
    pub(super) fn new(split: Split, sections: Sections, parts: Parts) -> Self {
        let mut of_patch = vec![NONE; split.patches.len()];
        let mut pairs: Vec<(u32, u32)> = Vec::with_capacity(parts.parts.len());
        let grid = &sections.grid;
        for (number, part) in parts.parts.iter().enumerate() {
            pairs.push((part.brick, number as u32));
            for &patch in &part.patches {
                of_patch[patch as usize] = number as u32;
                pairs.push((grid.brick(grid.leaf(split.patches[patch as usize].brick)) as u32, number as u32));
            }
        }
        pairs.sort_unstable();
        pairs.dedup();
        let by_leaf = Rows::new(grid.len(), &|add| pairs.iter().for_each(|&(brick, part)| add(brick as usize, part)));
        SubCells { split, sections, parts, by_leaf, of_patch, divisions: Divisions::default() }
    }

    /// The place of a corner of sections.
    pub(super) fn point(&self, corner: u32) -> Vec3 {
        self.sections.point(&self.split, corner)
    }

    /// Whether some of the solid lies in the leaf that begins with a brick.
    pub(super) fn holds(&self, brick: usize) -> bool {
        !self.of(brick).is_empty()
    }

    fn of(&self, brick: usize) -> &[u32] {
        self.by_leaf.row(brick)
    }

    /// Hands out the sub-cells with a box around each leaf that they have volume in, as far around it as points of the leaf may lie.
    fn each_box(&self, mut with: impl FnMut(u32, Bounds<3>)) {
        let grid = &self.sections.grid;
        for brick in 0..grid.len() {
            for &part in self.of(brick) {
                let place = grid.place(brick);
                let [low, high] = [0, grid.size(place)].each(|end| Vec3::from(place.each(|at| f64::from(at + end))));
                with(part, Bounds { low, high }.widened(&Vec3::repeat(EDGE_ON)));
            }
        }
    }
}

/// The solid angle of a triangle seen from the origin; none of one whose plane the origin lies in.
fn angle(corners: [Vec3; 3]) -> f64 {
    let [a, b, c] = &corners;
    let is_edge_on = a.dot(&b.cross(c)).abs() <= EDGE_ON * a.norm() * b.norm() * c.norm();
    if is_edge_on { 0.0 } else { solid_angle(&corners) }
}

impl SubCells {
    /// The part of the full solid angle around a point that a sub-cell fills: one inside, a half on its faces.
    fn share(&self, part: u32, x: &Vec3) -> f64 {
        let part = &self.parts.parts[part as usize];
        let mut sum = 0.0;
        let point = |corner: u32| self.point(corner) - x;
        for &(section, sign) in &part.sections {
            each_triangle(&self.sections, section, |corners| sum += sign * angle(corners.each(point)));
        }
        for &patch in &part.patches {
            sum += angle(self.split.patches[patch as usize].corners.each(point));
        }
        sum / (4.0 * PI)
    }

    /// Adds the sub-cells that hold a point, or the one nearby that it is most inside of: points of a rule may lie a little outside.
    pub(super) fn at(&self, x: &Vec3, found: &mut Vec<u32>) {
        let first = found.len();
        for reach in [EDGE_ON, self.sections.grid.scale(x)] {
            self.within(x, reach, found);
            if found.len() > first {
                break;
            }
        }
        if found[first..].iter().any(|part| self.divisions.of_part.contains_key(part)) {
            for part in found.split_off(first) {
                match self.divisions.of_part.get(&part) {
                    Some(divided) => divided.at(x, found),
                    None => found.push(part),
                }
            }
        }
    }

    /// Adds the sub-cells in whose leaves a point lies, among which are all that hold it; false where that is not known.
    fn near(&self, x: &Vec3, found: &mut Vec<u32>) -> bool {
        let grid = &self.sections.grid;
        let first = found.len();
        for leaf in grid.leaves_in(&x.add_scalar(-EDGE_ON), &x.add_scalar(EDGE_ON)) {
            for &part in self.of(grid.brick(leaf)) {
                let Some(divided) = self.divisions.of_part.get(&part) else {
                    found.push(part);
                    continue;
                };
                let own = found.len();
                if !divided.cells.near(&divided.local(x), found) {
                    return false;
                }
                found[own..].iter_mut().for_each(|number| *number += divided.first);
            }
        }
        found.len() > first
    }

    /// The sub-cells with walls in the bricks that a box meets.
    pub(super) fn cut_near(&self, within: &Bounds<3>) -> Vec<u32> {
        let grid = &self.sections.grid;
        let leaves = grid.leaves_in(&within.low, &within.high);
        let near = leaves.flat_map(|leaf| self.of(grid.brick(leaf)).iter().copied());
        near.filter(|part| !self.parts.parts[*part as usize].patches.is_empty()).collect()
    }

    /// Hands out the triangles of a patch with the sub-cells or divisions that they bound.
    pub(super) fn each_wall(&self, patch: u32, mut with: impl FnMut(u32, [Vec3; 3])) {
        let part = self.of_patch[patch as usize];
        if part == NONE {
            return;
        }
        let Some(divided) = self.divisions.of_part.get(&part) else {
            return with(part, self.split.corners(patch));
        };
        for &piece in divided.of_patch.get(&patch).into_iter().flatten() {
            let own = divided.cells.of_patch[piece as usize];
            if own != NONE {
                with(divided.first + own, divided.cells.split.corners(piece).each(|corner| divided.place(&corner)));
            }
        }
    }

    /// The same in the bricks within a distance.
    fn within(&self, x: &Vec3, reach: f64, found: &mut Vec<u32>) {
        let first = found.len();
        let mut best: Option<(f64, u32)> = None;
        let grid = &self.sections.grid;
        let leaves: Vec<[i32; 3]> = grid.leaves_in(&x.add_scalar(-reach), &x.add_scalar(reach)).collect();
        let of = |leaf: [i32; 3]| self.of(grid.brick(leaf));
        if let [leaf] = leaves[..]
            && let [only] = of(leaf)
        {
            found.push(*only);
            return;
        }
        for leaf in leaves {
            for &part in of(leaf) {
                if found[first..].contains(&part) {
                    continue;
                }
                let inside = reach < 1.0 && self.parts.parts[part as usize].patches.is_empty();
                let share = if inside { 1.0 } else { self.share(part, x) };
                if best.is_none_or(|known| known.0 < share) {
                    best = Some((share, part));
                }
                if share > HELD {
                    found.push(part);
                }
            }
        }
        if found.len() == first {
            found.extend(best.map(|(_, part)| part));
        }
    }

    /// Hands out the sub-cells beside one, with the box of the section between.
    pub(super) fn each_beside(&self, part: u32, with: &mut dyn FnMut(u32, &Bounds<3>)) {
        if let Some(beside) = self.divisions.beside.get(&part) {
            return beside.iter().for_each(|(other, face)| with(*other, face));
        }
        for &(section, sign) in &self.parts.parts[part as usize].sections {
            let Some(other) = self.parts.across(section, sign) else { continue };
            // The whole face between the bricks, however little of it the solid fills.
            let section = &self.sections.sections[section as usize];
            let low = Vec3::from(self.sections.grid.place(section.brick as usize).each(f64::from));
            let mut high = low.add_scalar(f64::from(section.size));
            high[section.axis as usize] = low[section.axis as usize];
            with(other, &Bounds { low, high });
        }
    }
}

/// Places are those of the lattice, and no cells are known around particles.
impl Adjacent<3> for SubCells {
    fn count(&self) -> usize {
        self.parts.parts.len().max(self.divisions.count)
    }

    fn at(&self, x: &Vec3, found: &mut Vec<u32>) {
        SubCells::at(self, x, found);
    }

    fn around(&self, _: u32) -> &[u32] {
        &[]
    }

    fn beside(&self, cell: u32, with: &mut dyn FnMut(u32, &Bounds<3>)) {
        self.each_beside(cell, with);
    }
}

/// The cells of a lattice as points see them: whole ones, and at the roots of slots their sub-cells and divisions.
pub(super) struct Whole {
    frame: Frame,
    cells: Arc<SubCells>,
    /// The first sub-cell of the cell that each sub-cell or division counts as; itself at the roots of slots.
    first: Vec<u32>,
    /// Those around each particle.
    around: Vec<Vec<u32>>,
    /// Those beside each, with the box of the faces between.
    beside: Vec<Vec<(u32, Bounds<3>)>>,
    /// A box around each.
    bounds: Vec<Bounds<3>>,
}

impl Whole {
    /// Cells are given by their sub-cells, particles by their places in the lattice.
    pub(super) fn new(frame: &Frame, connected: &Arc<SubCells>, cells: &[Vec<u32>], particles: &[Vec3]) -> Self {
        let divisions = &connected.divisions;
        let mut first: Vec<u32> = (0..divisions.count as u32).collect();
        for parts in cells.iter().filter(|parts| !parts.iter().any(|part| divisions.of_part.contains_key(part))) {
            parts.iter().for_each(|&part| first[part as usize] = parts[0]);
        }
        let mut beside: Vec<Vec<(u32, Bounds<3>)>> = vec![Vec::new(); first.len()];
        for (number, &own) in (0u32..).zip(&first).filter(|(number, _)| !divisions.of_part.contains_key(number)) {
            connected.each_beside(number, &mut |other, face| {
                let other = first[other as usize];
                let known = &mut beside[own as usize];
                match known.iter_mut().find(|known| known.0 == other) {
                    Some(known) => known.1 = known.1.join(face),
                    None if other != own => known.push((other, *face)),
                    None => {}
                }
            });
        }
        let mut bounds = vec![Bounds::none(); first.len()];
        let mut add = |number: u32, own: &Bounds<3>| {
            let known = &mut bounds[first[number as usize] as usize];
            *known = known.join(own);
        };
        connected.each_box(|part, own| add(part, &own));
        for own in divisions.of_part.values() {
            own.cells.each_box(|part, inner| add(own.first + part, &own.in_lattice(&inner)));
        }
        let mut all =
            Whole { frame: frame.clone(), cells: connected.clone(), first, around: Vec::new(), beside, bounds };
        let around = |x: &Vec3| {
            let mut found = Vec::new();
            all.in_lattice(x, &mut found);
            found
        };
        all.around = map_with(particles.len(), 2, || (), |(), particle| around(&particles[particle]));
        all
    }

    /// Adds what holds a point of the lattice.
    fn in_lattice(&self, u: &Vec3, found: &mut Vec<u32>) {
        let before = found.len();
        self.cells.at(u, found);
        found[before..].iter_mut().for_each(|number| *number = self.first[*number as usize]);
        found.dedup();
    }
}

impl Adjacent<3> for Whole {
    fn count(&self) -> usize {
        self.first.len()
    }

    fn at(&self, x: &Vec3, found: &mut Vec<u32>) {
        self.in_lattice(&self.frame.local(x), found);
    }

    fn near(&self, x: &Vec3, found: &mut Vec<u32>) -> bool {
        let before = found.len();
        if !self.cells.near(&self.frame.local(x), found) {
            found.truncate(before);
            self.at(x, found);
            return true;
        }
        found[before..].iter_mut().for_each(|number| *number = self.first[*number as usize]);
        found[before..].sort_unstable();
        found.dedup();
        found.len() == before + 1
    }

    fn bounds(&self, cell: u32) -> Option<&Bounds<3>> {
        self.bounds.get(cell as usize)
    }

    fn around(&self, particle: u32) -> &[u32] {
        &self.around[particle as usize]
    }

    fn beside(&self, cell: u32, with: &mut dyn FnMut(u32, &Bounds<3>)) {
        self.beside[cell as usize].iter().for_each(|(other, face)| with(*other, face));
    }

    fn in_boxes(&self, x: &Vec3) -> Vec3 {
        self.frame.local(x)
    }

    fn margin_of_boxes(&self, margin: &Vec3) -> Vec3 {
        margin / self.frame.size
    }
}
