//! A model at a state: forces, and increments of the condensed unknowns.

use crate::error::SolveError;
use crate::parallel::{map_ranges, threads};
use crate::term::{Element, TermStep, View, Zone, each_force};

use super::model::{Model, SERIAL_BELOW};
use super::state_ref::StateRef;

/// Clusters whose forces are held at a time.
const BATCH: usize = 4096;

/// A model at a state that fits it.
#[derive(Clone, Copy)]
pub struct ModelAt<'a> {
    pub(super) model: &'a Model,
    pub(super) at: StateRef<'a>,
}

impl Model {
    /// The model at a state.
    ///
    /// # Errors
    /// [`SolveError::OtherModel`] for a state of another model.
    pub fn at<'a>(&'a self, state: impl Into<StateRef<'a>>) -> Result<ModelAt<'a>, SolveError> {
        let at = state.into();
        self.check(at)?;
        Ok(self.at_own(at))
    }

    /// The model at a state that is known to be one of its own.
    pub(crate) fn at_own<'a>(&'a self, state: impl Into<StateRef<'a>>) -> ModelAt<'a> {
        ModelAt { model: self, at: state.into() }
    }
}

impl<'a> ModelAt<'a> {
    /// The state as the term of a number sees it.
    pub(crate) fn view(self, term: usize) -> View<'a> {
        self.model.view(self.at, term).unwrap_or_else(|| View::at_rest(self.at.displacement, self.at.load))
    }

    /// The residual $r$, without any matrix.
    pub fn residual(self) -> Vec<f64> {
        self.sum_forces(|force, _| force)
    }

    /// $\partial r/\partial\lambda$.
    pub(crate) fn load_slope(self) -> Vec<f64> {
        self.sum_forces(|_, change| change)
    }

    /// Sums what is taken of residual and load slope of every cluster, node by node.
    fn sum_forces(self, take: impl Fn(f64, f64) -> f64 + Sync) -> Vec<f64> {
        let (dim, mut sums) = (self.model.dim(), vec![0.0; self.model.unknowns()]);
        for (number, term) in self.model.summed() {
            let view = self.view(number);
            for first in (0..term.clusters()).step_by(BATCH) {
                let count = BATCH.min(term.clusters() - first);
                let runs = map_ranges(count, if self.is_small() { usize::MAX } else { 2 }, |some| {
                    let clusters = first + some.start..first + some.end;
                    let (mut element, mut taken) = (Element::default(), Vec::new());
                    each_force(term, clusters, view, &mut element, |_, residual, load_slope| {
                        taken.extend((0..dim).map(|i| take(residual[i], load_slope[i])));
                    });
                    taken
                });
                // In the order of the clusters, whatever thread has found them.
                let nodes = (first..first + count).flat_map(|cluster| term.nodes(cluster));
                let taken = runs.iter().flat_map(|run| run.chunks_exact(dim));
                for (&node, taken) in nodes.zip(taken) {
                    for i in 0..dim {
                        sums[node as usize * dim + i] += taken[i];
                    }
                }
            }
        }
        self.model.total(&mut sums);
        sums
    }

    /// Whether one thread does all.
    pub(super) fn is_small(self) -> bool {
        self.model.unknowns() < SERIAL_BELOW || threads() < 2
    }

    /// Increments of the condensed unknowns for a step of the other unknowns; the largest admissible step factor.
    ///
    /// # Errors
    /// [`SolveError::OtherModel`] for increments of another model.
    pub fn advance(self, step: TermStep<'_>, condensed_step: &mut [Vec<f64>]) -> Result<f64, SolveError> {
        self.model.check_step(step.displacement, condensed_step)?;
        Ok(self.advance_own(step, condensed_step))
    }

    /// As [`advance`](Self::advance), for increments that are known to be some of the model's own.
    pub(crate) fn advance_own(self, step: TermStep<'_>, condensed_step: &mut [Vec<f64>]) -> f64 {
        let model = self.model;
        let mut bound: f64 = 1.0;
        // min() would drop a NaN.
        let least = |bound: f64, limit: f64| if limit.is_nan() { 0.0 } else { bound.min(limit) };
        for (number, (term, condensed_step)) in model.terms.iter().zip(condensed_step).enumerate() {
            let view = self.view(number);
            if self.is_small() {
                for cluster in 0..term.clusters() {
                    bound =
                        least(bound, term.advance(cluster, view, step, &mut condensed_step[term.unknowns(cluster)]));
                }
                continue;
            }
            // One vector per run of clusters keeps the writes apart without unsafe code.
            let runs = map_ranges(term.clusters(), 2, |clusters| {
                let mut values = vec![0.0; clusters.clone().map(|c| term.unknowns(c).len()).sum()];
                let (mut bound, mut place): (f64, usize) = (1.0, 0);
                for cluster in clusters.clone() {
                    let count = term.unknowns(cluster).len();
                    bound = least(bound, term.advance(cluster, view, step, &mut values[place..place + count]));
                    place += count;
                }
                (clusters, bound, values)
            });
            for (clusters, limit, values) in runs {
                bound = least(bound, limit);
                let mut place = 0;
                for cluster in clusters {
                    let range = term.unknowns(cluster);
                    condensed_step[range.clone()].copy_from_slice(&values[place..place + range.len()]);
                    place += range.len();
                }
            }
        }
        match &model.ranks {
            Some(ranks) => ranks.least(bound),
            None => bound,
        }
    }

    /// Replaces increments of pressures in those of the condensed unknowns by ones that were solved for.
    pub(crate) fn take_pressures(self, zones: &[Zone], pressures: &[[f64; 4]], condensed_step: &mut [Vec<f64>]) {
        for (zone, pressures) in zones.iter().zip(pressures) {
            let functions = zone.slopes.len() / (self.model.dim() * zone.nodes.len());
            condensed_step[zone.owner[0] as usize][zone.place..][..functions].copy_from_slice(&pressures[..functions]);
        }
    }
}
