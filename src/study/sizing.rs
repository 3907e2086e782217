//! A tolerance in, the smallest sufficient model out.

use crate::error::{Error, GeometryError, SolveError};
use crate::scene::{Scene, Scheme};

use super::answer::{Answer, Budget, Tolerance};
use crate::solve::NO_FREE;

use super::progress::{Limits, Progress};

use super::nested::{Against, Course, check, failed, follow, join, judge, solve, worst};

/// Assumed order of convergence: corners of rubber parts allow no more.
const ORDER: f64 = 1.0;
/// An estimate falls at most with this power of the spacing.
const STEEPEST: f64 = 1.75;
/// Cells across the shortest side of the first model of a compact body.
const FIRST_ACROSS: f64 = 4.0;
/// Spacings across the first model of a planar shape, as if it were a square.
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
const FIRST_FACTOR: f64 = 1.5;
/// Bounds of all later factors: the larger one for a model that is expected to be the last.
const FACTORS: [f64; 2] = [1.5, 2.0];
/// The next model aims at this part of the tolerance.
const AIM: f64 = 0.8;
/// First models without a free unknown that are tried again with twice the cells.
const ATTEMPTS: usize = 4;

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
    /// let force = Quantity::reaction((1, Side::Max), 0);
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
    /// $\delta_k = \max_q|q_k - q_{k-1}|/|q_k|$ (over the size of [`relative_to`](super::Quantity::relative_to) where that is larger) and $f$ the ratio of the spacings the estimate is
    /// $$e_k = \max\Big(\frac{\delta_k}{f - 1},\ e_{k-1}\\,f^{-7/4}\Big),$$
    /// with first order assumed, because corners allow no more; an estimate that falls nearly as fast as the second order of
    /// linear functions is not believed. The energy is always looked at: where it was not asked for, its change counts in
    /// proportion to what the quantities changed beside it between the first two models, so that a quantity that
    /// passes its limit value by accident does not end the refinement. At least three models are solved, with even numbers of
    /// cells; the next one aims at eight tenths of the tolerance and has two thirds to half the spacing. Where everything that the coarsest one has is
    /// prescribed, as one cell through a thin bonded body, it takes more cells across. And where it has one cell through a
    /// thin body it is compared with the model that has two: if that changes a quantity by more than eight tenths of the
    /// tolerance, as it does in bending, all models have two or more; else the change stays part of the bound.
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
        self.solve_within_watched(scheme, tolerance, budget, &mut ())
    }

    /// As [`solve_within_by`](Scene::solve_within_by), watched: after each model, and inside each analysis.
    ///
    /// No model may take more than four times the work of all before it together, sixteen times where the estimate says that it will
    /// be the last; the work is counted in factorisations times the power 3/2 of the unknowns.
    ///
    /// # Errors
    /// As [`solve_within_by`](Scene::solve_within_by).
    pub fn solve_within_watched(
        &self,
        scheme: &Scheme,
        tolerance: &Tolerance<D>,
        budget: Budget,
        watch: &mut dyn Progress,
    ) -> Result<Answer<D>, Error> {
        check(tolerance)?;
        let mut limits = Limits::new(watch);
        let mut last_one = false;
        let mut sides = Sides::of(self)?;
        let (mut fineness, mut attempts, mut across) = (1.0, 0, 0.0);
        let mut counts = sides.counts(fineness);
        let mut answer: Option<Answer<D>> = None;
        loop {
            let scheme = scheme.clone();
            limits.begin(last_one);
            let solved =
                solve(self, scheme.clone().particles(counts.clone()), &counts, tolerance, answer.as_ref(), &mut limits);
            // Bonded on both sides, one cell through a thin body leaves nothing free.
            if let (Err(Error::Solve(SolveError::Empty { what: NO_FREE, .. })), None) = (&solved, &answer) {
                attempts += 1;
                if attempts < ATTEMPTS {
                    sides.fewest *= 2.0;
                    // Drawn shapes have no sides to count along.
                    if sides.counts(fineness) == counts {
                        fineness *= FACTORS[1];
                    }
                    counts = sides.counts(fineness);
                    continue;
                }
            }
            let (mut next, before) = match follow(solved, answer, &counts, &limits)? {
                Course::Onward(next, before) => (next, before),
                Course::Ended(best) => return Ok(best),
            };
            // Refining a thin body along itself never shows what one cell through it makes of bending.
            let through = Sides { fewest: 2.0, ..sides };
            let finer = through.counts(fineness);
            if before.is_empty() && counts.contains(&2) && finer != counts {
                limits.begin(true);
                let scheme = scheme.particles(finer.clone());
                let second = solve(self, scheme, &finer, tolerance, Some(&next), &mut limits);
                let mut second = match second {
                    Ok(second) => second,
                    Err(error) => {
                        next.verdict = failed(&finer, &error, &limits);
                        return Ok(next);
                    }
                };
                across = worst(&next.levels[0], &second.levels[0], tolerance);
                if across > AIM * tolerance.error {
                    (sides, counts, across) = (through, finer, 0.0);
                    std::mem::swap(&mut next, &mut second);
                }
                next.levels[0].iterations += second.levels[0].iterations;
                next.levels[0].seconds += second.levels[0].seconds;
            }
            let last = before.len().checked_sub(1);
            let last = last.map(|place| {
                let factor: f64 = sides.spacing(&before[place].counts) / sides.spacing(&counts);
                Against { place, ratio: factor.powf(ORDER), left: factor.powf(-STEEPEST), least: across }
            });
            join(&mut next, before, tolerance, last);
            let course = judge(next, tolerance, budget, &mut limits, |next| {
                let factor = match next.levels.len() {
                    1 => FIRST_FACTOR,
                    _ => (next.bound / (AIM * tolerance.error)).powf(1.0 / ORDER).max(FACTORS[0]),
                };
                last_one = next.levels.len() > 1 && factor <= FACTORS[1];
                // Four times the work, unless it will be the last.
                let factor = if last_one { factor } else { factor.min(FACTORS[0]) };
                // Models that round to the same counts are skipped.
                let mut fineness = fineness;
                while sides.counts(fineness * factor) == counts {
                    fineness *= 1.05;
                }
                let finer = sides.counts(fineness * factor);
                Ok((finer.iter().fold(D, |n, &c| n.saturating_mul(c)), (fineness * factor, finer)))
            });
            match course {
                Course::Onward(next, finer) => {
                    answer = Some(next);
                    (fineness, counts) = finer;
                }
                Course::Ended(found) => return Ok(found),
            }
        }
    }
}

