//! Coulomb's friction at a hat of a rigid contact.

use crate::geometry::Point;
use crate::term::{Element, Term, View};

use super::RigidContact;
use super::grip::Grip;
use super::obstacle::Touch;

impl<const D: usize> RigidContact<D> {
    /// What a touching hat does along the surface.
    pub(super) fn grip(&self, hat: usize, condensed: &[f64], touch: &Touch<D>) -> Grip<D> {
        let (pressure, traction) = self.pressure(hat, condensed);
        let first = self.memory().start + hat * D;
        let was = Point::<D>::from_fn(|i, _| condensed[first + i]);
        let along = |v: Point<D>| v - touch.normal * touch.normal.dot(&v);
        let (slip, decisive) = (along(touch.beside - was), self.decisive(hat));
        let asked = along(traction) - slip * decisive;
        let size = asked.norm();
        if size <= self.surface.friction * (pressure - decisive * touch.gap) {
            Grip::Sticks(slip)
        } else {
            Grip::Slides(asked / size, decisive / size)
        }
    }

    /// Adds force and stiffness of friction at a hat whose normal force is `pressure` $-\ \varepsilon\bar g$.
    pub(super) fn rub(&self, cluster: usize, view: &View<'_>, touch: &Touch<D>, slope: &[f64], out: &mut Element) {
        let hat = &self.skin.hats[cluster];
        let (n, size) = (hat.nodes.len(), hat.nodes.len() * D);
        let (pressure, traction) = self.pressure(cluster, view.condensed);
        let (proximal, friction) = (self.proximal(cluster), self.surface.friction);
        let force = pressure - proximal * touch.gap;
        // Mean displacement: ∫ΘΨ_a along each component, and the travel of the surface.
        let mut values = vec![0.0; n];
        for (k, &(point, weight)) in hat.points.iter().enumerate() {
            for (&l, value) in hat.local(k).iter().zip(self.skin.table.values(point as usize)) {
                values[l as usize] += weight * value;
            }
        }
        // (place, how the unknown there moves the hat beside the surface).
        let mut moves: Vec<(usize, Point<D>)> = Vec::with_capacity(size);
        let unit = |i: usize| Point::<D>::from_fn(|j, _| f64::from(u8::from(i == j)));
        let travel = self.carriage.zip(self.surface.free_direction());
        for (a, value) in values.iter().enumerate() {
            if *value != 0.0 {
                moves.extend((0..D).map(|i| (a * D + i, unit(i) * *value)));
            }
        }
        moves.extend(travel.map(|(_, along)| (size - D, along * -hat.area)));
        let along = |v: &Point<D>| v - touch.normal * touch.normal.dot(v);
        let placed = self.placed(view.displacement, view.load);
        match self.grip(cluster, view.condensed, touch) {
            Grip::Sticks(slip) => {
                let held = along(&traction) - slip * proximal;
                let by_load = along(&placed.slope) * proximal;
                for (place, by) in &moves {
                    out.residual[*place] -= by.dot(&held);
                    out.load_slope[*place] -= by.dot(&by_load);
                }
                self.add_along(&moves, &touch.normal, None, proximal / hat.area, size, out);
            }
            Grip::Slides(direction, turn) => {
                let held = direction * (friction * force);
                let by_load = direction * (friction * proximal * touch.by_load);
                for (place, by) in &moves {
                    out.residual[*place] -= by.dot(&held);
                    out.load_slope[*place] += by.dot(&by_load);
                }
                if !out.with_matrix {
                    return;
                }
                let turning = (friction * force * turn).clamp(0.0, proximal) / hat.area;
                self.add_along(&moves, &touch.normal, Some(direction), turning, size, out);
                out.coupling.resize(size * size, 0.0);
                for (column, by_gap) in out.coupling.chunks_exact_mut(size).zip(slope) {
                    let factor = friction * proximal / hat.area * by_gap;
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
