//! Contact of two parts as a term of the potential.

use crate::compiled::by_dim;
use crate::each::{Each, add};
use crate::geometry::{Bounds, Point, Vec3, unit};
use crate::term::{Coupling, Element, Form, Layout, Term, TermStep, View};

use super::friction::friction_step;
use super::law::{Gradients, Touch};
use super::pair::{Gathered, Now, PairContact, Piece, Slip};

/// A trace function that touches.
struct Touching {
    trace: usize,
    touch: Touch,
    pieces: Vec<Piece>,
    /// Over the points that it presses on and, with friction, those that its slip is of.
    gathered: Gathered,
}

impl Term for PairContact {
    fn dim(&self) -> usize {
        self.law.dim
    }

    // All trace functions see the same nodes.
    fn nodes(&self, _: usize) -> &[u32] {
        &self.nodes
    }

    fn break_points(&self) -> Vec<f64> {
        self.law.interference.iter().map(|interference| interference.until).collect()
    }

    fn linearize(&self, _: usize, view: View<'_>, out: &mut Element) {
        let (now, dim) = (self.now(&view), self.law.dim);
        let mut touching = Vec::new();
        for trace in 0..self.carrying {
            let (touch, pieces) = self.touch(trace, &view, &now);
            if touch.is_active() {
                let others = now.slip(trace).into_iter().flat_map(|slip| slip.weights.iter().map(|entry| entry.0));
                let gathered = self.gathered(&pieces, others, &now.state);
                touching.push(Touching { trace, touch, pieces, gathered });
            }
        }
        if touching.is_empty() {
            return;
        }
        let lists = touching.iter().map(|touching| touching.gathered.points.as_slice());
        if out.with_matrix {
            out.points.reset(dim, self.motion.len(), lists);
            let factor = |touching: &Touching| -touching.touch.concentrated()[0].max(0.0);
            let pressed = touching.iter().map(|touching| (touching.trace as u32, factor(touching), &*touching.pieces));
            self.add_curves(&pressed.collect::<Vec<_>>(), &now.state, out);
        }
        let (mut forces, mut squares) = (vec![0.0; out.residual.len()], 0.0);
        let mut own = Element::default();
        for touching in touching {
            own.reset(touching.gathered.points.len() * dim, out.with_matrix);
            let slip = now.slip(touching.trace);
            let points = self.add_trace(touching, slip, &mut own);
            forces.fill(0.0);
            for (k, &point) in points.iter().enumerate() {
                self.motion.add_force(point, &own.residual[k * dim..][..dim], &mut forces);
                self.motion.add_force(point, &own.load_slope[k * dim..][..dim], &mut out.load_slope);
            }
            squares += forces.summed(|force| force * force);
            add(&mut out.residual, 1.0, &forces);
            if out.with_matrix {
                by_dim!(dim, D => out.points.add::<D>(&points, &own.matrix));
            }
            out.coupling.extend(own.coupling.drain(..).map(|Coupling { left, right }| Coupling {
                left: self.over_nodes(&points, &left, &mut forces),
                right: self.over_nodes(&points, &right, &mut forces),
            }));
        }
        out.force_squares = Some(squares);
    }

    fn advance(&self, _: usize, view: View<'_>, step: TermStep<'_>, condensed_step: &mut [f64]) -> f64 {
        let (now, moves) = (self.now(&view), self.moves(step.displacement));
        // What vertices move by that may come to be opposite.
        let opposite = if self.carrying < self.traces { self.carrying } else { 0 };
        let others = Bounds::of(&moves[opposite..self.traces]);
        let mut bound: f64 = 1.0;
        for (trace, own) in condensed_step.chunks_exact_mut(self.law.stride()).enumerate() {
            let part = self.advance_trace(trace, &view, &now, (&moves, &others, step.load), own);
            bound = if part.is_nan() { 0.0 } else { bound.min(part) };
        }
        bound
    }

    fn layout(&self) -> Layout {
        // Displacements of all nodes, from which slips are counted; without friction they do not matter.
        let history = if self.law.has_friction() { self.nodes.len() * self.law.dim } else { 0 };
        Layout { unilateral: true, history, ..Layout::default() }
    }

