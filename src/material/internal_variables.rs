//! Laws that remember: what a material needs beside the deformation gradient, and how a step of time is taken.

use nalgebra::Matrix3;

/// The part of a laws with internal variables where it has been, point by point.
///
/// A step leads from what is remembered at its beginning to a deformation gradient at its end, `elapsed` \[time\] later. Within it the
/// law is one of hyperelasticity, an energy of $F$ with what is remembered held: its derivatives are
/// [`respond`](Self::respond), symmetric as ever, and Newton's method sees nothing new. Once the step is accepted
/// [`update_history`](Self::update_history) writes what the next one begins with. For a material with a
/// [`split`](super::Material::split) it stands in place of the distortional energy, else of the whole.
///
/// The contract: with no time elapsed and what was just remembered, `respond` gives the stress of the step that ended there.
///
/// A plastic-like memory of the largest stretch, which stiffens nothing and only counts:
///
/// ```
/// use rkpm::material::{Material, InternalVariables, Rubber};
/// use rkpm::nalgebra::Matrix3;
///
/// struct Counted(Rubber);
/// impl InternalVariables for Counted {
///     fn len(&self) -> usize { 1 }
///     fn energy(&self, f: &Matrix3<f64>, _: &[f64], _: f64) -> f64 { self.0.split().unwrap().0.energy(f) }
///     fn respond(&self, f: &Matrix3<f64>, _: &[f64], _: f64, c: &[usize], p: &mut [f64], a: &mut [f64]) {
///         self.0.split().unwrap().0.respond(f, c, p, a);
///     }
///     fn update_history(&self, f: &Matrix3<f64>, internal_variables: &[f64], _: f64, next: &mut [f64]) {
///         next[0] = internal_variables[0].max(f.norm());
///     }
/// }
/// let mut next = [0.0];
/// Counted(Rubber::neo_hookean(0.5, 1e3)?).update_history(&Matrix3::identity(), &[0.0], 0.0, &mut next);
/// assert_eq!(next, [3f64.sqrt()]);
/// # Ok::<(), rkpm::error::MaterialError>(())
/// ```
#[allow(clippy::len_without_is_empty)] // A memory of nothing has no use.
pub trait InternalVariables: Send + Sync {
    /// Numbers that are remembered at a point.
    fn len(&self) -> usize;

    /// Writes what is remembered at rest; zeros as they are.
    fn start(&self, _memory: &mut [f64]) {}

    /// The energy whose derivatives are the stress and the tangent at the end of a step \[stress\].
    fn energy(&self, f: &Matrix3<f64>, internal_variables: &[f64], elapsed: f64) -> f64;

    /// Stress and tangent at the end of a step in a few components, as [`Material::respond`](super::Material::respond) writes them.
    fn respond(
        &self,
        f: &Matrix3<f64>,
        internal_variables: &[f64],
        elapsed: f64,
        components: &[usize],
        stress: &mut [f64],
        tangent: &mut [f64],
    );

    /// Writes what is remembered at the end of a step.
    fn update_history(&self, f: &Matrix3<f64>, internal_variables: &[f64], elapsed: f64, next: &mut [f64]);

    /// The square of the error of the stress that the step of time has left, and the square of the stress, at a point:
    /// for laws whose steps are exact, zero. `before` is what was remembered a step earlier and the time from there, where the
    /// rate of loading had no break point.
    fn time_error(&self, _before: Option<(&[f64], f64)>, _memory: &[f64], _elapsed: f64, _next: &[f64]) -> [f64; 2] {
        [0.0; 2]
    }
}
