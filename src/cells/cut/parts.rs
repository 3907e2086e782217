//! Connected parts of a solid in the bricks of a lattice, small ones joined to their neighbours.

use std::collections::HashMap;

use crate::each::{Each, EachOf};
use crate::geometry::{Disjoint, Vec3};
use crate::order;

use super::sections::{Sections, others};
use super::split::Split;
use crate::rows::Rows;

/// No part beside a section.
pub(super) const NONE: u32 = u32::MAX;

/// Volume below which a part joins a neighbour, as a part of its leaf: smaller ones turn over under large compression.
const SMALL: f64 = 0.1;

/// A connected part of the solid in one brick, or several that were joined.
#[derive(Debug, Clone)]
pub(super) struct Part {
    /// The brick that it lies in; that of the largest of several.
    pub(super) brick: u32,
    pub(super) volume: f64,
    pub(super) centre: Vec3,
    /// Sections around it, with the sign that turns them outward; none inside.
    pub(super) sections: Vec<(u32, f64)>,
    /// Patches of the surface around it.
    pub(super) patches: Vec<u32>,
}

/// All parts, and those below and above each section.
#[derive(Debug, Clone, Default)]
pub(super) struct Parts {
    pub(super) parts: Vec<Part>,
    pub(super) beside: Vec<[u32; 2]>,
}

/// Areas and centres are those of triangles: $\int n\,\mathrm dA$ and the moments that the divergence theorem needs.
fn triangle(corners: &[Vec3; 3], sign: f64, origin: &Vec3) -> (f64, Vec3) {
    let [a, b, c] = corners.each(|corner| corner - origin);
    // Of the tetrahedron to the origin.
    let volume = sign * a.dot(&b.cross(&c)) / 6.0;
    (volume, (a + b + c) * (volume / 4.0))
}

impl Parts {
    pub(super) fn new(split: &Split, by_brick: &Rows, sections: &Sections) -> Self {
        let grid = &sections.grid;
        let mut all = Parts { parts: Vec::new(), beside: vec![[NONE; 2]; sections.sections.len()] };
        for brick in 0..grid.len() {
            let place = grid.place(brick);
            if by_brick.row(brick).is_empty() && !sections.is_inside(grid.node(place)) {
                continue;
            }
            let leaf = grid.leaf(place);
            if sections.is_whole_leaf(leaf) {
                if leaf == place {
                    all.push(whole_leaf(sections, brick as u32, place));
                }
                continue;
            }
            if by_brick.row(brick).is_empty() {
                let around = around(sections, brick, place);
                let centre = Vec3::from(place.each(|at| f64::from(at) + 0.5));
                all.push(Part { brick: brick as u32, volume: 1.0, centre, sections: around, patches: Vec::new() });
                continue;
            }
            for part in cut(split, sections, brick as u32, by_brick.row(brick)) {
                all.push(part);
            }
        }
        all
    }

    fn push(&mut self, part: Part) {
        for &(section, sign) in &part.sections {
            self.beside[section as usize][usize::from(sign < 0.0)] = self.parts.len() as u32;
        }
        self.parts.push(part);
    }

    /// The part beyond a section, which the sign turns outward; none where there is no other.
    pub(super) fn across(&self, section: u32, sign: f64) -> Option<u32> {
        Some(self.beside[section as usize][usize::from(sign > 0.0)]).filter(|other| *other != NONE)
    }

    /// Parts that are connected within a leaf joined, each in the lowest brick of its leaf.
    pub(super) fn in_leaves(mut self, sections: &Sections) -> Self {
        let grid = &sections.grid;
        if grid.is_even() {
            return self;
        }
        let mut sets = Disjoint::new(self.parts.len());
        for &[below, above] in self.beside.iter().filter(|beside| !beside.contains(&NONE)) {
            let leaves = [below, above].each(|part| grid.leaf_of(self.parts[part as usize].brick));
            let [a, b] = [below, above].each(|part| sets.leader(part as usize));
            if leaves[0] == leaves[1] && a != b {
                // The larger one is the weightier centre.
                let volume = |part: usize| self.parts[part].volume;
                let (into, from) = if volume(b) > volume(a) { (b, a) } else { (a, b) };
                sets.lead(into, from);
            }
        }
        let mut joined = self.merge(sets);
        joined.parts.iter_mut().for_each(|part| part.brick = grid.leaf_of(part.brick));
        joined
    }

