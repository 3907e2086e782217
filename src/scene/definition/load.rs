//! Loads: forces, pressures, springs, and integrands of one's own.

use std::fmt;
use std::sync::Arc;

use crate::each::{EachOf, list_of, point_of};
use crate::error::SolveError;
use crate::geometry::{Mat3, Point, Vec3, padded, vector};
use crate::material::{Material, Past};
use crate::term::{Amplitude, Body, DeadLoad, FollowerPressure, Integrand, PointDerivatives, PointState, Sparsity};

use crate::scene::{Place, Value};

/// A load: where, what, and how it follows the load factor.
///
/// ```
/// use rkpm::prelude::*;
/// // A column under its own weight on an elastic foundation, pushed sideways by 2 N on the middle of its right face.
/// let scene = Scene::new(Block::new([0.0, 0.0], [1.0, 3.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
///     .with(Load::elastic_foundation((1, Side::Min), 5.0))
///     .with(Load::body_force([0.0, -0.01]))
///     .with(Load::force(Place::on(Side::Max).within(|x: &Point<2>| (x[1] - 1.5).abs() < 0.5), [-0.02, 0.0]));
/// let problem = scene.discretize(&Scheme::default().particles([5, 13]))?;
/// let path = problem.run()?.completed()?;
/// assert!(problem.displacement(path.last(), &[0.5, 0.0].into())?[1] < 0.0);
/// # Ok::<(), rkpm::Error>(())
/// ```
#[derive(Clone)]
pub struct Load<const D: usize> {
    pub(crate) place: Place<D>,
    pub(crate) kind: LoadKind<D>,
    pub(crate) amplitude: Amplitude,
    pub(crate) name: Option<String>,
}

/// What kind of load.
#[derive(Clone)]
pub(crate) enum LoadKind<const D: usize> {
    /// A force per reference area on parts, per reference volume in the body, at a point the force itself.
    Dead(Value<D, [f64; D]>),
    /// The same, shared out evenly over the place.
    Total([f64; D]),
    Pressure(Value<D>),
    /// On a rigid body.
    Moment([f64; 3]),
    Integrand(Arc<dyn Integrand>),
}

impl<const D: usize> Load<D> {
    fn new(place: impl Into<Place<D>>, kind: LoadKind<D>) -> Self {
        Load { place: place.into(), kind, amplitude: Amplitude::Ramp, name: None }
    }

    /// A dead traction \[stress\] per reference area of a boundary part. On [`Place::body`] it is a force per reference volume, which is how
    /// [`of`](Place::of) and [`within`](Place::within) give a [`body_force`](Load::body_force) to one body or some of it; at a point it is the
    /// force itself, as [`force`](Load::force) is there.
    pub fn traction(place: impl Into<Place<D>>, traction: impl Into<Value<D, [f64; D]>>) -> Self {
        Load::new(place, LoadKind::Dead(traction.into()))
    }

    /// A pressure \[stress\] that follows a boundary part, positive inwards.
    pub fn pressure(place: impl Into<Place<D>>, pressure: impl Into<Value<D>>) -> Self {
        Load::new(place, LoadKind::Pressure(pressure.into()))
    }

    /// A dead force \[force\] at a point, or a total one shared out evenly over the reference area of a part or the volume of the
    /// body; per unit thickness in plane strain, of the whole revolution in bodies of revolution.
    pub fn force(place: impl Into<Place<D>>, force: [f64; D]) -> Self {
        Load::new(place, LoadKind::Total(force))
    }

    /// A moment \[force × length\] on a rigid body ([`Scene::rigid`](crate::scene::Scene::rigid)), in the plane its third component, others are refused:
    /// the work on a small further rotation $\delta\omega$ is $M\cdot\delta\omega$ wherever the body has turned to.
    pub fn moment(body: &str, moment: [f64; 3]) -> Self {
        Load::new(body, LoadKind::Moment(moment))
    }

    /// A dead force per reference volume \[stress/length\].
    pub fn body_force(force: impl Into<Value<D, [f64; D]>>) -> Self {
        Load::new(Place::body(), LoadKind::Dead(force.into()))
    }

    /// Springs in all directions, $\tfrac12\int k\\,|u|^2$: `stiffness` is per reference area on a part \[stress/length\], per
    /// reference volume in the body, at a point the spring's own \[force/length\].
    pub fn elastic_foundation(place: impl Into<Place<D>>, stiffness: f64) -> Self {
        Load::new(place, LoadKind::Integrand(Arc::new(crate::term::ElasticFoundation { stiffness })))
    }

