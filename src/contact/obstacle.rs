//! Contact of a body with a rigid surface.

use crate::error::Invalid;
use crate::geometry::{Point, Vec3, unit};
use crate::term::{Curve, Element, Layout, Term, TermStep, View, straight_until};

use super::contact_surface::Trace;
use super::counted::CountedMean;
use super::facing::THROUGH;
use super::friction::friction_step;
use super::law::{Gradients, Pressed, Slipping, Stiffness, Touch, started, three};
use super::rigid::{Obstacle, Placed};
use super::{ContactError, ContactLaw, ContactSurface, Nearest};

/// Least part of a step of the load that a motion of the surface may ask for.
const LEAST_PART: f64 = 1e-3;

/// Largest curvature times width that the matrix knows: to a trace function what is rounder is a corner, which no tangent describes.
const SHARPEST: f64 = 4.0;

/// Contact of a part of the boundary with a rigid surface, by the law [`ContactLaw`]: the gap of a trace function is a mean of $g(x)$ with
/// $\Theta_J$ in which depth counts for more ([`CountedMean`]).
pub(crate) struct RigidContact {
    pub contact_surface: ContactSurface,
    pub surface: Obstacle,
    /// The node whose first component is the travel of a surface that is pushed, and whose second one is the turn of one that is free to turn,
    /// times the lever.
    pub rigid_dof: Option<u32>,
    /// The largest coordinate of the body part \[length\].
    pub lever: f64,
    pub law: ContactLaw,
    /// For each trace function the components in which conditions fix the particle and the surface does not move: sticking would repeat
    /// their equations.
    fixed: Vec<[bool; 3]>,
    /// Nodes of each facet with that of the surface; none where it has no unknowns.
    facets: Vec<Vec<u32>>,
}

/// What a trace function knows of the surface at a state.
pub(crate) struct LocalContact {
    /// $\bar g_J$ \[length\], without an interference.
    mean: CountedMean,
    /// $\bar g_J$ \[length\].
    pub gap: f64,
    /// Its change with the load factor.
    pub by_load: f64,
    /// The mean normal, a unit vector.
    pub normal: Vec3,
    /// The mean displacement of the trace function beside what the surface has gone \[length\].
    pub beside: Vec3,
    /// By how much the surface has turned \[rad\].
    pub angle: f64,
    /// The mean way to the trace function from the axis, where the surface turns \[length\].
    arm: Vec3,
    placed: Placed,
}

/// A point of the boundary beside the surface.
pub(crate) struct Beside {
    pub point: u32,
    moved: Vec3,
    place: Vec3,
    pub found: Nearest<3>,
    arm: Vec3,
    /// How the unknowns of the surface itself move it there: its travel and its turn, times the lever.
    motions: [Option<Vec3>; 2],
}

impl LocalContact {
    /// Mean slip on the material of the surface since an earlier state, $s = a - R\,a_0$, $a_0$ and $a$ the ways from the axis to the trace
    /// function then and now, $R$ the turn of the surface in between. $\partial s/\partial u = 1$: the force of friction is its traction.
    pub(crate) fn slip(&self, beside: &Vec3, angle: f64) -> Vec3 {
        self.arm - self.placed.carried(self.arm - (self.beside - beside), angle)
    }
}

impl RigidContact {
    pub(crate) fn placed(&self, displacement: &[f64], load: f64) -> Placed {
        let own = |i: usize| self.rigid_dof.map_or(0.0, |node| displacement[node as usize * self.law.dim + i]);
        self.surface.placed(load, [own(0), if self.turns_freely() { own(1) / self.lever } else { 0.0 }])
    }

    fn turns_freely(&self) -> bool {
        self.surface.turning.as_ref().is_some_and(|turning| turning.free)
    }

    /// A point of the boundary beside the surface.
    fn beside(&self, placed: &Placed, point: u32, view: &View<'_>) -> Beside {
        let moved = self.contact_surface.table.displacement(point as usize, view.displacement);
        let place = self.contact_surface.table.positions[point as usize] + moved;
        let arm = placed.arm(&place);
        let spun = self.turns_freely().then(|| placed.spun(&arm) / self.lever);
        let found = placed.nearest(&*self.surface.shape, &place);
        Beside { point, moved, place, found, arm, motions: [self.surface.free_direction(), spun] }
    }

