//! Sums over the neighbours of a point: forces and matrices from stresses and tangents.

use crate::simd::Arithmetic;

use super::lower::{LowerBlocks, WIDTH};

/// Points with the same nodes that are summed together: their matrix is read and written once for all.
pub(crate) const GROUP: usize = 4;

/// Nodes of a point in one window.
#[derive(Debug, Clone, Copy)]
struct Window {
    /// First node of the window, by its place in the cluster.
    start: u32,
    /// First of the point's nodes in it.
    first: u32,
    /// Whether the point sees all nodes of the window.
    whole: bool,
}

/// The nodes of a group of points in windows of four successive nodes of their cluster, gradients by point and
/// slot beside them; nodes of a window that the points do not see have zero gradients.
#[derive(Debug, Clone, Default)]
pub(crate) struct Windows {
    windows: Vec<Window>,
    /// Window of each node and its place there.
    of: Vec<(u32, u32)>,
    /// Of up to three slots.
    gradients: Vec<[[[f64; WIDTH]; 3]; GROUP]>,
}

/// $A_{isjt}$ of a point at `[j][t][i][s]`, weight included.
pub(crate) type PointTangent<const D: usize, const S: usize> = [[[[f64; WIDTH]; D]; S]; D];

impl Windows {
    /// Lays out windows over the nodes of a first point.
    #[inline(always)]
    pub(crate) fn lay(&mut self, local: &[u16]) {
        self.windows.clear();
        self.of.clear();
        let mut a = 0;
        while a < local.len() {
            let start = u32::from(local[a]);
            let first = a;
            let window = self.windows.len() as u32;
            while a < local.len() && u32::from(local[a]) < start + WIDTH as u32 {
                self.of.push((window, u32::from(local[a]) - start));
                a += 1;
            }
            self.windows.push(Window { start, first: first as u32, whole: a - first == WIDTH });
        }
        // What stands there is written over.
        if self.gradients.len() < self.windows.len() {
            self.gradients.resize(self.windows.len(), [[[0.0; WIDTH]; 3]; GROUP]);
        }
    }

    /// Packs the gradients of the `p`-th point of the group.
    #[inline(always)]
    pub(crate) fn pack<const S: usize>(&mut self, p: usize, gradients: &[f64]) {
        let n = self.of.len();
        for (window, packed) in self.windows.iter().zip(&mut self.gradients) {
            let packed = &mut packed[p];
            let first = window.first as usize;
            if window.whole {
                for s in 0..S {
                    packed[s].copy_from_slice(&gradients[s * n + first..][..WIDTH]);
                }
                continue;
            }
            for s in 0..S {
                packed[s] = [0.0; WIDTH];
            }
            let last = (first + WIDTH).min(n);
            let of = self.of[first];
            for (a, &(_, place)) in (first..).zip(self.of[first..last].iter().take_while(|o| o.0 == of.0)) {
                for s in 0..S {
                    packed[s][place as usize] = gradients[s * n + a];
                }
            }
        }
    }

    /// The windows of the `p`-th point with its gradients.
    #[inline(always)]
    fn of_point(&self, p: usize) -> impl Iterator<Item = (usize, &[[f64; WIDTH]; 3])> {
        self.windows.iter().zip(&self.gradients).map(move |(window, gradients)| (window.start as usize, &gradients[p]))
    }

    /// Adds $P_{is}\\,g_{as}$ of the `p`-th point to forces by components of a padded length.
    #[inline(always)]
    pub(crate) fn add_forces<A: Arithmetic, const D: usize, const S: usize>(
        &self,
        p: usize,
        stress: &[[f64; WIDTH]; D],
        stride: usize,
        forces: &mut [f64],
    ) {
        for (start, g) in self.of_point(p) {
            for i in 0..D {
                let at = i * stride + start;
                let target = &mut forces[at..at + WIDTH];
                let mut sum = [target[0], target[1], target[2], target[3]];
                for s in 0..S {
                    for l in 0..WIDTH {
                        sum[l] = A::multiply_add(stress[i][s], g[s][l], sum[l]);
                    }
                }
                target.copy_from_slice(&sum);
            }
        }
    }

    /// Adds $f_k\\,P_{is}\\,g_{as}$ for several factors $f_k$ to as many vectors of `D` components.
    #[inline(always)]
    pub(crate) fn add_multiples<A: Arithmetic, const D: usize, const S: usize>(
        &self,
        p: usize,
        stress: &[[f64; WIDTH]; D],
        factors: &[f64],
        stride: usize,
        vectors: &mut [f64],
    ) {
        for (start, g) in self.of_point(p) {
            for i in 0..D {
                let mut sum = [0.0; WIDTH];
                for s in 0..S {
                    for l in 0..WIDTH {
                        sum[l] = A::multiply_add(stress[i][s], g[s][l], sum[l]);
                    }
                }
                for (k, factor) in factors.iter().enumerate() {
                    let at = (k * D + i) * stride + start;
                    let target = &mut vectors[at..at + WIDTH];
                    for l in 0..WIDTH {
                        target[l] = A::multiply_add(*factor, sum[l], target[l]);
                    }
                }
            }
        }
    }

