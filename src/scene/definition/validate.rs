//! What of a scene no scheme could serve.

use crate::contact::ContactError;
use crate::each::Each;
use crate::error::{BoundaryError, Error, GeometryError, Incompatible, Invalid};
use crate::geometry::{Part, Point};
use crate::material::Material;
use crate::term::Amplitude;

use super::condition::{Condition, Direction};
use super::load::{Load, LoadKind};
use super::place::{Place, Spot};
use super::scene::Scene;
use super::source::BodyOf;
use super::value::Value;

impl<const D: usize> Scene<D> {
    /// Refuses conditions and loads that no scheme could serve.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        check_names(self)?;
        tell_apart(self)?;
        self.validate_bodies()?;
        if let Some(name) = self.absent.first() {
            return Err(BoundaryError::UnknownName { requested: name.clone(), known: known(self) }.into());
        }
        for condition in &self.conditions {
            let what = condition.name.clone().unwrap_or_else(|| condition.place.to_string());
            let what = format!("condition on {what}");
            amplitude(&condition.amplitude, &what)?;
            ensure!(!condition.prescribed.is_empty(), BoundaryError::Incomplete { what });
            for (direction, value) in &condition.prescribed {
                let component = if let Direction::Component(component) = *direction { component } else { 0 };
                let value = if let Value::Constant(value) = *value { value } else { 0.0 };
                prescribed(D, condition.label(direction), component, value)?;
            }
        }
        if let Some(Value::Motion(_)) = self.expansion {
            let remedy = "it acts in full from the first step on: give a number or Value::field; an expansion in steps is a run for each";
            return Err(Incompatible::new(
                "an expansion that changes with the load factor",
                "Scene::with_expansion",
                remedy,
            )
            .into());
        }
        self.loads.iter().try_for_each(check_load)?;
        parts_of_rigid_bodies(self)?;
        parts_of_points(self)?;
        sizes(self)?;
        contacts(self)?;
        crate::kinematics::hoop_components(&*self.kinematics)?;
        Ok(())
    }
}

/// The components of a load, where it is the same everywhere.
fn constant<const D: usize>(load: &Load<D>) -> &[f64] {
    match &load.kind {
        LoadKind::Dead(Value::Constant(force)) | LoadKind::Total(force) => force,
        LoadKind::Moment(moment) => moment,
        LoadKind::Pressure(Value::Constant(pressure)) => std::slice::from_ref(pressure),
        LoadKind::Dead(_) | LoadKind::Pressure(_) | LoadKind::Integrand(_) => &[],
    }
}

/// Refuses components that there are not and values that are no numbers.
fn prescribed(dim: usize, what: String, component: usize, value: f64) -> Result<(), BoundaryError> {
    if component >= dim {
        return Err(BoundaryError::Component { what, component, dimension: dim });
    }
    ensure!(value.is_finite(), BoundaryError::Value { what, value, load: 1.0 });
    Ok(())
}

fn check_load<const D: usize>(load: &Load<D>) -> Result<(), Error> {
    let label = load.label();
    load.amplitude.validate(|| label.clone())?;
    followed(load)?;
    ensure!(
        !matches!(load.kind, LoadKind::Pressure(_)) || load.place.is_on_part(),
        GeometryError::Unsuited {
            what: "a pressure on a point or on the whole body",
            needed: "a part of the boundary, whose normal it has: put it there"
        }
    );
    is_finite(&load.amplitude, &label)?;
    match not_finite(constant(load)) {
        Some(value) => Err(BoundaryError::Value { what: label, value, load: 1.0 }.into()),
        None => Ok(()),
    }
}

/// Refuses what a load of its kind would leave out: an amplitude of springs, a moment out of the plane.
fn followed<const D: usize>(load: &Load<D>) -> Result<(), Incompatible> {
    match load.kind {
        LoadKind::Integrand(_) if load.amplitude != Amplitude::Ramp => {
            let remedy = "springs act in full from the start and an integrand sees the load factor itself: leave Load::amplitude out";
            Err(Incompatible::new("an amplitude", format!("the {}", load.label()), remedy))
        }
        LoadKind::Moment([x, y, _]) if D < 3 && [x, y] != [0.0; 2] => {
            let remedy = "in the plane only the third component acts: give [0.0, 0.0, moment]";
            let what = format!("the {} with components {x} and {y}", load.label());
            Err(Incompatible::new(what, "a planar body", remedy))
        }
        _ => Ok(()),
    }
}

