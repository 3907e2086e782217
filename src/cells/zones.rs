//! Zones of cells that share a pressure: any, those of lattices and those of triangles.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use nalgebra::SymmetricEigen;

use crate::each::{Each, list_of};
use crate::error::GeometryError;
use crate::geometry::{Mat3, Point, Vec3, padded};
use crate::quadrature::Points;
use crate::rows::Rows;

use super::mesh::{Mesh, NONE};

/// What a zone has of free particles, and where it lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZoneParticles<const D: usize> {
    /// Particles in it and on its sides, of each the part that is free.
    pub free: f64,
    /// The middle of its volume, or of the corners of its cells \[length\].
    pub middle: Point<D>,
    /// Its thickness along the axis along which it is thinnest \[length\].
    pub thickness: f64,
}

/// What zones have of free particles at the corners of their cells.
pub(super) fn free_corners<const D: usize>(
    positions: &[Point<D>],
    corners: &[Vec<usize>],
    zones: &Zones,
    free: &dyn Fn(usize) -> f64,
) -> Vec<ZoneParticles<D>> {
    let of_zone = |range: &[usize]| {
        let mut own = Vec::new();
        for &cell in &zones.cells[range[0]..range[1]] {
            own.extend_from_slice(&corners[cell as usize]);
        }
        own.sort_unstable();
        own.dedup();
        let mut middle = Point::<D>::zeros();
        for &corner in &own {
            middle += positions[corner];
        }
        middle /= own.len().max(1) as f64;
        let off = own.mapped(|&corner| padded(&(positions[corner] - middle)));
        ZoneParticles { free: own.summed(|&corner| free(corner)), middle, thickness: thickness(&off, D) }
    };
    list_of(zones.offsets.len().saturating_sub(1), |zone| of_zone(&zones.offsets[zone..zone + 2]))
}

/// How far points lie apart along the axis along which they spread least.
fn thickness(off: &[Vec3], dimension: usize) -> f64 {
    let spread = SymmetricEigen::new(off.iter().map(|off| off * off.transpose()).sum::<Mat3>());
    let mut order = [0, 1, 2];
    crate::order::sort(&mut order, &|&a: &usize, &b| spread.eigenvalues[a].total_cmp(&spread.eigenvalues[b]));
    // The axes that the zone does not have come first.
    let across = spread.eigenvectors.column(order[3 - dimension.min(3)]);
    let [low, high] = off.iter().map(|off| off.dot(&across)).fold([0.0f64; 2], |[l, h], x| [l.min(x), h.max(x)]);
    high - low
}

/// A partition of the cells into zones that share a pressure.
#[derive(Debug, Clone, PartialEq)]
pub struct Zones {
    /// Cells ordered by zone.
    pub cells: Vec<u32>,
    /// Zone $z$ holds `cells[offsets[z]..offsets[z + 1]]`.
    pub offsets: Vec<usize>,
    /// Whether they are a share of all zones, see [`share`](Zones::share).
    partial: bool,
}

impl Zones {
    /// Zones of all cells: zone $z$ holds `cells[offsets[z]..offsets[z + 1]]`.
    pub fn new(cells: Vec<u32>, offsets: Vec<usize>) -> Self {
        Zones { cells, offsets, partial: false }
    }

    /// Each of `count` cells a zone of its own.
    pub fn single(count: usize) -> Self {
        Zones::new((0..count as u32).collect(), (0..=count).collect())
    }

