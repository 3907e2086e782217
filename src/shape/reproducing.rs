//! Reproducing kernel shape functions (3.22)–(3.32).

use crate::basis::Basis;
use crate::dense::{invert, one_norm, solve};
use crate::error::ApproximationError;
use crate::geometry::Point;
use crate::kernel::Kernel;
use crate::neighbours::BinGrid;
use crate::particles::{Particles, Support};
use crate::simd::{Arithmetic, Task, dispatch};

use super::{Approximation, ShapeFunctions};

/// Reciprocal condition numbers below this refuse the point.
///
/// Measured on random clouds: gradient errors reach 1e-3 at 1e-10…1e-8, 2e-8 at 1e-6…1e-5.
const RCOND_LIMIT: f64 = 1e-8;

/// Reproducing kernel shape functions
/// $$\Psi_I(x) = H^T(0) M^{-1}(x) H(x - x_I)\, \Phi_a(x - x_I)\,[\Delta V_I],\qquad
///   M(x) = \sum_I H(x - x_I) H^T(x - x_I)\, \Phi_a(x - x_I)\,[\Delta V_I]$$
/// (3.22), (3.29), (3.32), with a shifted and scaled basis. Every function in the span of the basis is
/// reproduced: $\sum_I \Psi_I(x)\,p(x_I) = p(x)$.
///
/// ```
/// use rkpm::prelude::*;
/// let particles = Block::new([0.0, 0.0], [2.0, 1.0]).particles([5, 4], 1.0)?;
/// let rk = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear())?;
/// let psi = rk.shape_functions(&[0.7, 0.4].into())?;
/// let x: f64 = psi.nodes.iter().zip(&psi.values).map(|(&i, v)| v * rk.nodes()[i as usize][0]).sum();
/// assert!((x - 0.7).abs() < 1e-14);
/// # Ok::<(), rkpm::Error>(())
/// ```
pub struct ReproducingKernel<const D: usize, K, B> {
    particles: Particles<D>,
    kernel: K,
    basis: B,
    bins: BinGrid<D>,
    rcond_limit: f64,
}

/// Buffers of [`ReproducingKernel`].
#[derive(Debug, Clone, Default)]
pub struct KernelScratch<const D: usize> {
    /// Of each covering particle $x - x_I$ and the half-widths of its support.
    offsets: Vec<Point<D>>,
    half_widths: Vec<Point<D>>,
    /// Distances, kernel values and slopes by axis, neighbours running fastest.
    distances: Vec<f64>,
    factors: Vec<f64>,
    factor_slopes: Vec<f64>,
    sums: Sums,
}

/// Supports end here, in terms of their half-width. On lattices edges of supports meet points everywhere, and rounding
/// would let in particles whose weight is nothing: a matrix grew by a third, its factors by two.
const EDGE: f64 = 1.0 - 1e-12;

impl<const D: usize, K: Kernel, B: Basis<D>> ReproducingKernel<D, K, B> {
    /// Shape functions of the given particles.
    ///
    /// # Errors
    /// Where there are fewer particles than terms of the basis, or the basis has no term.
    pub fn new(particles: Particles<D>, kernel: K, basis: B) -> Result<Self, ApproximationError> {
        if basis.is_empty() {
            return Err(ApproximationError::Particle {
                particle: 0,
                what: "the basis has no term",
                remedy: "give at least the constant",
            });
        }
        if particles.positions().len() < basis.len() {
            return Err(ApproximationError::Uncovered {
                at: particles.positions()[0].as_slice().to_vec(),
                covering: particles.positions().len(),
                needed: basis.len(),
            });
        }
        let bins = BinGrid::new(&particles);
        Ok(ReproducingKernel { particles, kernel, basis, bins, rcond_limit: RCOND_LIMIT })
    }

    /// Changes the reciprocal condition number below which a point is refused (default 1e-8).
    pub fn with_rcond_limit(mut self, limit: f64) -> Self {
        self.rcond_limit = limit;
        self
    }

    /// The particles.
    pub fn particles(&self) -> &Particles<D> {
        &self.particles
    }

    /// The kernel.
    pub fn kernel(&self) -> &K {
        &self.kernel
    }

    /// The basis.
    pub fn basis(&self) -> &B {
        &self.basis
    }

