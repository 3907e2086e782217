//! Nested iteration: each model is solved from the one before it, its dual problems with it.

use std::time::Instant;

use crate::each::{Each, EachOf, IntoEach};
use crate::error::{Error, Invalid, SolveError};
use crate::scene::{ApproximationChoice, Judging, Problem, Scheme};
use crate::solve::{Dual, Ending, EquilibriumPath, Newton, NoAnswer, State};

use super::answer::{Answer, Level, Tolerance, Verdict};
use super::progress::Limits;
use super::quantity::Quantity;
use super::strategy::Model;

/// Why a search ended that its observer broke off.
pub(super) const BROKEN_OFF: &str = "the observer broke off";

/// Refuses tolerances that can't be met or ask for nothing.
pub(super) fn check<const D: usize>(tolerance: &Tolerance<D>) -> Result<(), Error> {
    ensure!(
        tolerance.error > 0.0 && tolerance.error < 1.0,
        Invalid::new("tolerance", tolerance.error, "give a relative error between 0 and 1")
    );
    ensure!(
        !tolerance.quantities.is_empty(),
        SolveError::Empty {
            what: "quantities of a tolerance",
            remedy: "name at least one quantity; Quantity::energy is one"
        }
    );
    Ok(tolerance.quantities.iter().try_for_each(Quantity::check_size)?)
}

/// The verdict where a further model could not be solved.
pub(super) fn failed(counts: &[usize], error: &Error, limits: &Limits<'_>) -> Verdict {
    let particles: Vec<String> = counts.mapped(usize::to_string);
    let particles = particles.join(" × ");
    Verdict::NotReached(if let Some(why) = limits.late() {
        format!("{why} with the model of {particles} particles under way")
    } else if limits.exceeded {
        format!("the model of {particles} particles would take too many times the work of all before it")
    } else if let Error::Solve(SolveError::BrokenOff { .. }) = error {
        BROKEN_OFF.into()
    } else {
        format!("the model of {particles} particles failed: {error}")
    })
}

/// What the last two models say of the quantity that is furthest from rest.
pub(super) fn unsettled<const D: usize>(answer: &Answer<D>, tolerance: &Tolerance<D>) -> String {
    let [.., before, last] = &answer.levels[..] else { return String::new() };
    let changes = changes(before, last, tolerance).enumerate();
    let Some((k, _)) = changes.max_by(|a, b| a.1.total_cmp(&b.1)) else { return String::new() };
    let [from, to] = [before, last].each(|level| level.values[k]);
    // What is zero but for rounding never settles.
    let remedy = "where it vanishes, Quantity::relative_to says what size counts";
    let name = tolerance.quantities[k].name();
    format!("; the last models say {from:.6e} and {to:.6e} of {name} ({remedy})")
}

/// Corrections end once increments are below this, whatever is requested: what is left of a quadratic fall is then its
/// square, and steps with a reused tangent end at far less.
const ALGEBRAIC: f64 = 1e-4;

/// Most iterations that correct a guess; beyond them the usual steps are cheaper.
const CORRECTIONS: usize = 12;

