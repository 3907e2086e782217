//! Reproducing kernel shape functions (3.22)–(3.32).

mod refusal;

use nalgebra::{DMatrix, SMatrix};

use crate::basis::Basis;
use crate::error::ApproximationError;
use crate::geometry::Point;
use crate::kernel::Kernel;
use crate::neighbours::BinGrid;
use crate::particles::{Particles, Support};
use crate::simd::dispatch;

use super::correction::{Correction, Sums, padded, resize};
use super::{Approximation, ShapeFunctions};

/// Reciprocal condition numbers below this refuse the point.
///
/// Measured on random clouds: gradient errors reach 1e-3 at 1e-10…1e-8, 2e-8 at 1e-6…1e-5.
const RCOND_LIMIT: f64 = 1e-8;

/// Reproducing kernel shape functions
/// $$\Psi_I(x) = H^T(0) M^{-1}(x) H(x - x_I)\\, \Phi_a(x - x_I)\\,[\Delta V_I],\qquad
///   M(x) = \sum_I H(x - x_I) H^T(x - x_I)\\, \Phi_a(x - x_I)\\,[\Delta V_I]$$
/// (3.22), (3.29), (3.32), with a shifted and scaled basis. Every function in the span of the basis is
/// reproduced: $\sum_I \Psi_I(x)\\,p(x_I) = p(x)$.
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
    /// What the search for covering particles reads of each, together in memory.
    reaches: Vec<Reach<D>>,
    /// What takes offsets to their places in parallelepipeds, in the order of their particles.
    inverse_axes: Vec<SMatrix<f64, D, D>>,
    /// Volumes over those of supports: with volumes inside the sum the kernel is a density, (3.3), (3.26).
    densities: Vec<f64>,
    rcond_limit: f64,
}

/// A particle as the search sees it.
#[derive(Debug, Clone, Copy)]
struct Reach<const D: usize> {
    position: Point<D>,
    /// One over the half-widths of the support.
    inverse: Point<D>,
    form: Form,
}

/// What distances from a particle are measured by.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    Ball,
    Box,
    /// With the place of its inverse half-axes.
    Parallelepiped(u32),
}

/// Buffers of [`ReproducingKernel`].
#[derive(Debug, Clone, Default)]
pub struct KernelScratch<const D: usize> {
    /// Of each covering particle $x - x_I$ and one over the half-widths of its support.
    offsets: Vec<Point<D>>,
    inverse_halves: Vec<Point<D>>,
    /// Covering particles whose support is a ball.
    balls: usize,
    /// Distances, kernel values and slopes by axis, neighbours running fastest in rows as long as the candidates.
    row: usize,
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
    /// Where there are fewer particles than terms of the basis, the basis has no term, or the kernel has negative
    /// values or ones that are not finite.
    pub fn new(particles: Particles<D>, kernel: K, basis: B) -> Result<Self, ApproximationError> {
        crate::kernel::check(&kernel)?;
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
        let mut inverse_axes = Vec::new();
        let reaches = particles.positions().iter().zip(particles.supports());
        let reach = |(position, support): (&Point<D>, &Support<D>)| Reach {
            position: *position,
            inverse: support.half_widths().map(|half| 1.0 / half),
            form: match support {
                Support::Ball(_) => Form::Ball,
                Support::Box(_) => Form::Box,
                Support::Parallelepiped(_) => {
                    // Particles have been asked for theirs.
                    inverse_axes.push(support.inverse_axes().unwrap_or_else(SMatrix::zeros));
                    Form::Parallelepiped(inverse_axes.len() as u32 - 1)
                }
            },
        };
        let reaches: Vec<Reach<D>> = reaches.map(reach).collect();
        let measure = |reach: &Reach<D>| match reach.form {
            Form::Ball | Form::Box => reach.inverse.iter().product(),
            Form::Parallelepiped(place) => {
                let inverse = &inverse_axes[place as usize];
                DMatrix::from_fn(D, D, |i, j| inverse[(i, j)]).determinant().abs()
            }
        };
        let densities =
            particles.volumes().iter().zip(&reaches).map(|(volume, reach)| volume * measure(reach)).collect();
        Ok(ReproducingKernel {
            reaches,
            inverse_axes,
            densities,
            particles,
            kernel,
            basis,
            bins,
            rcond_limit: RCOND_LIMIT,
        })
    }

    /// Changes the reciprocal condition number below which a point is refused (default 1e-8); a NaN, below which
    /// nothing is, changes nothing.
    pub fn with_rcond_limit(mut self, limit: f64) -> Self {
        if !limit.is_nan() {
            self.rcond_limit = limit;
        }
        self
    }

