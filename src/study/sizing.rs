//! A tolerance in, the smallest sufficient model out.

use std::time::Instant;

use crate::error::{Error, GeometryError, SolveError};
use crate::output::{Cell, Table};
use crate::scene::{Problem, Scene, Scheme};
use crate::solve::{Ending, Path};

use super::quantity::Quantity;

/// What is to be known, and how well.
#[derive(Debug, Clone)]
pub struct Tolerance<const D: usize> {
    /// Largest relative error of each quantity.
    pub error: f64,
    /// The quantities asked for.
    pub quantities: Vec<Quantity<D>>,
}

impl<const D: usize> Tolerance<D> {
    /// The stored energy to a relative error.
    pub fn energy(error: f64) -> Self {
        Tolerance::of(Quantity::energy(), error)
    }

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

/// Where the search for a model ends without one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Most displacement unknowns of a model.
    pub unknowns: usize,
    /// Most models that are solved.
    pub levels: usize,
}

impl Default for Budget {
    /// 50 000 unknowns, 12 models.
    fn default() -> Self {
        Budget { unknowns: 50_000, levels: 12 }
    }
}

/// One model on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// Particles along each axis.
    pub counts: Vec<usize>,
    /// Displacement unknowns.
    pub unknowns: usize,
    /// Newton iterations, those of a first guess that led nowhere included.
    pub iterations: usize,
    /// Seconds from particles to the solution.
    pub seconds: f64,
    /// Values of the quantities asked for, then the energy.
    pub values: Vec<f64>,
    /// Estimated relative error of the worst quantity; none for the first model.
    pub estimate: Option<f64>,
}

/// Whether the tolerance was met.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// The estimate of the last model is below the tolerance.
    Reached,
    /// It is not; why the search ended. The last model is the best there is.
    NotReached(String),
}

/// The answer to a tolerance: the last model, its solution, and the way there.
pub struct Answer<const D: usize> {
    /// Whether the tolerance was met.
    pub verdict: Verdict,
    /// The bound given for the relative error of the worst quantity of the last model.
    pub bound: f64,
    /// The last model.
    pub problem: Problem<D>,
    /// Its solution; where it was corrected from a coarser one, a path of one step.
    pub path: Path,
    /// All models, from coarse to fine.
    pub levels: Vec<Level>,
}

impl<const D: usize> Answer<D> {
    /// Values of the quantities asked for.
    pub fn values(&self) -> &[f64] {
        let values = self.levels.last().map_or(&[][..], |level| &level.values);
        // The energy that stands behind them served the estimate.
        &values[..values.len().saturating_sub(1)]
    }

    /// Whether the tolerance was met.
    pub fn reached(&self) -> bool {
        self.verdict == Verdict::Reached
    }

    /// Seconds of all models together.
    pub fn seconds(&self) -> f64 {
        self.levels.iter().map(|level| level.seconds).sum()
    }

    /// Particles, unknowns, iterations, seconds and estimates, a row per model.
    pub fn table(&self) -> Table {
        let mut table = Table::new(["counts", "unknowns", "iterations", "seconds", "estimate"]);
        table.rows.extend(self.levels.iter().map(|level| {
            let counts: Vec<String> = level.counts.iter().map(usize::to_string).collect();
            let counts = Cell::from(counts.join(" × "));
            let numbers = [Cell::from(level.unknowns), Cell::from(level.iterations), Cell::from(level.seconds)];
            [counts].into_iter().chain(numbers).chain([Cell::from(level.estimate)]).collect()
        }));
        table
    }
}

#[cfg(feature = "chart")]
impl<const D: usize> Answer<D> {
    /// Estimates over unknowns, model by model, and the tolerance to be met.
    pub fn chart(&self, tolerance: f64) -> crate::output::Chart {
        let estimated = self.levels.iter().filter_map(|level| Some([level.unknowns as f64, level.estimate?]));
        crate::output::Chart::new("A model that is just fine enough")
            .x_log("unknowns")
            .y_log("estimated relative error")
            .marked_line("models", &estimated.collect::<Vec<_>>())
            .horizontal("tolerance", tolerance)
    }
}

