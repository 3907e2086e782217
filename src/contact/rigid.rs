//! Rigid surfaces and how they move.

use std::sync::Arc;

use crate::error::{Error, GeometryError, Invalid};
use crate::geometry::{Point, Vec3, vector};
use crate::solid::Solid3;
use crate::term::Amplitude;

use super::interference::{self, Interference};
use super::surface::Padded;
use super::turning::{Turned, Turning, finite, rotation};
use super::{Cone, ContactError, Nearest, Plane, Profile, Round, Surface, Triangulated};

/// How a rigid surface moves: by a vector times an amplitude, or along a unit vector, pushed by a force times an amplitude and free to move.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Drive {
    pub along: Vec3,
    pub force: Option<f64>,
    pub amplitude: Amplitude,
}

/// A rigid surface: its shape, its motion along the load factor and its friction.
///
/// ```
/// use rkpm::contact::RigidSurface;
/// // A plate above that comes down by 2 mm, without friction.
/// let plate = RigidSurface::plane([0.0, 10.0], [0.0, -1.0]).moving([0.0, -2.0]);
/// // A shaft that is pushed to the left by 3 N/mm.
/// let shaft = RigidSurface::shaft([20.0, 5.0], 4.0).pushed([-3.0, 0.0]);
/// # let _ = (plate, shaft);
/// ```
#[derive(Clone)]
pub struct RigidSurface<const D: usize>(pub(crate) Obstacle);

/// What a rigid surface is, by three components.
#[derive(Clone)]
pub(crate) struct Obstacle {
    pub shape: Arc<dyn Surface<3>>,
    pub name: String,
    pub drive: Option<Drive>,
    pub turning: Option<Turning>,
    /// Where it has gone before the run \[length\].
    start: Vec3,
    pub friction: f64,
    pub interference: Option<Interference>,
    /// Whether it was given a motion and then a force, or the reverse; an angle and then a moment, or the reverse.
    driven_twice: bool,
    /// An amplitude of a turn that is not given yet.
    turn_to_come: Option<Amplitude>,
}

/// A rigid surface at one load factor, as a point sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placed {
    /// Where the surface has gone \[length\].
    pub offset: Vec3,
    /// Its change with the load factor.
    pub slope: Vec3,
    pub turned: Option<Turned>,
}

impl<const D: usize> RigidSurface<D> {
    /// A surface of any shape that stays where it is.
    pub fn new(shape: impl Surface<D> + 'static) -> Self {
        RigidSurface::named_shape(shape, "rigid surface")
    }

    fn named_shape(shape: impl Surface<D> + 'static, name: &str) -> Self {
        RigidSurface(Obstacle {
            shape: Arc::new(Padded::<D, _>(shape)),
            name: name.into(),
            drive: None,
            turning: None,
            start: Point::zeros(),
            friction: 0.0,
            interference: None,
            driven_twice: false,
            turn_to_come: None,
        })
    }

    /// A plane through a point \[length\]; the rigid body lies behind it, opposite to the normal.
    pub fn plane(through: [f64; D], normal: [f64; D]) -> Self {
        RigidSurface::named_shape(Plane { through: through.into(), normal: normal.into() }, "plane")
    }

    /// The name by which results are requested.
    pub fn named(mut self, name: &str) -> Self {
        self.0.name = name.into();
        self
    }

    /// Moves by a vector \[length\] while the load factor goes from 0 to 1.
    pub fn moving(self, by: [f64; D]) -> Self {
        self.moving_along(by, Amplitude::Ramp)
    }

    /// Moves by a vector \[length\] times an amplitude.
    pub fn moving_along(mut self, by: [f64; D], amplitude: Amplitude) -> Self {
        self.0.drive(Drive { along: vector(&by), force: None, amplitude });
        self
    }

