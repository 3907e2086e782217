//! Facets that cross each other.

use crate::each::{EachOf, array_of};
use crate::geometry::{Bounds, Vec3, double_area, mean};
use crate::order;
use crate::parallel::map_ranges;

use super::tree::Tree;

/// Distances below this part of the facets' size are rounding: they do not cross, they touch.
const ROUNDING: f64 = 1e-10;
/// The same for areas that two facets of one plane share.
const SHARE: f64 = 1e-6;

/// Two facets that cross.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    pub facets: [u32; 2],
    pub at: [f64; 3],
}

/// All pairs of facets that cross, by the lower facet.
pub(super) fn crossings(vertices: &[Vec3], facets: &[[u32; 3]], tree: &Tree) -> Vec<Crossing> {
    let found = map_ranges(facets.len(), 4096, |range| {
        let mut found = Vec::new();
        range.for_each(|one| of_facet(vertices, facets, tree, one as u32, &mut found));
        found
    });
    found.concat()
}

/// How many pairs cross, and the first of them. None is kept: a damaged surface may have as many as the square of its facets.
pub(super) fn first_crossing(vertices: &[Vec3], facets: &[[u32; 3]], tree: &Tree) -> Option<(usize, Crossing)> {
    let found = map_ranges(facets.len(), 4096, |range| {
        let (mut count, mut first) = (0, None);
        let mut found = Vec::new();
        for one in range {
            found.clear();
            of_facet(vertices, facets, tree, one as u32, &mut found);
            count += found.len();
            first = first.or(found.first().copied());
        }
        (count, first)
    });
    let first = found.iter().find_map(|range| range.1)?;
    Some((found.iter().map(|range| range.0).sum(), first))
}

/// Adds the pairs of a facet with later ones, in their order.
fn of_facet(vertices: &[Vec3], facets: &[[u32; 3]], tree: &Tree, one: u32, found: &mut Vec<Crossing>) {
    let corners = |facet: u32| facets[facet as usize].each(|vertex| vertices[vertex as usize]);
    let x = corners(one);
    let begun = found.len();
    tree.for_each_in(&Bounds::of(&x), |other| {
        if other > one
            && let Some(at) = crossing(&x, facets[one as usize], &corners(other), facets[other as usize])
        {
            found.push(Crossing { facets: [one, other], at: at.into() });
        }
    });
    order::sort(&mut found[begun..], &|a, b| a.facets.cmp(&b.facets));
}

/// A point that two facets share beyond their common vertices.
fn crossing(x: &[Vec3; 3], a: [u32; 3], y: &[Vec3; 3], b: [u32; 3]) -> Option<Vec3> {
    // Most pairs whose boxes meet: one facet is on one side of the other's plane, but for common vertices.
    let (over_x, over_y) = (heights(x, y, &a, &b)?, heights(y, x, &b, &a)?);
    let flat = |heights: &[f64; 3]| heights.iter().all(|h| *h == 0.0);
    if flat(&over_x) || flat(&over_y) {
        return overlap(x, y);
    }
    pierced(x, y, &over_y).or_else(|| pierced(y, x, &over_x))
}

/// Heights of `y` over the plane of `x`, rounding and common vertices as zeros; `None` where all that are none have one sign and
/// can't cross.
fn heights(x: &[Vec3; 3], y: &[Vec3; 3], a: &[u32; 3], b: &[u32; 3]) -> Option<[f64; 3]> {
    let normal = double_area(x).normalize();
    let size = (x[1] - x[0]).amax().max((x[2] - x[0]).amax()).max((y[1] - y[0]).amax()).max((y[2] - y[0]).amax());
    let heights: [f64; 3] = array_of(|k| {
        let height = normal.dot(&(y[k] - x[0]));
        if a.contains(&b[k]) || height.abs() <= ROUNDING * size { 0.0 } else { height }
    });
    let above = heights.iter().filter(|h| **h > 0.0).count();
    let below = heights.iter().filter(|h| **h < 0.0).count();
    let flat = above + below == 0;
    (flat || above > 0 && below > 0 || heights.iter().any(|h| h.is_nan())).then_some(heights)
}

/// Where a side of `x`, whose corners are at `heights` over the plane of `y`, runs through `y`.
fn pierced(x: &[Vec3; 3], y: &[Vec3; 3], heights: &[f64; 3]) -> Option<Vec3> {
    (0..3).find_map(|k| {
        let (p, q) = (heights[k], heights[(k + 1) % 3]);
        let at = x[k] + (x[(k + 1) % 3] - x[k]) * (p / (p - q));
        (p * q < 0.0 && sides(y, &at).iter().all(|side| *side > -ROUNDING)).then_some(at)
    })
}

/// The barycentric coordinates of a point in the plane of a triangle.
fn sides(y: &[Vec3; 3], at: &Vec3) -> [f64; 3] {
    let normal = double_area(y);
    array_of(|j| double_area(&[y[j], y[(j + 1) % 3], *at]).dot(&normal) / normal.norm_squared())
}

/// Where two facets of one plane cover each other.
fn overlap(x: &[Vec3; 3], y: &[Vec3; 3]) -> Option<Vec3> {
    let double =
        |x: &[Vec3]| -> f64 { (2..x.len()).map(|k| (x[k - 1] - x[0]).cross(&(x[k] - x[0]))).sum::<Vec3>().norm() };
    // What is left of one within the other.
    let mut polygon = y.to_vec();
    for k in 0..3 {
        let mut cut = Vec::with_capacity(polygon.len() + 1);
        for (j, p) in polygon.iter().enumerate() {
            let q = &polygon[(j + 1) % polygon.len()];
            let [s, t] = [p, q].each(|p| sides(x, p)[k]);
            if s >= 0.0 {
                cut.push(*p);
            }
            if s * t < 0.0 {
                cut.push(p + (q - p) * (s / (s - t)));
            }
        }
        polygon = cut;
    }
    let least = double(x).min(double(y));
    (double(&polygon) > SHARE * least).then(|| mean(&polygon))
}
