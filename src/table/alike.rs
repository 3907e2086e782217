//! Sub-cells whose surroundings are alike: their rows are written once.

use std::collections::HashMap;

use crate::cells::Smoothing;
use crate::each::{EachOf, array_of};
use crate::geometry::Bounds;
use crate::shape::{Approximation, ShapeFunctions};

/// Sub-cells below which rows are written one by one.
const FEWEST: usize = 512;
/// Sub-cells in a row, in the middle of the body, that tell whether many are alike.
const SAMPLE: usize = 128;
/// Numbers are the same where they differ by no more than rounding leaves: a lattice a hundred supports wide, far from the
/// origin by as much, has places in supports to 1e-13.
const ROUNDING: f64 = 1e-11;
/// Sums of the numbers with fixed random factors that stand for all of them.
const SUMS: usize = 4;

/// Sums that tell surroundings apart, and how many nodes there are.
#[derive(Debug, Clone, Copy)]
pub(super) struct Likeness {
    sums: [f64; SUMS],
    nodes: usize,
}

/// Buffers of [`Surroundings::of`].
#[derive(Default)]
pub(super) struct Surroundings {
    numbers: Vec<f64>,
    factors: Vec<[f64; SUMS]>,
}

impl Surroundings {
    /// The nodes around a sub-cell and what tells it from others; none where the approximation does not know.
    pub(super) fn of<const D: usize>(
        &mut self,
        approximation: &dyn Approximation<D>,
        smoothing: &Smoothing<D>,
        cell: usize,
        nodes: &mut Vec<u32>,
    ) -> Option<Likeness> {
        let points = |facet: u32| smoothing.facet(facet as usize);
        let facets = &smoothing.cells[cell];
        let at = facets.iter().flat_map(|&(facet, _)| &smoothing.facet_points[points(facet)]);
        let Bounds { low, high } = Bounds::of(at);
        if !approximation.surroundings(&low, &high, nodes, &mut self.numbers) {
            return None;
        }
        let width = (high - low).amax();
        self.numbers.push(width.ln());
        for &(facet, sign) in facets {
            let size = smoothing.facet_areas[points(facet).start].norm();
            self.numbers.push(size.ln());
            for (at, area) in smoothing.facet_points[points(facet)].iter().zip(&smoothing.facet_areas[points(facet)]) {
                for k in 0..D {
                    self.numbers.push((at[k] - low[k]) / width);
                    self.numbers.push(sign * area[k] / size);
                }
            }
        }
        Some(self.likeness(nodes.len()))
    }

    /// What tells the shape functions of a point in an element from others.
    pub(super) fn of_functions<const D: usize>(&mut self, psi: &ShapeFunctions<D>, weight: f64) -> Likeness {
        let width = weight.powf(1.0 / D as f64);
        self.numbers.clear();
        self.numbers.push(width.ln());
        self.numbers.extend_from_slice(&psi.values);
        for gradient in &psi.gradients {
            for k in 0..D {
                self.numbers.push(width * gradient[k]);
            }
        }
        self.likeness(psi.nodes.len())
    }

    fn likeness(&mut self, nodes: usize) -> Likeness {
        let mut state = self.factors.len() as u64;
        self.factors.resize_with(self.numbers.len().max(self.factors.len()), || {
            state += 1;
            array_of(|k| factor(state * SUMS as u64 + k as u64))
        });
        let mut sums = [0.0; SUMS];
        for (number, factors) in self.numbers.iter().zip(&self.factors) {
            for k in 0..SUMS {
                sums[k] += number * factors[k];
            }
        }
        Likeness { sums, nodes }
    }

    /// Whether many sub-cells are like others.
    pub(super) fn repeat<const D: usize>(approximation: &dyn Approximation<D>, smoothing: &Smoothing<D>) -> bool {
        let count = smoothing.cells.len();
        if count < FEWEST {
            return false;
        }
        let (mut own, mut nodes) = (Surroundings::default(), Vec::new());
        let first = (count - SAMPLE) / 2;
        let sample = (first..first + SAMPLE).map(|cell| own.of(approximation, smoothing, cell, &mut nodes));
        let Some(sample) = sample.collect::<Option<Vec<_>>>() else { return false };
        let alone = sources(&sample).iter().enumerate().filter(|(k, source)| *k == **source as usize).count();
        2 * alone <= SAMPLE
    }
}

/// A number between −1 and 1 that follows from another without pattern (SplitMix64).
fn factor(k: u64) -> f64 {
    let mut z = k.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (z ^ (z >> 31)) as i64 as f64 / i64::MAX as f64
}

/// For each sub-cell the first one that it is like.
pub(super) fn sources(all: &[Likeness]) -> Vec<u32> {
    // Numbers that may be the same stand in one bin or in two that touch.
    const WIDTH: f64 = 1e3 * ROUNDING;
    // The last sub-cell of each bin, and the one in the same bin before each.
    let mut bins: HashMap<i64, u32> = HashMap::with_capacity(all.len());
    let mut earlier: Vec<Option<u32>> = vec![None; all.len()];
    let like = |a: &Likeness, b: &Likeness| {
        a.nodes == b.nodes && a.sums.iter().zip(&b.sums).all(|(a, b)| (a - b).abs() <= ROUNDING)
    };
    let source = |(cell, own): (usize, &Likeness)| {
        let place = own.sums[0] / WIDTH;
        let near = 2.0 * ROUNDING / WIDTH;
        for bin in [place - near, place + near].each(|x| x.floor() as i64) {
            let mut others = std::iter::successors(bins.get(&bin).copied(), |&other| earlier[other as usize]);
            if let Some(known) = others.find(|&other| like(&all[other as usize], own)) {
                return known;
            }
        }
        earlier[cell] = bins.insert(place.floor() as i64, cell as u32);
        cell as u32
    };
    all.iter().enumerate().map(source).collect()
}
