//! Whether the states of a run are answers.

mod biot;
mod depth;
mod energy;
mod passing;
mod restraint;
mod surface_points;
mod volume;

use std::ops::ControlFlow;

use crate::error::{Cause, Doubt, DoubtCause, Error, GeometryError};
use crate::solve::{Ending, EquilibriumPath, Iteration, Observer, State, Step};

use crate::scene::{Problem, free_motions};

pub use depth::FixedInside;
pub(crate) use depth::fixed_inside;

/// An observer together with a problem that judges each converged state of its run.
pub(crate) struct Judging<'a, const D: usize> {
    pub problem: &'a Problem<D>,
    pub observer: &'a mut dyn Observer,
}

impl<const D: usize> Observer for Judging<'_, D> {
    fn iteration(&mut self, iteration: &Iteration) -> ControlFlow<()> {
        self.observer.iteration(iteration)
    }

    fn step(&mut self, step: &Step) -> ControlFlow<()> {
        self.observer.step(step)
    }

    fn doubts(&mut self, state: &State) -> Vec<Doubt> {
        // The state is that of a run of this problem.
        let mut doubts = self.problem.doubts(state).unwrap_or_default();
        doubts.append(&mut self.observer.doubts(state));
        doubts
    }
}

impl<const D: usize> Problem<D> {
    /// All that makes a path of this problem doubtful: what its steps have recorded ([`EquilibriumPath::doubts`]), and what only the
    /// problem can tell of the last state:
    /// * bodies that have passed through one another, through themselves or through a rigid surface, where no contact is declared,
    /// * walls that were left with few particle spacings across,
    /// * conditions that prescribe different values at a common edge,
    /// * free surfaces beyond Biot's limit, at which they crease.
    ///
    /// Costs shape functions and a sum over the surface for each of its points, of which 2000 are looked at.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let block = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .hold(Side::Min)
    ///     .prescribe(Side::Max, 0, 0.2);
    /// let problem = block.discretize(&Scheme::default().particles([17, 9]))?;
    /// let path = problem.run()?.completed()?;
    /// for doubt in problem.verdict(&path)? {
    ///     println!("{doubt}");
    /// }
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// For a path of another problem, and where the surface of a body can't be integrated.
    pub fn verdict(&self, path: &EquilibriumPath) -> Result<Vec<Doubt>, Error> {
        let (state, mut doubts) = (path.last(), self.doubts_at_end(path)?);
        doubts.extend(self.equations.overruled().iter().map(|overruled| Doubt {
            cause: DoubtCause::Overruled { conditions: overruled.to_string() },
            load: state.load,
            at: Vec::new(),
        }));
        let thin = self.discrete_bodies.iter().filter_map(|body| body.cells().left_thin());
        doubts.extend(thin.map(|wall| Doubt {
            cause: DoubtCause::ThinWall { wall: wall.to_string() },
            load: state.load,
            at: match wall {
                GeometryError::ThinLeft { at, .. } => at.clone(),
                _ => Vec::new(),
            },
        }));
        Ok(doubts)
    }

    /// The doubts of [`verdict`](Problem::verdict) that are about states, not about the scene.
    pub(crate) fn doubts_at_end(&self, path: &EquilibriumPath) -> Result<Vec<Doubt>, Error> {
        let (view, state) = (self.view(), path.last());
        state.check_lengths(&self.model, &self.equations)?;
        let mut doubts: Vec<Doubt> = path.doubts().into_iter().cloned().collect();
        let points = surface_points::surface_points(&view, state)?;
        doubts.extend(passing::passed(self, state, &points));
        doubts.extend(biot::beyond_limit(&view, state, &points, &biot::touching(self, state)));
        Ok(doubts)
    }

    /// What makes a state of this problem doubtful, as each step of a run records it ([`Step::doubts`]): the field folds, the body lies
    /// deep in a rigid surface, or its particles do not resolve the contact with it, a restrained motion takes a moment. Unstable modes are
    /// known to the run alone.
    ///
    /// # Errors
    /// For a state of another problem.
    pub fn doubts(&self, state: &State) -> Result<Vec<Doubt>, Error> {
        state.check_lengths(&self.model, &self.equations)?;
        let mut doubts: Vec<Doubt> = volume::folded(&self.view(), state).into_iter().collect();
        doubts.extend(depth::unresolved(self, state));
        doubts.extend(restraint::strained(self, state));
        Ok(doubts)
    }

    /// The path of a run that stalled for want of a state, with the free motion as its cause where there is one, or the rigid surface that
    /// runs into prescribed particles.
    pub(crate) fn named(&self, mut path: EquilibriumPath) -> EquilibriumPath {
        let Ending::Stalled(stalled) = &mut path.ending else { return path };
        let numeric = matches!(
            stalled.cause,
            Cause::Iterations(_)
                | Cause::StepLimited { .. }
                | Cause::Diverging { .. }
                | Cause::Singular { .. }
                | Cause::LinearSolver(_)
        );
        if numeric {
            // Friction resists nothing before there is pressure.
            for friction in if stalled.load == 0.0 { &[true, false][..] } else { &[true] } {
                let motions: Vec<String> = free_motions(self, *friction).iter().map(ToString::to_string).collect();
                if !motions.is_empty() {
                    stalled.cause = Cause::FreeMotion { motions, friction: !friction };
                    return path;
                }
            }
            if let Some(inside) = fixed_inside(self).first() {
                stalled.cause = Cause::Refused(format!("no equilibrium was found: {inside}"));
            }
        }
        path
    }
}