/// Cells across the shortest side of the first model of a compact body.
pub(super) const FIRST_ACROSS: f64 = 3.0;
/// Spacings across the first model of a drawn shape, as if it were a square.
const FIRST_SCATTERED: f64 = 6.0;
/// Cells along the longest side of the first model of a thin body.
const FIRST_ALONG: f64 = 6.0;
/// A body whose sides differ by more than this factor is thin: it is refined along itself first.
pub(super) const THIN: f64 = 8.0;
/// Sides that differ by less than this factor get as many cells each.
const ALIKE: f64 = 2.0;
/// Spacing across a thin body relative to that along it: bending varies along, hardly across.
const ACROSS: f64 = 2.0;
/// The second model's spacing relative to the first: close enough to be cheap, far enough to tell.
const FIRST_FACTOR: f64 = 4.0 / 3.0;
/// Bounds of all later factors.
const FACTORS: [f64; 2] = [1.2, 2.0];
/// The next model aims at this part of the tolerance.
const AIM: f64 = 0.8;
/// Assumed order of convergence: corners of rubber parts allow no more.
const ORDER: f64 = 1.0;
/// An estimate falls at most with this power of the spacing: a difference that is small by accident does not count.
const STEEPEST: f64 = 1.5;

impl<const D: usize> Scene<D> {
    /// Solves the scene with the cheapest model found sufficient under the default scheme, see
    /// [`solve_within_by`](Scene::solve_within_by).
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// use rkpm::study::{Budget, Quantity, Tolerance};
    /// let rubber = Rubber::neo_hookean(0.5, 1e3)?; // MPa
    /// // A bearing pad of 40 × 10 mm between plates, sheared by 5 mm.
    /// let bearing = Scene::new(Block::new([0.0, 0.0], [40.0, 10.0]), PlaneStrain, rubber)
    ///     .hold((1, Side::Min))
    ///     .prescribe((1, Side::Max), 0, 5.0)
    ///     .prescribe((1, Side::Max), 1, 0.0);
    /// let force = Quantity::reaction("u_0 on face (1, Max)", 0);
    /// let answer = bearing.solve_within(&Tolerance::of(force, 0.02), Budget::default())?;
    /// println!("{:.3} N/mm ± {:.1} %, {} models", answer.values()[0], 100.0 * answer.bound, answer.levels.len());
    /// # #[cfg(feature = "chart")]
    /// # let directory = std::env::temp_dir().join("rkpm-sizing");
    /// # #[cfg(feature = "chart")]
    /// answer.chart(0.02).write(directory.join("bearing.svg"))?;
    /// # assert!(answer.reached() && answer.bound < 0.02);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`solve_within_by`](Scene::solve_within_by).
    pub fn solve_within(&self, tolerance: &Tolerance<D>, budget: Budget) -> Result<Answer<D>, Error> {
        self.solve_within_by(&Scheme::default(), tolerance, budget)
    }

