//! Boundary parts in space that may touch each other: triangles, and which is opposite of which point.

use std::collections::HashMap;
use std::sync::OnceLock;

use nalgebra::SMatrix;

use crate::each::Each;
use crate::geometry::Vec3;
use crate::order;

use super::facets::{Facing, LOCAL as POINT, Seen, Sorted, Triangle, covered, gap};
use super::facing::{Facet, Facets};
use super::jet::Jet;
use super::overlap::{Base, GapSlopes, LOCAL};

/// A point of a facet that is no triangles, of the part that carries pressures, and the mover there.
pub(super) struct Loose {
    pub point: u32,
    pub mover: u32,
    facet: u32,
}

/// Faces of one or two parts.
pub(super) struct Faces {
    /// Those of the part that carries pressures, then those of the other one.
    pub triangles: Vec<Triangle>,
    /// For each trace function that carries pressures its triangles, and what it is at their corners.
    pub of_trace: Vec<Vec<(u32, [f64; 3])>>,
    pub loose: Vec<Loose>,
    /// The place among those of each point, where there are any.
    loose_of: Vec<Option<u32>>,
    pub facets: Facets,
    /// The connected part of the surface that each facet lies in, and its distance in facets from an end of that; empty for two parts.
    ranks: Vec<(u32, u32)>,
    /// Triangles of the part that carries pressures.
    carrying: usize,
    /// Whether facets that may be pressed against are no triangles.
    pub cut_facets: bool,
}

/// Faces at a state.
pub(super) struct LaidFaces {
    corners: Vec<[Vec3; 3]>,
    /// The triangles of the part that carries pressures.
    pub bases: Vec<Base>,
    /// What faces each of them.
    pub facing: Vec<Vec<Facing>>,
    /// The gradients of its mean gaps, once they are needed.
    slopes: Vec<OnceLock<Vec<GapSlopes>>>,
    /// The triangle opposite of each point of a facet that is no triangles.
    opposite: Vec<Option<u32>>,
    /// How far around a triangle is known.
    pub reach: f64,
}

impl LaidFaces {
    /// The gradients of the mean gaps under a triangle, over each of those that face it.
    pub(crate) fn slopes(&self, triangle: usize) -> &[GapSlopes] {
        let base = &self.bases[triangle];
        let of = |facing: &Facing| base.slopes(&facing.overlap, &base.over(&self.corners[facing.other as usize]));
        self.slopes[triangle].get_or_init(|| self.facing[triangle].mapped(of))
    }

    /// The second derivatives of a sum of the mean gaps under a triangle with factors, over one of those that face it, by its number.
    pub(crate) fn curve(&self, triangle: usize, number: usize, factors: [f64; 3]) -> SMatrix<f64, LOCAL, LOCAL> {
        let (base, facing) = (&self.bases[triangle], &self.facing[triangle][number]);
        base.curve(&facing.overlap, &base.over(&self.corners[facing.other as usize]), factors)
    }
}

/// Measures of the triangles of a facet, each between a corner and the next one, for which the linear functions of its corners have the
/// integrals `shares` of its trace functions where those of opposite corners have equal sums, as on bilinear facets of uniform density; else
/// the nearest to them, and equal parts where one would be negative: uniform pressures are not exact there.
fn measures(shares: &[f64]) -> Vec<f64> {
    let whole: f64 = shares.iter().sum();
    let &[a, b, c, d] = shares else { return vec![whole] };
    let (first, second) = (0.75 * (a - c + b - d), 0.75 * (b - d - a + c));
    let found = [first, second, -first, -second].map(|more| 0.25 * whole + more);
    // Facets that are bent far.
    if found.iter().all(|part| *part > 0.0) { found.to_vec() } else { vec![0.25 * whole; 4] }
}

