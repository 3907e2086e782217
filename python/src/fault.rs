//! Exceptions: errors of the crate with their own words, and what Python functions raise while the crate calls them.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::{PyException, PyKeyboardInterrupt, PyTypeError};
use pyo3::prelude::*;

pyo3::create_exception!(
    rkpm,
    Error,
    PyException,
    "What the crate refuses or can't find: where, what, and the remedy. A run that ended early is `path`, with the stages before it `paths`."
);
pyo3::create_exception!(
    rkpm,
    Interrupted,
    PyKeyboardInterrupt,
    "A run that Ctrl-C ended. Its steps up to there are `path`, also `Scene.path`, with the stages before it `paths`; before the first one \
     there is none."
);

/// An error of the crate as an exception with the same words.
pub(crate) fn refused(error: impl Into<rkpm::Error>) -> PyErr {
    Error::new_err(error.into().to_string())
}

/// What is of another type than is needed.
pub(crate) fn mistyped(what: impl Into<String>) -> PyErr {
    PyTypeError::new_err(what.into())
}

/// The first exception of a Python function since it was last taken.
#[derive(Clone, Default)]
pub(crate) struct Fault(Arc<Mutex<Option<PyErr>>>);

impl Fault {
    pub(crate) fn set(&self, error: PyErr) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }

    pub(crate) fn is_set(&self) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    pub(crate) fn take(&self) -> Option<PyErr> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// The faults of the Python functions that a scene, a run or a law calls; clones share them. Stages of a history add theirs on the way.
///
/// Each call of the crate that may call these functions begins without an exception and ends by looking for one: what a function raised
/// goes before what the crate made of the value that is missing, and none is left for the next call.
#[derive(Clone, Default)]
pub(crate) struct Faults(Arc<Mutex<Vec<Fault>>>);

impl Faults {
    pub(crate) fn new(faults: impl IntoIterator<Item = Fault>) -> Self {
        Faults(Arc::new(Mutex::new(faults.into_iter().collect())))
    }

    pub(crate) fn add(&self, faults: impl IntoIterator<Item = Fault>) {
        let mut own = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        for fault in faults {
            if !own.iter().any(|other| Arc::ptr_eq(&other.0, &fault.0)) {
                own.push(fault);
            }
        }
    }

    pub(crate) fn all(&self) -> Vec<Fault> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub(crate) fn are_set(&self) -> bool {
        self.all().iter().any(Fault::is_set)
    }

    /// One of the exceptions, if there are any. None is left.
    pub(crate) fn take(&self) -> Option<PyErr> {
        self.all().iter().map(Fault::take).fold(None, Option::or)
    }

    /// What the crate finds while the interpreter is free, unless one of the functions raises.
    pub(crate) fn calling<T: Send, E: Into<rkpm::Error> + Send>(
        &self,
        py: Python<'_>,
        find: impl FnOnce() -> Result<T, E> + Send,
    ) -> PyResult<T> {
        self.take();
        let found = py.detach(find);
        self.take().map_or_else(|| found.map_err(refused), Err)
    }
}

/// A Python function that the crate calls from any thread, and the first exception that it raised.
#[derive(Clone)]
pub(crate) struct Callback {
    function: Arc<Py<PyAny>>,
    pub(crate) fault: Fault,
}

impl Callback {
    pub(crate) fn new(function: &Bound<'_, PyAny>) -> Self {
        Callback { function: Arc::new(function.clone().unbind()), fault: Fault::default() }
    }

    /// The same with the exceptions of another function.
    #[must_use]
    pub(crate) fn sharing(self, other: &Callback) -> Self {
        Callback { fault: other.fault.clone(), ..self }
    }

    /// The value of the function; nothing once it has raised, until the exception is taken.
    pub(crate) fn call<T>(&self, run: impl FnOnce(&Bound<'_, PyAny>) -> PyResult<T>) -> Option<T> {
        if self.fault.is_set() {
            return None;
        }
        Python::attach(|py| run(self.function.bind(py))).map_err(|error| self.fault.set(error)).ok()
    }
}
