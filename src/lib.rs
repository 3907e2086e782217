#![deny(unsafe_code)]
#![warn(missing_docs, unreachable_pub)]
// Some of what lies beneath the solver serves nothing else.
#![cfg_attr(not(feature = "solve"), allow(dead_code, unused_imports, unused_macros))]
#![cfg_attr(docsrs, feature(doc_cfg))]
//! The Reproducing Kernel Particle Method for rubber: shape functions on particles, nearly incompressible
//! hyperelasticity, and an implicit solver for large deformations.
//!
//! The method is that of Chen, Pan & Wu (1997), *Large deformation analysis of rubber based on a
//! reproducing kernel particle method*; numbers in parentheses such as (3.22) are its equations. The
//! default scheme repairs what the paper's does not deliver: it passes the patch test, does not lock, and
//! takes full loads in one step where it can.
//!
//! # Ten lines
//! A rubber bush between two sleeves; the inner one is pushed down by half the wall thickness. Lengths in mm, stresses in MPa,
//! forces in N per mm of the bush's length:
//! ```
//! use rkpm::prelude::*;
//! fn main() -> Result<(), rkpm::Error> {
//!     let outer = Outline::circle("outer sleeve", [0.0, 0.0], 20.0);
//!     let inner = Outline::circle("inner sleeve", [0.0, 0.0], 10.0);
//!     let rubber = Rubber::yeoh(0.5, -0.02, 0.002, 1000.0)?;
//!     let bush = Scene::new(Region::with_holes(outer, [inner])?, PlaneStrain, rubber)
//!         .hold("outer sleeve")
//!         .with(Condition::on("inner sleeve").displacement([0.0, -5.0]));
//!     let problem = bush.discretize(&Scheme::default().spacing(2.0))?;
//!     let path = problem.run()?.completed()?;
//!     let force = -problem.reaction(path.last(), "inner sleeve")?[1];
//!     println!("{force:.1} N/mm; finite elements on a fine mesh: 787.1 N/mm");
//!     assert!((force / 787.1 - 1.0).abs() < 0.03); // 1.9 %, and 0.6 % with half of the spacing
//!     Ok(())
//! }
//! ```
//!
//! # Three ways in
//! * **Shape functions only** (`default-features = false`: neither faer nor rayon):
//!   [`ReproducingKernel`](shape::ReproducingKernel) gives values and gradients at a point.
//! * **A part to analyse**: a `scene::Scene` says what — domain, kinematics, material,
//!   conditions, loads; a `Scheme` says how. A `Problem` runs and answers.
//! * **A kernel, material, term or solver of your own**: implement one of the traits below; the page of each has an example.
//!
//! # Layers
//! A file imports only from its own layer and those below (a test reads the imports).
//!
//! | layer | modules | traits to implement |
//! |---|---|---|
//! | 0 | [`error`], [`geometry`], [`tensor`] | [`Domain`](geometry::Domain) |
//! | 1 | [`kernel`], [`basis`], [`kinematics`], [`material`] | [`Kernel`](kernel::Kernel), [`Basis`](basis::Basis), [`Kinematics`](kinematics::Kinematics), [`Material`](material::Material), [`InvariantEnergy`](material::InvariantEnergy), [`PrincipalEnergy`](material::PrincipalEnergy), [`VolumetricEnergy`](material::VolumetricEnergy) |
//! | 2 | [`particles`], [`mesh`], [`cells`], [`quadrature`], [`solid`] | [`Cells`](cells::Cells) |
//! | 3 | [`shape`] | [`Approximation`](shape::Approximation) |
//! | 4 | [`table`] | |
//! | 5 | [`term`], [`contact`] | [`Term`](term::Term), [`Integrand`](term::Integrand), [`Surface`](contact::Surface) |
//! | 6 | [`assembly`] | |
//! | 7 | `boundary`, `linear` | `Enforcement`, `LinearSolver` |
//! | 8 | `solve`, [`paper`] | `Observer`, `Functional` |
//! | 9 | [`output`] | |
//! | 10 | `scene` | |
//! | 11 | `check`, `study`, `fit` | `Family` |
//!
//! [`contact`], `solve` and layers 7, 10 and 11 need the feature `solve`; `fit` has its own.
//!
//! # Features
//! | feature | default | what it adds |
//! |---|---|---|
//! | `solve` | yes | conditions, sparse solvers (faer), Newton, scenes |
//! | `rayon` | yes | tabulation and assembly on all cores, same bits for any number of threads |
//! | `chart` | yes | charts (SVG), pictures (SVG, PNG) and pages (HTML) |
//! | `fit` | no | laws fitted to test data (levenberg-marquardt, csv) |
//! | `serde` | no | states and paths as data, journals of runs that are resumed after a kill |
//!
//! # Conventions
//! Lengths, forces and stresses are in any consistent units. $F_{iJ}$ is stored at row $i$, column $J$;
//! fourth-order tensors as 9×9 with component $3i + J$ ([`tensor`]). Coefficient vectors run node by
//! node, `D` components each. Bodies of revolution are whole: energies and forces are those of the full
//! turn. Nothing prints, nothing panics on bad input; a stalled analysis returns its path so far.

