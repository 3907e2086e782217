//! Rigid bodies as a scene defines them.

use super::place::Place;
use super::scene::Scene;

impl<const D: usize> Scene<D> {
    /// Ties a part to a rigid body of a name, a bonded plate or insert: all of the part moves as one, by translation and
    /// finite rotation. Several parts may be tied to one body. Where the part is a volume of a mesh (an area in the plane), its
    /// cells are left out, and what they share faces with is tied.
    ///
    /// By its name the body is held (`hold`), moved ([`Condition`](crate::scene::Condition)), and loaded by a force
    /// ([`Load::force`](crate::scene::Load::force)) or a moment ([`Load::moment`](crate::scene::Load::moment)). A condition by the name
    /// prescribes the displacement of all its points, so that it does not turn unless the values say so; one at a point,
    /// `Place::at(x).of("plate")`, leaves it free to turn about that point. What no condition prescribes is free, and follows
    /// from the loads. A condition on the whole body that it is tied to prescribes it as one by the name does; what another one prescribes at a
    /// particle that is tied, it prescribes of the rigid body there. Where a tied face and a face with a condition meet at an edge, one of the
    /// two has the equations of the particles there.
    /// [`Problem::reaction`](crate::scene::Problem::reaction) and [`Problem::moment`](crate::scene::Problem::moment) by the name are what the body exerts on the parts.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// // A rubber block under a bonded plate that is pushed aside beneath a dead weight, free to turn.
    /// let block = Scene::new(Block::new([0.0, 0.0], [2.0, 2.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .hold((1, Side::Min))
    ///     .rigid("plate", (1, Side::Max))
    ///     .with(Condition::on(Place::at([1.0, 2.0]).of("plate")).component(0, 0.5).named("push"))
    ///     .with(Load::force("plate", [0.0, -0.1]));
    /// let problem = block.discretize(&Scheme::default().particles([9, 9]))?;
    /// let path = problem.run()?.completed()?;
    /// let plate = problem.rigid_motion(path.last(), "plate")?;
    /// assert!(plate.rotation[(0, 1)] > 0.01); // it leans forward
    /// assert!((problem.reaction(path.last(), "plate")?[1] + 0.1).abs() < 1e-9);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn rigid(mut self, name: impl Into<String>, place: impl Into<Place<D>>) -> Self {
        self.rigids.push((name.into(), place.into()));
        self
    }
}
