//! Watching the search for a model, and its own limits.

use std::ops::ControlFlow;
use std::time::Duration;

use crate::solve::{Iteration, MatrixUse, Observer, Step};

use super::answer::{Budget, Level};
use super::strategy::RUNAWAY;

/// Watches the search for a model: every iteration and step of each analysis, and each model that is solved.
///
/// ```
/// use std::ops::ControlFlow;
/// use rkpm::prelude::*;
/// use rkpm::study::{Budget, Level, Progress, Quantity, Tolerance, Verdict};
/// /// Ends the search after one model.
/// struct One;
/// impl Observer for One {}
/// impl Progress for One {
///     fn level(&mut self, level: &Level) -> ControlFlow<()> {
///         println!("{:?}: {:?}", level.counts, level.estimate);
///         ControlFlow::Break(())
///     }
/// }
/// let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
///     .hold((0, Side::Min)).traction((0, Side::Max), [0.0, 0.01]);
/// let requested = Tolerance::of(Quantity::energy(), 0.01);
/// let answer = scene.solve_within_by(&[Scheme::default()], &requested, Budget::default(), &mut One)?;
/// assert!(matches!(answer.verdict, Verdict::NotReached(_)) && answer.levels.len() == 1);
/// # Ok::<(), rkpm::Error>(())
/// ```
pub trait Progress: Observer {
    /// Called after each model; `Break` ends the search with what is known.
    fn level(&mut self, _level: &Level) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

impl Progress for () {}

/// Work that is never too much: thirty matrices of 500 unknowns.
const FREE: f64 = 3e5;
/// Matrices that any model may take: in space a finer one has several times the unknowns, whatever is planned.
const LEAST: f64 = 8.0;

/// The watch of a search, and the work it may do: factorisations times the power 3/2 of the unknowns, which each takes of
/// bodies in the plane.
pub(super) struct Limits<'a> {
    pub watch: &'a mut dyn Progress,
    /// Time of the search so far.
    clock: &'a dyn Fn() -> Duration,
    /// Most of it.
    pub time: Option<Duration>,
    /// Whether there is an answer: before, no time is too long.
    pub answered: bool,
    /// Work of all models of the search so far.
    pub spent: f64,
    /// Work at which the current model is given up.
    allowed: f64,
    /// Work of one factorisation of the current model.
    each: f64,
    /// Matrices of the first model, which nothing limits.
    first: f64,
    /// Whether a model was given up for its work.
    pub exceeded: bool,
}

impl<'a> Limits<'a> {
    pub(crate) fn new(watch: &'a mut dyn Progress, budget: Budget, clock: &'a dyn Fn() -> Duration) -> Self {
        let (allowed, time) = (f64::INFINITY, budget.time);
        Limits { watch, clock, time, answered: false, spent: 0.0, allowed, each: 0.0, first: 0.0, exceeded: false }
    }

    /// Why the search ends, once its time is used up.
    pub(crate) fn late(&self) -> Option<String> {
        let time = self.time.filter(|time| self.answered && (self.clock)() >= *time)?;
        Some(format!("the budget of {} s is used up", time.as_secs_f64()))
    }

    /// Once the unknowns of the next model are known; nothing is known to limit the first one.
    pub(crate) fn begin(&mut self, unknowns: usize) {
        self.exceeded = false;
        self.each = (unknowns as f64).powf(1.5);
        if self.spent == 0.0 {
            (self.first, self.allowed) = (0.0, f64::INFINITY);
            return;
        }
        // A history that is run anew takes as many as the first model, and some more.
        let most = (RUNAWAY * self.spent).max(FREE).max(LEAST.max(2.0 * self.first) * self.each);
        self.allowed = self.spent + most;
    }

    /// Counts one more matrix of the current model.
    pub(crate) fn matrix(&mut self) {
        self.spent += self.each;
        self.first += if self.allowed.is_infinite() { 1.0 } else { 0.0 };
    }
}

impl Observer for Limits<'_> {
    fn iteration(&mut self, iteration: &Iteration) -> ControlFlow<()> {
        let flow = self.watch.iteration(iteration);
        if iteration.matrix == MatrixUse::Formed {
            self.matrix();
        }
        if self.spent > self.allowed {
            self.exceeded = true;
            return ControlFlow::Break(());
        }
        if self.late().is_some() {
            return ControlFlow::Break(());
        }
        flow
    }

    fn step(&mut self, step: &Step) -> ControlFlow<()> {
        self.watch.step(step)
    }
}
