//! Coulomb's friction at a trace function of a rigid contact.

use crate::geometry::Point;
use crate::term::{Element, History, View};

use super::RigidContact;
use super::obstacle::LocalContact;
use super::stick_slip::StickSlip;

impl<const D: usize> RigidContact<D> {
    /// What a touching trace function does along the surface.
    pub(super) fn stick_slip(&self, trace: usize, condensed: &[f64], local_contact: &LocalContact<D>) -> StickSlip<D> {
        let (pressure, traction) = self.pressure(trace, condensed);
        let first = self.variables().start + trace * D;
        let was = Point::<D>::from_fn(|i, _| condensed[first + i]);
        let along = |v: Point<D>| v - local_contact.normal * local_contact.normal.dot(&v);
        let (slip, decisive) = (along(local_contact.beside - was), self.decisive(trace));
        let requested = along(traction) - slip * decisive;
        let size = requested.norm();
        if size <= self.surface.friction * (pressure - decisive * local_contact.gap) {
            StickSlip::Stick(slip)
        } else {
            StickSlip::Slip(requested / size, decisive / size)
        }
    }

    /// Adds force and stiffness of friction at a trace function whose normal force is `pressure` $-\ \varepsilon\bar g$.
    pub(super) fn add_friction(
        &self,
        cluster: usize,
        view: &View<'_>,
        local_contact: &LocalContact<D>,
        slope: &[f64],
        out: &mut Element,
    ) {
        let trace = &self.contact_surface.traces[cluster];
        let (n, size) = (trace.nodes.len(), trace.nodes.len() * D);
        let (pressure, traction) = self.pressure(cluster, view.condensed);
        let (proximal, friction) = (self.proximal(cluster), self.surface.friction);
        let force = pressure - proximal * local_contact.gap;
        // Mean displacement: ∫ΘΨ_a along each component, and the travel of the surface.
        let mut values = vec![0.0; n];
        for (k, &(point, weight)) in trace.points.iter().enumerate() {
            for (&l, value) in trace.local(k).iter().zip(self.contact_surface.table.values(point as usize)) {
                values[l as usize] += weight * value;
            }
        }
        // (place, how the unknown there moves the trace function beside the surface).
        let mut moves: Vec<(usize, Point<D>)> = Vec::with_capacity(size);
        let unit = |i: usize| Point::<D>::from_fn(|j, _| f64::from(u8::from(i == j)));
        let travel = self.rigid_dof.zip(self.surface.free_direction());
        for (a, value) in values.iter().enumerate() {
            if *value != 0.0 {
                moves.extend((0..D).map(|i| (a * D + i, unit(i) * *value)));
            }
        }
        moves.extend(travel.map(|(_, along)| (size - D, along * -trace.area)));
        let along = |v: &Point<D>| v - local_contact.normal * local_contact.normal.dot(v);
        let placed = self.placed(view.displacement, view.load);
        match self.stick_slip(cluster, view.condensed, local_contact) {
            StickSlip::Stick(slip) => {
                let held = along(&traction) - slip * proximal;
                let by_load = along(&placed.slope) * proximal;
                for (place, by) in &moves {
                    out.residual[*place] -= by.dot(&held);
                    out.load_slope[*place] -= by.dot(&by_load);
                }
                self.add_along(&moves, &local_contact.normal, None, proximal / trace.area, size, out);
            }
            StickSlip::Slip(direction, turn) => {
                let held = direction * (friction * force);
                let by_load = direction * (friction * proximal * local_contact.by_load);
                for (place, by) in &moves {
                    out.residual[*place] -= by.dot(&held);
                    out.load_slope[*place] += by.dot(&by_load);
                }
                if !out.with_matrix {
                    return;
                }
                let turning = (friction * force * turn).clamp(0.0, proximal) / trace.area;
                self.add_along(&moves, &local_contact.normal, Some(direction), turning, size, out);
                out.coupling.resize(size * size, 0.0);
                for (column, by_gap) in out.coupling.chunks_exact_mut(size).zip(slope) {
                    let factor = friction * proximal / trace.area * by_gap;
                    if factor != 0.0 {
                        for (place, by) in &moves {
                            column[*place] += factor * by.dot(&direction);
                        }
                    }
                }
            }
        }
    }

    /// Adds a stiffness along the surface, but not along a direction in it.
    fn add_along(
        &self,
        moves: &[(usize, Point<D>)],
        normal: &Point<D>,
        but: Option<Point<D>>,
        factor: f64,
        size: usize,
        out: &mut Element,
    ) {
        if !out.with_matrix || factor == 0.0 || but.is_some() && D == 2 {
            return;
        }
        for (b, by) in moves {
            let mut held = by - normal * normal.dot(by);
            if let Some(but) = &but {
                held -= but * but.dot(&held);
            }
            let column = &mut out.matrix[b * size..][..size];
            for (a, other) in moves {
                column[*a] += factor * other.dot(&held);
            }
        }
    }
}
