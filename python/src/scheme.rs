//! How a scene is solved, and who watches.

use std::ops::ControlFlow;
use std::time::Instant;

use pyo3::exceptions::{PyKeyboardInterrupt, PyUserWarning};
use pyo3::prelude::*;
use rkpm::cells::Scatter;
use rkpm::scene::{ApproximationChoice, Dilation, Scene, Scheme};
use rkpm::solve::{Ending, Iteration, Observer, Step, StepControl, Stepping};
use rkpm::study::{Budget, Progress, Quantity, Tolerance, Verdict};

use crate::fault::{Callback, Error, Faults, Interrupted, mistyped, refused};
use crate::path::{Path, Run, Within};
use crate::place::{Place, array};

/// What the keywords of `solve` say.
pub(crate) struct Choices {
    pub(crate) spacing: Option<f64>,
    pub(crate) order: Option<u8>,
    pub(crate) elements: bool,
    pub(crate) dilation: Option<f64>,
    pub(crate) seed: Option<u64>,
    pub(crate) steps: Option<usize>,
    pub(crate) arc_length: bool,
}

impl Choices {
    pub(crate) fn scheme(&self, particles: Option<&Bound<'_, PyAny>>) -> PyResult<Scheme> {
        let mut scheme = Scheme::default();
        scheme = match (particles, self.spacing) {
            (Some(_), Some(_)) => return Err(Error::new_err("solve: give particles or spacing, not both")),
            (Some(particles), None) => scheme.particles(counts(particles)?),
            (None, Some(spacing)) => scheme.spacing(spacing),
            (None, None) => scheme,
        };
        if self.elements {
            scheme = scheme.approximation(ApproximationChoice::Elements);
        }
        if let Some(order) = self.order {
            scheme = scheme.order(order);
        }
        if let Some(dilation) = self.dilation {
            scheme = scheme.dilation(dilation);
        }
        if let Some(seed) = self.seed {
            scheme = scheme.seed(seed);
        }
        Ok(match (self.steps, self.arc_length) {
            (Some(_), true) => return Err(Error::new_err("solve: give steps or arc_length, not both")),
            (Some(0), _) => return Err(Error::new_err("solve: 0 steps, give at least one")),
            (Some(steps), false) => scheme.stepping(Stepping::equal(steps)),
            (None, true) => scheme.stepping(Stepping { control: StepControl::ArcLength, ..Stepping::default() }),
            (None, false) => scheme,
        })
    }
}

/// Numbers of particles: one for all axes, or one for each.
pub(crate) fn counts(given: &Bound<'_, PyAny>) -> PyResult<Vec<usize>> {
    let one = given.extract::<usize>().map(|count| vec![count]);
    one.or_else(|_| given.extract()).map_err(|_| mistyped("particles: give a whole number, or one for each axis"))
}

