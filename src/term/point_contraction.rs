//! Sums over neighbour pairs at one point, and stresses and tangents without the components that the kinematics lacks.

use nalgebra::Matrix3;

use crate::table::ShapeTable;
use crate::tensor::Tangent;

use super::Element;

/// Stress components that do work on the displacement of one kinematics: entry $3i + s$ belongs to
/// displacement component $i$ and gradient slot $s$; the hoops are summed into slot $D$ of component 0.
#[inline]
pub(crate) fn reduce_stress<const D: usize>(stress: &Matrix3<f64>, hoops: &[usize]) -> [f64; 9] {
    let mut reduced = [0.0; 9];
    for i in 0..D {
        for s in 0..D {
            reduced[3 * i + s] = stress[(i, s)];
        }
    }
    for &k in hoops {
        reduced[D] += stress[(k, k)];
    }
    reduced
}

/// The tangent in the components of [`reduce_stress`].
#[inline]
pub(crate) fn reduce_tangent<const D: usize>(tangent: &Tangent, hoops: &[usize]) -> [[f64; 9]; 9] {
    let mut reduced = [[0.0; 9]; 9];
    for i in 0..D {
        for s in 0..D {
            for j in 0..D {
                for t in 0..D {
                    reduced[3 * i + s][3 * j + t] = tangent[(3 * i + s, 3 * j + t)];
                }
            }
            for &k in hoops {
                reduced[3 * i + s][D] += tangent[(3 * i + s, 4 * k)];
                reduced[D][3 * i + s] += tangent[(4 * k, 3 * i + s)];
            }
        }
    }
    for &k in hoops {
        for &l in hoops {
            reduced[D][D] += tangent[(4 * k, 4 * l)];
        }
    }
    reduced
}

/// Sums over neighbour pairs, compiled for each dimension and number of slots.
#[derive(Clone, Copy)]
pub(crate) struct Contraction {
    dimension: usize,
    slots: usize,
}

impl Contraction {
    pub(crate) fn of<const D: usize>(table: &ShapeTable<D>) -> Self {
        Contraction { dimension: D, slots: table.gradient_components() }
    }

    /// Adds $w\\,P_{is}\\,g_{as}$ to the forces of a cluster.
    #[inline]
    pub(crate) fn add_forces<const D: usize>(
        self,
        table: &ShapeTable<D>,
        point: usize,
        stress: &[f64; 9],
        weight: f64,
        forces: &mut [f64],
    ) {
        let local = table.clusters().local(point);
        let gradients = table.gradients(point);
        let n = local.len();
        for (a, &l) in local.iter().enumerate() {
            let target = &mut forces[l as usize * D..l as usize * D + D];
            for (i, entry) in target.iter_mut().enumerate() {
                let mut sum = 0.0;
                for s in 0..self.slots {
                    sum += stress[3 * i + s] * gradients[s * n + a];
                }
                *entry += weight * sum;
            }
        }
    }

    /// Adds $w\\,g_{as} A_{isjt}\\,g_{bt}$ to the matrix of a cluster.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn add_matrix<const D: usize>(
        self,
        table: &ShapeTable<D>,
        point: usize,
        tangent: &[[f64; 9]; 9],
        weight: f64,
        size: usize,
        symmetric: bool,
        out: &mut Element,
    ) {
        let local = table.clusters().local(point);
        let gradients = table.gradients(point);
        let matrix = &mut out.matrix;
        match (self.dimension, self.slots) {
            (1, 1) => add_block::<1, 1>(local, gradients, tangent, weight, size, symmetric, matrix),
            (1, 2) => add_block::<1, 2>(local, gradients, tangent, weight, size, symmetric, matrix),
            (2, 2) => add_block::<2, 2>(local, gradients, tangent, weight, size, symmetric, matrix),
            (2, 3) => add_block::<2, 3>(local, gradients, tangent, weight, size, symmetric, matrix),
            _ => add_block::<3, 3>(local, gradients, tangent, weight, size, symmetric, matrix),
        }
    }
}

/// The structured contraction: $T_{isj} = A_{isjt} g_{bt}$ first, then one dot product per entry.
fn add_block<const D: usize, const S: usize>(
    local: &[u16],
    gradients: &[f64],
    tangent: &[[f64; 9]; 9],
    weight: f64,
    size: usize,
    symmetric: bool,
    matrix: &mut [f64],
) {
    let n = local.len();
    for b in 0..n {
        let mut g = [0.0; S];
        for t in 0..S {
            g[t] = weight * gradients[t * n + b];
        }
        let first = if symmetric { b } else { 0 };
        for j in 0..D {
            let mut products = [[0.0; S]; D];
            for i in 0..D {
                for s in 0..S {
                    let row = &tangent[3 * i + s];
                    let mut sum = 0.0;
                    for t in 0..S {
                        sum += row[3 * j + t] * g[t];
                    }
                    products[i][s] = sum;
                }
            }
            let start = (local[b] as usize * D + j) * size;
            let column = &mut matrix[start..start + size];
            for a in first..n {
                let row = local[a] as usize * D;
                let target = &mut column[row..row + D];
                for i in 0..D {
                    let mut sum = 0.0;
                    for s in 0..S {
                        sum += products[i][s] * gradients[s * n + a];
                    }
                    target[i] += sum;
                }
            }
        }
    }
}
