//! A tolerance in, the smallest sufficient model out.

use std::ops::ControlFlow;

use crate::error::{Error, SolveError};
use crate::scene::{Scene, Scheme};
use crate::solve::NO_FREE;

use super::answer::{Answer, Budget, Tolerance, Verdict};
use super::assembled::{Assembled, is_assembled};
use super::evidence::{DifferenceBound, difference_bound};
use super::nested::{BROKEN_OFF, check, failed, name_of, settle, solve, unsettled};
use super::progress::{Limits, Progress};
use super::strategy::{Even, Found, Model, Next, ORDERS, Strategy};

/// Order of convergence between the first two models, where none is measured: corners of rubber parts allow no more.
const ORDER: f64 = 1.0;
/// First models without a free unknown that are tried again with twice the cells.
const ATTEMPTS: usize = 4;
/// Two models that differ by less agree by no accident: bodies at rest, homogeneous states.
const EXACT: f64 = 1e-10;

impl<const D: usize> Scene<D> {
    /// Solves the scene with the cheapest model found sufficient: finite elements of order 2 on blocks and mapped blocks, the default
    /// scheme's particles where those fail, in one dimension, on drawn shapes and meshes, and for several bodies; see
    /// [`solve_within_observed`](Scene::solve_within_observed).
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
    /// let force = Quantity::reaction((1, Side::Max), 0);
    /// let answer = bearing.solve_within(&Tolerance::of(force, 0.02), Budget::default())?;
    /// println!("{:.3} N/mm ± {:.1} %, by {}", answer.values()[0], 100.0 * answer.bound, answer.choice);
    /// # #[cfg(feature = "chart")]
    /// # let directory = std::env::temp_dir().join("rkpm-sizing");
    /// # #[cfg(feature = "chart")]
    /// answer.chart(0.02).write(directory.join("bearing.svg"))?;
    /// # assert!(answer.reached() && answer.bound < 0.02);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`solve_within_observed`](Scene::solve_within_observed).
    pub fn solve_within(&self, tolerance: &Tolerance<D>, budget: Budget) -> Result<Answer<D>, Error> {
        // In one dimension nothing is cheap or dear.
        if D == 1 || self.domain().is_none() {
            return self.solve_within_by(&Scheme::default(), tolerance, budget);
        }
        self.solve_within_observed(&[Scheme::elements(2), Scheme::default()], tolerance, budget, &mut ())
    }

    /// Solves the scene with the cheapest model found sufficient under a scheme, whose number of particles
    /// is chosen here; see [`solve_within_observed`](Scene::solve_within_observed).
    ///
    /// # Errors
    /// As [`solve_within_observed`](Scene::solve_within_observed).
    pub fn solve_within_by(
        &self,
        scheme: &Scheme,
        tolerance: &Tolerance<D>,
        budget: Budget,
    ) -> Result<Answer<D>, Error> {
        self.solve_within_observed(std::slice::from_ref(scheme), tolerance, budget, &mut ())
    }

