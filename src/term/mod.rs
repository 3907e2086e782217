//! Terms of the potential: what is summed over clusters of points.

mod advance;
mod amplitude;
mod body;
mod body_pressures;
mod body_term;
mod body_zones;
mod contraction;
mod diagnostics;
mod element;
mod integrand;
mod internal_variables;
mod linearize;
mod load;
mod lower;
mod point_contraction;
mod point_panel;
mod pressure_field;
mod product;
mod shared;
mod stabilisation;
mod step_limit;
mod uncondensed;
mod volumetric_measure;
mod zone_residuals;

pub use amplitude::Amplitude;
pub use body::Body;
pub use diagnostics::StateDiagnostics;
pub use element::{Element, ForceDensities, View};
pub use integrand::{Integrand, PointDerivatives, PointState, Pointwise, Sparsity};
pub use load::{DeadLoad, ElasticFoundation, FollowerPressure};
pub use pressure_field::{PressureField, ProjectedMeasure};
pub use step_limit::largest_step;
pub use uncondensed::{Product, Zone};

pub(crate) use lower::LowerBlocks;

use crate::error::SolveError;

/// A term of the potential $\Pi(d, \text{condensed}; \lambda)$, summed over clusters of nodes.
///
/// A term may carry condensed unknowns (pressures): it condenses them in [`linearize`](Term::linearize)
/// and recovers their increments in [`advance`](Term::advance).
///
/// ```
/// use rkpm::term::{Element, Term, View};
/// /// A linear spring of stiffness k between component 0 of two nodes in one dimension.
/// struct Spring { nodes: [u32; 2], stiffness: f64 }
/// impl Term<1> for Spring {
///     fn clusters(&self) -> usize { 1 }
///     fn nodes(&self, _: usize) -> &[u32] { &self.nodes }
///     fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
///         let d = |a: usize| view.displacement[self.nodes[a] as usize];
///         let force = self.stiffness * (d(1) - d(0));
///         out.residual.copy_from_slice(&[-force, force]);
///         if out.with_matrix {
///             out.matrix.copy_from_slice(&[1.0, -1.0, -1.0, 1.0].map(|s| s * self.stiffness));
///         }
///     }
///     fn energy(&self, _: usize, view: View<'_>) -> f64 {
///         let stretch = view.displacement[self.nodes[1] as usize] - view.displacement[self.nodes[0] as usize];
///         0.5 * self.stiffness * stretch * stretch
///     }
/// }
/// assert!(Spring { nodes: [0, 1], stiffness: 2.0 }.is_symmetric());
/// ```
pub trait Term<const D: usize>: Send + Sync {
    /// Number of clusters.
    fn clusters(&self) -> usize;

    /// Nodes of a cluster, each once and by rising index; others are refused before an analysis begins.
    fn nodes(&self, cluster: usize) -> &[u32];

    /// Refuses what can't be summed, before an analysis begins: a force over a table without values.
    ///
    /// # Errors
    /// What is missing, and what to do.
    fn validate(&self) -> Result<(), SolveError> {
        Ok(())
    }

    /// Whether the matrix is symmetric in every cluster.
    fn is_symmetric(&self) -> bool {
        true
    }

    /// Whether the term has a matrix at all: dead loads have none, and nothing is summed for them.
    fn has_matrix(&self) -> bool {
        true
    }

    /// Whether the matrix changes with the load factor while displacement and condensed unknowns stay: follower loads do so.
    /// Where no term does, the matrix at rest is formed once for all loads.
    fn matrix_follows_load(&self) -> bool {
        true
    }

    /// Load factors inside $(0, 1)$ at which the forces of the term have break points: steps of the load stop there.
    fn break_points(&self) -> Vec<f64> {
        Vec::new()
    }

    /// Whether the term acts from one side only, as contact does: the load leads runs with it, for no tangent displacement tells
    /// what touches.
    fn is_unilateral(&self) -> bool {
        false
    }

    /// The farthest load factor on the way from one to another that a single step may go to.
    fn farthest_load(&self, _from: f64, to: f64) -> f64 {
        to
    }

    /// Whether the term fills the lower blocks that the assembler asks for; those of this crate alone know them.
    #[doc(hidden)]
    fn fills_lower_blocks(&self) -> bool {
        false
    }

    /// Whether the term can keep its condensed unknowns apart; those of this crate alone know how.
    #[doc(hidden)]
    fn separates(&self) -> bool {
        false
    }

