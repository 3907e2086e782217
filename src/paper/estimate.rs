//! §3.1 step by step: the uncorrected kernel estimate, its moments, and the correction as values.
//!
//! Shape functions never come this way; these are the intermediate quantities of the paper, for those who
//! want to look at them. Sums run over particles with their volumes (one where the set has none).

use nalgebra::{DMatrix, DVector};

use crate::basis::Basis;
use crate::error::ApproximationError;
use crate::geometry::Point;
use crate::kernel::Kernel;
use crate::shape::ReproducingKernel;

impl<const D: usize, K: Kernel, B: Basis<D>> ReproducingKernel<D, K, B> {
    /// The weight $\Phi_a(x - x_I)\\,\Delta V_I$ of each particle that covers a point, (3.3), (3.26), (3.27);
    /// without volumes the kernel carries no factor $1/a$, which cancels in every corrected quantity.
    pub fn kernel_weights(&self, at: &Point<D>) -> Vec<(u32, f64)> {
        self.covering(at)
            .filter_map(|particle| Some((particle, self.kernel_at(particle as usize, at, false)?.0)))
            .collect()
    }

    /// The uncorrected kernel estimate $u^a(x) = \sum_I \Phi_a(x - x_I)\\,u_I\\,\Delta V_I$ (3.2): not even
    /// constants are reproduced near a boundary. NaN for fewer values than particles.
    pub fn kernel_estimate(&self, at: &Point<D>, values: &[f64]) -> f64 {
        if values.len() < self.particles().positions().len() {
            return f64::NAN;
        }
        self.kernel_weights(at).iter().map(|&(particle, weight)| weight * values[particle as usize]).sum()
    }

    /// The moment $m_\alpha(x) = \sum_I (x - x_I)^\alpha\\,\Phi_a(x - x_I)\\,\Delta V_I$ (3.6).
    pub fn moment(&self, at: &Point<D>, exponents: [i32; D]) -> f64 {
        let power = |particle: u32| -> f64 {
            let offset = at - self.particles().positions()[particle as usize];
            (0..D).map(|i| offset[i].powi(exponents[i])).product()
        };
        self.kernel_weights(at).iter().map(|&(particle, weight)| weight * power(particle)).sum()
    }

    /// The moment matrix $M(x) = \sum_I H H^T\\,\Phi_a\\,\Delta V_I$ (3.19), basis shifted but not scaled.
    pub fn moment_matrix(&self, at: &Point<D>) -> DMatrix<f64> {
        let n = self.basis().len();
        let mut moment = DMatrix::zeros(n, n);
        for (particle, weight) in self.kernel_weights(at) {
            let h = self.basis_at(&(at - self.particles().positions()[particle as usize]));
            moment.ger(weight, &h, &h, 1.0);
        }
        moment
    }

    /// The coefficients $b(x) = M^{-1}(x)\\,H(0)$ of the correction (3.21).
    ///
    /// # Errors
    /// Where the moment matrix is singular.
    pub fn correction_coefficients(&self, at: &Point<D>) -> Result<DVector<f64>, ApproximationError> {
        let covering = self.kernel_weights(at).len();
        let singular = ApproximationError::Singular { at: at.as_slice().to_vec(), rcond: 0.0, limit: 0.0, covering };
        let factor = self.moment_matrix(at).cholesky().ok_or(singular)?;
        Ok(factor.solve(&self.basis_at(&Point::zeros())))
    }

    /// The correction function $C(x; x - s) = H^T(x - s)\\,b(x)$ (3.11).
    ///
    /// # Errors
    /// Where the moment matrix is singular.
    pub fn correction(&self, at: &Point<D>, s: &Point<D>) -> Result<f64, ApproximationError> {
        Ok(self.basis_at(&(at - s)).dot(&self.correction_coefficients(at)?))
    }

    /// The modified kernel $\bar\Phi_a(x; x - x_I) = C(x; x - x_I)\\,\Phi_a(x - x_I)\\,[\Delta V_I]$ of one particle
    /// (3.10), (3.22): its shape function, by the paper's own route.
    ///
    /// # Errors
    /// Where the moment matrix is singular.
    pub fn modified_kernel(&self, at: &Point<D>, particle: usize) -> Result<f64, ApproximationError> {
        if particle >= self.particles().positions().len() {
            return Err(ApproximationError::Particle {
                particle,
                what: "there is no particle of this number",
                remedy: "give indices below the number of particles",
            });
        }
        let Some((weight, _)) = self.kernel_at(particle, at, false) else { return Ok(0.0) };
        Ok(weight * self.correction(at, &self.particles().positions()[particle])?)
    }

    fn basis_at(&self, offset: &Point<D>) -> DVector<f64> {
        let n = self.basis().len();
        let mut h = DVector::zeros(n);
        self.basis().fill(offset, h.as_mut_slice(), &mut vec![Point::zeros(); n]);
        h
    }
}
