//! Functions of a few coordinates with their first and second derivatives.

use std::ops::{Add, Mul, Sub};

use nalgebra::{SMatrix, SVector};

/// Value, gradient and Hessian over `N` coordinates; the Hessian over the first `M`, so that there is none with zero.
#[derive(Debug, Clone, Copy)]
pub(super) struct Jet<const N: usize, const M: usize = N> {
    pub value: f64,
    pub slope: SVector<f64, N>,
    pub curve: SMatrix<f64, M, M>,
}

impl<const N: usize, const M: usize> Jet<N, M> {
    pub(crate) fn constant(value: f64) -> Self {
        Jet { value, slope: SVector::zeros(), curve: SMatrix::zeros() }
    }

    /// The coordinate of an index.
    pub(crate) fn variable(value: f64, index: usize) -> Self {
        let mut jet = Jet::constant(value);
        jet.slope[index] = 1.0;
        jet
    }

    /// A function of this one with its value and first two derivatives.
    fn chain(self, value: f64, first: f64, second: f64) -> Self {
        let mut curve = self.curve * first;
        for j in 0..M {
            (0..M).for_each(|i| curve[(i, j)] += self.slope[i] * self.slope[j] * second);
        }
        Jet { value, slope: self.slope * first, curve }
    }

    pub(crate) fn reciprocal(self) -> Self {
        let inverse = 1.0 / self.value;
        self.chain(inverse, -inverse * inverse, 2.0 * inverse.powi(3))
    }

    pub(crate) fn root(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root, -0.25 / (root * self.value))
    }
}

impl<const N: usize, const M: usize> Add for Jet<N, M> {
    type Output = Jet<N, M>;
    fn add(self, other: Jet<N, M>) -> Jet<N, M> {
        Jet { value: self.value + other.value, slope: self.slope + other.slope, curve: self.curve + other.curve }
    }
}

impl<const N: usize, const M: usize> Sub for Jet<N, M> {
    type Output = Jet<N, M>;
    fn sub(self, other: Jet<N, M>) -> Jet<N, M> {
        Jet { value: self.value - other.value, slope: self.slope - other.slope, curve: self.curve - other.curve }
    }
}

impl<const N: usize, const M: usize> Mul<f64> for Jet<N, M> {
    type Output = Jet<N, M>;
    fn mul(self, by: f64) -> Jet<N, M> {
        Jet { value: self.value * by, slope: self.slope * by, curve: self.curve * by }
    }
}

impl<const N: usize, const M: usize> Mul for Jet<N, M> {
    type Output = Jet<N, M>;
    fn mul(self, other: Jet<N, M>) -> Jet<N, M> {
        let (slope, mut curve) = (self.slope * other.value + other.slope * self.value, self.curve);
        for j in 0..M {
            for i in 0..M {
                curve[(i, j)] = curve[(i, j)] * other.value
                    + other.curve[(i, j)] * self.value
                    + (self.slope[i] * other.slope[j] + other.slope[i] * self.slope[j]);
            }
        }
        Jet { value: self.value * other.value, slope, curve }
    }
}
