//! Measures of a state: energy, gradients, determinants, and how far it can be trusted.

use crate::term::{StateDiagnostics, Term, View};

use super::{Model, Ranks};

impl<const D: usize> Model<D> {
    /// Energy stored in all terms \[stress·length³; per unit length in plane strain\]; NaN for vectors of another model.
    pub fn energy(&self, displacement: &[f64], condensed: &[Vec<f64>], load: f64) -> f64 {
        if !self.reads(displacement, condensed) {
            return f64::NAN;
        }
        let mut energy = 0.0;
        for (term, condensed) in self.terms.iter().zip(condensed) {
            let view = View { displacement, condensed, load };
            for cluster in 0..term.clusters() {
                energy += term.energy(cluster, view);
            }
        }
        if let Some(ranks) = &self.ranks {
            let mut total = [energy];
            ranks.sum(&mut total);
            return total[0];
        }
        energy
    }

    /// The largest $|\nabla u|$ of a displacement at any point; NaN for one of another model.
    pub fn largest_gradient(&self, displacement: &[f64]) -> f64 {
        if !self.is_complete() || displacement.len() != self.unknowns() {
            return f64::NAN;
        }
        let of_term = |term: &dyn Term<D>| {
            (0..term.clusters()).map(|c| term.largest_gradient(c, displacement)).fold(0.0, f64::max)
        };
        let mine = self.terms.iter().map(|term| of_term(&**term)).fold(0.0, f64::max);
        match &self.ranks {
            Some(ranks) => -ranks.least(-mine),
            None => mine,
        }
    }

    /// The smallest $\det F$ at any point and where, `None` where no term has a deformation gradient; NaN nowhere for vectors
    /// of another model.
    pub fn smallest_jacobian(
        &self,
        displacement: &[f64],
        condensed: &[Vec<f64>],
        load: f64,
    ) -> Option<(f64, Vec<f64>)> {
        if !self.reads(displacement, condensed) {
            return Some((f64::NAN, Vec::new()));
        }
        let mut smallest: Option<(f64, Vec<f64>)> = None;
        for (term, condensed) in self.terms.iter().zip(condensed) {
            let view = View { displacement, condensed, load };
            for cluster in 0..term.clusters() {
                if let Some(found) = term.smallest_jacobian(cluster, view)
                    && smallest.as_ref().is_none_or(|s| found.0 < s.0 || found.0.is_nan())
                {
                    smallest = Some(found);
                }
            }
        }
        match &self.ranks {
            Some(ranks) => smallest_of_all::<D>(&**ranks, smallest),
            None => smallest,
        }
    }

    /// How far a state can be trusted: the worst of all clusters; Jacobians are NaN for vectors of another model.
    pub fn diagnostics(&self, displacement: &[f64], condensed: &[Vec<f64>], load: f64) -> StateDiagnostics {
        if !self.reads(displacement, condensed) {
            return StateDiagnostics { jacobians: Some([f64::NAN; 2]), ..StateDiagnostics::default() };
        }
        let mut diagnostics = StateDiagnostics::default();
        for (term, condensed) in self.terms.iter().zip(condensed) {
            let view = View { displacement, condensed, load };
            for cluster in 0..term.clusters() {
                diagnostics = diagnostics.join(term.diagnostics(cluster, view));
            }
        }
        match &self.ranks {
            Some(ranks) => diagnostics.over(|values| ranks.largest(values), |value| ranks.sum(value)),
            None => diagnostics,
        }
    }

    /// Why a state is none that a term can answer for.
    #[cfg(feature = "solve")]
    pub(crate) fn check_state(&self, displacement: &[f64], condensed: &[Vec<f64>], load: f64) -> Option<String> {
        let mut terms = self.terms.iter().zip(condensed);
        terms.find_map(|(term, condensed)| term.check_state(View { displacement, condensed, load }))
    }
}

/// The smallest determinant of all ranks and where: that of the first rank that has found it.
fn smallest_of_all<const D: usize>(ranks: &dyn Ranks, mine: Option<(f64, Vec<f64>)>) -> Option<(f64, Vec<f64>)> {
    // A determinant that is none stands before all others.
    let key = mine.as_ref().map_or(f64::INFINITY, |found| if found.0.is_nan() { f64::NEG_INFINITY } else { found.0 });
    let least = ranks.least(key);
    if least == f64::INFINITY {
        return None;
    }
    let first = ranks.least(if key == least { ranks.rank() as f64 } else { f64::INFINITY });
    let mut at = [0.0; D];
    if let Some((_, place)) = mine.filter(|_| first == ranks.rank() as f64) {
        at.iter_mut().zip(&place).for_each(|(at, x)| *at = *x);
    }
    ranks.sum(&mut at);
    Some((if least == f64::NEG_INFINITY { f64::NAN } else { least }, at.to_vec()))
}
