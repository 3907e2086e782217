//! Contact of a body with a rigid surface.

use crate::geometry::Point;
use crate::term::{
    CondensedUnknowns, Curve, Element, History, Product, Protocol, Term, Unilateral, View, Zone, straight_until,
};

use super::contact_surface::Trace;
use super::counted::CountedMean;
use super::facing::THROUGH;
use super::friction::{Friction, friction_step};
use super::rigid::{Drive, Placed};
use super::{ContactError, ContactSurface, Nearest, RigidSurface};

/// Least part of a step of the load that a motion of the surface may ask for.
const LEAST_PART: f64 = 1e-3;

/// How stiff a contact answers between two iterations, from the stiffness of the body and the size of a trace function.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stiffness {
    /// $\varepsilon w$ \[stress\]: the change of a pressure by a gap as wide as the trace function.
    pub proximal: f64,
    /// $c w$ \[stress\]: the weight of a gap compared with a pressure where it is decided whether they touch.
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
const TOO_FAR: f64 = 0.5;

/// The part of a step after which a trace function that does not touch has gone too far in, or further than where it is inside already.
pub(super) fn farthest(gap: f64, change: f64, width: f64) -> f64 {
    let most = gap.max(0.0) + TOO_FAR * width;
    if change < -most { most / -change } else { 1.0 }
}

/// Largest curvature times width that the matrix knows: to a trace function what is rounder is a corner, which no tangent describes.
const SHARPEST: f64 = 4.0;

/// Unilateral contact of a part of the boundary with a rigid surface, with Coulomb's friction or without.
///
/// With the gap $\bar g_J$ of a trace function, a mean of $g(x)$ with $\Theta_J$ in which depth counts for more ([`CountedMean`]), and its
/// pressure $\pi_J$ per reference area, equilibrium is a saddle of $\Pi(d) - \sum_J A_J\\,\pi_J\\,\bar g_J$ with
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
    /// The node whose first component is the travel of a surface that is pushed, and whose second one is the turn of one that is free to turn,
    /// times the lever.
    pub rigid_dof: Option<u32>,
    /// The largest coordinate of the body part \[length\].
    pub lever: f64,
    pub stiffness: Stiffness,
    /// Mean gap of each trace function at rest, where an interference is resolved.
    pub at_rest: Vec<f64>,
    /// Nodes of each facet with that of the surface; none where it has no unknowns.
    facets: Vec<Vec<u32>>,
}

/// What a trace function knows of the surface at a state.
pub(crate) struct LocalContact<const D: usize> {
    /// $\bar g_J$ \[length\], without an interference.
    mean: CountedMean,
    /// $\bar g_J$ \[length\].
    pub gap: f64,
    /// Its change with the load factor.
    pub by_load: f64,
    /// The mean normal, a unit vector.
    pub normal: Point<D>,
    /// The mean displacement of the trace function beside what the surface has gone \[length\].
    pub beside: Point<D>,
    /// By how much the surface has turned \[rad\], and what a unit angle moves it by under the trace function \[length\].
    pub angle: f64,
    pub spun: Point<D>,
    /// How the surface moves under the trace function with the load factor.
    rate: Point<D>,
}

impl<const D: usize> LocalContact<D> {
    /// Mean displacement beside the material of the surface since an earlier state.
    pub(crate) fn slip(&self, beside: &Point<D>, angle: f64) -> Point<D> {
        self.beside - beside - self.spun * (self.angle - angle)
    }
}

impl<const D: usize> RigidContact<D> {
    pub(crate) fn placed(&self, displacement: &[f64], load: f64) -> Placed<D> {
        let own = |i: usize| self.rigid_dof.map_or(0.0, |node| displacement[node as usize * D + i]);
        self.surface.placed(load, [own(0), if self.turns_freely() { own(1) / self.lever } else { 0.0 }])
    }

    fn turns_freely(&self) -> bool {
        self.surface.turning.as_ref().is_some_and(|turning| turning.free)
    }

    /// How the unknowns of the surface itself move it at the end of an arm.
    fn motions(&self, placed: &Placed<D>, arm: &Point<D>) -> [Option<Point<D>>; 2] {
        [self.surface.free_direction(), self.turns_freely().then(|| placed.spun(arm) / self.lever)]
    }

