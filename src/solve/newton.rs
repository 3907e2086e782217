//! One Newton solve: from a predicted state to an equilibrium under a control.

use std::fmt;

use crate::assembly::{Assembler, Model, System};
use crate::boundary::{Constraints, Enforced};
use crate::error::LinearError;
use crate::linear::{Factorizer, Factors, Inertia, MatrixClass};

use super::path::{Iteration, Observer, State};
use super::search::{Ahead, LineSearch};

/// A scalar function of the displacement that may control an analysis in place of the load.
///
/// ```
/// use rkpm::solve::Functional;
/// /// The sum of the squares of all coefficients.
/// struct Square;
/// impl Functional for Square {
///     fn value(&self, d: &[f64]) -> f64 { d.iter().map(|x| x * x).sum() }
///     fn gradient(&self, d: &[f64], out: &mut [f64]) {
///         for (o, x) in out.iter_mut().zip(d) { *o = 2.0 * x; }
///     }
/// }
/// assert_eq!(Square.value(&[1.0, 2.0]), 5.0);
/// ```
pub trait Functional: Send + Sync {
    /// $q(d)$.
    fn value(&self, displacement: &[f64]) -> f64;

    /// Writes $\partial q/\partial d$.
    fn gradient(&self, displacement: &[f64], out: &mut [f64]);

    /// Number of displacement unknowns that it is made for, `None` where any will do.
    fn unknowns(&self) -> Option<usize> {
        None
    }
}

/// A linear functional $q = c\cdot d$: a displacement at a point, or a generalised deflection.
#[derive(Debug, Clone, PartialEq)]
pub struct Deflection {
    /// $c$, one entry per coefficient.
    pub weights: Vec<f64>,
}

impl Functional for Deflection {
    fn value(&self, displacement: &[f64]) -> f64 {
        self.weights.iter().zip(displacement).map(|(c, d)| c * d).sum()
    }

    fn gradient(&self, _displacement: &[f64], out: &mut [f64]) {
        for (o, weight) in out.iter_mut().zip(&self.weights) {
            *o = *weight;
        }
    }

    fn unknowns(&self) -> Option<usize> {
        Some(self.weights.len())
    }
}

/// What is held fixed while Newton iterates.
#[derive(Clone, Copy)]
pub enum Control<'a> {
    /// The load factor.
    Load(f64),
    /// A functional of the displacement, the load factor being unknown.
    Functional(&'a dyn Functional, f64),
}

/// Settings of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Newton {
    /// Most iterations of one attempt.
    pub iterations: usize,
    /// Converged where the increment is below this part of the displacement. Looser values lost the
    /// path of thin sheets.
    pub tolerance: f64,
    /// Whether steps are shortened by what the residual does along them.
    pub search: LineSearch,
}

impl Default for Newton {
    /// 30 iterations, 1e-8, whole steps.
    fn default() -> Self {
        Newton { iterations: 30, tolerance: 1e-8, search: LineSearch::Off }
    }
}

/// Why an attempt was given up.
#[derive(Debug, Clone, PartialEq)]
pub enum Rejection {
    /// Not converged within the allowed iterations.
    Iterations(usize),
    /// The path guard kept cutting the step: the attempt is too far away.
    Guarded {
        /// The last step factor.
        factor: f64,
    },
    /// The increments grow although the state was predicted from others.
    Diverging {
        /// The last increment relative to the displacement.
        increment: f64,
    },
    /// Numbers that are not finite: a material left its domain.
    NotFinite,
    /// The linear solve failed.
    Linear(LinearError),
    /// The controlled functional does not change with the load.
    Control,
    /// A large step has gained unstable modes: it may have left its path.
    Unstable {
        /// Unstable modes before the step.
        before: usize,
        /// Unstable modes after it.
        after: usize,
    },
    /// The arc runs back along the path.
    Turned,
}

/// Gained modes are followed up by this part of the smallest increment: with the default of that, down to Newton's
/// own tolerance.
const LOCATED: f64 = 1e-4;

