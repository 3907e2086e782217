//! Smooth pieces of a boundary, and trace functions that combine to the normals of curved ones.

use std::collections::{HashMap, HashSet};

use nalgebra::{Matrix4, SymmetricEigen, Vector4};

use crate::each::{Each, IntoEach, list_of};
use crate::error::GeometryError;
use crate::geometry::{Disjoint, Point, Side, Vec3, padded};
use crate::order;

use super::{BoundaryCells, TraceChoice};

/// Cosine of the angle between neighbouring facets beyond which the boundary has an edge, 65°: circles of six chords are
/// smooth.
const SMOOTH: f64 = 0.42;
/// Difference of unit normals below which a piece is flat.
pub(super) const FLAT: f64 = 1e-9;
/// Rings of facets around one whose particles may carry its trace functions.
const RINGS: usize = 3;
/// What may be missing of the sum of trace functions and of the normal.
pub(super) const EXACT: f64 = 1e-11;
/// Eigenvalues below which products of normals are taken for singular, relative to the largest.
const SINGULAR: f64 = 1e-12;

/// A facet of a boundary: its corners in turn, its normal, and whether that varies on it.
pub(super) struct Facet {
    pub corners: Vec<u32>,
    pub normal: Vec3,
    pub warped: bool,
}

/// Connected facets without edges between them, by their numbers, and whether their normals differ; `alike` says which two may be in one.
/// The facets are all of a boundary.
pub(super) fn smooth(
    dimension: usize,
    facets: &[Facet],
    alike: &dyn Fn(usize, usize) -> bool,
) -> Vec<(Vec<u32>, bool)> {
    // Facets at each edge; in the plane at each point.
    let mut at: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
    for (number, facet) in facets.iter().enumerate() {
        for edge in sides(dimension, &facet.corners) {
            at.entry(edge).or_default().push(number as u32);
        }
    }
    // Facets that hang together, in so far as neighbours join.
    let joined = |joins: &dyn Fn(usize, usize) -> bool| {
        let mut sets = Disjoint::new(facets.len());
        for own in at.values() {
            for (k, &a) in own.iter().enumerate() {
                for &b in &own[..k] {
                    if alike(a as usize, b as usize) && joins(a as usize, b as usize) {
                        sets.join(a as usize, b as usize);
                    }
                }
            }
        }
        let leaders = list_of(facets.len(), |facet| sets.leader(facet));
        order::grouped(&leaders).into_mapped(|own| own.into_mapped(|facet| facet as u32)).into_iter()
    };
    let normal = |facet: usize| &facets[facet].normal;
    let level = |a: usize, b: usize| (normal(a) - normal(b)).norm() <= FLAT && !facets[a].warped && !facets[b].warped;
    let mut pieces = Vec::new();
    let mut push = |own: Vec<u32>| {
        let first = own[0] as usize;
        let curved = own.iter().any(|&other| !level(first, other as usize));
        pieces.push((own, curved));
    };
    // A level patch with a particle inside stands alone, whatever the angle to its neighbours: trace functions of a crease between
    // two of them would vanish. Patches without one are facets of something curved.
    let mut around: HashMap<u32, usize> = HashMap::new();
    for &corner in facets.iter().flat_map(|facet| &facet.corners) {
        *around.entry(corner).or_default() += 1;
    }
    let mut alone = vec![false; facets.len()];
    for patch in joined(&level) {
        let mut own: HashMap<u32, usize> = HashMap::new();
        for &corner in patch.iter().flat_map(|&facet| &facets[facet as usize].corners) {
            *own.entry(corner).or_default() += 1;
        }
        if own.iter().any(|(corner, count)| around[corner] == *count) {
            patch.iter().for_each(|&facet| alone[facet as usize] = true);
            push(patch);
        }
    }
    let smooth = |a: usize, b: usize| !alone[a] && !alone[b] && normal(a).dot(normal(b)) > SMOOTH;
    joined(&smooth).filter(|own| !alone[own[0] as usize]).for_each(push);
    pieces
}

/// The edges of a facet by their ends, the lower one first; the ends of a side in the plane.
fn sides(dimension: usize, corners: &[u32]) -> Vec<[u32; 2]> {
    if dimension == 2 {
        return corners.mapped(|&c| [c, c]);
    }
    list_of(corners.len(), |k| {
        let (a, b) = (corners[k], corners[(k + 1) % corners.len()]);
        [a.min(b), a.max(b)]
    })
}

