//! The directions in which conditions have prescribed the displacements of particles, and whether another condition repeats them.

use std::sync::Arc;

use crate::each::{Each, EachOf, add};
use crate::error::BoundaryError;
use crate::linear::vector::dot;
use crate::term::Amplitude;

/// A direction that differs by less than this from a combination of those prescribed before it counts as one of them: a constraint
/// equation for it would repeat them but for a twentieth, and reactions would be twenty times as large as the forces they balance.
const REPEATED: f64 = 0.05;
/// The same for directions that are combinations of the prescribed ones up to rounding.
const EXACT: f64 = 1e-9;

/// A direction of a particle that a condition has prescribed, or one of a rigid body: along the first components at its middle.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PrescribedDirection<const N: usize = 3> {
    /// The unit vector, padded by zeros.
    pub(super) direction: [f64; N],
    pub(super) label: String,
    target: f64,
    amplitude: Amplitude,
    /// The constraint equation that carries it.
    pub(crate) equation: usize,
}

impl<const N: usize> PrescribedDirection<N> {
    pub(crate) fn new(direction: [f64; N], label: &str, target: f64, amplitude: Amplitude) -> Self {
        PrescribedDirection { direction, label: label.to_string(), target, amplitude, equation: 0 }
    }
}

impl PrescribedDirection {
    /// $|n\cdot e|$ with a normal.
    pub(super) fn facing(&self, normal: &[f64]) -> f64 {
        dot(&self.direction, normal).abs()
    }
}

/// The direction as a combination of the prescribed ones, and what is left of it.
fn resolve<const N: usize>(prescriptions: &[PrescribedDirection<N>], direction: &[f64; N]) -> (Vec<f64>, f64) {
    // Gram–Schmidt over at most N vectors, with each basis vector as a combination of the prescribed ones.
    let mut basis: Vec<([f64; N], Vec<f64>)> = Vec::new();
    for (place, prescription) in prescriptions.iter().enumerate() {
        let (mut rest, mut made) = (prescription.direction, vec![0.0; prescriptions.len()]);
        made[place] = 1.0;
        for (vector, of) in &basis {
            let along = dot(vector, &prescription.direction);
            add(&mut rest, -along, vector);
            add(&mut made, -along, of);
        }
        let size = dot(&rest, &rest).sqrt();
        if size > EXACT {
            basis.push((rest.each(|r| r / size), made.mapped(|m| m / size)));
        }
    }
    let (mut rest, mut parts) = (*direction, vec![0.0; prescriptions.len()]);
    for (vector, of) in &basis {
        let along = dot(vector, direction);
        add(&mut rest, -along, vector);
        add(&mut parts, along, of);
    }
    (parts, dot(&rest, &rest).sqrt())
}

/// Whether a direction is a combination of prescribed ones, whatever the values.
pub(crate) fn repeats(prescriptions: &[PrescribedDirection], direction: &[f64; 3]) -> bool {
    !prescriptions.is_empty() && resolve(prescriptions, direction).1 <= REPEATED
}

/// Whether a condition repeats what is already prescribed on its particle.
///
/// # Errors
/// Where it prescribes another value: by more than the part of the values that the angle between the directions leaves open.
pub(crate) fn is_redundant(
    prescriptions: &[PrescribedDirection],
    requested: &PrescribedDirection,
    at: &[f64],
    rounding: f64,
) -> Result<bool, BoundaryError> {
    agrees(prescriptions, requested, at, rounding, REPEATED)
}

/// Whether what a condition prescribes follows from what is prescribed already, up to rounding.
///
/// # Errors
/// Where it prescribes another value.
pub(crate) fn follows<const N: usize>(
    prescriptions: &[PrescribedDirection<N>],
    requested: &PrescribedDirection<N>,
    at: &[f64],
    rounding: f64,
) -> Result<bool, BoundaryError> {
    agrees(prescriptions, requested, at, rounding, EXACT)
}