    /// Is pushed by a force that grows with the load factor \[force; per unit thickness in plane strain\]: free to move along it,
    /// guided across.
    pub fn pushed(mut self, force: [f64; D]) -> Self {
        let force = vector(&force);
        let size = force.norm();
        self.0.drive(Drive { along: force / size, force: Some(size), amplitude: Amplitude::Ramp });
        self
    }

    /// Coulomb's coefficient of friction. Where a condition fixes a boundary particle along the surface, and the surface does not move in
    /// that direction, the condition takes the force and no friction acts.
    pub fn friction(mut self, coefficient: f64) -> Self {
        self.0.friction = coefficient;
        self
    }

    /// Lets the body begin inside the surface: the overlap is resolved while the load factor goes from 0 to `until`.
    pub fn interference(mut self, until: f64) -> Self {
        self.0.interference = Some(Interference::new(until));
        self
    }

    /// Lets the turn by `turning`, or the moment of `driven`, follow an amplitude in place of the load factor; given before or after it.
    pub fn turning_along(mut self, amplitude: Amplitude) -> Self {
        match &mut self.0.turning {
            Some(turning) => turning.amplitude = amplitude,
            None => self.0.turn_to_come = Some(amplitude),
        }
        self
    }
}

impl Obstacle {
    /// Gives it a motion or a force.
    pub(crate) fn drive(&mut self, drive: Drive) {
        self.driven_twice |=
            self.drive.as_ref().is_some_and(|earlier| earlier.force.is_some() != drive.force.is_some());
        self.drive = Some(drive);
    }

    /// Moves on from where it is; along with the motion of a ramp that it has, and not with another one.
    pub(crate) fn move_on(&mut self, by: Point<3>) {
        let is_moved = |drive: &&Drive| drive.force.is_none();
        self.driven_twice |=
            self.drive.as_ref().filter(is_moved).is_some_and(|drive| drive.amplitude != Amplitude::Ramp);
        let earlier = self.drive.as_ref().filter(is_moved).map_or_else(Point::zeros, |drive| drive.along);
        self.drive(Drive { along: earlier + by, force: None, amplitude: Amplitude::Ramp });
    }

    /// Gives it an angle, or a moment where it is free to turn.
    fn turn(&mut self, about: Vec3, axis: Vec3, amount: f64, free: bool) {
        let spin = axis.normalize().cross_matrix();
        self.driven_twice |= self.turning.as_ref().is_some_and(|turning| turning.free != free);
        let earlier = self.turning.as_ref().map(|turning| turning.amplitude.clone());
        let amplitude = self.turn_to_come.take().or(earlier).unwrap_or(Amplitude::Ramp);
        self.turning = Some(Turning { about, spin, amount, amplitude, free, start: 0.0, axis: axis.norm() });
    }

    /// Whether the load factor moves it.
    pub(crate) fn moves_with_load(&self) -> bool {
        self.drive.as_ref().is_some_and(|drive| drive.force.is_none())
            || self.turning.as_ref().is_some_and(|turning| !turning.free)
    }

    /// Refuses surfaces that bound no body and motions that are none.
    pub(crate) fn validate(&self, contact: &str) -> Result<(), Error> {
        let contact = contact.to_string();
        self.shape.validate().map_err(|error| match error {
            GeometryError::Invalid(Invalid { what, value, needed }) => {
                Error::from(Invalid::new(format!("{contact}: {what}"), value, needed))
            }
            other => other.into(),
        })?;
        interference::validate(self.friction, self.interference.as_ref(), &contact)?;
        ensure!(!self.driven_twice, ContactError::DrivenTwice { contact });
        ensure!(self.turn_to_come.is_none(), ContactError::Unturned { contact });
        if let Some(turning) = &self.turning {
            turning.validate(&contact)?;
        }
        let Some(Drive { along, force, amplitude }) = &self.drive else { return Ok(()) };
        amplitude.validate(|| contact.clone())?;
        ensure!(*force != Some(0.0), ContactError::Unheld { contact });
        let (what, own) = match force {
            Some(force) => ("force", std::slice::from_ref(force)),
            None => ("motion", along.as_slice()),
        };
        Ok(finite(|| format!("{contact}: {what} of the rigid surface"), own.iter().copied(), amplitude)?)
    }

