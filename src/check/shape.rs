//! Contracts of kernels and bases.

use nalgebra::{DMatrix, DVector};

use crate::basis::Basis;
use crate::each::{Each, list_of, point_of};
use crate::geometry::Point;
use crate::kernel::Kernel;

use super::{Finding, Report, signed};

/// Samples of a kernel between 0 and 1.
const KERNEL_SAMPLES: usize = 400;
/// Step of central differences of smooth functions: truncation $h^2$ meets rounding $\epsilon/h$ near here.
const STEP: f64 = 1e-5;
/// What differences with [`STEP`] leave of exact slopes, with room for break points of splines.
const SLOPE_TOLERANCE: f64 = 1e-6;
/// Intervals at whose ends a kernel without jumps has one value.
const SHORTEST: f64 = 1e-9;
/// What another order of the same operations may change.
const SAME: f64 = 1e-10;
/// Terms of a basis up to which it is checked; a moment matrix of more is out of reach anyway.
const TERM_LIMIT: usize = 200;
/// Condition number of a basis on samples beyond which its functions count as dependent.
const DEPENDENT: f64 = 1e8;

/// Checks the contract of [`Kernel`]: value and slope zero for $z \ge 1$, positive inside, largest at 0,
/// slope zero at 0 (else the even kernel has a kink there), slope the derivative of the value, no jump of the value up
/// to $z = 1$, and that [`Kernel::fill`], which shape functions call, gives the same.
///
/// ```
/// use rkpm::kernel::{CubicSpline, Gaussian, QuinticSpline, WendlandC2};
/// assert!(rkpm::check::kernel(&CubicSpline).holds());
/// assert!(rkpm::check::kernel(&Gaussian::default()).holds());
/// ```
pub fn kernel(kernel: &dyn Kernel) -> Report {
    let top = kernel.value_and_slope(0.0).0;
    let place = |z: f64| move || format!("z = {z}");
    let mut ends = Finding::new("value and slope are zero for z >= 1", 0.0);
    for z in [1.0, 1.0 + 1e-12, 1.001, 1.5, 2.0, 10.0, 1e6] {
        let (value, slope) = kernel.value_and_slope(z);
        ends.see((value.abs() + slope.abs()) / top.abs(), place(z));
    }
    let mut positive = Finding::new("the value is positive inside the support", 0.0);
    let mut largest = Finding::new("the value is largest at z = 0", 0.0);
    let mut even = Finding::new("the slope is zero at z = 0", 0.0);
    let mut slopes = Finding::new("the slope is the derivative of the value", SLOPE_TOLERANCE);
    even.see(kernel.value_and_slope(0.0).1.abs() / top.abs(), place(0.0));
    positive.see(not_positive(top), place(0.0));
    for i in 0..KERNEL_SAMPLES {
        // Off the round numbers where splines have their break points.
        let z = (i as f64 + 0.377) / KERNEL_SAMPLES as f64;
        let (value, slope) = kernel.value_and_slope(z);
        positive.see(not_positive(value / top), place(z));
        largest.see((value / top - 1.0).max(0.0) + 0.0 * value, place(z));
        let (above, below) = (kernel.value_and_slope(z + STEP).0, kernel.value_and_slope(z - STEP).0);
        slopes.see(((above - below) / (2.0 * STEP) - slope).abs() / top.abs(), place(z));
    }
    Report::default().with([ends, positive, largest, even, slopes, jumps(kernel, top), filled(kernel, top)])
}

/// Differences of the value against integrals of the slope: off at a jump however short the interval. Differences at
/// samples alone step over jumps between them.
fn jumps(kernel: &dyn Kernel, top: f64) -> Finding {
    let mut steady = Finding::new("the value has no jumps", SLOPE_TOLERANCE);
    let value = |z: f64| kernel.value_and_slope(z).0;
    // Simpson's rule, whose error falls with the interval even where the slope jumps.
    let off = |low: f64, high: f64| {
        let slope = |part: f64| kernel.value_and_slope(low + part * (high - low)).1;
        // The slope to the left of the end: at z = 1 that to the right is zero.
        let integral = (high - low) / 6.0 * (slope(0.0) + 4.0 * slope(0.5) + slope(1.0 - 1e-3));
        ((value(high) - value(low)) - integral).abs() / top.abs()
    };
    for i in 0..KERNEL_SAMPLES {
        let (mut low, mut high) = (i as f64 / KERNEL_SAMPLES as f64, (i + 1) as f64 / KERNEL_SAMPLES as f64);
        let mut found = off(low, high);
        // Errors by kinks and by coarse rules halve with the interval.
        while found > SLOPE_TOLERANCE && high - low > SHORTEST {
            let middle = 0.5 * (low + high);
            let (left, right) = (off(low, middle), off(middle, high));
            (found, low, high) = if left > right { (left, low, middle) } else { (right, middle, high) };
        }
        steady.see(found, || format!("z = {high}"));
    }
    steady
}

