//! Bases $H$ of the correction function (3.11), (3.29).

use crate::each::point_of;
use crate::geometry::Point;

/// The functions that the correction reproduces.
///
/// The argument is shifted and scaled, $\xi = (x - x_I)/L$ with $L$ a local dilation, so that the
/// moment matrix stays well conditioned far from the origin. The span must not depend on shift and
/// scale, as that of the polynomials up to an order does not.
///
/// ```
/// use rkpm::{basis::Basis, geometry::Point};
/// /// 1, x, y and xy.
/// struct Bilinear;
/// impl Basis<2> for Bilinear {
///     fn len(&self) -> usize { 4 }
///     fn fill(&self, x: &Point<2>, h: &mut [f64], dh: &mut [Point<2>]) {
///         h.copy_from_slice(&[1.0, x[0], x[1], x[0] * x[1]]);
///         dh.copy_from_slice(&[[0.0, 0.0].into(), [1.0, 0.0].into(), [0.0, 1.0].into(), [x[1], x[0]].into()]);
///     }
/// }
/// assert_eq!(Bilinear.len(), 4);
/// ```
pub trait Basis<const D: usize>: Send + Sync {
    /// Number of functions.
    fn len(&self) -> usize;

    /// Whether there is no function at all; a basis needs at least the constant.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes $H(\xi)$ and $\partial H/\partial\xi$; both slices have [`len`](Basis::len) entries.
    fn fill(&self, x: &Point<D>, h: &mut [f64], dh: &mut [Point<D>]);

    /// Writes $H$ at `count` points and, where `dh` is not empty, $\partial H/\partial\xi$, the points
    /// running fastest: coordinate $k$ of point $a$ is `x[k * count + a]`, $H_i$ goes to `h[i * count + a]`
    /// and its slope along axis $k$ to `dh[(i * D + k) * count + a]`.
    ///
    /// Nothing needs to be written for it; a basis that does is quicker.
    fn fill_many(&self, count: usize, x: &[f64], h: &mut [f64], dh: &mut [f64]) {
        // Terms of one point; bases of more terms than this are not met in practice.
        let (mut few, mut few_slopes) = ([0.0; 32], [Point::<D>::zeros(); 32]);
        let (mut more, mut more_slopes) = (Vec::new(), Vec::new());
        let terms = self.len();
        let (values, slopes) = if terms <= few.len() {
            (&mut few[..terms], &mut few_slopes[..terms])
        } else {
            more.resize(terms, 0.0);
            more_slopes.resize(terms, Point::zeros());
            (&mut more[..], &mut more_slopes[..])
        };
        for a in 0..count {
            self.fill(&point_of(|k| x[k * count + a]), values, slopes);
            for i in 0..terms {
                h[i * count + a] = values[i];
                if !dh.is_empty() {
                    for k in 0..D {
                        dh[(i * D + k) * count + a] = slopes[i][k];
                    }
                }
            }
        }
    }
}

impl<const D: usize, B: Basis<D> + ?Sized> Basis<D> for std::sync::Arc<B> {
    fn len(&self) -> usize {
        (**self).len()
    }

    fn is_empty(&self) -> bool {
        (**self).is_empty()
    }

    fn fill(&self, x: &Point<D>, h: &mut [f64], dh: &mut [Point<D>]) {
        (**self).fill(x, h, dh);
    }

    fn fill_many(&self, count: usize, x: &[f64], h: &mut [f64], dh: &mut [f64]) {
        (**self).fill_many(count, x, h, dh);
    }
}

/// All monomials $\xi^\alpha$ with $|\alpha| \le N$ (3.29), (3.30), by rising order.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomial<const D: usize> {
    exponents: Vec<[u8; D]>,
    /// Each monomial but the first is an earlier one times a coordinate: (place of the earlier, axis).
    factors: Vec<(usize, usize)>,
}

impl<const D: usize> Polynomial<D> {
    /// Monomials up to the given order; 0 gives the Shepard functions.
    pub fn new(order: u8) -> Self {
        let mut exponents = Vec::new();
        let mut factors = vec![(0, 0)];
        let mut last = 0..0;
        for total in 0..=order {
            let start = exponents.len();
            push_exponents(&mut exponents, [0; D], 0, total);
            let factor = |alpha: &[u8; D]| {
                let axis = alpha.iter().position(|&power| power > 0).unwrap_or(0);
                let mut earlier = *alpha;
                earlier[axis] = earlier[axis].saturating_sub(1);
                // Those of one order fall in lexicographic order.
                (last.start + exponents[last.clone()].partition_point(|other| *other > earlier), axis)
            };
            if total > 0 {
                factors.extend(exponents[start..].iter().map(factor));
            }
            last = start..exponents.len();
        }
        Polynomial { exponents, factors }
    }

    /// $1, x_1, \dots, x_D$: what the paper uses throughout §6.
    pub fn linear() -> Self {
        Polynomial::new(1)
    }