    /// How much a step of the unknowns of the surface moves it at the end of an arm.
    fn moved(&self, placed: &Placed<D>, arm: &Point<D>, step: &[f64]) -> Point<D> {
        let Some(node) = self.rigid_dof else { return Point::zeros() };
        let own = |i: usize| step[node as usize * D + i];
        let motions = self.motions(placed, arm).into_iter().enumerate();
        motions.filter_map(|(i, motion)| motion.map(|motion| motion * own(i))).sum()
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
        let lever = contact_surface.extent;
        let clusters = contact_surface.table.clusters();
        let mut facets = Vec::new();
        if let Some(node) = rigid_dof {
            for facet in 0..clusters.len() {
                let mut nodes = clusters.nodes(facet).to_vec();
                nodes.push(node);
                facets.push(nodes);
            }
        }
        let at_rest = Vec::new();
        let mut contact = RigidContact { contact_surface, surface, rigid_dof, lever, stiffness, at_rest, facets };
        if let Some(interference) = contact.surface.interference.take() {
            let (table, all) = (&contact.contact_surface.table, contact.contact_surface.traces.len());
            let unknowns = D * contact.rigid_dof.map_or(0, |node| node as usize + 1).max(table.node_count());
            let rest = vec![0.0; unknowns];
            let view = View { displacement: &rest, condensed: &[], load: 0.0 };
            let gaps = (0..all).map(|trace| contact.local_contact(trace, &view, |_, _, _, _| {}).gap);
            contact.at_rest = gaps.collect();
            contact.surface.interference = Some(interference);
        }
        contact
    }

    /// Visits the points of a trace function, with their parts in its gap times area, $A_J\\,\partial\bar g_J/\partial g$.
    pub(crate) fn local_contact(
        &self,
        trace: usize,
        view: &View<'_>,
        mut visit: impl FnMut(usize, f64, &Nearest<D>, &Point<D>),
    ) -> LocalContact<D> {
        let (index, trace) = (trace, &self.contact_surface.traces[trace]);
        let placed = self.placed(view.displacement, view.load);
        let mut points = Vec::with_capacity(trace.points.len());
        let mut gaps = Vec::with_capacity(trace.points.len());
        let (mut beside, mut all_arms) = (Point::<D>::zeros(), Point::<D>::zeros());
        for &(point, weight) in &trace.points {
            let u = self.contact_surface.displacement(point, view.displacement);
            let x = self.contact_surface.table.positions()[point as usize] + u;
            let found = placed.nearest(&*self.surface.shape, &x);
            let arm = placed.arm(&x);
            gaps.push((found.gap, weight));
            beside += u * weight;
            all_arms += arm * weight;
            points.push((found, arm));
        }
        let mean = CountedMean::new(&gaps, trace.width);
        let (mut by_load, mut normal) = (0.0, Point::<D>::zeros());
        for (k, ((found, arm), (gap, weight))) in points.iter().zip(&gaps).enumerate() {
            let part = weight * mean.part(*gap);
            by_load -= part * found.normal.dot(&placed.rate(arm));
            normal += found.normal * part;
            visit(k, part, found, arm);
        }
        let (length, arms) = (normal.norm(), all_arms / trace.area);
        let [shift, shift_by_load] = self.shift(index, view.load);
        LocalContact {
            gap: mean.gap + shift,
            mean,
            by_load: by_load / trace.area + shift_by_load,
            normal: if length > 0.0 { normal / length } else { normal },
            beside: beside / trace.area - placed.offset,
            angle: placed.angle(),
            spun: placed.spun(&arms),
            rate: placed.rate(&arms),
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
        let (beside, angle) = self.before(trace, view.condensed);
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
            slip: local_contact.slip(&beside, angle),
            slip_by_load: -local_contact.rate,
            area,
        }
    }

    /// Where a trace function was beside the surface at the last converged state, and by how much the surface had turned.
    fn before(&self, trace: usize, condensed: &[f64]) -> (Point<D>, f64) {
        let variables = &condensed[self.variables()];
        let angle = if self.surface.turning.is_some() { variables[variables.len() - 1] } else { 0.0 };
        (Point::from_fn(|i, _| variables[trace * D + i]), angle)
    }

