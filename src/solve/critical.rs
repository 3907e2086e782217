//! Critical points: where the number of unstable modes changes along a path.

use super::state::State;

/// What happens to the path at a critical point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum CriticalKind {
    /// The load has an extremum: beyond it the path falls under load control, or comes back to stability.
    Limit,
    /// Another branch crosses the path; the load goes on as before.
    Bifurcation,
}

/// A critical point between two states of a path: modes of negative stiffness appear or vanish there.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CriticalPoint {
    /// What it is.
    pub kind: CriticalKind,
    /// Unstable modes before and behind it.
    pub modes: [usize; 2],
    /// Load factors before and behind it. At a limit point the extremum lies at or beyond both.
    pub loads: [f64; 2],
    /// The last state before it.
    pub state: State,
}

impl CriticalPoint {
    /// The load factor: the middle of the bracket, at a limit point its outer end.
    pub fn load(&self) -> f64 {
        let [before, behind] = self.loads;
        match self.kind {
            CriticalKind::Bifurcation => 0.5 * (before + behind),
            // A path that loses stability passes a maximum, one that wins it back a minimum.
            CriticalKind::Limit if self.modes[1] > self.modes[0] => before.max(behind),
            CriticalKind::Limit => before.min(behind),
        }
    }
}
