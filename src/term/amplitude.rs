//! Amplitudes: how a load or a prescribed value follows the load factor.

use crate::error::BoundaryError;

/// The factor of a load as a function of the load factor $\lambda$.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Amplitude {
    /// $\lambda$ itself.
    #[default]
    Ramp,
    /// 1 from the start.
    Constant,
    /// Straight lines between (load factor, value) pairs, constant outside.
    Table(Vec<(f64, f64)>),
}

impl Amplitude {
    /// A table of (load factor, value) pairs.
    ///
    /// # Errors
    /// For fewer than two pairs, numbers that are not finite, or load factors that do not rise.
    pub fn table(pairs: Vec<(f64, f64)>) -> Result<Self, BoundaryError> {
        if pairs.len() < 2 {
            return Err(BoundaryError::Amplitude { what: "fewer than two pairs" });
        }
        if pairs.iter().any(|(l, v)| !l.is_finite() || !v.is_finite()) {
            return Err(BoundaryError::Amplitude { what: "a number is not finite" });
        }
        if pairs.windows(2).any(|w| w[1].0 <= w[0].0) {
            return Err(BoundaryError::Amplitude { what: "the load factors do not rise" });
        }
        Ok(Amplitude::Table(pairs))
    }

    /// Value and slope at a load factor; at a kink the slope to the left.
    pub fn evaluate(&self, load: f64) -> (f64, f64) {
        match self {
            Amplitude::Ramp => (load, 1.0),
            Amplitude::Constant => (1.0, 0.0),
            Amplitude::Table(pairs) => {
                let next = pairs.partition_point(|p| p.0 < load);
                if next == 0 {
                    (pairs.first().map_or(0.0, |p| p.1), 0.0)
                } else if next == pairs.len() {
                    (pairs[next - 1].1, 0.0)
                } else {
                    let (a, b) = (pairs[next - 1], pairs[next]);
                    let slope = (b.1 - a.1) / (b.0 - a.0);
                    (a.1 + slope * (load - a.0), slope)
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_interpolate_and_are_checked() {
        let table = Amplitude::table(vec![(0.0, 0.0), (1.0, 2.0), (3.0, 0.0)]).unwrap();
        assert_eq!(table.evaluate(0.5), (1.0, 2.0));
        assert_eq!(table.evaluate(2.0), (1.0, -1.0));
        assert_eq!(table.evaluate(9.0), (0.0, 0.0));
        assert!(Amplitude::table(vec![(0.0, 1.0)]).is_err());
        assert!(Amplitude::table(vec![(0.0, 1.0), (0.0, 2.0)]).is_err());
        assert!(Amplitude::table(vec![(0.0, 1.0), (1.0, f64::NAN)]).is_err());
    }
}