/// Solves one model, corrected from a coarser one where there is one, and its dual problems.
pub(super) fn solve<const D: usize>(
    model: Model<D>,
    tolerance: &Tolerance<D>,
    coarser: Option<&Answer<D>>,
    limits: &mut Limits<'_>,
) -> Result<Answer<D>, Error> {
    let start = Instant::now();
    let Model { scene, scheme, counts, .. } = model;
    let mut problem = scene.discretize(&scheme)?;
    limits.begin(problem.model().unknowns());
    let energy = Quantity::energy();
    let requested: Vec<&Quantity<D>> = tolerance.quantities.iter().chain([&energy]).collect();
    let mut wasted = 0;
    let (mut corrected, mut rough) = (None, false);
    if let Some(coarser) = coarser.filter(|_| !remembers(&problem)) {
        let guess = problem.transfer(&coarser.problem, coarser.path.last())?;
        let tight = problem.analysis().newton;
        let (tolerance, iterations) = (tight.tolerance.max(ALGEBRAIC), tight.iterations.min(CORRECTIONS));
        problem.analysis_mut().newton = Newton { tolerance, iterations, ..tight };
        let judging = &mut Judging { problem: &problem, observer: &mut *limits };
        let found = problem.analysis().correct(problem.model(), problem.equations(), guess, judging);
        problem.analysis_mut().newton = tight;
        // A guess that can't be corrected costs its iterations and nothing else.
        match found {
            Ok(path) if path.ending == Ending::Completed => (corrected, rough) = (Some(path), true),
            Ok(path) if path.ending == Ending::Stopped => corrected = Some(path.reached()?),
            Ok(path) => wasted = path.iterations,
            Err(_) => {}
        }
    }
    let path = match corrected {
        Some(path) => path,
        // What a coarse model has in doubt a finer one may not have.
        None => problem.run_with(&mut *limits)?.reached()?,
    };
    let values = requested.try_mapped(|q| q.evaluate(&problem, path.last()))?;
    for (value, quantity) in values.iter().zip(&tolerance.quantities) {
        quantity.check(*value)?;
    }
    let (duals, matrix) = duals(&requested, &problem, &path)?;
    limits.matrix();
    let doubts = problem.doubts_at_end(&path)?;
    let tables: usize = problem.discrete_bodies().iter().map(|body| body.body().table().bytes()).sum();
    let level = Level {
        functions: name_of(&scheme),
        counts,
        unknowns: problem.model().unknowns(),
        iterations: path.iterations + wasted,
        seconds: start.elapsed().as_secs_f64(),
        bytes: tables + matrix,
        values,
        corrections: vec![0.0; tolerance.quantities.len()],
        estimate: None,
        doubts,
    };
    let values = level.values[..tolerance.quantities.len()].to_vec();
    Ok(Answer {
        verdict: Verdict::NotReached(String::new()),
        bound: f64::INFINITY,
        problem,
        path,
        levels: vec![level],
        choice: name_of(&scheme).to_string(),
        tried: Vec::new(),
        rough,
        requested: tolerance.quantities.clone(),
        values,
        duals,
    })
}

/// Whether a problem reaches its last state by its whole history: laws with internal variables, friction.
pub(super) fn remembers<const D: usize>(problem: &Problem<D>) -> bool {
    problem.model().terms().iter().any(|term| term.layout().history > 0)
}

/// Brings the model of an answer to rest as any analysis does: while models are compared they need not be. A model in doubt reaches no
/// tolerance.
pub(super) fn settle<const D: usize>(
    answer: &mut Answer<D>,
    tolerance: &Tolerance<D>,
    limits: &mut Limits<'_>,
) -> Result<(), Error> {
    if std::mem::take(&mut answer.rough) {
        correct(answer, tolerance, limits)?;
    }
    if let Some(why) = answer.reached().then(|| answer.doubted()).flatten() {
        answer.verdict = Verdict::NotReached(why);
    }
    Ok(())
}

/// Iterates the model of an answer to rest; one that does not come to rest reaches no tolerance.
fn correct<const D: usize>(
    answer: &mut Answer<D>,
    tolerance: &Tolerance<D>,
    limits: &mut Limits<'_>,
) -> Result<(), Error> {
    let start = Instant::now();
    let (problem, guess) = (&answer.problem, answer.path.last().clone());
    // The model of an answer comes to rest, however long it takes.
    let time = limits.time.take();
    limits.begin(problem.model().unknowns());
    let judging = &mut Judging { problem, observer: limits };
    let path = problem.analysis().correct(problem.model(), problem.equations(), guess, judging);
    limits.time = time;
    let path = match path?.reached() {
        Ok(path) => path,
        // Broken off: what was compared is the answer.
        Err(NoAnswer { error: SolveError::BrokenOff { .. }, .. }) => return Ok(()),
        Err(NoAnswer { error, .. }) => {
            if let Some(level) = answer.levels.last_mut() {
                level.estimate = None;
            }
            if answer.reached() {
                let (kind, unknowns) = (&answer.choice, problem.model().unknowns());
                answer.verdict =
                    Verdict::NotReached(format!("{kind} of {unknowns} unknowns do not come to rest: {error}"));
            }
            return Ok(());
        }
    };
    if let Some(level) = answer.levels.last_mut() {
        for (k, quantity) in tolerance.quantities.iter().enumerate() {
            level.values[k] = quantity.evaluate(problem, path.last())?;
            answer.values[k] = level.values[k] + level.corrections[k];
        }
        level.doubts = problem.doubts_at_end(&path)?;
        level.iterations += path.iterations;
        level.seconds += start.elapsed().as_secs_f64();
    }
    answer.path = path;
    Ok(())
}

