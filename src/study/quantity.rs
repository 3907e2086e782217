//! Quantities of interest: numbers asked of a solved problem.

use std::fmt;
use std::sync::Arc;

use crate::boundary::Row;
use crate::error::{BoundaryError, Error};
use crate::geometry::Point;
use crate::scene::Problem;
use crate::solve::State;

/// How a quantity is read off a state.
type Measure<const D: usize> = Arc<dyn Fn(&Problem<D>, &State) -> Result<f64, Error> + Send + Sync>;

/// A number asked of a solved problem, whatever the scheme that solved it.
#[derive(Clone)]
pub struct Quantity<const D: usize> {
    name: String,
    measure: Measure<D>,
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
        Quantity { name: name.into(), measure: Arc::new(measure) }
    }

    /// The energy stored, $\int W\\,\mathrm d\Omega$; of the whole revolution for bodies of revolution.
    pub fn energy() -> Self {
        Quantity::new("energy", |problem, state| Ok(problem.energy(state)))
    }

    /// Displacement component `component` at a point of the body \[length\].
    pub fn displacement(at: [f64; D], component: usize) -> Self {
        Quantity::new(format!("u_{component} at {at:?}"), move |problem, state| {
            let u = problem.displacement(state, &at.into())?;
            component_of(&u, component, || format!("u_{component} at {at:?}"))
        })
    }

    /// Component `component` of the force \[force\] on the body by the condition of a label ("u_0 on face (0, Max)"),
    /// see [`Problem::reaction`]. A label without a condition, and a component in which its condition does not act, are
    /// errors of [`evaluate`](Quantity::evaluate).
    pub fn reaction(label: impl Into<String>, component: usize) -> Self {
        let label = label.into();
        Quantity::new(format!("reaction {component} of {label}"), move |problem, state| {
            let force = problem.reaction(state, &label)?;
            let value = component_of(&force, component, || format!("reaction of {label}"))?;
            // A zero that no row could change is a mistaken question, and any model would seem to answer it exactly.
            let acts = |row: &Row| row.label == label && row.entries.iter().any(|&(k, _)| k % D == component);
            if !problem.rows.rows().iter().any(acts) {
                return Err(problem.unknown_condition(format!("{label} with a force in component {component}")).into());
            }
            Ok(value)
        })
    }

    /// The current volume of the body $\int J\\,\mathrm d\Omega$ \[length³; per unit thickness in plane strain\].
    pub fn volume() -> Self {
        Quantity::new("volume", |problem, state| {
            let weights = problem.body.table().weights();
            let gradients = problem.deformation_gradients(state);
            Ok(gradients.iter().zip(weights).map(|(f, w)| w * f.determinant()).sum())
        })
    }

    /// The same quantity under another name.
    pub fn named(self, name: impl Into<String>) -> Self {
        Quantity { name: name.into(), ..self }
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

/// A component of a vector, or the error that says whose it was.
fn component_of<const D: usize>(v: &Point<D>, component: usize, what: impl Fn() -> String) -> Result<f64, Error> {
    let missing = || BoundaryError::Component { what: what(), component, dimension: D };
    Ok(v.as_slice().get(component).copied().ok_or_else(missing)?)
}
