//! Several bodies in one scene.

use std::sync::Arc;

use crate::cells::Cells;
use crate::each::Each;
use crate::error::{BoundaryError, Error, GeometryError};
use crate::geometry::Part;
use crate::kinematics::Kinematics;
use crate::material::Material;

use super::place::Spot;
use super::source::{BodyOf, Source};
use crate::scene::{Geometry, Place, Scene, Scheme};

impl<const D: usize> Scene<D> {
    /// A scene without a body, to which several are added by [`body`](Scene::body).
    ///
    /// Bodies have particles of their own and are bonded where they share faces, whether their particles match there or not:
    /// the strain may jump there, as different materials require. Faces of lattices belong to a body:
    /// `Place::on((1, Side::Max)).of("rubber")`.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// // A rubber sheet between two plates of steel, sheared.
    /// let sheet = |low, high| Block::new([0.0, low], [20.0, high]); // mm
    /// let steel = Rubber::neo_hookean(40e3, 175e3)?; // MPa
    /// let scene = Scene::assembly(PlaneStrain)
    ///     .body("rubber", sheet(1.0, 5.0), Rubber::neo_hookean(0.5, 1e3)?)
    ///     .body("lower", sheet(0.0, 1.0), steel.clone())
    ///     .body("upper", sheet(5.0, 6.0), steel)
    ///     .scheme_of("rubber", |scheme| scheme.particles([21, 5]))
    ///     .hold(Place::on((1, Side::Min)).of("lower"))
    ///     .with(Condition::on(Place::on((1, Side::Max)).of("upper")).displacement([2.0, 0.0]).named("shear"));
    /// let problem = scene.discretize(&Scheme::default().particles([11, 3]))?;
    /// let path = problem.run()?.completed()?;
    /// let force = problem.reaction(path.last(), "shear")?[0];
    /// assert!((force / (1.0 * 2.0 / 4.0 * 20.0) - 1.0).abs() < 0.1); // N/mm, less than µγA at the free ends
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn assembly(kinematics: impl Kinematics<D> + 'static) -> Self {
        Scene {
            bodies: Vec::new(),
            unbonded: Vec::new(),
            schemes: Vec::new(),
            kinematics: Arc::new(kinematics),
            clock: None,
            expansion: None,
            conditions: Vec::new(),
            loads: Vec::new(),
            names: Vec::new(),
            rigids: Vec::new(),
            started: None,
            absent: Vec::new(),
            contacts: Vec::new(),
            contact_pairs: Vec::new(),
            released: Vec::new(),
        }
    }

    /// Adds a body. Its parts have the names that they were drawn with.
    pub fn body(
        mut self,
        name: impl Into<String>,
        geometry: impl Into<Geometry<D>>,
        material: impl Material + 'static,
    ) -> Self {
        let source = geometry.into().source;
        self.bodies.push(BodyOf { name: name.into(), source, material: Arc::new(material) });
        self
    }

    /// Changes the scheme for a body alone: its particles, its approximation. Several changes follow one another.
    pub fn scheme_of(mut self, name: &str, change: impl Fn(Scheme) -> Scheme + Send + Sync + 'static) -> Self {
        self.schemes.push((name.to_string(), Arc::new(change)));
        self
    }

    /// Whether a body has a scheme of its own.
    pub(crate) fn has_scheme_of(&self, body: &str) -> bool {
        self.schemes.iter().any(|(name, _)| name == body)
    }

    /// The scheme of a body under that of the scene.
    pub(crate) fn scheme_under(&self, body: &str, scheme: &Scheme) -> Scheme {
        let own = self.schemes.iter().filter(|(name, _)| name == body);
        own.fold(scheme.clone(), |scheme, (_, change)| change(scheme))
    }

    /// Leaves two bodies unbonded where they touch.
    pub fn unbonded(mut self, first: impl Into<String>, second: impl Into<String>) -> Self {
        self.unbonded.push([first.into(), second.into()]);
        self
    }

    /// Whether two bodies, by their numbers, are left unbonded.
    pub(crate) fn is_unbonded(&self, pair: [usize; 2]) -> bool {
        let names = pair.map(|body| &self.bodies[body].name);
        self.unbonded.iter().any(|[a, b]| names == [a, b] || names == [b, a])
    }

