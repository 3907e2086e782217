//! The search for critical points between two equilibria of a path.

use crate::each::Each;
use crate::linear::vector::dot;

use super::critical::{CriticalKind, CriticalPoint};
use super::equilibrium::Equilibrium;
use super::functional::{Control, Deflection, Functional};
use super::newton::Attempt;
use super::path::Observer;
use super::settings::Newton;
use super::state::State;

/// Critical points reported between two steps; a wrinkling body may lose hundreds of modes at once.
const MOST_POINTS: usize = 4;
/// Load factors of a bracket differ by no more than this part.
const BRACKET: f64 = 1e-3;
/// Bisections per critical point: 2⁻⁴⁰ is below any tolerance that Newton's own allows.
const BISECTIONS: usize = 40;

impl Equilibrium<'_> {
    /// The critical points between two equilibria of one path with their numbers of unstable modes.
    ///
    /// Both are led apart by the secant deflection $c\cdot d$, $c = d_B - d_A$, which grows through limit points too.
    pub(crate) fn critical_points(
        &mut self,
        newton: &Newton,
        before: (&State, usize),
        behind: (&State, usize),
        observer: &mut dyn Observer,
    ) -> Vec<CriticalPoint> {
        let mut points = Vec::new();
        let (mut low, mut low_modes) = (before.0.clone(), before.1);
        while low_modes != behind.1 && points.len() < MOST_POINTS {
            let (mut high, mut high_modes) = (behind.0.clone(), behind.1);
            for _ in 0..BISECTIONS {
                if is_narrow(&low, &high, BRACKET) {
                    break;
                }
                // A middle that can't be reached leaves the bracket as wide as it is.
                let Some((middle, modes)) = self.middle(newton, &low, &high, observer) else { break };
                if modes == low_modes {
                    low = middle;
                } else {
                    (high, high_modes) = (middle, modes);
                }
            }
            let kind = self.kind(&low, &high);
            self.react(&mut low);
            let loads = [low.load, high.load];
            points.push(CriticalPoint { kind, modes: [low_modes, high_modes], loads, state: low });
            (low, low_modes) = (high, high_modes);
        }
        points
    }

    /// The equilibrium half-way between two others, and its number of unstable modes.
    fn middle(
        &mut self,
        newton: &Newton,
        low: &State,
        high: &State,
        observer: &mut dyn Observer,
    ) -> Option<(State, usize)> {
        let secant = secant(low, high);
        let half = 0.5 * (secant.value(&low.displacement) + secant.value(&high.displacement));
        // The mean of both, condensed unknowns included.
        let mut middle = self.predict(low, high, -0.5);
        let control = Control::Functional(&secant, half);
        let attempt = Attempt { control, predicted: true, largest_first_step: f64::INFINITY };
        self.newton(newton, &mut middle, &attempt, observer).ok()?;
        Some((middle, self.unstable_modes()?))
    }

    /// At a limit point the load runs backwards along the secant, at a bifurcation it does not.
    fn kind(&mut self, low: &State, high: &State) -> CriticalKind {
        let secant = secant(low, high);
        let mut along = |state: &State| self.tangent_displacement(state).map(|answer| dot(&secant.weights, &answer));
        match (along(low), along(high)) {
            (Ok(a), Ok(b)) if (a < 0.0) != (b < 0.0) => CriticalKind::Limit,
            _ => CriticalKind::Bifurcation,
        }
    }
}

/// $c = d_B - d_A$.
fn secant(low: &State, high: &State) -> Deflection {
    Deflection { weights: high.displacement.paired(&low.displacement, |b, a| b - a) }
}

/// Whether two states are as close as requested. The load is flat at a limit point: there the displacements decide,
/// with the root of the width, because the load falls off with their square.
fn is_narrow(low: &State, high: &State, width: f64) -> bool {
    let secant = secant(low, high);
    let apart = dot(&secant.weights, &secant.weights).sqrt();
    let size = dot(&high.displacement, &high.displacement).sqrt();
    let load = low.load.abs().max(high.load.abs());
    (high.load - low.load).abs() <= width * load && apart <= width.sqrt() * size
}