    /// Solves the scene with the cheapest model found sufficient under the first scheme that reaches the tolerance, and tells each
    /// model to an observer: give the scheme first that is expected to be cheapest. The number of particles is chosen here, and
    /// elements of order 2 whose layout is regular are graded towards all faces, by the power 5/4 of the distance.
    ///
    /// Each model is compared with one of half its cells along each axis, from which it is corrected. With the solutions $u$, the
    /// dual solutions $z$ of a quantity $q$ (of a displacement, a reaction, a volume or the energy; each model takes one more
    /// matrix for them), their pressures $p$ and $p_z$, and $\Delta$ for what changes from the coarse model to the fine one, the bound
    /// is
    /// $$e = \frac{\max(|\Delta q|, \eta)}{(2^p - 1)\\,|q|},\qquad
    /// \eta = \sum_\text{zones}\Big|\int\Delta\mathbf P:\nabla\Delta z
    /// \+ \Delta p\operatorname{cof}\mathbf F:\nabla\Delta z
    /// \+ \Delta p_z\Big(\operatorname{cof}\mathbf F:\nabla\Delta u - \frac{\Delta p}{U''}\Big)\\,\mathrm d\Omega\Big|$$
    /// with the distortional stress $\mathbf P$, over the size of [`relative_to`](super::Quantity::relative_to) where that is
    /// larger. Without the absolute values of zones the sum is $\Delta q$ itself, as Galerkin's orthogonality has it; that may
    /// vanish by accident, where parts of the body cancel each other. For the energy $z - u/2$ stands for $z$. Quantities
    /// of one's own, whose derivative is not known, take the $\eta$ of the energy, in proportion to what they changed beside it.
    /// The order $p$ is 1 at first, then that by which $\max(|\Delta q|, \eta)$ falls from model to model, between 1/2 and 5/4. Drawn shapes,
    /// whose particles can't be halved, meshes, whose cells are halved, and several bodies are compared with the model before.
    ///
    /// The next model aims at eight tenths of the tolerance. No model may take more than four times the work of all before
    /// it, unless the bound says that it will be the last: then sixteen times (work is counted in factorisations times the power 3/2 of
    /// the unknowns; small models and eight matrices of any are free). No answer rests on one comparison: two coarse models of one kind may agree by
    /// accident. A search ends once the measured order tells that the budget will not do; where no scheme comes to its end, the one
    /// with the best bound is brought as near as the budget allows.
    /// Where everything that the coarsest model has is prescribed, as one cell through a thin bonded body, it takes more
    /// cells across.
    ///
    /// # Errors
    /// For a tolerance that is not between 0 and 1 or asks for nothing, and where a model can't be built or
    /// the coarsest one can't be solved.
    pub fn solve_within_observed(
        &self,
        schemes: &[Scheme],
        tolerance: &Tolerance<D>,
        budget: Budget,
        watch: &mut dyn Progress,
    ) -> Result<Answer<D>, Error> {
        check(tolerance)?;
        let mut limits = Limits::new(watch);
        let (mut best, mut refused) = (None::<Search<'_, D>>, None);
        let (mut tried, mut left) = (Vec::new(), Vec::new());
        for scheme in schemes {
            let name = name_of(scheme);
            let started = strategy(self, scheme).and_then(|strategy| Search::start(strategy, tolerance, &mut limits));
            let mut found = match started {
                Ok(found) => found,
                Err(error) => {
                    left.push(format!("{name} failed: {error}"));
                    refused.get_or_insert(error);
                    continue;
                }
            };
            found.run(tolerance, budget, false, &mut limits);
            let done = found.answer.reached()
                || matches!(&found.answer.verdict, Verdict::NotReached(why) if why == BROKEN_OFF);
            if let Verdict::NotReached(why) = &found.answer.verdict {
                left.push(format!("{name} did not: {why}"));
            }
            let better = |best: &Search<'_, D>| found.answer.reached() || found.answer.bound < best.answer.bound;
            let other = if best.as_ref().is_none_or(better) { best.replace(found) } else { Some(found) };
            tried.extend(other.into_iter().flat_map(|other| other.answer.levels));
            if done {
                break;
            }
        }
        let remedy = "give at least one";
        let none = || refused.unwrap_or_else(|| SolveError::Empty { what: "schemes to choose from", remedy }.into());
        let mut best = best.ok_or_else(none)?;
        // What can't be reached is brought as near as the budget allows: a tighter tolerance never answers worse than a looser one.
        if best.hopeless {
            best.run(tolerance, budget, true, &mut limits);
        }
        let mut answer = best.answer;
        if answer.reached() && schemes.len() > 1 {
            let why = if left.is_empty() { "reached the tolerance first".into() } else { left.join("; ") };
            answer.choice = format!("{} ({why})", answer.choice);
        }
        answer.tried = tried;
        settle(&mut answer, tolerance, &mut limits)?;
        Ok(answer)
    }
}

/// How the models of a scene are made finer.
fn strategy<'a, const D: usize>(scene: &'a Scene<D>, scheme: &'a Scheme) -> Result<Box<dyn Strategy<D> + 'a>, Error> {
    if is_assembled(scene) {
        return Ok(Box::new(Assembled::new(scene, scheme)?));
    }
    Ok(Box::new(Even::new(scene, scheme)?))
}

/// Searches for a model by one strategy, until the budget is used up where the tolerance is out of reach; an error where the coarsest
/// can't be solved.
pub(super) fn search<'a, const D: usize>(
    strategy: impl Strategy<D> + 'a,
    tolerance: &Tolerance<D>,
    budget: Budget,
    limits: &mut Limits<'_>,
) -> Result<Answer<D>, Error> {
    let mut search = Search::start(Box::new(strategy), tolerance, limits)?;
    search.run(tolerance, budget, true, limits);
    let mut answer = search.answer;
    settle(&mut answer, tolerance, limits)?;
    Ok(answer)
}

/// The models of one strategy.
struct Search<'a, const D: usize> {
    strategy: Box<dyn Strategy<D> + 'a>,
    answer: Answer<D>,
    /// Spacing of the last model.
    spacing: f64,
    /// How far it was from the one it was compared with.
    compared: Option<f64>,
    order: f64,
    /// Whether the order was measured: two comparisons, of three models at least. Before, two coarse models of one kind may agree by
    /// accident, and no answer rests on them.
    measured: bool,
    /// Whether the search ended because it would not come to its end within the budget.
    hopeless: bool,
    zones: Vec<f64>,
}

impl<'a, const D: usize> Search<'a, D> {
    /// The coarsest model.
    fn start(
        mut strategy: Box<dyn Strategy<D> + 'a>,
        tolerance: &Tolerance<D>,
        limits: &mut Limits<'_>,
    ) -> Result<Self, Error> {
        let mut attempts = 0;
        loop {
            attempts += 1;
            limits.begin(true);
            let coarsest = strategy.coarsest();
            let spacing = coarsest.spacing;
            match solve(coarsest, tolerance, None, limits) {
                // Bonded on both sides, one cell through a thin body leaves nothing free.
                Err(Error::Solve(SolveError::Empty { what: NO_FREE, .. }))
                    if attempts < ATTEMPTS && strategy.thicken() => {}
                solved => {
                    let answer = solved?;
                    let (compared, order, zones) = (None, ORDER, Vec::new());
                    let (measured, hopeless) = (false, false);
                    return Ok(Search { strategy, answer, spacing, compared, order, measured, hopeless, zones });
                }
            }
        }
    }

