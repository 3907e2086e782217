//! Where the time goes: a linear solver that is timed from outside.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use crate::assembly::{Pattern, StateRef};
use crate::error::LinearError;
use crate::linear::{Factorizer, Factors, Inertia, LinearSolver, Linearised, MatrixClass};

/// Seconds of one analysis by phase.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Phases {
    /// Particles, cells, tables, rows, terms.
    pub discretize: f64,
    /// Symbolic factorisation, once.
    pub analyze: f64,
    /// Numeric factorisations.
    pub factorize: f64,
    /// Triangular solves.
    pub solve: f64,
    /// Patterns, assembly, enforcement, step limiter, energy: the rest.
    pub assemble: f64,
}

impl Phases {
    /// Seconds of the whole analysis, from particles to the last state.
    pub(crate) fn total(&self) -> f64 {
        self.discretize + self.analyze + self.factorize + self.solve + self.assemble
    }
}

/// Nanoseconds spent in the linear solver, and the size of what it was given.
#[derive(Debug, Default)]
pub(super) struct Meter {
    analyze: AtomicU64,
    factorize: AtomicU64,
    solve: AtomicU64,
    factorizations: AtomicU64,
    solutions: AtomicU64,
    unknowns: AtomicU64,
    entries: AtomicU64,
}

impl Meter {
    /// Seconds by phase, of an analysis that took `run` seconds after `discretize` seconds of preparation.
    pub(crate) fn phases(&self, discretize: f64, run: f64) -> Phases {
        let seconds = |counter: &AtomicU64| counter.load(Ordering::Relaxed) as f64 * 1e-9;
        let (analyze, factorize, solve) = (seconds(&self.analyze), seconds(&self.factorize), seconds(&self.solve));
        Phases { discretize, analyze, factorize, solve, assemble: (run - analyze - factorize - solve).max(0.0) }
    }

    /// Matrices that were factorised.
    pub(crate) fn factorizations(&self) -> usize {
        self.factorizations.load(Ordering::Relaxed) as usize
    }

    /// Right-hand sides that were solved for.
    pub(crate) fn solutions(&self) -> usize {
        self.solutions.load(Ordering::Relaxed) as usize
    }

    /// Unknowns of the systems that were solved.
    pub(crate) fn unknowns(&self) -> usize {
        self.unknowns.load(Ordering::Relaxed) as usize
    }

    /// Entries of their lower triangles.
    pub(crate) fn entries(&self) -> usize {
        self.entries.load(Ordering::Relaxed) as usize
    }
}

/// Adds the time of a call to a counter.
fn timed<T>(counter: &AtomicU64, call: impl FnOnce() -> T) -> T {
    let start = Instant::now();
    let result = call();
    counter.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
    result
}

/// A solver whose time is taken.
pub(super) struct Timed {
    pub inner: Box<dyn LinearSolver>,
    pub meter: Arc<Meter>,
}

struct TimedFactorizer {
    inner: Box<dyn Factorizer>,
    meter: Arc<Meter>,
}

struct TimedFactors<'a> {
    inner: Box<dyn Factors + 'a>,
    meter: &'a Meter,
}

impl LinearSolver for Timed {
    fn analyze(
        &self,
        pattern: &Pattern,
        class: MatrixClass,
        order: Option<&[usize]>,
    ) -> Result<Box<dyn Factorizer>, LinearError> {
        self.meter.unknowns.store(pattern.size() as u64, Ordering::Relaxed);
        self.meter.entries.store(pattern.entries() as u64, Ordering::Relaxed);
        let inner = timed(&self.meter.analyze, || self.inner.analyze(pattern, class, order))?;
        Ok(Box::new(TimedFactorizer { inner, meter: self.meter.clone() }))
    }

    fn keeps_pressures(&self) -> bool {
        self.inner.keeps_pressures()
    }

    fn krylov_iterations(&self) -> Vec<usize> {
        self.inner.krylov_iterations()
    }
}

impl Factorizer for TimedFactorizer {
    fn factorize<'a>(&'a mut self, values: &'a [f64]) -> Result<Box<dyn Factors + 'a>, LinearError> {
        let meter = &*self.meter;
        meter.factorizations.fetch_add(1, Ordering::Relaxed);
        let inner = timed(&meter.factorize, || self.inner.factorize(values))?;
        Ok(Box::new(TimedFactors { inner, meter }))
    }

    fn factorize_at<'a>(
        &'a mut self,
        system: Linearised<'a>,
        at: StateRef<'_>,
    ) -> Result<Box<dyn Factors + 'a>, LinearError> {
        let meter = &*self.meter;
        meter.factorizations.fetch_add(1, Ordering::Relaxed);
        let inner = timed(&meter.factorize, || self.inner.factorize_at(system, at))?;
        Ok(Box::new(TimedFactors { inner, meter }))
    }

    fn release(&mut self) {
        self.inner.release();
    }

    fn bytes(&self) -> Option<usize> {
        self.inner.bytes()
    }
}

impl Factors for TimedFactors<'_> {
    fn solve_in_place(&self, rhs: &mut [f64]) -> Result<(), LinearError> {
        self.meter.solutions.fetch_add(1, Ordering::Relaxed);
        timed(&self.meter.solve, || self.inner.solve_in_place(rhs))
    }

    fn inertia(&self) -> Option<Inertia> {
        self.inner.inertia()
    }

    fn solve_apart(&self, rhs: &mut [f64], pressures: &mut [[f64; 4]]) -> Result<(), LinearError> {
        self.meter.solutions.fetch_add(1, Ordering::Relaxed);
        timed(&self.meter.solve, || self.inner.solve_apart(rhs, pressures))
    }

    fn relative_residual(&self) -> f64 {
        self.inner.relative_residual()
    }
}