    /// Solves the scene with the cheapest model found sufficient under a scheme, whose number of particles
    /// is chosen here.
    ///
    /// Nested iteration: the coarsest model is solved, each finer one corrected from it. With
    /// $\delta_k = \max_q|q_k/q_{k-1} - 1|$ and $f$ the ratio of the spacings the estimate is
    /// $$e_k = \max\Big(\frac{\delta_k}{f - 1},\ e_{k-1}\,f^{-3/2}\Big),$$
    /// first order assumed, because corners allow no more, and no faster fall believed. The energy is always
    /// looked at: where it was not asked for, its change counts in proportion to what the quantities changed
    /// beside it between the first two models, so that a quantity that crosses its limit by accident passes
    /// for nothing. At least three models are solved; the next one aims at eight tenths of the tolerance and
    /// has at most half the spacing.
    ///
    /// # Errors
    /// For a tolerance that is not between 0 and 1 or asks for nothing, and where a model can't be built or
    /// the coarsest one can't be solved.
    pub fn solve_within_by(
        &self,
        scheme: &Scheme,
        tolerance: &Tolerance<D>,
        budget: Budget,
    ) -> Result<Answer<D>, Error> {
        check(tolerance)?;
        let sides = Sides::of(self)?;
        let mut fineness = 1.0;
        let mut answer: Option<Answer<D>> = None;
        let mut counts = sides.counts(fineness);
        loop {
            let solved = solve(self, scheme.clone().particles(counts.clone()), &counts, tolerance, answer.as_ref());
            let mut next = match follow(solved, &mut answer, &counts)? {
                Ok(next) => next,
                Err(best) => return Ok(*best),
            };
            let before = answer.take().map(|answer| answer.levels).unwrap_or_default();
            if let (Some(level), Some(last)) = (next.levels.first_mut(), before.last()) {
                let first = before.first().zip(before.get(1)).unwrap_or((last, &*level));
                let factor = sides.spacing(&last.counts) / sides.spacing(&level.counts);
                let estimate = estimate(first, last, level, factor);
                level.estimate = Some(estimate);
                next.bound = estimate;
            }
            next.levels.splice(0..0, before);
            if next.levels.len() >= 3 && next.bound < tolerance.error {
                next.verdict = Verdict::Reached;
                return Ok(next);
            }
            // Models that round to the same counts are skipped.
            let factor = match next.levels.len() {
                1 => FIRST_FACTOR,
                _ => (next.bound / (AIM * tolerance.error)).powf(1.0 / ORDER).clamp(FACTORS[0], FACTORS[1]),
            };
            while sides.counts(fineness * factor) == counts {
                fineness *= 1.05;
            }
            fineness *= factor;
            counts = sides.counts(fineness);
            let unknowns = counts.iter().fold(D, |n, &c| n.saturating_mul(c));
            let why = if next.levels.len() >= budget.levels {
                format!("the budget of {} models is used up", budget.levels)
            } else if unknowns > budget.unknowns {
                format!("the next model has {unknowns} unknowns, the budget allows {}", budget.unknowns)
            } else {
                answer = Some(next);
                continue;
            };
            next.verdict = Verdict::NotReached(why);
            return Ok(next);
        }
    }
}

/// Refuses tolerances that can't be met or ask for nothing.
pub(super) fn check<const D: usize>(tolerance: &Tolerance<D>) -> Result<(), Error> {
    if !(tolerance.error > 0.0 && tolerance.error < 1.0) {
        let needed = "give a relative error between 0 and 1";
        return Err(SolveError::Setting { what: "tolerance", value: tolerance.error, needed }.into());
    }
    if tolerance.quantities.is_empty() {
        let remedy = "name at least one quantity; Tolerance::energy is one";
        return Err(SolveError::Empty { what: "quantities of a tolerance", remedy }.into());
    }
    Ok(())
}

/// The next model, or the best so far where the next one failed; an error where there is none.
#[allow(clippy::type_complexity)] // Said once, in the line above.
pub(super) fn follow<const D: usize>(
    solved: Result<Answer<D>, Error>,
    answer: &mut Option<Answer<D>>,
    counts: &[usize],
) -> Result<Result<Answer<D>, Box<Answer<D>>>, Error> {
    match (solved, answer.take()) {
        (Ok(next), before) => {
            *answer = before;
            Ok(Ok(next))
        }
        // What is known stays known.
        (Err(error), Some(mut best)) => {
            let particles: Vec<String> = counts.iter().map(usize::to_string).collect();
            let why = format!("the model of {} particles failed: {error}", particles.join(" × "));
            best.verdict = Verdict::NotReached(why);
            Ok(Err(Box::new(best)))
        }
        (Err(error), None) => Err(error),
    }
}

/// Lengths of the sides of a body's unit cube, and how they are divided.
struct Sides<const D: usize> {
    lengths: [f64; D],
    first: f64,
    /// Longest side of those that count as thickness.
    thin: f64,
}

