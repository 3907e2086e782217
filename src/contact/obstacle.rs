//! Contact of a body with a rigid surface.

use crate::geometry::Point;
use crate::term::{Element, Term, View};

use super::grip::Grip;
use super::rigid::{Drive, Placed};
use super::skin::Hat;
use super::{ContactError, Nearest, RigidSurface, Skin};

/// How stiff a contact answers between two iterations, from the stiffness of the body and the size of a hat.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stiffness {
    /// $\varepsilon w$ \[stress\]: the change of a pressure by a gap as wide as the hat.
    pub proximal: f64,
    /// $c w$ \[stress\]: what a gap counts beside a pressure where it is asked whether they touch.
    pub decisive: f64,
}

/// Shear moduli of [`Stiffness::proximal`].
const PROXIMAL_SHEAR: f64 = 1e4;
/// Bulk moduli of it.
const PROXIMAL_BULK: f64 = 1e2;

impl Stiffness {
    /// What rounding of coordinates up to `extent` makes of the pressures of hats and of the norm of their forces.
    pub fn rounding<'a>(&self, hats: impl Iterator<Item = &'a Hat>, extent: f64) -> [f64; 2] {
        let (mut most, mut forces) = (0.0f64, 0.0);
        for hat in hats {
            let pressure = ROUNDED * f64::EPSILON * extent / hat.width * self.proximal;
            most = most.max(pressure);
            forces += (pressure * hat.area).powi(2);
        }
        [most, forces.sqrt()]
    }

    /// For a body of the given initial moduli.
    pub fn of(shear: f64, bulk: f64) -> Self {
        Stiffness { proximal: PROXIMAL_SHEAR * shear + PROXIMAL_BULK * bulk.max(0.0), decisive: shear }
    }
}

/// Roundings of a coordinate that a mean gap may be off by.
const ROUNDED: f64 = 4.0;

/// Part of its width that a hat may go too far in one iteration where it comes to touch.
pub(super) const TOO_FAR: f64 = 0.5;

/// Largest curvature times width that the matrix knows: to a hat what is rounder is a corner, which no tangent describes.
const SHARPEST: f64 = 4.0;

/// Steps of the load go no further where there is friction, which knows where a body comes from.
const FRICTION_STEP: f64 = 0.1;

/// Unilateral contact of a part of the boundary with a rigid surface, with Coulomb's friction or without.
///
/// With the mean gap of a hat, $\bar g_J = \int\Theta_J\\,g(x)\\,\mathrm d\Gamma/A_J$, and its pressure $\pi_J$ per
/// reference area, equilibrium is a saddle of $\Pi(d) - \sum_J A_J\\,\pi_J\\,\bar g_J$ with
/// $$\bar g_J \ge 0,\quad \pi_J \ge 0,\quad \pi_J\\,\bar g_J = 0.$$
/// Pressures are condensed unknowns, condensed before assembly: with the hats in contact those where
/// $\pi_J > c\\,\bar g_J$ (a semismooth Newton method on the complementarity), an iteration solves for
/// $$\pi_J^{new} = \pi_J - \varepsilon\\,(\bar g_J + \nabla\bar g_J\cdot\delta d),$$
/// and all others have none. At rest of the iteration $\bar g_J = 0$ whatever $\varepsilon$: it says how fast pressures come to
/// rest, not where. Force $-\pi_J A_J\nabla\bar g_J$; without friction the matrix is symmetric.
///
/// Friction: the tangential traction $\tau_J$ is a condensed unknown as well, and $s_J$ the mean slip since the last converged state,
/// $$s_J = 0 \text{ where } |\tau_J| \le \mu\\,\pi_J,\qquad \tau_J = -\mu\\,\pi_J\\,s_J/|s_J| \text{ elsewhere},$$
/// told apart by $|\tau_J - c\\,s_J| \le \mu\\,(\pi_J - c\\,\bar g_J)$. Sticking hats get $\tau^{new} = \tau - \varepsilon(s + \nabla s\cdot\delta d)$;
/// what the friction of sliding ones changes with their pressure is not symmetric and goes beside the factors.
pub(crate) struct RigidContact<const D: usize> {
    pub skin: Skin<D>,
    pub surface: RigidSurface<D>,
    /// The node whose first component is the travel of a surface that is pushed.
    pub carriage: Option<u32>,
    pub stiffness: Stiffness,
}

