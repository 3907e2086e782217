//! Shape functions at the points of a contact face.

use crate::compiled::by_dim;
use crate::geometry::{Mat3, Point, Vec3, all_padded};
use crate::simd::Plain;
use crate::table::{Clusters, ShapeTable, displacement_gradient};

/// A [`ShapeTable`] on a boundary, whose dimension is data: places and normals have three components.
pub(crate) struct FaceTable {
    pub dim: usize,
    pub node_count: usize,
    pub positions: Vec<Vec3>,
    /// Outward unit normals of the undeformed body.
    pub normals: Vec<Vec3>,
    pub weights: Vec<f64>,
    /// The points of each facet.
    pub clusters: Clusters,
    /// The first entry of each point, and the end.
    first: Vec<usize>,
    nodes: Vec<u32>,
    values: Vec<f64>,
    gradients: Vec<f64>,
    slots: usize,
    hoops: &'static [usize],
}

impl FaceTable {
    pub(crate) fn new<const D: usize>(table: &ShapeTable<D>) -> Self {
        let (mut first, mut nodes, mut values, mut gradients) = (vec![0], Vec::new(), Vec::new(), Vec::new());
        for point in 0..table.point_count() {
            nodes.extend_from_slice(table.nodes(point));
            values.extend_from_slice(table.values(point));
            gradients.extend_from_slice(table.gradients(point));
            first.push(nodes.len());
        }
        FaceTable {
            dim: D,
            node_count: table.node_count(),
            positions: all_padded(table.positions()),
            normals: all_padded(table.normals()),
            weights: table.weights().to_vec(),
            clusters: table.clusters().clone(),
            first,
            nodes,
            values,
            gradients,
            slots: table.gradient_components(),
            hoops: table.hoop_components(),
        }
    }

    /// Number of points.
    pub(crate) fn len(&self) -> usize {
        self.weights.len()
    }

    /// Nodes with a nonzero function at a point, by rising index.
    #[inline]
    pub(crate) fn nodes(&self, point: usize) -> &[u32] {
        &self.nodes[self.first[point]..self.first[point + 1]]
    }

    /// Values of their functions.
    #[inline]
    pub(crate) fn values(&self, point: usize) -> &[f64] {
        &self.values[self.first[point]..self.first[point + 1]]
    }

    /// The displacement that a vector of coefficients gives at a point.
    #[inline]
    pub(crate) fn displacement(&self, point: usize, d: &[f64]) -> Vec3 {
        let mut u = Point::zeros();
        by_dim!(self.dim, D => {
            for (&node, &value) in self.nodes(point).iter().zip(self.values(point)) {
                for i in 0..D {
                    u[i] += value * d[node as usize * D + i];
                }
            }
        });
        u
    }

    /// The gradient of the displacement at a point, with hoops on the diagonal.
    pub(crate) fn displacement_gradient(&self, point: usize, d: &[f64]) -> Mat3 {
        let gradients = &self.gradients[self.first[point] * self.slots..self.first[point + 1] * self.slots];
        by_dim!(self.dim, D => displacement_gradient::<Plain, D>(self.nodes(point), gradients, self.hoops, d))
    }
}
