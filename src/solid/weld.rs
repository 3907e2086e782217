//! One vertex per place, no facet without area, none twice.

use std::collections::HashMap;
use std::hash::Hasher;

use crate::each::EachOf;
use crate::geometry::{Disjoint, Mixed, Places, Vec3, double_area};

use super::edges::{edge, half_edges};

/// A facet with the place that it had in the list given; closed openings have none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Facet {
    pub corners: [u32; 3],
    pub origin: u32,
}

/// Facets that close an opening.
pub(super) const ADDED: u32 = u32::MAX;

/// Rounds of turning edges; a flat facet next to others like it takes one for each.
const ROUNDS: usize = 50;

/// Key of a grid cell.
#[derive(PartialEq, Eq)]
struct Cell([i64; 3]);

impl std::hash::Hash for Cell {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.0.iter().for_each(|&x| state.write_u64(x as u64));
    }
}

/// Gives vertices within `tolerance` of an earlier one that stays its number; unused ones go.
/// Facets left with two corners go too.
pub(super) fn weld(vertices: &[Vec3], facets: &[[u32; 3]], tolerance: f64) -> (Vec<Vec3>, Vec<Facet>) {
    let (unique, number) = same_bits(vertices, facets);
    let mut sets = Disjoint::new(unique.len());
    if tolerance > 0.0 {
        join_near(&unique, tolerance, &mut sets);
    }
    let (place, count) = sets.numbered();
    let mut kept = Vec::with_capacity(count);
    // The first of each set is the one that stays.
    for (x, &own) in unique.iter().zip(&place) {
        if own as usize == kept.len() {
            kept.push(*x);
        }
    }
    let welded = facets.iter().enumerate().filter_map(|(origin, corners)| {
        let corners = corners.each(|vertex| place[number[vertex as usize] as usize]);
        let [a, b, c] = corners;
        (a != b && b != c && c != a).then_some(Facet { corners, origin: origin as u32 })
    });
    (kept, welded.collect())
}

/// Vertices of different bits in the order of facets, and the number of each vertex in use.
fn same_bits(vertices: &[Vec3], facets: &[[u32; 3]]) -> (Vec<Vec3>, Vec<u32>) {
    const NONE: u32 = u32::MAX;
    let bits = |x: &Vec3| [0, 1, 2].each(|i| (x[i] + 0.0).to_bits());
    let mut unique: Vec<Vec3> = Vec::new();
    let mut number = vec![NONE; vertices.len()];
    // An open table of a quarter of the memory of a map: files may be large.
    let mut table = vec![NONE; (2 * vertices.len().min(3 * facets.len())).next_power_of_two()];
    for &vertex in facets.iter().flatten() {
        if number[vertex as usize] != NONE {
            continue;
        }
        let x = &vertices[vertex as usize];
        let mut hash = Mixed::default();
        bits(x).iter().for_each(|&word| hash.write_u64(word));
        let mut slot = hash.finish() as usize & (table.len() - 1);
        while table[slot] != NONE && bits(&unique[table[slot] as usize]) != bits(x) {
            slot = (slot + 1) & (table.len() - 1);
        }
        if table[slot] == NONE {
            table[slot] = unique.len() as u32;
            unique.push(*x);
        }
        number[vertex as usize] = table[slot];
    }
    (unique, number)
}

fn join_near(points: &[Vec3], tolerance: f64, sets: &mut Disjoint) {
    // A ball of the tolerance meets one cell mostly, eight at most.
    let inverse = 0.125 / tolerance;
    let mut cells: Places<Cell, u32> = Places::default();
    let mut next = vec![u32::MAX; points.len()];
    let at = |x: &Vec3, shift: [f64; 3]| [0, 1, 2].each(|i| ((x[i] + shift[i] * tolerance) * inverse).floor() as i64);
    for (k, x) in points.iter().enumerate() {
        let (low, high) = (at(x, [-1.0; 3]), at(x, [1.0; 3]));
        for corner in 0..8 {
            let cell = [0, 1, 2].each(|i| if corner >> i & 1 == 0 { low[i] } else { high[i] });
            if (0..3).any(|i| corner >> i & 1 == 1 && low[i] == high[i]) {
                continue;
            }
            let mut other = cells.get(&Cell(cell)).copied().unwrap_or(u32::MAX);
            while other != u32::MAX {
                if (points[other as usize] - x).norm() <= tolerance {
                    sets.join(other as usize, k);
                }
                other = next[other as usize];
            }
        }
        // A point close to one before it would only lengthen the list of its cell.
        if sets.leader(k) == k {
            let first = cells.entry(Cell(at(x, [0.0; 3]))).or_insert(u32::MAX);
            next[k] = std::mem::replace(first, k as u32);
        }
    }
}

