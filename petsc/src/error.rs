//! What PETSc or MPI refused.

use rkpm::error::LinearError;

/// Why a call of PETSc or MPI failed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PetscError {
    /// A function returned an error code.
    #[error("{function} failed with code {code}: {text}")]
    Call {
        /// The function.
        function: &'static str,
        /// Its code.
        code: i32,
        /// What PETSc says of the code.
        text: String,
    },
    /// PETSc was called from a thread other than the one that started it.
    #[error("PETSc was started on another thread: call it from the thread that called Session::start")]
    Thread,
    /// A session of this process has ended: MPI starts once in a process.
    #[error("MPI has been finalised in this process and does not start again: keep one session for the whole program")]
    Ended,
    /// MUMPS could not factorise the matrix.
    #[error("MUMPS could not factorise the matrix: INFOG(1) = {}, INFOG(2) = {}; -9 and -13 ask for more memory: take more ranks or Gamg", code[0], code[1])]
    Factors {
        /// MUMPS' two codes.
        code: [i32; 2],
    },
    /// Journals are no whole set of one run.
    #[error("the journals of the ranks do not fit together: {what}")]
    Pieces {
        /// Which, and why.
        what: String,
    },
    /// More unknowns or entries than 32-bit indices hold.
    #[error("{size} {what} are more than PETSc's 32-bit indices hold: {remedy}")]
    Size {
        /// Of what.
        what: &'static str,
        /// How many.
        size: usize,
        /// What to do.
        remedy: &'static str,
    },
}

impl From<PetscError> for LinearError {
    fn from(error: PetscError) -> Self {
        LinearError::Library { what: error.to_string() }
    }
}
