//! Scenes: what is to be solved, for one, two or three dimensions.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::prelude::*;
use pyo3::types::PyDict;
use rkpm::contact::RigidSurface;
use rkpm::prelude::{Axisymmetric, PlaneStrain, PlaneStress, RadialCylinder, RadialSphere, Solid};
use rkpm::scene::{Condition, Load, Scene as SceneOf, Scheme, StagePath, Stages};

use crate::fault::{Callback, Error, Fault, Faults, mistyped};
use crate::geometry::AnyGeometry;
use crate::laws::Law;
use crate::path::{Path, Run};
use crate::place::{Number, Place, Vector, amplitude, array};
use crate::scheme::{Choices, Watch, quantity};

/// A scene of one, two or three dimensions.
#[derive(Clone)]
pub(crate) enum AnyScene {
    One(SceneOf<1>),
    Two(SceneOf<2>),
    Three(SceneOf<3>),
}

macro_rules! kinds {
    ($($dimension:literal $kind:ident),*) => {$(
        impl From<SceneOf<$dimension>> for AnyScene {
            fn from(scene: SceneOf<$dimension>) -> Self {
                AnyScene::$kind(scene)
            }
        }
        impl TryFrom<AnyScene> for SceneOf<$dimension> {
            type Error = PyErr;
            fn try_from(scene: AnyScene) -> PyResult<Self> {
                match scene {
                    AnyScene::$kind(scene) => Ok(scene),
                    _ => Err(Error::new_err("history: a stage gave a scene of other dimensions")),
                }
            }
        }
    )*};
}
kinds!(1 One, 2 Two, 3 Three);

/// A change of a scene by a Python function, which may add functions to those that the run calls.
fn change<const D: usize>(
    function: Callback,
    faults: Faults,
) -> impl Fn(SceneOf<D>) -> SceneOf<D> + Send + Sync + 'static
where
    AnyScene: From<SceneOf<D>>,
    SceneOf<D>: TryFrom<AnyScene, Error = PyErr>,
{
    move |scene| {
        let changed = function.call(|function| {
            let before = Scene { inner: scene.clone().into(), faults: faults.all(), path: Mutex::new(None) };
            let after = function.call1((before,))?;
            let after = after.cast::<Scene>().map_err(|_| mistyped("history: a stage gave no scene"))?.get();
            faults.add(after.faults.iter().cloned());
            after.inner.clone().try_into()
        });
        changed.unwrap_or(scene)
    }
}

/// The scene after a change that is written once for all dimensions.
macro_rules! changed {
    ($self:expr, $scene:ident => $change:expr) => {
        match $self.inner.clone() {
            AnyScene::One($scene) => AnyScene::One($change),
            AnyScene::Two($scene) => AnyScene::Two($change),
            AnyScene::Three($scene) => AnyScene::Three($change),
        }
    };
}

/// A body with its law, conditions, loads and contacts. Methods give a new scene and leave the old one as it was.
///
/// `kinematics` of bodies in the plane is "plane strain", "plane stress" (with `thickness`, 1 unless given) or "axisymmetric", of
/// bars "radial cylinder" or "radial sphere". Without a body the scene is an assembly, to which `body` adds several; it needs its kinematics, or "solid" in
/// space.
#[pyclass(frozen, module = "rkpm")]
pub(crate) struct Scene {
    inner: AnyScene,
    faults: Vec<Fault>,
    path: Mutex<Option<Py<Path>>>,
}

