//! A tolerance in, the smallest sufficient model out.

use std::ops::ControlFlow;
use std::time::Instant;

use crate::each::EachOf;
use crate::error::{Error, SolveError};
use crate::scene::{Scene, Scheme};
use crate::solve::NO_FREE;

use super::answer::{Answer, Budget, Tolerance, Verdict};
use super::assembled::{Assembled, is_assembled};
use super::evidence::{DifferenceBound, difference_bound};
use super::extrapolation::extrapolate;
use super::nested::{BROKEN_OFF, check, failed, name_of, settle, solve, unsettled};
use super::progress::{Limits, Progress};
use super::resolved::{may_close, overlooked};
use super::strategy::{Even, Found, Model, Next, ORDERS, Strategy};

/// First models without a free unknown that are tried again with twice the cells.
const ATTEMPTS: usize = 4;

impl<const D: usize> Scene<D> {
    /// Solves the scene with the cheapest model found sufficient: finite elements of order 2 on blocks and mapped blocks, the default
    /// scheme's particles where those fail, in one dimension, on drawn shapes and meshes, and for several bodies; see
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
    /// As [`solve_within_by`](Scene::solve_within_by).
    pub fn solve_within(&self, tolerance: &Tolerance<D>, budget: Budget) -> Result<Answer<D>, Error> {
        // In one dimension nothing is cheap or dear.
        if D == 1 || self.domain().is_none() {
            return self.solve_within_by(&[Scheme::default()], tolerance, budget, &mut ());
        }
        self.solve_within_by(&[Scheme::elements(2), Scheme::default()], tolerance, budget, &mut ())
    }

    /// Solves the scene with the cheapest model found sufficient under the first scheme that reaches the tolerance, and tells each
    /// model to an observer: give the scheme first that is expected to be cheapest. The number of particles is chosen here, and
    /// elements of order 2 whose layout is regular are graded towards all faces, by the power 5/4 of the distance.
    ///
    /// Whatever is requested, a scheme has the same series of models, with 1, 2, 3, 4, 6, 8, 12 and so on times the cells of the first along
    /// each axis, each solved from the one before: a tighter tolerance goes further along it, and never answers worse than a looser one
    /// under the same budget.
    /// From the third model on values are extrapolated (Richardson): the answer is the value of its model and a
    /// correction ([`Level::corrections`](super::Level::corrections)), and the bound is about what is left.
    ///
    /// What order $a$ would leave of the last value, after the last change and after the one before, is
    /// $r_a = \max_{k = n, n-1}|q_k - q_{k-1}|\\,h_n^a/(h_{k-1}^a - h_k^a)$ with values $q_k$ and spacings $h_k$ of models $k \le n$.
    /// With the order $p$ of the last three values, correction and bound (over the size of
    /// [`relative_to`](super::Quantity::relative_to) where that is larger) are
    /// $$c = \frac{q_n - q_{n-1}}{(h_{n-1}/h_n)^{\max(p, 2)} - 1},\qquad
    /// e = \frac{1}{|q|}\max\Big(\frac{\eta}{4}\frac{h_n}{h_{n-1} - h_n},
    /// r_{\min(p, 1)} - |c|\Big).$$
    /// Where the last two changes differ in sign the value is not corrected, and its bound is $r_{1/2}$. $\eta$ weighs what
    /// changes, $\Delta$, from the coarse model to the fine one by the dual solutions $z$ of the quantity $q$ (of a displacement, a reaction, a volume or the energy; each model takes one more
    /// matrix for them), with the solutions $u$, their pressures $p$ and $p_z$:
    /// $$\eta = \sum_\text{zones}\Big|\int\Delta\mathbf P:\nabla\Delta z
    /// \+ \Delta p\operatorname{cof}\mathbf F:\nabla\Delta z
    /// \+ \Delta p_z\Big(\operatorname{cof}\mathbf F:\nabla\Delta u - \frac{\Delta p}{U''}\Big)\\,\mathrm d\Omega\Big|$$
    /// with the distortional stress $\mathbf P$. Without the absolute values of zones the sum is $\Delta q$ itself, as Galerkin's
    /// orthogonality has it; that may vanish by accident, where parts of the body cancel each other. For the energy $z - u/2$ stands
    /// for $z$. Quantities of one's own, whose derivative is not known, are not corrected, and take the $\eta$ of the energy, in
    /// proportion to what they changed beside it; where one did not change at all, a contact that is open has to be seen to stay open:
    /// its least gap must be larger than what first order leaves of the gap's last change.
    ///
    /// No model may take more than sixteen times the work of all before it (work is counted in factorisations times the power 3/2 of
    /// the unknowns; small models, eight matrices of any and twice as many as the first took are free). A search ends once the fall of
    /// its bounds tells that the budget will not do; where no scheme comes to its end, each is brought as near as the budget allows, and the least bound is the answer.
    /// Where everything that the coarsest model has is prescribed, as one cell through a thin bonded body, it takes more
    /// cells across.
    ///
    /// # Errors
    /// For a tolerance that is not between 0 and 1 or asks for nothing, and where a model can't be built or
    /// the coarsest one can't be solved.
    pub fn solve_within_by(
        &self,
        schemes: &[Scheme],
        tolerance: &Tolerance<D>,
        budget: Budget,
        watch: &mut dyn Progress,
    ) -> Result<Answer<D>, Error> {
        let start = Instant::now();
        self.sized(schemes, tolerance, budget, &mut Limits::new(watch, budget, &|| start.elapsed()))
    }