    /// How unknowns of a trace function move it beside the surface, times its area: displacements by $\int\Theta\Psi_a$, also to where the
    /// surface has turned by another way, and travel and turn of the surface.
    fn moves(&self, trace: usize, view: &View<'_>) -> Vec<(usize, Point<D>)> {
        let (_, was) = self.before(trace, view.condensed);
        let placed = self.placed(view.displacement, view.load);
        let trace = &self.contact_surface.traces[trace];
        let mut values = vec![0.0; trace.nodes.len()];
        let mut arm = Point::<D>::zeros();
        for (k, &(point, weight)) in trace.points.iter().enumerate() {
            for (&l, value) in trace.local(k).iter().zip(self.contact_surface.table.values(point as usize)) {
                values[l as usize] += weight * value;
            }
            if self.surface.turning.is_some() {
                let x = self.contact_surface.table.positions()[point as usize];
                arm += placed.arm(&(x + self.contact_surface.displacement(point, view.displacement)))
                    * (weight / trace.area);
            }
        }
        let turned = |by: Point<D>| by - placed.spun(&by) * (placed.angle() - was);
        let mut moves: Vec<(usize, Point<D>)> = Vec::with_capacity(values.len() * D);
        let unit = |i: usize| turned(Point::<D>::from_fn(|j, _| f64::from(u8::from(i == j))));
        for (a, value) in values.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            moves.extend((0..D).map(|i| (a * D + i, unit(i) * *value)));
        }
        let [along, spun] = self.motions(&placed, &arm);
        for (i, by) in [along.map(turned), spun].into_iter().enumerate() {
            moves.extend(by.map(|by| ((trace.nodes.len() - 1) * D + i, by * -trace.area)));
        }
        moves
    }

    /// Where a trace function that touches lies beyond an open end of the surface.
    pub(crate) fn passed_end(&self, trace: usize, view: &View<'_>) -> Option<Point<D>> {
        let mut passed = None;
        let points = &self.contact_surface.traces[trace].points;
        let local_contact = self.local_contact(trace, view, |k, _, found, _| {
            if found.passed_end {
                passed = Some(points[k].0);
            }
        });
        let (pressure, _) = self.pressure(trace, view.condensed);
        passed.filter(|_| self.is_active(trace, pressure, local_contact.gap)).map(|point| self.place(point, view))
    }

    /// Where the surface has come to the inner side of the body in a step: at one trace function, or all in all, so that it pulls. A surface
    /// presses against the normal of the body; one that has just let go may stand beside it or behind another part of the boundary, and one
    /// that is smaller than a trace function may never have touched.
    fn passed_through(&self, before: &View<'_>, after: &View<'_>) -> Option<Point<D>> {
        let (mut pull, mut most, mut at) = (0.0, f64::NEG_INFINITY, 0);
        for (index, trace) in self.contact_surface.traces.iter().enumerate() {
            let mut along = 0.0;
            let now = self.local_contact(index, after, |k, _, found, _| {
                let (point, weight) = trace.points[k];
                let outward = self.contact_surface.outward(point, after.displacement);
                let cosine = (0..D).map(|i| found.normal[i] * outward[i]).sum::<f64>() / outward.norm();
                along += weight / trace.area * cosine;
            });
            let pressure = self.pressure(index, after.condensed).0;
            let touches = self.is_active(index, pressure, now.gap);
            let touched = || {
                let gap = self.local_contact(index, before, |_, _, _, _| {}).gap;
                self.is_active(index, self.pressure(index, before.condensed).0, gap)
            };
            let is_small = now.gap < trace.width && self.surface.shape.depth() < trace.width;
            if along > THROUGH && (touches || is_small || touched()) && !self.is_shielded(index, after) {
                return Some(self.place(trace.points[0].0, after));
            }
            if touches {
                // Below zero a pressure is rounding.
                pull += pressure.max(0.0) * trace.area * along;
                (most, at) = if along > most { (along, trace.points[0].0) } else { (most, at) };
            }
        }
        (pull > 0.0).then(|| self.place(at, after))
    }

    /// Whether most of the nearest places of the surface are beside another part of the boundary: the body has slipped past it there.
    fn is_shielded(&self, trace: usize, view: &View<'_>) -> bool {
        let (table, mut shielded) = (&self.contact_surface.table, 0.0);
        self.local_contact(trace, view, |k, _, found, _| {
            let (point, weight) = self.contact_surface.traces[trace].points[k];
            let nearest = self.place(point, view) - found.normal * found.gap;
            let mut others = 0..table.positions().len() as u32;
            if found.gap > 0.0 && others.any(|p| (self.place(p, view) - nearest).norm() < 0.5 * found.gap) {
                shielded += weight;
            }
        });
        shielded > 0.5 * self.contact_surface.traces[trace].area
    }

    /// Where a point of the boundary is.
    fn place(&self, point: u32, view: &View<'_>) -> Point<D> {
        self.contact_surface.table.positions()[point as usize]
            + self.contact_surface.displacement(point, view.displacement)
    }

    /// Gap of a trace function, $\nabla\bar g\cdot\delta d$, and its mean displacement beside the surface by the step.
    fn change(&self, trace: usize, view: &View<'_>, step: &[f64]) -> (LocalContact<D>, f64, Point<D>) {
        let placed = self.placed(view.displacement, view.load);
        let (mut change, mut moved) = (0.0, Point::<D>::zeros());
        let points = &self.contact_surface.traces[trace].points;
        let was = if self.has_friction() { self.before(trace, view.condensed).1 } else { 0.0 };
        let local_contact = self.local_contact(trace, view, |k, part, found, arm| {
            let (point, weight) = points[k];
            let (by, pushed) = (self.contact_surface.displacement(point, step), self.moved(&placed, arm, step));
            change += part * found.normal.dot(&(by - pushed));
            let along = self.moved(&placed, &Point::zeros(), step);
            moved += (by - pushed - placed.spun(&(by - along)) * (placed.angle() - was)) * weight;
        });
        let area = self.contact_surface.traces[trace].area;
        (local_contact, change / area, moved / area)
    }
}

