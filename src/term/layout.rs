//! The fixed properties of a term, and the form of its matrix.

use crate::table::Clusters;

use super::at_points::PointMotion;

/// What is known of a term before any state is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Whether there is a matrix at all: dead loads have none, and nothing is summed for them.
    pub has_matrix: bool,
    /// Whether the matrix is symmetric in every cluster.
    pub symmetric: bool,
    /// Whether the matrix changes with the load factor while displacement and condensed unknowns stay, as that of follower loads does.
    /// Where that of no term does, the matrix at rest is formed once for all loads.
    pub follows_load: bool,
    /// Whether the matrix acts on the steps of Newton's method alone and resists nothing.
    pub artificial: bool,
    /// Whether it acts from one side only, as contact does: the load leads runs with it, for no tangent displacement tells what comes into
    /// contact.
    pub unilateral: bool,
    /// Number of internal variables: what a term carries from one converged state to the next, held while Newton's method iterates.
    pub history: usize,
    /// Whether the internal variables fade with time, so that steps of the load are steps of it where the model has a clock: the load factor
    /// leads.
    pub timed: bool,
    /// Number of nodes of its shape functions, which must be that of the model; none for a term without shape functions.
    pub nodes: Option<usize>,
}

impl Default for Layout {
    /// A symmetric matrix that may change with the load factor, and nothing else.
    fn default() -> Self {
        Layout {
            has_matrix: true,
            symmetric: true,
            follows_load: true,
            artificial: false,
            unilateral: false,
            history: 0,
            timed: false,
            nodes: None,
        }
    }
}

impl Form<'_> {
    /// Whether the matrix stays at its points, where pressures are kept.
    pub(crate) fn stays(self, kept: bool) -> bool {
        kept && matches!(self, Form::Blocks { kept: true, .. })
    }
}

/// How a term hands over the matrix of a cluster.
#[derive(Clone, Copy)]
pub enum Form<'a> {
    /// Over all unknowns of its nodes, in [`Element::matrix`](super::Element::matrix).
    Nodes,
    /// The lower half in blocks that whole registers are added to. Its zones may be `kept`: pressures that are not condensed, beside
    /// tangents at points in place of the rest.
    Blocks {
        /// Whether its zones can be kept.
        kept: bool,
        /// Where pressures are left out, the points whose nodes are coupled.
        apart: Option<&'a Clusters>,
    },
    /// Over points that move with the nodes: what comes into contact is not known before, and couples a few of many nodes at a time.
    Points(&'a PointMotion),
}
