//! Materials with internal variables: what a law needs beside the deformation gradient, and how a step of time is taken.

use nalgebra::Matrix3;

/// The internal variables of a material at a point, and their update over a step.
///
/// A step leads from the internal variables at its beginning to a deformation gradient at its end, `elapsed` \[time\] later. Within it the
/// law is one of hyperelasticity, an energy of $F$ at fixed internal variables: its derivatives are
/// [`respond`](Self::respond), symmetric as ever, and Newton's method is unchanged. Once the step is accepted
/// [`update_history`](Self::update_history) writes those that the next one begins with. For a material with a
/// [`split`](super::Material::split) it stands in place of the distortional energy, else of the whole.
///
/// The contract: with no time elapsed and the variables just updated, `respond` gives the stress of the step that ended there.
///
/// A law that records its largest stretch and is elastic otherwise:
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
#[allow(clippy::len_without_is_empty)] // A law without internal variables does not implement this.
pub trait InternalVariables: Send + Sync {
    /// Number of internal variables at a point.
    fn len(&self) -> usize;

    /// Writes the internal variables at rest; zero unless said.
    fn start(&self, _memory: &mut [f64]) {}

    /// The part of the stress at rest that is left of a strain held for ever, 1 where nothing relaxes: stabilisations follow it.
    fn relaxed(&self) -> f64 {
        1.0
    }

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

    /// Writes the internal variables at the end of a step.
    fn update_history(&self, f: &Matrix3<f64>, internal_variables: &[f64], elapsed: f64, next: &mut [f64]);

    /// The deformation gradient at the end of a step where the kinematics leaves a component open, the thickness of a sheet in
    /// plane stress; the one given elsewhere.
    fn deformation(&self, f: &Matrix3<f64>, _internal_variables: &[f64], _elapsed: f64) -> Matrix3<f64> {
        *f
    }

    /// The square of the error of the stress that the step of time has left, and the square of the stress, at a point:
    /// for laws whose steps are exact, zero. `before` has the internal variables a step earlier and the time from there, where the
    /// rate of loading had no break point.
    fn time_error(&self, _before: Option<(&[f64], f64)>, _memory: &[f64], _elapsed: f64, _next: &[f64]) -> [f64; 2] {
        [0.0; 2]
    }
}
