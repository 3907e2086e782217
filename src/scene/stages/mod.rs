//! Histories of named stages: what is pressed, locked, loaded and released in turn.

mod carry;
mod held;
#[cfg(feature = "serde")]
mod journaled;
mod stage_path;
mod turning;

use crate::error::{BoundaryError, Error, SolveError};
use crate::solve::{Ending, EquilibriumPath, Observer, Stepping};

use super::{Problem, Scene, Scheme};

pub use stage_path::{BrokenHistory, StagePath, history, write_stages};

/// What a stage changes in the scene of the one before.
type Change<const D: usize> = Box<dyn Fn(Scene<D>) -> Scene<D> + Send + Sync>;

struct Stage<const D: usize> {
    name: String,
    change: Change<D>,
    stepping: Option<Stepping>,
}

/// A history of named stages in order. Each begins where the one before ended, with its conditions, loads and surfaces held as they
/// are, and changes some: it adds them by the methods of [`Scene`], takes them away by [`Scene::without`] and moves surfaces on by
/// [`Scene::move_on`]. The load factor runs from 0 to 1 in every stage, and laws keep their internal variables. Time goes on in stages that
/// give theirs by [`Scene::over_time`]; in one that does not it stands, and laws that relax do not.
///
/// What a new condition prescribes is reached from where the body is, $g(\lambda) = g\\,a(\lambda) + (1 - \lambda)\\,(Gd_0 - g\\,a(0))$, and
/// forces that were taken away fall from what they were, in proportion to $1 - \lambda$: at load factor 0 each stage is in the
/// equilibrium in which the last one ended, at 1 in its own. With the out-of-balance forces $f_0$ that its multipliers can't carry the
/// stage therefore solves $f(d, \lambda) + G^T\mu = (1 - \lambda)\\,f_0$.
///
/// A rigid body that is led by its name keeps its shape on the way: it turns about one axis, the shortest way, or back as it has turned where
/// the orientation it is led to is nearer to that at rest than to where it is. Prescribe another way by [`Value::motion`](super::Value::motion).
///
/// ```
/// use rkpm::prelude::*;
/// use rkpm::scene::Stages;
/// // A pad is pressed, locked at its height, sheared, and released.
/// let pad = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 500.0)?)
///     .hold((1, Side::Min))
///     .with(Load::traction((1, Side::Max), [0.0, -0.1]).named("press"));
/// let stages = Stages::new("press", pad)
///     .then("shear", |scene| {
///         scene.without("press").with(Condition::on((1, Side::Max)).displacement([0.2, -0.05]).named("plate"))
///     })
///     .then("release", |scene| scene.without("plate"));
/// let paths = stages.run(&Scheme::default().particles([5, 3]))?;
/// let [_, sheared, released] = &paths[..] else { panic!() };
/// assert!(sheared.problem.reaction(sheared.path.last(), "plate")?[0] > 0.05);
/// // Elastic: nothing is left.
/// assert!(released.path.last().displacement.iter().all(|d| d.abs() < 1e-8));
/// # Ok::<(), rkpm::Error>(())
/// ```
pub struct Stages<const D: usize> {
    scene: Scene<D>,
    stages: Vec<Stage<D>>,
}

impl<const D: usize> Stages<D> {
    /// A history of one stage: the scene as it is.
    pub fn new(name: impl Into<String>, scene: Scene<D>) -> Self {
        let first = Stage { name: name.into(), change: Box::new(|scene| scene), stepping: None };
        Stages { scene, stages: vec![first] }
    }

    /// Adds a stage that changes the scene of the one before, all of which is held.
    pub fn then(
        mut self,
        name: impl Into<String>,
        change: impl Fn(Scene<D>) -> Scene<D> + Send + Sync + 'static,
    ) -> Self {
        self.stages.push(Stage { name: name.into(), change: Box::new(change), stepping: None });
        self
    }

    /// Sets how the last stage is stepped and what controls it, in place of what the scheme says.
    pub fn stepping(mut self, stepping: Stepping) -> Self {
        if let Some(stage) = self.stages.last_mut() {
            stage.stepping = Some(stepping);
        }
        self
    }

