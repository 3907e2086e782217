//! Contact of two parts as a term of the potential.

use crate::geometry::Point;
use crate::term::{CondensedUnknowns, Element, History, PointMotion, Protocol, Term, Unilateral, View};

use super::friction::{Friction, friction_step};
use super::obstacle::farthest;
use super::pair::{Gathered, Held, Order, PairContact, Piece, Slip, State, TraceGap};

/// A trace function that touches.
struct Touching {
    trace: usize,
    overlap: TraceGap,
    /// Over the points that it presses on and, with friction, those that its slip is of.
    gathered: Gathered,
    pressure: f64,
    proximal: f64,
}

impl<const D: usize> Term for PairContact<D> {
    fn dim(&self) -> usize {
        D
    }

    // All trace functions see the same nodes.
    fn clusters(&self) -> usize {
        1
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &self.nodes
    }

    fn break_points(&self) -> Vec<f64> {
        self.law.interference.iter().map(|interference| interference.until).collect()
    }

    fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
        let state = self.now(view.displacement);
        let held = self.has_friction().then(|| self.held(view.condensed));
        let touching = self.touching(&view, &state, held.as_deref(), out.with_matrix);
        if touching.is_empty() {
            return;
        }
        let since = self.moved_since(view.displacement, view.condensed);
        let lists = touching.iter().map(|touching| touching.gathered.points.as_slice());
        if out.with_matrix {
            out.points.reset::<D>(self.motion.len(), lists.clone());
            if held.is_some() {
                out.point_coupling.reset::<D>(self.motion.len(), lists);
            }
            let mut factors = vec![0.0; self.carrying];
            touching.iter().for_each(|touching| factors[touching.trace] = -touching.pressure.max(0.0));
            self.curves(&factors, &state, |row, column, factor, block| {
                let target = out.points.block::<D>(row, column);
                for j in 0..D {
                    (0..D).for_each(|i| target[j][i] += factor * block[j][i]);
                }
            });
        }
        let (mut forces, mut squares) = (vec![0.0; out.residual.len()], 0.0);
        let mut own = Element::default();
        for touching in touching {
            own.reset(touching.gathered.points.len() * D, out.with_matrix);
            let slip = held.as_ref().and_then(|held| held.slips[touching.trace].as_ref());
            let points = self.add_trace(touching, slip, &view, &since, &mut own);
            forces.fill(0.0);
            for (k, &point) in points.iter().enumerate() {
                self.motion.add_force::<D>(point, &own.residual[k * D..][..D], &mut forces);
                self.motion.add_force::<D>(point, &own.load_slope[k * D..][..D], &mut out.load_slope);
            }
            squares += forces.iter().map(|force| force * force).sum::<f64>();
            out.residual.iter_mut().zip(&forces).for_each(|(total, force)| *total += force);
            if out.with_matrix {
                out.points.add::<D>(&points, &own.matrix);
            }
            if !own.coupling.is_empty() {
                out.point_coupling.add::<D>(&points, &own.coupling);
            }
        }
        out.force_squares = Some(squares);
    }

    fn advance(&self, _: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        let (state, moves) = (self.now(view.displacement), self.moves(step));
        let held = self.has_friction().then(|| self.held(view.condensed));
        let since = self.moved_since(view.displacement, view.condensed);
        let mut bound: f64 = 1.0;
        for (trace, own) in condensed_step.chunks_exact_mut(self.stride()).enumerate() {
            let slip = held.as_ref().and_then(|held| held.slips[trace].as_ref());
            let part = self.advance_trace(trace, slip, &view, &state, [&moves, &since], own);
            bound = if part.is_nan() { 0.0 } else { bound.min(part) };
        }
        bound
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

impl<const D: usize> CondensedUnknowns for PairContact<D> {
    fn unknowns(&self, _: usize) -> std::ops::Range<usize> {
        0..self.carrying * self.stride()
    }
}

impl<const D: usize> History for PairContact<D> {
    fn variables(&self) -> std::ops::Range<usize> {
        let first = self.carrying * self.stride();
        // Displacements of all nodes, from which slips are counted; without friction they do not matter.
        first..first + if self.has_friction() { self.nodes.len() * D } else { 0 }
    }

    fn update(&self, view: View<'_>, next: &mut [f64]) {
        for (&node, now) in self.nodes.iter().zip(next.chunks_exact_mut(D)) {
            now.copy_from_slice(&view.displacement[node as usize * D..][..D]);
        }
    }
}

impl<const D: usize> Unilateral for PairContact<D> {
    fn farthest_load(&self, from: f64, to: f64) -> f64 {
        if self.has_friction() { friction_step(from, to) } else { to }
    }

    fn rounding(&self) -> [f64; 2] {
        let extent = self.contact_surfaces.iter().map(|contact_surface| contact_surface.extent).fold(0.0, f64::max);
        self.law.stiffness.rounding(self.contact_surfaces[0].traces.iter(), extent)
    }

    fn advance_load(&self, _: usize, view: View<'_>, load_step: f64, condensed_step: &mut [f64]) {
        if self.law.interference.is_none() || load_step == 0.0 {
            return;
        }
        let state = self.now(view.displacement);
        let held = self.has_friction().then(|| self.held(view.condensed));
        let since = self.moved_since(view.displacement, view.condensed);
        for (trace, own) in condensed_step.chunks_exact_mut(self.stride()).enumerate() {
            let (pressure, _) = self.pressure(trace, view.condensed);
            let overlap = self.overlap(trace, &state, view.load, |_| {});
            if !self.is_active(trace, pressure, overlap.gap) {
                continue;
            }
            own[0] -= self.proximal(trace) * overlap.by_load * load_step;
            if let Some(slip) = held.as_ref().and_then(|held| held.slips[trace].as_ref()) {
                let more = self.friction(trace, &view, &overlap, slip, &since).next_by_load(load_step);
                own[1..].iter_mut().zip(&more).for_each(|(s, t)| *s += *t);
            }
        }
    }
}

impl<const D: usize> Protocol for PairContact<D> {
    fn hold_search(&self, hold: bool) -> bool {
        PairContact::hold_search(self, hold);
        true
    }

    fn points(&self) -> Option<&PointMotion> {
        Some(&self.motion)
    }
}

/// Adds a matrix over the coordinates of points, column by column: $-\pi\,\partial^2 G + \varepsilon\,s\,s^{\mathsf T}
/// + \sigma\,(a\,s^{\mathsf T} + s\,a^{\mathsf T})$ with the slope $s = \partial G - \bar g\,a$ and the gradient $a$ of the area.
fn add_matrix(
    slope: &[f64],
    area_slope: &[f64],
    curve: &[f64],
    [pressure, proximal, shrinks]: [f64; 3],
    matrix: &mut [f64],
) {
    matrix.iter_mut().zip(curve).for_each(|(entry, curve)| *entry -= pressure * curve);
    for (j, column) in matrix.chunks_exact_mut(slope.len()).enumerate() {
        let along_gap = proximal * slope[j] + shrinks * area_slope[j];
        let along_area = shrinks * slope[j];
        for ((entry, s), a) in column.iter_mut().zip(slope).zip(area_slope) {
            *entry += along_gap * s + along_area * a;
        }
    }
}

impl<const D: usize> PairContact<D> {
    /// The trace functions that touch.
    fn touching(&self, view: &View<'_>, state: &State<D>, held: Option<&Held<D>>, with_matrix: bool) -> Vec<Touching> {
        let mut pieces: Vec<Piece<D>> = Vec::new();
        let of = |trace: usize| {
            let (pressure, _) = self.pressure(trace, view.condensed);
            pieces.clear();
            let overlap = self.overlap(trace, state, view.load, |piece| pieces.push(piece));
            if !self.is_active(trace, pressure, overlap.gap) {
                return None;
            }
            let concentration = self.concentration(trace, &overlap);
            let (pressure, proximal) = (pressure * concentration, self.proximal(trace) * concentration);
            let order = if with_matrix && pressure > 0.0 { Order::Second } else { Order::First };
            let slip = held.and_then(|held| held.slips[trace].as_ref());
            let others = slip.iter().flat_map(|slip| slip.weights.iter().map(|entry| entry.0));
            Some(Touching {
                trace,
                gathered: self.gathered(&pieces, others, state, order),
                overlap,
                pressure,
                proximal,
            })
        };
        (0..self.carrying).filter_map(of).collect()
    }

    /// Adds the forces and the matrix of a trace function over the coordinates of points, which are given back.
    fn add_trace(
        &self,
        Touching { trace, overlap, gathered, pressure, proximal }: Touching,
        slip: Option<&Slip<D>>,
        view: &View<'_>,
        since: &[Point<D>],
        out: &mut Element,
    ) -> Vec<u32> {
        // A ∇ḡ.
        let both = gathered.slope.iter().zip(&gathered.area_slope);
        let slope: Vec<f64> = both.map(|(s, a)| s - overlap.gap * a).collect();
        let force = pressure - proximal * overlap.gap;
        for (r, s) in out.residual.iter_mut().zip(&slope) {
            *r -= force * s;
        }
        for (l, s) in out.load_slope.iter_mut().zip(&slope) {
            *l += proximal * overlap.by_load * s;
        }
        let Gathered { points, area_slope, curve, .. } = gathered;
        if out.with_matrix {
            let shrinks = pressure.max(0.0) / overlap.area;
            add_matrix(&slope, &area_slope, &curve, [pressure, proximal / overlap.area, shrinks], &mut out.matrix);
        }
        if let Some(slip) = slip {
            let area = self.contact_surfaces[0].traces[trace].area;
            let mut moves: Vec<(usize, Point<D>)> = Vec::with_capacity(slope.len());
            for &(point, value) in &slip.weights {
                let place = points.partition_point(|&p| p < point);
                let along = |i: usize| Point::<D>::from_fn(|j, _| if i == j { area * value } else { 0.0 });
                moves.extend((0..D).map(|i| (place * D + i, along(i))));
            }
            self.friction(trace, view, &overlap, slip, since).add(&moves, &slope, out);
        }
        points
    }

    /// Writes the increments of the condensed unknowns of a trace function for a step that moves the points, which have moved since the last
    /// converged state; the largest part of the step that is admissible.
    fn advance_trace(
        &self,
        trace: usize,
        slip: Option<&Slip<D>>,
        view: &View<'_>,
        state: &State<D>,
        [moves, since]: [&[Point<D>]; 2],
        condensed_step: &mut [f64],
    ) -> f64 {
        let (pressure, traction) = self.pressure(trace, view.condensed);
        let mut pieces: Vec<Piece<D>> = Vec::new();
        let overlap = self.overlap(trace, state, view.load, |piece| pieces.push(piece));
        let gap = overlap.gap;
        let set = |traction_step: Point<D>, condensed_step: &mut [f64]| {
            condensed_step[1..].iter_mut().zip(&traction_step).for_each(|(s, t)| *s = *t);
        };
        if self.is_active(trace, pressure, gap) {
            let change = self.change(&pieces, state, gap, moves) / overlap.area;
            condensed_step[0] = -self.proximal(trace) * (gap + change);
            if self.has_friction() {
                let next = slip.map_or_else(Point::zeros, |slip| {
                    self.friction(trace, view, &overlap, slip, since).next(change, &slip.of(moves))
                });
                set(next - traction, condensed_step);
            }
            return 1.0;
        }
        condensed_step[0] = -pressure;
        set(-traction, condensed_step);
        if gap.is_finite() {
            // An overlap that grows changes the mean gap, but takes nothing further in.
            return farthest(gap, self.opening(&pieces, moves) / overlap.area, self.width(trace));
        }
        // A trace function with no opposite facet moves no further than the search reached.
        let distance = moves[trace].norm();
        if distance > state.reach { state.reach / distance } else { 1.0 }
    }

    /// What friction asks of a trace function that touches.
    fn friction(
        &self,
        trace: usize,
        view: &View<'_>,
        overlap: &TraceGap,
        slip: &Slip<D>,
        since: &[Point<D>],
    ) -> Friction<D> {
        let (pressure, traction) = self.pressure(trace, view.condensed);
        Friction {
            coefficient: self.law.friction,
            proximal: self.proximal(trace),
            decisive: self.decisive(trace),
            normal: slip.normal,
            pressure,
            traction,
            gap: overlap.gap,
            gap_by_load: overlap.by_load,
            gap_area: overlap.area,
            slip: slip.of(since),
            slip_by_load: Point::zeros(),
            area: self.contact_surfaces[0].traces[trace].area,
        }
    }
}
