//! Moments of shape functions over the facets between sub-cells.

use crate::cells::Smoothing;
use crate::error::Error;
use crate::geometry::Point;
use crate::parallel::map_ranges;
use crate::shape::{Approximation, Scratch, ShapeFunctions};

use super::build::SERIAL_BELOW;
use super::check_values;
use super::measured::Measured;

/// Facets in consecutive runs, as they were integrated: joining them would copy the largest lists of all.
pub(super) struct Facets<const D: usize, const Q: usize> {
    /// First facet of each run.
    starts: Vec<usize>,
    runs: Vec<Run<D, Q>>,
    pub(super) rcond: f64,
}

/// $\int\Psi_I\\,m\\,n\\,q_k\\,\mathrm dA$ over each facet of a run, in the direction in which the facet is stored:
/// $q$ are the [`monomials`] from the first point $o$ of the facet.
struct Run<const D: usize, const Q: usize> {
    ends: Vec<usize>,
    nodes: Vec<u32>,
    sums: Vec<[Point<D>; Q]>,
    /// $\int m\\,(x_0 - o)\\,n_0\\,\mathrm dA$: the facet's part in the measure of its cells.
    volumes: Vec<f64>,
    rcond: f64,
}

impl<const D: usize, const Q: usize> Facets<D, Q> {
    /// Nodes and sums of a facet, and its part in the measure of its cells.
    pub(super) fn get(&self, facet: usize) -> (&[u32], &[[Point<D>; Q]], f64) {
        let run = self.starts.partition_point(|&start| start <= facet) - 1;
        let (run, facet) = (&self.runs[run], facet - self.starts[run]);
        let entries = if facet == 0 { 0..run.ends[0] } else { run.ends[facet - 1]..run.ends[facet] };
        (&run.nodes[entries.clone()], &run.sums[entries], run.volumes[facet])
    }

    /// Facets are integrated once, and each serves both its neighbours.
    pub(super) fn integrate(
        approximation: &dyn Approximation<D>,
        smoothing: &Smoothing<D>,
        measured: &Measured<'_, D>,
    ) -> Result<Self, Error> {
        let count = smoothing.facet_count();
        let dimension = (1 + measured.hoops) as f64;
        // Radii count from the axis. Other coordinates count from the body: far from the origin the parts of a small
        // cell would be large and cancel.
        let on_axis = measured.hoops > 0;
        let origin = smoothing.facet_points.first().filter(|_| !on_axis).map_or(0.0, |at| at[0]);
        let runs = map_ranges(count, SERIAL_BELOW, |range| -> Result<(usize, Run<D, Q>), Error> {
            let mut facets = Run {
                ends: Vec::with_capacity(range.len()),
                nodes: Vec::new(),
                sums: Vec::new(),
                volumes: Vec::with_capacity(range.len()),
                rcond: 1.0,
            };
            let mut scratch = Scratch::default();
            let mut psi = ShapeFunctions::default();
            let mut list = List::default();
            for facet in range.clone() {
                let own = smoothing.facet(facet);
                let first = own.start;
                let mut volume = 0.0;
                list.clear();
                for point in own {
                    let at = &smoothing.facet_points[point];
                    approximation.evaluate_values(at, &mut scratch, &mut psi)?;
                    check_values(&psi, approximation.nodes().len(), at)?;
                    facets.rcond = facets.rcond.min(psi.rcond);
                    let area = smoothing.facet_areas[point] * measured.at(at)?;
                    volume += (at[0] - origin) * area[0] / dimension;
                    let away = at - smoothing.facet_points[first];
                    let q = monomials::<D, Q>(&away);
                    list.add([Point::zeros(); Q], &psi.nodes, |a, sum| {
                        let flux = area * psi.values[a];
                        for (sum, q) in sum.iter_mut().zip(&q) {
                            *sum += flux * *q;
                        }
                    });
                }
                facets.nodes.extend_from_slice(&list.nodes);
                facets.sums.extend_from_slice(&list.sums);
                facets.ends.push(facets.nodes.len());
                facets.volumes.push(volume);
                if facet == range.start {
                    // As wide as the first one, and some.
                    let width = list.nodes.len() + list.nodes.len() / 8;
                    facets.nodes.reserve(width * range.len());
                    facets.sums.reserve(width * range.len());
                }
            }
            Ok((range.start, facets))
        });
        let mut facets = Facets { starts: Vec::new(), runs: Vec::new(), rcond: 1.0 };
        for run in runs {
            let (start, run) = run?;
            facets.rcond = facets.rcond.min(run.rcond);
            facets.starts.push(start);
            facets.runs.push(run);
        }
        Ok(facets)
    }
}