impl Rejection {
    /// The increment below which a run stalls, from the one for attempts that do not converge: what a large step
    /// gained is real only once the step is small, however far away the next target is.
    pub(super) fn least(&self, smallest: f64) -> f64 {
        match self {
            Rejection::Unstable { .. } => LOCATED * smallest,
            _ => smallest,
        }
    }
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Rejection::Iterations(n) => write!(f, "not converged within {n} iterations"),
            Rejection::Guarded { factor } => {
                write!(f, "the path guard cut every step (factor {factor:.3}): the next state is too far away")
            }
            Rejection::Diverging { increment } => {
                write!(
                    f,
                    "the increments grow (now {increment:.1e} of the displacement): the next state is too far away"
                )
            }
            Rejection::NotFinite => write!(f, "forces are not finite: a material left its domain"),
            Rejection::Linear(error) => write!(f, "{error}"),
            Rejection::Unstable { before, after } => {
                write!(f, "a large step turns {before} unstable modes into {after}: the state may lie on another path")
            }
            Rejection::Turned => write!(f, "the arc runs back along the path"),
            Rejection::Control => write!(f, "the controlled quantity does not change with the load"),
        }
    }
}

/// Step factors below this from the second iteration on mean that the attempt is too far away.
const SMALL_FACTOR: f64 = 0.3;
/// Small factors in a row before the attempt is given up.
const SMALL_FACTORS: usize = 3;
/// A predicted attempt whose increments grow beyond this multiple of the first one is too far away; those
/// that converged on the way through the disk's inflation stayed below 1.5.
const GROWN: f64 = 2.0;
/// Increments below this part of the displacement may grow all the same.
const GROWN_LEAST: f64 = 1e-2;
/// An unknown load factor is settled once it changes by no more than this part: convergence is quadratic, and the
/// balloon's load was off by 4e-8 after a last change of 2e-5, by 1e-14 after one more iteration.
const LOAD_SETTLED: f64 = 1e-6;
/// Load factors below this count as this one: a path may pass through zero.
const LEAST_LOAD: f64 = 1e-3;
/// Sweeps over the skew part per linear solve; each reduces the error by the ratio of skew to stiffness.
const SKEW_SWEEPS: usize = 40;

/// Linear solutions are refined until this relative residual: what is left of it is corrected by Newton's next
/// iteration, which would leave as much by its own rounding.
const REFINED: f64 = 1e-10;

/// Everything a Newton solve works with; buffers are kept from one solve to the next.
pub(crate) struct Workspace<'a, const D: usize> {
    pub model: &'a Model<D>,
    pub rows: &'a Constraints,
    pub assembler: Assembler,
    pub enforced: Box<dyn Enforced>,
    pub factorizer: Box<dyn Factorizer>,
    pub system: System,
    pub values: Vec<f64>,
    pub iterations: usize,
    pub inertia: Option<Inertia>,
}

/// Buffers of one linear solve.
#[derive(Default)]
struct Buffers {
    solution: Vec<f64>,
    rhs: Vec<f64>,
    correction: Vec<f64>,
    full: Vec<f64>,
    product: Vec<f64>,
    projected: Vec<f64>,
    skew: Vec<f64>,
    zero_gap: Vec<f64>,
    unused: Vec<f64>,
}