/// The names of conditions, loads and contacts.
fn known<const D: usize>(scene: &Scene<D>) -> String {
    let mut all: Vec<&str> = scene.conditions.iter().filter_map(|condition| condition.name.as_deref()).collect();
    all.extend(scene.loads.iter().filter_map(|load| load.name.as_deref()));
    all.append(&mut contact_names(scene));
    all.join("; ")
}

/// The names of contacts, of rigid surfaces first.
fn contact_names<const D: usize>(scene: &Scene<D>) -> Vec<&str> {
    let mut all = scene.contacts.mapped(|contact| &*contact.surface.name);
    all.extend(scene.contact_pairs.iter().map(|pair| &*pair.name));
    all
}

/// Refuses empty names: those that a scene gives, then those of the parts that it asks for.
fn check_names<const D: usize>(scene: &Scene<D>) -> Result<(), BoundaryError> {
    let check = |what, name: Option<&str>| {
        ensure!(name.is_none_or(|name| !name.trim().is_empty()), BoundaryError::Nameless { what });
        Ok(())
    };
    for body in &scene.bodies {
        check("a body", Some(&body.name))?;
    }
    for condition in &scene.conditions {
        check("a condition", condition.name.as_deref())?;
    }
    for load in &scene.loads {
        check("a load", load.name.as_deref())?;
    }
    let mut places = scene.acting();
    for contact in &scene.contacts {
        check("a rigid surface", Some(&contact.surface.name))?;
        places.push(&contact.place);
    }
    for pair in &scene.contact_pairs {
        check("a contact", Some(&pair.name))?;
        places.push(&pair.first);
        places.extend(&pair.second);
    }
    for (what, named) in [("a place", &scene.names), ("a rigid body", &scene.rigids)] {
        for (name, place) in named {
            check(what, Some(name))?;
            places.push(place);
        }
    }
    for place in places {
        if let Spot::Part(Part::Named(name)) = &place.spot {
            check("the place of a condition, a load or a contact", Some(name))?;
        }
    }
    Ok(())
}

/// Refuses the name of a part for a condition elsewhere, where another condition is on that part, and that of a rigid body: results are
/// asked for by either.
fn tell_apart<const D: usize>(scene: &Scene<D>) -> Result<(), BoundaryError> {
    let rigid = scene.rigid_names();
    for condition in &scene.conditions {
        let Some(name) = &condition.name else { continue };
        let (there, place) = (scene.resolve(&condition.place), || condition.place.to_string());
        if rigid.contains(&name.as_str()) {
            let body = scene.rigid_at(&there).map(|(number, _)| rigid[number]);
            ensure!(body == Some(name.as_str()), BoundaryError::NameOfBody { name: name.clone(), place: place() });
            continue;
        }
        let part = scene.resolve(&Place::from(name.as_str()));
        let hidden =
            |other: &Condition<D>| other.name.as_ref() != Some(name) && part.takes_in(&scene.resolve(&other.place));
        ensure!(
            part.takes_in(&there) || !scene.conditions.iter().any(hidden),
            BoundaryError::NameOfPart { name: name.clone(), place: place() }
        );
    }
    Ok(())
}

/// Bulk over shear modulus beyond which changes of volume are lost in rounding: $10^{-16}k$ is a stress.
const STIFFEST: f64 = 1e12;
/// Loads over the stiffest modulus of a scene beyond which nothing elastic could carry them.
const LARGEST_LOAD: f64 = 1e3;

/// Refuses laws and loads whose sizes can't be meant.
fn sizes<const D: usize>(scene: &Scene<D>) -> Result<(), Error> {
    let mut stiffest: f64 = 0.0;
    for BodyOf { name, material, .. } in &scene.bodies {
        material.validate()?;
        let (shear, bulk) = (material.initial_moduli().shear, material.initial_moduli().bulk);
        stiffest = stiffest.max(shear).max(bulk);
        ensure!(
            shear > 0.0,
            Invalid::new(
                format!("initial shear modulus of the material of body {name}"),
                shear,
                "give constants whose sum resists shear: a modulus above zero"
            )
        );
        ensure!(
            !(bulk / shear > STIFFEST),
            Invalid::new(
                format!("bulk over shear modulus of body {name}"),
                bulk / shear,
                "at most 1e12, where changes of volume begin to be lost in rounding; 1e5 is incompressible to all purposes"
            )
        );
    }
    let distributed = |load: &&Load<D>| matches!(load.kind, LoadKind::Dead(_) | LoadKind::Pressure(_));
    for load in scene.loads.iter().filter(distributed).filter(|load| load.place.is_on_part()) {
        let size = match constant(load) {
            [one] => one.abs(),
            all => all.summed(|t| t * t).sqrt(),
        };
        ensure!(
            !(size > LARGEST_LOAD * stiffest),
            Invalid::new(
                format!("{} over the stiffest modulus", load.label()),
                size / stiffest,
                "nothing elastic carries more than a thousand times its stiffest modulus: check the units"
            )
        );
    }
    Ok(())
}

