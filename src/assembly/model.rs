//! Models: terms over one set of nodes, their forces and condensed unknowns.

use std::sync::Arc;

use crate::geometry::Point;
use crate::parallel::{map_ranges, threads};
use crate::term::{Element, Product, Term, View, Zone};

use super::Ranks;
use super::remote::RemoteTerm;

/// Unknowns below which everything stays on one thread.
pub(super) const SERIAL_BELOW: usize = 400;

/// Terms of a potential over the coefficients of one set of nodes.
pub struct Model<const D: usize> {
    pub(super) positions: Vec<Point<D>>,
    pub(super) terms: Vec<Box<dyn Term<D>>>,
    /// Nodes and condensed unknowns, memory included, that each term reads at least.
    needs: Vec<[usize; 2]>,
    /// The first term, and its cluster, whose nodes do not rise.
    unsorted: Option<[usize; 2]>,
    /// Those that share the clusters, where it is not one alone.
    pub(super) ranks: Option<Arc<dyn Ranks>>,
}

impl<const D: usize> Model<D> {
    /// A model without terms over nodes at the given reference positions.
    pub fn new(positions: Vec<Point<D>>) -> Self {
        Model { positions, terms: Vec::new(), needs: Vec::new(), unsorted: None, ranks: None }
    }

    /// Says that the terms hold one rank's share of the clusters: all sums go over the ranks from here on.
    pub fn share(&mut self, ranks: Arc<dyn Ranks>) -> &mut Self {
        self.ranks = (ranks.count() > 1).then_some(ranks);
        self
    }

    /// The ranks that share the clusters; none where this process holds all of them.
    pub fn ranks(&self) -> Option<&dyn Ranks> {
        self.ranks.as_deref()
    }

    /// Whether an observer breaks off here: where one rank's does, all stop.
    #[cfg(feature = "solve")]
    pub(crate) fn is_ended_by(&self, flow: std::ops::ControlFlow<()>) -> bool {
        let mine = f64::from(u8::from(flow.is_continue()));
        match &self.ranks {
            Some(ranks) => ranks.least(mine) == 0.0,
            None => flow.is_break(),
        }
    }

    #[cfg(feature = "solve")]
    pub(crate) fn shared_ranks(&self) -> Option<Arc<dyn Ranks>> {
        self.ranks.clone()
    }

    /// Adds a term.
    pub fn add(&mut self, term: impl Term<D> + 'static) -> &mut Self {
        let clusters = 0..term.clusters();
        let falls = |&cluster: &usize| !term.nodes(cluster).is_sorted_by(|a, b| a < b);
        if self.unsorted.is_none() {
            self.unsorted = clusters.clone().find(falls).map(|cluster| [self.terms.len(), cluster]);
        }
        let nodes = clusters.clone().flat_map(|c| term.nodes(c)).map(|&node| node as usize + 1);
        self.needs.push([
            nodes.max().unwrap_or(0),
            clusters.map(|c| term.condensed(c).end).max().unwrap_or(0).max(term.internal_variables().end),
        ]);
        self.terms.push(Box::new(term));
        self
    }

    /// Adds a term that this process knows as a whole: where ranks share the clusters, the first of them alone sums it.
    pub fn add_whole(&mut self, term: impl Term<D> + 'static) -> &mut Self {
        if self.ranks().is_some_and(|ranks| ranks.rank() > 0) { self.add(RemoteTerm(term)) } else { self.add(term) }
    }

    /// The terms.
    pub fn terms(&self) -> &[Box<dyn Term<D>>] {
        &self.terms
    }

    /// The first term, and its cluster, whose nodes do not rise: nothing can be solved with it.
    pub fn unsorted(&self) -> Option<[usize; 2]> {
        self.unsorted
    }

    /// Reference positions of the nodes \[length\].
    pub fn positions(&self) -> &[Point<D>] {
        &self.positions
    }

    /// Load factors inside $(0, 1)$ at which the forces of a term have break points.
    pub fn break_points(&self) -> Vec<f64> {
        self.terms.iter().flat_map(|term| term.break_points()).collect()
    }

    /// Number of displacement unknowns.
    pub fn unknowns(&self) -> usize {
        self.positions.len() * D
    }

    /// Condensed unknowns at zero displacement, one vector per term.
    pub fn start(&self) -> Vec<Vec<f64>> {
        self.terms
            .iter()
            .zip(&self.needs)
            .map(|(term, [_, total])| {
                let mut condensed = vec![0.0; *total];
                for cluster in 0..term.clusters() {
                    term.start(cluster, &mut condensed[term.condensed(cluster)]);
                }
                if !term.internal_variables().is_empty() {
                    term.start_internal_variables(&mut condensed[term.internal_variables()]);
                }
                condensed
            })
            .collect()
    }