impl<const D: usize> Workspace<'_, D> {
    /// Iterates `state` to an equilibrium; on rejection the state is left where the attempt ended.
    /// `near` says that the state was predicted from others, so that increments must not grow.
    pub fn newton(
        &mut self,
        settings: &Newton,
        state: &mut State,
        control: Control<'_>,
        observer: &mut dyn Observer,
        scale: f64,
        near: bool,
    ) -> Result<usize, Rejection> {
        let unknowns = self.model.unknowns();
        let mut buffers = Buffers::default();
        let (mut gap, mut slope) = (Vec::new(), Vec::new());
        let mut step = vec![0.0; unknowns];
        let mut load_step = vec![0.0; unknowns];
        let mut gradient = vec![0.0; unknowns];
        let mut multipliers = vec![0.0; self.rows.len()];
        let mut load_multipliers = vec![0.0; self.rows.len()];
        let mut imbalance = Vec::new();
        let mut locals_step: Vec<Vec<f64>> = state.locals.iter().map(|l| vec![0.0; l.len()]).collect();
        if let Control::Load(load) = control {
            state.load = load;
        }
        let mut small = 0;
        let mut first = f64::INFINITY;
        for number in 1..=settings.iterations {
            self.assembler.assemble(self.model, &state.displacement, &state.locals, state.load, &mut self.system);
            self.iterations += 1;
            if !self.system.scale.is_finite() {
                return Err(Rejection::NotFinite);
            }
            self.enforced.imbalance(&self.system.residual, &state.multipliers, &mut imbalance);
            let residual = norm(&imbalance) / self.system.scale.max(f64::MIN_POSITIVE);
            self.rows.gap(&state.displacement, state.load, &mut gap);
            self.enforced.reduce(&self.system, &mut self.values);
            let factors = self.factorizer.factorize(&self.values).map_err(Rejection::Linear)?;
            self.inertia = factors.inertia();
            let force: Vec<f64> = self.system.residual.iter().map(|r| -r).collect();
            solve(&*self.enforced, &*factors, &self.system, &self.values, &force, &gap, &mut buffers)
                .map_err(Rejection::Linear)?;
            self.enforced.recover(&buffers.solution, &gap, &mut step, &mut multipliers);
            let mut load_change = 0.0;
            if let Control::Functional(functional, target) = control {
                let force: Vec<f64> = self.system.load_slope.iter().map(|r| -r).collect();
                self.rows.load_slope(state.load, &mut slope);
                solve(&*self.enforced, &*factors, &self.system, &self.values, &force, &slope, &mut buffers)
                    .map_err(Rejection::Linear)?;
                self.enforced.recover(&buffers.solution, &slope, &mut load_step, &mut load_multipliers);
                functional.gradient(&state.displacement, &mut gradient);
                let along = dot(&gradient, &load_step);
                load_change = (target - functional.value(&state.displacement) - dot(&gradient, &step)) / along;
                if !load_change.is_finite() {
                    return Err(Rejection::Control);
                }
                for (s, l) in step.iter_mut().zip(&load_step) {
                    *s += load_change * l;
                }
                for (m, l) in multipliers.iter_mut().zip(&load_multipliers) {
                    *m += load_change * l;
                }
            }
            drop(factors);
            let bound = self.model.advance(&state.displacement, &state.locals, state.load, &step, &mut locals_step);
            if !(bound > 0.0) {
                return Err(Rejection::Guarded { factor: bound });
            }
            let factor = match (settings.search, control) {
                (LineSearch::Slope, Control::Load(_)) => {
                    let ahead = Ahead { step: &step, locals: &locals_step, multipliers: &multipliers, gap: &gap };
                    self.search(state, &imbalance, &ahead, bound)
                }
                _ => bound,
            };
            for (d, s) in state.displacement.iter_mut().zip(&step) {
                *d += factor * s;
            }
            for (locals, steps) in state.locals.iter_mut().zip(&locals_step) {
                for (l, s) in locals.iter_mut().zip(steps) {
                    *l += factor * s;
                }
            }
            // Multipliers are linear in the increment: those of the full step belong to the full step.
            for (m, new) in state.multipliers.iter_mut().zip(&multipliers) {
                *m += factor * (new - *m);
            }
            state.load += factor * load_change;
            // Below rounding of the body's own size an increment is nothing.
            let size = norm(&state.displacement).max(1e-6 * scale * (unknowns as f64).sqrt());
            let increment = norm(&step) / size;
            if !increment.is_finite() {
                return Err(Rejection::NotFinite);
            }
            observer.iteration(&Iteration { load: state.load, number, residual, increment, factor });
            // The load of a nearly incompressible wall settles after its displacement.
            let settled = load_change.abs() <= LOAD_SETTLED * state.load.abs().max(LEAST_LOAD);
            if factor == 1.0 && increment <= settings.tolerance && settled {
                return Ok(number);
            }
            if number == 1 {
                first = increment;
            } else if near && increment > (GROWN * first).max(GROWN_LEAST) {
                return Err(Rejection::Diverging { increment });
            }
            small = if number >= 2 && factor < SMALL_FACTOR { small + 1 } else { 0 };
            if small >= SMALL_FACTORS {
                return Err(Rejection::Guarded { factor });
            }
        }
        Err(Rejection::Iterations(settings.iterations))
    }

    /// Negative pivots less constraints at the last factorisation, where the solver knows them.
    pub fn unstable_modes(&self) -> Option<usize> {
        let constraints = match self.enforced.class() {
            MatrixClass::Definite => 0,
            MatrixClass::Saddle { constraints } => constraints,
        };
        self.inertia.map(|inertia| inertia.negative.saturating_sub(constraints))
    }

    /// The linear answer to the full load at a state: increments for a unit change of the load factor,
    /// with the tangent of that state (at rest: without any follower stiffness).
    pub fn probe(&mut self, state: &State) -> Result<Vec<f64>, Rejection> {
        self.assembler.assemble(self.model, &state.displacement, &state.locals, state.load, &mut self.system);
        self.iterations += 1;
        if !self.system.scale.is_finite() {
            return Err(Rejection::NotFinite);
        }
        self.enforced.reduce(&self.system, &mut self.values);
        let factors = self.factorizer.factorize(&self.values).map_err(Rejection::Linear)?;
        self.inertia = factors.inertia();
        let force: Vec<f64> = self.system.load_slope.iter().map(|r| -r).collect();
        let mut gap = Vec::new();
        self.rows.load_slope(state.load, &mut gap);
        let mut buffers = Buffers::default();
        solve(&*self.enforced, &*factors, &self.system, &self.values, &force, &gap, &mut buffers)
            .map_err(Rejection::Linear)?;
        let mut step = vec![0.0; self.model.unknowns()];
        let mut multipliers = vec![0.0; self.rows.len()];
        self.enforced.recover(&buffers.solution, &gap, &mut step, &mut multipliers);
        Ok(step)
    }

    /// Writes the multipliers of a converged state, for strategies whose multipliers are no unknowns.
    pub fn react(&mut self, state: &mut State) {
        if self.rows.is_empty() {
            return;
        }
        let residual = self.model.residual(&state.displacement, &state.locals, state.load);
        self.enforced.react(&residual, &mut state.multipliers);
    }
}

