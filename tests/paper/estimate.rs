//! §3.1 step by step: the uncorrected kernel estimate, its moments, and the correction as values. Sums run over particles with their
//! volumes (one where the set has none).

use rkpm::nalgebra::{DMatrix, DVector};
use rkpm::prelude::*;

/// The quantities of §3.1 for a linear basis.
pub trait Estimate<const D: usize> {
    /// $u^a(x) = \sum_I \Phi_a(x - x_I)\,u_I\,\Delta V_I$ (3.2): not even constants are reproduced near a boundary.
    fn kernel_estimate(&self, at: &Point<D>, values: &[f64]) -> f64;

    /// The moment $m_\alpha(x) = \sum_I (x - x_I)^\alpha\,\Phi_a(x - x_I)\,\Delta V_I$ (3.6).
    fn moment(&self, at: &Point<D>, exponents: [i32; D]) -> f64;

    /// The moment matrix $M(x) = \sum_I H H^T\,\Phi_a\,\Delta V_I$ (3.19), basis shifted but not scaled.
    fn moment_matrix(&self, at: &Point<D>) -> DMatrix<f64>;

    /// The correction function $C(x; x - s) = H^T(x - s)\,M^{-1}(x)\,H(0)$ (3.11), (3.21).
    fn correction(&self, at: &Point<D>, s: &Point<D>) -> f64;

    /// The modified kernel $C(x; x - x_I)\,\Phi_a(x - x_I)\,[\Delta V_I]$ of one particle (3.10), (3.22): its shape function, by the
    /// paper's own route.
    fn modified_kernel(&self, at: &Point<D>, particle: usize) -> f64;
}

impl<const D: usize, K: Kernel> Estimate<D> for ReproducingKernel<D, K, Polynomial<D>> {
    fn kernel_estimate(&self, at: &Point<D>, values: &[f64]) -> f64 {
        self.kernel_weights(at).iter().map(|&(particle, weight)| weight * values[particle as usize]).sum()
    }

    fn moment(&self, at: &Point<D>, exponents: [i32; D]) -> f64 {
        let power = |particle: u32| -> f64 {
            let offset = at - self.particles().positions()[particle as usize];
            (0..D).map(|i| offset[i].powi(exponents[i])).product()
        };
        self.kernel_weights(at).iter().map(|&(particle, weight)| weight * power(particle)).sum()
    }

    fn moment_matrix(&self, at: &Point<D>) -> DMatrix<f64> {
        let mut moment = DMatrix::zeros(D + 1, D + 1);
        for (particle, weight) in self.kernel_weights(at) {
            let h = basis_at(&(at - self.particles().positions()[particle as usize]));
            moment.ger(weight, &h, &h, 1.0);
        }
        moment
    }

    fn correction(&self, at: &Point<D>, s: &Point<D>) -> f64 {
        let factor = self.moment_matrix(at).cholesky().expect("enough particles cover the point");
        basis_at(&(at - s)).dot(&factor.solve(&basis_at(&Point::<D>::zeros())))
    }

    fn modified_kernel(&self, at: &Point<D>, particle: usize) -> f64 {
        let weights = self.kernel_weights(at);
        let own = weights.iter().find(|(other, _)| *other as usize == particle);
        own.map_or(0.0, |(_, weight)| weight * self.correction(at, &self.particles().positions()[particle]))
    }
}

/// The linear basis, $1, x_1, x_2 \dots$
fn basis_at<const D: usize>(offset: &Point<D>) -> DVector<f64> {
    DVector::from_iterator(D + 1, std::iter::once(1.0).chain(offset.iter().copied()))
}
