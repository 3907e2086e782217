//! Amplitudes: how a load or a prescribed value follows the load factor.

use std::fmt;
use std::sync::Arc;

use crate::each::Each;
use crate::error::{BoundaryError, Invalid, SolveError};

/// The factor of a load as a function of the load factor $\lambda$.
#[derive(Clone, Default)]
pub enum Amplitude {
    /// $\lambda$ itself.
    #[default]
    Ramp,
    /// 1 from the start.
    Constant,
    /// Straight lines between (load factor, value) pairs, constant outside.
    ///
    /// The argument is the load factor, not a time: runs go from 0 to 1, and what a table says beyond is never seen.
    /// Divide seconds by the duration. Steps of the load stop at the break points inside, steps along a deflection or an arc pass
    /// them.
    Table(Vec<(f64, f64)>),
    /// Any smooth function of $\lambda$; its slope is taken by central differences, on one side at the ends of the run.
    Function(Arc<dyn Fn(f64) -> f64 + Send + Sync>),
}

/// Half the interval of the central difference: where rounding and truncation of a smooth function meet.
const DIFFERENCE: f64 = 1e-5;

impl PartialEq for Amplitude {
    /// Functions are equal where they are the same one.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Amplitude::Ramp, Amplitude::Ramp) | (Amplitude::Constant, Amplitude::Constant) => true,
            (Amplitude::Table(a), Amplitude::Table(b)) => a == b,
            (Amplitude::Function(a), Amplitude::Function(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }
}

impl fmt::Debug for Amplitude {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Amplitude::Ramp => write!(f, "Ramp"),
            Amplitude::Constant => write!(f, "Constant"),
            Amplitude::Table(pairs) => f.debug_tuple("Table").field(pairs).finish(),
            Amplitude::Function(_) => write!(f, "Function(..)"),
        }
    }
}

impl Amplitude {
    /// A table of (load factor, value) pairs.
    ///
    /// # Errors
    /// For fewer than two pairs, numbers that are not finite, or load factors that do not rise.
    pub fn table(pairs: Vec<(f64, f64)>) -> Result<Self, BoundaryError> {
        let table = Amplitude::Table(pairs);
        table.validate(|| "a table".into())?;
        Ok(table)
    }

    /// Refuses tables that were put together without [`table`](Amplitude::table)'s check.
    ///
    /// # Errors
    /// As [`table`](Amplitude::table).
    pub(crate) fn validate(&self, of: impl FnOnce() -> String) -> Result<(), BoundaryError> {
        match self.fault() {
            Some((what, _)) => Err(BoundaryError::Amplitude { of: of(), what }),
            None => Ok(()),
        }
    }

    /// The same for integrands.
    ///
    /// # Errors
    /// As [`table`](Amplitude::table).
    pub(crate) fn validate_of(&self, load: &str) -> Result<(), SolveError> {
        let Some((what, value)) = self.fault() else { return Ok(()) };
        let needed = "give at least two (load factor, value) pairs with growing, finite load factors";
        Err(Invalid::new(format!("amplitude table of {load}, where {what}"), value, needed).into())
    }

    /// What is wrong with a table, and the number that is.
    fn fault(&self) -> Option<(&'static str, f64)> {
        let Amplitude::Table(pairs) = self else { return None };
        if pairs.len() < 2 {
            return Some(("fewer than two pairs are given", pairs.len() as f64));
        }
        if let Some(number) = pairs.iter().flat_map(|&(l, v)| [l, v]).find(|number| !number.is_finite()) {
            return Some(("a number is not finite", number));
        }
        let back = pairs.windows(2).find(|w| w[1].0 <= w[0].0);
        back.map(|w| ("the load factors do not rise", w[1].0))
    }

    /// The load factors inside $(0, 1)$ at which the slope of a table may change, rising.
    pub(crate) fn break_points(&self) -> Vec<f64> {
        let Amplitude::Table(pairs) = self else { return Vec::new() };
        pairs.iter().map(|p| p.0).filter(|&load| load > 0.0 && load < 1.0).collect()
    }