/// Solves the reduced system for a full right-hand side: the symmetric factors carry the symmetric part,
/// sweeps of iterative refinement the skew part and what rounding left.
fn solve(
    enforced: &dyn Enforced,
    factors: &dyn Factors,
    system: &System,
    values: &[f64],
    force: &[f64],
    gap: &[f64],
    buffers: &mut Buffers,
) -> Result<(), LinearError> {
    enforced.restrict(force, gap, system, &mut buffers.rhs);
    buffers.solution.clone_from(&buffers.rhs);
    factors.solve_in_place(&mut buffers.solution)?;
    let size = norm(&buffers.rhs);
    let sweeps = if system.skew.is_empty() { 1 } else { SKEW_SWEEPS };
    let mut before = f64::INFINITY;
    let mut residual = 0.0;
    for sweep in 0..=sweeps {
        buffers.product.clear();
        buffers.product.resize(buffers.rhs.len(), 0.0);
        enforced.pattern().multiply_add(values, &buffers.solution, &mut buffers.product);
        if !system.skew.is_empty() {
            buffers.full.resize(force.len(), 0.0);
            buffers.zero_gap.resize(gap.len(), 0.0);
            buffers.unused.resize(gap.len(), 0.0);
            enforced.recover(&buffers.solution, &buffers.zero_gap, &mut buffers.full, &mut buffers.unused);
            buffers.skew.clear();
            buffers.skew.resize(force.len(), 0.0);
            system.skew_multiply_add(&buffers.full, &mut buffers.skew);
            enforced.project(&buffers.skew, &mut buffers.projected);
            for (p, s) in buffers.product.iter_mut().zip(&buffers.projected) {
                *p += s;
            }
        }
        buffers.correction.clear();
        buffers.correction.extend(buffers.rhs.iter().zip(&buffers.product).map(|(b, p)| b - p));
        residual = norm(&buffers.correction);
        if !residual.is_finite() {
            return Err(LinearError::Residual { residual });
        }
        // One sweep removes the rounding of the factors; the skew part needs as many as it takes.
        if residual <= REFINED * size || residual >= 0.9 * before || sweep == sweeps {
            break;
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

pub(crate) fn norm(v: &[f64]) -> f64 {
    dot(v, v).sqrt()
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