/// For each facet the connected part of the surface and its distance in facets from an end of that: from the facet farthest from its first one.
fn ranks(facets: &Facets) -> Vec<(u32, u32)> {
    let (mut ranks, mut part) = (vec![(0, 0); facets.all.len()], 0);
    for first in 0..facets.all.len() as u32 {
        if ranks[first as usize].0 > 0 {
            continue;
        }
        part += 1;
        let distances = |from: u32| {
            let mut known = HashMap::from([(from, 0u32)]);
            let (mut front, mut distance, mut last) = (vec![from], 0, from);
            while let Some(&any) = front.first() {
                (last, distance) = (any, distance + 1);
                let mut wider: Vec<u32> = Vec::new();
                front.iter().for_each(|&facet| wider.extend_from_slice(&facets.all[facet as usize].beside));
                wider.sort_unstable();
                wider.dedup();
                wider.retain(|facet| !known.contains_key(facet));
                known.extend(wider.iter().map(|&facet| (facet, distance)));
                front = wider;
            }
            (last, known)
        };
        let (end, _) = distances(first);
        for (facet, distance) in distances(end).1 {
            ranks[facet as usize] = (part, distance);
        }
    }
    ranks
}

impl Faces {
    /// Facets of three or four corners are triangles; points of others press against those of the other part.
    pub(crate) fn new(facets: Facets, carrying: usize, ends: &[Vec3]) -> Self {
        let last = facets.all.iter().map(|facet| facet.points.end).max().unwrap_or(0);
        let mut faces = Faces {
            triangles: Vec::new(),
            of_trace: vec![Vec::new(); carrying],
            loose: Vec::new(),
            loose_of: vec![None; last],
            ranks: if facets.two { Vec::new() } else { ranks(&facets) },
            carrying: 0,
            cut_facets: false,
            facets,
        };
        for number in 0..faces.facets.all.len() {
            let Facet { part, points, shares, .. } = &faces.facets.all[number];
            let (part, points) = (*part, points.clone());
            if (3..=4).contains(&shares.len()) {
                faces.push_facet(number, |trace| ends[trace as usize]);
                faces.carrying = if part == 0 { faces.triangles.len() } else { faces.carrying };
                continue;
            }
            faces.cut_facets |= part == 1 || !faces.facets.two;
            for point in points.take(if part == 0 { last } else { 0 }) {
                faces.loose_of[point] = Some(faces.loose.len() as u32);
                faces.loose.push(Loose { point: point as u32, mover: u32::MAX, facet: number as u32 });
            }
        }
        faces.find_traces();
        faces
    }

    /// Adds the triangles of a facet.
    fn push_facet(&mut self, number: usize, end: impl Fn(u32) -> Vec3) {
        let Facet { middle, outward, shares, .. } = &self.facets.all[number];
        let (middle, outward, mut shares) = (*middle, *outward, shares.clone());
        order::sort(&mut shares, &|a, b| a.0.cmp(&b.0));
        // Counter-clockwise about the outward normal.
        let axis = outward.cross(&(end(shares[0].0) - middle)).normalize();
        let other = axis.cross(&outward);
        let angle = |trace: u32| {
            let away = end(trace) - middle;
            away.dot(&axis).atan2(away.dot(&other))
        };
        order::sort(&mut shares, &|a, b| angle(a.0).total_cmp(&angle(b.0)));
        let traces = shares.mapped(|share| share.0);
        let measures = measures(&shares.mapped(|share| share.1));
        for (k, &measure) in measures.iter().enumerate() {
            let corners = match traces[..] {
                [a, b, c] => [vec![a], vec![b], vec![c]],
                _ => [vec![traces[k]], vec![traces[(k + 1) % traces.len()]], traces.clone()],
            };
            let at = |k: usize| corners[k].iter().map(|&trace| end(trace)).sum::<Vec3>() / corners[k].len() as f64;
            let turned = (at(1) - at(0)).cross(&(at(2) - at(0))).dot(&outward);
            let sign = if turned >= 0.0 { 1.0 } else { -1.0 };
            self.triangles.push(Triangle { corners, movers: [0; 3], sign, measure, facet: number as u32 });
        }
    }

    /// Finds the triangles of each trace function that carries pressures.
    fn find_traces(&mut self) {
        for (k, triangle) in self.triangles[..self.carrying].iter().enumerate() {
            for (corner, traces) in triangle.corners.iter().enumerate() {
                let part = 1.0 / traces.len() as f64;
                for &trace in traces {
                    let list = &mut self.of_trace[trace as usize];
                    if list.last().is_none_or(|last| last.0 != k as u32) {
                        list.push((k as u32, [0.0; 3]));
                    }
                    if let Some(last) = list.last_mut() {
                        last.1[corner] += part;
                    }
                }
            }
        }
    }

