//! Scenes and schemes: what is asked, and how it is answered.
//!
//! A [`Scene`] holds domain, kinematics, material, conditions and loads by boundary part and knows
//! nothing of particles. A [`Scheme`] holds particles, order, kernel, dilation, rule, zones, rows and
//! stepping and knows nothing of the scene. One scene runs under every scheme.
//!
//! ```
//! use rkpm::prelude::*;
//! let rubber = Rubber::yeoh(0.373, -0.031, 0.005, 1e5)?; // MPa
//! let tube = Scene::new(Block::new([6.0], [8.0]), RadialCylinder, rubber).pressure(Side::Min, 0.46); // cm, MPa
//! let problem = tube.discretize(&Scheme::default().particles([9]))?;
//! let path = problem.run(&mut ())?.completed()?;
//! let bore = problem.displacement(path.last(), &[6.0].into())?[0];
//! assert!((bore / 15.0023846431 - 1.0).abs() < 5e-6);
//! # Ok::<(), rkpm::Error>(())
//! ```

mod conditions;
mod contact;
mod control;
mod cover;
mod discretize;
mod fields;
mod problem;
mod scheme;
mod transfer;

pub use contact::{ContactPoint, ContactState};
pub use cover::Certificate;
pub(crate) use discretize::kernel_functions;
pub use problem::Problem;
pub use scheme::{Dilation, Enforcing, Functions, Partition, Resolution, RowKind, Rule, Scheme, Volume};

use std::sync::Arc;

use nalgebra::Vector3;

use crate::boundary::Motion;
use crate::cells::{Cells, Triangulation, Voronoi};
use crate::compiled::compiled;
use crate::error::{BoundaryError, Error};
use crate::geometry::{Domain, Part, Point, Region};
use crate::kinematics::Kinematics;
use crate::material::Material;
use crate::term::Amplitude;

/// A value that may vary over a boundary part.
pub(crate) type Field<const D: usize> = Arc<dyn Fn(&Point<D>) -> f64 + Send + Sync>;

/// Where a condition or load acts.
#[derive(Clone)]
pub(crate) enum Place<const D: usize> {
    Part(Part),
    Particle(Point<D>),
    Body,
}

/// A prescribed displacement component.
#[derive(Clone)]
pub(crate) struct Condition<const D: usize> {
    pub place: Place<D>,
    pub component: usize,
    pub value: Value<D>,
    pub amplitude: Amplitude,
    pub label: String,
}

/// What a condition prescribes: a value in proportion to its amplitude, or a motion along it.
#[derive(Clone)]
pub(crate) enum Value<const D: usize> {
    Field(Field<D>),
    Motion(Motion<D>),
}

/// A load.
#[derive(Clone)]
pub(crate) struct Load<const D: usize> {
    pub place: Place<D>,
    pub kind: LoadKind,
    pub amplitude: Amplitude,
    pub label: String,
}

/// What kind of load.
#[derive(Clone)]
pub(crate) enum LoadKind {
    Dead(Vector3<f64>),
    Pressure(f64),
}

/// What was added last, so that [`Scene::with_amplitude`] knows what to change.
#[derive(Clone, Copy)]
enum Last {
    Nothing,
    Condition,
    Load,
}

/// What is discretised: the image of a unit cube, or whatever hands out its own cells.
#[derive(Clone)]
pub(crate) enum Source<const D: usize> {
    Domain(Arc<dyn Domain<D>>),
    Cells(Arc<dyn Cells<D>>),
    Scattered(Arc<Scattering<D>>),
}

/// Particles and cells of a drawn region under a scheme.
pub(crate) type Scattering<const D: usize> = dyn Fn(&Scheme) -> Result<Arc<dyn Cells<D>>, Error> + Send + Sync;

/// What is to be solved: domain, kinematics, material, conditions and loads by boundary part.
///
/// Loads and prescribed values follow the load factor $\lambda \in [0, 1]$ as a ramp unless
/// [`with_amplitude`](Scene::with_amplitude) says otherwise.
#[derive(Clone)]
pub struct Scene<const D: usize> {
    pub(crate) source: Source<D>,
    pub(crate) kinematics: Arc<dyn Kinematics<D>>,
    pub(crate) material: Arc<dyn Material>,
    pub(crate) conditions: Vec<Condition<D>>,
    pub(crate) loads: Vec<Load<D>>,
    pub(crate) contacts: Vec<contact::Touching<D>>,
    last: Last,
    /// Whether an amplitude was given before any condition or load.
    stray_amplitude: bool,
}

