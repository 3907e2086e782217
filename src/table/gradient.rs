//! The displacement gradient at a point of a table.

use crate::each::array_of;
use crate::geometry::Mat3;
use crate::simd::Arithmetic;

/// $\nabla u$ at a point from its nodes and their gradients by slot; see [`ShapeTable::displacement_gradient`].
#[inline(always)]
pub(crate) fn displacement_gradient<A: Arithmetic, const D: usize>(
    nodes: &[u32],
    gradients: &[f64],
    hoops: &[usize],
    d: &[f64],
) -> Mat3 {
    // Four partial sums fill a register.
    const LANES: usize = 4;
    let n = nodes.len();
    let mut sums = [[[0.0; LANES]; D]; D];
    let mut hoop = [0.0; LANES];
    let (whole, rest) = nodes.as_chunks::<LANES>();
    for (chunk, four) in whole.iter().enumerate() {
        let u: [[f64; LANES]; D] = array_of(|i| array_of(|l| d[four[l] as usize * D + i]));
        for j in 0..D {
            let g = &gradients[j * n + chunk * LANES..][..LANES];
            for i in 0..D {
                for l in 0..LANES {
                    sums[i][j][l] = A::multiply_add(u[i][l], g[l], sums[i][j][l]);
                }
            }
        }
        if !hoops.is_empty() {
            let g = &gradients[D * n + chunk * LANES..][..LANES];
            for l in 0..LANES {
                hoop[l] = A::multiply_add(u[0][l], g[l], hoop[l]);
            }
        }
    }
    for (l, &node) in rest.iter().enumerate() {
        let a = whole.len() * LANES + l;
        for i in 0..D {
            let u = d[node as usize * D + i];
            for j in 0..D {
                sums[i][j][l] = A::multiply_add(u, gradients[j * n + a], sums[i][j][l]);
            }
        }
        if !hoops.is_empty() {
            hoop[l] = A::multiply_add(d[node as usize * D], gradients[D * n + a], hoop[l]);
        }
    }
    let total = |lanes: &[f64; LANES]| (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]);
    let mut h = Mat3::zeros();
    for i in 0..D {
        for j in 0..D {
            h[(i, j)] = total(&sums[i][j]);
        }
    }
    for &k in hoops {
        h[(k, k)] = total(&hoop);
    }
    h
}
