//! PETSc and MPI, started once in a process.

use std::ffi::{CStr, c_int, c_void};
use std::ptr;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::thread::{self, ThreadId};

use rkpm::assembly::Ranks;

use crate::error::PetscError;
use crate::ffi;
use crate::solver::Remains;

/// Numbers in one message of MPI.
const MESSAGE: usize = 1 << 27;

/// The library of this process: not started, running, or ended for good.
static LIBRARY: Mutex<Option<Weak<Library>>> = Mutex::new(None);

/// Turns a code into a result.
pub(crate) fn check(function: &'static str, code: c_int) -> Result<(), PetscError> {
    if code == 0 {
        return Ok(());
    }
    let mut text = ptr::null();
    // SAFETY: PETSc hands out a static string, or leaves the pointer as it is.
    let text = unsafe {
        ffi::PetscErrorMessage(code, &mut text, ptr::null_mut());
        if text.is_null() { String::from("unknown") } else { CStr::from_ptr(text).to_string_lossy().into_owned() }
    };
    Err(PetscError::Call { function, code, text })
}

/// The running library; ends with its last user.
#[derive(Debug)]
struct Library {
    home: ThreadId,
    /// What is to be destroyed when all ranks ask for something new.
    remains: Mutex<Vec<Remains>>,
}

impl Drop for Library {
    fn drop(&mut self) {
        // On another thread, or where a rank unwinds alone, the others would wait for ever.
        if self.home == thread::current().id() && !thread::panicking() {
            // SAFETY: all objects hold the library, so none is left.
            unsafe { ffi::PetscFinalize() };
        }
    }
}

/// A session of PETSc over all ranks that `mpirun` started; one rank without it.
///
/// All ranks run the same program: what this crate does for one of them, all of them must ask for, in the same order.
#[derive(Debug, Clone)]
pub struct Session {
    library: Arc<Library>,
    rank: usize,
    count: usize,
}

/// Which of several values stays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reduction {
    Sum,
    Largest,
}

impl Session {
    /// Starts MPI and PETSc, once in a process and on the thread that will solve.
    ///
    /// # Errors
    /// Where PETSc can't start, or a session of this process has ended.
    pub fn start() -> Result<Self, PetscError> {
        let mut current = LIBRARY.lock().unwrap_or_else(PoisonError::into_inner);
        let library = match current.as_ref().map(Weak::upgrade) {
            Some(Some(library)) => library,
            Some(None) => return Err(PetscError::Ended),
            None => {
                // SAFETY: the first calls of PETSc, as its manual asks for them; the handler is PETSc's own.
                unsafe {
                    check("PetscInitialize", ffi::PetscInitializeNoArguments())?;
                    // Errors come back as codes; by default PETSc prints them and ends the process.
                    check(
                        "PetscPushErrorHandler",
                        ffi::PetscPushErrorHandler(ffi::PetscReturnErrorHandler, ptr::null_mut()),
                    )?;
                }
                let library = Arc::new(Library { home: thread::current().id(), remains: Mutex::default() });
                *current = Some(Arc::downgrade(&library));
                library
            }
        };
        let (mut rank, mut count) = (0, 1);
        // SAFETY: MPI runs, its communicator of all ranks is valid.
        unsafe {
            check("MPI_Comm_rank", ffi::MPI_Comm_rank(ffi::PETSC_COMM_WORLD, &mut rank))?;
            check("MPI_Comm_size", ffi::MPI_Comm_size(ffi::PETSC_COMM_WORLD, &mut count))?;
        }
        Ok(Session { library, rank: rank as usize, count: count as usize })
    }

    /// This rank, counted from 0.
    pub fn rank(&self) -> usize {
        self.rank
    }

    /// How many ranks there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Ends all ranks with an exit code, from any of them: the others would wait for ever for one that has failed alone.
    pub fn abort(&self, code: i32) -> ! {
        // SAFETY: MPI runs as long as the session.
        unsafe { ffi::MPI_Abort(ffi::PETSC_COMM_WORLD, code) };
        std::process::exit(code)
    }

    /// A reduction that must not fail: the other ranks wait for it.
    fn certainly(&self, reduction: Reduction, values: &mut [f64]) {
        if let Err(error) = self.reduce(reduction, values) {
            eprintln!("rank {}: {error}", self.rank);
            self.abort(1);
        }
    }

    /// Keeps objects that are to be destroyed.
    pub(crate) fn leave(&self, remains: Remains) {
        self.library.remains.lock().unwrap_or_else(PoisonError::into_inner).push(remains);
    }

    /// Destroys what was left, on all ranks.
    pub(crate) fn clear(&self) {
        if self.at_home().is_ok() {
            let mut remains = self.library.remains.lock().unwrap_or_else(PoisonError::into_inner);
            remains.drain(..).for_each(Remains::destroy);
        }
    }

    /// Refuses calls from other threads than the one that started the library.
    pub(crate) fn at_home(&self) -> Result<(), PetscError> {
        if self.library.home == thread::current().id() { Ok(()) } else { Err(PetscError::Thread) }
    }

    /// Reduces values over the ranks; all get the same bits, those that rank 0 has found.
    pub(crate) fn reduce(&self, reduction: Reduction, values: &mut [f64]) -> Result<(), PetscError> {
        if self.count == 1 {
            return Ok(());
        }
        self.at_home()?;
        // SAFETY: the addresses of Open MPI's own objects; the buffers are as long as said and live through the calls.
        unsafe {
            let op = match reduction {
                Reduction::Sum => &raw const ffi::ompi_mpi_op_sum,
                Reduction::Largest => &raw const ffi::ompi_mpi_op_max,
            };
            let double = &raw const ffi::ompi_mpi_double;
            let mut received = Vec::new();
            for part in values.chunks_mut(MESSAGE) {
                received.clear();
                received.resize(part.len(), 0.0);
                let (length, world) = (part.len() as c_int, ffi::PETSC_COMM_WORLD);
                let (from, to) = (part.as_ptr().cast::<c_void>(), received.as_mut_ptr().cast::<c_void>());
                check("MPI_Reduce", ffi::MPI_Reduce(from, to, length, double, op, 0, world))?;
                check("MPI_Bcast", ffi::MPI_Bcast(to, length, double, 0, world))?;
                part.copy_from_slice(&received);
            }
        }
        Ok(())
    }
}

impl Ranks for Session {
    fn rank(&self) -> usize {
        self.rank
    }

    fn count(&self) -> usize {
        self.count
    }

    fn sum(&self, values: &mut [f64]) {
        self.certainly(Reduction::Sum, values);
    }

    fn largest(&self, values: &mut [f64]) {
        self.certainly(Reduction::Largest, values);
    }
}
