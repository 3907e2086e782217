//! Measures of a state: energy, gradients, determinants, and how far it can be trusted.

use crate::each::Each;
use crate::material::Past;
use crate::parallel::map_with;
use crate::term::{StateDiagnostics, Term, TermState, View};

use super::model_at::ModelAt;
use super::state_ref::StateRef;
use super::{Model, Ranks};

impl ModelAt<'_> {
    /// Energy stored in all terms \[stress·length³; per unit length in plane strain\].
    pub fn energy(self) -> f64 {
        let mut energy = [self.fold(|term, cluster, view| term.energy(cluster, view), 0.0, |sum, own| sum + own)];
        self.model.total(&mut energy);
        energy[0]
    }

    /// The smallest $\det F$ at any point and where; `None` where no term has a deformation gradient.
    pub fn smallest_jacobian(self) -> Option<(f64, Vec<f64>)> {
        type Found = Option<(f64, Vec<f64>)>;
        let smaller = |least: Found, found: Found| match (least, found) {
            (Some(least), Some(found)) if !(found.0 < least.0 || found.0.is_nan()) => Some(least),
            (least, found) => found.or(least),
        };
        let smallest = self.fold(|term, cluster, view| term.smallest_jacobian(cluster, view), None, smaller);
        match &self.model.ranks {
            Some(ranks) => smallest_of_all(&**ranks, self.model.dim(), smallest),
            None => smallest,
        }
    }

    /// How far the state can be trusted: the worst of all clusters.
    pub(crate) fn diagnostics(self) -> StateDiagnostics {
        let own = |term: &dyn Term, cluster: usize, view: View<'_>| term.diagnostics(cluster, view);
        let diagnostics = self.fold(own, StateDiagnostics::default(), StateDiagnostics::join);
        match &self.model.ranks {
            Some(ranks) => diagnostics.over(|values| ranks.largest(values), |value| ranks.sum(value)),
            None => diagnostics,
        }
    }

    /// Why the state does not follow from another one by a step.
    pub(crate) fn check_step(self, before: Self) -> Option<String> {
        let mut terms = self.model.terms.iter().enumerate();
        terms.find_map(|(number, term)| term.check_step(before.view(number), self.view(number)))
    }

    /// What terms hold of a converged state, with the memory of the step that led there.
    pub(crate) fn update_history(self) -> Vec<TermState> {
        let mut terms = self.at.terms.to_vec();
        for (number, (term, own)) in self.model.terms.iter().zip(&mut terms).enumerate() {
            term.update(self.view(number), &mut own.history);
        }
        terms
    }

    /// The error that a step of time has left in the stress, relative to the stress (root of the mean squares over the body): from
    /// the state `before`, a step earlier, where the loads had no break point since, to those at its end, whose memory
    /// is still that of its beginning; see [`Term::time_error`](crate::term::Term::time_error).
    pub(crate) fn time_error(self, before: Option<StateRef<'_>>) -> f64 {
        let mut sums = [0.0; 2];
        for (number, term) in self.model.summed() {
            if !term.layout().timed {
                continue;
            }
            let view = self.view(number);
            let mut next = view.history.to_vec();
            term.update(view, &mut next);
            let before = before
                .map(|before| Past { memory: &before.terms[number].history, elapsed: self.at.time - before.time });
            let squares = term.time_error(before, view, &next);
            for (sum, square) in sums.iter_mut().zip(squares) {
                *sum += square;
            }
        }
        self.model.total(&mut sums);
        if sums[0] == 0.0 { 0.0 } else { (sums[0] / sums[1]).sqrt() }
    }

    /// Joins what each cluster of each term has, in their order; all threads look for it where the model is large.
    fn fold<T: Send, A>(
        self,
        of: impl Fn(&dyn Term, usize, View<'_>) -> T + Sync,
        start: A,
        join: impl Fn(A, T) -> A,
    ) -> A {
        let mut joined = start;
        for (number, term) in self.model.summed() {
            let (clusters, view) = (term.clusters(), self.view(number));
            if self.is_small() {
                for cluster in 0..clusters {
                    joined = join(joined, of(term, cluster, view));
                }
                continue;
            }
            for found in map_with(clusters, 2, || (), |(), cluster| of(term, cluster, view)) {
                joined = join(joined, found);
            }
        }
        joined
    }
}

impl Model {
    /// The largest $|\nabla u|$ of a displacement at any point.
    pub(crate) fn largest_gradient(&self, displacement: &[f64]) -> f64 {
        let of_clusters = |term: &std::sync::Arc<dyn Term>| {
            (0..term.clusters()).map(|c| term.largest_gradient(c, displacement)).fold(0.0, f64::max)
        };
        let mine = self.terms.largest(of_clusters);
        match &self.ranks {
            Some(ranks) => -ranks.least(-mine),
            None => mine,
        }
    }
}

/// The smallest determinant of all ranks and where: that of the first rank that has found it.
fn smallest_of_all(ranks: &dyn Ranks, dim: usize, mine: Option<(f64, Vec<f64>)>) -> Option<(f64, Vec<f64>)> {
    // A determinant that is none stands before all others.
    let key = mine.as_ref().map_or(f64::INFINITY, |found| if found.0.is_nan() { f64::NEG_INFINITY } else { found.0 });
    let least = ranks.least(key);
    if least == f64::INFINITY {
        return None;
    }
    let first = ranks.least(if key == least { ranks.rank() as f64 } else { f64::INFINITY });
    let mut at = vec![0.0; dim];
    if let Some((_, place)) = mine.filter(|_| first == ranks.rank() as f64) {
        at.iter_mut().zip(&place).for_each(|(at, x)| *at = *x);
    }
    ranks.sum(&mut at);
    Some((if least == f64::NEG_INFINITY { f64::NAN } else { least }, at))
}
