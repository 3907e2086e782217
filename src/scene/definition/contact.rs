//! Contact as a scene defines it.

use crate::contact::RigidSurface;

use super::contact_definition::{ContactDefinition, ContactPair};
use super::place::Place;
use super::scene::Scene;

impl<const D: usize> Scene<D> {
    /// Lets a boundary part touch a rigid surface: it may come to lie on it, slide along it and leave it. The mean gap under each trace
    /// function is never negative; single points may penetrate by a fraction of the spacing. No penalty factor, first step or guess of
    /// the contact zone is needed.
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
        self.contacts.push(ContactDefinition { place: place.into(), surface: surface.0, goes_on: false });
        self
    }

    /// Lets two boundary parts touch each other, of one body or of two, without friction; results are found by the name. A mortar method
    /// that passes the patch test whether particles match or not; the smaller part carries the pressures, of two of equal size the one
    /// with more facets. Faces of two bodies that are to touch are not bonded there.
    pub fn contact_between(self, first: impl Into<Place<D>>, second: impl Into<Place<D>>, name: &str) -> Self {
        self.with(ContactPair::between(first, second, name))
    }

    /// Lets a boundary part touch itself where it folds, without friction; results are found by the name.
    pub fn contact_itself(self, place: impl Into<Place<D>>, name: &str) -> Self {
        self.with(ContactPair::itself(place, name))
    }

    /// Lets two boundary parts that are drawn into each other touch without friction: the overlap is resolved along the load.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let rubber = Rubber::neo_hookean(0.5, 500.0)?;
    /// // Blocks of a height of 1 that overlap by 0.1 between fixed ends: each gives by the half of it.
    /// let (top, bottom) = ((1, Side::Max), (1, Side::Min));
    /// let scene = Scene::assembly(PlaneStrain)
    ///     .body("lower", Block::new([0.0, 0.0], [1.0, 1.0]), rubber.clone())
    ///     .body("upper", Block::new([0.0, 0.9], [1.0, 1.9]), rubber)
    ///     .hold(Place::on(bottom).of("lower"))
    ///     .hold(Place::on(top).of("upper"))
    ///     .press_fit(Place::on(top).of("lower"), Place::on(bottom).of("upper"), "fit");
    /// let problem = scene.discretize(&Scheme::default().particles([4, 4]))?;
    /// let path = problem.run()?.completed()?;
    /// assert!(problem.contact(path.last(), "fit")?.force[1] < -0.05);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn press_fit(self, first: impl Into<Place<D>>, second: impl Into<Place<D>>, name: &str) -> Self {
        self.with(ContactPair::between(first, second, name).interference(1.0))
    }
}