    /// $\Phi_a(x - x_I)$ (3.26), (3.27) and, if asked for, its gradient; `None` outside the support.
    #[inline]
    pub(super) fn kernel_at(&self, particle: usize, at: &Point<D>, slopes: bool) -> Option<(f64, Point<D>)> {
        let offset = at - self.particles.positions()[particle];
        let (mut value, mut gradient) = match &self.particles.supports()[particle] {
            Support::Ball(radius) => {
                let distance = offset.norm();
                if distance >= EDGE * radius {
                    return None;
                }
                let (value, slope) = self.kernel.value_and_slope(distance / radius);
                // The kernel is even: its slope vanishes at the centre, where the direction is undefined.
                let scale = if distance > 0.0 { slope / (radius * distance) } else { 0.0 };
                (value, offset * scale)
            }
            Support::Box(half) => {
                let mut value = 1.0;
                let mut factors = [(0.0, 0.0); D];
                for axis in 0..D {
                    let z = offset[axis].abs() / half[axis];
                    if z >= EDGE {
                        return None;
                    }
                    factors[axis] = self.kernel.value_and_slope(z);
                    value *= factors[axis].0;
                }
                let mut gradient = Point::zeros();
                if slopes {
                    for axis in 0..D {
                        let mut product = factors[axis].1 * offset[axis].signum() / half[axis];
                        for other in 0..D {
                            if other != axis {
                                product *= factors[other].0;
                            }
                        }
                        gradient[axis] = product;
                    }
                }
                (value, gradient)
            }
        };
        if let Some(volume) = self.particles.volumes().get(particle) {
            // With volumes inside the sum the kernel is a density: (3.3), (3.26).
            let density = volume / self.particles.supports()[particle].half_widths().iter().product::<f64>();
            value *= density;
            gradient *= density;
        }
        Some((value, gradient))
    }