    /// The multi-indices $\alpha$.
    pub fn exponents(&self) -> &[[u8; D]] {
        &self.exponents
    }
}

impl<const D: usize> Default for Polynomial<D> {
    fn default() -> Self {
        Polynomial::linear()
    }
}

/// Appends all multi-indices of one total order, the first axis highest first.
fn push_exponents<const D: usize>(out: &mut Vec<[u8; D]>, current: [u8; D], axis: usize, left: u8) {
    let mut next = current;
    if axis + 1 >= D {
        if D > 0 {
            next[D - 1] = left;
            out.push(next);
        }
        return;
    }
    for power in (0..=left).rev() {
        next[axis] = power;
        push_exponents(out, next, axis + 1, left - power);
    }
}

impl<const D: usize> Basis<D> for Polynomial<D> {
    fn len(&self) -> usize {
        self.exponents.len()
    }

    #[inline]
    fn fill(&self, x: &Point<D>, h: &mut [f64], dh: &mut [Point<D>]) {
        for ((alpha, h), dh) in self.exponents.iter().zip(h).zip(dh) {
            let mut value = 1.0;
            for axis in 0..D {
                value *= x[axis].powi(alpha[axis] as i32);
            }
            *h = value;
            for k in 0..D {
                let mut slope = if alpha[k] == 0 { 0.0 } else { alpha[k] as f64 };
                for axis in 0..D {
                    let power = alpha[axis] as i32 - i32::from(axis == k);
                    if power > 0 {
                        slope *= x[axis].powi(power);
                    }
                }
                dh[k] = slope;
            }
        }
    }

    #[inline(always)]
    fn fill_many(&self, count: usize, x: &[f64], h: &mut [f64], dh: &mut [f64]) {
        h[..count].fill(1.0);
        for (i, &(earlier, axis)) in self.factors.iter().enumerate().skip(1) {
            let (before, here) = h.split_at_mut(i * count);
            let (earlier, along) = (&before[earlier * count..][..count], &x[axis * count..][..count]);
            for ((h, earlier), x) in here[..count].iter_mut().zip(earlier).zip(along) {
                *h = earlier * x;
            }
        }
        if dh.is_empty() {
            return;
        }
        dh[..D * count].fill(0.0);
        for (i, &(earlier, axis)) in self.factors.iter().enumerate().skip(1) {
            let along = &x[axis * count..][..count];
            for k in 0..D {
                let (before, here) = dh.split_at_mut((i * D + k) * count);
                let slopes = &before[(earlier * D + k) * count..][..count];
                for ((slope, earlier), x) in here[..count].iter_mut().zip(slopes).zip(along) {
                    *slope = earlier * x;
                }
                if k == axis {
                    for (slope, earlier) in here[..count].iter_mut().zip(&h[earlier * count..][..count]) {
                        *slope += earlier;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Vec2, Vec3};
    use approx::assert_abs_diff_eq;

    #[test]
    fn monomials_by_rising_order() {
        assert_eq!(Polynomial::<2>::new(2).exponents(), &[[0, 0], [1, 0], [0, 1], [2, 0], [1, 1], [0, 2]]);
        assert_eq!(Polynomial::<3>::new(3).len(), 20);
        assert_eq!(Polynomial::<1>::new(4).len(), 5);
        let (mut h, mut dh) = ([0.0; 6], [Vec2::zeros(); 6]);
        Polynomial::<2>::new(2).fill(&Vec2::new(2.0, 3.0), &mut h, &mut dh);
        assert_eq!(h, [1.0, 2.0, 3.0, 4.0, 6.0, 9.0]);
        assert_eq!(dh[4], Vec2::new(3.0, 2.0));
        assert_eq!(dh[5], Vec2::new(0.0, 6.0));
    }

    #[test]
    fn many_points_at_once_are_the_same_points() {
        /// The polynomials without their own way for many points.
        struct OneByOne(Polynomial<3>);
        impl Basis<3> for OneByOne {
            fn len(&self) -> usize {
                self.0.len()
            }
            fn fill(&self, x: &Vec3, h: &mut [f64], dh: &mut [Vec3]) {
                self.0.fill(x, h, dh);
            }
        }
        // Order 4 has 35 terms: more than the default keeps on the stack.
        for order in 0..=4 {
            let basis = Polynomial::<3>::new(order);
            let (terms, count) = (basis.len(), 5);
            let x: Vec<f64> = (0..3 * count).map(|i| (i as f64).sin()).collect();
            let (mut h, mut dh) = (vec![0.0; terms * count], vec![0.0; 3 * terms * count]);
            let (mut h_one, mut dh_one) = (h.clone(), dh.clone());
            basis.fill_many(count, &x, &mut h, &mut dh);
            OneByOne(basis).fill_many(count, &x, &mut h_one, &mut dh_one);
            for (a, b) in h.iter().chain(&dh).zip(h_one.iter().chain(&dh_one)) {
                assert_abs_diff_eq!(a, b, epsilon = 1e-14);
            }
        }
    }
}
