//! What some terms have beside forces and a matrix.

use std::ops::Range;

use super::diagnostics::StateDiagnostics;
use super::element::{ForceDensities, View};

/// What is known of the matrix of a term before it is formed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TermMatrix {
    /// Whether there is one at all: dead loads have none, and nothing is summed for them.
    pub exists: bool,
    /// Whether it is symmetric in every cluster.
    pub symmetric: bool,
    /// Whether it changes with the load factor while displacement and condensed unknowns stay, as that of follower loads does. Where
    /// that of no term does, the matrix at rest is formed once for all loads.
    pub follows_load: bool,
}

impl Default for TermMatrix {
    /// A symmetric matrix that may change with the load factor.
    fn default() -> Self {
        TermMatrix { exists: true, symmetric: true, follows_load: true }
    }
}

/// Unknowns that a term condenses cluster by cluster; their increments come from [`Term::advance`](super::Term::advance).
///
/// ```
/// use rkpm::term::CondensedUnknowns;
/// /// One pressure per cluster, zero at rest.
/// struct Pressures;
/// impl CondensedUnknowns for Pressures {
///     fn unknowns(&self, cluster: usize) -> std::ops::Range<usize> { cluster..cluster + 1 }
/// }
/// assert_eq!(Pressures.unknowns(3), 3..4);
/// ```
pub trait CondensedUnknowns {
    /// Where the unknowns of a cluster stand among those of the term.
    fn unknowns(&self, cluster: usize) -> Range<usize>;

    /// Writes the unknowns of a cluster that belong to zero displacement into zeros.
    fn start(&self, _cluster: usize, _unknowns: &mut [f64]) {}
}

/// Internal variables: what a term carries from one converged state to the next, held while Newton's method iterates.
///
/// ```
/// use rkpm::term::{History, View};
/// /// The largest displacement of the first node so far.
/// struct Largest;
/// impl History for Largest {
///     fn variables(&self) -> std::ops::Range<usize> { 0..1 }
///     fn update(&self, view: View<'_>, next: &mut [f64]) { next[0] = view.condensed[0].max(view.displacement[0]); }
/// }
/// let mut next = [0.0];
/// Largest.update(View { displacement: &[0.2], condensed: &[0.1], load: 1.0 }, &mut next);
/// assert_eq!(next, [0.2]);
/// ```
pub trait History {
    /// Where the variables stand, behind the condensed unknowns of all clusters.
    fn variables(&self) -> Range<usize>;

    /// Writes the variables at rest into zeros.
    fn start_variables(&self, _variables: &mut [f64]) {}

    /// Writes the variables at a converged state, from what they were when the step to that state began.
    fn update(&self, view: View<'_>, next: &mut [f64]);

    /// Whether the variables fade with time, so that loads are steps of it: the load factor leads.
    fn is_timed(&self) -> bool {
        false
    }

    /// Squares of the error that a step of time has left in the stress, and of the stress, summed over the term: from `before`,
    /// the variables a step earlier where the loads had no break point since, over `view` with those of its beginning, to `next`.
    fn time_error(&self, _before: Option<&[f64]>, _view: View<'_>, _next: &[f64]) -> [f64; 2] {
        [0.0; 2]
    }
}

/// A term that acts from one side only, as contact does: the load leads runs with it, for no tangent displacement tells what
/// comes into contact.
///
/// ```
/// use rkpm::term::Unilateral;
/// /// A stop that no step may pass by more than a tenth of the load.
/// struct Stop;
/// impl Unilateral for Stop {
///     fn farthest_load(&self, from: f64, to: f64) -> f64 { to.min(from + 0.1) }
/// }
/// assert_eq!(Stop.farthest_load(0.0, 1.0), 0.1);
/// ```
pub trait Unilateral {
    /// The farthest load factor on the way from one to another that a single step may go to.
    fn farthest_load(&self, _from: f64, to: f64) -> f64 {
        to
    }

    /// Adds what a change of the load factor in the same increment does to the increments of a cluster's condensed unknowns, where the
    /// load factor is unknown: contact with a surface that is moved.
    fn advance_load(&self, _cluster: usize, _view: View<'_>, _load_step: f64, _condensed_step: &mut [f64]) {}

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
}

/// What a term tells of a state beside its forces.
///
/// ```
/// use rkpm::term::{Diagnostics, View};
/// /// A bar of unit length between nodes 0 and 1.
/// struct Bar;
/// impl Diagnostics for Bar {
///     fn largest_gradient(&self, _: usize, d: &[f64]) -> f64 { (d[1] - d[0]).abs() }
///     fn smallest_jacobian(&self, _: usize, view: View<'_>) -> Option<(f64, Vec<f64>)> {
///         Some((1.0 + view.displacement[1] - view.displacement[0], vec![0.5]))
///     }
/// }
/// assert_eq!(Bar.largest_gradient(0, &[0.0, -0.5]), 0.5);
/// ```
pub trait Diagnostics {
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
    fn of_state(&self, _cluster: usize, _view: View<'_>) -> StateDiagnostics {
        StateDiagnostics::default()
    }

    /// The forces on the body as densities at points, for terms that have no others: what stresses are recovered in
    /// equilibrium with.
    fn force_densities(&self, _view: View<'_>) -> Option<ForceDensities> {
        None
    }
}
