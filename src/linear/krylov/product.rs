//! Products with the parts of a linearised system.

use std::cell::RefCell;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::Matrix4;

use crate::assembly::{Pattern, Ranks};
use crate::each::{Each, EachOf, add, array_of, list_of};
use crate::error::LinearError;
use crate::parallel::map_with;
use crate::term::{Product, Zone};

use super::super::multilevel::Multilevel;
use super::super::{LinearSolver, LinearSystem};
use super::auxiliary::total;
use super::interpolation::Interpolation;

/// Parts of a product that threads share: the same for any number of them, for the sake of the bits.
const PARTS: usize = 16;

/// Columns of about equal numbers of entries.
pub(super) fn parts(pattern: &Pattern, unknowns: usize) -> Vec<usize> {
    let total = pattern.columns[unknowns];
    let mut ends: Vec<usize> =
        list_of(PARTS + 1, |k| pattern.columns[..=unknowns].partition_point(|&c| c < total * k / PARTS));
    ends[PARTS] = unknowns;
    ends
}

/// Zones that one thread at a time multiplies.
pub(super) struct Piece {
    pub(super) zones: Range<usize>,
    /// The unknowns of their nodes.
    pub(super) unknowns: Range<usize>,
}

pub(super) fn pieces(zones: &[Zone]) -> Vec<Piece> {
    let parts = PARTS.min(zones.len().max(1));
    let piece = |part| {
        let own = zones.len() * part / parts..zones.len() * (part + 1) / parts;
        let nodes = || zones[own.clone()].iter().flat_map(|zone| &zone.nodes).map(|&node| node as usize);
        let unknowns = nodes().min().map_or(0..0, |least| 3 * least..3 * (nodes().max().unwrap_or(least) + 1));
        Piece { zones: own, unknowns }
    };
    list_of(parts, piece)
}

/// Numbers of a zone, in unknowns of the size of the forces.
pub(super) struct Pressures {
    pub(super) scale: f64,
    pub(super) compliance: Matrix4<f64>,
    pub(super) inverse: Matrix4<f64>,
}

/// A solver within this one, with the values that it has factorised.
pub(super) struct Inner<'a>(RefCell<&'a mut dyn LinearSolver>, &'a [f64]);

impl<'a> Inner<'a> {
    pub(super) fn new(solver: &'a mut dyn LinearSolver, values: &'a [f64]) -> Self {
        Inner(RefCell::new(solver), values)
    }

    pub(super) fn solve(&self, x: &mut [f64]) -> Result<(), LinearError> {
        self.0.borrow_mut().solve(&LinearSystem::of(self.1), x, None).map(|_| ())
    }
}

/// A system while it is solved.
pub(super) struct Solved<'a> {
    pub(super) pattern: &'a Pattern,
    pub(super) unknowns: usize,
    pub(super) system: &'a LinearSystem<'a>,
    pub(super) pressures: &'a [Pressures],
    pub(super) pieces: &'a [Piece],
    /// Conditions with a largest entry of one, and what they are multiplied with in the matrix.
    pub(super) rows: &'a [Vec<(u32, f64)>],
    pub(super) stiffness: f64,
    pub(super) projector: Option<Inner<'a>>,
    pub(super) values_at: Option<&'a Interpolation>,
    pub(super) ends: &'a [usize],
    pub(super) multilevel: Option<RefCell<&'a mut Multilevel>>,
    pub(super) preconditioner: Option<Inner<'a>>,
    pub(super) ranks: &'a Option<Arc<dyn Ranks>>,
    /// The displacements that this rank keeps of vectors: all of them where it is alone.
    pub(super) own: Range<usize>,
}

