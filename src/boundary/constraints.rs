//! The constraint equations of the essential conditions.

use std::collections::HashMap;

use crate::error::BoundaryError;
use crate::geometry::unit;
use crate::term::Amplitude;

use super::equation::ConstraintEquation;
use super::prescribed_directions::{PrescribedDirection, own_component, repeats};

/// Prescribed by boundary integrals.
pub(super) const OVER_BOUNDARY: usize = 0;
/// Prescribed at particles.
pub(super) const AT_PARTICLES: usize = 1;

/// The constraint equations of a problem.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Constraints {
    pub(super) equations: Vec<ConstraintEquation>,
    /// By particle: what is prescribed of it by boundary integrals, and at itself.
    prescribed: [HashMap<usize, Vec<PrescribedDirection>>; 2],
    /// Break points of motions that the amplitudes of their constraint equations do not have.
    pub(super) break_points: Vec<f64>,
    /// Conditions whose values do not hold at an edge.
    overruled: Vec<BoundaryError>,
}

impl Constraints {
    /// The constraint equations, in the order in which they were added.
    pub fn equations(&self) -> &[ConstraintEquation] {
        &self.equations
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        self.equations.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.equations.is_empty()
    }

    /// The constraint equations, to change what they prescribe.
    pub(crate) fn equations_mut(&mut self) -> impl Iterator<Item = &mut ConstraintEquation> {
        self.equations.iter_mut()
    }

    /// Load factors inside $(0, 1)$ at which prescribed values have break points: steps of the load stop there.
    pub(crate) fn break_points(&self) -> Vec<f64> {
        self.equations
            .iter()
            .flat_map(|equation| equation.amplitude.break_points())
            .chain(self.break_points.iter().copied())
            .collect()
    }

    /// Adds load factors at which motions have break points.
    pub(crate) fn add_break_points(&mut self, loads: Vec<f64>) {
        self.break_points.extend(loads);
    }

    /// Conditions whose values do not hold at edges, where those of others do.
    pub(crate) fn overruled(&self) -> &[BoundaryError] {
        &self.overruled
    }

    /// Adds conditions whose values do not hold at edges.
    pub(crate) fn overrule(&mut self, overruled: Vec<BoundaryError>) {
        self.overruled.extend(overruled);
    }

    /// The numbers of constraint equations and break points so far, for [`take_back`](Constraints::take_back) of what is added later.
    pub(crate) fn mark(&self) -> [usize; 2] {
        [self.equations.len(), self.break_points.len()]
    }

    /// Takes back what was added since a mark: copies of all constraint equations would cost as many as there are for each condition.
    pub(crate) fn take_back(&mut self, [equations, break_points]: [usize; 2]) {
        for prescriptions in &mut self.prescribed {
            prescriptions.retain(|_, of_particle| {
                of_particle.retain(|prescription| prescription.equation < equations);
                !of_particle.is_empty()
            });
        }
        self.equations.truncate(equations);
        self.break_points.truncate(break_points);
    }

    /// What is prescribed of a particle by boundary integrals or at itself.
    pub(super) fn prescriptions(&self, by: usize, particle: usize) -> &[PrescribedDirection] {
        self.prescribed[by].get(&particle).map_or(&[], Vec::as_slice)
    }

    /// Adds the constraint equation of a particle along a direction.
    pub(super) fn own(
        &mut self,
        dim: usize,
        (by, particle): (usize, usize),
        mut requested: PrescribedDirection,
        entries: Vec<(usize, f64)>,
        (target, amplitude): (f64, Amplitude),
    ) -> Result<(), BoundaryError> {
        let taken = |equation: usize| self.equations[equation].dependent % dim;
        let own = own_component(self.prescriptions(by, particle), &requested.direction[..dim], taken);
        requested.equation = self.equations.len();
        let (dependent, label) = (particle * dim + own, requested.label.clone());
        self.push(ConstraintEquation { entries, dependent, target, amplitude, label })?;
        self.prescribed[by].entry(particle).or_default().push(requested);
        Ok(())
    }

    /// Whether a condition prescribes a component of a particle.
    pub(crate) fn prescribes(&self, particle: usize, component: usize) -> bool {
        let axis = unit::<3>(component).into();
        [OVER_BOUNDARY, AT_PARTICLES].into_iter().any(|by| repeats(self.prescriptions(by, particle), &axis))
    }

    /// Appends the constraint equations of a body whose particles stand `nodes` behind the first, each with `dimension` components.
    pub(crate) fn append(&mut self, other: Constraints, nodes: usize, dimension: usize) {
        let before = self.equations.len();
        let shift = nodes * dimension;
        self.equations.extend(other.equations.into_iter().map(|mut equation| {
            equation.dependent += shift;
            equation.entries.iter_mut().for_each(|entry| entry.0 += shift);
            equation
        }));
        for (mine, others) in self.prescribed.iter_mut().zip(other.prescribed) {
            mine.extend(others.into_iter().map(|(particle, mut prescriptions)| {
                prescriptions.iter_mut().for_each(|prescription| prescription.equation += before);
                (particle + nodes, prescriptions)
            }));
        }
        self.break_points.extend(other.break_points);
        self.overruled.extend(other.overruled);
    }

    /// Adds entries to a constraint equation.
    pub(crate) fn extend_equation(&mut self, equation: usize, entries: Vec<(usize, f64)>) {
        if let Some(equation) = self.equations.get_mut(equation) {
            equation.entries.extend(entries);
        }
    }

    /// Adds a constraint equation unchanged.
    ///
    /// # Errors
    /// Where a number is not finite, the constraint equation has no entry or its amplitude is no table.
    pub fn push(&mut self, equation: ConstraintEquation) -> Result<(), BoundaryError> {
        if let Some(&(_, value)) = equation.entries.iter().find(|(_, c)| !c.is_finite()) {
            return Err(BoundaryError::Value { what: equation.label, value, load: 1.0 });
        }
        ensure!(
            equation.target.is_finite(),
            BoundaryError::Value { what: equation.label, value: equation.target, load: 1.0 }
        );
        equation.amplitude.validate(|| equation.label.clone())?;
        for load in [0.0, 1.0] {
            let value = equation.target * equation.amplitude.value(load);
            ensure!(value.is_finite(), BoundaryError::Value { what: equation.label, value, load });
        }
        if equation.entries.iter().all(|(_, c)| *c == 0.0) {
            return Err(BoundaryError::Dependent { equation: self.equations.len(), what: equation.label, pivot: 0.0 });
        }
        self.equations.push(equation);
        Ok(())
    }

    /// Writes $g\\,a(\lambda) - Gd$, one entry per constraint equation; NaN where the displacement is too short.
    pub fn violation(&self, displacement: &[f64], load: f64, violation: &mut Vec<f64>) {
        violation.clear();
        violation.extend(
            self.equations
                .iter()
                .map(|equation| equation.target * equation.amplitude.value(load) - equation.value(displacement)),
        );
    }

    /// Writes $g\\,a'(\lambda)$, one entry per constraint equation.
    pub(crate) fn load_slope(&self, load: f64, slope: &mut Vec<f64>) {
        slope.clear();
        slope.extend(self.equations.iter().map(|equation| equation.target * equation.amplitude.evaluate(load).1));
    }
}