impl<const D: usize> Sides<D> {
    fn of(scene: &Scene<D>) -> Result<Self, Error> {
        if scene.is_scattered() {
            // A drawn shape takes the product of the counts as its number of particles.
            return Ok(Sides { lengths: [1.0; D], first: 1.0 / FIRST_SCATTERED, thin: 0.0 });
        }
        let needed = "a scene on a block, mapped block or drawn region, whose particles can be chosen";
        let lengths = scene.side_lengths().ok_or(GeometryError::Unsuited { what: "sizing to a tolerance", needed })?;
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        let shortest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
        let first = if longest > THIN * shortest { longest / FIRST_ALONG } else { shortest / FIRST_ACROSS };
        // Sides that are nearly alike are taken as equal to the shortest, in favour of cells of any shape.
        let lengths = lengths.map(|l| if l < ALIKE * shortest { shortest } else { l });
        Ok(Sides { lengths, first, thin: longest / THIN })
    }

    /// Particles along each axis for a spacing `fineness` times finer than the first.
    fn counts(&self, fineness: f64) -> Vec<usize> {
        let spacing = self.first / fineness;
        let cells = |&length: &f64| {
            let coarser = if length < self.thin { ACROSS } else { 1.0 };
            (length / (coarser * spacing)).round().max(1.0)
        };
        self.lengths.iter().map(|length| cells(length).min(1e7) as usize + 1).collect()
    }

    /// The largest spacing of counts.
    fn spacing(&self, counts: &[usize]) -> f64 {
        let along = self.lengths.iter().zip(counts).filter(|(length, _)| **length >= self.thin);
        along.map(|(length, &n)| length / (n - 1) as f64).fold(0.0, f64::max)
    }
}

/// Solves one model, corrected from a coarser one where there is one.
pub(super) fn solve<const D: usize>(
    scene: &Scene<D>,
    scheme: Scheme,
    counts: &[usize],
    tolerance: &Tolerance<D>,
    coarser: Option<&Answer<D>>,
) -> Result<Answer<D>, Error> {
    let start = Instant::now();
    let problem = scene.discretize(&scheme)?;
    let mut wasted = 0;
    let corrected = match coarser {
        Some(coarser) => {
            let guess = problem.transfer(&coarser.problem, coarser.path.last())?;
            // A guess that can't be corrected costs its iterations and nothing else.
            match problem.analysis.correct(&problem.model, &problem.rows, guess, &mut ()) {
                Ok(path) if path.ending == Ending::Completed => Some(path),
                Ok(path) => {
                    wasted = path.iterations;
                    None
                }
                Err(_) => None,
            }
        }
        None => None,
    };
    let path = match corrected {
        Some(path) => path,
        None => problem.run(&mut ())?.completed()?,
    };
    let seconds = start.elapsed().as_secs_f64();
    let energy = Quantity::energy();
    let asked = tolerance.quantities.iter().chain([&energy]);
    let values = asked.map(|q| q.evaluate(&problem, path.last())).collect::<Result<Vec<_>, _>>()?;
    let level = Level {
        counts: counts.to_vec(),
        unknowns: problem.model.unknowns(),
        iterations: path.iterations + wasted,
        seconds,
        values,
        estimate: None,
    };
    Ok(Answer { verdict: Verdict::NotReached(String::new()), bound: f64::INFINITY, problem, path, levels: vec![level] })
}

/// The estimate of the last of two models, `first` being the first two of all.
pub(super) fn estimate(first: (&Level, &Level), before: &Level, now: &Level, factor: f64) -> f64 {
    let change = |a: &Level, b: &Level, k: usize| {
        let (a, b) = (a.values[k], b.values[k]);
        if a == b { 0.0 } else { ((b - a) / b).abs() }
    };
    let asked = now.values.len() - 1;
    let worst = |a: &Level, b: &Level| (0..asked).map(|k| change(a, b, k)).fold(0.0, f64::max);
    // How much the quantities moved with the energy at first: at most as much as the energy itself.
    let sensitivity = (worst(first.0, first.1) / change(first.0, first.1, asked)).min(1.0);
    let guard = sensitivity * change(before, now, asked);
    let difference = worst(before, now).max(if guard.is_nan() { 0.0 } else { guard });
    let extrapolated = difference / (factor.powf(ORDER) - 1.0);
    let believed = before.estimate.map_or(0.0, |e| e * factor.powf(-STEEPEST));
    extrapolated.max(believed)
}
