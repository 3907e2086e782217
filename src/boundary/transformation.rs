//! The transformation method (4.28)–(4.45), restricted to the constrained unknowns.

use crate::assembly::{Pattern, System};
use crate::error::BoundaryError;
use crate::linear::MatrixClass;
use crate::simd::{Arithmetic, Task, dispatch};

use super::elimination::{Group, eliminate};
use super::{Constraints, Enforced, Enforcement, pattern_fits};

/// The mixed transformation: as many unknowns as there are constraint equations are expressed by the others,
/// $d_p = W d_f + V g$, so that the constraint equations hold exactly and the reduced matrix stays definite.
///
/// With constraint equations at particles this is the transformation (4.32), (4.42) of the constrained particles alone.
/// Constraint equations that share unknowns are eliminated together (Gauss–Jordan with complete pivoting), which
/// couples a whole constrained face; above [`limit`](MixedTransformation::limit) constraint equations in one such group
/// take [`LagrangeMultipliers`](super::LagrangeMultipliers).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MixedTransformation {
    /// Most constraint equations that may be eliminated together; the cost grows with its third power.
    pub limit: usize,
}

impl Default for MixedTransformation {
    /// 2000 constraint equations: about 100 MB and a few seconds.
    fn default() -> Self {
        MixedTransformation { limit: 2000 }
    }
}

struct Bound {
    reduced: Pattern,
    groups: Vec<Group>,
    /// Destination of each full entry between free unknowns; `u32::MAX` for others.
    destination: Vec<u32>,
    /// Group and place in it of each pivot.
    pivots: Vec<[u32; 2]>,
    /// Entries of the full matrix between a pivot and a free unknown: entry, pivot, place among the coupled ones.
    touches_free: Vec<[u32; 3]>,
    /// Entries between two pivots: entry, pivot, pivot.
    touches_pivot: Vec<[u32; 3]>,
    /// The values of both, of the matrix that was reduced last.
    touching: Vec<f64>,
    /// Reduced index of each full unknown; `u32::MAX` for pivots.
    reduced_of: Vec<u32>,
    full_of: Vec<usize>,
}

impl Enforcement for MixedTransformation {
    fn bind(&self, pattern: &Pattern, equations: &Constraints) -> Result<Box<dyn Enforced>, BoundaryError> {
        pattern_fits(pattern, equations)?;
        let eliminated = eliminate(equations, self.limit)?;
        let numbering = Numbering::new(pattern.size(), &eliminated);
        let mut groups: Vec<Group> = Vec::with_capacity(eliminated.len());
        for (mut group, free) in eliminated {
            group.free = free.iter().map(|&unknown| numbering.reduced_of[unknown]).collect();
            groups.push(group);
        }
        let reduced = numbering.reduced_pattern(pattern, &mut groups);
        let Destinations { destination, touches_free, touches_pivot } =
            numbering.destinations(pattern, &reduced, &groups);
        let Numbering { pivots, reduced_of, full_of, .. } = numbering;
        let touching = Vec::new();
        Ok(Box::new(Bound {
            reduced,
            groups,
            destination,
            pivots,
            touches_free,
            touches_pivot,
            touching,
            reduced_of,
            full_of,
        }))
    }
}

/// Pivots and free unknowns by their numbers.
struct Numbering {
    /// The number of each pivot among all; `u32::MAX` for free unknowns.
    pivot_of: Vec<u32>,
    pivots: Vec<[u32; 2]>,
    reduced_of: Vec<u32>,
    full_of: Vec<usize>,
}

/// Where the entries of the full matrix go, as [`Bound`] has them.
struct Destinations {
    destination: Vec<u32>,
    touches_free: Vec<[u32; 3]>,
    touches_pivot: Vec<[u32; 3]>,
}

impl Numbering {
    fn new(size: usize, groups: &[(Group, Vec<usize>)]) -> Self {
        let mut pivot_of = vec![u32::MAX; size];
        let mut pivots: Vec<[u32; 2]> = Vec::new();
        for (g, group) in groups.iter().enumerate() {
            for (p, &unknown) in group.0.pivots.iter().enumerate() {
                pivot_of[unknown] = pivots.len() as u32;
                pivots.push([g as u32, p as u32]);
            }
        }
        let mut reduced_of = vec![u32::MAX; size];
        let full_of: Vec<usize> = (0..size).filter(|&unknown| pivot_of[unknown] == u32::MAX).collect();
        for (reduced, &full) in full_of.iter().enumerate() {
            reduced_of[full] = reduced as u32;
        }
        Numbering { pivot_of, pivots, reduced_of, full_of }
    }

