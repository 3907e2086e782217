//! The path of an analysis, its steps, and their observers.

use std::fmt;
use std::ops::ControlFlow;

use crate::error::{Doubt, DoubtCause, Error, SolveError, Stalled};
use crate::linear::Inertia;
use crate::term::StateDiagnostics;

use super::critical::CriticalPoint;
use super::state::State;

/// What a stepping rule carries from one converged step to the next, beside the states themselves.
///
/// It is part of the [`Step`], so that [`Analysis::resume`](super::Analysis::resume) goes on with the same
/// bits as a run that was never broken off.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StepControlState {
    /// The next increment: of the load factor, of the deflection in control \[its own unit\], or, on the way
    /// to a target, the part of what is left.
    pub increment: f64,
    /// Targets of a controlled run that have been reached.
    pub reached: usize,
    /// Whether the arc length is controlled in place of a deflection that could not be increased further.
    #[cfg_attr(feature = "serde", serde(default))]
    pub arc: bool,
}

/// A converged state and what it cost.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Step {
    /// The state.
    pub state: State,
    /// Newton iterations (factorisations) since the last converged state, rejected attempts included.
    pub iterations: usize,
    /// Rejected attempts since the last converged state.
    pub rejected: usize,
    /// Energy stored in the body.
    #[cfg_attr(feature = "serde", serde(with = "crate::error::finite"))]
    pub energy: f64,
    /// Signs of the pivots at the last iteration, where the solver knows them.
    pub inertia: Option<Inertia>,
    /// Unstable modes under a fixed load: negative pivots less constraints. Of the symmetric part of the tangent.
    pub unstable: Option<usize>,
    /// Critical points between the last converged state and this one, where the stepping follows the path
    /// ([`Following`](super::Following)).
    pub critical: Vec<CriticalPoint>,
    /// How far the state can be trusted.
    pub diagnostics: StateDiagnostics,
    /// Why the state may be no answer.
    #[cfg_attr(feature = "serde", serde(default))]
    pub doubts: Vec<Doubt>,
    /// How the stepping goes on from here.
    pub control_state: StepControlState,
}

impl Step {
    /// The locking indicator $\eta = \int U(J) - U(\bar J_{zone})\\,\mathrm d\Omega / \Pi$: the part of the energy that
    /// is spent on changes of volume within zones, which a cure would give back. `None` where pressures are projected.
    pub fn locking(&self) -> Option<f64> {
        self.diagnostics.locked_energy.map(|locked| locked / self.energy).filter(|eta| eta.is_finite())
    }
}

/// Which matrix an iteration has worked with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MatrixUse {
    /// The matrix of its own state, formed and factorised.
    Formed,
    /// That of an earlier state, see [`TangentUpdate`](super::TangentUpdate).
    ReusedTangent,
}

/// One Newton iteration, as an observer sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Iteration {
    /// Load factor of the attempt.
    pub load: f64,
    /// Count within the attempt, from 1; iterations with a reused tangent are counted on their own, from 1 after each
    /// matrix.
    pub number: usize,
    /// Which matrix it has worked with.
    pub matrix: MatrixUse,
    /// Norm of the reduced residual relative to the unreduced forces.
    pub residual: f64,
    /// Norm of the displacement increment relative to the displacement.
    pub increment: f64,
    /// Step factor taken by the step limiter.
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
    /// Called after each iteration; `Break` ends the analysis with [`Ending::Stopped`].
    fn iteration(&mut self, _iteration: &Iteration) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Called after each converged step; `Break` ends the analysis with [`Ending::Stopped`].
    fn step(&mut self, _step: &Step) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Called with each converged state before it becomes a step: doubts about it, which its step records
    /// ([`Step::doubts`]).
    fn doubts(&mut self, _state: &State) -> Vec<Doubt> {
        Vec::new()
    }
}

impl Observer for () {}

/// Both watch, the first one first; either ends the analysis.
impl<A: Observer, B: Observer> Observer for (A, B) {
    fn iteration(&mut self, iteration: &Iteration) -> ControlFlow<()> {
        // Both see it, whatever the first one says of it.
        let (first, second) = (self.0.iteration(iteration), self.1.iteration(iteration));
        if first.is_break() { first } else { second }
    }

    fn step(&mut self, step: &Step) -> ControlFlow<()> {
        // Both see the step, whatever the first one says of it.
        let (first, second) = (self.0.step(step), self.1.step(step));
        if first.is_break() { first } else { second }
    }

    fn doubts(&mut self, state: &State) -> Vec<Doubt> {
        let mut doubts = self.0.doubts(state);
        doubts.append(&mut self.1.doubts(state));
        doubts
    }
}

impl<T: Observer + ?Sized> Observer for &mut T {
    fn iteration(&mut self, iteration: &Iteration) -> ControlFlow<()> {
        (**self).iteration(iteration)
    }

    fn step(&mut self, step: &Step) -> ControlFlow<()> {
        (**self).step(step)
    }

    fn doubts(&mut self, state: &State) -> Vec<Doubt> {
        (**self).doubts(state)
    }
}

