//! How well data determine coefficients.

use crate::each::{list_of, sum_of};
use std::f64::consts::FRAC_PI_2;

use nalgebra::{DMatrix, DVector};

/// Condition of the normalised Jacobian beyond which nothing is said of the coefficients.
const SINGULAR: f64 = 1e11;

/// Intervals of Simpson's rule, an even number.
const INTERVALS: usize = 1000;

/// The condition number of the Jacobian with columns of length one, and the half-widths of 95 % confidence intervals.
///
/// The covariance is that of heteroscedastic errors, $(J^TJ)^{-1}J^T\operatorname{diag}\big(r_i^2/(1-h_i)^2\big)J(J^TJ)^{-1}$ with the
/// leverages $h_i$ (HC3): errors of a test machine grow with the stress, and differ between tests.
pub(super) fn confidence(jacobian: &DMatrix<f64>, residuals: &[f64]) -> (f64, Vec<f64>) {
    let (points, count) = jacobian.shape();
    let sizes: Vec<f64> = jacobian.column_iter().map(|c| c.norm()).collect();
    let unknown = vec![f64::INFINITY; count];
    if sizes.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return (f64::INFINITY, unknown);
    }
    let scaled = DMatrix::from_fn(points, count, |i, c| jacobian[(i, c)] / sizes[c]);
    let svd = scaled.svd(true, true);
    let (Some(u), Some(v_t)) = (&svd.u, &svd.v_t) else { return (f64::INFINITY, unknown) };
    let condition = svd.singular_values.max() / svd.singular_values.min();
    if !(condition < SINGULAR) || points <= count {
        return (condition, unknown);
    }
    let leverages: Vec<f64> = u.row_iter().map(|row| row.norm_squared()).collect();
    // Rows of (JᵀJ)⁻¹Jᵀ, times the residuals.
    let inverse = DMatrix::from_diagonal(&DVector::from_iterator(count, svd.singular_values.iter().map(|s| 1.0 / s)));
    let spread = v_t.transpose() * inverse * u.transpose();
    let quantile = quantile(points - count);
    let half = |c: usize| {
        let variance: f64 =
            sum_of(points, |i| (spread[(c, i)] * residuals[i] / (1.0 - leverages[i]).max(1e-6)).powi(2));
        quantile * variance.sqrt() / sizes[c]
    };
    (condition, list_of(count, half))
}

/// The 97.5 % quantile of Student's distribution, $t = \sqrt n\tan\theta$ with
/// $\int_0^\theta\cos^{n-1} = 0.95\int_0^{\pi/2}\cos^{n-1}$.
fn quantile(freedom: usize) -> f64 {
    if freedom == 0 {
        return f64::INFINITY;
    }
    // The cosine to a high power lives in a narrow part of the interval: the intervals are those of its width.
    let width = (12.0 / (freedom as f64).sqrt()).min(FRAC_PI_2);
    let area = |to: f64| -> f64 {
        let step = to / INTERVALS as f64;
        let density = |k: usize| (k as f64 * step).cos().max(0.0).powi(freedom as i32 - 1);
        let inner: f64 = (1..INTERVALS).map(|k| density(k) * if k % 2 == 1 { 4.0 } else { 2.0 }).sum();
        (density(0) + inner + density(INTERVALS)) * step / 3.0
    };
    let wanted = 0.95 * area(width);
    let (mut low, mut high) = (0.0, width);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if area(middle) < wanted { low = middle } else { high = middle }
    }
    (freedom as f64).sqrt() * low.tan()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{abs_diff_eq, assert_abs_diff_eq};

    #[test]
    fn quantiles_are_those_of_the_tables() {
        for (freedom, tabulated) in [(1, 12.706), (2, 4.303), (3, 3.182), (5, 2.571), (10, 2.228), (50, 2.009)] {
            assert!(abs_diff_eq!(quantile(freedom), tabulated, epsilon = 1e-3), "{freedom}: {}", quantile(freedom));
        }
    }

    #[test]
    fn a_mean_has_the_error_of_a_mean() {
        // r = c - y: residuals of ±1 around the mean of eight numbers.
        let residuals = [1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0];
        let (condition, half) = confidence(&DMatrix::repeat(8, 1, 1.0), &residuals);
        assert_abs_diff_eq!(condition, 1.0, epsilon = 1e-14);
        let expected = quantile(7) * (8.0f64).sqrt() / 8.0 / (1.0 - 1.0 / 8.0);
        assert_abs_diff_eq!(half[0], expected, epsilon = 1e-14);
    }
}