impl<const D: usize> Scene<D> {
    /// A free, unloaded body.
    pub fn new(
        domain: impl Domain<D> + 'static,
        kinematics: impl Kinematics<D> + 'static,
        material: impl Material + 'static,
    ) -> Self {
        Scene::of(Source::Domain(Arc::new(domain)), kinematics, material)
    }

    /// A free, unloaded body over given particles and cells; the scheme's resolution and layout are left out.
    pub fn over(
        cells: Arc<dyn Cells<D>>,
        kinematics: impl Kinematics<D> + 'static,
        material: impl Material + 'static,
    ) -> Self {
        Scene::of(Source::Cells(cells), kinematics, material)
    }

    fn of(source: Source<D>, kinematics: impl Kinematics<D> + 'static, material: impl Material + 'static) -> Self {
        Scene {
            source,
            kinematics: Arc::new(kinematics),
            material: Arc::new(material),
            conditions: Vec::new(),
            loads: Vec::new(),
            contacts: Vec::new(),
            last: Last::Nothing,
            stray_amplitude: false,
        }
    }

    /// The lengths of the domain's sides \[length\]; none where the cells were given.
    pub(crate) fn side_lengths(&self) -> Option<[f64; D]> {
        match &self.source {
            Source::Domain(domain) => Some(discretize::edge_lengths(&**domain)),
            _ => None,
        }
    }

    /// The domain; none where the cells were given.
    pub(crate) fn domain(&self) -> Option<Arc<dyn Domain<D>>> {
        match &self.source {
            Source::Domain(domain) => Some(domain.clone()),
            _ => None,
        }
    }

    /// Whether the scheme scatters the particles.
    pub(crate) fn is_scattered(&self) -> bool {
        matches!(self.source, Source::Scattered(_))
    }

    /// The same scene over given particles and cells of the same body; a scheme's resolution and layout are left
    /// out.
    pub fn with_cells(&self, cells: Arc<dyn Cells<D>>) -> Self {
        Scene { source: Source::Cells(cells), ..self.clone() }
    }

    /// The body alone: domain, kinematics and material.
    pub(crate) fn without_conditions(&self) -> Self {
        Scene { conditions: Vec::new(), loads: Vec::new(), contacts: Vec::new(), last: Last::Nothing, ..self.clone() }
    }

    fn condition(mut self, place: Place<D>, component: usize, value: Value<D>, label: String) -> Self {
        self.conditions.push(Condition { place, component, value, amplitude: Amplitude::Ramp, label });
        self.last = Last::Condition;
        self
    }

    fn load(mut self, place: Place<D>, kind: LoadKind, label: String) -> Self {
        self.loads.push(Load { place, kind, amplitude: Amplitude::Ramp, label });
        self.last = Last::Load;
        self
    }

    /// Prescribes displacement component `component` \[length\] on a boundary part.
    ///
    /// Where parts meet both values hold: [`discretize`](Scene::discretize) refuses those that differ.
    pub fn prescribe(self, part: impl Into<Part>, component: usize, value: f64) -> Self {
        self.prescribe_field(part, component, move |_| value)
    }

    /// Prescribes a displacement component on a boundary part as a function of $X$.
    pub fn prescribe_field(
        self,
        part: impl Into<Part>,
        component: usize,
        value: impl Fn(&Point<D>) -> f64 + Send + Sync + 'static,
    ) -> Self {
        let part = part.into();
        let label = format!("u_{component} on {part}");
        self.condition(Place::Part(part), component, Value::Field(Arc::new(value)), label)
    }