    /// What the surface tells of the first point of the boundary beside which it has no gap or no normal: a gap that is NaN would be taken
    /// for an open one.
    pub(crate) fn undefined(&self, view: &View<'_>) -> Option<Invalid> {
        let placed = self.placed(view.displacement, view.load);
        let undefined = |point: usize| {
            let Beside { place, found, .. } = self.beside(&placed, point as u32, view);
            let numbers = std::iter::once(found.gap).filter(|gap| gap.is_nan());
            let value = numbers.chain(found.normal.iter().copied().filter(|n| !n.is_finite())).next()?;
            let (name, at) = (&self.surface.name, self.contact_surface.coordinates(&place));
            let what = format!("{name}: gap or normal by Surface::nearest at x = {at:?}");
            Some(Invalid::new(what, value, "return numbers wherever the body may come"))
        };
        (0..self.contact_surface.table.len()).find_map(undefined)
    }

    /// Visits what unknowns of a cluster of `size` move a point by beside the surface: displacements of the nodes that it sees, by their places
    /// there, then those of the surface itself.
    fn motions(&self, size: usize, beside: &Beside, seen: (&[u16], &[f64]), mut visit: impl FnMut(usize, Vec3)) {
        let dim = self.law.dim;
        for (&node, value) in seen.0.iter().zip(seen.1) {
            (0..dim).for_each(|i| visit(node as usize * dim + i, unit(i) * *value));
        }
        for (m, motion) in beside.motions.iter().enumerate() {
            motion.iter().for_each(|motion| visit(size - dim + m, -motion));
        }
    }

    /// The contact of a boundary part with a surface, of a body that begins with a displacement.
    pub(crate) fn new(
        contact_surface: ContactSurface,
        surface: Obstacle,
        moved: &[f64],
        rigid_dof: Option<u32>,
        stiffness: Stiffness,
        fixes: impl Fn(usize, usize) -> bool,
    ) -> Self {
        let of = |trace: &Trace| std::array::from_fn(|i| surface.stays_along(i) && fixes(trace.particle as usize, i));
        let fixed = contact_surface.traces.iter().map(of).collect();
        let lever = contact_surface.extent;
        let clusters = &contact_surface.table.clusters;
        let mut facets = Vec::new();
        if let Some(node) = rigid_dof {
            for facet in 0..clusters.count() {
                let mut nodes = clusters.nodes(facet).to_vec();
                nodes.push(node);
                facets.push(nodes);
            }
        }
        let law = ContactLaw::new(contact_surface.table.dim, stiffness, surface.friction, None);
        let mut contact = RigidContact { contact_surface, surface, rigid_dof, lever, law, fixed, facets };
        if contact.surface.interference.is_some() {
            let (table, all) = (&contact.contact_surface.table, contact.contact_surface.traces.len());
            let unknowns = table.dim * contact.rigid_dof.map_or(0, |node| node as usize + 1).max(table.node_count);
            let rest = started(moved, unknowns);
            let view = View::at_rest(&rest, 0.0);
            let gaps = (0..all).map(|trace| contact.local_contact(trace, &view, |_, _, _| {}).gap);
            contact.law.at_rest = gaps.collect();
            contact.law.interference = contact.surface.interference;
        }
        contact
    }

    /// Visits the points of a trace function, with their parts in its gap times area, $A_J\\,\partial\bar g_J/\partial g$, and what depth has
    /// besides in the second derivatives, $w\\,c''$.
    pub(crate) fn local_contact(
        &self,
        trace: usize,
        view: &View<'_>,
        mut visit: impl FnMut(usize, [f64; 2], &Beside),
    ) -> LocalContact {
        let (index, trace) = (trace, &self.contact_surface.traces[trace]);
        let placed = self.placed(view.displacement, view.load);
        let mut points = Vec::with_capacity(trace.points.len());
        let mut gaps = Vec::with_capacity(trace.points.len());
        let (mut moved, mut all_arms) = (Vec3::zeros(), Vec3::zeros());
        for &(point, weight) in &trace.points {
            let beside = self.beside(&placed, point, view);
            gaps.push((beside.found.gap, weight));
            moved += beside.moved * weight;
            all_arms += beside.arm * weight;
            points.push(beside);
        }
        let mean = CountedMean::new(&gaps, trace.width);
        let (mut by_load, mut normal) = (0.0, Vec3::zeros());
        for (k, (beside, (gap, weight))) in points.iter().zip(&gaps).enumerate() {
            let part = weight * mean.part(*gap);
            by_load -= part * beside.found.normal.dot(&placed.rate(&beside.arm));
            normal += beside.found.normal * part;
            visit(k, [part, weight * mean.curvature(*gap)], beside);
        }
        let (length, arms) = (normal.norm(), all_arms / trace.area);
        let [shift, shift_by_load] = self.law.shift(index, view.load);
        LocalContact {
            gap: mean.gap + shift,
            mean,
            by_load: by_load / trace.area + shift_by_load,
            normal: if length > 0.0 { normal / length } else { normal },
            beside: moved / trace.area - placed.offset,
            angle: placed.angle(),
            arm: arms,
            placed,
        }
    }

