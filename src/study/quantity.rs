//! Quantities of interest: numbers requested of a solved problem.

use std::fmt;
use std::sync::Arc;

use crate::error::{BoundaryError, Error, Invalid, SolveError};
use crate::geometry::{Bounds, Point};
use crate::scene::{Place, Problem};
use crate::solve::{Dual, State};
use crate::tensor::cofactor;
use crate::term::{View, add_residual};

/// Displacements below this part of the extent of a problem, and stresses below this part of the moduli, are rounding.
const REST: f64 = 1e-13;

/// How a quantity is read off a state.
type Measure<const D: usize> = Arc<dyn Fn(&Problem<D>, &State) -> Result<f64, Error> + Send + Sync>;

/// What is known of a quantity beside its value.
#[derive(Clone)]
enum Kind<const D: usize> {
    Displacement { at: Point<D>, component: usize },
    Energy,
    Reaction { place: Place<D>, component: usize },
    Moment { place: Place<D>, about: [f64; D], component: usize },
    Volume,
    Other,
}

/// A number requested of a solved problem, whatever the scheme that solved it.
#[derive(Clone)]
pub struct Quantity<const D: usize> {
    name: String,
    measure: Measure<D>,
    kind: Kind<D>,
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
    /// let highest = Quantity::<2>::new("largest pressure", |problem, state| {
    ///     // Mean stresses are positive in tension.
    ///     Ok(problem.pressures(state)?.unwrap_or_default().into_iter().fold(f64::MIN, |most, p| most.max(-p)))
    /// });
    /// assert_eq!(highest.name(), "largest pressure");
    /// ```
    pub fn new(
        name: impl Into<String>,
        measure: impl Fn(&Problem<D>, &State) -> Result<f64, Error> + Send + Sync + 'static,
    ) -> Self {
        Quantity { name: name.into(), measure: Arc::new(measure), kind: Kind::Other, size: 0.0 }
    }

    /// The energy stored, $\int W\\,\mathrm d\Omega$; of the whole revolution for bodies of revolution. 0 where nothing is
    /// displaced or stressed, rounding or not.
    pub fn energy() -> Self {
        let energy = |problem: &Problem<D>, state: &State| -> Result<f64, Error> {
            let energy = problem.energy(state)?;
            Ok(if stays(problem, state) && is_stressless(problem, state)? { 0.0 } else { energy })
        };
        Quantity { kind: Kind::Energy, ..Quantity::new("energy", energy) }
    }

    /// Displacement component `component` at a point of the body \[length\]. 0 where nothing is displaced, rounding or not.
    pub fn displacement(at: [f64; D], component: usize) -> Self {
        let measure = move |problem: &Problem<D>, state: &State| {
            let u = problem.displacement(state, &at.into())?;
            let u = if stays(problem, state) { Point::zeros() } else { u };
            component_of(&u, component, || format!("u_{component} at {at:?}"))
        };
        let kind = Kind::Displacement { at: at.into(), component };
        Quantity { kind, ..Quantity::new(format!("u_{component} at {at:?}"), measure) }
    }

    /// Component `component` of the force \[force\] on the body by the conditions at a place or by the condition of a name, see
    /// [`Problem::reaction`]. A place without a condition, and a component in which its conditions do not act, are
    /// errors of [`evaluate`](Quantity::evaluate).
    pub fn reaction(place: impl Into<Place<D>>, component: usize) -> Self {
        let place = place.into();
        let (name, kind) =
            (format!("reaction {component} of {place}"), Kind::Reaction { place: place.clone(), component });
        let measure = move |problem: &Problem<D>, state: &State| {
            let force = problem.reaction(state, place.clone())?;
            let value = component_of(&force, component, || format!("reaction of {place}"))?;
            // A zero that no row could change is a mistaken question, and any model would seem to answer it exactly.
            ensure!(
                problem.acts_in(&place, component),
                problem.unknown_condition(format!("{place} with a force in component {component}"))
            );
            Ok(value)
        };
        Quantity { kind, ..Quantity::new(name, measure) }
    }

    /// Component `component` of the moment \[force × length\] about a point, in current positions, of the forces on the body by the
    /// conditions at a place or by the condition of a name, see [`Problem::moment`]: that about the line through the point along an
    /// axis, 2 in the plane. Other components there, bodies of revolution and places without a condition are errors of
    /// [`evaluate`](Quantity::evaluate).
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// use rkpm::study::{Budget, Quantity, Tolerance};
    /// // A bar of 2 × 1 mm, its right end turned by 0.1 rad about its middle.
    /// let turned = Value::field(|x: &Point<2>| [-0.1 * (x[1] - 0.5), 0.0]);
    /// let bar = Scene::new(Block::new([0.0, 0.0], [2.0, 1.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e3)?)
    ///     .hold((0, Side::Min))
    ///     .with(Condition::on((0, Side::Max)).displacement(turned).named("turned"));
    /// let moment = Quantity::moment("turned", [2.0, 0.5], 2);
    /// let answer = bar.solve_within(&Tolerance::of(moment, 0.02), Budget::default())?;
    /// assert!(answer.reached() && answer.values()[0] > 0.0);
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    pub fn moment(place: impl Into<Place<D>>, about: [f64; D], component: usize) -> Self {
        let place = place.into();
        let name = format!("moment {component} of {place} about {about:?}");
        let kind = Kind::Moment { place: place.clone(), about, component };
        let measure = move |problem: &Problem<D>, state: &State| {
            let moment = problem.moment(state, place.clone(), about)?;
            ensure!(
                problem.turns().contains(&component),
                Invalid::new(
                    "component of a moment",
                    component as f64,
                    "2 in the plane; 0, 1 or 2 in 3D; axisymmetric and radial bodies have no moments"
                )
            );
            Ok(moment[component])
        };
        Quantity { kind, ..Quantity::new(name, measure) }
    }

