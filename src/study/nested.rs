//! Nested iteration: each model is solved from the one before it, its error estimated, and judged.

use std::time::Instant;

use crate::error::{Error, Invalid, SolveError};
use crate::scene::{Functions, Problem, Scene, Scheme};
use crate::solve::{Dual, Ending, EquilibriumPath, State};

use super::answer::{Answer, Budget, Level, Tolerance, Verdict};
use super::progress::Limits;
use super::quantity::Quantity;

/// Fewer models say nothing of their error.
const LEAST: usize = 3;

/// Why a search ended that its observer broke off.
pub(super) const BROKEN_OFF: &str = "the observer broke off";

/// Where a model leads: to the end of the search, or on with what the next one needs.
pub(super) enum Course<const D: usize, Next> {
    Ended(Answer<D>),
    Onward(Answer<D>, Next),
}

/// Refuses tolerances that can't be met or ask for nothing.
pub(super) fn check<const D: usize>(tolerance: &Tolerance<D>) -> Result<(), Error> {
    if !(tolerance.error > 0.0 && tolerance.error < 1.0) {
        let needed = "give a relative error between 0 and 1";
        return Err(Invalid::new("tolerance", tolerance.error, needed).into());
    }
    if tolerance.quantities.is_empty() {
        let remedy = "name at least one quantity; Tolerance::energy is one";
        return Err(SolveError::Empty { what: "quantities of a tolerance", remedy }.into());
    }
    if let Some(wrong) = tolerance.quantities.iter().find(|q| !(q.size >= 0.0 && q.size.is_finite())) {
        let needed = "give a finite number of at least 0";
        return Err(Invalid::new("size of a quantity", wrong.size, needed).into());
    }
    Ok(())
}

/// The next model with those before it, or the end of the search where it failed: what is known stays known. An
/// error where there is none yet.
pub(super) fn follow<const D: usize>(
    solved: Result<Answer<D>, Error>,
    before: Option<Answer<D>>,
    counts: &[usize],
    limits: &Limits<'_>,
) -> Result<Course<D, Vec<Level>>, Error> {
    match (solved, before) {
        (Ok(next), before) => Ok(Course::Onward(next, before.map(|before| before.levels).unwrap_or_default())),
        (Err(error), Some(mut best)) => {
            best.verdict = failed(counts, &error, limits);
            Ok(Course::Ended(best))
        }
        (Err(error), None) => Err(error),
    }
}

/// The verdict where a further model could not be solved.
pub(super) fn failed(counts: &[usize], error: &Error, limits: &Limits<'_>) -> Verdict {
    let particles: Vec<String> = counts.iter().map(usize::to_string).collect();
    let particles = particles.join(" × ");
    Verdict::NotReached(if limits.exceeded {
        format!("the model of {particles} particles would take too many times the work of all before it")
    } else {
        format!("the model of {particles} particles failed: {error}")
    })
}

/// The model that a finer one is compared with.
pub(super) struct Against {
    /// Its place among those before.
    pub place: usize,
    /// Its error over that of the finer model, as assumed: $f^p$ for the ratio of spacings $f$ and the order $p$.
    pub ratio: f64,
    /// The least part of its estimate that is left: a difference that is small by accident does not count.
    pub left: f64,
    /// What the finer model shows by itself, 0 where nothing is known: errors that both models share make no difference.
    pub least: f64,
}

/// Joins a model to those before it, its error estimated against one of them.
pub(super) fn join<const D: usize>(
    next: &mut Answer<D>,
    before: Vec<Level>,
    tolerance: &Tolerance<D>,
    against: Option<Against>,
) {
    if let (Some(level), Some(against)) = (next.levels.first_mut(), against) {
        let last = &before[against.place];
        let first = before.first().zip(before.get(1)).unwrap_or((last, &*level));
        let found = estimate(first, last, level, tolerance, &against);
        level.estimate = Some(found);
        next.bound = found;
    }
    next.levels.splice(0..0, before);
}