pub use nalgebra;

// Floor 0
mod compiled;
mod dense;
mod each;
#[macro_use]
pub mod error;
pub mod geometry;
mod order;
mod parallel;
mod rows;
mod simd;
pub mod tensor;
// Floor 1
pub mod basis;
pub mod kernel;
pub mod kinematics;
pub mod material;
// Floor 2
pub mod cells;
pub mod mesh;
mod neighbours;
pub mod particles;
pub mod quadrature;
pub mod solid;
// Floor 3
pub mod shape;
// Floor 4
pub mod table;
// Floor 5
#[cfg(feature = "solve")]
pub mod contact;
pub mod term;
// Floor 6
pub mod assembly;
// Floor 7
#[cfg(feature = "solve")]
pub mod boundary;
#[cfg(feature = "solve")]
pub mod linear;
// Floor 8
pub mod paper;
#[cfg(feature = "solve")]
pub mod solve;
// Floor 9
pub mod output;
// Floor 10
#[cfg(feature = "solve")]
pub mod scene;
// Floor 11
#[cfg(feature = "solve")]
pub mod check;
#[cfg(feature = "fit")]
pub mod fit;
#[cfg(feature = "solve")]
pub mod study;

pub use error::Error;

/// What most programs need.
pub mod prelude {
    pub use crate::assembly::Model;
    pub use crate::basis::{Basis, Polynomial};
    #[cfg(feature = "solve")]
    pub use crate::boundary::{Constraints, LagrangeMultipliers, MixedTransformation};
    pub use crate::cells::{Cells, Lattice, Layout, Triangulation, Voronoi};
    #[cfg(feature = "solve")]
    pub use crate::contact::{Profile, RigidSurface};
    pub use crate::error::Error;
    pub use crate::geometry::{Block, Domain, Mapped, Outline, Part, Point, Quadrilateral, Region, Side, Turn};
    pub use crate::kernel::{CubicSpline, Gaussian, Kernel, QuinticSpline, WendlandC2};
    pub use crate::kinematics::{
        Axisymmetric, Kinematics, PlaneStrain, PlaneStress, RadialCylinder, RadialSphere, Solid,
    };
    #[cfg(feature = "solve")]
    pub use crate::linear::Direct;
    pub use crate::material::{Material, Rubber};
    pub use crate::mesh::Mesh;
    pub use crate::particles::{Particles, Support};
    pub use crate::quadrature::Points;
    #[cfg(feature = "solve")]
    pub use crate::scene::{
        Condition, ContactPair, Dilation, Direction, Geometry, Load, Place, Problem, Rule, Scene, Scheme, Value,
    };
    pub use crate::shape::{Approximation, ReproducingKernel, Scratch, ShapeFunctions};
    pub use crate::solid::{Select, Shape, Solid3};
    #[cfg(feature = "solve")]
    pub use crate::solve::{Analysis, Ending, Equilibrium, EquilibriumPath, Increment, Observer, Rhs, State, Stepping};
    pub use crate::table::ShapeTable;
    pub use crate::term::{
        Amplitude, Body, DeadLoad, FollowerPressure, Integrand, Pointwise, PressureField, ProjectedMeasure, Term,
    };
}
