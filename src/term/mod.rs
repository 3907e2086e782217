//! Terms of the potential: what is summed over clusters of points.

mod advance;
mod amplitude;
mod at_points;
mod body;
mod body_pressures;
mod body_term;
mod body_zones;
mod contraction;
mod curve;
mod diagnostics;
mod element;
mod forces;
mod integrand;
mod internal_variables;
mod layout;
mod linearize;
mod load;
mod lower;
mod point_panel;
mod pressure_field;
mod product;
mod stabilisation;
mod step_limit;
mod uncondensed;
mod volumetric_measure;
mod zone_residuals;

pub use amplitude::Amplitude;
pub use body::Body;
pub use diagnostics::StateDiagnostics;
pub use element::{Coupling, Element, ForceDensities, TermState, TermStep, View};
pub use integrand::{Integrand, PointDerivatives, PointState, Pointwise, Sparsity};
pub use layout::{Form, Layout};
pub(crate) use load::foundation;
pub use load::{DeadLoad, ElasticFoundation, FollowerPressure};
pub use pressure_field::{PressureField, ProjectedMeasure};
pub use uncondensed::{Product, Zone};

pub(crate) use at_points::PointMotion;
pub(crate) use curve::{Curve, straight_until};
pub(crate) use forces::each_force;
pub(crate) use forces::{add_residual, stored};
pub(crate) use lower::LowerBlocks;

use std::ops::Range;

use crate::error::SolveError;
use crate::material::Past;

/// A term of the potential $\Pi(d, \text{condensed}; \lambda)$, summed over clusters of nodes.
///
/// A term may carry condensed unknowns (pressures): it condenses them in [`linearize`](Term::linearize)
/// and recovers their increments in [`advance`](Term::advance).
///
/// ```
/// use rkpm::term::{Element, Term, View};
/// /// A linear spring of stiffness k between component 0 of two nodes in one dimension.
/// struct Spring { nodes: [u32; 2], stiffness: f64 }
/// impl Term for Spring {
///     fn dim(&self) -> usize { 1 }
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
/// assert!(Spring { nodes: [0, 1], stiffness: 2.0 }.layout().symmetric);
/// ```
pub trait Term: Send + Sync {
    /// Displacement components of a node: 1 along an axis, 2 in a plane, 3 in 3D. A model takes terms of its own dimension alone.
    fn dim(&self) -> usize;

    /// Number of clusters: one unless a term has another one.
    fn clusters(&self) -> usize {
        1
    }

    /// Nodes of a cluster, each once and by rising index; others are refused before an analysis begins.
    fn nodes(&self, cluster: usize) -> &[u32];

    /// Refuses what can't be summed, before an analysis begins: a force over a table without values.
    ///
    /// # Errors
    /// What is missing, and what to do.
    fn validate(&self) -> Result<(), SolveError> {
        Ok(())
    }

    /// What is known of it before any state is.
    fn layout(&self) -> Layout {
        Layout::default()
    }

    /// Load factors inside $(0, 1)$ at which the forces of the term have break points: steps of the load stop there.
    fn break_points(&self) -> Vec<f64> {
        Vec::new()
    }

    /// The amplitudes that its loads follow: steps of the load end before one of them that is a function turns back.
    fn amplitudes(&self) -> Vec<Amplitude> {
        Vec::new()
    }

    /// Adds the cluster's forces, load slope and, where requested, its matrix to zeroed buffers.
    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element);

    /// Where the condensed unknowns of a cluster stand among those of the term: unknowns that it condenses cluster by cluster, and whose
    /// increments [`advance`](Term::advance) finds. No cluster has those of another one; others are refused before an analysis begins.
    fn unknowns(&self, _cluster: usize) -> Range<usize> {
        0..0
    }

    /// Writes the condensed unknowns of all clusters that belong to zero displacement, and the internal variables at rest, into zeros.
    fn start(&self, _condensed: &mut [f64], _history: &mut [f64]) {}

    /// For a Newton increment, writes the increments of the cluster's condensed unknowns and returns the largest step factor in $[0, 1]$
    /// that keeps the path admissible.
    fn advance(&self, _cluster: usize, _view: View<'_>, _step: TermStep<'_>, _condensed_step: &mut [f64]) -> f64 {
        1.0
    }

    /// Energy stored in the cluster; zero for loads.
    fn energy(&self, _cluster: usize, _view: View<'_>) -> f64 {
        0.0
    }

    /// Writes the internal variables at a converged state, from what they were when the step to that state began. With them, and no time
    /// elapsed, the forces at the state are to be what they were: reactions are taken from them.
    fn update(&self, _view: View<'_>, _next: &mut [f64]) {}

    /// Squares of the error that a step of time has left in the stress, and of the stress, summed over the term: from `before`, the internal
    /// variables a step earlier and the time of that step where the loads had no break point since, over `view` with those of its
    /// beginning, to `next`.
    fn time_error(&self, _before: Option<Past<'_>>, _view: View<'_>, _next: &[f64]) -> [f64; 2] {
        [0.0; 2]
    }

    /// The farthest load factor on the way from one to another that a single step may go to.
    fn farthest_load(&self, _from: f64, to: f64) -> f64 {
        to
    }

    /// Why a converged state does not follow from the last one: the body has left the rigid surface that it was said to lie on, or the
    /// surface has gone through the body. The step is tried again with a smaller increment.
    fn check_step(&self, _before: View<'_>, _after: View<'_>) -> Option<String> {
        None
    }

    /// What rounding of coordinates makes of the condensed unknowns, and of the norm of the forces: changes below are none. Contact that
    /// has come to rest under next to no force needs it, all else is measured beside its forces.
    fn rounding(&self) -> [f64; 2] {
        [0.0; 2]
    }

    /// The largest $|\nabla u|$ (Frobenius) of a displacement in a cluster; tells how far from linear it is.
    fn largest_gradient(&self, _cluster: usize, _displacement: &[f64]) -> f64 {
        0.0
    }

    /// The smallest determinant of $F$ in a cluster and where, for terms that have one; negative beyond the axis of
    /// revolution, where the hoop stretch is.
    fn smallest_jacobian(&self, _cluster: usize, _view: View<'_>) -> Option<(f64, Vec<f64>)> {
        None
    }

    /// What a cluster tells of the trust in a state.
    fn diagnostics(&self, _cluster: usize, _view: View<'_>) -> StateDiagnostics {
        StateDiagnostics::default()
    }

    /// The forces on the body as densities at points, for terms that have no others: what stresses are recovered in
    /// equilibrium with.
    fn force_densities(&self, _view: View<'_>) -> Option<ForceDensities> {
        None
    }

    /// How it hands its matrix over: those of users node by node.
    #[doc(hidden)]
    fn form(&self) -> Form<'_> {
        Form::Nodes
    }

    /// Adds the product of the kept part of a cluster's matrix with a vector to zeros, node by node: $K x$ beside $C^T H C x$.
    #[doc(hidden)]
    fn multiply(&self, _zone: &Zone, _x: &[f64], _product: &mut Product) {}

    /// Lets the search for what faces what rest as it was at the last state, or go on; whether there is one.
    #[doc(hidden)]
    fn hold_search(&self, _hold: bool) -> bool {
        false
    }
}