    /// Whether all terms stay among the nodes.
    pub(super) fn is_complete(&self) -> bool {
        self.needs.iter().all(|[nodes, _]| *nodes <= self.positions.len())
    }

    /// Whether vectors are as long as the terms read them, and the terms stay among the nodes.
    pub(super) fn reads(&self, displacement: &[f64], condensed: &[Vec<f64>]) -> bool {
        self.is_complete() && displacement.len() == self.unknowns() && self.reads_condensed(condensed)
    }

    fn reads_condensed(&self, condensed: &[Vec<f64>]) -> bool {
        condensed.len() == self.terms.len()
            && self.needs.iter().zip(condensed).all(|([_, needed], l)| *needed <= l.len())
    }

    /// Adds what a change of the load factor does to the increments of the condensed unknowns.
    #[cfg(feature = "solve")]
    pub(crate) fn advance_load(
        &self,
        displacement: &[f64],
        condensed: &[Vec<f64>],
        load: f64,
        load_step: f64,
        condensed_step: &mut [Vec<f64>],
    ) {
        for ((term, condensed), step) in self.terms.iter().zip(condensed).zip(condensed_step) {
            if load_step != 0.0 && term.is_unilateral() {
                let view = View { displacement, condensed, load };
                for cluster in 0..term.clusters() {
                    term.advance_load(cluster, view, load_step, &mut step[term.condensed(cluster)]);
                }
            }
        }
    }

    /// Increments of the condensed unknowns for a displacement increment, and the largest admissible step factor; 0 for vectors
    /// of another model.
    pub fn advance(
        &self,
        displacement: &[f64],
        condensed: &[Vec<f64>],
        load: f64,
        step: &[f64],
        condensed_step: &mut [Vec<f64>],
    ) -> f64 {
        let fit = self.reads(displacement, condensed)
            && step.len() == displacement.len()
            && self.reads_condensed(condensed_step);
        if !fit {
            return 0.0;
        }
        let mut bound: f64 = 1.0;
        // min() would drop a NaN.
        let least = |bound: f64, limit: f64| if limit.is_nan() { 0.0 } else { bound.min(limit) };
        let parallel = self.unknowns() >= SERIAL_BELOW && threads() > 1;
        for ((term, condensed), condensed_step) in self.terms.iter().zip(condensed).zip(condensed_step) {
            let view = View { displacement, condensed, load };
            if !parallel {
                for cluster in 0..term.clusters() {
                    bound =
                        least(bound, term.advance(cluster, view, step, &mut condensed_step[term.condensed(cluster)]));
                }
                continue;
            }
            // One vector per run of clusters keeps the writes apart without unsafe code.
            let runs = map_ranges(term.clusters(), 2, |clusters| {
                let mut values = vec![0.0; clusters.clone().map(|c| term.condensed(c).len()).sum()];
                let (mut bound, mut place): (f64, usize) = (1.0, 0);
                for cluster in clusters.clone() {
                    let count = term.condensed(cluster).len();
                    bound = least(bound, term.advance(cluster, view, step, &mut values[place..place + count]));
                    place += count;
                }
                (clusters, bound, values)
            });
            for (clusters, limit, values) in runs {
                bound = least(bound, limit);
                let mut place = 0;
                for cluster in clusters {
                    let range = term.condensed(cluster);
                    condensed_step[range.clone()].copy_from_slice(&values[place..place + range.len()]);
                    place += range.len();
                }
            }
        }
        match &self.ranks {
            Some(ranks) => ranks.least(bound),
            None => bound,
        }
    }

    /// Whether the memory of a term fades with time: steps of the load are steps of time.
    pub fn is_timed(&self) -> bool {
        self.terms.iter().any(|term| term.is_timed())
    }

    /// Condensed unknowns at a converged state with the memory of the step that led there; as they are where no term
    /// remembers, and for vectors of another model.
    pub fn update_history(&self, displacement: &[f64], condensed: &mut [Vec<f64>], load: f64) {
        if !self.reads(displacement, condensed) {
            return;
        }
        for (term, condensed) in self.terms.iter().zip(condensed) {
            let range = term.internal_variables();
            if range.is_empty() {
                continue;
            }
            let mut next = condensed[range.clone()].to_vec();
            term.update_history(View { displacement, condensed, load }, &mut next);
            condensed[range].copy_from_slice(&next);
        }
    }

