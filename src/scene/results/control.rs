//! Runs that are led by a displacement.

use crate::each::Each;
use crate::error::{BoundaryError, Error, Invalid};
use crate::geometry::Point;
use crate::solve::{Deflection, EquilibriumPath, Functional, Observer, State};
use crate::term::TermState;

use crate::scene::Problem;
use crate::scene::results::verdict::Judging;

impl<const D: usize> Problem<D> {
    /// A displacement component at a point of the body as a functional \[length\]: what a displacement-controlled run prescribes,
    /// $q = \sum_I \Psi_I(X)\\,d_{Ii}$.
    ///
    /// # Errors
    /// Where the point lies outside the body, or the component does not exist.
    pub fn deflection(&self, at: &Point<D>, component: usize) -> Result<Deflection, Error> {
        ensure!(
            component < D,
            BoundaryError::Component { what: format!("deflection at {:?}", at.as_slice()), component, dimension: D }
        );
        self.member_at(at)?;
        let psi = self.shape_functions(at)?;
        let mut weights = vec![0.0; self.model.unknowns()];
        for (&node, &value) in psi.nodes.iter().zip(&psi.values) {
            weights[node as usize * D + component] = value;
        }
        Ok(Deflection { weights })
    }

    /// Runs the problem so that a functional takes each target in turn, the load factor being what it takes, from the
    /// state at rest: through limit points and past load factor 1.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// # let disk = Scene::new(Block::new([0.0, 0.0], [18.923, 0.635]), Axisymmetric, Rubber::mooney_rivlin(0.5516, 0.1379, 689.5)?)
    /// #     .prescribe((0, Side::Min), 0, 0.0).hold((0, Side::Max)).pressure((1, Side::Min), 0.1);
    /// let problem = disk.discretize(&Scheme::default().particles([11, 2]))?;
    /// let centre = problem.deflection(&[0.0, 0.0].into(), 1)?;
    /// let path = problem.run_controlled(&centre, &[1.0, 3.0, 5.0], &mut ())?.completed()?; // cm
    /// assert!((problem.displacement(path.last(), &[0.0, 0.0].into())?[1] - 5.0).abs() < 1e-9);
    /// println!("{} MPa", 0.1 * path.last().load);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`Analysis::run_controlled`](crate::solve::Analysis::run_controlled).
    pub fn run_controlled(
        &self,
        functional: &dyn Functional,
        targets: &[f64],
        observer: &mut dyn Observer,
    ) -> Result<EquilibriumPath, Error> {
        let judging = &mut Judging { problem: self, observer };
        let start = self.at_rest();
        Ok(self.named(self.analysis.run_controlled(
            &self.model,
            &self.equations,
            start,
            functional,
            targets,
            judging,
        )?))
    }

    /// The states of a path at given load factors, those where it first comes to each: interpolated between its steps and
    /// iterated to equilibrium. The run itself takes the steps that it would have taken.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// let block = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .hold(Side::Min)
    ///     .prescribe(Side::Max, 0, 1.0);
    /// let problem = block.discretize(&Scheme::default().particles([9, 5]))?;
    /// let path = problem.run()?.completed()?;
    /// for state in problem.states_at(&path, &[0.25, 0.5, 0.75])? {
    ///     println!("{}: {:.4} N/mm", state.load, problem.reaction(&state, Side::Max)?[0]);
    /// }
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// For load factors that the path does not come to, and where Newton's method finds no state between two steps, which says
    /// so as [`EquilibriumPath::reached`] does.
    pub fn states_at(&self, path: &EquilibriumPath, loads: &[f64]) -> Result<Vec<State>, Error> {
        let all: Vec<&State> = path.states().collect();
        let mut found = Vec::with_capacity(loads.len());
        for &load in loads {
            let between = |pair: &[&State]| (pair[0].load - load) * (pair[1].load - load) <= 0.0;
            let Some(step) = all.windows(2).position(between) else {
                let (what, needed) = ("load factor of a state", "give load factors that the path comes to");
                return Err(Invalid::new(what, load, needed).into());
            };
            found.push(self.state_between(all[step], all[step + 1], load)?);
        }
        Ok(found)
    }

    /// The state at a load factor between two states of a path.
    fn state_between(&self, before: &State, behind: &State, load: f64) -> Result<State, Error> {
        let (mut low, mut aim) = (before.clone(), load);
        // Where the straight line between two steps is too far from the path, nearer states come first.
        let mut failed = 0;
        loop {
            let guess = self.interpolated(&low, behind, aim);
            let path = self.analysis.correct(&self.model, &self.equations, guess, &mut ())?;
            if path.steps.is_empty() && failed < HALVINGS {
                failed += 1;
                aim = 0.5 * (low.load + aim);
                continue;
            }
            low = path.reached()?.last().clone();
            if aim == load {
                return Ok(low);
            }
            aim = load;
        }
    }

    /// The state on the straight line between two at a load factor, with the internal variables of the one before: the step to it
    /// begins there.
    fn interpolated(&self, before: &State, behind: &State, load: f64) -> State {
        let length = behind.load - before.load;
        let part = if length == 0.0 { 1.0 } else { (load - before.load) / length };
        let mix = |a: &[f64], b: &[f64]| -> Vec<f64> { a.paired(b, |a, b| a + part * (b - a)) };
        let between = |a: &TermState, b: &TermState| TermState {
            condensed: mix(&a.condensed, &b.condensed),
            history: a.history.clone(),
        };
        State {
            displacement: mix(&before.displacement, &behind.displacement),
            terms: before.terms.paired(&behind.terms, between),
            multipliers: mix(&before.multipliers, &behind.multipliers),
            load,
            time: before.time,
            origin: self.model.origin(),
        }
    }
}

/// Nearer states that are looked for before a state between two steps is given up.
const HALVINGS: usize = 12;
