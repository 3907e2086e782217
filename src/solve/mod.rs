//! Newton's method with local unknowns, load stepping, and the path of converged states.

mod analysis;
mod newton;
mod path;
mod volume;

pub use analysis::{Analysis, StepControl, Stepping};
pub use newton::{Control, Deflection, Functional, Newton, Rejection};
pub use path::{Ending, Iteration, Observer, Pace, Path, State, Step};
pub use volume::EnclosedVolume;