/// A dual solution for each quantity that has a derivative.
type Duals = Vec<Option<Vec<f64>>>;

/// The dual solutions of quantities at the end of a path, by one matrix, and the bytes that it takes with its factors; none of
/// quantities without a derivative.
fn duals<const D: usize>(
    requested: &[&Quantity<D>],
    problem: &Problem<D>,
    path: &EquilibriumPath,
) -> Result<(Duals, usize), Error> {
    let state: &State = path.last();
    let problems = requested.try_mapped(|q| q.dual_problem(problem, state))?;
    let known: Vec<bool> = problems.mapped(Option::is_some);
    let problems: Vec<Dual> = problems.into_iter().flatten().collect();
    let (solved, bytes) = problem.analysis().duals(problem.model(), problem.equations(), state, &problems)?;
    let mut solved = solved.into_iter();
    Ok((known.into_mapped(|known| if known { solved.next() } else { None }), bytes))
}

/// What a scheme approximates with.
pub(super) fn name_of(scheme: &Scheme) -> &'static str {
    match (scheme.approximation, scheme.order) {
        (ApproximationChoice::Elements, 1) => "finite elements of order 1",
        (ApproximationChoice::Elements, _) => "finite elements of order 2",
        (ApproximationChoice::Particles, 0 | 1) => "linear particles",
        (ApproximationChoice::Particles, _) => "particles of higher order",
    }
}

/// The change of the values requested from one model to another, relative to the latter or to the size given for them.
fn changes<const D: usize>(a: &Level, b: &Level, tolerance: &Tolerance<D>) -> impl Iterator<Item = f64> {
    let values = a.values.iter().zip(&b.values);
    tolerance.quantities.iter().zip(values).map(
        |(quantity, (a, b))| {
            if a == b { 0.0 } else { ((b - a) / b.abs().max(quantity.size)).abs() }
        },
    )
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::super::answer::Budget;
    use super::*;
    use crate::geometry::{Block, Side};
    use crate::kinematics::PlaneStrain;
    use crate::material::Rubber;
    use crate::scene::Scene;

    /// A model that was compared and then does not come to rest: its tolerance is not reached, whatever its bound.
    #[test]
    fn models_that_do_not_come_to_rest_reach_nothing() {
        let rubber = Rubber::neo_hookean(0.5, 10.0).unwrap();
        let scene = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber).hold((0, Side::Min)).prescribe(
            (0, Side::Max),
            1,
            0.5,
        );
        let tolerance = Tolerance::of(Quantity::energy(), 0.1);
        let clock = || Duration::ZERO;
        let (mut watch, scheme) = ((), Scheme::default().particles([5, 4]));
        let limits = &mut Limits::new(&mut watch, Budget::default(), &clock);
        for stalls in [false, true] {
            let model = Model { scene: scene.clone(), scheme: scheme.clone(), counts: vec![5, 4], spacing: 1.0 };
            let mut answer = solve(model, &tolerance, None, limits).unwrap();
            (answer.verdict, answer.rough) = (Verdict::Reached, true);
            answer.levels[0].estimate = Some(0.01);
            if stalls {
                // From afar, one iteration.
                answer.problem.analysis_mut().newton.iterations = 1;
                let state = &mut answer.path.steps.last_mut().unwrap().state;
                state.displacement.iter_mut().for_each(|u| *u *= 0.9);
            }
            settle(&mut answer, &tolerance, limits).unwrap();
            assert_eq!(answer.reached(), !stalls, "{:?}", answer.verdict);
            assert_eq!(answer.recommended(0.1).is_some(), !stalls);
            let told = |why: &str| why.contains("do not come to rest");
            assert!(
                !stalls || matches!(&answer.verdict, Verdict::NotReached(why) if told(why)),
                "{:?}",
                answer.verdict
            );
        }
    }
}
