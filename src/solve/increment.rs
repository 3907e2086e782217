//! One step of all unknowns, and the linear systems behind it.

use crate::assembly::System;
use crate::boundary::Enforced;
use crate::error::LinearError;
use crate::linear::Factors;

use super::newton::{Control, dot, norm};
use super::path::State;
use super::rejection::Rejection;

/// Sweeps over the skew part per linear solve; each reduces the error by the ratio of skew to stiffness.
const SKEW_SWEEPS: usize = 40;

/// Linear solutions are refined until this relative residual: what is left of it is corrected by Newton's next
/// iteration, which would leave as much by its own rounding.
const REFINED: f64 = 1e-10;
/// Where there is a skew part, until this one: each sweep costs a solution, and Newton's next iteration finds what is
/// left of it at once.
const SWEPT: f64 = 1e-6;

/// Sweeps that leave more than this part of the residual of the one before give way to minimal residuals.
const SLOW: f64 = 0.5;
/// Directions over which residuals are minimised at most. The skew part lives on free faces under pressure, and few are
/// needed: a strip that pressure bends by 122° takes 2.
const DIRECTIONS: usize = 60;

/// A step of displacement, multipliers, load and local unknowns.
pub(super) struct Increment {
    pub step: Vec<f64>,
    /// Multipliers of the whole step.
    pub multipliers: Vec<f64>,
    pub locals: Vec<Vec<f64>>,
    /// The answer to a unit change of the load.
    pub load_step: Vec<f64>,
    pub load_multipliers: Vec<f64>,
    pub load_change: f64,
    gradient: Vec<f64>,
}

impl Increment {
    pub fn new(state: &State) -> Self {
        let (unknowns, rows) = (state.displacement.len(), state.multipliers.len());
        Increment {
            step: vec![0.0; unknowns],
            multipliers: vec![0.0; rows],
            locals: state.locals.iter().map(|l| vec![0.0; l.len()]).collect(),
            load_step: vec![0.0; unknowns],
            load_multipliers: vec![0.0; rows],
            load_change: 0.0,
            gradient: vec![0.0; unknowns],
        }
    }

    /// Adds as much of the answer to the load as brings a controlled functional to its target.
    pub fn lead(&mut self, control: Control<'_>, state: &State) -> Result<(), Rejection> {
        let Control::Functional(functional, target) = control else { return Ok(()) };
        functional.gradient(&state.displacement, &mut self.gradient);
        let along = dot(&self.gradient, &self.load_step);
        let missing = target - functional.value(&state.displacement) - dot(&self.gradient, &self.step);
        self.load_change = missing / along;
        if !self.load_change.is_finite() {
            return Err(Rejection::Control);
        }
        for (s, l) in self.step.iter_mut().zip(&self.load_step) {
            *s += self.load_change * l;
        }
        for (m, l) in self.multipliers.iter_mut().zip(&self.load_multipliers) {
            *m += self.load_change * l;
        }
        Ok(())
    }

    /// Takes `factor` of the step.
    pub fn apply(&self, factor: f64, state: &mut State) {
        for (d, s) in state.displacement.iter_mut().zip(&self.step) {
            *d += factor * s;
        }
        for (l, s) in state.locals.iter_mut().flatten().zip(self.locals.iter().flatten()) {
            *l += factor * s;
        }
        // Multipliers are linear in the increment: those of the full step belong to the full step.
        for (m, new) in state.multipliers.iter_mut().zip(&self.multipliers) {
            *m += factor * (new - *m);
        }
        state.load += factor * self.load_change;
    }
}

/// Buffers of one linear solve.
#[derive(Default)]
pub(super) struct Buffers {
    pub solution: Vec<f64>,
    pub rhs: Vec<f64>,
    pub load_rhs: Vec<f64>,
    correction: Vec<f64>,
    full: Vec<f64>,
    product: Vec<f64>,
    projected: Vec<f64>,
    skew: Vec<f64>,
    pub zero_gap: Vec<f64>,
    unused: Vec<f64>,
}

impl Buffers {
    pub fn new(rows: usize) -> Self {
        Buffers { zero_gap: vec![0.0; rows], unused: vec![0.0; rows], ..Buffers::default() }
    }
}

/// A factorised reduced system with its matrix.
pub(super) struct Linear<'a> {
    pub enforced: &'a dyn Enforced,
    pub factors: &'a dyn Factors,
    /// For the skew part.
    pub system: &'a System,
    /// The reduced matrix.
    pub values: &'a [f64],
}

