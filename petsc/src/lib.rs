#![warn(missing_docs)]
//! Scenes of rkpm on many ranks: PETSc's solvers behind the traits of [`rkpm::linear`].
//!
//! Needs PETSc and Open MPI (Debian: `libpetsc-real-dev`, `libopenmpi-dev`).

mod error;
#[allow(unsafe_code)]
mod ffi;
#[allow(unsafe_code)]
mod gamg;
mod journals;
mod pieces;
mod program;
#[allow(unsafe_code)]
mod session;
#[allow(unsafe_code)]
mod solver;

pub use error::PetscError;
pub use gamg::Gamg;
pub use journals::Journals;
pub use program::on_all_ranks;
pub use session::Session;
pub use solver::Mumps;