    /// Prescribes a displacement component on a boundary part as a function of $X$ and the load factor,
    /// for what does not grow in proportion: a part that turns runs along circles.
    ///
    /// An amplitude given to it takes the place of the load factor. Load steps follow the way: they turn a part by a
    /// quarter at most, and one that comes back to where it was has been away.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let rubber = Rubber::neo_hookean(0.5, 1e3)?;
    /// // A quarter turn of the upper end about the origin.
    /// let turn = |load: f64| (load * std::f64::consts::FRAC_PI_2).sin_cos();
    /// let scene = Scene::new(Block::new([0.0, 0.0], [1.0, 2.0]), PlaneStrain, rubber)
    ///     .hold((1, Side::Min))
    ///     .prescribe_motion((1, Side::Max), 0, move |x, load| x[0] * (turn(load).1 - 1.0) - x[1] * turn(load).0)
    ///     .prescribe_motion((1, Side::Max), 1, move |x, load| x[0] * turn(load).0 + x[1] * (turn(load).1 - 1.0));
    /// # let _ = scene.discretize(&Scheme::default().particles([3, 5]))?;
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn prescribe_motion(
        self,
        part: impl Into<Part>,
        component: usize,
        motion: impl Fn(&Point<D>, f64) -> f64 + Send + Sync + 'static,
    ) -> Self {
        let part = part.into();
        let label = format!("u_{component} on {part}");
        self.condition(Place::Part(part), component, Value::Motion(Arc::new(motion)), label)
    }

    /// Holds all displacement components on a boundary part.
    pub fn hold(self, part: impl Into<Part>) -> Self {
        let part = part.into();
        (0..D).fold(self, |scene, component| scene.prescribe(part.clone(), component, 0.0))
    }

    /// Prescribes a displacement component at the particle that lies at a point.
    pub fn prescribe_at(self, at: [f64; D], component: usize, value: f64) -> Self {
        let label = format!("u_{component} at {at:?}");
        self.condition(Place::Particle(at.into()), component, Value::Field(Arc::new(move |_| value)), label)
    }

    /// A pressure \[stress\] that follows a boundary part, positive inwards.
    pub fn pressure(self, part: impl Into<Part>, pressure: f64) -> Self {
        let part = part.into();
        let label = format!("pressure on {part}");
        self.load(Place::Part(part), LoadKind::Pressure(pressure), label)
    }

    /// A dead traction \[stress\] per reference area on a boundary part.
    pub fn traction(self, part: impl Into<Part>, traction: [f64; D]) -> Self {
        let part = part.into();
        let label = format!("traction on {part}");
        self.load(Place::Part(part), LoadKind::Dead(pad(&traction)), label)
    }

    /// A body force \[stress/length\] per reference volume.
    pub fn body_force(self, force: [f64; D]) -> Self {
        self.load(Place::Body, LoadKind::Dead(pad(&force)), "body force".into())
    }

    /// A point load \[force\] on the displacement at a point of the body.
    pub fn point_load(self, at: [f64; D], force: [f64; D]) -> Self {
        let label = format!("point load at {at:?}");
        self.load(Place::Particle(at.into()), LoadKind::Dead(pad(&force)), label)
    }

    /// Changes the amplitude of the condition or load that was added last; a [`hold`](Scene::hold) needs none, its values are zero.
    /// Before any of them it is refused when the scene is discretised.
    pub fn with_amplitude(mut self, amplitude: Amplitude) -> Self {
        match self.last {
            Last::Nothing => self.stray_amplitude = true,
            Last::Condition => {
                if let Some(last) = self.conditions.last_mut() {
                    last.amplitude = amplitude;
                }
            }
            Last::Load => {
                if let Some(last) = self.loads.last_mut() {
                    last.amplitude = amplitude;
                }
            }
        }
        self
    }

    /// The material.
    pub fn material(&self) -> &dyn Material {
        &*self.material
    }

    /// Turns the scene into a problem under a scheme.
    ///
    /// # Errors
    /// Any bad input of scene or scheme: geometry, particles, supports, selections, rows, loads.
    pub fn discretize(&self, scheme: &Scheme) -> Result<Problem<D>, Error> {
        compiled!(D: (scene: &Scene<D> = self; scheme: &Scheme = scheme) -> Result<Problem<D>, Error> {
            scene.validate()?;
            discretize::discretize(scene, scheme, &mut Err)
        })
    }

    /// As [`discretize`](Scene::discretize) without the conditions that can't be taken, and why not.
    pub(crate) fn discretize_leniently(&self, scheme: &Scheme) -> Result<(Problem<D>, Vec<Error>), Error> {
        compiled!(D: (scene: &Scene<D> = self; scheme: &Scheme = scheme) -> Result<(Problem<D>, Vec<Error>), Error> {
            scene.validate()?;
            let mut refused = Vec::new();
            let problem = discretize::discretize(scene, scheme, &mut |error| {
                refused.push(error);
                Ok(())
            })?;
            Ok((problem, refused))
        })
    }