    /// Share `part` of `parts`: a run of the zones in the order of the keys `key(cell)` of their first cells, as many
    /// cells in each share as the sizes of zones allow. Rules and smoothings over a share leave the other cells out.
    pub(crate) fn share(&self, part: usize, parts: usize, key: impl Fn(u32) -> u64) -> Self {
        let mut order: Vec<usize> = (0..self.offsets.len().saturating_sub(1)).collect();
        let of = |zone: usize| self.cells.get(self.offsets[zone]..self.offsets[zone + 1]).unwrap_or_default();
        let first = |zone: usize| of(zone).first().map_or(0, |&cell| key(cell));
        let keys: Vec<u64> = order.mapped(|&zone| first(zone));
        crate::order::sort(&mut order, &|&a, &b| keys[a].cmp(&keys[b]));
        let (total, parts) = (self.cells.len() as u128, parts.max(1) as u128);
        let mut share = Zones { cells: Vec::new(), offsets: vec![0], partial: true };
        let mut before = 0u128;
        for zone in order {
            let cells = of(zone);
            // The middle of the zone tells whose it is.
            let owner = (2 * before + cells.len() as u128) * parts / (2 * total).max(1);
            if owner.min(parts - 1) == part as u128 {
                share.cells.extend_from_slice(cells);
                share.offsets.push(share.cells.len());
            }
            before += cells.len() as u128;
        }
        share
    }

    /// The cells of each zone.
    pub(crate) fn each(&self) -> impl Iterator<Item = &[u32]> {
        self.offsets.windows(2).map(|zone| &self.cells[zone[0]..zone[1]])
    }

    /// Points of each cell, grouped by zone.
    ///
    /// # Errors
    /// For zones that are not those of `count` cells.
    pub(crate) fn points<const D: usize>(
        &self,
        count: usize,
        mut add: impl FnMut(usize, &mut Points<D>),
    ) -> Result<Points<D>, GeometryError> {
        self.validate(count)?;
        let mut points = Points::empty();
        for zone in self.each() {
            zone.iter().for_each(|&cell| add(cell as usize, &mut points));
            points.close_group();
        }
        Ok(points)
    }

    /// Whether they are a share of all zones.
    pub(crate) fn is_share(&self) -> bool {
        self.partial
    }

    /// Refuses zones that name cells beyond `count`, that do not name each of them once (at most once in a share), or whose
    /// offsets don't rise from 0 to the number of cells.
    ///
    /// # Errors
    /// [`GeometryError::Count`] in these cases.
    pub(crate) fn validate(&self, count: usize) -> Result<(), GeometryError> {
        if let Some(&cell) = self.cells.iter().find(|&&cell| cell as usize >= count) {
            let needed = "zones hold cells of the partition, counted from 0";
            return Err(GeometryError::Count { what: "cell of a zone", count: cell as usize, needed });
        }
        let rise = self.offsets.windows(2).all(|w| w[0] <= w[1]);
        ensure!(
            rise && self.offsets.first() == Some(&0) && self.offsets.last() == Some(&self.cells.len()),
            GeometryError::Count {
                what: "offsets of zones",
                count: self.offsets.len(),
                needed: "offsets rise from 0 to the number of cells in all zones"
            }
        );
        let mut named = vec![false; count];
        let needed = "each cell belongs to one zone";
        if let Some(&cell) = self.cells.iter().find(|&&cell| std::mem::replace(&mut named[cell as usize], true)) {
            return Err(GeometryError::Count { what: "cell that is named twice", count: cell as usize, needed });
        }
        if let Some(cell) = named.iter().position(|named| !named).filter(|_| !self.partial) {
            return Err(GeometryError::Count { what: "cell that no zone names", count: cell, needed });
        }
        Ok(())
    }
}

/// First cell of each block of `size`, and the end; the left-over cells belong to the last block.
pub(super) fn block_starts(cells: usize, size: usize) -> Vec<usize> {
    let blocks = (cells / size).max(1);
    let mut starts: Vec<usize> = list_of(blocks, |b| b * size);
    starts.push(cells);
    starts
}