    /// The reciprocal condition number below which a point is refused.
    pub fn rcond_limit(&self) -> f64 {
        self.rcond_limit
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
        let half = self.particles.supports()[particle].half_widths();
        let (mut value, mut gradient) = match self.reaches[particle].form {
            Form::Ball => {
                let radius = half[0];
                let distance = offset.norm();
                if distance >= EDGE * radius {
                    return None;
                }
                let (value, slope) = self.kernel.value_and_slope(distance / radius);
                // The kernel is even: its slope vanishes at the centre, where the direction is undefined.
                let scale = if distance > 0.0 { slope / (radius * distance) } else { 0.0 };
                (value, offset * scale)
            }
            Form::Box => self.product(&offset.component_div(&half), slopes, |s| s.component_div(&half))?,
            Form::Parallelepiped(place) => {
                let inverse = &self.inverse_axes[place as usize];
                self.product(&(inverse * offset), slopes, |s| inverse.tr_mul(s))?
            }
        };
        if let Some(&density) = self.densities.get(particle) {
            value *= density;
            gradient *= density;
        }
        Some((value, gradient))
    }

    /// $\prod_k \Phi(|\xi_k|)$ and, if asked for, its gradient, made of that by $\xi$; `None` outside the support.
    #[inline(always)]
    fn product(
        &self,
        xi: &Point<D>,
        slopes: bool,
        gradient: impl FnOnce(&Point<D>) -> Point<D>,
    ) -> Option<(f64, Point<D>)> {
        if xi.iter().any(|xi| xi.abs() >= EDGE) {
            return None;
        }
        let factors: [(f64, f64); D] = std::array::from_fn(|k| self.kernel.value_and_slope(xi[k].abs()));
        let value = factors.iter().map(|factor| factor.0).product();
        if !slopes {
            return Some((value, Point::zeros()));
        }
        let by_xi = Point::from_fn(|k, _| {
            let others = (0..D).filter(|&other| other != k).map(|other| factors[other].0);
            factors[k].1 * sign(xi[k]) * others.product::<f64>()
        });
        Some((value, gradient(&by_xi)))
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
            self.drop_weightless(at, scratch, out)?;
            self.weigh(scratch, out, gradients);
        }
        let covering = out.nodes.len();
        if covering < terms {
            return Err(ApproximationError::Uncovered { at: at.as_slice().to_vec(), covering, needed: terms });
        }
        // One over the widest support.
        let halves = &scratch.inverse_halves[..covering];
        let inverse_scale = halves.iter().fold(halves[0], |scale, half| scale.zip_map(half, f64::min));
        let stride = padded(covering);
        resize(&mut scratch.sums.scaled, D * stride);
        for (a, offset) in scratch.offsets[..covering].iter().enumerate() {
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
            return Err(self.refusal(at, scratch, out, gradients));
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

    /// Finds the particles that cover a point, and their distances in terms of their supports.
    fn collect(&self, at: &Point<D>, scratch: &mut KernelScratch<D>, out: &mut ShapeFunctions<D>) {
        let candidates = self.bins.candidates(at);
        let row = candidates.len();
        let KernelScratch { offsets, inverse_halves, distances, .. } = scratch;
        out.nodes.resize(row, 0);
        if offsets.len() < row {
            offsets.resize(row, Point::zeros());
            inverse_halves.resize(row, Point::zeros());
        }
        resize(distances, D * row);
        let (mut covering, mut balls) = (0, 0);
        // Each candidate is written down and counted if it covers the point: no branch that the machine has to guess.
        for &particle in candidates {
            let reach = &self.reaches[particle as usize];
            let offset = at - reach.position;
            let mut inside = true;
            match reach.form {
                Form::Ball => {
                    let distance = offset.norm() * reach.inverse[0];
                    inside = distance < EDGE;
                    distances[covering] = distance;
                    for k in 1..D {
                        distances[k * row + covering] = 0.0;
                    }
                }
                Form::Box => {
                    for k in 0..D {
                        let distance = offset[k].abs() * reach.inverse[k];
                        inside &= distance < EDGE;
                        distances[k * row + covering] = distance;
                    }
                }
                Form::Parallelepiped(place) => {
                    let xi = self.inverse_axes[place as usize] * offset;
                    for k in 0..D {
                        let distance = xi[k].abs();
                        inside &= distance < EDGE;
                        distances[k * row + covering] = distance;
                    }
                }
            }
            out.nodes[covering] = particle;
            offsets[covering] = offset;
            inverse_halves[covering] = reach.inverse;
            covering += usize::from(inside);
            balls += usize::from(inside && reach.form == Form::Ball);
        }
        out.nodes.truncate(covering);
        scratch.row = row;
        scratch.balls = balls;
    }

    /// Removes particles whose kernel vanishes at the point; the kernel is nowhere negative.
    fn drop_weightless(
        &self,
        at: &Point<D>,
        scratch: &mut KernelScratch<D>,
        out: &mut ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        self.check_kernel(at, scratch, out)?;
        let row = scratch.row;
        let mut kept = 0;
        for a in 0..out.nodes.len() {
            if scratch.sums.weights[a] > 0.0 {
                out.nodes[kept] = out.nodes[a];
                scratch.offsets[kept] = scratch.offsets[a];
                scratch.inverse_halves[kept] = scratch.inverse_halves[a];
                for k in 0..D {
                    scratch.distances[k * row + kept] = scratch.distances[k * row + a];
                }
                kept += 1;
            }
        }
        out.nodes.truncate(kept);
        scratch.balls = out.nodes.iter().filter(|&&node| self.reaches[node as usize].form == Form::Ball).count();
        Ok(())
    }

    /// Kernel values and, if asked for, gradients of the collected particles, as [`kernel_at`](Self::kernel_at)
    /// has them; `false` where a value is not positive.
    fn weigh(&self, scratch: &mut KernelScratch<D>, out: &ShapeFunctions<D>, gradients: bool) -> bool {
        let covering = out.nodes.len();
        let stride = padded(covering);
        let KernelScratch { offsets, inverse_halves, balls, row, distances, factors, factor_slopes, sums } = scratch;
        let (balls, row) = (*balls, *row);
        resize(&mut sums.weights, stride);
        resize(&mut sums.slopes, D * stride);
        sums.weights[covering..stride].fill(0.0);
        for k in 0..D {
            sums.slopes[k * stride + covering..(k + 1) * stride].fill(0.0);
        }
        resize(factors, D * row);
        resize(factor_slopes, D * row);
        // A ball has one distance and one factor, a box one for each axis.
        let axes = if balls == covering { 1 } else { D };
        for k in 0..axes {
            let all = k * row..k * row + covering;
            self.kernel.fill(&distances[all.clone()], &mut factors[all.clone()], &mut factor_slopes[all]);
        }
        // Boxes alone are by far the usual case.
        let boxes = balls == 0 && self.inverse_axes.is_empty();
        let form = |a: usize| if boxes { Form::Box } else { self.reaches[out.nodes[a] as usize].form };
        if balls == 0 && !gradients && self.densities.is_empty() {
            // What smoothed tables ask for: products of whole rows.
            let weights = &mut sums.weights[..covering];
            weights.copy_from_slice(&factors[..covering]);
            for k in 1..D {
                for (weight, factor) in weights.iter_mut().zip(&factors[k * row..k * row + covering]) {
                    *weight *= factor;
                }
            }
            return weights.iter().fold(true, |positive, weight| positive & (*weight > 0.0));
        }
        let mut positive = true;
        for a in 0..covering {
            let mut weight = 1.0;
            let form = form(a);
            if form == Form::Ball {
                weight = factors[a];
                if gradients {
                    // The kernel is even: its slope vanishes at the centre, where the direction is undefined.
                    let distance = offsets[a].norm();
                    let slope = factor_slopes[a] * inverse_halves[a][0];
                    let scale = if distance > 0.0 { slope / distance } else { 0.0 };
                    for k in 0..D {
                        sums.slopes[k * stride + a] = offsets[a][k] * scale;
                    }
                }
            } else {
                for k in 0..D {
                    weight *= factors[k * row + a];
                }
                // Slopes by places in the support, then by those in the body.
                let by_place = |k: usize, sign: f64| {
                    let others = (0..D).filter(|&other| other != k).map(|other| factors[other * row + a]);
                    others.fold(factor_slopes[k * row + a] * sign, |slope, factor| slope * factor)
                };
                match form {
                    _ if !gradients => {}
                    Form::Parallelepiped(place) => {
                        let inverse = &self.inverse_axes[place as usize];
                        let xi = inverse * offsets[a];
                        let slopes = inverse.tr_mul(&Point::<D>::from_fn(|k, _| by_place(k, sign(xi[k]))));
                        for k in 0..D {
                            sums.slopes[k * stride + a] = slopes[k];
                        }
                    }
                    Form::Ball | Form::Box => {
                        for k in 0..D {
                            sums.slopes[k * stride + a] = by_place(k, sign(offsets[a][k]) * inverse_halves[a][k]);
                        }
                    }
                }
            }
            if let Some(&density) = self.densities.get(out.nodes[a] as usize) {
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

/// The sign of an offset, 0 at the centre: the kernel is even, and what its slope says there is of one side alone.
#[inline(always)]
fn sign(offset: f64) -> f64 {
    if offset == 0.0 { 0.0 } else { offset.signum() }
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
