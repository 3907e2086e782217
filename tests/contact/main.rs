//! Contact: laws of the surfaces, of the pressures, and scenes with known answers.

mod errors;
mod rigid;
mod surfaces;