/// Drops what stands twice: of facets with the same corners those that face opposite ways, in pairs, and copies.
pub(super) fn drop_doubles(facets: &mut Vec<Facet>) {
    let key = |facet: &Facet| {
        let mut sorted = facet.corners;
        sorted.sort_unstable();
        sorted
    };
    let turn = |facet: &Facet| {
        let [a, b, c] = facet.corners;
        if [a < b, b < c, c < a].iter().filter(|rises| **rises).count() == 2 { 1i32 } else { -1 }
    };
    let mut order: Vec<([u32; 3], u32)> = facets.iter().enumerate().map(|(k, f)| (key(f), k as u32)).collect();
    order.sort_unstable();
    let mut kept = vec![true; facets.len()];
    for group in order.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1) {
        let sum: i32 = group.iter().map(|(_, k)| turn(&facets[*k as usize])).sum();
        let stays = group.iter().find(|(_, k)| turn(&facets[*k as usize]) == sum.signum());
        group.iter().for_each(|(_, k)| kept[*k as usize] = false);
        if let Some((_, k)) = stays {
            kept[*k as usize] = true;
        }
    }
    let mut kept = kept.iter();
    facets.retain(|_| kept.next().is_some_and(|kept| *kept));
}

/// Height of a triangle over its longest side, and the corner opposite of it.
fn height(x: [Vec3; 3]) -> (f64, usize) {
    let longest = (0..3).map(|k| ((x[(k + 2) % 3] - x[(k + 1) % 3]).norm(), k));
    let (length, corner) = longest.fold((0.0, 0), |best, side| if side.0 > best.0 { side } else { best });
    (double_area(&x).norm() / length, corner)
}

/// Whether a facet is lower than `tolerance` over its longest side.
fn is_flat(vertices: &[Vec3], facet: &Facet, tolerance: f64) -> bool {
    !(height(facet.corners.each(|vertex| vertices[vertex as usize])).0 > tolerance)
}

/// Drops facets lower than `tolerance` without which fewer edges bound an odd number of facets: slivers on an edge that bounds two facets
/// already, whole or split.
pub(super) fn drop_spare(vertices: &[Vec3], facets: &mut Vec<Facet>, tolerance: f64) {
    let flat: Vec<usize> = (0..facets.len()).filter(|&k| is_flat(vertices, &facets[k], tolerance)).collect();
    if flat.is_empty() {
        return;
    }
    let mut counts: HashMap<u64, usize> = HashMap::new();
    half_edges(facets.iter().map(|facet| facet.corners))
        .iter()
        .for_each(|half| *counts.entry(half.key).or_default() += 1);
    let mut kept = vec![true; facets.len()];
    for _ in 0..ROUNDS {
        let mut changed = false;
        for &k in &flat {
            if !kept[k] {
                continue;
            }
            let corners = facets[k].corners;
            let sides = [0, 1, 2].each(|i| edge(corners[i], corners[(i + 1) % 3]));
            if sides.iter().filter(|side| counts.get(side).is_some_and(|count| count % 2 == 1)).count() < 2 {
                continue;
            }
            sides.iter().for_each(|side| *counts.entry(*side).or_insert(1) -= 1);
            kept[k] = false;
            changed = true;
        }
        if !changed {
            break;
        }
    }
    let mut kept = kept.iter();
    facets.retain(|_| kept.next().is_some_and(|kept| *kept));
}

/// Facets lower than `tolerance` over their longest side: that side is turned, so that what lay on it bounds the facet beyond.
pub(super) fn turn_flat(vertices: &[Vec3], facets: &mut Vec<Facet>, tolerance: f64) {
    let corners_of = |facet: &Facet| facet.corners.each(|vertex| vertices[vertex as usize]);
    let is_flat = |facet: &Facet| is_flat(vertices, facet, tolerance);
    for _ in 0..ROUNDS {
        let flat: Vec<usize> = (0..facets.len()).filter(|&k| is_flat(&facets[k])).collect();
        if flat.is_empty() {
            return;
        }
        let halves = half_edges(facets.iter().map(|facet| facet.corners));
        let mut touched = vec![false; facets.len()];
        let mut changed = false;
        for k in flat {
            let corner = height(corners_of(&facets[k])).1;
            let [b, c, a] = [0, 1, 2].each(|i| facets[k].corners[(corner + i) % 3]);
            let key = edge(a, c);
            let from = halves.partition_point(|half| half.key < key);
            let both: Vec<usize> =
                halves[from..].iter().take_while(|half| half.key == key).map(|half| half.facet as usize).collect();
            let [one, two] = both[..] else { continue };
            let other = if one == k { two } else { one };
            let Some(&d) = facets[other].corners.iter().find(|&&v| v != a && v != c) else { continue };
            // A facet beyond that faces the other way is left to those who turn facets.
            let follows = (0..3).any(|i| facets[other].corners[i] == a && facets[other].corners[(i + 1) % 3] == c);
            if other == k || touched[k] || touched[other] || d == b || !follows {
                continue;
            }
            let before = height(corners_of(&facets[other])).0;
            let [first, second] = [[a, b, d], [b, c, d]];
            let lowest = [first, second].each(|corners| height(corners.each(|vertex| vertices[vertex as usize])).0);
            if is_flat(&facets[other]) && !(lowest[0].min(lowest[1]) > before) {
                continue;
            }
            facets[k].corners = first;
            facets[other].corners = second;
            (touched[k], touched[other]) = (true, true);
            changed = true;
        }
        drop_doubles(facets);
        if !changed {
            return;
        }
    }
}
