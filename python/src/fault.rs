//! Exceptions: errors of the crate with their own words, and what Python functions raise while a scene is solved.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::{PyException, PyKeyboardInterrupt, PyTypeError};
use pyo3::prelude::*;

pyo3::create_exception!(rkpm, Error, PyException, "What the crate refuses or can't find: where, what, and the remedy.");
pyo3::create_exception!(
    rkpm,
    Interrupted,
    PyKeyboardInterrupt,
    "A run that Ctrl-C ended. Its steps up to there are `path`, also `Scene.path`."
);

/// An error of the crate as an exception with the same words.
pub(crate) fn refused(error: impl Into<rkpm::Error>) -> PyErr {
    Error::new_err(error.into().to_string())
}

/// What is of another type than is needed.
pub(crate) fn mistyped(what: impl Into<String>) -> PyErr {
    PyTypeError::new_err(what.into())
}

/// The first exception of a Python function that is called while a scene is solved.
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

/// A Python function that the solver calls from any thread, and the first exception that it raised.
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

    /// The value of the function; nothing once it has raised.
    pub(crate) fn call<T>(&self, run: impl FnOnce(&Bound<'_, PyAny>) -> PyResult<T>) -> Option<T> {
        if self.fault.is_set() {
            return None;
        }
        Python::attach(|py| run(self.function.bind(py))).map_err(|error| self.fault.set(error)).ok()
    }
}