/// Whether a direction is a combination of those prescribed already up to a limit, with the same value.
fn agrees<const N: usize>(
    prescriptions: &[PrescribedDirection<N>],
    requested: &PrescribedDirection<N>,
    at: &[f64],
    rounding: f64,
    limit: f64,
) -> Result<bool, BoundaryError> {
    let (parts, rest) = resolve(prescriptions, &requested.direction);
    if rest > limit {
        return Ok(false);
    }
    let open = if rest > EXACT { rest } else { 0.0 };
    let size = |i: usize| requested.direction[i].abs();
    let component = (0..at.len()).max_by(|&i, &j| size(i).total_cmp(&size(j))).unwrap_or(0);
    let involved: Vec<(&PrescribedDirection<N>, f64)> =
        prescriptions.iter().zip(parts).filter(|(_, part)| part.abs() > EXACT).collect();
    let second = (requested.label.as_str(), requested.target, &requested.amplitude);
    match involved.as_slice() {
        [(prescription, part)] => {
            let first = (prescription.label.as_str(), part * prescription.target, &prescription.amplitude);
            check_agreement(first, second, (component, at), (rounding, open))?;
        }
        several => {
            let terms: Vec<(f64, Amplitude)> =
                several.mapped(|(prescription, part)| (part * prescription.target, prescription.amplitude.clone()));
            let label = several.mapped(|(prescription, _)| prescription.label.as_str()).join(" and ");
            let sum = move |load: f64| terms.summed(|(target, a)| target * a.value(load));
            check_agreement(
                (&label, 1.0, &Amplitude::Function(Arc::new(sum))),
                second,
                (component, at),
                (rounding, open),
            )?;
        }
    }
    Ok(true)
}

/// The component of the unknown that a constraint equation along a direction owns: its largest one that no earlier constraint equation of the particle has.
pub(crate) fn own_component(
    prescriptions: &[PrescribedDirection],
    direction: &[f64],
    owned: impl Fn(usize) -> usize,
) -> usize {
    let taken = |i: &usize| prescriptions.iter().any(|prescription| owned(prescription.equation) == *i);
    (0..direction.len())
        .filter(|i| !taken(i))
        .max_by(|&i, &j| direction[i].abs().total_cmp(&direction[j].abs()).then(j.cmp(&i)))
        .unwrap_or(0)
}

/// Refuses two conditions (label, target, amplitude) on one component that say different things at a point, with the
/// values at the full load, or at the first load found where they differ: by more than rounding and an open part of them.
fn check_agreement(
    first: (&str, f64, &Amplitude),
    second: (&str, f64, &Amplitude),
    (component, at): (usize, &[f64]),
    (rounding, open): (f64, f64),
) -> Result<(), BoundaryError> {
    let same = |[a, b]: [f64; 2]| (a - b).abs() <= rounding + (1e-12 + open) * a.abs().max(b.abs());
    let found = if first.2 == second.2 {
        Some((1.0, [first.1, second.1])).filter(|&(_, values)| !same(values))
    } else {
        // At some loads and at the break points of tables; those of functions can't be known.
        let break_points = first.2.break_points().into_iter().chain(second.2.break_points());
        let loads = [1.0, 0.0, 0.21, 0.47, 0.76].into_iter().chain(break_points);
        let both = |load: f64| (load, [first, second].each(|(_, g, a)| g * a.value(load)));
        loads.map(both).find(|&(_, values)| !same(values))
    };
    let Some((load, values)) = found else { return Ok(()) };
    for ((label, ..), value) in [first, second].into_iter().zip(values) {
        ensure!(value.is_finite(), BoundaryError::Value { what: label.to_string(), value, load });
    }
    let (first, second) = (first.0.to_string(), second.0.to_string());
    Err(BoundaryError::Conflict { first, second, component, at: at.to_vec(), values })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn prescription([x, y]: [f64; 2], target: f64) -> PrescribedDirection {
        PrescribedDirection::new([x, y, 0.0], "a plane", target, Amplitude::Ramp)
    }

    #[test]
    fn a_direction_between_two_claimed_ones_repeats_them() {
        let at = [0.0; 2];
        let prescriptions = [prescription([1.0, 0.0], 0.3), prescription([0.6, 0.8], 0.5)];
        // u = (0.3, 0.4): along the second axis 0.4.
        assert!(is_redundant(&prescriptions, &prescription([0.0, 1.0], 0.4), &at, 0.0).unwrap());
        assert!(is_redundant(&prescriptions, &prescription([0.0, 1.0], 0.41), &at, 0.0).is_err());
        assert!(is_redundant(&prescriptions[..1], &prescription([-1.0, 0.0], -0.3), &at, 0.0).unwrap());
        assert!(!is_redundant(&prescriptions[..1], &prescription([0.6, 0.8], 9.0), &at, 0.0).unwrap());
        assert!(!is_redundant(&[], &prescription([0.6, 0.8], 9.0), &at, 0.0).unwrap());
        // Nearly the same direction: merged where the value differs by no more than the angle leaves open.
        let slight = |target| prescription([0.9999, 0.0141], target);
        assert!(is_redundant(&prescriptions[..1], &slight(0.302), &at, 0.0).unwrap());
        for other in [0.0, 0.33] {
            assert!(is_redundant(&prescriptions[..1], &slight(other), &at, 0.0).is_err());
        }
    }
}
