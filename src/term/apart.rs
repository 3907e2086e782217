//! Pressures kept apart: what clusters would add to the matrix by their condensed unknowns.

use nalgebra::Matrix4;

use crate::parallel::map_ranges;

/// Functions of a zone at most.
pub(crate) const FUNCTIONS: usize = 4;

/// The part $C^T H C$ of a cluster's matrix that its condensed pressures would make, kept as factors: in space it would
/// couple all nodes of a zone and leave the sparse matrix nearly dense.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Zone {
    /// Nodes of the cluster.
    pub nodes: Vec<u32>,
    /// Rows of $C$: one vector over the unknowns of the nodes, node by node, for each function.
    pub slopes: Vec<f64>,
    /// $H$ \[stress\], symmetric; rows and columns beyond the functions are zero.
    pub hessian: [[f64; FUNCTIONS]; FUNCTIONS],
    /// The initial shear modulus \[stress\], zero where it is not known.
    pub shear: f64,
}

impl Zone {
    /// Number of functions.
    pub fn functions<const D: usize>(&self) -> usize {
        self.slopes.len() / (D * self.nodes.len()).max(1)
    }

    /// $C x$ for a vector over all unknowns.
    pub fn gather<const D: usize>(&self, x: &[f64]) -> [f64; FUNCTIONS] {
        let mut sums = [0.0; FUNCTIONS];
        let size = D * self.nodes.len();
        for (sum, row) in sums.iter_mut().zip(self.slopes.chunks_exact(size.max(1))) {
            for (c, &node) in row.chunks_exact(D).zip(&self.nodes) {
                let x = &x[node as usize * D..][..D];
                for i in 0..D {
                    *sum += c[i] * x[i];
                }
            }
        }
        sums
    }

    /// $y \mathrel{+}= C^T q$.
    pub fn scatter<const D: usize>(&self, q: &[f64; FUNCTIONS], y: &mut [f64]) {
        let size = D * self.nodes.len();
        for (q, row) in q.iter().zip(self.slopes.chunks_exact(size.max(1))) {
            for (c, &node) in row.chunks_exact(D).zip(&self.nodes) {
                let y = &mut y[node as usize * D..][..D];
                for i in 0..D {
                    y[i] += c[i] * q;
                }
            }
        }
    }

    /// $H$ with a unit diagonal for functions that the zone lacks.
    pub fn regular_hessian(&self) -> Matrix4<f64> {
        let mut hessian = Matrix4::from_fn(|k, l| self.hessian[k][l]);
        for k in 0..FUNCTIONS {
            if hessian[(k, k)] == 0.0 {
                hessian[(k, k)] = 1.0;
            }
        }
        hessian
    }
}

/// $C x$ of all zones, on all threads.
pub fn gather_all<const D: usize>(zones: &[Zone], x: &[f64]) -> Vec<[f64; FUNCTIONS]> {
    map_ranges(zones.len(), 64, |range| zones[range].iter().map(|zone| zone.gather::<D>(x)).collect::<Vec<_>>())
        .concat()
}