    /// Joins parts of less than a tenth of a leaf to the neighbour with the largest common section.
    pub(super) fn joined(mut self, sections: &Sections) -> Self {
        let count = self.parts.len();
        let mut sets = Disjoint::new(count);
        let mut volumes: Vec<f64> = self.parts.mapped(|part| part.volume);
        let mut members: HashMap<u32, Vec<u32>> = HashMap::new();
        let size = |part: &Part| f64::from(sections.grid.size(sections.grid.place(part.brick as usize)));
        let least: Vec<f64> = self.parts.mapped(|part| SMALL * size(part).powi(3));
        let mut small: Vec<u32> =
            (0..count as u32).filter(|&part| volumes[part as usize] < least[part as usize]).collect();
        order::sort(&mut small, &|&a, &b| volumes[a as usize].total_cmp(&volumes[b as usize]));
        for part in small {
            let own = sets.leader(part as usize) as u32;
            if volumes[own as usize] >= least[own as usize] {
                continue;
            }
            let mut areas: Vec<(u32, f64)> = Vec::new();
            let all = members.get(&own).cloned().unwrap_or_else(|| vec![own]);
            for &(section, sign) in all.iter().flat_map(|&member| &self.parts[member as usize].sections) {
                let Some(other) = self.across(section, sign) else { continue };
                let other = sets.leader(other as usize) as u32;
                let area = sections.sections[section as usize].area.abs();
                if other != own {
                    order::accumulate(&mut areas, other, area);
                }
            }
            let largest = areas.iter().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            let Some(&(other, _)) = largest else { continue };
            let (into, from) =
                if volumes[other as usize] >= volumes[own as usize] { (other, own) } else { (own, other) };
            sets.lead(into as usize, from as usize);
            volumes[into as usize] += volumes[from as usize];
            let moved = members.remove(&from).unwrap_or_else(|| vec![from]);
            members.entry(into).or_insert_with(|| vec![into]).extend(moved);
        }
        self.merge(sets)
    }

    /// One part for each set, the sections inside left out.
    fn merge(&mut self, mut sets: Disjoint) -> Self {
        let (of, _) = sets.numbered();
        let leaders = self.parts.iter().enumerate().filter(|(number, _)| sets.leader(*number) == *number);
        let bare = |(_, part): (_, &Part)| Part { sections: Vec::new(), patches: Vec::new(), ..part.clone() };
        let mut merged: Vec<Part> = leaders.map(bare).collect();
        for (place, part) in std::mem::take(&mut self.parts).into_iter().enumerate() {
            let into = &mut merged[of[place] as usize];
            if sets.leader(place) != place {
                let whole = into.volume + part.volume;
                into.centre = (into.centre * into.volume + part.centre * part.volume) / whole;
                into.volume = whole;
            }
            into.patches.extend(part.patches);
            into.sections.extend(part.sections.into_iter().filter(|&(section, sign)| {
                self.across(section, sign).is_none_or(|other| of[other as usize] != of[place])
            }));
        }
        for beside in &mut self.beside {
            beside.iter_mut().filter(|part| **part != NONE).for_each(|part| *part = of[*part as usize]);
        }
        Parts { parts: merged, beside: std::mem::take(&mut self.beside) }
    }

    /// Connected parts within blocks of bricks, and how many.
    pub(super) fn connected(&self, block: impl Fn(u32) -> usize) -> (Vec<u32>, usize) {
        let mut sets = Disjoint::new(self.parts.len());
        let blocks: Vec<usize> = self.parts.mapped(|part| block(part.brick));
        for &[below, above] in &self.beside {
            if below != NONE && above != NONE && blocks[below as usize] == blocks[above as usize] {
                sets.join(below as usize, above as usize);
            }
        }
        sets.numbered()
    }
}

/// The part that fills a leaf.
fn whole_leaf(sections: &Sections, brick: u32, place: [i32; 3]) -> Part {
    let size = sections.grid.size(place);
    let mut around = Vec::with_capacity(6);
    for axis in 0..3 {
        let [b, c] = others(axis);
        for (end, sign) in [(0, -1.0), (size, 1.0)] {
            for (j, k) in (0..size).flat_map(|k| (0..size).map(move |j| (j, k))) {
                let mut at = place;
                (at[axis], at[b], at[c]) = (at[axis] + end, at[b] + j, at[c] + k);
                around.extend(sections.on(axis, sections.grid.brick(at)).map(|section| (section as u32, sign)));
            }
        }
    }
    let centre = Vec3::from(place.each(|at| f64::from(at) + 0.5 * f64::from(size)));
    Part { brick, volume: f64::from(size).powi(3), centre, sections: around, patches: Vec::new() }
}

