//! Reproducing kernel shape functions (3.22)–(3.32).

use crate::basis::Basis;
use crate::dense::{cholesky, cholesky_solve, one_norm};
use crate::error::ApproximationError;
use crate::geometry::Point;
use crate::kernel::Kernel;
use crate::neighbours::BinGrid;
use crate::particles::{Particles, Support};

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
    /// Kernel value and gradient of each covering particle.
    weights: Vec<f64>,
    slopes: Vec<Point<D>>,
    /// Basis and its gradient at each covering particle, one after the other.
    basis: Vec<f64>,
    basis_slopes: Vec<Point<D>>,
    moment: Vec<f64>,
    factor: Vec<f64>,
    column: Vec<f64>,
    coefficients: Vec<f64>,
    coefficient_slopes: Vec<f64>,
}

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
                if distance >= *radius {
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
                    if z >= 1.0 {
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
        out.nodes.clear();
        out.values.clear();
        scratch.weights.clear();
        scratch.slopes.clear();
        let mut scale = Point::<D>::zeros();
        for &particle in self.bins.candidates(at) {
            if let Some((value, slope)) = self.kernel_at(particle as usize, at, gradients) {
                // A kernel that underflows to zero inside its support adds nothing.
                if value > 0.0 {
                    out.nodes.push(particle);
                    scratch.weights.push(value);
                    scratch.slopes.push(slope);
                    let half = self.particles.supports()[particle as usize].half_widths();
                    scale = scale.zip_map(&half, f64::max);
                }
            }
        }
        let covering = out.nodes.len();
        if covering < terms {
            return Err(ApproximationError::Uncovered { at: at.as_slice().to_vec(), covering, needed: terms });
        }
        let inverse_scale = scale.map(|s| 1.0 / s);

        scratch.basis.resize(covering * terms, 0.0);
        scratch.basis_slopes.resize(covering * terms, Point::zeros());
        scratch.moment.clear();
        scratch.moment.resize(terms * terms, 0.0);
        for (a, &particle) in out.nodes.iter().enumerate() {
            let offset = (at - self.particles.positions()[particle as usize]).component_mul(&inverse_scale);
            let h = &mut scratch.basis[a * terms..(a + 1) * terms];
            self.basis.fill(&offset, h, &mut scratch.basis_slopes[a * terms..(a + 1) * terms]);
            let weight = scratch.weights[a];
            for i in 0..terms {
                let weighted = weight * h[i];
                for j in 0..=i {
                    scratch.moment[i * terms + j] += weighted * h[j];
                }
            }
        }
        for i in 0..terms {
            for j in 0..i {
                scratch.moment[j * terms + i] = scratch.moment[i * terms + j];
            }
        }
        let norm = one_norm(&scratch.moment, terms);
        scratch.factor.clear();
        scratch.factor.extend_from_slice(&scratch.moment);
        let definite = cholesky(&mut scratch.factor, terms);
        let mut inverse_norm = f64::INFINITY;
        if definite {
            inverse_norm = 0.0f64;
            for j in 0..terms {
                scratch.column.clear();
                scratch.column.resize(terms, 0.0);
                scratch.column[j] = 1.0;
                cholesky_solve(&scratch.factor, terms, &mut scratch.column);
                inverse_norm = inverse_norm.max(scratch.column.iter().map(|v| v.abs()).sum());
            }
        }
        out.rcond = 1.0 / (norm * inverse_norm);
        // The negation also refuses NaN.
        if !(out.rcond >= self.rcond_limit) {
            let rcond = if out.rcond.is_finite() { out.rcond } else { 0.0 };
            let limit = self.rcond_limit;
            return Err(ApproximationError::Singular { at: at.as_slice().to_vec(), rcond, limit, covering });
        }

        // b = M⁻¹ H(0), eq. (3.21); one step of refinement brings the reproducing conditions to rounding.
        scratch.coefficients.clear();
        scratch.coefficients.resize(terms, 0.0);
        scratch.column.clear();
        scratch.column.resize(terms, 0.0);
        // The slopes buffer is free until the second pass: use it for ∂H(0), which is not needed.
        scratch.basis_slopes.resize((covering + 1) * terms, Point::zeros());
        self.basis.fill(&Point::zeros(), &mut scratch.column, &mut scratch.basis_slopes[covering * terms..]);
        scratch.coefficients.copy_from_slice(&scratch.column);
        cholesky_solve(&scratch.factor, terms, &mut scratch.coefficients);
        for i in 0..terms {
            let row = &scratch.moment[i * terms..(i + 1) * terms];
            let product: f64 = row.iter().zip(&scratch.coefficients).map(|(m, b)| m * b).sum();
            scratch.column[i] -= product;
        }
        cholesky_solve(&scratch.factor, terms, &mut scratch.column);
        for (b, correction) in scratch.coefficients.iter_mut().zip(&scratch.column) {
            *b += correction;
        }

        for a in 0..covering {
            let h = &scratch.basis[a * terms..(a + 1) * terms];
            let correction: f64 = h.iter().zip(&scratch.coefficients).map(|(h, b)| h * b).sum();
            out.values.push(correction * scratch.weights[a]);
        }
        if !gradients {
            return Ok(());
        }

        // ∂b/∂x_k = −M⁻¹ (∂M/∂x_k b); the product is summed directly, without the matrix ∂M/∂x_k.
        scratch.coefficient_slopes.clear();
        scratch.coefficient_slopes.resize(D * terms, 0.0);
        out.gradients.clear();
        for a in 0..covering {
            let h = &scratch.basis[a * terms..(a + 1) * terms];
            let dh = &scratch.basis_slopes[a * terms..(a + 1) * terms];
            let mut correction = 0.0;
            let mut correction_slope = Point::<D>::zeros();
            for i in 0..terms {
                correction += h[i] * scratch.coefficients[i];
                correction_slope += dh[i] * scratch.coefficients[i];
            }
            correction_slope.component_mul_assign(&inverse_scale);
            let weight = scratch.weights[a];
            let slope = scratch.slopes[a];
            let total = correction_slope * weight + slope * correction;
            for k in 0..D {
                let dm = &mut scratch.coefficient_slopes[k * terms..(k + 1) * terms];
                let along = correction * weight * inverse_scale[k];
                for i in 0..terms {
                    dm[i] -= h[i] * total[k] + dh[i][k] * along;
                }
            }
            out.gradients.push(total);
        }
        for k in 0..D {
            cholesky_solve(&scratch.factor, terms, &mut scratch.coefficient_slopes[k * terms..(k + 1) * terms]);
        }
        for a in 0..covering {
            let h = &scratch.basis[a * terms..(a + 1) * terms];
            let weight = scratch.weights[a];
            for k in 0..D {
                let db = &scratch.coefficient_slopes[k * terms..(k + 1) * terms];
                let sum: f64 = h.iter().zip(db).map(|(h, b)| h * b).sum();
                out.gradients[a][k] += sum * weight;
            }
        }
        Ok(())
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
