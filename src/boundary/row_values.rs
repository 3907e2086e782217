//! What constraint equations prescribe, and along which direction.

use std::sync::Arc;

use crate::error::BoundaryError;
use crate::geometry::Point;
use crate::term::Amplitude;

/// A displacement component as a function of $X$ and the load factor.
pub type Motion<const D: usize> = Arc<dyn Fn(&Point<D>, f64) -> f64 + Send + Sync>;

/// The value of a constraint equation that weighs the given points: $g$ and $a(\lambda)$.
pub(crate) type Value<'a, const D: usize> = &'a dyn Fn(Vec<(Point<D>, f64)>) -> (f64, Amplitude);

/// $g\\,a(\lambda)$ with $g = \sum w\\,g(X)$.
pub(crate) fn scaled<'a, const D: usize>(
    target: &'a dyn Fn(&Point<D>) -> f64,
    amplitude: &'a Amplitude,
) -> impl Fn(Vec<(Point<D>, f64)>) -> (f64, Amplitude) + 'a {
    move |points| {
        let sum = points.iter().map(|(x, w)| w * target(x)).sum();
        // Weights of either sign would make a NaN of what is infinite.
        let odd = points.iter().map(|(x, _)| target(x)).find(|value| !value.is_finite());
        (odd.unwrap_or(sum), amplitude.clone())
    }
}

/// $\sum w\\,g(X, \lambda)$, all of it in the amplitude.
pub(crate) fn moved<'a, const D: usize>(
    motion: &'a Motion<D>,
) -> impl Fn(Vec<(Point<D>, f64)>) -> (f64, Amplitude) + 'a {
    move |points| {
        let motion = motion.clone();
        let sum = move |load: f64| points.iter().map(|(x, w)| w * motion(x, load)).sum();
        (1.0, Amplitude::Function(Arc::new(sum)))
    }
}

/// The unit vector along which a condition acts, at a point with the outward normal of the boundary there (zero where there
/// is none).
pub(crate) type Along<'a, const D: usize> = &'a dyn Fn(&Point<D>, &Point<D>) -> Result<Point<D>, BoundaryError>;

/// Conditions along an axis.
pub(super) fn along_axis<const D: usize>(
    component: usize,
) -> impl Fn(&Point<D>, &Point<D>) -> Result<Point<D>, BoundaryError> {
    move |_, _| Ok(Point::from_fn(|i, _| f64::from(u8::from(i == component))))
}
