//! The scene in which a stage has ended, held as it is.

use std::sync::Arc;

use crate::scene::{AtFullLoad, LoadKind, Scene};
use crate::term::Amplitude;

/// A scene that a stage has made of one that was held. Made anew it begins where that one stands too: at its time, on its way.
pub(super) fn begun<const D: usize>(mut scene: Scene<D>, held: &Scene<D>) -> Scene<D> {
    if let (None, Some((time, _))) = (&scene.started, &held.started) {
        scene.clock = scene.clock.map(|clock| clock.later(*time)).or_else(|| held.clock.clone());
        scene.started.clone_from(&held.started);
        scene.released.extend(held.contact_pairs.iter().chain(&held.released).cloned());
    }
    scene
}

/// A scene whose conditions, loads and surfaces stay as they are at load factor 1, and whose clock stands at a time; with the displacements of
/// its particles.
pub(super) fn held<const D: usize>(mut scene: Scene<D>, time: f64, displacement: Vec<f64>) -> Scene<D> {
    let hold = |amplitude: &mut Amplitude| *amplitude = Amplitude::level(amplitude.value(1.0));
    scene.conditions.iter_mut().for_each(|condition| hold(&mut condition.amplitude));
    for load in &mut scene.loads {
        match &load.kind {
            LoadKind::Integrand(integrand) => load.kind = LoadKind::Integrand(Arc::new(AtFullLoad(integrand.clone()))),
            _ => hold(&mut load.amplitude),
        }
    }
    for contact in &mut scene.contacts {
        contact.surface.stay();
        contact.goes_on = true;
    }
    scene.contact_pairs.iter_mut().for_each(|pair| pair.goes_on = true);
    let surfaces = scene.contacts.iter_mut().filter_map(|contact| contact.surface.interference.as_mut());
    let pairs = scene.contact_pairs.iter_mut().filter_map(|pair| pair.interference.as_mut());
    surfaces.chain(pairs).for_each(|interference| interference.resolved = true);
    scene.started = Some((time, Arc::new(displacement)));
    scene.clock = scene.clock.map(|_| Amplitude::level(time));
    scene
}
