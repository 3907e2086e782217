//! States as models see them.

use crate::term::TermState;

/// The particles that a state belongs to, which differ from those of another body although there are as many; not known for states that
/// are put together by hand or read from a file.
///
/// It says where numbers come from and is no part of them: states are equal where their numbers are.
#[derive(Debug, Clone, Copy, Default)]
pub struct Origin(Option<u64>);

impl PartialEq for Origin {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Origin {
    /// That of a state over particles at reference positions, component by component.
    pub(crate) fn of(coordinates: &[f64]) -> Self {
        // Fowler, Noll and Vo's hash of the bits.
        let bits = coordinates.iter().map(|x| x.to_bits());
        Origin(Some(bits.fold(0xcbf2_9ce4_8422_2325, |hash, bits| (hash ^ bits).wrapping_mul(0x0100_0000_01b3))))
    }

    /// Whether both are known, and differ.
    pub(crate) fn differs(self, other: Self) -> bool {
        matches!((self.0, other.0), (Some(own), Some(other)) if own != other)
    }
}

/// A state as a model sees it.
#[derive(Debug, Clone, Copy)]
pub struct StateRef<'a> {
    /// Coefficients $d$, node by node \[length\].
    pub displacement: &'a [f64],
    /// Condensed unknowns and internal variables, term by term.
    pub terms: &'a [TermState],
    /// Load factor $\lambda$.
    pub load: f64,
    /// Time at which the internal variables were written \[time\].
    pub time: f64,
    /// The particles that it belongs to.
    pub origin: Origin,
}

impl<'a> StateRef<'a> {
    /// A state of these vectors at a load factor, with internal variables of time 0 and an origin that is not known.
    pub fn new(displacement: &'a [f64], terms: &'a [TermState], load: f64) -> Self {
        StateRef { displacement, terms, load, time: 0.0, origin: Origin::default() }
    }
}