/// Inner particles that are at least `size` edges apart, as many as fit, in the order in which a front reaches them:
/// what belongs to each then lies snugly beside the others.
fn seeds(neighbours: &Rows, on_boundary: &[bool], size: usize) -> Vec<u32> {
    let row = |p: u32| neighbours.row(p as usize);
    let particles = on_boundary.len();
    let mut seeds = Vec::new();
    let mut taken = vec![false; particles];
    let mut reached = vec![false; particles];
    let mut queue = VecDeque::new();
    let mut near = Vec::new();
    for start in 0..particles as u32 {
        if reached[start as usize] {
            continue;
        }
        reached[start as usize] = true;
        queue.push_back(start);
        while let Some(particle) = queue.pop_front() {
            if !taken[particle as usize] && !on_boundary[particle as usize] {
                seeds.push(particle);
                // Particles closer than `size` edges are taken; the last ring of them comes first in the queue's
                // neighbourhood, so that the next seed is just beyond it.
                near.clear();
                near.push(particle);
                taken[particle as usize] = true;
                let mut first = 0;
                for _ in 1..size {
                    let end = near.len();
                    for k in first..end {
                        for &other in row(near[k]) {
                            if !near.contains(&other) {
                                near.push(other);
                                taken[other as usize] = true;
                            }
                        }
                    }
                    first = end;
                }
                for &ring in &near[first..] {
                    for &other in row(ring) {
                        if !taken[other as usize] && !reached[other as usize] {
                            reached[other as usize] = true;
                            queue.push_back(other);
                        }
                    }
                }
            }
            for &other in row(particle) {
                if !reached[other as usize] {
                    reached[other as usize] = true;
                    queue.push_back(other);
                }
            }
        }
    }
    seeds
}

/// Gives each cell without a zone to the smallest zone beside it, from the zones outward; where there is none (thin
/// parts with boundary particles alone) a cell becomes one.
fn grow(mut zone_of: Vec<u32>, mut zones: usize, beside: &dyn Fn(usize) -> Vec<u32>) -> (Vec<u32>, usize) {
    let mut sizes = vec![0usize; zones];
    for &zone in zone_of.iter().filter(|z| **z != NONE) {
        sizes[zone as usize] += 1;
    }
    let mut left: Vec<usize> = (0..zone_of.len()).filter(|&c| zone_of[c] == NONE).collect();
    while !left.is_empty() {
        let mut joined = Vec::new();
        for &cell in &left {
            let around = beside(cell).into_iter().map(|other| zone_of[other as usize]).filter(|z| *z != NONE);
            if let Some(zone) = around.min_by_key(|z| (sizes[*z as usize], *z)) {
                joined.push((cell, zone));
                sizes[zone as usize] += 1;
            }
        }
        if joined.is_empty() {
            joined.push((left[0], zones as u32));
            sizes.push(1);
            zones += 1;
        }
        for (cell, zone) in joined {
            zone_of[cell] = zone;
        }
        left.retain(|&c| zone_of[c] == NONE);
    }
    (zone_of, zones)
}

/// Inner particles that a zone of a mesh has at least: two displacements and more to a pressure, in the plane and in space.
/// Corners of lattices have 3.4 in space.
const INNER: f64 = 3.0;

/// Groups the cells of any mesh into zones: stars of inner particles that share no cell, `around` having the particles that
/// share cells and `beside` the cells beside one with the measure of the side between; each cell that is left joins the smallest zone beside it, and zones with few inner particles join others.
pub(super) fn stars(
    cells: &[&[u32]],
    around: &Rows,
    on_boundary: &[bool],
    size: usize,
    beside: &dyn Fn(usize) -> Vec<(u32, f64)>,
) -> Zones {
    if size <= 1 {
        return Zones::single(cells.len());
    }
    let mut seeds = seeds(around, on_boundary, size);
    // Where a body is one cell thick there are no inner particles: those of its boundary stand in for them.
    let thin = far(around, &seeds);
    let free: Vec<bool> = on_boundary.paired(&thin, |on, thin| !on || *thin);
    let others: Vec<bool> = thin.mapped(|thin| !thin);
    seeds.extend(self::seeds(around, &others, size));
    let mut seeded = vec![NONE; on_boundary.len()];
    for (zone, &seed) in seeds.iter().enumerate() {
        seeded[seed as usize] = zone as u32;
    }
    // No cell holds two seeds.
    let seed_of = |corners: &&[u32]| corners.iter().find_map(|&c| Some(seeded[c as usize]).filter(|z| *z != NONE));
    let zone_of = cells.mapped(|corners| seed_of(corners).unwrap_or(NONE));
    let grown = grow(zone_of, seeds.len(), &|cell| beside(cell).mapped(|side| side.0));
    join_poor(grown, cells, &free, beside)
}