    /// Refuses bodies without a name of their own, and names that no body has.
    pub(crate) fn validate_bodies(&self) -> Result<(), Error> {
        ensure!(
            !self.bodies.is_empty(),
            GeometryError::Count { what: "bodies of a scene", count: 0, needed: "add one by Scene::body" }
        );
        let mut own: Vec<&str> = Vec::with_capacity(self.bodies.len());
        for body in &self.bodies {
            ensure!(!own.contains(&body.name.as_str()), BoundaryError::NamedTwice { name: body.name.clone() });
            own.push(&body.name);
            if let Source::Domain(domain) = &body.source {
                domain.validate()?;
            }
        }
        let mut places = self.acting();
        for (_, place) in &self.rigids {
            places.push(place);
        }
        let mut asked: Vec<&str> = Vec::new();
        for place in places {
            if let (None, Some(name)) = (self.rigid_at(place), &place.of) {
                asked.push(name);
            }
        }
        for (_, place) in &self.names {
            if let Some(name) = &place.of {
                asked.push(name);
            }
        }
        asked.extend(self.schemes.iter().map(|(name, _)| name.as_str()));
        for pair in &self.unbonded {
            asked.extend([&*pair[0], &*pair[1]]);
        }
        if let Some(name) = self.rigid_names().iter().find(|name| own.contains(name)) {
            return Err(BoundaryError::NamedTwice { name: name.to_string() }.into());
        }
        match asked.iter().find(|name| !own.contains(name)) {
            Some(name) => Err(unknown_body(&own, name).into()),
            None => Ok(()),
        }
    }

    /// The places of conditions, then those of loads.
    pub(super) fn acting(&self) -> Vec<&Place<D>> {
        let mut places = self.conditions.mapped(|condition| &condition.place);
        places.extend(self.loads.iter().map(|load| &load.place));
        places
    }

    /// Which bodies a place lies on, by their numbers; at least one. At a point it is the first that `reaches` it.
    pub(crate) fn bodies_at(
        &self,
        place: &Place<D>,
        what: &dyn Fn() -> String,
        cells: &[(Scheme, Arc<dyn Cells<D>>)],
        reaches: &dyn Fn(usize) -> bool,
    ) -> Result<Vec<usize>, Error> {
        let names = self.bodies.mapped(|body| &*body.name);
        if let Some(name) = &place.of {
            let found = names.iter().position(|own| own == name);
            return Ok(vec![found.ok_or_else(|| unknown_body(&names, name))?]);
        }
        if names.len() == 1 {
            return Ok(vec![0]);
        }
        let all = 0..names.len();
        match &place.spot {
            Spot::Body => Ok(all.collect()),
            Spot::Point(_) => Ok(vec![all.into_iter().find(|&number| reaches(number)).unwrap_or(0)]),
            Spot::Part(part @ Part::Named(_)) => {
                let found: Vec<usize> = all.filter(|&body| cells[body].1.particles_on(part).is_ok()).collect();
                if found.is_empty() {
                    // The first body's own refusal lists the parts that it knows.
                    cells[0].1.particles_on(part)?;
                }
                Ok(found)
            }
            Spot::Part(_) => Err(BoundaryError::Ambiguous { what: what(), known: names.join("; ") }.into()),
        }
    }

    /// The body of a place in contact, by its number, and the place with its name looked up; a part that several bodies have is refused.
    pub(crate) fn touching(
        &self,
        place: &Place<D>,
        cells: &[(Scheme, Arc<dyn Cells<D>>)],
    ) -> Result<(usize, Place<D>), Error> {
        let place = self.resolve(place);
        let what = || format!("contact of {place}");
        let of = self.bodies_at(&place, &what, cells, &|_| true)?;
        if let (Spot::Part(_), [_, _, ..]) = (&place.spot, &of[..]) {
            let known = of.mapped(|body| &*self.bodies[*body].name).join("; ");
            return Err(BoundaryError::Ambiguous { what: what(), known }.into());
        }
        Ok((of.first().copied().unwrap_or(0), place))
    }
}

fn unknown_body(known: &[&str], name: &str) -> BoundaryError {
    BoundaryError::UnknownBody { requested: name.to_string(), known: known.join("; ") }
}
