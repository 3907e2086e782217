//! The contact face of a body: trace functions over boundary particles and what their points see.

use nalgebra::{Matrix3, Vector3};

use crate::cells::BoundaryCells;
use crate::error::Error;
use crate::geometry::Point;
use crate::table::ShapeTable;
use crate::tensor::cofactor;

/// A part of the boundary that may touch something: facet points with their shape functions, gathered by the trace functions of
/// the boundary particles, face by face at corners. A trace function carries one contact pressure.
pub(crate) struct ContactSurface<const D: usize> {
    pub table: ShapeTable<D>,
    pub traces: Vec<Trace>,
    /// The largest coordinate: what positions are rounded by.
    pub extent: f64,
}

/// Cosine between normals of facets below which they are faces of their own: a trace function around a corner would be held up by its mean gap
/// on one face while the other goes in.
const CORNER: f64 = 0.6;

/// One boundary particle's trace function $\Theta_J$.
pub(crate) struct Trace {
    /// The particle.
    pub particle: u32,
    /// $\int\Theta_J\\,\mathrm d\Gamma$ with the measure of the kinematics.
    pub area: f64,
    /// Its width: the length of an edge with half a trace function on both sides, the root of an area \[length\].
    pub width: f64,
    /// Points under the trace function with their weights $w\\,\Theta_J$.
    pub points: Vec<(u32, f64)>,
    /// Nodes that these points see, by rising index, and a further one where the surface has an unknown of its own.
    pub nodes: Vec<u32>,
    /// For each point the places of its nodes among those, point after point.
    pub local: Vec<u16>,
    /// Where the places of each point begin.
    pub first: Vec<u32>,
}

impl Trace {
    /// Places of the nodes of the k-th point.
    #[inline]
    pub(crate) fn local(&self, k: usize) -> &[u16] {
        &self.local[self.first[k] as usize..self.first[k + 1] as usize]
    }
}

impl<const D: usize> ContactSurface<D> {
    /// Gathers the points of boundary cells by their trace functions; `extra` is a node that every trace function sees besides.
    ///
    /// # Errors
    /// Where cells and table do not fit together.
    pub(crate) fn new(cells: &BoundaryCells<D>, table: ShapeTable<D>, extra: Option<u32>) -> Result<Self, Error> {
        cells.validate(table.node_count())?;
        // The trace functions of each particle, with the normal that each began with: one for each face at a corner.
        let mut of_particle: Vec<Vec<(u32, Point<D>)>> = vec![Vec::new(); table.node_count()];
        let mut traces: Vec<Trace> = Vec::new();
        let mut plain: Vec<f64> = Vec::new();
        for group in cells.points.groups.windows(2) {
            let range = group[0]..group[1];
            let normals = cells.points.normals.get(range.clone()).unwrap_or_default();
            let normal = normals.iter().sum::<Point<D>>();
            let normal = normal / normal.norm().max(f64::MIN_POSITIVE);
            for point in range {
                for &(particle, value) in &cells.traces[point] {
                    let weight = table.weights()[point] * value;
                    if !(weight > 0.0) {
                        continue;
                    }
                    let list = &mut of_particle[particle as usize];
                    let place = match list.iter().find(|(_, first)| first.dot(&normal) >= CORNER) {
                        Some((place, _)) => *place as usize,
                        None => {
                            list.push((traces.len() as u32, normal));
                            plain.push(0.0);
                            traces.push(Trace {
                                particle,
                                area: 0.0,
                                width: 0.0,
                                points: Vec::new(),
                                nodes: Vec::new(),
                                local: Vec::new(),
                                first: vec![0],
                            });
                            traces.len() - 1
                        }
                    };
                    traces[place].points.push((point as u32, weight));
                    traces[place].area += weight;
                    plain[place] += cells.points.weights[point] * value;
                }
            }
        }
        for (trace, plain) in traces.iter_mut().zip(&plain) {
            trace.width = if D == 3 { plain.sqrt() } else { *plain };
            trace.nodes = trace.points.iter().flat_map(|&(p, _)| table.nodes(p as usize)).copied().collect();
            trace.nodes.extend(extra);
            trace.nodes.sort_unstable();
            trace.nodes.dedup();
            for &(point, _) in &trace.points {
                let places = table.nodes(point as usize).iter().map(|n| trace.nodes.partition_point(|m| m < n) as u16);
                trace.local.extend(places);
                trace.first.push(trace.local.len() as u32);
            }
        }
        let extent = table.positions().iter().map(|x| x.amax()).fold(0.0, f64::max);
        Ok(ContactSurface { table, traces, extent })
    }

    /// The points of each facet, and the integrals over it of the trace functions that it has a part of.
    pub(super) fn shares(
        &self,
        cells: &BoundaryCells<D>,
    ) -> impl Iterator<Item = (std::ops::Range<usize>, Vec<(u32, f64)>)> {
        let mut over: Vec<Vec<(u32, f64)>> = vec![Vec::new(); cells.points.positions.len()];
        for (k, trace) in self.traces.iter().enumerate() {
            trace.points.iter().for_each(|&(point, weight)| over[point as usize].push((k as u32, weight)));
        }
        cells.points.groups.windows(2).map(move |group| {
            let mut shares: Vec<(u32, f64)> = Vec::new();
            for &(trace, weight) in over[group[0]..group[1]].iter().flatten() {
                match shares.iter_mut().find(|share| share.0 == trace) {
                    Some(share) => share.1 += weight,
                    None => shares.push((trace, weight)),
                }
            }
            (group[0]..group[1], shares)
        })
    }

    /// The outward normal of the body at a point at a displacement, as long as an area now over the one at rest: $\operatorname{cof}F\\,N$.
    pub(crate) fn outward(&self, point: u32, displacement: &[f64]) -> Vector3<f64> {
        let point = point as usize;
        let f = Matrix3::identity() + self.table.displacement_gradient(point, displacement);
        let normal = self.table.normals()[point];
        cofactor(&f) * Vector3::from_fn(|i, _| normal.get(i).copied().unwrap_or(0.0))
    }

    /// The displacement that a vector of coefficients gives at a point.
    #[inline]
    pub(crate) fn displacement(&self, point: u32, step: &[f64]) -> Point<D> {
        let point = point as usize;
        let mut u = Point::zeros();
        for (&node, &value) in self.table.nodes(point).iter().zip(self.table.values(point)) {
            for i in 0..D {
                u[i] += value * step[node as usize * D + i];
            }
        }
        u
    }
}
