//! The runs of a study: their table, front and chart.

#[cfg(feature = "chart")]
use crate::each::Each;
use crate::order;
#[cfg(feature = "chart")]
use crate::output::chart::{Chart, Colour, Marker, Series, Stroke};
use crate::output::{Cell, Table};

use super::clock::Phases;

/// One scheme's run.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// The series it belongs to.
    pub series: String,
    /// Particles or nodes.
    pub particles: usize,
    /// Unknowns of the linear systems, multipliers included.
    pub unknowns: usize,
    /// Integration points of the body.
    pub points: usize,
    /// Converged steps.
    pub steps: usize,
    /// Newton iterations, those of rejected steps included.
    pub iterations: usize,
    /// Matrices that were factorised: fewer than iterations where factors are kept.
    pub factorizations: usize,
    /// Right-hand sides that were solved for with them.
    pub solutions: usize,
    /// Bytes of the body's table and of the matrix, without its factor.
    pub bytes: usize,
    /// Seconds of the whole analysis from particles to the last state: the fastest of the repetitions.
    pub seconds: f64,
    /// Seconds by phase, of the same repetition.
    pub phases: Phases,
    /// Values of the quantities; empty where the analysis failed.
    pub values: Vec<f64>,
    /// Signed errors of the quantities, relative to their references or sizes; empty where the analysis failed.
    pub errors: Vec<f64>,
    /// The largest of their magnitudes; NaN where the analysis failed.
    pub error: f64,
    /// The largest `error` of this run and of those behind it in its series.
    pub error_envelope: f64,
    /// Why the analysis failed, where it did.
    pub failure: Option<String>,
}

impl Default for Run {
    /// Nothing measured yet.
    fn default() -> Self {
        Run {
            series: String::new(),
            particles: 0,
            unknowns: 0,
            points: 0,
            steps: 0,
            iterations: 0,
            factorizations: 0,
            solutions: 0,
            bytes: 0,
            seconds: f64::NAN,
            phases: Phases::default(),
            values: Vec::new(),
            errors: Vec::new(),
            error: f64::NAN,
            error_envelope: f64::NAN,
            failure: None,
        }
    }
}

/// What a [`WorkPrecision`](super::WorkPrecision) found.
#[derive(Debug, Clone, PartialEq)]
pub struct Study {
    /// The name of the problem.
    pub name: String,
    /// Names of the quantities.
    pub quantities: Vec<String>,
    /// The runs, series by series, in the order in which they were given.
    pub runs: Vec<Run>,
    /// Largest relative uncertainty of the references: below it nothing is claimed.
    pub uncertainty: f64,
    /// Threads at work.
    pub threads: usize,
}

impl Study {
    /// Takes in runs of any origin (another program's, say), each series from coarse to fine, and credits
    /// every run anew.
    pub fn include(&mut self, runs: impl IntoIterator<Item = Run>) {
        self.runs.extend(runs);
        for last in (0..self.runs.len()).rev() {
            let behind = self.runs[last + 1..]
                .iter()
                .find(|run| run.series == self.runs[last].series && run.error_envelope.is_finite());
            let worst = behind.map_or(0.0, |run| run.error_envelope);
            let run = &mut self.runs[last];
            run.error_envelope = if run.error.is_finite() { run.error.max(worst) } else { f64::NAN };
        }
    }

    /// Seconds of the cheapest run of a series that is credited with at most this error.
    pub fn seconds_at(&self, series: &str, error: f64) -> Option<f64> {
        let runs = self.runs.iter().filter(|run| run.series == series && run.error_envelope <= error);
        runs.map(|run| run.seconds).min_by(f64::total_cmp)
    }

    /// The columns `problem, scheme, particles, unknowns, steps, iterations, factorizations, solutions, error, seconds`, a
    /// row per run; `error` is that of the run itself.
    pub fn points(&self) -> Table {
        let mut table = Table::new([
            "problem",
            "scheme",
            "particles",
            "unknowns",
            "steps",
            "iterations",
            "factorizations",
            "solutions",
            "error",
            "seconds",
        ]);
        table.rows.extend(self.runs.iter().map(|run| {
            let words = [Cell::from(self.name.as_str()), Cell::from(run.series.as_str())];
            let sizes = [run.particles, run.unknowns, run.steps];
            let counts = sizes.into_iter().chain([run.iterations, run.factorizations, run.solutions]).map(Cell::from);
            words.into_iter().chain(counts).chain([run.error, run.seconds].map(Cell::from)).collect()
        }));
        table
    }

