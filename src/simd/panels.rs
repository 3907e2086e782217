//! Products of panels: what the points of a group add to the matrix of their nodes, by whole registers.

/// Rows of a panel come in so many at a time: one register of the widest instructions.
pub(crate) const LANES: usize = 8;

/// So many numbers side by side.
pub(crate) type Eight = [f64; LANES];

/// Gradients of all nodes at some points, and the tangents there.
///
/// Row $r$ belongs to a node, column $3p + s$ to component $s$ of the gradient at point $p$.
#[derive(Debug, Clone, Default)]
pub(crate) struct Panel {
    /// Column by column, eight rows at a time.
    pub gradients: Vec<Eight>,
    /// Rows, divided by [`LANES`].
    pub blocks: usize,
    /// $A_{isjt}$ of each point with its weight, at `[t][s][j][i]`.
    pub tangents: Vec<[[[[f64; 3]; 3]; 3]; 3]>,
    /// $T_{psji} = A_{isjt}\\,g_{bt}$ for eight rows $b$ at a time.
    #[cfg(all(feature = "solve", target_arch = "x86_64"))]
    products: Vec<[[Eight; 3]; 3]>,
}

/// Takes the sums $K_{ia,jb} = \sum_{p,s} g_{psa} T_{psji}$ of one column.
pub(crate) trait Sink {
    /// Whether the matrix has columns for this row of the panel.
    fn wants(&self, row: usize) -> bool;

    /// Adds the sums for $b$, $j$ and the rows $a$ from `first` on: `sums[i][a - first]`.
    fn add(&mut self, b: usize, j: usize, first: usize, sums: [&[f64]; 3]);
}

impl Panel {
    /// Hands all columns to `sink`, rows of earlier blocks of eight left out.
    #[inline]
    pub(crate) fn multiply<K: Sink>(&mut self, sink: &mut K) {
        #[cfg(all(feature = "solve", target_arch = "x86_64"))]
        match pulp::x86::Arch::new() {
            pulp::x86::Arch::V4(simd) => {
                pulp::Simd::vectorize(simd, wide::Multiply::<K, 8> { panel: self, sink });
                return;
            }
            pulp::x86::Arch::V3(simd) => {
                pulp::Simd::vectorize(simd, wide::Multiply::<K, 4> { panel: self, sink });
                return;
            }
            _ => {}
        }
        self.multiply_plainly(sink);
    }