/// What a hat knows of the surface at a state.
pub(crate) struct Touch<const D: usize> {
    /// $\bar g_J$ \[length\].
    pub gap: f64,
    /// Its change with the load factor.
    pub by_load: f64,
    /// The mean normal, a unit vector.
    pub normal: Point<D>,
    /// The mean displacement of the hat beside the surface \[length\].
    pub beside: Point<D>,
}

impl<const D: usize> RigidContact<D> {
    pub(crate) fn placed(&self, displacement: &[f64], load: f64) -> Placed<D> {
        let travel = self.carriage.map_or(0.0, |node| displacement[node as usize * D]);
        self.surface.placed(load, travel)
    }

    pub(crate) fn rubs(&self) -> bool {
        self.surface.friction > 0.0
    }

    /// Condensed unknowns of a hat: its pressure, and with friction its traction.
    pub(super) fn stride(&self) -> usize {
        if self.rubs() { 1 + D } else { 1 }
    }

    /// Pressure and tangential traction of a hat.
    pub(crate) fn pressure(&self, hat: usize, condensed: &[f64]) -> (f64, Point<D>) {
        let first = hat * self.stride();
        let traction = if self.rubs() { Point::from_fn(|i, _| condensed[first + 1 + i]) } else { Point::zeros() };
        (condensed[first], traction)
    }

    /// Visits the points of a hat.
    pub(crate) fn touch(
        &self,
        hat: usize,
        view: &View<'_>,
        mut visit: impl FnMut(usize, f64, &Nearest<D>),
    ) -> Touch<D> {
        let hat = &self.skin.hats[hat];
        let placed = self.placed(view.displacement, view.load);
        let (mut gap, mut by_load) = (0.0, 0.0);
        let (mut normal, mut beside) = (Point::<D>::zeros(), Point::<D>::zeros());
        for (k, &(point, weight)) in hat.points.iter().enumerate() {
            let u = self.skin.displacement(point, view.displacement);
            let x = self.skin.table.positions()[point as usize] + u;
            let found = placed.nearest(&*self.surface.shape, &x);
            gap += weight * found.gap;
            by_load -= weight * found.normal.dot(&placed.slope);
            normal += found.normal * weight;
            beside += u * weight;
            visit(k, weight, &found);
        }
        let length = normal.norm();
        Touch {
            gap: gap / hat.area,
            by_load: by_load / hat.area,
            normal: if length > 0.0 { normal / length } else { normal },
            beside: beside / hat.area - placed.offset,
        }
    }

    /// $\varepsilon$ of a hat \[stress/length\].
    pub(super) fn proximal(&self, hat: usize) -> f64 {
        self.stiffness.proximal / self.skin.hats[hat].width
    }

    /// $c$ of a hat \[stress/length\].
    pub(super) fn decisive(&self, hat: usize) -> f64 {
        self.stiffness.decisive / self.skin.hats[hat].width
    }

    pub(crate) fn touches(&self, hat: usize, pressure: f64, gap: f64) -> bool {
        pressure > self.decisive(hat) * gap
    }

    /// Where a hat that touches lies beyond an open end of the surface.
    pub(crate) fn passed_end(&self, hat: usize, view: &View<'_>) -> Option<Point<D>> {
        let mut passed = None;
        let points = &self.skin.hats[hat].points;
        let touch = self.touch(hat, view, |k, _, found| {
            if found.passed_end {
                passed = Some(points[k].0);
            }
        });
        let (pressure, _) = self.pressure(hat, view.condensed);
        passed
            .filter(|_| self.touches(hat, pressure, touch.gap))
            .map(|point| self.skin.table.positions()[point as usize] + self.skin.displacement(point, view.displacement))
    }

