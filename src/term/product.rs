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
        let mut shared: &[u16] = &[];
        for (point, tangent) in clusters.points(zone.owner[1] as usize).zip(&zone.tangents) {
            let local = clusters.local(point);
            if local != shared {
                give(shared, forces, values);
                shared = local;
                take(zone, local, x, moved, forces);
            }
            let n = local.len();
            let gradients = table.gradients(point);
            let slots: [&[f64]; 3] = std::array::from_fn(|s| &gradients[s * n..(s + 1) * n]);
            let (whole, rest) = (n / LANES, n % LANES);
            let mut sums = [[[0.0; LANES]; 3]; 3];
            for k in 0..whole {
                let u: [&[f64; LANES]; 3] = std::array::from_fn(|i| &moved[i][k]);
                for s in 0..3 {
                    let g = &slots[s][k * LANES..][..LANES];
                    for i in 0..3 {
                        for l in 0..LANES {
                            sums[s][i][l] = A::multiply_add(u[i][l], g[l], sums[s][i][l]);
                        }
                    }
                }
            }
            for s in 0..3 {
                for l in 0..rest {
                    let g = slots[s][whole * LANES + l];
                    for i in 0..3 {
                        sums[s][i][l] = A::multiply_add(moved[i][whole][l], g, sums[s][i][l]);
                    }
                }
            }
            let mut gradient = [0.0; 9];
            for s in 0..3 {
                for i in 0..3 {
                    gradient[3 * s + i] = total(&sums[s][i]);
                }
            }
            let stress = contracted::<A>(tangent, &gradient);
            for k in 0..whole {
                let g: [&[f64]; 3] = std::array::from_fn(|s| &slots[s][k * LANES..][..LANES]);
                for i in 0..3 {
                    let force = &mut forces[i][k];
                    for s in 0..3 {
                        for l in 0..LANES {
                            force[l] = A::multiply_add(stress[3 * s + i], g[s][l], force[l]);
                        }
                    }
                }
            }
            for i in 0..3 {
                for s in 0..3 {
                    for l in 0..rest {
                        let force = &mut forces[i][whole][l];
                        *force = A::multiply_add(stress[3 * s + i], slots[s][whole * LANES + l], *force);
                    }
                }
            }
        }
        give(shared, forces, values);
    }
}

/// A symmetric matrix times a vector.
#[inline(always)]
fn contracted<A: Arithmetic>((columns, corner): &Tangent, gradient: &[f64; 9]) -> [f64; 9] {
    // Two sums, for products wait for each other.
    let mut sums = [[0.0; 8]; 2];
    for (k, (column, factor)) in columns.iter().zip(gradient).enumerate() {
        for l in 0..8 {
            sums[k % 2][l] = A::multiply_add(column[l], *factor, sums[k % 2][l]);
        }
    }
    let mut stress = [0.0; 9];
    let mut last = [0.0; 8];
    for l in 0..8 {
        stress[l] = sums[0][l] + sums[1][l];
        last[l] = columns[8][l] * gradient[l];
    }
    stress[8] = A::multiply_add(*corner, gradient[8], total(&last));
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
