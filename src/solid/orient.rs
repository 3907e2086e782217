//! Facets that all face the same way, small openings closed.

use std::collections::HashMap;

use crate::each::{Each, EachOf};
use crate::error::SolidError;
use crate::geometry::{Disjoint, Vec3, double_area};

use super::edges::{balance, by_edge, edge, ends, half_edges};
use super::weld::{ADDED, Facet};

/// Largest area of an opening that is closed, over that of the surface.
const SMALL: f64 = 1e-3;
/// Longest opening that is closed [edges]: each triangle of the patch looks at all that are left.
const LONG: usize = 2000;

fn middle(vertices: &[Vec3], key: u64) -> [f64; 3] {
    let [a, b] = ends(key).each(|vertex| vertices[vertex as usize]);
    ((a + b) * 0.5).into()
}

fn turn(facet: &mut Facet) {
    facet.corners.swap(1, 2);
}

/// Turns facets so that neighbours face the same way, as few as possible in each connected part. Where all do already, also
/// at edges of four facets, nothing is done.
pub(super) fn agree(vertices: &[Vec3], facets: &mut [Facet]) -> Result<(), SolidError> {
    let halves = half_edges(facets.iter().map(|facet| facet.corners));
    if by_edge(&halves).all(|group| balance(group) == 0) {
        return Ok(());
    }
    // Neighbours over edges of two facets, and whether they face opposite ways.
    let mut neighbours = vec![[(u32::MAX, false); 3]; facets.len()];
    for group in by_edge(&halves) {
        if let [a, b] = group {
            let opposed = a.rises == b.rises;
            neighbours[a.facet as usize][a.opposite as usize] = (b.facet, opposed);
            neighbours[b.facet as usize][b.opposite as usize] = (a.facet, opposed);
        }
    }
    let mut turned: Vec<Option<bool>> = vec![None; facets.len()];
    let mut part = Vec::new();
    for seed in 0..facets.len() {
        if turned[seed].is_some() {
            continue;
        }
        turned[seed] = Some(false);
        part.clear();
        part.push(seed as u32);
        let mut next = 0;
        while let Some(&facet) = part.get(next) {
            next += 1;
            let own = turned[facet as usize] == Some(true);
            for (side, &(other, opposed)) in neighbours[facet as usize].iter().enumerate() {
                if other == u32::MAX {
                    continue;
                }
                let wanted = own ^ opposed;
                match turned[other as usize] {
                    None => {
                        turned[other as usize] = Some(wanted);
                        part.push(other);
                    }
                    Some(found) if found != wanted => {
                        let corners = facets[facet as usize].corners;
                        let key = edge(corners[(side + 1) % 3], corners[(side + 2) % 3]);
                        return Err(SolidError::OneSided { at: middle(vertices, key) });
                    }
                    Some(_) => {}
                }
            }
        }
        let most = 2 * part.iter().filter(|facet| turned[**facet as usize] == Some(true)).count() > part.len();
        for &facet in &part {
            if (turned[facet as usize] == Some(true)) != most {
                turn(&mut facets[facet as usize]);
            }
        }
    }
    Ok(())
}

/// Adds facets over small openings, and refuses large ones and edges where walls meet.
pub(super) fn close(vertices: &[Vec3], facets: &mut Vec<Facet>) -> Result<(), SolidError> {
    let halves = half_edges(facets.iter().map(|facet| facet.corners));
    let total: f64 = facets.summed(|facet| area(facet.corners.each(|v| vertices[v as usize])));
    let open = by_edge(&halves).filter(|group| group.len() == 1).count();
    ensure!(
        open <= facets.len(),
        SolidError::Open { edges: open, area: total, at: vertices[facets[0].corners[0] as usize].into() }
    );
    // Edges as a closing facet runs along them.
    let mut next: HashMap<u32, Vec<u32>> = HashMap::new();
    let mut starts = Vec::new();
    for group in by_edge(&halves) {
        let (sum, [low, high]) = (balance(group), ends(group[0].key));
        match (sum, group.len()) {
            (0, _) => {}
            (-1 | 1, 1) => {
                let (from, to) = if sum > 0 { (high, low) } else { (low, high) };
                next.entry(from).or_default().push(to);
                starts.push(from);
            }
            (_, facets) => return Err(SolidError::Branching { facets, at: middle(vertices, group[0].key) }),
        }
    }
    if starts.is_empty() {
        return Ok(());
    }
    let mut worst = (0.0, starts[0]);
    let mut added = Vec::new();
    for &start in &starts {
        for ring in rings(start, &mut next) {
            let patch = if ring.len() <= LONG { fill(vertices, &ring) } else { Vec::new() };
            let size: f64 = patch.summed(|corners| area(corners.each(|v| vertices[v as usize])));
            let size = if patch.is_empty() { f64::INFINITY } else { size };
            if size > worst.0 {
                worst = (size, ring[0]);
            }
            added.extend(patch.into_iter().map(|corners| Facet { corners, origin: ADDED }));
        }
    }
    ensure!(
        !(worst.0 > SMALL * total),
        SolidError::Open { edges: starts.len(), area: worst.0, at: vertices[worst.1 as usize].into() }
    );
    facets.extend(added);
    Ok(())
}

fn area(corners: [Vec3; 3]) -> f64 {
    0.5 * double_area(&corners).norm()
}

/// Takes the edges that are reached from a vertex out of `next`, as rings that pass each vertex once.
fn rings(start: u32, next: &mut HashMap<u32, Vec<u32>>) -> Vec<Vec<u32>> {
    let mut found = Vec::new();
    let mut way = vec![start];
    let mut place: HashMap<u32, usize> = HashMap::from([(start, 0)]);
    while let Some(&last) = way.last() {
        let Some(to) = next.get_mut(&last).and_then(Vec::pop) else { break };
        match place.get(&to) {
            Some(&from) => {
                let ring: Vec<u32> = way[from..].to_vec();
                // Its own alone: a look at the whole way for each ring would be long where many hang on a long way.
                for vertex in way.drain(from + 1..) {
                    place.remove(&vertex);
                }
                found.push(ring);
            }
            None => {
                place.insert(to, way.len());
                way.push(to);
            }
        }
    }
    found
}

/// Triangles over a ring, each with the shortest new edge that is left.
fn fill(vertices: &[Vec3], ring: &[u32]) -> Vec<[u32; 3]> {
    let mut ring = ring.to_vec();
    let mut out = Vec::with_capacity(ring.len());
    while ring.len() >= 3 {
        let count = ring.len();
        let across = |k: usize| {
            let [a, c] = [ring[(k + count - 1) % count], ring[(k + 1) % count]].each(|v| vertices[v as usize]);
            (c - a).norm_squared()
        };
        let ear = (0..count).min_by(|&j, &k| across(j).total_cmp(&across(k))).unwrap_or(0);
        out.push([ring[(ear + count - 1) % count], ring[ear], ring[(ear + 1) % count]]);
        ring.remove(ear);
    }
    out
}

/// The connected part of each facet, over edges, numbered by their first facets; how many there are.
pub(super) fn parts(facets: &[[u32; 3]]) -> (Vec<u32>, usize) {
    let mut sets = Disjoint::new(facets.len());
    let halves = half_edges(facets.iter().copied());
    for group in by_edge(&halves) {
        for pair in group.windows(2) {
            sets.join(pair[0].facet as usize, pair[1].facet as usize);
        }
    }
    sets.numbered()
}