    fn group_of(&self, unknown: usize) -> usize {
        self.pivots[self.pivot_of[unknown] as usize][0] as usize
    }

    /// The pattern between free unknowns, and what the pivots of each group couple with.
    fn reduced_pattern(&self, pattern: &Pattern, groups: &mut [Group]) -> Pattern {
        // What each group's pivots couple with, directly or through other pivots.
        let mut coupled: Vec<Vec<u32>> = groups.iter().map(|g| g.free.clone()).collect();
        // Groups whose pivots couple with each other.
        let mut partners: Vec<(usize, usize)> = Vec::new();
        let mut columns: Vec<Vec<u32>> = vec![Vec::new(); self.full_of.len()];
        for column in 0..pattern.size() {
            let c = self.reduced_of[column];
            if c != u32::MAX {
                columns[c as usize].reserve(pattern.column(column).len());
            }
            for row in pattern.column(column).iter().map(|&row| row as usize) {
                let r = self.reduced_of[row];
                match (r == u32::MAX, c == u32::MAX) {
                    (false, false) => columns[c as usize].push(r),
                    (true, false) => coupled[self.group_of(row)].push(c),
                    (false, true) => coupled[self.group_of(column)].push(r),
                    (true, true) => {
                        let (a, b) = (self.group_of(row), self.group_of(column));
                        if a != b {
                            partners.push((a.min(b), a.max(b)));
                        }
                    }
                }
            }
        }
        partners.sort_unstable();
        partners.dedup();
        let mut partners_of: Vec<Vec<usize>> = (0..groups.len()).map(|g| vec![g]).collect();
        for (a, b) in partners {
            coupled[a].extend_from_slice(&groups[b].free);
            coupled[b].extend_from_slice(&groups[a].free);
            partners_of[a].push(b);
            partners_of[b].push(a);
        }
        for (g, (mut coupled, mut partners)) in coupled.into_iter().zip(partners_of).enumerate() {
            coupled.sort_unstable();
            coupled.dedup();
            partners.sort_unstable();
            let place = |free: &u32| coupled.partition_point(|c| c < free) as u32;
            let places = |partner: usize| (partner as u32, groups[partner].free.iter().map(place).collect());
            let partners = partners.into_iter().map(places).collect();
            let group = &mut groups[g];
            (group.coupled, group.partners) = (coupled, partners);
            for &s in &group.free {
                for &n in &group.coupled {
                    columns[s.min(n) as usize].push(s.max(n));
                }
            }
        }
        let reduced = Pattern::from_columns(columns);
        for group in groups {
            for &s in &group.free {
                for &n in &group.coupled {
                    // In the pattern by construction.
                    let place = reduced.find(s.max(n) as usize, s.min(n) as usize).unwrap_or(0);
                    group.places.push(place as u32);
                }
            }
        }
        reduced
    }

    fn destinations(&self, pattern: &Pattern, reduced: &Pattern, groups: &[Group]) -> Destinations {
        let mut destination = vec![u32::MAX; pattern.entries()];
        let (mut touches_free, mut touches_pivot) = (Vec::new(), Vec::new());
        for column in 0..pattern.size() {
            let mut place = None;
            for entry in pattern.columns[column]..pattern.columns[column + 1] {
                let row = pattern.rows[entry] as usize;
                let (r, c) = (self.reduced_of[row], self.reduced_of[column]);
                if r != u32::MAX && c != u32::MAX {
                    // Both columns are sorted: walk along instead of searching.
                    let mut k = place.unwrap_or(reduced.columns[c as usize]);
                    while reduced.rows[k] < r {
                        k += 1;
                    }
                    destination[entry] = k as u32;
                    place = Some(k);
                } else if r == u32::MAX && c == u32::MAX {
                    touches_pivot.push([entry as u32, self.pivot_of[row], self.pivot_of[column]]);
                } else {
                    let (pivot, free) = if r == u32::MAX { (row, c) } else { (column, r) };
                    let at = groups[self.group_of(pivot)].coupled.partition_point(|&n| n < free);
                    touches_free.push([entry as u32, self.pivot_of[pivot], at as u32]);
                }
            }
        }
        touches_free.shrink_to_fit();
        Destinations { destination, touches_free, touches_pivot }
    }
}