/// A face of a lattice.
type Face = (usize, Side);

/// The smooth pieces of some faces of a lattice, `all` being its faces.
pub(super) fn smooth_pieces<const D: usize>(
    faces: &[Face],
    all: &[Face],
    facets: &dyn Fn(Face) -> Result<BoundaryCells<D>, GeometryError>,
) -> Result<Vec<BoundaryCells<D>>, GeometryError> {
    let mut pieces = faces.try_mapped(|&face| facets(face))?;
    if !pieces.iter().all(BoundaryCells::is_flat) {
        // Whether a particle is inside of a level patch depends on the other faces.
        let (mut whole, mut on) = (Vec::new(), Vec::new());
        for &face in all {
            let cells = facets(face)?;
            on.resize(on.len() + cells.points.groups.len() - 1, face);
            whole.push(cells);
        }
        let whole = BoundaryCells::joined(whole);
        let own = whole.smooth(&on).into_iter().filter(|piece| faces.contains(&on[piece[0] as usize]));
        pieces = own.map(|piece| whole.facets(&|number, _| piece.binary_search(&(number as u32)).is_ok())).collect();
    }
    Ok(pieces)
}

impl<const D: usize> TraceChoice<'_, D> {
    /// The pieces of a part with plain trace functions as a condition takes them.
    pub(crate) fn of(&self, pieces: Vec<BoundaryCells<D>>) -> Vec<BoundaryCells<D>> {
        let mut without = self.without.iter();
        pieces.into_mapped(|piece| {
            let own = match self.within {
                Some(holds) => piece.within(holds),
                None => piece,
            };
            own.bent(without.next())
        })
    }
}

impl<const D: usize> BoundaryCells<D> {
    /// Whether all normals are the same.
    fn is_flat(&self) -> bool {
        let normals = &self.points.normals;
        normals.iter().all(|normal| (normal - normals[0]).norm() <= FLAT)
    }

    /// The smooth pieces of a whole boundary with plain trace functions, by the numbers of their facets; `faces` has the face that each
    /// facet is on.
    fn smooth(&self, faces: &[Face]) -> Vec<Vec<u32>> {
        let facet = |group: &[usize]| {
            let (range, normals) = (group[0]..group[1], &self.points.normals[group[0]..group[1]]);
            let mut corners = self.particles_at(range);
            // Around, where lattices have axis 0 running fastest.
            if corners.len() == 4 {
                corners.swap(2, 3);
            }
            let warped = normals.iter().any(|normal| (normal - normals[0]).norm() > FLAT);
            Facet { corners, normal: padded(&normals.iter().sum::<Point<D>>().normalize()), warped }
        };
        let facets: Vec<Facet> = self.points.groups.windows(2).map(facet).collect();
        smooth(D, &facets, &|a, b| faces[a] == faces[b]).into_mapped(|piece| piece.0)
    }

    /// The particles with a trace function at some points, in the order in which they occur.
    fn particles_at(&self, points: std::ops::Range<usize>) -> Vec<u32> {
        let mut own: Vec<u32> = Vec::new();
        for &(particle, _) in self.traces[points].iter().flatten() {
            if !own.contains(&particle) {
                own.push(particle);
            }
        }
        own
    }

    /// A piece with the trace functions of conditions, made of plain ones.
    ///
    /// Rows reproduce the tractions of homogeneous stress exactly where trace functions can combine to the normal: on flat pieces those
    /// that sum to one do. On curved ones normals vary within facets and jump between them: there the weights of the particles around a
    /// facet are the trace functions with the smallest change for which $\sum_J f_J = 1$ and $\sum_J f_J\\,n_J = n$, with $n_J$ the mean
    /// normal at particle $J$, on as few rings of facets as can. Particles whose equations others own carry none where the rest can
    /// give the normal `without` them. Functions may be negative: contact takes plain ones.
    pub(super) fn bent(mut self, without: Option<&HashSet<u32>>) -> Self {
        if self.is_flat() {
            return self;
        }
        let normals: HashMap<u32, Vec3> =
            self.normals_at_particles().into_iter().map(|(particle, normal)| (particle, padded(&normal))).collect();
        let facets: Vec<Vec<u32>> = self.points.groups.windows(2).map(|w| self.particles_at(w[0]..w[1])).collect();
        let mut facets_at: HashMap<u32, Vec<usize>> = HashMap::new();
        for (number, corners) in facets.iter().enumerate() {
            corners.iter().for_each(|&corner| facets_at.entry(corner).or_default().push(number));
        }
        let carries = |particle: &u32| {
            normals.contains_key(particle) && without.is_none_or(|without| !without.contains(particle))
        };
        for facet in 0..facets.len() {
            let rings = rings(facet, &facets, &facets_at, &carries);
            for point in self.points.groups[facet]..self.points.groups[facet + 1] {
                let (plain, normal) = (&self.traces[point], padded(&self.points.normals[point]));
                let found = rings.iter().find_map(|window| exact(window, &normals, plain, &normal));
                if let Some(found) = found {
                    self.traces[point] = found;
                }
            }
        }
        self
    }
}