impl Solved<'_> {
    /// $y = K x + C^T q$ and $z = C x$, in scaled pressures.
    pub(super) fn multiply(&self, x: &[f64], q: &[f64], y: &mut [f64], z: &mut [f64]) {
        self.symmetric(x, y);
        let Solved { system: LinearSystem { zones: all, product: multiply, skew, .. }, pressures, pieces, .. } = self;
        let done = map_with(pieces.len(), 2, Product::default, |product, piece| {
            let Piece { zones, unknowns } = &pieces[piece];
            let mut sums = vec![0.0; unknowns.len()];
            let mut volumes = Vec::with_capacity(4 * zones.len());
            for k in zones.clone() {
                let (zone, scale) = (&all[k], pressures[k].scale);
                multiply(zone, x, product);
                for (node, values) in zone.nodes.iter().zip(product.values.as_chunks::<3>().0) {
                    let target = &mut sums[3 * *node as usize - unknowns.start..][..3];
                    (0..3).for_each(|i| target[i] += values[i]);
                }
                let q = array_of(|l| scale * q[4 * k + l]);
                if q.iter().any(|q| *q != 0.0) {
                    zone.scatter::<3>(&q, &mut sums, unknowns.start);
                }
                volumes.extend(zone.gather::<3>(x).each(|v| scale * v));
            }
            (sums, volumes)
        });
        let mut z = z;
        for (Piece { unknowns, .. }, (sums, volumes)) in pieces.iter().zip(done) {
            add(&mut y[unknowns.clone()], 1.0, &sums);
            let own;
            (own, z) = z.split_at_mut(volumes.len());
            own.copy_from_slice(&volumes);
        }
        for &(row, column, value) in *skew {
            y[row as usize] += value * x[column as usize];
            y[column as usize] -= value * x[row as usize];
        }
    }

    /// What is summed of the symmetric part.
    fn symmetric(&self, x: &[f64], y: &mut [f64]) {
        let Solved { unknowns: n, ends, pattern, system: LinearSystem { values, .. }, .. } = self;
        let n = *n;
        let pieces = map_with(
            PARTS,
            2,
            || (),
            |(), part| {
                let (first, end) = (ends[part], ends[part + 1]);
                let last = (first..end)
                    .filter_map(|column| {
                        let rows = pattern.column(column);
                        rows[..rows.partition_point(|&row| (row as usize) < n)].last().copied()
                    })
                    .max();
                let mut sums = vec![0.0; last.map_or(0, |last| last as usize + 1 - first)];
                for column in first..end {
                    let from = pattern.columns[column];
                    let rows = pattern.column(column);
                    let factor = x[column];
                    let mut sum = values[from] * factor;
                    for (&row, value) in rows.iter().zip(&values[from..]).skip(1) {
                        let row = row as usize;
                        if row >= n {
                            break;
                        }
                        sum += value * x[row];
                        sums[row - first] += value * factor;
                    }
                    sums[column - first] += sum;
                }
                (first, sums)
            },
        );
        y.fill(0.0);
        for (first, sums) in pieces {
            add(&mut y[first..first + sums.len()], 1.0, &sums);
        }
    }

    /// $G x$ of conditions with a largest entry of one.
    fn conditions(&self, x: &[f64]) -> Vec<f64> {
        self.rows.mapped(|row| row.summed(|&(k, c)| c * x[k as usize]))
    }

    /// $x \mathrel{+}= s\\,G^T \mu$.
    pub(super) fn react(&self, mu: &[f64], s: f64, x: &mut [f64]) {
        for (row, mu) in self.rows.iter().zip(mu) {
            row.iter().for_each(|&(k, c)| x[k as usize] += s * c * mu);
        }
    }

    /// $(G G^T)^{-1} G x$.
    pub(super) fn multipliers(&self, x: &[f64]) -> Result<Vec<f64>, LinearError> {
        let mut mu = self.conditions(x);
        if let Some(projector) = &self.projector {
            projector.solve(&mut mu)?;
        }
        Ok(mu)
    }

    /// $\Pi x$.
    pub(super) fn project(&self, x: &mut [f64]) {
        if let Ok(mu) = self.multipliers(x) {
            self.react(&mu, -1.0, x);
        } else {
            x.fill(f64::NAN);
        }
    }

    /// $y \mathrel{+}= C^T q$ in scaled pressures.
    pub(super) fn pressed(&self, q: &[f64], sign: f64, y: &mut [f64]) {
        for ((zone, own), q) in self.system.zones.iter().zip(self.pressures).zip(q.as_chunks::<4>().0) {
            zone.scatter::<3>(&q.each(|q| sign * own.scale * q), y, 0);
        }
    }

    /// The sum of a number over the ranks.
    pub(super) fn total(&self, mine: f64) -> f64 {
        let mut sum = [mine];
        total(self.ranks, &mut sum);
        sum[0]
    }

    /// The whole of a vector of which each rank has a part.
    pub(super) fn gathered(&self, mine: &[f64]) -> Vec<f64> {
        let mut whole = vec![0.0; self.unknowns];
        whole[self.own.clone()].copy_from_slice(mine);
        total(self.ranks, &mut whole);
        whole
    }

    /// In place of $K^{-1}$.
    pub(super) fn smooth(&self, x: &mut [f64]) {
        if let Some(values) = self.values_at {
            values.solve(true, x);
        }
        let failed = match &self.preconditioner {
            Some(preconditioner) => preconditioner.solve(x).is_err(),
            None => self.multilevel.as_ref().is_some_and(|levels| levels.borrow_mut().cycle(x).is_err()),
        };
        if failed {
            x.fill(f64::NAN);
        }
        if let Some(values) = self.values_at {
            values.solve(false, x);
        }
    }
}
