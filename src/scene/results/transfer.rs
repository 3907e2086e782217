//! States carried from one discretisation of a scene to another.

use crate::compiled::compiled;
use crate::error::{ApproximationError, Error};
use crate::neighbours::BoxTree;
use crate::solve::State;

use crate::term::variables_range;

use crate::scene::Problem;

impl<const D: usize> Problem<D> {
    /// The state of another discretisation of the same scene as a first guess for this one, to be
    /// [`correct`](crate::solve::Analysis::correct)ed: displacements evaluated at the particles, pressures
    /// and internal variables taken from the nearest integration point.
    ///
    /// # Errors
    /// Where a particle of this problem lies outside the other body.
    pub fn transfer(&self, from: &Problem<D>, state: &State) -> Result<State, Error> {
        compiled!(D: (problem: &Problem<D> = self, from: &Problem<D> = from; state: &State = state) -> Result<State, Error> {
            problem.guess(from, state)
        })
    }

    fn guess(&self, from: &Problem<D>, state: &State) -> Result<State, Error> {
        let mut guess = State::at_rest(&self.model, &self.equations);
        guess.load = state.load;
        from.check_length(state)?;
        for (number, discrete_body) in self.discrete_bodies.iter().enumerate() {
            let positions = discrete_body.cells.positions();
            // Bodies of scenes that differ are matched by the place alone.
            let other =
                from.discrete_bodies.iter().find(|other| other.name == discrete_body.name).unwrap_or(from.first());
            if let Some(x) = positions.iter().find(|x| !other.cells.contains(x)) {
                return Err(ApproximationError::Outside { at: x.as_slice().to_vec() }.into());
            }
            for (node, u) in discrete_body.nodes.clone().zip(other.displacements_at(positions, state)?) {
                guess.displacement[node * D..(node + 1) * D].copy_from_slice(u.as_slice());
            }
            let place = from.discrete_bodies.iter().position(|m| m.name == other.name).unwrap_or(0);
            if let Some(pressures) = other.pressures(place, state) {
                let nearest = BoxTree::of(other.body.table().positions());
                let condensed = discrete_body.body.condensed_of(|x| pressures[nearest.nearest(x).unwrap_or(0)]);
                if let Some(own) = guess.condensed.get_mut(number).filter(|own| own.len() >= condensed.len()) {
                    own[..condensed.len()].copy_from_slice(&condensed);
                }
            }
            let range = variables_range(&*discrete_body.body);
            if let (false, Some(given)) = (range.is_empty(), state.condensed.get(place)) {
                let nearest = BoxTree::of(other.body.table().positions());
                let internal_variables =
                    discrete_body.body.memory_from(&other.body, given, |x| nearest.nearest(x).unwrap_or(0));
                if let (Some(internal_variables), Some(condensed)) =
                    (internal_variables, guess.condensed.get_mut(number))
                {
                    condensed[range].copy_from_slice(&internal_variables);
                }
            }
        }
        self.transfer_frames(from, state, &mut guess);
        Ok(guess)
    }
}