    /// Springs along the reference normal of a part alone, $\tfrac12\int k\\,(u\cdot N)^2$ \[stress/length\]: what slides
    /// along a soft support.
    pub fn normal_elastic_foundation(place: impl Into<Place<D>>, stiffness: f64) -> Self {
        Load::new(place, LoadKind::Integrand(Arc::new(NormalElasticFoundation { stiffness })))
    }

    /// An integrand of one's own over the points of a part, the body, or at a point; it sees the load factor itself, without an amplitude.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// use rkpm::term::{Sparsity, PointDerivatives, PointState};
    /// /// A wall below X₂ = 0 that pushes back.
    /// struct Wall(f64);
    /// impl Integrand for Wall {
    ///     fn sparsity(&self) -> Sparsity {
    ///         Sparsity { force: true, force_by_displacement: true, ..Sparsity::default() }
    ///     }
    ///     fn evaluate(&self, at: &PointState, flux: &mut PointDerivatives) {
    ///         let depth = -(at.position[1] + at.displacement[1]);
    ///         if depth > 0.0 {
    ///             flux.energy = 0.5 * self.0 * depth * depth;
    ///             flux.force[1] = -self.0 * depth;
    ///             flux.force_by_displacement[(1, 1)] = self.0;
    ///         }
    ///     }
    /// }
    /// let block = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .prescribe(Side::Min, 0, 0.0)
    ///     .with(Load::integrand((1, Side::Min), Wall(50.0)))
    ///     .prescribe((1, Side::Max), 1, -0.1);
    /// let path = block.discretize(&Scheme::default().particles([5, 5]))?.run()?.completed()?;
    /// # let _ = path;
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn integrand(place: impl Into<Place<D>>, integrand: impl Integrand + 'static) -> Self {
        Load::new(place, LoadKind::Integrand(Arc::new(integrand)))
    }

    /// Sets how the load follows the load factor; a ramp unless set. Motions get it in place of the load factor; springs and integrands of
    /// one's own, which have none, are refused with it.
    pub fn amplitude(mut self, amplitude: Amplitude) -> Self {
        self.amplitude = amplitude;
        self
    }

    /// Gives the load a name, which messages use.
    pub fn named(mut self, name: impl Into<String>) -> Self {
        self.name = Some(name.into());
        self
    }

    /// What messages call it.
    pub(crate) fn label(&self) -> String {
        use super::place::Spot;
        let kind = match (&self.kind, &self.place.spot) {
            (LoadKind::Dead(_), Spot::Body) if self.name.is_none() => return "body force".into(),
            (LoadKind::Dead(_), Spot::Body) => "force",
            (LoadKind::Total(_) | LoadKind::Dead(_), Spot::Point(at)) if self.name.is_none() => {
                return format!("point load at {:?}", at.as_slice());
            }
            (LoadKind::Total(_) | LoadKind::Dead(_), Spot::Point(_)) => "point load",
            (LoadKind::Dead(_), _) => "traction",
            (LoadKind::Total(_), _) => "force",
            (LoadKind::Pressure(_), _) => "pressure",
            (LoadKind::Moment(_), _) => "moment",
            (LoadKind::Integrand(_), _) => "integrand",
        };
        label(self.name.as_deref(), kind, &self.place)
    }
}

fn label(name: Option<&str>, kind: &str, place: &dyn fmt::Display) -> String {
    match name {
        Some(name) => format!("{name} ({kind} on {place})"),
        None => format!("{kind} on {place}"),
    }
}

impl<const D: usize> fmt::Debug for Load<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Load({}, {:?})", self.label(), self.amplitude)
    }
}

/// Half the interval of the central difference for motions, as that of amplitudes.
const DIFFERENCE: f64 = 1e-5;

/// The difference of a function's values before, at and behind a place, and over how many steps: over one where the function has no value
/// on the other side, as a root has none before its zero.
fn difference([before, here, behind]: [f64; 3]) -> (f64, f64) {
    match (before.is_finite(), behind.is_finite()) {
        (false, true) => (behind - here, 1.0),
        (true, false) => (here - before, 1.0),
        _ => (behind - before, 2.0),
    }
}

/// A load whose value varies.
pub(crate) struct Varying<V> {
    pub value: V,
    pub amplitude: Amplitude,
}

/// A value by the amplitude as a vector, and whether it moves: values that do not are to be multiplied by the amplitude.
struct ByAmplitude<'a> {
    moves: bool,
    at: &'a dyn Fn(f64) -> Vec3,
}

