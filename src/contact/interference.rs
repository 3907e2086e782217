//! Interference: parts that begin inside each other, or are pressed apart by a given amount.

use crate::error::Invalid;

/// What is added to the gaps of a contact while an interference is resolved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Interference {
    /// By how much the surfaces are pressed apart \[length\]; as deep as they are drawn into each other where nothing is given.
    pub amount: Option<f64>,
    /// The load factor at which it is resolved.
    pub until: f64,
    /// Whether it was resolved before the run.
    pub resolved: bool,
}

/// Gap at rest of surfaces that are drawn to one size, as a part of the width of a trace function.
const FIT: f64 = 0.1;

impl Interference {
    /// An interference that is resolved at a load factor.
    pub fn new(amount: Option<f64>, until: f64) -> Self {
        Interference { amount, until, resolved: false }
    }

    /// What counts of the gap of a trace function at rest: where an amount is given, what chords of a body and a curved surface that it
    /// fits leave between them.
    pub fn at_rest(&self, gap: f64, width: f64) -> f64 {
        let counts = gap.is_finite() && (self.amount.is_none() || gap.abs() <= FIT * width);
        if counts { gap } else { 0.0 }
    }

    /// What is added to a gap that is `at_rest` at rest, and its change with the load factor:
    /// $(1 - s)\\,\max(-g_0, 0)$ for an overlap that is drawn, $-g_0 - s\\,\delta$ for a given one,
    /// $s = \min(\lambda/\lambda_e, 1)$.
    pub fn shift(&self, at_rest: f64, load: f64) -> [f64; 2] {
        let done = self.resolved || load >= self.until;
        let (part, rate) = if done { (1.0, 0.0) } else { ((load / self.until).max(0.0), 1.0 / self.until) };
        match self.amount {
            Some(amount) => [-at_rest - part * amount, -rate * amount],
            None => [(1.0 - part) * (-at_rest).max(0.0), -rate * (-at_rest).max(0.0)],
        }
    }

    /// Refuses amounts and stages that are none.
    pub fn validate(&self, contact: &str) -> Result<(), Invalid> {
        if !(self.until > 0.0 && self.until <= 1.0) {
            let needed = "give a load factor above 0, at most 1";
            return Err(Invalid::new(format!("{contact}: end of the stage of interference"), self.until, needed));
        }
        match self.amount {
            Some(amount) if !(amount > 0.0 && amount.is_finite()) => {
                Err(Invalid::new(format!("{contact}: interference"), amount, "give a length above 0"))
            }
            _ => Ok(()),
        }
    }
}
