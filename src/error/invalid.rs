//! Invalid numbers.

use std::borrow::Cow;

use thiserror::Error;

/// A number given is NaN, infinite or out of its range.
///
/// Whatever it was given to, it comes out as [`Error::Invalid`](super::Error::Invalid).
///
/// ```
/// use rkpm::error::{Error, Invalid};
/// use rkpm::prelude::*;
/// let block = Scene::new(Block::new([0.0], [1.0]), RadialCylinder, Rubber::neo_hookean(0.5, 1e3)?);
/// let Err(Error::Invalid(Invalid { what, value, .. })) = block.discretize(&Scheme::default().spacing(-0.1)) else { panic!() };
/// assert_eq!((&*what, value), ("particle spacing", -0.1));
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{what} = {value:e}: {needed}")]
pub struct Invalid {
    /// What was given, and where.
    pub what: Cow<'static, str>,
    /// The value given.
    pub value: f64,
    /// What would be accepted.
    pub needed: &'static str,
}

impl Invalid {
    pub(crate) fn new(what: impl Into<Cow<'static, str>>, value: f64, needed: &'static str) -> Self {
        Invalid { what: what.into(), value, needed }
    }
}