    /// What the law asks of a trace function, whose points are visited.
    fn touch(
        &self,
        trace: usize,
        view: &View<'_>,
        visit: impl FnMut(usize, [f64; 2], &Beside),
    ) -> (Touch, LocalContact) {
        let local_contact = self.local_contact(trace, view, visit);
        let slipping = self.law.has_friction().then(|| {
            let (beside, angle) = self.before(trace, view.history);
            let slip = local_contact.slip(&beside, angle);
            let by_load = -local_contact.placed.rate(&(local_contact.arm - slip));
            let slipping = Slipping { normal: local_contact.normal, slip, by_load, fixed: None };
            slipping.without(self.fixed[trace], self.law.dim)
        });
        let slipping = slipping.flatten();
        let own = (trace, &self.contact_surface.traces[trace]);
        let touch = self.law.touch(own, view.condensed, [local_contact.gap, local_contact.by_load], slipping);
        (touch, local_contact)
    }

    /// Where a trace function was beside the surface at the last converged state, and by how much the surface had turned.
    fn before(&self, trace: usize, variables: &[f64]) -> (Vec3, f64) {
        let angle = if self.surface.turning.is_some() { variables[variables.len() - 1] } else { 0.0 };
        (three(&variables[trace * self.law.dim..][..self.law.dim]), angle)
    }

