//! What an answer feels of each thing that is modelled: loads, contacts, bodies, their compressibility.

use std::fmt;

use crate::each::{Each, add};
use crate::error::Error;
use crate::material::Material;
use crate::order;
use crate::scene::Problem;
use crate::solve::State;
use crate::tensor::cofactor;
use crate::term::{Term, View, add_residual, stored};

use super::answer::Answer;
use super::nested::remembers;

/// What one thing that is modelled does to an answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// What it is.
    pub what: String,
    /// The quantity that it changes most.
    pub quantity: String,
    /// How far it changes that, relative to the value or to the size given for it; NaN where a quantity has no derivative, for
    /// contacts that are closed, and wherever laws with internal variables or friction remember what went before the last state.
    pub change: f64,
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Effect { what, quantity, change } = self;
        match change {
            change if change.is_nan() => write!(f, "{what}: its effect on {quantity} is not known"),
            0.0 => write!(f, "{what} changes nothing"),
            change => write!(f, "{what} changes {quantity} by {:.2} %", 100.0 * change),
        }
    }
}

impl<const D: usize> Answer<D> {
    /// What loads, contacts, the bulk moduli and, where there are several, the stiffnesses of bodies do to the quantities that were
    /// requested, from the least to the largest. Loads on rigid bodies are not among them.
    ///
    /// By the dual solution $z$ of a quantity $q$ each takes one sum over its points. What adds $r$ to the residual changes
    /// $q$ by $\partial q/\partial s - z\cdot r$ where it is scaled by $1 + s$, so that this, to first order, is what the answer would lose
    /// without it. Likewise $p\operatorname{cof}\mathbf F$ tells what an incompressible body would change, and the difference between a
    /// pressure on the deformed and on the reference surface whether it needs to follow. The last state alone tells that; where it
    /// depends on those before, by internal variables or friction, no effect is known.
    ///
    /// ```
    /// use rkpm::prelude::*;
    /// use rkpm::study::{Budget, Quantity, Tolerance};
    /// // A pad between plates, sheared by 1 mm, under its own weight; a stop 5 mm aside.
    /// let pad = Scene::new(Block::new([0.0, 0.0], [40.0, 10.0]), PlaneStrain, Rubber::neo_hookean(0.5, 1e4)?) // mm, MPa
    ///     .hold((1, Side::Min))
    ///     .with(Condition::on((1, Side::Max)).displacement([1.0, 0.0]))
    ///     .with(Load::body_force([0.0, -1.2e-5]))
    ///     .contact((0, Side::Max), RigidSurface::plane([45.0, 0.0], [-1.0, 0.0]).named("stop"));
    /// let shear = Tolerance::of(Quantity::reaction((1, Side::Max), 0), 0.02);
    /// let answer = pad.solve_within(&shear, Budget::default())?;
    /// let unneeded: Vec<String> = answer.unneeded(shear.error)?.iter().map(ToString::to_string).collect();
    /// assert_eq!(unneeded[0], "the contact at `stop`, which is open at the end, changes nothing");
    /// assert!(unneeded.iter().any(|what| what.starts_with("body force changes reaction 0")), "{unneeded:?}");
    /// assert!(unneeded.iter().any(|what| what.contains("bulk modulus")), "{unneeded:?}");
    /// # Ok::<(), rkpm::Error>(())
    /// ```
    ///
    /// # Errors
    /// For quantities that the problem of the answer can't evaluate.
    pub fn effects(&self) -> Result<Vec<Effect>, Error> {
        let (problem, state) = (&self.problem, self.path.last());
        let (mut found, remembers) = (Vec::new(), remembers(problem));
        let first = self.requested.first().map(|quantity| quantity.name().to_string()).unwrap_or_default();
        let values = self.requested.iter().map(|quantity| quantity.evaluate(problem, state));
        let values = values.collect::<Result<Vec<f64>, Error>>()?;
        let all = problem.model().terms();
        let of_terms = |terms: std::ops::Range<usize>| {
            let parts = terms.filter_map(|term| Some((&*all[term], problem.model.view(state, term)?)));
            let energy = parts.clone().map(|(term, view)| stored(term, view)).sum();
            Change { residual: residual(problem, parts), energy }
        };
        for contact in &problem.contacts {
            let open = !problem.contact(state, &contact.name)?.points.iter().any(|point| point.is_active);
            let what = format!("the contact at `{}`", contact.name);
            found.push(if open && !remembers {
                self.effect(&values, format!("{what}, which is open at the end,"), &Change::none(problem))
            } else {
                // Its forces do no work in dual solutions, which keep it closed.
                Effect { what, quantity: first.clone(), change: f64::NAN }
            });
        }
        for load in &problem.loads {
            found.push(self.effect(&values, load.label.clone(), &of_terms(load.terms.clone())));
            if load.follows {
                let rest = State { displacement: vec![0.0; state.displacement.len()], ..state.clone() };
                let mut change = of_terms(load.terms.clone());
                let parts = load.terms.clone().filter_map(|term| Some((&*all[term], problem.model.view(&rest, term)?)));
                let dead = residual(problem, parts);
                add(&mut change.residual, -1.0, &dead);
                found.push(self.effect(&values, format!("that {} follows the surface", load.label), &change));
            }
        }
        for (number, body) in problem.discrete_bodies().iter().enumerate() {
            let of = if problem.discrete_bodies().len() > 1 { format!(" of `{}`", body.name()) } else { String::new() };
            if let Some(change) = compressibility(problem, number, state) {
                found.push(self.effect(&values, format!("the bulk modulus{of}"), &change));
            }
            if !of.is_empty() {
                found.push(self.effect(&values, format!("the stiffness{of}"), &of_terms(number..number + 1)));
            }
        }
        if remembers {
            // What is gone or open at the end, and what stiffness has relaxed, took part in what the state became.
            found.iter_mut().for_each(|effect| (effect.quantity, effect.change) = (first.clone(), f64::NAN));
        }
        order::sort(&mut found, &|a, b| a.change.total_cmp(&b.change));
        Ok(found)
    }