/// How an analysis ended.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Ending {
    /// The last load was reached.
    Completed,
    /// An observer broke off.
    Stopped,
    /// No further state could be found: the cause of the last rejected attempt, and where.
    Stalled(Stalled),
    /// The run has not ended: it was killed, or it still runs. A journal without an ending reads as this.
    Interrupted,
}

/// The converged states of an analysis, however it ended.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EquilibriumPath {
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

impl From<State> for EquilibriumPath {
    /// A path that has yet to take its first step.
    fn from(start: State) -> Self {
        EquilibriumPath { start, steps: Vec::new(), ending: Ending::Interrupted, iterations: 0, rejected: 0 }
    }
}

impl EquilibriumPath {
    /// Iterations and rejected attempts up to the last step.
    pub(crate) fn spent(&self) -> (usize, usize) {
        // Far below overflow, whatever a damaged record says: a resumed run counts on from here.
        const MOST: usize = usize::MAX / 2;
        let total =
            |count: fn(&Step) -> usize| self.steps.iter().fold(0, |n: usize, s| n.saturating_add(count(s)).min(MOST));
        (total(|s| s.iterations), total(|s| s.rejected))
    }

    /// The last converged state.
    pub fn last(&self) -> &State {
        self.steps.last().map_or(&self.start, |s| &s.state)
    }

    /// The first state and those of all steps.
    pub(crate) fn states(&self) -> impl Iterator<Item = &State> {
        std::iter::once(&self.start).chain(self.steps.iter().map(|step| &step.state))
    }

    /// The limit and bifurcation points of the path, in the order in which they are passed.
    pub fn critical_points(&self) -> impl Iterator<Item = &CriticalPoint> {
        self.steps.iter().flat_map(|step| &step.critical)
    }

    /// What makes the states of the path doubtful: each cause once, in the step that has it first. That a contact touches too few
    /// particles is told of the last state alone: each contact begins so.
    pub fn doubts(&self) -> Vec<&Doubt> {
        let mut found: Vec<&Doubt> = Vec::new();
        let last = self.steps.len().saturating_sub(1);
        for (number, step) in self.steps.iter().enumerate() {
            for doubt in &step.doubts {
                let begins = number < last && matches!(doubt.cause, DoubtCause::Overlap { .. });
                if !begins && !found.iter().any(|known| known.cause.is_like(&doubt.cause)) {
                    found.push(doubt);
                }
            }
        }
        found
    }

    /// The path itself if the last load was reached and its last state is an answer; what is doubtful before is told by
    /// [`doubts`](EquilibriumPath::doubts).
    ///
    /// # Errors
    /// [`NoAnswer`], which has the path and why: [`SolveError::Stalled`] where the last load could not be reached,
    /// [`SolveError::BrokenOff`] where an observer or a kill ended the run, [`SolveError::Doubtful`] where the last state is doubtful
    /// ([`Doubt::refutes`]). Keep the path instead to use what there is of it.
    pub fn completed(self) -> Result<EquilibriumPath, NoAnswer> {
        let steps = self.steps.len();
        let last = self.steps.last().into_iter().flat_map(|step| &step.doubts);
        let doubts: Vec<Doubt> = last.filter(|doubt| doubt.refutes()).cloned().collect();
        match self.reached() {
            Ok(path) if doubts.is_empty() => Ok(path),
            Ok(path) => Err(NoAnswer { path: Box::new(path), error: SolveError::Doubtful { steps, doubts } }),
            Err(none) => Err(none),
        }
    }

    /// Whether it is completed without a doubt that refutes its last state.
    pub(crate) fn is_answer(&self) -> bool {
        let last = self.steps.last();
        self.ending == Ending::Completed && !last.is_some_and(|step| step.doubts.iter().any(Doubt::refutes))
    }

    /// The path itself if the last load was reached, whatever its doubts.
    ///
    /// # Errors
    /// [`NoAnswer`] with [`SolveError::Stalled`] or [`SolveError::BrokenOff`].
    pub fn reached(self) -> Result<EquilibriumPath, NoAnswer> {
        let (load, steps) = (self.last().load, self.steps.len());
        let error = match &self.ending {
            Ending::Completed => return Ok(self),
            Ending::Stopped => SolveError::BrokenOff { load, steps, why: "an observer broke off" },
            Ending::Interrupted => SolveError::BrokenOff { load, steps, why: "the run was broken off; resume it" },
            Ending::Stalled(stalled) => SolveError::Stalled { steps, stalled: stalled.clone() },
        };
        Err(NoAnswer { path: Box::new(self), error })
    }
}

/// A path that is no answer, and why.
#[derive(Clone, PartialEq, thiserror::Error)]
#[error("{error}")]
pub struct NoAnswer {
    /// The path so far.
    pub path: Box<EquilibriumPath>,
    /// Why it is no answer.
    pub error: SolveError,
}

impl From<NoAnswer> for Error {
    fn from(none: NoAnswer) -> Self {
        none.error.into()
    }
}

/// Without the states, which fill pages where a program unwraps the result.
impl fmt::Debug for NoAnswer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("NoAnswer")
            .field("error", &self.error)
            .field("steps", &self.path.steps.len())
            .finish_non_exhaustive()
    }
}
