//! Vertices of deformable faces: what they are of the displacements of nodes.

use crate::geometry::Point;

use super::ContactSurface;

/// What a point is of the displacements of some nodes: their places among those of the contact, and factors.
pub(super) type Combination = Vec<(u16, f64)>;

/// Points that move with the body, each a combination of displacements, and whose force goes to which trace functions.
pub(super) struct Movers<const D: usize> {
    pub combinations: Vec<Combination>,
    pub rest: Vec<Point<D>>,
    pub owners: Vec<Vec<(u32, f64)>>,
}

impl<const D: usize> Movers<D> {
    pub fn push(&mut self, combination: Combination, rest: Point<D>, owners: Vec<(u32, f64)>) {
        self.combinations.push(combination);
        self.rest.push(rest);
        self.owners.push(owners);
    }

    /// Adds the mean of some, and says where it is.
    pub fn push_mean(&mut self, of: &[u32]) -> u32 {
        if let [one] = of {
            return *one;
        }
        let part = 1.0 / of.len() as f64;
        let all = of.iter().flat_map(|&k| &self.combinations[k as usize]);
        let combination = merged(all.map(|&(node, value)| (node, part * value)).collect());
        let rest = of.iter().map(|&k| self.rest[k as usize]).sum::<Point<D>>() * part;
        let owners = of.iter().flat_map(|&k| &self.owners[k as usize]).map(|&(trace, value)| (trace, part * value));
        let owners = owners.collect();
        self.push(combination, rest, owners);
        self.combinations.len() as u32 - 1
    }
}

/// What the vertices of a face are made of.
pub(super) struct Means<const D: usize> {
    /// Reference positions of the means under the trace functions.
    at: Vec<Point<D>>,
    /// For each trace function those that it shares points with, and $\int\Theta_K\Theta_L\\,\mathrm d\Gamma$.
    shared: Vec<Vec<(u32, f64)>>,
}

impl<const D: usize> Means<D> {
    pub fn of(contact_surface: &ContactSurface<D>) -> Self {
        let mut over: Vec<Vec<(u32, f64)>> = vec![Vec::new(); contact_surface.table.len()];
        let mut at = Vec::with_capacity(contact_surface.traces.len());
        for (k, trace) in contact_surface.traces.iter().enumerate() {
            let mean = |&(point, weight): &(u32, f64)| contact_surface.table.positions()[point as usize] * weight;
            at.push(trace.points.iter().map(mean).sum::<Point<D>>() / trace.area);
            trace.points.iter().for_each(|&(point, weight)| over[point as usize].push((k as u32, weight)));
        }
        let mut shared: Vec<Vec<(u32, f64)>> = vec![Vec::new(); contact_surface.traces.len()];
        for (traces, weight) in over.iter().zip(contact_surface.table.weights()) {
            for &(k, mine) in traces {
                for &(l, its) in traces.iter().filter(|(l, _)| *l != k) {
                    let list = &mut shared[k as usize];
                    match list.iter_mut().find(|entry| entry.0 == l) {
                        Some(entry) => entry.1 += mine * its / weight,
                        None => list.push((l, mine * its / weight)),
                    }
                }
            }
        }
        Means { at, shared }
    }

    /// The vertex of a trace function as a combination of displacements, and where it is at rest.
    pub fn vertex(
        &self,
        contact_surface: &ContactSurface<D>,
        positions: &[Point<D>],
        trace: usize,
        place: impl Fn(u32) -> u16,
    ) -> (Combination, Point<D>) {
        let particle = |k: usize| positions[contact_surface.traces[k].particle as usize];
        let mut parts = vec![(trace, 1.0)];
        for &(other, both) in &self.shared[trace] {
            let other = other as usize;
            let stretched = (particle(trace) - particle(other)).norm() / (self.at[trace] - self.at[other]).norm();
            let part = both * stretched / contact_surface.traces[trace].area;
            parts[0].1 += part;
            parts.push((other, -part));
        }
        let (mut combination, mut rest) = (Combination::new(), Point::<D>::zeros());
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

/// A combination with each node once.
pub(super) fn merged(mut combination: Combination) -> Combination {
    combination.sort_by_key(|entry| entry.0);
    combination.dedup_by(|second, first| {
        let same = second.0 == first.0;
        first.1 += if same { second.1 } else { 0.0 };
        same
    });
    combination
}
