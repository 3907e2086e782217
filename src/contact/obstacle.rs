//! Contact of a body with a rigid surface.

use crate::geometry::Point;
use crate::term::{CondensedUnknowns, Element, History, Term, Unilateral, View};

use super::contact_surface::Trace;
use super::friction::{Friction, friction_step};
use super::rigid::{Drive, Placed};
use super::{ContactError, ContactSurface, Nearest, RigidSurface};

/// How stiff a contact answers between two iterations, from the stiffness of the body and the size of a trace function.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stiffness {
    /// $\varepsilon w$ \[stress\]: the change of a pressure by a gap as wide as the trace function.
    pub proximal: f64,
    /// $c w$ \[stress\]: what a gap counts beside a pressure where it is requested whether they touch.
    pub decisive: f64,
}

/// Shear moduli of [`Stiffness::proximal`].
const PROXIMAL_SHEAR: f64 = 1e4;
/// Bulk moduli of it.
const PROXIMAL_BULK: f64 = 1e2;

impl Stiffness {
    /// What rounding of coordinates up to `extent` makes of the pressures of trace functions and of the norm of their forces.
    pub(crate) fn rounding<'a>(&self, traces: impl Iterator<Item = &'a Trace>, extent: f64) -> [f64; 2] {
        let (mut most, mut forces) = (0.0f64, 0.0);
        for trace in traces {
            let pressure = ROUNDED * f64::EPSILON * extent / trace.width * self.proximal;
            most = most.max(pressure);
            forces += (pressure * trace.area).powi(2);
        }
        [most, forces.sqrt()]
    }

    /// For a body of the given initial moduli.
    pub(crate) fn of(shear: f64, bulk: f64) -> Self {
        Stiffness { proximal: PROXIMAL_SHEAR * shear + PROXIMAL_BULK * bulk.max(0.0), decisive: shear }
    }
}

/// Roundings of a coordinate that a mean gap may be off by.
const ROUNDED: f64 = 4.0;

/// Part of its width that a trace function may go too far in one iteration where it comes to touch.
pub(super) const TOO_FAR: f64 = 0.5;

/// Largest curvature times width that the matrix knows: to a trace function what is rounder is a corner, which no tangent describes.
const SHARPEST: f64 = 4.0;

/// Unilateral contact of a part of the boundary with a rigid surface, with Coulomb's friction or without.
///
/// With the mean gap of a trace function, $\bar g_J = \int\Theta_J\\,g(x)\\,\mathrm d\Gamma/A_J$, and its pressure $\pi_J$ per
/// reference area, equilibrium is a saddle of $\Pi(d) - \sum_J A_J\\,\pi_J\\,\bar g_J$ with
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
/// what the friction of sliding ones changes with their pressure is not symmetric and goes beside the factors.
pub(crate) struct RigidContact<const D: usize> {
    pub contact_surface: ContactSurface<D>,
    pub surface: RigidSurface<D>,
    /// The node whose first component is the travel of a surface that is pushed.
    pub rigid_dof: Option<u32>,
    pub stiffness: Stiffness,
    /// Mean gap of each trace function at rest, where an interference is resolved.
    pub at_rest: Vec<f64>,
}

/// What a trace function knows of the surface at a state.
pub(crate) struct LocalContact<const D: usize> {
    /// $\bar g_J$ \[length\].
    pub gap: f64,
    /// Its change with the load factor.
    pub by_load: f64,
    /// The mean normal, a unit vector.
    pub normal: Point<D>,
    /// The mean displacement of the trace function beside the surface \[length\].
    pub beside: Point<D>,
}

impl<const D: usize> RigidContact<D> {
    pub(crate) fn placed(&self, displacement: &[f64], load: f64) -> Placed<D> {
        let travel = self.rigid_dof.map_or(0.0, |node| displacement[node as usize * D]);
        self.surface.placed(load, travel)
    }

    pub(crate) fn has_friction(&self) -> bool {
        self.surface.friction > 0.0
    }

    /// Condensed unknowns of a trace function: its pressure, and with friction its traction.
    pub(super) fn stride(&self) -> usize {
        if self.has_friction() { 1 + D } else { 1 }
    }

    /// Pressure and tangential traction of a trace function.
    pub(crate) fn pressure(&self, trace: usize, condensed: &[f64]) -> (f64, Point<D>) {
        let first = trace * self.stride();
        let traction =
            if self.has_friction() { Point::from_fn(|i, _| condensed[first + 1 + i]) } else { Point::zeros() };
        (condensed[first], traction)
    }

    /// What an interference adds to the gap of a trace function, and its change with the load factor.
    fn shift(&self, trace: usize, load: f64) -> [f64; 2] {
        let at_rest = self.at_rest.get(trace).copied().unwrap_or(0.0);
        self.surface.interference.map_or([0.0; 2], |interference| interference.shift(at_rest, load))
    }