    /// The same value at all load factors.
    pub(crate) fn level(value: f64) -> Self {
        Amplitude::Table(vec![(0.0, value), (1.0, value)])
    }

    /// The same with a value added to it.
    pub(crate) fn later(&self, by: f64) -> Self {
        match self {
            Amplitude::Ramp => Amplitude::Table(vec![(0.0, by), (1.0, by + 1.0)]),
            Amplitude::Constant => Amplitude::level(by + 1.0),
            Amplitude::Table(pairs) => Amplitude::Table(pairs.mapped(|&(load, value)| (load, value + by))),
            Amplitude::Function(function) => {
                let function = function.clone();
                Amplitude::Function(Arc::new(move |load| function(load) + by))
            }
        }
    }

    /// Whether the value may be any function of the load factor.
    pub(crate) fn is_function(&self) -> bool {
        matches!(self, Amplitude::Function(_))
    }

    /// The value alone, for a third of the calls of a function.
    pub(crate) fn value(&self, load: f64) -> f64 {
        match self {
            Amplitude::Function(function) => function(load),
            other => other.evaluate(load).0,
        }
    }

    /// Value and slope at a load factor; at a break point the slope to the left, at the first pair of a table the one to the
    /// right: a run that starts there has to see where it leads.
    pub fn evaluate(&self, load: f64) -> (f64, f64) {
        match self {
            Amplitude::Ramp => (load, 1.0),
            Amplitude::Constant => (1.0, 0.0),
            Amplitude::Function(function) => {
                // Load factors that a run does not come to are not asked for: a function need not be defined there.
                let [low, high] = [(load - DIFFERENCE).max(load.min(0.0)), (load + DIFFERENCE).min(load.max(1.0))];
                (function(load), (function(high) - function(low)) / (high - low))
            }
            Amplitude::Table(pairs) => {
                let next = pairs.partition_point(|p| p.0 < load);
                if next == 0 && pairs.len() > 1 && pairs[0].0 == load {
                    let (a, b) = (pairs[0], pairs[1]);
                    (a.1, (b.1 - a.1) / (b.0 - a.0))
                } else if next == 0 {
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
    use approx::assert_abs_diff_eq;

    #[test]
    fn tables_interpolate_and_are_checked() {
        let table = Amplitude::table(vec![(0.0, 0.0), (1.0, 2.0), (3.0, 0.0)]).unwrap();
        assert_eq!(table.evaluate(0.5), (1.0, 2.0));
        assert_eq!(table.evaluate(2.0), (1.0, -1.0));
        assert_eq!(table.evaluate(9.0), (0.0, 0.0));
        // A run that starts at the first pair is led by the slope behind it; before it and beyond, nothing changes.
        assert_eq!(table.evaluate(0.0), (0.0, 2.0));
        assert_eq!(table.evaluate(-0.1), (0.0, 0.0));
        let stages = Amplitude::table(vec![(-1.0, 0.0), (0.0, 0.0), (0.2, 1.0), (0.5, 2.0), (1.0, 2.0), (4.0, 0.0)]);
        assert_eq!(stages.unwrap().break_points(), [0.2, 0.5]);
        assert!(Amplitude::Ramp.break_points().is_empty());
        assert!(Amplitude::table(vec![(0.0, 1.0)]).is_err());
        assert!(Amplitude::table(vec![(0.0, 1.0), (0.0, 2.0)]).is_err());
        assert!(Amplitude::table(vec![(0.0, 1.0), (1.0, f64::NAN)]).is_err());
    }

    #[test]
    fn functions_have_slopes() {
        let sine = Amplitude::Function(Arc::new(f64::sin));
        let (value, slope) = sine.evaluate(0.7);
        assert_eq!(value, 0.7f64.sin());
        assert_abs_diff_eq!(slope, 0.7f64.cos(), epsilon = 1e-9);
        assert_eq!(sine, sine.clone());
        assert_ne!(sine, Amplitude::Function(Arc::new(f64::sin)));
    }
}