    /// The current volume of the body $\int J\\,\mathrm d\Omega$ \[length³; per unit thickness in plane strain\].
    pub fn volume() -> Self {
        let volume = |problem: &Problem<D>, state: &State| -> Result<f64, Error> {
            let gradients = problem.deformation_gradients(state)?;
            Ok(gradients.iter().zip(problem.weights()).map(|(f, w)| w * f.determinant()).sum())
        };
        Quantity { kind: Kind::Volume, ..Quantity::new("volume", volume) }
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

    /// Whether it is the energy, whose second derivative is known.
    pub(super) fn is_energy(&self) -> bool {
        matches!(self.kind, Kind::Energy)
    }

    /// The dual problem of the quantity at a state, where its derivative is known: with its solution $z$ a change
    /// $\delta r$ of the residual changes the quantity by $-z\cdot\delta r$.
    ///
    /// That of a reaction is the answer to a unit displacement of its condition against it, that of a moment to a unit turn:
    /// virtual work moves along them.
    pub(super) fn dual_problem(&self, problem: &Problem<D>, state: &State) -> Result<Option<Dual>, Error> {
        let mut force = vec![0.0; problem.model.unknowns()];
        let mut gap = vec![0.0; problem.equations.len()];
        match &self.kind {
            Kind::Other => return Ok(None),
            // Refused by `evaluate`.
            Kind::Displacement { component, .. } if *component >= D => return Ok(None),
            Kind::Displacement { at, component } => {
                force = problem.deflection(at, *component)?.weights;
            }
            Kind::Energy => {
                for (number, term) in problem.model.terms().iter().enumerate() {
                    // Loads store nothing.
                    let stores = |view: &View<'_>| (0..term.clusters()).any(|k| term.energy(k, *view) != 0.0);
                    if let Some(view) = problem.model.view(state, number).filter(stores) {
                        add_residual(&**term, view, &mut force);
                    }
                }
            }
            // The thickness of a sheet follows from its gradient in the plane.
            Kind::Volume if problem.discrete_bodies().iter().any(|member| member.sheet.is_some()) => return Ok(None),
            Kind::Volume => {
                for member in problem.discrete_bodies() {
                    let (body, table) = (member.body(), member.body().table());
                    for point in 0..table.point_count() {
                        let f = body.deformation_gradient(point, &state.displacement);
                        let slope = cofactor(&f) * table.weights()[point];
                        table.add_stress(point, &slope, &mut force);
                    }
                }
            }
            Kind::Reaction { place, component } => {
                for (k, unit) in problem.unit_motion(place, *component) {
                    gap[k] = -unit;
                }
            }
            Kind::Moment { place, about, component } => {
                for (k, turn) in problem.unit_turn(state, place, *about, *component, &mut force)? {
                    gap[k] = -turn;
                }
            }
        }
        Ok(Some(Dual { force, prescribed: gap }))
    }

    /// The signed error of a value, relative to the reference or to the size given where that is larger.
    pub(super) fn error(&self, value: f64, reference: f64) -> f64 {
        if reference.abs() < self.size { (value - reference) / self.size } else { value / reference - 1.0 }
    }

    /// Refuses sizes that errors can't be relative to.
    pub(super) fn check_size(&self) -> Result<(), Invalid> {
        let needed = "give a finite number of at least 0";
        let is_size = self.size >= 0.0 && self.size.is_finite();
        if is_size { Ok(()) } else { Err(Invalid::new("size of a quantity", self.size, needed)) }
    }

    /// Refuses values that are no numbers: no error could be told from them.
    pub(super) fn check(&self, value: f64) -> Result<(), SolveError> {
        let needed = "a quantity that is finite in the state reached";
        let what = "value of a quantity";
        if value.is_finite() { Ok(()) } else { Err(Invalid::new(what, value, needed).into()) }
    }
}

/// Whether nothing is displaced.
fn stays<const D: usize>(problem: &Problem<D>, state: &State) -> bool {
    let extent = Bounds::of(&problem.positions()).extent().norm();
    state.displacement.iter().all(|d| d.abs() <= REST * extent)
}

/// Whether nothing is stressed: bodies that expand, that were stretched before or that relax are, though nothing is displaced.
fn is_stressless<const D: usize>(problem: &Problem<D>, state: &State) -> Result<bool, Error> {
    problem.model.at(state)?;
    let mut largest: f64 = 0.0;
    for (number, member) in problem.discrete_bodies().iter().enumerate() {
        let Some(view) = problem.model.view(state, number) else { continue };
        let moduli = member.body().material().initial_moduli();
        for point in 0..member.body().table().point_count() {
            let f = member.body().deformation_in(point, view);
            let stress = member.body().stress(point, &f, view).norm() / (moduli.shear + moduli.bulk.max(0.0));
            // A stress that is none is not nothing.
            largest = if stress.is_nan() { f64::INFINITY } else { largest.max(stress) };
        }
    }
    // All ranks take part, whatever their own points say.
    let largest = problem.model.ranks().map_or(largest, |ranks| -ranks.least(-largest));
    Ok(largest <= REST)
}

/// A component of a vector, or the error that says whose it was.
fn component_of<const D: usize>(v: &Point<D>, component: usize, what: impl Fn() -> String) -> Result<f64, Error> {
    let missing = || BoundaryError::Component { what: what(), component, dimension: D };
    Ok(v.as_slice().get(component).copied().ok_or_else(missing)?)
}