/// Steps from the nearest seed beyond which a particle belongs to a thin part of the body: corners of thick ones are four away.
const FAR: usize = 4;

/// Particles that are more than [`FAR`] steps away from all seeds.
fn far(around: &Rows, seeds: &[u32]) -> Vec<bool> {
    let mut far = vec![true; around.count()];
    let mut near: Vec<u32> = seeds.to_vec();
    for _ in 0..=FAR {
        let mut next = Vec::new();
        for &particle in &near {
            if std::mem::replace(&mut far[particle as usize], false) {
                next.extend_from_slice(around.row(particle as usize));
            }
        }
        near = next;
    }
    far
}

/// Joins zones with fewer than [`INNER`] inner particles to others: with the whole boundary held there
/// would be as many pressures as displacements.
fn join_poor(
    (mut zone_of, zones): (Vec<u32>, usize),
    cells: &[&[u32]],
    free: &[bool],
    beside: &dyn Fn(usize) -> Vec<(u32, f64)>,
) -> Zones {
    // A particle counts in parts for the zones of the cells around it.
    let mut around = vec![0u32; free.len()];
    for &corner in cells.iter().copied().flatten() {
        around[corner as usize] += 1;
    }
    let mut sides: Vec<BTreeMap<u32, f64>> = vec![BTreeMap::new(); zones];
    let mut inner = vec![0.0f64; zones];
    for (cell, corners) in cells.iter().enumerate() {
        let own = zone_of[cell];
        for &corner in corners.iter().filter(|c| free[**c as usize]) {
            inner[own as usize] += 1.0 / f64::from(around[corner as usize]);
        }
        for (other, side) in beside(cell) {
            let other = zone_of[other as usize];
            if other != own {
                *sides[own as usize].entry(other).or_default() += side;
            }
        }
    }
    let kept = join_by_sides(&mut zone_of, inner, sides, INNER);
    collect((zone_of, kept))
}

/// Joins zones that have less than `least` of inner particles to the zone with which they share the largest side, the poorest first:
/// strips along a boundary whose inner particles stand in one layer would leave pressures across them unseen. `inner` has
/// how many particles each has and `sides` the measures shared; the number of zones that are left.
pub(super) fn join_by_sides(
    zone_of: &mut [u32],
    mut inner: Vec<f64>,
    mut sides: Vec<BTreeMap<u32, f64>>,
    least: f64,
) -> usize {
    let zones = inner.len();
    // In steps that rounding does not change.
    let rank = |worth: f64| (1e6 * worth).round() as u64;
    let mut into: Vec<u32> = (0..zones as u32).collect();
    let ranks = inner.iter().map(|inner| rank(*inner)).zip(0u32..);
    let mut open: BTreeSet<(u64, u32)> = ranks.filter(|own| own.0 < rank(least)).collect();
    while let Some((_, zone)) = open.pop_first() {
        // The first of those that rounding may tell apart.
        let largest = sides[zone as usize].values().copied().fold(0.0, f64::max);
        let longest = sides[zone as usize].iter().find(|side| *side.1 >= (1.0 - 1e-6) * largest).map(|side| *side.0);
        let Some(other) = longest else { continue };
        open.remove(&(rank(inner[other as usize]), other));
        into[zone as usize] = other;
        inner[other as usize] += inner[zone as usize];
        for (beyond, side) in std::mem::take(&mut sides[zone as usize]) {
            sides[beyond as usize].remove(&zone);
            if beyond != other {
                *sides[beyond as usize].entry(other).or_default() += side;
                *sides[other as usize].entry(beyond).or_default() += side;
            }
        }
        let both = rank(inner[other as usize]);
        if both < rank(least) {
            open.insert((both, other));
        }
    }
    let mut number = vec![NONE; zones];
    let mut kept = 0;
    for zone in zone_of.iter_mut() {
        let mut last = *zone;
        while into[last as usize] != last {
            last = into[last as usize];
        }
        if number[last as usize] == NONE {
            number[last as usize] = kept;
            kept += 1;
        }
        *zone = number[last as usize];
    }
    kept as usize
}

