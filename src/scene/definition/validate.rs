//! What of a scene no scheme could serve.

use crate::contact::ContactError;
use crate::error::{BoundaryError, Error};
use crate::term::Amplitude;

use super::condition::Direction;
use super::load::LoadKind;
use super::scene::Scene;
use super::value::Value;

impl<const D: usize> Scene<D> {
    /// Refuses conditions and loads that no scheme could serve.
    pub(crate) fn validate(&self) -> Result<(), Error> {
        self.validate_bodies()?;
        for condition in &self.conditions {
            let what = condition.name.clone().unwrap_or_else(|| condition.place.to_string());
            condition.amplitude.validate()?;
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
            load.amplitude.validate()?;
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
        contacts(self)?;
        crate::kinematics::hoop_components(&*self.kinematics)?;
        Ok(())
    }
}

/// Refuses an amplitude that is no number at load factors of a run.
fn is_finite(amplitude: &Amplitude, label: impl Fn() -> String) -> Result<(), BoundaryError> {
    let values = [0.0, 0.25, 0.5, 0.75, 1.0].map(|load| (load, amplitude.evaluate(load).0));
    match values.into_iter().find(|(_, value)| !value.is_finite()) {
        Some((load, value)) => Err(BoundaryError::Value { what: format!("amplitude of {}", label()), value, load }),
        None => Ok(()),
    }
}

/// Refuses contacts that no scheme could serve.
fn contacts<const D: usize>(scene: &Scene<D>) -> Result<(), Error> {
    for contact in &scene.contacts {
        contact.surface.validate(&contact.label())?;
    }
    let rigid = scene.contacts.iter().map(|contact| &contact.surface.name);
    let names: Vec<&String> = rigid.chain(scene.contact_pairs.iter().map(|contact_pair| &contact_pair.name)).collect();
    match names.iter().enumerate().find(|(k, name)| names[..*k].contains(name)) {
        Some((_, name)) => Err(ContactError::Twice { name: name.to_string() }.into()),
        None => Ok(()),
    }
}
