//! Errors: one small enum per layer, each in its own file, and one enum for all of them.
//!
//! Each message states where the problem is, what it is, and what to do about it.

/// Returns an error, lifted to that of the function, unless a condition holds.
macro_rules! ensure {
    ($holds:expr, $error:expr) => {
        if !$holds {
            return Err($error.into());
        }
    };
}

mod approximation;
mod boundary;
mod contact;
mod doubt;
#[cfg(feature = "serde")]
pub(crate) mod finite;
#[cfg(feature = "fit")]
mod fit;
mod geometry;
mod incompatible;
mod invalid;
mod linear;
mod material;
mod mesh;
mod output;
mod solid;
mod solve;
mod stalled;

pub use approximation::ApproximationError;
pub use boundary::BoundaryError;
pub use contact::ContactError;
pub use doubt::{Doubt, DoubtCause};
#[cfg(feature = "fit")]
pub use fit::FitError;
pub use geometry::GeometryError;
pub use incompatible::Incompatible;
pub use invalid::Invalid;
pub use linear::LinearError;
pub use material::MaterialError;
pub use mesh::MeshError;
pub use output::OutputError;
pub use solid::SolidError;
pub use solve::SolveError;
pub use stalled::{Cause, Driven, Stalled};

use thiserror::Error;

/// Any error of this crate.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// An invalid number, whatever it was given to.
    #[error(transparent)]
    Invalid(#[from] Invalid),
    /// Two choices that can't be combined.
    #[error(transparent)]
    Incompatible(#[from] Incompatible),
    /// Geometry, cells, rules.
    #[error(transparent)]
    Geometry(GeometryError),
    /// Meshes and their files.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// Particles and shape functions.
    #[error(transparent)]
    Approximation(#[from] ApproximationError),
    /// Materials.
    #[error(transparent)]
    Material(MaterialError),
    /// Loads and conditions.
    #[error(transparent)]
    Boundary(#[from] BoundaryError),
    /// Contact.
    #[error(transparent)]
    Contact(ContactError),
    /// Linear algebra.
    #[error(transparent)]
    Linear(#[from] LinearError),
    /// Newton and stepping.
    #[error(transparent)]
    Solve(SolveError),
    /// Files and charts.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Fits to test data.
    #[cfg(feature = "fit")]
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// Invalid numbers have one variant, whichever layer finds them.
macro_rules! lifted {
    ($($variant:ident($error:ident)),*) => {
        $(impl From<$error> for Error {
            fn from(error: $error) -> Self {
                match error {
                    $error::Invalid(invalid) => Error::Invalid(invalid),
                    error => Error::$variant(error),
                }
            }
        })*
    };
}

impl From<Cause> for Error {
    fn from(cause: Cause) -> Self {
        Error::Solve(SolveError::Attempt(cause))
    }
}

lifted!(Geometry(GeometryError), Material(MaterialError), Contact(ContactError), Solve(SolveError));
