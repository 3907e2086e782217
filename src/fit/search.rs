//! The search for optima: many starts, each followed by the method of Levenberg and Marquardt.
//!
//! The library of that method stands on another version of nalgebra than this crate: what passes between them here are slices,
//! and its types appear in no signature outside of this file.

use std::sync::Arc;

use fastrand::Rng;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector};
use nalgebra_of_levenberg_marquardt as other;

use super::{Coefficient, Family, TestData};
use crate::each::{Each, EachOf};
use crate::material::{Material, Mode};

/// A residual where the law has no answer: far above any error of a fit, so that the step is taken back.
const REFUSED: f64 = 1e4;

/// Sweeps over the stresses of a start, and how near to its lower bound it may bring one, in units of the modulus.
const SWEEPS: usize = 200;
const LEAST: f64 = 1e-6;

/// Step of differences, relative.
const STEP: f64 = 1e-6;

/// What is minimised: residuals $\sqrt{w_t/n_t}\\,(P(\lambda) - P_t)/\text{RMS}(P_t)$ of all points, as a function of the coefficients.
pub(super) struct Residuals<'a> {
    pub family: &'a dyn Family,
    pub coefficients: Vec<Coefficient>,
    /// Unit of the coefficients: the shear modulus that the data suggest, or 1.
    pub units: Vec<f64>,
    /// Mode, stretch, stress and factor of each point.
    points: Vec<(Mode, f64, f64, f64)>,
}

/// Where a start ended.
#[derive(Debug, Clone)]
pub(super) struct End {
    pub values: Vec<f64>,
    pub residuals: Vec<f64>,
    /// Whether it is an optimum: the gradient vanishes beside residuals and Jacobian.
    pub settled: bool,
}

impl End {
    pub(crate) fn cost(&self) -> f64 {
        self.residuals.summed(|r| r * r)
    }
}

impl<'a> Residuals<'a> {
    pub(crate) fn new(family: &'a dyn Family, coefficients: Vec<Coefficient>, data: &TestData, modulus: f64) -> Self {
        let units = coefficients.mapped(|c| if c.is_stress { modulus } else { 1.0 });
        let seen = data.tests().iter().filter(|t| family.is_compressible() || t.mode != Mode::Volumetric);
        let points = seen
            .flat_map(|test| {
                let factor = (test.weight / test.points.len() as f64).sqrt() / test.size();
                test.points.iter().map(move |&[stretch, stress]| (test.mode, stretch, stress, factor))
            })
            .collect();
        Self { family, coefficients, units, points }
    }

    /// Residuals at values of the coefficients; NaN where the law has no answer.
    pub(crate) fn at(&self, values: &[f64]) -> Vec<f64> {
        let Ok(law) = self.family.build(values) else { return vec![f64::NAN; self.points.len()] };
        let residual = |&(mode, stretch, stress, factor): &(Mode, f64, f64, f64)| {
            (predict(&law, self.family.is_compressible(), mode, stretch) - stress) * factor
        };
        self.points.mapped(residual)
    }

    /// $\partial r/\partial c$ by central differences; zero columns where the law has no answer on either side.
    pub(crate) fn jacobian(&self, values: &[f64]) -> DMatrix<f64> {
        let step = |c: usize| STEP * values[c].abs().max(1e-4 * self.units[c]);
        self.differences(values, &step, &|values| self.at(values))
    }

    /// Derivatives of residuals with respect to numbers, with a step for each.
    fn differences(
        &self,
        numbers: &[f64],
        step: &dyn Fn(usize) -> f64,
        residuals: &dyn Fn(&[f64]) -> Vec<f64>,
    ) -> DMatrix<f64> {
        let mut jacobian = DMatrix::zeros(self.points.len(), numbers.len());
        for c in 0..numbers.len() {
            let along = |step: f64| {
                let mut moved = numbers.to_vec();
                moved[c] += step;
                residuals(&moved)
            };
            let step = step(c);
            jacobian.set_column(c, &slopes(&along(step), &along(-step), &|| residuals(numbers), step));
        }
        jacobian
    }