impl ByAmplitude<'_> {
    /// The value and its slope over the load factor.
    fn with_slope(&self, amplitude: &Amplitude, load: f64) -> [Vec3; 2] {
        let (factor, slope) = amplitude.evaluate(load);
        let value = (self.at)(factor);
        if self.moves {
            let [low, high] = [(self.at)(factor - DIFFERENCE), (self.at)(factor + DIFFERENCE)];
            let by_component = |i: usize| {
                let (change, steps) = difference([low[i], value[i], high[i]]);
                change * (slope / (steps * DIFFERENCE))
            };
            return [value, point_of(by_component)];
        }
        [value * factor, value * slope]
    }
}

/// The amplitudes of the components of a vector that moves.
fn components(dim: usize, vector: Arc<dyn Fn(f64) -> Vec3 + Send + Sync>, amplitude: &Amplitude) -> Vec<Amplitude> {
    let component = |i: usize| {
        let (vector, amplitude) = (vector.clone(), amplitude.clone());
        Amplitude::Function(Arc::new(move |load| vector(amplitude.value(load))[i]))
    };
    list_of(dim, component)
}

impl<const D: usize, T: Copy + 'static> Varying<Value<D, T>> {
    fn with_slope(&self, at: &PointState, vector: fn(&T) -> Vec3) -> [Vec3; 2] {
        let x: Point<D> = padded(&at.position);
        let moves = matches!(self.value, Value::Motion(_));
        ByAmplitude { moves, at: &|factor| vector(&self.value.at(&x, factor)) }.with_slope(&self.amplitude, at.load)
    }

    /// The amplitudes that the value follows at a point: its own, or the components of one that moves.
    fn followed(&self, at: &Vec3, vector: fn(&T) -> Vec3) -> Vec<Amplitude> {
        let Value::Motion(motion) = &self.value else { return vec![self.amplitude.clone()] };
        let (x, motion): (Point<D>, _) = (padded(at), motion.clone());
        components(D, Arc::new(move |factor| vector(&motion(&x, factor))), &self.amplitude)
    }
}

impl<const D: usize> Integrand for Varying<Value<D, [f64; D]>> {
    fn sparsity(&self) -> Sparsity {
        Sparsity { force: true, ..Sparsity::default() }
    }

    fn evaluate(&self, at: &PointState, flux: &mut PointDerivatives) {
        let [force, slope] = self.with_slope(at, vector);
        (flux.force, flux.force_by_load) = (-force, -slope);
    }

    fn break_points(&self) -> Vec<f64> {
        self.amplitude.break_points()
    }

    fn amplitudes(&self, at: &Vec3) -> Vec<Amplitude> {
        self.followed(at, vector)
    }
}

impl<const D: usize> Integrand for Varying<Value<D>> {
    fn sparsity(&self) -> Sparsity {
        FollowerPressure { pressure: 1.0, amplitude: Amplitude::Constant }.sparsity()
    }

    fn evaluate(&self, at: &PointState, flux: &mut PointDerivatives) {
        let [pressure, slope] = self.with_slope(at, first);
        follow(pressure[0], slope[0], at, flux);
    }

    fn is_symmetric(&self) -> bool {
        false
    }

    fn break_points(&self) -> Vec<f64> {
        self.amplitude.break_points()
    }

    fn amplitudes(&self, at: &Vec3) -> Vec<Amplitude> {
        self.followed(at, first)
    }

    fn needs_normals(&self) -> bool {
        true
    }
}

/// A number as the first component of a vector.
fn first(value: &f64) -> Vec3 {
    Vec3::new(*value, 0.0, 0.0)
}

/// Derivatives of a pressure with a slope over the load factor.
fn follow(pressure: f64, slope: f64, at: &PointState, flux: &mut PointDerivatives) {
    let follower = |pressure| FollowerPressure { pressure, amplitude: Amplitude::Constant };
    follower(slope).evaluate(at, flux);
    let by_load = flux.force;
    follower(pressure).evaluate(at, flux);
    flux.force_by_load = by_load;
}

/// Springs along the normal.
struct NormalElasticFoundation {
    stiffness: f64,
}

impl Integrand for NormalElasticFoundation {
    fn sparsity(&self) -> Sparsity {
        Sparsity { force: true, force_by_displacement: true, ..Sparsity::default() }
    }

