//! States, the path of an analysis, and who watches it.

use std::ops::ControlFlow;

use crate::assembly::Model;
use crate::boundary::Constraints;
use crate::error::SolveError;
use crate::linear::Inertia;

/// Everything that an analysis iterates on; predicted, halved and kept as a whole.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct State {
    /// Coefficients $d$, node by node \[length\].
    pub displacement: Vec<f64>,
    /// Local unknowns (pressures), one vector per term.
    pub locals: Vec<Vec<f64>>,
    /// Multipliers of the rows \[force; stress for rows over a boundary\].
    pub multipliers: Vec<f64>,
    /// Load factor $\lambda$.
    pub load: f64,
}

impl State {
    /// The state of a model at rest: no displacement, local unknowns to match, load factor 0.
    pub fn at_rest<const D: usize>(model: &Model<D>, rows: &Constraints) -> Self {
        State {
            displacement: vec![0.0; model.unknowns()],
            locals: model.start(),
            multipliers: vec![0.0; rows.len()],
            load: 0.0,
        }
    }
}

/// A converged state and what it cost.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// The state.
    pub state: State,
    /// Newton iterations (factorisations) since the last converged state, rejected attempts included.
    pub iterations: usize,
    /// Energy stored in the body.
    pub energy: f64,
    /// Signs of the pivots at the last iteration, where the solver knows them.
    pub inertia: Option<Inertia>,
}

/// One Newton iteration, as an observer sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Iteration {
    /// Load factor of the attempt.
    pub load: f64,
    /// Count within the attempt, from 1.
    pub number: usize,
    /// Norm of the reduced residual relative to the unreduced forces.
    pub residual: f64,
    /// Norm of the displacement increment relative to the displacement.
    pub increment: f64,
    /// Step factor taken by the path guard.
    pub factor: f64,
}

/// Watches an analysis; every method may be left out.
///
/// ```
/// use std::ops::ControlFlow;
/// use rkpm::solve::{Observer, Step};
/// /// Stops after three converged states.
/// struct Three(usize);
/// impl Observer for Three {
///     fn step(&mut self, _: &Step) -> ControlFlow<()> {
///         self.0 += 1;
///         if self.0 < 3 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
///     }
/// }
/// # let _ = Three(0);
/// ```
pub trait Observer {
    /// Called after each iteration.
    fn iteration(&mut self, _iteration: &Iteration) {}

    /// Called after each converged step; `Break` ends the analysis with [`Ending::Stopped`].
    fn step(&mut self, _step: &Step) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl Observer for () {}

/// How an analysis ended.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// The last load was reached.
    Completed,
    /// An observer broke off.
    Stopped,
    /// No further state could be found; the reason of the last rejected attempt.
    Stalled(String),
}

/// The converged states of an analysis, however it ended.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// The first state, before any step.
    pub start: State,
    /// Converged steps.
    pub steps: Vec<Step>,
    /// How it ended.
    pub ending: Ending,
    /// All Newton iterations (factorisations), those of rejected steps included.
    pub iterations: usize,
    /// Rejected attempts.
    pub rejected: usize,
}

impl Path {
    /// The last converged state.
    pub fn last(&self) -> &State {
        self.steps.last().map_or(&self.start, |s| &s.state)
    }

    /// The path itself if the last load was reached.
    ///
    /// # Errors
    /// [`SolveError::Stalled`] where it was not; keep the path instead to use what there is of it.
    pub fn completed(self) -> Result<Path, SolveError> {
        let why = match &self.ending {
            Ending::Completed => return Ok(self),
            Ending::Stopped => "an observer broke off".to_string(),
            Ending::Stalled(why) => why.clone(),
        };
        Err(SolveError::Stalled { load: self.last().load, steps: self.steps.len(), why })
    }
}