    /// The same for machines whose registers are not known.
    fn multiply_plainly<K: Sink>(&self, sink: &mut K) {
        for b in (0..self.blocks * LANES).filter(|&b| sink.wants(b)).collect::<Vec<_>>() {
            let own = |column: usize| self.gradients[column * self.blocks + b / LANES][b % LANES];
            for j in 0..3 {
                for block in b / LANES..self.blocks {
                    let mut sums = [[0.0; LANES]; 3];
                    for (p, tangent) in self.tangents.iter().enumerate() {
                        for s in 0..3 {
                            let rows = &self.gradients[(3 * p + s) * self.blocks + block];
                            for i in 0..3 {
                                let factor: f64 = (0..3).map(|t| tangent[t][s][j][i] * own(3 * p + t)).sum();
                                for l in 0..LANES {
                                    sums[i][l] += factor * rows[l];
                                }
                            }
                        }
                    }
                    sink.add(b, j, block * LANES, sums.each_ref().map(|sum| sum.as_slice()));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::abs_diff_eq;

    /// A matrix of one node for each row that is not a multiple of five.
    struct Whole(Vec<f64>, usize);

    impl Sink for Whole {
        fn wants(&self, row: usize) -> bool {
            !row.is_multiple_of(5)
        }

        fn add(&mut self, b: usize, j: usize, first: usize, sums: [&[f64]; 3]) {
            for (i, sums) in sums.into_iter().enumerate() {
                for (a, sum) in sums.iter().enumerate() {
                    self.0[((b * 3 + j) * 3 + i) * self.1 + first + a] += sum;
                }
            }
        }
    }

    #[test]
    fn every_way_gives_the_same_matrix_to_rounding() {
        for (points, blocks) in [(1, 1), (3, 4), (8, 8), (5, 17)] {
            let mut panel = Panel { blocks, ..Panel::default() };
            let mut number = 0.0;
            let mut next = || {
                number += 1.0;
                f64::sin(number)
            };
            panel.gradients = (0..3 * points * blocks).map(|_| std::array::from_fn(|_| next())).collect();
            let of = |next: &mut dyn FnMut() -> f64| {
                std::array::from_fn(|_| {
                    std::array::from_fn(|_| std::array::from_fn(|_| std::array::from_fn(|_| next())))
                })
            };
            panel.tangents = (0..points).map(|_| of(&mut next)).collect();
            let rows = blocks * LANES;
            let [mut best, mut plain] = [(); 2].map(|()| Whole(vec![0.0; 9 * rows * rows], rows));
            panel.multiply(&mut best);
            panel.multiply_plainly(&mut plain);
            assert!(plain.0.iter().any(|x| x.abs() > 1.0));
            for (best, plain) in best.0.iter().zip(&plain.0) {
                assert!(abs_diff_eq!(best, plain, epsilon = 1e-12 * points as f64), "{points} points, {blocks} blocks");
            }
        }
    }
}

#[cfg(all(feature = "solve", target_arch = "x86_64"))]
mod wide {
    use pulp::{Simd, WithSimd};

    use super::{Eight, LANES, Panel, Sink};

    /// `MOST`: registers of rows whose sums of three components leave room for what they are made of.
    pub(super) struct Multiply<'a, K, const MOST: usize> {
        pub panel: &'a mut Panel,
        pub sink: &'a mut K,
    }

    impl<K: Sink, const MOST: usize> WithSimd for Multiply<'_, K, MOST> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            let Multiply { panel: Panel { gradients, blocks, tangents, products }, sink } = self;
            let blocks = *blocks;
            products.clear();
            products.resize(3 * tangents.len(), Default::default());
            for block in 0..blocks {
                for (p, tangent) in tangents.iter().enumerate() {
                    let g: [&Eight; 3] = std::array::from_fn(|t| &gradients[(3 * p + t) * blocks + block]);
                    for s in 0..3 {
                        for j in 0..3 {
                            for i in 0..3 {
                                let target = S::as_mut_simd_f64s(&mut products[3 * p + s][j][i]).0;
                                for (v, target) in target.iter_mut().enumerate() {
                                    let mut sum = simd.splat_f64s(0.0);
                                    for t in 0..3 {
                                        let g = S::as_simd_f64s(g[t]).0[v];
                                        sum = simd.mul_add_f64s(simd.splat_f64s(tangent[t][s][j][i]), g, sum);
                                    }
                                    *target = sum;
                                }
                            }
                        }
                    }
                }
                for lane in 0..LANES {
                    let b = block * LANES + lane;
                    if !sink.wants(b) {
                        continue;
                    }
                    for j in 0..3 {
                        let per = LANES / S::F64_LANES;
                        let mut first = block * per;
                        while first < blocks * per {
                            let count = (blocks * per - first).min(MOST);
                            let at = Place { blocks, first, b, j, lane };
                            macro_rules! sums {
                                ($($n:literal)*) => {
                                    match count {
                                        // What registers have no room for is not compiled.
                                        $($n if const { $n <= MOST } => {
                                            sum::<S, K, $n>(simd, gradients, products, at, sink)
                                        })*
                                        _ => {}
                                    }
                                };
                            }
                            sums!(1 2 3 4 5 6 7 8);
                            first += count;
                        }
                    }
                }
            }
        }
    }

    #[derive(Clone, Copy)]
    struct Place {
        blocks: usize,
        /// First register of rows.
        first: usize,
        b: usize,
        j: usize,
        lane: usize,
    }

    /// `N` registers of rows for three components.
    #[inline(always)]
    fn sum<S: Simd, K: Sink, const N: usize>(
        simd: S,
        gradients: &[Eight],
        products: &[[[Eight; 3]; 3]],
        at: Place,
        sink: &mut K,
    ) {
        let lanes = S::F64_LANES;
        let (gradients, stride) = (gradients.as_flattened(), at.blocks * LANES);
        let mut sums = [[simd.splat_f64s(0.0); N]; 3];
        for (column, product) in gradients.chunks_exact(stride).zip(products) {
            let rows = S::as_simd_f64s(&column[at.first * lanes..][..N * lanes]).0;
            let rows: &[S::f64s; N] = match rows.try_into() {
                Ok(rows) => rows,
                Err(_) => return,
            };
            for i in 0..3 {
                let factor = simd.splat_f64s(product[at.j][i][at.lane]);
                for n in 0..N {
                    sums[i][n] = simd.mul_add_f64s(factor, rows[n], sums[i][n]);
                }
            }
        }
        let mut out = [[[0.0; LANES]; 8]; 3];
        for i in 0..3 {
            let out = S::as_mut_simd_f64s(out[i].as_flattened_mut()).0;
            out[..N].copy_from_slice(&sums[i]);
        }
        let count = N * lanes;
        let sum = |i: usize| &out[i].as_flattened()[..count];
        sink.add(at.b, at.j, at.first * lanes, [sum(0), sum(1), sum(2)]);
    }
}
