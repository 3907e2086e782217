//! Why attempts to reach a state are given up.

use std::fmt;

use crate::error::LinearError;

/// Why an attempt was given up.
#[derive(Debug, Clone, PartialEq)]
pub enum Rejection {
    /// Not converged within the allowed iterations.
    Iterations(usize),
    /// The path guard kept cutting the step: the attempt is too far away.
    Guarded {
        /// The last step factor.
        factor: f64,
    },
    /// The increments grow although the state was predicted from others.
    Diverging {
        /// The last increment relative to the displacement.
        increment: f64,
    },
    /// Numbers that are not finite: of a material that left its domain, a load or a term of one's own.
    NotFinite,
    /// The linear solve failed.
    Linear(LinearError),
    /// The controlled functional does not change with the load.
    Control,
    /// A large step has gained unstable modes: it may have left its path.
    Unstable {
        /// Unstable modes before the step.
        before: usize,
        /// Unstable modes after it.
        after: usize,
    },
    /// A large step has made the changes of volume far less even: it may have folded the field between points.
    Folded {
        /// The largest $J$ over the smallest one before the step.
        before: f64,
        /// The same after it.
        after: f64,
    },
    /// The arc runs back along the path.
    Turned,
    /// The linear answer to the load is so large that a deflection should lead.
    Far,
}

/// Gained modes are followed up by this part of the smallest increment: with the default of that, down to Newton's
/// own tolerance.
const LOCATED: f64 = 1e-4;

impl Rejection {
    /// The increment below which a run stalls, from the one for attempts that do not converge: what a large step
    /// gained is real only once the step is small, however far away the next target is.
    pub(super) fn least(&self, smallest: f64) -> f64 {
        match self {
            Rejection::Unstable { .. } => LOCATED * smallest,
            _ => smallest,
        }
    }
}

/// What leads a run into its next state.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Driven {
    /// Loads that grow with the load factor.
    ByLoads,
    /// Prescribed displacements alone.
    ByDisplacements,
    /// A functional or an arc.
    Otherwise,
}

impl Driven {
    /// What to do where the next state can't be found.
    fn remedy(self) -> &'static str {
        match self {
            Driven::ByLoads => {
                "; StepControl::ArcLength or a prescribed deflection passes limit points, \
                 check::scene finds free rigid motions"
            }
            Driven::ByDisplacements => {
                "; no load grows here: a smaller Stepping::smallest or finer particles go on further, Health::jacobians \
                 of the last step tell material that is squeezed through, check::scene finds free rigid motions"
            }
            Driven::Otherwise => "",
        }
    }
}

impl Rejection {
    /// Why a run stalls: the reason of the last attempt as it looks from the path behind it, of `steps` converged steps
    /// up to the load factor `largest`, now at `load`.
    pub(super) fn stall(&self, steps: usize, [load, largest]: [f64; 2], driven: Driven) -> String {
        // What the first steps have solved is not free to move.
        let what = match self {
            Rejection::Linear(LinearError::Pivot { .. } | LinearError::Residual { .. }) if steps > 0 => {
                "the matrix is singular in the next state".to_string()
            }
            other => other.to_string(),
        };
        if load < largest {
            return format!("a limit point was passed, the largest load factor was {largest:.6}; now {what}");
        }
        let led_on = matches!(self, Rejection::Iterations(_) | Rejection::Guarded { .. } | Rejection::Diverging { .. })
            || matches!(self, Rejection::Linear(_)) && steps > 0;
        if led_on { what + driven.remedy() } else { what }
    }
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Rejection::Iterations(n) => write!(f, "not converged within {n} iterations"),
            Rejection::Guarded { factor } => {
                write!(f, "the path guard cut every step (factor {factor:.3}): the next state is too far away")
            }
            Rejection::Diverging { increment } => {
                write!(
                    f,
                    "the increments grow (now {increment:.1e} of the displacement): the next state is too far away"
                )
            }
            Rejection::NotFinite => write!(
                f,
                "forces are not finite: a material left its domain, or a load, an amplitude or a term of one's own is NaN there"
            ),
            Rejection::Linear(error) => write!(f, "{error}"),
            Rejection::Unstable { before, after } => {
                write!(f, "a large step turns {before} unstable modes into {after}: the state may lie on another path")
            }
            Rejection::Folded { before, after } => write!(
                f,
                "in a large step the largest volume ratio went from {before:.2} to {after:.2} of the smallest: the field may be folded"
            ),
            Rejection::Turned => write!(f, "the arc runs back along the path"),
            Rejection::Far => write!(f, "the linear answer to the load is too large"),
            Rejection::Control => write!(f, "the controlled quantity does not change with the load"),
        }
    }
}
