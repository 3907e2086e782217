//! The law of contact: what pressures, tractions and mean gaps of trace functions ask of each other.

use crate::each::add;
use crate::geometry::{Point, Vec3};
use crate::term::Element;

use super::contact_surface::Trace;
use super::{ContactSurface, Interference};

/// How stiff a contact answers between two iterations, from the stiffness of the body and the size of a trace function.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stiffness {
    /// $\varepsilon w$ \[stress\]: the change of a pressure by a gap as wide as the trace function.
    proximal: f64,
    /// $c w$ \[stress\]: the weight of a gap compared with a pressure where it is decided whether they touch.
    pub decisive: f64,
}

/// Shear moduli of [`Stiffness::proximal`].
const PROXIMAL_SHEAR: f64 = 1e4;
/// Bulk moduli of it.
const PROXIMAL_BULK: f64 = 1e2;
/// Roundings of a coordinate that a mean gap may be off by.
const ROUNDED: f64 = 4.0;
/// Part of its width that a trace function may go too far in one iteration.
const TOO_FAR: f64 = 0.5;

impl Stiffness {
    /// For a body of the given initial moduli.
    pub(crate) fn of(shear: f64, bulk: f64) -> Self {
        Stiffness { proximal: PROXIMAL_SHEAR * shear + PROXIMAL_BULK * bulk.max(0.0), decisive: shear }
    }
}

/// Unilateral contact of trace functions with what is opposite, with Coulomb's friction or without.
///
/// With the mean gap $\bar g_J$ of a trace function and its pressure $\pi_J$ per reference area, equilibrium is a saddle of
/// $\Pi(d) - \sum_J A_J\\,\pi_J\\,\bar g_J$ with
/// $$\bar g_J \ge 0,\quad \pi_J \ge 0,\quad \pi_J\\,\bar g_J = 0.$$
/// Pressures are condensed unknowns, condensed before assembly: with the trace functions in contact those where
/// $\pi_J > c\\,\bar g_J$ (a semismooth Newton method on the complementarity), an iteration solves for
/// $$\pi_J^{new} = \pi_J - \varepsilon\\,(\bar g_J + \nabla\bar g_J\cdot\delta d),$$
/// and all others have none. At rest of the iteration $\bar g_J = 0$ whatever $\varepsilon$: it says how fast pressures come to
/// rest, not where. Force $-\pi_J A_J\nabla\bar g_J$; without friction the matrix is symmetric.
///
/// Friction: the tangential traction $\tau_J$ is a condensed unknown as well, and $s_J$ the mean slip since the last converged state,
/// $$s_J = 0 \text{ where } |\tau_J| \le \mu\\,\pi_J,\qquad \tau_J = -\mu\\,\pi_J\\,s_J/|s_J| \text{ elsewhere},$$
/// told apart by $|\tau_J - c\\,s_J| \le \mu\\,(\pi_J - c\\,\bar g_J)$. Sticking trace functions get $\tau^{new} = \tau - \varepsilon(s + \nabla s\cdot\delta d)$;
/// what the friction of sliding ones changes with their pressure is not symmetric and goes beside the factors. Along a direction in which a
/// condition fixes the particle, and the surface does not move, $\tau_J = 0$: $s_J = 0$ would repeat the condition's equation.
#[derive(Debug, Clone)]
pub(crate) struct ContactLaw {
    /// Components of a traction.
    pub dim: usize,
    pub stiffness: Stiffness,
    /// Coulomb's coefficient.
    pub friction: f64,
    pub interference: Option<Interference>,
    /// Mean gap of each trace function at rest, where an interference is resolved.
    pub at_rest: Vec<f64>,
}

impl ContactLaw {
    pub(crate) fn new(dim: usize, stiffness: Stiffness, friction: f64, interference: Option<Interference>) -> Self {
        ContactLaw { dim, stiffness, friction, interference, at_rest: Vec::new() }
    }

    pub(crate) fn has_friction(&self) -> bool {
        self.friction > 0.0
    }

    /// Condensed unknowns of a trace function: its pressure, and with friction its traction.
    pub(crate) fn stride(&self) -> usize {
        if self.has_friction() { 1 + self.dim } else { 1 }
    }

    /// Pressure and tangential traction of a trace function, per area of the whole of it.
    pub(crate) fn pressure(&self, trace: usize, condensed: &[f64]) -> (f64, Vec3) {
        let own = &condensed[trace * self.stride()..][..self.stride()];
        (own[0], three(&own[1..]))
    }

    /// Whether a traction is as long as friction lets it be.
    pub(super) fn slides(&self, pressure: f64, traction: &Vec3) -> bool {
        is_at_limit(self.friction, pressure, traction)
    }

