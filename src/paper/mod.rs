//! What the paper of 1997 has and analyses do not need: weights of the uncorrected kernel estimate (3.1)–(3.3),
//! spatial kernels (4.53)–(4.56).

mod estimate;
mod spatial;

pub use spatial::{COVER_WARNING, Cover};