impl Bound {
    /// Adds the product with the entries of the full matrix in rows and columns of pivots: all of $K v$ at pivots, and all of it
    /// elsewhere where $v$ is zero but at pivots.
    fn multiply_touching(&self, v: &[f64], product: &mut [f64]) {
        let unknown = |pivot: u32| {
            let [group, pivot] = self.pivots[pivot as usize];
            (&self.groups[group as usize], self.groups[group as usize].pivots[pivot as usize])
        };
        let (to_free, to_pivots) = self.touching.split_at(self.touches_free.len().min(self.touching.len()));
        for (&[_, pivot, at], value) in self.touches_free.iter().zip(to_free) {
            let (group, pivot) = unknown(pivot);
            let free = self.full_of[group.coupled[at as usize] as usize];
            product[free] += value * v[pivot];
            product[pivot] += value * v[free];
        }
        for (&[_, a, b], value) in self.touches_pivot.iter().zip(to_pivots) {
            let (a, b) = (unknown(a).1, unknown(b).1);
            product[a] += value * v[b];
            if a != b {
                product[b] += value * v[a];
            }
        }
    }

    /// $V\\,\text{violation}$ at the pivots of a group.
    fn prescribed(group: &Group, violation: &[f64]) -> Vec<f64> {
        let m = group.equations.len();
        (0..m)
            .map(|p| group.equations.iter().zip(&group.v[p * m..(p + 1) * m]).map(|(&r, v)| v * violation[r]).sum())
            .collect()
    }
}

/// Rows and columns whose sums fill the registers.
const TILE: [usize; 2] = [4, 16];

/// Adds $W^T Y$, for $W$ of `n` and $Y$ of `width` columns, by rows.
struct Product<'a> {
    w: &'a [f64],
    n: usize,
    y: &'a [f64],
    width: usize,
    block: &'a mut [f64],
}

impl Task for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let Product { w, n, y, width, block } = self;
        for column in (0..width).step_by(TILE[1]) {
            let across = TILE[1].min(width - column);
            for row in (0..n).step_by(TILE[0]) {
                let down = TILE[0].min(n - row);
                let mut sums = [[0.0; TILE[1]]; TILE[0]];
                for (w, y) in w.chunks_exact(n).zip(y.chunks_exact(width)) {
                    let (mut factors, mut numbers) = ([0.0; TILE[0]], [0.0; TILE[1]]);
                    if [down, across] == TILE {
                        factors.copy_from_slice(&w[row..row + TILE[0]]);
                        numbers.copy_from_slice(&y[column..column + TILE[1]]);
                    } else {
                        factors[..down].copy_from_slice(&w[row..row + down]);
                        numbers[..across].copy_from_slice(&y[column..column + across]);
                    }
                    for (sums, factor) in sums.iter_mut().zip(factors) {
                        for (sum, number) in sums.iter_mut().zip(numbers) {
                            *sum = A::multiply_add(factor, number, *sum);
                        }
                    }
                }
                for (k, sums) in sums[..down].iter().enumerate() {
                    let target = &mut block[(row + k) * width + column..][..across];
                    target.iter_mut().zip(sums).for_each(|(target, sum)| *target += sum);
                }
            }
        }
    }
}

impl Enforced for Bound {
    fn pattern(&self) -> &Pattern {
        &self.reduced
    }

    fn class(&self) -> MatrixClass {
        MatrixClass::Definite
    }

    fn unknowns(&self) -> usize {
        self.full_of.len()
    }

    fn reduce(&mut self, full: &System, values: &mut Vec<f64>) {
        values.clear();
        values.resize(self.reduced.entries(), 0.0);
        for (value, &place) in full.values.iter().zip(&self.destination) {
            if place != u32::MAX {
                values[place as usize] += value;
            }
        }
        let touching = self.touches_free.iter().chain(&self.touches_pivot);
        self.touching.clear();
        self.touching.extend(touching.map(|&[entry, ..]| full.values[entry as usize]));
        // Y = K_pf + ½ K_pp W; then K̂ = K_ff + WᵀY + YᵀW.
        let mut ys: Vec<Vec<f64>> =
            self.groups.iter().map(|group| vec![0.0; group.pivots.len() * group.coupled.len()]).collect();
        for &[entry, pivot, at] in &self.touches_free {
            let [group, pivot] = self.pivots[pivot as usize].map(|k| k as usize);
            let width = self.groups[group].coupled.len();
            ys[group][pivot * width + at as usize] += full.values[entry as usize];
        }
        for &[entry, a, b] in &self.touches_pivot {
            let half = 0.5 * full.values[entry as usize];
            for (to, from) in [(a, b), (b, a)] {
                let [to_group, to_pivot] = self.pivots[to as usize].map(|k| k as usize);
                let [from_group, from_pivot] = self.pivots[from as usize].map(|k| k as usize);
                let (target, source) = (&self.groups[to_group], &self.groups[from_group]);
                let width = target.coupled.len();
                let y = &mut ys[to_group][to_pivot * width..(to_pivot + 1) * width];
                let n = source.free.len();
                let w = &source.w[from_pivot * n..(from_pivot + 1) * n];
                for (&at, w) in target.places_of(from_group as u32).iter().zip(w) {
                    y[at as usize] += half * w;
                }
                if a == b {
                    break;
                }
            }
        }
        let mut block = Vec::new();
        for (group, y) in self.groups.iter().zip(&ys) {
            let (n, width) = (group.free.len(), group.coupled.len());
            block.clear();
            block.resize(n * width, 0.0);
            dispatch(Product { w: &group.w, n, y, width, block: &mut block });
            for s in 0..n {
                for k in 0..width {
                    let twice = if group.free[s] == group.coupled[k] { 2.0 } else { 1.0 };
                    values[group.places[s * width + k] as usize] += twice * block[s * width + k];
                }
            }
        }
    }

