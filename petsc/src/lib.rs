#![warn(missing_docs)]
//! PETSc's solvers behind the traits of [`rkpm::linear`], the ground for scenes on many ranks.
//!
//! Needs PETSc and Open MPI (Debian: `libpetsc-real-dev`, `libopenmpi-dev`).

mod error;
#[allow(unsafe_code)]
mod ffi;
#[allow(unsafe_code)]
mod session;
#[allow(unsafe_code)]
mod solver;

pub use error::PetscError;
pub use session::Session;
pub use solver::Mumps;
