//! Runs of a problem, whose states it judges.

use crate::error::Error;
use crate::solve::{Equilibrium, EquilibriumPath, Observer, State};

use super::verdict::Judging;
use crate::scene::Problem;

impl<const D: usize> Problem<D> {
    /// Runs the analysis from rest to load factor 1. Each step records what makes its state doubtful
    /// ([`Step::doubts`](crate::solve::Step::doubts)); a run that stalls because a rigid motion is free names the motion.
    ///
    /// # Errors
    /// As [`Analysis::run`](crate::solve::Analysis::run); a stalled analysis returns its path.
    pub fn run(&self) -> Result<EquilibriumPath, Error> {
        self.run_with(&mut ())
    }

    /// As [`run`](Problem::run), watched by an observer, which may end the analysis.
    ///
    /// # Errors
    /// As [`run`](Problem::run).
    pub fn run_with(&self, observer: &mut dyn Observer) -> Result<EquilibriumPath, Error> {
        self.analysis
            .run(&self.model, &self.equations, &mut Judging { problem: self, observer })
            .map(|path| self.named(path))
    }

    /// The state at rest, from which [`run`](Problem::run) starts.
    pub fn at_rest(&self) -> State {
        State::at_rest(&self.model, &self.equations)
    }

    /// The equations of equilibrium, for a method of one's own in place of [`run`](Problem::run).
    ///
    /// # Errors
    /// As [`Analysis::equilibrium`](crate::solve::Analysis::equilibrium).
    pub fn equilibrium(&self) -> Result<Equilibrium<'_>, Error> {
        self.analysis.equilibrium(&self.model, &self.equations)
    }

    /// Goes on from the last step of a path, with the same bits as if it had never been broken off.
    ///
    /// # Errors
    /// As [`Analysis::resume`](crate::solve::Analysis::resume).
    pub fn resume(&self, path: EquilibriumPath, observer: &mut dyn Observer) -> Result<EquilibriumPath, Error> {
        let judging = &mut Judging { problem: self, observer };
        self.analysis.resume(&self.model, &self.equations, path, judging).map(|path| self.named(path))
    }
}
