//! Contact of two parts as a term of the potential.

use crate::geometry::Point;
use crate::term::{CondensedUnknowns, Element, History, Protocol, Term, Unilateral, View};

use super::friction::{Friction, friction_step};
use super::obstacle::farthest;
use super::pair::{ContactPair, Gathered, Order, PairContact, Piece, Slip};

impl<const D: usize> Term<D> for PairContact<D> {
    fn clusters(&self) -> usize {
        self.carrying
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &self.nodes
    }

    fn break_points(&self) -> Vec<f64> {
        self.law.interference.iter().map(|interference| interference.until).collect()
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        let (pressure, _) = self.pressure(cluster, view.condensed);
        let state = self.now(view.displacement);
        let mut pieces: Vec<Piece<D>> = Vec::new();
        let overlap = self.overlap(cluster, &state, view.load, |piece| pieces.push(piece));
        if !self.is_active(cluster, pressure, overlap.gap) {
            return;
        }
        let concentration = self.concentration(cluster, &overlap);
        let (pressure, proximal) = (pressure * concentration, self.proximal(cluster) * concentration);
        let order = if out.with_matrix && pressure > 0.0 { Order::Second } else { Order::First };
        let gathered = self.gathered(&pieces, &state, order);
        let of = |point: &u32| &self.movers.combinations[*point as usize];
        let mut used: Vec<u16> = gathered.points.iter().flat_map(of).map(|entry| entry.0).collect();
        let held = self.has_friction().then(|| self.held(view.condensed));
        let slip = held.as_ref().and_then(|held| held.slips[cluster].as_ref());
        used.extend(slip.iter().flat_map(|slip| &slip.weights).map(|entry| entry.0));
        used.sort_unstable();
        used.dedup();
        out.reset_compact::<D>(&used);
        let size = used.len() * D;
        let local = |place: u16| used.partition_point(|&u| u < place);
        let (mut slope, mut by_area) = (vec![0.0; size], vec![0.0; size]);
        // (place in the element, factor) of each point.
        let spread = |point: &u32| of(point).iter().map(|&(place, value)| (local(place), value)).collect();
        let points: Vec<Vec<(usize, f64)>> = gathered.points.iter().map(spread).collect();
        for (k, of) in points.iter().enumerate() {
            for &(place, value) in of {
                for i in 0..D {
                    slope[place * D + i] += value * gathered.slope[k * D + i];
                    by_area[place * D + i] += value * gathered.area_slope[k * D + i];
                }
            }
        }
        // A ∇ḡ.
        slope.iter_mut().zip(&by_area).for_each(|(s, a)| *s -= overlap.gap * a);
        let force = pressure - proximal * overlap.gap;
        for (r, s) in out.residual.iter_mut().zip(&slope) {
            *r -= force * s;
        }
        for (l, s) in out.load_slope.iter_mut().zip(&slope) {
            *l += proximal * overlap.by_load * s;
        }
        if out.with_matrix {
            let shrinks = pressure.max(0.0) / overlap.area;
            let matrix = point_matrix(gathered, &overlap, [pressure, proximal / overlap.area, shrinks]);
            set_matrix::<D>(&matrix, &points, out);
        }
        if let Some(slip) = slip {
            let mut moves: Vec<(usize, Point<D>)> = Vec::with_capacity(size);
            let area = self.contact_surfaces[0].traces[cluster].area;
            for &(place, value) in &slip.weights {
                let along = |i: usize| Point::<D>::from_fn(|j, _| if i == j { area * value } else { 0.0 });
                moves.extend((0..D).map(|i| (local(place) * D + i, along(i))));
            }
            self.friction(cluster, &view, &overlap, slip).add(&moves, &slope, out);
        }
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        let (pressure, traction) = self.pressure(cluster, view.condensed);
        let state = self.now(view.displacement);
        let mut pieces: Vec<Piece<D>> = Vec::new();
        let overlap = self.overlap(cluster, &state, view.load, |piece| pieces.push(piece));
        let gap = overlap.gap;
        let set = |traction_step: Point<D>, condensed_step: &mut [f64]| {
            condensed_step[1..].iter_mut().zip(&traction_step).for_each(|(s, t)| *s = *t);
        };
        if self.is_active(cluster, pressure, gap) {
            let gathered = self.gathered(&pieces, &state, Order::First);
            let mut change = 0.0;
            for (k, &point) in gathered.points.iter().enumerate() {
                let by = self.moved(&self.movers.combinations[point as usize], step);
                let along = |i: usize| gathered.slope[k * D + i] - gap * gathered.area_slope[k * D + i];
                change += (0..D).map(|i| along(i) * by[i]).sum::<f64>() / overlap.area;
            }
            condensed_step[0] = -self.proximal(cluster) * (gap + change);
            if self.has_friction() {
                let held = self.held(view.condensed);
                let next = held.slips[cluster].as_ref().map_or_else(Point::zeros, |slip| {
                    let moved = self.moved(&slip.weights, step);
                    self.friction(cluster, &view, &overlap, slip).next(change, &moved)
                });
                set(next - traction, condensed_step);
            }
            return 1.0;
        }
        condensed_step[0] = -pressure;
        set(-traction, condensed_step);
        let width = self.width(cluster);
        if gap.is_finite() {
            // An overlap that grows changes the mean gap, but takes nothing further in.
            return farthest(gap, self.opening(&pieces, step) / overlap.area, width);
        }
        // What has nothing opposite goes no further than the search saw.
        let direction = self.moved(&self.movers.combinations[cluster], step).norm();
        if direction > state.reach { state.reach / direction } else { 1.0 }
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
    fn unknowns(&self, cluster: usize) -> std::ops::Range<usize> {
        let stride = self.stride();
        cluster * stride..(cluster + 1) * stride
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

    fn advance_load(&self, cluster: usize, view: View<'_>, load_step: f64, condensed_step: &mut [f64]) {
        if self.law.interference.is_none() || load_step == 0.0 {
            return;
        }
        let (pressure, _) = self.pressure(cluster, view.condensed);
        let overlap = self.overlap(cluster, &self.now(view.displacement), view.load, |_| {});
        if !self.is_active(cluster, pressure, overlap.gap) {
            return;
        }
        condensed_step[0] -= self.proximal(cluster) * overlap.by_load * load_step;
        let held = self.has_friction().then(|| self.held(view.condensed));
        if let Some(slip) = held.as_ref().and_then(|held| held.slips[cluster].as_ref()) {
            let more = self.friction(cluster, &view, &overlap, slip).next_by_load(load_step);
            condensed_step[1..].iter_mut().zip(&more).for_each(|(s, t)| *s += *t);
        }
    }
}

impl<const D: usize> Protocol for PairContact<D> {
    fn hold_search(&self, hold: bool) -> bool {
        PairContact::hold_search(self, hold);
        true
    }

    fn fills_compact(&self) -> bool {
        true
    }
}

/// The matrix over the coordinates of points, column by column: $-\pi\,\partial^2 G + \varepsilon\,s\,s^{\mathsf T}
/// + \sigma\,(a\,s^{\mathsf T} + s\,a^{\mathsf T})$ with $s = \partial G - \bar g\,a$ and the gradient $a$ of the area.
fn point_matrix(gathered: Gathered, overlap: &ContactPair, [pressure, proximal, shrinks]: [f64; 3]) -> Vec<f64> {
    let Gathered { slope, area_slope, curve: mut matrix, .. } = gathered;
    let size = slope.len();
    matrix.iter_mut().for_each(|entry| *entry *= -pressure);
    matrix.resize(size * size, 0.0);
    let slope: Vec<f64> = slope.iter().zip(&area_slope).map(|(s, a)| s - overlap.gap * a).collect();
    for (j, column) in matrix.chunks_exact_mut(size).enumerate() {
        let along_gap = proximal * slope[j] + shrinks * area_slope[j];
        let along_area = shrinks * slope[j];
        for ((entry, s), a) in column.iter_mut().zip(&slope).zip(&area_slope) {
            *entry += along_gap * s + along_area * a;
        }
    }
    matrix
}

/// Sets the matrix of an element to $T^{\mathsf T} M\,T$ with a symmetric $M$ over points, one side after the other, of which one half is
/// summed; `points` has for each point places in the element, rising, and factors.
fn set_matrix<const D: usize>(matrix: &[f64], points: &[Vec<(usize, f64)>], out: &mut Element) {
    let (size, rows) = (out.residual.len(), points.len() * D);
    let mut half = vec![0.0; rows * size];
    for (k, of) in points.iter().enumerate() {
        for i in 0..D {
            let column = &matrix[(k * D + i) * rows..][..rows];
            for &(place, value) in of {
                let target = &mut half[(place * D + i) * rows..][..rows];
                target.iter_mut().zip(column).for_each(|(t, c)| *t += value * c);
            }
        }
    }
    for ((j, column), from) in out.matrix.chunks_exact_mut(size).enumerate().zip(half.chunks_exact(rows)) {
        for (of, from) in points.iter().zip(from.chunks_exact(D)) {
            let first = of.partition_point(|entry| entry.0 < j / D);
            for &(place, value) in &of[first..] {
                let target = &mut column[place * D..][..D];
                target.iter_mut().zip(from).for_each(|(t, f)| *t += value * f);
            }
        }
    }
    for j in 0..size {
        for i in (j / D + 1) * D..size {
            out.matrix[i * size + j] = out.matrix[j * size + i];
        }
    }
}

impl<const D: usize> PairContact<D> {
    /// What friction asks of a trace function that touches.
    fn friction(&self, trace: usize, view: &View<'_>, overlap: &ContactPair, slip: &Slip<D>) -> Friction<D> {
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
            slip: self.slipped(slip, view.displacement, view.condensed),
            slip_by_load: Point::zeros(),
            area: self.contact_surfaces[0].traces[trace].area,
        }
    }
}
