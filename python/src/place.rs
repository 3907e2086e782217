//! Places, vectors and values as Python gives them.

use std::any::Any;
use std::sync::{Arc, Mutex, PoisonError};

use numpy::PyArray1;
use pyo3::prelude::*;
use rkpm::geometry::{Part, Point, Side};
use rkpm::prelude::Amplitude;
use rkpm::scene::Value;

use crate::fault::{Callback, Error, Fault, mistyped, refused};

#[derive(Clone)]
enum Spot {
    Part(Part),
    At(Vec<f64>),
    Body,
}

/// Where a condition or a load acts, or a result is asked for.
///
/// Most places need none of this: the name of a part (`"insert"`) or a face of a block, `(axis, "min")` or `(axis, "max")`,
/// stand for themselves, as do `"min"` and `"max"` of bars. `at` is a point, `of` names one of several bodies, `within` is a
/// function of X that says which part of the place is meant; results there are asked for by the same object. Without part and
/// point it is the whole body.
#[pyclass(frozen, module = "rkpm", from_py_object)]
#[derive(Clone)]
pub(crate) struct Place {
    spot: Spot,
    of: Option<String>,
    within: Option<Callback>,
    /// The same as places of the crate, one for each number of dimensions. Made once: the crate compares functions by identity.
    made: Arc<Mutex<Vec<Box<dyn Any + Send + Sync>>>>,
}

#[pymethods]
impl Place {
    #[new]
    #[pyo3(signature = (part=None, *, at=None, of=None, within=None))]
    fn new(
        part: Option<&Bound<'_, PyAny>>,
        at: Option<Vec<f64>>,
        of: Option<String>,
        within: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let spot = match (part, at) {
            (Some(_), Some(_)) => return Err(mistyped("Place: give a part or a point, not both")),
            (Some(part), None) => Spot::Part(self::part(part)?),
            (None, Some(at)) => Spot::At(at),
            (None, None) => Spot::Body,
        };
        Ok(Place { spot, of, within: within.map(Callback::new), made: Arc::default() })
    }
}

fn part(given: &Bound<'_, PyAny>) -> PyResult<Part> {
    if let Ok(name) = given.extract::<String>() {
        return Ok(Part::Named(name));
    }
    if let Ok((axis, side)) = given.extract::<(usize, String)>() {
        return match side.as_str() {
            "min" => Ok((axis, Side::Min).into()),
            "max" => Ok((axis, Side::Max).into()),
            _ => Err(Error::new_err(format!("place: {side:?} is no end of an axis, give \"min\" or \"max\""))),
        };
    }
    Err(mistyped("place: give a name, a face as (axis, \"min\") or (axis, \"max\"), or a Place"))
}

impl Place {
    pub(crate) fn of(given: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(place) = given.extract::<Place>() {
            return Ok(place);
        }
        Ok(Place { spot: Spot::Part(part(given)?), of: None, within: None, made: Arc::default() })
    }

    pub(crate) fn to<const D: usize>(&self) -> PyResult<rkpm::scene::Place<D>> {
        let mut made = self.made.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(place) = made.iter().find_map(|place| place.downcast_ref::<rkpm::scene::Place<D>>()) {
            return Ok(place.clone());
        }
        let place = self.make::<D>()?;
        made.push(Box::new(place.clone()));
        Ok(place)
    }

    fn make<const D: usize>(&self) -> PyResult<rkpm::scene::Place<D>> {
        use rkpm::scene::Place;
        let mut place = match &self.spot {
            // The ends of a bar.
            Spot::Part(Part::Named(name)) if D == 1 && name == "min" => Place::on(Side::Min),
            Spot::Part(Part::Named(name)) if D == 1 && name == "max" => Place::on(Side::Max),
            Spot::Part(part) => Place::on(part.clone()),
            Spot::At(at) => Place::at(array::<D>(at, "place")?),
            Spot::Body => Place::body(),
        };
        if let Some(body) = &self.of {
            place = place.of(body.clone());
        }
        Ok(match self.within.clone() {
            Some(within) => place.within(move |x| called(&within, x, |value| value.is_truthy()).unwrap_or(false)),
            None => place,
        })
    }

    /// The name, where the place is nothing else.
    pub(crate) fn plain_name(&self) -> Option<&str> {
        match &self.spot {
            Spot::Part(Part::Named(name)) if self.of.is_none() && self.within.is_none() => Some(name),
            _ => None,
        }
    }

    pub(crate) fn fault(&self) -> Option<Fault> {
        self.within.as_ref().map(|within| within.fault.clone())
    }
}

