//! Analyses: a model, its conditions, and the strategies that solve them.

use crate::assembly::Model;
use crate::boundary::{Constraints, Enforcement, MixedTransformation, Reduction, check_unknowns};
use crate::error::{Cause, Error, Incompatible, Invalid, LinearError, SolveError};
use crate::linear::{Direct, LinearSolver, after_their_rows, banded, minimum_degree, nested_dissection};

use super::equilibrium::Equilibrium;
use super::path::EquilibriumPath;
use super::settings::Newton;
use super::state::State;
use super::stepping::{StepControl, Stepping};

/// What is missing where every displacement is prescribed.
pub(crate) const NO_FREE: &str = "free unknowns";
/// Unknowns up to which a body in the plane is eliminated along a band.
const BANDED: usize = 3000;

/// An analysis: strategies that turn a model and its conditions into a path of equilibria.
pub struct Analysis {
    /// Newton's method.
    pub newton: Newton,
    /// Load stepping.
    pub stepping: Stepping,
    /// How conditions are enforced.
    pub enforcement: Box<dyn Enforcement>,
    /// The linear solver; each run takes a [`fresh`](LinearSolver::fresh) one.
    pub solver: Box<dyn LinearSolver>,
    /// Enforcement and solver of attempts that the solver leaves unsolved, an iterative one say; none where runs end there.
    pub factors: Option<Box<Analysis>>,
}

impl Default for Analysis {
    /// Mixed transformation and sparse direct factorisation.
    fn default() -> Self {
        Analysis::new(MixedTransformation::default(), Direct::default())
    }
}

impl Analysis {
    /// An analysis with the default stepping.
    pub fn new(enforcement: impl Enforcement + 'static, solver: impl LinearSolver + 'static) -> Self {
        Analysis {
            newton: Newton::default(),
            stepping: Stepping::default(),
            enforcement: Box::new(enforcement),
            solver: Box::new(solver),
            factors: None,
        }
    }

    /// Refuses settings and terms that nothing can be solved with.
    pub(crate) fn check_settings(&self, model: &Model) -> Result<(), Error> {
        self.stepping.validate()?;
        let Newton { tolerance, iterations, .. } = self.newton;
        for (what, value, ok, needed) in [
            (
                "Newton tolerance",
                tolerance,
                (f64::EPSILON..1.0).contains(&tolerance),
                "give a tolerance between 0 and 1, and not below 2.2e-16: increments of that size are rounding",
            ),
            ("Newton iterations", iterations as f64, iterations > 0, "give at least one iteration"),
        ] {
            ensure!(ok, Invalid::new(what, value, needed));
        }
        check_terms(model)?;
        ensure!(
            self.stepping.control != StepControl::ArcLength || !model.is_timed(),
            Incompatible::new(
                "StepControl::ArcLength",
                "a material that relaxes",
                "load steps are time steps: take StepControl::Auto, or the elastic material alone"
            )
        );
        Ok(())
    }

    pub(super) fn validate(&self, model: &Model, equations: &Constraints, path: &EquilibriumPath) -> Result<(), Error> {
        self.check_settings(model)?;
        check_model(model, equations)?;
        check_state(model, equations, &path.start)?;
        for step in path.steps.iter().rev().take(3) {
            check_state(model, equations, &step.state)?;
            let increment = step.control_state.increment;
            ensure!(
                increment > 0.0 && increment.is_finite(),
                Invalid::new("increment at the last step of the path", increment, "resume a path as a run left it",)
            );
        }
        // The last state is one of those checked above: its numbers are finite.
        if let Some(why) = model.at_own(path.last()).fault() {
            return Err(Cause::Term(why).into());
        }
        Ok(())
    }