    /// How unknowns of a trace function move it beside the surface, times its area: displacements by $\int\Theta\Psi_a$, and travel and turn
    /// of the surface.
    fn moves(&self, trace: usize, local_contact: &LocalContact) -> Vec<(usize, Vec3)> {
        let trace = &self.contact_surface.traces[trace];
        let mut values = vec![0.0; trace.nodes.len()];
        for (k, &(point, weight)) in trace.points.iter().enumerate() {
            for (&l, value) in trace.local(k).iter().zip(self.contact_surface.table.values(point as usize)) {
                values[l as usize] += weight * value;
            }
        }
        let dim = self.law.dim;
        let mut moves: Vec<(usize, Vec3)> = Vec::with_capacity(values.len() * dim);
        for (a, value) in values.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            for i in 0..dim {
                moves.push((a * dim + i, unit(i) * *value));
            }
        }
        let own = (trace.nodes.len() - 1) * dim;
        moves.extend(self.surface.free_direction().map(|by| (own, by * -trace.area)));
        if self.turns_freely() {
            moves.push((own + 1, local_contact.placed.spun(&local_contact.arm) * (-trace.area / self.lever)));
        }
        moves
    }

    /// Gaps and forces at a state, the moment of the forces about the origin, and how deep the deepest point lies behind the surface.
    pub(crate) fn pressed(&self, view: &View<'_>) -> (Pressed, Vec3, f64) {
        let mut all = Pressed::new(self.contact_surface.traces.len());
        let (mut moment, mut depth) = (Vec3::zeros(), 0.0f64);
        for (k, trace) in self.contact_surface.traces.iter().enumerate() {
            let (pressure, friction) = self.law.pressure(k, view.condensed);
            let (mut force, mut own) = (Vec3::zeros(), Vec3::zeros());
            let (touch, _) = self.touch(k, view, |p, [part, _], at| {
                depth = depth.max(-at.found.gap);
                let push = at.found.normal * (pressure * part) + friction * trace.points[p].1;
                force += push;
                own += at.place.cross(&push);
            });
            all.gaps[k] = touch.gap;
            all.active[k] = touch.is_active();
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
            let [was, now] = [before, after].map(|view| self.local_contact(trace, view, |_, _, _| {}));
            now.slip(&was.beside, was.angle)
        })
    }

    /// Where a trace function that touches lies beyond an open end of the surface.
    pub(crate) fn passed_end(&self, trace: usize, view: &View<'_>) -> Option<Vec3> {
        let mut passed = None;
        let (touch, _) = self.touch(trace, view, |_, _, at| {
            passed = if at.found.passed_end { Some(at.place) } else { passed };
        });
        passed.filter(|_| touch.is_active())
    }

    /// Where the surface has come to the inner side of the body in a step: at one trace function, or all in all, so that it pulls. A surface
    /// presses against the normal of the body; one that has just let go may stand beside it or behind another part of the boundary, and one
    /// that is smaller than a trace function may never have touched.
    fn passed_through(&self, before: &View<'_>, after: &View<'_>) -> Option<Vec3> {
        let (mut pull, mut most, mut at) = (0.0, f64::NEG_INFINITY, 0);
        for (index, trace) in self.contact_surface.traces.iter().enumerate() {
            let mut along = 0.0;
            let (touch, now) = self.touch(index, after, |k, _, at| {
                let outward = self.contact_surface.outward(at.point, after.displacement);
                let cosine = at.found.normal.dot(&outward) / outward.norm();
                along += trace.points[k].1 / trace.area * cosine;
            });
            let is_small = now.gap < trace.width && self.surface.shape.depth() < trace.width;
            let touched = || touch.is_active() || is_small || self.touch(index, before, |_, _, _| {}).0.is_active();
            if along > THROUGH && touched() && !self.is_shielded(index, after) {
                return Some(self.contact_surface.place(trace.points[0].0, after.displacement));
            }
            if touch.is_active() {
                // Below zero a pressure is rounding.
                pull += touch.pressure.max(0.0) * trace.area * along;
                (most, at) = if along > most { (along, trace.points[0].0) } else { (most, at) };
            }
        }
        (pull > 0.0).then(|| self.contact_surface.place(at, after.displacement))
    }

    /// Whether most of the nearest places of the surface are beside another part of the boundary: the body has slipped past it there.
    fn is_shielded(&self, trace: usize, view: &View<'_>) -> bool {
        let (surface, mut shielded) = (&self.contact_surface, 0.0);
        self.local_contact(trace, view, |k, _, Beside { place, found, .. }| {
            let nearest = place - found.normal * found.gap;
            let mut others = 0..surface.table.len() as u32;
            if found.gap > 0.0
                && others.any(|p| (surface.place(p, view.displacement) - nearest).norm() < 0.5 * found.gap)
            {
                shielded += surface.traces[trace].points[k].1;
            }
        });
        shielded > 0.5 * surface.traces[trace].area
    }

    /// Adds the second derivatives of the gaps over a facet, times the pressures there, by displacements and by the motions of the surface,
    /// whose normal turns with it, and by the load factor where that moves the surface; of one that lets go in this iteration the pressure
    /// counts too, and is none in the next. Point by point, for each lies under many trace functions.
    fn add_curvature(&self, facet: usize, view: &View<'_>, out: &mut Element) {
        let (contact_surface, table) = (&self.contact_surface, &self.contact_surface.table);
        let (placed, size) = (self.placed(view.displacement, view.load), out.residual.len());
        let (mut means, mut list): (Vec<(u32, CountedMean)>, _) = (Vec::new(), Vec::new());
        for point in table.clusters.points(facet) {
            let (mut by_normal, mut by_square, mut found) = (0.0, 0.0, None);
            for &(trace, weight) in &contact_surface.over[point] {
                let force = weight * self.law.pressure(trace as usize, view.condensed).0.max(0.0);
                if force == 0.0 {
                    continue;
                }
                let mean = match means.iter().find(|(other, _)| *other == trace) {
                    Some((_, mean)) => *mean,
                    None => {
                        let mean = self.local_contact(trace as usize, view, |_, _, _| {}).mean;
                        means.push((trace, mean));
                        mean
                    }
                };
                let at = found.get_or_insert_with(|| self.beside(&placed, point as u32, view));
                let bent = contact_surface.traces[trace as usize].width * at.found.curvature.norm();
                by_normal -= force * mean.part(at.found.gap) * (SHARPEST / bent).min(1.0);
                by_square -= force * mean.curvature(at.found.gap);
            }
            let Some(at) = found else { continue };
            let normal = at.found.normal;
            let bend = at.found.curvature * by_normal + normal * normal.transpose() * by_square;
            let spun = placed.spun(&normal) * by_normal;
            if spun == Vec3::zeros() && bend.norm() == 0.0 {
                continue;
            }
            list.clear();
            let seen = (table.clusters.local(point), table.values(point));
            self.motions(size, &at, seen, |row, by| list.push((row, by)));
            // The normal turns with the surface.
            let turn = at.motions[1].and_then(|_| list.last()).map(|(turn, _)| *turn);
            let rate = placed.rate(&at.arm);
            let by_load = spun * placed.turn_rate() - bend * rate;
            list.iter().for_each(|(row, left)| out.load_slope[*row] += left.dot(&by_load));
            if let Some(turn) = turn {
                out.load_slope[turn] -= spun.dot(&rate) / self.lever;
            }
            if !out.with_matrix {
                continue;
            }
            for (column, right) in &list {
                let (right, column) = (bend * right, &mut out.matrix[column * size..][..size]);
                list.iter().for_each(|(row, left)| column[*row] += left.dot(&right));
            }
            let Some(turn) = turn else { continue };
            for (place, by) in &list {
                let entry = spun.dot(by) / self.lever;
                out.matrix[turn * size + place] += entry;
                out.matrix[place * size + turn] += if *place == turn { 0.0 } else { entry };
            }
        }
    }

    /// The facet whose curvature a cluster stands for, behind those of the trace functions.
    fn facet_of(&self, cluster: usize) -> Option<usize> {
        cluster.checked_sub(self.contact_surface.traces.len())
    }
}

