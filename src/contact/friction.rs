//! Coulomb's friction at a trace function in contact, with a rigid surface or another face.

use crate::geometry::{Point, Vec3, unit};
use crate::term::{Coupling, Element};

use super::law::{Slipping, Touch, is_at_limit};

/// Largest step of the load factor with friction, whose forces depend on the path.
const FRICTION_STEP: f64 = 0.1;

/// The farthest load factor of a step with friction: equal parts of the way, the last of which ends where it does.
pub(super) fn friction_step(from: f64, to: f64) -> f64 {
    let parts = ((to - from) / FRICTION_STEP - 1e-9).ceil();
    if parts > 1.0 { from + (to - from) / parts } else { to }
}

/// The traction $h + \mu\,\pi\,t - k\,s$ of a trace function: it sticks, or slides along a direction.
struct Grip<'a> {
    slipping: &'a Slipping,
    /// $h$: that of the last iteration, where it sticks.
    held: Vec3,
    /// $t$: a unit vector where it slides, else zero.
    direction: Vec3,
    slides: bool,
    /// $k$ \[stress/length\]: $\varepsilon$, or what the traction turns by with a slip across it, $\mu\pi/|s|$ at rest.
    stiffness: f64,
    /// $s$: all of the slip, or that across the direction.
    slip: Vec3,
    /// Its change with the load factor, where it sticks.
    rate: Vec3,
}

impl Grip<'_> {
    /// The part of a vector along the surface, without that along the direction.
    fn across(&self, v: &Vec3) -> Vec3 {
        let along = self.slipping.along(v);
        along - self.direction * self.direction.dot(&along)
    }
}

impl Slipping {
    /// The tangential part of a vector, without the direction in which a condition fixes the particle.
    fn along(&self, v: &Vec3) -> Vec3 {
        let along = v - self.normal * self.normal.dot(v);
        self.fixed.map_or(along, |fixed| along - fixed * fixed.dot(&along))
    }

    /// Without the tangential directions of the components in which conditions fix the particle; none where no direction is left.
    pub(super) fn without(mut self, components: [bool; 3], dim: usize) -> Option<Self> {
        for component in (0..dim).filter(|&i| components[i]) {
            // A component nearer to the normal than to the surface fixes the gap, not the slip.
            let tangent = unit(component) - self.normal * self.normal[component];
            if tangent.norm() < self.normal[component].abs() {
                continue;
            }
            if dim == 2 || self.fixed.is_some() {
                return None;
            }
            self.fixed = Some(tangent.normalize());
        }
        Some(self)
    }
}

impl Touch {
    fn grip<'a>(&self, slipping: &'a Slipping) -> Grip<'a> {
        let (slip, held) = (slipping.along(&slipping.slip), slipping.along(&self.traction));
        let trial = held - slip * self.decisive;
        let size = trial.norm();
        // Without a slip since the last converged state rounding would decide about what slid there: it goes on sliding.
        let slid = slip.iter().all(|s| *s == 0.0) && is_at_limit(self.coefficient, self.pressure, &held);
        if size <= self.coefficient * (self.pressure - self.decisive * self.gap) && !(slid && size > 0.0) {
            let (direction, rate) = (Point::zeros(), slipping.along(&slipping.by_load));
            return Grip { slipping, held, direction, slides: false, stiffness: self.proximal, slip, rate };
        }
        // The slope of the law's traction -μπ s/|s| across the slip, μπ/|s|: at rest the request is as long as μπ + c|s|.
        let limit = self.coefficient * self.pressure.max(0.0);
        let turning = limit * self.decisive / (size - limit);
        let stiffness = if turning >= 0.0 { turning.min(self.proximal) } else { self.proximal };
        let (direction, none) = (trial / size, Point::zeros());
        let slip = slip - direction * direction.dot(&slip);
        Grip { slipping, held: none, direction, slides: true, stiffness, slip, rate: none }
    }

    /// Adds force and stiffness of friction; `moves` are places of unknowns with the slip times area that they make, `slope` that of
    /// the gap times area.
    pub(super) fn add_friction(&self, slipping: &Slipping, moves: &[(usize, Vec3)], slope: &[f64], out: &mut Element) {
        let (grip, size, friction) = (self.grip(slipping), slope.len(), self.coefficient);
        let limit = friction * (self.pressure - self.proximal * self.gap);
        let traction = grip.held + grip.direction * limit - grip.slip * grip.stiffness;
        let by_load = grip.rate * self.proximal + grip.direction * (friction * self.proximal * self.by_load);
        for (place, by) in moves {
            out.residual[*place] -= by.dot(&traction);
            out.load_slope[*place] += by.dot(&by_load);
        }
        if !out.with_matrix {
            return;
        }
        let factor = grip.stiffness / self.area;
        if factor != 0.0 && !(grip.slides && self.dim == 2) {
            for (b, by) in moves {
                let across = grip.across(by);
                let column = &mut out.matrix[b * size..][..size];
                for (a, other) in moves {
                    column[*a] += factor * other.dot(&across);
                }
            }
        }
        if !grip.slides {
            return;
        }
        let factor = friction * self.proximal / self.gap_area;
        let left = moves.iter().map(|(place, by)| (*place as u32, by.dot(&grip.direction))).collect();
        let pressed = slope.iter().enumerate().filter(|(_, by_gap)| **by_gap != 0.0);
        out.coupling.push(Coupling { left, right: pressed.map(|(k, by_gap)| (k as u32, factor * by_gap)).collect() });
    }

    /// The traction after a step that changes the gap and the slip.
    pub(super) fn next(&self, gap_change: f64, moved: &Vec3) -> Vec3 {
        let Some(slipping) = &self.slipping else { return Point::zeros() };
        let grip = self.grip(slipping);
        let limit = self.coefficient * (self.pressure - self.proximal * (self.gap + gap_change)).max(0.0);
        let next = grip.held + grip.direction * limit - (grip.slip + grip.across(moved)) * grip.stiffness;
        if !grip.slides {
            return next;
        }
        // No longer than the law has it.
        next * (limit / next.norm().max(limit).max(f64::MIN_POSITIVE))
    }

    /// What a change of the load factor adds to the traction.
    pub(super) fn next_by_load(&self, load_step: f64) -> Vec3 {
        let Some(slipping) = &self.slipping else { return Point::zeros() };
        let grip = self.grip(slipping);
        (grip.rate + grip.direction * (self.coefficient * self.by_load)) * (-self.proximal * load_step)
    }
}