    /// The contact of a boundary part with a surface.
    pub(crate) fn new(
        contact_surface: ContactSurface<D>,
        surface: RigidSurface<D>,
        rigid_dof: Option<u32>,
        stiffness: Stiffness,
    ) -> Self {
        let mut contact = RigidContact { contact_surface, surface, rigid_dof, stiffness, at_rest: Vec::new() };
        if let Some(interference) = contact.surface.interference.take() {
            let (table, all) = (&contact.contact_surface.table, contact.contact_surface.traces.len());
            let unknowns = D * contact.rigid_dof.map_or(0, |node| node as usize + 1).max(table.node_count());
            let rest = vec![0.0; unknowns];
            let view = View { displacement: &rest, condensed: &[], load: 0.0 };
            let gaps = (0..all).map(|trace| contact.local_contact(trace, &view, |_, _, _| {}).gap);
            contact.at_rest = gaps.collect();
            contact.surface.interference = Some(interference);
        }
        contact
    }

    /// Visits the points of a trace function.
    pub(crate) fn local_contact(
        &self,
        trace: usize,
        view: &View<'_>,
        mut visit: impl FnMut(usize, f64, &Nearest<D>),
    ) -> LocalContact<D> {
        let (index, trace) = (trace, &self.contact_surface.traces[trace]);
        let placed = self.placed(view.displacement, view.load);
        let (mut gap, mut by_load) = (0.0, 0.0);
        let (mut normal, mut beside) = (Point::<D>::zeros(), Point::<D>::zeros());
        for (k, &(point, weight)) in trace.points.iter().enumerate() {
            let u = self.contact_surface.displacement(point, view.displacement);
            let x = self.contact_surface.table.positions()[point as usize] + u;
            let found = placed.nearest(&*self.surface.shape, &x);
            gap += weight * found.gap;
            by_load -= weight * found.normal.dot(&placed.slope);
            normal += found.normal * weight;
            beside += u * weight;
            visit(k, weight, &found);
        }
        let length = normal.norm();
        let [shift, shift_by_load] = self.shift(index, view.load);
        LocalContact {
            gap: gap / trace.area + shift,
            by_load: by_load / trace.area + shift_by_load,
            normal: if length > 0.0 { normal / length } else { normal },
            beside: beside / trace.area - placed.offset,
        }
    }

    /// $\varepsilon$ of a trace function \[stress/length\].
    pub(super) fn proximal(&self, trace: usize) -> f64 {
        self.stiffness.proximal / self.contact_surface.traces[trace].width
    }

    /// $c$ of a trace function \[stress/length\].
    pub(super) fn decisive(&self, trace: usize) -> f64 {
        self.stiffness.decisive / self.contact_surface.traces[trace].width
    }

    pub(crate) fn is_active(&self, trace: usize, pressure: f64, gap: f64) -> bool {
        pressure > self.decisive(trace) * gap
    }

    /// What friction asks of a trace function that touches.
    fn friction(&self, trace: usize, view: &View<'_>, local_contact: &LocalContact<D>) -> Friction<D> {
        let (pressure, traction) = self.pressure(trace, view.condensed);
        let first = self.variables().start + trace * D;
        let was = Point::<D>::from_fn(|i, _| view.condensed[first + i]);
        let area = self.contact_surface.traces[trace].area;
        Friction {
            coefficient: self.surface.friction,
            proximal: self.proximal(trace),
            decisive: self.decisive(trace),
            normal: local_contact.normal,
            pressure,
            traction,
            gap: local_contact.gap,
            gap_by_load: local_contact.by_load,
            gap_area: area,
            slip: local_contact.beside - was,
            slip_by_load: -self.placed(view.displacement, view.load).slope,
            area,
        }
    }

