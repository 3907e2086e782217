//! A path from the journals of another number of ranks.

use std::collections::HashMap;

use rkpm::scene::{LocalOwnership, TermOwnership};
use rkpm::solve::{EquilibriumPath, State, Step};
use rkpm::term::TermState;

use crate::error::PetscError;

/// What one rank has recorded.
pub(crate) struct Piece {
    /// The name of its journal.
    pub name: String,
    pub ownership: LocalOwnership,
    pub path: EquilibriumPath,
}

/// Where a run of numbers stands: piece, first number, how many.
type Source = (usize, usize, usize);

/// Refuses a set of journals.
fn refused<T>(what: String) -> Result<T, PetscError> {
    Err(PetscError::Pieces { what })
}

/// The path of all pieces as a rank holds it, up to the last step that all have recorded.
///
/// # Errors
/// [`PetscError::Pieces`] where the pieces are not of one run, hold a zone twice, or lack one.
pub(crate) fn composed(pieces: &[Piece], own: &LocalOwnership) -> Result<EquilibriumPath, PetscError> {
    let Some(first) = pieces.first() else { return refused("there are none".into()) };
    let steps = pieces.iter().map(|piece| piece.path.steps.len()).min().unwrap_or(0);
    let whole = states(first, steps);
    for piece in pieces {
        let others = states(piece, steps);
        let differs = |(a, b): &(&&State, &&State)| {
            !same_bits(&a.displacement, &b.displacement)
                || !same_bits(&a.multipliers, &b.multipliers)
                || !same_bits(&[a.load, a.time], &[b.load, b.time])
        };
        let other = whole.iter().zip(&others).find(differs).map(|(a, _)| a.load);
        if let Some(load) = other.or_else(|| (others.len() != whole.len()).then_some(first.path.start.load)) {
            return refused(format!("{} and {} are of different runs from load {load} on", piece.name, first.name));
        }
        check_lengths(piece, &others)?;
    }
    let sources = sources(pieces, own)?;
    let all: Vec<Vec<&State>> = pieces.iter().map(|piece| states(piece, steps)).collect();
    let mut composed = (0..whole.len()).map(|number| {
        let terms = sources.iter().enumerate().map(|(term, [condensed, history])| {
            let own = |piece: usize| &all[piece][number].terms[term];
            let condensed = condensed.iter().flat_map(|&(piece, at, count)| &own(piece).condensed[at..at + count]);
            let history = history.iter().flat_map(|&(piece, at, count)| &own(piece).history[at..at + count]);
            TermState { condensed: condensed.copied().collect(), history: history.copied().collect() }
        });
        State { terms: terms.collect(), ..whole[number].clone() }
    });
    let mut next = || composed.next().unwrap_or_default();
    let mut path = EquilibriumPath::from(next());
    for step in &first.path.steps[..steps] {
        let mut step = Step { state: next(), ..step.clone() };
        step.critical.iter_mut().for_each(|point| point.state = next());
        path.steps.push(step);
    }
    Ok(path)
}

/// The states of a path up to some step, in one order.
fn states(piece: &Piece, steps: usize) -> Vec<&State> {
    let mut states = vec![&piece.path.start];
    for step in &piece.path.steps[..steps] {
        states.push(&step.state);
        states.extend(step.critical.iter().map(|point| &point.state));
    }
    states
}

fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Refuses a piece whose states are not as long as it says.
fn check_lengths(piece: &Piece, states: &[&State]) -> Result<(), PetscError> {
    let needed: Vec<[usize; 2]> = piece.ownership.terms.iter().map(TermOwnership::total).collect();
    let sizes = |own: &TermState| [own.condensed.len(), own.history.len()];
    match states.iter().all(|state| state.terms.iter().map(sizes).eq(needed.iter().copied())) {
        true => Ok(()),
        false => refused(format!("{} has other unknowns than its list of zones says", piece.name)),
    }
}

/// For each term of a rank, where its condensed unknowns and its internal variables stand.
fn sources(pieces: &[Piece], own: &LocalOwnership) -> Result<Vec<[Vec<Source>; 2]>, PetscError> {
    if let Some(piece) = pieces.iter().find(|piece| piece.ownership.terms.len() != own.terms.len()) {
        return refused(format!("{} is of another scene: it has other bodies or terms", piece.name));
    }
    (0..own.terms.len()).map(|term| sources_of(pieces, term, &own.terms[term])).collect()
}

fn sources_of(pieces: &[Piece], term: usize, own: &TermOwnership) -> Result<[Vec<Source>; 2], PetscError> {
    // Each cluster of all pieces: where its unknowns and its memory stand.
    let mut found: HashMap<u64, (Source, Source)> = HashMap::new();
    for (number, piece) in pieces.iter().enumerate() {
        let ownership = &piece.ownership.terms[term];
        let [mut unknown, mut variable] = ownership.common;
        for (&key, (&unknowns, &memory)) in
            ownership.keys.iter().zip(ownership.unknowns.iter().zip(&ownership.internal_variables))
        {
            let places = ((number, unknown, unknowns), (number, variable, memory));
            if found.insert(key, places).is_some() {
                return refused(format!("{} holds a zone of body {term} that another piece holds too", piece.name));
            }
            (unknown, variable) = (unknown + unknowns, variable + memory);
        }
    }
    let common = pieces.iter().position(|piece| piece.ownership.terms[term].common == own.common);
    let Some(common) = common else {
        return refused(format!("term {term} of the model has other numbers of unknowns here"));
    };
    let [mut unknowns, mut memory] = own.common.map(|count| vec![(common, 0, count)]);
    for (key, lengths) in own.keys.iter().zip(own.unknowns.iter().zip(&own.internal_variables)) {
        let Some(&(unknown, variable)) = found.get(key) else {
            return refused(format!(
                "a zone of body {term} is in none of them: another scene or scheme, or a piece is missing"
            ));
        };
        if (unknown.2, variable.2) != (*lengths.0, *lengths.1) {
            return refused(format!(
                "a zone of body {term} has {} unknowns and {} internal variables where the material here has {} and {}",
                unknown.2, variable.2, lengths.0, lengths.1
            ));
        }
        unknowns.push(unknown);
        memory.push(variable);
    }
    Ok([unknowns, memory])
}