/// [`Kernel::fill`] against the kernel point by point, for lists of several lengths.
fn filled(kernel: &dyn Kernel, top: f64) -> Finding {
    let mut same = Finding::new("fill gives what value_and_slope gives", SAME);
    let distances: Vec<f64> = list_of(KERNEL_SAMPLES, |i| 1.05 * (i as f64 + 0.377) / KERNEL_SAMPLES as f64);
    for count in [1, 3, 8, 13, KERNEL_SAMPLES] {
        // What is not written stays a NaN and shows.
        let (mut values, mut slopes) = (vec![f64::NAN; count], vec![f64::NAN; count]);
        let z = &distances[KERNEL_SAMPLES - count..];
        kernel.fill(z, &mut values, &mut slopes);
        for ((&z, filled), slope_filled) in z.iter().zip(values).zip(slopes) {
            let (value, slope) = kernel.value_and_slope(z);
            let error = (filled - value).abs() + (slope_filled - slope).abs();
            same.see(error / top.abs(), || format!("z = {z}, one of {count}"));
        }
    }
    same
}

/// How far a number is from being positive; NaN stays NaN.
fn not_positive(value: f64) -> f64 {
    if value > 0.0 { 0.0 } else { (-value).max(f64::MIN_POSITIVE) + 0.0 * value }
}

/// Checks the contract of [`Basis`]: the gradients are derivatives, the span holds the constant, the
/// functions are independent, the span does not depend on shift and scale of its argument, and
/// [`Basis::fill_many`], which shape functions call, gives what [`Basis::fill`] gives.
///
/// ```
/// use rkpm::{basis::{Basis, Polynomial}, geometry::Point};
/// assert!(rkpm::check::basis(&Polynomial::<2>::new(2)).holds());
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
        let mut constant = Finding::new("the span holds the constant", 0.0);
        constant.see(f64::INFINITY, || "a basis without functions".into());
        return Report::default().with([constant]);
    }
    if terms > TERM_LIMIT {
        return Report::default().unchecked(format!("all laws: {terms} terms, at most {TERM_LIMIT} are checked"));
    }
    let mut random = fastrand::Rng::with_seed(1);
    let samples: Vec<Point<D>> = list_of(4 * terms + 20, |_| Point::from_fn(|_, _| signed(&mut random)));
    let fill = |x: &Point<D>| {
        let (mut h, mut dh) = (vec![0.0; terms], vec![Point::<D>::zeros(); terms]);
        basis.fill(x, &mut h, &mut dh);
        (h, dh)
    };

    let mut slopes = Finding::new("the gradients are derivatives of the functions", SLOPE_TOLERANCE);
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

    let same = filled_many(basis, &samples);
    // All functions at all samples, each scaled to size 1.
    let mut matrix = DMatrix::zeros(samples.len(), terms);
    for (row, x) in samples.iter().enumerate() {
        matrix.row_mut(row).copy_from_slice(&fill(x).0);
    }
    let mut independent = Finding::new("the functions are independent (condition number)", DEPENDENT);
    for k in 0..terms {
        let norm = matrix.column(k).norm();
        if norm > 0.0 {
            matrix.column_mut(k).scale_mut(1.0 / norm);
        }
    }
    let mut constant = Finding::new("the span holds the constant", 1e-9);
    let mut closed = Finding::new("the span does not depend on shift and scale", 1e-9);
    if matrix.iter().any(|v| !v.is_finite()) {
        independent.see(f64::NAN, || "a function is not finite between -1 and 1".into());
        return Report::default().with([slopes, same, independent]);
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
    let shift = point_of::<D>(|i| 0.3 - 0.2 * i as f64);
    let shifted: Vec<Vec<f64>> = samples.mapped(|x| fill(&(x * 0.7 + shift)).0);
    for k in 0..terms {
        let values = DVector::from_fn(samples.len(), |row, _| shifted[row][k]);
        closed.see(distance(values), || format!("function {k} at 0.7 xi + {:?}", shift.as_slice()));
    }
    Report::default().with([slopes, same, constant, independent, closed])
}

