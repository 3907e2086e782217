//! The polynomial (Rivlin) family (2.9).

use crate::error::MaterialError;

use super::invariants::{Distortion, InvariantEnergy};

/// $\bar W = \sum_{m+n\ge1} A_{mn}(\bar I_1 - 3)^m(\bar I_2 - 3)^n$ (2.9).
#[derive(Debug, Clone, PartialEq)]
pub struct RivlinPolynomial {
    terms: Vec<(i32, i32, f64)>,
}

/// Exponents above this are refused: no rubber is fitted with them and powers would overflow.
const LARGEST_EXPONENT: u32 = 12;

impl RivlinPolynomial {
    /// Terms $((m, n), A_{mn})$ \[stress\].
    ///
    /// # Errors
    /// For no term, $m + n = 0$, exponents above 12, or constants that are not finite.
    pub fn new(terms: impl IntoIterator<Item = ((u32, u32), f64)>) -> Result<Self, MaterialError> {
        let mut checked = Vec::new();
        for ((m, n), value) in terms {
            let name = || format!("A_{m}{n}");
            if m.saturating_add(n) == 0 {
                return Err(MaterialError::Constant {
                    name: name(),
                    value,
                    needed: "the constant term has m + n >= 1",
                });
            }
            if m > LARGEST_EXPONENT || n > LARGEST_EXPONENT {
                return Err(MaterialError::Constant { name: name(), value, needed: "exponents up to 12 are accepted" });
            }
            if !value.is_finite() {
                return Err(MaterialError::Constant { name: name(), value, needed: "give a finite number" });
            }
            checked.push((m as i32, n as i32, value));
        }
        if checked.is_empty() {
            return Err(MaterialError::Empty);
        }
        Ok(RivlinPolynomial { terms: checked })
    }

    /// The terms $((m, n), A_{mn})$.
    pub fn terms(&self) -> impl Iterator<Item = ((u32, u32), f64)> + '_ {
        self.terms.iter().map(|&(m, n, a)| ((m as u32, n as u32), a))
    }
}

impl InvariantEnergy for RivlinPolynomial {
    #[inline]
    fn evaluate(&self, i1: f64, i2: f64) -> Distortion {
        let (x, y) = (i1 - 3.0, i2 - 3.0);
        let mut d = Distortion::default();
        // d/dx of x^m without 0·x^(−1).
        let power = |x: f64, m: i32, order: i32| -> f64 {
            match (order, m) {
                (0, _) => x.powi(m),
                (1, 0) | (2, 0 | 1) => 0.0,
                (1, _) => f64::from(m) * x.powi(m - 1),
                _ => f64::from(m * (m - 1)) * x.powi(m - 2),
            }
        };
        for &(m, n, a) in &self.terms {
            d.energy += a * power(x, m, 0) * power(y, n, 0);
            d.w1 += a * power(x, m, 1) * power(y, n, 0);
            d.w2 += a * power(x, m, 0) * power(y, n, 1);
            d.w11 += a * power(x, m, 2) * power(y, n, 0);
            d.w12 += a * power(x, m, 1) * power(y, n, 1);
            d.w22 += a * power(x, m, 0) * power(y, n, 2);
        }
        d
    }
}
