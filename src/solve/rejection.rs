//! Why attempts to reach a state are given up.

use crate::error::{Cause, LinearError};

/// Why an attempt was given up.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Rejection {
    /// Something went wrong; where no smaller step helps, the run ends with it.
    Failed(Cause),
    /// An observer broke off.
    Stopped,
    /// The first step is so large that a deflection should be controlled in place of the load.
    TooLarge(Vec<f64>),
}

/// Modes gained or lost, and errors of time, are followed up by this part of the smallest increment: with the default of that, down to
/// Newton's own tolerance.
const LOCATED: f64 = 1e-4;

impl Rejection {
    /// The increment below which a run stalls, from the one for attempts that do not converge: what a large step
    /// gained or lost is real only once the step is small, however far away the next target is. An error of time falls with the step, and
    /// what a law needs to relax may be any part of the duration.
    pub(super) fn least(&self, smallest: f64) -> f64 {
        match self {
            Rejection::Failed(Cause::Unstable { .. } | Cause::TimeError { .. }) => LOCATED * smallest,
            Rejection::Stopped => f64::INFINITY,
            _ => smallest,
        }
    }
}

impl From<Cause> for Rejection {
    fn from(cause: Cause) -> Self {
        Rejection::Failed(cause)
    }
}

impl From<LinearError> for Rejection {
    fn from(error: LinearError) -> Self {
        Rejection::Failed(error.into())
    }
}