/// What is to be known within an error.
pub(crate) fn quantity<const D: usize>(of: Option<&Bound<'_, PyAny>>, error: f64) -> PyResult<Tolerance<D>> {
    let unknown = || {
        Error::new_err(
            "of: give \"energy\", \"volume\", (\"force\", place, component) or (\"displacement\", point, component)",
        )
    };
    let quantity = match of {
        None => Quantity::energy(),
        Some(of) => match of.extract::<String>() {
            Ok(name) if name == "energy" => Quantity::energy(),
            Ok(name) if name == "volume" => Quantity::volume(),
            Ok(_) => return Err(unknown()),
            Err(_) => {
                let (kind, place, component) =
                    of.extract::<(String, Bound<'_, PyAny>, usize)>().map_err(|_| unknown())?;
                if component >= D {
                    return Err(Error::new_err(format!("of: no component {component}, the body has {D} dimensions")));
                }
                match kind.as_str() {
                    "force" => Quantity::reaction(Place::of(&place)?.to()?, component),
                    "displacement" => Quantity::displacement(array(&place.extract::<Vec<f64>>()?, "of")?, component),
                    _ => return Err(unknown()),
                }
            }
        },
    };
    Ok(Tolerance::of(quantity, error))
}

/// Solves a scene under a scheme.
pub(crate) fn run<const D: usize>(scene: &Scene<D>, scheme: &Scheme, watch: &mut Watch) -> Result<Run<D>, rkpm::Error> {
    let started = Instant::now();
    let problem = scene.discretize(scheme)?;
    let path = problem.run_with(watch)?;
    let (faults, seconds) = (watch.faults.clone(), started.elapsed().as_secs_f64());
    Ok(Run { problem, path, within: None, why: None, seconds, faults })
}

/// Solves a scene by a model that meets a tolerance.
pub(crate) fn sized<const D: usize>(
    scene: &Scene<D>,
    scheme: &Scheme,
    any: bool,
    tolerance: &Tolerance<D>,
    watch: &mut Watch,
) -> Result<Run<D>, rkpm::Error> {
    let started = Instant::now();
    // Bodies that are no lattice, and bars, have one scheme to choose from.
    let both = [elements(scheme), scheme.clone()];
    let schemes = if any && D > 1 { &both[..] } else { &both[1..] };
    let answer = scene.solve_within_by(schemes, tolerance, Budget::default(), watch)?;
    let why = match &answer.verdict {
        Verdict::Reached => None,
        Verdict::NotReached(why) => Some(why.clone()),
    };
    let (faults, seconds) = (watch.faults.clone(), started.elapsed().as_secs_f64());
    let within = answer.values().first().map(|&value| Within { value, bound: answer.bound });
    Ok(Run { within, problem: answer.problem, path: answer.path, why, seconds, faults })
}

/// The same with finite elements of order 2, without what these don't have.
fn elements(scheme: &Scheme) -> Scheme {
    let scheme = scheme.clone().approximation(ApproximationChoice::Elements).order(2);
    scheme.scatter(Scatter::default()).dilation(Dilation::Auto)
}

/// Looks after Ctrl-C, exceptions of Python functions and progress.
pub(crate) struct Watch {
    faults: Faults,
    progress: Option<Callback>,
    interrupted: bool,
    raised: Option<PyErr>,
    iterations: usize,
}

impl Watch {
    /// At the beginning of a run that calls the functions of these faults.
    pub(crate) fn new(progress: Option<&Bound<'_, PyAny>>, faults: Faults) -> Self {
        let progress = progress.filter(|given| given.is_truthy().unwrap_or(true)).map(Callback::new);
        faults.add(progress.as_ref().map(|progress| progress.fault.clone()));
        faults.take();
        Watch { faults, progress, interrupted: false, raised: None, iterations: 0 }
    }

    /// What a run found, unless a Python function or a signal's handler raised. Ctrl-C is told by [`judge`](Watch::judge), with the path,
    /// where there is one.
    pub(crate) fn finish<T>(&mut self, py: Python<'_>, found: Result<T, rkpm::Error>) -> PyResult<T> {
        let fault = self.faults.take();
        let Some(raised) = self.raised.take().or(fault) else { return found.map_err(refused) };
        if !raised.is_instance_of::<PyKeyboardInterrupt>(py) {
            return Err(raised);
        }
        self.interrupted = true;
        found.or_else(|_| {
            let error = Interrupted::new_err("the run was interrupted before its first step");
            error.value(py).setattr("path", py.None())?;
            Err(error)
        })
    }

    fn look(&mut self) -> ControlFlow<()> {
        if let Err(error) = Python::attach(|py| py.check_signals()) {
            self.raised = Some(error);
            return ControlFlow::Break(());
        }
        if self.faults.are_set() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Raises where the run was not completed; the exception carries the path.
    pub(crate) fn judge(&self, py: Python<'_>, path: &Py<Path>) -> PyResult<()> {
        let path = path.bind(py);
        let error = if self.interrupted {
            Interrupted::new_err(
                "the run was interrupted; its steps so far are in the exception's path and in the scene's",
            )
        } else if let Some(why) = path.get().unmet() {
            let text = std::ffi::CString::new(format!("the tolerance was not met: {why}")).unwrap_or_default();
            return PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 2);
        } else {
            match path.get().refusal() {
                Some(words) => Error::new_err(words),
                None => return Ok(()),
            }
        };
        error.value(py).setattr("path", path)?;
        Err(error)
    }
}

impl Observer for Watch {
    fn iteration(&mut self, _: &Iteration) -> ControlFlow<()> {
        self.iterations += 1;
        self.look()
    }

    fn step(&mut self, step: &Step) -> ControlFlow<()> {
        let iterations = self.iterations;
        if let Some(progress) = &self.progress {
            progress.call(|given| {
                if given.is_callable() {
                    return given.call1((step.state.load, iterations)).map(drop);
                }
                let line = format!("load factor {:.4} after {iterations} iterations", step.state.load);
                given.py().import("builtins")?.call_method1("print", (line,)).map(drop)
            });
        }
        self.look()
    }
}

impl Progress for Watch {}

/// How a path ended, as Python hears it.
pub(crate) fn ending(ending: &Ending) -> &'static str {
    match ending {
        Ending::Completed => "completed",
        Ending::Stopped => "stopped",
        Ending::Stalled(_) => "stalled",
        Ending::Interrupted => "interrupted",
    }
}
