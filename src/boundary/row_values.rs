//! What constraint equations prescribe, and along which direction.

use std::sync::Arc;

use crate::each::Each;
use crate::error::BoundaryError;
use crate::geometry::{Point, unit};
use crate::term::Amplitude;

use super::equation::check_component;
use super::prescribed_directions::PrescribedDirection;

/// A displacement component as a function of $X$ and the load factor.
pub type Motion<const D: usize> = Arc<dyn Fn(&Point<D>, f64) -> f64 + Send + Sync>;

/// A value over weighed points: $g$ and $a(\lambda)$.
pub(crate) type Value<'a, const D: usize> = &'a dyn Fn(Vec<(Point<D>, f64)>) -> (f64, Amplitude);

/// What a condition prescribes along a direction.
pub(crate) trait Prescription<const D: usize> {
    /// The condition, for messages.
    fn label(&self) -> &str;

    /// The axis that it acts along, where it is one.
    fn axis(&self) -> Option<usize>;

    /// The unit vector that it acts along, at a point with the outward normal of the boundary there (zero where there is none).
    fn along(&self, x: &Point<D>, normal: &Point<D>) -> Result<Point<D>, BoundaryError>;

    /// What it prescribes over weighed points: $g$ and $a(\lambda)$.
    fn value(&self, points: Vec<(Point<D>, f64)>) -> (f64, Amplitude);

    /// What it prescribes at a point.
    fn at(&self, x: &Point<D>, normal: &Point<D>) -> Result<PrescribedDirection, BoundaryError> {
        let (target, amplitude) = self.value(vec![(*x, 1.0)]);
        Ok(PrescribedDirection::new(self.along(x, normal)?, self.label(), target, amplitude))
    }
}

/// A prescribed component.
pub(super) struct PrescribedComponent<'a, const D: usize> {
    component: usize,
    value: Value<'a, D>,
    label: &'a str,
}

impl<'a, const D: usize> PrescribedComponent<'a, D> {
    pub(super) fn new(component: usize, value: Value<'a, D>, label: &'a str) -> Result<Self, BoundaryError> {
        check_component(component, D, label)?;
        Ok(PrescribedComponent { component, value, label })
    }
}

impl<const D: usize> Prescription<D> for PrescribedComponent<'_, D> {
    fn label(&self) -> &str {
        self.label
    }

    fn axis(&self) -> Option<usize> {
        Some(self.component)
    }

    fn along(&self, _: &Point<D>, _: &Point<D>) -> Result<Point<D>, BoundaryError> {
        Ok(unit(self.component))
    }

    fn value(&self, points: Vec<(Point<D>, f64)>) -> (f64, Amplitude) {
        (self.value)(points)
    }
}

/// $g\\,a(\lambda)$ with $g = \sum w\\,g(X)$.
pub(crate) fn scaled<'a, const D: usize>(
    target: &'a dyn Fn(&Point<D>) -> f64,
    amplitude: &'a Amplitude,
) -> impl Fn(Vec<(Point<D>, f64)>) -> (f64, Amplitude) + 'a {
    move |points| {
        let sum = points.summed(|(x, w)| w * target(x));
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
        let sum = move |load: f64| points.summed(|(x, w)| w * motion(x, load));
        (1.0, Amplitude::Function(Arc::new(sum)))
    }
}