    /// Particles that may cover a point, by rising index.
    pub(super) fn covering(&self, at: &Point<D>) -> impl Iterator<Item = u32> + '_ {
        self.bins.candidates(at).iter().copied()
    }

    /// Everything of [`Approximation::evaluate`]; gradients only where asked for.
    fn evaluate_some(
        &self,
        at: &Point<D>,
        scratch: &mut KernelScratch<D>,
        out: &mut ShapeFunctions<D>,
        gradients: bool,
    ) -> Result<(), ApproximationError> {
        if !at.iter().all(|x| x.is_finite()) {
            return Err(ApproximationError::Point { at: at.as_slice().to_vec() });
        }
        let terms = self.basis.len();
        self.collect(at, scratch, out);
        // A particle whose kernel underflows to zero inside its support adds nothing; met at its very edge.
        if !self.weigh(scratch, out, gradients) {
            self.drop_weightless(at, scratch, out);
            self.weigh(scratch, out, gradients);
        }
        let covering = out.nodes.len();
        if covering < terms {
            return Err(ApproximationError::Uncovered { at: at.as_slice().to_vec(), covering, needed: terms });
        }
        let scale = scratch.half_widths.iter().fold(Point::<D>::zeros(), |scale, half| scale.zip_map(half, f64::max));
        let inverse_scale = scale.map(|s| 1.0 / s);
        let stride = padded(covering);
        resize(&mut scratch.sums.scaled, D * stride);
        for (a, offset) in scratch.offsets.iter().enumerate() {
            for k in 0..D {
                scratch.sums.scaled[k * stride + a] = offset[k] * inverse_scale[k];
            }
        }
        for k in 0..D {
            scratch.sums.scaled[k * stride + covering..(k + 1) * stride].fill(0.0);
        }
        let sums = &mut scratch.sums;
        out.rcond = dispatch(Correction {
            basis: &self.basis,
            inverse_scale,
            stride,
            sums,
            gradients,
            rcond_limit: self.rcond_limit,
        });
        // The negation also refuses NaN.
        if !(out.rcond >= self.rcond_limit) {
            let rcond = if out.rcond.is_finite() { out.rcond } else { 0.0 };
            let limit = self.rcond_limit;
            return Err(ApproximationError::Singular { at: at.as_slice().to_vec(), rcond, limit, covering });
        }
        out.values.clear();
        out.values.extend_from_slice(&scratch.sums.values[..covering]);
        if gradients {
            let slopes = &scratch.sums.slopes;
            out.gradients.clear();
            out.gradients.extend((0..covering).map(|a| Point::from_fn(|k, _| slopes[k * stride + a])));
        }
        Ok(())
    }

    /// Finds the particles that cover a point.
    fn collect(&self, at: &Point<D>, scratch: &mut KernelScratch<D>, out: &mut ShapeFunctions<D>) {
        out.nodes.clear();
        scratch.offsets.clear();
        scratch.half_widths.clear();
        for &particle in self.bins.candidates(at) {
            let offset = at - self.particles.positions()[particle as usize];
            let (inside, half) = match &self.particles.supports()[particle as usize] {
                Support::Ball(radius) => (offset.norm() < EDGE * radius, Point::repeat(*radius)),
                Support::Box(half) => ((0..D).all(|k| offset[k].abs() / half[k] < EDGE), *half),
            };
            if inside {
                out.nodes.push(particle);
                scratch.offsets.push(offset);
                scratch.half_widths.push(half);
            }
        }
    }

    /// Removes particles whose kernel vanishes at the point.
    fn drop_weightless(&self, at: &Point<D>, scratch: &mut KernelScratch<D>, out: &mut ShapeFunctions<D>) {
        let mut kept = 0;
        for a in 0..out.nodes.len() {
            if self.kernel_at(out.nodes[a] as usize, at, false).is_some_and(|(value, _)| value > 0.0) {
                out.nodes[kept] = out.nodes[a];
                scratch.offsets[kept] = scratch.offsets[a];
                scratch.half_widths[kept] = scratch.half_widths[a];
                kept += 1;
            }
        }
        out.nodes.truncate(kept);
        scratch.offsets.truncate(kept);
        scratch.half_widths.truncate(kept);
    }

    /// Kernel values and, if asked for, gradients of the collected particles, as [`kernel_at`](Self::kernel_at)
    /// has them; `false` where a value is not positive.
    fn weigh(&self, scratch: &mut KernelScratch<D>, out: &ShapeFunctions<D>, gradients: bool) -> bool {
        let covering = out.nodes.len();
        let stride = padded(covering);
        let KernelScratch { offsets, half_widths, distances, factors, factor_slopes, sums } = scratch;
        let supports = self.particles.supports();
        resize(&mut sums.weights, stride);
        resize(&mut sums.slopes, D * stride);
        sums.weights[covering..stride].fill(0.0);
        for k in 0..D {
            sums.slopes[k * stride + covering..(k + 1) * stride].fill(0.0);
        }
        // A ball has one distance and one factor, a box one for each axis.
        let is_ball = |a: usize| matches!(supports[out.nodes[a] as usize], Support::Ball(_));
        let axes = if (0..covering).all(is_ball) { 1 } else { D };
        resize(distances, D * covering);
        resize(factors, D * covering);
        resize(factor_slopes, D * covering);
        for a in 0..covering {
            if is_ball(a) {
                distances[a] = offsets[a].norm() / half_widths[a][0];
                for k in 1..axes {
                    distances[k * covering + a] = 0.0;
                }
            } else {
                for k in 0..D {
                    distances[k * covering + a] = offsets[a][k].abs() / half_widths[a][k];
                }
            }
        }
        let used = axes * covering;
        self.kernel.fill(&distances[..used], &mut factors[..used], &mut factor_slopes[..used]);
        let mut positive = true;
        for a in 0..covering {
            let mut weight = 1.0;
            if is_ball(a) {
                weight = factors[a];
                if gradients {
                    // The kernel is even: its slope vanishes at the centre, where the direction is undefined.
                    let distance = offsets[a].norm();
                    let slope = factor_slopes[a] / half_widths[a][0];
                    let scale = if distance > 0.0 { slope / distance } else { 0.0 };
                    for k in 0..D {
                        sums.slopes[k * stride + a] = offsets[a][k] * scale;
                    }
                }
            } else {
                for k in 0..D {
                    weight *= factors[k * covering + a];
                }
                if gradients {
                    for k in 0..D {
                        let mut slope = factor_slopes[k * covering + a] * offsets[a][k].signum() / half_widths[a][k];
                        for other in (0..D).filter(|&other| other != k) {
                            slope *= factors[other * covering + a];
                        }
                        sums.slopes[k * stride + a] = slope;
                    }
                }
            }
            if let Some(volume) = self.particles.volumes().get(out.nodes[a] as usize) {
                // With volumes inside the sum the kernel is a density: (3.3), (3.26).
                let density = volume / half_widths[a].iter().product::<f64>();
                weight *= density;
                for k in 0..D {
                    sums.slopes[k * stride + a] *= density;
                }
            }
            sums.weights[a] = weight;
            positive &= weight > 0.0;
        }
        positive
    }
}

/// Neighbours are summed in groups of this many, so that sums fill whole registers.
const LANES: usize = 8;

fn padded(count: usize) -> usize {
    count.next_multiple_of(LANES)
}

/// Grows a buffer; what it holds is overwritten by its user.
fn resize(buffer: &mut Vec<f64>, length: usize) {
    if buffer.len() < length {
        buffer.resize(length, 0.0);
    }
}

