//! What of a scene no scheme could serve.

use crate::contact::ContactError;
use crate::error::{BoundaryError, Error, GeometryError, Incompatible, Invalid};
use crate::geometry::{Part, Point};
use crate::material::Material;
use crate::term::Amplitude;

use super::condition::Direction;
use super::load::{Load, LoadKind};
use super::place::Spot;
use super::scene::Scene;
use super::value::Value;

impl<const D: usize> Scene<D> {
    /// Refuses conditions and loads that no scheme could serve.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        names(self)?;
        self.validate_bodies()?;
        if let Some(name) = self.absent.first() {
            return Err(BoundaryError::UnknownCondition { requested: name.clone(), known: known(self) }.into());
        }
        for condition in &self.conditions {
            let what = condition.name.clone().unwrap_or_else(|| condition.place.to_string());
            condition.amplitude.validate(|| format!("condition on {what}"))?;
            is_finite(&condition.amplitude, || format!("condition on {what}"))?;
            if condition.prescribed.is_empty() {
                return Err(BoundaryError::Incomplete { what: format!("condition on {what}") }.into());
            }
            for (direction, value) in &condition.prescribed {
                let what = condition.label(direction);
                if let Direction::Component(component) = *direction
                    && component >= D
                {
                    return Err(BoundaryError::Component { what, component, dimension: D }.into());
                }
                if let Value::Constant(value) = *value
                    && !value.is_finite()
                {
                    return Err(BoundaryError::Value { what, value, load: 1.0 }.into());
                }
            }
        }
        for load in &self.loads {
            load.amplitude.validate(|| load.label())?;
            followed(load)?;
            if let (LoadKind::Pressure(_), Spot::Body | Spot::Point(_)) = (&load.kind, &load.place.spot) {
                let needed = "a part of the boundary, whose normal it has: put it there";
                return Err(
                    GeometryError::Unsuited { what: "a pressure on a point or on the whole body", needed }.into()
                );
            }
            is_finite(&load.amplitude, || load.label())?;
            let value = match &load.kind {
                LoadKind::Dead(Value::Constant(force)) | LoadKind::Total(force) => {
                    force.iter().copied().find(|v| !v.is_finite())
                }
                LoadKind::Moment(moment) => moment.iter().copied().find(|v| !v.is_finite()),
                LoadKind::Pressure(Value::Constant(pressure)) => Some(*pressure).filter(|p| !p.is_finite()),
                _ => None,
            };
            if let Some(value) = value {
                return Err(BoundaryError::Value { what: load.label(), value, load: 1.0 }.into());
            }
        }
        parts_of_rigid_bodies(self)?;
        sizes(self)?;
        contacts(self)?;
        crate::kinematics::hoop_components(&*self.kinematics)?;
        Ok(())
    }
}

/// Refuses what a load of this kind would leave out: an amplitude of springs, a moment out of the plane.
fn followed<const D: usize>(load: &Load<D>) -> Result<(), Incompatible> {
    match load.kind {
        LoadKind::Integrand(_) if load.amplitude != Amplitude::Ramp => {
            let remedy = "springs act in full from the start and an integrand sees the load factor itself: leave Load::amplitude out";
            Err(Incompatible::new("an amplitude", format!("the {}", load.label()), remedy))
        }
        LoadKind::Moment([x, y, _]) if D < 3 && [x, y] != [0.0; 2] => {
            let remedy = "in the plane only the third component acts: give [0.0, 0.0, moment]";
            Err(Incompatible::new(format!("the {} with components {x} and {y}", load.label()), "a planar body", remedy))
        }
        _ => Ok(()),
    }
}

/// The names of conditions, loads and contacts.
fn known<const D: usize>(scene: &Scene<D>) -> String {
    let conditions = scene.conditions.iter().filter_map(|condition| condition.name.clone());
    let loads = scene.loads.iter().filter_map(|load| load.name.clone());
    let contacts = scene.contacts.iter().map(|contact| contact.surface.name.clone());
    let all = conditions.chain(loads).chain(contacts).chain(scene.contact_pairs.iter().map(|pair| pair.name.clone()));
    all.collect::<Vec<_>>().join("; ")
}

/// Refuses empty names.
fn names<const D: usize>(scene: &Scene<D>) -> Result<(), BoundaryError> {
    let conditions = scene.conditions.iter();
    let places = conditions.clone().map(|c| &c.place).chain(scene.loads.iter().map(|l| &l.place));
    let places = places.chain(scene.contacts.iter().map(|c| &c.place)).chain(scene.rigids.iter().map(|r| &r.1));
    let places = places.chain(scene.contact_pairs.iter().flat_map(|m| std::iter::once(&m.first).chain(&m.second)));
    let parts = places.chain(scene.names.iter().map(|n| &n.1)).filter_map(|place| match &place.spot {
        Spot::Part(Part::Named(name)) => Some(("the place of a condition, a load or a contact", name)),
        _ => None,
    });
    let all = (scene.bodies.iter().map(|body| ("a body", &body.name)))
        .chain(conditions.filter_map(|c| c.name.as_ref().map(|name| ("a condition", name))))
        .chain(scene.loads.iter().filter_map(|l| l.name.as_ref().map(|name| ("a load", name))))
        .chain(scene.contacts.iter().map(|c| ("a rigid surface", &c.surface.name)))
        .chain(scene.contact_pairs.iter().map(|m| ("a contact", &m.name)))
        .chain(scene.names.iter().map(|(name, _)| ("a place", name)))
        .chain(scene.rigids.iter().map(|(name, _)| ("a rigid body", name)));
    match all.chain(parts).find(|(_, name)| name.trim().is_empty()) {
        Some((what, _)) => Err(BoundaryError::Nameless { what }),
        None => Ok(()),
    }
}

