//! Motions that are restrained although nothing holds them.

use crate::error::{Doubt, DoubtCause};
use crate::solve::State;

use crate::scene::Problem;

/// The largest moment as a part of the contact forces times the radius: the arm by which an answer may shift a force that it has within
/// five per cent.
const LIMIT: f64 = 0.05;

/// Doubts about round bodies whose spring against rolling takes a moment: their motion is not neutral.
pub(super) fn strained<const D: usize>(problem: &Problem<D>, state: &State) -> Vec<Doubt> {
    if problem.rolling.is_empty() {
        return Vec::new();
    }
    let Ok(motions) = problem.neutral_motions(state) else { return Vec::new() };
    let contacts = problem.contacts.iter().filter_map(|contact| problem.contact(state, &contact.name).ok());
    let forces: f64 = contacts.flat_map(|contact| contact.points).map(|point| point.force.norm()).sum();
    let each = problem.rolling.iter().zip(motions).filter_map(|(rolling, motion)| {
        let scale = forces * rolling.radius;
        let cause = DoubtCause::Restrained { body: motion.body, moment: motion.moment, scale };
        (motion.moment.abs() > LIMIT * scale).then_some(Doubt { cause, load: state.load, at: Vec::new() })
    });
    each.collect()
}
