//! Scenes and schemes: what is asked, and how it is answered.
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
//! let path = problem.run(&mut ())?.completed()?;
//! let bore = problem.displacement(path.last(), &[6.0].into())?[0];
//! assert!((bore / 15.0023846431 - 1.0).abs() < 5e-6);
//! # Ok::<(), rkpm::Error>(())
//! ```

mod bodies;
mod body_cells;
mod bond;
mod condition;
mod conditions;
mod contact;
mod contact_state;
mod control;
mod cover;
mod definition;
mod discretize;
mod drawn;
mod elements;
mod facet_rule;
mod fields;
mod frame;
mod frame_terms;
mod functions;
mod holding;
mod interface;
mod interface_moments;
mod load;
mod member;
mod memory;
mod one_body;
mod particles;
mod picture;
mod place;
mod problem;
mod reactions;
mod recovery;
mod resolution;
mod rigid;
mod rigid_motion;
mod rule;
mod scheme;
mod scheme_choices;
mod sharing;
mod source;
mod space;
mod touching;
mod transfer;
mod unmeasured;
mod validate;
mod value;

pub use condition::{Condition, Direction};
pub use contact_state::{ContactPoint, ContactState};
pub use cover::Certificate;
pub use definition::{Action, Scene};
pub use drawn::Drawn;
pub(crate) use functions::kernel_functions;
pub use holding::{Holding, TermHolding};
pub use load::Load;
pub use member::Member;
pub use picture::Field;
pub use place::Place;
pub use problem::Problem;
pub use recovery::StressField;
pub use rigid_motion::RigidMotion;
pub use scheme::Scheme;
pub use scheme_choices::{
    Dilation, Enforcing, Functions, Partition, PressureScheme, Resolution, RowKind, Rule, Solving,
};
pub(crate) use transfer::Nearest;
pub use value::Value;
