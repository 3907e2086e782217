//! Contact: laws of the surfaces, of the pressures, and scenes with known answers.

mod drawn;
mod errors;
mod friction;
mod meshes;
mod pairs;
mod rigid;
mod surfaces;