    /// Whether of two facets of one part that face each other the first one carries the pressures: the one nearer to an end of the surface,
    /// so that all of a fold's one side does. Were neighbours to differ, slivers along their edges would carry pressures on both sides.
    fn is_first(&self, mine: u32, its: u32) -> bool {
        (self.ranks[mine as usize], mine) < (self.ranks[its as usize], its)
    }

    /// Finds what faces each triangle that carries pressures, given positions of all corners, and what is opposite of loose points, given
    /// those with their normals; with the search of another state its triangles are cut anew.
    pub(crate) fn laid(
        &self,
        corners: Vec<[Vec3; 3]>,
        points: &[(Vec3, Vec3)],
        searched: Option<&LaidFaces>,
    ) -> LaidFaces {
        let own = self.triangles.iter().zip(&corners).take(self.carrying);
        let bases: Vec<Base> = own.map(|(own, corners)| Base::new(corners, own.sign, own.measure)).collect();
        let (facing, opposite, reach) = if let Some(laid) = searched {
            let again = |(base, facing): (&Base, &Vec<Facing>)| {
                let again = |facing: &Facing| covered(base, &corners[facing.other as usize], facing.other);
                facing.iter().filter_map(again).collect()
            };
            (bases.iter().zip(&laid.facing).map(again).collect(), laid.opposite.clone(), laid.reach)
        } else {
            let sorted = Sorted::new(&self.triangles, &corners, if self.facets.two { self.carrying } else { 0 });
            let mut seen = Seen::default();
            let facing = bases.iter().enumerate().map(|(own, base)| {
                let mine = self.triangles[own].facet;
                let may = |other: usize, gap: f64| self.facets.may_touch(mine, self.triangles[other].facet, gap);
                let mut facing = sorted.facing(own, base, self.facets.deeper, &mut seen, may);
                facing.retain(|facing| {
                    self.facets.two || self.is_first(mine, self.triangles[facing.other as usize].facet)
                });
                facing.sort_by_key(|facing| facing.other);
                facing
            });
            let facing = facing.collect();
            let opposite = points.iter().zip(&self.loose).map(|((x, outward), loose)| {
                let may = |other: usize, gap: f64| self.facets.may_touch(loose.facet, self.triangles[other].facet, gap);
                let found = sorted.nearest(x, outward, self.facets.deeper, may)?;
                (self.facets.two || self.is_first(loose.facet, self.triangles[found].facet)).then_some(found as u32)
            });
            (facing, opposite.collect(), sorted.reach())
        };
        LaidFaces { slopes: vec![OnceLock::new(); self.carrying], corners, bases, facing, opposite, reach }
    }

    /// The mover of a loose point, and the triangle opposite of it with the gap there.
    pub(crate) fn loose_gap(
        &self,
        laid: &LaidFaces,
        point: u32,
        place: impl Fn(u32) -> Vec3,
    ) -> Option<(u32, u32, Jet<POINT>)> {
        let loose = (*self.loose_of.get(point as usize)?)? as usize;
        let (mover, triangle) = (self.loose[loose].mover, laid.opposite[loose]?);
        let sign = self.triangles[triangle as usize].sign;
        Some((mover, triangle, gap(&place(mover), &laid.corners[triangle as usize], sign)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::abs_diff_eq;

    /// Linear functions of a facet's corners over its triangles have the integrals of its bilinear trace functions: on a
    /// trapezium of sides 1 and 2 with the density 1 + x.
    #[test]
    fn triangles_measure_trace_functions() {
        let shares = [4.0 / 12.0, 5.0 / 12.0, 5.0 / 12.0, 4.0 / 12.0];
        let found = measures(&shares);
        for (k, share) in shares.iter().enumerate() {
            let sum = (found[k] + found[(k + 3) % 4]) / 3.0 + found.iter().sum::<f64>() / 12.0;
            assert!(abs_diff_eq!(sum, share, epsilon = 1e-15), "{found:?}");
        }
    }
}
