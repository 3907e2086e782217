//! Why an analysis found no further state.

use std::fmt;

use thiserror::Error;

use super::LinearError;

/// Why an analysis stalled: what went wrong in the last attempt, and where on the path.
///
/// Its text, by `Display`, also says what to do.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Stalled {
    /// What went wrong.
    pub cause: Cause,
    /// Load factor of the last converged state.
    pub load: f64,
    /// The largest load factor of the path: above [`load`](Stalled::load) where a limit point was passed.
    pub largest_load: f64,
    /// What drives the analysis.
    pub driven: Driven,
}

/// What ended the last attempt to reach a further state.
#[derive(Debug, Clone, PartialEq, Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Cause {
    /// Newton's method did not converge within the allowed iterations.
    #[error("Newton's method did not converge within {0} iterations")]
    Iterations(usize),
    /// Every step was cut, so that no material inverts or by [`Term::advance`](crate::term::Term::advance): the step is too large.
    #[error(
        "every iteration had to be shortened (factor {factor:.3}) to keep J > 0 and within what each term admits: no equilibrium was found \
         nearby"
    )]
    StepLimited {
        /// The last step factor.
        #[cfg_attr(feature = "serde", serde(with = "super::finite"))]
        factor: f64,
    },
    /// The increments grow although the state was predicted from others.
    #[error("Newton's increments grow (now {increment:.1e} of the displacement): no equilibrium was found nearby")]
    Diverging {
        /// The last increment relative to the displacement.
        #[cfg_attr(feature = "serde", serde(with = "super::finite"))]
        increment: f64,
    },
    /// Numbers that are not finite: of a material beyond its range, a load or a custom term.
    #[error(
        "forces are not finite: the material is strained beyond its range, or a load, an amplitude or a custom term is NaN there"
    )]
    NotFinite,
    /// A term breaks what it promises: which one, and how.
    #[error("{0}")]
    Term(String),
    /// The tangent matrix is singular.
    #[error("{}", if *at_start { solver.as_str() } else { "the matrix is singular in the next state" })]
    Singular {
        /// Whether no step had converged before: a rigid motion may be free.
        at_start: bool,
        /// The message of the linear solver.
        solver: String,
    },
    /// A rigid motion is free, or friction alone resists it.
    #[error(
        "{}: {}; hold it by a condition, {}",
        if *friction { "friction alone resists a motion, and only once there is pressure" } else { "a motion is free" },
        motions.join("; "),
        if *friction {
            "for good or in a first stage that presses the parts together (Stages)"
        } else {
            "or by the friction of a contact"
        }
    )]
    FreeMotion {
        /// The motions, by translation and rotation and by body.
        motions: Vec<String>,
        /// Whether the friction of contacts resists them: not before there is pressure, and not where all of a contact slides.
        friction: bool,
    },
    /// The linear solver failed otherwise.
    #[error("{0}")]
    LinearSolver(String),
    /// The controlled functional does not change with the load.
    #[error(
        "the controlled quantity does not change with the load; control one that the loads move, or the load itself"
    )]
    Control,
    /// A large step has gained or lost unstable modes: it may have left its path.
    #[error(
        "the number of unstable modes changes from {before} to {after} in one large step: the state may lie on another \
         equilibrium path; lower Stepping::first and Stepping::smallest, or give the part an imperfection"
    )]
    Unstable {
        /// Unstable modes before the step.
        before: usize,
        /// Unstable modes after it.
        after: usize,
    },
    /// Only unstable states were found, also after a perturbation along an unstable mode.
    #[error(
        "no stable state was found: the last one has {modes} unstable modes, and a perturbation led to no stable state \
         either. The body buckles or slips away here; support it, add friction, or use StepControl::ArcLength"
    )]
    NoStableState {
        /// Unstable modes of the last state found.
        modes: usize,
    },
    /// Even the smallest time step has an error above the tolerance.
    #[error(
        "the relative error of the stress is {error:.1e} even with the smallest time step, the tolerance is {tolerance:.1e}: \
         lower Stepping::smallest or raise Stepping::time_tolerance"
    )]
    TimeError {
        /// The relative error of the stress.
        #[cfg_attr(feature = "serde", serde(with = "super::finite"))]
        error: f64,
        /// The tolerance.
        #[cfg_attr(feature = "serde", serde(with = "super::finite"))]
        tolerance: f64,
    },
    /// A state or a step is refused, with the reason: a body that leaves a rigid profile at its open end, lists of another problem.
    #[error("{0}")]
    Refused(String),
    /// The arc runs back along the path.
    #[error("the arc-length step runs back along the path; take smaller arcs (Stepping::first)")]
    Turned,
    /// The load falls beyond a limit point, and the stepping was not told to follow it.
    #[error("the load falls beyond a limit point")]
    LimitPoint,
    /// The largest allowed number of steps is reached.
    #[error("the analysis has taken {0} steps, the most allowed: raise Stepping::steps")]
    Steps(usize),
    /// The next step would be smaller than the rounding of the controlled quantity.
    #[error(
        "the step of the controlled quantity, from {now:e} to {next:e}, is lost in rounding: no equilibrium was found in between"
    )]
    Rounding {
        /// The controlled quantity now.
        #[cfg_attr(feature = "serde", serde(with = "super::finite"))]
        now: f64,
        /// The same after the step.
        #[cfg_attr(feature = "serde", serde(with = "super::finite"))]
        next: f64,
    },
}