    /// The equations of equilibrium of a model under its conditions, with enforcement and linear solver bound to them.
    ///
    /// # Errors
    /// For a model without terms or unknowns, constraint equations that depend on each other, and patterns that the solver refuses.
    pub fn equilibrium<'a>(&self, model: &'a Model, equations: &'a Constraints) -> Result<Equilibrium<'a>, Error> {
        check_model(model, equations)?;
        let apart = self.solver.keeps_pressures();
        let mut assembler = if apart { model.assembler_free() } else { model.assembler() };
        let enforced = self.enforcement.bind(assembler.pattern(), equations)?;
        let mut reduction = Reduction::new(enforced, assembler.pattern(), equations)?;
        ensure!(
            reduction.unknowns() != 0,
            SolveError::Empty {
                what: NO_FREE,
                remedy: "every displacement is prescribed: take more particles between the parts that are held, or evaluate the field instead",
            }
        );
        assembler.forget_rows();
        let solver = self.bound_solver(model, &mut reduction)?;
        Ok(Equilibrium::bound(model, equations, assembler, (reduction, solver), self.stepping.smallest))
    }

    /// A solver of its own for bound conditions: orders the unknowns, renumbers them for direct solvers, and has the solver
    /// look at their pattern.
    ///
    /// The orders are those that were measured to be fastest: a band for small bodies in the plane, minimum degree for
    /// larger ones, nested dissection in space. Multipliers, which have no place in the full vector, follow the last
    /// unknowns of their rows. For a new [`Reduction`], whose multipliers stand last.
    ///
    /// # Errors
    /// As [`LinearSolver::analyze`].
    pub fn bound_solver(&self, model: &Model, reduction: &mut Reduction) -> Result<Box<dyn LinearSolver>, LinearError> {
        let mut solver = self.solver.fresh();
        if solver.keeps_pressures() {
            solver.analyze(&reduction.pattern, reduction.class(), None)?;
            return Ok(solver);
        }
        let pattern = &reduction.pattern;
        let unknowns = reduction.unknowns();
        let inner = (0..unknowns).take_while(|&k| reduction.full_index(k).is_some()).count();
        let dim = model.dim();
        let node = |k: usize| reduction.full_index(k).map(|full| full / dim);
        let coordinate = |k: usize, axis: usize| model.coordinates(node(k).unwrap_or(0))[axis];
        let mut order = match dim {
            // The patterns of ranks differ, their orders must not: along a curve, so that each rank holds a region.
            _ if model.ranks().is_some() => {
                let curve = model.curve();
                let mut order: Vec<usize> = (0..inner).collect();
                order.sort_by_cached_key(|&k| (node(k).map(|node| curve.place(model.coordinates(node))), k));
                order
            }
            3 => nested_dissection(pattern, inner, dim, &coordinate),
            _ if inner <= BANDED => banded(pattern, inner, dim, &coordinate),
            _ => minimum_degree(pattern, inner)?,
        };
        order.truncate(inner);
        let order = after_their_rows(pattern, &order);
        reduction.renumber(&order);
        let order: Vec<usize> = (0..unknowns).collect();
        solver.analyze(&reduction.pattern, reduction.class(), Some(&order))?;
        Ok(solver)
    }
}

/// Refuses states of the wrong size, inverted ones, and numbers that are not finite.
fn check_state(model: &Model, equations: &Constraints, state: &State) -> Result<(), Error> {
    state.check_lengths(model, equations)?;
    if let Some(&value) = state.numbers().find(|v| !v.is_finite()) {
        return Err(Invalid::new(
            "a number of the first state, or of the last ones of a path",
            value,
            "give finite numbers; zero displacement is a state at rest",
        )
        .into());
    }
    if let Some((jacobian, at)) = model.at(state)?.smallest_jacobian()
        && !(jacobian > 0.0)
    {
        return Err(SolveError::InvertedStart { jacobian, at }.into());
    }
    Ok(())
}

/// Refuses models that nothing can be solved with, and constraint equations over unknowns that they lack.
fn check_model(model: &Model, equations: &Constraints) -> Result<(), Error> {
    check_terms(model)?;
    Ok(check_unknowns(equations.equations(), model.unknowns())?)
}

/// Refuses terms of another dimension, terms whose nodes do not rise or whose clusters share unknowns, and ones over nodes that the model lacks: their tables belong to another set.
fn check_terms(model: &Model) -> Result<(), SolveError> {
    if model.terms().is_empty() {
        return Err(SolveError::Empty { what: "terms", remedy: "add at least a body" });
    }
    if let Some(error) = &model.misfit {
        return Err(error.clone());
    }
    model.terms().iter().try_for_each(|term| term.validate())
}
