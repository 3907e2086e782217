//! Work against precision: one scene under many schemes.

use std::sync::Arc;
use std::time::Instant;

use crate::each::{Each, IntoEach};
use crate::error::{Error, Invalid, SolveError};
use crate::scene::{Scene, Scheme};

use super::clock::{Meter, Timed, count};
use super::quantity::Quantity;
use super::runs::{Run, Study};

/// What a quantity is compared with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reference {
    /// A value known from elsewhere.
    Given {
        /// The value.
        value: f64,
        /// Its own uncertainty, relative as errors are.
        uncertainty: f64,
    },
    /// The run with the most unknowns of all series, its uncertainty being its distance from the run
    /// before it in its series.
    Finest,
}

/// Repetitions of a run of less than [`SHORT`] seconds; the fastest counts, for other work on the machine only adds.
const REPEATS: usize = 20;

/// Repetitions of a longer run.
const REPEATS_LONG: usize = 5;

/// Seconds up to which a run is short.
const SHORT: f64 = 0.1;

/// Passes over all runs that the repetitions are shared out to: a busy moment of the machine then does not meet all
/// repetitions of a run.
const PASSES: usize = 5;

/// A scene, series of schemes, quantities with their references: runs each, and keeps error and time.
///
/// The error of a run is the *worst* error of all quantities, relative to the reference or to the size of
/// [`Quantity::relative_to`] where that is larger. A series is credited at each run
/// with the worst error of that run and of all finer ones behind it, so that the lucky zero crossing of a
/// signed error counts for nothing ([`Run::error_envelope`]).
#[derive(Clone)]
pub struct WorkPrecision<const D: usize> {
    name: String,
    scene: Scene<D>,
    quantities: Vec<(Quantity<D>, Reference)>,
    series: Vec<(String, Vec<Scheme>)>,
    repeats: Option<usize>,
}

/// A run while it is repeated.
struct Timing<'a> {
    scheme: &'a Scheme,
    run: Run,
    first: f64,
    seconds: Vec<f64>,
}

impl<const D: usize> WorkPrecision<D> {
    /// A study of a scene, without schemes or quantities yet.
    pub fn new(name: impl Into<String>, scene: Scene<D>) -> Self {
        WorkPrecision { name: name.into(), scene, quantities: Vec::new(), series: Vec::new(), repeats: None }
    }

    /// Adds a quantity and what it is compared with.
    pub fn quantity(mut self, quantity: Quantity<D>, reference: Reference) -> Self {
        self.quantities.push((quantity, reference));
        self
    }

    /// Adds a series of schemes, from coarse to fine.
    pub fn series(mut self, name: impl Into<String>, schemes: impl IntoIterator<Item = Scheme>) -> Self {
        self.series.push((name.into(), schemes.into_iter().collect()));
        self
    }

    /// Sets the repetitions of each run; otherwise 20, or 5 where one takes over 0.1 s, in up to five passes over all
    /// runs. Each pass warms short ones up first.
    pub fn repeated(mut self, repeats: usize) -> Self {
        self.repeats = Some(repeats.max(1));
        self
    }

    /// Runs every scheme and compares. An analysis that fails is kept as a run with its reason.
    ///
    /// # Errors
    /// Where there is nothing to run or to ask, or no run can serve as reference.
    pub fn run(&self) -> Result<Study, Error> {
        ensure!(
            !self.quantities.is_empty() && !self.series.iter().all(|(_, schemes)| schemes.is_empty()),
            SolveError::Empty {
                what: "schemes or quantities of a study",
                remedy: "add at least one quantity and one series"
            }
        );
        let mut timed: Vec<Timing<'_>> = Vec::new();
        for (name, schemes) in &self.series {
            timed.extend(schemes.iter().map(|scheme| self.first(name, scheme)));
        }
        for pass in 0..PASSES {
            for timing in &mut timed {
                self.repeat(pass, timing);
            }
        }
        let mut runs: Vec<Run> = timed.into_mapped(|Timing { mut run, first, seconds, .. }| {
            run.seconds = seconds.into_iter().reduce(f64::min).unwrap_or(first);
            run
        });
        let mut uncertainty: f64 = 0.0;
        for k in 0..self.quantities.len() {
            let (value, own) = self.reference(k, &runs)?;
            uncertainty = uncertainty.max(own);
            for run in runs.iter_mut().filter(|run| run.failure.is_none()) {
                run.errors.push(self.quantities[k].0.error(run.values[k], value));
            }
        }
        for run in runs.iter_mut().filter(|run| run.failure.is_none()) {
            run.error = run.errors.iter().fold(0.0, |worst, e| f64::max(worst, e.abs()));
        }
        let quantities = self.quantities.mapped(|(q, _)| q.name().to_string());
        let threads = crate::parallel::threads();
        let mut study = Study { name: self.name.clone(), quantities, runs: Vec::new(), uncertainty, threads };
        study.include(runs);
        Ok(study)
    }