    /// The direction in which it is free, where it is.
    pub(crate) fn free_direction(&self) -> Option<Vec3> {
        self.drive.as_ref().filter(|drive| drive.force.is_some()).map(|drive| drive.along)
    }

    /// Whether no motion moves it along an axis.
    pub(super) fn stays_along(&self, axis: usize) -> bool {
        self.turning.is_none() && self.drive.as_ref().is_none_or(|drive| drive.along[axis] == 0.0)
    }

    /// Whether it moves by unknowns of its own.
    pub(crate) fn is_free(&self) -> bool {
        self.free_direction().is_some() || self.turning.as_ref().is_some_and(|turning| turning.free)
    }

    /// Stays where it has come to at load factor 1, pushed by the force that it has there.
    pub(crate) fn stay(&mut self) {
        self.turning.iter_mut().for_each(Turning::stay);
        let Some(Drive { along, force, amplitude }) = &mut self.drive else { return };
        let value = amplitude.value(1.0);
        if force.is_some() {
            *amplitude = Amplitude::level(value);
        } else {
            self.start += *along * value;
            self.drive = None;
        }
    }

    /// Where it has gone at a load factor; travel and angle are its own unknowns where it is pushed and free to turn.
    pub(crate) fn placed(&self, load: f64, [travel, angle]: [f64; 2]) -> Placed {
        let (by, slope) = match &self.drive {
            None => (Point::zeros(), Point::zeros()),
            Some(Drive { along, force: Some(_), .. }) => (along * travel, Point::zeros()),
            Some(Drive { along, amplitude, .. }) => {
                let (value, slope) = amplitude.evaluate(load);
                (along * value, along * slope)
            }
        };
        let turned = self.turning.as_ref().map(|turning| turning.at(load, angle));
        Placed { offset: self.start + by, slope, turned }
    }

    /// What its motion follows.
    pub(crate) fn amplitudes(&self) -> impl Iterator<Item = &Amplitude> {
        let drive = self.drive.iter().map(|drive| &drive.amplitude);
        drive.chain(self.turning.iter().map(|turning| &turning.amplitude))
    }

    /// Load factors at which its motion has break points.
    pub(crate) fn break_points(&self) -> Vec<f64> {
        let mut all = Vec::new();
        for amplitude in self.amplitudes() {
            all.append(&mut amplitude.break_points());
        }
        all
    }
}

impl Placed {
    /// Gap, normal and curvature at a current position.
    pub(crate) fn nearest(&self, shape: &dyn Surface<3>, x: &Vec3) -> Nearest<3> {
        let Some(turned) = &self.turned else { return shape.nearest(&(x - self.offset)) };
        let rotation = turned.rotation;
        let found = shape.nearest(&(turned.about + rotation.tr_mul(&self.arm(x))));
        let curvature = rotation * found.curvature * rotation.transpose();
        Nearest { normal: rotation * found.normal, curvature, ..found }
    }

    /// From the axis to a current position.
    pub(crate) fn arm(&self, x: &Vec3) -> Vec3 {
        self.turned.as_ref().map_or_else(Point::zeros, |turned| x - self.offset - turned.about)
    }

    /// What a turn by a unit angle moves the surface by at the end of an arm.
    pub(crate) fn spun(&self, arm: &Vec3) -> Vec3 {
        self.turned.as_ref().map_or_else(Point::zeros, |turned| turned.spin * arm)
    }

    /// Where an arm has come to with the surface since it had turned by an angle.
    pub(crate) fn carried(&self, arm: Vec3, angle: f64) -> Vec3 {
        self.turned.as_ref().map_or(arm, |turned| rotation(&turned.spin, turned.angle - angle) * arm)
    }

    /// How the surface moves with the load factor at the end of an arm.
    pub(crate) fn rate(&self, arm: &Vec3) -> Vec3 {
        self.slope + self.spun(arm) * self.turn_rate()
    }

