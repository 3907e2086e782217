//! Terms of the potential: what is summed over clusters of points.

mod advance;
mod amplitude;
mod at_points;
mod body;
mod body_pressures;
mod body_term;
mod body_zones;
mod contraction;
#[cfg(feature = "solve")]
mod curve;
mod diagnostics;
mod element;
mod forces;
mod integrand;
mod internal_variables;
mod linearize;
mod load;
mod lower;
mod point_contraction;
mod point_panel;
mod pressure_field;
mod product;
mod protocol;
mod stabilisation;
mod step_limit;
mod uncondensed;
mod views;
mod volumetric_measure;
mod zone_residuals;

pub use amplitude::Amplitude;
pub use body::Body;
pub use diagnostics::StateDiagnostics;
pub use element::{Element, ForceDensities, View};
pub use integrand::{Integrand, PointDerivatives, PointState, Pointwise, Sparsity};
#[cfg(feature = "solve")]
pub(crate) use load::foundation;
pub use load::{DeadLoad, ElasticFoundation, FollowerPressure};
pub use pressure_field::{PressureField, ProjectedMeasure};
pub use uncondensed::{Product, Zone};
pub use views::{CondensedUnknowns, Diagnostics, History, TermMatrix, Unilateral};

pub(crate) use at_points::PointMotion;
#[cfg(feature = "solve")]
pub(crate) use curve::{Curve, straight_until};
pub(crate) use forces::each_force;
#[cfg(feature = "solve")]
pub(crate) use forces::{add_residual, stored};
pub(crate) use lower::LowerBlocks;
pub(crate) use protocol::Protocol;

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
/// impl Term for Spring {
///     fn dim(&self) -> usize { 1 }
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
/// assert!(Spring { nodes: [0, 1], stiffness: 2.0 }.matrix().symmetric);
/// ```
pub trait Term: Send + Sync {
    /// Displacement components of a node: 1 along an axis, 2 in a plane, 3 in 3D. A model takes terms of its own dimension alone.
    fn dim(&self) -> usize;

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

    /// What is known of the matrix.
    fn matrix(&self) -> TermMatrix {
        TermMatrix::default()
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

    /// For the Newton increment `step` of the displacement, writes the increments of the cluster's
    /// condensed unknowns and returns the largest step factor in $[0, 1]$ that keeps the path admissible.
    fn advance(&self, _cluster: usize, _view: View<'_>, _step: &[f64], _condensed_step: &mut [f64]) -> f64 {
        1.0
    }

    /// Energy stored in the cluster; zero for loads.
    fn energy(&self, _cluster: usize, _view: View<'_>) -> f64 {
        0.0
    }

    /// Its condensed unknowns.
    fn condensed(&self) -> Option<&dyn CondensedUnknowns> {
        None
    }

    /// Its internal variables.
    fn history(&self) -> Option<&dyn History> {
        None
    }

    /// What acts from one side only.
    fn unilateral(&self) -> Option<&dyn Unilateral> {
        None
    }

    /// What it tells of a state beside its forces.
    fn diagnostics(&self) -> Option<&dyn Diagnostics> {
        None
    }

    /// What terms of this crate arrange with the assembler.
    #[doc(hidden)]
    fn protocol(&self) -> &dyn Protocol {
        &protocol::Plain
    }
}

/// Where the condensed unknowns of a cluster stand; nowhere for terms without any.
pub(crate) fn condensed_range(term: &dyn Term, cluster: usize) -> std::ops::Range<usize> {
    term.condensed().map_or(0..0, |condensed| condensed.unknowns(cluster))
}

/// Where the internal variables of a term stand; nowhere for terms without any.
pub(crate) fn variables_range(term: &dyn Term) -> std::ops::Range<usize> {
    term.history().map_or(0..0, |history| history.variables())
}