    /// Value and relative uncertainty of a quantity's reference.
    fn reference(&self, quantity: usize, runs: &[Run]) -> Result<(f64, f64), Error> {
        let (requested, reference) = &self.quantities[quantity];
        requested.check_size()?;
        if let Reference::Given { value, uncertainty } = *reference {
            let is_sized = value != 0.0 || requested.size > 0.0;
            return if is_sized && value.is_finite() && uncertainty >= 0.0 && uncertainty.is_finite() {
                Ok((value, uncertainty))
            } else {
                let needed = "relative errors need a finite reference other than zero, or Quantity::relative_to, and a finite uncertainty of \
                              at least 0";
                Err(Invalid::new("reference of a quantity", value, needed).into())
            };
        }
        let solved = || runs.iter().filter(|run| run.failure.is_none());
        // The first of the largest: series given first are trusted first.
        let finest = solved().reduce(|best, run| if run.unknowns > best.unknowns { run } else { best });
        let before = finest.and_then(|finest| {
            solved()
                .filter(|run| run.series == finest.series && run.unknowns < finest.unknowns)
                .max_by_key(|run| run.unknowns)
        });
        match (finest, before) {
            (Some(finest), Some(before)) if finest.values[quantity] != 0.0 || requested.size > 0.0 => {
                let value = finest.values[quantity];
                Ok((value, requested.error(before.values[quantity], value).abs()))
            }
            _ => Err(SolveError::Empty {
                what: "runs to take a reference from",
                remedy: "the finest series needs two completed runs of different size with values other than zero, or \
                         Quantity::relative_to",
            }
            .into()),
        }
    }

    /// Runs one scheme for the first time, which tells how many repetitions it is worth.
    fn first<'a>(&self, series: &str, scheme: &'a Scheme) -> Timing<'a> {
        let mut run = Run { series: series.to_string(), ..Run::default() };
        let first = match self.once(scheme, &mut run) {
            Ok(first) => first,
            Err(error) => {
                run.failure = Some(error.to_string());
                f64::NAN
            }
        };
        Timing { scheme, run, first, seconds: Vec::new() }
    }

    /// The repetitions of one pass.
    fn repeat(&self, pass: usize, timing: &mut Timing<'_>) {
        let Timing { scheme, run, first, seconds } = timing;
        let short = *first < SHORT;
        let repeats = self.repeats.unwrap_or(if short { REPEATS } else { REPEATS_LONG });
        let count = repeats * (pass + 1) / PASSES - repeats * pass / PASSES;
        if run.failure.is_some() || count == 0 {
            return;
        }
        let mut phases = run.phases;
        // Other runs have been in the caches since.
        if short {
            drop(self.once(scheme, run));
        }
        for _ in 0..count {
            let Ok(taken) = self.once(scheme, run) else { continue };
            if seconds.iter().all(|other| taken < *other) {
                phases = run.phases;
            }
            seconds.push(taken);
        }
        run.phases = phases;
    }

    /// One analysis; its seconds.
    fn once(&self, scheme: &Scheme, run: &mut Run) -> Result<f64, Error> {
        let meter = Arc::new(Meter::default());
        let start = Instant::now();
        let mut problem = self.scene.discretize(scheme)?;
        let discretized = start.elapsed().as_secs_f64();
        let analysis = problem.analysis_mut();
        analysis.solver = Box::new(Timed { inner: analysis.solver.fresh(), meter: meter.clone() });
        let path = problem.run()?;
        let seconds = start.elapsed().as_secs_f64();
        run.phases = meter.phases(discretized, seconds - discretized);
        run.particles = problem.model().node_count();
        run.unknowns = count(&meter.unknowns);
        let tables = || problem.discrete_bodies().iter().map(|body| body.body().table());
        run.points = tables().map(|table| table.point_count()).sum();
        // A value and a row index per entry.
        run.bytes = tables().map(|table| table.bytes()).sum::<usize>() + 12 * count(&meter.entries);
        run.steps = path.steps.len();
        run.iterations = path.iterations;
        (run.factorizations, run.solutions) = (count(&meter.factorizations), count(&meter.solutions));
        let path = path.reached()?;
        run.values = self
            .quantities
            .iter()
            .map(|(quantity, _)| quantity.evaluate(&problem, path.last()))
            .collect::<Result<_, _>>()?;
        for (value, (quantity, _)) in run.values.iter().zip(&self.quantities) {
            quantity.check(*value)?;
        }
        Ok(seconds)
    }
}
