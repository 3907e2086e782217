//! Sharp edges, corners and smooth pieces of a closed surface.

use std::collections::{BTreeMap, HashMap};

use nalgebra::SymmetricEigen;

use crate::each::{Each, EachOf};
use crate::geometry::{Disjoint, Mat3, Vec3, double_area};
use crate::solid::{by_edge, ends, half_edges};

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
        let edges = half_edges(facets.iter().copied());
        let mut sharp: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        let mut smooth = Disjoint::new(facets.len());
        for around in by_edge(&edges) {
            let is_sharp = match around {
                [first, second] => {
                    let [first, second] = [first, second].each(|edge| edge.facet as usize);
                    let is_sharp = normals[first].dot(&normals[second]) < SHARP;
                    if !is_sharp && marks[first] == marks[second] {
                        smooth.join(first, second);
                    }
                    is_sharp
                }
                _ => true,
            };
            if is_sharp {
                let [a, b] = ends(around[0].key);
                sharp.entry(a).or_default().push(b);
                sharp.entry(b).or_default().push(a);
            }
        }
        let (pieces, count) = smooth.numbered();
        let mut lengths: BTreeMap<[u32; 2], f64> = BTreeMap::new();
        for around in by_edge(&edges) {
            if let [first, second] = around {
                let [a, b] = ends(first.key).each(|end| points[end as usize]);
                let [first, second] = [first, second].each(|edge| pieces[edge.facet as usize]);
                if first != second {
                    *lengths.entry([first.min(second), first.max(second)]).or_default() += (a - b).norm();
                }
            }
        }
        let (curved, needs) = spread(&normals, &pieces, count);
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

/// Whether each piece has different normals, and one more than the dimensions that they spread over.
fn spread(normals: &[Vec3], pieces: &[u32], count: usize) -> (Vec<bool>, Vec<usize>) {
    let mut first: Vec<Option<Vec3>> = vec![None; count];
    let (mut curved, mut spread) = (vec![false; count], vec![Mat3::zeros(); count]);
    for (normal, &piece) in normals.iter().zip(pieces) {
        let off = normal - *first[piece as usize].get_or_insert(*normal);
        curved[piece as usize] |= off.norm() > FLAT;
        spread[piece as usize] += off * off.transpose();
    }
    let dimensions = |spread: &Mat3| {
        let squares = SymmetricEigen::new(*spread).eigenvalues;
        squares.iter().filter(|square| **square > FLAT.max(1e-6 * squares.max())).count()
    };
    (curved, spread.mapped(|spread| 1 + dimensions(spread)))
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
