//! Spatial kernels (4.53)–(4.56): shape functions rebuilt on moved particles with supports that do not move along.

use crate::basis::Basis;
use crate::error::ApproximationError;
use crate::geometry::Point;
use crate::kernel::Kernel;
use crate::particles::Particles;
use crate::shape::{Approximation, ReproducingKernel, ShapeFunctions};

/// Reciprocal condition number of the moment matrix below which a spatial kernel is about to lose its cover.
///
/// Material kernels on lattices stay above it; stretched spatial ones fall below well before the cover is lost.
pub const COVER_WARNING: f64 = 1e-3;

/// How well particles cover a set of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Cover {
    /// The smallest reciprocal condition number of the moment matrix; 0 where the cover is lost.
    pub rcond: f64,
    /// Where it was found \[length\].
    pub at: Vec<f64>,
    /// Points covered by fewer particles than the basis has terms, or singularly.
    pub lost: usize,
}

impl Cover {
    /// Whether no shape functions exist at some point.
    pub fn is_lost(&self) -> bool {
        self.lost > 0
    }

    /// Whether the cover is lost or about to be: the reciprocal condition is below [`COVER_WARNING`].
    pub fn is_warned(&self) -> bool {
        self.is_lost() || self.rcond < COVER_WARNING
    }
}

impl<const D: usize, K: Kernel + Clone, B: Basis<D> + Clone> ReproducingKernel<D, K, B> {
    /// The spatial kernel: the same kernel, basis, supports and limit of the condition number on particles at their
    /// current positions, (4.53).
    ///
    /// A material kernel needs no such thing: its supports deform with the body and always cover the same
    /// particles (4.46). With fixed dilation the spatial one loses its cover at a stretch of $2r$ (linear basis).
    ///
    /// # Errors
    /// Where the number of positions differs from that of the particles, or two of them coincide.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let particles = Block::new([0.0], [8.0]).particles([9], 1.0)?;
    /// let material = ReproducingKernel::new(particles, CubicSpline, Polynomial::linear())?;
    /// let stretched = |s: f64| material.nodes().iter().map(|x| x * s).collect::<Vec<_>>();
    /// let spatial = material.spatial(stretched(1.5))?;
    /// assert!(!spatial.cover(spatial.nodes()).is_lost());
    /// let spatial = material.spatial(stretched(2.1))?;
    /// assert!(spatial.cover(spatial.nodes()).is_lost());
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn spatial(&self, positions: Vec<Point<D>>) -> Result<Self, ApproximationError> {
        let mut moved = Particles::new(positions, self.particles().supports().to_vec())?;
        if !self.particles().volumes().is_empty() {
            moved = moved.with_volumes(self.particles().volumes().to_vec())?;
        }
        let spatial = ReproducingKernel::new(moved, self.kernel().clone(), self.basis().clone())?;
        Ok(spatial.with_rcond_limit(self.rcond_limit()))
    }
}

impl<const D: usize, K: Kernel, B: Basis<D>> ReproducingKernel<D, K, B> {
    /// The certificate of a set of points: the smallest reciprocal condition number, and where the cover is lost.
    pub fn cover(&self, points: &[Point<D>]) -> Cover {
        let mut cover = Cover { rcond: f64::INFINITY, at: Vec::new(), lost: 0 };
        let mut scratch = Default::default();
        let mut psi = ShapeFunctions::default();
        for at in points {
            let rcond = match self.evaluate_values(at, &mut scratch, &mut psi) {
                Ok(()) => psi.rcond,
                Err(_) => {
                    cover.lost += 1;
                    0.0
                }
            };
            if rcond < cover.rcond {
                cover.rcond = rcond;
                cover.at = at.as_slice().to_vec();
            }
        }
        cover
    }
}
