//! Contact as a scene defines it.

use crate::contact::RigidSurface;

use super::contact_definition::{ContactDefinition, ContactPair};
use super::place::Place;
use super::scene::Scene;

impl<const D: usize> Scene<D> {
    /// Lets a boundary part touch a rigid surface: it may come to lie on it, slide along it and leave it, and never goes
    /// in. Nothing else is to be said: no factor, no first step, no guess of what touches.
    ///
    /// A body that nothing but contact holds is kept in place until it touches. Results are found by the name of the
    /// surface, [`Problem::contact`](crate::scene::Problem::contact).
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// // A quarter of a rubber cylinder of 0.4 m squeezed by a plate that comes down by 25 mm.
    /// let quarter = Outline::at([0.0, 0.0]).line("equator", [0.2, 0.0])
    ///     .arc("outer", [0.0, 0.2], [0.0, 0.0], Turn::Left).close("axis");
    /// let rubber = Rubber::mooney_rivlin(0.293, 0.177, 1410.0)?; // MPa
    /// let roller = Scene::new(Region::new(quarter)?, PlaneStrain, rubber)
    ///     .prescribe("equator", 1, 0.0)
    ///     .prescribe("axis", 0, 0.0)
    ///     .contact("outer", RigidSurface::plane([0.0, 0.2], [0.0, -1.0]).moving([0.0, -0.025]).named("plate"));
    /// let problem = roller.discretize(&Scheme::default().particles([8]))?;
    /// let path = problem.run()?.completed()?;
    /// let plate = problem.contact(path.last(), "plate")?;
    /// let width = plate.extent; // m, of this half
    /// assert!(plate.force[1] < 0.0 && width > 0.04 && width < 0.1);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn contact(mut self, place: impl Into<Place<D>>, surface: RigidSurface<D>) -> Self {
        self.contacts.push(ContactDefinition { place: place.into(), surface });
        self
    }

    /// Lets two boundary parts touch each other, of one body or of two, without friction; results are found by the name. A mortar method
    /// that passes the patch test whether particles match or not; the part that has more facets carries the pressures.
    pub fn contact_between(mut self, first: impl Into<Place<D>>, second: impl Into<Place<D>>, name: &str) -> Self {
        self.contact_pairs.push(ContactPair { first: first.into(), second: Some(second.into()), name: name.into() });
        self
    }

    /// Lets a boundary part touch itself where it folds, without friction; results are found by the name.
    pub fn contact_itself(mut self, place: impl Into<Place<D>>, name: &str) -> Self {
        self.contact_pairs.push(ContactPair { first: place.into(), second: None, name: name.into() });
        self
    }
}