    /// Writes the product of the kept part of a cluster's matrix with a vector, node by node: $K x$ beside $C^T H C x$.
    #[doc(hidden)]
    fn multiply(&self, _zone: &Zone, _x: &[f64], _product: &mut Product) {}

    /// Takes increments of pressures that were kept uncondensed, instead of those that follow from the step.
    #[doc(hidden)]
    fn take_pressures(&self, _cluster: usize, _pressures: &[f64; 4], _condensed_step: &mut [f64]) {}

    /// Visits lists of nodes, by their places in the cluster, that the matrix couples beside condensed unknowns.
    #[doc(hidden)]
    fn couplings(&self, _cluster: usize, _visit: &mut dyn FnMut(&[u16])) {}

    /// Whether the term fills buffers over a few of many nodes, the same for all clusters, as contact does where what touches what
    /// is not known before.
    #[doc(hidden)]
    fn fills_compact(&self) -> bool {
        false
    }

    /// Where the condensed unknowns of a cluster stand among those of the term.
    fn condensed(&self, _cluster: usize) -> std::ops::Range<usize> {
        0..0
    }

    /// Writes the condensed unknowns of a cluster that belong to zero displacement.
    fn start(&self, _cluster: usize, _locals: &mut [f64]) {}

    /// Where the memory of the term stands, behind the condensed unknowns of all clusters: what it carries from one converged state to
    /// the next, held while Newton's method iterates.
    fn internal_variables(&self) -> std::ops::Range<usize> {
        0..0
    }

    /// Writes the memory that belongs to the state at rest.
    fn start_internal_variables(&self, _memory: &mut [f64]) {}

    /// Writes the memory at a converged state, from what it was when the step to that state began.
    fn update_history(&self, _view: View<'_>, _next: &mut [f64]) {}

    /// Whether the memory fades with time, so that loads are steps of it: the load factor leads.
    fn is_timed(&self) -> bool {
        false
    }

    /// Squares of the error that a step of time has left in the stress, and of the stress, summed over the term: from `before`,
    /// the memory a step earlier where the loads had no break point since, over `view` with the memory of its beginning, to `next`.
    fn time_error(&self, _before: Option<&[f64]>, _view: View<'_>, _next: &[f64]) -> [f64; 2] {
        [0.0; 2]
    }

    /// Adds the cluster's forces, load slope and, where requested, its matrix to zeroed buffers.
    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element);

    /// For the Newton increment `step` of the displacement, writes the increments of the cluster's
    /// condensed unknowns and returns the largest step factor in $[0, 1]$ that keeps the path admissible.
    fn advance(&self, _cluster: usize, _view: View<'_>, _step: &[f64], _locals_step: &mut [f64]) -> f64 {
        1.0
    }

    /// Adds what a change of the load factor in the same increment does to the increments of a cluster's condensed unknowns, where the
    /// load factor is unknown: contact with a surface that is moved.
    fn advance_load(&self, _cluster: usize, _view: View<'_>, _load_step: f64, _locals_step: &mut [f64]) {}

    /// Why a converged state is none that the term can answer for: a body that has left the rigid surface it was said to lie on.
    /// The run ends before it.
    fn check_state(&self, _view: View<'_>) -> Option<String> {
        None
    }

    /// What rounding of coordinates makes of the condensed unknowns, and of the norm of the forces: changes below are none. Contact that
    /// has come to rest under next to no force needs it, all else is measured beside its forces.
    fn rounding(&self) -> [f64; 2] {
        [0.0; 2]
    }

    /// Energy stored in the cluster; zero for loads.
    fn energy(&self, _cluster: usize, _view: View<'_>) -> f64 {
        0.0
    }

    /// The largest $|\nabla u|$ (Frobenius) of a displacement in the cluster; tells how far from linear it is.
    fn largest_gradient(&self, _cluster: usize, _displacement: &[f64]) -> f64 {
        0.0
    }

    /// The smallest determinant of $F$ in the cluster and where, for terms that have one; negative beyond the axis of
    /// revolution, where the hoop stretch is.
    fn smallest_jacobian(&self, _cluster: usize, _view: View<'_>) -> Option<(f64, Vec<f64>)> {
        None
    }

    /// What the cluster tells of the trust in a state; nothing for loads.
    fn diagnostics(&self, _cluster: usize, _view: View<'_>) -> StateDiagnostics {
        StateDiagnostics::default()
    }

    /// The forces on the body as densities at points, for terms that have no others: what stresses are recovered in
    /// equilibrium with.
    fn force_densities(&self, _view: View<'_>) -> Option<ForceDensities<D>> {
        None
    }
}
