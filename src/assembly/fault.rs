//! Terms that break their promises, by name.

use crate::each::Each;
use crate::term::{Element, Form, Layout, Term, View};

use super::model_at::ModelAt;

/// Entries of a matrix that was promised to be symmetric may differ by this part of the largest one, the root of a rounding: so much is
/// left of a matrix that was differentiated numerically.
const ALIKE: f64 = 1.5e-8;

/// What is wrong with the contribution of a cluster of so many unknowns, whose matrix was filled node by node where there is one.
pub(crate) fn fault(size: usize, layout: Layout, element: &Element) -> Option<&'static str> {
    let finite = |all: &[f64]| all.iter().all(|x| x.is_finite());
    let Element { residual, load_slope, matrix: entries, coupling, .. } = element;
    let square = entries.len() == size * size || entries.is_empty() && !element.with_matrix;
    if residual.len() != size || load_slope.len() != size || !square {
        return Some(
            "Term::linearize() changes the length of a buffer; keep the lengths in which they are handed over",
        );
    }
    if !finite(residual) || !finite(load_slope) {
        return Some("forces or load slopes are not finite");
    }
    let coupled = || coupling.iter().flat_map(|of| of.left.iter().chain(&of.right));
    if coupled().any(|(k, _)| *k as usize >= size) {
        return Some(
            "its coupling names unknowns that the cluster lacks; number them node by node within the cluster, below the length of the residual",
        );
    }
    if !finite(entries) || coupled().any(|(_, x)| !x.is_finite()) {
        return Some("entries of the matrix are not finite");
    }
    if layout.symmetric && is_unsymmetric(size, entries) {
        return Some("the matrix is not symmetric; return `symmetric: false` from Term::layout(), and fill all of it");
    }
    None
}

/// The place of the first force density that is not finite.
fn infinite_at(term: &dyn Term, view: View<'_>) -> Option<[f64; 3]> {
    let densities = term.force_densities(view)?;
    let point = densities.forces.iter().position(|force| force.iter().any(|f| !f.is_finite()))?;
    Some(densities.positions[point].into())
}

/// Whether a matrix differs from its transpose. What is zero above the diagonal may have been left out.
fn is_unsymmetric(size: usize, matrix: &[f64]) -> bool {
    let mut apart = 0.0f64;
    for (column, entries) in matrix.chunks_exact(size.max(1)).enumerate() {
        for (row, &above) in entries[..column].iter().enumerate() {
            let difference = (above - matrix[row * size + column]).abs();
            // Entries that agree for themselves agree for the largest, too.
            if above != 0.0 && difference > ALIKE * above.abs() {
                apart = apart.max(difference);
            }
        }
    }
    apart > 0.0 && apart > ALIKE * matrix.largest(|entry| entry.abs())
}

impl ModelAt<'_> {
    /// The first term that breaks a promise at this state, and how. Bodies and contacts of this crate are left out.
    pub(crate) fn fault(self) -> Option<String> {
        let own = |(number, term): (usize, &dyn Term)| {
            let (layout, view) = (term.layout(), self.view(number));
            let mut element = Element::default();
            (0..term.clusters()).find_map(|cluster| {
                let size = term.nodes(cluster).len() * term.dim();
                element.reset(size, layout.has_matrix);
                term.linearize(cluster, view, &mut element);
                let what = fault(size, layout, &element)?;
                let at = infinite_at(term, view).map(|x| format!(", at X = {x:?}")).unwrap_or_default();
                Some(format!("term {number} of the model, cluster {cluster}: {what}{at}"))
            })
        };
        let dense = |(_, term): &(usize, &dyn Term)| matches!(term.form(), Form::Nodes);
        self.model.summed().filter(dense).find_map(own)
    }
}
