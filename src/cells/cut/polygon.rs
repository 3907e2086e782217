//! Triangles of plane polygons with holes.

use crate::geometry::{Vec2, is_left};

use super::super::mesh::cross;

/// A corner: its number and its place.
pub(super) type Corner = (u32, Vec2);

/// Twice the signed area of a polygon.
pub(super) fn area(polygon: &[Corner]) -> f64 {
    let first = polygon[0].1;
    polygon.windows(2).map(|w| cross(first, w[0].1, w[1].1)).sum()
}

/// Whether a point lies in a polygon.
pub(super) fn holds(polygon: &[Corner], at: Vec2) -> bool {
    let crossed = (0..polygon.len()).filter(|k| is_left(polygon[*k].1, polygon[(k + 1) % polygon.len()].1, &at));
    crossed.count() % 2 == 1
}

/// Triangles of a polygon, corners counterclockwise, with holes, theirs clockwise. Where rounding leaves no ear triangles may overlap with
/// opposite signs: their signed areas and moments are those of the polygon always.
pub(super) fn triangles(mut polygon: Vec<Corner>, mut holes: Vec<Vec<Corner>>) -> Vec<[u32; 3]> {
    let rightmost = |hole: &Vec<Corner>| {
        (0..hole.len()).max_by(|&a, &b| hole[a].1[0].total_cmp(&hole[b].1[0]).then(b.cmp(&a))).unwrap_or(0)
    };
    // From the right: a bridge then meets no hole that comes later.
    crate::order::sort(&mut holes, &|a, b| b[rightmost(b)].1[0].total_cmp(&a[rightmost(a)].1[0]));
    for hole in holes {
        let start = rightmost(&hole);
        let bridge = bridge(&polygon, hole[start].1);
        let mut joined = polygon[..=bridge].to_vec();
        joined.extend(hole[start..].iter().chain(&hole[..=start]).copied());
        joined.extend_from_slice(&polygon[bridge..]);
        polygon = joined;
    }
    ears(polygon)
}

/// The corner of a polygon that is seen from a point inside, to the right of it.
fn bridge(polygon: &[Corner], from: Vec2) -> usize {
    let count = polygon.len();
    let mut nearest = (f64::INFINITY, 0);
    for k in 0..count {
        let (a, b) = (polygon[k].1, polygon[(k + 1) % count].1);
        // The inside is on the left of edges: those that go up are seen from it.
        if a[1] <= from[1] && b[1] > from[1] {
            let x = a[0] + (from[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
            if x >= from[0] && x < nearest.0 {
                nearest = (x, if a[0] > b[0] { k } else { (k + 1) % count });
            }
        }
    }
    let (x, mut best) = nearest;
    if !x.is_finite() {
        return 0;
    }
    // Corners in the triangle between the point, the edge and its end hide the end: the one nearest to the ray is seen.
    let (end, hit) = (polygon[best].1, Vec2::new(x, from[1]));
    let steep = |p: Vec2| (p[1] - from[1]).abs() / (p[0] - from[0]).max(f64::MIN_POSITIVE);
    let mut least = steep(end);
    for (k, &(_, p)) in polygon.iter().enumerate() {
        let signs = [cross(from, hit, p), cross(hit, end, p), cross(end, from, p)];
        let within = signs.iter().all(|s| *s >= 0.0) || signs.iter().all(|s| *s <= 0.0);
        let before = polygon[(k + count - 1) % count].1;
        let after = polygon[(k + 1) % count].1;
        if within && p != end && p[0] > from[0] && cross(before, p, after) < 0.0 && steep(p) < least {
            (least, best) = (steep(p), k);
        }
    }
    best
}

/// Cuts corners off until a triangle is left.
fn ears(mut polygon: Vec<Corner>) -> Vec<[u32; 3]> {
    let mut found = Vec::with_capacity(polygon.len().saturating_sub(2));
    let mut start = 0;
    while polygon.len() > 2 {
        let count = polygon.len();
        let at = |k: usize| polygon[k % count];
        let is_ear = |k: usize| {
            let [a, b, c] = [at(k + count - 1), at(k), at(k + 1)];
            let size = cross(a.1, b.1, c.1);
            if size <= 0.0 {
                return size == 0.0 && a.0 != c.0;
            }
            !polygon.iter().any(|p| {
                ![a.0, b.0, c.0].contains(&p.0)
                    && cross(a.1, b.1, p.1) >= 0.0
                    && cross(b.1, c.1, p.1) >= 0.0
                    && cross(c.1, a.1, p.1) >= 0.0
            })
        };
        // Ears are looked for from the last one on, so that triangles do not all share a corner.
        let smallest = |a: &usize, b: &usize| {
            let size = |k: usize| cross(at(k + count - 1).1, at(k).1, at(k + 1).1).abs();
            size(*a).total_cmp(&size(*b))
        };
        let ear = if count == 3 {
            1
        } else {
            let ear = (start..start + count).map(|k| k % count).find(|&k| is_ear(k));
            ear.or_else(|| (0..count).min_by(smallest)).unwrap_or(0)
        };
        let corners = [at(ear + count - 1).0, at(ear).0, at(ear + 1).0];
        if corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0] {
            found.push(corners);
        }
        polygon.remove(ear);
        start = ear + 1;
    }
    found
}
