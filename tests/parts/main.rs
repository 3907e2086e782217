//! Parts drawn elsewhere: meshes read from files, particles and cells made of them, scenes on them.

mod conditions;
mod cook;
mod fuzz;
mod iteration;
mod laws;
mod memory;
mod pictures;
mod reading;
mod slots;

use memory::peak;

/// The bytes of a mesh of the tests.
fn file(name: &str) -> Vec<u8> {
    std::fs::read(format!("{}/tests/meshes/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}