    /// The particles under a scheme and the cells between them.
    pub(crate) fn cells(&self, scheme: &Scheme) -> Result<Arc<dyn Cells<D>>, Error> {
        compiled!(D: (scene: &Scene<D> = self; scheme: &Scheme = scheme) -> Result<Arc<dyn Cells<D>>, Error> {
            scene.validate()?;
            discretize::cells(scene, scheme)
        })
    }

    /// Refuses conditions and loads that no scheme could serve.
    fn validate(&self) -> Result<(), Error> {
        if self.stray_amplitude {
            return Err(BoundaryError::Misplaced {
                what: "with_amplitude before any condition or load",
                remedy: "call it right after the condition or load that it belongs to",
            }
            .into());
        }
        if let Source::Domain(domain) = &self.source {
            domain.validate()?;
        }
        for condition in &self.conditions {
            condition.amplitude.validate()?;
            is_finite(&condition.amplitude, &condition.label)?;
            if condition.component >= D {
                return Err(BoundaryError::Component {
                    what: condition.label.clone(),
                    component: condition.component,
                    dimension: D,
                }
                .into());
            }
        }
        for load in &self.loads {
            load.amplitude.validate()?;
            is_finite(&load.amplitude, &load.label)?;
            let value = match &load.kind {
                LoadKind::Dead(force) => force.iter().copied().find(|v| !v.is_finite()),
                LoadKind::Pressure(pressure) => Some(*pressure).filter(|p| !p.is_finite()),
            };
            if let Some(value) = value {
                return Err(BoundaryError::Value { what: load.label.clone(), value, load: 1.0 }.into());
            }
        }
        contact::validate(&self.contacts)?;
        crate::kinematics::hoops(&*self.kinematics)?;
        Ok(())
    }
}

impl Scene<2> {
    /// A free, unloaded body in a drawn region, over which the scheme scatters its particles: their spacing or about
    /// how many ([`Scheme::spacing`], [`Scheme::particles`]), where they are finer ([`Scheme::graded`]), which
    /// draw ([`Scheme::seed`]).
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let plate = Outline::at([0.0, 0.0])
    ///     .line("bottom", [4.0, 0.0]).line("right", [4.0, 1.0]).line("top", [0.0, 1.0]).close("left");
    /// let scene = Scene::on(Region::new(plate)?, PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .hold("left")
    ///     .traction("right", [0.0, 0.01]);
    /// let problem = scene.discretize(&Scheme::default().spacing(0.25).seed(7))?;
    /// let path = problem.run(&mut ())?.completed()?;
    /// assert!(problem.displacement(path.last(), &[4.0, 0.5].into())?[1] > 0.1);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn on(region: Region, kinematics: impl Kinematics<2> + 'static, material: impl Material + 'static) -> Self {
        let scattering = move |scheme: &Scheme| -> Result<Arc<dyn Cells<2>>, Error> {
            let grading = |x: &Point<2>| scheme.grading.as_ref().map_or(1.0, |grading| grading(x.as_slice()));
            let triangles = match &scheme.resolution {
                Resolution::Spacing(h) => Triangulation::scattered(&region, |x| h * grading(x), &scheme.scatter)?,
                Resolution::Counts(counts) => {
                    let counts: [usize; 2] = discretize::per_axis(counts, "particle counts")?;
                    let count = counts[0].saturating_mul(counts[1]);
                    Triangulation::about(&region, count, grading, &scheme.scatter)?
                }
            };
            Ok(match scheme.partition {
                Partition::Triangles => Arc::new(triangles),
                Partition::Voronoi => Arc::new(Voronoi::new(triangles)),
            })
        };
        Scene::of(Source::Scattered(Arc::new(scattering)), kinematics, material)
    }
}

/// Refuses an amplitude that is no number at load factors of a run.
fn is_finite(amplitude: &Amplitude, label: &str) -> Result<(), BoundaryError> {
    let values = [0.0, 0.25, 0.5, 0.75, 1.0].map(|load| (load, amplitude.evaluate(load).0));
    match values.into_iter().find(|(_, value)| !value.is_finite()) {
        Some((load, value)) => Err(BoundaryError::Value { what: format!("amplitude of {label}"), value, load }),
        None => Ok(()),
    }
}

fn pad<const D: usize>(v: &[f64; D]) -> Vector3<f64> {
    Vector3::from_fn(|i, _| if i < D { v[i] } else { 0.0 })
}