    /// The error that a step of time has left in the stress, relative to the stress (root of the mean squares over the body): from
    /// the condensed unknowns `before` of a step earlier, where the loads had no break point since, to those at its end, whose memory
    /// is still that of its beginning; see [`Term::time_error`]. NaN for vectors of another model.
    pub fn time_error(
        &self,
        before: Option<&[Vec<f64>]>,
        displacement: &[f64],
        condensed: &[Vec<f64>],
        load: f64,
    ) -> f64 {
        if !self.reads(displacement, condensed) || before.is_some_and(|before| !self.reads_condensed(before)) {
            return f64::NAN;
        }
        let mut sums = [0.0; 2];
        for (k, (term, condensed)) in self.terms.iter().zip(condensed).enumerate() {
            let range = term.internal_variables();
            if !term.is_timed() || range.is_empty() {
                continue;
            }
            let view = View { displacement, condensed, load };
            let mut next = condensed[range.clone()].to_vec();
            term.update_history(view, &mut next);
            let squares = term.time_error(before.map(|before| &before[k][range.clone()]), view, &next);
            for (sum, square) in sums.iter_mut().zip(squares) {
                *sum += square;
            }
        }
        if let Some(ranks) = &self.ranks {
            ranks.sum(&mut sums);
        }
        if sums[0] == 0.0 { 0.0 } else { (sums[0] / sums[1]).sqrt() }
    }

    /// The product of a zone's matrix, $C^T H C$ left out, with a vector over all unknowns: node by node of the zone.
    pub fn multiply_zone(&self, zone: &Zone, x: &[f64], product: &mut Product) {
        if let Some(term) = self.terms.get(zone.owner[0] as usize) {
            term.multiply(zone, x, product);
        }
    }

    /// Replaces increments of pressures in those of the condensed unknowns by ones that were solved for.
    #[cfg(feature = "solve")]
    pub(crate) fn take_pressures(&self, zones: &[Zone], pressures: &[[f64; 4]], condensed_step: &mut [Vec<f64>]) {
        for (zone, pressures) in zones.iter().zip(pressures) {
            let [term, cluster] = zone.owner.map(|k| k as usize);
            let range = self.terms[term].condensed(cluster);
            self.terms[term].take_pressures(cluster, pressures, &mut condensed_step[term][range]);
        }
    }

    /// The residual $r$ of the model, without any matrix; NaN for vectors of another model.
    pub fn residual(&self, displacement: &[f64], condensed: &[Vec<f64>], load: f64) -> Vec<f64> {
        if !self.reads(displacement, condensed) {
            return vec![f64::NAN; self.unknowns()];
        }
        let mut residual = vec![0.0; self.unknowns()];
        self.sum_forces(displacement, condensed, load, |unknown, force, _| residual[unknown] += force);
        if let Some(ranks) = &self.ranks {
            ranks.sum(&mut residual);
        }
        residual
    }

    /// Writes $\partial r/\partial\lambda$; NaN for vectors of another model.
    pub fn load_slope(&self, displacement: &[f64], condensed: &[Vec<f64>], load: f64, slope: &mut [f64]) {
        if !self.reads(displacement, condensed) || slope.len() != self.unknowns() {
            slope.fill(f64::NAN);
            return;
        }
        slope.fill(0.0);
        self.sum_forces(displacement, condensed, load, |unknown, _, change| slope[unknown] += change);
        if let Some(ranks) = &self.ranks {
            ranks.sum(slope);
        }
    }

    /// Visits residual and load slope of every cluster, unknown by unknown.
    fn sum_forces(
        &self,
        displacement: &[f64],
        condensed: &[Vec<f64>],
        load: f64,
        mut add: impl FnMut(usize, f64, f64),
    ) {
        let mut element = Element::default();
        for (term, condensed) in self.terms.iter().zip(condensed) {
            let view = View { displacement, condensed, load };
            for cluster in 0..term.clusters() {
                let nodes = term.nodes(cluster);
                let compact = term.fills_compact();
                element.reset(if compact { 0 } else { nodes.len() * D }, false);
                term.linearize(cluster, view, &mut element);
                for a in 0..element.residual.len() / D {
                    let node = if compact { nodes[element.compact[a] as usize] } else { nodes[a] };
                    for i in 0..D {
                        add(node as usize * D + i, element.residual[a * D + i], element.load_slope[a * D + i]);
                    }
                }
            }
        }
    }
}
