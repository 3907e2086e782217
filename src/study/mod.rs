//! Studies: error against time, a line per scheme; a tolerance in, the smallest sufficient model out.
//!
//! A [`WorkPrecision`] runs one scene under many schemes and charts what each costs against what it
//! delivers, by the worst of the quantities requested:
//! ```
//! use rkpm::prelude::*;
//! use rkpm::study::{Quantity, Reference, WorkPrecision};
//! let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?; // MPa
//! let tube = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber).pressure(Side::Min, 0.46); // cm, MPa
//! let study = WorkPrecision::new("tube", tube)
//!     .quantity(Quantity::displacement([6.0], 0), Reference::Given { value: 15.0023846431, uncertainty: 1e-10 })
//!     .quantity(Quantity::energy(), Reference::Finest)
//!     .series("default", [5, 9, 17].map(|n| Scheme::default().particles([n])))
//!     .series("quadratic", [5, 9].map(|n| Scheme::default().order(2).particles([n])))
//!     .repeated(2)
//!     .run()?;
//! assert!(study.runs.iter().all(|run| run.error < 1e-3));
//! # #[cfg(feature = "chart")]
//! assert!(study.chart().to_svg()?.contains("quadratic"));
//! # Ok::<(), rkpm::Error>(())
//! ```
//! [`Scene::solve_within`](crate::scene::Scene::solve_within) chooses the number of particles itself.

mod answer;
mod assembled;
mod clock;
mod effects;
mod evidence;
mod extrapolation;
mod nested;
mod progress;
mod quantity;
mod refinement;
mod resolved;
mod runs;
mod sides;
mod sizing;
mod strategy;
mod work_precision;

pub use answer::{Answer, Budget, Level, Tolerance, Verdict};
pub use clock::Phases;
pub use effects::Effect;
pub use progress::Progress;
pub use quantity::Quantity;
pub use runs::{Run, Study};
pub use work_precision::{Reference, WorkPrecision};