impl Scene {
    fn with(&self, inner: AnyScene, faults: impl IntoIterator<Item = Option<Fault>>) -> Self {
        let faults = self.faults.iter().cloned().chain(faults.into_iter().flatten()).collect();
        Scene { inner, faults, path: Mutex::new(None) }
    }
}

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (body=None, law=None, kinematics=None, *, thickness=None))]
    fn new(
        body: Option<&Bound<'_, PyAny>>,
        law: Option<Law>,
        kinematics: Option<&str>,
        thickness: Option<f64>,
    ) -> PyResult<Self> {
        let geometry = body.map(AnyGeometry::of).transpose()?;
        let kinematics = kinematics.unwrap_or(match geometry.as_ref().map(AnyGeometry::dimension) {
            Some(1) => "radial cylinder",
            Some(2) => "plane strain",
            _ => "solid",
        });
        let empty = match kinematics {
            "plane strain" => AnyScene::Two(SceneOf::assembly(PlaneStrain)),
            "plane stress" => AnyScene::Two(SceneOf::assembly(PlaneStress { thickness: thickness.unwrap_or(1.0) })),
            "axisymmetric" => AnyScene::Two(SceneOf::assembly(Axisymmetric)),
            "solid" => AnyScene::Three(SceneOf::assembly(Solid)),
            "radial cylinder" => AnyScene::One(SceneOf::assembly(RadialCylinder)),
            "radial sphere" => AnyScene::One(SceneOf::assembly(RadialSphere)),
            other => {
                let known = "plane strain, plane stress, axisymmetric, solid, radial cylinder, radial sphere";
                return Err(Error::new_err(format!("scene: no kinematics {other:?}; there are {known}")));
            }
        };
        if thickness.is_some() && kinematics != "plane stress" {
            let why = "is that of plane stress; forces in plane strain are per unit thickness";
            return Err(Error::new_err(format!("scene: a thickness in {kinematics}: it {why}")));
        }
        let scene = Scene { inner: empty, faults: Vec::new(), path: Mutex::new(None) };
        match (body, law) {
            (None, None) => Ok(scene),
            // The name that a scene of one body gives it.
            (Some(body), Some(law)) => scene.body("body", body, law, None, None),
            _ => Err(mistyped("scene: give a body with its law, or neither and add bodies by body(…)")),
        }
    }

    /// Adds a body of a name; `particles` and `spacing` are those of this body alone.
    #[pyo3(signature = (name, geometry, law, *, particles=None, spacing=None))]
    fn body(
        &self,
        name: &str,
        geometry: &Bound<'_, PyAny>,
        law: Law,
        particles: Option<&Bound<'_, PyAny>>,
        spacing: Option<f64>,
    ) -> PyResult<Self> {
        let geometry = AnyGeometry::of(geometry)?;
        let given = geometry.dimension();
        let material = law.material;
        if particles.is_some() && spacing.is_some() {
            return Err(Error::new_err(format!("body {name:?}: give particles or spacing, not both")));
        }
        let counts = particles.map(crate::scheme::counts).transpose()?;
        let own = move |scheme: Scheme| match (&counts, spacing) {
            (Some(counts), _) => scheme.particles(counts.clone()),
            (None, Some(spacing)) => scheme.spacing(spacing),
            (None, None) => scheme,
        };
        let is_own = particles.is_some() || spacing.is_some();
        macro_rules! add {
            ($scene:ident, $geometry:ident) => {{
                let scene = $scene.body(name, $geometry, material);
                if is_own { scene.scheme_of(name, own) } else { scene }
            }};
        }
        let inner = match (self.inner.clone(), geometry) {
            (AnyScene::One(s), AnyGeometry::One(g)) => AnyScene::One(add!(s, g)),
            (AnyScene::Two(s), AnyGeometry::Two(g)) => AnyScene::Two(add!(s, g)),
            (AnyScene::Three(s), AnyGeometry::Three(g)) => AnyScene::Three(add!(s, g)),
            (scene, _) => {
                let needed = match scene {
                    AnyScene::One(_) => 1,
                    AnyScene::Two(_) => 2,
                    AnyScene::Three(_) => 3,
                };
                return Err(Error::new_err(format!(
                    "body {name:?}: it has {given} dimensions, the kinematics of the scene needs {needed}"
                )));
            }
        };
        Ok(self.with(inner, law.faults.all().into_iter().map(Some)))
    }

    /// Leaves two bodies unbonded where they touch.
    fn unbonded(&self, first: &str, second: &str) -> Self {
        self.with(changed!(self, scene => scene.unbonded(first, second)), [])
    }

    /// Gives a place a name.
    fn name(&self, name: &str, place: &Bound<'_, PyAny>) -> PyResult<Self> {
        let place = Place::of(place)?;
        Ok(self.with(changed!(self, scene => scene.name(name, place.to()?)), [place.fault()]))
    }

    /// Holds all displacement components on a part.
    fn hold(&self, place: &Bound<'_, PyAny>) -> PyResult<Self> {
        let place = Place::of(place)?;
        Ok(self.with(changed!(self, scene => scene.hold(place.to()?)), [place.fault()]))
    }

    /// Moves a part: a vector [length], or a function of X or of X and the load factor that gives one; arguments with defaults are the
    /// function's own. `over` is a table of pairs of load factor and value in place of the ramp; results go by `name`.
    #[pyo3(signature = (place, by, *, name=None, over=None))]
    #[pyo3(name = "move")]
    fn shift(
        &self,
        place: &Bound<'_, PyAny>,
        by: &Bound<'_, PyAny>,
        name: Option<String>,
        over: Option<Vec<(f64, f64)>>,
    ) -> PyResult<Self> {
        let (place, by, over) = (Place::of(place)?, Vector::of(by, "move")?, amplitude(over)?);
        let inner = changed!(self, scene => {
            let condition = Condition::on(place.to()?).displacement(by.to("move")?).amplitude(over);
            scene.with(match name { Some(name) => condition.named(name), None => condition })
        });
        Ok(self.with(inner, [place.fault(), by.fault()]))
    }

    /// Prescribes one component of the displacement on a part: a number [length] or a function of X.
    #[pyo3(signature = (place, component, value, *, name=None, over=None))]
    fn prescribe(
        &self,
        place: &Bound<'_, PyAny>,
        component: usize,
        value: &Bound<'_, PyAny>,
        name: Option<String>,
        over: Option<Vec<(f64, f64)>>,
    ) -> PyResult<Self> {
        let (place, value, over) = (Place::of(place)?, Number::of(value, "prescribe")?, amplitude(over)?);
        let inner = changed!(self, scene => {
            let condition = Condition::on(place.to()?).component(component, value.to()).amplitude(over);
            scene.with(match name { Some(name) => condition.named(name), None => condition })
        });
        Ok(self.with(inner, [place.fault(), value.fault()]))
    }

    /// A pressure [stress] that follows a part, positive inwards.
    #[pyo3(signature = (place, pressure, *, name=None, over=None))]
    fn pressure(
        &self,
        place: &Bound<'_, PyAny>,
        pressure: &Bound<'_, PyAny>,
        name: Option<String>,
        over: Option<Vec<(f64, f64)>>,
    ) -> PyResult<Self> {
        let (place, value, over) = (Place::of(place)?, Number::of(pressure, "pressure")?, amplitude(over)?);
        let inner = changed!(self, scene => {
            let load = Load::pressure(place.to()?, value.to()).amplitude(over);
            scene.with(match name { Some(name) => load.named(name), None => load })
        });
        Ok(self.with(inner, [place.fault(), value.fault()]))
    }

    /// A dead traction [stress] per area at rest.
    #[pyo3(signature = (place, traction, *, name=None, over=None))]
    fn traction(
        &self,
        place: &Bound<'_, PyAny>,
        traction: &Bound<'_, PyAny>,
        name: Option<String>,
        over: Option<Vec<(f64, f64)>>,
    ) -> PyResult<Self> {
        let (place, value, over) = (Place::of(place)?, Vector::of(traction, "traction")?, amplitude(over)?);
        let inner = changed!(self, scene => {
            let load = Load::traction(place.to()?, value.to("traction")?).amplitude(over);
            scene.with(match name { Some(name) => load.named(name), None => load })
        });
        Ok(self.with(inner, [place.fault(), value.fault()]))
    }

    /// A dead force on a rigid body or at a point, or shared out evenly over a part or the body.
    #[pyo3(name = "force", signature = (place, force, *, name=None, over=None))]
    fn push(
        &self,
        place: &Bound<'_, PyAny>,
        force: Vec<f64>,
        name: Option<String>,
        over: Option<Vec<(f64, f64)>>,
    ) -> PyResult<Self> {
        let (place, over) = (Place::of(place)?, amplitude(over)?);
        let inner = changed!(self, scene => {
            let load = Load::force(place.to()?, array(&force, "force")?).amplitude(over);
            scene.with(match name { Some(name) => load.named(name), None => load })
        });
        Ok(self.with(inner, [place.fault()]))
    }

    /// A moment [force × length] on a rigid body: three components, in the plane the third alone counts.
    fn moment(&self, body: &str, moment: [f64; 3]) -> Self {
        self.with(changed!(self, scene => scene.with(Load::moment(body, moment))), [])
    }

    /// A dead force per volume at rest [stress/length].
    fn body_force(&self, force: &Bound<'_, PyAny>) -> PyResult<Self> {
        let value = Vector::of(force, "body_force")?;
        let inner = changed!(self, scene => scene.with(Load::body_force(value.to("body_force")?)));
        Ok(self.with(inner, [value.fault()]))
    }

    /// Springs on a part [stress/length], in all directions or along the normal alone.
    #[pyo3(signature = (place, stiffness, *, normal=false))]
    fn foundation(&self, place: &Bound<'_, PyAny>, stiffness: f64, normal: bool) -> PyResult<Self> {
        let place = Place::of(place)?;
        let inner = changed!(self, scene => scene.with(match normal {
            true => Load::normal_elastic_foundation(place.to()?, stiffness),
            false => Load::elastic_foundation(place.to()?, stiffness),
        }));
        Ok(self.with(inner, [place.fault()]))
    }

    /// Ties a part to a rigid body of a name, which is then held, moved and loaded by that name.
    fn rigid(&self, name: &str, place: &Bound<'_, PyAny>) -> PyResult<Self> {
        let place = Place::of(place)?;
        Ok(self.with(changed!(self, scene => scene.rigid(name, place.to()?)), [place.fault()]))
    }

    /// Lets a part touch a rigid surface: `plane=(point, normal)` with the rigid side behind it, or `sphere=(centre, radius)` (a
    /// shaft in the plane), which moves by a vector, or is pushed by a force; results go by the name.
    #[pyo3(signature = (place, name, *, plane=None, sphere=None, move_by=None, push=None, friction=0.0))]
    fn contact(
        &self,
        place: &Bound<'_, PyAny>,
        name: &str,
        plane: Option<(Vec<f64>, Vec<f64>)>,
        sphere: Option<(Vec<f64>, f64)>,
        move_by: Option<Vec<f64>>,
        push: Option<Vec<f64>>,
        friction: f64,
    ) -> PyResult<Self> {
        let place = Place::of(place)?;
        macro_rules! finish {
            ($surface:expr) => {{
                let surface = $surface.named(name);
                let surface = match (&move_by, &push) {
                    (Some(_), Some(_)) => return Err(mistyped("contact: give move_by or push, not both")),
                    (Some(by), None) => surface.moving(array(by, "contact")?),
                    (None, Some(force)) => surface.pushed(array(force, "contact")?),
                    (None, None) => surface,
                };
                if friction == 0.0 { surface } else { surface.friction(friction) }
            }};
        }
        let inner = match (&self.inner, &plane, &sphere) {
            (_, Some((point, normal)), None) => changed!(self, scene => {
                let surface = RigidSurface::plane(array(point, "contact")?, array(normal, "contact")?);
                scene.contact(place.to()?, finish!(surface))
            }),
            (AnyScene::Two(scene), None, Some((centre, radius))) => {
                let surface = finish!(RigidSurface::shaft(array(centre, "contact")?, *radius));
                AnyScene::Two(scene.clone().contact(place.to()?, surface))
            }
            (AnyScene::Three(scene), None, Some((centre, radius))) => {
                let surface = finish!(RigidSurface::sphere(array(centre, "contact")?, *radius));
                AnyScene::Three(scene.clone().contact(place.to()?, surface))
            }
            _ => return Err(mistyped("contact: give plane or sphere")),
        };
        Ok(self.with(inner, [place.fault()]))
    }

    /// Lets two parts touch each other without friction, or one itself; results go by the name. With `fit` they begin inside each other,
    /// and the overlap is resolved along the load.
    #[pyo3(signature = (first, second, name, *, fit=false))]
    fn contact_between(
        &self,
        first: &Bound<'_, PyAny>,
        second: Option<&Bound<'_, PyAny>>,
        name: &str,
        fit: bool,
    ) -> PyResult<Self> {
        let (first, second) = (Place::of(first)?, second.map(Place::of).transpose()?);
        if fit && second.is_none() {
            return Err(mistyped("contact_between: fit needs two parts that begin inside each other"));
        }
        let inner = changed!(self, scene => match (&second, fit) {
            (Some(second), true) => scene.press_fit(first.to()?, second.to()?, name),
            (Some(second), false) => scene.contact_between(first.to()?, second.to()?, name),
            (None, _) => scene.contact_itself(first.to()?, name),
        });
        Ok(self.with(inner, [first.fault(), second.as_ref().and_then(Place::fault)]))
    }

    /// The stretch of free expansion in all directions: a number or a function of X.
    fn expansion(&self, stretch: &Bound<'_, PyAny>) -> PyResult<Self> {
        let value = Number::of(stretch, "expansion")?;
        Ok(self.with(changed!(self, scene => scene.with_expansion(value.to())), [value.fault()]))
    }

    /// The same without the conditions, loads and contacts of a name, for a later stage.
    fn without(&self, name: &str) -> Self {
        self.with(changed!(self, scene => scene.without(name)), [])
    }

    /// The same with the rigid surface of a name moving on by a vector, for a later stage.
    fn move_on(&self, name: &str, by: Vec<f64>) -> PyResult<Self> {
        Ok(self.with(changed!(self, scene => scene.move_on(name, array(&by, "move_on")?)), []))
    }

    /// Takes time while the load factor goes from 0 to 1, for laws that relax.
    fn over_time(&self, duration: f64) -> Self {
        self.with(changed!(self, scene => scene.over_time(duration)), [])
    }

    /// The path of the last run, however it ended.
    #[getter]
    fn path(&self, py: Python<'_>) -> Option<Py<Path>> {
        self.path.lock().unwrap_or_else(PoisonError::into_inner).as_ref().map(|path| path.clone_ref(py))
    }

    /// Solves the scene.
    ///
    /// How: `particles` along each axis (one number or several), or their `spacing` [length]; `order` of the basis, 1 or 2;
    /// `elements=True` takes finite elements of that order; `dilation`, the normalised one; `seed` of scattered particles; `steps`, equal
    /// ones; `arc_length=True` follows the path through limit points.
    ///
    /// Or `within`, a relative error: the crate chooses the model, whatever particles bodies were given. `of` says of what: "energy" (unless given), "volume",
    /// `("force", place, component)` or `("displacement", point, component)`; the answer is `value` of the path, with `bound`.
    ///
    /// `progress=True` prints a line for each step, a function is called with load factor and iterations. Ctrl-C raises `Interrupted`.
    #[pyo3(signature = (*, particles=None, spacing=None, order=None, elements=false, dilation=None, seed=None, steps=None,
        arc_length=false, within=None, of=None, progress=None))]
    fn solve(
        &self,
        py: Python<'_>,
        particles: Option<&Bound<'_, PyAny>>,
        spacing: Option<f64>,
        order: Option<u8>,
        elements: bool,
        dilation: Option<f64>,
        seed: Option<u64>,
        steps: Option<usize>,
        arc_length: bool,
        within: Option<f64>,
        of: Option<&Bound<'_, PyAny>>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<Path>> {
        if of.is_some() && within.is_none() {
            return Err(Error::new_err("solve: of says what is to be known within an error, give within too"));
        }
        let choices = Choices { spacing, order, elements, dilation, seed, steps, arc_length };
        let scheme = choices.scheme(particles)?;
        let mut watch = Watch::new(progress, Faults::new(self.faults.iter().cloned()));
        macro_rules! run {
            ($scene:expr, $variant:ident) => {{
                let tolerance = within.map(|error| quantity(of, error)).transpose()?;
                let found = match &tolerance {
                    Some(_) if particles.is_some() || spacing.is_some() => {
                        return Err(Error::new_err(
                            "solve: within chooses the particles, leave particles and spacing out",
                        ));
                    }
                    Some(tolerance) => {
                        let default = !elements && order.is_none() && dilation.is_none();
                        py.detach(|| crate::scheme::sized($scene, &scheme, default, tolerance, &mut watch))
                    }
                    None => py.detach(|| crate::scheme::run($scene, &scheme, &mut watch)),
                };
                found.map(|found| Path::$variant(Arc::new(found)))
            }};
        }
        let path = match &self.inner {
            AnyScene::One(scene) => run!(scene, one),
            AnyScene::Two(scene) => run!(scene, two),
            AnyScene::Three(scene) => run!(scene, three),
        };
        let path = Py::new(py, watch.finish(py, path)?)?;
        *self.path.lock().unwrap_or_else(PoisonError::into_inner) = Some(path.clone_ref(py));
        watch.judge(py, &path)?;
        Ok(path)
    }

    /// Solves the scene, then stages that change it, each from where the one before ended: `{name: function}`, a function takes the scene
    /// of the stage before and gives the next one, by `without`, `move_on`, `move`, … . Gives a path for each stage, the first for the scene
    /// itself. How: as in `solve`. Where a run ends early, or a stage cannot begin, the exception has the paths of all stages up to there as
    /// `paths`.
    #[pyo3(signature = (stages, *, particles=None, spacing=None, order=None, elements=false, steps=None, progress=None))]
    fn history(
        &self,
        py: Python<'_>,
        stages: &Bound<'_, PyDict>,
        particles: Option<&Bound<'_, PyAny>>,
        spacing: Option<f64>,
        order: Option<u8>,
        elements: bool,
        steps: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<Py<Path>>> {
        let choices = Choices { spacing, order, elements, dilation: None, seed: None, steps, arc_length: false };
        let scheme = choices.scheme(particles)?;
        let mut named = Vec::new();
        let faults = Faults::new(self.faults.iter().cloned());
        for (name, function) in stages.iter() {
            if !function.is_callable() {
                return Err(mistyped("history: give stages as {name: function of a scene}"));
            }
            let function = Callback::new(&function);
            faults.add([function.fault.clone()]);
            named.push((name.extract::<String>()?, function));
        }
        // A name that no stage has.
        let mut first = "first".to_string();
        while named.iter().any(|(name, _)| *name == first) {
            first.push('\'');
        }
        let mut watch = Watch::new(progress, faults.clone());
        macro_rules! run {
            ($scene:expr, $variant:ident) => {{
                let mut stages = Stages::new(first, $scene.clone());
                for (name, function) in named {
                    stages = stages.then(name, change(function, faults.clone()));
                }
                let found = py.detach(|| stages.run_with(&scheme, &mut watch));
                let path = |stage: StagePath<_>| {
                    let (problem, path, faults) = (stage.problem, stage.path, faults.clone());
                    Path::$variant(Arc::new(Run { problem, path, within: None, why: None, seconds: f64::NAN, faults }))
                };
                let (stages, ended) = match found {
                    Ok(stages) => (stages, Ok(())),
                    Err(broken) => (broken.stages, Err(*broken.error)),
                };
                (stages.into_iter().map(path).collect::<Vec<_>>(), ended)
            }};
        }
        let (paths, ended) = match &self.inner {
            AnyScene::One(scene) => run!(scene, one),
            AnyScene::Two(scene) => run!(scene, two),
            AnyScene::Three(scene) => run!(scene, three),
        };
        let ended = watch.finish(py, ended);
        let paths: Vec<Py<Path>> = paths.into_iter().map(|path| Py::new(py, path)).collect::<PyResult<_>>()?;
        let Some(last) = paths.last() else { return ended.map(|()| paths) };
        *self.path.lock().unwrap_or_else(PoisonError::into_inner) = Some(last.clone_ref(py));
        let error = match ended.map(|()| watch.judge(py, last)) {
            Ok(Ok(())) => return Ok(paths),
            Ok(Err(error)) => error,
            Err(error) => {
                error.value(py).setattr("path", last)?;
                error
            }
        };
        error.value(py).setattr("paths", paths)?;
        Err(error)
    }
}
