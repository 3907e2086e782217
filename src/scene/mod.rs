//! Scenes and schemes: the problem to solve, and how to discretise it.
//!
//! A [`Scene`] holds domain, kinematics, material, conditions and loads by boundary part and knows
//! nothing of particles. A [`Scheme`] holds particles, order, kernel, dilation, rule, zones, rows and
//! stepping and knows nothing of the scene. One scene runs under every scheme.
//!
//! ```
//! use rkpm::prelude::*;
//! let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?; // MPa
//! let tube = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber).pressure(Side::Min, 0.46); // cm, MPa
//! let problem = tube.discretize(&Scheme::default().particles([9]))?;
//! let path = problem.run()?.completed()?;
//! let bore = problem.displacement(path.last(), &[6.0].into())?[0];
//! assert!((bore / 15.0023846431 - 1.0).abs() < 5e-6);
//! # Ok::<(), rkpm::Error>(())
//! ```

mod definition;
mod discretisation;
mod results;
mod stages;

pub use definition::condition::{Condition, Direction};
pub(crate) use definition::contact_definition::Contact;
pub use definition::contact_definition::ContactPair;
pub use definition::geometry::Geometry;
pub use definition::load::Load;
pub(crate) use definition::load::{AtFullLoad, LoadKind, OnSheet, Sheet, Varying, dead};
pub use definition::place::Place;
pub(crate) use definition::place::Spot;
pub(crate) use definition::resolution::{counts, edge_lengths, per_axis};
pub use definition::scene::{Action, Scene};
pub(crate) use definition::scene::{FIRST, resolve};
pub use definition::scheme::Scheme;
pub use definition::scheme_choices::{
    ApproximationChoice, ConstraintKind, ConstraintMethod, Dilation, Partition, Rule, SolverChoice,
};
pub(crate) use definition::scheme_choices::{PressureScheme, Resolution};
pub(crate) use definition::source::{BodyCells, BodyOf, Own, Source};
pub use definition::value::Value;
pub(crate) use discretisation::approximation::kernel_functions;
pub use discretisation::cover::Certificate;
pub use discretisation::discrete_body::DiscreteBody;
pub(crate) use discretisation::frame::RigidFrame;
pub use discretisation::ownership::{LocalOwnership, TermOwnership};
pub use discretisation::problem::Problem;
pub(crate) use discretisation::thin_walls::is_stiff;
pub use results::contact_state::{ContactPoint, ContactState};
pub use results::free_motions::FreeMotion;
pub(crate) use results::free_motions::free_motions;
pub use results::neutral_motion::NeutralMotion;
#[cfg(feature = "chart")]
pub use results::picture::Field;
pub use results::recovery::StressField;
pub use results::rigid_motion::RigidMotion;
pub(crate) use results::rigid_motion::rotation_vector;
pub(crate) use results::transfer::{coefficients, values};
pub use results::verdict::FixedInside;
pub(crate) use results::verdict::{Judging, fixed_inside};
pub(crate) use results::view::BodyView;
pub use stages::{BrokenHistory, StagePath, Stages, history, write_stages};
