//! The contact face of a body: trace functions over boundary particles and what their points see.

use std::collections::HashMap;

use crate::cells::{BoundaryCells, CORNER};
use crate::each::Each;
use crate::error::Error;
use crate::geometry::{Mat3, Vec3, cut};
use crate::order::accumulate;
use crate::table::ShapeTable;
use crate::tensor::cofactor;

use super::face_table::FaceTable;

/// A part of the boundary that may touch something: facet points with their shape functions, gathered by the trace functions of
/// the boundary particles, face by face at corners. A trace function carries one contact pressure.
pub(crate) struct ContactSurface {
    pub table: FaceTable,
    pub traces: Vec<Trace>,
    /// For each point the trace functions that it lies under, with its weights there.
    pub over: Vec<Vec<(u32, f64)>>,
    /// The largest coordinate: what positions are rounded by.
    pub extent: f64,
    /// Its length or area, without the measure of the kinematics.
    pub area: f64,
}

/// Part of a trace function below which a face is none: the end of the function on a curved face. Corners of thin bodies have faces of a
/// small part as well.
const SLIVER: f64 = 0.01;

/// One boundary particle's trace function $\Theta_J$.
pub(crate) struct Trace {
    /// The particle.
    pub particle: u32,
    /// $\int\Theta_J\\,\mathrm d\Gamma$ with the measure of the kinematics.
    pub area: f64,
    /// Its width: the length of an edge with half a trace function on both sides, the root of an area, at the end of a radial line the spacing
    /// there \[length\].
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

/// The faces of the body that each particle has trace functions on, by the facets that it has a part of: facets whose normals are turned
/// from that of the heaviest one by more than [`CORNER`] are another face. The heaviest one is beside the particle, whose function on a
/// curved face reaches to both of its sides.
fn faces(table: &FaceTable, values: &[Vec<(u32, f64)>]) -> HashMap<(u32, u32), u32> {
    let mut normals: Vec<Vec3> = Vec::with_capacity(table.clusters.count());
    let mut facets: HashMap<u32, Vec<(u32, f64)>> = HashMap::new();
    for facet in 0..table.clusters.count() as u32 {
        let points = table.clusters.points(facet as usize);
        let normal = table.normals.get(points.clone()).unwrap_or_default().iter().sum::<Vec3>();
        normals.push(normal / normal.norm().max(f64::MIN_POSITIVE));
        for point in points {
            for &(particle, value) in &values[point] {
                let (weight, own) = (table.weights[point] * value, facets.entry(particle).or_default());
                match own.last_mut().filter(|last| last.0 == facet) {
                    Some(last) => last.1 += weight,
                    None => own.push((facet, weight)),
                }
            }
        }
    }
    let mut faces = HashMap::new();
    for (particle, mut left) in facets {
        let whole = left.summed(|own| own.1);
        let mut face = 0;
        while let Some(heaviest) = left.iter().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0))).map(|own| own.0) {
            let normal = normals[heaviest as usize];
            let (own, apart): (Vec<_>, Vec<_>) = left
                .into_iter()
                .partition(|&(facet, _)| facet == heaviest || normals[facet as usize].dot(&normal) >= CORNER);
            let weight = own.summed(|own| own.1);
            let number = if weight < SLIVER * whole { 0 } else { face };
            faces.extend(own.into_iter().map(|(facet, _)| ((particle, facet), number)));
            face += 1;
            left = apart;
        }
    }
    faces
}

impl ContactSurface {
    /// Gathers the points of boundary cells by their trace functions; `extra` is a node that every trace function sees besides.
    ///
    /// # Errors
    /// Where cells and table do not fit together.
    pub(crate) fn new<const D: usize>(
        cells: &BoundaryCells<D>,
        table: &ShapeTable<D>,
        extra: Option<u32>,
    ) -> Result<Self, Error> {
        cells.validate(table.node_count())?;
        Ok(ContactSurface::of(FaceTable::new(table), &cells.traces, &cells.points.weights, extra))
    }

    /// Of the values of all trace functions at the points of a table, whose weights without the measure are given.
    fn of(table: FaceTable, values: &[Vec<(u32, f64)>], weights: &[f64], extra: Option<u32>) -> Self {
        let faces = faces(&table, values);
        let mut places: HashMap<(u32, u32), usize> = HashMap::new();
        let mut traces: Vec<Trace> = Vec::new();
        let mut plain: Vec<f64> = Vec::new();
        for facet in 0..table.clusters.count() as u32 {
            for point in table.clusters.points(facet as usize) {
                for &(particle, value) in &values[point] {
                    let weight = table.weights[point] * value;
                    if !(weight > 0.0) {
                        continue;
                    }
                    let face = faces.get(&(particle, facet)).copied().unwrap_or(0);
                    let place = *places.entry((particle, face)).or_insert(traces.len());
                    if place == traces.len() {
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
                    }
                    traces[place].points.push((point as u32, weight));
                    traces[place].area += weight;
                    plain[place] += weights[point] * value;
                }
            }
        }
        for (trace, plain) in traces.iter_mut().zip(&plain) {
            trace.width = if table.dim == 3 { plain.sqrt() } else { *plain };
            trace.nodes = Vec::new();
            for &(point, _) in &trace.points {
                trace.nodes.extend_from_slice(table.nodes(point as usize));
            }
            trace.nodes.extend(extra);
            trace.nodes.sort_unstable();
            trace.nodes.dedup();
            for &(point, _) in &trace.points {
                let places = table.nodes(point as usize).iter().map(|n| trace.nodes.partition_point(|m| m < n) as u16);
                trace.local.extend(places);
                trace.first.push(trace.local.len() as u32);
            }
        }
        let mut over: Vec<Vec<(u32, f64)>> = vec![Vec::new(); table.len()];
        for (k, trace) in traces.iter().enumerate() {
            trace.points.iter().for_each(|&(point, weight)| over[point as usize].push((k as u32, weight)));
        }
        let extent = table.positions.largest(|x| x.amax());
        ContactSurface { table, traces, over, extent, area: weights.iter().sum() }
    }

    /// The trace functions that a facet has a part of, with their integrals over it.
    pub(super) fn shares(&self, facet: usize) -> Vec<(u32, f64)> {
        let mut shares: Vec<(u32, f64)> = Vec::new();
        for &(trace, weight) in self.over[self.table.clusters.points(facet)].iter().flatten() {
            accumulate(&mut shares, trace, weight);
        }
        shares
    }

    /// The mean outward normal of the undeformed body under a trace function.
    pub(crate) fn normal(&self, trace: &Trace) -> Vec3 {
        let mut normal = Vec3::zeros();
        trace.points.iter().for_each(|&(point, weight)| normal += self.table.normals[point as usize] * weight);
        normal / normal.norm().max(f64::MIN_POSITIVE)
    }

    /// The outward normal of the body at a point at a displacement, as long as an area now over the one at rest: $\operatorname{cof}F\\,N$.
    pub(crate) fn outward(&self, point: u32, displacement: &[f64]) -> Vec3 {
        let point = point as usize;
        let f = Mat3::identity() + self.table.displacement_gradient(point, displacement);
        cofactor(&f) * self.table.normals[point]
    }

    /// Where a point is at a displacement.
    pub(crate) fn place(&self, point: u32, displacement: &[f64]) -> Vec3 {
        self.table.positions[point as usize] + self.table.displacement(point as usize, displacement)
    }

    /// The coordinates of a place, as many as the body has.
    pub(crate) fn coordinates(&self, place: &Vec3) -> Vec<f64> {
        cut(place, self.table.dim)
    }
}
