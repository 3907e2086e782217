#![deny(unsafe_code)]
#![warn(missing_docs)]
//! rkpm
pub use nalgebra;
pub mod error;
pub mod material;
pub mod output;
pub mod tensor;
pub use error::Error;
