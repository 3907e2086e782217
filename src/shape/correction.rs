//! The correction of the kernel (3.19)–(3.22) at one point: moment matrix, coefficients and their slopes.

use crate::basis::Basis;
use crate::dense::{invert, one_norm, solve};
use crate::geometry::Point;
use crate::simd::{Arithmetic, Task};

/// Neighbours are summed in groups of this many, so that sums fill whole registers.
const LANES: usize = 8;

pub(super) fn padded(count: usize) -> usize {
    count.next_multiple_of(LANES)
}

/// Grows a buffer; what it holds is overwritten by its user.
pub(super) fn resize(buffer: &mut Vec<f64>, length: usize) {
    if buffer.len() < length {
        buffer.resize(length, 0.0);
    }
}

/// What the correction is made of at one point, neighbours running fastest in rows of a padded length; weights
/// and slopes of the padding are zero.
#[derive(Debug, Clone, Default)]
pub(super) struct Sums {
    /// $(x - x_I)/L$ by axis.
    pub(super) scaled: Vec<f64>,
    /// Kernel values and, by axis, gradients; the latter become those of the shape functions.
    pub(super) weights: Vec<f64>,
    pub(super) slopes: Vec<f64>,
    pub(super) values: Vec<f64>,
    pub(super) basis: Vec<f64>,
    pub(super) basis_slopes: Vec<f64>,
    /// $\Phi H$ and $\Phi\\,(b\cdot H)$.
    pub(super) weighted: Vec<f64>,
    pub(super) carried: Vec<f64>,
    pub(super) moment: Vec<f64>,
    pub(super) factor: Vec<f64>,
    pub(super) inverse: Vec<f64>,
    /// $b$, $H(0)$ and buffers of their length.
    pub(super) coefficients: Vec<f64>,
    pub(super) column: Vec<f64>,
}

/// The correction of the kernel (3.19)–(3.22) at one point.
pub(super) struct Correction<'a, const D: usize, B> {
    pub(super) basis: &'a B,
    pub(super) inverse_scale: Point<D>,
    pub(super) stride: usize,
    pub(super) sums: &'a mut Sums,
    pub(super) gradients: bool,
    pub(super) rcond_limit: f64,
}

/// $\sum_a x_a y_a$ over rows of a padded length.
#[inline(always)]
fn dot<A: Arithmetic>(x: &[f64], y: &[f64]) -> f64 {
    let mut lanes = [0.0; LANES];
    for (x, y) in x.as_chunks::<LANES>().0.iter().zip(y.as_chunks::<LANES>().0) {
        for l in 0..LANES {
            lanes[l] = A::multiply_add(x[l], y[l], lanes[l]);
        }
    }
    let mut half = [0.0; LANES / 2];
    for l in 0..LANES / 2 {
        half[l] = lanes[l] + lanes[l + LANES / 2];
    }
    (half[0] + half[2]) + (half[1] + half[3])
}

/// $y \mathrel{+}= s x$ over rows of a padded length.
#[inline(always)]
fn add_scaled<A: Arithmetic>(s: f64, x: &[f64], y: &mut [f64]) {
    for (x, y) in x.as_chunks::<LANES>().0.iter().zip(y.as_chunks_mut::<LANES>().0) {
        for l in 0..LANES {
            y[l] = A::multiply_add(s, x[l], y[l]);
        }
    }
}

/// $z = x y$, entry by entry.
#[inline(always)]
fn multiply(x: &[f64], y: &[f64], z: &mut [f64]) {
    for ((x, y), z) in x.iter().zip(y).zip(z) {
        *z = x * y;
    }
}

impl<const D: usize, B: Basis<D>> Task for Correction<'_, D, B> {
    /// The reciprocal condition number of the moment matrix; where it is too small nothing else is written. NaN
    /// where a value or slope of the kernel or the basis is not finite.
    type Output = f64;

    #[inline(always)]
    fn run<A: Arithmetic>(mut self) -> f64 {
        self.make_room();
        if !self.invert_moment::<A>() {
            return 0.0;
        }
        let (terms, square) = (self.basis.len(), self.basis.len().pow(2));
        let rcond =
            1.0 / (one_norm(&self.sums.moment[..square], terms) * one_norm(&self.sums.inverse[..square], terms));
        // The negation also refuses NaN.
        if !(rcond >= self.rcond_limit) {
            return rcond;
        }
        let finite = self.write_values::<A>() && (!self.gradients || self.write_slopes::<A>());
        if finite { rcond } else { f64::NAN }
    }
}

