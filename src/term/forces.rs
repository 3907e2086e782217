//! Forces of a term at its nodes.

use std::ops::Range;

use super::Term;
use super::element::{Element, View};
use crate::each::sum_of;

/// Hands out a node of each of some clusters with its part of the residual and of the load slope, without any matrix.
pub(crate) fn each_force(
    term: &dyn Term,
    clusters: Range<usize>,
    view: View<'_>,
    element: &mut Element,
    mut with: impl FnMut(usize, &[f64], &[f64]),
) {
    let dim = term.dim();
    for cluster in clusters {
        let nodes = term.nodes(cluster);
        element.reset(nodes.len() * dim, false);
        term.linearize(cluster, view, element);
        let both = element.residual.chunks_exact(dim).zip(element.load_slope.chunks_exact(dim));
        for (&node, (residual, load_slope)) in nodes.iter().zip(both) {
            with(node as usize, residual, load_slope);
        }
    }
}

/// Adds the residual of a term to a vector over all nodes.
pub(crate) fn add_residual(term: &dyn Term, view: View<'_>, sum: &mut [f64]) {
    let dim = term.dim();
    each_force(term, 0..term.clusters(), view, &mut Element::default(), |node, residual, _| {
        sum[node * dim..].iter_mut().zip(residual).for_each(|(sum, part)| *sum += part);
    });
}

/// The energy that a term stores.
pub(crate) fn stored(term: &dyn Term, view: View<'_>) -> f64 {
    sum_of(term.clusters(), |cluster| term.energy(cluster, view))
}
