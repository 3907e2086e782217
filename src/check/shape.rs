//! Contracts of kernels and bases.

use nalgebra::{DMatrix, DVector};

use crate::basis::Basis;
use crate::geometry::Point;
use crate::kernel::Kernel;

use super::{Law, Report, signed};

/// Samples of a kernel between 0 and 1.
const KERNEL_SAMPLES: usize = 400;
/// Step of central differences of smooth functions: truncation $h^2$ meets rounding $\epsilon/h$ near here.
const STEP: f64 = 1e-5;
/// What differences with [`STEP`] leave of exact slopes, with room for knots of splines.
const SLOPE_TOLERANCE: f64 = 1e-6;
/// Terms of a basis up to which it is checked; a moment matrix of more is out of reach anyway.
const TERM_LIMIT: usize = 200;
/// Condition number of a basis on samples beyond which its functions count as dependent.
const DEPENDENT: f64 = 1e8;

/// Checks the contract of [`Kernel`]: value and slope zero for $z \ge 1$, positive inside, largest at 0,
/// slope zero at 0 (else the even kernel has a kink there), slope the derivative of the value.
///
/// ```
/// use rkpm::kernel::{CubicSpline, Gaussian, QuinticSpline, WendlandC2};
/// assert!(rkpm::check::kernel(&CubicSpline).holds());
/// assert!(rkpm::check::kernel(&Gaussian::default()).holds());
/// ```
pub fn kernel(kernel: &dyn Kernel) -> Report {
    let top = kernel.value_and_slope(0.0).0;
    let place = |z: f64| move || format!("z = {z}");
    let mut ends = Law::new("value and slope are zero for z >= 1", 0.0);
    for z in [1.0, 1.0 + 1e-12, 1.001, 1.5, 2.0, 10.0, 1e6] {
        let (value, slope) = kernel.value_and_slope(z);
        ends.see((value.abs() + slope.abs()) / top.abs(), place(z));
    }
    let mut positive = Law::new("the value is positive inside the support", 0.0);
    let mut largest = Law::new("the value is largest at z = 0", 0.0);
    let mut even = Law::new("the slope is zero at z = 0", 0.0);
    let mut slopes = Law::new("the slope is the derivative of the value", SLOPE_TOLERANCE);
    even.see(kernel.value_and_slope(0.0).1.abs() / top.abs(), place(0.0));
    positive.see(not_positive(top), place(0.0));
    for i in 0..KERNEL_SAMPLES {
        // Off the round numbers where splines have their knots.
        let z = (i as f64 + 0.377) / KERNEL_SAMPLES as f64;
        let (value, slope) = kernel.value_and_slope(z);
        positive.see(not_positive(value / top), place(z));
        largest.see((value / top - 1.0).max(0.0) + 0.0 * value, place(z));
        let (above, below) = (kernel.value_and_slope(z + STEP).0, kernel.value_and_slope(z - STEP).0);
        slopes.see(((above - below) / (2.0 * STEP) - slope).abs() / top.abs(), place(z));
    }
    Report::default().with([ends, positive, largest, even, slopes])
}

/// How far a number is from being positive; NaN stays NaN.
fn not_positive(value: f64) -> f64 {
    if value > 0.0 { 0.0 } else { (-value).max(f64::MIN_POSITIVE) + 0.0 * value }
}

