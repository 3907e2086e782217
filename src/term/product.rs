//! Products with what a body keeps at its points in place of a matrix.

use std::ops::Range;

use crate::each::{EachOf, array_of};
use crate::simd::{Arithmetic, LANES, Task};
use crate::table::ShapeTable;

use super::body::Body;
use super::uncondensed::{Product, Tangents, Zone, entry};

/// Writes $\int B^T A\\,B x$ over a zone; see [`super::Term::multiply`].
pub(super) struct Multiply<'a, const D: usize> {
    pub body: &'a Body<D>,
    pub zone: &'a Zone,
    pub x: &'a [f64],
    pub product: &'a mut Product,
}

impl<const D: usize> Task for Multiply<'_, D> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arithmetic>(self) {
        let Multiply { body, zone, x, product } = self;
        let Product { values, moved, forces } = product;
        let table = body.table();
        let clusters = table.clusters();
        let points = clusters.points(zone.owner[1] as usize);
        for (first, tangents) in points.clone().step_by(LANES).zip(&zone.tangents) {
            let last = (first + LANES).min(points.end);
            let mut strains = [[0.0; LANES]; 9];
            let mut from = first;
            while from < last {
                let run = run(table, from..last);
                let local = clusters.local(from);
                take(zone, local, x, moved);
                for point in run.clone() {
                    let gradient = gradient::<A>(table.gradients(point), local.len(), moved);
                    (0..9).for_each(|k| strains[k][point - first] = gradient[k]);
                }
                from = run.end;
            }
            let stresses = contracted::<A>(tangents, &strains);
            let mut from = first;
            while from < last {
                let run = run(table, from..last);
                let local = clusters.local(from);
                let mut rows: [&[f64]; LANES] = [&[]; LANES];
                run.clone().for_each(|point| rows[point - from] = table.gradients(point));
                push::<A>(&rows[..run.len()], &stresses[from - first..run.end - first], local.len(), forces);
                give(local, forces, values);
                from = run.end;
            }
        }
    }
}

/// The first points of some that see the same nodes.
#[inline(always)]
fn run<const D: usize>(table: &ShapeTable<D>, points: Range<usize>) -> Range<usize> {
    let clusters = table.clusters();
    let local = clusters.local(points.start);
    // Most share one list.
    let alike = |&point: &usize| std::ptr::eq(clusters.local(point), local) || clusters.local(point) == local;
    let same = points.clone().skip(1).take_while(alike).count();
    points.start..points.start + 1 + same
}

/// Nodes of one register of the oldest machines that products are compiled for.
const HALF: usize = 4;

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

/// The gradient of a displacement at a point, component $i$ by slot $s$ at $3s + i$: nine sums of four nodes fill the registers
/// of any machine.
#[inline(always)]
fn gradient<A: Arithmetic>(row: &[f64], n: usize, moved: &[Vec<[f64; LANES]>; 3]) -> [f64; 9] {
    let mut sums = [[[0.0; HALF]; 3]; 3];
    let slots: [(&[[f64; HALF]], &[f64]); 3] = array_of(|s| row[s * n..(s + 1) * n].as_chunks::<HALF>());
    let [x, y, z] = moved.each_ref().each(|moved| moved.as_flattened().as_chunks::<HALF>().0);
    let whole = n / HALF;
    for k in 0..whole {
        add::<A>(&[x[k], y[k], z[k]], &[slots[0].0[k], slots[1].0[k], slots[2].0[k]], &mut sums);
    }
    if whole * HALF < n {
        let mut rest = [[0.0; HALF]; 3];
        for s in 0..3 {
            rest[s][..n - whole * HALF].copy_from_slice(slots[s].1);
        }
        add::<A>(&[x[whole], y[whole], z[whole]], &rest, &mut sums);
    }
    array_of(|k| {
        let sum = &sums[k / 3][k % 3];
        (sum[0] + sum[2]) + (sum[1] + sum[3])
    })
}

/// Adds what four nodes have in a gradient. A function and not a closure, which the compiler may leave at the oldest instructions.
#[inline(always)]
fn add<A: Arithmetic>(moved: &[[f64; HALF]; 3], gradients: &[[f64; HALF]; 3], sums: &mut [[[f64; HALF]; 3]; 3]) {
    for s in 0..3 {
        for i in 0..3 {
            for l in 0..HALF {
                sums[s][i][l] = A::multiply_add(moved[i][l], gradients[s][l], sums[s][i][l]);
            }
        }
    }
}

/// Writes the forces of stresses at some points on all nodes.
#[inline(always)]
fn push<A: Arithmetic>(rows: &[&[f64]], stresses: &[[f64; 9]], n: usize, forces: &mut [Vec<[f64; LANES]>; 3]) {
    for forces in forces.iter_mut() {
        forces.clear();
        forces.resize(n.div_ceil(LANES), [0.0; LANES]);
    }
    let (whole, rest) = (n / LANES, n % LANES);
    let mut block = 0;
    while block + 2 <= whole {
        pull::<A, 2>(rows, stresses, (block, LANES), forces);
        block += 2;
    }
    if block < whole {
        pull::<A, 1>(rows, stresses, (block, LANES), forces);
    }
    if rest > 0 {
        pull::<A, 1>(rows, stresses, (whole, rest), forces);
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

/// Symmetric matrices times vectors, for as many points as there are lanes; answers point by point.
#[inline(always)]
fn contracted<A: Arithmetic>(tangents: &Tangents, strains: &[[f64; LANES]; 9]) -> [[f64; 9]; LANES] {
    let mut stresses = [[0.0; 9]; LANES];
    for half in [0, HALF] {
        let mut sums = [[0.0; HALF]; 9];
        for row in 0..9 {
            for column in 0..=row {
                let tangent = &tangents[entry(row, column)];
                for l in 0..HALF {
                    let value = f64::from(tangent[half + l]);
                    sums[row][l] = A::multiply_add(value, strains[column][half + l], sums[row][l]);
                    if column < row {
                        sums[column][l] = A::multiply_add(value, strains[row][half + l], sums[column][l]);
                    }
                }
            }
        }
        for l in 0..HALF {
            stresses[half + l] = array_of(|k| sums[k][l]);
        }
    }
    stresses
}

/// Displacements of some nodes of a zone.
#[inline(always)]
fn take(zone: &Zone, local: &[u16], x: &[f64], moved: &mut [Vec<[f64; LANES]>; 3]) {
    for moved in moved.iter_mut() {
        moved.clear();
        moved.resize(local.len().div_ceil(LANES), [0.0; LANES]);
    }
    let [mx, my, mz] = moved.each_mut().map(|moved| moved.as_flattened_mut());
    let places = local.iter().map(|&place| zone.nodes[usize::from(place)] as usize);
    for (((node, mx), my), mz) in places.zip(mx).zip(my).zip(mz) {
        let at = &x[3 * node..][..3];
        (*mx, *my, *mz) = (at[0], at[1], at[2]);
    }
}

/// Adds forces of some nodes of a zone to those of all.
#[inline(always)]
fn give(local: &[u16], forces: &[Vec<[f64; LANES]>; 3], values: &mut [f64]) {
    let [x, y, z] = forces.each_ref().each(|forces| forces.as_flattened());
    let values = values.as_chunks_mut::<3>().0;
    for (((&place, x), y), z) in local.iter().zip(x).zip(y).zip(z) {
        let target = &mut values[usize::from(place)];
        (target[0], target[1], target[2]) = (target[0] + x, target[1] + y, target[2] + z);
    }
}
