//! Kernel functions $\Phi(z)$ of the normalised distance $z = \\|x - x_I\\|/a$, eqs. (3.3), (3.25).

use crate::error::ApproximationError;

/// A kernel function of the normalised distance.
///
/// Kernels are even, largest at 0 and zero for $z \ge 1$. A factor of all values cancels in the
/// moment matrix where supports are all balls or all boxes; where both occur, boxes have it once for each axis. Values and slopes are finite, and no value is negative: the moment matrix is factorised as a
/// positive definite one, which it is for kernels without a negative part alone. A particle whose kernel is zero
/// inside its support is left out there. Values that are negative or not finite, slopes that are not finite, and a
/// kernel without a value at 0 are refused, when the shape functions are made or at the point that meets them; jumps,
/// values that are larger elsewhere than at 0 and ones beyond $z = 1$, which nothing reads, are what
/// [`check::kernel`](crate::check::kernel) finds.
///
/// ```
/// use rkpm::kernel::Kernel;
/// /// (1 − z²)³, zero with two derivatives at the end of the support.
/// struct Bump;
/// impl Kernel for Bump {
///     fn value_and_slope(&self, z: f64) -> (f64, f64) {
///         if z >= 1.0 {
///             return (0.0, 0.0);
///         }
///         let q = 1.0 - z * z;
///         (q.powi(3), -6.0 * z * q * q)
///     }
/// }
/// assert_eq!(Bump.value_and_slope(0.0), (1.0, 0.0));
/// ```
pub trait Kernel: Send + Sync {
    /// $\Phi(z)$ and $\mathrm d\Phi/\mathrm dz$ for $z \ge 0$; both zero for $z \ge 1$.
    fn value_and_slope(&self, z: f64) -> (f64, f64);

    /// Writes $\Phi$ and $\mathrm d\Phi/\mathrm dz$ at several distances; all slices have one length.
    ///
    /// Nothing needs to be written for it: behind `dyn Kernel` it is one call for all neighbours of a point
    /// in place of one for each.
    fn fill(&self, z: &[f64], values: &mut [f64], slopes: &mut [f64]) {
        for ((z, value), slope) in z.iter().zip(values).zip(slopes) {
            (*value, *slope) = self.value_and_slope(*z);
        }
    }

    /// Refuses parameters that make no kernel; the default accepts all (values are checked all the same).
    ///
    /// # Errors
    /// Where a parameter is outside of what the kernel is made for.
    fn validate(&self) -> Result<(), ApproximationError> {
        Ok(())
    }
}

impl<K: Kernel + ?Sized> Kernel for std::sync::Arc<K> {
    fn value_and_slope(&self, z: f64) -> (f64, f64) {
        (**self).value_and_slope(z)
    }

    fn fill(&self, z: &[f64], values: &mut [f64], slopes: &mut [f64]) {
        (**self).fill(z, values, slopes);
    }

    fn validate(&self) -> Result<(), ApproximationError> {
        (**self).validate()
    }
}

impl<K: Kernel + ?Sized> Kernel for &K {
    fn value_and_slope(&self, z: f64) -> (f64, f64) {
        (**self).value_and_slope(z)
    }

    fn fill(&self, z: &[f64], values: &mut [f64], slopes: &mut [f64]) {
        (**self).fill(z, values, slopes);
    }

    fn validate(&self) -> Result<(), ApproximationError> {
        (**self).validate()
    }
}

/// Distances at which a kernel is looked at before it is used.
const SAMPLES: usize = 64;
/// What rounding may leave of a kernel that ends at zero, as a part of its value at the centre.
const ROUNDING: f64 = 1e-12;

/// What is wrong with a value or slope of a kernel, if anything; `top` is the value at the centre.
pub(crate) fn fault((value, slope): (f64, f64), top: f64) -> Option<(&'static str, f64, &'static str)> {
    if !value.is_finite() {
        Some(("the value of the kernel", value, "give finite values for z >= 0, zero from z = 1 on"))
    } else if value < -ROUNDING * top.abs() {
        let remedy = "the moment matrix needs kernels that are nowhere negative; take such a one";
        Some(("the value of the kernel", value, remedy))
    } else if !slope.is_finite() {
        Some(("the slope of the kernel", slope, "give finite slopes for z >= 0, zero from z = 1 on"))
    } else {
        None
    }
}

/// Refuses kernels with parameters, values or slopes that shape functions can't be made of.
pub(crate) fn check(kernel: &(impl Kernel + ?Sized)) -> Result<(), ApproximationError> {
    kernel.validate()?;
    let top = kernel.value_and_slope(0.0).0;
    let refuse = |(what, value, remedy), z: f64| {
        Err(ApproximationError::Function { what, value, at: format!("z = {z}"), remedy })
    };
    for sample in 0..SAMPLES {
        let z = sample as f64 / SAMPLES as f64;
        if let Some(fault) = fault(kernel.value_and_slope(z), top) {
            return refuse(fault, z);
        }
    }
    if !(top > 0.0) {
        return refuse(("the value of the kernel", top, "give a positive value at the centre of the support"), 0.0);
    }
    Ok(())
}

/// The cubic B-spline (3.25), $C^2$:
/// $\tfrac23 - 4z^2 + 4z^3$ up to $z = \tfrac12$, $\tfrac43(1-z)^3$ beyond.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CubicSpline;

