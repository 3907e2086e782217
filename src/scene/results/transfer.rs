//! States carried from one discretisation of a scene to another.

use crate::compiled::compiled;
use crate::each::add;
use crate::error::{ApproximationError, Error};
use crate::geometry::{Point, cut};
use crate::linear::vector::{dot, norm};
use crate::neighbours::BoxTree;
use crate::scene::Problem;
use crate::shape::ShapeFunctions;
use crate::solve::State;
use crate::term::TermState;

use super::view::BodyView;

/// Sweeps at most that make coefficients of values at particles.
const SWEEPS: usize = 50;
/// Part of the values that may be missing then: far below what models are apart.
const MISSING: f64 = 1e-7;

/// The coefficients $d$ whose values $\sum_I \Psi_I(x_J)\\,d_I$ at the particles are those wanted, `dim` numbers each.
pub(crate) fn coefficients(dim: usize, functions: &[ShapeFunctions<3>], wanted: Vec<f64>) -> Vec<f64> {
    let mut found = wanted.clone();
    let size = norm(&wanted);
    for _ in 0..SWEEPS {
        let missing: Vec<f64> = wanted.iter().zip(values(dim, functions, &found)).map(|(a, b)| a - b).collect();
        if !(norm(&missing) > MISSING * size) {
            break;
        }
        // Steps that leave least: where spacings jump, full ones lead away.
        let answer = values(dim, functions, &missing);
        let step = dot(&missing, &answer) / dot(&answer, &answer);
        add(&mut found, step, &missing);
    }
    found
}

/// Values of a field by its coefficients, `dim` numbers each.
pub(crate) fn values(dim: usize, functions: &[ShapeFunctions<3>], field: &[f64]) -> Vec<f64> {
    let mut values = vec![0.0; dim * functions.len()];
    for (value, psi) in values.chunks_exact_mut(dim).zip(functions) {
        for (&node, psi) in psi.nodes.iter().zip(&psi.values) {
            let given = &field[node as usize * dim..];
            add(value, *psi, given);
        }
    }
    values
}

impl<const D: usize> Problem<D> {
    /// The state of another discretisation of the same scene as a first guess for this one, to be
    /// [`correct`](crate::solve::Analysis::correct)ed: displacements that agree at the particles, pressures
    /// and internal variables of bodies taken from the nearest integration point. Those of contacts and of terms of one's own are taken
    /// over where the terms of the same places in both models have as many, and begin at rest elsewhere.
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
            // Bodies of scenes that differ are matched by the place alone.
            let other =
                from.discrete_bodies.iter().find(|other| other.name == discrete_body.name).unwrap_or(from.first());
            let found = carried(discrete_body, other, state)?;
            let first = discrete_body.nodes.start * D;
            guess.displacement[first..first + found.len()].copy_from_slice(&found);
            let place = from.discrete_bodies.iter().position(|m| m.name == other.name).unwrap_or(0);
            let pressures = from.model.view(state, place).and_then(|view| other.body.pressures(view));
            if let Some(pressures) = pressures {
                let nearest = BoxTree::of(other.body.table().positions());
                let condensed = discrete_body.body.condensed_of(|x| {
                    // A rank may have no point of the other one.
                    nearest.nearest(x).and_then(|point| pressures.get(point)).copied().unwrap_or(0.0)
                });
                if let Some(own) = guess.terms.get_mut(number).filter(|own| own.condensed.len() == condensed.len()) {
                    own.condensed = condensed;
                }
            }
            if let (false, Some(given)) = (other.body.table().point_count() == 0, state.terms.get(place)) {
                let nearest = BoxTree::of(other.body.table().positions());
                let nearest = |x: &Point<D>| nearest.nearest(x).unwrap_or(0);
                let history = discrete_body.body.memory_from(&other.body, &given.history, nearest);
                if let (Some(history), Some(own)) = (history, guess.terms.get_mut(number)) {
                    own.history = history;
                    guess.time = state.time;
                }
            }
        }
        self.transfer_others(from, state, &mut guess);
        self.transfer_frames(from, state, &mut guess);
        Ok(guess)
    }

    /// Takes over the condensed unknowns and internal variables of the terms that are no bodies, where those of the same places in both
    /// models have as many.
    fn transfer_others(&self, from: &Problem<D>, state: &State, guess: &mut State) {
        let bodies = self.discrete_bodies.len();
        if from.discrete_bodies.len() != bodies {
            return;
        }
        let terms = self.model.terms().iter().zip(from.model.terms());
        let values = guess.terms.iter_mut().zip(&state.terms);
        for ((own, given), (term, other)) in values.zip(terms).skip(bodies) {
            let sizes = |own: &TermState| (own.condensed.len(), own.history.len());
            if sizes(own) == sizes(given) && term.clusters() == other.clusters() {
                own.clone_from(given);
            }
        }
    }
}

/// The coefficients of a body whose displacements at its particles are those of another one.
fn carried(body: &dyn BodyView, other: &dyn BodyView, state: &State) -> Result<Vec<f64>, Error> {
    let (dim, mut positions) = (body.dim(), Vec::with_capacity(body.nodes().len()));
    for particle in 0..body.nodes().len() {
        let x = body.particle(particle);
        ensure!(other.holds(&x, false), ApproximationError::Outside { at: cut(&x, dim) });
        positions.push(x);
    }
    let mut wanted = Vec::with_capacity(dim * positions.len());
    for psi in other.values_at(&positions)? {
        wanted.extend_from_slice(&other.weighted(&psi, state).as_slice()[..dim]);
    }
    Ok(coefficients(dim, &body.values_at(&positions)?, wanted))
}