/// The sections on the faces of a brick, with the signs that turn them outward.
fn around(sections: &Sections, brick: usize, place: [i32; 3]) -> Vec<(u32, f64)> {
    let mut around = Vec::with_capacity(6);
    for axis in 0..3 {
        around.extend(sections.on(axis, brick).map(|section| (section as u32, -1.0)));
        let mut above = place;
        above[axis] += 1;
        around.extend(sections.on(axis, sections.grid.brick(above)).map(|section| (section as u32, 1.0)));
    }
    around
}

/// The connected parts of the solid in a brick that the surface cuts.
fn cut(split: &Split, sections: &Sections, brick: u32, patches: &[u32]) -> Vec<Part> {
    let place = sections.grid.place(brick as usize);
    let around = around(sections, brick as usize, place);
    // Elements are patches and then sections; those that share a corner are connected.
    let count = patches.len() + around.len();
    let mut sets = Disjoint::new(count);
    let mut corners: Vec<(u32, u32)> = Vec::new();
    for (element, &patch) in patches.iter().enumerate() {
        corners.extend(split.patches[patch as usize].corners.each(|corner| (corner, element as u32)));
    }
    for (element, &(section, _)) in around.iter().enumerate() {
        let element = (patches.len() + element) as u32;
        let section = &sections.sections[section as usize];
        match section.triangles.is_empty() {
            true => corners.extend(sections.corners(section).each(|corner| (corner, element))),
            false => {
                let all = sections.triangles[section.triangles.clone()].iter().flatten();
                corners.extend(all.map(|&corner| (corner, element)));
            }
        }
    }
    corners.sort_unstable();
    for pair in corners.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        sets.join(pair[0].1 as usize, pair[1].1 as usize);
    }
    let middle = Vec3::from(place.each(|at| f64::from(at) + 0.5));
    let (set_of, count) = sets.numbered();
    let empty = Part { brick, volume: 0.0, centre: Vec3::zeros(), sections: Vec::new(), patches: Vec::new() };
    let mut parts: Vec<Part> = vec![empty; count];
    for (element, set) in set_of.iter().enumerate() {
        let part = &mut parts[*set as usize];
        let mut add = |corners: [u32; 3], sign: f64| {
            let (volume, moment) = triangle(&corners.each(|corner| sections.point(split, corner)), sign, &middle);
            part.volume += volume;
            part.centre += moment;
        };
        match element.checked_sub(patches.len()) {
            None => {
                add(split.patches[patches[element] as usize].corners, 1.0);
                part.patches.push(patches[element]);
            }
            Some(place) => {
                let (section, sign) = around[place];
                each_triangle(sections, section, |corners| add(corners, sign));
                part.sections.push((section, sign));
            }
        }
    }
    enclosed(parts, split, &middle)
}

/// Hands out the triangles of a section.
pub(super) fn each_triangle(sections: &Sections, section: u32, mut with: impl FnMut([u32; 3])) {
    let section = &sections.sections[section as usize];
    if section.triangles.is_empty() {
        let [a, b, c, d] = sections.corners(section);
        with([a, b, c]);
        with([a, c, d]);
    } else {
        sections.triangles[section.triangles.clone()].iter().for_each(|corners| with(*corners));
    }
}

/// Surfaces of voids joined to the parts around them, and centres from moments.
fn enclosed(mut parts: Vec<Part>, split: &Split, middle: &Vec3) -> Vec<Part> {
    while parts.len() > 1 {
        let Some(void) = parts.iter().position(|part| part.volume < 0.0) else { break };
        let hole = parts.remove(void);
        // The largest other part has it, but for parts within parts within a single brick.
        let Some(around) = parts.iter_mut().max_by(|a, b| a.volume.total_cmp(&b.volume)) else { break };
        around.volume += hole.volume;
        around.centre += hole.centre;
        around.sections.extend(hole.sections);
        around.patches.extend(hole.patches);
    }
    for part in &mut parts {
        // Parts without volume to speak of take the mean of their corners.
        part.centre = match part.volume > 1e-9 {
            true => middle + part.centre / part.volume,
            false => {
                let corners = part.patches.iter().flat_map(|&patch| split.patches[patch as usize].corners);
                let (sum, count) = corners
                    .fold((Vec3::zeros(), 0), |(sum, count), corner| (sum + split.points[corner as usize], count + 1));
                if count > 0 { sum / f64::from(count) } else { *middle }
            }
        };
    }
    parts
}
