//! What a state tells of how far it can be trusted.

/// How far a state can be trusted; the worst over all points.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct StateDiagnostics {
    /// The smallest reciprocal condition number of the moment matrix behind the shape functions.
    pub rcond: Option<f64>,
    /// The smallest and the largest $J = \det F$ at the points of the body, those of averaged gradients with smoothed
    /// cells: close to edges of pressed faces the field may fold between them unseen. Faces that meet or pass through each
    /// other are not looked for.
    pub jacobians: Option<[f64; 2]>,
    /// Energy of changes of volume within zones, $\int U(J) - U(\bar J)$, where pressures are not projected:
    /// what locking costs \[energy\].
    pub locked_energy: Option<f64>,
}

impl StateDiagnostics {
    /// The worse of both; energies add.
    pub(crate) fn join(self, other: StateDiagnostics) -> StateDiagnostics {
        fn both<T>(a: Option<T>, b: Option<T>, join: impl Fn(T, T) -> T) -> Option<T> {
            match (a, b) {
                (Some(a), Some(b)) => Some(join(a, b)),
                (a, b) => a.or(b),
            }
        }
        StateDiagnostics {
            rcond: both(self.rcond, other.rcond, f64::min),
            jacobians: both(self.jacobians, other.jacobians, |a, b| [a[0].min(b[0]), a[1].max(b[1])]),
            locked_energy: both(self.locked_energy, other.locked_energy, |a, b| a + b),
        }
    }

    /// The worst over several processes, by functions that replace values by the largest and by the sum of all.
    pub(crate) fn over(self, largest: impl Fn(&mut [f64]), sum: impl Fn(&mut [f64])) -> StateDiagnostics {
        const NONE: f64 = f64::NEG_INFINITY;
        let [smallest_j, largest_j] = self.jacobians.map_or([NONE; 2], |[small, large]| [-small, large]);
        let mut values =
            [self.rcond.map_or(NONE, |r| -r), smallest_j, largest_j, self.locked_energy.map_or(NONE, |_| 0.0)];
        largest(&mut values);
        let mut locked = [self.locked_energy.unwrap_or(0.0)];
        sum(&mut locked);
        StateDiagnostics {
            rcond: (values[0] > NONE).then_some(-values[0]),
            jacobians: (values[1] > NONE).then_some([-values[1], values[2]]),
            locked_energy: (values[3] > NONE).then_some(locked[0]),
        }
    }
}
