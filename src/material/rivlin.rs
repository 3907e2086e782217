//! The polynomial distortional energy (2.9).

use super::constants::{check, finite, positive};
use super::{Distortion, InvariantEnergy};
use crate::error::MaterialError;

/// The polynomial (2.9) in the reduced invariants,
/// $\bar W = \sum_{m+n\ge1} A_{mn}(\bar I_1-3)^m(\bar I_2-3)^n$, constants in \[stress\].
///
/// ```
/// use rkpm::material::{InvariantEnergy, RivlinPolynomial};
///
/// let energy = RivlinPolynomial::new([((1, 0), 0.3), ((0, 1), 0.05), ((1, 1), 0.002)])?;
/// assert!((energy.evaluate(4.0, 5.0).energy - (0.3 + 2.0 * 0.05 + 2.0 * 0.002)).abs() < 1e-15);
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RivlinPolynomial {
    /// A_mn at `n * width + m`: dense, so that Horner's rule needs no powers.
    coefficients: Vec<f64>,
    /// Largest m, plus one.
    width: usize,
}

impl RivlinPolynomial {
    /// The largest exponent accepted; fits to tests of rubber go up to 3, and a slip of the pen must
    /// not allocate a table of gigabytes.
    pub(crate) const LARGEST_EXPONENT: u32 = 12;

    /// The polynomial with terms $((m, n), A_{mn})$; terms with the same exponents add up.
    ///
    /// Constants may have either sign: fits to tests have negative ones too.
    ///
    /// # Errors
    /// [`MaterialError::Invalid`] for a constant that isn't finite, for $m = n = 0$ and for exponents
    /// above 12; [`MaterialError::Empty`] where no constant differs from zero.
    pub fn new(terms: impl IntoIterator<Item = ((u32, u32), f64)>) -> Result<Self, MaterialError> {
        let terms: Vec<_> = terms.into_iter().collect();
        let name = |(m, n): (u32, u32)| format!("A_{m}{n}");
        for &(exponents, value) in &terms {
            finite(name(exponents), value)?;
            check(name(exponents), value, exponents != (0, 0), "exponents need m + n >= 1 (2.9)")?;
            let small = exponents.0.max(exponents.1) <= Self::LARGEST_EXPONENT;
            check(name(exponents), value, small, "exponents up to 12 are accepted")?;
        }
        let width = 1 + terms.iter().map(|t| t.0.0).max().unwrap_or(0) as usize;
        let height = 1 + terms.iter().map(|t| t.0.1).max().unwrap_or(0) as usize;
        let mut coefficients = vec![0.0; width * height];
        for &((m, n), value) in &terms {
            let sum = &mut coefficients[n as usize * width + m as usize];
            *sum += value;
            check(name((m, n)), *sum, sum.is_finite(), "terms given twice must have a finite sum")?;
        }
        if coefficients.iter().all(|&a| a == 0.0) {
            return Err(MaterialError::Empty);
        }
        Ok(Self { coefficients, width })
    }

    /// The neo-Hookean energy $A_{10}(\bar I_1-3)$; shear modulus $2A_{10}$.
    ///
    /// # Errors
    /// [`MaterialError::Invalid`] unless $A_{10}$ is finite and above zero.
    pub(crate) fn neo_hookean(a10: f64) -> Result<Self, MaterialError> {
        positive("A_10", a10)?;
        Self::new([((1, 0), a10)])
    }

    /// The Mooney–Rivlin energy $A_{10}(\bar I_1-3) + A_{01}(\bar I_2-3)$; shear modulus $2(A_{10}+A_{01})$.
    ///
    /// # Errors
    /// [`MaterialError::Invalid`] unless both are finite and their sum is above zero.
    pub(crate) fn mooney_rivlin(a10: f64, a01: f64) -> Result<Self, MaterialError> {
        // The terms first: they name the constant that isn't finite, which the sum could not.
        let polynomial = Self::new([((1, 0), a10), ((0, 1), a01)])?;
        positive("A_10 + A_01", a10 + a01)?;
        Ok(polynomial)
    }

    /// The Yeoh energy $\sum_{m=1}^3 A_{m0}(\bar I_1-3)^m$, the paper's with $(0.373, -0.031, 0.005)$ MPa.
    ///
    /// # Errors
    /// [`MaterialError::Invalid`] unless all are finite and $A_{10}$ is above zero.
    pub(crate) fn yeoh(a10: f64, a20: f64, a30: f64) -> Result<Self, MaterialError> {
        positive("A_10", a10)?;
        Self::new([((1, 0), a10), ((2, 0), a20), ((3, 0), a30)])
    }

    /// The terms $((m, n), A_{mn})$ that differ from zero.
    pub(crate) fn terms(&self) -> impl Iterator<Item = ((u32, u32), f64)> + '_ {
        self.coefficients
            .iter()
            .enumerate()
            .filter(|(_, a)| **a != 0.0)
            // Both exponents are at most 12.
            .map(|(at, &a)| (((at % self.width) as u32, (at / self.width) as u32), a))
    }
}

impl InvariantEnergy for RivlinPolynomial {
    fn evaluate(&self, i1: f64, i2: f64) -> Distortion {
        self.evaluate_excess(i1 - 3.0, i2 - 3.0)
    }

    fn evaluate_excess(&self, x: f64, y: f64) -> Distortion {
        // Horner's rule for value and derivatives: in x along a row of equal n, in y across rows.
        // `second` and `w22` collect half of the second derivatives.
        let mut sum = Distortion::default();
        for row in self.coefficients.chunks_exact(self.width).rev() {
            let (mut value, mut first, mut second) = (0.0, 0.0, 0.0);
            for &a in row.iter().rev() {
                second = second * x + first;
                first = first * x + value;
                value = value * x + a;
            }
            sum.w22 = sum.w22 * y + sum.w2;
            sum.w2 = sum.w2 * y + sum.energy;
            sum.energy = sum.energy * y + value;
            sum.w12 = sum.w12 * y + sum.w1;
            sum.w1 = sum.w1 * y + first;
            sum.w11 = sum.w11 * y + 2.0 * second;
        }
        sum.w22 *= 2.0;
        sum
    }
}
