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
    /// More than one rank.
    #[error("the program runs on {count} ranks, a scene is solved on one: start it without mpirun")]
    Ranks {
        /// How many ranks there are.
        count: usize,
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