impl Kernel for CubicSpline {
    #[inline]
    fn value_and_slope(&self, z: f64) -> (f64, f64) {
        // The truncated powers of both pieces, 4/3 [(1-z)₊³ - 4 (1/2-z)₊³]: without branches a loop over
        // neighbours fills whole registers.
        let outer = if z < 1.0 { 1.0 - z } else { 0.0 };
        let inner = if z < 0.5 { 0.5 - z } else { 0.0 };
        let (outer2, inner2) = (outer * outer, inner * inner);
        (4.0 / 3.0 * (outer2 * outer - 4.0 * inner2 * inner), 16.0 * inner2 - 4.0 * outer2)
    }
}

/// The quintic B-spline, $C^4$: $(3-3z)_+^5 - 6(2-3z)_+^5 + 15(1-3z)_+^5$, divided by 120.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct QuinticSpline;

impl Kernel for QuinticSpline {
    #[inline]
    fn value_and_slope(&self, z: f64) -> (f64, f64) {
        let mut value = 0.0;
        let mut slope = 0.0;
        for (weight, break_point) in [(1.0, 3.0), (-6.0, 2.0), (15.0, 1.0)] {
            let q: f64 = break_point - 3.0 * z;
            if q > 0.0 {
                let q4 = q.powi(4);
                value += weight * q4 * q;
                slope -= 15.0 * weight * q4;
            }
        }
        (value / 120.0, slope / 120.0)
    }
}

/// The Gaussian, truncated and shifted to zero at the end of the support:
/// $(e^{-(z/c)^2} - e^{-1/c^2})/(1 - e^{-1/c^2})$, $C^0$ at $z = 1$.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gaussian {
    /// The width $c$ as a part of the dilation, 0.01 to 1000: narrower ones see no neighbour, of wider ones
    /// rounding leaves nothing.
    pub width: f64,
}

impl Default for Gaussian {
    /// $c = 0.4$, the width usual in element-free Galerkin methods.
    fn default() -> Self {
        Gaussian { width: 0.4 }
    }
}

impl Kernel for Gaussian {
    #[inline]
    fn value_and_slope(&self, z: f64) -> (f64, f64) {
        if z >= 1.0 {
            return (0.0, 0.0);
        }
        let c2 = self.width * self.width;
        let end = (-1.0 / c2).exp();
        let bell = (-z * z / c2).exp();
        ((bell - end) / (1.0 - end), -2.0 * z / c2 * bell / (1.0 - end))
    }

    fn validate(&self) -> Result<(), ApproximationError> {
        if self.width >= 0.01 && self.width <= 1e3 {
            return Ok(());
        }
        let remedy = "give it as a part of the dilation, between 0.01 and 1000; 0.4 is usual";
        let at = "every point".to_string();
        Err(ApproximationError::Function { what: "the width of a Gaussian kernel", value: self.width, at, remedy })
    }
}

/// Wendland's $C^2$ function $(1-z)_+^4(4z+1)$.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct WendlandC2;

impl Kernel for WendlandC2 {
    #[inline]
    fn value_and_slope(&self, z: f64) -> (f64, f64) {
        if z >= 1.0 {
            return (0.0, 0.0);
        }
        let q = 1.0 - z;
        let q3 = q * q * q;
        (q3 * q * (4.0 * z + 1.0), -20.0 * z * q3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{abs_diff_eq, assert_abs_diff_eq};

    #[test]
    fn kernels_are_smooth_positive_and_end_at_one() {
        let kernels: [&dyn Kernel; 4] = [&CubicSpline, &QuinticSpline, &Gaussian::default(), &WendlandC2];
        for kernel in kernels {
            assert_eq!(kernel.value_and_slope(1.0), (0.0, 0.0));
            assert_eq!(kernel.value_and_slope(1.5), (0.0, 0.0));
            assert_eq!(kernel.value_and_slope(0.0).1, 0.0);
            for i in 1..100 {
                let z = i as f64 / 100.0 - 0.005;
                let (value, slope) = kernel.value_and_slope(z);
                assert!(value > 0.0 && slope <= 0.0);
                let step = 1e-6;
                let difference =
                    (kernel.value_and_slope(z + step).0 - kernel.value_and_slope(z - step).0) / (2.0 * step);
                assert!(abs_diff_eq!(difference, slope, epsilon = 1e-7), "{z}");
            }
        }
    }

    #[test]
    fn cubic_spline_has_the_moments_of_the_paper() {
        // ∫Φ = 1/2 and ∫z²Φ = 1/24 over [−1, 1] for (3.25); the trapezoidal rule of a C² function.
        let n = 4000;
        let (mut m0, mut m2) = (0.0, 0.0);
        for i in 0..=n {
            let z = i as f64 / n as f64;
            let w = if i == 0 || i == n { 1.0 } else { 2.0 } / n as f64;
            let value = CubicSpline.value_and_slope(z).0;
            m0 += w * value;
            m2 += w * z * z * value;
        }
        assert_abs_diff_eq!(m0, 0.5, epsilon = 1e-9);
        assert_abs_diff_eq!(m2, 1.0 / 24.0, epsilon = 1e-7);
    }
}