impl Term for RigidContact {
    fn dim(&self) -> usize {
        self.law.dim
    }

    fn clusters(&self) -> usize {
        self.contact_surface.traces.len() + self.contact_surface.table.clusters.count()
    }

    fn nodes(&self, cluster: usize) -> &[u32] {
        match (self.facet_of(cluster), self.rigid_dof) {
            (None, _) => &self.contact_surface.traces[cluster].nodes,
            (Some(facet), None) => self.contact_surface.table.clusters.nodes(facet),
            (Some(facet), Some(_)) => &self.facets[facet],
        }
    }

    fn break_points(&self) -> Vec<f64> {
        let mut found = self.surface.break_points();
        found.extend(self.law.interference.map(|interference| interference.until));
        found
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        if let Some(facet) = self.facet_of(cluster) {
            if out.with_matrix || self.surface.moves_with_load() {
                self.add_curvature(facet, &view, out);
            }
            return;
        }
        if self.law.has_friction() {
            out.uncondensed = None;
        } else if let Some(zone) = &mut out.uncondensed {
            zone.place = cluster;
        }
        let (trace, kept) = (&self.contact_surface.traces[cluster], out.uncondensed.is_some());
        let size = trace.nodes.len() * self.law.dim;
        // ∇ḡ A, in the buffer of the element, and what depth that counts from the mean has in the second derivatives,
        // ∫ Θ c'' (∇g - ∇ḡ)(∇g - ∇ḡ)ᵀ. Pressures that are kept uncondensed do without it: for an increment that leaves the mean gap as it is
        // it vanishes.
        let mut slope = std::mem::take(&mut out.scratch);
        slope.clear();
        slope.resize(size, 0.0);
        let bends = (out.with_matrix || self.surface.moves_with_load()) && !kept;
        let bent = if bends { self.law.pressure(cluster, view.condensed).0.max(0.0) } else { 0.0 };
        let placed = self.placed(view.displacement, view.load);
        let (mut beside, mut whole, mut by_load) = (Vec::new(), 0.0, [0.0; 2]);
        let (touch, local_contact) = self.touch(cluster, &view, |k, [part, more], at| {
            let values = self.contact_surface.table.values(at.point as usize);
            let (seen, more) = ((trace.local(k), values), -bent * more);
            let closing = at.found.normal.dot(&placed.rate(&at.arm));
            by_load[0] -= part * closing;
            self.motions(size, at, seen, |place, by| slope[place] += part * at.found.normal.dot(&by));
            if more != 0.0 {
                whole += more;
                by_load[1] -= more * closing;
                beside.resize(size, 0.0);
                self.motions(size, at, seen, |place, by| beside[place] += more * at.found.normal.dot(&by));
            }
        });
        let (factor, square) = (-1.0 / trace.area, whole / trace.area.powi(2));
        let gradients = Gradients { slope, beside, factor, square, by_load };
        if touch.is_active() {
            let moves = if self.law.has_friction() { self.moves(cluster, &local_contact) } else { Vec::new() };
            touch.add(&gradients, &moves, out);
        }
        out.scratch = gradients.slope;
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: TermStep<'_>, condensed_step: &mut [f64]) -> f64 {
        if self.facet_of(cluster).is_some() {
            return 1.0;
        }
        let (surface, dim, mut change) = (&self.contact_surface, self.law.dim, 0.0);
        let TermStep { displacement: step, load } = step;
        let trace = &surface.traces[cluster];
        let own = |m: usize| self.rigid_dof.map_or(0.0, |node| step[node as usize * dim + m]);
        let (touch, local_contact) = self.touch(cluster, &view, |_, [part, _], at| {
            let mut by = surface.table.displacement(at.point as usize, step);
            for (m, motion) in at.motions.iter().enumerate() {
                by -= motion.map_or_else(Point::zeros, |motion| motion * own(m));
            }
            change += part * at.found.normal.dot(&by);
        });
        let mut moved = Point::zeros();
        if touch.slipping.is_some() {
            for (place, by) in self.moves(cluster, &local_contact) {
                moved += by * (step[trace.nodes[place / dim] as usize * dim + place % dim] / trace.area);
            }
        }
        let change = change / trace.area;
        touch.advance(change, &moved, load, condensed_step);
        touch.farthest(change)
    }

