//! The one load-stepping rule of the crate: its settings and its numbers.

use crate::error::{Invalid, SolveError};

/// What is controlled while the load factor goes from 0 to 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StepControl {
    /// The load, unless the tangent displacement to it has $|\nabla u| > 1$: then a generalised deflection, the
    /// mean displacement along the load; where that leads no further, as following loads turn with the body, the arc
    /// length as long as the load rises. The load also where contact is possible, where a material relaxes, where an amplitude table has
    /// break points inside $(0, 1)$, and where prescribed displacements change with the load.
    #[default]
    Auto,
    /// The load. Steps stop at the break points of amplitude tables.
    Load,
    /// The arc length over the displacements, $|d - d_n| = \ell$ (root of the mean square of the coefficients):
    /// follows the path through limit points and along falling branches. The first arc is
    /// [`first`](Stepping::first) of the tangent displacement, or shorter; where there is none, and where something may touch, it is as long as
    /// a first step of the load leads. A path that never comes to load factor 1 ends
    /// with its [`steps`](Stepping::steps) or by its observer. Break points of amplitudes are passed wherever an arc
    /// ends.
    ArcLength,
}

/// What counts: the states at their loads, or the path that leads there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Following {
    /// The states. A homogeneous state may be reached in one step although it is unstable;
    /// [`Step::unstable`](super::Step::unstable) says so. A large step may lead to another state than small steps do: who
    /// bends by more than 30 degrees or compares with another branch takes [`first`](Stepping::first) 0.1 to 0.25.
    #[default]
    Load,
    /// The path: every large step that gains or loses unstable modes is halved until it does so in a small one, and
    /// every critical point is located. Arc length always follows the path.
    Path,
}

/// How the load is stepped.
///
/// * The full load first, or, where the tangent displacement says that the load is a poor guide, a first deflection;
/// * every step from a predictor, the parabola through the last three states where the load is unknown, to the one tight
///   tolerance of [`Newton`](super::Newton): looser ones lost the path of the disk;
/// * attempts broken off early where increments grow or the step limiter keeps cutting them;
/// * half the increment after a failure, and after a large step that gained or lost unstable modes where
///   [`follow`](Stepping::follow) asks for it: Newton's method may land on a false equilibrium, and the number of
///   negative pivots shows it. In a small step the change is real, and the critical point is located and reported;
/// * growth after quick convergence;
/// * no step of the load along which prescribed displacements leave the straight line between its ends by more than
///   0.22 of what they change: one turns a part by a quarter at most. It is cut into as many equal parts as it takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stepping {
    /// First increment of the load factor, under load control.
    pub first: f64,
    /// Increments below this end the analysis as stalled; below this part of the first one under control of a deflection or an arc. Where modes
    /// change, or where a step of time leaves too large an error, increments may be smaller by a factor of 1e-4.
    pub smallest: f64,
    /// Largest increment, under load control.
    pub largest: f64,
    /// Growth after a step of at most `quick` iterations.
    pub growth: f64,
    /// Iterations up to which a step counts as quick.
    pub quick: usize,
    /// Most converged steps.
    pub steps: usize,
    /// Whether the next state is predicted from the last ones: by a parabola through three where the load is unknown, by a line through two
    /// under load control, or with contact.
    pub predict: bool,
    /// What is controlled.
    pub control: StepControl,
    /// What counts: the states at their loads, or the path that leads there.
    pub follow: Following,
    /// Largest error that a step of time may leave in the stress, relative to the stress (root of the mean squares over the body):
    /// larger steps are taken again with a smaller increment, and the next increment follows from it. Infinite takes steps as they
    /// come. Of consequence where a law relaxes ([`Viscoelastic`](crate::material::Viscoelastic)) alone.
    pub time_tolerance: f64,
}

impl Default for Stepping {
    /// Full load first, growth 1.5 after at most 6 iterations.
    fn default() -> Self {
        Stepping {
            first: 1.0,
            smallest: 1e-4,
            largest: 1.0,
            growth: 1.5,
            quick: 6,
            steps: 1000,
            predict: true,
            control: StepControl::Auto,
            follow: Following::Load,
            time_tolerance: 1e-4,
        }
    }
}

impl Stepping {
    /// Equal increments without predictor or growth, as the paper steps.
    pub fn equal(steps: usize) -> Self {
        let first = 1.0 / steps.max(1) as f64;
        Stepping {
            first,
            largest: first,
            smallest: first.min(Stepping::default().smallest),
            growth: 1.0,
            predict: false,
            steps: steps.saturating_mul(100),
            control: StepControl::Load,
            time_tolerance: f64::INFINITY,
            ..Stepping::default()
        }
    }

    pub(super) fn validate(&self) -> Result<(), SolveError> {
        ensure!(
            self.time_tolerance > 0.0,
            Invalid::new(
                "tolerance of steps of time",
                self.time_tolerance,
                "a part of the stress above 0, for instance 1e-4; infinite takes steps as they come"
            )
        );
        for (what, value, ok) in [
            ("first load increment", self.first, self.first >= f64::EPSILON && self.first <= 1.0),
            ("smallest load increment", self.smallest, self.smallest > 0.0 && self.smallest <= self.first),
            ("largest load increment", self.largest, self.largest >= self.first && self.largest.is_finite()),
            ("growth of the load increment", self.growth, self.growth >= 1.0 && self.growth <= 1e3),
        ] {
            ensure!(
                ok,
                Invalid::new(
                    what,
                    value,
                    "increments are above 0 with smallest <= first <= largest and first <= 1, the first one not below 2.2e-16, which \
                     a load factor does not feel; growth is from 1 to 1000",
                )
            );
        }
        ensure!(self.steps != 0, Invalid::new("number of steps", 0.0, "give at least 1"));
        Ok(())
    }
}

/// The tangent displacement has $|\nabla u|$ beyond this: a thin sheet under pressure, whose load says little
/// about its deflection.
pub(super) const TOO_LARGE: f64 = 1.0;
/// $|\nabla u|$ of the tangent displacement at the first step of a deflection or an arc.
pub(super) const FIRST_GRADIENT: f64 = 0.25;
/// A step that changes $\nabla u$ by more than this part of $1 + |\nabla u|$ may have left its path: where it has
/// gained or lost unstable modes it is repeated with half the increment.
pub(super) const LARGE_CHANGE: f64 = 1e-3;