    /// How unknowns of a trace function move it beside the surface, times its area: displacements by $\int\Theta\Psi_a$, and the travel of the
    /// surface.
    fn moves(&self, trace: usize) -> Vec<(usize, Point<D>)> {
        let trace = &self.contact_surface.traces[trace];
        let mut values = vec![0.0; trace.nodes.len()];
        for (k, &(point, weight)) in trace.points.iter().enumerate() {
            for (&l, value) in trace.local(k).iter().zip(self.contact_surface.table.values(point as usize)) {
                values[l as usize] += weight * value;
            }
        }
        let mut moves: Vec<(usize, Point<D>)> = Vec::with_capacity(values.len() * D);
        let unit = |i: usize| Point::<D>::from_fn(|j, _| f64::from(u8::from(i == j)));
        for (a, value) in values.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            moves.extend((0..D).map(|i| (a * D + i, unit(i) * *value)));
        }
        if let (Some(_), Some(along)) = (self.rigid_dof, self.surface.free_direction()) {
            moves.push(((trace.nodes.len() - 1) * D, along * -trace.area));
        }
        moves
    }

    /// Where a trace function that touches lies beyond an open end of the surface.
    pub(crate) fn passed_end(&self, trace: usize, view: &View<'_>) -> Option<Point<D>> {
        let mut passed = None;
        let points = &self.contact_surface.traces[trace].points;
        let local_contact = self.local_contact(trace, view, |k, _, found| {
            if found.passed_end {
                passed = Some(points[k].0);
            }
        });
        let (pressure, _) = self.pressure(trace, view.condensed);
        passed.filter(|_| self.is_active(trace, pressure, local_contact.gap)).map(|point| {
            self.contact_surface.table.positions()[point as usize]
                + self.contact_surface.displacement(point, view.displacement)
        })
    }

    /// Gap of a trace function, $\nabla\bar g\cdot\delta d$, and its mean displacement beside the surface by the step.
    fn change(&self, trace: usize, view: &View<'_>, step: &[f64]) -> (LocalContact<D>, f64, Point<D>) {
        let travel = self.rigid_dof.map_or(0.0, |node| step[node as usize * D]);
        let pushed = self.surface.free_direction().map_or_else(Point::zeros, |along| along * travel);
        let (mut change, mut moved) = (0.0, Point::<D>::zeros());
        let points = &self.contact_surface.traces[trace].points;
        let local_contact = self.local_contact(trace, view, |k, weight, found| {
            let (point, _) = points[k];
            let by = self.contact_surface.displacement(point, step) - pushed;
            change += weight * found.normal.dot(&by);
            moved += by * weight;
        });
        let area = self.contact_surface.traces[trace].area;
        (local_contact, change / area, moved / area)
    }
}

impl<const D: usize> Term<D> for RigidContact<D> {
    fn clusters(&self) -> usize {
        self.contact_surface.traces.len()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        &self.contact_surface.traces[cluster].nodes
    }

    fn break_points(&self) -> Vec<f64> {
        let mut found = self.surface.break_points();
        found.extend(self.surface.interference.map(|interference| interference.until));
        found
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        let trace = &self.contact_surface.traces[cluster];
        let size = trace.nodes.len() * D;
        let (pressure, _) = self.pressure(cluster, view.condensed);
        // ∇ḡ A, in the buffer of the element.
        let mut slope = std::mem::take(&mut out.scratch);
        slope.clear();
        slope.resize(size, 0.0);
        let free = self.surface.free_direction();
        let travel = self.rigid_dof.map(|_| size - D);
        let matrix = &mut out.matrix;
        let curved = out.with_matrix && pressure > 0.0;
        let local_contact = self.local_contact(cluster, &view, |k, weight, found| {
            let values = self.contact_surface.table.values(trace.points[k].0 as usize);
            let local = trace.local(k);
            for (&l, value) in local.iter().zip(values) {
                for i in 0..D {
                    slope[l as usize * D + i] += weight * value * found.normal[i];
                }
            }
            if let (Some(place), Some(along)) = (travel, &free) {
                slope[place] -= weight * found.normal.dot(along);
            }
            if curved && found.curvature.iter().any(|c| *c != 0.0) {
                let factor = -pressure * weight * (SHARPEST / (trace.width * found.curvature.norm())).min(1.0);
                for (&b, value) in local.iter().zip(values) {
                    for j in 0..D {
                        let column = &mut matrix[(b as usize * D + j) * size..][..size];
                        for (&a, other) in local.iter().zip(values) {
                            for i in 0..D {
                                column[a as usize * D + i] += factor * value * other * found.curvature[(i, j)];
                            }
                        }
                    }
                }
                if let (Some(place), Some(along)) = (travel, &free) {
                    let turned = found.curvature * along;
                    for (&a, value) in local.iter().zip(values) {
                        for i in 0..D {
                            let entry = -factor * value * turned[i];
                            matrix[place * size + a as usize * D + i] += entry;
                            matrix[(a as usize * D + i) * size + place] += entry;
                        }
                    }
                    matrix[place * size + place] += factor * along.dot(&turned);
                }
            }
        });
        if !self.is_active(cluster, pressure, local_contact.gap) {
            matrix.fill(0.0);
            out.scratch = slope;
            return;
        }
        let proximal = self.proximal(cluster);
        let force = pressure - proximal * local_contact.gap;
        for (r, s) in out.residual.iter_mut().zip(&slope) {
            *r -= force * s;
        }
        for (l, s) in out.load_slope.iter_mut().zip(&slope) {
            *l += proximal * local_contact.by_load * s;
        }
        if out.with_matrix {
            for (column, b) in out.matrix.chunks_exact_mut(size).zip(&slope) {
                let factor = proximal / trace.area * b;
                if factor != 0.0 {
                    for (entry, a) in column.iter_mut().zip(&slope) {
                        *entry += factor * a;
                    }
                }
            }
        }
        if self.has_friction() {
            self.friction(cluster, &view, &local_contact).add(&self.moves(cluster), &slope, out);
        }
        out.scratch = slope;
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        let (pressure, traction) = self.pressure(cluster, view.condensed);
        let (local_contact, change, moved) = self.change(cluster, &view, step);
        condensed_step.fill(0.0);
        if !self.is_active(cluster, pressure, local_contact.gap) {
            condensed_step[0] = -pressure;
            if self.has_friction() {
                condensed_step[1..1 + D].iter_mut().zip(&traction).for_each(|(s, t)| *s = -t);
            }
            let most = TOO_FAR * self.contact_surface.traces[cluster].width;
            if local_contact.gap + change < -most && change < 0.0 {
                return ((local_contact.gap + most) / -change).min(1.0);
            }
            return 1.0;
        }
        let proximal = self.proximal(cluster);
        condensed_step[0] = -proximal * (local_contact.gap + change);
        if self.has_friction() {
            let next = self.friction(cluster, &view, &local_contact).next(change, &moved);
            condensed_step[1..1 + D].iter_mut().zip((next - traction).iter()).for_each(|(s, t)| *s = *t);
        }
        1.0
    }