    /// Values of the coefficients at the free numbers that the method works with.
    fn values(&self, free: &[f64]) -> Vec<f64> {
        let of = |((c, unit), x): ((&Coefficient, &f64), &f64)| {
            let [low, high] = c.bounds;
            unit * match (low.is_finite(), high.is_finite()) {
                (false, false) => *x,
                (true, false) => low + x.exp(),
                (false, true) => high - x.exp(),
                (true, true) => low + (high - low) / (1.0 + (-x).exp()),
            }
        };
        self.coefficients.iter().zip(&self.units).zip(free).map(of).collect()
    }

    /// A random start, in free numbers.
    fn start(&self, random: &mut Rng) -> Vec<f64> {
        let of = |c: &Coefficient| {
            let [low, high] = c.start;
            let t = random.f64();
            let value = if low > 0.0 { low * (high / low).powf(t) } else { low + (high - low) * t };
            freed(c, value)
        };
        self.coefficients.mapped(of)
    }

    /// The free numbers of values of the coefficients.
    fn free(&self, values: &[f64]) -> Vec<f64> {
        self.coefficients.iter().zip(&self.units).zip(values).map(|((c, unit), value)| freed(c, value / unit)).collect()
    }

    /// Follows one random start to its end; `None` where the law answers at no start that was tried.
    pub(crate) fn follow(&self, random: &mut Rng) -> Option<End> {
        const TRIES: usize = 200;
        let finite = |free: &Vec<f64>| self.at(&self.values(free)).iter().all(|r| r.is_finite());
        let start = (0..TRIES).map(|_| self.start(random)).find(finite)?;
        let mut free = self.scaled(start);
        // A second run with fresh scales takes the first where narrow valleys left it.
        for _ in 0..2 {
            let problem = Problem { residuals: self, free: other::DVector::from_vec(free) };
            let (problem, _) = LevenbergMarquardt::new().with_patience(300).minimize(problem);
            free = problem.free.as_slice().to_vec();
        }
        let mut values = self.values(&free);
        let residuals = self.at(&values);
        let settled = residuals.iter().all(|r| r.is_finite()) && self.is_settled(&free, &residuals);
        self.arrange(&mut values);
        Some(End { values, residuals, settled })
    }

    /// Puts terms into the order of their family, where they change places with others of the same bounds alone: a bound that was given for a
    /// term by its name holds for the term of that name.
    fn arrange(&self, values: &mut [f64]) {
        let mut arranged = values.to_vec();
        self.family.arrange(&mut arranged);
        let bounds = |place: usize| self.coefficients[place].bounds;
        let fits = |(to, value): (usize, &f64)| {
            (0..values.len()).filter(|&from| values[from] == *value).all(|from| bounds(from) == bounds(to))
        };
        if arranged.iter().enumerate().all(fits) {
            values.copy_from_slice(&arranged);
        }
    }

    /// A start with the stresses among its coefficients as the data ask for: most laws are linear in them, and a start whose numbers
    /// are random and whose stresses fit is far less often led astray. The start as it is where that is no better.
    fn scaled(&self, start: Vec<f64>) -> Vec<f64> {
        let mut values = self.values(&start);
        let (jacobian, residuals) = (self.jacobian(&values), self.at(&values));
        let mut left = DVector::from_vec(residuals);
        let before = left.norm();
        // Coordinate by coordinate, each held above its lower bound.
        for _ in 0..SWEEPS {
            for (c, coefficient) in self.coefficients.iter().enumerate().filter(|(_, c)| c.is_stress) {
                let column = jacobian.column(c);
                let square = column.norm_squared();
                if square <= 0.0 {
                    continue;
                }
                let [low, high] = coefficient.bounds.each(|b| b * self.units[c]);
                let least = if low.is_finite() { low + LEAST * self.units[c] } else { low };
                let next = (values[c] - column.dot(&left) / square).clamp(least, high.max(least));
                left.axpy(next - values[c], &column, 1.0);
                values[c] = next;
            }
        }
        let better = self.at(&values).summed(|r| r * r).sqrt() < before;
        if better { self.free(&values) } else { start }
    }

