//! Second- and fourth-order tensors of the physics, always three-dimensional.
//!
//! A second-order tensor is a [`Matrix3`]; its nine components are numbered row by row,
//! $c = 3i + J$. A [`Tangent`] holds $A_{iJkL} = \partial P_{iJ}/\partial F_{kL}$ at row
//! $3i + J$, column $3k + L$.

use crate::geometry::{Mat3, Vec3};

use nalgebra::{Matrix3, RealField, SMatrix, SVector};

/// $\partial P_{iJ}/\partial F_{kL}$ at row $3i+J$, column $3k+L$ \[stress\].
pub type Tangent = SMatrix<f64, 9, 9>;

/// The nine components of a second-order tensor, row by row.
pub type Vector9 = SVector<f64, 9>;

/// The components of `m` row by row, $v_{3i+J} = m_{iJ}$.
///
/// ```
/// let v = rkpm::tensor::components(&rkpm::nalgebra::Matrix3::new(1., 2., 3., 4., 5., 6., 7., 8., 9.));
/// assert_eq!(v[5], 6.0);
/// ```
#[inline]
pub fn components(m: &Mat3) -> Vector9 {
    // nalgebra stores by columns: the transpose read in memory order is the row order.
    Vector9::from_column_slice(m.transpose().as_slice())
}

/// The tensor with components `v` row by row; inverse of [`components`].
#[inline]
pub fn from_components(v: &Vector9) -> Mat3 {
    Mat3::from_row_slice(v.as_slice())
}

/// $\operatorname{cof} F = \partial J/\partial F = J F^{-T}$, defined for singular $F$ too.
#[inline]
pub fn cofactor<T: RealField + Copy>(f: &Matrix3<T>) -> Matrix3<T> {
    Matrix3::new(
        f.m22 * f.m33 - f.m23 * f.m32,
        f.m23 * f.m31 - f.m21 * f.m33,
        f.m21 * f.m32 - f.m22 * f.m31,
        f.m13 * f.m32 - f.m12 * f.m33,
        f.m11 * f.m33 - f.m13 * f.m31,
        f.m12 * f.m31 - f.m11 * f.m32,
        f.m12 * f.m23 - f.m13 * f.m22,
        f.m13 * f.m21 - f.m11 * f.m23,
        f.m11 * f.m22 - f.m12 * f.m21,
    )
}

/// $F^{-1}$ from cofactors; none where $\det F = 0$. nalgebra's own brings the inverse of four rows into each program.
#[inline]
pub(crate) fn inverse<T: RealField + Copy>(f: &Matrix3<T>) -> Option<Matrix3<T>> {
    let determinant = f.determinant();
    (!determinant.is_zero()).then(|| cofactor(f).transpose() / determinant)
}

/// The inverse of a matrix of at most three rows; none where its determinant is zero.
pub(crate) fn small_inverse<const D: usize>(m: &SMatrix<f64, D, D>) -> Option<SMatrix<f64, D, D>> {
    let (mut padded, mut found) = (Mat3::identity(), SMatrix::zeros());
    for j in 0..D {
        for i in 0..D {
            padded[(i, j)] = m[(i, j)];
        }
    }
    let inverse = inverse(&padded)?;
    for j in 0..D {
        for i in 0..D {
            found[(i, j)] = inverse[(i, j)];
        }
    }
    Some(found)
}

/// Adds $s\\,\partial^2 J/\partial F_{iJ}\partial F_{kL} = s\\,\epsilon_{ikm}\epsilon_{JLN}F_{mN}$ to `tangent`.
#[inline]
pub fn add_determinant_hessian(tangent: &mut Tangent, f: &Mat3, s: f64) {
    for i in 0..3 {
        for j in 0..3 {
            // The eight nonzero (k, L) of ε_ikm ε_JLN reduce to four sign patterns per (i, J).
            let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
            let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
            let row = 3 * i + j;
            tangent[(row, 3 * i1 + j1)] += s * f[(i2, j2)];
            tangent[(row, 3 * i1 + j2)] -= s * f[(i2, j1)];
            tangent[(row, 3 * i2 + j1)] -= s * f[(i1, j2)];
            tangent[(row, 3 * i2 + j2)] += s * f[(i1, j1)];
        }
    }
}

