//! Reproducing kernel shape functions (3.22)–(3.32).

mod evaluation;
mod refusal;

use std::sync::Arc;

use nalgebra::{DMatrix, SMatrix};

use crate::basis::Basis;
use crate::each::{Each, array_of, point_of};
use crate::error::ApproximationError;
use crate::geometry::Point;
use crate::kernel::Kernel;
use crate::neighbours::{BinGrid, Sights, Visibility};
use crate::particles::{Particles, Support};

use super::correction::Sums;

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
#[derive(Clone)]
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
    /// What is seen near slots; without it everything within reach.
    visibility: Option<Arc<Visibility<D>>>,
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
struct KernelScratch<const D: usize> {
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
    sights: Sights<D>,
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
                    // `Particles` has checked that the half-axes have an inverse.
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
        let densities = particles.volumes().paired(&reaches, |volume, reach| volume * measure(reach));
        Ok(ReproducingKernel {
            reaches,
            inverse_axes,
            densities,
            particles,
            kernel,
            basis,
            bins,
            rcond_limit: RCOND_LIMIT,
            visibility: None,
        })
    }

    /// Changes the reciprocal condition number below which a point is refused (default 1e-8); a number that is none or negative, below
    /// which nothing is, changes nothing.
    pub fn with_rcond_limit(mut self, limit: f64) -> Self {
        if limit >= 0.0 {
            self.rcond_limit = limit;
        }
        self
    }

    /// The same functions, each zero where its particle is not seen.
    pub(crate) fn seeing(mut self, visibility: Option<Visibility<D>>) -> Self {
        self.visibility = visibility.map(Arc::new);
        self
    }

    /// The reciprocal condition number below which a point is refused.
    pub(crate) fn rcond_limit(&self) -> f64 {
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
    pub(crate) fn basis(&self) -> &B {
        &self.basis
    }

    /// $\Phi_a(x - x_I)$ (3.26), (3.27) and, if requested, its gradient; `None` outside the support.
    #[inline]
    pub(crate) fn kernel_at(&self, particle: usize, at: &Point<D>, slopes: bool) -> Option<(f64, Point<D>)> {
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

    /// $\prod_k \Phi(|\xi_k|)$ and, if requested, its gradient, made of that by $\xi$; `None` outside the support.
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
        let factors: [(f64, f64); D] = array_of(|k| self.kernel.value_and_slope(xi[k].abs()));
        let value = factors.iter().map(|factor| factor.0).product();
        if !slopes {
            return Some((value, Point::zeros()));
        }
        let by_xi = point_of(|k| {
            let others = (0..D).filter(|&other| other != k).map(|other| factors[other].0);
            factors[k].1 * sign(xi[k]) * others.product::<f64>()
        });
        Some((value, gradient(&by_xi)))
    }

    /// Particles that may cover a point, by rising index.
    pub(crate) fn covering(&self, at: &Point<D>) -> impl Iterator<Item = u32> + '_ {
        self.bins.candidates(at).iter().copied()
    }
}

/// The sign of an offset, 0 at the centre: the kernel is even, and what its slope says there is of one side alone.
#[inline(always)]
fn sign(offset: f64) -> f64 {
    if offset == 0.0 { 0.0 } else { offset.signum() }
}
