//! Contact of a body with a rigid surface.

use nalgebra::Vector3;

use crate::geometry::{Point, padded};
use crate::term::{
    CondensedUnknowns, Curve, Element, History, Product, Protocol, Term, Unilateral, View, Zone, straight_until,
};

use super::counted::CountedMean;
use super::facing::THROUGH;
use super::friction::friction_step;
use super::law::{Gradients, Pressed, Slipping, Stiffness, Touch};
use super::rigid::{Drive, Placed};
use super::{ContactError, ContactLaw, ContactSurface, Nearest, RigidSurface};

/// Least part of a step of the load that a motion of the surface may ask for.
const LEAST_PART: f64 = 1e-3;

/// Largest curvature times width that the matrix knows: to a trace function what is rounder is a corner, which no tangent describes.
const SHARPEST: f64 = 4.0;

/// Contact of a part of the boundary with a rigid surface, by the law [`ContactLaw`]: the gap of a trace function is a mean of $g(x)$ with
/// $\Theta_J$ in which depth counts for more ([`CountedMean`]).
pub(crate) struct RigidContact<const D: usize> {
    pub contact_surface: ContactSurface<D>,
    pub surface: RigidSurface<D>,
    /// The node whose first component is the travel of a surface that is pushed, and whose second one is the turn of one that is free to turn,
    /// times the lever.
    pub rigid_dof: Option<u32>,
    /// The largest coordinate of the body part \[length\].
    pub lever: f64,
    pub law: ContactLaw,
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
        let law = ContactLaw::new(stiffness, surface.friction, None);
        let mut contact = RigidContact { contact_surface, surface, rigid_dof, lever, law, facets };
        if contact.surface.interference.is_some() {
            let (table, all) = (&contact.contact_surface.table, contact.contact_surface.traces.len());
            let unknowns = D * contact.rigid_dof.map_or(0, |node| node as usize + 1).max(table.node_count());
            let rest = vec![0.0; unknowns];
            let view = View { displacement: &rest, condensed: &[], load: 0.0 };
            let gaps = (0..all).map(|trace| contact.local_contact(trace, &view, |_, _, _, _| {}).gap);
            contact.law.at_rest = gaps.collect();
            contact.law.interference = contact.surface.interference;
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
        let [shift, shift_by_load] = self.law.shift(index, view.load);
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

    /// What the law asks of a trace function.
    fn touch(&self, trace: usize, view: &View<'_>, local_contact: &LocalContact<D>) -> Touch<D> {
        let slipping = self.law.has_friction().then(|| {
            let (beside, angle) = self.before(trace, view.condensed);
            let slip = local_contact.slip(&beside, angle);
            Slipping { normal: local_contact.normal, slip, by_load: -local_contact.rate }
        });
        let own = (trace, &self.contact_surface.traces[trace]);
        self.law.touch(own, view.condensed, [local_contact.gap, local_contact.by_load], slipping)
    }

    fn touches(&self, trace: usize, view: &View<'_>) -> bool {
        self.touch(trace, view, &self.local_contact(trace, view, |_, _, _, _| {})).is_active()
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

    /// Gaps and forces at a state, the moment of the forces about the origin, and how deep the deepest point lies behind the surface.
    pub(crate) fn pressed(&self, view: &View<'_>) -> (Pressed<D>, Vector3<f64>, f64) {
        let mut all = Pressed::new(self.contact_surface.traces.len());
        let (mut moment, mut depth) = (Vector3::zeros(), 0.0f64);
        for (k, trace) in self.contact_surface.traces.iter().enumerate() {
            let (pressure, friction) = self.law.pressure::<D>(k, view.condensed);
            let (mut force, mut own) = (Point::<D>::zeros(), Vector3::zeros());
            let local_contact = self.local_contact(k, view, |p, part, nearest, _| {
                let (point, weight) = trace.points[p];
                depth = depth.max(-nearest.gap);
                let push = nearest.normal * (pressure * part) + friction * weight;
                force += push;
                own += padded::<D, 3>(&self.place(point, view)).cross(&padded(&push));
            });
            all.gaps[k] = local_contact.gap;
            all.active[k] = self.touch(k, view, &local_contact).is_active();
            if all.active[k] {
                all.slides[k] = self.law.slides(pressure, &friction);
                all.normal_forces[k] = pressure * trace.area;
                all.forces[k] = force;
                all.total += force;
                moment += own;
            }
        }
        (all, moment, depth)
    }

    /// The work of friction between two states \[force·length\].
    pub(crate) fn friction_work(&self, before: &View<'_>, after: &View<'_>) -> f64 {
        self.law.work(&self.contact_surface, [before.condensed, after.condensed], |trace| {
            let [was, now] = [before, after].map(|view| self.local_contact(trace, view, |_, _, _, _| {}));
            now.slip(&was.beside, was.angle)
        })
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
        passed.filter(|_| self.touch(trace, view, &local_contact).is_active()).map(|point| self.place(point, view))
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
            let touch = self.touch(index, after, &now);
            let is_small = now.gap < trace.width && self.surface.shape.depth() < trace.width;
            let touched = || touch.is_active() || is_small || self.touches(index, before);
            if along > THROUGH && touched() && !self.is_shielded(index, after) {
                return Some(self.place(trace.points[0].0, after));
            }
            if touch.is_active() {
                // Below zero a pressure is rounding.
                pull += touch.pressure.max(0.0) * trace.area * along;
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
        let was = if self.law.has_friction() { self.before(trace, view.condensed).1 } else { 0.0 };
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
                let force = weight * self.law.pressure::<D>(trace as usize, view.condensed).0.max(0.0);
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
        let pressure = self.law.pressure::<D>(trace, view.condensed).0.max(0.0);
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
        found.extend(self.law.interference.map(|interference| interference.until));
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
        let touch = self.touch(cluster, &view, &local_contact);
        let mut gradients = Gradients { slope, ..Gradients::default() };
        if touch.is_active() {
            let moves = if self.law.has_friction() { self.moves(cluster, &view) } else { Vec::new() };
            let kept = out.uncondensed.is_some();
            touch.add(&gradients, &moves, out);
            if out.with_matrix && !kept {
                self.add_mean(cluster, &view, &local_contact.mean, &gradients.slope, &mut out.matrix);
            }
        }
        out.scratch = std::mem::take(&mut gradients.slope);
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        if self.facet_of(cluster).is_some() {
            return 1.0;
        }
        let (local_contact, change, moved) = self.change(cluster, &view, step);
        let touch = self.touch(cluster, &view, &local_contact);
        touch.advance(change, &moved, condensed_step);
        if touch.is_active() { 1.0 } else { touch.farthest(change) }
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
        !self.law.has_friction()
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
        let (stride, traces) = (self.law.stride(D), self.contact_surface.traces.len());
        cluster.min(traces) * stride..(cluster + 1).min(traces) * stride
    }
}

impl<const D: usize> History for RigidContact<D> {
    fn variables(&self) -> std::ops::Range<usize> {
        let traces = self.contact_surface.traces.len();
        let first = traces * self.law.stride(D);
        // Where each trace function was beside the surface; without friction that does not matter.
        let turned = usize::from(self.surface.turning.is_some());
        first..first + if self.law.has_friction() { traces * D + turned } else { 0 }
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
        self.law.rounding(&self.contact_surface, self.contact_surface.extent)
    }

    fn advance_load(&self, cluster: usize, view: View<'_>, load_step: f64, condensed_step: &mut [f64]) {
        if self.facet_of(cluster).is_none() {
            let local_contact = self.local_contact(cluster, &view, |_, _, _, _| {});
            self.touch(cluster, &view, &local_contact).advance_load(load_step, condensed_step);
        }
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
        let to = if self.law.has_friction() { friction_step(from, to) } else { to };
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