impl<const D: usize> RigidContact<D> {
    /// Adds the second derivatives of the gaps over a facet, times the pressures there, by displacements and by the motions of the surface,
    /// whose normal turns with it; of one that lets go in this iteration the pressure counts too, and is none in the next. Point by point,
    /// for each lies under many trace functions.
    fn add_curvature(&self, facet: usize, view: &View<'_>, matrix: &mut [f64]) {
        let (contact_surface, table) = (&self.contact_surface, &self.contact_surface.table);
        let placed = self.placed(view.displacement, view.load);
        let mut means: Vec<(u32, CountedMean)> = Vec::new();
        for point in table.clusters().points(facet) {
            let (mut by_normal, mut by_square, mut found) = (0.0, 0.0, None);
            for &(trace, weight) in &contact_surface.over[point] {
                let force = weight * self.pressure(trace as usize, view.condensed).0.max(0.0);
                if force == 0.0 {
                    continue;
                }
                let mean = match means.iter().find(|(other, _)| *other == trace) {
                    Some((_, mean)) => *mean,
                    None => {
                        let mean = self.local_contact(trace as usize, view, |_, _, _, _| {}).mean;
                        means.push((trace, mean));
                        mean
                    }
                };
                let nearest: &Nearest<D> =
                    found.get_or_insert_with(|| placed.nearest(&*self.surface.shape, &self.place(point as u32, view)));
                let bent = contact_surface.traces[trace as usize].width * nearest.curvature.norm();
                by_normal -= force * mean.part(nearest.gap) * (SHARPEST / bent).min(1.0);
                by_square -= force * mean.curvature(nearest.gap);
            }
            let Some(found) = found else { continue };
            let motions = self.motions(&placed, &placed.arm(&self.place(point as u32, view)));
            let seen = (table.clusters().local(point), table.values(point));
            if by_square != 0.0 {
                Self::add_depth(by_square, (&found, &motions), seen, matrix);
            }
            if found.curvature.norm() != 0.0 || motions[1].is_some() {
                Self::add_bent(by_normal, &found, seen, matrix);
                self.add_turned(by_normal, (&found, &placed, &motions), seen, matrix);
            }
        }
    }

