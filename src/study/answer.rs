//! Tolerance, budget and answer of a search for a model that is fine enough.

use std::time::Duration;

use crate::each::Each;
use crate::error::{Doubt, DoubtCause};
#[cfg(feature = "chart")]
use crate::order;
use crate::output::{Cell, Table};
use crate::scene::Problem;
use crate::solve::EquilibriumPath;

use super::quantity::Quantity;

/// What is to be known, and how well.
#[derive(Debug, Clone)]
pub struct Tolerance<const D: usize> {
    /// Largest relative error of each quantity (relative to its value, or see [`Quantity::relative_to`]).
    pub error: f64,
    /// The quantities requested.
    pub quantities: Vec<Quantity<D>>,
}

impl<const D: usize> Tolerance<D> {
    /// A quantity to a relative error.
    pub fn of(quantity: Quantity<D>, error: f64) -> Self {
        Tolerance { error, quantities: vec![quantity] }
    }

    /// One quantity more, to the same error.
    pub fn and(mut self, quantity: Quantity<D>) -> Self {
        self.quantities.push(quantity);
        self
    }
}

/// Where the search for a model ends without one: with the best answer so far and its bound, for the coarsest model is always solved.
///
/// ```
/// use std::time::Duration;
/// use rkpm::study::Budget;
/// // A minute, and half a gigabyte for the largest model.
/// let budget = Budget { time: Some(Duration::from_secs(60)), bytes: Some(500_000_000), ..Budget::default() };
/// assert_eq!(budget.levels, 12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Most displacement unknowns of a model.
    pub unknowns: usize,
    /// Most models that are solved.
    pub levels: usize,
    /// Most time of the whole search, where it is limited: a model under way then is given up, after the matrix that it is at. What
    /// is answered depends on the machine then.
    pub time: Option<Duration>,
    /// Most bytes of a model ([`Level::bytes`]), where they are limited: those of the next one are predicted from the last one. The coarsest
    /// model is not limited.
    pub bytes: Option<usize>,
}

impl Default for Budget {
    /// 50 000 unknowns, 12 models, whatever time and memory they take.
    fn default() -> Self {
        Budget { unknowns: 50_000, levels: 12, time: None, bytes: None }
    }
}

/// One model on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// What it approximates with: linear or quadratic particles, finite elements.
    pub functions: &'static str,
    /// Particles along each axis.
    pub counts: Vec<usize>,
    /// Displacement unknowns.
    pub unknowns: usize,
    /// Newton iterations, those of a first guess that led nowhere included, and of a model that was only compared with.
    pub iterations: usize,
    /// Seconds from particles to the solution.
    pub seconds: f64,
    /// Bytes of the bodies' tables, of the matrix and of its factors.
    pub bytes: usize,
    /// Values of the quantities requested, then the energy.
    pub values: Vec<f64>,
    /// What extrapolation adds to the values requested, in their units; zero for the first two models and in local refinement.
    pub corrections: Vec<f64>,
    /// Estimated relative error of the worst corrected value; none for the first model, and for the
    /// second one where values are extrapolated: their order is not known; none for one that does not come to rest.
    pub estimate: Option<f64>,
    /// What makes its last state doubtful; a model with doubts reaches no tolerance, and is not recommended.
    pub doubts: Vec<Doubt>,
}

impl Level {
    /// What is found to be wrong with its last state; that a solver can't tell whether it is stable is no finding.
    fn seen(&self) -> Option<&Doubt> {
        self.doubts.iter().find(|doubt| doubt.cause != DoubtCause::StabilityUnknown)
    }
}

/// Whether the tolerance was met.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// The bound of the last model is below the tolerance.
    Reached,
    /// It is not; why the search ended. The answer is the model with the least bound.
    NotReached(String),
}

/// The answer to a tolerance: the model, its solution, the values extrapolated from its series, and the way there.
pub struct Answer<const D: usize> {
    /// Whether the tolerance was met.
    pub verdict: Verdict,
    /// The bound given for the relative error of the worst of [`values`](Answer::values).
    pub bound: f64,
    /// The model of the answer.
    pub problem: Problem<D>,
    /// Its solution; where it was corrected from a coarser one, a path of one step.
    pub path: EquilibriumPath,
    /// Models of the approximation that was chosen, from coarse to fine; the last one is that of the answer.
    pub levels: Vec<Level>,
    /// Which approximation was chosen, and why.
    pub choice: String,
    /// Models of other approximations, and finer ones whose bound is larger.
    pub tried: Vec<Level>,
    /// Whether the model is at rest only as far as comparisons need.
    pub(super) rough: bool,
    /// The quantities requested.
    pub(super) requested: Vec<Quantity<D>>,
    /// Their corrected values.
    pub(super) values: Vec<f64>,
    /// Dual solutions of the model, quantity by quantity, that of the energy last.
    pub(super) duals: Vec<Option<Vec<f64>>>,
}