/// Refuses conditions and loads on some of a rigid body, which moves as a whole.
fn parts_of_rigid_bodies<const D: usize>(scene: &Scene<D>) -> Result<(), Incompatible> {
    for place in scene.acting() {
        ensure!(
            place.within.is_empty() || scene.rigid_at(place).is_none(),
            Incompatible::new(
                format!("{place}"),
                "a rigid body",
                "leave Place::within out: a rigid body moves as a whole"
            )
        );
    }
    Ok(())
}

/// Refuses some of a point.
fn parts_of_points<const D: usize>(scene: &Scene<D>) -> Result<(), Incompatible> {
    let mut places = scene.acting();
    places.extend(scene.rigids.iter().map(|(_, place)| place));
    for place in places {
        let resolved = scene.resolve(place);
        ensure!(
            resolved.within.is_empty() || !matches!(resolved.spot, Spot::Point(_)),
            Incompatible::new(
                format!("{place}"),
                "a single point",
                "leave Place::within out: a point is the whole place"
            )
        );
    }
    Ok(())
}

/// Load factors at which what varies is looked at before a run.
const LOOKED_AT: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// Refuses a load that is no number at one of its points.
pub(in crate::scene) fn is_finite_over<const D: usize>(
    load: &Load<D>,
    points: &[Point<D>],
) -> Result<(), BoundaryError> {
    for x in points {
        for at in LOOKED_AT {
            let factor = load.amplitude.value(at);
            let wrong = match &load.kind {
                LoadKind::Dead(force) => not_finite(&force.at(x, factor)),
                LoadKind::Pressure(pressure) => not_finite(&[pressure.at(x, factor)]),
                _ => None,
            };
            if let Some(value) = wrong {
                let what = format!("{} at X = {:?}", load.label(), x.as_slice());
                return Err(BoundaryError::Value { what, value, load: at });
            }
        }
    }
    Ok(())
}

fn not_finite(values: &[f64]) -> Option<f64> {
    values.iter().copied().find(|value| !value.is_finite())
}

/// Refuses amplitudes that are none.
fn amplitude(amplitude: &Amplitude, label: &str) -> Result<(), BoundaryError> {
    amplitude.validate(|| label.to_string())?;
    is_finite(amplitude, label)
}

/// Refuses an amplitude that is no number at load factors of a run.
fn is_finite(amplitude: &Amplitude, label: &str) -> Result<(), BoundaryError> {
    for load in LOOKED_AT {
        let value = amplitude.value(load);
        ensure!(value.is_finite(), BoundaryError::Value { what: format!("amplitude of {label}"), value, load });
    }
    Ok(())
}

/// Refuses contacts that no scheme could serve.
fn contacts<const D: usize>(scene: &Scene<D>) -> Result<(), Error> {
    for contact in &scene.contacts {
        contact.surface.validate(&contact.label())?;
        ensure!(
            contact.surface.turning.is_none() || scene.kinematics.hoop_components().is_empty(),
            Incompatible::new(
                "a rigid surface that turns",
                "an axisymmetric body",
                "take a body in the plane or in 3D, or a surface that moves along the axis"
            )
        );
    }
    for pair in &scene.contact_pairs {
        pair.validate()?;
    }
    match repeated(&contact_names(scene)) {
        Some(name) => Err(ContactError::Twice { name: name.to_string() }.into()),
        None => Ok(()),
    }
}

/// The first name that stands among those before it.
fn repeated<'a>(names: &[&'a str]) -> Option<&'a str> {
    names.iter().enumerate().find(|(k, name)| names[..*k].contains(name)).map(|(_, name)| *name)
}
