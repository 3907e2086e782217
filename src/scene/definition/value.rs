//! Values that are prescribed: constant, varying over the body, or moving with the load factor.

use std::fmt;
use std::sync::Arc;

use crate::geometry::Point;

/// A function of $X$.
type Field<const D: usize, T> = Arc<dyn Fn(&Point<D>) -> T + Send + Sync>;
/// A function of $X$ and the amplitude.
type Motion<const D: usize, T> = Arc<dyn Fn(&Point<D>, f64) -> T + Send + Sync>;

/// A number, or a vector `[f64; D]`, that a condition or a load prescribes.
///
/// Numbers are values as they are: `.component(1, -4.0)`. What varies is made by [`Value::field`] and [`Value::motion`].
#[derive(Clone)]
pub enum Value<const D: usize, T = f64> {
    /// The same everywhere, times the amplitude.
    Constant(T),
    /// A function of $X$, times the amplitude.
    Field(Field<D, T>),
    /// A function of $X$ and the amplitude, for what does not grow in proportion: a part that turns runs along circles.
    Motion(Motion<D, T>),
}

impl<const D: usize, T> Value<D, T> {
    /// A function of $X$.
    pub fn field(value: impl Fn(&Point<D>) -> T + Send + Sync + 'static) -> Self {
        Value::Field(Arc::new(value))
    }

    /// A function of $X$ and the amplitude, which is the load factor unless another one is given.
    pub fn motion(value: impl Fn(&Point<D>, f64) -> T + Send + Sync + 'static) -> Self {
        Value::Motion(Arc::new(value))
    }
}

impl<const D: usize, T: Copy + 'static> Value<D, T> {
    /// The value at a point where the amplitude has come to `factor`, without that factor for constants and fields.
    pub(crate) fn at(&self, x: &Point<D>, factor: f64) -> T {
        match self {
            Value::Constant(value) => *value,
            Value::Field(field) => field(x),
            Value::Motion(motion) => motion(x, factor),
        }
    }

    /// A number made of each value.
    pub(crate) fn map(&self, part: impl Fn(&T) -> f64 + Send + Sync + 'static) -> Value<D> {
        match self.clone() {
            Value::Constant(value) => Value::Constant(part(&value)),
            Value::Field(field) => Value::Field(Arc::new(move |x| part(&field(x)))),
            Value::Motion(motion) => Value::Motion(Arc::new(move |x, factor| part(&motion(x, factor)))),
        }
    }
}

impl<const D: usize, T> From<T> for Value<D, T> {
    fn from(value: T) -> Self {
        Value::Constant(value)
    }
}

impl<const D: usize, T: fmt::Debug> fmt::Debug for Value<D, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Constant(value) => write!(f, "{value:?}"),
            Value::Field(_) => write!(f, "field"),
            Value::Motion(_) => write!(f, "motion"),
        }
    }
}