    /// Adds what the second derivatives of the gap of a trace function have beside those of its points: depth counts from the mean,
    /// $\int\Theta\\,c''\\,(\nabla g - \nabla\bar g)(\nabla g - \nabla\bar g)^T$. Pressures that are kept uncondensed do without it: for an increment that
    /// leaves the mean gap as it is it vanishes.
    fn add_mean(&self, trace: usize, view: &View<'_>, mean: &CountedMean, slope: &[f64], matrix: &mut [f64]) {
        let pressure = self.pressure(trace, view.condensed).0.max(0.0);
        let (surface, size) = (&self.contact_surface, slope.len());
        let trace = &surface.traces[trace];
        let placed = self.placed(view.displacement, view.load);
        let (mut bent, mut whole) = (vec![0.0; size], 0.0);
        for (k, &(point, weight)) in trace.points.iter().enumerate() {
            let x = self.place(point, view);
            let found = placed.nearest(&*self.surface.shape, &x);
            let factor = -pressure * weight * mean.curvature(found.gap);
            if factor == 0.0 {
                continue;
            }
            whole += factor;
            for (&l, value) in trace.local(k).iter().zip(surface.table.values(point as usize)) {
                (0..D).for_each(|i| bent[l as usize * D + i] += factor * value * found.normal[i]);
            }
            for (i, motion) in self.motions(&placed, &placed.arm(&x)).iter().enumerate() {
                if let Some(motion) = motion {
                    bent[size - D + i] -= factor * found.normal.dot(motion);
                }
            }
        }
        if whole == 0.0 {
            return;
        }
        let (by_area, by_square) = (1.0 / trace.area, whole / trace.area.powi(2));
        for (column, (slope_b, bent_b)) in matrix.chunks_exact_mut(size).zip(slope.iter().zip(&bent)) {
            for (entry, (slope_a, bent_a)) in column.iter_mut().zip(slope.iter().zip(&bent)) {
                *entry += by_square * slope_a * slope_b - by_area * (slope_a * bent_b + bent_a * slope_b);
            }
        }
    }

    /// Adds a factor times the second derivatives of the gap of a point by its displacements.
    fn add_bent(factor: f64, found: &Nearest<D>, (local, values): (&[u16], &[f64]), matrix: &mut [f64]) {
        let size = matrix.len().isqrt();
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
    }

    /// Adds a factor times the square of the derivative of the gap of a point, by its displacements and the motions of the surface.
    fn add_depth(
        factor: f64,
        (found, motions): (&Nearest<D>, &[Option<Point<D>>; 2]),
        (local, values): (&[u16], &[f64]),
        matrix: &mut [f64],
    ) {
        let size = matrix.len().isqrt();
        let mut slope: Vec<(usize, f64)> = Vec::with_capacity(values.len() * D + motions.len());
        for (&a, value) in local.iter().zip(values) {
            slope.extend((0..D).map(|i| (a as usize * D + i, value * found.normal[i])));
        }
        for (m, motion) in motions.iter().enumerate() {
            slope.extend(motion.map(|motion| (size - D + m, -found.normal.dot(&motion))));
        }
        for &(column, right) in &slope {
            for &(row, left) in &slope {
                matrix[column * size + row] += factor * left * right;
            }
        }
    }

    /// Adds a factor times the second derivatives of the gap of a point by the motions of the surface.
    fn add_turned(
        &self,
        factor: f64,
        (found, placed, motions): (&Nearest<D>, &Placed<D>, &[Option<Point<D>>; 2]),
        (local, values): (&[u16], &[f64]),
        matrix: &mut [f64],
    ) {
        let size = matrix.len().isqrt();
        let spun = [Point::zeros(), placed.spun(&found.normal) / self.lever];
        for (m, motion) in motions.iter().enumerate() {
            let Some(motion) = motion else { continue };
            // The change of the normal with this motion.
            let turned = spun[m] - found.curvature * motion;
            let place = size - D + m;
            for (&a, value) in local.iter().zip(values) {
                for i in 0..D {
                    let entry = factor * value * turned[i];
                    matrix[place * size + a as usize * D + i] += entry;
                    matrix[(a as usize * D + i) * size + place] += entry;
                }
            }
            for (l, other) in motions.iter().enumerate().take(m + 1) {
                let Some(other) = other else { continue };
                let (entry, row) = (-factor * turned.dot(other), size - D + l);
                matrix[place * size + row] += entry;
                if l != m {
                    matrix[row * size + place] += entry;
                }
            }
        }
    }

    /// The nodes that the points of a facet see, and that of the surface's own unknowns.
    fn facet_nodes(&self, facet: usize) -> &[u32] {
        match self.rigid_dof {
            Some(_) => &self.facets[facet],
            None => self.contact_surface.table.clusters().nodes(facet),
        }
    }

    /// The facet whose curvature a cluster stands for, behind those of the trace functions.
    fn facet_of(&self, cluster: usize) -> Option<usize> {
        cluster.checked_sub(self.contact_surface.traces.len())
    }
}

impl<const D: usize> Term for RigidContact<D> {
    fn dim(&self) -> usize {
        D
    }

