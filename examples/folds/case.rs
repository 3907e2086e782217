//! What a family consists of: answers that are known, and models that should find them.

use rkpm::prelude::*;

/// The answer at one set of parameters, as a refined model gives it.
#[derive(Clone, Copy)]
pub enum Reference {
    /// The refined model completes with this value; how far the value is known, as a part of itself.
    Value { value: f64, uncertainty: f64 },
    /// The refined model ends before the whole load: ending is right.
    Ends,
}

/// What became of one run.
pub struct Found {
    /// The quantity that is compared.
    pub value: f64,
    /// The load factor that was reached.
    pub load: f64,
    pub iterations: usize,
    pub unstable: usize,
    /// Smallest and largest determinant of the deformation gradient.
    pub jacobians: [f64; 2],
    /// Why the run ended before the whole load; none where it completed.
    pub ending: Option<String>,
}

/// One discretisation of a problem.
pub struct Model {
    pub label: String,
    pub run: Box<dyn Fn() -> Result<Found, rkpm::Error>>,
}

/// One problem: its models share the answer.
pub struct Target {
    pub label: String,
    pub reference: Reference,
    pub models: Vec<Model>,
    /// Finer and finer models, from which the reference comes.
    pub refined: Vec<Model>,
}

/// Problems of one kind.
pub struct Family {
    pub name: &'static str,
    pub targets: Vec<Target>,
}

/// What a run is worth.
#[derive(Clone, Copy, PartialEq)]
pub enum Verdict {
    Right,
    /// Completed, and more than 5 % from the refined model, or where that finds no state.
    WrongCompleted,
    Ended,
}

/// Largest distance from the refined model of a completed run that is right.
const RIGHT: f64 = 0.05;

impl Reference {
    /// What a run is worth, and whether it is right: an ending is where the refined model ends as well.
    pub fn judge(self, found: &Found) -> Verdict {
        match (self, &found.ending) {
            (Reference::Value { .. }, Some(_)) => Verdict::Ended,
            (Reference::Ends, Some(_)) => Verdict::Right,
            (Reference::Value { value, .. }, None) if (found.value / value - 1.0).abs() <= RIGHT => Verdict::Right,
            _ => Verdict::WrongCompleted,
        }
    }
}

/// A model of a scene whose quantity is a function of problem and state.
pub fn model<const D: usize>(
    label: impl Into<String>,
    scene: impl Fn() -> Result<Scene<D>, rkpm::Error> + 'static,
    scheme: Scheme,
    quantity: fn(&Problem<D>, &State) -> Result<f64, rkpm::Error>,
) -> Model {
    let run = move || {
        let problem = scene()?.discretize(&scheme)?;
        let path = problem.run()?;
        let last = path.steps.last();
        Ok(Found {
            value: quantity(&problem, path.last())?,
            load: path.last().load,
            iterations: path.iterations,
            unstable: last.and_then(|step| step.unstable).unwrap_or(0),
            jacobians: last.and_then(|step| step.diagnostics.jacobians).unwrap_or([1.0; 2]),
            ending: match path.clone().completed() {
                Err(none) => Some(none.to_string()),
                Ok(path) => problem.verdict(&path)?.first().map(ToString::to_string),
            },
        })
    };
    Model { label: label.into(), run: Box::new(run) }
}

/// An amplitude that is met at equal parts of the load.
pub fn stops(count: usize) -> Amplitude {
    let parts = (0..=count.max(1)).map(|k| k as f64 / count.max(1) as f64);
    Amplitude::table(parts.map(|part| (part, part)).collect()).expect("load factors rise from 0 to 1")
}
