//! Forces of a term at its nodes.

use super::Term;
use super::element::{Element, View};

/// Hands out a node of each cluster with its part of the residual and of the load slope, without any matrix.
pub(crate) fn each_force<const D: usize>(
    term: &dyn Term<D>,
    view: View<'_>,
    element: &mut Element,
    mut with: impl FnMut(usize, &[f64], &[f64]),
) {
    let compact = term.protocol().fills_compact();
    for cluster in 0..term.clusters() {
        let nodes = term.nodes(cluster);
        element.reset(if compact { 0 } else { nodes.len() * D }, false);
        term.linearize(cluster, view, element);
        let both = element.residual.chunks_exact(D).zip(element.load_slope.chunks_exact(D));
        for (a, (residual, load_slope)) in both.enumerate() {
            let node = if compact { nodes[element.compact[a] as usize] } else { nodes[a] };
            with(node as usize, residual, load_slope);
        }
    }
}