/// Lengths of the sides of a body's unit cube, and how they are divided.
#[derive(Clone, Copy)]
struct Sides<const D: usize> {
    lengths: [f64; D],
    first: f64,
    /// Longest side of those that count as thickness.
    thin: f64,
    /// Cells across a side of the first model at least.
    fewest: f64,
    /// Numbers of cells are even, where there are more than two.
    in_pairs: bool,
}

impl<const D: usize> Sides<D> {
    fn of(scene: &Scene<D>) -> Result<Self, Error> {
        if scene.is_scattered() {
            // A planar shape takes the product of the counts as its number of particles.
            return Ok(Sides {
                lengths: [1.0; D],
                first: 1.0 / FIRST_SCATTERED,
                thin: 0.0,
                fewest: 1.0,
                in_pairs: false,
            });
        }
        let needed = "a scene on a block, mapped block or planar region, whose particles can be chosen";
        let lengths = scene.side_lengths().ok_or(GeometryError::Unsuited { what: "sizing to a tolerance", needed })?;
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        let shortest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
        let first = if longest > THIN * shortest { longest / FIRST_ALONG } else { shortest / FIRST_ACROSS };
        // Sides that are nearly alike are taken as equal to the shortest, in favour of cells of any shape.
        let lengths = lengths.map(|l| if l < ALIKE * shortest { shortest } else { l });
        Ok(Sides { lengths, first, thin: longest / THIN, fewest: 1.0, in_pairs: true })
    }

    /// Particles along each axis for a spacing `fineness` times finer than the first.
    fn counts(&self, fineness: f64) -> Vec<usize> {
        let spacing = self.first / fineness;
        // What made them necessary varies across: they are refined with the others.
        let fewest = if self.fewest > 1.0 { (self.fewest * fineness).round() } else { 1.0 };
        let cells = |&length: &f64| {
            let coarser = if length < self.thin { ACROSS } else { 1.0 };
            let cells = length / (coarser * spacing);
            // Pressure zones take two by two: the wider one that an odd number leaves makes errors of its own, and models
            // with and without it differ by them.
            if self.in_pairs && cells >= 2.5 { 2.0 * (0.5 * cells).round() } else { cells.round() }.max(fewest)
        };
        self.lengths.iter().map(|length| cells(length).min(1e7) as usize + 1).collect()
    }

    /// The largest spacing of counts.
    fn spacing(&self, counts: &[usize]) -> f64 {
        let along = self.lengths.iter().zip(counts).filter(|(length, _)| **length >= self.thin);
        along.map(|(length, &n)| length / (n - 1) as f64).fold(0.0, f64::max)
    }
}