impl<const D: usize, B: Basis<D>> Correction<'_, D, B> {
    #[inline(always)]
    fn make_room(&mut self) {
        let (n, terms, sums) = (self.stride, self.basis.len(), &mut *self.sums);
        let square = terms * terms;
        resize(&mut sums.values, n);
        resize(&mut sums.basis, terms * n);
        resize(&mut sums.weighted, terms * n);
        resize(&mut sums.moment, square);
        resize(&mut sums.factor, square);
        resize(&mut sums.inverse, square);
        resize(&mut sums.coefficients, terms);
        resize(&mut sums.column, 2 * terms);
        if self.gradients {
            resize(&mut sums.basis_slopes, terms * D * n);
            resize(&mut sums.carried, 2 * n);
        }
    }

    /// Sums and inverts the moment matrix; whether it has an inverse.
    #[inline(always)]
    fn invert_moment<A: Arithmetic>(&mut self) -> bool {
        let (basis, n, gradients) = (self.basis, self.stride, self.gradients);
        let terms = basis.len();
        let Sums { scaled, weights, basis: h, basis_slopes: dh, weighted, moment, factor, inverse, .. } =
            &mut *self.sums;
        let weights = &weights[..n];
        let (h, weighted) = (&mut h[..terms * n], &mut weighted[..terms * n]);
        let dh = &mut dh[..if gradients { terms * D * n } else { 0 }];
        basis.fill_many(n, &scaled[..D * n], h, dh);
        let h = &*h;
        let row = |i: usize| i * n..(i + 1) * n;
        for i in 0..terms {
            multiply(weights, &h[row(i)], &mut weighted[row(i)]);
        }
        let moment = &mut moment[..terms * terms];
        for i in 0..terms {
            for j in 0..=i {
                let sum = dot::<A>(&weighted[row(i)], &h[row(j)]);
                moment[i * terms + j] = sum;
                moment[j * terms + i] = sum;
            }
        }
        invert(moment, terms, factor, &mut inverse[..terms * terms])
    }

    /// Values of the functions by $b = M^{-1} H(0)$, eq. (3.21); one step of refinement brings the reproducing conditions to
    /// rounding. Whether all coefficients are finite: weights and basis are where their products in $M$ were, $H(0)$ shows here.
    #[inline(always)]
    fn write_values<A: Arithmetic>(&mut self) -> bool {
        let (basis, n) = (self.basis, self.stride);
        let terms = basis.len();
        let Sums { values, weighted, moment, factor, coefficients, column, .. } = &mut *self.sums;
        let (at_zero, left) = column[..2 * terms].split_at_mut(terms);
        basis.fill_many(1, &[0.0; D], at_zero, &mut []);
        let b = &mut coefficients[..terms];
        b.copy_from_slice(at_zero);
        solve(factor, terms, b);
        product::<A>(&moment[..terms * terms], b, left);
        for (left, h) in left.iter_mut().zip(&*at_zero) {
            *left = h - *left;
        }
        solve(factor, terms, left);
        for (b, correction) in b.iter_mut().zip(&*left) {
            *b += correction;
        }
        if !b.iter().all(|b| b.is_finite()) {
            return false;
        }
        let values = &mut values[..n];
        values.fill(0.0);
        for i in 0..terms {
            add_scaled::<A>(b[i], &weighted[i * n..(i + 1) * n], values);
        }
        true
    }

    /// Slopes of the functions by $\partial b/\partial x_k = -M^{-1}(\partial M/\partial x_k\,b)$; the product is summed directly,
    /// without the matrix $\partial M/\partial x_k$. Whether all are finite.
    #[inline(always)]
    fn write_slopes<A: Arithmetic>(&mut self) -> bool {
        let (n, terms, inverse_scale) = (self.stride, self.basis.len(), self.inverse_scale);
        let Sums {
            weights,
            slopes,
            values,
            basis: h,
            basis_slopes: dh,
            weighted,
            carried,
            factor,
            coefficients,
            column,
            ..
        } = &mut *self.sums;
        let row = |i: usize| i * n..(i + 1) * n;
        let (weights, values, b) = (&weights[..n], &values[..n], &coefficients[..terms]);
        let left = &mut column[terms..2 * terms];
        let (correction, slope) = carried[..2 * n].split_at_mut(n);
        correction.fill(0.0);
        for i in 0..terms {
            add_scaled::<A>(b[i], &h[row(i)], correction);
        }
        for k in 0..D {
            // The slope of the product Φ (b·H), b held: what is written back is the slope of the function.
            slope.fill(0.0);
            for i in 0..terms {
                add_scaled::<A>(b[i] * inverse_scale[k], &dh[row(i * D + k)], slope);
            }
            let total = &mut slopes[row(k)];
            for a in 0..n {
                total[a] = A::multiply_add(slope[a], weights[a], total[a] * correction[a]);
            }
            for i in 0..terms {
                left[i] = -dot::<A>(&h[row(i)], total) - inverse_scale[k] * dot::<A>(&dh[row(i * D + k)], values);
            }
            // Every slope is a part of these sums: one that is not finite shows in them.
            if !left.iter().all(|left| left.is_finite()) {
                return false;
            }
            solve(factor, terms, left);
            for i in 0..terms {
                add_scaled::<A>(left[i], &weighted[row(i)], total);
            }
        }
        true
    }
}

/// $y = A x$ for a row-major square matrix.
#[inline(always)]
fn product<A: Arithmetic>(a: &[f64], x: &[f64], y: &mut [f64]) {
    let n = x.len();
    for (row, y) in a.chunks_exact(n).zip(y) {
        let mut sum = 0.0;
        for (a, x) in row.iter().zip(x) {
            sum = A::multiply_add(*a, *x, sum);
        }
        *y = sum;
    }
}