    /// What an interference adds to the gap of a trace function, and its change with the load factor.
    pub(super) fn shift(&self, trace: usize, load: f64) -> [f64; 2] {
        let at_rest = self.at_rest.get(trace).copied().unwrap_or(0.0);
        self.interference.map_or([0.0; 2], |interference| interference.shift(at_rest, load))
    }

    /// A trace function with its mean gap and the change of that with the load factor, and how it slips if it does.
    pub(super) fn touch(
        &self,
        (index, trace): (usize, &Trace),
        condensed: &[f64],
        [gap, by_load]: [f64; 2],
        slipping: Option<Slipping>,
    ) -> Touch {
        let (pressure, traction) = self.pressure(index, condensed);
        Touch {
            dim: self.dim,
            coefficient: self.friction,
            proximal: self.stiffness.proximal / trace.width,
            decisive: self.stiffness.decisive / trace.width,
            pressure,
            traction,
            gap,
            by_load,
            area: trace.area,
            gap_area: trace.area,
            width: trace.width,
            slipping,
        }
    }

    /// What rounding of coordinates makes of the pressures of the trace functions of a surface and of the norm of their forces.
    pub(super) fn rounding(&self, surface: &ContactSurface, extent: f64) -> [f64; 2] {
        let (mut most, mut forces) = (0.0f64, 0.0);
        for trace in &surface.traces {
            let pressure = ROUNDED * f64::EPSILON * extent / trace.width * self.stiffness.proximal;
            most = most.max(pressure);
            forces += (pressure * trace.area).powi(2);
        }
        [most, forces.sqrt()]
    }

    /// The work of friction of trace functions that slip between two states \[force·length\]: the mean traction times the slip.
    pub(super) fn work(
        &self,
        surface: &ContactSurface,
        [before, after]: [&[f64]; 2],
        slip: impl Fn(usize) -> Vec3,
    ) -> f64 {
        if !self.has_friction() {
            return 0.0;
        }
        let mut work = 0.0;
        for (k, trace) in surface.traces.iter().enumerate() {
            let [now, was] = [after, before].map(|condensed| self.pressure(k, condensed).1);
            work -= 0.5 * trace.area * (now + was).dot(&slip(k));
        }
        work
    }
}

/// The displacement with which bodies begin, of which nothing is said that did not move.
pub(crate) fn started(moved: &[f64], unknowns: usize) -> Vec<f64> {
    let mut all = vec![0.0; unknowns];
    all.iter_mut().zip(moved).for_each(|(all, moved)| *all = *moved);
    all
}

/// Up to three numbers as a vector.
pub(super) fn three(numbers: &[f64]) -> Vec3 {
    let mut all = Vec3::zeros();
    all.iter_mut().zip(numbers).for_each(|(to, from)| *to = *from);
    all
}

/// Part of the limit of friction by which the traction of a trace function that slides may fall short: what Newton's tolerance leaves.
const AT_LIMIT: f64 = 1e-6;

/// Whether a traction is as long as friction lets it be.
pub(super) fn is_at_limit(friction: f64, pressure: f64, traction: &Vec3) -> bool {
    traction.norm() >= (1.0 - AT_LIMIT) * friction * pressure
}

/// A trace function at a state, and what the law asks of it.
pub(super) struct Touch {
    pub(super) dim: usize,
    pub(super) coefficient: f64,
    /// $\varepsilon$ \[stress/length\].
    pub(super) proximal: f64,
    /// $c$ \[stress/length\].
    pub(super) decisive: f64,
    pub(super) pressure: f64,
    pub(super) traction: Vec3,
    pub(super) gap: f64,
    /// Change of the gap with the load factor.
    pub(super) by_load: f64,
    pub(super) area: f64,
    /// What the mean gap is a mean over, where that is less.
    pub(super) gap_area: f64,
    pub(super) width: f64,
    /// How it slips, where there is friction and something opposite.
    pub(super) slipping: Option<Slipping>,
}

/// How a trace function slips along what is opposite.
pub(super) struct Slipping {
    pub normal: Vec3,
    /// Mean displacement relative to the other surface since the last converged state, and its change with the load factor.
    pub slip: Vec3,
    pub by_load: Vec3,
    /// A tangential unit vector along which a condition fixes the particle and the surface does not move: no traction acts there.
    pub fixed: Option<Vec3>,
}

/// Derivatives of a mean gap over some unknowns, times the area that it is a mean over.
pub(super) struct Gradients {
    pub slope: Vec<f64>,
    /// A vector $b$ of which the matrix has $s\\,b^{\mathsf T} + b\\,s^{\mathsf T}$ beside the slope $s$, empty where there is none; the factor of
    /// both, and that of $s\\,s^{\mathsf T}$ that comes to the law's.
    pub beside: Vec<f64>,
    pub factor: f64,
    pub square: f64,
    /// What the load factor changes the mean gap by, and $b$ by as if it were an unknown: for it these are one more place of $s$ and $b$.
    pub by_load: [f64; 2],
}