/// What the correction is made of at one point, neighbours running fastest in rows of a padded length; weights
/// and slopes of the padding are zero.
#[derive(Debug, Clone, Default)]
struct Sums {
    /// $(x - x_I)/L$ by axis.
    scaled: Vec<f64>,
    /// Kernel values and, by axis, gradients; the latter become those of the shape functions.
    weights: Vec<f64>,
    slopes: Vec<f64>,
    values: Vec<f64>,
    basis: Vec<f64>,
    basis_slopes: Vec<f64>,
    /// $\Phi H$ and $\Phi\,(b\cdot H)$.
    weighted: Vec<f64>,
    carried: Vec<f64>,
    moment: Vec<f64>,
    factor: Vec<f64>,
    inverse: Vec<f64>,
    /// $b$, $H(0)$ and buffers of their length.
    coefficients: Vec<f64>,
    column: Vec<f64>,
}

/// The correction of the kernel (3.19)–(3.22) at one point.
struct Correction<'a, const D: usize, B> {
    basis: &'a B,
    inverse_scale: Point<D>,
    stride: usize,
    sums: &'a mut Sums,
    gradients: bool,
    rcond_limit: f64,
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
    /// The reciprocal condition number of the moment matrix; where it is too small nothing else is written.
    type Output = f64;

    #[inline(always)]
    fn run<A: Arithmetic>(self) -> f64 {
        let Correction { basis, inverse_scale, stride: n, sums, gradients, rcond_limit } = self;
        let terms = basis.len();
        let square = terms * terms;
        let Sums {
            scaled,
            weights,
            slopes,
            values,
            basis: h,
            basis_slopes: dh,
            weighted,
            carried,
            moment,
            factor,
            inverse,
            coefficients,
            column,
        } = sums;
        resize(values, n);
        resize(h, terms * n);
        resize(weighted, terms * n);
        resize(moment, square);
        resize(factor, square);
        resize(inverse, square);
        resize(coefficients, terms);
        resize(column, 2 * terms);
        if gradients {
            resize(dh, terms * D * n);
            resize(carried, 2 * n);
        }
        let weights = &weights[..n];
        let (h, weighted) = (&mut h[..terms * n], &mut weighted[..terms * n]);
        let dh = &mut dh[..if gradients { terms * D * n } else { 0 }];
        basis.fill_many(n, &scaled[..D * n], h, dh);
        let (h, dh) = (&*h, &*dh);
        let row = |i: usize| i * n..(i + 1) * n;
        for i in 0..terms {
            multiply(weights, &h[row(i)], &mut weighted[row(i)]);
        }
        let moment = &mut moment[..square];
        for i in 0..terms {
            for j in 0..=i {
                let sum = dot::<A>(&weighted[row(i)], &h[row(j)]);
                moment[i * terms + j] = sum;
                moment[j * terms + i] = sum;
            }
        }
        let inverse = &mut inverse[..square];
        if !invert(moment, terms, factor, inverse) {
            return 0.0;
        }
        let rcond = 1.0 / (one_norm(moment, terms) * one_norm(inverse, terms));
        // The negation also refuses NaN.
        if !(rcond >= rcond_limit) {
            return rcond;
        }

        // b = M⁻¹ H(0), eq. (3.21); one step of refinement brings the reproducing conditions to rounding.
        let (at_zero, left) = column[..2 * terms].split_at_mut(terms);
        basis.fill_many(1, &[0.0; D], at_zero, &mut []);
        let b = &mut coefficients[..terms];
        b.copy_from_slice(at_zero);
        solve(factor, terms, b);
        product::<A>(moment, b, left);
        for (left, h) in left.iter_mut().zip(&*at_zero) {
            *left = h - *left;
        }
        solve(factor, terms, left);
        for (b, correction) in b.iter_mut().zip(&*left) {
            *b += correction;
        }

        let values = &mut values[..n];
        values.fill(0.0);
        for i in 0..terms {
            add_scaled::<A>(b[i], &weighted[row(i)], values);
        }
        if !gradients {
            return rcond;
        }

        // ∂b/∂x_k = −M⁻¹ (∂M/∂x_k b); the product is summed directly, without the matrix ∂M/∂x_k.
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
            solve(factor, terms, left);
            for i in 0..terms {
                add_scaled::<A>(left[i], &weighted[row(i)], total);
            }
        }
        rcond
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

impl<const D: usize, K: Kernel, B: Basis<D>> Approximation<D> for ReproducingKernel<D, K, B> {
    type Scratch = KernelScratch<D>;

    fn nodes(&self) -> &[Point<D>] {
        self.particles.positions()
    }

    fn evaluate(
        &self,
        at: &Point<D>,
        scratch: &mut KernelScratch<D>,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        self.evaluate_some(at, scratch, out, true)
    }

    fn evaluate_values(
        &self,
        at: &Point<D>,
        scratch: &mut KernelScratch<D>,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        self.evaluate_some(at, scratch, out, false)
    }
}
