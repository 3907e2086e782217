//! Contact: laws of the surfaces, of the pressures, and scenes with known answers.

// The models of the example `folds`.
#[allow(dead_code)]
#[path = "../../examples/folds/axisymmetric.rs"]
mod axisymmetric;
#[allow(dead_code)]
#[path = "../../examples/folds/beam.rs"]
mod beam;
#[allow(dead_code)]
#[path = "../../examples/folds/case.rs"]
mod case;
mod closed_forms;
mod errors;
mod families;
mod folds;
mod friction;
mod friction_between;
mod interference;
mod meshes;
mod pairs;
mod partial_slip;
#[allow(dead_code)]
#[path = "../../examples/folds/plane.rs"]
mod plane;
mod rigid;
mod rings;
mod rolling;
mod turning;

use rkpm::prelude::Rubber;

/// The shear modulus of scenes beside closed forms.
const SHEAR: f64 = 1.0;

fn soft(bulk: f64) -> Rubber {
    Rubber::neo_hookean(0.5 * SHEAR, bulk).unwrap()
}
