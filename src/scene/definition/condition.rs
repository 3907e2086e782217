//! Conditions: displacements that are prescribed.

use std::fmt;
use std::sync::Arc;

use crate::each::{Each, array_of};
use crate::error::BoundaryError;
use crate::geometry::{Point, unit};
use crate::term::Amplitude;

use crate::scene::{Place, Value};

/// A vector as a function of $X$.
type Vectors<const D: usize> = Arc<dyn Fn(&Point<D>) -> [f64; D] + Send + Sync>;

/// The direction along which a displacement is prescribed.
#[derive(Clone)]
pub enum Direction<const D: usize> {
    /// A component of the displacement.
    Component(usize),
    /// A fixed direction, of any length.
    Along([f64; D]),
    /// The outward normal of the reference body.
    Normal,
    /// A direction that varies over the body, of any length.
    Field(Vectors<D>),
}

impl<const D: usize> Direction<D> {
    /// Away from an axis of a cylinder through `centre`: in the plane away from the centre, whatever the axis.
    pub fn radial(centre: [f64; D], axis: [f64; 3]) -> Self {
        Direction::Field(Arc::new(move |x| across(x, &centre, &axis)))
    }

    /// Around an axis of a cylinder through `centre`, $a \times r$: in the plane counter-clockwise around the centre.
    pub fn tangential(centre: [f64; D], axis: [f64; 3]) -> Self {
        Direction::Field(Arc::new(move |x| {
            let r = across(x, &centre, &axis);
            let r: [f64; 3] = array_of(|i| r.get(i).copied().unwrap_or(0.0));
            let a = if D == 3 { axis } else { [0.0, 0.0, 1.0] };
            let around = [a[1] * r[2] - a[2] * r[1], a[2] * r[0] - a[0] * r[2], a[0] * r[1] - a[1] * r[0]];
            array_of(|i| around[i])
        }))
    }

    /// The unit vector at a point of a boundary with the normal there.
    pub(crate) fn unit(&self, label: &str, x: &Point<D>, normal: &Point<D>) -> Result<Point<D>, BoundaryError> {
        let vector: Point<D> = match self {
            Direction::Component(component) => return Ok(unit(*component)),
            Direction::Along(vector) => (*vector).into(),
            Direction::Normal => *normal,
            Direction::Field(field) => field(x).into(),
        };
        let length = vector.norm();
        if length > 0.0 && length.is_finite() {
            // Unit vectors stay as they were given, to the bit.
            Ok(if length == 1.0 { vector } else { vector / length })
        } else {
            let (what, at) = (label.to_string(), x.as_slice().to_vec());
            Err(BoundaryError::Direction { what, at, vector: vector.as_slice().to_vec() })
        }
    }
}

/// The part of $x - c$ across an axis.
fn across<const D: usize>(x: &Point<D>, centre: &[f64; D], axis: &[f64; 3]) -> [f64; D] {
    let offset: [f64; D] = array_of(|i| x[i] - centre[i]);
    if D < 3 {
        return offset;
    }
    let size: f64 = axis.summed(|a| a * a);
    if !(size > 0.0) {
        // Nothing is across an axis without a direction: the direction is refused where it is asked for.
        return [0.0; D];
    }
    let along = offset.pair_sum(axis, |o, a| o * a) / size;
    array_of(|i| offset[i] - along * axis[i])
}

impl<const D: usize> fmt::Display for Direction<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Direction::Component(component) => write!(f, "u_{component}"),
            Direction::Along(vector) => write!(f, "u along {vector:?}"),
            Direction::Normal => f.write_str("u along the normal"),
            Direction::Field(_) => f.write_str("u along a field of directions"),
        }
    }
}