    /// The same under given limits.
    fn sized(
        &self,
        schemes: &[Scheme],
        tolerance: &Tolerance<D>,
        budget: Budget,
        limits: &mut Limits<'_>,
    ) -> Result<Answer<D>, Error> {
        check(tolerance)?;
        let (mut searches, mut refused, mut left) = (Vec::<Search<'_, D>>::new(), None, Vec::new());
        for scheme in schemes {
            if let Some(why) = limits.late() {
                left.push(format!("{} was not begun: {why}", name_of(scheme)));
                break;
            }
            limits.spent = 0.0;
            let started = strategy(self, scheme).and_then(|strategy| Search::start(strategy, tolerance, limits));
            let mut found = match started {
                Ok(found) => found,
                Err(error) => {
                    left.push(format!("{} failed: {error}", name_of(scheme)));
                    // Where all are refused the error is that of the last.
                    refused = Some(error);
                    continue;
                }
            };
            limits.answered = true;
            found.run(tolerance, budget, false, limits);
            // A state that is none leaves the tolerance to the next scheme.
            if found.answer.reached() {
                settle(&mut found.answer, tolerance, limits)?;
            }
            let done = found.is_done();
            searches.push(found);
            if done {
                break;
            }
        }
        // What can't be reached is brought as near as the budget allows by all: a tighter tolerance never answers worse than a looser one.
        if !searches.iter().any(Search::is_done) {
            for search in searches.iter_mut().filter(|search| search.hopeless) {
                search.run(tolerance, budget, true, limits);
                if search.answer.reached() {
                    settle(&mut search.answer, tolerance, limits)?;
                }
                if search.is_done() {
                    break;
                }
            }
        }
        let rank = |search: &Search<'_, D>| (!search.answer.reached(), search.answer.bound);
        let better = |a: &Search<'_, D>, b: &Search<'_, D>| {
            let (a, b) = (rank(a), rank(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        };
        let best = (0..searches.len()).min_by(|&a, &b| better(&searches[a], &searches[b]));
        let remedy = "give at least one";
        let none = || refused.unwrap_or_else(|| SolveError::Empty { what: "schemes to choose from", remedy }.into());
        let mut answer = searches.remove(best.ok_or_else(none)?).answer;
        for other in &searches {
            if let Verdict::NotReached(why) = &other.answer.verdict {
                left.push(format!("{} did not: {why}", other.answer.choice));
            }
        }
        if answer.reached() && schemes.len() > 1 {
            let why = if left.is_empty() { "reached the tolerance first".into() } else { left.join("; ") };
            answer.choice = format!("{} ({why})", answer.choice);
        }
        for other in searches {
            answer.tried.extend(other.answer.levels.into_iter().chain(other.answer.tried));
        }
        // Now that all finer models are known.
        if let Some(why) = answer.reached().then(|| answer.doubted()).flatten() {
            answer.verdict = Verdict::NotReached(why);
        }
        if !answer.reached() {
            settle(&mut answer, tolerance, limits)?;
        }
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
    limits.answered = true;
    search.run(tolerance, budget, true, limits);
    let mut answer = search.answer;
    settle(&mut answer, tolerance, limits)?;
    Ok(answer)
}

/// The models of one strategy.
struct Search<'a, const D: usize> {
    strategy: Box<dyn Strategy<D> + 'a>,
    answer: Answer<D>,
    /// A model before the last one whose bound is less, and how many there were then.
    best: Option<(usize, Answer<D>)>,
    /// Spacings of all models.
    spacings: Vec<f64>,
    /// How far the last two compared were apart, where cells are cut one by one.
    compared: Option<f64>,
    /// By which bounds fall.
    order: f64,
    /// Whether the order was measured: two comparisons, of three models at least. Before, two coarse models of one kind may agree by
    /// accident, and no answer rests on them.
    measured: bool,
    /// Whether the search ended because it would not come to its end within the budget.
    hopeless: bool,
    /// A contact that is open in the last model and may close in finer ones, where a quantity may be its force.
    open: Option<String>,
    zones: Vec<f64>,
    /// Work so far.
    spent: f64,
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
            let coarsest = strategy.coarsest();
            let spacing = coarsest.spacing;
            match solve(coarsest, tolerance, None, limits) {
                // Bonded on both sides, one cell through a thin body leaves nothing free.
                Err(Error::Solve(SolveError::Empty { what: NO_FREE, .. }))
                    if attempts < ATTEMPTS && strategy.thicken() => {}
                solved => {
                    let answer = solved?;
                    return Ok(Search {
                        strategy,
                        answer,
                        best: None,
                        spacings: vec![spacing],
                        compared: None,
                        order: ORDERS[0],
                        measured: false,
                        hopeless: false,
                        open: None,
                        zones: Vec::new(),
                        spent: limits.spent,
                    });
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
        limits.spent = self.spent;
        let verdict = loop {
            if self.measured && self.answer.bound < tolerance.error {
                break Verdict::Reached;
            }
            if flow.is_break() {
                break Verdict::NotReached(BROKEN_OFF.into());
            }
            if let Some(why) = limits.late().or_else(|| self.used_up(budget)) {
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
        self.spent = limits.spent;
        let ended = !self.hopeless && verdict != Verdict::Reached;
        // What was solved after the best model was tried and left.
        let later = &self.answer;
        let better = |best: &Answer<D>| best.bound < later.bound && agrees(best, later, tolerance);
        if let Some((last, best)) = self.best.take_if(|(_, best)| ended && better(best)) {
            let mut levels = std::mem::take(&mut self.answer.levels);
            let tried = levels.split_off(last);
            self.answer = Answer { levels, tried, ..best };
        }
        self.answer.verdict = match (verdict, overlooked(&self.answer.problem)) {
            (Verdict::NotReached(why), Some(at)) if why != BROKEN_OFF => Verdict::NotReached(format!(
                "{why}; cells are too wide for the bore or narrow end at X = {at:?}, which the models overlook: allow more models \
                 (Budget::levels), or draw the shape without it"
            )),
            (Verdict::NotReached(why), None) if why != BROKEN_OFF => Verdict::NotReached(match &self.open {
                Some(name) => format!(
                    "{why}; the contact at `{name}` is open, and the gap still falls with the spacing as if it were to close: allow more \
                     models (Budget::levels)"
                ),
                None => why,
            }),
            (verdict, _) => verdict,
        };
    }

    /// Whether the tolerance is reached, or the observer broke off.
    fn is_done(&self) -> bool {
        match &self.answer.verdict {
            Verdict::Reached => true,
            Verdict::NotReached(why) => why == BROKEN_OFF,
        }
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
        let order = self.order.max(ORDERS[1]);
        let finer = (self.answer.bound / tolerance).powf(D as f64 / order);
        let needed = self.answer.problem.model().unknowns() as f64 * finer;
        let most = budget.unknowns as f64;
        (needed > most).then(|| format!("it would take about {needed:.0e} unknowns, the budget allows {most}"))
    }

    /// Bytes of a model of so many unknowns, as factors grow under nested dissection: by the power 4/3 in space, $n\ln n$ in the plane.
    fn predicted_bytes(&self, unknowns: usize) -> f64 {
        let Some(last) = self.answer.levels.last() else { return 0.0 };
        let [from, to] = [last.unknowns, unknowns].each(|n| n.max(2) as f64);
        let ratio = if D > 2 { (to / from).powf(4.0 / 3.0) } else { to * to.ln() / (from * from.ln()) };
        last.bytes as f64 * ratio
    }

    /// Solves the next model, and the one to compare it with where that is not the last, and bounds its error.
    fn advance(&mut self, tolerance: &Tolerance<D>, budget: Budget, limits: &mut Limits<'_>) -> Result<(), Verdict> {
        let last = self.answer.levels.last();
        let (counts, solved) = last.map(|level| (level.counts.clone(), level.unknowns)).unwrap_or_default();
        let found = Found { first: self.answer.levels.len() < 2, counts: &counts, zones: &self.zones };
        let none = |why: String| Verdict::NotReached(why + &unsettled(&self.answer, tolerance));
        let Next { coarse, fine } = self.strategy.next(&found).map_err(none)?;
        // Of a drawn shape or a solid the particles fill a part of their box, the same of any.
        let product = |counts: &[usize]| counts.iter().map(|&c| c as f64).product::<f64>();
        let unknowns = (solved as f64 * product(&fine.counts) / product(&counts)).round() as usize;
        if unknowns > budget.unknowns {
            return Err(none(format!("the next model has {unknowns} unknowns, the budget allows {}", budget.unknowns)));
        }
        let predicted = self.predicted_bytes(unknowns);
        if let Some(most) = budget.bytes.filter(|most| predicted > *most as f64) {
            return Err(none(format!("the next model takes about {predicted:.1e} bytes, the budget allows {most}")));
        }
        let (spacing, before) = (fine.spacing, self.spacings.last().copied().unwrap_or(1.0));
        let mut solved = |model: Model<D>| {
            let counts = model.counts.clone();
            solve(model, tolerance, Some(&self.answer), limits).map_err(|error| failed(&counts, &error, limits))
        };
        let coarser = coarse.as_ref().map_or(before, |coarse| coarse.spacing);
        let companion = coarse.map(&mut solved).transpose()?;
        let particles = fine.counts.clone();
        let mut next = solved(fine)?;
        let compared = companion.as_ref().unwrap_or(&self.answer);
        let difference = difference_bound(compared, &next, tolerance, &self.answer.levels);
        let difference = difference.map_err(|error| failed(&particles, &error, limits))?;
        let left = spacing / (coarser - spacing);
        let open = if difference.unseen { may_close(compared, &next, left) } else { Ok(None) };
        self.open = open.map_err(|error| failed(&particles, &error, limits))?;
        let level = &mut next.levels[0];
        for companion in companion.iter().flat_map(|companion| &companion.levels) {
            level.iterations += companion.iterations;
            level.seconds += companion.seconds;
        }
        next.levels.splice(0..0, std::mem::take(&mut self.answer.levels));
        self.spacings.push(spacing);
        let (previous, was_measured) = (std::mem::replace(&mut self.answer, next), self.measured);
        let (uniform, unseen) = (self.strategy.is_uniform(), difference.unseen);
        if uniform {
            self.extrapolate(&difference, tolerance);
        } else {
            self.compare((before, coarser), difference);
        }
        if overlooked(&self.answer.problem).is_some() || self.open.is_some() || unseen && !self.measured {
            // Models that do not see a bore or a contact agree, and say nothing of the body. So may two that agree in what is requested alone.
            (self.measured, self.answer.bound) = (false, f64::INFINITY);
        }
        // What conditions miss of their parts is an error that all models may share.
        self.answer.bound = self.answer.bound.max(self.answer.problem.missed_parts());
        let corrections = self.answer.corrections();
        if let Some(level) = self.answer.levels.last_mut() {
            level.corrections = corrections;
            // Extrapolation from two models rests on an order that nothing measured.
            level.estimate = (self.measured || !uniform).then_some(self.answer.bound);
        }
        let least = self.best.as_ref().map_or(f64::INFINITY, |(_, best)| best.bound);
        if was_measured && previous.bound < self.answer.bound.min(least) {
            self.best = Some((self.answer.levels.len() - 1, previous));
        }
        Ok(())
    }

    /// The bound by the change from the model that the last one is compared with, whose spacing is `coarser`.
    fn compare(&mut self, (before, coarser): (f64, f64), difference: DifferenceBound) {
        let spacing = self.spacings.last().copied().unwrap_or(1.0);
        let DifferenceBound { most, exact, zones, .. } = difference;
        if let Some(then) = self.compared {
            let order = (then / most).ln() / (before / spacing).ln();
            if order.is_finite() {
                self.order = order.clamp(ORDERS[0], ORDERS[1]);
            }
        }
        self.measured = self.compared.is_some() || exact;
        (self.compared, self.zones) = (Some(most), zones);
        self.answer.bound = most / ((coarser / spacing).powf(self.order) - 1.0);
    }

    /// Values and bound, extrapolated from all models.
    fn extrapolate(&mut self, difference: &DifferenceBound, tolerance: &Tolerance<D>) {
        let before = self.answer.levels.iter().rev().find_map(|level| level.estimate);
        let mut bound: f64 = 0.0;
        for (k, quantity) in tolerance.quantities.iter().enumerate() {
            let value = self.answer.values[k];
            let size = value.abs().max(quantity.size);
            let values = self.answer.levels.iter().map(|level| level.values[k]);
            let series: Vec<(f64, f64)> = self.spacings.iter().copied().zip(values).collect();
            let eta = difference.weighted.get(k).map_or(f64::INFINITY, |weighted| weighted * size);
            let found = extrapolate(&series, eta, self.answer.duals.get(k).is_some_and(Option::is_some));
            self.answer.values[k] += found.correction;
            let left = if found.left == 0.0 { 0.0 } else { found.left / size };
            bound = if left.is_nan() { f64::INFINITY } else { bound.max(left) };
        }
        self.answer.bound = bound;
        self.measured = self.spacings.len() > 2 || difference.exact;
        if let (Some(before), [.., coarser, finer]) = (before, &self.spacings[..]) {
            self.order = (before / bound).ln() / (coarser / finer).ln();
        }
    }
}

/// Whether all values of a finer model lie within the bound of a coarser one: a bound that what came later denies is none.
fn agrees<const D: usize>(coarser: &Answer<D>, finer: &Answer<D>, tolerance: &Tolerance<D>) -> bool {
    let values = coarser.values.iter().zip(&finer.values).zip(&tolerance.quantities);
    values
        .into_iter()
        .all(|((before, after), quantity)| (after - before).abs() <= coarser.bound * before.abs().max(quantity.size))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::time::Duration;

    use super::super::quantity::Quantity;
    use super::*;
    use crate::geometry::{Block, Side};
    use crate::kinematics::PlaneStrain;
    use crate::material::Rubber;

    /// Under a clock that ticks once an iteration: the more time, the smaller the bound, and never no answer.
    #[test]
    fn time_ends_searches_with_the_best_model() {
        let scene =
            Scene::new(Block::new([0.0, 0.0], [40.0, 10.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3).unwrap());
        let scene = scene.hold((1, Side::Min)).prescribe((1, Side::Max), 0, 5.0).prescribe((1, Side::Max), 1, 0.0);
        let tolerance = Tolerance::of(Quantity::reaction((1, Side::Max), 0), 1e-4);
        let mut least = f64::INFINITY;
        for seconds in [0, 1, 5, 10, 20, 30] {
            let ticks = Cell::new(0);
            let clock = || {
                ticks.set(ticks.get() + 1);
                Duration::from_secs(ticks.get())
            };
            let budget = Budget { time: Some(Duration::from_secs(seconds)), ..Budget::default() };
            let mut watch = ();
            let schemes = [Scheme::elements(2), Scheme::default()];
            let answer =
                scene.sized(&schemes, &tolerance, budget, &mut Limits::new(&mut watch, budget, &clock)).unwrap();
            assert!(!answer.levels.is_empty(), "{seconds}");
            assert!(answer.bound <= least * (1.0 + 1e-12), "{seconds}: {} after {least}", answer.bound);
            assert!(
                matches!(&answer.verdict, Verdict::NotReached(why) if why.contains("is used up")),
                "{:?}",
                answer.verdict
            );
            least = answer.bound;
        }
        assert!(least < 1.0);
    }
}
