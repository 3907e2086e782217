//! The weights of the uncorrected kernel estimate, §3.1.

use crate::basis::Basis;
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
}
