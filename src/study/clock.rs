//! Where the time goes: a linear solver that is timed from outside.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use crate::assembly::Pattern;
use crate::error::LinearError;
use crate::linear::{Inertia, LinearSolver, LinearSystem, MatrixClass};

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

/// Nanoseconds spent in the linear solver, and the size of what it was given.
#[derive(Debug, Default)]
pub(super) struct Meter {
    analyze: AtomicU64,
    factorize: AtomicU64,
    solve: AtomicU64,
    pub(super) factorizations: AtomicU64,
    pub(super) solutions: AtomicU64,
    pub(super) unknowns: AtomicU64,
    /// Of the lower triangles.
    pub(super) entries: AtomicU64,
}

impl Meter {
    /// Seconds by phase, of an analysis that took `run` seconds after `discretize` seconds of preparation.
    pub(crate) fn phases(&self, discretize: f64, run: f64) -> Phases {
        let seconds = |counter: &AtomicU64| count(counter) as f64 * 1e-9;
        let (analyze, factorize, solve) = (seconds(&self.analyze), seconds(&self.factorize), seconds(&self.solve));
        Phases { discretize, analyze, factorize, solve, assemble: (run - analyze - factorize - solve).max(0.0) }
    }
}

/// What a counter has counted.
pub(super) fn count(counter: &AtomicU64) -> usize {
    counter.load(Ordering::Relaxed) as usize
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

impl LinearSolver for Timed {
    fn fresh(&self) -> Box<dyn LinearSolver> {
        Box::new(Timed { inner: self.inner.fresh(), meter: self.meter.clone() })
    }

    fn analyze(&mut self, pattern: &Pattern, class: MatrixClass, order: Option<&[usize]>) -> Result<(), LinearError> {
        self.meter.unknowns.store(pattern.size() as u64, Ordering::Relaxed);
        self.meter.entries.store(pattern.entries() as u64, Ordering::Relaxed);
        timed(&self.meter.analyze, || self.inner.analyze(pattern, class, order))
    }

    fn factorize(&mut self, system: &LinearSystem<'_>) -> Result<Option<Inertia>, LinearError> {
        self.meter.factorizations.fetch_add(1, Ordering::Relaxed);
        timed(&self.meter.factorize, || self.inner.factorize(system))
    }

    fn solve(
        &mut self,
        system: &LinearSystem<'_>,
        rhs: &mut [f64],
        pressures: Option<&mut [[f64; 4]]>,
    ) -> Result<f64, LinearError> {
        self.meter.solutions.fetch_add(1, Ordering::Relaxed);
        timed(&self.meter.solve, || self.inner.solve(system, rhs, pressures))
    }

    fn keeps_pressures(&self) -> bool {
        self.inner.keeps_pressures()
    }

    fn krylov_iterations(&self) -> Vec<usize> {
        self.inner.krylov_iterations()
    }

    fn release(&mut self) {
        self.inner.release();
    }

    fn bytes(&self) -> Option<usize> {
        self.inner.bytes()
    }
}
