//! Vertices of deformable faces: what they are of the displacements of nodes.

use crate::each::{Each, add};
use crate::geometry::Vec3;
use crate::order::{accumulate, merged};

use super::ContactSurface;

/// What a point is of the displacements of some nodes: their places among those of the contact, and factors.
pub(super) type Combination = Vec<(u16, f64)>;

/// Points that move with the body, each a combination of displacements or the mean of some, and whose force goes to which trace functions.
#[derive(Default)]
pub(super) struct Movers {
    /// None of what is a mean.
    pub combinations: Vec<Combination>,
    pub rest: Vec<Vec3>,
    pub owners: Vec<Vec<(u32, f64)>>,
    /// For each the points that it is the mean of, with its parts: itself where it is none.
    pub parts: Vec<Vec<(u32, f64)>>,
}

impl Movers {
    pub(crate) fn push(&mut self, combination: Combination, rest: Vec3, owners: Vec<(u32, f64)>) {
        self.parts.push(vec![(self.rest.len() as u32, 1.0)]);
        self.combinations.push(combination);
        self.rest.push(rest);
        self.owners.push(owners);
    }

    /// Adds the mean of some, and says where it is.
    pub(crate) fn push_mean(&mut self, of: &[u32]) -> u32 {
        if let [one] = of {
            return *one;
        }
        let part = 1.0 / of.len() as f64;
        let parts = of.mapped(|&k| (k, part));
        // The triangles of a facet share their common corner.
        if self.parts.last() == Some(&parts) {
            return self.parts.len() as u32 - 1;
        }
        let rest = of.iter().map(|&k| self.rest[k as usize]).sum::<Vec3>() * part;
        let mut owners = Vec::new();
        for &k in of {
            for &(trace, value) in &self.owners[k as usize] {
                owners.push((trace, part * value));
            }
        }
        self.push(Combination::new(), rest, owners);
        self.parts.pop();
        self.parts.push(parts);
        self.combinations.len() as u32 - 1
    }
}

/// Iterations at most that bring vertices to their particles.
const SWEEPS: usize = 1000;
/// Part of the gradient at the start at which they are there.
const AT_REST: f64 = 1e-13;

/// What the vertices of a face are made of.
pub(super) struct Means {
    /// Reference positions of the means under the trace functions.
    at: Vec<Vec3>,
    /// For each trace function those that it shares points with, and $t_{KL}$.
    shared: Vec<Vec<(u32, f64)>>,
}

impl Means {
    pub(crate) fn of(contact_surface: &ContactSurface, positions: &[Vec3]) -> Self {
        let mut at = Vec::with_capacity(contact_surface.traces.len());
        for trace in &contact_surface.traces {
            let mean = |&(point, weight): &(u32, f64)| contact_surface.table.positions[point as usize] * weight;
            at.push(trace.points.iter().map(mean).sum::<Vec3>() / trace.area);
        }
        let mut shared: Vec<Vec<(u32, f64)>> = vec![Vec::new(); contact_surface.traces.len()];
        for (traces, weight) in contact_surface.over.iter().zip(&contact_surface.table.weights) {
            for &(k, mine) in traces {
                for &(l, its) in traces.iter().filter(|(l, _)| *l != k) {
                    accumulate(&mut shared[k as usize], l, mine * its / weight);
                }
            }
        }
        let particles: Vec<Vec3> = contact_surface.traces.mapped(|trace| positions[trace.particle as usize]);
        for (k, list) in shared.iter_mut().enumerate() {
            for (l, both) in list {
                let l = *l as usize;
                *both *= (particles[k] - particles[l]).norm() / (at[k] - at[l]).norm();
            }
        }
        let mut means = Means { at, shared };
        if contact_surface.table.dim == 3 {
            means.bring_to(contact_surface, &particles);
        }
        means
    }

    /// Changes $t_{KL}$ by least squares, symmetrically, so that vertices lie at the particles along flat faces.
    fn bring_to(&mut self, contact_surface: &ContactSurface, particles: &[Vec3]) {
        let normals = contact_surface.traces.mapped(|trace| contact_surface.normal(trace));
        let along = |k: usize, v: Vec3| v - normals[k] * normals[k].dot(&v);
        // Pairs in one direction, with the means' distance times t: changes count in parts of t.
        let mut pairs: Vec<(usize, usize, Vec3)> = Vec::new();
        for (k, list) in self.shared.iter().enumerate() {
            let after = list.iter().filter(|entry| entry.0 as usize > k);
            pairs.extend(after.map(|&(l, t)| (k, l as usize, (self.at[k] - self.at[l as usize]) * t)));
        }
        let moved = |parts: &[f64]| {
            let mut sums = vec![Vec3::zeros(); particles.len()];
            for (&(k, l, way), part) in pairs.iter().zip(parts) {
                sums[k] += along(k, way * *part);
                sums[l] -= along(l, way * *part);
            }
            sums
        };
        let all = moved(&vec![1.0; pairs.len()]);
        let mut missing: Vec<Vec3> = (contact_surface.traces.iter().zip(particles).zip(&self.at))
            .enumerate()
            .map(|(k, ((trace, x), mean))| along(k, (x - mean) * trace.area) - all[k])
            .collect();
        // Conjugate gradients for least squares.
        let answer = |left: &[Vec3]| -> Vec<f64> {
            pairs.mapped(|&(k, l, way)| way.dot(&along(k, left[k])) - way.dot(&along(l, left[l])))
        };
        let square = |v: &[f64]| v.summed(|x| x * x);
        let mut parts = vec![0.0; pairs.len()];
        let mut gradient = answer(&missing);
        let (mut direction, start) = (gradient.clone(), square(&gradient));
        let mut size = start;
        for _ in 0..SWEEPS {
            if !(size > AT_REST * AT_REST * start) {
                break;
            }
            let image = moved(&direction);
            let step = size / image.summed(|v| v.norm_squared());
            add(&mut parts, step, &direction);
            missing.iter_mut().zip(&image).for_each(|(left, by)| *left -= by * step);
            gradient = answer(&missing);
            let before = std::mem::replace(&mut size, square(&gradient));
            direction.iter_mut().zip(&gradient).for_each(|(d, g)| *d = g + size / before * *d);
        }
        for (&(k, l, _), part) in pairs.iter().zip(&parts) {
            for (own, other) in [(k, l), (l, k)] {
                if let Some(entry) = self.shared[own].iter_mut().find(|entry| entry.0 as usize == other) {
                    entry.1 *= 1.0 + part;
                }
            }
        }
    }

    /// The vertex of a trace function as a combination of displacements, and where it is at rest.
    pub(crate) fn vertex(
        &self,
        contact_surface: &ContactSurface,
        trace: usize,
        place: impl Fn(u32) -> u16,
    ) -> (Combination, Vec3) {
        let mut parts = vec![(trace, 1.0)];
        for &(other, both) in &self.shared[trace] {
            let part = both / contact_surface.traces[trace].area;
            parts[0].1 += part;
            parts.push((other as usize, -part));
        }
        let (mut combination, mut rest) = (Combination::new(), Vec3::zeros());
        for (k, part) in parts {
            let of = &contact_surface.traces[k];
            rest += self.at[k] * part;
            for (p, &(point, weight)) in of.points.iter().enumerate() {
                let factor = part * weight / of.area;
                let seen = of.local(p).iter().zip(contact_surface.table.values(point as usize));
                combination.extend(seen.map(|(&l, value)| (place(of.nodes[l as usize]), factor * value)));
            }
        }
        (merged(combination), rest)
    }
}
