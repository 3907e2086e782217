//! Newton's method with local unknowns, load stepping, and the path of converged states.

mod analysis;
mod chord;
mod critical;
mod increment;
mod lead;
mod march;
mod newton;
mod path;
mod recorded;
mod rejection;
mod routes;
mod search;
mod stepping;
mod volume;
mod ways;

pub use analysis::Analysis;
pub(crate) use analysis::NO_FREE;
pub use critical::{Bracketing, CriticalKind, CriticalPoint};
pub use newton::{Control, Deflection, Functional, Matrices, Newton};
pub use path::{Ending, Iteration, MatrixUse, Observer, Pace, Path, State, Step};
pub use rejection::Rejection;
pub use search::LineSearch;
pub use stepping::{Following, StepControl, Stepping};
pub use volume::EnclosedVolume;
