//! Facets of deformable faces, and which of them may touch each other.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::OnceLock;

use crate::cells::EDGE;
use crate::geometry::Vec3;

use super::ContactSurface;

/// How deep a part may be behind another one to be in contact with it, in terms of their length: beyond, it is the far side of a
/// wall.
pub(super) const BEHIND: f64 = 1.5;
/// Cosine between the inward normal and the way to another part, both at rest, from which on the body lies between them; the same between
/// the outward normals of the body and of a rigid surface that has passed through it, and of parts that look the same way and cannot touch.
pub(crate) const THROUGH: f64 = 0.5;
/// An undeformed facet.
pub(super) struct Facet {
    /// Which part it belongs to.
    pub part: usize,
    /// Its points.
    pub points: Range<usize>,
    /// Its trace functions, counted through all parts, with their integrals over it.
    pub shares: Vec<(u32, f64)>,
    pub middle: Vec3,
    pub outward: Vec3,
    /// Facets that it meets at a particle, itself among them: they never touch.
    pub beside: Vec<u32>,
    /// How far behind it the far side of its own body is, as far as that is of its part, once it is asked for.
    wall: OnceLock<f64>,
}

/// Facets of one or two parts.
pub(super) struct Facets {
    pub all: Vec<Facet>,
    /// Whether they touch those of the other part alone.
    pub two: bool,
    /// How much deeper than usual one may lie behind another one \[length\].
    pub deeper: f64,
}

impl Facets {
    /// The facets of all parts, whose trace functions have vertices at `ends`.
    pub(super) fn new(surfaces: &[ContactSurface], ends: &[Vec3]) -> Self {
        let (mut all, mut first) = (Vec::new(), 0u32);
        // Facets meet at particles: a corner has a trace function for each of its faces.
        let (mut at, mut particles): (HashMap<u32, Vec<u32>>, Vec<u32>) = (HashMap::new(), Vec::new());
        for (part, surface) in surfaces.iter().enumerate() {
            particles.extend(surface.traces.iter().map(|trace| trace.particle));
            for facet in 0..surface.table.clusters.count() {
                let (points, mut shares) = (surface.table.clusters.points(facet), surface.shares(facet));
                let (mut middle, mut outward) = (Vec3::zeros(), Vec3::zeros());
                for share in &mut shares {
                    share.0 += first;
                    middle += ends[share.0 as usize];
                    at.entry(particles[share.0 as usize]).or_default().push(all.len() as u32);
                }
                middle /= shares.len().max(1) as f64;
                points.clone().for_each(|point| outward += surface.table.normals[point]);
                outward /= outward.norm().max(f64::MIN_POSITIVE);
                all.push(Facet { part, points, shares, middle, outward, beside: Vec::new(), wall: OnceLock::new() });
            }
            first += surface.traces.len() as u32;
        }
        for facet in &mut all {
            for (trace, _) in &facet.shares {
                facet.beside.extend_from_slice(&at[&particles[*trace as usize]]);
            }
            facet.beside.sort_unstable();
            facet.beside.dedup();
        }
        Facets { all, two: surfaces.len() > 1, deeper: 0.0 }
    }

    /// The ends of radial lines, each of which is a facet.
    pub(super) fn of_lines(surfaces: &[ContactSurface], ends: &[Vec3]) -> Self {
        let mut all: Vec<Facet> = Vec::with_capacity(ends.len());
        for (part, surface) in surfaces.iter().enumerate() {
            for trace in &surface.traces {
                let (number, point) = (all.len() as u32, trace.points[0].0 as usize);
                all.push(Facet {
                    part,
                    points: point..point + 1,
                    shares: vec![(number, trace.area)],
                    middle: ends[all.len()],
                    outward: surface.table.normals[point],
                    beside: vec![number],
                    wall: OnceLock::new(),
                });
            }
        }
        Facets { all, two: surfaces.len() > 1, deeper: 0.0 }
    }

    /// Whether facets may touch where the gap between them is that: they do not meet, and no body lies between them. Facets of one part have
    /// it between them that lie behind each other at rest. Two parts may begin in each other: one lies between where the other facet is no
    /// nearer at rest than the far side of its own body, and now nearer to that than to the facet.
    pub(super) fn may_touch(&self, mine: u32, its: u32, gap: f64) -> bool {
        let beyond = |from: u32, to: u32| {
            // The far side is looked for where there is something behind.
            let depth = self.depth(from, to).0;
            depth > 0.0 && depth >= (1.0 - EDGE) * self.wall(from) && -gap > 0.5 * self.wall(from)
        };
        let between = || match self.two {
            true => beyond(mine, its) || beyond(its, mine),
            false => self.behind(mine, its).is_some(),
        };
        self.all[mine as usize].beside.binary_search(&its).is_err() && !(gap < 0.0 && between())
    }

    /// How far behind an undeformed facet another one lies, and how far away it is.
    fn depth(&self, from: u32, to: u32) -> (f64, f64) {
        let (from, to) = (&self.all[from as usize], &self.all[to as usize]);
        let way = to.middle - from.middle;
        (-way.dot(&from.outward), way.norm())
    }

    /// How far behind an undeformed facet another one lies, where the way to it goes into the body.
    fn behind(&self, from: u32, to: u32) -> Option<f64> {
        let (depth, distance) = self.depth(from, to);
        (depth > THROUGH * distance).then_some(depth)
    }

    /// How far behind a facet the nearest one of its part is that looks the other way.
    fn wall(&self, of: u32) -> f64 {
        let own = &self.all[of as usize];
        *own.wall.get_or_init(|| {
            // A facet along the axis of revolution has no area and no trace functions.
            let is_far = |other: &Facet| {
                other.part == own.part && other.outward.dot(&own.outward) < -THROUGH && !other.shares.is_empty()
            };
            let far = self.all.iter().zip(0..).filter(|(other, _)| is_far(other));
            far.filter_map(|(_, number)| self.behind(of, number)).fold(f64::INFINITY, f64::min)
        })
    }
}