/// Ends the search where the tolerance is met or the budget used up; else it goes on with what `finer` gives for the
/// next model beside its unknowns, or ends for its reason.
pub(super) fn judge<const D: usize, Next>(
    mut answer: Answer<D>,
    tolerance: &Tolerance<D>,
    budget: Budget,
    limits: &mut Limits<'_>,
    finer: impl FnOnce(&Answer<D>) -> Result<(usize, Next), String>,
) -> Course<D, Next> {
    let flow = answer.levels.last().map(|level| limits.watch.level(level));
    if answer.levels.len() >= LEAST && answer.bound < tolerance.error {
        answer.verdict = Verdict::Reached;
        return Course::Ended(answer);
    }
    let mut why = if flow.is_some_and(|flow| flow.is_break()) {
        BROKEN_OFF.to_string()
    } else if answer.levels.len() >= budget.levels {
        format!("the budget of {} models is used up", budget.levels)
    } else {
        match finer(&answer) {
            Ok((unknowns, next)) if unknowns <= budget.unknowns => return Course::Onward(answer, next),
            Ok((unknowns, _)) => {
                format!("the next model has {unknowns} unknowns, the budget allows {}", budget.unknowns)
            }
            Err(why) => why,
        }
    };
    why += &unsettled(&answer, tolerance);
    answer.verdict = Verdict::NotReached(why);
    Course::Ended(answer)
}

/// What the last two models say of the quantity that is furthest from rest.
pub(super) fn unsettled<const D: usize>(answer: &Answer<D>, tolerance: &Tolerance<D>) -> String {
    let [.., before, last] = &answer.levels[..] else { return String::new() };
    let changes = changes(before, last, tolerance).enumerate();
    let Some((k, _)) = changes.max_by(|a, b| a.1.total_cmp(&b.1)) else { return String::new() };
    let [from, to] = [before, last].map(|level| level.values[k]);
    // What is zero but for rounding never settles.
    let remedy = "where it vanishes, Quantity::relative_to says what size counts";
    let name = tolerance.quantities[k].name();
    format!("; the last models say {from:.6e} and {to:.6e} of {name} ({remedy})")
}

/// Corrections end once increments are below this part of the tolerance: what is left of a quadratic fall is then its
/// square, and steps with a kept matrix end at far less.
const ALGEBRAIC: f64 = 0.1;

/// Solves one model, corrected from a coarser one where there is one, and its dual problems.
pub(super) fn solve<const D: usize>(
    scene: &Scene<D>,
    scheme: Scheme,
    counts: &[usize],
    tolerance: &Tolerance<D>,
    coarser: Option<&Answer<D>>,
    limits: &mut Limits<'_>,
) -> Result<Answer<D>, Error> {
    let start = Instant::now();
    let mut problem = scene.discretize(&scheme)?;
    limits.counts(problem.model().unknowns());
    let energy = Quantity::energy();
    let asked: Vec<&Quantity<D>> = tolerance.quantities.iter().chain([&energy]).collect();
    let mut wasted = 0;
    let mut corrected = None;
    if let Some(coarser) = coarser {
        let guess = problem.transfer(&coarser.problem, coarser.path.last())?;
        let tight = problem.analysis().newton.tolerance;
        problem.analysis_mut().newton.tolerance = tight.max(ALGEBRAIC * tolerance.error);
        let found = problem.analysis().correct(problem.model(), problem.rows(), guess, &mut *limits);
        problem.analysis_mut().newton.tolerance = tight;
        // A guess that can't be corrected costs its iterations and nothing else.
        match found {
            Ok(path) if path.ending == Ending::Completed => corrected = Some(path),
            Ok(path) if path.ending == Ending::Stopped => corrected = Some(path.completed()?),
            Ok(path) => wasted = path.iterations,
            Err(_) => {}
        }
    }
    let path = match corrected {
        Some(path) => path,
        None => problem.run(&mut *limits)?.completed()?,
    };
    let values = asked.iter().map(|q| q.evaluate(&problem, path.last())).collect::<Result<Vec<_>, _>>()?;
    for (value, quantity) in values.iter().zip(&tolerance.quantities) {
        quantity.check(*value)?;
    }
    let duals = duals(&asked, &problem, &path)?;
    limits.matrix();
    let level = Level {
        functions: name_of(&scheme),
        counts: counts.to_vec(),
        unknowns: problem.model().unknowns(),
        iterations: path.iterations + wasted,
        seconds: start.elapsed().as_secs_f64(),
        values,
        estimate: None,
    };
    Ok(Answer {
        verdict: Verdict::NotReached(String::new()),
        bound: f64::INFINITY,
        problem,
        path,
        levels: vec![level],
        choice: name_of(&scheme).to_string(),
        tried: Vec::new(),
        duals,
    })
}