    /// Gap of a hat, $\nabla\bar g\cdot\delta d$, and its mean displacement beside the surface by the step.
    fn change(&self, hat: usize, view: &View<'_>, step: &[f64]) -> (Touch<D>, f64, Point<D>) {
        let travel = self.carriage.map_or(0.0, |node| step[node as usize * D]);
        let pushed = self.surface.free_direction().map_or_else(Point::zeros, |along| along * travel);
        let (mut change, mut moved) = (0.0, Point::<D>::zeros());
        let points = &self.skin.hats[hat].points;
        let touch = self.touch(hat, view, |k, weight, found| {
            let (point, _) = points[k];
            let by = self.skin.displacement(point, step) - pushed;
            change += weight * found.normal.dot(&by);
            moved += by * weight;
        });
        let area = self.skin.hats[hat].area;
        (touch, change / area, moved / area)
    }
}

impl<const D: usize> Term<D> for RigidContact<D> {
    fn clusters(&self) -> usize {
        self.skin.hats.len()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        &self.skin.hats[cluster].nodes
    }

    fn break_points(&self) -> Vec<f64> {
        self.surface.break_points()
    }

    fn is_unilateral(&self) -> bool {
        true
    }

    fn condensed(&self, cluster: usize) -> std::ops::Range<usize> {
        let stride = self.stride();
        cluster * stride..(cluster + 1) * stride
    }

    fn memory(&self) -> std::ops::Range<usize> {
        let hats = self.skin.hats.len();
        let first = hats * self.stride();
        // Where each hat was beside the surface; without friction that does not matter.
        first..first + if self.rubs() { hats * D } else { 0 }
    }

    fn start_memory(&self, memory: &mut [f64]) {
        let offset = self.surface.placed(0.0, 0.0).offset;
        for was in memory.chunks_exact_mut(D) {
            was.iter_mut().zip(&offset).for_each(|(was, offset)| *was = -offset);
        }
    }

    fn remember(&self, view: View<'_>, next: &mut [f64]) {
        for (hat, now) in next.chunks_exact_mut(D).enumerate() {
            now.copy_from_slice(self.touch(hat, &view, |_, _, _| {}).beside.as_slice());
        }
    }

