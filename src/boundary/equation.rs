//! One constraint equation of the essential conditions.

use crate::each::Each;
use crate::error::BoundaryError;
use crate::term::Amplitude;

/// One condition $\sum_k c_k d_k = g\\,a(\lambda)$ on the coefficients $d$.
#[derive(Debug, Clone, PartialEq)]
pub struct ConstraintEquation {
    /// (unknown, coefficient) pairs.
    pub entries: Vec<(usize, f64)>,
    /// The unknown that the constraint equation owns: component of the particle it belongs to.
    pub dependent: usize,
    /// $g$ \[length; length × measure for constraint equations over a boundary\].
    pub target: f64,
    /// Its factor $a(\lambda)$.
    pub amplitude: Amplitude,
    /// The condition that the constraint equation comes from, for messages.
    pub label: String,
}

impl ConstraintEquation {
    /// $\sum_k c_k d_k$; NaN where the displacement is too short.
    pub(crate) fn value(&self, displacement: &[f64]) -> f64 {
        self.entries.summed(|&(k, c)| c * displacement.get(k).copied().unwrap_or(f64::NAN))
    }

    /// $\max_k |c_k|$.
    pub(crate) fn largest(&self) -> f64 {
        self.entries.largest(|entry| entry.1.abs())
    }

    /// Its coefficients that are not zero over the largest one, and one over that.
    pub(super) fn scaled(&self) -> (Vec<(usize, f64)>, f64) {
        let largest = self.largest();
        let entries = self.entries.iter().filter(|entry| entry.1 != 0.0);
        (entries.map(|&(unknown, c)| (unknown, c / largest)).collect(), 1.0 / largest)
    }

    /// Whether it prescribes one value at all load factors, to a rounding.
    pub(crate) fn stays_at(&self, value: f64, rounding: f64) -> bool {
        let off = |load: f64| (self.target * self.amplitude.value(load) - value).abs() > rounding;
        let loads = || self.amplitude.break_points().into_iter().chain([1.0]);
        if self.target == 0.0 { value.abs() <= rounding } else { !self.amplitude.is_function() && !loads().any(off) }
    }

    /// $\sum_k |c_k|$, by which values of constraint equations over a boundary are divided to be lengths; about 1 at particles.
    pub(crate) fn measure(&self) -> f64 {
        self.entries.summed(|(_, c)| c.abs())
    }
}

/// Rejects constraint equations that name unknowns beyond the `unknowns` of a model.
pub(crate) fn check_unknowns(equations: &[ConstraintEquation], unknowns: usize) -> Result<(), BoundaryError> {
    let beyond = |equation: &&ConstraintEquation| {
        equation.dependent >= unknowns || equation.entries.iter().any(|e| e.0 >= unknowns)
    };
    match equations.iter().find(beyond) {
        Some(equation) => Err(BoundaryError::Unsuitable {
            enforcement: "constraint equation",
            reason: format!("{} names an unknown beyond the {unknowns} of the model", equation.label),
        }),
        None => Ok(()),
    }
}

pub(crate) fn check_component(component: usize, dimension: usize, label: &str) -> Result<(), BoundaryError> {
    if component < dimension {
        Ok(())
    } else {
        Err(BoundaryError::Component { what: label.to_string(), component, dimension })
    }
}
