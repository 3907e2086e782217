//! Quantities of interest: numbers asked of a solved problem.

use std::fmt;
use std::sync::Arc;

use crate::error::{BoundaryError, Error, SolveError};
use crate::geometry::Point;
use crate::scene::{Place, Problem};
use crate::solve::State;

/// Gradients of displacements below this are rounding of those that bodies have.
const REST: f64 = 1e-13;

/// How a quantity is read off a state.
type Measure<const D: usize> = Arc<dyn Fn(&Problem<D>, &State) -> Result<f64, Error> + Send + Sync>;

/// A number asked of a solved problem, whatever the scheme that solved it.
#[derive(Clone)]
pub struct Quantity<const D: usize> {
    name: String,
    measure: Measure<D>,
    /// Errors are relative to this where the value is smaller.
    pub(super) size: f64,
}

impl<const D: usize> fmt::Debug for Quantity<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Quantity").field(&self.name).finish()
    }
}

impl<const D: usize> Quantity<D> {
    /// Any number of one's own.
    ///
    /// ```
    /// use rkpm::study::Quantity;
    /// let hottest = Quantity::<2>::new("largest pressure", |problem, state| {
    ///     Ok(problem.pressures(state).unwrap_or_default().into_iter().fold(f64::MIN, f64::max))
    /// });
    /// assert_eq!(hottest.name(), "largest pressure");
    /// ```
    pub fn new(
        name: impl Into<String>,
        measure: impl Fn(&Problem<D>, &State) -> Result<f64, Error> + Send + Sync + 'static,
    ) -> Self {
        Quantity { name: name.into(), measure: Arc::new(measure), size: 0.0 }
    }

    /// The energy stored, $\int W\\,\mathrm d\Omega$; of the whole revolution for bodies of revolution. 0 for a body
    /// at rest, rounding or not.
    pub fn energy() -> Self {
        Quantity::new("energy", |problem, state| Ok(if rests(problem, state) { 0.0 } else { problem.energy(state) }))
    }

    /// Displacement component `component` at a point of the body \[length\]. 0 for a body at rest, rounding or not.
    pub fn displacement(at: [f64; D], component: usize) -> Self {
        Quantity::new(format!("u_{component} at {at:?}"), move |problem, state| {
            let u = problem.displacement(state, &at.into())?;
            let u = if rests(problem, state) { Point::zeros() } else { u };
            component_of(&u, component, || format!("u_{component} at {at:?}"))
        })
    }

    /// Component `component` of the force \[force\] on the body by the conditions at a place or by the condition of a name, see
    /// [`Problem::reaction`]. A place without a condition, and a component in which its conditions do not act, are
    /// errors of [`evaluate`](Quantity::evaluate).
    pub fn reaction(place: impl Into<Place<D>>, component: usize) -> Self {
        let place = place.into();
        Quantity::new(format!("reaction {component} of {place}"), move |problem, state| {
            let force = problem.reaction(state, place.clone())?;
            let value = component_of(&force, component, || format!("reaction of {place}"))?;
            // A zero that no row could change is a mistaken question, and any model would seem to answer it exactly.
            if !problem.acts_in(&place, component) {
                return Err(problem.unknown_condition(format!("{place} with a force in component {component}")).into());
            }
            Ok(value)
        })
    }

    /// The current volume of the body $\int J\\,\mathrm d\Omega$ \[length³; per unit thickness in plane strain\].
    pub fn volume() -> Self {
        Quantity::new("volume", |problem, state| {
            let gradients = problem.deformation_gradients(state);
            Ok(gradients.iter().zip(problem.weights()).map(|(f, w)| w * f.determinant()).sum())
        })
    }

    /// The same quantity under another name.
    pub fn named(self, name: impl Into<String>) -> Self {
        Quantity { name: name.into(), ..self }
    }

    /// The same quantity, its errors relative to `size` \[unit of the quantity\] wherever it is smaller: a force that symmetry makes vanish, say,
    /// has no relative error of its own that any model could bring below a tolerance.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// use rkpm::study::{Budget, Quantity, Tolerance};
    /// // A block bonded to plates that are pulled apart: nothing pushes it aside.
    /// let block = Scene::new(Block::new([0.0, 0.0], [1.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .hold((1, Side::Min))
    ///     .prescribe((1, Side::Max), 0, 0.0)
    ///     .prescribe((1, Side::Max), 1, 0.1);
    /// let aside = Quantity::reaction((1, Side::Max), 0).relative_to(0.1); // N/mm
    /// let answer = block.solve_within(&Tolerance::of(aside, 0.01), Budget::default())?;
    /// assert!(answer.reached() && answer.values()[0].abs() < 0.01 * 0.1);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn relative_to(self, size: f64) -> Self {
        Quantity { size, ..self }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Its value in a state.
    ///
    /// # Errors
    /// Where the problem can't answer: a point outside the body, a component or a condition that does not exist.
    pub fn evaluate(&self, problem: &Problem<D>, state: &State) -> Result<f64, Error> {
        (self.measure)(problem, state)
    }
}

impl<const D: usize> Quantity<D> {
    /// Refuses values that are no numbers: no error could be told from them.
    pub(super) fn check(&self, value: f64) -> Result<(), SolveError> {
        let needed = "a quantity that is finite in the state reached";
        let what = "value of a quantity";
        if value.is_finite() { Ok(()) } else { Err(SolveError::Setting { what, value, needed }) }
    }
}

/// Whether nothing is strained.
fn rests<const D: usize>(problem: &Problem<D>, state: &State) -> bool {
    problem.model().largest_gradient(&state.displacement) <= REST
}

/// A component of a vector, or the error that says whose it was.
fn component_of<const D: usize>(v: &Point<D>, component: usize, what: impl Fn() -> String) -> Result<f64, Error> {
    let missing = || BoundaryError::Component { what: what(), component, dimension: D };
    Ok(v.as_slice().get(component).copied().ok_or_else(missing)?)
}
