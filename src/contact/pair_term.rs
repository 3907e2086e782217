//! Contact of two parts as a term of the potential.

use crate::term::{CondensedUnknowns, Element, Protocol, Term, Unilateral, View};

use super::obstacle::TOO_FAR;
use super::pair::{PairContact, Piece};

impl<const D: usize> Term<D> for PairContact<D> {
    fn clusters(&self) -> usize {
        self.carrying
    }

    fn nodes(&self, _: usize) -> &[u32] {
        &self.nodes
    }

    fn linearize(&self, cluster: usize, view: View<'_>, out: &mut Element) {
        let pressure = view.condensed[cluster];
        let state = self.now(view.displacement);
        let mut pieces: Vec<Piece> = Vec::new();
        let overlap = self.overlap(cluster, &state, |piece| pieces.push(piece));
        if !self.is_active(cluster, pressure, overlap.gap) {
            return;
        }
        let of = |mover: u32| &self.movers.combinations[mover as usize];
        let all = pieces.iter().flat_map(|piece| &piece.movers);
        let mut used: Vec<u16> = all.flat_map(|&mover| of(mover)).map(|entry| entry.0).collect();
        used.sort_unstable();
        used.dedup();
        out.reset_compact::<D>(&used);
        let size = used.len() * D;
        let local = |place: u16| used.partition_point(|&u| u < place);
        let mut slope = vec![0.0; size];
        let mut half: Vec<f64> = Vec::new();
        for piece in &pieces {
            // (place in the element, factor) of each mover.
            let points: Vec<Vec<(usize, f64)>> = piece
                .movers
                .iter()
                .map(|&mover| of(mover).iter().map(|&(place, value)| (local(place), value)).collect())
                .collect();
            for (k, of) in points.iter().enumerate() {
                for &(place, value) in of {
                    for i in 0..D {
                        slope[place * D + i] += value * piece.slope[k * D + i];
                    }
                }
            }
            if !(out.with_matrix && pressure > 0.0) {
                continue;
            }
            // −π Tᵀ (∂²G) T, one side after the other.
            let rows = piece.curve.nrows();
            half.clear();
            half.resize(rows * size, 0.0);
            for (k, of) in points.iter().enumerate() {
                for i in 0..D {
                    let column = piece.curve.column(k * D + i);
                    for &(place, value) in of {
                        let target = &mut half[(place * D + i) * rows..][..rows];
                        target.iter_mut().zip(column.iter()).for_each(|(t, c)| *t -= pressure * value * c);
                    }
                }
            }
            for (column, from) in out.matrix.chunks_exact_mut(size).zip(half.chunks_exact(rows)) {
                for (k, of) in points.iter().enumerate() {
                    for &(place, value) in of {
                        for i in 0..D {
                            column[place * D + i] += value * from[k * D + i];
                        }
                    }
                }
            }
        }
        let proximal = self.proximal(cluster);
        let force = pressure - proximal * overlap.gap;
        for (r, s) in out.residual.iter_mut().zip(&slope) {
            *r -= force * s;
        }
        if out.with_matrix {
            for (column, b) in out.matrix.chunks_exact_mut(size).zip(&slope) {
                let factor = proximal / overlap.area * b;
                for (entry, a) in column.iter_mut().zip(&slope) {
                    *entry += factor * a;
                }
            }
        }
    }

    fn advance(&self, cluster: usize, view: View<'_>, step: &[f64], condensed_step: &mut [f64]) -> f64 {
        let pressure = view.condensed[cluster];
        let state = self.now(view.displacement);
        let mut change = 0.0;
        let overlap = self.overlap(cluster, &state, |piece| change += self.change(&piece, step));
        let (gap, change) = (overlap.gap, change / overlap.area);
        if self.is_active(cluster, pressure, gap) {
            condensed_step[0] = -self.proximal(cluster) * (gap + change);
            return 1.0;
        }
        condensed_step[0] = -pressure;
        let width = self.width(cluster);
        if gap.is_finite() {
            let most = TOO_FAR * width;
            return if gap + change < -most && change < 0.0 { ((gap + most) / -change).min(1.0) } else { 1.0 };
        }
        // What has nothing opposite goes no further than the search saw.
        let direction = self.moved(&self.movers.combinations[cluster], step).norm();
        if direction > state.reach { state.reach / direction } else { 1.0 }
    }

    fn condensed(&self) -> Option<&dyn CondensedUnknowns> {
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
        cluster..cluster + 1
    }
}

impl<const D: usize> Unilateral for PairContact<D> {
    fn rounding(&self) -> [f64; 2] {
        let extent = self.contact_surfaces.iter().map(|contact_surface| contact_surface.extent).fold(0.0, f64::max);
        self.stiffness.rounding(self.contact_surfaces[0].traces.iter(), extent)
    }
}

impl<const D: usize> Protocol for PairContact<D> {
    fn fills_compact(&self) -> bool {
        true
    }
}
