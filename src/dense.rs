//! In-place inversion of small symmetric positive definite matrices.
//!
//! Moment matrices have 2 to 20 rows; at that size plain loops beat any library call by an order of
//! magnitude and allocate nothing.

/// Writes the inverse of the row-major symmetric `n × n` matrix $A = LL^T$ and, below and on the diagonal of
/// `factor`, $L^{-1}$ for [`solve`].
///
/// Returns `false` where a pivot is not positive.
#[inline(always)]
pub(crate) fn invert(a: &[f64], n: usize, factor: &mut [f64], inverse: &mut [f64]) -> bool {
    // With a literal size the loops are unrolled.
    match n {
        1 => invert_sized(a, 1, factor, inverse),
        2 => invert_sized(a, 2, factor, inverse),
        3 => invert_sized(a, 3, factor, inverse),
        4 => invert_sized(a, 4, factor, inverse),
        6 => invert_sized(a, 6, factor, inverse),
        _ => invert_sized(a, n, factor, inverse),
    }
}

#[inline(always)]
fn invert_sized(a: &[f64], n: usize, factor: &mut [f64], inverse: &mut [f64]) -> bool {
    let (a, l, inverse) = (&a[..n * n], &mut factor[..n * n], &mut inverse[..n * n]);
    // A = L Lᵀ, with the reciprocals of the pivots on the diagonal of L.
    for j in 0..n {
        let mut pivot = a[j * n + j];
        for k in 0..j {
            pivot -= l[j * n + k] * l[j * n + k];
        }
        if !(pivot > 0.0 && pivot.is_finite()) {
            return false;
        }
        let reciprocal = 1.0 / pivot.sqrt();
        l[j * n + j] = reciprocal;
        for i in j + 1..n {
            let mut sum = a[i * n + j];
            for k in 0..j {
                sum -= l[i * n + k] * l[j * n + k];
            }
            l[i * n + j] = sum * reciprocal;
        }
    }
    // L⁻¹ in place, column by column.
    for j in 0..n {
        for i in j + 1..n {
            let mut sum = 0.0;
            for k in j..i {
                sum -= l[i * n + k] * l[k * n + j];
            }
            l[i * n + j] = sum * l[i * n + i];
        }
    }
    // A⁻¹ = L⁻ᵀ L⁻¹.
    for i in 0..n {
        for j in 0..=i {
            let mut sum = 0.0;
            for k in i..n {
                sum += l[k * n + i] * l[k * n + j];
            }
            inverse[i * n + j] = sum;
            inverse[j * n + i] = sum;
        }
    }
    true
}

/// Solves $Ax = b$ in place with the factor of [`invert`]: as accurate as substitution, which the product with
/// $A^{-1}$ is not.
#[inline(always)]
pub(crate) fn solve(factor: &[f64], n: usize, b: &mut [f64]) {
    match n {
        1 => solve_sized(factor, 1, b),
        2 => solve_sized(factor, 2, b),
        3 => solve_sized(factor, 3, b),
        4 => solve_sized(factor, 4, b),
        6 => solve_sized(factor, 6, b),
        _ => solve_sized(factor, n, b),
    }
}

#[inline(always)]
fn solve_sized(factor: &[f64], n: usize, b: &mut [f64]) {
    let (l, b) = (&factor[..n * n], &mut b[..n]);
    for i in (0..n).rev() {
        let mut sum = 0.0;
        for k in 0..=i {
            sum += l[i * n + k] * b[k];
        }
        b[i] = sum;
    }
    for i in 0..n {
        let mut sum = 0.0;
        for k in i..n {
            sum += l[k * n + i] * b[k];
        }
        b[i] = sum;
    }
}

/// The largest absolute row sum of the row-major symmetric matrix `a`.
#[inline(always)]
pub(crate) fn one_norm(a: &[f64], n: usize) -> f64 {
    let mut largest: f64 = 0.0;
    for row in a.chunks_exact(n) {
        let mut sum = 0.0;
        for value in row {
            sum += value.abs();
        }
        largest = largest.max(sum);
    }
    largest
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn inverses_invert_and_refuse() {
        for n in 1..=8 {
            // Diagonally dominant, hence definite.
            let a: Vec<f64> = (0..n * n)
                .map(|k| if k / n == k % n { n as f64 + 1.0 } else { (((k / n) * (k % n)) as f64).cos() })
                .collect();
            let (mut factor, mut inverse) = (vec![0.0; n * n], vec![0.0; n * n]);
            assert!(invert(&a, n, &mut factor, &mut inverse));
            for i in 0..n {
                for j in 0..n {
                    let product: f64 = (0..n).map(|k| a[i * n + k] * inverse[k * n + j]).sum();
                    assert_abs_diff_eq!(product, f64::from(u8::from(i == j)), epsilon = 1e-14);
                }
            }
            let mut x: Vec<f64> = (0..n).map(|k| (k as f64).sin()).collect();
            let b = x.clone();
            solve(&factor, n, &mut x);
            for i in 0..n {
                let product: f64 = (0..n).map(|k| a[i * n + k] * x[k]).sum();
                assert_abs_diff_eq!(product, b[i], epsilon = 1e-14);
            }
        }
        let mut buffer = [0.0; 4];
        assert!(!invert(&[1.0, 2.0, 2.0, 1.0], 2, &mut buffer, &mut [0.0; 4]));
        assert!(!invert(&[f64::NAN], 1, &mut buffer, &mut [0.0; 4]));
    }
}