/// Groups triangles into zones: stars of inner particles that are at least `size` edges apart, each triangle that is
/// left joining the zone beside it. With `size` 2 on a triangular lattice these are hexagons around every third
/// particle: three linear pressures for six displacements.
pub(crate) fn zones(mesh: &Mesh, size: usize) -> Zones {
    let count = mesh.triangles.len();
    if size <= 1 {
        return Zones::single(count);
    }
    let stars = mesh.stars();
    let mut zone_of = vec![NONE; count];
    let seeds = seeds(&mesh.neighbours(), &mesh.on_boundary(), size);
    for (zone, &seed) in seeds.iter().enumerate() {
        for &triangle in stars.row(seed as usize) {
            zone_of[triangle as usize] = zone as u32;
        }
    }
    collect(grow(zone_of, seeds.len(), &|triangle| {
        let edges = mesh.triangle_edges[triangle];
        let around = edges.into_iter().flat_map(|e| mesh.beside[e as usize]);
        around.filter(|&t| t != NONE && t as usize != triangle).collect()
    }))
}

/// Groups particles into zones around the same seeds.
pub(crate) fn particle_zones(mesh: &Mesh, size: usize) -> Zones {
    let count = mesh.positions.len();
    if size <= 1 {
        return Zones::single(count);
    }
    let neighbours = mesh.neighbours();
    let mut zone_of = vec![NONE; count];
    let seeds = seeds(&neighbours, &mesh.on_boundary(), size);
    for (zone, &seed) in seeds.iter().enumerate() {
        zone_of[seed as usize] = zone as u32;
    }
    collect(grow(zone_of, seeds.len(), &|particle| neighbours.row(particle).to_vec()))
}

/// Cells ordered by the zone of each, and the number of zones.
pub(crate) fn collect((zone_of, zones): (Vec<u32>, usize)) -> Zones {
    let each = |(cell, &zone): (usize, &u32)| (zone as usize, cell as u32);
    let rows = Rows::new(zones, &|add| zone_of.iter().enumerate().map(each).for_each(|(zone, cell)| add(zone, cell)));
    Zones::new(rows.entries, rows.starts.mapped(|&start| start as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_zones_hold_each_once_and_are_even() {
        // Zones of one to three cells.
        let mut offsets = vec![0];
        (0..40).for_each(|zone| offsets.push(offsets[zone] + 1 + zone % 3));
        let count = offsets[40];
        let all = Zones::new((0..count as u32).rev().collect(), offsets);
        all.validate(count).unwrap();
        for parts in [1, 2, 3, 7] {
            let mut named = vec![0; count];
            for part in 0..parts {
                let share = all.share(part, parts, |cell| u64::from(cell * 7919 % 101));
                share.validate(count).unwrap();
                assert!(share.cells.len().abs_diff(count / parts) <= 4, "{parts} parts");
                share.cells.iter().for_each(|&cell| named[cell as usize] += 1);
            }
            assert!(named.iter().all(|&times| times == 1), "{parts} parts");
        }
        // More shares than zones: some are empty.
        let shares = (0..100).map(|part| all.share(part, 100, u64::from).cells.len());
        assert_eq!(shares.sum::<usize>(), count);
    }
}
