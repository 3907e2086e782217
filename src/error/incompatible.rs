//! Two choices that can't be combined.

use std::borrow::Cow;

use thiserror::Error;

/// Two choices of a scene, a scheme or a run that can't be combined: both sides, and what to do instead.
///
/// ```
/// use rkpm::error::{Error, Incompatible};
/// use rkpm::prelude::*;
/// let block = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?);
/// let graded = Scheme::default().graded(|x| 1.0 + x[0]);
/// let Err(Error::Incompatible(Incompatible { what, with, .. })) = block.discretize(&graded) else { panic!() };
/// assert_eq!((&*what, &*with), ("Scheme::graded", "a block or mapped block"));
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{what} can't be combined with {with}: {remedy}")]
pub struct Incompatible {
    /// The first.
    pub what: Cow<'static, str>,
    /// The second.
    pub with: Cow<'static, str>,
    /// What to do instead.
    pub remedy: &'static str,
}

impl Incompatible {
    pub(crate) fn new(
        what: impl Into<Cow<'static, str>>,
        with: impl Into<Cow<'static, str>>,
        remedy: &'static str,
    ) -> Self {
        Incompatible { what: what.into(), with: with.into(), remedy }
    }
}