    /// All that was recorded: the signed error of each quantity, seconds by phase, points, bytes, failures.
    pub fn table(&self) -> Table {
        let mut table = self.points();
        table.header.extend(self.quantities.iter().map(|name| format!("error of {name}")));
        let phases = ["discretize_s", "analyze_s", "factorize_s", "solve_s", "assemble_s"];
        table.header.extend(["error_envelope", "points", "bytes"].iter().chain(&phases).map(|name| name.to_string()));
        table.header.push("failure".into());
        for (row, run) in table.rows.iter_mut().zip(&self.runs) {
            row.extend((0..self.quantities.len()).map(|k| Cell::from(run.errors.get(k).copied())));
            row.extend([Cell::from(run.error_envelope), Cell::from(run.points), Cell::from(run.bytes)]);
            let Phases { discretize, analyze, factorize, solve, assemble } = run.phases;
            row.extend([discretize, analyze, factorize, solve, assemble].map(Cell::from));
            row.push(Cell::from(run.failure.clone()));
        }
        table
    }

    /// The runs that no other run beats in both time and credited error, by rising time.
    pub fn front(&self) -> Vec<&Run> {
        let mut runs: Vec<&Run> = self.runs.iter().filter(|run| run.error_envelope.is_finite()).collect();
        order::sort(&mut runs, &|a, b| {
            a.seconds.total_cmp(&b.seconds).then(a.error_envelope.total_cmp(&b.error_envelope))
        });
        let mut best = f64::INFINITY;
        runs.retain(|run| {
            let better = run.error_envelope < best;
            best = best.min(run.error_envelope);
            better
        });
        runs
    }

    /// Credited error over seconds, log-log: a line per series, the front dashed, and a grey band up to the
    /// uncertainty of the references, within which nothing is claimed.
    #[cfg(feature = "chart")]
    pub fn chart(&self) -> Chart {
        let threads = if self.threads == 1 { "1 thread".to_string() } else { format!("{} threads", self.threads) };
        let mut chart = Chart::new(format!("{}, {threads}", self.name))
            .x_log("seconds of the whole analysis")
            .y_log("worst relative error")
            .names_beside_curves();
        let drawn = || self.runs.iter().filter(|run| run.error_envelope > 0.0 && run.seconds > 0.0);
        let least = drawn().map(|run| run.error_envelope).fold(f64::INFINITY, f64::min);
        if self.uncertainty > 0.0 && least.is_finite() {
            // Deep enough to be seen, not so deep that it takes the chart.
            let lower = (0.5 * least).min(0.5 * self.uncertainty);
            chart = chart.band("uncertainty of the reference", lower, self.uncertainty);
        }
        let front: Vec<[f64; 2]> = self.front().mapped(|run| [run.seconds, run.error_envelope]);
        let stairs: Vec<[f64; 2]> =
            front.windows(2).flat_map(|w| [w[0], [w[1][0], w[0][1]]]).chain(front.last().copied()).collect();
        chart = chart.with(Series::line("front", &stairs).stroke(Stroke::Dashed).colour(Colour::Grey));
        let mut names: Vec<&str> = Vec::new();
        for run in drawn() {
            if !names.contains(&run.series.as_str()) {
                names.push(&run.series);
            }
        }
        let first = names.first().copied();
        for name in names {
            let points: Vec<[f64; 2]> =
                drawn().filter(|run| run.series == name).map(|run| [run.seconds, run.error_envelope]).collect();
            // The first series is what the others are compared with.
            let colour = if Some(name) == first { Colour::Black } else { Colour::Automatic };
            chart = chart.with(Series::line(name, &points).marker(Marker::Automatic).colour(colour));
        }
        chart
    }
}