/// [`Basis::fill_many`] against the basis point by point, with slopes and without, for several numbers of points.
fn filled_many<const D: usize>(basis: &dyn Basis<D>, samples: &[Point<D>]) -> Finding {
    let mut same = Finding::new("fill_many gives what fill gives", SAME);
    let terms = basis.len();
    let (mut h, mut dh) = (vec![0.0; terms], vec![Point::<D>::zeros(); terms]);
    for count in [1, 3, 8, samples.len()] {
        let points = &samples[..count];
        let x: Vec<f64> = (0..D).flat_map(|k| points.iter().map(move |x| x[k])).collect();
        for slopes in [false, true] {
            // What is not written stays a NaN and shows.
            let mut values = vec![f64::NAN; terms * count];
            let mut gradients = vec![f64::NAN; if slopes { terms * D * count } else { 0 }];
            basis.fill_many(count, &x, &mut values, &mut gradients);
            for (a, point) in points.iter().enumerate() {
                basis.fill(point, &mut h, &mut dh);
                for i in 0..terms {
                    let place = || format!("function {i}, xi = {:?}, one of {count}", point.as_slice());
                    same.see((values[i * count + a] - h[i]).abs() / (1.0 + h[i].abs()), place);
                    for k in (0..D).filter(|_| slopes) {
                        let error = (gradients[(i * D + k) * count + a] - dh[i][k]).abs();
                        same.see(error / (1.0 + dh[i].norm()), place);
                    }
                }
            }
        }
    }
    same
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::basis::Polynomial;
    use crate::geometry::Vec2;
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
    fn each_broken_law_of_a_kernel_is_named() {
        let inside = |z: f64, pair: (f64, f64)| if z < 1.0 { pair } else { (0.0, 0.0) };
        let hat = From(move |z: f64| inside(z, (1.0 - z, -1.0)));
        assert_eq!(broken(&kernel(&hat)), ["the slope is zero at z = 0"]);
        let wrong = From(move |z: f64| inside(z, ((1.0 - z * z).powi(2), -2.0 * z * (1.0 - z * z))));
        assert_eq!(broken(&kernel(&wrong)), ["the slope is the derivative of the value"]);
        let negative = From(move |z: f64| inside(z, (1.0 - 3.0 * z * z + 2.0 * z.powi(4), -6.0 * z + 8.0 * z.powi(3))));
        assert_eq!(broken(&kernel(&negative)), ["the value is positive inside the support"]);
        let nan = From(|_: f64| (f64::NAN, f64::NAN));
        assert_eq!(broken(&kernel(&nan)).len(), 7);
        // Jumps between samples, at them and at the end of the support; kinks are no jumps.
        for at in [0.3, 0.3003, 0.5, 2.0 / 3.0] {
            let jump = From(move |z: f64| {
                let (q, part) = (1.0 - z * z, if z < at { 1.0 } else { 0.5 });
                inside(z, (part * q.powi(3), -6.0 * part * z * q * q))
            });
            assert_eq!(broken(&kernel(&jump)), ["the value has no jumps"], "{at}");
        }
        let cut = From(move |z: f64| inside(z, ((-4.0 * z * z).exp(), -8.0 * z * (-4.0 * z * z).exp())));
        assert_eq!(broken(&kernel(&cut)), ["the value has no jumps"]);
        let plateau =
            From(move |z: f64| inside(z, if z < 0.3007 { (1.0, 0.0) } else { ((1.0 - z) / 0.6993, -1.0 / 0.6993) }));
        assert!(kernel(&plateau).holds(), "{}", kernel(&plateau));
        let rising = From(move |z: f64| inside(z, ((1.0 - z * z) * (1.0 + 3.0 * z * z), 4.0 * z - 12.0 * z.powi(3))));
        assert_eq!(broken(&kernel(&rising)), ["the value is largest at z = 0"]);

        type Fill = fn(&[f64], &mut [f64], &mut [f64]);
        /// A kernel with a fill of its own.
        struct Filled(Fill);
        impl Kernel for Filled {
            fn value_and_slope(&self, z: f64) -> (f64, f64) {
                CubicSpline.value_and_slope(z)
            }
            fn fill(&self, z: &[f64], values: &mut [f64], slopes: &mut [f64]) {
                (self.0)(z, values, slopes);
            }
        }
        assert!(kernel(&Filled(|z, values, slopes| CubicSpline.fill(z, values, slopes))).holds());
        let wrong: [Fill; 3] = [
            |_, _, _| {},
            |z, values, slopes| {
                CubicSpline.fill(z, values, slopes);
                slopes.iter_mut().for_each(|slope| *slope *= 1.01);
            },
            // Whole groups of four alone.
            |z, values, slopes| {
                let n = z.len() / 4 * 4;
                CubicSpline.fill(&z[..n], &mut values[..n], &mut slopes[..n]);
            },
        ];
        for fill in wrong {
            assert_eq!(broken(&kernel(&Filled(fill))), ["fill gives what value_and_slope gives"]);
        }
    }

    #[test]
    fn each_broken_law_of_a_basis_is_named() {
        /// A basis with a fill of its own for many points.
        struct Many(f64, bool);
        impl Basis<2> for Many {
            fn len(&self) -> usize {
                3
            }
            fn fill(&self, x: &Vec2, h: &mut [f64], dh: &mut [Vec2]) {
                Polynomial::linear().fill(x, h, dh);
            }
            fn fill_many(&self, count: usize, x: &[f64], h: &mut [f64], dh: &mut [f64]) {
                Polynomial::<2>::linear().fill_many(count, x, h, if self.1 { dh } else { &mut [] });
                h.iter_mut().for_each(|h| *h *= self.0);
            }
        }
        assert!(basis(&Many(1.0, true)).holds());
        for many in [Many(1.01, true), Many(1.0, false)] {
            assert_eq!(broken(&basis(&many)), ["fill_many gives what fill gives"]);
        }

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