    fn restrict(&self, force: &[f64], violation: &[f64], full: &System, rhs: &mut Vec<f64>) {
        let mut jump = vec![0.0; force.len()];
        let mut any = false;
        for group in &self.groups {
            for (&pivot, value) in group.pivots.iter().zip(Self::prescribed(group, violation)) {
                jump[pivot] = value;
                any |= value != 0.0;
            }
        }
        if !any {
            self.project(force, rhs);
            return;
        }
        let mut product = vec![0.0; force.len()];
        self.multiply_touching(&jump, &mut product);
        full.skew_multiply_add(&jump, &mut product);
        full.over_ranks(&mut product);
        for (p, f) in product.iter_mut().zip(force) {
            *p = f - *p;
        }
        self.project(&product, rhs);
    }

    fn project(&self, full: &[f64], out: &mut Vec<f64>) {
        out.clear();
        out.extend(self.full_of.iter().map(|&f| full[f]));
        for group in &self.groups {
            let n = group.free.len();
            for (p, &pivot) in group.pivots.iter().enumerate() {
                for (&free, w) in group.free.iter().zip(&group.w[p * n..(p + 1) * n]) {
                    out[free as usize] += w * full[pivot];
                }
            }
        }
    }

    fn stiffen(&self, step: &[f64], full: &System, residual: &mut [f64]) {
        let mut product = vec![0.0; residual.len()];
        self.multiply_touching(step, &mut product);
        full.skew_multiply_add(step, &mut product);
        full.over_ranks(&mut product);
        residual.iter_mut().zip(&product).for_each(|(r, p)| *r += p);
    }

    fn react(&self, residual: &[f64], multipliers: &mut [f64]) {
        // V G = [I, −W], hence Gᵀ Vᵀ y = [y; −Wᵀ y] balances a residual in equilibrium for y = −r_p.
        for group in &self.groups {
            let m = group.equations.len();
            for (i, &equation) in group.equations.iter().enumerate() {
                multipliers[equation] = -group
                    .pivots
                    .iter()
                    .enumerate()
                    .map(|(p, &unknown)| group.v[p * m + i] * residual[unknown])
                    .sum::<f64>();
            }
        }
    }

    fn recover(&self, solved: &[f64], violation: &[f64], step: &mut [f64], _multipliers: &mut [f64]) {
        for (unknown, &reduced) in self.reduced_of.iter().enumerate() {
            step[unknown] = if reduced == u32::MAX { 0.0 } else { solved[reduced as usize] };
        }
        for group in &self.groups {
            let n = group.free.len();
            for (p, (&pivot, jump)) in group.pivots.iter().zip(Self::prescribed(group, violation)).enumerate() {
                let row = &group.w[p * n..(p + 1) * n];
                step[pivot] = jump + group.free.iter().zip(row).map(|(&f, w)| w * solved[f as usize]).sum::<f64>();
            }
        }
    }

    fn renumber(&mut self, order: &[usize]) -> bool {
        let (reduced, places) = self.reduced.permuted(order);
        self.reduced = reduced;
        self.destination
            .iter_mut()
            .filter(|place| **place != u32::MAX)
            .for_each(|place| *place = places[*place as usize]);
        self.full_of = order.iter().map(|&old| self.full_of[old]).collect();
        for (new, &full) in self.full_of.iter().enumerate() {
            self.reduced_of[full] = new as u32;
        }
        let mut inverse = vec![0u32; order.len()];
        for (new, &old) in order.iter().enumerate() {
            inverse[old] = new as u32;
        }
        for group in &mut self.groups {
            group.places.iter_mut().for_each(|place| *place = places[*place as usize]);
            group.free.iter_mut().chain(&mut group.coupled).for_each(|unknown| *unknown = inverse[*unknown as usize]);
        }
        true
    }

    fn full_index(&self, reduced: usize) -> Option<usize> {
        self.full_of.get(reduced).copied()
    }
}