    fn condensed(&self) -> Option<&dyn CondensedUnknowns> {
        Some(self)
    }

    fn history(&self) -> Option<&dyn History> {
        Some(self)
    }

    fn unilateral(&self) -> Option<&dyn Unilateral> {
        Some(self)
    }
}

impl<const D: usize> CondensedUnknowns for RigidContact<D> {
    fn unknowns(&self, cluster: usize) -> std::ops::Range<usize> {
        let stride = self.stride();
        cluster * stride..(cluster + 1) * stride
    }
}

impl<const D: usize> History for RigidContact<D> {
    fn variables(&self) -> std::ops::Range<usize> {
        let traces = self.contact_surface.traces.len();
        let first = traces * self.stride();
        // Where each trace function was beside the surface; without friction that does not matter.
        first..first + if self.has_friction() { traces * D } else { 0 }
    }

    fn start_variables(&self, variables: &mut [f64]) {
        let offset = self.surface.placed(0.0, 0.0).offset;
        for was in variables.chunks_exact_mut(D) {
            was.iter_mut().zip(&offset).for_each(|(was, offset)| *was = -offset);
        }
    }

    fn update(&self, view: View<'_>, next: &mut [f64]) {
        for (trace, now) in next.chunks_exact_mut(D).enumerate() {
            now.copy_from_slice(self.local_contact(trace, &view, |_, _, _| {}).beside.as_slice());
        }
    }
}

impl<const D: usize> Unilateral for RigidContact<D> {
    fn rounding(&self) -> [f64; 2] {
        self.stiffness.rounding(self.contact_surface.traces.iter(), self.contact_surface.extent)
    }

    fn advance_load(&self, cluster: usize, view: View<'_>, load_step: f64, condensed_step: &mut [f64]) {
        let (pressure, _) = self.pressure(cluster, view.condensed);
        let local_contact = self.local_contact(cluster, &view, |_, _, _| {});
        if !self.is_active(cluster, pressure, local_contact.gap) {
            return;
        }
        let proximal = self.proximal(cluster);
        condensed_step[0] -= proximal * local_contact.by_load * load_step;
        if !self.has_friction() {
            return;
        }
        let next = self.friction(cluster, &view, &local_contact).next_by_load(load_step);
        condensed_step[1..1 + D].iter_mut().zip(&next).for_each(|(step, more)| *step += more);
    }

    fn check_state(&self, view: View<'_>) -> Option<String> {
        (0..self.contact_surface.traces.len()).find_map(|trace| {
            let at = self.passed_end(trace, &view)?.as_slice().to_vec();
            let (contact, load) = (self.surface.name.clone(), view.load);
            Some(ContactError::PassedEnd { contact, at, load }.to_string())
        })
    }

    fn farthest_load(&self, from: f64, to: f64) -> f64 {
        let to = if self.has_friction() { friction_step(from, to) } else { to };
        let depth = 0.5 * self.surface.shape.depth();
        let Drive::Moved { by, amplitude } = &self.surface.drive else { return to };
        if !depth.is_finite() {
            return to;
        }
        let direction = |load: f64| by.norm() * (amplitude.evaluate(load).0 - amplitude.evaluate(from).0).abs();
        let mut part = 1.0;
        while direction(from + part * (to - from)) > depth && part > 1e-3 {
            part *= 0.5;
        }
        from + part * (to - from)
    }
}
