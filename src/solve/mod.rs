//! Newton's method with condensed unknowns, continuation, and the path of converged states.

mod active_set;
mod adjoint;
mod analysis;
mod continuation;
mod critical;
mod critical_search;
mod driver;
mod driver_choice;
mod functional;
mod increment;
mod line_search;
mod motion_limit;
mod newton;
mod path;
mod path_control;
mod recorded;
mod rejection;
mod reused_tangent;
mod run;
mod settings;
mod state;
mod stepping;
mod volume;

pub use crate::error::{Cause, Driven, Stalled};
pub(crate) use adjoint::Dual;
pub use analysis::Analysis;
pub(crate) use analysis::NO_FREE;
pub use critical::{CriticalKind, CriticalPoint};
pub use functional::{Control, Deflection, Functional};
pub use line_search::LineSearch;
pub use path::{Ending, EquilibriumPath, Iteration, MatrixUse, Observer, Step, StepControlState};
pub use settings::{Newton, TangentUpdate};
pub use state::State;
pub use stepping::{Bracketing, Following, StepControl, Stepping};
pub use volume::EnclosedVolume;