/// A vector with as many components as the scene has dimensions.
pub(crate) fn array<const D: usize>(given: &[f64], what: &str) -> PyResult<[f64; D]> {
    <[f64; D]>::try_from(given).map_err(|_| {
        Error::new_err(format!("{what}: {} components, give {D}: the body has {D} dimensions", given.len()))
    })
}

fn called<const D: usize, T>(
    function: &Callback,
    x: &Point<D>,
    read: impl FnOnce(Bound<'_, PyAny>) -> PyResult<T>,
) -> Option<T> {
    function.call(|function| read(function.call1((PyArray1::from_slice(function.py(), x.as_slice()),))?))
}

/// How many arguments a function must be given, by their places: neither what a method is bound to nor what has a default.
fn needed(function: &Bound<'_, PyAny>) -> PyResult<usize> {
    let signature = function.py().import("inspect")?.call_method1("signature", (function,))?;
    let mut count = 0;
    for parameter in signature.getattr("parameters")?.call_method0("values")?.try_iter()? {
        let parameter = parameter?;
        let kind = parameter.getattr("kind")?;
        let by_place =
            kind.eq(parameter.getattr("POSITIONAL_ONLY")?)? || kind.eq(parameter.getattr("POSITIONAL_OR_KEYWORD")?)?;
        count += usize::from(by_place && parameter.getattr("default")?.is(&parameter.getattr("empty")?));
    }
    Ok(count)
}

/// A number or a function of X.
#[derive(Clone)]
pub(crate) enum Number {
    Constant(f64),
    Function(Callback),
}

impl Number {
    pub(crate) fn of(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Self> {
        if given.is_callable() {
            return Ok(Number::Function(Callback::new(given)));
        }
        let value = given.extract().map_err(|_| mistyped(format!("{what}: give a number or a function of X")))?;
        Ok(Number::Constant(value))
    }

    pub(crate) fn to<const D: usize>(&self) -> Value<D> {
        match self.clone() {
            Number::Constant(value) => Value::Constant(value),
            Number::Function(function) => {
                Value::field(move |x| called(&function, x, |value| value.extract()).unwrap_or(f64::NAN))
            }
        }
    }

    pub(crate) fn fault(&self) -> Option<Fault> {
        match self {
            Number::Constant(_) => None,
            Number::Function(function) => Some(function.fault.clone()),
        }
    }
}

/// A vector or a function of X; a motion where it needs the load factor too.
#[derive(Clone)]
pub(crate) enum Vector {
    Constant(Vec<f64>),
    Function(Callback, bool),
}

impl Vector {
    pub(crate) fn of(given: &Bound<'_, PyAny>, what: &str) -> PyResult<Self> {
        if given.is_callable() {
            // Functions of other languages may not tell their arguments.
            let moves = needed(given).is_ok_and(|count| count == 2);
            return Ok(Vector::Function(Callback::new(given), moves));
        }
        let value = given.extract().map_err(|_| mistyped(format!("{what}: give a vector or a function of X")))?;
        Ok(Vector::Constant(value))
    }

    pub(crate) fn to<const D: usize>(&self, what: &str) -> PyResult<Value<D, [f64; D]>> {
        let what = what.to_string();
        Ok(match self.clone() {
            Vector::Constant(value) => Value::Constant(array(&value, &what)?),
            Vector::Function(function, true) => Value::motion(move |x: &Point<D>, load| {
                let at = |function: &Bound<'_, PyAny>| {
                    let value = function.call1((PyArray1::from_slice(function.py(), x.as_slice()), load))?;
                    array(&value.extract::<Vec<f64>>()?, &what)
                };
                function.call(at).unwrap_or([f64::NAN; D])
            }),
            Vector::Function(function, false) => Value::field(move |x| {
                let read = |value: Bound<'_, PyAny>| array(&value.extract::<Vec<f64>>()?, &what);
                called(&function, x, read).unwrap_or([f64::NAN; D])
            }),
        })
    }

    pub(crate) fn fault(&self) -> Option<Fault> {
        match self {
            Vector::Constant(_) => None,
            Vector::Function(function, _) => Some(function.fault.clone()),
        }
    }
}

/// How a value follows the load factor: in proportion, or by pairs of load factor and value.
pub(crate) fn amplitude(pairs: Option<Vec<(f64, f64)>>) -> PyResult<Amplitude> {
    pairs.map_or(Ok(Amplitude::Ramp), |pairs| Amplitude::table(pairs).map_err(refused))
}