    /// The names of the stages, in order.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> {
        self.stages.iter().map(|stage| stage.name.as_str())
    }

    /// Runs one stage after the other, up to the first that does not end with an answer ([`EquilibriumPath::completed`]).
    ///
    /// # Errors
    /// [`BrokenHistory`] with the stages before and why the next one could not be run: as [`Scene::discretize`] and
    /// [`Problem::run`](super::Problem::run), for names that are empty or given twice, and for stages that change the bodies.
    pub fn run(&self, scheme: &Scheme) -> Result<Vec<StagePath<D>>, BrokenHistory<D>> {
        self.run_with(scheme, &mut ())
    }

    /// As [`run`](Stages::run), watched by an observer, which may end the history.
    ///
    /// # Errors
    /// As [`run`](Stages::run).
    pub fn run_with(
        &self,
        scheme: &Scheme,
        observer: &mut dyn Observer,
    ) -> Result<Vec<StagePath<D>>, BrokenHistory<D>> {
        self.resume(scheme, Vec::new(), observer)
    }

    /// Goes on from the paths of a run that was broken off, stage by stage, the last of them unfinished or not, with the same bits as
    /// if it had never been; without paths it starts.
    ///
    /// # Errors
    /// As [`run`](Stages::run), and where a path does not begin where the stage before has ended.
    pub fn resume(
        &self,
        scheme: &Scheme,
        paths: Vec<EquilibriumPath>,
        observer: &mut dyn Observer,
    ) -> Result<Vec<StagePath<D>>, BrokenHistory<D>> {
        self.go_on(scheme, paths, |_, problem, path| problem.resume(path, observer))
    }

    fn go_on(
        &self,
        scheme: &Scheme,
        given: Vec<EquilibriumPath>,
        solve: impl FnMut(&str, &Problem<D>, EquilibriumPath) -> Result<EquilibriumPath, Error>,
    ) -> Result<Vec<StagePath<D>>, BrokenHistory<D>> {
        let mut stages = Vec::with_capacity(self.stages.len());
        match self.add_to(&mut stages, scheme, given, solve) {
            Ok(()) => Ok(stages),
            Err(error) => Err(BrokenHistory { stages, error: Box::new(error) }),
        }
    }

    /// Runs the stages one after the other; those before an error are done.
    fn add_to(
        &self,
        done: &mut Vec<StagePath<D>>,
        scheme: &Scheme,
        given: Vec<EquilibriumPath>,
        mut solve: impl FnMut(&str, &Problem<D>, EquilibriumPath) -> Result<EquilibriumPath, Error>,
    ) -> Result<(), Error> {
        self.check_names()?;
        if given.len() > self.stages.len() {
            let (what, given, needed) = ("paths of stages", given.len(), self.stages.len());
            return Err(SolveError::OtherModel { what, given, needed }.into());
        }
        let mut scene = self.scene.clone();
        let mut given = given.into_iter();
        for stage in &self.stages {
            scene = held::begun((stage.change)(scene.clone()), &scene);
            let own = stage.stepping.map(|stepping| scheme.clone().stepping(stepping));
            let mut problem = scene.discretize(own.as_ref().unwrap_or(scheme))?;
            let start = carry::start(done, &mut problem)?;
            let path = match given.next() {
                None => solve(&stage.name, &problem, EquilibriumPath::from(start))?,
                Some(path) if path.start != start => {
                    let off = largest(&path.start.displacement, &start.displacement);
                    let what = "its first state is off that in which the stage before ended by";
                    return Err(SolveError::OtherProblem { what, value: off, load: path.start.load }.into());
                }
                Some(path) if path.ending == Ending::Completed => path,
                Some(path) => solve(&stage.name, &problem, path)?,
            };
            let answered = path.is_answer();
            let (time, last) = (problem.time(path.last()), path.last().displacement.clone());
            done.push(StagePath { name: stage.name.clone(), problem, path });
            if !answered {
                break;
            }
            scene = held::held(scene, time, last);
        }
        Ok(())
    }

    fn check_names(&self) -> Result<(), BoundaryError> {
        for (number, stage) in self.stages.iter().enumerate() {
            if stage.name.trim().is_empty() {
                return Err(BoundaryError::Nameless { what: "a stage" });
            }
            if self.stages[..number].iter().any(|other| other.name == stage.name) {
                return Err(BoundaryError::StageTwice { name: stage.name.clone() });
            }
        }
        Ok(())
    }
}

/// The largest difference of two vectors; infinite where they are not of one length.
fn largest(a: &[f64], b: &[f64]) -> f64 {
    if a.len() != b.len() {
        return f64::INFINITY;
    }
    a.iter().zip(b).fold(0.0, |largest, (a, b)| (a - b).abs().max(largest))
}