/// A prescribed displacement: where, along what, how much, and how it follows the load factor.
///
/// ```
/// use rkpm::prelude::*;
/// // A quarter of a ring on two planes of symmetry, its outer face turned by 0.2 about the origin.
/// let ring = Mapped(|unit: &Point<2>| {
///     let (radius, angle) = (1.0 + unit[0], std::f64::consts::FRAC_PI_2 * unit[1]);
///     Point::<2>::new(radius * angle.cos(), radius * angle.sin())
/// });
/// let turn = Value::motion(|x: &Point<2>, load| {
///     let (sin, cos) = (0.2 * load).sin_cos();
///     [cos * x[0] - sin * x[1] - x[0], sin * x[0] + cos * x[1] - x[1]]
/// });
/// let scene = Scene::new(ring, PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
///     .with(Condition::on(Side::Min).along(Direction::radial([0.0, 0.0], [0.0, 0.0, 1.0]), 0.0).named("bore"))
///     .with(Condition::on((1, Side::Min)).along(Direction::Normal, 0.0))
///     .with(Condition::on((1, Side::Max)).along(Direction::Normal, 0.0))
///     .with(Condition::on(Side::Max).displacement(Value::field(|x: &Point<2>| [-0.1 * x[0], -0.1 * x[1]])));
/// let problem = scene.discretize(&Scheme::default().particles([5, 9]))?;
/// let path = problem.run()?.completed()?;
/// let [on_bore, outside] = [problem.reaction(path.last(), "bore")?, problem.reaction(path.last(), Side::Max)?];
/// assert!(on_bore[0] > 0.0 && outside[0] < 0.0);
/// # let _ = turn;
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Clone)]
pub struct Condition<const D: usize> {
    pub(crate) place: Place<D>,
    pub(crate) prescribed: Vec<(Direction<D>, Value<D>)>,
    pub(crate) amplitude: Amplitude,
    pub(crate) name: Option<String>,
}

impl<const D: usize> Condition<D> {
    /// A condition at a place, which prescribes nothing yet.
    pub fn on(place: impl Into<Place<D>>) -> Self {
        Condition { place: place.into(), prescribed: Vec::new(), amplitude: Amplitude::Ramp, name: None }
    }

    /// Prescribes a component of the displacement \[length\].
    pub fn component(self, component: usize, value: impl Into<Value<D>>) -> Self {
        self.along(Direction::Component(component), value)
    }

    /// Prescribes the displacement along a direction \[length\]; nothing across it.
    pub fn along(mut self, direction: Direction<D>, value: impl Into<Value<D>>) -> Self {
        self.prescribed.push((direction, value.into()));
        self
    }

    /// Prescribes all components \[length\]: a vector, [`Value::field`] or [`Value::motion`] of vectors.
    pub fn displacement(mut self, value: impl Into<Value<D, [f64; D]>>) -> Self {
        let value = value.into();
        for i in 0..D {
            self = self.component(i, value.map(move |u| u[i]));
        }
        self
    }

    /// Sets how the values follow the load factor; a ramp unless set. Motions get it in place of the load factor.
    pub fn amplitude(mut self, amplitude: Amplitude) -> Self {
        self.amplitude = amplitude;
        self
    }

    /// Gives the condition a name, by which its reaction is requested and which messages use.
    pub fn named(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }

    /// What messages call one of its directions.
    pub(crate) fn label(&self, direction: &Direction<D>) -> String {
        let at = if matches!(self.place.spot, super::place::Spot::Point(_)) { "at" } else { "on" };
        let what = format!("{direction} {at} {}", self.place);
        match &self.name {
            Some(name) => format!("{name} ({what})"),
            None => what,
        }
    }
}

impl<const D: usize> fmt::Debug for Condition<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let prescribed: Vec<String> = self.prescribed.mapped(|(d, v)| format!("{d} = {v:?}"));
        f.debug_struct("Condition")
            .field("place", &self.place)
            .field("prescribed", &prescribed)
            .field("amplitude", &self.amplitude)
            .field("name", &self.name)
            .finish()
    }
}