/// $\partial^2 J/\partial F_c\\,\partial F_d$ for two components numbered row by row: one entry of
/// [`add_determinant_hessian`] for callers that need few.
#[inline(always)]
pub(crate) fn determinant_hessian(f: &Mat3, c: usize, d: usize) -> f64 {
    let (i, j, k, l) = (c / 3, c % 3, d / 3, d % 3);
    if i == k || j == l {
        return 0.0;
    }
    // ε_ikm is 1 where k follows i in the cycle, -1 where it precedes it.
    let entry = f[(3 - i - k, 3 - j - l)];
    if (k == (i + 1) % 3) == (l == (j + 1) % 3) { entry } else { -entry }
}

/// As [`add_determinant_hessian`] in a few components $c = 3i + J$, row by row into `tangent`.
#[inline(always)]
pub(crate) fn add_hessian_in(components: &[usize], tangent: &mut [f64], f: &Mat3, s: f64) {
    let n = components.len();
    if components.iter().copied().eq(0..9) {
        // The four entries of each row that are not zero.
        for i in 0..3 {
            for j in 0..3 {
                let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
                let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
                let row = &mut tangent[9 * (3 * i + j)..][..9];
                row[3 * i1 + j1] += s * f[(i2, j2)];
                row[3 * i1 + j2] -= s * f[(i2, j1)];
                row[3 * i2 + j1] -= s * f[(i1, j2)];
                row[3 * i2 + j2] += s * f[(i1, j1)];
            }
        }
        return;
    }
    for (a, &c) in components.iter().enumerate() {
        for (b, &d) in components.iter().enumerate().take(a) {
            let entry = s * determinant_hessian(f, c, d);
            tangent[a * n + b] += entry;
            tangent[b * n + a] += entry;
        }
    }
}

/// A third of the trace.
pub(crate) fn mean(stress: &Mat3) -> f64 {
    stress.trace() / 3.0
}

/// Von Mises' equivalent of a stress.
pub(crate) fn von_mises(stress: &Mat3) -> f64 {
    (1.5f64).sqrt() * (stress - Mat3::identity() * mean(stress)).norm()
}

/// Eigenvalues of the part of a symmetric matrix across a unit vector.
pub(crate) fn across(matrix: &Mat3, normal: &Vec3) -> nalgebra::Vector2<f64> {
    let e = if normal.x.abs() < 0.7 { Vec3::x() } else { Vec3::y() }.cross(normal).normalize();
    let g = normal.cross(&e);
    let part = |v: &Vec3, w: &Vec3| v.dot(&(matrix * w));
    nalgebra::Matrix2::new(part(&e, &e), part(&e, &g), part(&g, &e), part(&g, &g)).symmetric_eigenvalues()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    #[test]
    fn cofactor_is_the_derivative_of_the_determinant() {
        let f = Mat3::new(1.1, 0.2, -0.3, 0.05, 0.9, 0.4, -0.2, 0.1, 1.3);
        let cof = cofactor(&f);
        let expected = f.try_inverse().unwrap().transpose() * f.determinant();
        assert_eq!(inverse(&f), f.try_inverse());
        let plane = f.fixed_view::<2, 2>(0, 0).into_owned();
        assert_eq!(small_inverse(&plane), plane.try_inverse());
        assert_abs_diff_eq!(cof, expected, epsilon = 3e-15);
        let mut hessian = Tangent::zeros();
        add_determinant_hessian(&mut hessian, &f, 1.0);
        for c in 0..9 {
            // The determinant is quadratic in any single entry pair, so a central difference is exact.
            let mut step = Vector9::zeros();
            step[c] = 0.5;
            let d = from_components(&step);
            let column = components(&(cofactor(&(f + d)) - cofactor(&(f - d))));
            assert_abs_diff_eq!(hessian.column(c).into_owned(), column, epsilon = 5e-15);
            for d in 0..9 {
                assert_eq!(hessian[(d, c)], determinant_hessian(&f, d, c));
            }
        }
        for components in [&[0, 1, 2, 3, 4, 5, 6, 7, 8][..], &[0, 1, 3, 4, 8], &[8, 7, 6, 5, 4, 3, 2, 1, 0]] {
            let n = components.len();
            let mut few = vec![1.0; n * n];
            add_hessian_in(components, &mut few, &f, 2.0);
            for (a, &c) in components.iter().enumerate() {
                for (b, &d) in components.iter().enumerate() {
                    assert_eq!(few[a * n + b], 1.0 + 2.0 * hessian[(c, d)]);
                }
            }
        }
    }
}
