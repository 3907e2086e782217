//! Scenes: what is to be solved.

use std::sync::Arc;

use crate::cells::Cells;
use crate::error::Incompatible;
use crate::geometry::{Domain, Part, vector};
use crate::kinematics::Kinematics;
use crate::material::Material;
use crate::term::Amplitude;

use super::condition::Condition;
use super::contact_definition::{ContactDefinition, ContactPair};
use super::geometry::Geometry;
use super::load::Load;
use super::place::{Place, Spot};
use super::resolution::edge_lengths;
use super::source::{BodyOf, Own, Source};
use super::value::Value;

/// The name of the first body of a scene that was made with one.
pub(crate) const FIRST: &str = "body";

/// What is added to a scene by [`Scene::with`].
#[derive(Debug, Clone)]
pub enum Action<const D: usize> {
    /// A prescribed displacement.
    Condition(Condition<D>),
    /// A load.
    Load(Load<D>),
    /// Boundary parts that touch each other.
    ContactPair(ContactPair<D>),
}

impl<const D: usize> From<Condition<D>> for Action<D> {
    fn from(condition: Condition<D>) -> Self {
        Action::Condition(condition)
    }
}

impl<const D: usize> From<ContactPair<D>> for Action<D> {
    fn from(pair: ContactPair<D>) -> Self {
        Action::ContactPair(pair)
    }
}

impl<const D: usize> From<Load<D>> for Action<D> {
    fn from(load: Load<D>) -> Self {
        Action::Load(load)
    }
}

/// What is to be solved: domain, kinematics, material, conditions and loads by boundary part; or several bodies.
///
/// Loads and prescribed values follow the load factor $\lambda \in [0, 1]$ as a ramp unless they have an amplitude of their
/// own. Parts go by the names that the cells give them, and by those that [`name`](Scene::name) adds.
#[derive(Clone)]
pub struct Scene<const D: usize> {
    pub(crate) bodies: Vec<BodyOf<D>>,
    /// Pairs of bodies that are not bonded where they touch.
    pub(crate) unbonded: Vec<[String; 2]>,
    /// What the schemes of bodies change in that of the scene, by their names.
    pub(crate) schemes: Vec<(String, Own)>,
    pub(crate) kinematics: Arc<dyn Kinematics<D>>,
    /// Time by the load factor.
    pub(crate) clock: Option<Amplitude>,
    /// Stretch of free expansion.
    pub(crate) expansion: Option<Value<D>>,
    pub(crate) conditions: Vec<Condition<D>>,
    pub(crate) loads: Vec<Load<D>>,
    pub(crate) contacts: Vec<ContactDefinition<D>>,
    pub(crate) contact_pairs: Vec<ContactPair<D>>,
    /// Those that a later stage goes without: their faces stay unbonded.
    pub(crate) released: Vec<ContactPair<D>>,
    pub(crate) names: Vec<(String, Place<D>)>,
    /// Rigid bodies and the parts tied to them.
    pub(crate) rigids: Vec<(String, Place<D>)>,
    /// The time and the displacements of the particles with which a later stage begins; none in a first one.
    pub(crate) started: Option<(f64, Arc<Vec<f64>>)>,
    /// Names that a stage asked for and nothing has.
    pub(crate) absent: Vec<String>,
}

