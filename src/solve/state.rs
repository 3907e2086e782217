//! The state of an analysis.

use crate::assembly::{Model, Origin, StateRef};
use crate::boundary::Constraints;
use crate::error::SolveError;
use crate::term::TermState;

/// Everything that an analysis iterates on; predicted, halved and kept as a whole.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct State {
    /// Coefficients $d$, node by node \[length\].
    pub displacement: Vec<f64>,
    /// Condensed unknowns (pressures) and internal variables, term by term.
    pub terms: Vec<TermState>,
    /// Multipliers of the rows \[force; stress for rows over a boundary\].
    pub multipliers: Vec<f64>,
    /// Load factor $\lambda$.
    pub load: f64,
    /// Time at which the internal variables were written \[time\]; 0 without a clock.
    pub time: f64,
    /// The particles that it belongs to, as far as that is known.
    #[cfg_attr(feature = "serde", serde(skip))]
    pub origin: Origin,
}

impl<'a> From<&'a State> for StateRef<'a> {
    fn from(state: &'a State) -> Self {
        let known = StateRef::new(&state.displacement, &state.terms, state.load);
        StateRef { time: state.time, origin: state.origin, ..known }
    }
}

impl State {
    /// The state of a model at rest: no displacement, condensed unknowns to match, load factor 0.
    pub fn at_rest(model: &Model, equations: &Constraints) -> Self {
        State {
            displacement: vec![0.0; model.unknowns()],
            terms: model.start(),
            multipliers: vec![0.0; equations.len()],
            load: 0.0,
            time: model.time(0.0),
            origin: model.origin(),
        }
    }

    /// All numbers of it.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = &f64> {
        let of_terms = self.terms.iter().flat_map(TermState::numbers);
        self.displacement.iter().chain(of_terms).chain(&self.multipliers).chain([&self.load, &self.time])
    }

    /// Refuses a state whose vectors are not as long as a model and its rows need them.
    ///
    /// # Errors
    /// [`SolveError::OtherModel`] with the vector.
    pub(crate) fn check_lengths(&self, model: &Model, equations: &Constraints) -> Result<(), SolveError> {
        model.at(self)?;
        let (given, needed) = (self.multipliers.len(), equations.len());
        if given == needed { Ok(()) } else { Err(SolveError::OtherModel { what: "multipliers", given, needed }) }
    }
}