impl Linear<'_> {
    /// Solves for a reduced right-hand side: the symmetric factors carry the symmetric part, sweeps of iterative
    /// refinement the skew part and what rounding left.
    pub fn solve(&self, load: bool, buffers: &mut Buffers) -> Result<(), LinearError> {
        let Linear { enforced, factors, system, values } = *self;
        let rhs = if load { &buffers.load_rhs } else { &buffers.rhs };
        buffers.solution.clone_from(rhs);
        factors.solve_in_place(&mut buffers.solution)?;
        let size = norm(rhs);
        let sweeps = if system.skew.is_empty() { 1 } else { SKEW_SWEEPS };
        let mut before = f64::INFINITY;
        let mut residual = 0.0;
        for sweep in 0..=sweeps {
            buffers.product.clear();
            buffers.product.resize(rhs.len(), 0.0);
            enforced.pattern().multiply_add(values, &buffers.solution, &mut buffers.product);
            if !system.skew.is_empty() {
                buffers.full.resize(system.residual.len(), 0.0);
                enforced.recover(&buffers.solution, &buffers.zero_gap, &mut buffers.full, &mut buffers.unused);
                buffers.skew.clear();
                buffers.skew.resize(system.residual.len(), 0.0);
                system.skew_multiply_add(&buffers.full, &mut buffers.skew);
                enforced.project(&buffers.skew, &mut buffers.projected);
                for (p, s) in buffers.product.iter_mut().zip(&buffers.projected) {
                    *p += s;
                }
            }
            buffers.correction.clear();
            buffers.correction.extend(rhs.iter().zip(&buffers.product).map(|(b, p)| b - p));
            residual = norm(&buffers.correction);
            if !residual.is_finite() {
                return Err(LinearError::Residual { residual });
            }
            // One sweep removes the rounding of the factors; the skew part needs as many as it takes.
            if residual <= (if system.skew.is_empty() { REFINED } else { SWEPT }) * size
                || (system.skew.is_empty() && residual >= 0.9 * before)
                || sweep == sweeps
            {
                break;
            }
            if residual > SLOW * before {
                return self.minimise(residual > size, load, buffers);
            }
            before = residual;
            factors.solve_in_place(&mut buffers.correction)?;
            for (x, c) in buffers.solution.iter_mut().zip(&buffers.correction) {
                *x += c;
            }
        }
        // A solution of a regular system leaves next to nothing; what is left of a singular one is of its own size.
        if system.skew.is_empty() && residual > 1e-3 * size {
            return Err(LinearError::Residual { residual: residual / size });
        }
        Ok(())
    }

    /// Generalised minimal residuals of $(1 + K^{-1}N)\\,x = K^{-1}b$, from zero or from what sweeps have found with the
    /// residual left in the correction: where the skew part is no longer small beside the stiffness, as in slender bodies
    /// with free ends under following pressure, sweeps go astray.
    fn minimise(&self, from_zero: bool, load: bool, buffers: &mut Buffers) -> Result<(), LinearError> {
        let Linear { enforced, factors, system, .. } = *self;
        if from_zero {
            buffers.correction.clone_from(if load { &buffers.load_rhs } else { &buffers.rhs });
            buffers.solution.fill(0.0);
        }
        factors.solve_in_place(&mut buffers.correction)?;
        let size = norm(&buffers.correction);
        if !(size > 0.0) {
            return Ok(());
        }
        let mut basis = vec![buffers.correction.iter().map(|r| r / size).collect::<Vec<f64>>()];
        // Columns of the triangular factor of Hessenberg's matrix, its rotations, and what they leave of the right-hand side.
        let (mut columns, mut rotations, mut left) = (Vec::<Vec<f64>>::new(), Vec::<[f64; 2]>::new(), vec![size]);
        while basis.len() <= DIRECTIONS {
            let last = &basis[basis.len() - 1];
            buffers.full.resize(system.residual.len(), 0.0);
            enforced.recover(last, &buffers.zero_gap, &mut buffers.full, &mut buffers.unused);
            buffers.skew.clear();
            buffers.skew.resize(system.residual.len(), 0.0);
            system.skew_multiply_add(&buffers.full, &mut buffers.skew);
            enforced.project(&buffers.skew, &mut buffers.projected);
            factors.solve_in_place(&mut buffers.projected)?;
            let mut next: Vec<f64> = last.iter().zip(&buffers.projected).map(|(v, n)| v + n).collect();
            let mut column = Vec::with_capacity(basis.len() + 1);
            for other in &basis {
                let along = dot(other, &next);
                next.iter_mut().zip(other).for_each(|(n, o)| *n -= along * o);
                column.push(along);
            }
            let length = norm(&next);
            for (k, [cosine, sine]) in rotations.iter().enumerate() {
                let (a, b) = (column[k], column[k + 1]);
                (column[k], column[k + 1]) = (cosine * a + sine * b, cosine * b - sine * a);
            }
            let end = column.len() - 1;
            let hypotenuse = column[end].hypot(length);
            if !(hypotenuse > 0.0 && hypotenuse.is_finite()) {
                return Err(LinearError::Residual { residual: hypotenuse });
            }
            let rotation = [column[end] / hypotenuse, length / hypotenuse];
            column[end] = hypotenuse;
            columns.push(column);
            rotations.push(rotation);
            left.push(-rotation[1] * left[end]);
            left[end] *= rotation[0];
            if left[end + 1].abs() <= SWEPT * size || length <= f64::EPSILON * hypotenuse {
                break;
            }
            basis.push(next.iter().map(|n| n / length).collect());
        }
        for k in (0..columns.len()).rev() {
            let known: f64 = (k + 1..columns.len()).map(|j| columns[j][k] * left[j]).sum();
            left[k] = (left[k] - known) / columns[k][k];
            buffers.solution.iter_mut().zip(&basis[k]).for_each(|(x, v)| *x += left[k] * v);
        }
        Ok(())
    }
}