/// The dual solutions of quantities at the end of a path, by one matrix; none of quantities without a derivative.
fn duals<const D: usize>(
    asked: &[&Quantity<D>],
    problem: &Problem<D>,
    path: &EquilibriumPath,
) -> Result<Vec<Option<Vec<f64>>>, Error> {
    let state: &State = path.last();
    let problems = asked.iter().map(|q| q.dual_problem(problem, state)).collect::<Result<Vec<_>, _>>()?;
    let known: Vec<bool> = problems.iter().map(Option::is_some).collect();
    let problems: Vec<Dual> = problems.into_iter().flatten().collect();
    let solved = problem.analysis().duals(problem.model(), problem.rows(), state, &problems)?;
    let mut solved = solved.into_iter();
    Ok(known.into_iter().map(|known| if known { solved.next() } else { None }).collect())
}

/// What a scheme approximates with.
pub(super) fn name_of(scheme: &Scheme) -> &'static str {
    match (scheme.functions, scheme.order) {
        (Functions::Elements, 1) => "finite elements of order 1",
        (Functions::Elements, _) => "finite elements of order 2",
        (Functions::Particles, 0 | 1) => "linear particles",
        (Functions::Particles, _) => "particles of higher order",
    }
}

/// The change of the values asked for from one model to another, relative to the latter or to the size given for them.
fn changes<const D: usize>(a: &Level, b: &Level, tolerance: &Tolerance<D>) -> impl Iterator<Item = f64> {
    let values = a.values.iter().zip(&b.values);
    tolerance.quantities.iter().zip(values).map(|(quantity, (a, b))| change(*a, *b, quantity.size))
}

/// The largest of the changes from one model to another.
pub(super) fn worst<const D: usize>(a: &Level, b: &Level, tolerance: &Tolerance<D>) -> f64 {
    changes(a, b, tolerance).fold(0.0, f64::max)
}

fn change(a: f64, b: f64, size: f64) -> f64 {
    if a == b { 0.0 } else { ((b - a) / b.abs().max(size)).abs() }
}

/// The estimate of the last of two models, `first` being the first two of all.
fn estimate<const D: usize>(
    first: (&Level, &Level),
    before: &Level,
    now: &Level,
    tolerance: &Tolerance<D>,
    against: &Against,
) -> f64 {
    // The energy stands behind what is asked for.
    let energies = |a: &Level, b: &Level| {
        let both = a.values.last().zip(b.values.last());
        both.map_or(0.0, |(a, b)| change(*a, *b, 0.0))
    };
    // How much the quantities moved with the energy at first: at most as much as the energy itself.
    let sensitivity = (worst(first.0, first.1, tolerance) / energies(first.0, first.1)).min(1.0);
    let guard = sensitivity * energies(before, now);
    let difference = worst(before, now, tolerance).max(if guard.is_nan() { 0.0 } else { guard });
    let extrapolated = difference / (against.ratio - 1.0);
    let believed = before.estimate.map_or(0.0, |e| e * against.left);
    // A part that is no number, as of a body at rest, counts for nothing.
    extrapolated.max(believed).max(against.least)
}
