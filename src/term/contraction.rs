//! Sums over the neighbours of a point: forces and matrices from stresses and tangents.

use nalgebra::Matrix3;

use crate::simd::{Arithmetic, LANES, Panel, Sink};
use crate::table::ShapeTable;
use crate::tensor::Tangent;

use super::Element;
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
            // In space the products of one component fill the registers.
            1 if D < 3 => self.add_point::<A, D, S>(local, &tangents[0], lower),
            1 => self.add_group::<A, D, S, 1>(local, tangents, lower),
            2 => self.add_group::<A, D, S, 2>(local, tangents, lower),
            3 => self.add_group::<A, D, S, 3>(local, tangents, lower),
            _ => self.add_group::<A, D, S, 4>(local, tangents, lower),
        }
    }

    /// As [`add_group`](Self::add_group) for one point, all components of a node at once: each window is read once.
    #[inline(always)]
    fn add_point<A: Arithmetic, const D: usize, const S: usize>(
        &self,
        local: &[u16],
        tangent: &PointTangent<D, S>,
        lower: &mut LowerBlocks,
    ) {
        for (&place, &(window, lane)) in local.iter().zip(&self.of) {
            let place = place as usize;
            let first = LowerBlocks::start(place);
            let windows = &self.windows[window as usize..];
            let gradients = &self.gradients[window as usize..][..windows.len()];
            let mut products = [[[0.0; WIDTH]; D]; D];
            for j in 0..D {
                for t in 0..S {
                    let g = gradients[0][0][t][lane as usize];
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
                                sum[l] = A::multiply_add(products[j][i][s], g[0][s][l], sum[l]);
                            }
                        }
                        target.copy_from_slice(&sum);
                    }
                }
            }
        }
    }

    /// The structured contraction: $T_{isj} = A_{isjt}\\,g_{bt}$ first, then for each window as many products as
    /// points and slots.
    #[inline(always)]
    fn add_group<A: Arithmetic, const D: usize, const S: usize, const P: usize>(
        &self,
        local: &[u16],
        tangents: &[PointTangent<D, S>],
        lower: &mut LowerBlocks,
    ) {
        for (&place, &(window, lane)) in local.iter().zip(&self.of) {
            let place = place as usize;
            let first = LowerBlocks::start(place) as u32;
            let windows = &self.windows[window as usize..];
            let gradients = &self.gradients[window as usize..][..windows.len()];
            for j in 0..D {
                let mut products = [[[0.0; WIDTH]; P]; D];
                for p in 0..P {
                    for t in 0..S {
                        let g = gradients[0][p][t][lane as usize];
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
                                    sum[l] = A::multiply_add(products[i][p][s], g[p][s][l], sum[l]);
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

/// Most points of a group in space: a cell of $2^3$ sub-cells.
const TOGETHER: usize = 8;
/// A group's nodes are at most so many times those that a point sees on average: the others have no gradient there.
const SPREAD: f64 = 1.25;

/// The points of a cell in space, which see nearly the same nodes: their products are summed in registers and added to
/// the cluster's matrix once.
#[derive(Debug, Clone, Default)]
pub(crate) struct Together {
    /// Points that wait, and their nodes in all.
    points: Vec<usize>,
    entries: usize,
    /// Nodes of all of them, by their place in the cluster.
    union: Vec<u16>,
    merged: Vec<u16>,
    /// First nodes of the windows, the node of each row (`u16::MAX` for none), and the row of each node of the cluster.
    windows: Vec<u16>,
    node_of: Vec<u16>,
    row_of: Vec<u32>,
    panel: Panel,
}

impl Together {
    /// Begins with another cluster.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.points.clear();
        self.union.clear();
        self.entries = 0;
        self.panel.tangents.clear();
    }

    /// Takes another point; what waits is added first where they don't fit together.
    #[inline(always)]
    pub(crate) fn push<const D: usize>(
        &mut self,
        table: &ShapeTable<D>,
        point: usize,
        tangent: [[[[f64; 3]; 3]; 3]; 3],
        lower: &mut LowerBlocks,
    ) {
        let local = table.clusters().local(point);
        if self.points.len() == TOGETHER {
            self.flush::<D>(table, lower);
        }
        if self.union.as_slice() != local {
            merge(&self.union, local, &mut self.merged);
            let mean = (self.entries + local.len()) as f64 / (self.points.len() + 1) as f64;
            if self.merged.len() as f64 > SPREAD * mean {
                self.flush::<D>(table, lower);
                self.merged.clear();
                self.merged.extend_from_slice(local);
            }
            std::mem::swap(&mut self.union, &mut self.merged);
        }
        self.points.push(point);
        self.entries += local.len();
        self.panel.tangents.push(tangent);
    }

    /// Adds $g_{as} A_{isjt}\\,g_{bt}$ of what waits to the lower half of the cluster's matrix.
    #[inline(always)]
    pub(crate) fn flush<const D: usize>(&mut self, table: &ShapeTable<D>, lower: &mut LowerBlocks) {
        if self.points.is_empty() {
            return;
        }
        self.windows.clear();
        self.node_of.clear();
        self.row_of.clear();
        self.row_of.resize(self.union.last().map_or(0, |&last| last as usize + 1), u32::MAX);
        for &node in &self.union {
            let start = match self.windows.last() {
                Some(&start) if usize::from(node) < usize::from(start) + WIDTH => start,
                _ => {
                    self.windows.push(node);
                    self.node_of.extend([u16::MAX; WIDTH]);
                    node
                }
            };
            let row = (self.windows.len() - 1) * WIDTH + usize::from(node - start);
            (self.row_of[usize::from(node)], self.node_of[row]) = (row as u32, node);
        }
        let blocks = (self.windows.len() * WIDTH).div_ceil(LANES);
        let Panel { gradients, blocks: known, .. } = &mut self.panel;
        *known = blocks;
        gradients.clear();
        gradients.resize(3 * self.points.len() * blocks, [0.0; LANES]);
        let columns = gradients.as_flattened_mut().chunks_exact_mut(3 * blocks * LANES);
        for (&point, columns) in self.points.iter().zip(columns) {
            let local = table.clusters().local(point);
            let all = table.gradients(point);
            for (s, column) in columns.chunks_exact_mut(blocks * LANES).enumerate() {
                for (&node, g) in local.iter().zip(&all[s * local.len()..]) {
                    column[self.row_of[usize::from(node)] as usize] = *g;
                }
            }
        }
        let Together { windows, node_of, panel, .. } = self;
        panel.multiply(&mut Rows::<D> { windows, node_of, lower });
        self.clear();
    }
}

/// Rows of a panel in the lower half of a cluster's matrix.
struct Rows<'a, const D: usize> {
    windows: &'a [u16],
    node_of: &'a [u16],
    lower: &'a mut LowerBlocks,
}

impl<const D: usize> Sink for Rows<'_, D> {
    #[inline(always)]
    fn wants(&self, row: usize) -> bool {
        self.node_of.get(row).is_some_and(|&node| node != u16::MAX)
    }

    #[inline(always)]
    fn add(&mut self, b: usize, j: usize, first: usize, sums: [&[f64]; 3]) {
        let node = usize::from(self.node_of[b]);
        let start = LowerBlocks::start(node);
        let (column, rows) = self.lower.column_mut::<D>(node, j);
        let from = (b / WIDTH).max(first / WIDTH);
        let to = ((first + sums[0].len()) / WIDTH).min(self.windows.len());
        for (i, sums) in sums.into_iter().enumerate() {
            let sums = sums[from * WIDTH - first..].as_chunks::<WIDTH>().0;
            for (&window, sum) in self.windows[from..to].iter().zip(sums) {
                let target = &mut column[i * rows + usize::from(window) - start..][..WIDTH];
                for l in 0..WIDTH {
                    target[l] += sum[l];
                }
            }
        }
    }
}

/// The union of two rising lists.
#[inline(always)]
fn merge(a: &[u16], b: &[u16], out: &mut Vec<u16>) {
    out.clear();
    let (mut a, mut b) = (a.iter().copied().peekable(), b.iter().copied().peekable());
    while let Some(least) = a.peek().into_iter().chain(b.peek()).min().copied() {
        a.next_if_eq(&least);
        b.next_if_eq(&least);
        out.push(least);
    }
}

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
