//! The step limiter: no step passes through an inverted state.

use crate::geometry::Mat3;
use crate::tensor::cofactor;

/// Part of the determinant that must be left along a step.
const REMAINING: f64 = 0.2;

/// The largest $s \le 1$ for which $\theta + s\\,\delta\theta \ge 0.2\\,\theta$: the same for a determinant that is an iterate.
#[inline]
pub(crate) fn largest_part(theta: f64, step: f64) -> f64 {
    let room = (1.0 - REMAINING) * theta;
    if -step > room { room / -step } else { 1.0 }
}

/// The largest $s \le 1$ for which $\min_{0 \le t \le s} \det(F + t\\,\delta F) \ge 0.2 \det F$.
///
/// Testing the end alone lets a step pass through inversion and land on a state with two axes flipped
/// and $J > 0$. The determinant is a cubic in $t$. Returns 0 where $\det F \le 0$ or a number is not finite.
#[inline]
pub(crate) fn largest_step(f: &Mat3, step: &Mat3) -> f64 {
    let now = f.determinant();
    let linear = cofactor(f).dot(step);
    let quadratic = f.dot(&cofactor(step));
    let cubic = step.determinant();
    if !(now > 0.0 && (linear + quadratic + cubic).is_finite()) {
        return 0.0;
    }
    let start = (1.0 - REMAINING) * now;
    // Most points pass this bound and need no roots.
    if linear.min(0.0) + quadratic.min(0.0) + cubic.min(0.0) > -start {
        return 1.0;
    }
    let value = |t: f64| start + t * (linear + t * (quadratic + t * cubic));
    // The cubic is monotone between the zeros of its slope: look for the first sign change.
    let mut ends = [1.0; 3];
    let (a, b, c) = (3.0 * cubic, 2.0 * quadratic, linear);
    let discriminant = b * b - 4.0 * a * c;
    if discriminant > 0.0 {
        let q = -0.5 * (b + discriminant.sqrt().copysign(b));
        for (end, root) in ends.iter_mut().zip([q / a, c / q]) {
            if root > 0.0 && root < 1.0 {
                *end = root;
            }
        }
    }
    ends.sort_unstable_by(f64::total_cmp);
    let mut low = 0.0;
    for end in ends {
        if value(end) < 0.0 {
            let mut high = end;
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if value(middle) < 0.0 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            return low;
        }
        low = end;
    }
    1.0
}

/// The largest $s \le 1$ for which each hoop stretch $1 + u_1/X_1$ keeps a fifth of itself along the step: a point
/// beyond the axis of revolution may well have $J > 0$, the radial stretch being negative too. Returns 0 where one is
/// not positive.
#[inline]
pub(super) fn largest_step_of_hoops(f: &Mat3, step: &Mat3, hoops: &[usize]) -> f64 {
    let mut bound: f64 = 1.0;
    for &hoop in hoops {
        let (now, change) = (f[(hoop, hoop)], step[(hoop, hoop)]);
        if !(now > 0.0) {
            return 0.0;
        }
        if now + change < REMAINING * now {
            bound = bound.min((REMAINING - 1.0) * now / change);
        }
    }
    bound
}

/// $\det F$, with a negative sign where a hoop stretch is not positive: beyond the axis of revolution.
pub(super) fn jacobian(f: &Mat3, hoops: &[usize]) -> f64 {
    let j = f.determinant();
    if hoops.iter().any(|&hoop| f[(hoop, hoop)] <= 0.0) { -j.abs() } else { j }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;
    use approx::assert_abs_diff_eq;

    #[test]
    fn steps_stop_before_inversion_even_where_the_end_is_sound() {
        let identity = Mat3::identity();
        // Two axes flip: J = (1 − 2t)² is 1 at both ends and 0 in between.
        let flip = Mat3::from_diagonal(&Vec3::new(-2.0, -2.0, 0.0));
        let s = largest_step(&identity, &flip);
        assert_abs_diff_eq!((1.0 - 2.0 * s).powi(2), 0.2, epsilon = 1e-12);
        assert_eq!(largest_step(&identity, &(identity * 3.0)), 1.0);
        assert_eq!(largest_step(&identity, &Mat3::zeros()), 1.0);
        assert_eq!(largest_step(&-identity, &Mat3::zeros()), 0.0);
        assert_eq!(largest_step(&identity, &Mat3::repeat(f64::NAN)), 0.0);
    }

    #[test]
    fn no_step_leads_beyond_the_axis() {
        let diagonal = |r, hoop| Mat3::from_diagonal(&Vec3::new(r, hoop, 1.0));
        let (f, step) = (diagonal(2.0, 0.5), diagonal(0.0, -1.0) - diagonal(0.0, 0.0));
        assert_eq!(largest_step_of_hoops(&f, &step, &[]), 1.0);
        assert_abs_diff_eq!(largest_step_of_hoops(&f, &step, &[1]), 0.4, epsilon = 1e-15);
        assert_eq!(largest_step_of_hoops(&f, &diagonal(0.0, 3.0), &[1]), 1.0);
        assert_eq!(largest_step_of_hoops(&f, &diagonal(0.0, -0.3), &[1]), 1.0);
        // Both stretches negative: J > 0, and yet beyond the axis.
        let beyond = diagonal(-2.0, -0.5);
        assert_eq!(largest_step_of_hoops(&beyond, &step, &[1]), 0.0);
        assert_eq!((jacobian(&beyond, &[1]), jacobian(&beyond, &[])), (-1.0, 1.0));
        assert_eq!(jacobian(&f, &[1]), 1.0);
    }

    #[test]
    fn the_bound_is_the_first_crossing() {
        let mut random = fastrand::Rng::with_seed(11);
        for _ in 0..2000 {
            let f = Mat3::identity() + Mat3::from_fn(|_, _| 0.4 * (random.f64() - 0.5));
            let step = Mat3::from_fn(|_, _| 4.0 * (random.f64() - 0.5));
            let s = largest_step(&f, &step);
            let floor = 0.2 * f.determinant();
            for i in 0..=200 {
                let t = s * i as f64 / 200.0;
                assert!((f + step * t).determinant() >= floor - 1e-9);
            }
            if s < 1.0 {
                assert!((f + step * (s + 1e-6)).determinant() < floor + 1e-4);
            }
        }
    }
}
