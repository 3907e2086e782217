//! What constraint equations prescribe, and along which direction.

use std::sync::Arc;

use crate::error::BoundaryError;
use crate::geometry::{Point, Vec3, padded, unit};
use crate::term::Amplitude;

use super::equation::check_component;
use super::prescribed_directions::PrescribedDirection;

/// The unit vector at a point with the outward normal of the boundary there (zero where there is none).
type Along<'a> = Box<dyn Fn(&Vec3, &Vec3) -> Result<Vec3, BoundaryError> + 'a>;

/// A value over weighed points: $g$ and $a(\lambda)$.
pub(crate) type Value<'a> = Box<dyn Fn(Vec<(Vec3, f64)>) -> (f64, Amplitude) + 'a>;

/// What a condition prescribes along a direction, at places with three components.
pub(crate) struct Prescription<'a> {
    /// The condition, for messages.
    pub label: String,
    /// The axis that it acts along, where it is one.
    pub axis: Option<usize>,
    pub along: Along<'a>,
    pub value: Value<'a>,
}

impl<'a> Prescription<'a> {
    /// Of a component.
    pub(super) fn of(dim: usize, component: usize, value: Value<'a>, label: &str) -> Result<Self, BoundaryError> {
        check_component(component, dim, label)?;
        let along = Box::new(move |_: &_, _: &_| Ok(unit(component)));
        Ok(Prescription { label: label.to_string(), axis: Some(component), along, value })
    }

    /// What it prescribes at a point.
    pub(crate) fn at(&self, x: &Vec3, normal: &Vec3) -> Result<PrescribedDirection, BoundaryError> {
        let (target, amplitude) = (self.value)(vec![(*x, 1.0)]);
        Ok(PrescribedDirection::new((self.along)(x, normal)?.into(), &self.label, target, amplitude))
    }
}

/// $g\\,a(\lambda)$ with $g = \sum w\\,g(X)$.
pub(crate) fn scaled<'a, const D: usize>(
    target: impl Fn(&Point<D>) -> f64 + 'a,
    amplitude: &'a Amplitude,
) -> Value<'a> {
    Box::new(move |points| {
        let sum = points.iter().map(|(x, w)| w * target(&padded(x))).sum();
        // Weights of either sign would make a NaN of what is infinite.
        let odd = points.iter().map(|(x, _)| target(&padded(x))).find(|value| !value.is_finite());
        (odd.unwrap_or(sum), amplitude.clone())
    })
}

/// $\sum w\\,g(X, \lambda)$, all of it in the amplitude.
pub(crate) fn moved<'a, const D: usize>(motion: impl Fn(&Point<D>, f64) -> f64 + Send + Sync + 'static) -> Value<'a> {
    let motion = Arc::new(motion);
    Box::new(move |points| {
        let motion = motion.clone();
        let sum = move |load: f64| points.iter().map(|(x, w)| w * motion(&padded(x), load)).sum();
        (1.0, Amplitude::Function(Arc::new(sum)))
    })
}
