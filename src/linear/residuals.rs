//! Generalised minimal residuals (GMRES) of Saad and Schultz, without restarts.

use crate::error::LinearError;

use super::vector::{dot, norm};

/// Directions over which residuals are minimised at most. The skew part of a tangent lives on free faces under pressure,
/// and few are needed: a strip that pressure bends by 122° takes 2.
const DIRECTIONS: usize = 60;

/// Orthonormal directions, and how far to go along each.
pub(crate) struct Directions {
    pub basis: Vec<Vec<f64>>,
    pub lengths: Vec<f64>,
}

/// Directions whose sum solves $A x = b$ until the residual is below `tolerance` times that of zero; `apply` gives
/// $A v$.
///
/// # Errors
/// Those of `apply`, and where a product is not finite.
pub(crate) fn minimal_residuals(
    rhs: &[f64],
    tolerance: f64,
    mut apply: impl FnMut(&[f64]) -> Result<Vec<f64>, LinearError>,
) -> Result<Directions, LinearError> {
    let size = norm(rhs);
    if !(size > 0.0) {
        return Ok(Directions { basis: Vec::new(), lengths: Vec::new() });
    }
    let mut basis = vec![rhs.iter().map(|r| r / size).collect::<Vec<f64>>()];
    // Columns of the triangular factor of Hessenberg's matrix, its rotations, and what they leave of the right-hand side.
    let (mut columns, mut rotations, mut left) = (Vec::<Vec<f64>>::new(), Vec::<[f64; 2]>::new(), vec![size]);
    while basis.len() <= DIRECTIONS {
        let mut next = apply(&basis[basis.len() - 1])?;
        let mut column = Vec::with_capacity(basis.len() + 1);
        for other in &basis {
            let along = dot(other, &next);
            next.iter_mut().zip(other).for_each(|(n, o)| *n -= along * o);
            column.push(along);
        }
        let length = norm(&next);
        for (k, [cosine, sine]) in rotations.iter().enumerate() {
            let (a, b) = (column[k], column[k + 1]);
            (column[k], column[k + 1]) = (cosine * a + sine * b, cosine * b - sine * a);
        }
        let end = column.len() - 1;
        let hypotenuse = column[end].hypot(length);
        if !(hypotenuse > 0.0 && hypotenuse.is_finite()) {
            return Err(LinearError::Residual { residual: hypotenuse });
        }
        let rotation = [column[end] / hypotenuse, length / hypotenuse];
        column[end] = hypotenuse;
        columns.push(column);
        rotations.push(rotation);
        left.push(-rotation[1] * left[end]);
        left[end] *= rotation[0];
        if left[end + 1].abs() <= tolerance * size || length <= f64::EPSILON * hypotenuse {
            break;
        }
        basis.push(next.iter().map(|n| n / length).collect());
    }
    for k in (0..columns.len()).rev() {
        let known: f64 = (k + 1..columns.len()).map(|j| columns[j][k] * left[j]).sum();
        left[k] = (left[k] - known) / columns[k][k];
    }
    left.truncate(columns.len());
    basis.truncate(columns.len());
    Ok(Directions { basis, lengths: left })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_system_is_solved() {
        let matrix = [[4.0, 1.0, -2.0], [-1.0, 3.0, 0.5], [2.0, -0.5, 5.0]];
        let exact = [1.0, -2.0, 0.5];
        let product = |v: &[f64]| matrix.iter().map(|row| dot(row, v)).collect::<Vec<f64>>();
        let found = minimal_residuals(&product(&exact), 1e-14, |v| Ok(product(v))).unwrap();
        let mut x = [0.0; 3];
        for (direction, length) in found.basis.iter().zip(&found.lengths) {
            x.iter_mut().zip(direction).for_each(|(x, d)| *x += length * d);
        }
        assert!(x.iter().zip(&exact).all(|(x, e)| (x - e).abs() < 1e-12), "{x:?}");
    }
}