    /// How it turns with the load factor.
    pub(crate) fn turn_rate(&self) -> f64 {
        self.turned.as_ref().map_or(0.0, |turned| turned.rate)
    }

    /// The angle that it has turned by.
    pub(crate) fn angle(&self) -> f64 {
        self.turned.as_ref().map_or(0.0, |turned| turned.angle)
    }
}

impl RigidSurface<2> {
    /// A rigid cylinder across the plane.
    pub fn shaft(centre: [f64; 2], radius: f64) -> Self {
        RigidSurface::named_shape(Round { centre: centre.into(), along: None, radius, hollow: false }, "shaft")
    }

    /// A cylindrical bore across the plane: the body lies within.
    pub fn bore(centre: [f64; 2], radius: f64) -> Self {
        RigidSurface::named_shape(Round { centre: centre.into(), along: None, radius, hollow: true }, "bore")
    }

    /// A profile of lines and arcs.
    pub fn profile(profile: Profile) -> Self {
        RigidSurface::named_shape(profile, "profile")
    }
}

impl RigidSurface<3> {
    /// A rigid sphere.
    pub fn sphere(centre: [f64; 3], radius: f64) -> Self {
        RigidSurface::named_shape(Round { centre: centre.into(), along: None, radius, hollow: false }, "sphere")
    }

    /// An endless rigid cylinder about the line through a point.
    pub fn cylinder(through: [f64; 3], along: [f64; 3], radius: f64) -> Self {
        let shape = Round { centre: through.into(), along: Some(along.into()), radius, hollow: false };
        RigidSurface::named_shape(shape, "cylinder")
    }

    /// An endless cylindrical bore about the line through a point: the body lies within.
    pub fn sleeve(through: [f64; 3], along: [f64; 3], radius: f64) -> Self {
        let shape = Round { centre: through.into(), along: Some(along.into()), radius, hollow: true };
        RigidSurface::named_shape(shape, "sleeve")
    }

    /// A closed surface as a rigid body: that of an STL file, for example.
    pub fn solid(solid: &Solid3) -> Self {
        let shape = Triangulated::new(solid.vertices().to_vec(), solid.facets().to_vec());
        RigidSurface::named_shape(shape, "solid")
    }

    /// An endless rigid cone from its tip along its axis.
    pub fn cone(tip: [f64; 3], along: [f64; 3], half_angle: f64) -> Self {
        RigidSurface::named_shape(Cone { tip: tip.into(), along: along.into(), half_angle }, "cone")
    }
}

impl RigidSurface<2> {
    /// Turns about a point, which moves with the surface, by an angle \[rad\], counter-clockwise, while the load factor goes from 0 to 1.
    pub fn turning(mut self, about: [f64; 2], angle: f64) -> Self {
        self.0.turn(vector(&about), Vec3::z(), angle, false);
        self
    }

    /// Is free to turn about a point, which moves with the surface, under a moment that grows with the load factor \[force·length per
    /// unit thickness\]; without one it tilts until its moment vanishes.
    pub fn driven(mut self, about: [f64; 2], moment: f64) -> Self {
        self.0.turn(vector(&about), Vec3::z(), moment, true);
        self
    }
}

impl RigidSurface<3> {
    /// Turns about an axis through a point, which moves with the surface, by an angle \[rad\] while the load factor goes from 0 to 1.
    pub fn turning(mut self, about: [f64; 3], axis: [f64; 3], angle: f64) -> Self {
        self.0.turn(about.into(), axis.into(), angle, false);
        self
    }

    /// Is free to turn about an axis through a point, which moves with the surface, under a moment that grows with the load factor
    /// \[force·length\]; without one it tilts until its moment vanishes.
    pub fn driven(mut self, about: [f64; 3], axis: [f64; 3], moment: f64) -> Self {
        self.0.turn(about.into(), axis.into(), moment, true);
        self
    }
}
