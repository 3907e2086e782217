//! Sharp edges, corners and smooth pieces of a closed surface.

use std::collections::{BTreeMap, HashMap};

use nalgebra::SymmetricEigen;

use crate::each::{Each, EachOf};
use crate::geometry::{Mat3, Vec3, double_area};

/// Cosine of the angle between facets beyond which the edge between them is sharp, 40°.
const SHARP: f64 = 0.766;
/// Difference of unit normals below which a piece is flat.
const FLAT: f64 = 1e-9;

/// A sharp edge between corners, or around.
#[derive(Debug, Clone)]
pub(super) struct Crease {
    pub(super) points: Vec<Vec3>,
    pub(super) closed: bool,
}

/// Sharp edges, corners and the smooth pieces between them.
#[derive(Debug, Clone)]
pub(super) struct Features {
    pub(super) creases: Vec<Crease>,
    pub(super) corners: Vec<Vec3>,
    /// The piece of each facet.
    pub(super) pieces: Vec<u32>,
    /// Whether the facets of a piece have different normals.
    pub(super) curved: Vec<bool>,
    /// Particles that a piece needs at least for functions that give its normals: one on a plane, three on a cylinder.
    pub(super) needs: Vec<usize>,
    /// Lengths of the edges between pieces, the lower one first.
    pub(super) beside: BTreeMap<[u32; 2], f64>,
    /// Unit normals of facets.
    pub(super) normals: Vec<Vec3>,
}

impl Features {
    /// Facets with the same mark and no sharp edge between them are one piece.
    pub(super) fn new(points: &[Vec3], facets: &[[u32; 3]], marks: &[u32]) -> Self {
        let normal = |corners: &[u32; 3]| {
            let area = double_area(&corners.each(|corner| points[corner as usize]));
            area / area.norm().max(f64::MIN_POSITIVE)
        };
        let normals: Vec<Vec3> = facets.mapped(normal);
        // Sorted in one list: a list for each edge would be allocated by itself.
        let mut edges: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * facets.len());
        for (facet, corners) in facets.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                edges.push((a.min(b), a.max(b), facet as u32));
            }
        }
        edges.sort_unstable();
        let around = || edges.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1));
        let mut sharp: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        // A facet has three edges, and so three neighbours at most.
        let mut beside = vec![[u32::MAX; 3]; facets.len()];
        let mut join = |facet: usize, other: usize| {
            if let Some(free) = beside[facet].iter_mut().find(|free| **free == u32::MAX) {
                *free = other as u32;
            }
        };
        for around in around() {
            let is_sharp = match around {
                [first, second] => {
                    let [first, second] = [first, second].each(|edge| edge.2 as usize);
                    let is_sharp = normals[first].dot(&normals[second]) < SHARP;
                    if !is_sharp && marks[first] == marks[second] {
                        join(first, second);
                        join(second, first);
                    }
                    is_sharp
                }
                _ => true,
            };
            if is_sharp {
                let (a, b, _) = around[0];
                sharp.entry(a).or_default().push(b);
                sharp.entry(b).or_default().push(a);
            }
        }
        let (pieces, curved) = pieces(&normals, &beside);
        let mut lengths: BTreeMap<[u32; 2], f64> = BTreeMap::new();
        for around in around() {
            if let [first, second] = around {
                let (a, b, _) = *first;
                let [first, second] = [first, second].each(|edge| pieces[edge.2 as usize]);
                if first != second {
                    let length = (points[a as usize] - points[b as usize]).norm();
                    *lengths.entry([first.min(second), first.max(second)]).or_default() += length;
                }
            }
        }
        let needs = needs(&normals, &pieces, curved.len());
        sharp.values_mut().for_each(|others| others.sort_unstable());
        let turns = |at: u32, others: &[u32]| {
            let direction = |other: u32| (points[other as usize] - points[at as usize]).normalize();
            others.len() != 2 || direction(others[0]).dot(&-direction(others[1])) < SHARP
        };
        let ends: Vec<u32> = sharp.iter().filter(|(at, others)| turns(**at, others)).map(|(at, _)| *at).collect();
        let corners = ends.mapped(|&end| points[end as usize]);
        Features { creases: creases(points, &sharp, &ends), corners, pieces, needs, beside: lengths, curved, normals }
    }
}

/// The piece of each facet, and whether each piece has different normals; facets are given by those beside them.
fn pieces(normals: &[Vec3], beside: &[[u32; 3]]) -> (Vec<u32>, Vec<bool>) {
    let mut pieces = vec![u32::MAX; beside.len()];
    let mut curved = Vec::new();
    for first in 0..beside.len() {
        if pieces[first] != u32::MAX {
            continue;
        }
        let number = curved.len() as u32;
        let (mut open, mut bent) = (vec![first as u32], false);
        pieces[first] = number;
        while let Some(facet) = open.pop() {
            bent |= (normals[facet as usize] - normals[first]).norm() > FLAT;
            for &other in beside[facet as usize].iter().take_while(|other| **other != u32::MAX) {
                if pieces[other as usize] == u32::MAX {
                    pieces[other as usize] = number;
                    open.push(other);
                }
            }
        }
        curved.push(bent);
    }
    (pieces, curved)
}

/// One more than the dimensions that the normals of each piece spread over.
fn needs(normals: &[Vec3], pieces: &[u32], count: usize) -> Vec<usize> {
    let mut first: Vec<Option<Vec3>> = vec![None; count];
    let mut spread = vec![Mat3::zeros(); count];
    for (normal, &piece) in normals.iter().zip(pieces) {
        let off = normal - *first[piece as usize].get_or_insert(*normal);
        spread[piece as usize] += off * off.transpose();
    }
    let dimensions = |spread: &Mat3| {
        let squares = SymmetricEigen::new(*spread).eigenvalues;
        squares.iter().filter(|square| **square > FLAT.max(1e-6 * squares.max())).count()
    };
    spread.mapped(|spread| 1 + dimensions(spread))
}

/// Sharp edges joined end to end between corners.
fn creases(points: &[Vec3], sharp: &BTreeMap<u32, Vec<u32>>, corners: &[u32]) -> Vec<Crease> {
    let is_corner = |at: u32| corners.binary_search(&at).is_ok();
    let mut seen: HashMap<(u32, u32), ()> = HashMap::new();
    let mut found = Vec::new();
    for &first in corners.iter().chain(sharp.keys()) {
        for &second in &sharp[&first] {
            if seen.contains_key(&(first.min(second), first.max(second))) {
                continue;
            }
            let mut path = vec![first];
            let (mut from, mut to) = (first, second);
            while seen.insert((from.min(to), from.max(to)), ()).is_none() {
                path.push(to);
                if is_corner(to) {
                    break;
                }
                let Some(&next) = sharp[&to].iter().find(|&&next| next != from) else { break };
                (from, to) = (to, next);
            }
            let closed = path.len() > 2 && path[0] == path[path.len() - 1] && !is_corner(first);
            found.push(Crease { points: path.mapped(|&at| points[at as usize]), closed });
        }
    }
    found
}
