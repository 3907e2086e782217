//! Why a point has no shape functions.

use crate::basis::Basis;
use crate::error::ApproximationError;
use crate::geometry::Point;
use crate::kernel::{Kernel, fault};

use super::super::ShapeFunctions;
use super::super::correction::padded;
use super::{Form, KernelScratch, ReproducingKernel};

impl<const D: usize, K: Kernel, B: Basis<D>> ReproducingKernel<D, K, B> {
    /// Why a point has no shape functions: values or slopes that are not finite, else a singular moment matrix.
    #[cold]
    pub(super) fn refusal(
        &self,
        at: &Point<D>,
        scratch: &KernelScratch<D>,
        out: &ShapeFunctions<D>,
        gradients: bool,
    ) -> ApproximationError {
        if let Err(error) = self.check_kernel(at, scratch, out) {
            return error;
        }
        let covering = out.nodes.len();
        let (terms, stride) = (self.basis.len(), padded(covering));
        let values = (&scratch.sums.basis, terms, "a function of the basis");
        let slopes = (&scratch.sums.basis_slopes, if gradients { terms * D } else { 0 }, "a slope of the basis");
        let remedy = "give finite values and slopes for arguments between -1 and 1 along each axis";
        for (entries, rows, what) in [values, slopes] {
            if let Some(&value) = entries[..rows * stride].iter().find(|v| !v.is_finite()) {
                return ApproximationError::Function { what, value, at: format!("X = {:?}", at.as_slice()), remedy };
            }
        }
        let rcond = if out.rcond.is_finite() { out.rcond } else { 0.0 };
        let limit = self.rcond_limit;
        ApproximationError::Singular { at: at.as_slice().to_vec(), rcond, limit, covering }
    }

    /// Refuses values and slopes of the kernel, as [`weigh`](Self::weigh) left them, that are negative or not finite.
    #[cold]
    pub(super) fn check_kernel(
        &self,
        at: &Point<D>,
        scratch: &KernelScratch<D>,
        out: &ShapeFunctions<D>,
    ) -> Result<(), ApproximationError> {
        let top = self.kernel.value_and_slope(0.0).0;
        for (a, &node) in out.nodes.iter().enumerate() {
            let axes = if self.reaches[node as usize].form == Form::Ball { 1 } else { D };
            for entry in (0..axes).map(|k| k * scratch.row + a) {
                let pair = (scratch.factors[entry], scratch.factor_slopes[entry]);
                if let Some((what, value, remedy)) = fault(pair, top) {
                    let at = format!("X = {:?}, z = {} from particle {node}", at.as_slice(), scratch.distances[entry]);
                    return Err(ApproximationError::Function { what, value, at, remedy });
                }
            }
        }
        Ok(())
    }
}