    fn unknowns(&self, _: usize) -> std::ops::Range<usize> {
        0..self.carrying * self.law.stride()
    }

    fn update(&self, view: View<'_>, next: &mut [f64]) {
        let dim = self.law.dim;
        for (&node, now) in self.nodes.iter().zip(next.chunks_exact_mut(dim)) {
            now.copy_from_slice(&view.displacement[node as usize * dim..][..dim]);
        }
    }

    fn farthest_load(&self, from: f64, to: f64) -> f64 {
        if self.law.has_friction() { friction_step(from, to) } else { to }
    }

    fn rounding(&self) -> [f64; 2] {
        let extent = self.contact_surfaces.largest(|contact_surface| contact_surface.extent);
        self.law.rounding(&self.contact_surfaces[0], extent)
    }

    fn hold_search(&self, hold: bool) -> bool {
        PairContact::hold_search(self, hold);
        true
    }

    fn form(&self) -> Form<'_> {
        Form::Points(&self.motion)
    }
}

impl PairContact {
    /// Adds the forces and the matrix of a trace function over the coordinates of points, which are given back.
    fn add_trace(
        &self,
        Touching { touch, gathered, .. }: Touching,
        slip: Option<&Slip>,
        out: &mut Element,
    ) -> Vec<u32> {
        // A ∇ḡ.
        let both = gathered.slope.iter().zip(&gathered.area_slope);
        let slope: Vec<f64> = both.map(|(s, a)| s - touch.gap * a).collect();
        let Gathered { points, area_slope, .. } = gathered;
        let mut moves: Vec<(usize, Vec3)> = Vec::new();
        for &(point, value) in slip.iter().flat_map(|slip| &slip.weights) {
            let place = points.partition_point(|&p| p < point);
            moves.extend((0..self.law.dim).map(|i| (place * self.law.dim + i, unit(i) * (touch.area * value))));
        }
        let factor = touch.concentrated()[0].max(0.0) / touch.gap_area;
        touch.add(&Gradients { slope, beside: area_slope, factor, square: 0.0, by_load: [0.0; 2] }, &moves, out);
        points
    }

    /// What a vector over the coordinates of points is over the unknowns of the nodes.
    fn over_nodes(&self, points: &[u32], of_points: &[(u32, f64)], buffer: &mut [f64]) -> Vec<(u32, f64)> {
        let dim = self.law.dim;
        buffer.fill(0.0);
        for &(place, value) in of_points {
            let (point, i) = (points[place as usize / dim], place as usize % dim);
            self.motion.of(point).iter().for_each(|&(node, factor)| buffer[node as usize * dim + i] += factor * value);
        }
        let all = buffer.iter().enumerate().filter(|(_, value)| **value != 0.0);
        all.map(|(k, value)| (k as u32, *value)).collect()
    }

    /// Writes the increments of the condensed unknowns of a trace function for a step that moves the points and changes the load factor; the
    /// largest part of the step that is admissible.
    fn advance_trace(
        &self,
        trace: usize,
        view: &View<'_>,
        now: &Now,
        (moves, others, load): (&[Vec3], &Bounds<3>, f64),
        condensed_step: &mut [f64],
    ) -> f64 {
        let (touch, pieces) = self.touch(trace, view, now);
        if touch.is_active() {
            let change = self.change(&pieces, &now.state, touch.gap, moves) / touch.gap_area;
            let moved = now.slip(trace).map_or_else(Point::zeros, |slip| slip.of(moves));
            touch.advance(change, &moved, load, condensed_step);
        } else {
            touch.advance(0.0, &Point::zeros(), load, condensed_step);
        }
        if touch.gap.is_finite() {
            // An overlap that grows changes the mean gap, but takes nothing further in.
            return touch.farthest(self.opening(&pieces, moves) / touch.gap_area);
        }
        // A trace function with no opposite facet and what may come to be opposite move no further past each other than the search reached,
        // whichever of them moves.
        let (beside, reach) = (moves[trace], now.state.reach);
        let distance = (beside - others.low).abs().sup(&(others.high - beside).abs()).norm();
        if distance > reach { reach / distance } else { 1.0 }
    }
}