/// Checks the contract of [`Basis`]: the gradients are derivatives, the span holds the constant, the
/// functions are independent, and the span does not depend on shift and scale of its argument.
///
/// ```
/// use rkpm::{basis::{Basis, Polynomial}, geometry::Point};
/// assert!(rkpm::check::basis(&Polynomial::<2>::quadratic()).holds());
/// /// Without a constant no rigid motion is reproduced.
/// struct Slopes;
/// impl Basis<1> for Slopes {
///     fn len(&self) -> usize { 1 }
///     fn fill(&self, x: &Point<1>, h: &mut [f64], dh: &mut [Point<1>]) {
///         h[0] = x[0];
///         dh[0] = Point::<1>::new(1.0);
///     }
/// }
/// assert!(!rkpm::check::basis(&Slopes).holds());
/// ```
pub fn basis<const D: usize>(basis: &dyn Basis<D>) -> Report {
    let terms = basis.len();
    if terms == 0 {
        let mut constant = Law::new("the span holds the constant", 0.0);
        constant.see(f64::INFINITY, || "a basis without functions".into());
        return Report::default().with([constant]);
    }
    if terms > TERM_LIMIT {
        return Report::default().unchecked(format!("all laws: {terms} terms, at most {TERM_LIMIT} are checked"));
    }
    let mut random = fastrand::Rng::with_seed(1);
    let samples: Vec<Point<D>> = (0..4 * terms + 20).map(|_| Point::from_fn(|_, _| signed(&mut random))).collect();
    let fill = |x: &Point<D>| {
        let (mut h, mut dh) = (vec![0.0; terms], vec![Point::<D>::zeros(); terms]);
        basis.fill(x, &mut h, &mut dh);
        (h, dh)
    };

    let mut slopes = Law::new("the gradients are derivatives of the functions", SLOPE_TOLERANCE);
    for x in &samples {
        let (_, dh) = fill(x);
        for axis in 0..D {
            let mut step = Point::<D>::zeros();
            step[axis] = STEP;
            let (above, below) = (fill(&(x + step)).0, fill(&(x - step)).0);
            for k in 0..terms {
                let difference = (above[k] - below[k]) / (2.0 * STEP);
                let size = 1.0 + dh[k].norm();
                slopes.see((difference - dh[k][axis]).abs() / size, || {
                    format!("function {k}, axis {axis}, xi = {:?}", x.as_slice())
                });
            }
        }
    }

    // All functions at all samples, each scaled to size 1.
    let mut matrix = DMatrix::zeros(samples.len(), terms);
    for (row, x) in samples.iter().enumerate() {
        matrix.row_mut(row).copy_from_slice(&fill(x).0);
    }
    let mut independent = Law::new("the functions are independent (condition number)", DEPENDENT);
    for k in 0..terms {
        let norm = matrix.column(k).norm();
        if norm > 0.0 {
            matrix.column_mut(k).scale_mut(1.0 / norm);
        }
    }
    let mut constant = Law::new("the span holds the constant", 1e-9);
    let mut closed = Law::new("the span does not depend on shift and scale", 1e-9);
    if matrix.iter().any(|v| !v.is_finite()) {
        independent.see(f64::NAN, || "a function is not finite between -1 and 1".into());
        return Report::default().with([slopes, independent]);
    }
    let decomposition = matrix.clone().svd(true, true);
    let singular = &decomposition.singular_values;
    let condition = singular.max() / singular.min();
    independent.see(if singular.min() > 0.0 { condition } else { f64::INFINITY }, || "samples in [-1, 1]".into());
    let distance = |values: DVector<f64>| -> f64 {
        let size = values.norm();
        match decomposition.solve(&values, singular.max() * 1e-12) {
            Ok(fit) if size > 0.0 => (&matrix * fit - &values).norm() / size,
            Ok(_) => 0.0,
            Err(_) => f64::NAN,
        }
    };
    constant.see(distance(DVector::repeat(samples.len(), 1.0)), || "samples in [-1, 1]".into());
    let shift = Point::<D>::from_fn(|i, _| 0.3 - 0.2 * i as f64);
    let shifted: Vec<Vec<f64>> = samples.iter().map(|x| fill(&(x * 0.7 + shift)).0).collect();
    for k in 0..terms {
        let values = DVector::from_fn(samples.len(), |row, _| shifted[row][k]);
        closed.see(distance(values), || format!("function {k} at 0.7 xi + {:?}", shift.as_slice()));
    }
    Report::default().with([slopes, constant, independent, closed])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::basis::Polynomial;
    use crate::kernel::{CubicSpline, Gaussian, QuinticSpline, WendlandC2};

    #[test]
    fn the_pieces_of_the_crate_hold() {
        for piece in [&CubicSpline as &dyn Kernel, &QuinticSpline, &Gaussian::default(), &WendlandC2] {
            let report = kernel(piece);
            assert!(report.holds(), "{report}");
        }
        for order in 0..4 {
            let report = basis(&Polynomial::<2>::new(order));
            assert!(report.holds(), "{report}");
            let report = basis(&Polynomial::<3>::new(order));
            assert!(report.holds(), "{report}");
        }
    }

    /// A kernel from a function.
    struct From<F>(F);

    impl<F: Fn(f64) -> (f64, f64) + Send + Sync> Kernel for From<F> {
        fn value_and_slope(&self, z: f64) -> (f64, f64) {
            (self.0)(z)
        }
    }

    fn broken(report: &Report) -> Vec<&str> {
        report.violations().map(|f| f.law).collect()
    }

    #[test]
    fn each_broken_law_is_named() {
        let inside = |z: f64, pair: (f64, f64)| if z < 1.0 { pair } else { (0.0, 0.0) };
        let hat = From(move |z: f64| inside(z, (1.0 - z, -1.0)));
        assert_eq!(broken(&kernel(&hat)), ["the slope is zero at z = 0"]);
        let wrong = From(move |z: f64| inside(z, ((1.0 - z * z).powi(2), -2.0 * z * (1.0 - z * z))));
        assert_eq!(broken(&kernel(&wrong)), ["the slope is the derivative of the value"]);
        let negative = From(move |z: f64| inside(z, (1.0 - 2.0 * z * z, -4.0 * z)));
        assert_eq!(broken(&kernel(&negative)), ["the value is positive inside the support"]);
        let nan = From(|_: f64| (f64::NAN, f64::NAN));
        assert_eq!(broken(&kernel(&nan)).len(), 5);

        struct Powers([i32; 2], f64);
        impl Basis<1> for Powers {
            fn len(&self) -> usize {
                2
            }
            fn fill(&self, x: &Point<1>, h: &mut [f64], dh: &mut [Point<1>]) {
                for (k, p) in self.0.into_iter().enumerate() {
                    h[k] = x[0].powi(p);
                    dh[k][0] = self.1 * if p == 0 { 0.0 } else { f64::from(p) * x[0].powi(p - 1) };
                }
            }
        }
        assert!(basis(&Powers([0, 1], 1.0)).holds());
        assert_eq!(broken(&basis(&Powers([0, 1], 2.0))), ["the gradients are derivatives of the functions"]);
        assert_eq!(broken(&basis(&Powers([0, 2], 1.0))), ["the span does not depend on shift and scale"]);
        assert_eq!(broken(&basis(&Powers([0, 0], 1.0))), ["the functions are independent (condition number)"]);
        assert_eq!(basis(&Polynomial::<3>::new(20)).unchecked.len(), 1);
    }
}