    fn layout(&self) -> Layout {
        // Where each trace function was beside the surface; without friction that does not matter.
        let turned = usize::from(self.surface.turning.is_some());
        let history =
            if self.law.has_friction() { self.contact_surface.traces.len() * self.law.dim + turned } else { 0 };
        Layout { unilateral: true, history, ..Layout::default() }
    }

    fn unknowns(&self, cluster: usize) -> std::ops::Range<usize> {
        let (stride, traces) = (self.law.stride(), self.contact_surface.traces.len());
        cluster.min(traces) * stride..(cluster + 1).min(traces) * stride
    }

    fn start(&self, _: &mut [f64], history: &mut [f64]) {
        let placed = self.surface.placed(0.0, [0.0; 2]);
        let traces = self.contact_surface.traces.len();
        for was in history.chunks_exact_mut(self.law.dim).take(traces) {
            was.iter_mut().zip(&placed.offset).for_each(|(was, offset)| *was = -offset);
        }
        history.iter_mut().skip(traces * self.law.dim).for_each(|was| *was = placed.angle());
    }

    fn update(&self, view: View<'_>, next: &mut [f64]) {
        let traces = self.contact_surface.traces.len();
        for (trace, now) in next.chunks_exact_mut(self.law.dim).take(traces).enumerate() {
            let beside = self.local_contact(trace, &view, |_, _, _| {}).beside;
            now.iter_mut().zip(&beside).for_each(|(now, beside)| *now = *beside);
        }
        let angle = self.placed(view.displacement, view.load).angle();
        next.iter_mut().skip(traces * self.law.dim).for_each(|now| *now = angle);
    }

    fn rounding(&self) -> [f64; 2] {
        self.law.rounding(&self.contact_surface, self.contact_surface.extent)
    }

    fn check_step(&self, before: View<'_>, after: View<'_>) -> Option<String> {
        if let Some(undefined) = self.undefined(&after) {
            return Some(undefined.to_string());
        }
        let (contact, load) = (self.surface.name.clone(), after.load);
        if let Some(at) = (0..self.contact_surface.traces.len()).find_map(|trace| self.passed_end(trace, &after)) {
            return Some(
                ContactError::PassedEnd { contact, at: self.contact_surface.coordinates(&at), load }.to_string(),
            );
        }
        let at = self.passed_through(&before, &after)?;
        Some(ContactError::PassedThrough { contact, at: self.contact_surface.coordinates(&at), load }.to_string())
    }

    fn farthest_load(&self, from: f64, to: f64) -> f64 {
        let to = if self.law.has_friction() { friction_step(from, to) } else { to };
        if !self.surface.moves_with_load() {
            return to;
        }
        let start = self.surface.placed(from, [0.0; 2]);
        let positions = self.contact_surface.table.positions.iter();
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
