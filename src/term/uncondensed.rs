//! Pressures kept uncondensed: what clusters would add to the matrix by their condensed unknowns.

use nalgebra::Matrix4;

use crate::each::array_of;
use crate::simd::LANES;

/// Functions of a zone at most.
pub(crate) const FUNCTIONS: usize = 4;

/// Entries of a symmetric tangent, rows and columns $3s + i$ for component $i$ and slot $s$.
pub(crate) const ENTRIES: usize = 45;

/// Symmetric tangents of [`LANES`] points, lower triangles by rows. In single precision, for they are most of what a large model
/// keeps: solutions are sought to 1e-5 at best, and Newton's method takes the residual from the state.
pub(crate) type Tangents = [[f32; LANES]; ENTRIES];

/// Place of an entry of the lower triangle.
#[inline(always)]
pub(crate) const fn entry(row: usize, column: usize) -> usize {
    let (low, high) = if row < column { (row, column) } else { (column, row) };
    high * (high + 1) / 2 + low
}

/// The product of a zone's matrix with a vector, and the working memory behind it.
#[derive(Debug, Clone, Default)]
pub struct Product {
    /// Node by node of the zone.
    pub values: Vec<f64>,
    /// Eight nodes at a time, padded: displacements and forces of the nodes of a cell by components, gradients by slots.
    pub(super) moved: [Vec<[f64; LANES]>; 3],
    pub(super) forces: [Vec<[f64; LANES]>; 3],
}

/// The part $C^T H C$ of a cluster's matrix that its condensed pressures would make, kept as factors: in space it would
/// couple all nodes of a zone and leave the sparse matrix nearly dense.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Zone {
    /// Which term of the model, and which of its clusters.
    pub owner: [u32; 2],
    /// Nodes of the cluster.
    pub nodes: Vec<u32>,
    /// Rows of $C$: one vector over the unknowns of the nodes, node by node, for each function; in single precision, as the
    /// rest of what products read.
    pub slopes: Vec<f32>,
    /// $H$ \[stress\], for contact its compliance $\varepsilon/A$ \[length/force\], symmetric; rows and columns beyond the functions are zero.
    pub hessian: [[f64; FUNCTIONS]; FUNCTIONS],
    /// The initial shear modulus \[stress\], zero where it is not known.
    pub shear: f64,
    /// What the local equations leave, $r_\theta$ and $r_\pi$.
    pub of_theta: [f64; FUNCTIONS],
    /// See `of_theta`.
    pub of_pi: [f64; FUNCTIONS],
    /// The first of its pressures among the condensed unknowns of the term.
    pub(crate) place: usize,
    /// Tangents $w A_{isjt}$ at the points of the cluster, where the rest of its matrix is not summed either.
    pub(crate) tangents: Vec<Tangents>,
}

impl Zone {
    /// $C x$ for a vector over all unknowns.
    pub(crate) fn gather<const D: usize>(&self, x: &[f64]) -> [f64; FUNCTIONS] {
        let mut sums = [0.0; FUNCTIONS];
        let size = D * self.nodes.len();
        for (sum, row) in sums.iter_mut().zip(self.slopes.chunks_exact(size.max(1))) {
            for (c, &node) in row.chunks_exact(D).zip(&self.nodes) {
                let x = &x[node as usize * D..][..D];
                for i in 0..D {
                    *sum += f64::from(c[i]) * x[i];
                }
            }
        }
        sums
    }

    /// $y \mathrel{+}= C^T q$.
    /// `y` begins with the unknown `first`.
    pub(crate) fn scatter<const D: usize>(&self, q: &[f64; FUNCTIONS], y: &mut [f64], first: usize) {
        let size = D * self.nodes.len();
        for (q, row) in q.iter().zip(self.slopes.chunks_exact(size.max(1))) {
            for (c, &node) in row.chunks_exact(D).zip(&self.nodes) {
                let y = &mut y[node as usize * D - first..][..D];
                for i in 0..D {
                    y[i] += f64::from(c[i]) * q;
                }
            }
        }
    }

    /// Right-hand sides $-(r_\pi + H^{-1} r_\theta)$ of the rows $C\,\delta d - H^{-1}\delta\pi$; zero where $H$ is singular.
    pub(crate) fn gap(&self) -> [f64; FUNCTIONS] {
        let Some(compliance) = self.regular_hessian().try_inverse() else { return [0.0; FUNCTIONS] };
        let moved = compliance * nalgebra::Vector4::from(self.of_theta);
        array_of(|k| -(self.of_pi[k] + moved[k]))
    }

    /// $H$ with a unit diagonal for functions that the zone lacks.
    pub(crate) fn regular_hessian(&self) -> Matrix4<f64> {
        let mut hessian = Matrix4::from_fn(|k, l| self.hessian[k][l]);
        for k in 0..FUNCTIONS {
            if hessian[(k, k)] == 0.0 {
                hessian[(k, k)] = 1.0;
            }
        }
        hessian
    }
}