    fn evaluate(&self, at: &PointState, flux: &mut PointDerivatives) {
        let along = at.displacement.dot(&at.normal);
        flux.energy = 0.5 * self.stiffness * along * along;
        flux.force = at.normal * (self.stiffness * along);
        flux.force_by_displacement = at.normal * at.normal.transpose() * self.stiffness;
    }

    fn needs_normals(&self) -> bool {
        true
    }

    fn validate(&self) -> Result<(), SolveError> {
        crate::term::foundation(self.stiffness)
    }
}

/// An integrand at load factor 1, whatever the load factor is.
pub(crate) struct AtFullLoad(pub Arc<dyn Integrand>);

impl Integrand for AtFullLoad {
    fn sparsity(&self) -> Sparsity {
        self.0.sparsity()
    }

    fn evaluate(&self, at: &PointState, flux: &mut PointDerivatives) {
        self.0.evaluate(&PointState { load: 1.0, ..*at }, flux);
        flux.force_by_load = Vec3::zeros();
    }

    fn is_symmetric(&self) -> bool {
        self.0.is_symmetric()
    }

    fn needs_normals(&self) -> bool {
        self.0.needs_normals()
    }

    fn validate(&self) -> Result<(), SolveError> {
        self.0.validate()
    }
}

/// A body in plane stress.
#[derive(Clone)]
pub(crate) struct Sheet<const D: usize> {
    /// With the free thickness.
    pub law: Arc<dyn Material>,
    /// The stretch of its free expansion, where it has one.
    pub expansion: Option<Value<D>>,
}

impl<const D: usize> Sheet<D> {
    /// What a body is in plane stress; none where it is not.
    pub(crate) fn of(body: &Body<D>, expansion: Option<Value<D>>) -> Option<Self> {
        body.table().is_plane_stress().then(|| Sheet { law: body.material().clone(), expansion })
    }

    /// The stretch across it at a place, as the elastic law has it.
    pub(crate) fn thickness(&self, f: &Mat3, x: &Point<D>) -> f64 {
        let free = self.expansion.as_ref().map_or(1.0, |stretch| stretch.at(x, 1.0));
        let rest = self.law.rest();
        free * self.law.settled(&(f / free), Past { memory: &rest, elapsed: 0.0 })[(2, 2)]
    }
}

/// A load on a sheet that reads the deformation: the stretch across is that of the sheet as the law has it at the point.
pub(crate) struct OnSheet<const D: usize> {
    pub load: Arc<dyn Integrand>,
    pub sheet: Sheet<D>,
}

impl<const D: usize> Integrand for OnSheet<D> {
    fn sparsity(&self) -> Sparsity {
        self.load.sparsity()
    }

    fn evaluate(&self, at: &PointState, flux: &mut PointDerivatives) {
        let x: Point<D> = padded(&at.position);
        on_sheet(&*self.load, &|f| self.sheet.thickness(f, &x), at, flux);
    }

    fn is_symmetric(&self) -> bool {
        false
    }

    fn break_points(&self) -> Vec<f64> {
        self.load.break_points()
    }

    fn amplitudes(&self, at: &Vec3) -> Vec<Amplitude> {
        self.load.amplitudes(at)
    }

    fn needs_normals(&self) -> bool {
        self.load.needs_normals()
    }

    fn validate(&self) -> Result<(), SolveError> {
        self.load.validate()
    }
}

/// Derivatives of a load where the stretch across follows from the deformation in the plane.
fn on_sheet(load: &dyn Integrand, thick: &dyn Fn(&Mat3) -> f64, at: &PointState, flux: &mut PointDerivatives) {
    const ACROSS: usize = 8;
    let mut settled = at.deformation;
    settled[(2, 2)] = thick(&at.deformation);
    load.evaluate(&PointState { deformation: settled, ..*at }, flux);
    let across = flux.force_by_gradient.column(ACROSS).into_owned();
    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let [low, high] = [-DIFFERENCE, DIFFERENCE].each(|step| {
            let mut f = at.deformation;
            f[(i, j)] += step;
            thick(&f)
        });
        let slope = across * ((high - low) / (2.0 * DIFFERENCE));
        let mut column = flux.force_by_gradient.column_mut(3 * i + j);
        column += slope;
    }
    flux.force_by_gradient.column_mut(ACROSS).fill(0.0);
}

/// A dead load that is the same everywhere.
pub(crate) fn dead<const D: usize>(force: &[f64; D], amplitude: &Amplitude) -> DeadLoad {
    DeadLoad { force: vector(force), amplitude: amplitude.clone() }
}
