#![deny(unsafe_code)]
#![warn(missing_docs)]
#![cfg_attr(docsrs, feature(doc_cfg))]
//! The Reproducing Kernel Particle Method for rubber.

pub use nalgebra;

// Floor 0
mod dense;
pub mod error;
pub mod geometry;
mod parallel;
pub mod tensor;
// Floor 1
pub mod basis;
pub mod kernel;
pub mod kinematics;
pub mod material;
// Floor 2
pub mod cells;
mod neighbours;
pub mod particles;
pub mod quadrature;
// Floor 3
pub mod shape;
// Floor 4
pub mod table;
// Floor 5
pub mod term;
// Floor 6
pub mod assembly;
// Floor 7
#[cfg(feature = "solve")]
pub mod boundary;
#[cfg(feature = "solve")]
pub mod linear;
// Floor 8
#[cfg(feature = "solve")]
pub mod solve;
// Floor 9
pub mod output;
// Floor 10
#[cfg(feature = "solve")]
pub mod scene;

pub use error::Error;

/// What most programs need.
pub mod prelude {
    pub use crate::assembly::Model;
    pub use crate::basis::{Basis, Polynomial};
    #[cfg(feature = "solve")]
    pub use crate::boundary::{Constraints, LagrangeMultipliers, MixedTransformation};
    pub use crate::cells::{Lattice, Layout};
    pub use crate::error::Error;
    pub use crate::geometry::{Block, Domain, Mapped, Part, Point, Quadrilateral, Side};
    pub use crate::kernel::{CubicSpline, Gaussian, Kernel, QuinticSpline, WendlandC2};
    pub use crate::kinematics::{Axisymmetric, Kinematics, PlaneStrain, RadialCylinder, RadialSphere, Solid};
    #[cfg(feature = "solve")]
    pub use crate::linear::Direct;
    pub use crate::material::{Material, Rubber};
    pub use crate::particles::{Particles, Support};
    pub use crate::quadrature::Points;
    #[cfg(feature = "solve")]
    pub use crate::scene::{Problem, Scene, Scheme};
    pub use crate::shape::{Approximation, ReproducingKernel, ShapeFunctions};
    #[cfg(feature = "solve")]
    pub use crate::solve::{Analysis, Ending, Observer, Path, Stepping};
    pub use crate::table::ShapeTable;
    pub use crate::term::{Amplitude, Body, DeadLoad, FollowerPressure, Integrand, Pointwise, PressureField, Term};
}