/// What drives an analysis into its next state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Driven {
    /// Loads that grow with the load factor.
    ByLoads,
    /// Prescribed displacements alone.
    ByDisplacements,
    /// No loads, and something may touch: prescribed displacements and rigid surfaces that move or turn.
    ByContacts,
    /// A functional or an arc length, the load factor being unknown.
    ByControl,
}

impl From<LinearError> for Cause {
    fn from(error: LinearError) -> Self {
        match error {
            LinearError::Pivot { .. } | LinearError::Residual { .. } => {
                Cause::Singular { at_start: true, solver: error.to_string() }
            }
            other => Cause::LinearSolver(other.to_string()),
        }
    }
}

impl Driven {
    /// What to do where the next state can't be found.
    fn remedy(self) -> &'static str {
        match self {
            Driven::ByLoads => {
                "; the body may be at a limit point (use StepControl::ArcLength, or prescribe a deflection instead of the load) \
                 or move freely (check::scene finds free rigid motions)"
            }
            Driven::ByDisplacements => {
                "; allow smaller steps (Stepping::smallest), take more particles, or raise Newton::tolerance if it is far below 1e-10; \
                 StateDiagnostics::jacobians of the last step show inverted material, check::scene finds free rigid motions"
            }
            Driven::ByContacts => {
                "; check how far rigid surfaces move or turn and whether the body can follow, allow smaller steps (Stepping::smallest), or take \
                 more particles where bodies touch; check::scene finds free rigid motions"
            }
            Driven::ByControl => {
                "; take smaller steps (Stepping::first, Stepping::smallest), more particles, or another control"
            }
        }
    }
}

impl fmt::Display for Stalled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Stalled { cause, load, largest_load, driven } = self;
        let passed = load < largest_load;
        match cause {
            Cause::Steps(_) if passed => {
                write!(f, "{cause}; a limit point was passed at load factor {largest_load:.6}")
            }
            Cause::LimitPoint => write!(
                f,
                "a limit point was passed, the largest load factor was {largest_load:.6}: \
                 use StepControl::ArcLength to follow the path where the load falls"
            ),
            Cause::Steps(_) | Cause::Rounding { .. } => write!(f, "{cause}"),
            _ if passed => {
                write!(f, "a limit point was passed, the largest load factor was {largest_load:.6}; now {cause}")
            }
            Cause::Iterations(_)
            | Cause::StepLimited { .. }
            | Cause::Diverging { .. }
            | Cause::LinearSolver(_)
            | Cause::Singular { at_start: false, .. } => write!(f, "{cause}{}", driven.remedy()),
            _ => write!(f, "{cause}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_say_what_leads_on() {
        let text =
            |cause: Cause, largest_load: f64, driven| Stalled { cause, load: 0.5, largest_load, driven }.to_string();
        let iterations = Cause::Iterations(30);
        assert!(text(iterations.clone(), 0.5, Driven::ByLoads).contains("StepControl::ArcLength"));
        assert!(text(iterations.clone(), 0.5, Driven::ByDisplacements).contains("Stepping::smallest"));
        // Beyond a limit point the remedy is another one.
        let passed = text(iterations, 0.7, Driven::ByLoads);
        assert!(passed.contains("limit point") && passed.contains("0.700000") && !passed.contains("ArcLength"));
        let singular = |at_start| Cause::Singular { at_start, solver: "a rigid motion may be free".into() };
        assert!(text(singular(true), 0.5, Driven::ByLoads).contains("rigid motion may be free"));
        assert!(!text(singular(false), 0.5, Driven::ByControl).contains("rigid"));
        assert!(text(Cause::Steps(3), 0.7, Driven::ByControl).contains("3 steps"));
    }
}