    /// What could be left out of the scene, or made incompressible: the least [`effects`](Answer::effects) that together with the
    /// [`bound`](Answer::bound) are still below a tolerance. First-order estimates. What has no known effect, as a contact that is closed, is
    /// not among them.
    ///
    /// # Errors
    /// As [`effects`](Answer::effects).
    pub fn unneeded(&self, tolerance: f64) -> Result<Vec<Effect>, Error> {
        let mut left = tolerance - self.bound;
        let mut effects = self.effects()?;
        let count = effects.iter().take_while(|effect| {
            left -= effect.change;
            effect.change == 0.0 || left > 0.0
        });
        let count = count.count();
        effects.truncate(count);
        Ok(effects)
    }

    /// The largest change of the quantities requested.
    fn effect(&self, values: &[f64], what: String, change: &Change) -> Effect {
        let mut worst = Effect { what, quantity: String::new(), change: 0.0 };
        for (k, (quantity, value)) in self.requested.iter().zip(values).enumerate() {
            let explicit = if quantity.is_energy() { change.energy } else { 0.0 };
            let dual = self.duals.get(k).and_then(Option::as_ref);
            let by_state = match dual {
                _ if change.residual.iter().all(|r| *r == 0.0) => 0.0,
                Some(dual) => dual.pair_sum(&change.residual, |z, r| z * r),
                None => f64::NAN,
            };
            let size = value.abs().max(quantity.size);
            let part = if explicit == by_state { 0.0 } else { ((explicit - by_state) / size).abs() };
            if part > worst.change || part.is_nan() || worst.quantity.is_empty() {
                (worst.quantity, worst.change) = (quantity.name().to_string(), part);
            }
            if part.is_nan() {
                break;
            }
        }
        worst
    }
}

/// What something adds to the residual and to the energy.
struct Change {
    residual: Vec<f64>,
    energy: f64,
}

impl Change {
    fn none<const D: usize>(problem: &Problem<D>) -> Self {
        Change { residual: vec![0.0; problem.model().unknowns()], energy: 0.0 }
    }
}

/// The residual of some terms.
fn residual<'a, const D: usize>(
    problem: &Problem<D>,
    terms: impl Iterator<Item = (&'a dyn Term, View<'a>)>,
) -> Vec<f64> {
    let mut sum = Change::none(problem).residual;
    terms.for_each(|(term, view)| add_residual(term, view, &mut sum));
    sum
}

/// What the pressures of a body add, which are proportional to its bulk modulus: to first order an incompressible body
/// changes as much. None of laws that tell no pressures.
fn compressibility<const D: usize>(problem: &Problem<D>, number: usize, state: &State) -> Option<Change> {
    let member = &problem.discrete_bodies()[number];
    let (body, table) = (member.body(), member.body().table());
    let pressures = body.bulk_pressures(problem.model.view(state, number)?)?;
    let volumetric = body.material().volumetric()?;
    let mut change = Change::none(problem);
    // By $p^2/2\kappa$: where pressures are projected, $J$ at a point does not follow from $p$.
    let give = volumetric.evaluate(1.0).curvature.recip();
    for (point, pressure) in pressures.into_iter().enumerate() {
        let f = body.deformation_gradient(point, &state.displacement);
        let stress = cofactor(&f) * (pressure * table.weights()[point]);
        change.energy += 0.5 * table.weights()[point] * pressure * pressure * give;
        table.add_stress(point, &stress, &mut change.residual);
    }
    Some(change)
}
