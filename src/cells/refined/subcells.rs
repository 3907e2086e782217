//! Sub-cells of cells that may have particles in the middle of their sides.

use std::collections::BTreeMap;

use crate::each::Each;
use crate::geometry::{Vec2, mean};
use crate::quadrature::{LineRule, Points};

use super::super::Smoothing;
use super::super::brick::{determinant, multilinear};
use super::super::mesh::{collapse, parabola, three_points};
use super::Refined;

/// A point between two particles, `k` of `parts` from the first one, on their chord or its parabola.
fn cut(positions: &[Vec2], ends: (u32, u32), bulge: &Vec2, k: usize, parts: usize) -> Vec2 {
    let (low, high) = (&positions[ends.0 as usize], &positions[ends.1 as usize]);
    parabola(low, high, bulge, k as f64 / parts as f64).0
}

/// Abscissae and weights along the sides of the unit square.
pub(super) struct Rules {
    /// Two points: exact to degree 3.
    pub(super) straight: LineRule,
    /// Three points, for the maps of curved sides.
    pub(super) curved: LineRule,
}

/// Facets while sub-cells are built: each with its two ends.
#[derive(Default)]
pub(super) struct Facets {
    pub(super) ends: Vec<[Vec2; 2]>,
    /// How far the middle of each stands off its chord.
    pub(super) bulges: Vec<Vec2>,
    chords: BTreeMap<(u32, u32), u32>,
}

impl Facets {
    /// The sub-facets of the side from one particle to another, with signs; made where they are new.
    fn side(&mut self, cells: &Refined, from: u32, to: u32, parts: usize) -> Vec<(u32, f64)> {
        let key = (from.min(to), from.max(to));
        let next = self.ends.len() as u32;
        let first = *self.chords.entry(key).or_insert(next);
        if first == next {
            let bulge = cells.bulge(from, to);
            let at = |k: usize| cut(&cells.positions, key, &bulge, k, parts);
            self.ends.extend((0..parts).map(|k| [at(k), at(k + 1)]));
            // A piece of a parabola is one again.
            self.bulges.extend((0..parts).map(|_| bulge / (parts * parts) as f64));
        }
        let all = first..first + parts as u32;
        if from < to { all.map(|f| (f, 1.0)).collect() } else { all.rev().map(|f| (f, -1.0)).collect() }
    }

    fn inner(&mut self, from: Vec2, to: Vec2) -> u32 {
        self.ends.push([from, to]);
        self.bulges.push(Vec2::zeros());
        self.ends.len() as u32 - 1
    }
}

impl Refined {
    /// Cuts one cell into `parts` × `parts` sub-cells.
    pub(super) fn cut_cell(
        &self,
        number: usize,
        parts: usize,
        rules: &Rules,
        facets: &mut Facets,
        out: &mut Smoothing<2>,
    ) {
        let cell = &self.cells[number];
        let shape = self.shape(number);
        // Sub-facets of each side around the cell, in `parts` runs.
        let sides: [Vec<Vec<(u32, f64)>>; 4] = std::array::from_fn(|side| {
            let chain = self.along(cell, side);
            let all: Vec<(u32, f64)> = chain.windows(2).flat_map(|w| facets.side(self, w[0], w[1], parts)).collect();
            all.chunks(chain.len() - 1).map(<[_]>::to_vec).collect()
        });
        let ends = |&(facet, sign): &(u32, f64)| {
            let [from, to] = facets.ends[facet as usize];
            if sign > 0.0 { [from, to] } else { [to, from] }
        };
        // Corners of the sub-cells: on the sides those of the facets, inside by the map of the cell.
        let mut grid = vec![Vec2::zeros(); (parts + 1) * (parts + 1)];
        let at = |i: usize, j: usize| j * (parts + 1) + i;
        for j in 0..=parts {
            for i in 0..=parts {
                let unit = Vec2::new(i as f64 / parts as f64, j as f64 / parts as f64);
                grid[at(i, j)] = shape.map(&unit).0;
            }
        }
        for k in 0..parts {
            for (side, place) in
                [at(k, 0), at(parts, k), at(parts - k, parts), at(0, parts - k)].into_iter().enumerate()
            {
                grid[place] = ends(&sides[side][k][0])[0];
            }
        }
        // Inner facets: upward ones at x = i, rightward ones at y = j.
        let mut upward = vec![0; (parts + 1) * parts];
        let mut rightward = vec![0; (parts + 1) * parts];
        for k in 1..parts {
            for l in 0..parts {
                upward[k * parts + l] = facets.inner(grid[at(k, l)], grid[at(k, l + 1)]);
                rightward[k * parts + l] = facets.inner(grid[at(l, k)], grid[at(l + 1, k)]);
            }
        }
        for j in 0..parts {
            for i in 0..parts {
                let below = if j == 0 { sides[0][i].clone() } else { vec![(rightward[j * parts + i], 1.0)] };
                let right = if i + 1 == parts { sides[1][j].clone() } else { vec![(upward[(i + 1) * parts + j], 1.0)] };
                let above = if j + 1 == parts {
                    sides[2][parts - 1 - i].clone()
                } else {
                    vec![(rightward[(j + 1) * parts + i], -1.0)]
                };
                let left = if i == 0 { sides[3][parts - 1 - j].clone() } else { vec![(upward[i * parts + j], -1.0)] };
                let around: Vec<(u32, f64)> = [below, right, above, left].concat();
                let outline: Vec<Vec2> =
                    around.mapped(|&(facet, sign)| facets.ends[facet as usize][usize::from(sign < 0.0)]);
                let bulges: Vec<Vec2> = around.mapped(|&(facet, _)| facets.bulges[facet as usize]);
                let (interior, centre) = fan(&outline, &bulges, rules);
                out.cells.push(around);
                out.interior.push(interior);
                out.centres.push(centre);
            }
        }
    }
}

/// Interior points of a polygon exact to degree 2 — Gauss points of a quadrilateral, else those of the triangles around its
/// mean corner — and its centroid.
fn fan(outline: &[Vec2], bulges: &[Vec2], Rules { straight: gauss, curved }: &Rules) -> (Vec<(Vec2, f64)>, Vec2) {
    let mean = mean(outline);
    let (mut points, mut total, mut centre) = (Vec::with_capacity(3 * outline.len()), 0.0, Vec2::zeros());
    for (k, &a) in outline.iter().enumerate() {
        let b = outline[(k + 1) % outline.len()];
        let area = 0.5 * determinant(&[a - mean, b - mean]);
        total += area;
        centre += (a + b + mean) * (area / 3.0);
        if bulges[k] != Vec2::zeros() {
            let mut rule = Points::empty();
            let sides = [bulges[k], Vec2::zeros(), Vec2::zeros()];
            collapse(curved, &[a, b, mean], &sides, &mut rule);
            points.extend(rule.positions.into_iter().zip(rule.weights));
            continue;
        }
        points.extend(three_points([a, b, mean], area));
    }
    if let [a, b, c, d] = *outline
        && bulges.iter().all(|bulge| *bulge == Vec2::zeros())
    {
        let corners = [a, b, d, c, a, b, d, c];
        let gauss = gauss.0.iter().flat_map(|t| gauss.0.iter().map(|s| Vec2::new(*s, *t)));
        let weighed = |at: Vec2| {
            let (position, columns) = multilinear(&corners, &at);
            (position, 0.25 * determinant(&columns))
        };
        points = gauss.map(weighed).collect();
    }
    (points, centre / total)
}