    /// Whether no coefficient alone, moved by an e-fold or less, promises to take more than a 1e-5th off the sum of squares.
    fn is_settled(&self, free: &[f64], residuals: &[f64]) -> bool {
        let r = DVector::from_column_slice(residuals);
        let jacobian = self.free_jacobian(free);
        // Data that are met exactly leave nothing to gain.
        let cost = r.norm_squared();
        cost.sqrt() < 1e-9
            || jacobian.column_iter().all(|column| {
                let (along, square) = (column.dot(&r).abs(), column.norm_squared());
                let gain = if along <= square { along * along / square } else { 2.0 * along - square };
                square == 0.0 || gain <= 1e-5 * cost
            })
    }

    fn free_jacobian(&self, free: &[f64]) -> DMatrix<f64> {
        self.differences(free, &|c| STEP * (1.0 + free[c].abs()), &|free| self.at(&self.values(free)))
    }
}

/// The free number of a coefficient's value in its unit.
fn freed(coefficient: &Coefficient, value: f64) -> f64 {
    let [least, most] = coefficient.bounds;
    match (least.is_finite(), most.is_finite()) {
        (false, false) => value,
        (true, false) => (value - least).max(f64::MIN_POSITIVE).ln(),
        (false, true) => (most - value).max(f64::MIN_POSITIVE).ln(),
        (true, true) => {
            let part = ((value - least) / (most - least)).clamp(1e-9, 1.0 - 1e-9);
            (part / (1.0 - part)).ln()
        }
    }
}

/// Central differences, one-sided where the law answers on one side alone.
fn slopes(ahead: &[f64], behind: &[f64], here: &dyn Fn() -> Vec<f64>, step: f64) -> DVector<f64> {
    let finite = |r: &[f64]| r.iter().all(|r| r.is_finite());
    let difference =
        |a: &[f64], b: &[f64], h: f64| DVector::from_iterator(a.len(), a.iter().zip(b).map(|(a, b)| (a - b) / h));
    match (finite(ahead), finite(behind)) {
        (true, true) => difference(ahead, behind, 2.0 * step),
        (true, false) => difference(ahead, &here(), step),
        (false, true) => difference(&here(), behind, step),
        (false, false) => DVector::zeros(ahead.len()),
    }
}

/// The nominal stress of a law at a stretch (the mean Cauchy stress at a volume ratio in volumetric tests); NaN where there is none.
pub(super) fn predict(law: &Arc<dyn Material>, compressible: bool, mode: Mode, stretch: f64) -> f64 {
    match mode {
        // The shape alone says nothing of it.
        Mode::Volumetric if !compressible => f64::NAN,
        Mode::Volumetric => {
            let side = stretch.cbrt();
            mode.state(law, side).map_or(f64::NAN, |state| state.stress / (side * side))
        }
        _ if compressible => mode.state(law, stretch).map_or(f64::NAN, |state| state.stress),
        _ => mode.incompressible_state(law, stretch).stress,
    }
}

struct Problem<'a> {
    residuals: &'a Residuals<'a>,
    free: other::DVector<f64>,
}

impl LeastSquaresProblem<f64, other::Dyn, other::Dyn> for Problem<'_> {
    type ResidualStorage = other::VecStorage<f64, other::Dyn, other::U1>;
    type JacobianStorage = other::VecStorage<f64, other::Dyn, other::Dyn>;
    type ParameterStorage = other::VecStorage<f64, other::Dyn, other::U1>;

    fn set_params(&mut self, x: &other::DVector<f64>) {
        self.free.copy_from(x);
    }

    fn params(&self) -> other::DVector<f64> {
        self.free.clone()
    }

    fn residuals(&self) -> Option<other::DVector<f64>> {
        let mut residuals = self.residuals.at(&self.residuals.values(self.free.as_slice()));
        if !residuals.iter().all(|r| r.abs() < REFUSED) {
            residuals.fill(REFUSED);
        }
        Some(other::DVector::from_vec(residuals))
    }

    fn jacobian(&self) -> Option<other::DMatrix<f64>> {
        let jacobian = self.residuals.free_jacobian(self.free.as_slice());
        Some(other::DMatrix::from_column_slice(jacobian.nrows(), jacobian.ncols(), jacobian.as_slice()))
    }
}