impl Touch {
    pub(super) fn is_active(&self) -> bool {
        self.pressure > self.decisive * self.gap
    }

    /// Pressure and $\varepsilon$ per area that the mean gap is a mean over.
    pub(super) fn concentrated(&self) -> [f64; 2] {
        let more = self.area / self.gap_area;
        [self.pressure * more, self.proximal * more]
    }

    /// Adds forces and matrix; `moves` are places of unknowns with the slip times area that they make.
    pub(super) fn add(&self, gradients: &Gradients, moves: &[(usize, Vec3)], out: &mut Element) {
        let Gradients { slope, beside, factor, square: more, by_load } = gradients;
        let [pressure, proximal] = self.concentrated();
        // Pressures that are kept uncondensed have a row of their own for the gap.
        let condensed = out.uncondensed.is_none();
        let force = pressure - if condensed { proximal * self.gap } else { 0.0 };
        for (r, s) in out.residual.iter_mut().zip(slope) {
            *r -= force * s;
        }
        for (l, s) in out.load_slope.iter_mut().zip(slope) {
            *l += (proximal * self.by_load + more * by_load[0] + factor * by_load[1]) * s;
        }
        for (l, b) in out.load_slope.iter_mut().zip(beside) {
            *l += factor * by_load[0] * b;
        }
        let square = proximal / self.gap_area;
        if let Some(zone) = &mut out.uncondensed {
            // -A ∇ḡ·δd - δπ A/ε = A ḡ: what an iteration leaves of a gap is not multiplied by ε.
            zone.slopes.extend(slope.iter().map(|s| -*s as f32));
            zone.hessian[0][0] = square;
            zone.of_pi[0] = -self.gap * self.area;
            // A pressure that changes from one trace function to the next meets w/μ.
            zone.shear = self.decisive / self.area;
        } else if out.with_matrix {
            let square = square + more;
            for (j, column) in out.matrix.chunks_exact_mut(slope.len()).enumerate() {
                let Some(b) = beside.get(j) else {
                    let along = square * slope[j];
                    if along != 0.0 {
                        add(column, along, slope);
                    }
                    continue;
                };
                let (along, across) = (square * slope[j] + factor * b, factor * slope[j]);
                for ((entry, s), b) in column.iter_mut().zip(slope).zip(beside) {
                    *entry += along * s + across * b;
                }
            }
        }
        if let Some(slipping) = &self.slipping {
            self.add_friction(slipping, moves, slope, out);
        }
    }

    /// Writes the increments of pressure and traction for a step that changes the gap, moves the trace function and changes the load factor.
    pub(super) fn advance(&self, change: f64, moved: &Vec3, load: f64, step: &mut [f64]) {
        let mut traction = -self.traction;
        if self.is_active() {
            step[0] = -self.proximal * (self.gap + change);
            traction += self.next(change, moved);
        } else {
            step[0] = -self.pressure;
        }
        if self.is_active() && load != 0.0 {
            step[0] -= self.proximal * self.by_load * load;
            traction += self.next_by_load(load);
        }
        step[1..].iter_mut().zip(&traction).for_each(|(s, t)| *s = *t);
    }

    /// The part of a step after which a trace function has gone too far in, or further than where it is inside already. An iteration brings
    /// one that touches out; a predicted step may take it through what is opposite.
    pub(super) fn farthest(&self, change: f64) -> f64 {
        let most = self.gap.max(0.0) + TOO_FAR * self.width;
        if change < -most { most / -change } else { 1.0 }
    }
}

/// What trace functions are found to do at a state, all of one part and then those of the other.
pub(crate) struct Pressed {
    /// Mean gaps, infinite where they carry no pressure.
    pub gaps: Vec<f64>,
    /// Forces on the body, and their parts against the normal.
    pub forces: Vec<Vec3>,
    pub normal_forces: Vec<f64>,
    /// Whether they touch, and whether those that carry pressures slide.
    pub active: Vec<bool>,
    pub slides: Vec<bool>,
    /// The force on what carries pressures.
    pub total: Vec3,
}

impl Pressed {
    pub(super) fn new(traces: usize) -> Self {
        Pressed {
            gaps: vec![f64::INFINITY; traces],
            forces: vec![Point::zeros(); traces],
            normal_forces: vec![0.0; traces],
            active: vec![false; traces],
            slides: vec![false; traces],
            total: Point::zeros(),
        }
    }
}
