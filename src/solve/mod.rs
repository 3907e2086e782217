//! Newton's method with local unknowns, load stepping, and the path of converged states.

mod analysis;
mod critical;
mod lead;
mod march;
mod newton;
mod path;
mod search;
mod stepping;
mod volume;

pub use analysis::Analysis;
pub use critical::{Bracketing, CriticalKind, CriticalPoint};
pub use newton::{Control, Deflection, Functional, Newton, Rejection};
pub use path::{Ending, Iteration, Observer, Pace, Path, State, Step};
pub use search::LineSearch;
pub use stepping::{Following, StepControl, Stepping};
pub use volume::EnclosedVolume;