/// Bulk over shear modulus beyond which changes of volume are lost in rounding: $10^{-16}k$ is a stress.
const STIFFEST: f64 = 1e12;
/// Loads over the stiffest modulus of a scene beyond which nothing elastic could carry them.
const LARGEST_LOAD: f64 = 1e3;

/// Refuses laws and loads whose sizes can't be meant.
fn sizes<const D: usize>(scene: &Scene<D>) -> Result<(), Error> {
    let mut stiffest: f64 = 0.0;
    for body in &scene.bodies {
        body.material.validate()?;
        let (shear, bulk) = (body.material.initial_moduli().shear, body.material.initial_moduli().bulk);
        stiffest = stiffest.max(shear).max(bulk);
        if !(shear > 0.0) {
            let what = format!("initial shear modulus of the material of body {}", body.name);
            let needed = "give constants whose sum resists shear: a modulus above zero";
            return Err(Invalid::new(what, shear, needed).into());
        }
        if bulk / shear > STIFFEST {
            let needed = "at most 1e12, where changes of volume begin to be lost in rounding; 1e5 is incompressible to all purposes";
            let what = format!("bulk over shear modulus of body {}", body.name);
            return Err(Invalid::new(what, bulk / shear, needed).into());
        }
    }
    for load in scene.loads.iter().filter(|load| matches!(load.place.spot, Spot::Part(_))) {
        let size = match &load.kind {
            LoadKind::Dead(Value::Constant(traction)) => traction.iter().map(|t| t * t).sum::<f64>().sqrt(),
            LoadKind::Pressure(Value::Constant(pressure)) => pressure.abs(),
            _ => continue,
        };
        if size > LARGEST_LOAD * stiffest {
            let needed = "nothing elastic carries more than a thousand times its stiffest modulus: check the units";
            return Err(
                Invalid::new(format!("{} over the stiffest modulus", load.label()), size / stiffest, needed).into()
            );
        }
    }
    Ok(())
}

/// Refuses conditions and loads on some of a rigid body, which moves as a whole.
fn parts_of_rigid_bodies<const D: usize>(scene: &Scene<D>) -> Result<(), Incompatible> {
    let places =
        scene.conditions.iter().map(|condition| &condition.place).chain(scene.loads.iter().map(|load| &load.place));
    match places.into_iter().find(|place| place.within.is_some() && scene.rigid_at(place).is_some()) {
        Some(place) => {
            let remedy = "leave Place::within out: a rigid body moves as a whole";
            Err(Incompatible::new(format!("{place}"), "a rigid body", remedy))
        }
        None => Ok(()),
    }
}

/// Load factors at which what varies is looked at before a run.
const LOOKED_AT: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// Refuses a load that is no number at one of its points.
pub(in crate::scene) fn is_finite_over<const D: usize>(
    load: &Load<D>,
    points: &[Point<D>],
) -> Result<(), BoundaryError> {
    let wrong = |x: &Point<D>, factor: f64| {
        let all = match &load.kind {
            LoadKind::Dead(force) => force.at(x, factor).to_vec(),
            LoadKind::Pressure(pressure) => vec![pressure.at(x, factor)],
            _ => Vec::new(),
        };
        all.into_iter().find(|value| !value.is_finite())
    };
    for x in points {
        for at in LOOKED_AT {
            if let Some(value) = wrong(x, load.amplitude.value(at)) {
                let what = format!("{} at X = {:?}", load.label(), x.as_slice());
                return Err(BoundaryError::Value { what, value, load: at });
            }
        }
    }
    Ok(())
}

/// Refuses an amplitude that is no number at load factors of a run.
fn is_finite(amplitude: &Amplitude, label: impl Fn() -> String) -> Result<(), BoundaryError> {
    let values = LOOKED_AT.map(|load| (load, amplitude.evaluate(load).0));
    match values.into_iter().find(|(_, value)| !value.is_finite()) {
        Some((load, value)) => Err(BoundaryError::Value { what: format!("amplitude of {}", label()), value, load }),
        None => Ok(()),
    }
}

/// Refuses contacts that no scheme could serve.
fn contacts<const D: usize>(scene: &Scene<D>) -> Result<(), Error> {
    for contact in &scene.contacts {
        contact.surface.validate(&contact.label())?;
        if contact.surface.turning.is_some() && !scene.kinematics.hoop_components().is_empty() {
            let remedy = "take a body in the plane or in 3D, or a surface that moves along the axis";
            return Err(Incompatible::new("a rigid surface that turns", "an axisymmetric body", remedy).into());
        }
    }
    scene.contact_pairs.iter().try_for_each(|pair| pair.validate())?;
    let rigid = scene.contacts.iter().map(|contact| &contact.surface.name);
    let names: Vec<&String> = rigid.chain(scene.contact_pairs.iter().map(|contact_pair| &contact_pair.name)).collect();
    match names.iter().enumerate().find(|(k, name)| names[..*k].contains(name)) {
        Some((_, name)) => Err(ContactError::Twice { name: name.to_string() }.into()),
        None => Ok(()),
    }
}