    fn rounding(&self) -> [f64; 2] {
        self.stiffness.rounding(self.skin.hats.iter(), self.skin.extent)
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        let hat = &self.skin.hats[cluster];
        let size = hat.nodes.len() * D;
        let (pressure, _) = self.pressure(cluster, view.condensed);
        // ∇ḡ A, in the buffer of the element.
        let mut slope = std::mem::take(&mut out.scratch);
        slope.clear();
        slope.resize(size, 0.0);
        let free = self.surface.free_direction();
        let travel = self.carriage.map(|_| size - D);
        let matrix = &mut out.matrix;
        let curved = out.with_matrix && pressure > 0.0;
        let touch = self.touch(cluster, &view, |k, weight, found| {
            let values = self.skin.table.values(hat.points[k].0 as usize);
            let local = hat.local(k);
            for (&l, value) in local.iter().zip(values) {
                for i in 0..D {
                    slope[l as usize * D + i] += weight * value * found.normal[i];
                }
            }
            if let (Some(place), Some(along)) = (travel, &free) {
                slope[place] -= weight * found.normal.dot(along);
            }
            if curved && found.curvature.iter().any(|c| *c != 0.0) {
                let factor = -pressure * weight * (SHARPEST / (hat.width * found.curvature.norm())).min(1.0);
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
        if !self.touches(cluster, pressure, touch.gap) {
            matrix.fill(0.0);
            out.scratch = slope;
            return;
        }
        let proximal = self.proximal(cluster);
        let force = pressure - proximal * touch.gap;
        for (r, s) in out.residual.iter_mut().zip(&slope) {
            *r -= force * s;
        }
        for (l, s) in out.load_slope.iter_mut().zip(&slope) {
            *l += proximal * touch.by_load * s;
        }
        if out.with_matrix {
            for (column, b) in out.matrix.chunks_exact_mut(size).zip(&slope) {
                let factor = proximal / hat.area * b;
                if factor != 0.0 {
                    for (entry, a) in column.iter_mut().zip(&slope) {
                        *entry += factor * a;
                    }
                }
            }
        }
        if self.rubs() {
            self.rub(cluster, &view, &touch, &slope, out);
        }
        out.scratch = slope;
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        let (pressure, traction) = self.pressure(cluster, view.condensed);
        let (touch, change, moved) = self.change(cluster, &view, step);
        condensed_step.fill(0.0);
        if !self.touches(cluster, pressure, touch.gap) {
            condensed_step[0] = -pressure;
            if self.rubs() {
                condensed_step[1..1 + D].iter_mut().zip(&traction).for_each(|(s, t)| *s = -t);
            }
            let most = TOO_FAR * self.skin.hats[cluster].width;
            if touch.gap + change < -most && change < 0.0 {
                return ((touch.gap + most) / -change).min(1.0);
            }
            return 1.0;
        }
        let proximal = self.proximal(cluster);
        condensed_step[0] = -proximal * (touch.gap + change);
        if self.rubs() {
            let along = |v: Point<D>| v - touch.normal * touch.normal.dot(&v);
            let next = match self.grip(cluster, view.condensed, &touch) {
                Grip::Sticks(slip) => along(traction) - (slip + along(moved)) * proximal,
                Grip::Slides(direction, turn) => {
                    let mut turned = along(moved);
                    turned -= direction * direction.dot(&turned);
                    let next = (pressure + condensed_step[0]).max(0.0);
                    let limit = proximal / (self.surface.friction * pressure).max(f64::MIN_POSITIVE);
                    (direction - turned * turn.min(limit)) * (self.surface.friction * next)
                }
            };
            condensed_step[1..1 + D].iter_mut().zip((next - traction).iter()).for_each(|(s, t)| *s = *t);
        }
        1.0
    }

    fn advance_load(&self, cluster: usize, view: View<'_>, load_step: f64, condensed_step: &mut [f64]) {
        let (pressure, _) = self.pressure(cluster, view.condensed);
        let touch = self.touch(cluster, &view, |_, _, _| {});
        if !self.touches(cluster, pressure, touch.gap) {
            return;
        }
        let proximal = self.proximal(cluster);
        condensed_step[0] -= proximal * touch.by_load * load_step;
        if !self.rubs() {
            return;
        }
        let moved = self.placed(view.displacement, view.load).slope * -load_step;
        let next = match self.grip(cluster, view.condensed, &touch) {
            Grip::Sticks(_) => (moved - touch.normal * touch.normal.dot(&moved)) * -proximal,
            Grip::Slides(direction, _) => direction * (-self.surface.friction * proximal * touch.by_load * load_step),
        };
        condensed_step[1..1 + D].iter_mut().zip(&next).for_each(|(step, more)| *step += more);
    }

    fn refuses(&self, view: View<'_>) -> Option<String> {
        (0..self.skin.hats.len()).find_map(|hat| {
            let at = self.passed_end(hat, &view)?.as_slice().to_vec();
            let (contact, load) = (self.surface.name.clone(), view.load);
            Some(ContactError::PassedEnd { contact, at, load }.to_string())
        })
    }

    fn farthest_load(&self, from: f64, to: f64) -> f64 {
        // Equal parts of the way, the last of which ends where it does.
        let parts = if self.rubs() { ((to - from) / FRICTION_STEP - 1e-9).ceil() } else { 1.0 };
        let to = if parts > 1.0 { from + (to - from) / parts } else { to };
        let depth = 0.5 * self.surface.shape.depth();
        let Drive::Moved { by, amplitude } = &self.surface.drive else { return to };
        if !depth.is_finite() {
            return to;
        }
        let way = |load: f64| by.norm() * (amplitude.evaluate(load).0 - amplitude.evaluate(from).0).abs();
        let mut part = 1.0;
        while way(from + part * (to - from)) > depth && part > 1e-3 {
            part *= 0.5;
        }
        from + part * (to - from)
    }
}
