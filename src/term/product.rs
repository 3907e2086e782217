//! Products with what a body keeps at its points in place of a matrix.

use crate::material::Material;
use crate::simd::{Arithmetic, LANES, Task, dispatch};

use super::body::Body;
use super::uncondensed::{Product, Tangent, Zone};

impl<const D: usize, M: Material> Body<D, M> {
    /// Writes $\int B^T A\\,B x$ over a zone; see [`super::Term::multiply`].
    pub(super) fn multiply_zone(&self, zone: &Zone, x: &[f64], product: &mut Product) {
        dispatch(Multiply { body: self, zone, x, product });
    }
}

struct Multiply<'a, const D: usize, M> {
    body: &'a Body<D, M>,
    zone: &'a Zone,
    x: &'a [f64],
    product: &'a mut Product,
}

impl<const D: usize, M: Material> Task for Multiply<'_, D, M> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let Multiply { body, zone, x, product } = self;
        let Product { values, moved, forces } = product;
        values.clear();
        values.resize(3 * zone.nodes.len(), 0.0);
        let table = body.table();
        let clusters = table.clusters();
        let points = clusters.points(zone.owner[1] as usize);
        let mut first = points.start;
        while first < points.end {
            let local = clusters.local(first);
            let alike = |&point: &usize| point < points.end && clusters.local(point) == local;
            let count = (first + 1..first + CELL).take_while(alike).count() + 1;
            take(zone, local, x, moved, forces);
            let mut rows: [&[f64]; CELL] = [&[]; CELL];
            let mut stresses = [[0.0; 9]; CELL];
            for p in 0..count {
                rows[p] = table.gradients(first + p);
                let gradient = gradient::<A>(rows[p], local.len(), moved);
                stresses[p] = contracted::<A>(&zone.tangents[first + p - points.start], &gradient);
            }
            let (rows, stresses) = (&rows[..count], &stresses[..count]);
            let (whole, rest) = (local.len() / LANES, local.len() % LANES);
            let mut block = 0;
            while block + 4 <= whole {
                pull::<A, 4>(rows, stresses, (block, LANES), forces);
                block += 4;
            }
            while block < whole {
                pull::<A, 1>(rows, stresses, (block, LANES), forces);
                block += 1;
            }
            if rest > 0 {
                pull::<A, 1>(rows, stresses, (whole, rest), forces);
            }
            give(local, forces, values);
            first += count;
        }
    }
}

/// Points that are multiplied together: those of a cell.
const CELL: usize = 8;

/// Numbers of eight nodes, of which the table has `have`.
#[inline(always)]
fn eight(slot: &[f64], have: usize) -> [f64; LANES] {
    let mut all = [0.0; LANES];
    if have == LANES {
        all.copy_from_slice(&slot[..LANES]);
    } else {
        all[..have].copy_from_slice(&slot[..have]);
    }
    all
}

/// The gradient of a displacement at a point, component $i$ by slot $s$ at $3s + i$.
#[inline(always)]
fn gradient<A: Arithmetic>(row: &[f64], n: usize, moved: &[Vec<[f64; LANES]>; 3]) -> [f64; 9] {
    let mut sums = [[[0.0; LANES]; 3]; 3];
    for k in 0..n / LANES {
        add_gradient::<A>(row, n, moved, (k, LANES), &mut sums);
    }
    if !n.is_multiple_of(LANES) {
        add_gradient::<A>(row, n, moved, (n / LANES, n % LANES), &mut sums);
    }
    std::array::from_fn(|k| total(&sums[k / 3][k % 3]))
}

/// What eight nodes, of which the table has `have`, add to the gradient of a displacement.
#[inline(always)]
fn add_gradient<A: Arithmetic>(
    row: &[f64],
    n: usize,
    moved: &[Vec<[f64; LANES]>; 3],
    (k, have): (usize, usize),
    sums: &mut [[[f64; LANES]; 3]; 3],
) {
    for s in 0..3 {
        let g = eight(&row[s * n + k * LANES..(s + 1) * n], have);
        for i in 0..3 {
            for l in 0..LANES {
                sums[s][i][l] = A::multiply_add(moved[i][k][l], g[l], sums[s][i][l]);
            }
        }
    }
}

/// Writes the forces of stresses at some points on `N` times eight nodes, of which the table has `have`.
#[inline(always)]
fn pull<A: Arithmetic, const N: usize>(
    rows: &[&[f64]],
    stresses: &[[f64; 9]],
    (block, have): (usize, usize),
    forces: &mut [Vec<[f64; LANES]>; 3],
) {
    let mut sums = [[[0.0; LANES]; 3]; N];
    for (row, stress) in rows.iter().zip(stresses) {
        let n = row.len() / 3;
        for s in 0..3 {
            for k in 0..N {
                let g = eight(&row[s * n + (block + k) * LANES..(s + 1) * n], have);
                for i in 0..3 {
                    for l in 0..LANES {
                        sums[k][i][l] = A::multiply_add(stress[3 * s + i], g[l], sums[k][i][l]);
                    }
                }
            }
        }
    }
    for k in 0..N {
        for i in 0..3 {
            forces[i][block + k] = sums[k][i];
        }
    }
}

/// A symmetric matrix times a vector.
#[inline(always)]
fn contracted<A: Arithmetic>((columns, corner): &Tangent, gradient: &[f64; 9]) -> [f64; 9] {
    // Two sums, for products wait for each other.
    let mut sums = [[0.0; 8]; 2];
    for (k, (column, factor)) in columns.iter().zip(gradient).enumerate() {
        for l in 0..8 {
            sums[k % 2][l] = A::multiply_add(f64::from(column[l]), *factor, sums[k % 2][l]);
        }
    }
    let mut stress = [0.0; 9];
    let mut last = [0.0; 8];
    for l in 0..8 {
        stress[l] = sums[0][l] + sums[1][l];
        last[l] = f64::from(columns[8][l]) * gradient[l];
    }
    stress[8] = A::multiply_add(f64::from(*corner), gradient[8], total(&last));
    stress
}

/// The sum of eight numbers, in pairs.
#[inline(always)]
fn total(lanes: &[f64; LANES]) -> f64 {
    ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]))
}

/// Displacements of some nodes of a zone, and no forces.
#[inline(always)]
fn take(
    zone: &Zone,
    local: &[u16],
    x: &[f64],
    moved: &mut [Vec<[f64; LANES]>; 3],
    forces: &mut [Vec<[f64; LANES]>; 3],
) {
    let blocks = local.len().div_ceil(LANES);
    for i in 0..3 {
        forces[i].clear();
        forces[i].resize(blocks, [0.0; LANES]);
        moved[i].clear();
        moved[i].resize(blocks, [0.0; LANES]);
    }
    for (a, &place) in local.iter().enumerate() {
        let x = &x[3 * zone.nodes[usize::from(place)] as usize..][..3];
        for i in 0..3 {
            moved[i][a / LANES][a % LANES] = x[i];
        }
    }
}

/// Adds forces of some nodes of a zone to those of all.
#[inline(always)]
fn give(local: &[u16], forces: &[Vec<[f64; LANES]>; 3], values: &mut [f64]) {
    for (a, &place) in local.iter().enumerate() {
        let target = &mut values[3 * usize::from(place)..][..3];
        for i in 0..3 {
            target[i] += forces[i][a / LANES][a % LANES];
        }
    }
}
