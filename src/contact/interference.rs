//! Interference: parts that begin inside each other.

use crate::error::Invalid;

/// What is added to the gaps of a contact while an interference is resolved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Interference {
    /// The load factor at which it is resolved.
    pub until: f64,
    /// Whether it was resolved before the run.
    pub resolved: bool,
}

impl Interference {
    /// An interference that is resolved at a load factor.
    pub(crate) fn new(until: f64) -> Self {
        Interference { until, resolved: false }
    }

    /// What is added to a gap that is `at_rest` at rest, and its change with the load factor: $(1 - s)\\,\max(-g_0, 0)$ with
    /// $s = \min(\lambda/\lambda_e, 1)$.
    pub(crate) fn shift(&self, at_rest: f64, load: f64) -> [f64; 2] {
        if self.resolved || load >= self.until {
            return [0.0; 2];
        }
        let overlap = (-at_rest).max(0.0);
        [(1.0 - (load / self.until).max(0.0)) * overlap, -overlap / self.until]
    }
}

/// Refuses coefficients of friction and stages of interference that are none.
pub(crate) fn validate(friction: f64, interference: Option<&Interference>, contact: &str) -> Result<(), Invalid> {
    ensure!(
        friction >= 0.0 && friction.is_finite(),
        Invalid::new(format!("{contact}: coefficient of friction"), friction, "give a finite number from 0 on",)
    );
    match interference.map(|interference| interference.until) {
        Some(until) if !(until > 0.0 && until <= 1.0) => {
            let needed = "give a load factor above 0, at most 1";
            Err(Invalid::new(format!("{contact}: end of the stage of interference"), until, needed))
        }
        _ => Ok(()),
    }
}