impl<const D: usize> Answer<D> {
    /// Values of the quantities requested, $q_n + c$: those of the model and their extrapolation
    /// ([`Level::corrections`], [`Scene::solve_within_by`](crate::scene::Scene::solve_within_by)), to which
    /// [`bound`](Answer::bound) refers. Fields and forces of [`problem`](Answer::problem) are those of the model alone.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// What the values of the last model were corrected by.
    pub(super) fn corrections(&self) -> Vec<f64> {
        let own = self.levels.last().map_or(&[][..], |level| &level.values);
        self.values.paired(own, |corrected, own| corrected - own)
    }

    /// Whether the tolerance was met.
    pub fn reached(&self) -> bool {
        self.verdict == Verdict::Reached
    }

    /// Seconds of all models together.
    pub fn seconds(&self) -> f64 {
        self.levels.iter().chain(&self.tried).map(|level| level.seconds).sum()
    }

    /// All models that were solved: those of the kind that was chosen, then the others.
    fn all(&self) -> impl Iterator<Item = &Level> {
        self.levels.iter().chain(&self.tried)
    }

    /// Why a model that was solved is no answer, and which one tells it: its own last state is in doubt, or that of a finer model, the finest of
    /// its kind, which may see what the others overlook: parts that pass through one another, surfaces that are unstable.
    fn refuted<'a>(&'a self, level: &'a Level) -> Option<(&'a Level, &'a Doubt)> {
        let own = level.doubts.first().map(|doubt| (level, doubt));
        let is_finest = |finer: &&Level| {
            !self.all().any(|other| other.functions == finer.functions && other.unknowns > finer.unknowns)
        };
        let mut finer = self.all().filter(|finer| finer.unknowns > level.unknowns).filter(is_finest);
        own.or_else(|| finer.find_map(|finer| Some((finer, finer.seen()?))))
    }

    /// Why the model of the answer is none.
    pub(super) fn doubted(&self) -> Option<String> {
        let (level, doubt) = self.refuted(self.levels.last()?)?;
        Some(format!("{} of {} unknowns: {doubt}", level.functions, level.unknowns))
    }

    /// The model of the fewest unknowns, of all that were solved, whose [`estimate`](Level::estimate) is below a tolerance and whose state is
    /// not in doubt, by itself or by the finest model of a kind; none where there is no such model. A search for a tight tolerance so tells
    /// what looser ones take. The estimate is that of its values with their [`corrections`](Level::corrections): the model run by itself is
    /// off by these, too.
    pub fn recommended(&self, tolerance: f64) -> Option<&Level> {
        let sufficient = self.all().filter(|level| level.estimate.is_some_and(|estimate| estimate < tolerance));
        sufficient.filter(|level| self.refuted(level).is_none()).min_by_key(|level| level.unknowns)
    }

    /// What each model is made of, particles, unknowns, iterations, seconds, bytes and estimates, a row per model, those of other kinds last: error
    /// against cost.
    pub fn table(&self) -> Table {
        let mut table = Table::new(["functions", "counts", "unknowns", "iterations", "seconds", "bytes", "estimate"]);
        table.rows.extend(self.all().map(|level| {
            let counts: Vec<String> = level.counts.mapped(usize::to_string);
            vec![
                Cell::from(level.functions),
                Cell::from(counts.join(" × ")),
                Cell::from(level.unknowns),
                Cell::from(level.iterations),
                Cell::from(level.seconds),
                Cell::from(level.bytes),
                Cell::from(level.estimate),
            ]
        }));
        table
    }
}

#[cfg(feature = "chart")]
impl<const D: usize> Answer<D> {
    /// Estimated errors of the worst quantity over unknowns, a curve for each kind of models, with the tolerance to be met and the model
    /// [`recommended`](Answer::recommended) for it.
    pub fn chart(&self, tolerance: f64) -> crate::output::Chart {
        let mut chart = crate::output::Chart::new("A model that is just fine enough")
            .x_log("unknowns")
            .y_log("estimated relative error");
        let point = |level: &Level| Some([level.unknowns as f64, level.estimate.filter(|estimate| *estimate > 0.0)?]);
        let mut kinds: Vec<&'static str> = Vec::new();
        for level in self.all() {
            if !kinds.contains(&level.functions) {
                kinds.push(level.functions);
                let own = self.all().filter(|other| other.functions == level.functions);
                let mut points: Vec<[f64; 2]> = own.filter_map(point).collect();
                order::sort(&mut points, &|a, b| a[0].total_cmp(&b[0]));
                chart = chart.marked_line(level.functions, &points);
            }
        }
        if let Some(recommended) = self.recommended(tolerance).and_then(point) {
            chart = chart.markers("recommended", &[recommended]);
        }
        chart.horizontal("tolerance", tolerance)
    }
}