impl<const D: usize> Scene<D> {
    /// A free, unloaded body of a [`Geometry`](crate::scene::Geometry): a block, a region, a mesh, given cells. Over a region a scheme says the spacing of
    /// particles or about how many there are ([`spacing`](crate::scene::Scheme::spacing),
    /// [`particles`](crate::scene::Scheme::particles)), where they are finer ([`graded`](crate::scene::Scheme::graded)), and which
    /// draw ([`seed`](crate::scene::Scheme::seed)).
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let plate = Outline::at([0.0, 0.0])
    ///     .line("bottom", [4.0, 0.0]).line("right", [4.0, 1.0]).line("top", [0.0, 1.0]).close("left");
    /// let scene = Scene::new(Region::new(plate)?, PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .hold("left")
    ///     .traction("right", [0.0, 0.01]);
    /// let problem = scene.discretize(&Scheme::default().spacing(0.25).seed(7))?;
    /// let path = problem.run()?.completed()?;
    /// assert!(problem.displacement(path.last(), &[4.0, 0.5].into())?[1] > 0.1);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    /// A part from a file: names are those of its physical groups.
    /// ```no_run
    /// use rkpm::prelude::*;
    /// let mount = Mesh::read("mount.msh")?; // mm
    /// let scene = Scene::new(&mount.body("rubber")?, Solid, Rubber::yeoh(0.55, -0.05, 0.01, 1e3)?) // MPa
    ///     .hold("base")
    ///     .with(Condition::on("insert").displacement([0.0, 0.0, -4.0]));
    /// let problem = scene.discretize(&Scheme::default())?;
    /// let path = problem.run()?.completed()?;
    /// println!("{:.0} N", problem.reaction(path.last(), "insert")?[2]);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn new(
        geometry: impl Into<Geometry<D>>,
        kinematics: impl Kinematics<D> + 'static,
        material: impl Material + 'static,
    ) -> Self {
        let source = geometry.into().source;
        let first = BodyOf { name: FIRST.into(), source, material: Arc::new(material) };
        Scene { bodies: vec![first], ..Scene::assembly(kinematics) }
    }

    /// The lengths of the domain's sides \[length\]; none where the cells were given.
    pub(crate) fn side_lengths(&self) -> Option<[f64; D]> {
        self.domain().map(|domain| edge_lengths(&*domain))
    }

    /// The domain; none where the cells were given.
    pub(crate) fn domain(&self) -> Option<Arc<dyn Domain<D>>> {
        match &self.bodies[..] {
            [BodyOf { source: Source::Domain(domain), .. }] => Some(domain.clone()),
            _ => None,
        }
    }

    /// The same scene over given particles and cells of the same body, the first of several; a scheme's resolution and
    /// layout are left out.
    pub fn with_cells(&self, cells: Arc<dyn Cells<D>>) -> Self {
        let mut scene = self.clone();
        if let Some(first) = scene.bodies.first_mut() {
            first.source = Source::Cells(cells);
        }
        scene
    }

    /// The body alone, domain, kinematics and material, for a certificate.
    ///
    /// # Errors
    /// Where there are several.
    pub(crate) fn alone(&self, certificate: &'static str) -> Result<Self, Incompatible> {
        if self.bodies.len() > 1 {
            let remedy = "each body has a certificate of its own: give it a scene of one body";
            return Err(Incompatible::new(certificate, "a scene of several bodies", remedy));
        }
        Ok(Scene {
            conditions: Vec::new(),
            loads: Vec::new(),
            contacts: Vec::new(),
            contact_pairs: Vec::new(),
            rigids: Vec::new(),
            expansion: None,
            clock: None,
            started: None,
            ..self.clone()
        })
    }

    /// Adds a [`Condition`] or a [`Load`].
    ///
    /// Several conditions at one place must all be satisfied: contradictory ones are an error of [`discretize`](Scene::discretize). At a
    /// common edge of two faces the values of the face whose normal is nearest hold, and [`check::scene`](crate::check::scene)
    /// reports the others.
    pub fn with(mut self, action: impl Into<Action<D>>) -> Self {
        match action.into() {
            Action::Condition(condition) => self.conditions.push(condition),
            Action::Load(load) => self.loads.push(load),
            Action::ContactPair(pair) => self.contact_pairs.push(pair),
        }
        self
    }

    /// The same without the conditions, loads and contacts of a name, for a later stage of [`Stages`](super::super::Stages). Faces of two
    /// bodies that touched in such a contact do not become bonded.
    pub fn without(mut self, name: &str) -> Self {
        let count = |scene: &Self| {
            scene.conditions.len() + scene.loads.len() + scene.contacts.len() + scene.contact_pairs.len()
        };
        let before = count(&self);
        self.conditions.retain(|condition| condition.name.as_deref() != Some(name));
        self.loads.retain(|load| load.name.as_deref() != Some(name));
        self.contacts.retain(|contact| contact.surface.name != name);
        let (gone, kept): (Vec<_>, Vec<_>) = self.contact_pairs.into_iter().partition(|pair| pair.name == name);
        self.contact_pairs = kept;
        self.released.extend(gone);
        if count(&self) == before {
            // Refused with the names that there are.
            self.absent.push(name.to_string());
        }
        self
    }

    /// The same with the rigid surface of a name moving on by a vector \[length\] from where it is; vectors of several calls add up.
    pub fn move_on(mut self, name: &str, by: [f64; D]) -> Self {
        match self.contacts.iter_mut().find(|contact| contact.surface.name == name) {
            Some(contact) => contact.surface.move_on(vector(&by)),
            None => self.absent.push(name.to_string()),
        }
        self
    }

    /// Gives a place a name, which conditions, loads and results then go by; one that the cells know already is hidden.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let block = Scene::new(Block::new([0.0, 0.0], [3.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .name("bottom", (1, Side::Min))
    ///     .name("top", (1, Side::Max))
    ///     .hold("bottom")
    ///     .prescribe("top", 0, 0.2)
    ///     .prescribe("top", 1, 0.0);
    /// let problem = block.discretize(&Scheme::default().particles([7, 3]))?;
    /// let path = problem.run()?.completed()?;
    /// assert!((problem.reaction(path.last(), "top")? + problem.reaction(path.last(), "bottom")?).norm() < 1e-9);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn name(mut self, name: impl Into<String>, place: impl Into<Place<D>>) -> Self {
        let place = self.resolve(&place.into());
        self.names.push((name.into(), place));
        self
    }

    /// Whether anything may touch a rigid surface or another part.
    pub(crate) fn has_contact(&self) -> bool {
        !self.contacts.is_empty() || !self.contact_pairs.is_empty()
    }

    /// A place with its name, if the scene gave it one, looked up.
    pub(crate) fn resolve(&self, place: &Place<D>) -> Place<D> {
        resolve(&self.names, place)
    }

    /// Prescribes displacement component `component` on a part: a number \[length\], or a [`Value`] that varies or moves.
    pub fn prescribe(self, place: impl Into<Place<D>>, component: usize, value: impl Into<Value<D>>) -> Self {
        self.with(Condition::on(place).component(component, value))
    }

    /// Holds all displacement components on a part.
    pub fn hold(self, place: impl Into<Place<D>>) -> Self {
        self.with(Condition::on(place).displacement([0.0; D]))
    }

    /// A pressure \[stress\] that follows a boundary part, positive inwards.
    pub fn pressure(self, place: impl Into<Place<D>>, pressure: impl Into<Value<D>>) -> Self {
        self.with(Load::pressure(place, pressure))
    }

    /// A dead traction \[stress\] per reference area on a boundary part.
    pub fn traction(self, place: impl Into<Place<D>>, traction: impl Into<Value<D, [f64; D]>>) -> Self {
        self.with(Load::traction(place, traction))
    }

    /// The same with a body that would expand freely by a stretch $\vartheta(X)$ in all directions: thermal strain $\vartheta = 1 + \alpha\\,\Delta T$
    /// without temperatures, swelling, shrinkage. It acts in full from the first step on; held bodies are stressed by it.
    /// Deformation gradients of the body are the elastic ones, $F/\vartheta$.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// // A block that grows by 2 % between smooth walls along one axis, and rises along the other.
    /// let block = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .prescribe((0, Side::Min), 0, 0.0)
    ///     .prescribe((0, Side::Max), 0, 0.0)
    ///     .prescribe((1, Side::Min), 1, 0.0)
    ///     .with_expansion(1.02);
    /// let problem = block.discretize(&Scheme::default().particles([5, 3]))?;
    /// let path = problem.run()?.completed()?;
    /// let rise = problem.displacement(path.last(), &[1.0, 1.0].into())?[1];
    /// assert!((rise - 0.0612).abs() < 1e-3); // the volume grows by 1.02³ - 1
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn with_expansion(mut self, stretch: impl Into<Value<D>>) -> Self {
        self.expansion = Some(stretch.into());
        self
    }

    /// The same taking time: the load factor runs from 0 to 1 in `duration` \[time\], as even as a clock. Laws that relax
    /// ([`Viscoelastic`](crate::material::Viscoelastic)) do so by it; amplitudes say how loads follow. Steps are chosen by
    /// [`Stepping::time_tolerance`](crate::solve::Stepping::time_tolerance). In [`Stages`](crate::scene::Stages) it is the time of one stage:
    /// one that gives none of its own takes none, in which nothing relaxes.
    ///
    /// ```
    /// use rkpm::material::{Prony, Viscoelastic};
    /// use rkpm::prelude::*;
    /// // A block sheared by a fifth within 1 s and held for 9 s: amplitudes are tables over the load factor, 0.1 of it a second.
    /// let hold = Amplitude::table(vec![(0.0, 0.0), (0.1, 1.0), (1.0, 1.0)])?;
    /// let rubber = Viscoelastic::new(Rubber::neo_hookean(0.5, 1e3)?, Prony::of_instantaneous([(0.4, 2.0)])?);
    /// let pad = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, rubber)
    ///     .hold((1, Side::Min))
    ///     .with(Condition::on((1, Side::Max)).displacement([0.2, 0.0]).amplitude(hold))
    ///     .over_time(10.0);
    /// let path = pad.discretize(&Scheme::default().particles([5, 3]))?.run()?.completed()?;
    /// assert!(path.steps.len() > 5);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn over_time(self, duration: f64) -> Self {
        self.with_clock(Amplitude::Table(vec![(0.0, 0.0), (1.0, duration)]))
    }

    /// The same with time as any function of the load factor that does not fall: a table (0, 0), (0.1, 0), (0.5, 1), (1, 1000) loads suddenly
    /// by a tenth, then takes a second for the next part and a thousand for the rest. Steps stop at its pairs.
    pub fn with_clock(mut self, clock: Amplitude) -> Self {
        self.clock = Some(match &self.started {
            None => clock,
            Some((time, _)) => clock.later(*time),
        });
        self
    }

    /// The displacements with which that many unknowns of particles begin; nothing in a first stage.
    pub(crate) fn moved(&self, unknowns: usize) -> &[f64] {
        self.started.as_ref().and_then(|(_, moved)| moved.get(..unknowns)).unwrap_or_default()
    }
}

/// A place with its name, if it has one among these, looked up.
pub(crate) fn resolve<const D: usize>(names: &[(String, Place<D>)], place: &Place<D>) -> Place<D> {
    let Spot::Part(Part::Named(requested)) = &place.spot else { return place.clone() };
    let Some((_, named)) = names.iter().rev().find(|(name, _)| name == requested) else { return place.clone() };
    let mut named = named.clone();
    if place.of.is_some() {
        named.of = place.of.clone();
    }
    named.within.extend_from_slice(&place.within);
    named
}
