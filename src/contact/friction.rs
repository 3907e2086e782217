//! Coulomb's friction at a trace function in contact, with a rigid surface or another face.

use crate::geometry::Point;
use crate::term::Element;

use super::stick_slip::StickSlip;

/// Steps of the load go no further where there is friction, which knows where a body comes from.
const FRICTION_STEP: f64 = 0.1;

/// The farthest load factor of a step with friction: equal parts of the way, the last of which ends where it does.
pub(super) fn friction_step(from: f64, to: f64) -> f64 {
    let parts = ((to - from) / FRICTION_STEP - 1e-9).ceil();
    if parts > 1.0 { from + (to - from) / parts } else { to }
}

/// A trace function that touches, and all that friction asks of it.
pub(super) struct Friction<const D: usize> {
    pub coefficient: f64,
    /// $\varepsilon$ \[stress/length\].
    pub proximal: f64,
    /// $c$ \[stress/length\].
    pub decisive: f64,
    pub normal: Point<D>,
    pub pressure: f64,
    pub traction: Point<D>,
    pub gap: f64,
    /// Change of the gap with the load factor.
    pub gap_by_load: f64,
    /// What the slope of the gap is summed over, as an area.
    pub gap_area: f64,
    /// Mean displacement beside the other surface since the last converged state, and its change with the load factor.
    pub slip: Point<D>,
    pub slip_by_load: Point<D>,
    /// What the slip is summed over, as an area.
    pub area: f64,
}

impl<const D: usize> Friction<D> {
    fn along(&self, v: &Point<D>) -> Point<D> {
        v - self.normal * self.normal.dot(v)
    }

    /// What the trace function does along the surface.
    pub(crate) fn stick_slip(&self) -> StickSlip<D> {
        let slip = self.along(&self.slip);
        let trial = self.along(&self.traction) - slip * self.decisive;
        let size = trial.norm();
        if size <= self.coefficient * (self.pressure - self.decisive * self.gap) {
            StickSlip::Stick(slip)
        } else {
            // The slope of the law's traction -μπ s/|s| across the slip, μπ/|s|: at rest the request is as long as μπ + c|s|.
            let limit = self.coefficient * self.pressure.max(0.0);
            let turning = limit * self.decisive / (size - limit);
            let turning = if turning >= 0.0 { turning.min(self.proximal) } else { self.proximal };
            let direction = trial / size;
            StickSlip::Slip { direction, across: slip - direction * direction.dot(&slip), turning }
        }
    }

    /// Adds force and stiffness of friction; `moves` are places of unknowns with the slip times area that they make, `slope` that of
    /// the gap times area.
    pub(crate) fn add(&self, moves: &[(usize, Point<D>)], slope: &[f64], out: &mut Element) {
        let size = slope.len();
        let (proximal, friction) = (self.proximal, self.coefficient);
        let force = self.pressure - proximal * self.gap;
        match self.stick_slip() {
            StickSlip::Stick(slip) => {
                let held = self.along(&self.traction) - slip * proximal;
                let by_load = self.along(&self.slip_by_load) * proximal;
                for (place, by) in moves {
                    out.residual[*place] -= by.dot(&held);
                    out.load_slope[*place] += by.dot(&by_load);
                }
                self.add_along(moves, None, proximal / self.area, size, out);
            }
            StickSlip::Slip { direction, across, turning } => {
                let held = direction * (friction * force) - across * turning;
                let by_load = direction * (friction * proximal * self.gap_by_load);
                for (place, by) in moves {
                    out.residual[*place] -= by.dot(&held);
                    out.load_slope[*place] += by.dot(&by_load);
                }
                if !out.with_matrix {
                    return;
                }
                self.add_along(moves, Some(direction), turning / self.area, size, out);
                out.coupling.resize(size * size, 0.0);
                for (column, by_gap) in out.coupling.chunks_exact_mut(size).zip(slope) {
                    let factor = friction * proximal / self.gap_area * by_gap;
                    if factor != 0.0 {
                        for (place, by) in moves {
                            column[*place] += factor * by.dot(&direction);
                        }
                    }
                }
            }
        }
    }

    /// Adds a stiffness along the surface, but not along a direction in it.
    fn add_along(
        &self,
        moves: &[(usize, Point<D>)],
        but: Option<Point<D>>,
        factor: f64,
        size: usize,
        out: &mut Element,
    ) {
        if !out.with_matrix || factor == 0.0 || but.is_some() && D == 2 {
            return;
        }
        for (b, by) in moves {
            let mut held = self.along(by);
            if let Some(but) = &but {
                held -= but * but.dot(&held);
            }
            let column = &mut out.matrix[b * size..][..size];
            for (a, other) in moves {
                column[*a] += factor * other.dot(&held);
            }
        }
    }

    /// The traction after a step that changes the gap and the slip.
    pub(crate) fn next(&self, gap_change: f64, moved: &Point<D>) -> Point<D> {
        match self.stick_slip() {
            StickSlip::Stick(slip) => self.along(&self.traction) - (slip + self.along(moved)) * self.proximal,
            StickSlip::Slip { direction, across, turning } => {
                let mut turned = self.along(moved);
                turned -= direction * direction.dot(&turned);
                let limit = self.coefficient * (self.pressure - self.proximal * (self.gap + gap_change)).max(0.0);
                let next = direction * limit - (across + turned) * turning;
                // No longer than the law has it.
                next * (limit / next.norm().max(limit).max(f64::MIN_POSITIVE))
            }
        }
    }

    /// What a change of the load factor adds to the traction.
    pub(crate) fn next_by_load(&self, load_step: f64) -> Point<D> {
        match self.stick_slip() {
            StickSlip::Stick(_) => self.along(&self.slip_by_load) * (-self.proximal * load_step),
            StickSlip::Slip { direction, .. } => {
                direction * (-self.coefficient * self.proximal * self.gap_by_load * load_step)
            }
        }
    }
}
