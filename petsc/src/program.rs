//! Programs on all ranks, which end together.

use std::fmt::Display;
use std::panic::{self, AssertUnwindSafe};
use std::process::ExitCode;
use std::thread::sleep;
use std::time::Duration;

use crate::session::Session;

/// What other ranks wait for the first one's message: what fails alike on all of them is told once.
const PATIENCE: Duration = Duration::from_millis(500);

/// Runs a program on all ranks that `mpirun` started. One that fails or panics on any rank ends all of them, with its message
/// and a code other than 0; otherwise they would wait for it for ever.
///
/// ```ignore
/// fn main() -> std::process::ExitCode {
///     rkpm_petsc::on_all_ranks(|session| {
///         let problem = scene()?.discretize(&Scheme::default().solver(Mumps::new(session)))?;
///         let path = problem.run()?.completed()?;
///         if session.rank() == 0 {
///             println!("{}", problem.energy(path.last())?);
///         }
///         Ok::<(), rkpm::Error>(())
///     })
/// }
/// ```
pub fn on_all_ranks<E: Display>(program: impl FnOnce(&Session) -> Result<(), E>) -> ExitCode {
    let session = match Session::start() {
        Ok(session) => session,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::FAILURE;
        }
    };
    // The message of a panic is ours.
    let usual = panic::take_hook();
    panic::set_hook(Box::new(|_| ()));
    let outcome = panic::catch_unwind(AssertUnwindSafe(|| program(&session)));
    panic::set_hook(usual);
    let message = match outcome {
        Ok(Ok(())) => return ExitCode::SUCCESS,
        Ok(Err(error)) => error.to_string(),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
            format!("the program panicked: {text}")
        }
    };
    if session.rank() > 0 {
        sleep(PATIENCE);
    }
    eprintln!("rank {} of {}: {message}", session.rank(), session.count());
    session.abort(1)
}