    fn clusters(&self) -> usize {
        self.contact_surface.traces.len() + self.contact_surface.table.clusters().len()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        match self.facet_of(cluster) {
            Some(facet) => self.facet_nodes(facet),
            None => &self.contact_surface.traces[cluster].nodes,
        }
    }

    fn break_points(&self) -> Vec<f64> {
        let mut found = self.surface.break_points();
        found.extend(self.surface.interference.map(|interference| interference.until));
        found
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        if let Some(facet) = self.facet_of(cluster) {
            if out.with_matrix {
                self.add_curvature(facet, &view, &mut out.matrix);
            }
            return;
        }
        let trace = &self.contact_surface.traces[cluster];
        let size = trace.nodes.len() * D;
        let (pressure, _) = self.pressure(cluster, view.condensed);
        // ∇ḡ A, in the buffer of the element.
        let mut slope = std::mem::take(&mut out.scratch);
        slope.clear();
        slope.resize(size, 0.0);
        let placed = self.placed(view.displacement, view.load);
        let local_contact = self.local_contact(cluster, &view, |k, part, found, arm| {
            let values = self.contact_surface.table.values(trace.points[k].0 as usize);
            let motions = self.motions(&placed, arm);
            for (&l, value) in trace.local(k).iter().zip(values) {
                for i in 0..D {
                    slope[l as usize * D + i] += part * value * found.normal[i];
                }
            }
            for (i, motion) in motions.iter().enumerate() {
                if let Some(motion) = motion {
                    slope[size - D + i] -= part * found.normal.dot(motion);
                }
            }
        });
        if !self.is_active(cluster, pressure, local_contact.gap) {
            out.scratch = slope;
            return;
        }
        let proximal = self.proximal(cluster);
        // Pressures that are kept uncondensed have a row of their own for the gap.
        let condensed = out.uncondensed.is_none();
        let force = pressure - if condensed { proximal * local_contact.gap } else { 0.0 };
        for (r, s) in out.residual.iter_mut().zip(&slope) {
            *r -= force * s;
        }
        for (l, s) in out.load_slope.iter_mut().zip(&slope) {
            *l += proximal * local_contact.by_load * s;
        }
        if let Some(zone) = &mut out.uncondensed {
            zone.slopes.extend(slope.iter().map(|s| *s as f32));
            zone.hessian[0][0] = proximal / trace.area;
            zone.of_pi[0] = local_contact.gap * trace.area;
            // A pressure that changes from one trace function to the next meets w/μ.
            zone.shear = self.stiffness.decisive / (trace.area * trace.width);
        }
        if out.with_matrix && condensed {
            let square = proximal / trace.area;
            for (column, b) in out.matrix.chunks_exact_mut(size).zip(&slope) {
                let factor = square * b;
                if factor != 0.0 {
                    for (entry, a) in column.iter_mut().zip(&slope) {
                        *entry += factor * a;
                    }
                }
            }
            self.add_mean(cluster, &view, &local_contact.mean, &slope, &mut out.matrix);
        }
        if self.has_friction() {
            self.friction(cluster, &view, &local_contact).add(&self.moves(cluster, &view), &slope, out);
        }
        out.scratch = slope;
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        if self.facet_of(cluster).is_some() {
            return 1.0;
        }
        let (pressure, traction) = self.pressure(cluster, view.condensed);
        let (local_contact, change, moved) = self.change(cluster, &view, step);
        condensed_step.fill(0.0);
        if !self.is_active(cluster, pressure, local_contact.gap) {
            condensed_step[0] = -pressure;
            if self.has_friction() {
                condensed_step[1..1 + D].iter_mut().zip(&traction).for_each(|(s, t)| *s = -t);
            }
            return farthest(local_contact.gap, change, self.contact_surface.traces[cluster].width);
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

    fn protocol(&self) -> &dyn Protocol {
        self
    }
}

/// Where pressures are kept uncondensed, an iteration solves for $q = -\delta\pi$ beside the displacements:
/// $A\\,\nabla\bar g\cdot\delta d - q\\,A/\varepsilon = -A\\,\bar g$, so that what it leaves of a gap is not multiplied by $\varepsilon$.
impl<const D: usize> Protocol for RigidContact<D> {
    fn keeps_pressures(&self) -> bool {
        !self.has_friction()
    }

    fn multiply(&self, zone: &Zone, _: &[f64], product: &mut Product) {
        product.values.clear();
        product.values.resize(D * zone.nodes.len(), 0.0);
    }

    fn take_pressures(&self, pressures: &[f64; 4], condensed_step: &mut [f64]) {
        condensed_step[0] = -pressures[0];
    }
}

impl<const D: usize> CondensedUnknowns for RigidContact<D> {
    fn unknowns(&self, cluster: usize) -> std::ops::Range<usize> {
        let (stride, traces) = (self.stride(), self.contact_surface.traces.len());
        cluster.min(traces) * stride..(cluster + 1).min(traces) * stride
    }
}

impl<const D: usize> History for RigidContact<D> {
    fn variables(&self) -> std::ops::Range<usize> {
        let traces = self.contact_surface.traces.len();
        let first = traces * self.stride();
        // Where each trace function was beside the surface; without friction that does not matter.
        let turned = usize::from(self.surface.turning.is_some());
        first..first + if self.has_friction() { traces * D + turned } else { 0 }
    }

    fn start_variables(&self, variables: &mut [f64]) {
        let placed = self.surface.placed(0.0, [0.0; 2]);
        let traces = self.contact_surface.traces.len();
        for was in variables.chunks_exact_mut(D).take(traces) {
            was.iter_mut().zip(&placed.offset).for_each(|(was, offset)| *was = -offset);
        }
        variables.iter_mut().skip(traces * D).for_each(|was| *was = placed.angle());
    }

    fn update(&self, view: View<'_>, next: &mut [f64]) {
        let traces = self.contact_surface.traces.len();
        for (trace, now) in next.chunks_exact_mut(D).take(traces).enumerate() {
            now.copy_from_slice(self.local_contact(trace, &view, |_, _, _, _| {}).beside.as_slice());
        }
        let angle = self.placed(view.displacement, view.load).angle();
        next.iter_mut().skip(traces * D).for_each(|now| *now = angle);
    }
}

impl<const D: usize> Unilateral for RigidContact<D> {
    fn rounding(&self) -> [f64; 2] {
        self.stiffness.rounding(self.contact_surface.traces.iter(), self.contact_surface.extent)
    }

    fn advance_load(&self, cluster: usize, view: View<'_>, load_step: f64, condensed_step: &mut [f64]) {
        if self.facet_of(cluster).is_some() {
            return;
        }
        let (pressure, _) = self.pressure(cluster, view.condensed);
        let local_contact = self.local_contact(cluster, &view, |_, _, _, _| {});
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

    fn check_step(&self, before: View<'_>, after: View<'_>) -> Option<String> {
        let traces = 0..self.contact_surface.traces.len();
        let (contact, load) = (self.surface.name.clone(), after.load);
        if let Some(at) = traces.clone().find_map(|trace| self.passed_end(trace, &after)) {
            return Some(ContactError::PassedEnd { contact, at: at.as_slice().to_vec(), load }.to_string());
        }
        let at = self.passed_through(&before, &after)?;
        Some(ContactError::PassedThrough { contact, at: at.as_slice().to_vec(), load }.to_string())
    }

    fn farthest_load(&self, from: f64, to: f64) -> f64 {
        let to = if self.has_friction() { friction_step(from, to) } else { to };
        let moves = matches!(self.surface.drive, Drive::Moved { .. }) || self.surface.turning.is_some();
        if !moves {
            return to;
        }
        let start = self.surface.placed(from, [0.0; 2]);
        let positions = self.contact_surface.table.positions().iter();
        let lever = positions.map(|x| start.spun(&start.arm(x)).norm()).fold(0.0, f64::max);
        // A motion that returns or turns far within one step would not be seen, however thick the surface is.
        let curve = Curve::new(|load: f64| {
            let placed = self.surface.placed(load, [0.0; 2]);
            let (sine, cosine) = placed.angle().sin_cos();
            placed.offset.iter().copied().chain([lever * sine, lever * cosine]).collect()
        });
        let to = straight_until(from, to, LEAST_PART * (to - from), |from, to| curve.is_straight(from, to));
        let depth = 0.5 * self.surface.shape.depth();
        if !depth.is_finite() {
            return to;
        }
        let travel = |load: f64| {
            let placed = self.surface.placed(load, [0.0; 2]);
            (placed.offset - start.offset).norm() + lever * (placed.angle() - start.angle()).abs()
        };
        let mut part = 1.0;
        while travel(from + part * (to - from)) > depth && part > LEAST_PART {
            part *= 0.5;
        }
        from + part * (to - from)
    }
}