/// Particles around a facet that carry trace functions, from those of its neighbours on to farther ones.
fn rings(
    facet: usize,
    facets: &[Vec<u32>],
    facets_at: &HashMap<u32, Vec<usize>>,
    carries: &dyn Fn(&u32) -> bool,
) -> Vec<Vec<u32>> {
    let (mut seen, mut own, mut rings): (Vec<u32>, Vec<usize>, Vec<Vec<u32>>) = (Vec::new(), vec![facet], Vec::new());
    for _ in 0..=RINGS {
        let mut ring: Vec<u32> = own.iter().flat_map(|&facet| &facets[facet]).copied().collect();
        ring.sort_unstable();
        ring.dedup();
        ring.retain(|corner| !seen.contains(corner));
        own = ring.iter().flat_map(|corner| facets_at[corner].iter().copied()).collect();
        own.sort_unstable();
        own.dedup();
        seen.extend(&ring);
        rings.push(seen.iter().copied().filter(carries).collect());
    }
    rings.remove(0);
    rings
}

/// Trace functions of the particles in a window, moved as little as possible to sum to one and to the normal; none where the window has
/// too few.
fn exact(window: &[u32], normals: &HashMap<u32, Vec3>, plain: &[(u32, f64)], normal: &Vec3) -> Option<Vec<(u32, f64)>> {
    let of = |particle: &u32| plain.iter().find(|trace| trace.0 == *particle).map_or(0.0, |trace| trace.1);
    let start: Vec<f64> = window.mapped(of);
    let off: Vec<Vec3> = window.mapped(|particle| normals[particle] - normal);
    let values = reproducing(start, &off, &|_| 1.0)?;
    Some(window.iter().copied().zip(values).collect())
}

/// Values with the smallest change, in the norm of the inverse `weight`, that sum to one and to nothing with the distances of normals from
/// the one that is asked for; none where these can't.
pub(super) fn reproducing(mut values: Vec<f64>, off: &[Vec3], weight: &dyn Fn(usize) -> f64) -> Option<Vec<f64>> {
    // What normals of a level part differ by is rounding, which no functions shall follow.
    let scale = off.largest(|off| off.norm()).max(FLAT);
    let basis = |k: usize| Vector4::new(1.0, off[k][0] / scale, off[k][1] / scale, off[k][2] / scale);
    let missing = |values: &[f64]| {
        let mut missing = Vector4::new(1.0, 0.0, 0.0, 0.0);
        values.iter().enumerate().for_each(|(k, value)| missing -= basis(k) * *value);
        missing
    };
    let mut moments = Matrix4::zeros();
    (0..off.len()).for_each(|k| moments += basis(k) * basis(k).transpose() * weight(k));
    // Normals that hardly differ make the moments singular: what is in their range is solved, the rest is zero.
    let eigen = SymmetricEigen::new(moments);
    let largest = eigen.eigenvalues.max();
    // Once more for what rounding leaves.
    for _ in 0..2 {
        let (missing, mut solution) = (missing(&values), Vector4::zeros());
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > SINGULAR * largest {
                solution += vector * (vector.dot(&missing) / value);
            }
        }
        for (k, value) in values.iter_mut().enumerate() {
            *value += weight(k) * basis(k).dot(&solution);
        }
    }
    let left = missing(&values);
    (left[0].abs() + left.norm() * scale < EXACT).then_some(values)
}