    /// Adds $g_{as} A_{isjt}\\,g_{bt}$ of the group's points to the lower half of a cluster's matrix.
    #[inline(always)]
    pub(crate) fn add_matrices<A: Arithmetic, const D: usize, const S: usize>(
        &self,
        local: &[u16],
        tangents: &[PointTangent<D, S>],
        lower: &mut LowerBlocks,
    ) {
        match tangents.len() {
            0 => {}
            1 => self.add_last::<A, D, S>(local, tangents, lower),
            2 => self.add_group::<A, D, S, 2>(0, local, tangents, lower),
            3 => {
                self.add_group::<A, D, S, 2>(0, local, tangents, lower);
                self.add_last::<A, D, S>(local, tangents, lower);
            }
            _ => self.add_group::<A, D, S, 4>(0, local, tangents, lower),
        }
    }

    /// Adds the last point of the group.
    #[inline(always)]
    fn add_last<A: Arithmetic, const D: usize, const S: usize>(
        &self,
        local: &[u16],
        tangents: &[PointTangent<D, S>],
        lower: &mut LowerBlocks,
    ) {
        // In 3D the products of one component fill the registers.
        if const { D < 3 } {
            self.add_point::<A, D, S>(tangents.len() - 1, local, tangents, lower);
        } else {
            self.add_group::<A, D, S, 1>(tangents.len() - 1, local, tangents, lower);
        }
    }

    /// As [`add_group`](Self::add_group) for one point, all components of a node at once: each window is read once.
    #[inline(always)]
    fn add_point<A: Arithmetic, const D: usize, const S: usize>(
        &self,
        p: usize,
        local: &[u16],
        tangents: &[PointTangent<D, S>],
        lower: &mut LowerBlocks,
    ) {
        let tangent = &tangents[p];
        for (&place, &(window, lane)) in local.iter().zip(&self.of) {
            let place = place as usize;
            let first = LowerBlocks::start(place);
            let windows = &self.windows[window as usize..];
            let gradients = &self.gradients[window as usize..][..windows.len()];
            let mut products = [[[0.0; WIDTH]; D]; D];
            for j in 0..D {
                for t in 0..S {
                    let g = gradients[0][p][t][lane as usize];
                    for i in 0..D {
                        for s in 0..WIDTH {
                            products[j][i][s] = A::multiply_add(tangent[j][t][i][s], g, products[j][i][s]);
                        }
                    }
                }
            }
            let (block, rows) = lower.block_mut::<D>(place);
            let mut columns = block.chunks_exact_mut(rows);
            let parts: [[&mut [f64]; D]; D] =
                std::array::from_fn(|_| std::array::from_fn(|_| columns.next().unwrap_or_default()));
            for (window, g) in windows.iter().zip(gradients) {
                let at = window.start as usize - first;
                for j in 0..D {
                    for i in 0..D {
                        let target = &mut parts[j][i][at..at + WIDTH];
                        let mut sum = [target[0], target[1], target[2], target[3]];
                        for s in 0..S {
                            for l in 0..WIDTH {
                                sum[l] = A::multiply_add(products[j][i][s], g[p][s][l], sum[l]);
                            }
                        }
                        target.copy_from_slice(&sum);
                    }
                }
            }
        }
    }

    /// The structured contraction of `P` points behind others of the group: $T_{isj} = A_{isjt}\\,g_{bt}$ first, then for each window as many products as
    /// points and slots.
    #[inline(always)]
    fn add_group<A: Arithmetic, const D: usize, const S: usize, const P: usize>(
        &self,
        before: usize,
        local: &[u16],
        tangents: &[PointTangent<D, S>],
        lower: &mut LowerBlocks,
    ) {
        let tangents = &tangents[before..];
        for (&place, &(window, lane)) in local.iter().zip(&self.of) {
            let place = place as usize;
            let first = LowerBlocks::start(place) as u32;
            let windows = &self.windows[window as usize..];
            let gradients = &self.gradients[window as usize..][..windows.len()];
            for j in 0..D {
                let mut products = [[[0.0; WIDTH]; P]; D];
                for p in 0..P {
                    for t in 0..S {
                        let g = gradients[0][before + p][t][lane as usize];
                        for i in 0..D {
                            for s in 0..WIDTH {
                                products[i][p][s] = A::multiply_add(tangents[p][j][t][i][s], g, products[i][p][s]);
                            }
                        }
                    }
                }
                let (column, rows) = lower.column_mut::<D>(place, j);
                for (window, g) in windows.iter().zip(gradients) {
                    let at = (window.start - first) as usize;
                    for i in 0..D {
                        let target = &mut column[i * rows + at..][..WIDTH];
                        let mut sum = [target[0], target[1], target[2], target[3]];
                        for p in 0..P {
                            for s in 0..S {
                                for l in 0..WIDTH {
                                    sum[l] = A::multiply_add(products[i][p][s], g[before + p][s][l], sum[l]);
                                }
                            }
                        }
                        target.copy_from_slice(&sum);
                    }
                }
            }
        }
    }
}
