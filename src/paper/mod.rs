//! What the paper of 1997 has and analyses do not need: the uncorrected kernel estimate and its moments (3.1)–(3.21),
//! spatial kernels (4.53)–(4.56), the transformation of all particles (4.28)–(4.45).

mod estimate;
#[cfg(feature = "solve")]
mod full_transformation;
mod spatial;

#[cfg(feature = "solve")]
pub use full_transformation::FullTransformation;
pub use spatial::{COVER_WARNING, Cover};
