//! Contact: rigid surfaces, and the law of touching as terms with pressures of their own.
//!
//! Nothing is tuned: pressures are iterates of Newton's method, and where they come to rest gaps are closed to rounding.

mod bins;
mod chain;
mod chains;
mod contact_surface;
mod counted;
mod face_table;
mod faces;
mod facets;
mod facing;
mod friction;
mod interference;
mod jet;
mod law;
mod mortar;
mod neutral;
mod obstacle;
mod overlap;
mod pair;
mod pair_term;
mod profile;
mod rigid;
mod rigid_dof;
mod shapes;
mod surface;
mod triangulated;
mod turning;
mod vertices;

pub use crate::error::ContactError;
pub use profile::Profile;
pub use rigid::RigidSurface;
pub(crate) use shapes::{Cone, Plane, Round};
pub use surface::{Nearest, Surface};
pub use triangulated::Triangulated;

pub(crate) use chains::chains;
pub(crate) use contact_surface::{ContactSurface, Trace};
pub(crate) use facing::THROUGH;
pub(crate) use interference::{Interference, validate};
pub(crate) use law::{ContactLaw, Stiffness, started};
pub(crate) use neutral::RollingSpring;
pub(crate) use obstacle::RigidContact;
pub(crate) use pair::PairContact;
pub(crate) use rigid::Obstacle;
pub(crate) use rigid_dof::{ArtificialSpring, RigidBodyDof};

#[cfg(test)]
mod tests {
    use nalgebra::{SMatrix, SVector};

    /// Asserts that gradient and Hessian of a function of coordinates are those of its differences.
    pub(super) fn assert_derivatives<const N: usize>(
        at: impl Fn(&[f64; N]) -> (f64, SVector<f64, N>, SMatrix<f64, N, N>),
        q: &[f64; N],
    ) {
        use approx::abs_diff_eq;
        let (_, here, curve_here) = at(q);
        let step = 1e-5;
        for k in 0..N {
            let (mut up, mut down) = (*q, *q);
            up[k] += step;
            down[k] -= step;
            let (up, down) = (at(&up), at(&down));
            let slope = (up.0 - down.0) / (2.0 * step);
            assert!(abs_diff_eq!(slope, here[k], epsilon = 1e-8), "{k}: {slope} {}", here[k]);
            let curve = (up.1 - down.1) / (2.0 * step);
            assert!(abs_diff_eq!(curve, curve_here.column(k).into_owned(), epsilon = 1e-7), "{k}");
        }
    }
}
