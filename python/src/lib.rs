#![deny(unsafe_code)]
//! The Python module `rkpm`: bodies, laws, scenes and paths of the crate of the same name, with the same bits.
//!
//! Each class stands for one or two types of the crate, whose number of dimensions is chosen while the program runs. The interpreter is
//! free while a scene is solved; Python functions are called back from any thread.

mod expression;
mod fault;
mod geometry;
mod laws;
mod own;
mod path;
mod place;
mod scene;
mod scheme;
mod shape;

/// Rubber parts under large deformation by the Reproducing Kernel Particle Method.
///
/// A body (`Block`, `Region`, `Mesh`, `Solid`) and a law (`yeoh`, `ogden`, …, `fit`) make a `Scene`; conditions and loads are added to it; `solve`
/// gives a `Path` with forces, fields and pictures. Units are any consistent ones. What can't be is refused by `Error`.
#[pyo3::pymodule]
mod rkpm {
    #[pymodule_export]
    use crate::fault::{Error, Interrupted};
    #[pymodule_export]
    use crate::geometry::{Block, Mesh, Outline, Region, Shape, Solid};
    #[pymodule_export]
    use crate::laws::{
        Fitted, Law, arruda_boyce, blatz_ko, energy, extended_tube, fit, gent, material, mooney_rivlin, neo_hookean,
        ogden, polynomial, yeoh,
    };
    #[pymodule_export]
    use crate::path::{Path, Picture};
    #[pymodule_export]
    use crate::place::Place;
    #[pymodule_export]
    use crate::scene::Scene;
    #[pymodule_export]
    use crate::shape::shape_functions;
}