/// Monomials of $x$: 1, its components, and with eight of them $xy$, $yz$, $zx$ and $xyz$.
#[inline(always)]
pub(super) fn monomials<const D: usize, const Q: usize>(x: &Point<D>) -> [f64; Q] {
    let mut q = [1.0; Q];
    for (q, x) in q[1..].iter_mut().zip(x.iter()) {
        *q = *x;
    }
    if D == 3 && Q == 8 {
        (q[4], q[5], q[6]) = (x[0] * x[1], x[1] * x[2], x[2] * x[0]);
        q[7] = q[4] * x[2];
    }
    q
}

/// Derivatives of the [`monomials`] along one axis.
#[inline(always)]
pub(super) fn slopes<const D: usize, const Q: usize>(x: &Point<D>, axis: usize) -> [f64; Q] {
    let mut q = [0.0; Q];
    if Q > D {
        q[axis + 1] = 1.0;
    }
    if D == 3 && Q == 8 {
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        // The product of axis k with the next one stands at 4 + k.
        (q[4 + axis], q[4 + c], q[7]) = (x[b], x[c], x[b] * x[c]);
    }
    q
}

/// Moments about a point that lies by `from` behind the one that they were taken about.
#[inline(always)]
pub(super) fn shifted<const D: usize, const Q: usize>(m: &[f64; Q], from: &Point<D>) -> [f64; Q] {
    let mut out = *m;
    for k in 1..Q.min(D + 1) {
        out[k] += m[0] * from[k - 1];
    }
    if D == 3 && Q == 8 {
        for k in 0..3 {
            let next = (k + 1) % 3;
            out[4 + k] += from[k] * m[1 + next] + from[next] * m[1 + k] + from[k] * from[next] * m[0];
        }
        for k in 0..3 {
            let (next, last) = ((k + 1) % 3, (k + 2) % 3);
            // from of one axis with the product of the others, and the product of two with the third.
            out[7] += from[k] * m[4 + next] + from[k] * from[next] * m[1 + last];
        }
        out[7] += from[0] * from[1] * from[2] * m[0];
    }
    out
}

/// Nodes by rising index, each with a sum.
pub(super) struct List<T> {
    pub(super) nodes: Vec<u32>,
    pub(super) sums: Vec<T>,
    merged_nodes: Vec<u32>,
    merged_sums: Vec<T>,
}

impl<T> Default for List<T> {
    fn default() -> Self {
        List { nodes: Vec::new(), sums: Vec::new(), merged_nodes: Vec::new(), merged_sums: Vec::new() }
    }
}

impl<T: Copy> List<T> {
    pub(super) fn clear(&mut self) {
        self.nodes.clear();
        self.sums.clear();
    }

    /// Adds to the sums of further nodes, also by rising index: `add(a, sum)` for the a-th of them.
    #[inline(always)]
    pub(super) fn add(&mut self, zero: T, nodes: &[u32], add: impl Fn(usize, &mut T)) {
        if self.nodes.is_empty() {
            self.nodes.extend_from_slice(nodes);
            self.sums.resize(nodes.len(), zero);
        }
        // Points of a facet mostly see the same particles, and so do facets of a cell.
        if self.nodes == nodes {
            for a in 0..nodes.len() {
                add(a, &mut self.sums[a]);
            }
            return;
        }
        self.merge(zero, nodes);
        let mut place = 0;
        for a in 0..nodes.len() {
            while self.nodes[place] < nodes[a] {
                place += 1;
            }
            add(a, &mut self.sums[place]);
        }
    }

    /// Takes further nodes into the list.
    fn merge(&mut self, zero: T, nodes: &[u32]) {
        self.merged_nodes.clear();
        self.merged_sums.clear();
        let (mut i, mut j) = (0, 0);
        while i < self.nodes.len() && j < nodes.len() {
            let (x, y) = (self.nodes[i], nodes[j]);
            self.merged_nodes.push(x.min(y));
            self.merged_sums.push(if x <= y { self.sums[i] } else { zero });
            i += usize::from(x <= y);
            j += usize::from(y <= x);
        }
        self.merged_nodes.extend_from_slice(&self.nodes[i..]);
        self.merged_sums.extend_from_slice(&self.sums[i..]);
        self.merged_nodes.extend_from_slice(&nodes[j..]);
        self.merged_sums.resize(self.merged_nodes.len(), zero);
        std::mem::swap(&mut self.nodes, &mut self.merged_nodes);
        std::mem::swap(&mut self.sums, &mut self.merged_sums);
    }
}
