//! Several bodies in one scene.

use std::sync::Arc;

use crate::cells::Cells;
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
        self.bodies.push(BodyOf { name: name.into(), source, material: Arc::new(material), scheme: None });
        self
    }

    /// Changes the scheme for a body alone: its particles, its approximation.
    pub fn scheme_of(mut self, name: &str, change: impl Fn(Scheme) -> Scheme + Send + Sync + 'static) -> Self {
        match self.bodies.iter_mut().find(|body| body.name == name) {
            Some(body) => body.scheme = Some(Arc::new(change)),
            // Refused with the bodies that there are.
            None => self.unbonded.push([name.to_string(), name.to_string()]),
        }
        self
    }

    /// Leaves two bodies unbonded where they touch.
    pub fn unbonded(mut self, first: impl Into<String>, second: impl Into<String>) -> Self {
        self.unbonded.push([first.into(), second.into()]);
        self
    }

    /// Refuses bodies without a name of their own, and names that no body has.
    pub(crate) fn validate_bodies(&self) -> Result<(), Error> {
        if self.bodies.is_empty() {
            return Err(
                GeometryError::Count { what: "bodies of a scene", count: 0, needed: "add one by Scene::body" }.into()
            );
        }
        for (number, body) in self.bodies.iter().enumerate() {
            if self.bodies[..number].iter().any(|other| other.name == body.name) {
                return Err(BoundaryError::NamedTwice { name: body.name.clone() }.into());
            }
            if let Source::Domain(domain) = &body.source {
                domain.validate()?;
            }
        }
        let places = self.conditions.iter().map(|c| &c.place).chain(self.loads.iter().map(|l| &l.place));
        if let Some(name) =
            self.rigid_names().into_iter().find(|name| self.bodies.iter().any(|body| body.name == **name))
        {
            return Err(BoundaryError::NamedTwice { name: name.to_string() }.into());
        }
        let ties = self.rigids.iter().map(|(_, place)| place);
        let of = places
            .chain(ties)
            .filter(|place| self.rigid_at(place).is_none())
            .chain(self.names.iter().map(|(_, place)| place))
            .filter_map(|place| place.of.as_ref());
        match of.chain(self.unbonded.iter().flatten()).find(|name| self.bodies.iter().all(|body| body.name != **name)) {
            Some(name) => Err(self.unknown_body(name).into()),
            None => Ok(()),
        }
    }

    fn unknown_body(&self, name: &str) -> BoundaryError {
        let known = self.bodies.iter().map(|body| body.name.as_str()).collect::<Vec<_>>().join("; ");
        BoundaryError::UnknownBody { requested: name.to_string(), known }
    }

    /// Which bodies a place lies on, by their numbers; at least one. At a point it is the first that `reaches` it.
    pub(crate) fn bodies_at(
        &self,
        place: &Place<D>,
        what: &dyn Fn() -> String,
        cells: &[(Scheme, Arc<dyn Cells<D>>)],
        reaches: &dyn Fn(usize) -> bool,
    ) -> Result<Vec<usize>, Error> {
        let all = 0..self.bodies.len();
        if let Some(name) = &place.of {
            let found = all.clone().find(|&number| self.bodies[number].name == *name);
            return Ok(vec![found.ok_or_else(|| self.unknown_body(name))?]);
        }
        if self.bodies.len() == 1 {
            return Ok(vec![0]);
        }
        match &place.spot {
            Spot::Body => Ok(all.collect()),
            Spot::Point(_) => Ok(vec![all.clone().find(|&number| reaches(number)).unwrap_or(0)]),
            Spot::Part(part @ Part::Named(_)) => {
                let known = |number: &usize| cells[*number].1.boundary_nodes(part).is_ok();
                let found: Vec<usize> = all.clone().filter(known).collect();
                if found.is_empty() {
                    // The first body's own refusal lists the parts that it knows.
                    cells[0].1.boundary_nodes(part)?;
                }
                Ok(found)
            }
            Spot::Part(_) => {
                let known = self.bodies.iter().map(|body| body.name.as_str()).collect::<Vec<_>>().join("; ");
                Err(BoundaryError::Ambiguous { what: what(), known }.into())
            }
        }
    }
}