    /// Goes on until the tolerance is reached or there is a reason to end; with `patience` that it will not be reached is none.
    fn run(&mut self, tolerance: &Tolerance<D>, budget: Budget, patience: bool, limits: &mut Limits<'_>) {
        let mut flow = match &self.answer.levels[..] {
            [first] => limits.watch.level(first),
            _ => ControlFlow::Continue(()),
        };
        self.hopeless = false;
        self.answer.verdict = loop {
            if self.measured && self.answer.bound < tolerance.error {
                break Verdict::Reached;
            }
            if flow.is_break() {
                break Verdict::NotReached(BROKEN_OFF.into());
            }
            if let Some(why) = self.used_up(budget) {
                break Verdict::NotReached(why + &unsettled(&self.answer, tolerance));
            }
            if let Some(why) = self.out_of_reach(tolerance.error, budget).filter(|_| !patience) {
                self.hopeless = true;
                break Verdict::NotReached(why + &unsettled(&self.answer, tolerance));
            }
            if let Err(verdict) = self.advance(tolerance, budget, limits) {
                break verdict;
            }
            flow = self.answer.levels.last().map_or(flow, |level| limits.watch.level(level));
        };
    }

    /// Whether the budget leaves no further model.
    fn used_up(&self, budget: Budget) -> Option<String> {
        let used = self.answer.levels.len() >= budget.levels;
        used.then(|| format!("the budget of {} models is used up", budget.levels))
    }

    /// Why the tolerance is out of reach, as far as the measured order tells.
    fn out_of_reach(&self, tolerance: f64, budget: Budget) -> Option<String> {
        if !self.measured {
            return None;
        }
        if !self.answer.bound.is_finite() {
            return Some(format!("{} models say nothing of their error", self.answer.levels.len()));
        }
        // With the best order that is believed.
        let finer = (self.answer.bound / tolerance).powf(D as f64 / self.strategy.steepest());
        let needed = self.answer.problem.model().unknowns() as f64 * finer;
        let most = budget.unknowns as f64;
        (needed > most).then(|| format!("it would take about {needed:.0e} unknowns, the budget allows {most}"))
    }

    /// Solves the next model, and the one with half its cells, and compares them.
    fn advance(&mut self, tolerance: &Tolerance<D>, budget: Budget, limits: &mut Limits<'_>) -> Result<(), Verdict> {
        let counts = self.answer.levels.last().map(|level| level.counts.clone()).unwrap_or_default();
        let found = Found {
            first: self.answer.levels.len() < 2,
            bound: self.answer.bound,
            tolerance: tolerance.error,
            order: self.order,
            counts: &counts,
            zones: &self.zones,
            unknowns: budget.unknowns,
        };
        let none = |why: String| Verdict::NotReached(why + &unsettled(&self.answer, tolerance));
        let Next { coarse, fine, last } = self.strategy.next(&found).map_err(none)?;
        let unknowns = fine.counts.iter().fold(D, |n, &c| n.saturating_mul(c));
        if unknowns > budget.unknowns {
            return Err(none(format!("the next model has {unknowns} unknowns, the budget allows {}", budget.unknowns)));
        }
        let (spacing, before) = (fine.spacing, self.spacing);
        let mut solved = |model: Model<D>, last: bool| {
            limits.begin(last);
            let counts = model.counts.clone();
            solve(model, tolerance, Some(&self.answer), limits).map_err(|error| failed(&counts, &error, limits))
        };
        let coarser = coarse.as_ref().map_or(before, |coarse| coarse.spacing);
        let companion = coarse.map(|coarse| solved(coarse, true)).transpose()?;
        let particles = fine.counts.clone();
        let mut next = solved(fine, last)?;
        let DifferenceBound { most, zones } =
            difference_bound(companion.as_ref().unwrap_or(&self.answer), &next, tolerance, &self.answer.levels)
                .map_err(|error| failed(&particles, &error, limits))?;
        if let Some(then) = self.compared {
            let order = (then / most).ln() / (before / spacing).ln();
            if order.is_finite() {
                self.order = order.clamp(ORDERS[0], ORDERS[1]);
            }
        }
        self.measured = self.compared.is_some() || most <= EXACT;
        (self.compared, self.spacing, self.zones) = (Some(most), spacing, zones);
        next.bound = most / ((coarser / spacing).powf(self.order) - 1.0);
        let level = &mut next.levels[0];
        level.estimate = Some(next.bound);
        for companion in companion.iter().flat_map(|companion| &companion.levels) {
            level.iterations += companion.iterations;
            level.seconds += companion.seconds;
        }
        next.levels.splice(0..0, std::mem::take(&mut self.answer.levels));
        self.answer = next;
        Ok(())
    }
}
