//! Solutions by generalised minimal residuals.

use crate::each::{Each, EachOf, add};
use crate::error::LinearError;
use crate::parallel::lock;

use super::super::gmres::gmres;
use super::super::vector::dot;
use super::auxiliary::total;
use super::convergence::{ConvergenceHistory, Progress};
use super::product::Solved;

/// Relative residuals of solutions: no more than Newton's method can make use of. It leaves about the square of what the last
/// iteration has reduced the right-hand side by (Eisenstat and Walker, second choice).
const TOLERANCE: [f64; 2] = [1e-5, 1e-2];
/// Relative residual of solutions that no iteration of Newton's method corrects: what is left of a change of volume counts times
/// the bulk modulus in dual pressures.
const FULL: f64 = 1e-8;
/// Right-hand sides are not reduced below this part of the largest of an analysis.
const ENOUGH: f64 = 1e-12;
/// Right-hand sides below this part of the largest of an analysis may be rounding, which no iteration removes.
const ROUNDING: f64 = 1e-8;
/// What may be left of a right-hand side that is rounding.
const LEFT_OF_ROUNDING: f64 = 0.5;
/// Krylov iterations before a restart, and at most.
const ITERATIONS: [usize; 2] = [80, 240];

impl Solved<'_> {
    /// See [`Iteration::solve`](super::iteration::Iteration::solve).
    pub(super) fn solve(
        &self,
        rhs: &mut [f64],
        pressures: &mut [[f64; 4]],
        fully: bool,
        progress: &mut Progress,
    ) -> Result<f64, LinearError> {
        let (force, gap) = rhs.split_at_mut(self.unknowns);
        let mut met = self.met(gap)?;
        let right = self.right_hand_side(&met, force, pressures);
        let mut x = vec![0.0; right.len()];
        let residual = self.minimise(&right, &mut x, fully, progress)?;
        let (mine, q) = x.split_at(self.own.len());
        add(&mut met, 1.0, &self.gathered(mine));
        let mut left = vec![0.0; self.unknowns];
        self.multiply(&met, q, &mut left, &mut vec![0.0; q.len()]);
        total(self.ranks, &mut left);
        for ((pressures, own), q) in pressures.iter_mut().zip(self.pressures).zip(q.as_chunks::<4>().0) {
            *pressures = q.each(|q| own.scale * q);
        }
        left.iter_mut().zip(&*force).for_each(|(l, f)| *l = f - *l);
        let mu = self.multipliers(&left)?;
        gap.iter_mut().zip(mu).for_each(|(gap, mu)| *gap = mu / self.stiffness);
        force.copy_from_slice(&met);
        Ok(residual.max(f64::MIN_POSITIVE))
    }

    /// A displacement that meets the conditions.
    fn met(&self, gap: &[f64]) -> Result<Vec<f64>, LinearError> {
        let mut met = vec![0.0; self.unknowns];
        if let Some(projector) = &self.projector {
            let mut mu: Vec<f64> = gap.mapped(|g| g / self.stiffness);
            projector.solve(&mut mu)?;
            self.react(&mu, 1.0, &mut met);
        }
        Ok(met)
    }

    /// What is left for displacements that conditions leave free, of this rank, and for scaled pressures.
    fn right_hand_side(&self, met: &[f64], force: &[f64], pressures: &[[f64; 4]]) -> Vec<f64> {
        let mut right = vec![0.0; self.own.len() + 4 * self.system.zones.len()];
        let (u, q) = right.split_at_mut(self.own.len());
        let mut whole = vec![0.0; self.unknowns];
        if met.iter().any(|m| *m != 0.0) {
            self.multiply(met, &vec![0.0; q.len()], &mut whole, q);
            total(self.ranks, &mut whole);
        }
        whole.iter_mut().zip(force).for_each(|(u, f)| *u = f - *u);
        self.project(&mut whole);
        u.copy_from_slice(&whole[self.own.clone()]);
        let wanted = pressures.iter().zip(self.pressures).flat_map(|(g, own)| g.each(|g| own.scale * g));
        q.iter_mut().zip(wanted).for_each(|(q, wanted)| *q = wanted - *q);
        right
    }

    /// Minimises the residual, and remembers what it took; what is left of it.
    fn minimise(&self, right: &[f64], x: &mut [f64], fully: bool, progress: &mut Progress) -> Result<f64, LinearError> {
        let norm = self.total(dot(right, right)).sqrt();
        progress.largest = progress.largest.max(norm);
        let largest = progress.largest;
        let rounding = norm <= ROUNDING * largest;
        let [least, most] = TOLERANCE;
        let reduced = norm / std::mem::replace(&mut progress.last, norm);
        let usable = reduced.powi(2).max(ENOUGH * largest / norm).clamp(least, most);
        let tolerance = if fully { FULL } else { usable };
        let apply = |x: &[f64], y: &mut [f64]| self.apply(x, y);
        let precondition = |x: &[f64], y: &mut [f64]| self.precondition(x, y);
        let sum = |mine| self.total(mine);
        let done = gmres(
            right,
            x,
            (tolerance, if rounding { LEFT_OF_ROUNDING } else { 0.0 }),
            ITERATIONS,
            apply,
            precondition,
            sum,
        );
        lock(&progress.counts).push(done.iterations);
        let convergence = done.iterations as f64 / -done.residual.min(0.9).log10();
        if done.iterations > 0 {
            let first = progress.convergence.first.or(Some(convergence));
            progress.convergence = ConvergenceHistory { first, last: convergence };
        }
        // What is not quite solved is left to Newton's next iteration.
        let allowed = if rounding { LEFT_OF_ROUNDING } else { most };
        ensure!(done.residual <= allowed, LinearError::Residual { residual: done.residual });
        Ok(done.residual)
    }

    /// The projected matrix times a vector of displacements of this rank and scaled pressures.
    fn apply(&self, x: &[f64], y: &mut [f64]) {
        let own = self.own.clone();
        let ((mine, q), (y, z)) = (x.split_at(own.len()), y.split_at_mut(own.len()));
        let u = self.gathered(mine);
        let mut force = vec![0.0; self.unknowns];
        self.multiply(&u, q, &mut force, z);
        total(self.ranks, &mut force);
        self.project(&mut force);
        y.copy_from_slice(&force[own]);
        let zones = self.pressures.iter().zip(q.as_chunks::<4>().0).zip(z.as_chunks_mut::<4>().0);
        for ((own, q), z) in zones {
            let soft = own.compliance * nalgebra::Vector4::from(*q);
            (0..4).for_each(|k| z[k] -= soft[k]);
        }
    }

    /// In place of the inverse: pressures first, then displacements under them.
    fn precondition(&self, x: &[f64], y: &mut [f64]) {
        let own = self.own.clone();
        let ((u, q), (y, z)) = (x.split_at(own.len()), y.split_at_mut(own.len()));
        let zones = self.pressures.iter().zip(q.as_chunks::<4>().0).zip(z.as_chunks_mut::<4>().0);
        for ((own, q), z) in zones {
            let answer = own.inverse * nalgebra::Vector4::from(*q);
            (0..4).for_each(|k| z[k] = -answer[k]);
        }
        let mut force = vec![0.0; self.unknowns];
        force[own.clone()].copy_from_slice(u);
        self.pressed(z, -1.0, &mut force);
        total(self.ranks, &mut force);
        self.project(&mut force);
        self.smooth(&mut force);
        self.project(&mut force);
        y.copy_from_slice(&force[own]);
    }
}
